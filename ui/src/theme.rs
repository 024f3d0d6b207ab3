//! Colours and spacing, dark and light.

use egui::{Color32, CornerRadius, FontId, Margin, Shadow, Stroke, TextStyle, Visuals, vec2};

/// The grid that all distances are multiples of, in points.
pub const GAP: f32 = 8.0;

/// The window's shades, from the canvas outwards, and its one accent.
pub struct Shades {
    /// What lies around the image.
    pub canvas: Color32,
    field: Color32,
    /// Panels, and the window behind everything.
    pub panel: Color32,
    /// Cards on a panel.
    pub raised: Color32,
    control: Color32,
    hovered: Color32,
    /// Lines between panels.
    pub line: Color32,
    weak: Color32,
    text: Color32,
    strong: Color32,
    /// What is chosen, and the main button.
    pub accent: Color32,
    /// Text on the accent colour.
    pub on_accent: Color32,
    warning: Color32,
    /// Text that says that something is done and well.
    pub good: Color32,
    error: Color32,
}

const DARK: Shades = Shades {
    canvas: Color32::from_rgb(15, 16, 19),
    field: Color32::from_rgb(15, 16, 19),
    panel: Color32::from_rgb(26, 28, 32),
    raised: Color32::from_rgb(34, 36, 42),
    control: Color32::from_rgb(46, 49, 56),
    hovered: Color32::from_rgb(60, 64, 73),
    line: Color32::from_rgb(50, 53, 61),
    weak: Color32::from_rgb(156, 162, 174),
    text: Color32::from_rgb(214, 218, 226),
    strong: Color32::from_rgb(244, 246, 250),
    accent: Color32::from_rgb(84, 160, 255),
    on_accent: Color32::from_rgb(10, 22, 40),
    warning: Color32::from_rgb(240, 184, 84),
    good: Color32::from_rgb(110, 205, 140),
    error: Color32::from_rgb(255, 120, 112),
};

const LIGHT: Shades = Shades {
    canvas: Color32::from_rgb(214, 217, 222),
    field: Color32::from_rgb(234, 237, 242),
    panel: Color32::from_rgb(246, 247, 249),
    raised: Color32::from_rgb(255, 255, 255),
    control: Color32::from_rgb(229, 232, 237),
    hovered: Color32::from_rgb(214, 219, 227),
    line: Color32::from_rgb(208, 212, 219),
    weak: Color32::from_rgb(88, 95, 107),
    text: Color32::from_rgb(42, 47, 56),
    strong: Color32::from_rgb(14, 17, 22),
    accent: Color32::from_rgb(22, 98, 200),
    on_accent: Color32::from_rgb(255, 255, 255),
    warning: Color32::from_rgb(146, 94, 0),
    good: Color32::from_rgb(22, 116, 58),
    error: Color32::from_rgb(184, 38, 30),
};

/// The shades of the theme that these are of.
pub fn of(visuals: &Visuals) -> &'static Shades {
    if visuals.dark_mode { &DARK } else { &LIGHT }
}

/// Gives a window both themes; dark until the person says otherwise.
pub fn install(ctx: &egui::Context) {
    for (theme, shades) in [(egui::Theme::Dark, &DARK), (egui::Theme::Light, &LIGHT)] {
        ctx.style_mut_of(theme, |style| {
            style.visuals = visuals(theme, shades);
            spacing(style);
        });
    }
    ctx.set_theme(egui::ThemePreference::Dark);
}

fn spacing(style: &mut egui::Style) {
    style.text_styles = [
        (TextStyle::Heading, FontId::proportional(20.0)),
        (TextStyle::Body, FontId::proportional(14.0)),
        (TextStyle::Button, FontId::proportional(14.0)),
        (TextStyle::Small, FontId::proportional(12.0)),
        (TextStyle::Monospace, FontId::monospace(13.0)),
    ]
    .into();
    let spacing = &mut style.spacing;
    spacing.item_spacing = vec2(GAP, GAP);
    spacing.button_padding = vec2(10.0, 4.0);
    spacing.interact_size = vec2(28.0, 28.0);
    spacing.window_margin = Margin::same(16);
    spacing.menu_margin = Margin::same(8);
    spacing.slider_width = 96.0;
    spacing.slider_rail_height = 4.0;
    spacing.combo_width = 96.0;
    spacing.tooltip_width = 320.0;
    spacing.menu_width = 240.0;
    // Beside what it scrolls, not over it.
    spacing.scroll.floating_allocated_width = GAP;
    style.interaction.tooltip_delay = 0.35;
    style.animation_time = 0.08;
    style.always_scroll_the_only_direction = true;
}

