//! The interactive experiment with objects: the annotator says which chair it is, not only that it is one.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::time::{Duration, Instant};

use rand::SeedableRng;
use rand::rngs::SmallRng;
use rand::seq::SliceRandom;
use serde::Serialize;

use super::{Annotator, Click, Policy};
use crate::arguments::SimulateArguments;
use crate::learnt::{pool, session_surface};
use crate::objects::{GOOD, ObjectTruth, Segment, SegmentCounts, SegmentScores};
use crate::{Failure, mean};
use inplace_core::guide::{Suggestion, suggest};
use inplace_core::labels::{ClassId, Label, LabelSet, Object, ObjectId, Stroke, VOID};
use inplace_core::scene::{ImagePixels, Scene};
use inplace_core::semantics::{LabelPropagation, Surface, SurfaceObjects};
use inplace_core::session::SessionOptions;

/// Where the annotator clicks once on every class, at random, and names no object.
const CLASSES_ALONE: &str = "classes";
/// Where the annotator clicks so, but names the objects, and then answers the program's suggestions.
const SUGGESTED: &str = "suggested";
/// How long the geometry is learnt where depth has holes or there is none, unless that is said.
const GEOMETRY: Duration = Duration::from_secs(60);

/// How good the objects of the test frames were after so many clicks.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ObjectPoint {
    /// Name of the scene.
    pub scene: String,
    /// Where the annotator clicked; `classes` for one random click on every class, without a word of objects; `suggested` for
    /// these clicks with the names of their objects, and then the program's suggestions.
    pub policy: String,
    /// Seed of the clicks.
    pub seed: u64,
    /// Clicks there were for each object of the training frames, on the mean; 0 where no object was named.
    pub clicks_per_object: usize,
    /// Clicks in all.
    pub clicks: usize,
    /// Mean intersection over union of all objects, each with the pixels of its own clicks; not known where no object was
    /// named.
    pub iou: Option<f64>,
    /// The same of things, and of stuff.
    pub iou_things: Option<f64>,
    /// See [`ObjectPoint::iou_things`].
    pub iou_stuff: Option<f64>,
    /// Share of the objects with an intersection over union of at least 0.8; not known where no object was named.
    pub good_80: Option<f64>,
    /// The same of 0.85.
    pub good_85: Option<f64>,
    /// The same of 0.9.
    pub good_90: Option<f64>,
    /// Panoptic quality of the scene, all frames taken together; of things and of stuff with their parts.
    pub pq: Option<f64>,
    /// See [`ObjectPoint::pq`].
    pub pq_things: Option<f64>,
    /// Mean intersection over union of the things that were found.
    pub sq_things: Option<f64>,
    /// Share of the things that were found, see `SegmentScores::rq`.
    pub rq_things: Option<f64>,
    /// See [`ObjectPoint::pq`].
    pub pq_stuff: Option<f64>,
    /// Number of objects in the maps.
    pub objects: usize,
    /// Wall seconds since the surface was there, without measuring.
    pub wall_s: f64,
}

/// The columns of `objects.csv`, one row for each point.
pub const OBJECT_COLUMNS: &str = "scene policy seed clicks_per_object clicks iou:4 iou_things:4 iou_stuff:4 \
                                  good_80:4 good_85:4 good_90:4 pq:4 \
                                  pq_things:4 pq_stuff:4 sq_things:4 rq_things:4 objects wall_s:2";

/// Runs the experiment on the surface graph alone, with seeds that count up from that of the session.
///
/// # Errors
/// A scene without ground truth of its objects, and whatever keeps the surface from being found.
pub fn simulate_objects(
    experiment: &SimulateArguments,
    session: &SessionOptions,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<ObjectPoint>, Failure> {
    let scene = Arc::new(Scene::open(&session.source, session.open, &|_, _| {})?);
    let truth = ObjectTruth::read(&scene)?;
    let annotator = Annotator::new(&scene, &truth.images);
    let training = experiment.geometry.map_or(GEOMETRY, Duration::from_secs_f64);
    let pool = pool(session.threads)?;
    let most = experiment.clicks.iter().copied().max().map_or(0, usize::from);
    let mut points = Vec::new();
    progress("learning the scene");
    let surface = session_surface(&scene, session, training)?;
    for run in 0..experiment.seeds {
        let run = Run {
            experiment,
            scene: &scene,
            surface: &surface,
            truth: &truth,
            annotator: &annotator,
            seed: session.seed.wrapping_add(run),
        };
        points.push(pool.install(|| run.classes_alone())?);
        for &policy in &experiment.policies {
            progress(&format!("seed {}, {}", run.seed, policy.name()));
            let planned = annotator.clicks(policy, most, run.seed);
            let is_guided = policy == Policy::Guided;
            points.extend(pool.install(|| run.label(policy.name(), &planned, is_guided))?);
            if is_guided {
                points.extend(pool.install(|| run.label(SUGGESTED, &run.on_classes(), true))?);
            }
        }
    }
    Ok(points)
}

/// One run of the experiment.
struct Run<'a> {
    experiment: &'a SimulateArguments,
    scene: &'a Arc<Scene>,
    surface: &'a Arc<Surface>,
    truth: &'a ObjectTruth,
    /// Its classes are the objects.
    annotator: &'a Annotator<'a>,
    seed: u64,
}

