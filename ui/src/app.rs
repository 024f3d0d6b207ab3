//! The window's program: drains what others tell, draws the panels, carries out the actions.

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use egui::{Event, Key};
use inplace_core::project::JournalEvent;
use inplace_core::scene::SceneSource;
use inplace_core::session::{self, Command, SessionOptions};

use crate::UiOptions;
use crate::action::Actions;
use crate::canvas::Canvas;
use crate::class_view::ClassView;
use crate::document::Document;
use crate::english;
use crate::jobs::{Done, Jobs};
use crate::keeper::{Ending, Keeper};
use crate::opening::{self, Attached, Prepared, Refusal, Target};
use crate::panels::Panels;
use crate::preferences::Store;
use crate::session_link::{Running, SessionStarter};
use crate::state::{AppState, Opening, Settings, Stage};
use crate::stats::Stats;
use crate::toasts::Toasts;
use crate::trace::Trace;
use crate::workspace::Workspace;

/// How long the end of the program waits for the worker's model state.
const LAST_STATE: Duration = Duration::from_secs(2);

/// Most worker events looked at in one frame.
const EVENTS_A_FRAME: usize = 256;

/// Where the work on a scene that has no project file yet is kept.
pub type AutosavePath = Arc<dyn Fn(&SceneSource) -> PathBuf + Send + Sync>;

/// What the window needs from outside; tests bring their own.
pub struct Surroundings {
    /// Starts sessions.
    pub sessions: SessionStarter,
    /// Where unnamed work is kept.
    pub autosave: AutosavePath,
    /// What the person prefers, and where that is kept.
    pub preferences: Store,
    /// Folder of the pictures of what was opened lately.
    pub pictures: PathBuf,
    /// The window's pixel format where wgpu draws it.
    pub target: Option<wgpu::TextureFormat>,
}

/// The window's program.
pub struct App {
    pub(crate) state: AppState,
    pub(crate) canvas: Canvas,
    pub(crate) jobs: Jobs,
    pub(crate) ctx: egui::Context,
    panels: Panels,
    sessions: SessionStarter,
    pub(crate) autosave: AutosavePath,
    pub(crate) store: Store,
    pub(crate) pictures: PathBuf,
    /// The settings as they were when the preferences were last compared with them.
    pub(crate) settings_seen: Settings,
    /// Files that were closed and are still being written.
    endings: Vec<Ending>,
    threads: Option<usize>,
    seed: u64,
    pub(crate) last_ticket: u64,
    /// Set to stop the export that is under way.
    pub(crate) export_stop: Arc<AtomicBool>,
    /// The window was to be closed during an export.
    pub(crate) closes_after_export: bool,
    title: String,
    frame_started: Option<Instant>,
    trace: Option<Trace>,
}

impl App {
    /// A window's program with nothing open yet, or opening what the options name.
    pub fn new(ctx: &egui::Context, options: UiOptions, around: Surroundings) -> Self {
        crate::theme::install(ctx);
        let canvas = Canvas::new(around.target);
        let stats = options.stats.then(|| Stats::new(Arc::clone(canvas.clock())));
        let mut app = Self {
            state: AppState {
                stage: Stage::Start,
                keeper: None,
                settings: Settings::default(),
                preferences: around.preferences.preferences().clone(),
                found: HashMap::new(),
                open: options.read,
                read: options.read,
                preset: options.preset,
                out: options.out,
                dialog: None,
                export: None,
                stopping_export: false,
                importing: None,
                side: crate::state::Side::default(),
                toasts: Toasts::default(),
                stats,
                overlay_hidden: false,
            },
            canvas,
            jobs: Jobs::new(ctx.clone()),
            ctx: ctx.clone(),
            panels: Panels::new(ctx),
            sessions: around.sessions,
            autosave: around.autosave,
            store: around.preferences,
            pictures: around.pictures,
            settings_seen: Settings::default(),
            endings: Vec::new(),
            threads: options.threads,
            seed: options.seed,
            last_ticket: 0,
            export_stop: Arc::default(),
            closes_after_export: false,
            title: String::new(),
            frame_started: None,
            trace: options.trace.map(Trace::new),
        };
        // The scale has limits here, and is kept.
        ctx.options_mut(|options| options.zoom_with_keyboard = false);
        app.wear_preferences();
        let settings = app.preferred_settings();
        app.take_settings(settings);
        app.look_at_recents();
        if let Some(target) = options.open {
            app.open(target);
        }
        app
    }

    /// What the panels read.
    pub fn state(&self) -> &AppState {
        &self.state
    }

    /// Does something as a panel or a key would.
    pub fn act(&mut self, action: crate::action::Action) {
        self.apply(action);
    }

