//! Table 4: the fusion of imperfect predictions of single images.
//!
//! The network is a random forest on filter responses and the height in the image, trained by other scenes' label
//! images, whose classes are matched by name.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::Instant;

use rand::seq::SliceRandom;
use rand::{Rng, SeedableRng, rngs::SmallRng};
use rayon::prelude::*;

use super::{Found, PaperPoint, evenly};
use crate::learnt::{NodeLabels, spread};
use crate::pixels::{FilterBank, Forest, RESPONSES, Sample};
use crate::truth::in_image;
use crate::{Failure, SceneTruth, unusable_scene};
use inplace_core::labels::{Class, ClassId, ImportedLabels, ImportedMap, Trust, VOID, read_class_list};
use inplace_core::scene::{Frame, Scene, SceneSource, demo};
use inplace_core::semantics::{NO_NODE, Surface};

/// Frames of each scene that teach, and pixels of each scene, those of a class by the root of its number.
const FRAMES: usize = 30;
const SAMPLES: usize = 8000;
/// Pixels of a frame among which the samples are chosen.
const CANDIDATES: usize = 2000;
/// One pixel in so many along each axis is classified; its neighbours get the same.
const STRIDE: usize = 2;
/// No probability is taken to be smaller in a product: the forest has only so many trees.
const LEAST_PROBABILITY: f32 = 0.01;
/// Filter responses and the height in the image.
const FEATURES: usize = RESPONSES + 1;

/// A classifier of single images that was trained on some scenes.
#[derive(Clone, Debug)]
pub struct PixelClassifier {
    /// The forest's class k + 1 is the k-th name.
    forest: Forest<FEATURES>,
    names: Vec<String>,
    /// The scenes that it was trained on.
    pub scenes: Vec<String>,
}

impl PixelClassifier {
    /// Learns from the training frames' label images of scenes; it takes the threads that it is run in.
    ///
    /// # Errors
    /// A scene without ground truth or without `classes.json`.
    pub fn learn(scenes: &[Arc<Scene>], seed: u64) -> Result<Self, Failure> {
        let mut names: Vec<String> = Vec::new();
        let mut samples: Vec<Sample<FEATURES>> = Vec::new();
        for (number, scene) in scenes.iter().enumerate() {
            let truth = SceneTruth::read(scene)?;
            let mut of_scene = BTreeMap::new();
            for (id, name) in class_names(scene)? {
                let known = names.iter().position(|known| *known == name);
                of_scene.insert(id, 1 + known.unwrap_or(names.len()) as ClassId);
                if known.is_none() {
                    names.push(name);
                }
            }
            samples.extend(chosen(scene, &truth, &of_scene, seed ^ ((number as u64) << 48)));
        }
        Ok(Self {
            forest: Forest::grown(&samples, seed),
            names,
            scenes: scenes.iter().map(|scene| scene.name()).collect(),
        })
    }

    /// The classes of a scene that it knows: id, name and the forest's class, in the order of the ids.
    ///
    /// # Errors
    /// A scene without `classes.json`, or of which it knows no class.
    pub fn known(&self, scene: &Scene) -> Result<Vec<(ClassId, String, ClassId)>, Failure> {
        let known = class_names(scene)?.into_iter().filter_map(|(id, name)| {
            let index = self.names.iter().position(|own| *own == name)?;
            Some((id, name, index as ClassId + 1))
        });
        let known: Vec<(ClassId, String, ClassId)> = known.collect();
        if known.is_empty() {
            let scenes = self.scenes.join(", ");
            let reason = format!("none of its classes is in {scenes}; teach on others");
            return Err(unusable_scene(scene, reason));
        }
        Ok(known)
    }

