//! Over the whole window while something is held above it: drop it to open it.

use egui::{Align2, Area, Color32, FontId, Id, Order, Role, Sense, Stroke, StrokeKind, WidgetInfo};

use crate::theme;

/// Covers the window while files are held above it.
pub fn drop_area(ctx: &egui::Context) {
    if ctx.input(|input| input.raw.hovered_files.is_empty()) {
        return;
    }
    let window = ctx.content_rect();
    Area::new(Id::unique("drop"))
        .order(Order::Foreground)
        .fixed_pos(window.min)
        .interactable(false)
        .show(ctx, |ui| {
            let (_, response) = ui.allocate_exact_size(window.size(), Sense::hover());
            response.widget_info(|| WidgetInfo::labeled(Role::Label, true, "Drop to open"));
            paint(ui, window);
        });
}

fn paint(ui: &egui::Ui, window: egui::Rect) {
    let (painter, visuals) = (ui.painter(), ui.visuals());
    let veil = if visuals.dark_mode {
        Color32::from_black_alpha(190)
    } else {
        Color32::from_white_alpha(215)
    };
    painter.rect_filled(window, 0, veil);
    let inner = window.shrink(24.0);
    let accent = Stroke::new(3.0, theme::of(visuals).accent);
    painter.rect_stroke(inner, 12, accent, StrokeKind::Inside);
    let center = inner.center();
    let (large, small) = (FontId::proportional(28.0), FontId::proportional(14.0));
    let strong = visuals.strong_text_color();
    painter.text(center, Align2::CENTER_BOTTOM, "Drop to open", large, strong);
    let what = "The folder of a scene, or a project file (.inplace)";
    painter.text(center, Align2::CENTER_TOP, what, small, visuals.text_color());
}
