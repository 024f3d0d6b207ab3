//! A small capture with known labels: a part of the demo scene at a fifth of its resolution, and how right labels of it are.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::sync::{Arc, LazyLock};

use inplace_core::labels::{
    Class, ClassId, History, LabelSet, Stroke, VOID, decode_gray, rasterise, strokes_json,
};
use inplace_core::scene::{Frame, GroundTruth, Scene, SceneSource, demo, write_replica};
use inplace_lab::ConfusionMatrix;
use serde_json::Value;

/// The beginning of the demo, in small images.
const SHOT: demo::Shot = demo::Shot::new(20, [64, 48]);
/// Frames of the shot from one to the next.
const STEP: usize = 2;
/// Clicks of each class.
const CLICKS: usize = 2;

/// A capture in memory.
#[derive(Debug)]
pub struct Small {
    /// Frames with exact depth, named `rgb_0` and so on.
    pub scene: Arc<Scene>,
    /// Its classes.
    pub classes: Vec<Class>,
    /// True classes of each frame, row-major `[height, width]`.
    pub truth: Vec<Vec<ClassId>>,
}

impl Small {
    /// The demo as photographed in `shot`.
    pub fn of(shot: demo::Shot) -> Self {
        Self {
            scene: Arc::new(shot.scene(&|_, _| {})),
            truth: shot.ground_truth(),
            classes: demo::classes(),
        }
    }

    /// Ten frames of 64x48 pixels; made once for each test executable.
    pub fn get() -> &'static Self {
        static SMALL: LazyLock<Small> = LazyLock::new(|| {
            let all = Small::of(SHOT);
            let frames = all.scene.frames.iter().step_by(STEP).zip(0..);
            let frames = frames.map(|(frame, number)| Frame {
                stem: format!("rgb_{number}"),
                ..frame.clone()
            });
            Small {
                scene: Arc::new(Scene::new(SceneSource::Demo, "test", frames.collect())),
                truth: all.truth.into_iter().step_by(STEP).collect(),
                classes: all.classes,
            }
        });
        &SMALL
    }

    /// Mean intersection over union of some frames' labels with the true ones.
    pub fn miou(&self, labels: impl IntoIterator<Item = (usize, impl AsRef<[ClassId]>)>) -> f64 {
        let mut matrix = ConfusionMatrix::default();
        for (frame, labels) in labels {
            matrix.add(&self.truth[frame], labels.as_ref()).expect("one size");
        }
        matrix.miou().expect("there are labels")
    }

    /// Writes the capture with its ground truth into a new folder.
    pub fn write(&self, folder: &Path) {
        let truth = GroundTruth {
            classes: &self.classes,
            labels: &|frame| self.truth[frame].clone(),
            objects: None,
            held_out: &[],
        };
        write_replica(&self.scene, folder, Some(&truth)).expect("the capture can be written");
    }

    /// Clicks on every class that can be hit: well inside it, each in another frame.
    pub fn labels(&self) -> LabelSet {
        let mut candidates: BTreeMap<ClassId, Vec<(usize, Stroke)>> = BTreeMap::new();
        for (frame, labels) in self.truth.iter().enumerate() {
            let camera = &self.scene.frames[frame].camera;
            let (width, height) = (camera.width as usize, camera.height as usize);
            for (index, &class) in labels.iter().enumerate().filter(|&(_, &class)| class != VOID) {
                let inside = room_around(labels, width, height, index);
                if inside > 0 {
                    let pixel = [(index % width) as u32, (index / width) as u32];
                    let click = Stroke::click(frame, class, pixel);
                    candidates.entry(class).or_default().push((inside, click));
                }
            }
        }
        let mut history = History::new(LabelSet::of_classes(self.classes.clone()));
        for mut of_class in candidates.into_values() {
            of_class.sort_by_key(|(inside, _)| std::cmp::Reverse(*inside));
            let mut frames = Vec::new();
            for (_, click) in of_class {
                if frames.len() < CLICKS && !frames.contains(&click.frame) {
                    frames.push(click.frame);
                    history.add_stroke(click);
                }
            }
        }
        history.labels().clone()
    }

    /// The [`labels`](Self::labels) as a strokes file.
    pub fn strokes(&self) -> Value {
        let text = strokes_json(&self.labels(), &self.scene.frames);
        serde_json::from_str(&text).expect("a strokes file is JSON")
    }
}

/// Chessboard radius of the largest square around a pixel that is all of its class.
fn room_around(labels: &[ClassId], width: usize, height: usize, index: usize) -> usize {
    let (x, y) = (index % width, index / width);
    let border = x.min(y).min(width - 1 - x).min(height - 1 - y);
    let uniform = |radius: usize| {
        (y - radius..=y + radius).all(|row| {
            labels[row * width + x - radius..=row * width + x + radius]
                .iter()
                .all(|&label| label == labels[index])
        })
    };
    (1..=border).take_while(|&radius| uniform(radius)).count()
}

/// Width, height and class ids of a label image on disk.
pub fn class_ids(path: &Path) -> (u32, u32, Vec<ClassId>) {
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    decode_gray(&bytes).unwrap_or_else(|error| panic!("{}: {error}", path.display()))
}

/// Mean intersection over union of the label images in an export's folder, named by these stems and of this size, with
/// true ones; every clicked pixel must have its class.
#[track_caller]
pub fn miou_with_clicks<'a>(
    export: &Path,
    size: (u32, u32),
    clicks: &LabelSet,
    truth: impl Iterator<Item = (&'a str, Vec<ClassId>)>,
) -> f64 {
    let mut matrix = ConfusionMatrix::default();
    for (index, (stem, truth)) in truth.enumerate() {
        let (width, height, labels) = class_ids(&export.join(format!("labels/{stem}.png")));
        assert_eq!((width, height), size, "{stem}");
        for (pixel, (class, _)) in rasterise(clicks, index, width, height) {
            assert_eq!(labels[pixel as usize], class, "pixel {pixel} of {stem}");
        }
        matrix.add(&truth, &labels).expect("one size");
    }
    matrix.miou().expect("there are labels")
}
