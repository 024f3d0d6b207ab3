//! A session: a background worker that opens a scene, trains its field and keeps every frame's maps
//! in step with the labels. The window and the headless commands use the same one.

mod background;
mod client;
mod demand;
mod estimating;
mod maps;
mod message;
mod opening;
mod outbox;
mod progress;
mod rendering;
mod semantic_trainer;
mod serve;
mod status_reporter;
mod surface_refiner;
mod thread;
mod worker;

use std::sync::Arc;
use std::thread::JoinHandle;

use crossbeam_channel::{Receiver, Sender, unbounded};

use crate::scene::Scene;
pub use crate::semantics::{
    CERTAIN, ENTROPY_STEPS_PER_NAT, FrameMap, FrameSummary, PixelAnswer, Preview, StrokeCheck,
};
pub use client::{Client, ClientError};
pub use demand::{Measured, TrainingEnd};
pub use maps::MapSlots;
pub use message::{Command, Event, ModelState, Phase, Saved, SessionOptions, Status};
pub use progress::Progress;
pub use rendering::{RenderedLabels, RenderedView};
pub use semantic_trainer::sampling;
pub use surface_refiner::SurfaceRefiner;

/// A handle to the worker. Dropping it stops the worker, and waits for it unless it is beside a window.
#[derive(Debug)]
pub struct Session {
    commands: Sender<Command>,
    events: Receiver<Event>,
    maps: Arc<MapSlots>,
    /// `None` where nobody waits for its end.
    worker: Option<JoinHandle<()>>,
}

impl Session {
    /// Starts a worker; `wake` is called after every event, from the worker's threads.
    pub fn start(options: SessionOptions, wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self::begin(options, None, false, wake)
    }

    /// Starts a worker that gives way to a window: where one is drawn without a GPU, both want all cores.
    pub fn beside_window(options: SessionOptions, wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self::begin(options, None, true, wake)
    }

    /// Starts a worker on a scene that is already open; the options' source is not read.
    pub fn on(scene: Arc<Scene>, options: SessionOptions, wake: impl Fn() + Send + Sync + 'static) -> Self {
        Self::begin(options, Some(scene), false, wake)
    }

    fn begin(
        options: SessionOptions,
        scene: Option<Arc<Scene>>,
        gives_way: bool,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Self {
        let (command_sender, commands) = unbounded();
        let (event_sender, events) = unbounded();
        let maps = Arc::new(MapSlots::default());
        let outbox = outbox::Outbox::new(event_sender, Arc::clone(&maps), Box::new(wake));
        let thread = std::thread::Builder::new().name("inplace-worker".to_owned());
        let failed = outbox.clone();
        let worker = thread.spawn(move || {
            if gives_way {
                thread::give_way();
            }
            thread::run(options, scene, &commands, &outbox);
        });
        let worker = match worker {
            Ok(handle) => (!gives_way).then_some(handle),
            Err(error) => {
                failed.send(Event::Error(format!(
                    "the training thread could not be started: {error}"
                )));
                None
            }
        };
        Self {
            commands: command_sender,
            events,
            maps,
            worker,
        }
    }

    /// A session with somebody else at the other end of these channels in place of a worker, as tests have it.
    pub fn answered_by(commands: Sender<Command>, events: Receiver<Event>, maps: Arc<MapSlots>) -> Self {
        Self {
            commands,
            events,
            maps,
            worker: None,
        }
    }

    /// Asks the worker to do something; never waits. Without effect once the worker has ended.
    pub fn send(&self, command: Command) {
        // A worker that has ended has reported it by `Event::Stopped` or `Event::Error`.
        let _ = self.commands.send(command);
    }

    /// The worker's events, oldest first.
    pub fn events(&self) -> &Receiver<Event> {
        &self.events
    }

    /// The newest map of every frame.
    pub fn maps(&self) -> &Arc<MapSlots> {
        &self.maps
    }
}

impl Drop for Session {
    fn drop(&mut self) {
        self.send(Command::Stop);
        if let Some(worker) = self.worker.take() {
            // A panic in the worker has been reported as `Event::Error`.
            let _ = worker.join();
        }
    }
}

#[cfg(test)]
mod tests;
