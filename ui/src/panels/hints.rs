//! The callout over the canvas: hints for first use, and what is being waited for.

use egui::{Align2, Area, Id, Order, Pos2, Rect, Shape, Stroke, Ui, vec2};
use inplace_model::hints::Hint;
use inplace_model::hints::waits_for_surface;
use inplace_model::model::Side;
use inplace_model::preferences::{Pane, PreferenceChange};
use inplace_model::workspace::{Reading, Workspace};
use inplace_model::{Command, Commands, Model};

use crate::keys::table::{EXPORT, NEXT_SUGGESTION};
use crate::theme;
use crate::widgets::{Icon, icon_button};

/// Distance from the edge of the canvas.
const INSET: f32 = 12.0;
/// Half the base, and the height, of the pointer to what is spoken of.
const POINTER: f32 = 7.0;

/// On a smaller canvas a callout would be in the way.
const LEAST_CANVAS: egui::Vec2 = vec2(320.0, 200.0);

/// Which part of the window a hint speaks of, as seen from the canvas.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Beside {
    /// The canvas itself.
    Here,
    /// The panel at the right.
    Right,
    /// The buttons above.
    Above,
}

/// What is said over the canvas.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Callout {
    /// The hint, remembered once it is dismissed or followed; `None` = what is going on, said every time.
    hint: Option<Hint>,
    text: String,
    /// What it speaks of.
    beside: Beside,
}

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
        model: &Model,
        workspace: &Workspace,
        canvas: Rect,
        commands: &mut Commands,
    ) {
        if let Some((scene, hint)) = self.shown {
            let same = scene == workspace.serial;
            let followed = !hint.applies(model, workspace);
            if same && followed {
                commands.push(Command::Prefer(PreferenceChange::HintSeen(hint)));
            }
            if !same || followed {
                self.shown = None;
            }
        }
        let Some(callout) = due(ui.ctx(), model, workspace) else {
            return;
        };
        // What is hidden cannot be pointed at.
        let window = ui.ctx().content_rect().size();
        let right = model.preferences.layout.shows(Pane::Suggestions, window);
        let listed = right && model.side == Side::LabelNext;
        let hidden = callout.beside == Beside::Right && !listed;
        let room = canvas.width() >= LEAST_CANVAS.x && canvas.height() >= LEAST_CANVAS.y;
        if model.dialog.is_none() && room && !hidden {
            if let Some(hint) = callout.hint {
                self.shown = Some((workspace.serial, hint));
            }
            draw(ui, &callout, canvas, commands);
        }
    }

    /// Someone who goes through the suggestions need not be told of them.
    pub fn follow_suggestions(model: &Model, commands: &mut Commands) {
        if !model.preferences.hints_seen.contains(&Hint::Suggestions) {
            commands.push(Command::Prefer(PreferenceChange::HintSeen(Hint::Suggestions)));
        }
    }
}

/// What to say now: the first hint that is due, or what is being waited for.
fn due(ctx: &egui::Context, model: &Model, workspace: &Workspace) -> Option<Callout> {
    if let Some(hint) = Hint::due(model, workspace) {
        // A key may have been taken away from what it did.
        let next = NEXT_SUGGESTION.key(ctx);
        let (text, beside) = match hint {
            Hint::FirstClass => {
                let click = "Click on something in the image and name its class";
                let text = match next.as_str() {
                    "" => click.to_owned(),
                    key => format!("{click}, or press {key} to be shown a place"),
                };
                (text, Beside::Here)
            }
            Hint::FirstStroke => (
                "No strokes yet: choose a class, then click or scribble on the image".to_owned(),
                Beside::Here,
            ),
            Hint::Suggestions => {
                let these = "These are the places whose label would settle most: click on one";
                let text = match next.as_str() {
                    "" => format!("{these} to go there"),
                    key => format!("{these}, or press {key}"),
                };
                (text, Beside::Right)
            }
            Hint::Export => {
                let export = EXPORT.named_as(ctx, "Export");
                let text = format!("When the frames look right: {export} writes the labels of every frame");
                (text, Beside::Above)
            }
        };
        return Some(Callout {
            hint: Some(hint),
            text,
            beside,
        });
    }
    waits_for_surface(workspace).then(|| Callout {
        hint: None,
        text: match workspace.reading {
            Some(Reading::Depth(_)) => {
                "Estimating the depth of the scene; your labels spread as soon as it is known"
            }
            Some(Reading::Frames(..)) => {
                "Reading the frames; your labels spread as soon as all of them are there"
            }
            None => "Finding the surface of the scene; your labels spread as soon as it is there",
        }
        .to_owned(),
        beside: Beside::Here,
    })
}

fn draw(ui: &Ui, callout: &Callout, canvas: Rect, commands: &mut Commands) {
    let (pivot, corner) = match callout.beside {
        Beside::Here => (Align2::CENTER_TOP, canvas.center_top() + vec2(0.0, INSET)),
        Beside::Right | Beside::Above => (Align2::RIGHT_TOP, canvas.right_top() + vec2(-INSET, INSET)),
    };
    let shown = Area::new(Id::unique("callout"))
        .order(Order::Middle)
        .pivot(pivot)
        .fixed_pos(corner)
        .constrain_to(canvas)
        .show(ui.ctx(), |ui| {
            let frame = egui::Frame::popup(ui.style()).inner_margin(egui::Margin::symmetric(12, 6));
            let frame = frame.stroke(Stroke::new(1.0, theme::of(ui.visuals()).accent));
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
                        && icon_button(ui, Icon::Close, "Dismiss hint").clicked()
                    {
                        commands.push(Command::Prefer(PreferenceChange::HintSeen(hint)));
                    }
                });
            });
        });
    let box_ = shown.response.rect;
    let tip = match callout.beside {
        Beside::Here => return,
        Beside::Right => [
            box_.right_center() + vec2(0.0, -POINTER),
            box_.right_center() + vec2(POINTER, 0.0),
            box_.right_center() + vec2(0.0, POINTER),
        ],
        Beside::Above => {
            let foot: Pos2 = box_.right_top() - vec2(24.0, 0.0);
            [
                foot + vec2(-POINTER, 0.0),
                foot - vec2(0.0, POINTER),
                foot + vec2(POINTER, 0.0),
            ]
        }
    };
    let color = theme::of(ui.visuals()).accent;
    let painter = ui.ctx().layer_painter(shown.response.layer_id);
    painter.add(Shape::convex_polygon(tip.to_vec(), color, Stroke::NONE));
}