    /// Probabilities of some of the forest's classes, `[rows, columns, classes]` of every second pixel.
    fn predict(&self, frame: &Frame, classes: &[ClassId]) -> Prediction {
        let bank = FilterBank::of(frame);
        let (width, height) = (bank.width, bank.height);
        let mut probabilities = Vec::new();
        for y in (0..height).step_by(STRIDE) {
            for x in (0..width).step_by(STRIDE) {
                let shares = self.forest.shares(&features(&bank, x, y));
                let of = |class: &ClassId| {
                    let said = shares.iter().find(|(said, _)| said == class);
                    said.map_or(0.0, |&(_, share)| share)
                };
                let row: Vec<f32> = classes.iter().map(of).collect();
                let sum: f32 = row.iter().sum();
                // Where only classes are said that are not asked about, nothing is known.
                let even = 1.0 / classes.len() as f32;
                probabilities.extend(row.iter().map(|p| if sum > 0.0 { p / sum } else { even }));
            }
        }
        Prediction {
            width,
            height,
            classes: classes.len(),
            probabilities,
        }
    }
}

fn features(bank: &FilterBank, x: usize, y: usize) -> [f32; FEATURES] {
    let mut features = [0.0; FEATURES];
    features[..RESPONSES].copy_from_slice(&bank.at(x, y));
    features[RESPONSES] = y as f32 / bank.height as f32;
    features
}

/// Names of a scene's classes, in lower case, in the order of the ids.
fn class_names(scene: &Scene) -> Result<Vec<(ClassId, String)>, Failure> {
    let mut classes = match &scene.source {
        SceneSource::Demo => demo::classes(),
        SceneSource::Folder(folder) => read_class_list(&folder.join("classes.json"))?,
    };
    classes.sort_by_key(|class| class.id);
    let named = |class: Class| (class.id, class.name.trim().to_lowercase());
    Ok(classes.into_iter().map(named).collect())
}

/// Samples of a scene: of each class as many as the root of its number of pixels is of all of those roots.
fn chosen(
    scene: &Scene,
    truth: &SceneTruth,
    class_of: &BTreeMap<ClassId, ClassId>,
    seed: u64,
) -> Vec<Sample<FEATURES>> {
    let frames = evenly(truth.train.len(), FRAMES);
    let of_frame = |&place: &usize| -> Vec<(ClassId, [f32; FEATURES])> {
        let number = truth.train[place];
        let labels = truth.in_frame(scene, number);
        let bank = FilterBank::of(&scene.frames[number]);
        let mut rng = SmallRng::seed_from_u64(seed ^ number as u64);
        let candidate = |_| {
            let pixel = rng.random_range(0..labels.len());
            let class = class_of.get(&labels[pixel])?;
            Some((*class, features(&bank, pixel % bank.width, pixel / bank.width)))
        };
        (0..CANDIDATES).filter_map(candidate).collect()
    };
    let mut by_class: BTreeMap<ClassId, Vec<[f32; FEATURES]>> = BTreeMap::new();
    let candidates: Vec<Vec<(ClassId, [f32; FEATURES])>> = frames.par_iter().map(of_frame).collect();
    for (class, features) in candidates.into_iter().flatten() {
        by_class.entry(class).or_default().push(features);
    }
    let roots: f64 = by_class.values().map(|own| (own.len() as f64).sqrt()).sum();
    let mut rng = SmallRng::seed_from_u64(seed);
    by_class
        .into_iter()
        .flat_map(|(class, mut own)| {
            let count = (SAMPLES as f64 * (own.len() as f64).sqrt() / roots).ceil() as usize;
            own.shuffle(&mut rng);
            own.truncate(count);
            own.into_iter().map(move |features| (features, class))
        })
        .collect()
}

/// Class probabilities of a frame.
struct Prediction {
    width: usize,
    height: usize,
    classes: usize,
    /// Of every second pixel along each axis, `[rows, columns, classes]`.
    probabilities: Vec<f32>,
}

