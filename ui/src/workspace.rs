//! An open scene: what is looked at, what was said about it, and what the worker answered.

mod answers;
mod classes;
mod strokes;
mod suggestions;

use std::sync::Arc;
use std::time::Instant;

use inplace_core::labels::{ClassId, Pixel, StrokeId};
use inplace_core::scene::{Frame, Scene};
use inplace_core::session::{Command, ModelState, Phase, Status};

use crate::canvas::{Content, Layer, ShownMap, View};
use crate::class_view::ClassView;
use crate::document::Document;
use crate::english::status as words;
use crate::frames;
use crate::guidance::Guidance;
use crate::overview::Overview;
use crate::session_link::Running;
use crate::shown::Shown;
use crate::state::Settings;
use crate::view3d::{Answer, Space};

pub use classes::Lock;

/// An open scene.
#[derive(Debug)]
pub struct Workspace {
    scene: Arc<Scene>,
    serial: u64,
    session: Running,
    document: Document,
    class_view: ClassView,
    frame: usize,
    class: Option<ClassId>,
    selected: Option<StrokeId>,
    shown: Shown,
    /// Counts up with every new map of a frame.
    map_versions: Vec<u64>,
    status: Status,
    paused: bool,
    guidance: Guidance,
    /// Generation of the labels that all maps follow.
    followed: Option<u64>,
    state: Option<Arc<ModelState>>,
    ended: bool,
    overview: Overview,
    /// The surface and what is known of it, since there is one.
    answer: Option<Answer>,
    /// Generation of the labels that it follows from.
    answer_generation: u64,
    /// Zoom and pan.
    pub view: View,
    /// The 3D view.
    pub space: Space,
}

impl Workspace {
    /// A scene that a session has just opened; `serial` tells scenes apart. What is made for the canvas wakes
    /// this window.
    pub fn new(
        scene: Arc<Scene>,
        serial: u64,
        session: Running,
        document: Document,
        ctx: &egui::Context,
    ) -> Self {
        let shown = Shown::new(&scene, serial, ctx);
        let maps = session.maps().cloned();
        let has_map = |frame| maps.as_ref().is_some_and(|maps| maps.get(frame).is_some());
        let mut workspace = Self {
            overview: Overview::new(scene.frames.len(), Instant::now()),
            map_versions: (0..scene.frames.len())
                .map(|frame| u64::from(has_map(frame)))
                .collect(),
            scene,
            serial,
            session,
            class: document.classes().first().map(|class| class.id),
            document,
            class_view: ClassView::default(),
            frame: 0,
            selected: None,
            shown,
            status: Status::default(),
            paused: false,
            guidance: Guidance::default(),
            followed: None,
            state: None,
            ended: false,
            answer: None,
            answer_generation: 0,
            view: View::FITTED,
            space: Space::default(),
        };
        workspace.session.send(Command::CheckStrokes);
        workspace.session.send(Command::View { frame: 0 });
        workspace.shown.take_map(workspace.newest_map());
        // So that the worker counts on from there: what it makes of older labels is not taken.
        if workspace.document.generation() > 0 || workspace.document.labels().says_anything() {
            workspace.send_labels();
        }
        workspace
    }

    /// The scene.
    pub fn scene(&self) -> &Arc<Scene> {
        &self.scene
    }

    /// A number that no other open scene of this window had.
    pub fn serial(&self) -> u64 {
        self.serial
    }

    /// The labels.
    pub fn document(&self) -> &Document {
        &self.document
    }

    /// Index of the frame in view.
    pub fn frame_index(&self) -> usize {
        self.frame
    }

    /// The frame in view; `None` in a scene without frames.
    pub fn frame(&self) -> Option<&Frame> {
        self.scene.frames.get(self.frame)
    }

    /// How training goes.
    pub fn status(&self) -> &Status {
        &self.status
    }

    /// Whether the person paused training.
    pub fn is_paused(&self) -> bool {
        self.paused
    }

    /// Whether the worker has ended.
    pub fn has_ended(&self) -> bool {
        self.ended
    }

    /// Generation of the newest labels that the maps of all frames follow; `None` before there are any.
    pub fn followed(&self) -> Option<u64> {
        self.followed
    }

