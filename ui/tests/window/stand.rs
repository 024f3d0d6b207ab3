//! A window without a screen, and a stand-in for the worker.

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, unbounded};
use egui::accesskit::Role;
use egui::{Key, Modifiers, PointerButton, Pos2, Rect, TouchDeviceId, TouchId, TouchPhase, vec2};
use egui_kittest::{Harness, kittest::Queryable};
use inplace_core::guide::Suggestion;
use inplace_core::labels::{LabelSet, ObjectId, Pixel, StrokeId};
use inplace_core::scene::{ColorImage, OpenOptions, Scene, SceneSource, Viewpoint};
use inplace_core::semantics::LabelPropagation;
use inplace_core::session::{self, Event, FrameMap, MapSlots, RenderedView, Session};
use inplace_model::exporting::ExportProgress;
use inplace_model::preferences::Store;
use inplace_model::project_session::SavedState;
use inplace_model::tool::{DrawnLine, Tool};
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Model};
use inplace_ui::app::{App, Environment};
use inplace_ui::canvas::{CANVAS_NAME, FrameView};
use inplace_ui::{Target, UiOptions};
use tempfile::TempDir;

use crate::images;
use crate::space::wall;

pub const WIDTH: u32 = 64;
pub const HEIGHT: u32 = 48;
pub const FRAMES: usize = 5;

#[derive(Clone)]
pub struct Worker {
    pub events: Sender<Event>,
    pub commands: Receiver<session::Command>,
    pub maps: Arc<MapSlots>,
}

impl Worker {
    /// Answers with a map of the frame in which every pixel has this class.
    pub fn publish(&self, frame: usize, generation: u64, class: u16) {
        self.publish_with(frame, generation, class, 500);
    }

    /// Answers so with this entropy in every pixel.
    pub fn publish_with(&self, frame: usize, generation: u64, class: u16, entropy: u16) {
        let pixels = (WIDTH * HEIGHT) as usize;
        let (labels, entropy) = (vec![class; pixels], vec![entropy; pixels]);
        let map = FrameMap::new(frame, generation, [WIDTH, HEIGHT], labels, entropy);
        self.maps.publish(map.unwrap());
        self.events.send(Event::Map { frame, generation }).unwrap();
    }

    pub fn publish_all(&self, generation: u64, class: u16) {
        for frame in 0..FRAMES {
            self.publish(frame, generation, class);
        }
    }

    /// From where views were asked for since the last call, which takes all commands.
    pub fn asked_views(&self) -> Vec<Viewpoint> {
        let viewpoint = |command| match command {
            session::Command::Render(viewpoint) => Some(viewpoint),
            _ => None,
        };
        self.received().into_iter().filter_map(viewpoint).collect()
    }

    /// The newest labels that it was told since the last call, which takes all commands, with their generation.
    pub fn told_labels(&self) -> Option<(LabelSet, u64)> {
        let labels = |command| match command {
            session::Command::Labels { labels, generation } => Some((labels, generation)),
            _ => None,
        };
        self.received().into_iter().rev().find_map(labels)
    }

    /// The commands since the last call.
    pub fn received(&self) -> Vec<session::Command> {
        self.commands.try_iter().collect()
    }
}

/// The field as seen from here after so many steps, of which no finer image follows: grey, and two metres away
/// everywhere.
pub fn rendered(viewpoint: Viewpoint, steps: u64) -> Event {
    const STRIDE: u32 = 4;
    let reduced = viewpoint.camera.reduced(STRIDE);
    let pixels = reduced.pixels();
    Event::Rendered(Arc::new(RenderedView {
        viewpoint,
        steps,
        is_last: true,
        stride: STRIDE,
        color: ColorImage::new(reduced.width, reduced.height, vec![50; 3 * pixels]).unwrap(),
        depth: vec![2.0; pixels],
        semantic_steps: 0,
        generation: 0,
        labels: None,
    }))
}

/// The frame of a capture on disk whose image vanishes as soon as it is open.
pub const VANISHING: usize = 3;