impl Prediction {
    /// The probabilities of a pixel.
    fn at(&self, pixel: usize) -> &[f32] {
        let columns = self.width.div_ceil(STRIDE);
        let place = (pixel / self.width / STRIDE) * columns + pixel % self.width / STRIDE;
        &self.probabilities[place * self.classes..(place + 1) * self.classes]
    }

    /// The likeliest of these classes for every pixel.
    fn labels(&self, ids: &[ClassId]) -> Vec<ClassId> {
        let pixels = 0..self.width * self.height;
        pixels.map(|pixel| likeliest(ids, self.at(pixel))).collect()
    }
}

/// The class with the largest value, the first of those with it.
fn likeliest(ids: &[ClassId], values: &[f32]) -> ClassId {
    let mut best = (f32::NEG_INFINITY, VOID);
    for (&value, &id) in values.iter().zip(ids) {
        if value > best.0 {
            best = (value, id);
        }
    }
    best.1
}

/// The class of every node by the sums over all pixels that show it of a function of their probabilities.
fn fused(
    surface: &Surface,
    predictions: &[(usize, Prediction)],
    ids: &[ClassId],
    of: impl Fn(f32) -> f32,
) -> NodeLabels {
    let count = ids.len();
    let mut sums = vec![0.0; surface.graph.len() * count];
    for (frame, prediction) in predictions {
        let nodes = surface.nodes_of(*frame);
        for (node, pixels) in nodes.runs().filter(|(node, _)| *node != NO_NODE) {
            let sums = &mut sums[node as usize * count..(node as usize + 1) * count];
            for pixel in pixels {
                for (sum, &p) in sums.iter_mut().zip(prediction.at(pixel)) {
                    *sum += of(p);
                }
            }
        }
    }
    NodeLabels(sums.chunks_exact(count).map(|row| likeliest(ids, row)).collect())
}

/// The class of every pixel of a frame, row-major.
type FrameLabels = Box<dyn Fn(usize) -> Vec<ClassId>>;