    /// The surface that the labels spread over, and what is known of each of its nodes.
    pub fn answer(&self) -> Option<&Answer> {
        self.answer.as_ref()
    }

    /// The newest model state that the worker handed over.
    pub fn state(&self) -> Option<&Arc<ModelState>> {
        self.state.as_ref()
    }

    /// The running session.
    pub fn session(&self) -> &Running {
        &self.session
    }

    /// The state of the scene as a whole.
    pub fn overview(&self) -> &Overview {
        &self.overview
    }

    /// The state of the scene as a whole.
    pub fn overview_mut(&mut self) -> &mut Overview {
        &mut self.overview
    }

    /// Brings the overview up to date; returns the frames whose maps are to be summed up now, if any.
    pub fn refresh_overview(&mut self, now: Instant) -> Option<Vec<(usize, u64)>> {
        self.overview.refresh(&self.scene, &self.document);
        self.overview.due(&self.map_versions, now)
    }

    /// Changes with every new map of a frame; 0 = none yet.
    pub fn map_version(&self, frame: usize) -> u64 {
        self.map_versions.get(frame).copied().unwrap_or(0)
    }

    /// The map shown for the frame in view.
    pub fn shown_map(&self) -> Option<&ShownMap> {
        self.shown.map()
    }

    /// What is known of the frame in view.
    pub fn shown(&self) -> &Shown {
        &self.shown
    }

    /// What the canvas shows of a layer.
    pub fn content(&self, layer: Layer) -> Option<Content> {
        self.shown.content(layer, self.document.palette())
    }

    /// Takes over what was made for the canvas, and has what these layers need made.
    pub fn prepare_layers(&mut self, layers: &[Layer], now: Instant) {
        self.shown.collect();
        let steps = self.status.steps;
        let contradicted = self.overview.contradicted();
        self.shown
            .want(layers, (&self.document, contradicted), &self.session, steps, now);
    }

    /// Shows a frame; returns whether another one was shown before.
    pub fn go_to(&mut self, frame: usize) -> bool {
        let frame = frame.min(self.scene.frames.len().saturating_sub(1));
        if frame == self.frame {
            return false;
        }
        self.frame = frame;
        self.selected = None;
        self.session.send(Command::View { frame });
        self.shown.go_to(frame, self.newest_map());
        true
    }

    /// The frame so many places from the one in view, among those that the filmstrip shows.
    pub fn stepped(&self, by: isize) -> Option<usize> {
        self.overview.frames().step(self.frame, by)
    }

    /// The frame that a number or a name means.
    pub fn frame_named(&self, text: &str) -> Option<usize> {
        let stems: Vec<&str> = self
            .scene
            .frames
            .iter()
            .map(|frame| frame.stem.as_str())
            .collect();
        frames::find(&stems, text, self.frame)
    }

    /// Shows a place of a frame.
    pub fn go_to_place(&mut self, frame: usize, [x, y]: Pixel) {
        self.go_to(frame);
        self.view.center_on(egui::pos2(x as f32 + 0.5, y as f32 + 0.5));
    }

    /// Shows all of the frame, or all of the scene in the 3D view.
    pub fn fit(&mut self) {
        if self.space.shown {
            self.space.fit();
        } else {
            self.view = View::FITTED;
        }
    }

    /// What a project keeps of how it is looked at: settings, locked and hidden classes, and the log.
    pub fn kept_view(&self, settings: &Settings) -> String {
        let view = self.class_view.with_settings(&settings.to_json());
        self.overview.log().kept_in(&view)
    }

    /// Pauses or resumes training.
    pub fn toggle_pause(&mut self) {
        self.paused = !self.paused;
        let command = if self.paused {
            Command::Pause
        } else {
            Command::Resume
        };
        self.session.send(command);
    }

    /// What the worker is doing, in words.
    pub fn phase_in_words(&self) -> &'static str {
        match (self.ended, self.paused, self.status.phase) {
            (true, ..) => words::ENDED,
            (_, true, _) => words::PAUSED,
            (.., Phase::Training) if self.status.settled => words::SETTLED,
            (.., phase) => words::phase(phase),
        }
    }
}
