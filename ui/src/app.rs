//! The window's program: it collects input for the model, carries out the model's effects, and draws the views.

mod effects;
mod frame;

use std::path::PathBuf;
use std::time::Instant;

use inplace_core::session::{Session, SessionOptions};
use inplace_model::jobs::AutosavePath;
use inplace_model::model::Start;
use inplace_model::opening::Target;
use inplace_model::preferences::Store;
use inplace_model::project_session::Ending;
use inplace_model::{Command, Model};

use crate::canvas::Canvas;
use crate::dialogs::Dialogs;
use crate::input_order::InputOrder;
use crate::jobs::Jobs;
use crate::panels::Panels;
use crate::stats::Stats;
use crate::theme;
use crate::trace::Trace;

/// What the window starts with.
#[derive(Clone, Debug, Default)]
pub struct UiOptions {
    /// What is opened first; `None` = the start page, or the demo where nothing was opened before.
    pub open: Option<Target>,
    /// How scenes are read and learnt.
    pub start: Start,
    /// Measure the window of the program that started then, and print the measurements at exit.
    pub stats: Option<Instant>,
    /// File that a record of what happens is written to.
    pub trace: Option<PathBuf>,
}

/// Starts sessions; the function is to be called after every event. Tests answer them in place of a worker.
pub type SessionStarter = Box<dyn Fn(SessionOptions, Box<dyn Fn() + Send + Sync>) -> Session>;

/// What the window needs from outside; tests bring their own.
pub struct Environment {
    /// Starts sessions.
    pub sessions: SessionStarter,
    /// Where unnamed work is kept.
    pub autosave: AutosavePath,
    /// What the person prefers, and where that is kept.
    pub preferences: Store,
    /// Folder of the pictures of what was opened lately.
    pub pictures: PathBuf,
    /// What draws the window, in words.
    pub renderer: String,
    /// The window's pixel format where wgpu draws it.
    pub target: Option<wgpu::TextureFormat>,
}

/// The window's program.
pub struct App {
    model: Model,
    canvas: Canvas,
    panels: Panels,
    dialogs: Dialogs,
    jobs: Jobs,
    ctx: egui::Context,
    sessions: SessionStarter,
    autosave: AutosavePath,
    store: Store,
    /// Files that were closed and are still being written.
    endings: Vec<Ending>,
    title: String,
    /// Whether the start page was shown in the last frame.
    at_start: bool,
    /// Measurements, where asked for.
    stats: Option<Stats>,
    trace: Option<Trace>,
}

impl App {
    /// A window's program with nothing open yet, or opening what the options name.
    pub fn new(ctx: &egui::Context, options: UiOptions, environment: Environment) -> Self {
        theme::install(ctx);
        ctx.add_plugin(InputOrder::default());
        // The scale has limits here, and is kept.
        ctx.options_mut(|options| options.zoom_with_keyboard = false);
        let canvas = Canvas::new(environment.target);
        let stats = options
            .stats
            .map(|started| Stats::new(canvas.clock.clone(), environment.renderer, started));
        let mut app = Self {
            model: Model::new(options.start, environment.preferences.preferences().clone()),
            canvas,
            panels: Panels::default(),
            dialogs: Dialogs::default(),
            jobs: Jobs::new(ctx.clone(), environment.pictures),
            ctx: ctx.clone(),
            sessions: environment.sessions,
            autosave: environment.autosave,
            store: environment.preferences,
            endings: Vec::new(),
            title: String::new(),
            at_start: true,
            stats,
            trace: options.trace.map(Trace::new),
        };
        app.wear_preferences();
        app.look_at_recents();
        if let Some(target) = options.open {
            app.update(Command::Open(target));
        }
        app
    }

    /// Looks what is still there of what was opened lately: a disk may have come or gone.
    fn look_at_recents(&self) {
        let recents = &self.model.preferences.recents;
        if !recents.is_empty() {
            let places = recents.iter().map(|recent| recent.place.clone());
            self.jobs.look_at(places.collect());
        }
    }

    /// What the views read.
    pub fn model(&self) -> &Model {
        &self.model
    }

    /// The canvas.
    pub fn canvas(&self) -> &Canvas {
        &self.canvas
    }

    /// The panels.
    pub fn panels(&self) -> &Panels {
        &self.panels
    }
}
