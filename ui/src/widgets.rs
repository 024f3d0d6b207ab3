//! The few widgets of our own: painted icons, class swatches, section headings, the main button.

use egui::{Color32, Pos2, Rect, Response, Role, Sense, Shape, Stroke, Ui, Vec2, WidgetInfo, pos2, vec2};

use crate::theme;

/// A painted icon, named after what it shows or what it is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Icon {
    Undo,
    Redo,
    /// The corners of a frame.
    Fit,
    Brush,
    Eraser,
    Pause,
    Play,
    Close,
    /// Three dots.
    More,
    Add,
    Info,
    Warning,
    Folder,
    Polyline,
    Polygon,
    Select,
    Delete,
    Up,
    Down,
    /// To the right: there is more below.
    Folded,
    /// Downwards, small: what is below belongs to it.
    Unfolded,
    Locked,
    Unlocked,
    Hidden,
    /// A frame in two halves.
    Compare,
    Check,
}

/// A square button with an icon; `name` is its tooltip and its name for screen readers.
pub fn icon_button(ui: &mut Ui, icon: Icon, name: &str) -> Response {
    icon_button_with(ui, icon, name, false)
}

/// An icon button that can be chosen.
pub fn icon_button_with(ui: &mut Ui, icon: Icon, name: &str, chosen: bool) -> Response {
    let side = ui.spacing().interact_size.y;
    let (rect, response) = ui.allocate_exact_size(Vec2::splat(side), Sense::click());
    let enabled = ui.is_enabled();
    response.widget_info(|| {
        let mut info = WidgetInfo::labeled(Role::Button, enabled, name);
        info.selected = chosen.then_some(true);
        info
    });
    if ui.is_rect_visible(rect) {
        let visuals = ui.style().interact(&response);
        let color = if chosen {
            ui.painter()
                .rect_filled(rect, visuals.corner_radius, theme::of(ui.visuals()).accent);
            theme::of(ui.visuals()).on_accent
        } else {
            if response.hovered() || response.has_focus() {
                ui.painter().rect(
                    rect,
                    visuals.corner_radius,
                    visuals.bg_fill,
                    visuals.bg_stroke,
                    egui::StrokeKind::Inside,
                );
            }
            visuals.text_color()
        };
        icon.paint(ui.painter(), rect, color);
    }
    if response.has_focus() {
        focus_ring(ui, rect);
    }
    response.on_hover_text(name)
}

/// The ring around a control that has the keyboard.
pub fn focus_ring(ui: &Ui, rect: Rect) {
    let stroke = Stroke::new(1.5, theme::of(ui.visuals()).accent);
    ui.painter()
        .rect_stroke(rect, 4, stroke, egui::StrokeKind::Outside);
}

