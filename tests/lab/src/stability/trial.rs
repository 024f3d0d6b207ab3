//! A scene with its truth and an annotator's labels, to be disturbed and then labelled by a session.

use std::sync::Arc;
use std::time::Duration;

use super::Settings;
use crate::learnt;
use crate::simulate::{Annotator, Policy};
use crate::{Failure, SceneTruth};
use crossbeam_channel::{Receiver, unbounded};
use inplace_core::labels::{ClassId, LabelSet};
use inplace_core::scene::{OpenOptions, Scene};
use inplace_core::session::{Client, Event, ModelState, Session, SessionOptions};
use tempfile::TempDir;

/// Random clicks for each class.
const CLICKS: usize = 5;

/// A scene to be disturbed; pixels are shared with the undisturbed one until they change.
#[derive(Clone)]
pub(super) struct Trial {
    pub scene: Scene,
    pub truth: SceneTruth,
    /// Some random clicks of every class on the training frames.
    pub labels: LabelSet,
    /// What holds the images of a scene that was written anew.
    pub folder: Option<Arc<TempDir>>,
}

/// The figure of a trial, and what the program told the person meanwhile, sentences.
pub(super) type Measured = (f64, Vec<String>);

impl Trial {
    pub fn new(scene: &Scene, truth: &SceneTruth, seed: u64) -> Self {
        let mut trial = Self {
            labels: LabelSet::default(),
            scene: scene.clone(),
            truth: truth.clone(),
            folder: None,
        };
        trial.click_anew(seed);
        trial
    }

    /// Replaces the labels by random clicks of every class on the training frames as they are now.
    pub fn click_anew(&mut self, seed: u64) {
        let annotator = Annotator::new(&self.scene, &self.truth);
        let clicks = annotator.clicks(Policy::Random, CLICKS, seed);
        self.labels = annotator.labels(&clicks);
    }

    /// Leaves measured depth aside.
    pub fn without_depth(&mut self) {
        for frame in &mut self.scene.frames {
            frame.set_depth(None);
        }
    }

    /// A session on the scene as it is, with the labels.
    pub fn session(&self, settings: &Settings) -> Course {
        self.start(self.options(settings), || {})
    }

    /// The same where the field is trained whatever the labels need, from an earlier session's model where there is one;
    /// `wake` is called on the worker's thread after every event.
    pub fn training_session(
        &self,
        settings: &Settings,
        state: Option<Arc<ModelState>>,
        wake: impl Fn() + Send + Sync + 'static,
    ) -> Course {
        let options = SessionOptions {
            views: true,
            state: state.map(Into::into),
            ..self.options(settings)
        };
        self.start(options, wake)
    }

    fn options(&self, settings: &Settings) -> SessionOptions {
        SessionOptions {
            open: OpenOptions::default(),
            ..settings.training.session_options(self.scene.source.clone())
        }
    }

    fn start(&self, options: SessionOptions, wake: impl Fn() + Send + Sync + 'static) -> Course {
        let scene = Arc::new(self.scene.clone());
        let (sender, told) = unbounded();
        for warning in &scene.warnings {
            // The receiver is in the same function.
            let _ = sender.send(warning.clone());
        }
        let session = Session::on(scene, options, wake);
        let mut course = Course {
            run: Client::observing(session, move |event| {
                if let Event::Warning(sentence) = event {
                    // Nobody asks any more when the course is being dropped.
                    let _ = sender.send(sentence.clone());
                }
            }),
            frames: self.scene.frames.len(),
            told,
            generation: 0,
        };
        course.say(&self.labels);
        course
    }

    /// Labels the scene with a session and measures the maps of the test frames.
    pub fn labelled(&self, settings: &Settings) -> Result<Measured, Failure> {
        let mut course = self.session(settings);
        course.settle(self.seconds(settings))?;
        Ok((self.miou(&course)?, course.told()))
    }

    /// Most seconds of training.
    pub fn seconds(&self, settings: &Settings) -> f64 {
        if self.scene.has_depth() {
            settings.seconds
        } else {
            settings.seconds_without_depth
        }
    }

    /// The mIoU of the test frames' maps, while the session goes on.
    pub fn miou(&self, course: &Course) -> Result<f64, Failure> {
        let scores = self.truth.scores_of(&course.run, &self.scene)?;
        Ok(scores.miou)
    }
}

/// A session that is followed, and what it told.
pub(super) struct Course {
    pub run: Client,
    frames: usize,
    told: Receiver<String>,
    generation: u64,
}

impl Course {
    /// # Errors
    /// The field had no step: then training was not put to the test.
    pub fn has_trained(&self) -> Result<(), Failure> {
        match self.run.status().steps {
            0 => Err("the field was not trained".into()),
            _ => Ok(()),
        }
    }

    /// Gives newer labels.
    pub fn say(&mut self, labels: &LabelSet) {
        self.generation += 1;
        self.run.label(labels.clone(), self.generation);
    }

    /// Trains for so long at most, then waits for the last surface and the last maps.
    pub fn settle(&mut self, seconds: f64) -> Result<(), Failure> {
        learnt::settle(
            &mut self.run,
            self.generation,
            Some(Duration::from_secs_f64(seconds)),
        )?;
        let status = self.run.status();
        let numbers = [status.held_out_psnr, status.depth_error, status.mean_entropy];
        if numbers.into_iter().flatten().any(f32::is_nan) {
            return Err("a measured quantity is not a number".into());
        }
        Ok(())
    }

    /// Every frame's map, once all follow the newest labels.
    pub fn maps(&mut self) -> Result<Vec<Vec<ClassId>>, Failure> {
        self.run.mapped(self.generation)?;
        let maps = (0..self.frames).map(|frame| self.run.map(frame));
        let labels = maps.map(|map| map.map_or_else(Vec::new, |map| map.labels().into_owned()));
        Ok(labels.collect())
    }

    /// What the program told the person so far.
    pub fn told(&self) -> Vec<String> {
        self.told.try_iter().collect()
    }
}