fn visuals(theme: egui::Theme, shades: &Shades) -> Visuals {
    let mut visuals = theme.default_visuals();
    let corner = CornerRadius::same(4);
    let widgets = &mut visuals.widgets;
    for (widget, fill, text) in [
        (&mut widgets.noninteractive, shades.panel, shades.text),
        (&mut widgets.inactive, shades.control, shades.text),
        (&mut widgets.hovered, shades.hovered, shades.strong),
        (&mut widgets.active, shades.hovered, shades.strong),
        (&mut widgets.open, shades.hovered, shades.strong),
    ] {
        widget.bg_fill = fill;
        widget.weak_bg_fill = fill;
        widget.fg_stroke = Stroke::new(1.0, text);
        widget.bg_stroke = Stroke::NONE;
        widget.corner_radius = corner;
        widget.expansion = 0.0;
    }
    widgets.noninteractive.bg_stroke = Stroke::new(1.0, shades.line);
    widgets.active.bg_stroke = Stroke::new(1.0, shades.accent);
    // A blinking cursor draws the whole window twice a second, which costs a computer without a GPU a tenth of a core.
    visuals.text_cursor.blink = false;
    visuals.selection.bg_fill = shades.accent;
    visuals.selection.stroke = Stroke::new(1.0, shades.on_accent);
    visuals.weak_text_color = Some(shades.weak);
    visuals.hyperlink_color = shades.accent;
    visuals.faint_bg_color = shades.raised;
    visuals.extreme_bg_color = shades.canvas;
    visuals.text_edit_bg_color = Some(shades.field);
    visuals.warn_fg_color = shades.warning;
    visuals.error_fg_color = shades.error;
    // Panels are what the window is cleared to: filling them again is most of the work where a computer has no GPU.
    visuals.panel_fill = Color32::TRANSPARENT;
    visuals.window_fill = shades.raised;
    visuals.window_stroke = Stroke::new(1.0, shades.line);
    visuals.window_corner_radius = CornerRadius::same(8);
    visuals.menu_corner_radius = CornerRadius::same(6);
    let shadow = Shadow {
        offset: [0, 6],
        blur: 20,
        spread: 0,
        color: Color32::from_black_alpha(if visuals.dark_mode { 110 } else { 40 }),
    };
    visuals.window_shadow = shadow;
    visuals.popup_shadow = shadow;
    visuals.slider_trailing_fill = true;
    visuals.handle_shape = egui::style::HandleShape::Circle;
    visuals
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Relative luminance (WCAG 2).
    fn luminance(color: Color32) -> f32 {
        let linear = egui::Rgba::from(color);
        0.2126 * linear.r() + 0.7152 * linear.g() + 0.0722 * linear.b()
    }

    fn contrast(a: Color32, b: Color32) -> f32 {
        let (a, b) = (luminance(a), luminance(b));
        (a.max(b) + 0.05) / (a.min(b) + 0.05)
    }

    #[test]
    fn text_is_readable_on_everything_it_stands_on() {
        for shades in [&DARK, &LIGHT] {
            for under in [shades.panel, shades.raised, shades.field] {
                for text in [
                    shades.weak,
                    shades.text,
                    shades.strong,
                    shades.warning,
                    shades.good,
                    shades.error,
                ] {
                    assert!(contrast(text, under) >= 4.5);
                }
            }
            assert!(contrast(shades.text, shades.control) >= 4.5);
            assert!(contrast(shades.strong, shades.hovered) >= 4.5);
            assert!(contrast(shades.on_accent, shades.accent) >= 4.5);
            assert!(contrast(shades.accent, shades.panel) >= 4.5);
        }
    }
}
