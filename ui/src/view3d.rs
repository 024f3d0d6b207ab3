//! The 3D view: the surface as splats, with the cameras of the frames and the suggestions, looked at from anywhere.
//!
//! A click on it becomes a click on the frame that shows that place best. While the camera rests, a layer of the field
//! shows what the field renders from there in place of the surface.

mod budget;
mod camera;
mod clicks;
mod cloud;
mod controls;
mod cpu;
mod gpu;
mod overlay;
mod pick;
mod shot;
mod steering;
mod targets;

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use egui::{CursorIcon, Pos2, Rect, Response, Role, Sense, Ui, WidgetInfo};
use glam::Quat;
use inplace_core::labels::Pixel;
use inplace_model::layer::{Layer, Look};
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands, Model};

pub use controls::switch;
pub use gpu::make_ready;

use crate::background::Background;
use crate::canvas::{Canvas, EntryColors, FieldView, FieldViewer, FrameView, field_words};
use crate::theme;
use crate::thumbnails::Thumbnails;
use budget::SplatBudget;
use camera::{Sight, level_axes};
use clicks::Told;
use cloud::{Prepared, Preparer};
use controls::Notice;
use cpu::Rasteriser;
use overlay::Mark;
use pick::Purpose;
use shot::{Shot, SplatLook};
use steering::Flight;

/// Seconds without a movement after which the picture is refined.
const REST: f64 = 0.15;
/// Depth of the frames' cameras as they are drawn, in radii of the scene.
const CAMERA_SIZE: f32 = 0.035;

/// A click that may yet be the first of a double click.
struct Click {
    /// Where it was.
    position: Pos2,
    question: pick::Question,
    /// When it is a click of its own.
    due: f64,
}

/// The 3D view with what it remembers between frames of the window.
pub struct View3d {
    preparer: Preparer,
    picker: Background<pick::Question, pick::Picked>,
    thumbnails: Thumbnails,
    budget: SplatBudget,
    /// How many splats the renderer drew in the last frame.
    drawn: Arc<AtomicUsize>,
    /// Draws them where there is no wgpu.
    rasteriser: Option<Rasteriser>,
    /// The field as seen from the camera, while a layer of it is shown.
    field: Option<FieldViewer>,
    /// The scene's level axes.
    level: Option<Quat>,
    /// Whether it was shown in the last frame of the window.
    was_shown: bool,
    last_sight: Option<Sight>,
    moved_at: f64,
    click: Option<Click>,
    /// Whether the finger that presses is one of two: lifting it is no click.
    pinched: bool,
    /// Where a click waits for its answer.
    asked: Option<Pos2>,
    told: Option<Told>,
    object_colors: EntryColors,
    flight: Option<Flight>,
    /// The suggested place that was gone to last.
    at_suggestion: Option<(usize, Pixel)>,
    notice: Option<Notice>,
}

impl View3d {
    /// A view for this window.
    pub fn new(ctx: &egui::Context) -> Self {
        Self {
            preparer: Preparer::new(ctx.clone()),
            picker: Background::new(ctx.clone(), "pick", pick::answer),
            thumbnails: Thumbnails::new(ctx.clone(), [192.0, 144.0]),
            budget: SplatBudget::default(),
            drawn: Arc::default(),
            rasteriser: None,
            field: None,
            level: None,
            was_shown: false,
            last_sight: None,
            moved_at: f64::NEG_INFINITY,
            click: None,
            pinched: false,
            asked: None,
            told: None,
            object_colors: EntryColors::default(),
            flight: None,
            at_suggestion: None,
            notice: None,
        }
    }

    /// It is not shown in this frame of the window. What was clicked on is labelled all the same.
    pub fn rest(&mut self, workspace: &Workspace, commands: &mut Commands) {
        self.was_shown = false;
        if let Some(click) = self.click.take() {
            self.picker.ask(click.question);
        }
        while let Some(picked) = self.picker.next() {
            if let Purpose::Label(chosen) = picked.purpose
                && Arc::ptr_eq(&picked.scene, &workspace.scene)
                && let Some((frame, pixel)) = picked.hit.and_then(|hit| hit.seen)
            {
                commands.push(Command::LabelSeen(frame, pixel, chosen));
            }
        }
        self.asked = None;
        self.told = None;
        self.flight = None;
        self.field = None;
    }

