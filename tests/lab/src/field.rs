//! `inplace-lab bench field`, the semantic field by itself: the labels that it renders, measured beside what the surface says.

use std::sync::Arc;
use std::time::{Duration, Instant};

use candle_core::Device;
use candle_core::safetensors::load_buffer;
use rand::{SeedableRng, rngs::SmallRng};
use rayon::prelude::*;
use serde::Serialize;

use super::arguments::FieldArguments;
use super::commands::begin;
use super::learnt::{NodeLabels, learn, pool, spread, surface};
use super::page::Page;
use super::paper::pixel_noise;
use super::simulate::{Annotator, Policy};
use super::table::csv;
use super::{ConfusionMatrix, Failure, SceneTruth, unusable_scene};
use inplace_core::export;
use inplace_core::field::{Ray, Trainer};
use inplace_core::labels::{ClassId, ImportedLabels, ImportedMap, Trust, VOID};
use inplace_core::scene::{Scene, SceneSource};
use inplace_core::semantics::{
    LabelPropagation, NodeVotes, RayTargets, SemanticField, SemanticPart, SoftTargets, Surface,
};
use inplace_core::session::{Client, Command, Progress, SessionOptions, sampling};

/// Seconds after the labels at which the answers are measured, ascending.
fn marks(arguments: &FieldArguments) -> Vec<f64> {
    let mut marks = arguments.marks.clone();
    marks.sort_by(f64::total_cmp);
    marks
}

/// A scene whose geometry a session has learnt.
struct Learnt {
    /// Those of a session that goes on from there.
    options: SessionOptions,
    scene: Arc<Scene>,
    truth: SceneTruth,
    trainer: Trainer,
    surface: Arc<Surface>,
}

impl Learnt {
    fn of(arguments: &FieldArguments, mut options: SessionOptions) -> Result<Self, Failure> {
        options.views = true;
        let mut run = Client::start(options.clone());
        let scene = run.opened()?;
        let truth = SceneTruth::read(&scene)?;
        learn(&mut run, arguments.geometry.map(Duration::from_secs_f64))?;
        let state = run.saved()?;
        drop(run);
        let trainer = state.field(&scene, options.preset, options.seed)?;
        let surface = surface(&scene, &trainer, 1.0)?;
        options.state = Some(state.into());
        Ok(Self {
            options,
            scene,
            truth,
            trainer,
            surface,
        })
    }
}

/// Measures the semantic field of a scene: trained by clicks in a session that goes on training, and by noisy
/// label images. It takes the threads that it is run in; the session has its own.
///
/// # Errors
/// A scene without ground truth or without a surface, and whatever stops a session.
fn semantic_field(
    arguments: &FieldArguments,
    session: SessionOptions,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<FieldPoint>, Failure> {
    progress("learning the scene");
    let mut learnt = Learnt::of(arguments, session)?;
    let mut points = Vec::new();
    for share in arguments.noise.iter().map(|percent| percent / 100.0) {
        progress(&format!("{:.0}% pixel noise", 100.0 * share));
        points.extend(taught_by_noise(arguments, &learnt, share)?);
    }
    progress("labelling by clicks");
    points.extend(labelled_by_clicks(arguments, &mut learnt)?);
    Ok(points)
}

/// How good an answer was so long after its labels were given.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct FieldPoint {
    /// Name of the scene.
    scene: String,
    /// Whether depth was read.
    depth: bool,
    /// The labels that were given, such as `5 clicks a class` or `90% pixel noise`.
    labels: String,
    /// Whose answer: `graph`, `maps`, `majority` (of each voxel's votes), `field` (as from any pose) or
    /// `field, known depth` (rays end at the frame's measured depth, as they do for the others).
    answer: &'static str,
    /// Whether it is what the frames show: that of the maps.
    shown: bool,
    /// Seed of the labels and of the training.
    seed: u64,
    /// Seconds since the last label; not a number where the answer does not change.
    seconds: f64,
    /// Mean intersection over union on the test frames, every so many pixels along each axis.
    miou: f64,
}

/// The columns of `field.csv`, one row for each point.
const COLUMNS: &str = "scene depth labels answer shown seed seconds miou:4";

