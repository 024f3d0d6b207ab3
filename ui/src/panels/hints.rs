//! The callout over the canvas: hints for first use, and what is being waited for.

use egui::{Align2, Area, Id, Order, Pos2, Rect, Shape, Stroke, Ui, vec2};

use crate::action::{Action, Actions};
use crate::english::hint::DISMISS;
use crate::hints::{Callout, Hint, Side, due, followed};
use crate::preferences::{Change, Pane};
use crate::state::AppState;
use crate::theme;
use crate::widgets::{Icon, icon_button};
use crate::workspace::Workspace;

/// Distance from the edge of the canvas.
const INSET: f32 = 12.0;
/// Half the base, and the height, of the pointer to what is spoken of.
const POINTER: f32 = 7.0;

/// On a smaller canvas a callout would be in the way.
const LEAST_CANVAS: egui::Vec2 = vec2(320.0, 200.0);

/// The callout, and which hint it showed last.
#[derive(Debug, Default)]
pub struct Hints {
    shown: Option<(u64, Hint)>,
}

impl Hints {
    /// Draws the callout that is due over the upper edge of the canvas.
    pub fn show(
        &mut self,
        ui: &Ui,
        state: &AppState,
        workspace: &Workspace,
        canvas: Rect,
        actions: &mut Actions,
    ) {
        if let Some((scene, hint)) = self.shown {
            let same = scene == workspace.serial();
            let followed = followed(hint, state, workspace);
            if same && followed {
                actions.push(Action::Prefer(Change::HintSeen(hint)));
            }
            if !same || followed {
                self.shown = None;
            }
        }
        let Some(callout) = due(state, workspace) else {
            return;
        };
        // What is hidden cannot be pointed at.
        let window = ui.ctx().content_rect().size();
        let guidance = state.preferences.layout.shows(Pane::Guidance, window);
        let listed = guidance && state.side == crate::state::Side::LabelNext;
        let hidden = callout.side == Side::Right && !listed;
        let room = canvas.width() >= LEAST_CANVAS.x && canvas.height() >= LEAST_CANVAS.y;
        if state.dialog.is_none() && room && !hidden {
            if let Some(hint) = callout.hint {
                self.shown = Some((workspace.serial(), hint));
            }
            draw(ui, &callout, canvas, actions);
        }
    }

    /// Someone who goes through the suggestions need not be told of them.
    pub fn follow_suggestions(state: &AppState, actions: &mut Actions) {
        if !state.preferences.hints_seen.contains(&Hint::Suggestions) {
            actions.push(Action::Prefer(Change::HintSeen(Hint::Suggestions)));
        }
    }
}

fn draw(ui: &Ui, callout: &Callout, canvas: Rect, actions: &mut Actions) {
    let (pivot, corner) = match callout.side {
        Side::Here => (Align2::CENTER_TOP, canvas.center_top() + vec2(0.0, INSET)),
        Side::Right | Side::Above => (Align2::RIGHT_TOP, canvas.right_top() + vec2(-INSET, INSET)),
    };
    let shown = Area::new(Id::unique("callout"))
        .order(Order::Middle)
        .pivot(pivot)
        .fixed_pos(corner)
        .constrain_to(canvas)
        .show(ui.ctx(), |ui| {
            let frame = egui::Frame::popup(ui.style()).inner_margin(egui::Margin::symmetric(12, 6));
            let frame = frame.stroke(Stroke::new(1.0, theme::accent(ui.visuals())));
            frame.show(ui, |ui| {
                ui.set_max_width((canvas.width() - 64.0).clamp(80.0, 420.0));
                ui.horizontal(|ui| {
                    let button = if callout.hint.is_some() { 36.0 } else { 0.0 };
                    let room = ui.available_width() - button;
                    ui.scope(|ui| {
                        ui.set_max_width(room);
                        ui.add(egui::Label::new(&callout.text).wrap().selectable(false));
                    });
                    if let Some(hint) = callout.hint
                        && icon_button(ui, Icon::Close, DISMISS).clicked()
                    {
                        actions.push(Action::Prefer(Change::HintSeen(hint)));
                    }
                });
            });
        });
    let box_ = shown.response.rect;
    let tip = match callout.side {
        Side::Here => return,
        Side::Right => [
            box_.right_center() + vec2(0.0, -POINTER),
            box_.right_center() + vec2(POINTER, 0.0),
            box_.right_center() + vec2(0.0, POINTER),
        ],
        Side::Above => {
            let foot: Pos2 = box_.right_top() - vec2(24.0, 0.0);
            [
                foot + vec2(-POINTER, 0.0),
                foot - vec2(0.0, POINTER),
                foot + vec2(POINTER, 0.0),
            ]
        }
    };
    let color = theme::accent(ui.visuals());
    let painter = ui.ctx().layer_painter(shown.response.layer_id);
    painter.add(Shape::convex_polygon(tip.to_vec(), color, Stroke::NONE));
}
