//! The panels around the canvas, a file for each. A panel reads the model and pushes commands.

mod audit;
mod charted;
mod classes;
mod comparison;
mod drop;
mod filmstrip;
mod frame_filter;
mod hints;
mod menu;
mod messages;
mod parts;
mod probe;
mod progress;
mod readiness;
mod start;
mod status;
mod strokes;
mod suggestion_bar;
mod suggestions;
mod tools;
mod work;

use egui::{Role, Ui, WidgetInfo};
use inplace_model::model::{Side, Stage};
use inplace_model::preferences::{Pane, PreferenceChange};
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands, Model};

pub use drop::drop_area;
pub use menu::window_title;
pub use messages::show as messages;
pub use work::show as work;

use crate::canvas::{Canvas, below_menus};
use crate::input_order::InputOrder;
use crate::keys::table::OTHER_SIDE;
use crate::pictures::Pictures;
use crate::thumbnails::Thumbnails;
use crate::view3d::View3d;
use parts::panel_frame;

/// All panels with what each remembers between frames.
#[derive(Default)]
pub struct Panels {
    start: start::StartPage,
    scene: Option<ScenePanels>,
    /// What is known about what was opened lately, once it was looked at.
    pub pictures: Pictures,
}

/// The panels of an open scene, which know nothing of another one.
struct ScenePanels {
    /// Serial number of the scene.
    serial: u64,
    classes: classes::ClassPanel,
    strokes: strokes::StrokePanel,
    filmstrip: filmstrip::Filmstrip,
    suggestions: suggestions::SuggestionPanel,
    hints: hints::Hints,
    progress: progress::ProgressPanel,
    view3d: View3d,
}

impl Panels {
    /// Draws the whole window.
    pub fn show(&mut self, ui: &mut Ui, model: &Model, canvas: &mut Canvas, commands: &mut Commands) {
        egui::Panel::top("menu")
            .frame(panel_frame(8, 4))
            .show(ui, |ui| menu::show(ui, model, &self.pictures, commands));
        if !matches!(model.stage, Stage::Open(_)) {
            self.scene = None;
            InputOrder::set_canvas(ui.ctx(), None, &[]);
        }
        match &model.stage {
            Stage::Start => {
                egui::CentralPanel::default()
                    .show(ui, |ui| self.start.show(ui, model, &self.pictures, commands));
            }
            Stage::Opening(opening) => {
                egui::CentralPanel::default().show(ui, |ui| work::opening(ui, opening, commands));
            }
            Stage::Open(workspace) => {
                let new = || ScenePanels::new(ui.ctx(), workspace.serial);
                let panels = self.scene.get_or_insert_with(new);
                if panels.serial != workspace.serial {
                    *panels = new();
                }
                panels.show(ui, model, workspace, canvas, commands);
            }
        }
    }
}

impl ScenePanels {
    fn new(ctx: &egui::Context, serial: u64) -> Self {
        let frames = Thumbnails::new(ctx.clone(), [128.0, 96.0]);
        Self {
            serial,
            classes: classes::ClassPanel::default(),
            strokes: strokes::StrokePanel::default(),
            filmstrip: filmstrip::Filmstrip::new(frames),
            suggestions: suggestions::SuggestionPanel::new(ctx),
            hints: hints::Hints::default(),
            progress: progress::ProgressPanel::default(),
            view3d: View3d::new(ctx),
        }
    }

