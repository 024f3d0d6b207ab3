//! Hints for first use: over the canvas for what is done there, in the panel at the right for what is listed there or
//! lies above it. Over the canvas also what is being waited for.

use egui::{Align2, Area, Id, Order, Rect, Stroke, Ui, vec2};
use inplace_model::hints::{Hint, waits_for_surface};
use inplace_model::model::Side;
use inplace_model::preferences::PreferenceChange;
use inplace_model::workspace::{Reading, Workspace};
use inplace_model::{Command, Commands, Model};

use super::parts::card;
use crate::keys::table::{EXPORT, NEXT_SUGGESTION};
use crate::theme;
use crate::widgets::{Icon, icon_button};

/// Distance from the edge of the canvas.
const INSET: f32 = 12.0;
/// On a smaller canvas a callout would be in the way.
const LEAST_CANVAS: egui::Vec2 = vec2(320.0, 200.0);

/// Which hint was shown last.
#[derive(Debug, Default)]
pub struct Hints {
    shown: Option<Hint>,
}

impl Hints {
    /// Remembers a hint that was shown and then followed; whoever goes through the suggestions need not be told of them.
    pub fn update(&mut self, model: &Model, workspace: &Workspace, commands: &mut Commands) {
        let mut seen = |hint| commands.push(Command::Prefer(PreferenceChange::HintSeen(hint)));
        if let Some(followed) = self.shown.take_if(|hint| !hint.applies(model, workspace)) {
            seen(followed);
        }
        let told = model.preferences.hints_seen.contains(&Hint::Suggestions);
        if workspace.suggestions().is_active() && !told {
            seen(Hint::Suggestions);
        }
    }

    /// Draws what is due at the top of the panel at the right.
    pub fn in_panel(&mut self, ui: &mut Ui, model: &Model, workspace: &Workspace, commands: &mut Commands) {
        let listed = |hint: &Hint| *hint != Hint::Suggestions || model.side == Side::LabelNext;
        let hint = Hint::due(model, workspace).filter(|hint| !is_of_canvas(hint) && listed(hint));
        let Some(hint) = hint.filter(|_| !workspace.suggestions().is_active()) else {
            return;
        };
        self.shown = Some(hint);
        let accent = Stroke::new(1.0, theme::of(ui.visuals()).accent);
        card(ui).stroke(accent).show(ui, |ui| {
            ui.set_width(ui.available_width());
            said(ui, &text_of(ui.ctx(), hint), Some(hint), commands);
        });
        ui.add_space(theme::GAP);
    }

    /// Draws what is due over the upper edge of the canvas.
    pub fn over_canvas(
        &mut self,
        ui: &Ui,
        model: &Model,
        workspace: &Workspace,
        canvas: Rect,
        commands: &mut Commands,
    ) {
        let hint = Hint::due(model, workspace).filter(is_of_canvas);
        let text = match hint {
            _ if workspace.suggestions().is_active() => return,
            Some(hint) => text_of(ui.ctx(), hint),
            None if waits_for_surface(workspace) => awaited(workspace).to_owned(),
            None => return,
        };
        let room = canvas.width() >= LEAST_CANVAS.x && canvas.height() >= LEAST_CANVAS.y;
        if model.dialog.is_some() || !room {
            return;
        }
        self.shown = hint.or(self.shown);
        Area::new(Id::unique("callout"))
            .order(Order::Middle)
            .pivot(Align2::CENTER_TOP)
            .fixed_pos(canvas.center_top() + vec2(0.0, INSET))
            .constrain_to(canvas)
            // What cannot be dismissed takes no clicks from the image.
            .interactable(hint.is_some())
            .show(ui.ctx(), |ui| {
                let frame = egui::Frame::popup(ui.style()).inner_margin(egui::Margin::symmetric(12, 6));
                let frame = frame.stroke(Stroke::new(1.0, theme::of(ui.visuals()).accent));
                frame.show(ui, |ui| {
                    ui.set_max_width((canvas.width() - 64.0).clamp(80.0, 420.0));
                    said(ui, &text, hint, commands);
                });
            });
    }
}

/// Whether a hint speaks of what is done on the canvas.
fn is_of_canvas(hint: &Hint) -> bool {
    matches!(hint, Hint::FirstClass | Hint::FirstStroke)
}

/// A text, and beside it what dismisses the hint.
fn said(ui: &mut Ui, text: &str, hint: Option<Hint>, commands: &mut Commands) {
    ui.horizontal(|ui| {
        let button = if hint.is_some() { 36.0 } else { 0.0 };
        let room = ui.available_width() - button;
        ui.scope(|ui| {
            ui.set_max_width(room);
            ui.add(egui::Label::new(text).wrap().selectable(false));
        });
        if let Some(hint) = hint
            && icon_button(ui, Icon::Close, "Dismiss hint").clicked()
        {
            commands.push(Command::Prefer(PreferenceChange::HintSeen(hint)));
        }
    });
}

fn text_of(ctx: &egui::Context, hint: Hint) -> String {
    // A key may have been taken away from what it did.
    let next = NEXT_SUGGESTION.key(ctx);
    match hint {
        Hint::FirstClass => {
            let click = "Click on something in the image and name its class";
            match next.as_str() {
                "" => click.to_owned(),
                key => format!("{click}, or press {key} to be shown a place"),
            }
        }
        Hint::FirstStroke => "No strokes yet: choose a class, then click or scribble on the image".to_owned(),
        Hint::Suggestions => {
            let these = "These are the places whose label would settle most: click on one";
            match next.as_str() {
                "" => format!("{these} to go there"),
                key => format!("{these}, or press {key}"),
            }
        }
        Hint::Export => {
            let export = EXPORT.named_as(ctx, "Export");
            format!("When the frames look right: {export} writes the labels of every frame")
        }
    }
}

/// What labels wait for.
fn awaited(workspace: &Workspace) -> &'static str {
    match workspace.reading {
        Some(Reading::Depth(_)) => {
            "Estimating the depth of the scene; your labels spread as soon as it is known"
        }
        Some(Reading::Frames(..)) => {
            "Reading the frames; your labels spread as soon as all of them are there"
        }
        None => "Finding the surface of the scene; your labels spread as soon as it is there",
    }
}
