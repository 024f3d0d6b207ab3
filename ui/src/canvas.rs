//! The frame canvas: the image with its layer, the strokes and suggestions over it, and drawing on it.

mod composed;
mod content;
mod cpu;
mod field_view;
mod frame_view;
mod gpu;
mod hover;
mod legend;
mod objects;
mod overlay;
mod pick;
mod plane;
mod preparing;
mod region;
mod shapes;
mod split;
mod strokes;
mod tools;
mod view;

use std::collections::BTreeMap;
use std::sync::Arc;

use egui::{Align2, CursorIcon, Event, Key, Pos2, Rect, Role, Sense, Ui, WidgetInfo, vec2};
use inplace_core::labels::Pixel;
use inplace_model::layer::{Layer, Look};
use inplace_model::palette::Palette;
use inplace_model::settings::Settings;
use inplace_model::text::counted;
use inplace_model::tool::{DrawnLine, Tool, stepped_brush};
use inplace_model::versioned::Versioned;
use inplace_model::view::View;
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands, Model};

pub use cpu::{fitted, mix, pictures, whole};
pub use field_view::{FieldView, FieldViewer};
pub use frame_view::FrameView;
pub use gpu::{UploadClock, make_ready};
pub use legend::field_words;
pub use objects::{EntryColors, SceneObjects, object_color, object_words};
pub use overlay::{marker, region};
pub use shapes::stroke_color;
pub use split::{below_menus, layer_menu};
pub use view::rect_of;

use crate::input_order::InputOrder;
use crate::{keys, theme};
use content::Content;
use hover::HoverLayer;
use strokes::StrokeLayer;
use tools::{CanvasPlace, Draft, Gesture, Outcome};
use view::Placement;

/// Name of the canvas for screen readers and tests.
pub const CANVAS_NAME: &str = "Frame canvas";

/// How frames get onto the screen.
enum Renderer {
    /// By a wgpu paint callback.
    Gpu(wgpu::TextureFormat),
    /// As one texture for each side, composed on the CPU.
    Cpu(Box<[composed::Side; gpu::SIDES]>),
}

/// The canvas.
pub struct Canvas {
    renderer: Renderer,
    /// What is known of the frame in view, while a scene is open.
    frame: Option<FrameView>,
    gesture: Gesture,
    /// The strokes over the main layer, and over the one beside it.
    strokes: [StrokeLayer; 2],
    outline: HoverLayer,
    /// The scene and the frame that the gesture is on; no frame while the 3D view is shown.
    place: (u64, Option<usize>),
    /// What was begun on other frames of the scene, and goes on when they are in view again.
    drafts: BTreeMap<usize, Draft>,
    /// The brush's radius as it was last, and until when it is shown, in seconds.
    brush: (u32, f64),
    /// What has reached the renderer.
    pub(crate) clock: UploadClock,
    /// Where it was drawn last.
    pub(crate) rect: Rect,
    /// Where controls lie on the canvas.
    covered: Vec<Rect>,
    /// The pixel of the frame under the pointer.
    pub pointed_at: Option<Pixel>,
    /// The pixel where a press would begin to label or erase.
    hovered: Option<Pixel>,
    /// The suggested place that keys answer.
    suggested: Option<(usize, Pixel)>,
    /// Where the pointer has rested since the person went there: it points at nothing.
    resting: Option<Pos2>,
    /// Whether a menu was open when the frame of the window began: a click beside a menu only closes it.
    pub(crate) in_menu: bool,
}

/// How long the size of the brush is shown after a change, in seconds.
const BRUSH_SHOWN: f64 = 1.2;

impl Canvas {
    /// A canvas drawn by wgpu where there is a target format, else on the CPU.
    pub fn new(target: Option<wgpu::TextureFormat>) -> Self {
        Self {
            renderer: target.map_or_else(|| Renderer::Cpu(Box::default()), Renderer::Gpu),
            frame: None,
            gesture: Gesture::default(),
            strokes: Default::default(),
            outline: HoverLayer::default(),
            place: (0, None),
            drafts: BTreeMap::new(),
            brush: (0, f64::NEG_INFINITY),
            clock: UploadClock::default(),
            rect: Rect::NOTHING,
            covered: Vec::new(),
            pointed_at: None,
            hovered: None,
            suggested: None,
            resting: None,
            in_menu: false,
        }
    }

    /// The strokes of the main layer as they were painted last.
    pub fn strokes(&self) -> &StrokeLayer {
        &self.strokes[0]
    }

