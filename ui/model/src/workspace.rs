//! An open scene: what is looked at, what was said about it, and what the worker answered.

mod answers;
pub mod audit;
mod classes;
mod hover;
mod objects;
pub mod source;
mod strokes;
mod suggestions;

pub use objects::Chosen;

use std::sync::Arc;
use std::time::Instant;

use inplace_core::labels::{ClassId, FoundObject, StrokeId};
use inplace_core::scene::{Frame, Scene, Viewpoint};
use inplace_core::semantics::{KnownPart, Posterior, Surface};
use inplace_core::session::{Command, FrameMap, ModelState, Phase, RenderedView, Session, Status};
use serde_json::json;

use self::audit::Auditing;
use crate::class_view::ClassView;
use crate::comparison::{Comparison, DueFrames};
use crate::document::Document;
use crate::hover::Hover;
use crate::overview::Overview;
use crate::settings::Settings;
use crate::space::Space;
use crate::suggestions::Suggestions;
use crate::versioned::Versioned;
use crate::view::View;

/// The surface that labels spread over, with what is known of each of its nodes.
#[derive(Clone, Debug)]
pub struct LabelledSurface {
    /// The surface.
    pub surface: Arc<Surface>,
    /// What is known of its nodes.
    pub posterior: Arc<Posterior>,
}

impl LabelledSurface {
    /// Whether both are the very same as those of another.
    pub fn is(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.surface, &other.surface) && Arc::ptr_eq(&self.posterior, &other.posterior)
    }
}

/// How far the reading of a scene is; what is later is more.
#[derive(Clone, Copy, Debug, PartialEq, PartialOrd)]
pub enum Reading {
    /// So many frames are read, of so many.
    Frames(usize, usize),
    /// All frames are read, and this share of the estimation of their depth is done.
    Depth(f32),
}

/// An open scene.
#[derive(Debug)]
pub struct Workspace {
    /// The scene.
    pub scene: Arc<Scene>,
    /// How far the work is, while the scene is being read: then it is the [listed](Scene::open_listed) one.
    pub reading: Option<Reading>,
    /// A number that no other open scene of this window had.
    pub serial: u64,
    /// The running session.
    pub session: Session,
    /// What the worker has yet to be asked; while the scene is being read it waits.
    outbox: Vec<Command>,
    /// The labels.
    pub document: Document,
    /// Which classes are locked, and which are hidden.
    pub class_view: ClassView,
    /// Index of the frame in view.
    pub frame_index: usize,
    /// The current class; `None` until there is one.
    pub class: Option<ClassId>,
    /// The object of the current class that strokes say, if they say one.
    said: Option<FoundObject>,
    /// The objects of the scene as the window found them last; empty before it looked for them.
    pub found: Arc<[FoundObject]>,
    /// Those of them that no stroke names, to find them again when the project is opened again.
    pub parts: Arc<[KnownPart]>,
    /// The selected stroke, which is on the frame in view.
    pub selected: Option<StrokeId>,
    /// Counts up with every new map of a frame.
    map_versions: Vec<u64>,
    /// How training goes.
    pub status: Status,
    /// Whether the person paused training.
    pub paused: bool,
    pub(crate) suggestions: Suggestions,
    /// The audit, and where the person is in it.
    pub auditing: Auditing,
    /// What a click at the pointer would win.
    pub hover: Hover,
    /// The comparison with another project, while there is one.
    pub comparison: Option<Comparison>,
    /// Generation of the newest labels that the maps of all frames follow; `None` before there are any.
    pub followed: Option<u64>,
    /// The newest model state that the worker handed over.
    pub state: Option<Arc<ModelState>>,
    /// Whether the worker has ended.
    pub ended: bool,
    /// The state of the scene as a whole.
    pub overview: Overview,
    /// The surface that the labels spread over, and what is known of each of its nodes, since there is one.
    pub surface: Option<LabelledSurface>,
    /// Generation of the labels that it follows from.
    surface_generation: u64,
    /// The newest view of the field, from wherever it was asked for.
    pub rendered: Option<Versioned<Arc<RenderedView>>>,
    /// Zoom and pan.
    pub view: View,
    /// The 3D view.
    pub space: Space,
}

