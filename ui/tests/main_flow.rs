//! The main flow by accessible names, with a stand-in for the worker.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test ends where it fails"
)]

use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, Sender, unbounded};
use egui::{Key, Modifiers, PointerButton, Pos2, vec2};
use egui_kittest::{Harness, kittest::Queryable};
use inplace_core::guide::Suggestion;
use inplace_core::scene::{Camera, ColorImage, Frame, Scene, SceneSource};
use inplace_core::session::{Command, Event, FrameMap, MapSlots};
use inplace_ui::app::{App, Surroundings};
use inplace_ui::canvas::{CANVAS_NAME, Layer};
use inplace_ui::session_link::SessionLink;
use inplace_ui::workspace::Workspace;
use inplace_ui::{Target, UiOptions};

const WIDTH: u32 = 64;
const HEIGHT: u32 = 48;
const FRAMES: usize = 5;

/// The worker's end of a session.
#[derive(Clone)]
struct Worker {
    events: Sender<Event>,
    commands: Receiver<Command>,
    maps: Arc<MapSlots>,
}

impl Worker {
    /// Answers with a map of the frame in which every pixel has this class.
    fn publish(&self, frame: usize, generation: u64, class: u16) {
        let pixels = (WIDTH * HEIGHT) as usize;
        let (labels, entropy) = (vec![class; pixels], vec![500; pixels]);
        let map = FrameMap::new(frame, generation, [WIDTH, HEIGHT], labels, entropy);
        self.maps.publish(map.unwrap());
        self.events.send(Event::Map { frame, generation }).unwrap();
    }

    /// The commands since the last call.
    fn received(&self) -> Vec<Command> {
        self.commands.try_iter().collect()
    }
}

struct Link {
    commands: Sender<Command>,
    events: Receiver<Event>,
    maps: Arc<MapSlots>,
}

impl SessionLink for Link {
    fn send(&self, command: Command) {
        let _ = self.commands.send(command);
    }
    fn next_event(&self) -> Option<Event> {
        self.events.try_recv().ok()
    }
    fn maps(&self) -> &Arc<MapSlots> {
        &self.maps
    }
}

fn scene(source: SceneSource) -> Arc<Scene> {
    let frame = |index: usize| Frame {
        stem: format!("rgb_{index}"),
        path: PathBuf::new(),
        camera: Camera::with_horizontal_fov(WIDTH, HEIGHT, 90.0),
        camera_to_world: Default::default(),
        color: ColorImage::new(WIDTH, HEIGHT, vec![90; (WIDTH * HEIGHT * 3) as usize]).unwrap(),
        depth: None,
        points: Vec::new(),
        lens: None,
    };
    Arc::new(Scene {
        source,
        format: "test",
        frames: (0..FRAMES).map(frame).collect(),
        origin: Default::default(),
        unit: 1.0,
        warnings: Vec::new(),
        notes: Vec::new(),
    })
}

/// A window in a test, with the worker of its newest session.
struct Window {
    harness: Harness<'static, App>,
    workers: Arc<Mutex<Vec<Worker>>>,
}

impl Window {
    fn new(folder: &Path, open: Option<Target>) -> Self {
        let workers = Arc::new(Mutex::new(Vec::new()));
        let started = Arc::clone(&workers);
        let folder = folder.to_path_buf();
        let mut harness = Harness::builder()
            .with_size(vec2(1280.0, 720.0))
            .build_eframe(move |creation| {
                let around = Surroundings {
                    sessions: Box::new(move |options, _wake| {
                        let (commands, command_inbox) = unbounded();
                        let (event_outbox, events) = unbounded();
                        let maps = Arc::new(MapSlots::default());
                        maps.reset(FRAMES);
                        let scene = scene(options.source);
                        event_outbox.send(Event::Opened(scene)).unwrap();
                        started.lock().unwrap().push(Worker {
                            events: event_outbox,
                            commands: command_inbox,
                            maps: Arc::clone(&maps),
                        });
                        Box::new(Link {
                            commands,
                            events,
                            maps,
                        })
                    }),
                    autosave: Arc::new(move |_| folder.join("autosave.inplace")),
                    target: None,
                };
                let options = UiOptions {
                    open,
                    ..UiOptions::default()
                };
                App::new(&creation.egui_ctx, options, around)
            });
        harness.run_steps(2);
        Self { harness, workers }
    }

