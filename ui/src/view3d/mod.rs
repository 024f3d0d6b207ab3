//! The 3D view: the surface as splats, with the cameras of the frames and the suggestions, looked at from anywhere.
//!
//! A click on it becomes a click on the frame that shows that place best.

mod camera;
mod clicks;
mod cloud;
mod controls;
mod cpu;
mod flight;
mod gpu;
mod overlay;
mod pace;
mod pick;
mod targets;

use std::sync::Arc;

use egui::{
    CursorIcon, EventFilter, Key, PointerButton, Pos2, Rect, Response, Role, Sense, Ui, WidgetInfo, vec2,
};
use glam::{Quat, Vec3};

pub use camera::{Direction, OrbitCamera};
pub use cloud::Answer;
pub use controls::switch;

use crate::action::{Action, Actions};
use crate::canvas::{Layer, Look};
use crate::english::view3d as english;
use crate::state::AppState;
use crate::theme;
use crate::thumbnails::{Source, Subject, Thumbnails};
use crate::workspace::Workspace;
use camera::{Ball, Sight, level_axes};
use clicks::Click;
use cloud::{Prepared, Preparer};
use controls::Notice;
use flight::Flight;
use gpu::SplatLook;
use overlay::Mark;
use pace::{Pace, Progress};
use pick::Picker;

/// Seconds without a movement after which the picture is refined.
const REST: f64 = 0.15;
/// Points of a drag that an arrow key stands for, and how much nearer + comes.
const KEY_DRAG: f32 = 30.0;
const KEY_ZOOM: f32 = 1.2;
/// Points of the wheel that come e times as near.
const WHEEL_POINTS: f32 = 250.0;
/// Depth of the frames' cameras as they are drawn, in radii of the scene.
const CAMERA_SIZE: f32 = 0.035;

/// What the 3D view of a scene shows.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Space {
    /// Whether it is shown in place of the frame.
    pub shown: bool,
    /// Whether what faces away is left out.
    pub see_through: bool,
    /// Whether the cameras of the frames are drawn.
    pub cameras: bool,
    /// `None` = all of the scene is fitted into the view.
    camera: Option<OrbitCamera>,
    /// Where a fitted view looks.
    direction: Direction,
}

impl Default for Space {
    fn default() -> Self {
        Self {
            shown: false,
            see_through: true,
            cameras: true,
            camera: None,
            direction: Direction::default(),
        }
    }
}

impl Space {
    /// Shows all of the scene from the side that it is looked at from.
    pub fn fit(&mut self) {
        if let Some(camera) = self.camera.take() {
            self.direction = camera.direction;
        }
    }

    /// The camera; `None` while all of the scene is fitted into the view.
    pub fn camera(&self) -> Option<&OrbitCamera> {
        self.camera.as_ref()
    }

    fn camera_or_fitted(&self, ball: Ball, level: Quat) -> OrbitCamera {
        self.camera
            .unwrap_or_else(|| OrbitCamera::fitted(ball, self.direction, level))
    }
}

/// The 3D view with what it remembers between frames of the window.
pub struct View3d {
    preparer: Preparer,
    picker: Picker,
    thumbnails: Thumbnails,
    pace: Pace,
    progress: Arc<Progress>,
    /// The scene shown last, and its level axes.
    scene: Option<(u64, Quat)>,
    /// Whether it was shown in the last frame of the window.
    was_shown: bool,
    last_sight: Option<Sight>,
    moved_at: f64,
    click: Option<Click>,
    /// Where a click waits for its answer.
    asked: Option<Pos2>,
    flight: Option<Flight>,
    /// The suggestion that was gone to last.
    at_suggestion: Option<usize>,
    notice: Option<Notice>,
}

impl View3d {
    /// A view for this window.
    pub fn new(ctx: &egui::Context) -> Self {
        Self {
            preparer: Preparer::new(ctx.clone()),
            picker: Picker::new(ctx.clone()),
            thumbnails: Thumbnails::new(ctx.clone(), [192, 144]),
            pace: Pace::default(),
            progress: Arc::default(),
            scene: None,
            was_shown: false,
            last_sight: None,
            moved_at: f64::NEG_INFINITY,
            click: None,
            asked: None,
            flight: None,
            at_suggestion: None,
            notice: None,
        }
    }

