//! Moving the 3D view's camera: by pointer and keys, and in flights to frames and suggestions.

use egui::{EventFilter, Key, PointerButton, Rect, Response, Ui};
use glam::Vec3;
use inplace_core::labels::Pixel;
use inplace_model::space::OrbitCamera;
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use super::View3d;
use super::camera::{pan, zoom_at};
use super::cloud::Prepared;
use super::overlay;
use crate::keys;

/// Points of a drag that an arrow key stands for, and how much nearer + comes.
const KEY_DRAG: f32 = 30.0;
const KEY_ZOOM: f32 = 1.2;
/// Points of the wheel that come e times as near.
const WHEEL_POINTS: f32 = 250.0;

/// Seconds that a flight takes.
const FLIGHT_SECONDS: f64 = 0.6;

#[derive(Clone, Copy, Debug)]
pub struct Flight {
    pub from: OrbitCamera,
    pub to: OrbitCamera,
    /// When it begins, in seconds.
    pub start: f64,
    /// Where to go at its end: a frame, and the pixel of a suggestion there. The list may be another by then.
    pub then: Option<(usize, Option<Pixel>)>,
}

impl Flight {
    /// Where the camera is at a time.
    pub fn camera(&self, now: f64) -> OrbitCamera {
        let share = ((now - self.start) / FLIGHT_SECONDS).clamp(0.0, 1.0) as f32;
        // Gently off and on.
        let eased = share * share * (3.0 - 2.0 * share);
        if share >= 1.0 {
            self.to
        } else {
            self.from.towards(&self.to, eased)
        }
    }
}

/// The suggested place that the person is at.
fn place_at_hand(workspace: &Workspace) -> Option<(usize, Pixel)> {
    let place = workspace.suggestions().place_at_hand()?;
    Some((place.frame, place.pixel))
}