impl Workspace {
    /// A scene that a session has listed and is reading; `serial` tells scenes apart.
    pub fn new(scene: Arc<Scene>, serial: u64, session: Session, document: Document) -> Self {
        let has_map = |frame| session.maps().get(frame).is_some();
        let mut workspace = Self {
            overview: Overview::new(scene.frames.len(), Instant::now()),
            map_versions: (0..scene.frames.len())
                .map(|frame| u64::from(has_map(frame)))
                .collect(),
            reading: Some(Reading::Frames(0, scene.frames.len())),
            scene,
            serial,
            session,
            outbox: vec![
                Command::Suggest { only: None },
                Command::CheckStrokes,
                Command::View { frame: 0 },
            ],
            class: document.classes().first().map(|class| class.id),
            document,
            class_view: ClassView::default(),
            frame_index: 0,
            said: None,
            found: Arc::default(),
            parts: Arc::default(),
            selected: None,
            status: Status::default(),
            paused: false,
            suggestions: Suggestions::default(),
            auditing: Auditing::default(),
            hover: Hover::default(),
            comparison: None,
            followed: None,
            state: None,
            ended: false,
            surface: None,
            surface_generation: 0,
            rendered: None,
            view: View::Whole,
            space: Space::default(),
        };
        // So that the worker counts on from there: what it makes of older labels is not taken.
        if workspace.document.generation() > 0 || workspace.document.labels().says_anything() {
            workspace.send_labels();
        }
        workspace
    }

    /// All of the scene is read: here it is, with the frames that were listed.
    pub(crate) fn take_scene(&mut self, scene: Arc<Scene>) {
        self.scene = scene;
        self.reading = None;
        self.overview.changed();
    }

    /// What the worker is to be asked now.
    pub(crate) fn take_outbox(&mut self) -> Vec<Command> {
        match self.reading {
            Some(_) => Vec::new(),
            None => std::mem::take(&mut self.outbox),
        }
    }

    /// The frame in view; `None` in a scene without frames.
    pub fn frame(&self) -> Option<&Frame> {
        self.scene.frames.get(self.frame_index)
    }

    /// The newest map of a frame.
    pub fn newest_map(&self, frame: usize) -> Option<Arc<FrameMap>> {
        self.session.maps().get(frame)
    }

    /// Whether the worker can tell what its model has learnt.
    pub(crate) fn has_learnt(&self) -> bool {
        self.status.steps > 0 && !self.ended && self.reading.is_none()
    }

    /// The map of a frame, if it follows the labels as they are now, imported images and all.
    pub(crate) fn following_map(&self, frame: usize) -> Option<Arc<FrameMap>> {
        let map = self.newest_map(frame)?;
        let is_newest = map.generation == self.document.generation();
        (is_newest && map.has_import_of(self.document.labels())).then_some(map)
    }

    /// The maps of all frames, if all follow the labels as they are now.
    pub(crate) fn following_maps(&self) -> Option<Vec<Arc<FrameMap>>> {
        let frames = 0..self.scene.frames.len();
        frames.map(|frame| self.following_map(frame)).collect()
    }

    /// Has the field rendered as seen from here.
    pub(crate) fn render(&mut self, viewpoint: Viewpoint) {
        self.outbox.push(Command::Render(viewpoint));
    }

    /// Has the worker hand over its model state.
    pub(crate) fn save(&mut self) {
        self.outbox.push(Command::Save);
    }

    /// Brings the overview up to date; returns the frames whose maps are to be summed up now, if any.
    pub fn refresh_overview(&mut self, now: Instant) -> Option<Vec<(usize, u64)>> {
        self.overview
            .refresh(&self.scene, &self.document, self.comparison.as_ref());
        self.overview.due(&self.map_versions, now)
    }

    /// The frames that are to be compared with the other project now, if any.
    pub(crate) fn due_differences(&mut self) -> Option<(DueFrames, &Comparison)> {
        let comparison = self.comparison.as_mut()?;
        let due = comparison.due(self.document.classes(), self.frame_index, &self.map_versions)?;
        Some((due, comparison))
    }

