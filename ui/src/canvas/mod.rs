//! The frame canvas: the image with its layer, the strokes and suggestions over it, and drawing on it.

mod content;
mod cpu;
mod gpu;
mod overlay;
mod palette;
mod tools;
mod view;

use egui::{CursorIcon, Key, Rect, Role, Sense, Ui, WidgetInfo, vec2};

pub use content::{Content, ShownMap};
pub use cpu::{Look, composite};
pub use gpu::UploadClock;
pub use overlay::{marker, region};
pub use palette::{Layer, Palette, VOID_COLOR};
pub use tools::{Gesture, Line, Outcome, Surroundings, Tool};
pub use view::{Placement, View};

use crate::action::{Action, Actions};
use crate::state::{AppState, Settings};
use crate::theme;
use crate::workspace::Workspace;

/// Name of the canvas for screen readers and tests.
pub const CANVAS_NAME: &str = "Frame canvas";

/// How frames get onto the screen.
enum Renderer {
    /// By a wgpu paint callback.
    Gpu(wgpu::TextureFormat),
    /// As one texture composed on the CPU.
    Cpu(Option<Composed>),
}

/// A composed texture and what it was made of.
struct Composed {
    texture: egui::TextureHandle,
    made_of: (u64, u64, u64, Look),
}

/// The canvas.
pub struct Canvas {
    renderer: Renderer,
    gesture: Gesture,
    clock: UploadClock,
    rect: Rect,
}

impl Canvas {
    /// A canvas drawn by wgpu where there is a target format, else on the CPU.
    pub fn new(target: Option<wgpu::TextureFormat>) -> Self {
        Self {
            renderer: target.map_or(Renderer::Cpu(None), Renderer::Gpu),
            gesture: Gesture::default(),
            clock: UploadClock::default(),
            rect: Rect::NOTHING,
        }
    }

    /// When the newest map reached the renderer.
    pub fn clock(&self) -> &UploadClock {
        &self.clock
    }

    /// Where the canvas was drawn last.
    pub fn rect(&self) -> Rect {
        self.rect
    }

