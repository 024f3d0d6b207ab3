//! What stands over the 3D view: buttons, gestures, and notices about clicks.

use egui::text::LayoutJob;
use egui::{Color32, FontId, Layout, Rect, Sense, Stroke, Ui, UiBuilder, WidgetInfo, pos2, vec2};
use inplace_core::labels::{ClassId, Pixel};
use inplace_model::layer::Layer;
use inplace_model::space::Space;
use inplace_model::view::ImagePart;
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use crate::canvas::{rect_of, stroke_color};
use crate::keys::table::{FIT, SPACE};
use crate::theme;
use crate::thumbnails::{self, Thumbnails};

/// What the pointer does, a gesture and what it does each.
const GESTURES: [(&str, &str); 5] = [
    ("Click", "label"),
    ("Drag", "turn"),
    ("Middle drag", "move"),
    ("Wheel", "zoom"),
    ("Double-click", "turn around that place"),
];

/// Seconds that a notice is shown.
const NOTICE_SECONDS: f64 = 5.0;
const MARGIN: f32 = 12.0;

/// The two buttons that choose what is in the middle of the window.
pub fn switch(ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
    for (space, name) in [(false, "Frame"), (true, "3D")] {
        let chosen = workspace.space.shown == space;
        let choice = ui.selectable_label(chosen, name);
        if choice
            .on_hover_text(SPACE.named_as(ui.ctx(), SPACE.does))
            .clicked()
            && !chosen
        {
            commands.push(Command::ToggleSpace);
        }
    }
}

/// The view's own controls, with a line of words below them; returns whether to fly to the frame in view.
pub fn show(ui: &mut Ui, area: Rect, space: &mut Space, layer: &mut Layer, words: Option<&str>) -> bool {
    let mut fly = false;
    let place = UiBuilder::new()
        .max_rect(area.shrink(MARGIN))
        .layout(Layout::left_to_right(egui::Align::Min));
    ui.scope_builder(place, |ui| {
        plate(ui).show(ui, |ui| {
            ui.vertical(|ui| {
                ui.horizontal_wrapped(|ui| {
                    let button = ui.button("Fly to this frame");
                    fly = button.on_hover_text("Looks from where the frame in view was taken").clicked();
                    ui.checkbox(&mut space.see_through, "See into rooms").on_hover_text(
                        "Leaves out walls and ceilings that are seen from behind, so that you look into the room from \
                         outside",
                    );
                    ui.checkbox(&mut space.cameras, "Cameras")
                        .on_hover_text("Shows where the frames were taken; click on one to go to its frame");
                    let mut field = layer.is_rendered();
                    let switch = ui.checkbox(&mut field, "Field").on_hover_text(
                        "Shows what the program has learnt of the scene, rendered from here when the view rests",
                    );
                    if switch.changed() {
                        *layer = layer.of_field(field);
                    }
                });
                if let Some(words) = words {
                    ui.weak(words);
                }
            });
        });
    });
    fly
}

/// A plate that words and controls over the splats stand on.
fn plate(ui: &Ui) -> egui::Frame {
    egui::Frame::new()
        .fill(ui.visuals().window_fill.gamma_multiply(0.92))
        .stroke(Stroke::new(1.0, theme::of(ui.visuals()).line))
        .corner_radius(8)
        .inner_margin(egui::Margin::symmetric(8, 4))
}

/// Says in the middle why there is nothing to see.
pub fn empty(ui: &mut Ui, area: Rect, words: &str) {
    let place = UiBuilder::new()
        .max_rect(Rect::from_center_size(
            area.center(),
            vec2((area.width() - 64.0).min(420.0), 60.0),
        ))
        .layout(Layout::top_down(egui::Align::Center));
    ui.scope_builder(place, |ui| crate::widgets::weak_text(ui, words));
}

/// The gestures and the key that fits the scene in, in the lower right corner.
pub fn gestures(ui: &Ui, area: Rect) {
    let visuals = ui.visuals();
    let fit = FIT.key(ui.ctx());
    let key = (!fit.is_empty()).then_some((fit.as_str(), "fit"));
    let gestures: Vec<(&str, &str)> = GESTURES.into_iter().chain(key).collect();
    let colors = [visuals.strong_text_color(), visuals.weak_text_color()];
    let job = gesture_job(&gestures, colors, area.width() - 2.0 * MARGIN - 16.0);
    let words: Vec<String> = gestures
        .iter()
        .map(|(gesture, does)| format!("{gesture}: {does}"))
        .collect();
    let galley = ui.painter().layout_job(job);
    let size = galley.size() + vec2(16.0, 8.0);
    let rect = Rect::from_min_size(area.right_bottom() - size - vec2(MARGIN, MARGIN), size);
    let fill = visuals.window_fill.gamma_multiply(0.85);
    ui.painter().rect_filled(rect, 6, fill);
    ui.painter()
        .galley(rect.min + vec2(8.0, 4.0), galley, visuals.text_color());
    let response = ui.interact(rect, ui.scope_id().with("gestures"), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(egui::Role::Label, true, words.join(", ")));
}