    /// What is known of the frame in view of the open scene.
    pub fn frame(&self) -> Option<&FrameView> {
        self.frame.as_ref()
    }

    /// Follows the open scene: takes over what is new, and has whatever the layers that are shown need made, off this
    /// thread.
    pub fn prepare(&mut self, ctx: &egui::Context, model: &Model, commands: &mut Commands) {
        let Some(workspace) = model.workspace() else {
            self.frame = None;
            return;
        };
        let is_other = |frame: &FrameView| frame.serial != workspace.serial;
        if self.frame.as_ref().is_none_or(is_other) {
            self.frame = Some(FrameView::new(workspace, ctx));
        }
        let settings = &model.settings;
        let other = settings.compare.then_some(settings.other_layer);
        let mut layers: Vec<Layer> = [Some(settings.layer), other].into_iter().flatten().collect();
        let objects = layers.contains(&Layer::Objects) || workspace.lists_objects();
        if workspace.space.shown {
            layers.clear();
        }
        if let Some(frame) = &mut self.frame {
            frame.follow(workspace, (&layers, objects), commands);
        }
        if workspace.hover.pixel != self.hovered {
            commands.push(Command::Hover(self.hovered));
        }
    }

    /// Takes the keys out of the input that belong to what is being drawn: Escape drops it, Enter ends it, Backspace
    /// and undo take its last corner back. Without anything being drawn, Escape lets go of the selected stroke.
    pub fn take_keys(&mut self, ctx: &egui::Context, model: &Model, commands: &mut Commands) {
        let Some(workspace) = model.workspace() else {
            return;
        };
        self.turn_to(workspace);
        self.in_menu = egui::Popup::is_any_open(ctx);
        if keys::are_taken(ctx) {
            return;
        }
        // Enter presses the control that has the keyboard, if one has.
        let focused = ctx.egui_wants_keyboard_input();
        let on = (workspace, model.settings.brush);
        ctx.input_mut(|input| {
            input.events.retain(|event| match keys::pressed(event) {
                Some((modifiers, key)) => !self.take_key(key, modifiers, focused, on, commands),
                None => true,
            });
        });
    }

    /// Returns whether the key was meant for what is being drawn.
    fn take_key(
        &mut self,
        key: Key,
        modifiers: egui::Modifiers,
        focused: bool,
        (workspace, brush): (&Workspace, u32),
        commands: &mut Commands,
    ) -> bool {
        let drafted = self.gesture.draft().is_some();
        // What waits unfinished on the frame of a suggestion leaves it the keys that answer.
        let answers = workspace.suggestions().is_active();
        match key {
            Key::Escape if self.gesture.is_drawing() && !answers => self.gesture.cancel(),
            Key::Escape if workspace.selected.is_some() => commands.push(Command::SelectStroke(None)),
            Key::Enter if drafted && !focused && !answers => {
                let draft = self.gesture.draft().cloned();
                if let Some(line) = self.gesture.finish() {
                    commands.push(drawn((&mut self.gesture, draft), (line, false), workspace, brush));
                }
            }
            Key::Backspace if drafted => self.gesture.take_back(),
            Key::Z if drafted && modifiers.command && !modifiers.shift => self.gesture.take_back(),
            _ => return false,
        }
        true
    }

    /// What is being drawn stays on its frame.
    fn turn_to(&mut self, workspace: &Workspace) {
        let frame = (!workspace.space.shown).then_some(workspace.frame_index);
        let place = (workspace.serial, frame);
        if self.place == place {
            return;
        }
        if self.place.0 == place.0 {
            let draft = frame.and_then(|frame| self.drafts.remove(&frame));
            let before = self.gesture.swap_draft(draft);
            self.drafts.extend(self.place.1.zip(before));
        } else {
            self.drafts.clear();
            self.gesture.cancel();
        }
        self.place = place;
    }

    /// The window's pixel format where wgpu draws it.
    pub fn target(&self) -> Option<wgpu::TextureFormat> {
        match self.renderer {
            Renderer::Gpu(target) => Some(target),
            Renderer::Cpu(_) => None,
        }
    }

    /// Another view has taken the canvas's place.
    pub fn stand_aside(&mut self, ctx: &egui::Context, workspace: &Workspace, rect: Rect) {
        InputOrder::set_canvas(ctx, None, &[]);
        self.turn_to(workspace);
        self.rect = rect;
        self.hovered = None;
        self.gesture.cancel();
    }