    /// Draws the frame in view and follows the pointer.
    pub fn show(&mut self, ui: &mut Ui, state: &AppState, workspace: &Workspace, actions: &mut Actions) {
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        self.rect = rect;
        response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, CANVAS_NAME));
        let painter = ui.painter_at(rect);
        painter.rect_filled(rect, 0, theme::canvas(ui.visuals()));
        let (Some(frame), Some(content)) = (workspace.frame(), workspace.content()) else {
            return;
        };
        let size = vec2(frame.color.width() as f32, frame.color.height() as f32);
        let hover = response
            .contains_pointer()
            .then(|| ui.ctx().pointer_latest_pos())
            .flatten();
        let around = Surroundings {
            canvas: rect,
            size,
            tool: state.settings.tool,
            pan_key: ui.input(|input| input.key_down(Key::Space)) && !ui.ctx().text_edit_focused(),
            cursor: hover,
        };
        let view = self.follow(ui, workspace.view, &around, &state.settings, actions);
        if self.gesture.line().is_some() && workspace.guidance().is_active() {
            // Whoever draws has turned to something else, also before the line is finished.
            actions.push(Action::LeaveSuggestions);
        }
        let placement = view.place(rect, size);
        let mut look = state.settings.look();
        if state.overlay_hidden {
            look.layer = Layer::Color;
        }
        self.paint_frame(&painter, content, placement, look);
        if !state.overlay_hidden {
            overlay::strokes(&painter, workspace, placement);
            overlay::suggestions(&painter, workspace, placement);
        }
        if let Some(line) = self.gesture.line() {
            overlay::draft(&painter, workspace, placement, line, state.settings.brush);
        }
        if let Some(position) = hover {
            self.show_cursor(ui, &painter, state, workspace, placement, position, &around);
        }
    }

    /// Follows the pointer events of this frame; returns the view after them.
    fn follow(
        &mut self,
        ui: &Ui,
        mut view: View,
        around: &Surroundings,
        settings: &Settings,
        actions: &mut Actions,
    ) -> View {
        // A discarded pass is run again with the same events.
        if ui.ctx().current_pass_index() > 0 {
            return view;
        }
        let layer = ui.layer_id();
        let reachable =
            |position| around.canvas.contains(position) && ui.ctx().layer_id_at(position) == Some(layer);
        let before = view;
        let mut brush = settings.brush;
        let events = ui.input(|input| input.events.clone());
        for event in &events {
            let wheel = matches!(event, egui::Event::MouseWheel { .. });
            if wheel && !around.cursor.is_some_and(reachable) {
                continue;
            }
            if matches!(event, egui::Event::PointerButton { pressed: true, pos, .. } if reachable(*pos))
                && let Some(focused) = ui.memory(|memory| memory.focused())
            {
                ui.memory_mut(|memory| memory.surrender_focus(focused));
            }
            match self.gesture.follow(event, view, around, reachable) {
                Some(Outcome::Finished(line)) => actions.push(Action::Draw(line)),
                Some(Outcome::Moved(moved)) => view = moved,
                Some(Outcome::Brush(steps)) => {
                    brush = stepped_brush(brush, steps);
                    actions.push(Action::SetBrush(brush));
                }
                None => {}
            }
        }
        if view != before {
            actions.push(Action::SetView(view));
        }
        view
    }

    fn paint_frame(&mut self, painter: &egui::Painter, content: Content, placement: Placement, look: Look) {
        let (painter_rect, clock) = (painter.clip_rect(), UploadClock::clone(&self.clock));
        match &mut self.renderer {
            Renderer::Gpu(target) => {
                let draw = gpu::Draw {
                    content,
                    placement,
                    look,
                    target: *target,
                    clock,
                };
                painter.add(egui_wgpu::Callback::new_paint_callback(painter_rect, draw));
            }
            Renderer::Cpu(composed) => {
                let map_serial = content.map.as_ref().map_or(0, |shown| shown.serial);
                let made_of = (content.color_serial, map_serial, content.palette_serial, look);
                if composed
                    .as_ref()
                    .is_none_or(|composed| composed.made_of != made_of)
                {
                    let texture = compose(painter.ctx(), &content, look);
                    *composed = Some(Composed { texture, made_of });
                    if let Some(shown) = &content.map {
                        gpu::note_upload(&clock, shown.map.generation, shown.map.frame);
                    }
                }
                if let Some(composed) = composed {
                    let whole = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
                    let texture = composed.texture.id();
                    painter.image(texture, placement.rect(), whole, egui::Color32::WHITE);
                }
            }
        }
    }

    #[expect(
        clippy::too_many_arguments,
        reason = "all of it is what the cursor depends on"
    )]
    fn show_cursor(
        &self,
        ui: &Ui,
        painter: &egui::Painter,
        state: &AppState,
        workspace: &Workspace,
        placement: Placement,
        position: egui::Pos2,
        around: &Surroundings,
    ) {
        if self.gesture.is_panning() {
            ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
        } else if around.pan_key {
            ui.ctx().set_cursor_icon(CursorIcon::Grab);
        } else if placement.pixel_at(position).is_some() {
            ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
            let tool = self.gesture.line().map_or(state.settings.tool, |line| line.tool);
            overlay::brush(
                painter,
                workspace,
                placement,
                position,
                tool,
                state.settings.brush,
            );
        }
    }
}

fn compose(ctx: &egui::Context, content: &Content, look: Look) -> egui::TextureHandle {
    let image = content.image();
    let size = [image.width() as usize, image.height() as usize];
    let map = content.map.as_ref().map(|shown| shown.map.as_ref());
    let composed = composite(image, map, &content.palette, look, size);
    let options = egui::TextureOptions {
        magnification: egui::TextureFilter::Nearest,
        ..egui::TextureOptions::LINEAR
    };
    ctx.load_texture("frame", composed, options)
}

/// The next brush size: single pixels first, then coarser steps.
pub fn stepped_brush(radius: u32, steps: i32) -> u32 {
    let mut radius = radius;
    for _ in 0..steps.unsigned_abs() {
        let step = 1 + radius / 8;
        radius = if steps > 0 {
            radius + step
        } else {
            radius.saturating_sub(step)
        };
    }
    radius.min(crate::state::LARGEST_BRUSH)
}