impl Icon {
    /// Paints the icon in the middle of a rectangle.
    pub fn paint(self, painter: &egui::Painter, rect: Rect, color: Color32) {
        let center = rect.center();
        let stroke = Stroke::new(1.6, color);
        // Corners as in an SVG: "x,y x,y", in points from the middle.
        let points = |corners: &str| -> Vec<Pos2> {
            let numbers = corners
                .split([' ', ','])
                .map(|number| number.parse().unwrap_or(0.0));
            let numbers: Vec<f32> = numbers.collect();
            numbers
                .chunks_exact(2)
                .map(|at| center + vec2(at[0], at[1]))
                .collect()
        };
        // One line or several: "x,y x,y;x,y x,y".
        let line = |lines: &str| {
            for corners in lines.split(';') {
                painter.line(points(corners), stroke);
            }
        };
        let outline = |corners: &str| {
            painter.add(Shape::closed_line(points(corners), stroke));
        };
        let dots = |centers: &str, radius: f32| {
            for center in points(centers) {
                painter.circle_filled(center, radius, color);
            }
        };
        let padlock = Rect::from_center_size(center + vec2(0.0, 2.5), vec2(10.0, 7.5));
        match self {
            Self::Undo => turn(painter, center, stroke, 1.0),
            Self::Redo => turn(painter, center, stroke, -1.0),
            Self::Fit => {
                line("2.5,6 6.5,6 6.5,2;2.5,-6 6.5,-6 6.5,-2;-2.5,6 -6.5,6 -6.5,2;-2.5,-6 -6.5,-6 -6.5,-2");
            }
            Self::Brush => {
                line("6.5,-6.5 -0.5,0.5");
                dots("-3,3", 3.6);
            }
            Self::Eraser => {
                outline("-6.5,2 1,-5.5 6,-0.5 -1,6 -3,6");
                line("-3,-1.5 2.2,3.4");
            }
            Self::Pause => {
                for middle in points("-3,0 3,0") {
                    painter.rect_filled(Rect::from_center_size(middle, vec2(3.0, 11.0)), 1, color);
                }
            }
            Self::Play => {
                let triangle = points("-4,-6 6,0 -4,6");
                painter.add(Shape::convex_polygon(triangle, color, Stroke::NONE));
            }
            Self::Check => line("-5,0.5 -1.5,4 5,-4"),
            Self::Close => line("-4,-4 4,4;-4,4 4,-4"),
            Self::More => dots("-5,0 0,0 5,0", 1.5),
            Self::Info => {
                painter.circle_stroke(center, 7.0, stroke);
                dots("0,-3.2", 1.0);
                line("0,-0.8 0,3.8");
            }
            Self::Warning => {
                outline("0,-7 7.5,6 -7.5,6");
                line("0,-2.6 0,1.6");
                dots("0,3.8", 1.0);
            }
            Self::Folder => outline("-7,5.5 -7,-5 -2,-5 0,-2.5 7,-2.5 7,5.5"),
            Self::Compare => {
                let frame = Rect::from_center_size(center, vec2(15.0, 12.0));
                painter.rect_filled(frame.with_max_x(center.x), 1, color);
                painter.rect_stroke(frame, 2, stroke, egui::StrokeKind::Middle);
            }
            Self::Add => line("-5,0 5,0;0,-5 0,5"),
            Self::Polyline => {
                let corners = "-6.5,4.5 -1.5,-4 2,3 6.5,-4.5";
                line(corners);
                dots(corners, 2.2);
            }
            Self::Polygon => {
                let corners = "-6,5 -4.5,-4.5 4.5,-5.5 6,3.5 0.5,6";
                outline(corners);
                dots(corners, 2.0);
            }
            Self::Select => outline("-4,-6.5 -4,5 -1,2 1.2,6.5 3.2,5.5 1,1.3 5,1"),
            Self::Delete => {
                line("-6,-4 6,-4;-2,-4 -2,-6.5 2,-6.5 2,-4;-4.5,-4 -3.7,6.5 3.7,6.5 4.5,-4");
            }
            Self::Up => line("-5,2.5 0,-2.5 5,2.5"),
            Self::Down => line("-5,-2.5 0,2.5 5,-2.5"),
            Self::Folded => line("-1.5,-4 2.5,0 -1.5,4"),
            Self::Unfolded => line("-4,-1.5 0,2.5 4,-1.5"),
            Self::Locked => {
                painter.rect_filled(padlock, 1, color);
                line("-3,-1 -3,-4 -1.5,-6;-1.5,-6 1.5,-6 3,-4 3,-1");
            }
            Self::Unlocked => {
                painter.rect_stroke(padlock, 1, Stroke::new(1.2, color), egui::StrokeKind::Inside);
                line("-3,-1 -3,-4 -1.5,-6;-1.5,-6 1.5,-6 3,-4");
            }
            Self::Hidden => {
                for side in [-4.0, 4.0] {
                    let steps = (0..=8).map(|step| step as f32 / 4.0 - 1.0);
                    let lid = steps.map(|x| center + vec2(7.0 * x, side * (1.0 - x * x)));
                    painter.line(lid.collect(), stroke);
                }
                dots("0,0", 2.0);
                line("-5.5,5.5 5.5,-5.5");
            }
        }
    }
}

/// An arrow that turns back (`side` 1) or forward (-1).
fn turn(painter: &egui::Painter, center: Pos2, stroke: Stroke, side: f32) {
    let at = |x: f32, y: f32| center + vec2(side * x, y);
    let arc = (0..=12).map(|step| {
        let angle = std::f32::consts::PI * (step as f32 / 12.0 - 0.5);
        at(1.0 + 4.5 * angle.cos(), 1.0 + 4.5 * angle.sin())
    });
    painter.line(vec![at(-6.0, -3.5), at(1.0, -3.5)], stroke);
    painter.line(arc.collect(), stroke);
    painter.line(vec![at(1.0, 5.5), at(-3.5, 5.5)], stroke);
    painter.line(vec![at(-2.8, -6.7), at(-6.0, -3.5), at(-2.8, -0.3)], stroke);
}

/// A class's colour as a small rounded square.
pub fn swatch(painter: &egui::Painter, center: Pos2, color: [u8; 3], side: f32) {
    let rect = Rect::from_center_size(center, Vec2::splat(side));
    let [r, g, b] = color;
    // So that it stands out from the panel however dark or pale it is.
    let style = painter.ctx().global_style();
    let edge = style.visuals.weak_text_color().gamma_multiply(0.4);
    painter.rect(
        rect,
        3,
        Color32::from_rgb(r, g, b),
        Stroke::new(1.0, edge),
        egui::StrokeKind::Inside,
    );
}

/// A panel's heading, with controls at the right end of its line.
pub fn heading(ui: &mut Ui, text: &str, controls: impl FnOnce(&mut Ui)) {
    ui.horizontal(|ui| {
        ui.set_min_height(ui.spacing().interact_size.y);
        ui.label(egui::RichText::new(text).size(15.0).strong());
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), controls);
    });
}