    fn with_demo(folder: &Path) -> Self {
        let mut window = Self::new(folder, Some(Target::Scene(SceneSource::Demo)));
        window.until("the scene is open", |app| app.state().workspace().is_some());
        window
    }

    /// Steps until something holds; it may depend on other threads.
    fn until(&mut self, what: &str, holds: impl Fn(&App) -> bool) {
        let start = Instant::now();
        while !holds(self.harness.state()) {
            assert!(
                start.elapsed() < Duration::from_secs(20),
                "waited in vain: {what}"
            );
            self.harness.step();
            std::thread::sleep(Duration::from_millis(2));
        }
        self.harness.run_steps(2);
    }

    fn workspace(&self) -> &Workspace {
        self.harness
            .state()
            .state()
            .workspace()
            .expect("no scene is open")
    }

    fn worker(&self) -> Worker {
        self.workers.lock().unwrap().last().unwrap().clone()
    }

    fn click(&mut self, name: &str) {
        self.harness.get_by_label(name).click();
        self.harness.run_steps(3);
    }

    fn press(&mut self, modifiers: Modifiers, key: Key) {
        self.harness.key_press_modifiers(modifiers, key);
        self.harness.run_steps(3);
    }

    fn type_into(&mut self, field: &str, text: &str) {
        self.harness
            .get_by_role_and_label(egui::accesskit::Role::TextInput, field)
            .focus();
        self.harness.run_steps(2);
        self.harness
            .get_by_role_and_label(egui::accesskit::Role::TextInput, field)
            .type_text(text);
        self.harness.run_steps(2);
        self.press(Modifiers::NONE, Key::Enter);
    }

    fn add_class(&mut self, name: &str) {
        self.type_into("New class", name);
    }

    /// A point of the canvas, relative to its middle.
    fn canvas(&self, x: f32, y: f32) -> Pos2 {
        self.harness.get_by_label(CANVAS_NAME).rect().center() + vec2(x, y)
    }

    fn drag(&mut self, button: PointerButton, positions: &[Pos2]) {
        let pressed = |pos, pressed| egui::Event::PointerButton {
            pos,
            button,
            pressed,
            modifiers: Modifiers::NONE,
        };
        let (first, last) = (positions[0], *positions.last().unwrap());
        self.harness.event(egui::Event::PointerMoved(first));
        self.harness.event(pressed(first, true));
        for &position in &positions[1..] {
            self.harness.event(egui::Event::PointerMoved(position));
        }
        self.harness.event(pressed(last, false));
        self.harness.run_steps(3);
    }

    fn strokes(&self) -> usize {
        self.workspace().document().labels().strokes.len()
    }
}

#[test]
fn the_start_page_opens_the_demo() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::new(folder.path(), None);
    window.harness.get_by_label("Open a folder...");
    window.click("Try the demo");
    window.until("the demo is open", |app| app.state().workspace().is_some());
    window.harness.get_by_label(CANVAS_NAME);
    assert_eq!(window.workspace().scene().frames.len(), FRAMES);
}

