//! The window's program: drains what others tell, draws the panels, carries out the actions.

mod draining;
mod ending;
mod frame;
mod opening;

use std::collections::HashMap;
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::Instant;

use inplace_core::scene::SceneSource;

use crate::UiOptions;
use crate::canvas::Canvas;
use crate::dialogs::ExportChoice;
use crate::jobs::Jobs;
use crate::keeper::Ending;
use crate::panels::Panels;
use crate::preferences::Store;
use crate::session_link::SessionStarter;
use crate::state::{AppState, Settings, Stage};
use crate::stats::Stats;
use crate::toasts::Toasts;
use crate::trace::Trace;

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
                export_choice: ExportChoice::new(),
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
}
