//! The panels around the canvas, a file for each. A panel reads the state and pushes actions.

mod charted;
mod classes;
mod drop;
mod filmstrip;
mod frame_filter;
mod guidance_bar;
mod hints;
mod menu;
mod opening;
mod probe;
mod progress;
mod start;
mod stats;
mod status;
mod strokes;
mod suggestions;
mod tools;
mod work;

use egui::{Role, Ui, WidgetInfo};

pub use work::show as work;

pub(crate) use drop::drop_area;

use crate::action::{Action, Actions};
use crate::canvas::{Canvas, below_menus};
use crate::english;
use crate::keys;
use crate::preferences::{Change, Pane};
use crate::state::{AppState, Side, Stage};
use crate::theme;
use crate::thumbnails::Thumbnails;
use crate::view3d::View3d;
use crate::widgets::{Icon, icon_button};
use crate::workspace::Workspace;

/// All panels with what each remembers between frames.
pub struct Panels {
    start: start::StartPage,
    classes: classes::ClassPanel,
    strokes: strokes::StrokePanel,
    filmstrip: filmstrip::Filmstrip,
    suggestions: suggestions::SuggestionPanel,
    hints: hints::Hints,
    progress: progress::ProgressPanel,
    view3d: View3d,
}

impl Panels {
    /// Panels for this window.
    pub fn new(ctx: &egui::Context) -> Self {
        let frames = Thumbnails::new(ctx.clone(), [128, 96]);
        let places = Thumbnails::new(ctx.clone(), [480, 360]);
        Self {
            start: start::StartPage::default(),
            classes: classes::ClassPanel::default(),
            strokes: strokes::StrokePanel::default(),
            filmstrip: filmstrip::Filmstrip::new(frames),
            suggestions: suggestions::SuggestionPanel::new(places),
            hints: hints::Hints::default(),
            progress: progress::ProgressPanel::default(),
            view3d: View3d::new(ctx),
        }
    }

    /// Draws the whole window.
    pub fn show(&mut self, ui: &mut Ui, state: &AppState, canvas: &mut Canvas, actions: &mut Actions) {
        egui::Panel::top("menu")
            .frame(panel_frame(ui, 8, 4))
            .show(ui, |ui| menu::show(ui, state, actions));
        if !matches!(state.stage, Stage::Open(_)) {
            self.view3d.forget();
        }
        match &state.stage {
            Stage::Start => {
                egui::CentralPanel::default().show(ui, |ui| self.start.show(ui, state, actions));
            }
            Stage::Opening(opening) => {
                egui::CentralPanel::default().show(ui, |ui| opening::show(ui, opening, actions));
            }
            Stage::Open(workspace) => self.show_workspace(ui, state, workspace, canvas, actions),
        }
    }