#[test]
fn a_click_becomes_a_stroke_and_its_map_is_shown_and_undo_takes_it_back() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.add_class("wall");
    window.harness.get_by_label("wall, 0 strokes");
    window.worker().received();
    let place = window.canvas(0.0, 0.0);
    window.drag(PointerButton::Primary, &[place]);
    window.harness.get_by_label("wall, 1 stroke");
    let generation = window.workspace().document().generation();
    assert!(window.worker().received().iter().any(|command| matches!(
        command,
        Command::Labels { generation: sent, labels } if *sent == generation && labels.strokes.len() == 1
    )));
    window.worker().publish(0, generation, 1);
    window.until("the map is shown", |app| {
        let shown = app
            .state()
            .workspace()
            .and_then(|workspace| workspace.shown_map());
        shown.is_some_and(|shown| shown.map.generation == generation)
    });
    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.strokes(), 0);
    window.press(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
    assert_eq!(window.strokes(), 1);
}

#[test]
fn a_click_without_any_class_asks_for_its_name_and_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    let place = window.canvas(10.0, 5.0);
    window.drag(PointerButton::Primary, &[place]);
    assert_eq!(window.strokes(), 0);
    window.type_into("Class name", "sofa");
    window.harness.get_by_label("sofa, 1 stroke");
    assert_eq!(window.strokes(), 1);
}

#[test]
fn a_scribble_keeps_every_position_and_the_right_button_erases_it() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.add_class("wall");
    let path = [
        window.canvas(-60.0, 0.0),
        window.canvas(0.0, 60.0),
        window.canvas(60.0, 0.0),
    ];
    window.drag(PointerButton::Primary, &path);
    let labels = window.workspace().document().labels();
    let (_, stroke) = labels.strokes_of(0).next().unwrap();
    assert_eq!(stroke.lines[0].len(), 3);
    window.drag(PointerButton::Secondary, &path);
    assert_eq!(window.strokes(), 0);
}

#[test]
fn undo_shows_the_frame_of_the_stroke() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.add_class("wall");
    let place = window.canvas(0.0, 0.0);
    window.drag(PointerButton::Primary, &[place]);
    window.press(Modifiers::NONE, Key::D);
    window.press(Modifiers::NONE, Key::D);
    assert_eq!(window.workspace().frame_index(), 2);
    window.press(Modifiers::COMMAND, Key::Z);
    assert_eq!(window.workspace().frame_index(), 0);
}

#[test]
fn keys_typed_into_a_text_field_do_nothing_else() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.type_into("New class", "desk pane");
    assert_eq!(window.workspace().frame_index(), 0);
    assert!(!window.workspace().is_paused());
    window.press(Modifiers::NONE, Key::Escape);
    window.harness.get_by_label("desk pane, 0 strokes");
}

#[test]
fn layers_change_by_button_and_by_key() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    let layer = |window: &Window| window.harness.state().state().settings.layer;
    window.click("Entropy");
    assert_eq!(layer(&window), Layer::Entropy);
    window.press(Modifiers::NONE, Key::Q);
    assert_eq!(layer(&window), Layer::Color);
}

#[test]
fn classes_are_renamed_merged_and_deleted_and_all_of_it_is_undone() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.add_class("wall");
    window.add_class("floor");
    let place = window.canvas(0.0, 0.0);
    window.drag(PointerButton::Primary, &[place]);
    let names = |window: &Window| -> Vec<String> {
        let classes = window.workspace().document().classes();
        classes.iter().map(|class| class.name.clone()).collect()
    };

    window.click("Actions for wall");
    window.click("Rename");
    let field = "Rename wall";
    for _ in 0..4 {
        window.press(Modifiers::NONE, Key::Backspace);
    }
    window.type_into(field, "ceiling");
    assert_eq!(names(&window), ["ceiling", "floor"]);

    window.click("Actions for floor");
    window.click("Merge into");
    window.click("ceiling");
    assert_eq!(names(&window), ["ceiling"]);
    window.harness.get_by_label("ceiling, 1 stroke");

    window.click("Actions for ceiling");
    window.click("Delete with its stroke");
    assert_eq!(names(&window), [""; 0]);
    assert_eq!(window.strokes(), 0);

    for _ in 0..3 {
        window.press(Modifiers::COMMAND, Key::Z);
    }
    assert_eq!(names(&window), ["wall", "floor"]);
    assert_eq!(window.strokes(), 1);
}

