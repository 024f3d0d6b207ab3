//! The start page: nothing is open.

use egui::{
    Align, Color32, FontId, Key, Layout, Rect, RichText, Role, ScrollArea, Sense, Stroke, StrokeKind, Ui,
    WidgetInfo, pos2, vec2,
};
use inplace_core::scene::SceneSource;
use inplace_model::dialogs::{Purpose, typed_path};
use inplace_model::opening::Target;
use inplace_model::preferences::{PreferenceChange, Recent, now};
use inplace_model::text::{PROGRAM, counted};
use inplace_model::{Command, Commands, Model};

use super::parts::{card, not_found};
use crate::keys::table::{HELP, OPEN, SETTINGS, UiCommand};
use crate::pictures::Pictures;
use crate::theme;
use crate::widgets::{Icon, focus_ring, icon_button, line_of_text, main_button_enabled, weak_text};

/// That things can be dropped.
const DROP: &str = "Drop a folder or a project file anywhere on this window";
/// Formats by name, and what to look for.
const FORMAT_LIST: [(&str, &str); 5] = [
    (
        "Replica, Semantic-NeRF",
        "rgb/, traj_w_c.txt, and depth/ where there is depth",
    ),
    ("COLMAP", "images/ and sparse/"),
    (
        "7-Scenes, TUM RGB-D, ScanNet",
        "frame-000000.color.png, rgb.txt, or color/ and pose/",
    ),
    (
        "nerfstudio, instant-ngp",
        "transforms.json and the images it lists",
    ),
    ("Inplace project", "a file .inplace that was saved here"),
];
/// What to do in the first minutes.
const STEPS: [(&str, &str); 3] = [
    ("Open a scene", "The demo is a small room that needs no files."),
    (
        "Click on things",
        "Click on something and name its class. All frames follow.",
    ),
    (
        "Go where it is unclear",
        "The list on the right shows what to label next; then export.",
    ),
];

/// Widest the page gets, and from which width on it has two columns.
const WIDEST: f32 = 1000.0;
const TWO_COLUMNS: f32 = 800.0;
/// Between the columns.
const GUTTER: f32 = 24.0;
/// A picture of something opened lately.
const PICTURE: egui::Vec2 = vec2(80.0, 60.0);

/// The start page with the path typed so far, and how high it was last.
#[derive(Debug, Default)]
pub struct StartPage {
    path: String,
    height: f32,
}

