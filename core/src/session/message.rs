//! What the window (or a headless command) and the worker say to each other.

use std::collections::{BTreeSet, HashMap};
use std::path::PathBuf;
use std::sync::Arc;

use candle_core::{DType, Device, Tensor};

use super::semantic_trainer::restored;
use super::{RenderedView, TrainingEnd};
use crate::field::{FieldError, Preset, Trainer};
use crate::guide::Suggestion;
use crate::labels::{LabelSet, Stroke};
use crate::scene::{OpenOptions, Scene, SceneSource, Viewpoint};
use crate::semantics::{Preview, SemanticField, StrokeCheck};

/// What a session works on and how.
#[derive(Clone, Debug)]
pub struct SessionOptions {
    /// The capture.
    pub source: SceneSource,
    /// What to read of it.
    pub open: OpenOptions,
    /// How large the field may grow and how long it trains.
    pub preset: Preset,
    /// Threads of the worker's pool, at least 1.
    pub threads: usize,
    /// Seed of everything random.
    pub seed: u64,
    /// Whether views of the field will be wanted: then it is trained until it has learnt the scene, whatever the labels
    /// need, and all of the semantic field follows them. A view that is asked for by [`Command::Render`] has the same
    /// effect for a while.
    pub views: bool,
    /// Whether somebody watches: then labels spread over a first look at the depth of a capture without measured depth, while
    /// that is estimated better.
    pub first_look: bool,
    /// File of a pretrained network, if any ([`Network`](crate::features::Network)): what it sees in the images helps to
    /// tell what is alike.
    pub features: Option<PathBuf>,
    /// Model state of an earlier session on the same scene.
    pub state: Option<Saved>,
}

/// A model state of an earlier session ([`Event::State`]), and what becomes of it.
#[derive(Clone, Debug)]
pub struct Saved {
    /// The state.
    pub model: Arc<ModelState>,
    /// Whether maps are made from it as it is, without further training, as after [`Command::Settle`]. Otherwise it is
    /// trained on.
    pub is_final: bool,
}

impl From<Arc<ModelState>> for Saved {
    /// To be trained on.
    fn from(model: Arc<ModelState>) -> Self {
        let is_final = false;
        Self { model, is_final }
    }
}

/// What the worker is asked to do.
#[derive(Clone, Debug)]
pub enum Command {
    /// The labels have changed. Maps made from them carry the same generation. Of several that wait the newest are followed.
    Labels {
        /// All labels.
        labels: LabelSet,
        /// Counts up with every change.
        generation: u64,
    },
    /// This frame is in view: its maps come first.
    View {
        /// Index of the frame.
        frame: usize,
    },
    /// From now on, suggest places to label next after every change of the maps ([`Event::Suggestions`]).
    Suggest {
        /// Indices of frames: places are shown in the keyframes among them. `None` = all.
        only: Option<BTreeSet<usize>>,
    },
    /// Tell what one more stroke would win on its frame, once there is a surface; a newer question replaces an older
    /// one. Answered with [`Event::Preview`] after one piece of work at most; the maps stay as they are.
    Preview(Stroke),
    /// From now on, check the strokes after every change of the labels ([`Event::StrokeChecks`]).
    CheckStrokes,
    /// Render the field as seen from here, in slices between other work; a newer request replaces an older one.
    /// Answered with [`Event::Rendered`], coarse first and then fine.
    Render(Viewpoint),
    /// Stop training; the maps still follow changes of the labels.
    Pause,
    /// Train on.
    Resume,
    /// Stop training after the last refinement of the surface and the last maps; then [`Status::settled`] is set.
    Settle,
    /// Answer with [`Event::State`].
    Save,
    /// End the worker. It answers with [`Event::Stopped`] within 100 ms.
    Stop,
}

/// What the worker reports. Maps are not in here: they are in [`MapSlots`](super::MapSlots).
#[derive(Clone, Debug)]
pub enum Event {
    /// The frames of the capture are known, and can be looked at before it is open
    /// ([`Scene::open_listed`](crate::scene::Scene::open_listed)); there is a map slot for each of them. Commands that name
    /// frames wait for [`Event::Opened`], which may leave some of them out.
    Listed(Arc<Scene>),
    /// The capture is being read: frames decoded, frames in all.
    Opening {
        /// Frames decoded so far.
        done: usize,
        /// Frames in all.
        total: usize,
    },
    /// The depth of a capture without measured depth is being estimated; this share of the work is done.
    Estimating {
        /// 0..=1.
        share: f32,
    },
    /// The capture is open; there is a map slot for each of its frames.
    Opened(Arc<Scene>),
    /// There is a newer map of this frame in its slot.
    Map {
        /// Index of the frame.
        frame: usize,
        /// Generation of the labels that it was made from.
        generation: u64,
    },
    /// Every frame's slot holds a map of this generation.
    AllMaps {
        /// Generation of the labels.
        generation: u64,
    },
    /// Where to label next, best first.
    Suggestions {
        /// Generation of the labels that they were made from.
        generation: u64,
        /// At most eight.
        suggestions: Vec<Suggestion>,
    },
    /// What one more stroke would win: the answer to [`Command::Preview`].
    Preview {
        /// Generation of the labels that the stroke would be added to.
        generation: u64,
        /// The stroke, and what it would win.
        preview: Arc<Preview>,
    },
    /// The strokes checked against each other, after [`Command::CheckStrokes`]; later than the maps.
    StrokeChecks {
        /// Generation of the labels that were checked.
        generation: u64,
        /// One for every stroke that can be checked ([`LeaveOneOut::strokes`](crate::semantics::LeaveOneOut::strokes)).
        checks: Vec<StrokeCheck>,
        /// Cross-validated accuracy, 0..=1 ([`LeaveOneOut::accuracy`](crate::semantics::LeaveOneOut::accuracy)).
        accuracy: Option<f32>,
    },
    /// The field as seen from a viewpoint: an answer to [`Command::Render`].
    Rendered(Arc<RenderedView>),
    /// Progress of training; several times a second while it runs.
    Status(Status),
    /// The answer to [`Command::Save`].
    State(Arc<ModelState>),
    /// Something is not as expected, and what; the work goes on.
    Warning(String),
    /// Something failed: what, and what to do. The labels are safe.
    Error(String),
    /// The worker has ended.
    Stopped,
}