/// Gestures with what they do, in these colours, in lines of at most this width in points.
fn gesture_job(gestures: &[(&str, &str)], [strong, weak]: [Color32; 2], width: f32) -> LayoutJob {
    let format = |color| egui::TextFormat::simple(FontId::proportional(12.0), color);
    // Only at the space between two gestures may a line end.
    let unbroken = |words: &str| words.replace(' ', "\u{a0}");
    let mut job = LayoutJob::default();
    for (index, (gesture, does)) in gestures.iter().enumerate() {
        let gap = if index == 0 { 0.0 } else { 11.0 };
        job.append(&unbroken(gesture), gap, format(strong));
        job.append(&unbroken(does), 5.0, format(weak));
        job.append(" ", 0.0, format(weak));
    }
    job.wrap.max_width = width;
    job
}

/// What became of a click.
pub struct Notice {
    words: String,
    /// The frame, pixel and class that a click was given to.
    label: Option<(usize, Pixel, ClassId)>,
    /// When it goes.
    pub until: f64,
}

impl Notice {
    /// Words, and the frame, pixel and class that a click was given to.
    pub fn new(words: String, label: Option<(usize, Pixel, ClassId)>, now: f64) -> Self {
        let until = now + NOTICE_SECONDS;
        Self { words, label, until }
    }
}

/// A notice in the lower left corner, with the frame and the pixel that took the click.
pub fn notice(ui: &mut Ui, area: Rect, notice: &Notice, workspace: &Workspace, thumbnails: &mut Thumbnails) {
    const PICTURE: egui::Vec2 = vec2(144.0, 108.0);
    const WORDS: egui::Vec2 = vec2(240.0, 20.0);
    let picture_height = notice
        .label
        .map_or(0.0, |_| PICTURE.y + ui.spacing().item_spacing.y);
    let size = WORDS + vec2(16.0, 8.0 + picture_height);
    // Above the gestures, which may take the whole width.
    let corner = area.left_bottom() + vec2(MARGIN, -MARGIN - 36.0);
    let rect = Rect::from_min_size(corner - vec2(0.0, size.y), size);
    let place = UiBuilder::new()
        .max_rect(rect)
        .layout(Layout::top_down(egui::Align::Min));
    ui.scope_builder(place, |ui| {
        plate(ui).show(ui, |ui| {
            if let Some(label) = notice.label {
                let (rect, _) = ui.allocate_exact_size(PICTURE, Sense::hover());
                picture(ui, rect, label, workspace, thumbnails);
            }
            ui.add(egui::Label::new(&notice.words).truncate());
        });
    });
}

fn picture(
    ui: &Ui,
    rect: Rect,
    (frame, pixel, class): (usize, Pixel, ClassId),
    workspace: &Workspace,
    thumbnails: &mut Thumbnails,
) {
    let Some(thumbnail) = thumbnails.place(workspace, frame, pixel) else {
        return;
    };
    let fitted = thumbnails::paint(&thumbnail, ui.painter(), rect);
    if let Some(camera) = workspace.scene.frames.get(frame).map(|frame| frame.camera) {
        let size = glam::vec2(camera.width as f32, camera.height as f32);
        let part = rect_of(ImagePart::around(size, pixel, &[]));
        let place = pos2(pixel[0] as f32 + 0.5, pixel[1] as f32 + 0.5);
        let center = fitted.min + (place - part.min) / part.size() * fitted.size();
        let color = stroke_color(workspace, class);
        ui.painter()
            .circle(center, 4.0, color, Stroke::new(1.5, Color32::WHITE));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_of_gestures_end_between_two_of_them() {
        let output = egui::Context::default().run_ui(egui::RawInput::default(), |ui| {
            let job = gesture_job(&GESTURES, [Color32::WHITE; 2], 260.0);
            let lines = ui.painter().layout_job(job);
            assert!(lines.rows.len() > 1);
            for line in &lines.rows {
                let line = line.text().replace('\u{a0}', " ");
                let whole = GESTURES.iter().any(|(_, does)| line.trim_end().ends_with(does));
                assert!(whole, "{line}");
            }
        });
        output.drop_without_applying_deltas();
    }
}