    fn show_workspace(
        &mut self,
        ui: &mut Ui,
        state: &AppState,
        workspace: &Workspace,
        canvas: &mut Canvas,
        actions: &mut Actions,
    ) {
        let shown = |pane| {
            state
                .preferences
                .layout
                .shows(pane, ui.ctx().content_rect().size())
        };
        let before = Pane::ALL.map(shown);
        let [mut classes, mut guidance, mut frames, training, strokes] = before;
        egui::Panel::left("classes")
            .frame(panel_frame(ui, 0, 0))
            .default_size(232.0)
            .size_range(184.0..=360.0)
            .show_collapsible(ui, &mut classes, |ui| {
                self.strokes.show_below(ui, workspace, strokes, actions);
                egui::CentralPanel::default()
                    .frame(panel_frame(ui, 12, 12))
                    .show(ui, |ui| self.classes.show(ui, workspace, actions));
            });
        egui::Panel::right("guidance")
            .frame(panel_frame(ui, 0, 0))
            .default_size(280.0)
            .size_range(240.0..=400.0)
            .show_collapsible(ui, &mut guidance, |ui| {
                // Each remembers its own height.
                let (id, margin) = if training {
                    ("status", 12)
                } else {
                    ("status folded", 6)
                };
                egui::Panel::bottom(id)
                    .frame(panel_frame(ui, 12, margin))
                    .resizable(false)
                    .show(ui, |ui| status::show(ui, workspace, training, actions));
                egui::Panel::top("sides")
                    .frame(panel_frame(ui, 12, 8))
                    .resizable(false)
                    .show(ui, |ui| sides(ui, state, actions));
                egui::CentralPanel::default()
                    .frame(panel_frame(ui, 12, 12))
                    .show(ui, |ui| match state.side {
                        Side::LabelNext => self.suggestions.show(ui, workspace, actions),
                        Side::Progress => self.progress.show(ui, workspace, actions),
                    });
            });
        egui::Panel::bottom("filmstrip")
            .frame(panel_frame(ui, 12, 8))
            .resizable(false)
            .exact_size(filmstrip::HEIGHT)
            .show_collapsible(ui, &mut frames, |ui| {
                self.filmstrip.show(ui, state, workspace, actions);
            });
        egui::Panel::top("tools")
            .frame(panel_frame(ui, 12, 4))
            .resizable(false)
            .show(ui, |ui| {
                // Where there is little room, the tools scroll.
                egui::ScrollArea::horizontal().show(ui, |ui| {
                    ui.set_min_width(tools::LEAST_WIDTH);
                    tools::show(ui, state, workspace, actions);
                });
            });
        // A panel that was dragged shut stays so.
        for (index, shown) in [classes, guidance, frames, training, strokes]
            .into_iter()
            .enumerate()
        {
            if shown != before[index] {
                actions.push(Action::Prefer(Change::Pane(Pane::ALL[index], Some(shown))));
            }
        }
        egui::CentralPanel::no_frame().show(ui, |ui| {
            let over;
            if workspace.space.shown {
                let rect = self.view3d.show(ui, state, workspace, canvas.target(), actions);
                canvas.stand_aside(rect);
                over = canvas.rect();
            } else {
                self.view3d.rest();
                let room = ui.available_rect_before_wrap();
                let (image, strip) = room.split_top_bottom_at_y(room.bottom() - probe::HEIGHT);
                let within = |rect| egui::UiBuilder::new().max_rect(rect);
                ui.scope_builder(within(image), |ui| canvas.show(ui, state, workspace, actions));
                ui.scope_builder(within(strip), |ui| {
                    probe::show(ui, workspace, canvas.pointed_at());
                });
                over = below_menus(canvas.rect(), &state.settings);
                if workspace.guidance().is_active() {
                    hints::Hints::follow_suggestions(state, actions);
                } else {
                    self.hints.show(ui, state, workspace, over, actions);
                }
            }
            guidance_bar::show(ui, workspace, over);
            stats::show(ui.ctx(), state, canvas.rect());
        });
    }
}

/// The tabs of the right side.
fn sides(ui: &mut Ui, state: &AppState, actions: &mut Actions) {
    ui.columns(2, |columns| {
        for (ui, (side, name)) in columns.iter_mut().zip([
            (Side::LabelNext, english::progress::LABEL_NEXT),
            (Side::Progress, english::progress::PROGRESS),
        ]) {
            let chosen = state.side == side;
            ui.vertical_centered_justified(|ui| {
                let tab = ui.selectable_label(chosen, name);
                tab.widget_info(|| WidgetInfo::selected(Role::Tab, true, chosen, name));
                if tab
                    .on_hover_text(keys::named(ui.ctx(), english::progress::SWITCH))
                    .clicked()
                {
                    actions.push(Action::ShowSide(side));
                }
            });
        }
    });
}

fn panel_frame(ui: &Ui, horizontal: i8, vertical: i8) -> egui::Frame {
    egui::Frame::new()
        .fill(ui.visuals().panel_fill)
        .inner_margin(egui::Margin::symmetric(horizontal, vertical))
}

/// Folds a panel that is shown in full to its first line, or unfolds it; `name` says which.
fn fold_button(ui: &mut Ui, pane: Pane, full: bool, name: &str, actions: &mut Actions) {
    let icon = if full { Icon::Down } else { Icon::Up };
    if icon_button(ui, icon, name).clicked() {
        let usual = pane.fits(ui.ctx().content_rect().size()) != full;
        actions.push(Action::Prefer(Change::Pane(pane, (!usual).then_some(!full))));
    }
}

/// A card on a panel.
fn card(ui: &Ui) -> egui::Frame {
    egui::Frame::new()
        .fill(theme::raised(ui.visuals()))
        .stroke(egui::Stroke::new(1.0, theme::line(ui.visuals())))
        .corner_radius(6)
        .inner_margin(8)
}