    /// The canvas.
    pub fn canvas(&self) -> &Canvas {
        &self.canvas
    }

    /// Starts opening something; what was open is kept and closed.
    pub(crate) fn open(&mut self, target: Target) {
        self.close();
        self.last_ticket += 1;
        let ticket = self.last_ticket;
        self.state.stage = Stage::Opening(Box::new(Opening {
            ticket,
            target: target.clone(),
            progress: (0, 0),
            session: None,
            prepared: None,
        }));
        let (open, autosave) = (self.state.open, Arc::clone(&self.autosave));
        self.endings.retain(|ending| !ending.is_done());
        let endings = self.endings.clone();
        self.jobs.spawn("open", move |tell| {
            let prepared = opening::prepare(target, open, autosave.as_ref(), &endings);
            tell(Done::Prepared(ticket, Box::new(prepared)));
        });
    }

    /// Keeps and closes what is open.
    pub(crate) fn close(&mut self) {
        self.keep_results();
        self.note_recent();
        self.state.stage = Stage::Start;
        self.endings
            .extend(self.state.keeper.take().and_then(Keeper::end));
        self.state.importing = None;
        // An export goes on: it has all that it needs.
        if !self.is_exporting() {
            self.state.export = None;
        }
        self.state.dialog = None;
    }

    /// Keeps the newest maps and model, so that the project shows them at once when it is opened again.
    pub(crate) fn keep_results(&self) {
        let (Some(workspace), Some(keeper)) = (self.state.workspace(), &self.state.keeper) else {
            return;
        };
        let frames = 0..workspace.scene().frames.len();
        let maps = workspace.session().maps().map_or_else(Vec::new, |slots| {
            frames.filter_map(|frame| slots.get(frame)).collect()
        });
        let view = workspace.kept_view(&self.state.settings);
        keeper.keep_results(maps, workspace.state(), view);
    }

    /// Threads of the worker's pool: as the command line says, as preferred, or all cores but one.
    fn threads(&self) -> usize {
        let preferred = self.state.preferences.threads;
        let chosen = self
            .threads
            .or(preferred.map(|threads| threads.min(crate::run::cores())));
        chosen.unwrap_or_else(crate::run::usual_threads).max(1)
    }

    fn start_session(&mut self, ticket: u64, prepared: Prepared) {
        let options = SessionOptions {
            source: prepared.source.clone(),
            open: prepared.open,
            preset: self.state.preset,
            threads: self.threads(),
            seed: self.seed,
            state: prepared.state(),
        };
        let Stage::Opening(opening) = &mut self.state.stage else {
            return;
        };
        if opening.ticket != ticket {
            return;
        }
        let ctx = self.ctx.clone();
        let session = (self.sessions)(options, Box::new(move || ctx.request_repaint()));
        self.state.read = prepared.open;
        opening.session = Some(Running::new(session));
        opening.prepared = Some(prepared);
    }

    /// The scene is read: fit what is kept to it, on a thread.
    fn attach(&mut self, scene: Arc<inplace_core::scene::Scene>) {
        let Stage::Opening(opening) = &mut self.state.stage else {
            return;
        };
        let Some(prepared) = opening.prepared.take() else {
            return;
        };
        let maps = opening
            .session
            .as_ref()
            .and_then(|session| session.maps().cloned());
        let (ticket, ctx) = (opening.ticket, self.ctx.clone());
        self.jobs.spawn("attach", move |tell| {
            let wake = move || ctx.request_repaint();
            let attached = opening::attach(prepared, &scene, maps.as_ref(), wake);
            tell(Done::Attached(ticket, scene, Box::new(attached)));
        });
    }

    fn show_workspace(&mut self, ticket: u64, scene: Arc<inplace_core::scene::Scene>, attached: Attached) {
        let Stage::Opening(opening) = &mut self.state.stage else {
            return;
        };
        if opening.ticket != ticket {
            return;
        }
        let Some(session) = opening.session.take() else {
            return;
        };
        for warning in &scene.warnings {
            self.state.toasts.info(warning);
        }
        for note in attached.notes {
            self.state.toasts.info(note);
        }
        if let Some(problem) = attached.problem {
            self.state.toasts.error(problem);
        }
        let mut settings = self.preferred_settings();
        if let Some(view) = &attached.view {
            settings.take_json(view);
        }
        self.take_settings(settings);
        let document = Document::new(attached.history, attached.generation);
        let mut workspace = Workspace::new(scene, ticket, session, document, &self.ctx);
        if let Some(view) = &attached.view {
            workspace.overview_mut().log_mut().take_view(view);
        }
        self.state.keeper = Some(attached.keeper);
        if let Some(view) = &attached.view {
            workspace.change_class_view(|classes| *classes = ClassView::of_json(view));
        }
        self.state.stage = Stage::Open(Box::new(workspace));
        self.note_recent();
    }