/// The pixels of the test frames that answers are measured on, and what the points have in common.
struct Measured<'a> {
    scene: &'a Scene,
    truth: &'a SceneTruth,
    /// Every so many pixels along each axis.
    stride: usize,
    labels: String,
    seed: u64,
}

impl<'a> Measured<'a> {
    fn new(stride: u16, seed: u64, scene: &'a Scene, truth: &'a SceneTruth, labels: String) -> Self {
        Self {
            scene,
            truth,
            stride: usize::from(stride.max(1)),
            labels,
            seed,
        }
    }

    fn point(&self, answer: &'static str, seconds: f64, miou: f64) -> FieldPoint {
        FieldPoint {
            scene: self.scene.name(),
            depth: self.scene.has_depth(),
            labels: self.labels.clone(),
            answer,
            shown: answer == "maps",
            seed: self.seed,
            seconds,
            miou,
        }
    }

    /// Row-major indices of the pixels of a frame, each with its true class.
    fn pixels(&self, number: usize) -> Vec<(usize, ClassId)> {
        let frame = &self.scene.frames[number];
        let labels = self.truth.in_frame(self.scene, number);
        let (width, height) = (frame.camera.width as usize, frame.camera.height as usize);
        let first = self.stride / 2;
        let rows = (first..height).step_by(self.stride);
        let row = |y: usize| (first..width).step_by(self.stride).map(move |x| y * width + x);
        let pixels = rows.flat_map(row);
        pixels.map(|pixel| (pixel, labels[pixel])).collect()
    }

    /// mIoU of the classes that `answer` gives for the pixels (by index) of each test frame.
    fn miou(
        &self,
        mut answer: impl FnMut(usize, &[usize]) -> Result<Vec<ClassId>, Failure>,
    ) -> Result<f64, Failure> {
        let mut matrix = ConfusionMatrix::default();
        for &frame in &self.truth.test {
            let (pixels, truth): (Vec<usize>, Vec<ClassId>) = self.pixels(frame).into_iter().unzip();
            matrix.add(&truth, &answer(frame, &pixels)?)?;
        }
        let void = "all pixels of the test frames are void; measure on a capture with classes";
        matrix.miou().ok_or_else(|| unusable_scene(self.scene, void))
    }

    /// The same of a map with a class for every pixel.
    fn miou_of_maps(&self, mut map: impl FnMut(usize) -> Vec<ClassId>) -> Result<f64, Failure> {
        self.miou(|frame, pixels| {
            let map = map(frame);
            let at = |&pixel: &usize| map.get(pixel).copied().unwrap_or(VOID);
            Ok(pixels.iter().map(at).collect())
        })
    }

    /// mIoU of the labels that a semantic field renders; where `known`, rays end at the frame's measured
    /// depth.
    fn miou_of_field(
        &self,
        semantics: &SemanticField,
        trainer: &Trainer,
        known: bool,
    ) -> Result<f64, Failure> {
        let classes = semantics.classes();
        let best = |row: &[f32]| {
            let better = |best: usize, index: usize| if row[index] > row[best] { index } else { best };
            classes[(1..row.len()).fold(0, better)]
        };
        self.miou(|frame, pixels| {
            let frame = &self.scene.frames[frame];
            let ray = |&pixel: &usize| {
                let ray = Ray::through(frame, pixel);
                let length = ray.length.filter(|_| known);
                Ray { length, ..ray }
            };
            let rays: Vec<Ray> = pixels.iter().map(ray).collect();
            let (field, occupancy) = (trainer.field(), trainer.occupancy());
            let probabilities = semantics.along_rays(field, occupancy, &rays, sampling(trainer, None))?;
            Ok(probabilities.chunks_exact(classes.len()).map(best).collect())
        })
    }

    /// The points of a field at one time: as from any pose, and where there is depth, with it.
    fn field_points(
        &self,
        semantics: &SemanticField,
        trainer: &Trainer,
        seconds: f64,
    ) -> Result<Vec<FieldPoint>, Failure> {
        let any_pose = self.miou_of_field(semantics, trainer, false)?;
        let mut points = vec![self.point("field", seconds, any_pose)];
        if self.scene.has_depth() {
            let known = self.miou_of_field(semantics, trainer, true)?;
            points.push(self.point("field, known depth", seconds, known));
        }
        Ok(points)
    }
}

