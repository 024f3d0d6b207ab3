//! An open scene: what is looked at, what was said about it, and what the worker answered.

use std::sync::Arc;
use std::time::Instant;

use inplace_core::guide::Suggestion;
use inplace_core::labels::{
    Class, ClassId, Edit, History, Pixel, Stroke, StrokeId, StrokeKind, VOID, erase, pixels_of, rasterise,
};
use inplace_core::scene::{Frame, Scene};
use inplace_core::session::{Command, Event, FrameMap, ModelState, Phase, Status, Verdict};

use crate::canvas::{Content, Layer, Line, ShownMap, Tool, View};
use crate::class_view::ClassView;
use crate::document::{Document, frame_of};
use crate::english::status as words;
use crate::frames;
use crate::guidance::{Arrival, Guidance};
use crate::overview::Overview;
use crate::session_link::Running;
use crate::shown::Shown;
use crate::state::Settings;
use crate::surroundings::surroundings;
use crate::view3d::{Answer, Space};

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

    /// The current class; `None` until there is one.
    pub fn class(&self) -> Option<ClassId> {
        self.class
    }

    /// The selected stroke, which is on the frame in view.
    pub fn selected(&self) -> Option<StrokeId> {
        self.selected
    }

    /// Where the newest line of the frame in view ends.
    pub fn line_end(&self) -> Option<Pixel> {
        let mut newest_first = self.document.strokes_on(self.frame).rev();
        let (_, newest) = newest_first.find(|(_, stroke)| stroke.kind() != StrokeKind::Polygon)?;
        newest.lines.last()?.last().copied()
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

    /// Where to label next, best first.
    pub fn suggestions(&self) -> &[Suggestion] {
        self.guidance.listed()
    }

    /// The suggestion that the person is at.
    pub fn at_suggestion(&self) -> Option<usize> {
        self.guidance.at()
    }

    /// The suggestions and where the person is among them.
    pub fn guidance(&self) -> &Guidance {
        &self.guidance
    }

    /// The suggestions and where the person is among them.
    pub fn guidance_mut(&mut self) -> &mut Guidance {
        &mut self.guidance
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

    /// What the other strokes say of each stroke that can be checked.
    pub fn verdicts(&self) -> &[Verdict] {
        self.overview.verdicts()
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

    /// The worker has checked the strokes.
    fn take_verdicts(&mut self, verdicts: Vec<Verdict>, accuracy: Option<f32>) {
        let contradicted = verdicts.iter().filter(|verdict| verdict.is_contradicted());
        let contradicted: Vec<_> = contradicted
            .map(|verdict| (verdict.stroke, verdict.class))
            .collect();
        self.shown.set_contradicted(&contradicted);
        self.overview.take_verdicts(verdicts, accuracy);
    }

    /// What the canvas shows of a layer.
    pub fn content(&self, layer: Layer) -> Option<Content> {
        self.shown.content(layer, self.document.palette())
    }

    /// Takes over what was made for the canvas, and has what these layers need made.
    pub fn prepare_layers(&mut self, layers: &[Layer], now: Instant) {
        self.shown.collect();
        let steps = self.status.steps;
        self.shown.want(layers, &self.document, &self.session, steps, now);
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

    /// Selects a stroke of the frame in view, or none.
    pub fn select(&mut self, stroke: Option<StrokeId>) {
        let strokes = &self.document.labels().strokes;
        let here = |id: &StrokeId| strokes.get(id).is_some_and(|stroke| stroke.frame == self.frame);
        self.selected = stroke.filter(here);
    }

    /// Shows a stroke and selects it; returns whether another frame was shown before.
    pub fn go_to_stroke(&mut self, id: StrokeId) -> bool {
        let Some(stroke) = self.document.labels().strokes.get(&id).cloned() else {
            return false;
        };
        let before = self.frame;
        // The middle of a scribble is on it; that of a polygon's rows is inside.
        let line = stroke.lines.get(stroke.lines.len() / 2);
        let middle = match line.map(Vec::as_slice) {
            Some(&[[from, y], [to, row]]) if y == row => Some([from.midpoint(to), y]),
            line => line.and_then(|line| line.get(line.len() / 2)).copied(),
        };
        match middle {
            Some(pixel) => self.go_to_place(stroke.frame, pixel),
            None => {
                self.go_to(stroke.frame);
            }
        }
        self.select(Some(id));
        self.frame != before
    }

    /// Shows a place of a frame.
    pub fn go_to_place(&mut self, frame: usize, [x, y]: Pixel) {
        self.go_to(frame);
        self.view.center_on(egui::pos2(x as f32 + 0.5, y as f32 + 0.5));
    }

    /// Shows the place of a suggestion, as near as it takes to recognise it.
    pub fn show_suggestion(&mut self, index: usize) {
        let Some(place) = self.guidance.listed().get(index) else {
            return;
        };
        let shown = self.scene.frames.get(place.frame).map(|frame| {
            let size = egui::vec2(frame.color.width() as f32, frame.color.height() as f32);
            (place.frame, surroundings(size, place.pixel, &place.outline))
        });
        if let Some((frame, part)) = shown {
            self.go_to(frame);
            self.view = View::showing(part);
        }
    }

    /// Goes to a suggestion and shows it; returns whether it is there.
    pub fn go_to_suggestion(&mut self, index: usize) -> bool {
        let there = self.guidance.go_to(index);
        if there {
            self.show_suggestion(index);
        }
        there
    }

    /// Goes on to another suggestion and shows it; returns whether there is any.
    pub fn step_suggestion(&mut self, backwards: bool) -> bool {
        let next = self.guidance.step(backwards);
        if let Some(index) = next {
            self.show_suggestion(index);
        }
        next.is_some()
    }

    /// Labels the place of a suggestion; `None` when it is not there, or was answered before.
    pub fn answer_suggestion(&mut self, index: usize, class: ClassId) -> Option<Edit> {
        let place = self.guidance.listed().get(index)?;
        let exists = class == VOID || self.document.labels().class(class).is_some();
        if !exists || self.guidance.answer_of(index).is_some() {
            return None;
        }
        let click = Stroke::click(place.frame, class, place.pixel);
        let edit = self.edit(|history| Some(history.add_stroke(click)))?;
        let stroke = edit.strokes.last()?.id;
        self.guidance.answered(index, class, stroke);
        Some(edit)
    }

    /// Shows all of the frame, or all of the scene in the 3D view.
    pub fn fit(&mut self) {
        if self.space.shown {
            self.space.fit();
        } else {
            self.view = View::FITTED;
        }
    }

    /// Makes a class current.
    pub fn choose_class(&mut self, class: ClassId) {
        if class == VOID || self.document.labels().class(class).is_some() {
            self.class = Some(class);
        }
    }

    /// Which classes are locked, and which are hidden.
    pub fn class_view(&self) -> &ClassView {
        &self.class_view
    }

    /// Locks, hides and shows classes.
    pub fn change_class_view(&mut self, change: impl FnOnce(&mut ClassView)) {
        change(&mut self.class_view);
        self.document.hide(self.class_view.hidden());
    }

    /// Whether what is labelled as a class has to stay as it is.
    pub fn is_locked(&self, class: ClassId) -> bool {
        self.class_view.locked().contains(&class)
    }

    /// Whether a class is left out of the overlay.
    pub fn is_hidden(&self, class: ClassId) -> bool {
        self.class_view.hidden().contains(&class)
    }

    /// The locked class that a stroke would cover, if any.
    pub fn locked_under(&self, stroke: &Stroke) -> Option<&Class> {
        let labels = self.document.labels();
        let camera = &self.scene.frames.get(stroke.frame)?.camera;
        let mut others = labels.strokes_of(stroke.frame);
        if !others.any(|(_, other)| self.is_locked(other.class)) {
            return None;
        }
        let drawn = rasterise(labels, stroke.frame, camera.width, camera.height);
        let covered = pixels_of(stroke, camera.width, camera.height);
        let mut classes = covered.iter().filter_map(|pixel| drawn.get(pixel));
        let (class, _) = classes.find(|(class, _)| *class != stroke.class && self.is_locked(*class))?;
        labels.class(*class)
    }

    /// The locked class whose strokes on the frame in view an eraser would have changed, if any.
    pub fn locked_under_eraser(&self, path: &[Pixel], radius: u32) -> Option<&Class> {
        let labels = self.document.labels();
        let locked = labels
            .strokes_of(self.frame)
            .filter(|(_, stroke)| self.is_locked(stroke.class));
        let mut touched = locked.filter(|(_, stroke)| erase(stroke, path, radius).is_some());
        touched.next().and_then(|(_, stroke)| labels.class(stroke.class))
    }

    /// What a project keeps of how it is looked at: settings, locked and hidden classes, and the log.
    pub fn kept_view(&self, settings: &Settings) -> String {
        let view = self.class_view.with_settings(&settings.to_json());
        self.overview.log().kept_in(&view)
    }

    /// Labels or erases along a line on the frame in view; `None` when nothing changed.
    pub fn draw(&mut self, line: Line, radius: u32) -> Option<Edit> {
        self.selected = None;
        match line.tool {
            Tool::Brush | Tool::Polyline | Tool::Polygon => {
                let stroke = line.into_stroke(self.frame, self.class?, radius);
                self.edit(|history| Some(history.add_stroke(stroke)))
            }
            Tool::Erase => self.erase(&line.points, radius),
            Tool::Select => None,
        }
    }

    /// Erases along a path on the frame in view: every eraser of the window does it here.
    fn erase(&mut self, path: &[Pixel], radius: u32) -> Option<Edit> {
        let frame = self.frame;
        let locked = self.class_view.locked().clone();
        let may_erase = |class| !locked.contains(&class);
        self.edit(|history| history.erase_where(frame, path, radius, may_erase))
    }

    /// Changes the labels and tells the worker; `None` when nothing changed.
    pub fn edit(&mut self, change: impl FnOnce(&mut History) -> Option<Edit>) -> Option<Edit> {
        let edit = self.document.edit(change)?;
        self.overview.changed();
        let exists = |class| class == VOID || self.document.labels().class(class).is_some();
        if !self.class.is_some_and(exists) {
            self.class = self.document.classes().first().map(|class| class.id);
        }
        self.select(self.selected);
        self.send_labels();
        Some(edit)
    }

    /// Undoes or redoes, and shows the frame where it happened.
    pub fn step_history(&mut self, step: fn(&mut History) -> Option<Edit>) -> Option<Edit> {
        let edit = self.edit(step)?;
        if let Some(frame) = frame_of(&edit) {
            self.go_to(frame);
        }
        if let Some(index) = self.guidance.history_stepped(&edit) {
            self.show_suggestion(index);
        }
        Some(edit)
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

    /// Takes what the worker told into account; returns a sentence about what failed.
    pub fn on_event(&mut self, event: Event) -> Option<String> {
        match event {
            Event::Map { frame, .. } => {
                if let Some(version) = self.map_versions.get_mut(frame) {
                    *version += 1;
                }
                if frame == self.frame {
                    self.shown.take_map(self.newest_map());
                }
                self.take_answer(frame);
            }
            Event::Suggestions {
                generation,
                mut suggestions,
            } => {
                let frames = self.scene.frames.len();
                suggestions.retain(|suggestion| suggestion.frame < frames);
                let newest = self.document.generation();
                match self.guidance.take_list(generation, suggestions, newest) {
                    Arrival::Next(index) => self.show_suggestion(index),
                    Arrival::Quiet | Arrival::NothingLeft => {}
                }
            }
            Event::AllMaps { generation } => self.followed = Some(generation),
            Event::Status(status) => {
                let strokes = self.document.labels().strokes.len();
                self.overview.note(&status, strokes, Instant::now());
                self.status = status;
            }
            Event::Verdicts {
                verdicts, accuracy, ..
            } => self.take_verdicts(verdicts, accuracy),
            Event::Rendered(view) => self.shown.take_view(view),
            Event::NotRendered(reason) => self.shown.take_no_view(reason),
            Event::State(state) => self.state = Some(state),
            Event::Warning(sentence) | Event::Error(sentence) => return Some(sentence),
            Event::Stopped => self.ended = true,
            Event::Opening { .. } | Event::Opened(_) => {}
        }
        None
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

    fn newest_map(&self) -> Option<Arc<FrameMap>> {
        self.session.maps().and_then(|maps| maps.get(self.frame))
    }

    /// All maps follow from one surface: the newest of any frame tells the newest answer.
    fn take_answer(&mut self, frame: usize) {
        let map = self.session.maps().and_then(|maps| maps.get(frame));
        let Some(map) = map.filter(|map| map.generation >= self.answer_generation) else {
            return;
        };
        if let Some((surface, posterior)) = map.surface() {
            self.answer_generation = map.generation;
            self.answer = Some(Answer {
                scene: self.serial,
                surface: Arc::clone(surface),
                posterior: Arc::clone(posterior),
            });
        }
    }

    fn send_labels(&self) {
        self.session.send(Command::Labels {
            labels: self.document.labels().clone(),
            generation: self.document.generation(),
        });
    }
}
