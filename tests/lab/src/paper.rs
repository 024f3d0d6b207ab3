//! `inplace-lab bench paper`, the experiments of the Semantic-NeRF paper: imperfect label images of the training frames, made perfect
//! by the surface that they share.

mod fusion;
mod recipe;

use std::sync::Arc;
use std::time::{Duration, Instant};

use rand::{SeedableRng, rngs::SmallRng};
use rayon::prelude::*;
use serde::Serialize;

pub use recipe::{Flipped, Objects, clicks, coarse, evenly, grid, grown, pixel_noise};

use super::arguments::PaperArguments;
use super::commands::begin;
use super::learnt::{pool, session_surface, spread};
use super::page::Page;
use super::table::csv;
use super::truth::in_image;
use super::{Failure, SceneTruth, Scores};
use inplace_core::export;
use inplace_core::labels::{ClassId, ImportedLabels, ImportedMap, Trust};
use inplace_core::scene::{Scene, SceneSource};
use inplace_core::semantics::Surface;
use inplace_core::session::{Progress, SessionOptions};

/// How the training frames' label images are spoilt.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Recipe {
    /// Only this share of the frames keeps its image, evenly.
    ShareOfFrames(f64),
    /// Only so many frames keep their image, evenly.
    Frames(usize),
    /// This share of the pixels gets a random class.
    PixelNoise(f64),
    /// Objects get a random class in this share of the frames that show them.
    RegionNoise(Flipped, f64),
    /// Scaled down by this factor and up again.
    Coarse(usize),
    /// Every so many pixels along each axis.
    Grid(usize),
    /// One pixel of every class in every frame.
    Clicks,
    /// A region that covers this share of every class in every frame.
    Grown(f64),
}

/// An experiment of the paper (Replica, 200,000 steps): its name in the results, what is done to the labels, and the
/// paper's mIoU, where it gives a number.
pub type Experiment = (&'static str, Recipe, Option<f64>);

/// The experiments of Figure 4 and Tables 1 to 3; Table 4 is [`FUSION`]. The two frames are evenly spaced, the
/// paper's chosen by hand.
pub const EXPERIMENTS: [Experiment; 20] = {
    use Flipped::{Even, Smallest};
    use Recipe::{Clicks, Coarse, Frames, Grid, Grown, PixelNoise, RegionNoise, ShareOfFrames};

    [
        ("frames-100%", ShareOfFrames(1.0), None),
        ("frames-50%", ShareOfFrames(0.5), None),
        ("frames-10%", ShareOfFrames(0.1), None),
        ("frames-2", Frames(2), None),
        ("pixel-noise-50%", PixelNoise(0.5), Some(0.951)),
        ("pixel-noise-90%", PixelNoise(0.9), Some(0.877)),
        ("region-sort-30%", RegionNoise(Smallest, 0.3), Some(0.895)),
        ("region-sort-40%", RegionNoise(Smallest, 0.4), Some(0.893)),
        ("region-sort-50%", RegionNoise(Smallest, 0.5), Some(0.803)),
        ("region-even-30%", RegionNoise(Even, 0.3), Some(0.796)),
        ("region-even-40%", RegionNoise(Even, 0.4), Some(0.747)),
        ("region-even-50%", RegionNoise(Even, 0.5), Some(0.733)),
        ("dense-8", Coarse(8), Some(0.610)),
        ("dense-16", Coarse(16), Some(0.433)),
        ("sparse-8", Grid(8), Some(0.887)),
        ("sparse-16", Grid(16), Some(0.800)),
        ("click", Clicks, Some(0.602)),
        ("grown-1%", Grown(0.01), Some(0.706)),
        ("grown-5%", Grown(0.05), Some(0.836)),
        ("grown-10%", Grown(0.1), Some(0.884)),
    ]
};

/// The name of the experiment of Table 4, and of its last row.
pub const FUSION: &str = "fusion";

/// The result of one run of an experiment.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PaperPoint {
    /// Name of the scene.
    pub scene: String,
    /// Name of the experiment.
    pub experiment: &'static str,
    /// Whether depth was read.
    pub depth: bool,
    /// Seed of the recipe and of the field.
    pub seed: u64,
    /// The scores of the resulting maps.
    #[serde(flatten)]
    pub scores: Scores,
    /// mIoU of the spoilt images themselves on the training frames; pixels without a label are wrong.
    pub input_miou: f64,
    /// Wall seconds: the surface, which the experiments of a seed share, and the spreading.
    pub wall_s: f64,
    /// The paper's mIoU, where it gives a number.
    pub paper_miou: Option<f64>,
}