impl Run<'_> {
    /// One random click on every class: on one of its objects, whichever that is.
    fn on_classes(&self) -> Vec<Click> {
        let mut clicks = self.annotator.clicks(Policy::Random, 1, self.seed);
        // A fair draw among the objects of a class.
        clicks.shuffle(&mut SmallRng::seed_from_u64(self.seed));
        let mut clicked: BTreeSet<ClassId> = BTreeSet::new();
        clicks.retain(|click| {
            let object = self.truth.objects.get(&click.class);
            object.is_some_and(|object| clicked.insert(object.class_id))
        });
        clicks
    }

    /// One click on every class without a word of objects.
    fn classes_alone(&self) -> Result<ObjectPoint, Failure> {
        let start = Instant::now();
        let clicks = self.on_classes();
        let mut propagation = LabelPropagation::new(Arc::clone(self.surface));
        let labels = self.labels(&clicks, false);
        propagation.set_labels(self.scene, &labels);
        let labelling = start.elapsed();
        self.measured(
            CLASSES_ALONE,
            (0, clicks.len()),
            (&propagation, &labels),
            labelling,
        )
    }

    /// Lets the annotator label, first by a plan and then by suggestions if `is_guided`, and measures the maps after each
    /// batch of clicks.
    fn label(&self, policy: &str, planned: &[Click], is_guided: bool) -> Result<Vec<ObjectPoint>, Failure> {
        let batches: BTreeSet<usize> = self.experiment.clicks.iter().copied().map(usize::from).collect();
        let only: BTreeSet<usize> = self.truth.images.train.iter().copied().collect();
        let mut propagation = LabelPropagation::new(Arc::clone(self.surface));
        let (mut given, mut points) = (Vec::new(), Vec::new());
        let mut labelling = Duration::ZERO;
        for clicks_per_object in batches {
            let start = Instant::now();
            let wanted = clicks_per_object * self.annotator.classes().len();
            let from_plan = wanted.min(planned.len()).saturating_sub(given.len());
            given.extend(planned.iter().skip(given.len()).take(from_plan));
            let mut labels = self.labels(&given, true);
            propagation.set_labels(self.scene, &labels);
            while is_guided && given.len() < wanted {
                let never = AtomicBool::new(false);
                let suggestions = suggest(self.scene, &propagation, Some(&only), &never).unwrap_or_default();
                let answer = |place: &Suggestion| self.annotator.answer(place.frame, place.pixel);
                let Some(click) = suggestions.iter().find_map(answer) else {
                    break;
                };
                given.push(click);
                labels = self.labels(&given, true);
                propagation.set_labels(self.scene, &labels);
            }
            labelling += start.elapsed();
            let clicks = (clicks_per_object, given.len());
            points.push(self.measured(policy, clicks, (&propagation, &labels), labelling)?);
        }
        Ok(points)
    }

    /// The clicks as strokes; with `objects`, those on things say which one, under its true number.
    fn labels(&self, clicks: &[Click], objects: bool) -> LabelSet {
        let mut labels = LabelSet::of_classes(self.truth.classes());
        for click in clicks {
            let Label { class, object } = self.label_of(click.class);
            let stroke = Stroke {
                object: object.filter(|_| objects),
                ..Stroke::click(click.frame, class, click.pixel)
            };
            if let Some(id) = stroke.object
                && labels.object(id).is_none()
            {
                let name = format!("object {}", id.number());
                labels.objects.push(Object { id, class, name });
            }
            labels.strokes.insert(labels.next_stroke_id(), stroke.into());
        }
        labels
    }

    /// What the annotator says of a pixel with this value of the truth.
    fn label_of(&self, id: u16) -> Label {
        match self.truth.segment(id) {
            Some(Segment { class, object }) => Label::new(class, ObjectId::new(object)),
            None => Label::from(VOID),
        }
    }

    fn measured(
        &self,
        policy: &str,
        (clicks_per_object, clicks): (usize, usize),
        (propagation, labels): (&LabelPropagation, &LabelSet),
        labelling: Duration,
    ) -> Result<ObjectPoint, Failure> {
        let listed = (labels.classes.as_slice(), labels.objects.as_slice());
        let objects = SurfaceObjects::new(self.surface, propagation.posterior(), listed, None);
        let things: BTreeSet<ClassId> = labels
            .classes
            .iter()
            .filter(|class| class.thing)
            .map(|class| class.id)
            .collect();
        // Parts that nobody named have numbers that are nobody's.
        let of = |number: u16| match ObjectId::new(number).is_none_or(|id| labels.object(id).is_some()) {
            true => number,
            false => u16::MAX - number,
        };
        let mut counts = SegmentCounts::default();
        let places = ImagePixels::default();
        for &frame in &self.truth.images.test {
            let map = propagation.map(self.scene, frame, 0);
            let map = map.in_image_with(&self.scene.frames[frame], Some(&objects), &places);
            let told = map.objects().unwrap_or_default();
            let labels = map.labels();
            let predicted = labels.iter().zip(told).map(|(&class, &object)| {
                // Void, or a thing of which nothing is known but its class.
                let is_known = class != VOID && (object != 0 || !things.contains(&class));
                is_known.then_some(Segment {
                    class,
                    object: of(object),
                })
            });
            let predicted: Vec<Option<Segment>> = predicted.collect();
            let truth = &self.truth.images.images[&frame].labels;
            let truth: Vec<Option<Segment>> = truth.iter().map(|&id| self.truth.segment(id)).collect();
            counts.add(&truth, &predicted)?;
        }
        let all = counts.scores(&|_| true);
        let of_things = counts.scores(&|class| things.contains(&class));
        let of_stuff = counts.scores(&|class| !things.contains(&class));
        let on_nodes = (0..self.surface.graph.len() as u32).filter_map(|node| objects.of_node(node));
        let named = |scores: &SegmentScores| scores.iou.filter(|_| clicks_per_object > 0);
        let [good_80, good_85, good_90] = all.good.map(|share| (clicks_per_object > 0).then_some(share));
        Ok(ObjectPoint {
            scene: self.scene.name(),
            policy: policy.to_owned(),
            seed: self.seed,
            clicks_per_object,
            clicks,
            iou: named(&all),
            iou_things: named(&of_things),
            iou_stuff: of_stuff.iou,
            good_80,
            good_85,
            good_90,
            pq: all.pq,
            pq_things: of_things.pq,
            sq_things: of_things.sq,
            rq_things: of_things.rq,
            pq_stuff: of_stuff.pq,
            objects: on_nodes.collect::<BTreeSet<ObjectId>>().len(),
            wall_s: labelling.as_secs_f64(),
        })
    }
}