/// A key that does something, painted like a key cap.
pub fn key_cap(ui: &Ui, center: Pos2, text: &str) {
    let visuals = ui.visuals();
    let rect = Rect::from_center_size(center, vec2(18.0, 18.0));
    let line = Stroke::new(1.0, visuals.widgets.hovered.bg_fill);
    ui.painter().rect_stroke(rect, 4, line, egui::StrokeKind::Inside);
    let font = egui::FontId::monospace(11.0);
    let color = visuals.weak_text_color();
    ui.painter()
        .text(center, egui::Align2::CENTER_CENTER, text, font, color);
}

/// A key cap as wide as its text, left of `right_center`; returns its width.
pub fn key_cap_of(ui: &Ui, right_center: Pos2, text: &str) -> f32 {
    let color = ui.visuals().weak_text_color();
    let font = egui::FontId::proportional(11.0);
    let galley = ui.painter().layout_no_wrap(text.to_owned(), font, color);
    let size = vec2((galley.size().x + 10.0).max(18.0), 18.0);
    let rect = Rect::from_center_size(right_center - vec2(0.5 * size.x, 0.0), size);
    let line = Stroke::new(1.0, ui.visuals().widgets.hovered.bg_fill);
    ui.painter().rect_stroke(rect, 4, line, egui::StrokeKind::Inside);
    let top_left = rect.center() - 0.5 * galley.size();
    ui.painter().galley(top_left, galley, color);
    size.x
}

/// The button that a person most likely wants, where it may not be possible yet.
pub fn main_button_enabled(ui: &mut Ui, enabled: bool, text: &str) -> Response {
    let visuals = ui.visuals();
    let (fill, color) = (theme::of(visuals).accent, theme::of(visuals).on_accent);
    let text = egui::RichText::new(text).color(color);
    ui.add_enabled(enabled, egui::Button::new(text).fill(fill))
}

/// Work that takes a while: what it is, how far it has come (`None` = nobody knows), and a button that stops it, where
/// it can be stopped, with its name for screen readers. Returns whether that was pressed.
pub fn long_work(
    ui: &mut Ui,
    title: &str,
    (share, words): (Option<f32>, &str),
    cancel: Option<&str>,
) -> bool {
    ui.add(egui::Label::new(egui::RichText::new(title).size(15.0).strong()).truncate());
    ui.add(egui::ProgressBar::new(share.unwrap_or(0.0)).desired_height(8.0));
    // Not on the bar: no colour is readable on both of its halves.
    ui.add(egui::Label::new(egui::RichText::new(words).weak()).truncate());
    cancel.is_some_and(|name| {
        let button = ui.button("Cancel");
        button.accessible_name(name).clicked()
    })
}

/// Words that matter less, in as many lines as they need.
pub fn weak_text(ui: &mut Ui, text: &str) -> Response {
    ui.add(egui::Label::new(egui::RichText::new(text).weak()).wrap())
}

/// Text cut to one line in a rectangle, with the colour given; returns whether some of it is cut off.
pub fn line_of_text(ui: &Ui, rect: Rect, text: &str, size: f32, color: Color32) -> bool {
    painted_line(ui.painter(), rect, text, size, color)
}

/// Like [`line_of_text`], over something that is painted.
pub fn painted_line(painter: &egui::Painter, rect: Rect, text: &str, size: f32, color: Color32) -> bool {
    let font = egui::FontId::proportional(size);
    let mut job =
        egui::text::LayoutJob::single_section(text.to_owned(), egui::text::TextFormat::simple(font, color));
    job.wrap = egui::text::TextWrapping::truncate_at_width(rect.width());
    let galley = painter.layout_job(job);
    let top = rect.center().y - 0.5 * galley.size().y;
    let cut = galley.elided;
    painter.galley(pos2(rect.left(), top), galley, color);
    cut
}

/// Scrolls as little as shows a rectangle, at once: while one scroll is under way, egui does not stop it for
/// something that is in view at that moment, and so leaves it behind.
pub fn scroll_to(ui: &Ui, rect: Rect) {
    ui.scroll_to_rect_animation(rect, None, egui::style::ScrollAnimation::none());
}

/// A list to choose from, as wide as this, with the choice of now on it; `name` is what screen readers call it.
pub fn choice_box(
    ui: &mut Ui,
    name: &str,
    width: f32,
    chosen: impl Into<egui::WidgetText>,
    choices: impl FnOnce(&mut Ui),
) -> Response {
    let list = egui::ComboBox::from_id_salt(name).selected_text(chosen);
    // High enough for all formats of an export at once.
    let shown = list.truncate().width(width).height(400.0).show_ui(ui, choices);
    shown.response.accessible_name(name)
}

/// A field for a line of text, with this hint while it is empty.
pub fn text_line<'a>(text: &'a mut String, hint: &'static str, width: f32) -> egui::TextEdit<'a> {
    egui::TextEdit::singleline(text)
        .hint_text(hint)
        .margin(vec2(8.0, 5.0))
        .desired_width(width)
}