    fn drain_jobs(&mut self) {
        while let Some(done) = self.jobs.next() {
            match done {
                Done::Picked(purpose, path) => self.picked(purpose, path),
                Done::Prepared(ticket, prepared) => match *prepared {
                    Ok(prepared) => self.start_session(ticket, prepared),
                    Err(Refusal::Sentence(sentence)) => self.opening_failed(ticket, sentence),
                    Err(Refusal::SceneGone { project, missing }) => {
                        self.scene_gone(ticket, project, missing);
                    }
                },
                Done::Attached(ticket, scene, attached) => match *attached {
                    Ok(attached) => self.show_workspace(ticket, scene, attached),
                    Err(sentence) => self.other_scene(ticket, &scene.source, sentence),
                },
                Done::Seen(seen) => self.seen(seen),
                Done::Kept(serial, keeper) => self.kept(serial, *keeper),
                Done::Exported(progress) => self.exported(progress),
                Done::Imported(ticket, images) => self.imported(ticket, *images),
                Done::Summarised(serial, made) => self.summarised(serial, made),
                Done::ClassesRead(read) => self.classes_read(read),
                Done::ClassesSaved(count, path) => self.classes_saved(count, &path),
                Done::Failed(sentence) => self.state.toasts.error(sentence),
            }
        }
    }

    /// The work in memory has a file from now on.
    fn kept(&mut self, serial: u64, mut keeper: Keeper) {
        if let Some(workspace) = self.state.workspace()
            && workspace.serial() == serial
        {
            keeper.catch_up(self.state.keeper.take());
            let path = keeper.path().to_path_buf();
            let before = self.state.place();
            self.state.keeper = Some(keeper);
            self.keep_results();
            self.note_named(before);
            self.state.toasts.info(english::saving::saved_to(&path));
        }
    }

    fn drain_session(&mut self) {
        for _ in 0..EVENTS_A_FRAME {
            let event = match &self.state.stage {
                Stage::Start => None,
                Stage::Opening(opening) => opening.session.as_ref().and_then(Running::next_event),
                Stage::Open(workspace) => workspace.session().next_event(),
            };
            let Some(event) = event else {
                return;
            };
            self.on_session_event(event);
        }
        self.ctx.request_repaint();
    }

    fn on_session_event(&mut self, event: session::Event) {
        match &mut self.state.stage {
            Stage::Open(workspace) => {
                if let (session::Event::State(state), Some(keeper)) = (&event, &self.state.keeper) {
                    keeper.keep_model(state);
                }
                let (frame, guided) = (workspace.frame_index(), workspace.guidance().is_active());
                let told = workspace.on_event(event);
                let moved = workspace.frame_index() != frame;
                let ended = guided && !workspace.guidance().is_active();
                if let Some(sentence) = told {
                    self.state.toasts.error(sentence);
                }
                if moved {
                    self.looked_away();
                }
                if ended {
                    self.state.toasts.info(english::guidance::NOTHING_LEFT);
                }
            }
            Stage::Opening(opening) => match event {
                session::Event::Opening { done, total } => opening.progress = (done, total),
                session::Event::Opened(scene) => self.attach(scene),
                session::Event::Error(sentence) => {
                    let ticket = opening.ticket;
                    self.opening_failed(ticket, sentence);
                }
                _ => {}
            },
            Stage::Start => {}
        }
    }

    fn drain_keeper(&mut self) {
        loop {
            let unnamed = self
                .state
                .keeper
                .as_ref()
                .is_some_and(|keeper| !keeper.is_named());
            let before = unnamed.then(|| self.state.place()).flatten();
            let Some(event) = self.state.keeper.as_mut().and_then(Keeper::next_event) else {
                return;
            };
            match event {
                JournalEvent::Saved { path } => {
                    self.keep_results();
                    self.note_named(before);
                    self.state.toasts.info(english::saving::saved_to(&path));
                }
                JournalEvent::Failed(sentence) => self.state.toasts.error(sentence),
                JournalEvent::Recovered { path } => {
                    self.state.toasts.info(english::saving::writable_again(&path));
                }
            }
        }
    }

    fn set_title(&mut self) {
        let saved = self.state.keeper.as_ref().map(Keeper::saved_state);
        let title = english::saving::title(self.state.document_name().as_deref(), saved);
        if title != self.title {
            self.title.clone_from(&title);
            self.ctx.send_viewport_cmd(egui::ViewportCommand::Title(title));
        }
    }