    fn show(
        &mut self,
        ui: &mut Ui,
        model: &Model,
        workspace: &Workspace,
        canvas: &mut Canvas,
        commands: &mut Commands,
    ) {
        let window = ui.ctx().content_rect().size();
        let shown = |pane| model.preferences.layout.shows(pane, window);
        self.hints.update(model, workspace, commands);
        let before = Pane::ALL.map(shown);
        let [mut classes, mut side, mut frames, training, strokes] = before;
        egui::Panel::left("classes")
            .frame(panel_frame(0, 0))
            .default_size(232.0)
            .size_range(184.0..=360.0)
            .show_collapsible(ui, &mut classes, |ui| {
                self.strokes.show_below(ui, workspace, strokes, commands);
                egui::CentralPanel::default()
                    .frame(panel_frame(12, 12))
                    .show(ui, |ui| self.classes.show(ui, workspace, commands));
            });
        egui::Panel::right("side")
            .frame(panel_frame(0, 0))
            .default_size(280.0)
            .size_range(240.0..=400.0)
            .show_collapsible(ui, &mut side, |ui| {
                // Each remembers its own height.
                let (id, margin) = if training {
                    ("status", 12)
                } else {
                    ("status folded", 6)
                };
                egui::Panel::bottom(id)
                    .frame(panel_frame(12, margin))
                    .resizable(false)
                    .show(ui, |ui| status::show(ui, workspace, training, commands));
                egui::Panel::top("sides")
                    .frame(panel_frame(12, 8))
                    .resizable(false)
                    .show(ui, |ui| sides(ui, model, commands));
                egui::CentralPanel::default()
                    .frame(panel_frame(12, 12))
                    .show(ui, |ui| {
                        self.hints.in_panel(ui, model, workspace, commands);
                        match model.side {
                            Side::LabelNext => self.suggestions.show(ui, workspace, commands),
                            Side::Progress => self.progress.show(ui, workspace, commands),
                        }
                    });
            });
        // Nobody's hand is on a list that is not shown.
        if workspace.suggestions().held && !(side && model.side == Side::LabelNext) {
            commands.push(Command::HoldSuggestions(false));
        }
        egui::Panel::bottom("filmstrip")
            .frame(panel_frame(12, 8))
            .resizable(false)
            .exact_size(filmstrip::HEIGHT)
            .show_collapsible(ui, &mut frames, |ui| {
                self.filmstrip.show(ui, model, workspace, commands);
            });
        egui::Panel::top("tools")
            .frame(panel_frame(12, 4))
            .resizable(false)
            .show(ui, |ui| {
                // Where there is little room, the tools scroll.
                egui::ScrollArea::horizontal().show(ui, |ui| {
                    tools::show(ui, model, workspace, commands);
                });
            });
        // A panel that was dragged shut stays so.
        for (index, shown) in [classes, side, frames, training, strokes].into_iter().enumerate() {
            if shown != before[index] {
                let change = PreferenceChange::Pane(Pane::ALL[index], Some(shown));
                commands.push(Command::Prefer(change));
            }
        }
        egui::CentralPanel::no_frame().show(ui, |ui| {
            let over;
            if workspace.space.shown {
                let rect = self.view3d.show(ui, model, workspace, canvas, commands);
                canvas.stand_aside(ui.ctx(), workspace, rect);
                over = canvas.rect;
            } else {
                self.view3d.rest(workspace, commands);
                let room = ui.available_rect_before_wrap();
                let (image, strip) = room.split_top_bottom_at_y(room.bottom() - probe::HEIGHT);
                let within = |rect| egui::UiBuilder::new().max_rect(rect);
                ui.scope_builder(within(image), |ui| canvas.show(ui, model, workspace, commands));
                ui.scope_builder(within(strip), |ui| {
                    probe::show(ui, workspace, canvas.frame(), canvas.pointed_at);
                });
                over = below_menus(canvas.rect, &model.settings);
                self.hints.over_canvas(ui, model, workspace, over, commands);
            }
            suggestion_bar::show(ui, workspace, over);
        });
    }
}

/// The tabs of the right side.
fn sides(ui: &mut Ui, model: &Model, commands: &mut Commands) {
    ui.columns(2, |columns| {
        for (ui, (side, name)) in columns
            .iter_mut()
            .zip([(Side::LabelNext, "Label next"), (Side::Progress, "Progress")])
        {
            let chosen = model.side == side;
            ui.vertical_centered_justified(|ui| {
                let tab = ui.selectable_label(chosen, name);
                tab.widget_info(|| WidgetInfo::selected(Role::Tab, true, chosen, name));
                if tab.on_hover_text(OTHER_SIDE.named(ui.ctx())).clicked() {
                    commands.push(Command::ShowSide(side));
                }
            });
        }
    });
}