#[test]
fn a_suggestion_is_gone_to_and_labelled_with_a_likely_class() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.add_class("wall");
    let suggestion = Suggestion {
        frame: 3,
        pixel: [20, 30],
        outline: vec![[10.0, 20.0], [30.0, 20.0], [20.0, 40.0]],
        score: 1.0,
        entropy: 0.6,
        share: 0.04,
        classes: vec![1],
    };
    let suggestions = Event::Suggestions {
        generation: 1,
        suggestions: vec![suggestion],
    };
    window.worker().events.send(suggestions).unwrap();
    for x in [0.0, 5.0] {
        window.harness.hover_at(window.canvas(x, 0.0));
        window.harness.run_steps(2);
    }
    window.press(Modifiers::NONE, Key::N);
    assert_eq!(window.workspace().frame_index(), 3);
    window.press(Modifiers::NONE, Key::A);
    window.click("Label as wall");
    assert_eq!(window.workspace().frame_index(), 3);
    let labels = window.workspace().document().labels();
    let (_, stroke) = labels.strokes_of(3).next().unwrap();
    assert_eq!((stroke.class, stroke.first_point()), (1, Some([20, 30])));
}

#[test]
fn an_older_map_never_covers_a_newer_one() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.worker().publish(0, 5, 1);
    window.worker().publish(0, 4, 2);
    window.harness.run_steps(3);
    assert_eq!(window.workspace().shown_map().unwrap().map.labels()[0], 1);
}

#[test]
fn what_the_worker_reports_as_failed_is_shown_in_one_sentence() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    let sentence = "The surface could not be found.";
    window
        .worker()
        .events
        .send(Event::Error(sentence.to_owned()))
        .unwrap();
    window.harness.run_steps(3);
    window.harness.get_by_label(sentence);
    window.click("Dismiss message");
    assert!(window.harness.query_by_label(sentence).is_none());
}

#[test]
fn a_saved_project_opens_again_with_its_strokes_and_its_maps() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("room.inplace");
    {
        let mut window = Window::with_demo(folder.path());
        window.add_class("wall");
        let place = window.canvas(0.0, 0.0);
        window.drag(PointerButton::Primary, &[place]);
        let generation = window.workspace().document().generation();
        window.worker().publish(0, generation, 1);
        window.harness.run_steps(3);
        window.press(Modifiers::COMMAND, Key::S);
        let field = window.harness.get_by_label("Project file");
        field.focus();
        window.harness.run_steps(2);
        window.press(Modifiers::COMMAND, Key::A);
        window.type_into("Project file", file.to_str().unwrap());
        let named = file.clone();
        window.until("the project is saved", |app| {
            let keeper = app.state().keeper.as_ref();
            keeper.is_some_and(|keeper| keeper.is_named() && keeper.path() == named)
        });
        assert!(!folder.path().join("autosave.inplace").exists());
        eframe::App::on_exit(window.harness.state_mut(), None);
    }
    let mut window = Window::new(folder.path(), Some(Target::Path(file)));
    window.until("the project is open", |app| app.state().workspace().is_some());
    window.harness.get_by_label("wall, 1 stroke");
    assert_eq!(window.workspace().shown_map().unwrap().map.labels()[0], 1);
}

#[test]
fn work_that_was_never_saved_is_recovered_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    {
        let mut window = Window::with_demo(folder.path());
        window.add_class("wall");
        let place = window.canvas(0.0, 0.0);
        window.drag(PointerButton::Primary, &[place]);
        eframe::App::on_exit(window.harness.state_mut(), None);
    }
    let window = Window::with_demo(folder.path());
    assert_eq!(window.strokes(), 1);
    window
        .harness
        .get_by_label("Your earlier work on this scene was recovered: 1 stroke.");
}

