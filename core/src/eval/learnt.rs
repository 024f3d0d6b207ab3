//! The surface of a scene outside of a session.

use std::sync::Arc;
use std::thread;
use std::time::{Duration, Instant};

use super::EvalError;
use crate::field::{FieldError, Preset, Trainer};
use crate::labels::LabelSet;
use crate::scene::Scene;
use crate::semantics::Surface;
use crate::session::ModelState;
use crate::session::surface_refiner::SurfaceRefiner;

impl From<FieldError> for EvalError {
    fn from(error: FieldError) -> Self {
        Self::Session(error.to_string())
    }
}

impl From<candle_core::Error> for EvalError {
    fn from(error: candle_core::Error) -> Self {
        Self::Session(error.to_string())
    }
}

/// The surface from measured depth; where that has holes or there is none, a field is trained for so long, and
/// its depth fills them. It takes the threads that it is run in.
pub(super) fn trained_surface(
    scene: &Arc<Scene>,
    preset: Preset,
    training: Duration,
    seed: u64,
) -> Result<Arc<Surface>, EvalError> {
    let mut trainer = Trainer::new(Arc::clone(scene), preset, seed)?;
    if !SurfaceRefiner::is_complete(scene) {
        let start = Instant::now();
        while start.elapsed() < training && !trainer.settled() {
            trainer.step()?;
        }
    }
    surface(scene, &trainer)
}

/// The surface that a session with this model has.
pub(super) fn restored_surface(
    scene: &Arc<Scene>,
    preset: Preset,
    state: &ModelState,
    seed: u64,
) -> Result<Arc<Surface>, EvalError> {
    surface(scene, &restored(scene, preset, state, seed)?)
}

/// The field of a session with this model.
pub(super) fn restored(
    scene: &Arc<Scene>,
    preset: Preset,
    state: &ModelState,
    seed: u64,
) -> Result<Trainer, EvalError> {
    Ok(state.field(scene, preset, seed)?)
}

/// The surface that this field completes.
pub(super) fn surface(scene: &Arc<Scene>, trainer: &Trainer) -> Result<Arc<Surface>, EvalError> {
    let mut refiner = SurfaceRefiner::new(scene, trainer, 1.0, rayon::current_num_threads());
    refiner.finish(trainer);
    while refiner.is_rendering() {
        refiner.advance(trainer, &LabelSet::default())?;
    }
    loop {
        let ready = refiner.ready();
        if let Some(spread) = ready.map_err(|reason| EvalError::Session(reason.to_owned()))? {
            return Ok(Arc::clone(spread.surface()));
        }
        if refiner.is_done() {
            return Err(EvalError::Scene {
                scene: scene.source.to_string(),
                reason: "no surface was found; train for longer".to_owned(),
            });
        }
        thread::sleep(Duration::from_millis(5));
    }
}