    /// Changes with every new map of a frame; 0 = none yet.
    pub fn map_version(&self, frame: usize) -> u64 {
        self.map_versions.get(frame).copied().unwrap_or(0)
    }

    /// Shows a frame; returns whether another one was shown before.
    pub fn go_to(&mut self, frame: usize) -> bool {
        let frame = frame.min(self.scene.frames.len().saturating_sub(1));
        if frame == self.frame_index {
            return false;
        }
        self.frame_index = frame;
        self.selected = None;
        self.auditing.at = None;
        self.outbox.push(Command::View { frame });
        true
    }

    /// Shows all of the frame, or all of the scene in the 3D view.
    pub fn fit(&mut self) {
        if self.space.shown {
            self.space.fit();
        } else {
            self.view = View::Whole;
        }
    }

    /// What a project keeps of how it is looked at: settings, locked and hidden classes, the log, and the audit.
    pub fn kept_view(&self, settings: &Settings) -> String {
        let mut view = settings.to_json();
        self.class_view.keep_in(&mut view);
        view["progress"] = self.overview.log.to_json();
        view["parts"] = json!(*self.parts);
        view["audit"] = json!(self.auditing.audit);
        view.to_string()
    }

    /// Pauses or resumes training.
    pub fn toggle_pause(&mut self) {
        self.paused = !self.paused;
        let command = if self.paused {
            Command::Pause
        } else {
            Command::Resume
        };
        self.outbox.push(command);
    }

    /// What the worker is doing, in words.
    pub fn phase_in_words(&self) -> &'static str {
        match (self.ended, self.paused, self.status.phase) {
            (true, ..) => "Training has stopped",
            (_, true, _) | (.., Phase::Paused) => "Paused",
            (.., Phase::Training) if self.status.settled => "Settled",
            (.., Phase::Training) if self.status.finding_features => "Finding look-alikes",
            (.., Phase::Training) => "Running",
            (.., Phase::Opening) => "Getting ready",
            (.., Phase::FindingSurface) => "Finding the surface",
            (.., Phase::Estimating { .. }) => "Estimating depth",
        }
    }
}

#[cfg(test)]
impl Workspace {
    /// A scene with the number 1, without labels, whose worker says nothing.
    pub(crate) fn of_test(scene: Scene) -> Self {
        use crossbeam_channel::unbounded;
        use inplace_core::labels::History;

        let ((commands, _), (_, events)) = (unbounded(), unbounded());
        let session = Session::answered_by(commands, events, Arc::default());
        Self::new(Arc::new(scene), 1, session, Document::new(History::default(), 0))
    }
}

#[cfg(test)]
mod tests {
    use inplace_core::labels::{ImportedLabels, ImportedMap, LabelImages, Trust};
    use inplace_core::scene::demo::Shot;
    use inplace_core::semantics::{LabelPropagation, SurfaceImport};

    use super::*;

    #[test]
    fn a_map_follows_the_labels_when_it_has_their_imported_images() {
        let mut workspace = Workspace::of_test(Shot::new(1, [64, 48]).scene(&|_, _| {}));
        let scene = Arc::clone(&workspace.scene);
        let map = ImportedMap::new(0, &[1; 64 * 48]);
        let images = LabelImages {
            labels: ImportedLabels::new(vec![map], Trust::RIGHT),
            classes: Vec::new(),
            objects: Vec::new(),
            unmatched: 0,
        };
        workspace.edit(|history| Some(history.import(images)));
        let labels = workspace.document.labels();
        let surface = Arc::new(Surface::build(&scene, &[], 8.0).unwrap());
        let import = SurfaceImport::new(&surface, labels).unwrap();
        let mut propagation = LabelPropagation::new(surface);
        propagation.set_labels(&scene, labels);
        let maps = workspace.session.maps();
        maps.reset(1);
        maps.publish(propagation.map(&scene, 0, workspace.document.generation()));
        assert!(workspace.newest_map(0).is_some() && workspace.following_maps().is_none());
        propagation.set_import(import);
        maps.publish(propagation.map(&scene, 0, workspace.document.generation()));
        assert!(workspace.following_maps().is_some());
    }
}
