//! Short messages at the bottom of the canvas: the one place where errors are shown.

use std::time::{Duration, Instant};

use crate::action::{Action, Actions};
use crate::theme;
use crate::widgets::{Icon, icon_button};

/// How serious a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Something worth knowing.
    Info,
    /// Something failed.
    Error,
}

/// A message.
#[derive(Clone, Debug)]
pub struct Toast {
    id: u64,
    level: Level,
    text: String,
    until: Option<Instant>,
}

/// The messages shown, oldest first.
#[derive(Debug, Default)]
pub struct Toasts {
    shown: Vec<Toast>,
    last: u64,
}

/// How many messages are shown at once.
const MOST: usize = 4;

impl Toasts {
    /// Shows something worth knowing for a while.
    pub fn info(&mut self, text: impl Into<String>) {
        self.add(Level::Info, text.into(), Some(Duration::from_secs(8)));
    }

    /// Shows what failed until it is dismissed.
    pub fn error(&mut self, text: impl Into<String>) {
        self.add(Level::Error, text.into(), None);
    }

    /// Removes a message.
    pub fn dismiss(&mut self, id: u64) {
        self.shown.retain(|toast| toast.id != id);
    }

    /// The texts shown, oldest first.
    pub fn texts(&self) -> impl Iterator<Item = &str> {
        self.shown.iter().map(|toast| toast.text.as_str())
    }

    /// Removes messages whose time is over; wakes the window when the next one is due.
    pub fn expire(&mut self, ctx: &egui::Context) {
        let now = Instant::now();
        self.shown
            .retain(|toast| toast.until.is_none_or(|until| until > now));
        if let Some(next) = self.shown.iter().filter_map(|toast| toast.until).min() {
            ctx.request_repaint_after(next - now);
        }
    }

    fn add(&mut self, level: Level, text: String, lasting: Option<Duration>) {
        self.shown.retain(|toast| toast.text != text);
        self.last += 1;
        self.shown.push(Toast {
            id: self.last,
            level,
            text,
            until: lasting.map(|lasting| Instant::now() + lasting),
        });
        let surplus = self.shown.len().saturating_sub(MOST);
        self.shown.drain(..surplus);
    }

    /// Draws the messages over the lower part of `area`.
    pub fn show(&self, ctx: &egui::Context, area: egui::Rect, actions: &mut Actions) {
        let bottom = area.center_bottom() - egui::vec2(0.0, theme::GAP * 2.0);
        egui::Area::new(egui::Id::unique("messages"))
            .order(egui::Order::Foreground)
            .pivot(egui::Align2::CENTER_BOTTOM)
            .fixed_pos(bottom)
            .show(ctx, |ui| {
                ui.set_max_width((area.width() - 64.0).clamp(240.0, 560.0));
                for toast in &self.shown {
                    toast.show(ui, actions);
                }
            });
    }
}

impl Toast {
    fn show(&self, ui: &mut egui::Ui, actions: &mut Actions) {
        let visuals = ui.visuals();
        let (mark, name) = match self.level {
            Level::Info => (theme::accent(visuals), "Message"),
            Level::Error => (visuals.error_fg_color, "Error"),
        };
        egui::Frame::popup(ui.style()).inner_margin(12).show(ui, |ui| {
            ui.horizontal_top(|ui| {
                let (dot, response) = ui.allocate_exact_size(egui::vec2(8.0, 18.0), egui::Sense::hover());
                response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, name));
                ui.painter().circle_filled(dot.center(), 4.0, mark);
                let room = ui.available_width() - 36.0;
                ui.scope(|ui| {
                    ui.set_max_width(room);
                    ui.add(egui::Label::new(&self.text).wrap().selectable(true));
                });
                if icon_button(ui, Icon::Close, "Dismiss message").clicked() {
                    actions.push(Action::Dismiss(self.id));
                }
            });
        });
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_same_message_is_shown_once_and_old_ones_make_room() {
        let mut toasts = Toasts::default();
        for text in ["a", "b", "a", "c", "d", "e"] {
            toasts.error(text);
        }
        assert_eq!(toasts.texts().collect::<Vec<_>>(), ["a", "c", "d", "e"]);
    }
}