impl View3d {
    /// The view has the keyboard from when it is shown or pressed on, so that the arrow keys turn it.
    pub(super) fn take_focus(&mut self, ui: &Ui, response: &Response, workspace: &Workspace) {
        if !self.was_shown {
            self.at_suggestion = place_at_hand(workspace);
        }
        keys::note_space(ui.ctx(), response.id);
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

    /// Moves the camera as far as its flight has come; goes where it leads at the end, and returns whether that is to
    /// be seen in a frame.
    pub(super) fn fly(
        &mut self,
        ui: &Ui,
        camera: &mut OrbitCamera,
        workspace: &Workspace,
        now: f64,
        commands: &mut Commands,
    ) -> bool {
        let Some(flight) = &self.flight else {
            return false;
        };
        *camera = flight.camera(now);
        self.moved_at = now;
        ui.ctx().request_repaint();
        if now - flight.start < FLIGHT_SECONDS {
            return false;
        }
        let then = flight.then;
        self.flight = None;
        if let Some((frame, _)) = then {
            let mut listed = workspace.suggestions().listed.iter();
            let suggestion = listed.position(|place| then == Some((place.frame, Some(place.pixel))));
            commands.push(suggestion.map_or(Command::GoToFrame(frame), Command::GoToSuggestion));
        }
        then.is_some()
    }

    /// Starts a flight to where a frame was taken.
    pub(super) fn fly_to(
        &mut self,
        frame: usize,
        (workspace, prepared): (&Workspace, &Prepared),
        from: OrbitCamera,
        now: f64,
        then: Option<(usize, Option<Pixel>)>,
    ) {
        let Some(shown) = workspace.scene.frames.get(frame) else {
            return;
        };
        let camera = &shown.camera;
        let middle = (camera.height / 2 * camera.width + camera.width / 2) as usize;
        let surface = &prepared.surface.surface;
        let node = surface.pixels.get(frame).and_then(|pixels| pixels.node(middle));
        let ball = prepared.cloud.ball;
        let distance = node
            .and_then(|node| surface.graph.nodes().get(node as usize))
            .map_or(ball.radius, |node| node.position.distance(shown.center()));
        // What meets nothing lies far outside of the scene.
        let distance = distance.min(2.0 * ball.radius);
        let to = OrbitCamera::at_frame(shown, from.level, distance);
        self.flight = Some(Flight {
            from,
            to,
            start: now,
            then,
        });
    }

    /// Turns, moves and zooms as pointer and keys say.
    pub(super) fn follow(
        &mut self,
        ui: &Ui,
        response: &Response,
        camera: &mut OrbitCamera,
        rect: Rect,
        workspace: &Workspace,
    ) {
        let before = *camera;
        let is_behind = !ui.memory(|memory| memory.allows_interaction(ui.layer_id()));
        let has_keys = !is_behind && !keys::are_taken(ui.ctx());
        // Of two fingers, the first moves the scene.
        let (space, pinch) = ui.input(|input| (input.key_down(Key::Space), input.multi_touch().is_some()));
        let panning = has_keys && space || pinch;
        self.pinched = pinch || self.pinched && !ui.input(|input| input.pointer.any_pressed());
        let drag = response.drag_delta();
        if response.dragged_by(PointerButton::Middle)
            || panning && response.dragged_by(PointerButton::Primary)
        {
            pan(camera, drag, rect);
        } else if response.dragged_by(PointerButton::Primary) {
            camera.orbit(glam::vec2(drag.x, drag.y));
        }
        if let Some(pointer) = response.hover_pos() {
            let (wheel, pinch) = ui.input(|input| (input.smooth_scroll_delta().y, input.zoom_delta()));
            let factor = (wheel / WHEEL_POINTS).exp() * pinch;
            // The system may tell of a pinch without a number.
            if factor.is_finite() && factor != 1.0 {
                zoom_at(camera, rect, pointer, factor);
            }
        }
        if has_keys {
            let pressed = |key| ui.input(|input| !input.modifiers.command && input.key_pressed(key));
            if response.has_focus() {
                for (key, x, y) in [
                    (Key::ArrowLeft, 1.0, 0.0),
                    (Key::ArrowRight, -1.0, 0.0),
                    (Key::ArrowUp, 0.0, 1.0),
                    (Key::ArrowDown, 0.0, -1.0),
                ] {
                    if pressed(key) {
                        camera.orbit(KEY_DRAG * glam::vec2(x, y));
                    }
                }
            }
            if pressed(Key::Plus) || pressed(Key::Equals) {
                zoom_at(camera, rect, rect.center(), KEY_ZOOM);
            }
            if pressed(Key::Minus) {
                zoom_at(camera, rect, rect.center(), 1.0 / KEY_ZOOM);
            }
        }
        // Whoever takes the wheel ends a flight.
        if *camera != before && workspace.space.shown {
            self.flight = None;
        }
    }

    /// Turns to the suggestion that the person went to last.
    pub(super) fn follow_suggestion(
        &mut self,
        ui: &Ui,
        camera: &OrbitCamera,
        (workspace, prepared): (&Workspace, &Prepared),
        now: f64,
    ) {
        let place = place_at_hand(workspace);
        if place == self.at_suggestion {
            return;
        }
        self.at_suggestion = place;
        let at = workspace.suggestions().at();
        let mut places = overlay::suggestion_places(workspace, &prepared.surface);
        if let Some((_, place)) = places.find(|&(index, _)| Some(index) == at) {
            self.turn_to(ui, camera, place, now);
        }
    }

    /// Starts a flight that brings a place into the middle.
    pub(super) fn turn_to(&mut self, ui: &Ui, camera: &OrbitCamera, pivot: Vec3, now: f64) {
        self.flight = Some(Flight {
            from: *camera,
            to: OrbitCamera { pivot, ..*camera },
            start: now,
            then: None,
        });
        ui.ctx().request_repaint();
    }
}