    /// Draws the frame in view and follows the pointer.
    pub fn show(&mut self, ui: &mut Ui, model: &Model, workspace: &Workspace, commands: &mut Commands) {
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        self.rect = rect;
        response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, CANVAS_NAME));
        let painter = ui.painter_at(rect);
        let background = painter.add(egui::Shape::Noop);
        let color = theme::of(ui.visuals()).canvas;
        painter.set(background, egui::Shape::rect_filled(rect, 0, color));
        (self.pointed_at, self.hovered) = (None, None);
        let Some(frame) = workspace.frame() else {
            return;
        };
        self.turn_to(workspace);
        let size = vec2(frame.camera.width as f32, frame.camera.height as f32);
        let hover = response
            .contains_pointer()
            .then(|| ui.ctx().pointer_latest_pos())
            .flatten();
        let around = CanvasPlace {
            canvas: rect,
            size,
            tool: model.settings.tool,
            pan_key: ui.input(|input| input.key_down(Key::Space)) && !keys::are_taken(ui.ctx()),
            cursor: hover,
            line_end: workspace.line_end(),
            time: ui.input(|input| input.time),
        };
        let corners = |gesture: &Gesture| gesture.draft().map(|draft| draft.points.len());
        let before = corners(&self.gesture);
        let view = self.follow(ui, workspace, &around, &model.settings, commands);
        let draws = self.gesture.line().is_some() || corners(&self.gesture) != before;
        if draws && workspace.suggestions().is_active() {
            // Whoever draws has turned to something else, also before the line is finished.
            commands.push(Command::LeaveSuggestions);
        }
        let placement = Placement::new(view, rect, size);
        let parts = split::parts(rect, &model.settings);
        let mut ready = true;
        for (side, part) in parts.iter().enumerate() {
            let mut look = model.settings.look();
            look.layer = if model.overlay_hidden {
                Layer::Color
            } else {
                part.layer
            };
            let Some(known) = &self.frame else {
                continue;
            };
            let Some(content) = known.content(look.layer, workspace.document.palette()) else {
                continue;
            };
            let missing = known.unreadable();
            if let Some(sentence) = missing.filter(|_| content.picture.is_none()) {
                overlay::sentence(ui, part.clip, side, sentence);
                ready = false;
                continue;
            }
            ready &= self.paint_frame(&painter.with_clip_rect(part.clip), side, content, placement, look);
        }
        if ready {
            // Most of the canvas is image: filling what it covers would be in vain.
            painter.set(background, shapes::around(rect, placement.rect(), color));
        }
        // For the instant in which the image of the frame before is still there.
        if ready && !model.overlay_hidden {
            for (part, strokes) in parts.iter().zip(&mut self.strokes) {
                let painter = painter.with_clip_rect(part.clip);
                strokes.paint(&painter, workspace, placement, part.layer == Layer::Disagreement);
                let known = self.frame.as_ref().filter(|_| part.layer == Layer::Objects);
                if let Some(plane) = known.and_then(FrameView::objects) {
                    let document = &workspace.document;
                    let strokes = document.strokes_on(workspace.frame_index);
                    let marks: Vec<Pixel> = strokes.filter_map(|(_, stroke)| stroke.first_point()).collect();
                    plane.paint_names(&painter, placement, document.palette(), &marks);
                }
            }
            self.outline.paint(&painter, workspace, placement);
            overlay::suggestions(&painter, workspace, placement);
            overlay::audited(&painter, workspace, placement);
        }
        if let Some(line) = self.gesture.line() {
            overlay::line(&painter, workspace, placement, line, model.settings.brush);
        }
        if let Some(draft) = self.gesture.draft() {
            let next = hover.filter(|_| model.settings.tool == draft.tool && !self.gesture.is_panning());
            overlay::draft(&painter, workspace, placement, draft, next, model.settings.brush);
            draft_note(ui, &painter, draft);
        }
        if let Some(known) = &self.frame
            && model.settings.legend
            && !model.overlay_hidden
        {
            let asked: Vec<Pos2> = overlay::asked(workspace, placement).collect();
            for (side, &part) in parts.iter().enumerate() {
                legend::show(ui, (workspace, known), side, part, &asked);
            }
        }
        self.covered = split::show(ui, rect, (&model.settings, model.is_compared()), commands);
        InputOrder::set_canvas(ui.ctx(), Some(rect), &self.covered);
        // Wherever it is: at first nothing may be under it yet.
        let rests = self.rests(workspace, ui.input(|input| input.pointer.latest_pos()));
        let on_image = |position: &Pos2| !self.covered.iter().any(|rect| rect.contains(*position));
        if let Some(position) = hover.filter(on_image) {
            self.pointed_at = placement.pixel_at(position);
            let line = ui.input(|input| input.modifiers.shift) && around.line_end.is_some();
            let is_busy = self.gesture.is_active() || around.pan_key || line || rests || self.in_menu;
            self.hovered = self.pointed_at.filter(|_| !is_busy && !model.overlay_hidden);
            self.show_cursor(&painter, model, workspace, placement, position, &around);
        }
        self.show_brush_size(ui, &painter, &model.settings, placement, hover);
    }

    /// Whether the pointer has rested since the person went to the suggestion that keys answer now.
    fn rests(&mut self, workspace: &Workspace, pointer: Option<Pos2>) -> bool {
        let at_hand = workspace.suggestions().place_at_hand();
        let suggested = at_hand.map(|place| (place.frame, place.pixel));
        if suggested != self.suggested {
            (self.suggested, self.resting) = (suggested, pointer.filter(|_| suggested.is_some()));
        }
        self.resting = self.resting.filter(|_| self.resting == pointer);
        self.resting.is_some()
    }

    /// Shows the size of the brush for a moment when it changes.
    fn show_brush_size(
        &mut self,
        ui: &Ui,
        painter: &egui::Painter,
        settings: &Settings,
        placement: Placement,
        hover: Option<Pos2>,
    ) {
        let now = ui.input(|input| input.time);
        let (radius, until) = self.brush;
        if radius != settings.brush {
            let first = until == f64::NEG_INFINITY;
            self.brush = (settings.brush, if first { now } else { now + BRUSH_SHOWN });
        }
        let left = self.brush.1 - now;
        if left <= 0.0 {
            return;
        }
        ui.ctx().request_repaint_after_secs(left as f32);
        let center = hover.unwrap_or_else(|| painter.clip_rect().center());
        let half = ((settings.brush as f32 + 0.5) * placement.zoom).max(3.0);
        if hover.is_none() {
            painter.circle_stroke(center, half + 1.0, egui::Stroke::new(1.0, shapes::HALO));
            painter.circle_stroke(center, half, egui::Stroke::new(1.5, egui::Color32::WHITE));
        }
        let below = center + vec2(0.0, half + 10.0);
        let size = format!("Brush {} px", settings.brush);
        overlay::note(painter, below, Align2::CENTER_TOP, &size);
    }

    /// Follows the pointer events of this frame; returns the view after them.
    fn follow(
        &mut self,
        ui: &Ui,
        workspace: &Workspace,
        around: &CanvasPlace,
        settings: &Settings,
        commands: &mut Commands,
    ) -> View {
        let mut view = workspace.view;
        let layer = ui.layer_id();
        let (covered, in_menu) = (&self.covered, self.in_menu);
        let reachable = |position| {
            !in_menu
                && around.canvas.contains(position)
                && !covered.iter().any(|rect| rect.contains(position))
                && ui.ctx().layer_id_at(position) == Some(layer)
        };
        let before = view;
        let mut brush = settings.brush;
        let events = ui.input(|input| input.events.clone());
        for event in &events {
            let at_pointer = matches!(event, Event::MouseWheel { .. } | Event::Zoom(_));
            if at_pointer && !around.cursor.is_some_and(reachable) {
                continue;
            }
            if matches!(event, Event::PointerButton { pressed: true, pos, .. } if reachable(*pos)) {
                // Takes the keyboard from whatever has it.
                ui.memory_mut(egui::Memory::stop_text_input);
            }
            let draft = self.gesture.draft().cloned();
            match self.gesture.follow(event, view, around, reachable) {
                Some(Outcome::Finished(line)) => {
                    commands.push(drawn((&mut self.gesture, draft), (line, false), workspace, brush));
                }
                Some(Outcome::FinishedObject(line)) => {
                    commands.push(drawn((&mut self.gesture, draft), (line, true), workspace, brush));
                }
                Some(Outcome::Moved(moved)) => view = moved,
                Some(Outcome::Picked(position)) => {
                    let zoom = around.placement(view).zoom;
                    let strokes = workspace.document.strokes_on(workspace.frame_index);
                    let seen = strokes.filter(|(id, stroke)| !workspace.is_stroke_hidden(*id, stroke));
                    let picked = pick::stroke_at(seen, position, zoom);
                    commands.push(Command::SelectStroke(picked));
                }
                Some(Outcome::Brush(steps)) => {
                    brush = stepped_brush(brush, steps);
                    commands.push(Command::SetBrush(brush));
                }
                None => {}
            }
        }
        // Only now: the first finger has pressed by then.
        let touch = ui.input(egui::InputState::multi_touch);
        if let Some(touch) = touch.filter(|touch| reachable(touch.center_pos)) {
            view = self.gesture.pinch(&touch, view, around);
        }
        if view != before {
            commands.push(Command::SetView(view));
        }
        view
    }

    /// Paints a layer of a view of the field all over an area, for another view that has taken the canvas's place.
    pub fn paint_view(
        &mut self,
        painter: &egui::Painter,
        area: Rect,
        view: &FieldView,
        look: Look,
        palette: &Versioned<Arc<Palette>>,
    ) {
        let content = view.content(look.layer, palette);
        let camera = &view.rendered.viewpoint.camera;
        let size = vec2(camera.width as f32, camera.height as f32);
        let placement = Placement {
            origin: area.min,
            zoom: area.width() / size.x,
            size,
        };
        self.paint_frame(&painter.with_clip_rect(area), 0, content, placement, look);
    }

    /// Paints one side of the canvas, which is what the painter is clipped to; `false` while the image is not
    /// ready, so that the one before stays.
    fn paint_frame(
        &mut self,
        painter: &egui::Painter,
        side: usize,
        mut content: Content,
        placement: Placement,
        look: Look,
    ) -> bool {
        let clock = UploadClock::clone(&self.clock);
        let is_ready = content.picture.is_some();
        match &mut self.renderer {
            Renderer::Gpu(target) => {
                if !is_ready {
                    content.over = None;
                }
                let draw = gpu::Draw {
                    side,
                    content,
                    placement,
                    look,
                    target: *target,
                    clock,
                };
                painter.add(egui_wgpu::Callback::new_paint_callback(painter.clip_rect(), draw));
            }
            Renderer::Cpu(sides) => sides[side].paint(painter, &content, placement, look, &clock),
        }
        is_ready
    }

    fn show_cursor(
        &self,
        painter: &egui::Painter,
        model: &Model,
        workspace: &Workspace,
        placement: Placement,
        position: Pos2,
        around: &CanvasPlace,
    ) {
        let ctx = painter.ctx();
        if self.gesture.is_panning() {
            ctx.set_cursor_icon(CursorIcon::Grabbing);
        } else if around.pan_key {
            ctx.set_cursor_icon(CursorIcon::Grab);
        } else if placement.pixel_at(position).is_some() || self.gesture.draft().is_some() {
            let tool = self.gesture.line().map_or(model.settings.tool, |line| line.tool);
            ctx.set_cursor_icon(match tool {
                Tool::Select => CursorIcon::Default,
                _ => CursorIcon::Crosshair,
            });
            let straight = around.line_end.filter(|_| {
                tool == Tool::Brush && !self.gesture.is_active() && ctx.input(|input| input.modifiers.shift)
            });
            if let Some(from) = straight {
                overlay::straight_line(painter, placement, from, position);
            }
            let radius = model.settings.brush;
            overlay::cursor(painter, workspace, placement, position, tool, radius);
        }
    }
}