/// The clicks on an object that it takes until its intersection over union is at least 0.8, 0.85 and 0.9, a row for each policy:
/// means over the objects and the seeds. Those that never get there count as the most clicks that were made.
pub fn click_rows(points: &[ObjectPoint]) -> Vec<Vec<String>> {
    let named: Vec<&ObjectPoint> = points
        .iter()
        .filter(|point| point.clicks_per_object > 0)
        .collect();
    let of_policy = named.chunk_by(|a, b| a.policy == b.policy);
    let mut sums: BTreeMap<&str, Vec<[f64; 3]>> = BTreeMap::new();
    for runs in of_policy {
        for run in runs.chunk_by(|a, b| a.seed == b.seed) {
            let mut clicks = [run[0].clicks_per_object as f64; 3];
            for pair in run.windows(2) {
                let more = (pair[1].clicks_per_object - pair[0].clicks_per_object) as f64;
                let good = [pair[0].good_80, pair[0].good_85, pair[0].good_90];
                for (sum, good) in clicks.iter_mut().zip(good) {
                    *sum += more * (1.0 - good.unwrap_or(0.0));
                }
            }
            sums.entry(&run[0].policy).or_default().push(clicks);
        }
    }
    let row = |(policy, runs): (&str, Vec<[f64; 3]>)| {
        let mean_of = |place: usize| format!("{:.1}", mean(runs.iter().map(|run| run[place])));
        let mut row = vec![policy.to_owned()];
        row.extend((0..GOOD.len()).map(mean_of));
        row
    };
    sums.into_iter().map(row).collect()
}