    /// It is not shown in this frame of the window.
    pub fn rest(&mut self) {
        self.was_shown = false;
        self.click = None;
        self.asked = None;
        self.flight = None;
    }

    /// No scene is open: keeps nothing of the last one.
    pub fn forget(&mut self) {
        if self.scene.take().is_some() {
            self.rest();
            self.preparer.get(None);
            self.thumbnails.clear();
            self.last_sight = None;
            self.notice = None;
        }
    }

    /// Draws the view and follows the pointer and the keys; returns where it was drawn.
    pub fn show(
        &mut self,
        ui: &mut Ui,
        state: &AppState,
        workspace: &Workspace,
        target: Option<wgpu::TextureFormat>,
        actions: &mut Actions,
    ) -> Rect {
        let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::click_and_drag());
        response.widget_info(|| WidgetInfo::labeled(Role::Canvas, true, english::NAME));
        self.take_focus(ui, &response, workspace);
        let painter = ui.painter_at(rect);
        let background = theme::canvas(ui.visuals());
        painter.rect_filled(rect, 0, background);
        self.thumbnails.collect(ui.ctx());
        let level = self.level(workspace);
        let prepared = self.preparer.get(workspace.answer()).cloned();
        // Another scene's splats may still come.
        let own = |prepared: &Prepared| prepared.answer.scene == workspace.serial();
        let Some(prepared) = prepared.filter(own) else {
            let waits = workspace.answer().is_none();
            controls::empty(
                ui,
                rect,
                if waits {
                    english::NO_SURFACE
                } else {
                    english::PREPARING
                },
            );
            return rect;
        };
        let now = ui.input(|input| input.time);
        let before = workspace.space.camera_or_fitted(prepared.cloud.ball, level);
        let mut camera = before;
        let arrived = self.fly(ui, &mut camera, now, actions);
        self.follow(ui, &response, &mut camera, rect, workspace);
        let sight = camera.sight(rect);
        self.take_answers(ui, &camera, workspace, now, actions);
        self.follow_suggestion(ui, &camera, (workspace, &prepared), now);
        let pointer = response.hover_pos();
        let pointed = pointer.and_then(|pointer| {
            overlay::mark_at(
                workspace,
                &prepared.answer,
                &sight,
                workspace.space.cameras,
                pointer,
            )
        });
        self.follow_clicks(ui, &response, (workspace, &prepared), (camera, sight), pointed);

        self.paint(ui, &painter, state, (workspace, &prepared), sight, target);
        if !state.overlay_hidden {
            if workspace.space.cameras {
                let depth = CAMERA_SIZE * prepared.cloud.ball.radius;
                overlay::cameras(&painter, workspace, &sight, depth, pointed);
            }
            overlay::suggestions(&painter, workspace, &prepared.answer, &sight);
        }
        if let Some(position) = self.click.as_ref().map(|click| click.position).or(self.asked) {
            overlay::ring(&painter, position, theme::accent(ui.visuals()));
        }
        if response.has_focus() {
            let ring = egui::Stroke::new(1.0, theme::accent(ui.visuals()));
            painter.rect_stroke(rect, 0, ring, egui::StrokeKind::Inside);
        }
        self.show_cursor(ui, &response, pointed, workspace);