/// Says at the lower edge how what is being drawn ends.
fn draft_note(ui: &Ui, painter: &egui::Painter, draft: &Draft) {
    let what = if draft.tool == Tool::Polygon {
        "Polygon"
    } else {
        "Polyline"
    };
    let corners = counted(draft.corners().count(), "corner", "corners");
    let text = format!("{what}, {corners}: Enter ends it, Backspace takes a corner back, Escape drops it");
    let canvas = painter.clip_rect();
    let place = canvas.center_bottom() - vec2(0.0, 12.0);
    overlay::note(painter, place, Align2::CENTER_BOTTOM, &text);
    let id = ui.scope_id().with("draft");
    let response = ui.interact(Rect::from_center_size(place, vec2(1.0, 1.0)), id, Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &text));
}

/// Draws a line, on a new object or not. What is about to be refused stays the draft that it was, so that its corners are
/// not lost.
fn drawn(
    (gesture, draft): (&mut Gesture, Option<Draft>),
    (line, on_new_object): (DrawnLine, bool),
    workspace: &Workspace,
    brush: u32,
) -> Command {
    if draft.is_some() && workspace.refuses(&line, brush, on_new_object) {
        gesture.swap_draft(draft);
    }
    match on_new_object {
        true => Command::DrawObject(line),
        false => Command::Draw(line),
    }
}

#[cfg(test)]
mod tests;
