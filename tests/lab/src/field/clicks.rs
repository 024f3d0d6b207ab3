//! The semantic field of a session that was given clicks and goes on training.

use std::sync::Arc;
use std::time::{Duration, Instant};

use candle_core::Device;
use candle_core::safetensors::load_buffer;

use super::{FieldExperiment, FieldPoint, Learnt, Measured};
use crate::EvalError;
use crate::learnt::learn;
use crate::simulate::{Annotator, Policy};
use inplace_core::semantics::{FrameMap, LabelPropagation};
use inplace_core::session::{Client, Command, ModelState};

/// A session so many seconds after its labels.
struct Seen {
    seconds: f64,
    /// Maps of the test frames, in their order.
    maps: Vec<Option<Arc<FrameMap>>>,
    state: Arc<ModelState>,
}

/// Gives a session that knows its geometry all clicks at once and measures, while it goes on training, its
/// maps and the labels that its semantic field renders, beside what the graph says from the clicks alone.
///
/// Seconds are those in which the session worked: it is paused while it is looked at.
pub(super) fn points(
    experiment: &FieldExperiment,
    learnt: &mut Learnt,
) -> Result<Vec<FieldPoint>, EvalError> {
    let (options, scene, truth) = (&learnt.options, &learnt.scene, &learnt.truth);
    let (trainer, surface) = (&mut learnt.trainer, &learnt.surface);
    let annotator = Annotator::new(scene, truth);
    let clicks = annotator.clicks(Policy::Random, experiment.clicks, options.seed);
    let labels = annotator.labels(&clicks);
    let mut run = Client::start(options.clone());
    run.opened()?;
    learn(&mut run, Some(Duration::ZERO))?;
    run.label(labels.clone(), 1);
    let mut all: Vec<Seen> = Vec::new();
    for &seconds in &experiment.marks {
        let before = all.last().map_or(0.0, |seen| seen.seconds);
        run.send(Command::Resume);
        let deadline = Instant::now() + Duration::from_secs_f64((seconds - before).max(0.0));
        run.work_until(deadline)?;
        run.send(Command::Pause);
        let state = run.saved()?;
        let maps = truth.test.iter().map(|&frame| run.map(frame));
        all.push(Seen {
            seconds,
            maps: maps.collect(),
            state,
        });
    }
    drop(run);

    let kind = format!("{} clicks a class", experiment.clicks);
    let measured = Measured::new(experiment, scene, truth, kind);
    let mut spread = LabelPropagation::new(Arc::clone(surface));
    spread.set_labels(scene, &labels);
    let alone = measured.miou_of_maps(|frame| spread.map(scene, frame, 1).labels().into_owned())?;
    let mut points = vec![measured.point("graph", f64::NAN, alone)];
    for Seen { seconds, maps, state } in all {
        let mut maps = maps.into_iter();
        let shown = measured.miou_of_maps(|_| {
            let map = maps.next().flatten();
            map.map_or_else(Vec::new, |map| map.labels().into_owned())
        })?;
        points.push(measured.point("maps", seconds, shown));
        let tensors = load_buffer(&state.tensors, &Device::Cpu)?;
        trainer.restore(&tensors, state.steps)?;
        if let Some(semantics) = state.semantic_field(trainer)? {
            points.extend(measured.field_points(&semantics, trainer, seconds)?);
        }
    }
    Ok(points)
}