/// Places of the surface and rays in a step.
const PLACES: usize = 2048;
const RAYS: usize = 512;

/// Teaches a semantic field label images of the training frames in which this share of the pixels has a random
/// class, and measures the labels that it renders for the test frames, beside the majority of each voxel's
/// votes and beside the maps of a session that imports them. Seconds are those of its steps alone.
fn taught_by_noise(
    arguments: &FieldArguments,
    learnt: &Learnt,
    share: f64,
) -> Result<Vec<FieldPoint>, Failure> {
    let (options, scene, truth) = (&learnt.options, &learnt.scene, &learnt.truth);
    let (trainer, surface) = (&learnt.trainer, &learnt.surface);
    let seed = options.seed;
    let classes = truth.classes();
    let noisy = |&frame: &usize| {
        let mut rng = SmallRng::seed_from_u64(seed ^ ((frame as u64 + 1) << 32));
        let mut labels = truth.in_frame(scene, frame);
        pixel_noise(&mut labels, &classes, share, &mut rng);
        ImportedMap::new(frame, &labels)
    };
    let labels = ImportedLabels::new(truth.train.par_iter().map(noisy).collect(), Trust::VOTES);
    let kind = format!("{:.0}% pixel noise", 100.0 * share);
    let measured = Measured::new(arguments.stride, options.seed, scene, truth, kind);
    let votes = NodeVotes::count(surface, &classes, &labels);
    let majority = votes.majority();
    let most = |node: usize| majority.get(&(node as u32)).copied().unwrap_or(VOID);
    let majority = NodeLabels((0..surface.graph.len()).map(most).collect::<Vec<ClassId>>());
    let majority = measured.miou_of_maps(|frame| majority.of_frame(surface, frame))?;
    let spread = spread(scene, surface, &classes, labels);
    let maps = measured.miou_of_maps(|frame| spread.map(scene, frame, 0).labels().into_owned())?;
    let mut points = vec![
        measured.point("majority", f64::NAN, majority),
        measured.point("maps", f64::NAN, maps),
    ];

    let field = trainer.field();
    let grid = trainer.capacity().semantic_grid();
    let mut semantics = SemanticField::new(&classes, field.feature_width(), grid, None, seed)?;
    let mut seconds = 0.0;
    for mark in marks(arguments) {
        while seconds < mark {
            let start = Instant::now();
            let seed = seed ^ (semantics.steps(SemanticPart::Residual) << 1);
            // Weighted by the number of votes, so that the cross-entropy is that with all the single votes; rays hit a
            // voxel in proportion to its votes already.
            let place = |node: usize| votes.shares(node);
            let soft = SoftTargets::at_random(surface, (PLACES, seed), 0.5 * surface.voxel, place);
            let ray = |node: usize| Some((1.0, votes.shares(node)?.1));
            let on = (&**surface, &**scene);
            let rays = RayTargets::at_random(on, &truth.train, (RAYS, seed), ray);
            let sampling = sampling(trainer, Some(seed));
            for part in [SemanticPart::Appearance, SemanticPart::Residual] {
                let radiance = (field, trainer.occupancy());
                semantics.step(part, radiance, &soft, &rays, sampling)?;
            }
            seconds += start.elapsed().as_secs_f64();
        }
        points.extend(measured.field_points(&semantics, trainer, mark)?);
    }
    Ok(points)
}