pub fn scene(source: SceneSource) -> Arc<Scene> {
    if let SceneSource::Folder(folder) = &source
        && folder.join("rgb").is_dir()
    {
        // Room for one keyframe; the others are read when they are wanted.
        let options = OpenOptions {
            image_bytes: 1,
            ..OpenOptions::default()
        };
        let scene = Scene::open(&source, options, &|_, _| {}).unwrap();
        assert!(!scene.frames[VANISHING].is_keyframe());
        fs::remove_file(&scene.frames[VANISHING].path).unwrap();
        return Arc::new(scene);
    }
    // A folder named so is another scene.
    let other = matches!(&source, SceneSource::Folder(folder) if folder.ends_with("other"));
    let name = if other { "other" } else { "rgb" };
    let image = || ColorImage::new(WIDTH, HEIGHT, vec![90; (WIDTH * HEIGHT * 3) as usize]).unwrap();
    let mut scene = images::scene((0..FRAMES).map(|_| image()));
    for (index, frame) in scene.frames.iter_mut().enumerate() {
        frame.stem = format!("{name}_{}", frame.stem);
        // Each has a view of its own, all but the same.
        frame.camera_to_world.translation.z -= 1e-4 * index as f32;
    }
    Arc::new(Scene { source, ..scene })
}

/// The primary button goes down or up here.
pub fn button(pos: Pos2, pressed: bool) -> egui::Event {
    any_button(PointerButton::Primary, pos, pressed, Modifiers::NONE)
}

fn any_button(button: PointerButton, pos: Pos2, pressed: bool, modifiers: Modifiers) -> egui::Event {
    egui::Event::PointerButton {
        pos,
        button,
        pressed,
        modifiers,
    }
}

pub fn suggestion(frame: usize) -> Suggestion {
    Suggestion {
        frame,
        pixel: [20, 30],
        position: Default::default(),
        outline: Vec::new(),
        share: 0.04,
        classes: Vec::new(),
    }
}

pub fn preferences_file(folder: &Path) -> PathBuf {
    folder.join("configuration/preferences.json")
}

/// A window in a test, with the worker of its newest session.
pub struct Window {
    pub harness: Harness<'static, App>,
    pub workers: Arc<Mutex<Vec<Worker>>>,
    /// Where its files are, unless the test has them; goes last.
    pub folder: Option<TempDir>,
}

impl Window {
    pub fn new(folder: &Path, open: Option<Target>) -> Self {
        let options = UiOptions {
            open,
            ..UiOptions::default()
        };
        Self::with_options(folder, options)
    }

    pub fn with_options(folder: &Path, options: UiOptions) -> Self {
        let workers = Arc::new(Mutex::new(Vec::new()));
        let started = Arc::clone(&workers);
        let folder = folder.to_path_buf();
        let mut harness = Harness::builder()
            .with_size(vec2(1280.0, 720.0))
            .build_eframe(move |creation| {
                let around = Environment {
                    sessions: Box::new(move |options, _wake| {
                        let (commands, command_inbox) = unbounded();
                        let (event_outbox, events) = unbounded();
                        let maps = Arc::new(MapSlots::default());
                        maps.reset(FRAMES);
                        // The test says when a folder named so is open.
                        let slow = matches!(&options.source, SceneSource::Folder(folder) if folder.ends_with("slow"));
                        let scene = scene(options.source);
                        let event = if slow { Event::Listed } else { Event::Opened };
                        event_outbox.send(event(scene)).unwrap();
                        started.lock().unwrap().push(Worker {
                            events: event_outbox,
                            commands: command_inbox,
                            maps: Arc::clone(&maps),
                        });
                        Session::answered_by(commands, events, maps)
                    }),
                    preferences: Store::open(preferences_file(&folder)),
                    renderer: String::new(),
                    pictures: folder.join("pictures"),
                    autosave: Arc::new(move |_| folder.join("autosave.inplace")),
                    target: None,
                };
                App::new(&creation.egui_ctx, options, around)
            });
        harness.run_steps(2);
        Self {
            harness,
            workers,
            folder: None,
        }
    }