        let mut space = workspace.space;
        if camera != before {
            space.camera = Some(camera);
        }
        space.shown = !arrived;
        let fly = controls::show(ui, rect, &mut space);
        if fly {
            self.fly_to(workspace.frame_index(), (workspace, &prepared), camera, now, None);
            ui.ctx().request_repaint();
        }
        controls::gestures(ui, rect);
        if let Some(notice) = &self.notice {
            if now < notice.until {
                controls::notice(ui, rect, notice, workspace, &mut self.thumbnails);
                let left = std::time::Duration::from_secs_f64(notice.until - now);
                ui.ctx().request_repaint_after(left);
            } else {
                self.notice = None;
            }
        }
        if space != workspace.space {
            actions.push(Action::SetSpace(space));
        }
        rect
    }

    /// The view has the keyboard from when it is shown or pressed on, so that the arrow keys turn it.
    fn take_focus(&mut self, ui: &Ui, response: &Response, workspace: &Workspace) {
        if !self.was_shown {
            self.at_suggestion = workspace.at_suggestion();
        }
        let pressed = response.contains_pointer() && ui.input(|input| input.pointer.any_pressed());
        if !self.was_shown || pressed {
            response.request_focus();
        }
        self.was_shown = true;
        let arrows = EventFilter {
            horizontal_arrows: true,
            vertical_arrows: true,
            ..EventFilter::default()
        };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(response.id, arrows));
    }

    fn level(&mut self, workspace: &Workspace) -> Quat {
        match self.scene {
            Some((serial, level)) if serial == workspace.serial() => level,
            _ => {
                self.forget();
                self.was_shown = true;
                let level = level_axes(workspace.scene());
                self.scene = Some((workspace.serial(), level));
                level
            }
        }
    }

    /// Moves the camera as far as its flight has come; goes where it leads at the end, and returns whether that is to
    /// be seen in a frame.
    fn fly(&mut self, ui: &Ui, camera: &mut OrbitCamera, now: f64, actions: &mut Actions) -> bool {
        let Some(flight) = &self.flight else {
            return false;
        };
        *camera = flight.camera(now);
        self.moved_at = now;
        ui.ctx().request_repaint();
        if !flight.has_ended(now) {
            return false;
        }
        let then = flight.then;
        self.flight = None;
        if let Some(mark) = then {
            actions.push(match mark {
                Mark::Frame(frame) => Action::GoToFrame(frame),
                Mark::Suggestion(index) => Action::GoToSuggestion(index),
            });
        }
        then.is_some()
    }

    /// Starts a flight to where a frame was taken.
    fn fly_to(
        &mut self,
        frame: usize,
        (workspace, prepared): (&Workspace, &Prepared),
        from: OrbitCamera,
        now: f64,
        then: Option<Mark>,
    ) {
        let Some(shown) = workspace.scene().frames.get(frame) else {
            return;
        };
        let camera = &shown.camera;
        let middle = (camera.height / 2 * camera.width + camera.width / 2) as usize;
        let surface = &prepared.answer.surface;
        let node = surface.pixels.get(frame).and_then(|pixels| pixels.node(middle));
        let ball = prepared.cloud.ball;
        let distance = node
            .and_then(|node| surface.graph.nodes().get(node as usize))
            .map_or(ball.radius, |node| node.position.distance(shown.center()));
        // What meets nothing lies far outside of the scene.
        let distance = distance.min(2.0 * ball.radius);
        let to = OrbitCamera::at_frame(shown, from.level, distance);
        self.flight = Some(Flight::new(from, to, now, then));
    }

    /// Turns, moves and zooms as pointer and keys say.
    fn follow(
        &mut self,
        ui: &Ui,
        response: &Response,
        camera: &mut OrbitCamera,
        rect: Rect,
        workspace: &Workspace,
    ) {
        let before = *camera;
        let typing = ui.ctx().text_edit_focused();
        let pan_key = !typing && ui.input(|input| input.key_down(Key::Space));
        let drag = response.drag_delta();
        if response.dragged_by(PointerButton::Middle)
            || pan_key && response.dragged_by(PointerButton::Primary)
        {
            camera.pan(drag, rect);
        } else if response.dragged_by(PointerButton::Primary) {
            camera.orbit(drag);
        }
        if let Some(pointer) = response.hover_pos() {
            let (wheel, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
            let factor = (wheel / WHEEL_POINTS).exp() * pinch;
            if factor != 1.0 {
                camera.zoom_at(rect, pointer, factor);
            }
        }
        if !typing {
            let pressed = |key| ui.input(|input| !input.modifiers.command && input.key_pressed(key));
            if response.has_focus() {
                for (key, x, y) in [
                    (Key::ArrowLeft, 1.0, 0.0),
                    (Key::ArrowRight, -1.0, 0.0),
                    (Key::ArrowUp, 0.0, 1.0),
                    (Key::ArrowDown, 0.0, -1.0),
                ] {
                    if pressed(key) {
                        camera.orbit(KEY_DRAG * vec2(x, y));
                    }
                }
            }
            if pressed(Key::Plus) || pressed(Key::Equals) {
                camera.zoom_at(rect, rect.center(), KEY_ZOOM);
            }
            if pressed(Key::Minus) {
                camera.zoom_at(rect, rect.center(), 1.0 / KEY_ZOOM);
            }
        }
        // Whoever takes the wheel ends a flight.
        if *camera != before && workspace.space.shown {
            self.flight = None;
        }
    }

    /// Turns to the suggestion that the person went to last.
    fn follow_suggestion(
        &mut self,
        ui: &Ui,
        camera: &OrbitCamera,
        (workspace, prepared): (&Workspace, &Prepared),
        now: f64,
    ) {
        let at = workspace.at_suggestion();
        if at == self.at_suggestion {
            return;
        }
        self.at_suggestion = at;
        let mut places = overlay::suggestion_places(workspace, &prepared.answer);
        if let Some((_, place)) = places.find(|&(index, _)| Some(index) == at) {
            self.turn_to(ui, camera, place, now);
        }
    }

    /// Starts a flight that brings a place into the middle.
    fn turn_to(&mut self, ui: &Ui, camera: &OrbitCamera, pivot: Vec3, now: f64) {
        let to = OrbitCamera { pivot, ..*camera };
        self.flight = Some(Flight::new(*camera, to, now, None));
        ui.ctx().request_repaint();
    }

    fn paint(
        &mut self,
        ui: &Ui,
        painter: &egui::Painter,
        state: &AppState,
        (workspace, prepared): (&Workspace, &Prepared),
        sight: Sight,
        target: Option<wgpu::TextureFormat>,
    ) {
        let (palette, palette_serial) = workspace.document().palette();
        let look = SplatLook {
            layer: if state.overlay_hidden {
                Layer::Color
            } else {
                state.settings.layer
            },
            opacity: state.settings.opacity,
            see_through: workspace.space.see_through,
            background: theme::canvas(ui.visuals()),
        };
        let Some(target) = target else {
            cpu::draw(painter, prepared, &sight, look, palette);
            return;
        };
        let (now, since) = ui.input(|input| (input.time, input.unstable_dt));
        if self.last_sight != Some(sight) {
            self.last_sight = Some(sight);
            self.moved_at = now;
        }
        let moving = now - self.moved_at < REST;
        let draw = gpu::Draw {
            prepared: prepared.clone(),
            sight,
            look,
            palette: (Arc::clone(palette), (workspace.serial() << 32) | palette_serial),
            moving,
            budget: self.pace.budget(self.progress.drawn(), since),
            target,
            progress: Arc::clone(&self.progress),
            ctx: ui.ctx().clone(),
        };
        painter.add(egui_wgpu::Callback::new_paint_callback(sight.area, draw));
        if moving {
            // So that the picture is refined when the camera has come to rest.
            let left = (self.moved_at + REST - now).max(0.0);
            ui.ctx()
                .request_repaint_after(std::time::Duration::from_secs_f64(left));
        }
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
            let thumbnail = self.thumbnails.get(Subject::Frame(frame), 1, || plain(workspace));
            let stem = workspace.scene().frames.get(frame).map(|frame| &frame.stem);
            response.clone().on_hover_ui_at_pointer(|ui| {
                if let Some(thumbnail) = &thumbnail {
                    ui.image((thumbnail.texture.id(), thumbnail.texture.size_vec2()));
                }
                ui.label(stem.map_or("", String::as_str));
            });
        }
    }
}

/// The colour image alone.
fn plain(workspace: &Workspace) -> Source {
    Source {
        scene: Arc::clone(workspace.scene()),
        map: None,
        palette: Arc::clone(workspace.document().palette().0),
        look: Look {
            layer: Layer::Color,
            opacity: 0.0,
            outlines: false,
        },
    }
}