/// Gives a session that knows its geometry all clicks at once and measures, while it goes on training, its
/// maps and the labels that its semantic field renders, beside what the graph says from the clicks alone.
///
/// Seconds are those in which the session worked: it is paused while it is looked at.
fn labelled_by_clicks(arguments: &FieldArguments, learnt: &mut Learnt) -> Result<Vec<FieldPoint>, Failure> {
    let (options, scene, truth) = (&learnt.options, &learnt.scene, &learnt.truth);
    let (trainer, surface) = (&mut learnt.trainer, &learnt.surface);
    let annotator = Annotator::new(scene, truth);
    let clicks = annotator.clicks(Policy::Random, arguments.clicks.into(), options.seed);
    let labels = annotator.labels(&clicks);
    let kind = format!("{} clicks a class", arguments.clicks);
    let measured = Measured::new(arguments.stride, options.seed, scene, truth, kind);
    let mut spread = LabelPropagation::new(Arc::clone(surface));
    spread.set_labels(scene, &labels);
    let alone = measured.miou_of_maps(|frame| spread.map(scene, frame, 1).labels().into_owned())?;
    let mut points = vec![measured.point("graph", f64::NAN, alone)];
    let mut run = Client::start(options.clone());
    run.opened()?;
    learn(&mut run, Some(Duration::ZERO))?;
    run.label(labels, 1);
    let mut before = 0.0;
    for seconds in marks(arguments) {
        run.send(Command::Resume);
        run.work_until(Instant::now() + Duration::from_secs_f64(seconds - before))?;
        run.send(Command::Pause);
        before = seconds;
        let state = run.saved()?;
        let shown = measured.miou_of_maps(|frame| {
            let map = run.map(frame);
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

/// Measures every scene, writes `field.csv`, and prints.
pub fn run(arguments: &FieldArguments) -> Result<(), Failure> {
    let out = &arguments.on.output.out;
    begin(out, &arguments.on.scenes)?;
    let threads = arguments.on.training.reading.threads();
    let pool = pool(threads)?;
    let mut points = Vec::new();
    for argument in &arguments.on.scenes {
        for run in 0..arguments.seeds {
            let source = SceneSource::from_argument(argument);
            let mut session = arguments.on.training.session_options(source);
            session.seed = session.seed.wrapping_add(run);
            let seed = session.seed;
            let measured = pool.install(|| {
                let progress = Progress::default();
                semantic_field(arguments, session, &mut |what| {
                    progress.show(format!("{}, seed {seed}: {what}", argument.display()));
                })
            });
            points.extend(measured?);
        }
    }
    export::write(&out.join("field.csv"), csv(&points, COLUMNS)?.as_bytes())?;
    page(&points)?.publish(&arguments.on.output, "field", &points)
}

/// A row for each answer and time: means over the seeds.
fn page(points: &[FieldPoint]) -> Result<Page, Failure> {
    let mut page = Page::default();
    page.paragraph(
        "mIoU on the test frames against the seconds since the labels, without them where an answer does not change; \
         means over the seeds.",
    );
    page.means(points, "scene | labels | answer | seconds | mIoU=miou:3")?;
    Ok(page)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{capture, options, parsed};

    #[test]
    fn every_answer_is_measured_at_every_time() {
        let (_root, folder) = capture();
        let arguments = parsed("x --out x --geometry 0.5 --clicks 2 --noise 40 --marks 1,0.5 --stride 2");
        let session = options(SceneSource::Folder(folder));
        let points = semantic_field(&arguments, session, &mut |_| {}).unwrap();
        let of = |labels: &str, answer: &str| -> Vec<&FieldPoint> {
            let is = |point: &&FieldPoint| point.labels == labels && point.answer == answer;
            points.iter().filter(is).collect()
        };
        let (noise, clicks) = ("40% pixel noise", "2 clicks a class");
        for (labels, answer) in [(noise, "majority"), (noise, "maps"), (clicks, "graph")] {
            let [only] = of(labels, answer)[..] else {
                panic!("{points:?}");
            };
            assert!(only.seconds.is_nan() && only.miou > 0.9, "{only:?}");
        }
        for answer in ["field", "field, known depth"] {
            let trained = of(noise, answer);
            let seconds: Vec<f64> = trained.iter().map(|point| point.seconds).collect();
            assert_eq!(seconds, [0.5, 1.0]);
        }
        assert_eq!(of(clicks, "maps").len(), 2);
        let rows = csv(&points, COLUMNS).unwrap();
        assert_eq!(rows.lines().count(), 1 + points.len());
        assert!(rows.contains(",graph,false,4,,"));
    }
}