    /// A window with the demo and a folder of its own.
    pub fn demo() -> Self {
        let folder = tempfile::tempdir().unwrap();
        let mut window = Self::with_demo(folder.path());
        window.folder = Some(folder);
        window
    }

    pub fn with_demo(folder: &Path) -> Self {
        Self::opened(folder, Target::Scene(SceneSource::Demo))
    }

    pub fn with_classes(classes: &[&str]) -> Self {
        let mut window = Self::demo();
        for class in classes {
            window.add_class(class);
        }
        // Out of the text field.
        window.key(Key::Escape);
        window
    }

    /// With strokes by clicks: on which frame, of which class, and how far from the middle of the canvas. A class that is
    /// not there is added.
    pub fn labelled(mut self, clicks: &[(usize, &str, [f32; 2])]) -> Self {
        for &(frame, class, [x, y]) in clicks {
            self.act(Command::GoToFrame(frame));
            self.add_class(class);
            self.click_canvas(x, y);
        }
        assert_eq!(self.strokes(), clicks.len());
        self
    }

    pub fn opened(folder: &Path, target: Target) -> Self {
        let mut window = Self::new(folder, Some(target));
        window.until_open();
        window
    }

    /// Steps until something holds; it may depend on other threads.
    pub fn until(&mut self, what: &str, holds: impl Fn(&App) -> bool) {
        self.until_window(what, |window| holds(window.harness.state()));
    }

    pub fn until_open(&mut self) {
        self.until("a scene is open", |app| app.model().workspace().is_some());
    }

    pub fn until_told(&mut self) {
        self.until("a message is shown", |app| !app.model().messages.shown.is_empty());
    }

    pub fn until_saved(&mut self) {
        self.until("all of it is written", |app| {
            let project = app.model().project.as_ref();
            project.is_some_and(|project| project.saved_state() == SavedState::Saved)
        });
    }

    pub fn until_window(&mut self, what: &str, holds: impl Fn(&Self) -> bool) {
        let end = Instant::now() + Duration::from_secs(20);
        while !holds(self) {
            assert!(Instant::now() < end, "waited in vain: {what}");
            self.harness.step();
            std::thread::sleep(Duration::from_millis(2));
        }
        self.harness.run_steps(2);
    }

    /// Ends the program as closing its window does.
    pub fn close(mut self) {
        eframe::App::on_exit(self.harness.state_mut(), None);
    }

    pub fn model(&self) -> &Model {
        self.harness.state().model()
    }

    pub fn workspace(&self) -> &Workspace {
        self.model().workspace().expect("no scene is open")
    }

    pub fn labels(&self) -> &LabelSet {
        self.workspace().document.labels()
    }

    pub fn generation(&self) -> u64 {
        self.workspace().document.generation()
    }

    pub fn frame_index(&self) -> usize {
        self.workspace().frame_index
    }

    pub fn tool(&self) -> Tool {
        self.model().settings.tool
    }

    /// The stroke that is selected.
    pub fn selected(&self) -> Option<StrokeId> {
        self.workspace().selected
    }

    /// What is known of the frame in view.
    pub fn frame(&self) -> &FrameView {
        self.harness.state().canvas().frame().expect("no scene is open")
    }

    pub fn worker(&self) -> Worker {
        self.workers.lock().unwrap().last().unwrap().clone()
    }

    /// The worker tells this, and the window takes it in.
    pub fn tell(&mut self, event: Event) {
        self.worker().events.send(event).unwrap();
        self.harness.run_steps(3);
    }

    pub fn shows(&self, name: &str) -> bool {
        self.harness.query_by_label(name).is_some()
    }

    #[track_caller]
    pub fn sees(&self, name: &str) {
        self.harness.get_by_label(name);
    }

    #[track_caller]
    pub fn sees_part(&self, of_name: &str) {
        self.harness.get_by_label_contains(of_name);
    }

    #[track_caller]
    pub fn misses(&self, name: &str) {
        assert!(!self.shows(name), "{name} is there");
    }

