//! Short messages at the bottom of the canvas: the one place where errors are shown.

use std::time::{Duration, Instant};

use egui::accesskit::Live;

use crate::action::{Action, Actions};
use crate::english::toasts as words;
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

    /// Draws the messages over the lower part of `area`; Escape dismisses the newest, unless it has
    /// something else to do.
    pub fn show(&self, ctx: &egui::Context, area: egui::Rect, escape: bool, actions: &mut Actions) {
        let Some(newest) = self.shown.last() else {
            return;
        };
        if escape && ctx.input(|input| input.key_pressed(egui::Key::Escape)) {
            actions.push(Action::Dismiss(newest.id));
        }
        let bottom = area.center_bottom() - egui::vec2(0.0, theme::GAP * 2.0);
        egui::Area::new(egui::Id::unique("messages"))
            .order(egui::Order::Foreground)
            .pivot(egui::Align2::CENTER_BOTTOM)
            .fixed_pos(bottom)
            .show(ctx, |ui| {
                let width = (area.width() - 32.0).clamp(160.0, 560.0);
                ui.set_max_width(width);
                // What is too long for the area scrolls: it must not cover the tools above.
                egui::ScrollArea::vertical()
                    .max_height((area.height() - 4.0 * theme::GAP).max(48.0))
                    .stick_to_bottom(true)
                    .auto_shrink(true)
                    .show(ui, |ui| {
                        for toast in &self.shown {
                            toast.show(ui, width, actions);
                        }
                    });
            });
    }
}

impl Toast {
    fn show(&self, ui: &mut egui::Ui, width: f32, actions: &mut Actions) {
        let visuals = ui.visuals();
        let (icon, color, name, live) = match self.level {
            Level::Info => (Icon::Info, theme::accent(visuals), words::INFO, Live::Polite),
            Level::Error => (
                Icon::Warning,
                visuals.error_fg_color,
                words::ERROR,
                Live::Assertive,
            ),
        };
        let mut frame = egui::Frame::popup(ui.style()).inner_margin(12);
        if self.level == Level::Error {
            frame = frame.stroke(egui::Stroke::new(1.0, color));
        }
        frame.show(ui, |ui| {
            ui.horizontal(|ui| {
                let (rect, response) = ui.allocate_exact_size(egui::vec2(18.0, 18.0), egui::Sense::hover());
                response.widget_info(|| egui::WidgetInfo::labeled(egui::Role::Image, true, name));
                icon.paint(ui.painter(), rect, color);
                // The icon, the button and the frame around them.
                let room = (width - 104.0).max(64.0);
                ui.scope(|ui| {
                    ui.set_max_width(room);
                    let text = ui.add(egui::Label::new(&self.text).wrap().selectable(true));
                    ui.ctx()
                        .accesskit_node_builder(text.id, |node| node.set_live(live));
                });
                if icon_button(ui, Icon::Close, words::DISMISS).clicked() {
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