/// Runs the experiment: the predictions for the training frames, what becomes of them by Bayesian fusion (the
/// product over the pixels that show a voxel) and average fusion on the known surface, and in the maps of a session that
/// imports them, where each pixel's likeliest class is a vote. Pixels of classes that the classifier does not know are wrong votes, and are
/// not measured.
///
/// # Errors
/// A scene of which the classifier knows no class.
pub(super) fn run(
    found: &Found<'_>,
    classifier: &PixelClassifier,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<PaperPoint>, Failure> {
    let (scene, surface) = (found.scene, found.surface);
    progress("fusion: predicting");
    let known = classifier.known(scene)?;
    let ids: Vec<ClassId> = known.iter().map(|&(id, ..)| id).collect();
    let classes: Vec<ClassId> = known.iter().map(|&(.., class)| class).collect();
    let measured: BTreeSet<ClassId> = ids.iter().copied().collect();
    let mut truth = found.truth.clone();
    for image in truth.images.values_mut() {
        let labels = image.labels.iter_mut();
        labels
            .filter(|label| !measured.contains(&**label))
            .for_each(|label| *label = VOID);
    }
    let start = Instant::now();
    let predict = |&frame: &usize| (frame, classifier.predict(&scene.frames[frame], &classes));
    let predictions: Vec<(usize, Prediction)> = truth.train.par_iter().map(predict).collect();
    let predicting = start.elapsed().as_secs_f64();
    let map = |(frame, own): &(usize, Prediction)| ImportedMap::new(*frame, &own.labels(&ids));
    let votes = ImportedLabels {
        maps: predictions.iter().map(map).collect(),
        trust: Trust::VOTES,
    };
    let single = |frame: usize| votes.of_frame(frame).map_or_else(Vec::new, ImportedMap::labels);
    let single = truth.scores(&truth.train, |frame| in_image(scene, frame, single(frame)))?;
    let mut points = vec![found.point("fusion-input", single, single.miou, predicting, Some(0.659))];
    let on_nodes = |labels: NodeLabels| -> FrameLabels {
        let surface = Arc::clone(surface);
        Box::new(move |frame| labels.of_frame(&surface, frame))
    };
    let ways: [(&str, f64, &dyn Fn() -> FrameLabels); 3] = [
        ("fusion-bayesian", 0.668, &|| {
            let log = |p: f32| p.max(LEAST_PROBABILITY).ln();
            on_nodes(fused(surface, &predictions, &ids, log))
        }),
        ("fusion-average", 0.586, &|| {
            on_nodes(fused(surface, &predictions, &ids, |p| p))
        }),
        ("fusion", 0.680, &|| {
            let spread = spread(scene, surface, &ids, votes.clone());
            let scene = Arc::clone(scene);
            Box::new(move |frame| spread.map(&scene, frame, 0).labels().into_owned())
        }),
    ];
    for (name, paper_miou, way) in ways {
        progress(name);
        let start = Instant::now();
        let labels = way();
        let seconds = found.surface_s + predicting + start.elapsed().as_secs_f64();
        let scores = truth.scores(&truth.train, |frame| in_image(scene, frame, labels(frame)))?;
        points.push(found.point(name, scores, single.miou, seconds, Some(paper_miou)));
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;
    use crate::testing::{capture_of, opened};

    /// A wall that is dark on the left and bright on the right, with classes of these ids and names.
    fn capture(root: &Path, dark: (ClassId, &str), bright: (ClassId, &str)) -> Arc<Scene> {
        let folder = root.join(format!("{} and {}", dark.1, bright.1));
        let classes = [dark, bright].map(|(id, name)| Class::new(id, name));
        capture_of(&folder, (64, 48), classes);
        opened(&folder)
    }

    fn points(scene: &Arc<Scene>, classifier: &PixelClassifier) -> Vec<PaperPoint> {
        let found = Found {
            scene,
            truth: &SceneTruth::read(scene).unwrap(),
            surface: &Arc::new(Surface::build(scene, &[], 5.0).unwrap()),
            surface_s: 0.0,
            seed: 1,
        };
        run(&found, classifier, &mut |_| {}).unwrap()
    }

    #[test]
    fn classes_of_another_scene_are_matched_by_name_and_what_it_lacks_is_not_measured() {
        let root = tempfile::tempdir().unwrap();
        let capture = |dark, bright| capture(root.path(), dark, bright);
        let classifier = PixelClassifier::learn(&[capture((1, "Night"), (2, "day"))], 1).unwrap();
        let scene = capture((9, "night"), (4, "moon"));
        assert_eq!(classifier.known(&scene).unwrap(), [(9, "night".to_owned(), 1)]);
        let points = points(&scene, &classifier);
        let names: Vec<&str> = points.iter().map(|point| point.experiment).collect();
        let all = "fusion-input fusion-bayesian fusion-average fusion";
        assert_eq!(names.join(" "), all);
        // Night is the only answer, and day is not asked about.
        assert!(points.iter().all(|point| point.scores.miou == 1.0), "{points:?}");

        let error = classifier.known(&capture((1, "sea"), (2, "land"))).unwrap_err();
        assert!(error.to_string().contains("none of its classes"), "{error}");
    }

    #[test]
    fn every_way_of_fusing_tells_the_halves_of_a_wall_apart() {
        let root = tempfile::tempdir().unwrap();
        let (night, day) = ((1, "night"), (2, "day"));
        let trained = capture(root.path(), day, night);
        // The other way round, so that the classifier is wrong about everything; and once right.
        let wrong = capture(root.path(), night, day);
        let classifier = PixelClassifier::learn(&[Arc::clone(&trained)], 1).unwrap();
        for (scene, right) in [(&trained, true), (&wrong, false)] {
            for point in points(scene, &classifier) {
                assert_eq!(point.scores.miou > 0.9, right, "{point:?}");
                assert_eq!(point.scores.miou < 0.1, !right, "{point:?}");
            }
        }
    }
}