    pub fn messages(&self) -> String {
        let shown = self.model().messages.shown.iter();
        shown.map(|message| format!("{}\n", message.text)).collect()
    }

    /// Asserts that a message has these words.
    #[track_caller]
    pub fn says(&self, words: &str) {
        let said = self.messages();
        assert!(said.contains(words), "\"{words}\" is not in: {said}");
    }

    pub fn rect(&self, name: &str) -> Rect {
        self.harness.get_by_label(name).rect()
    }

    pub fn click(&mut self, name: &str) {
        self.harness.get_by_label(name).click();
        self.harness.run_steps(3);
    }

    /// Clicks on one after the other, as through a menu.
    pub fn click_through(&mut self, names: &[&str]) {
        for name in names {
            self.click(name);
        }
    }

    /// Chooses something in a dialog, as a screen reader does: wherever it is scrolled to.
    pub fn choose(&mut self, name: &str) {
        self.harness.run_steps(3);
        self.harness.get_by_label(name).click_accesskit();
        self.harness.run_steps(3);
    }

    pub fn press(&mut self, modifiers: Modifiers, key: Key) {
        self.harness.key_press_modifiers(modifiers, key);
        self.harness.run_steps(3);
    }

    pub fn hover(&mut self, place: Pos2) {
        self.harness.hover_at(place);
        self.harness.run_steps(3);
    }

    pub fn focus(&mut self, name: &str) {
        self.harness.get_by_label(name).focus();
        self.harness.run_steps(3);
    }

    /// The worker answers the present labels with a map of the frame in which every pixel has this class.
    pub fn publish(&mut self, frame: usize, class: u16) {
        self.worker().publish(frame, self.generation(), class);
        self.harness.run_steps(3);
    }

    /// The worker answers the present labels as they spread over a wall, with a map of the frame in view: before the rest of
    /// the scene follows, and then with its surface.
    pub fn spread(&mut self) {
        let mut spread = LabelPropagation::new(wall());
        let (scene, labels) = (Arc::clone(&self.workspace().scene), self.labels().clone());
        let (frame, generation) = (self.frame_index(), self.generation());
        spread.set_labels(&scene, &LabelSet::of_classes(labels.classes.clone()));
        let is_told = spread.set_labels_seen_in((&scene, &labels), (frame, generation), |map| {
            self.worker().maps.publish(map);
            self.tell(Event::Map { frame, generation });
        });
        assert!(is_told);
        self.tell(Event::AllMaps { generation });
    }

    /// Adds a class and clicks with it on the middle of the canvas.
    pub fn label(&mut self, class: &str) {
        self.add_class(class);
        self.click_canvas(0.0, 0.0);
    }

    pub fn key(&mut self, key: Key) {
        self.press(Modifiers::NONE, key);
    }

    /// Does something as a panel or a key would.
    pub fn act(&mut self, action: Command) {
        self.harness.state_mut().update(action);
        self.harness.run_steps(3);
    }

    /// Takes an entry of a list that opens at a click.
    pub fn pick(&mut self, list: &str, entry: &str) {
        self.harness.get_by_role_and_label(Role::ComboBox, list).click();
        self.harness.run_steps(3);
        self.click(entry);
    }

    fn focus_field(&mut self, field: &str) {
        self.harness.get_by_role_and_label(Role::TextInput, field).focus();
        self.harness.run_steps(2);
    }

    /// Types in place of all that is in a field, and presses Enter.
    pub fn replace_text(&mut self, field: &str, text: &str) {
        self.focus_field(field);
        self.press(Modifiers::COMMAND, Key::A);
        self.type_into(field, text);
    }

    /// Types into a field, after what is in it unless that is selected, and presses Enter.
    pub fn type_into(&mut self, field: &str, text: &str) {
        self.focus_field(field);
        self.harness
            .get_by_role_and_label(Role::TextInput, field)
            .type_text(text);
        self.harness.run_steps(2);
        self.press(Modifiers::NONE, Key::Enter);
    }