/// What the experiments of a scene share.
struct Found<'a> {
    scene: &'a Arc<Scene>,
    truth: &'a SceneTruth,
    surface: &'a Arc<Surface>,
    /// Wall seconds that the surface took.
    surface_s: f64,
    seed: u64,
}

impl Found<'_> {
    fn point(
        &self,
        experiment: &'static str,
        scores: Scores,
        input_miou: f64,
        wall_s: f64,
        paper_miou: Option<f64>,
    ) -> PaperPoint {
        PaperPoint {
            scene: self.scene.name(),
            experiment,
            depth: self.scene.has_depth(),
            seed: self.seed,
            scores,
            input_miou,
            wall_s,
            paper_miou,
        }
    }
}

/// Runs the experiments that the command line asks for, with one seed of the recipes and of the field. It takes the threads
/// that it is run in.
///
/// # Errors
/// A scene without ground truth or without a surface.
pub fn paper_experiments(
    scene: &Arc<Scene>,
    arguments: &PaperArguments,
    seed: u64,
    progress: &mut dyn FnMut(&str),
) -> Result<Vec<PaperPoint>, Failure> {
    let truth = SceneTruth::read(scene)?;
    let classes = truth.classes();
    let image = |&frame: &usize| ImportedMap::new(frame, &truth.in_frame(scene, frame));
    let clean: Vec<ImportedMap> = truth.train.iter().map(image).collect();
    let start = Instant::now();
    progress("finding the surface");
    let training = Duration::from_secs_f64(arguments.seconds);
    let session = SessionOptions {
        seed,
        ..arguments.on.training.session_options(scene.source.clone())
    };
    let surface = session_surface(scene, &session, training)?;
    let found = Found {
        scene,
        truth: &truth,
        surface: &surface,
        surface_s: start.elapsed().as_secs_f64(),
        seed,
    };
    let chosen = &arguments.experiments;
    let wanted = |name: &str| chosen.is_empty() || chosen.iter().any(|own| own == name);
    let all = ImportedLabels::new(clean.clone(), Trust::RIGHT);
    let objects = Objects::find(&surface, &classes, &all);
    let mut points = Vec::new();
    for (name, recipe, paper_miou) in EXPERIMENTS.into_iter().filter(|(name, ..)| wanted(name)) {
        progress(name);
        let labels = spoilt(&clean, scene, &classes, &objects, recipe, seed);
        let input = |frame: usize| {
            let own = labels.of_frame(frame);
            let size = scene.frames[frame].camera.pixels();
            own.map_or_else(|| vec![0; size], ImportedMap::labels)
        };
        let in_image = |frame, labels| in_image(scene, frame, labels);
        let input = truth.scores(&truth.train, |frame| in_image(frame, input(frame)))?;
        let start = Instant::now();
        let spread = spread(scene, &surface, &classes, labels);
        let wall_s = found.surface_s + start.elapsed().as_secs_f64();
        use Recipe::{Coarse, Grid, PixelNoise, RegionNoise};
        // As in the paper: noisy, coarse and sparse labels in their own frames, the rest in the others.
        let frames = match recipe {
            PixelNoise(_) | RegionNoise(..) | Coarse(_) | Grid(_) => &truth.train,
            _ => &truth.test,
        };
        let map = |frame| spread.map(scene, frame, 0).labels().into_owned();
        let scores = truth.scores(frames, |frame| in_image(frame, map(frame)))?;
        points.push(found.point(name, scores, input.miou, wall_s, paper_miou));
    }
    if wanted(FUSION) {
        progress(FUSION);
        points.extend(fusion::run(&found)?);
    }
    Ok(points)
}