    fn take_dropped_files(&self, actions: &mut Actions) {
        let dropped = self.ctx.input(|input| {
            let first = input.raw.dropped_files.first();
            first.map(|file| file.path().to_path_buf())
        });
        if let Some(path) = dropped {
            actions.push(crate::action::Action::OpenPath(path));
        }
    }

    /// Waits for the model state and for the disk: the window is gone.
    fn end(&mut self) {
        if let Stage::Open(workspace) = &mut self.state.stage
            && !workspace.has_ended()
        {
            let before = workspace.state().cloned();
            workspace.session().send(Command::Save);
            let until = Instant::now() + LAST_STATE;
            let is_new = |workspace: &Workspace| match (workspace.state(), &before) {
                (Some(now), Some(before)) => !Arc::ptr_eq(now, before),
                (now, _) => now.is_some(),
            };
            while Instant::now() < until && !is_new(workspace) && !workspace.has_ended() {
                match workspace.session().next_event() {
                    Some(event) => drop(workspace.on_event(event)),
                    None => std::thread::sleep(Duration::from_millis(5)),
                }
            }
        }
        self.keep_results();
        self.keep_preferences();
        self.note_recent_last();
        if let Some(keeper) = self.state.keeper.take() {
            keeper.close();
        }
        self.state.stage = Stage::Start;
    }
}

impl eframe::App for App {
    fn logic(&mut self, _ctx: &egui::Context, _frame: &mut eframe::Frame) {
        self.frame_started = Some(Instant::now());
        if let Some(stats) = &mut self.state.stats {
            stats.frame_begins();
        }
        self.drain_jobs();
        self.drain_session();
        self.drain_keeper();
        self.look_over();
        self.hold_open_while_exporting();
        self.prepare_layers();
        let ctx = self.ctx.clone();
        self.state.toasts.expire(&ctx);
        self.set_title();
    }

    fn ui(&mut self, ui: &mut egui::Ui, frame: &mut eframe::Frame) {
        let mut actions = Actions::default();
        let ctx = self.ctx.clone();
        if ctx.current_pass_index() == 0 {
            self.take_dropped_files(&mut actions);
            if self.state.dialog.is_none() {
                let workspace = self.state.workspace();
                let guided = workspace.is_some_and(|workspace| workspace.guidance().is_active());
                self.canvas.take_keys(&ctx, &self.state, &mut actions);
                crate::keys::dispatch(&ctx, guided, &mut actions);
            }
        }
        // What an open dialog or a text field does with Escape comes before the messages.
        let escape = self.state.dialog.is_none() && !ctx.text_edit_focused();
        self.panels.show(ui, &self.state, &mut self.canvas, &mut actions);
        let mut dialog = self.state.dialog.take();
        if let Some(dialog) = &mut dialog {
            dialog.show(&ctx, &self.state, &mut actions);
        }
        self.state.dialog = dialog;
        let area = match self.state.stage {
            Stage::Open(_) => self.canvas.rect(),
            Stage::Start | Stage::Opening(_) => ctx.content_rect(),
        };
        crate::panels::work(&ctx, &self.state, area, &mut actions);
        crate::panels::drop_area(&ctx);
        self.state.toasts.show(&ctx, area, escape, &mut actions);
        for action in actions.take() {
            self.apply(action);
            ctx.request_repaint();
        }
        // What an action asks for is under way before the next frame.
        self.prepare_layers();
        self.keep_preferences();
        if let Some(trace) = &mut self.trace {
            trace.observe(&self.state, ctx.text_edit_focused());
        }
        if let (Some(stats), Some(started)) = (&mut self.state.stats, self.frame_started) {
            stats.frame_done(started.elapsed(), frame.info().cpu_usage);
        }
    }

    /// Over the canvas the Tab key hides the overlay; elsewhere it moves the focus as usual.
    fn raw_input_hook(&mut self, ctx: &egui::Context, input: &mut egui::RawInput) {
        let over_canvas = self.state.dialog.is_none()
            && self.state.workspace().is_some()
            && !ctx.text_edit_focused()
            && ctx
                .pointer_hover_pos()
                .is_some_and(|position| self.canvas.rect().contains(position));
        let mut hidden = self.state.overlay_hidden;
        input.events.retain(|event| match event {
            Event::Key {
                key: Key::Tab,
                pressed,
                ..
            } if over_canvas || (hidden && !pressed) => {
                hidden = *pressed;
                false
            }
            Event::WindowFocused(false) => {
                hidden = false;
                true
            }
            _ => true,
        });
        self.state.overlay_hidden = hidden;
    }

    fn on_exit(&mut self, _gl: Option<&eframe::glow::Context>) {
        self.end();
        if let Some(stats) = &self.state.stats {
            eprintln!("{}", stats.json());
        }
    }
}