impl StartPage {
    /// Draws the page in the middle of the window.
    pub fn show(&mut self, ui: &mut Ui, model: &Model, pictures: &Pictures, commands: &mut Commands) {
        let window = ui.available_size();
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            let width = (window.x - 32.0).min(WIDEST);
            let left = (0.5 * (window.x - width)).max(0.0);
            let top = (0.4 * (window.y - self.height)).max(16.0);
            let corner = ui.max_rect().min + vec2(left, top);
            let page = Rect::from_min_size(corner, vec2(width, 0.0));
            let page = ui.scope_builder(egui::UiBuilder::new().max_rect(page), |ui| {
                ui.set_width(width);
                ui.label(RichText::new(PROGRAM).size(36.0).strong());
                let what = RichText::new("Label a whole scene from a few clicks");
                ui.label(what.size(16.0).weak());
                ui.add_space(16.0);
                self.columns(ui, model, pictures, commands);
                ui.add_space(16.0);
                // A key may have been taken away.
                let named = |(command, does): (&UiCommand, &str)| {
                    let key = command.key(ui.ctx());
                    (!key.is_empty()).then(|| format!("{key} {does}"))
                };
                let keys = [
                    (&HELP, "shows all keys"),
                    (&OPEN, "opens"),
                    (&SETTINGS, "settings"),
                ];
                let keys: Vec<String> = keys.into_iter().filter_map(named).collect();
                weak_text(ui, &keys.join("    "));
                ui.add_space(8.0);
            });
            let height = page.response.rect.height();
            if self.height != height {
                self.height = height;
                ui.ctx().request_repaint();
            }
        });
    }

    fn columns(&mut self, ui: &mut Ui, model: &Model, pictures: &Pictures, commands: &mut Commands) {
        let width = ui.available_width();
        let one = |ui: &mut Ui, width: f32, add: &mut dyn FnMut(&mut Ui)| {
            ui.allocate_ui_with_layout(vec2(width, 0.0), Layout::top_down(Align::Min), |ui| {
                ui.set_width(width);
                add(ui);
            });
        };
        let recent = |ui: &mut Ui, commands: &mut Commands| {
            if model.preferences.recents.is_empty() {
                first_steps(ui);
            } else {
                recents(ui, model, pictures, commands);
            }
        };
        if width < TWO_COLUMNS {
            self.opening(ui, commands);
            ui.add_space(GUTTER);
            recent(ui, commands);
            return;
        }
        ui.horizontal_top(|ui| {
            ui.spacing_mut().item_spacing.x = GUTTER;
            let half = 0.5 * (width - GUTTER);
            one(ui, half, &mut |ui| {
                ui.spacing_mut().item_spacing.x = theme::GAP;
                self.opening(ui, commands);
            });
            one(ui, half, &mut |ui| {
                ui.spacing_mut().item_spacing.x = theme::GAP;
                recent(ui, commands);
            });
        });
    }

    fn opening(&mut self, ui: &mut Ui, commands: &mut Commands) {
        card(ui).inner_margin(20).show(ui, |ui| {
            ui.set_width(ui.available_width());
            ui.horizontal_wrapped(|ui| {
                if main_button_enabled(ui, true, "Open a folder...").clicked() {
                    commands.push(Command::Browse(Purpose::Scene));
                }
                if ui.button("Open a project...").clicked() {
                    commands.push(Command::Browse(Purpose::Project));
                }
                if ui.button("Try the demo").clicked() {
                    commands.push(Command::open_scene(SceneSource::Demo));
                }
            });
            self.path_field(ui, commands);
            ui.add_space(4.0);
            drop_here(ui);
            ui.add_space(8.0);
            ui.strong("What can be opened");
            for (name, files) in FORMAT_LIST {
                ui.vertical(|ui| {
                    ui.spacing_mut().item_spacing.y = 0.0;
                    ui.label(name);
                    weak_text(ui, files);
                });
            }
            ui.add(egui::Label::new(RichText::new("docs/formats.md describes them; \"inplace info FOLDER\" says what is found in a folder.").weak().small()).wrap());
        });
    }

    fn path_field(&mut self, ui: &mut Ui, commands: &mut Commands) {
        let mut open = false;
        let typed = !self.path.trim().is_empty();
        let height = ui.spacing().interact_size.y;
        ui.allocate_ui_with_layout(
            vec2(ui.available_width(), height),
            Layout::right_to_left(Align::Center),
            |ui| {
                open = main_button_enabled(ui, typed, "Open").clicked();
                let field = egui::TextEdit::singleline(&mut self.path)
                    .hint_text("or type a path: /data/room, /work/room.inplace")
                    .margin(vec2(8.0, 6.0))
                    .desired_width(ui.available_width());
                let response = ui.add(field).accessible_name("Path to open");
                open |= response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
            },
        );
        if open && !self.path.trim().is_empty() {
            commands.push(Command::Open(Target::Path(typed_path(&self.path))));
        }
    }
}

/// Says that things can be dropped, in a frame that looks like it.
fn drop_here(ui: &mut Ui) {
    let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), 56.0), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, DROP));
    let stroke = Stroke::new(1.0, ui.visuals().weak_text_color());
    let inner = rect.shrink(1.0);
    let corners = [
        inner.left_top(),
        inner.right_top(),
        inner.right_bottom(),
        inner.left_bottom(),
        inner.left_top(),
    ];
    ui.painter()
        .extend(egui::Shape::dashed_line(&corners, stroke, 6.0, 5.0));
    let job = egui::text::LayoutJob::simple(
        DROP.to_owned(),
        FontId::proportional(14.0),
        ui.visuals().weak_text_color(),
        rect.width() - 24.0,
    );
    let galley = ui.painter().layout_job(job);
    let corner = rect.center() - 0.5 * galley.size();
    ui.painter().galley(corner, galley, Color32::PLACEHOLDER);
}

fn first_steps(ui: &mut Ui) {
    card(ui).inner_margin(20).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.strong("First steps");
        ui.add_space(4.0);
        for (index, (title, text)) in STEPS.into_iter().enumerate() {
            ui.horizontal_top(|ui| {
                let (rect, _) = ui.allocate_exact_size(vec2(28.0, 28.0), Sense::hover());
                let (fill, color) = (theme::of(ui.visuals()).accent, theme::of(ui.visuals()).on_accent);
                ui.painter().circle_filled(rect.center(), 12.0, fill);
                let number = (index + 1).to_string();
                let font = FontId::proportional(14.0);
                ui.painter()
                    .text(rect.center(), egui::Align2::CENTER_CENTER, number, font, color);
                ui.vertical(|ui| {
                    ui.spacing_mut().item_spacing.y = 2.0;
                    ui.strong(title);
                    weak_text(ui, text);
                });
            });
            ui.add_space(8.0);
        }
    });
}