    /// Draws the view and follows the pointer and the keys; returns where it was drawn.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        model: &Model,
        workspace: &Workspace,
        canvas: &mut Canvas,
        commands: &mut Commands,
    ) -> Rect {
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, "3D view"));
        self.take_focus(ui, &response, workspace);
        let painter = ui.painter_at(rect);
        let background = theme::of(ui.visuals()).canvas;
        painter.rect_filled(rect, 0, background);
        self.thumbnails.collect();
        let level = *self.level.get_or_insert_with(|| level_axes(&workspace.scene));
        let objects = canvas.frame().and_then(FrameView::scene_objects);
        let objects = objects.filter(|_| model.settings.layer == Layer::Objects);
        let Some(prepared) = self.preparer.get(workspace.surface.as_ref(), objects).cloned() else {
            let words = match workspace.surface {
                None => {
                    "The surface of the scene is shown here as soon as it is found; until then you can label the frames"
                }
                Some(_) => "Preparing the surface",
            };
            controls::empty(ui, rect, words);
            return rect;
        };
        let now = ui.input(|input| input.time);
        let before = workspace.space.camera_or_fitted(prepared.cloud.ball, level);
        let mut camera = before;
        let arrived = self.fly(ui, &mut camera, workspace, now, commands);
        self.follow(ui, &response, &mut camera, rect, workspace);
        let sight = Sight::new(&camera, rect);
        self.take_answers(ui, &camera, (workspace, &prepared), now, commands);
        self.follow_suggestion(ui, &camera, (workspace, &prepared), now);
        let pointer = response.hover_pos();
        let pointed =
            pointer.and_then(|pointer| overlay::mark_at(workspace, &prepared.surface, &sight, pointer));
        if !canvas.in_menu {
            self.follow_clicks(ui, &response, (workspace, &prepared), (camera, sight), pointed);
        }

        let mut layer = model.settings.layer;
        let moving = self.is_moving(ui, sight, now);
        let look = Look {
            layer: if model.overlay_hidden { Layer::Color } else { layer },
            ..model.settings.look()
        };
        let is_field = look.layer.is_rendered();
        if !is_field {
            self.field = None;
        }
        let view = is_field
            .then(|| self.field_from(ui, workspace, sight, moving, commands))
            .flatten();
        if let Some(view) = &view {
            canvas.paint_view(&painter, rect, view, look, workspace.document.palette());
        } else {
            let look = SplatLook {
                layer: look.layer.of_field(false),
                opacity: look.opacity,
                see_through: workspace.space.see_through,
                background,
            };
            self.paint(
                ui,
                &painter,
                (workspace, &prepared),
                (sight, moving),
                look,
                canvas.target(),
            );
        }
        if !model.overlay_hidden {
            if workspace.space.cameras {
                let depth = CAMERA_SIZE * prepared.cloud.ball.radius;
                overlay::cameras(&painter, workspace, &sight, depth, pointed);
            }
            overlay::suggestions(&painter, workspace, &prepared.surface, &sight);
        }
        if let Some(position) = self.click.as_ref().map(|click| click.position).or(self.asked) {
            overlay::ring(&painter, position, theme::of(ui.visuals()).accent);
        }
        if response.has_focus() {
            let ring = egui::Stroke::new(1.0, theme::of(ui.visuals()).accent);
            painter.rect_stroke(rect, 0, ring, egui::StrokeKind::Inside);
        }
        self.show_cursor(ui, &response, pointed, workspace);

        let mut space = workspace.space;
        if camera != before {
            space.camera = Some(camera);
        }
        space.shown = !arrived;
        let words = is_field.then(|| field_words(workspace, view.as_ref(), layer));
        let fly = controls::show(ui, rect, &mut space, &mut layer, words.as_deref());
        if layer != model.settings.layer {
            commands.push(Command::ChooseLayer(layer));
        }
        if fly {
            self.fly_to(workspace.frame_index, (workspace, &prepared), camera, now, None);
            ui.ctx().request_repaint();
        }
        controls::gestures(ui, rect);
        if let Some(notice) = &self.notice {
            if now < notice.until {
                controls::notice(ui, rect, notice, workspace, &mut self.thumbnails);
                ui.ctx().request_repaint_after_secs((notice.until - now) as f32);
            } else {
                self.notice = None;
            }
        }
        if space != workspace.space {
            commands.push(Command::SetSpace(space));
        }
        rect
    }

    /// The field as seen from here, asked for while the camera rests; `None` until it is ready.
    fn field_from(
        &mut self,
        ui: &Ui,
        workspace: &Workspace,
        sight: Sight,
        moving: bool,
        commands: &mut Commands,
    ) -> Option<FieldView> {
        let new = || FieldViewer::new(ui.ctx().clone());
        let field = self.field.get_or_insert_with(new);
        field.follow(workspace, sight.viewpoint(), !moving, commands);
        field.view().cloned()
    }

    fn paint(
        &mut self,
        ui: &Ui,
        painter: &egui::Painter,
        (workspace, prepared): (&Workspace, &Prepared),
        (sight, moving): (Sight, bool),
        look: SplatLook,
        target: Option<wgpu::TextureFormat>,
    ) {
        let palette = workspace.document.palette();
        let palette = match &prepared.objects {
            Some(objects) => self.object_colors.follow(&objects.entries, palette),
            None => palette,
        };
        let shot = Shot {
            prepared: prepared.clone(),
            sight,
            look,
            palette: palette.clone(),
        };
        let since = ui.input(|input| input.unstable_dt);
        let budget = self.budget.next(self.drawn.load(Ordering::Relaxed), since);
        let Some(target) = target else {
            let new = || Rasteriser::new(ui.ctx().clone());
            let rasteriser = self.rasteriser.get_or_insert_with(new);
            let drawn = rasteriser.paint(painter, &shot, moving, budget);
            self.drawn.store(drawn, Ordering::Relaxed);
            return;
        };
        let draw = gpu::Draw {
            shot,
            moving,
            budget,
            target,
            drawn: Arc::clone(&self.drawn),
            ctx: ui.ctx().clone(),
        };
        painter.add(egui_wgpu::Callback::new_paint_callback(sight.area, draw));
    }

    /// Whether the camera has moved a moment ago; wakes the window when it has come to rest.
    fn is_moving(&mut self, ui: &Ui, sight: Sight, now: f64) -> bool {
        if self.last_sight != Some(sight) {
            self.last_sight = Some(sight);
            self.moved_at = now;
        }
        let left = self.moved_at + REST - now;
        if left > 0.0 {
            ui.ctx().request_repaint_after_secs(left as f32);
        }
        left > 0.0
    }

    fn show_cursor(&mut self, ui: &Ui, response: &Response, pointed: Option<Mark>, workspace: &Workspace) {
        if response.dragged() {
            ui.ctx().set_cursor_icon(CursorIcon::Grabbing);
        } else if pointed.is_some() {
            ui.ctx().set_cursor_icon(CursorIcon::PointingHand);
        } else if response.hovered() {
            ui.ctx().set_cursor_icon(CursorIcon::Crosshair);
        }
        if let Some(Mark::Frame(frame)) = pointed.filter(|_| !response.dragged()) {
            let thumbnail = self.thumbnails.frame(workspace, frame, Look::PLAIN);
            let stem = workspace.scene.frames.get(frame).map(|frame| &frame.stem);
            response.clone().on_hover_ui_at_pointer(|ui| {
                if let Some(thumbnail) = &thumbnail {
                    ui.image(thumbnail);
                }
                ui.label(stem.map_or("", String::as_str));
            });
        }
    }
}