    /// Exports as the dialog says, into this folder.
    pub fn export(&mut self, folder: &Path) {
        self.press(Modifiers::COMMAND, Key::E);
        self.replace_text("Export folder", folder.to_str().unwrap());
    }

    pub fn is_exporting(&self) -> bool {
        matches!(self.model().export, Some(ExportProgress::Writing(..)))
    }

    pub fn until_exported(&mut self) {
        self.until_window("the export has ended", |window| !window.is_exporting());
    }

    pub fn save_as(&mut self, project: &Path) {
        self.press(Modifiers::COMMAND, Key::S);
        self.replace_text("Project file", project.to_str().unwrap());
        let named = project.to_path_buf();
        self.until("the project is saved", |app| {
            let project = app.model().project.as_ref();
            project.is_some_and(|project| project.named && project.path == named)
        });
    }

    pub fn add_class(&mut self, name: &str) {
        self.type_into("New class", name);
    }

    /// A point of the canvas, relative to its middle.
    pub fn canvas(&self, x: f32, y: f32) -> Pos2 {
        self.rect(CANVAS_NAME).center() + vec2(x, y)
    }

    pub fn click_canvas(&mut self, x: f32, y: f32) {
        let place = self.canvas(x, y);
        self.drag(PointerButton::Primary, &[place]);
    }

    /// Clicks with these keys held.
    pub fn click_canvas_with(&mut self, held: Modifiers, x: f32, y: f32) {
        let pos = self.canvas(x, y);
        self.harness.event(egui::Event::PointerMoved(pos));
        for pressed in [true, false] {
            let event = any_button(PointerButton::Primary, pos, pressed, held);
            self.harness.event_modifiers(event, held);
        }
        self.harness.run_steps(3);
    }

    /// Draws or erases a point of the image.
    pub fn point(&mut self, tool: Tool, pixel: Pixel) {
        let points = vec![pixel];
        self.act(Command::Draw(DrawnLine { tool, points }));
    }

    /// The worker suggests these places, from labels of this generation.
    pub fn suggest(&mut self, generation: u64, suggestions: Vec<Suggestion>) {
        self.tell(Event::Suggestions {
            generation,
            suggestions,
        });
    }

    /// Touches this place with one finger, and beside it with another one that moves twice as far away.
    pub fn pinch(&mut self, place: Pos2) {
        self.hover(place);
        let touch = |id, phase, x| egui::Event::Touch {
            device_id: TouchDeviceId(0),
            id: TouchId(id),
            phase,
            pos: place + vec2(x, 0.0),
            force: None,
        };
        // As quick as a click.
        for events in [
            vec![
                touch(0, TouchPhase::Start, 0.0),
                button(place, true),
                touch(1, TouchPhase::Start, 40.0),
            ],
            vec![touch(1, TouchPhase::Move, 80.0)],
            vec![
                touch(1, TouchPhase::End, 80.0),
                touch(0, TouchPhase::End, 0.0),
                button(place, false),
            ],
        ] {
            self.harness.input_mut().events.extend(events);
            self.harness.step();
        }
        self.harness.run_steps(3);
    }

    pub fn drag(&mut self, button: PointerButton, positions: &[Pos2]) {
        let (first, last) = (positions[0], positions[positions.len() - 1]);
        self.harness.event(egui::Event::PointerMoved(first));
        let button_at = |pos, pressed| any_button(button, pos, pressed, Modifiers::NONE);
        self.harness.event(button_at(first, true));
        for &position in &positions[1..] {
            self.harness.event(egui::Event::PointerMoved(position));
        }
        self.harness.event(button_at(last, false));
        self.harness.run_steps(3);
    }

    pub fn strokes(&self) -> usize {
        self.labels().strokes.len()
    }

    /// The objects that the strokes say, by their numbers.
    pub fn said(&self) -> Vec<Option<u16>> {
        let strokes = self.labels().strokes.values();
        strokes
            .map(|stroke| stroke.object.map(ObjectId::number))
            .collect()
    }
}