/// Progress of training.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Status {
    /// What the worker is doing.
    pub phase: Phase,
    /// Training steps done, those before a saved state included.
    pub steps: u64,
    /// Training steps of the semantic field.
    pub semantic_steps: u64,
    /// Why the radiance field is trained no further, if it is not; the semantic field still follows the labels.
    pub training_end: Option<TrainingEnd>,
    /// Seconds spent training the field and refining its surface.
    pub geometry_seconds: f64,
    /// Estimated seconds from [`Command::Settle`] to the last surface; `None` where that is not known yet.
    pub seconds_to_settle: Option<f64>,
    /// Seconds spent propagating the labels and training the semantic field.
    pub semantics_seconds: f64,
    /// Seconds spent making maps.
    pub render_seconds: f64,
    /// Steps that were skipped because their loss or gradient was not finite.
    pub skipped_steps: u64,
    /// How often the field was reset to a checkpoint because it had collapsed or was not finite.
    pub undone: u64,
    /// Peak signal-to-noise ratio on held-out frames, in dB.
    pub held_out_psnr: Option<f32>,
    /// Median absolute depth error on held-out frames with depth, in metres.
    pub depth_error: Option<f32>,
    /// Mean entropy over all pixels of all frames, in nats.
    pub mean_entropy: Option<f32>,
    /// Trainable parameters.
    pub parameters: usize,
    /// The chosen model size in words.
    pub capacity: String,
    /// Nodes of the surface graph; 0 until there is one.
    pub surface_nodes: usize,
    /// Generation of the newest labels that the worker has.
    pub generation: u64,
    /// Whether imported label images are still being propagated, so that the maps do not follow them yet.
    pub spreading_import: bool,
    /// Whether a pretrained network is still looking at the images.
    pub finding_features: bool,
    /// Whether training is over and all maps are published.
    pub settled: bool,
}

impl Status {
    /// Whether maps of these labels are final.
    pub fn is_final(&self, generation: u64) -> bool {
        self.settled && self.generation == generation
    }
}

/// What the worker is doing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Phase {
    /// Reading the capture.
    #[default]
    Opening,
    /// Learning geometry and colour; there is no surface for the labels yet.
    FindingSurface,
    /// Estimating depth, so much of which is done; maps follow the labels by a first look at it.
    Estimating {
        /// 0..=100.
        percent: u8,
    },
    /// Training, with maps following the labels.
    Training,
    /// Training paused by the user.
    Paused,
}

/// A model state that a later session continues from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ModelState {
    /// Training steps done.
    pub steps: u64,
    /// The parameters and grids in the safetensors format.
    pub tensors: Vec<u8>,
}

impl ModelState {
    /// The saved field, in a trainer for this scene.
    ///
    /// # Errors
    /// The state of another scene or preset, or of another version of the program.
    pub fn field(&self, scene: &Arc<Scene>, preset: Preset, seed: u64) -> Result<Trainer, FieldError> {
        let mut trainer = Trainer::new(Arc::clone(scene), preset, seed)?;
        trainer.restore(&self.load()?, self.steps)?;
        Ok(trainer)
    }

    /// The semantic field as it was saved, on the radiance field of the same state; `None` where it had no step yet.
    ///
    /// # Errors
    /// As [`load`](Self::load).
    pub fn semantic_field(&self, trainer: &Trainer) -> Result<Option<SemanticField>, FieldError> {
        Ok(restored(&self.load()?, trainer))
    }

    /// The parameters and grids by name.
    ///
    /// # Errors
    /// Bytes that are not in the safetensors format, or a value that is not finite: training could not recover from it.
    pub fn load(&self) -> Result<HashMap<String, Tensor>, FieldError> {
        let tensors = candle_core::safetensors::load_buffer(&self.tensors, &Device::Cpu)?;
        for (name, tensor) in &tensors {
            if tensor.dtype() == DType::F32 {
                let values: Vec<f32> = tensor.flatten_all()?.to_vec1()?;
                if !values.iter().all(|value| value.is_finite()) {
                    let name: String = name.escape_debug().take(40).collect();
                    return Err(candle_core::Error::Msg(format!(
                        "{name} of the saved model has values that are not finite numbers"
                    ))
                    .into());
                }
            }
        }
        Ok(tensors)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_saved_model_with_a_value_that_is_no_number_is_refused_by_its_name() {
        let loaded = |value: f32| {
            let tensors = HashMap::from([("field.table", Tensor::new(&[1.0, value], &Device::Cpu).unwrap())]);
            let tensors = safetensors::serialize(&tensors, None).unwrap();
            ModelState { steps: 1, tensors }.load()
        };
        let values: Vec<f32> = loaded(2.5).unwrap()["field.table"].to_vec1().unwrap();
        assert_eq!(values, [1.0, 2.5]);
        for value in [f32::NAN, f32::INFINITY] {
            let error = loaded(value).unwrap_err().to_string();
            let is_named = error.contains("field.table") && error.contains("not finite");
            assert!(is_named, "{error}");
        }
    }
}