fn recents(ui: &mut Ui, model: &Model, pictures: &Pictures, commands: &mut Commands) {
    card(ui).inner_margin(12).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.horizontal(|ui| {
            ui.add_space(8.0);
            ui.strong("Recent");
        });
        ui.spacing_mut().item_spacing.y = 2.0;
        let now = now();
        for recent in model.preferences.recents.iter() {
            ui.push_id(&recent.place, |ui| row(ui, pictures, recent, now, commands));
        }
    });
}

fn row(ui: &mut Ui, pictures: &Pictures, recent: &Recent, now: u64, commands: &mut Commands) {
    let found = pictures.of(&recent.place);
    let there = found.is_none_or(|found| found.there);
    let size = vec2(ui.available_width(), PICTURE.y + 2.0 * theme::GAP);
    let (rect, response) = ui.allocate_exact_size(size, Sense::click());
    let name = match there {
        true => format!("Open {}", recent.name),
        false => not_found(&recent.name),
    };
    response.widget_info(|| WidgetInfo::labeled(Role::Button, there, &name));
    if there && response.clicked() {
        commands.push(Command::open_again(&recent.place));
    }
    let visuals = ui.visuals();
    if there && response.hovered() {
        ui.painter()
            .rect_filled(rect, 6, visuals.widgets.inactive.bg_fill);
    }
    if response.has_focus() {
        focus_ring(ui, rect.shrink(2.0));
    }
    let picture = Rect::from_min_size(rect.min + vec2(theme::GAP, theme::GAP), PICTURE);
    paint_picture(ui, picture, found.and_then(|found| found.picture.as_ref()), there);
    let text = Rect::from_min_max(
        pos2(picture.right() + 12.0, picture.top()),
        pos2(rect.right() - 44.0, picture.bottom()),
    );
    let lines =
        |index: f32| Rect::from_min_size(text.min + vec2(0.0, 20.0 * index), vec2(text.width(), 20.0));
    let (strong, weak) = (visuals.strong_text_color(), visuals.weak_text_color());
    if there {
        line_of_text(ui, lines(0.0), &recent.name, 15.0, strong);
        let details = format!(
            "{}, {}, {}  -  {}",
            counted(recent.frames, "frame", "frames"),
            counted(recent.classes, "class", "classes"),
            counted(recent.strokes, "stroke", "strokes"),
            ago(now.saturating_sub(recent.opened)),
        );
        line_of_text(ui, lines(2.0), &details, 12.0, weak);
    } else {
        line_of_text(ui, lines(0.0), &not_found(&recent.name), 15.0, weak);
    }
    let path = recent.place.path().display().to_string();
    line_of_text(ui, lines(1.0), &path, 12.0, weak);
    let corner = Rect::from_center_size(pos2(rect.right() - 22.0, rect.center().y), vec2(28.0, 28.0));
    let mut child = ui.new_child(egui::UiBuilder::new().max_rect(corner));
    let forget = format!("Remove {} from the list", recent.name);
    if icon_button(&mut child, Icon::Close, &forget).clicked() {
        commands.push(Command::Prefer(PreferenceChange::Forget(recent.place.clone())));
    }
    response.on_hover_text(path);
}

fn paint_picture(ui: &Ui, rect: Rect, picture: Option<&egui::TextureHandle>, there: bool) {
    let visuals = ui.visuals();
    ui.painter().rect_filled(rect, 4, theme::of(visuals).canvas);
    match picture {
        Some(picture) => {
            let size = picture.size_vec2();
            let scale = (rect.width() / size.x).min(rect.height() / size.y);
            let tint = if there {
                Color32::WHITE
            } else {
                Color32::from_white_alpha(70)
            };
            egui::Image::new(picture)
                .corner_radius(4)
                .tint(tint)
                .paint_at(ui, Rect::from_center_size(rect.center(), scale * size));
        }
        None => Icon::Folder.paint(ui.painter(), rect, visuals.weak_text_color()),
    }
    let line = Stroke::new(1.0, theme::of(visuals).line);
    ui.painter().rect_stroke(rect, 4, line, StrokeKind::Inside);
}

fn ago(seconds: u64) -> String {
    let of = |count: u64, unit: &str| format!("{count} {unit}{} ago", if count == 1 { "" } else { "s" });
    match seconds {
        0..60 => "just now".to_owned(),
        60..3600 => of(seconds / 60, "minute"),
        3600..86_400 => of(seconds / 3600, "hour"),
        86_400..5_184_000 => of(seconds / 86_400, "day"),
        _ => of(seconds / 2_592_000, "month"),
    }
}