/// The label images after a recipe.
fn spoilt(
    clean: &[ImportedMap],
    scene: &Scene,
    classes: &[ClassId],
    objects: &Objects,
    recipe: Recipe,
    seed: u64,
) -> ImportedLabels {
    let width = |frame: usize| scene.frames[frame].camera.width as usize;
    let each = |change: &(dyn Fn(&ImportedMap, &mut SmallRng) -> Vec<ClassId> + Sync)| -> Vec<ImportedMap> {
        let spoil = |map: &ImportedMap| {
            let mut rng = SmallRng::seed_from_u64(seed ^ ((map.frame as u64 + 1) << 32));
            ImportedMap::new(map.frame, &change(map, &mut rng))
        };
        clean.par_iter().map(spoil).collect()
    };
    let kept = |count: usize| {
        let places = evenly(clean.len(), count).into_iter();
        places.map(|place| clean[place].clone()).collect()
    };
    let maps = match recipe {
        Recipe::ShareOfFrames(share) => kept((share * clean.len() as f64).round().max(1.0) as usize),
        Recipe::Frames(count) => kept(count),
        Recipe::PixelNoise(share) => each(&|map, rng| {
            let mut labels = map.labels();
            pixel_noise(&mut labels, classes, share, rng);
            labels
        }),
        Recipe::RegionNoise(flipped, share) => {
            let mut maps = clean.to_vec();
            objects.flip(&mut maps, classes, flipped, share, seed);
            maps
        }
        Recipe::Coarse(factor) => each(&|map, _| coarse(&map.labels(), width(map.frame), factor)),
        Recipe::Grid(factor) => each(&|map, _| grid(&map.labels(), width(map.frame), factor)),
        Recipe::Clicks => each(&|map, rng| clicks(&map.labels(), rng)),
        Recipe::Grown(share) => each(&|map, rng| grown(&map.labels(), width(map.frame), share, rng)),
    };
    let trust = match recipe {
        Recipe::PixelNoise(_) | Recipe::RegionNoise(..) | Recipe::Coarse(_) => Trust::VOTES,
        _ => Trust::RIGHT,
    };
    ImportedLabels { maps, trust }
}

/// The columns of `paper.csv`, one row for each point.
pub const COLUMNS: &str = "scene experiment depth seed miou:4 average_accuracy:4 total_accuracy:4 wall_s:2 paper_miou \
     boundary_miou:4";

/// Runs the experiments on every scene, writes `paper.csv`, and prints.
pub fn run(arguments: &PaperArguments) -> Result<(), Failure> {
    let training = &arguments.on.training;
    let out = &arguments.on.output.out;
    begin(out, &arguments.on.scenes)?;
    let pool = pool(training.reading.threads())?;
    let mut points = Vec::new();
    for argument in &arguments.on.scenes {
        let source = SceneSource::from_argument(argument);
        let scene = Arc::new(Scene::open(&source, training.reading.open_options(), &|_, _| {})?);
        for run in 0..arguments.seeds {
            let seed = training.reading.seed.wrapping_add(run);
            let measured = pool.install(|| -> Result<Vec<PaperPoint>, Failure> {
                let progress = Progress::default();
                let name = argument.display();
                let mut tell = |what: &str| progress.show(format!("{name}, seed {seed}: {what}"));
                paper_experiments(&scene, arguments, seed, &mut tell)
            });
            points.extend(measured?);
        }
    }
    export::write(&out.join("paper.csv"), csv(&points, COLUMNS)?.as_bytes())?;
    page(&points)?.publish(&arguments.on.output, "paper", &points)
}

/// A row for each scene and experiment: means over the seeds.
fn page(points: &[PaperPoint]) -> Result<Page, Failure> {
    let mut page = Page::default();
    page.paragraph(
        "The experiments of the Semantic-NeRF paper. *Input* is the mIoU of the label images that were given; *paper* \
         the published mIoU, of Replica rooms, without depth, after 200,000 steps on a GPU.",
    );
    page.means(
        points,
        "scene | experiment | depth | input=input_miou:3 | mIoU=miou:3 | average accuracy=average_accuracy:3 | \
         total accuracy=total_accuracy:3 | boundary mIoU=boundary_miou:3 | seconds=wall_s:1 | paper=paper_miou:3",
    )?;
    Ok(page)
}
