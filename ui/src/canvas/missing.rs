//! What the canvas says in place of an image that cannot be read any more.

use egui::{FontId, Rect, Role, Sense, Ui, WidgetInfo};

use crate::theme;

/// Widest line, in points.
const WIDEST: f32 = 480.0;

/// Writes a sentence in the middle of a part of the canvas.
pub fn show(ui: &Ui, part: Rect, side: usize, sentence: &str) {
    let painter = ui.painter_at(part);
    let widest = (part.width() - 4.0 * theme::GAP).clamp(0.0, WIDEST);
    let (font, color) = (FontId::proportional(14.0), ui.visuals().strong_text_color());
    let galley = painter.layout(sentence.to_owned(), font, color, widest);
    let rect = Rect::from_center_size(part.center(), galley.size());
    painter.galley(rect.min, galley, color);
    // Hovering takes no clicks.
    let response = ui.interact(rect, ui.scope_id().with(("missing", side)), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, sentence));
}