#[test]
fn an_export_says_where_its_files_are() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut window = Window::with_demo(folder.path());
    window.add_class("wall");
    for frame in 0..FRAMES {
        window.worker().publish(frame, 1, 1);
    }
    window.press(Modifiers::COMMAND, Key::E);
    window.press(Modifiers::COMMAND, Key::A);
    window.type_into("Export folder", out.to_str().unwrap());
    window.until("the export has ended", |app| {
        !matches!(
            app.state().export,
            Some(inplace_ui::exporting::Progress::Writing(..))
        )
    });
    window.harness.get_by_label(&format!("Exported {FRAMES} frames"));
    window.harness.get_by_label(out.to_str().unwrap());
    for file in [
        "labels/rgb_0.png",
        "entropy/rgb_4.png",
        "classes.json",
        "strokes.json",
    ] {
        assert!(out.join(file).is_file(), "{file} is missing");
    }
}

#[test]
fn label_images_are_imported_undone_removed_and_kept_in_the_project() {
    let folder = tempfile::tempdir().unwrap();
    let images = folder.path().join("predictions");
    std::fs::create_dir(&images).unwrap();
    let import = |window: &mut Window, path: &Path| {
        window.click("File");
        window.click("Import labels...");
        window.press(Modifiers::COMMAND, Key::A);
        window.type_into("Folder of label images", path.to_str().unwrap());
    };
    let imported = |window: &Window| window.workspace().document().labels().imported.clone();
    {
        let mut window = Window::with_demo(folder.path());
        import(&mut window, &images);
        window.until("the error is shown", |app| app.state().toasts.texts().count() > 0);
        assert!(imported(&window).is_none());

        let image = image::GrayImage::from_pixel(WIDTH, HEIGHT, image::Luma([7]));
        image.save(images.join("rgb_1.png")).unwrap();
        window.worker().received();
        import(&mut window, &images);
        window.until("the images are imported", |app| {
            let workspace = app.state().workspace().unwrap();
            workspace.document().labels().imported.is_some()
        });
        window.harness.get_by_label("class 7, 0 strokes");
        assert!(window.worker().received().iter().any(|command| matches!(
            command,
            Command::Labels { labels, .. } if labels.imported.is_some()
        )));
        window.press(Modifiers::COMMAND, Key::Z);
        assert!(imported(&window).is_none());
        assert!(window.workspace().document().classes().is_empty());
        window.press(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
        window.click("File");
        window.click("Remove imported labels");
        assert!(imported(&window).is_none());
        window.press(Modifiers::COMMAND, Key::Z);
        assert!(imported(&window).is_some());
        eframe::App::on_exit(window.harness.state_mut(), None);
    }
    let window = Window::with_demo(folder.path());
    let images = imported(&window).unwrap();
    assert_eq!((images.maps.len(), images.maps[0].frame), (1, 1));
    window
        .harness
        .get_by_label("Your earlier work on this scene was recovered: 0 strokes and imported labels.");
}

#[test]
fn the_question_mark_shows_every_key() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.press(Modifiers::SHIFT, Key::Questionmark);
    window.harness.get_by_label("Pause or resume training");
    window.harness.run_steps(5);
    window.click("Close");
    assert!(
        window
            .harness
            .query_by_label("Pause or resume training")
            .is_none()
    );
}

#[test]
fn a_path_that_cannot_be_opened_is_one_sentence_on_the_start_page() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("broken.inplace");
    std::fs::write(&file, "not a project").unwrap();
    let mut window = Window::new(folder.path(), Some(Target::Path(file)));
    window.until("the error is shown", |app| app.state().toasts.texts().count() > 0);
    window.harness.get_by_label("Try the demo");
    let state = window.harness.state().state();
    let text = state.toasts.texts().next().unwrap();
    assert!(text.contains("broken.inplace"), "{text}");
}
