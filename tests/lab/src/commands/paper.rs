//! `inplace-lab bench paper`: the experiments of the Semantic-NeRF paper.

use std::path::Path;
use std::sync::Arc;

use crate::paper::{COLUMNS, PaperPoint, PixelClassifier, paper_experiments};
use crate::table::csv;
use inplace_core::export;
use inplace_core::field::Preset;
use inplace_core::scene::{Scene, SceneSource};

use super::{Failure, begin, grouped};
use crate::arguments::PaperArguments;
use crate::mean;
use crate::page::{Page, known};
use inplace_core::session::Progress;

/// Runs the experiments on every scene, writes `paper.csv`, and prints.
pub fn run(arguments: &PaperArguments) -> Result<(), Failure> {
    let training = &arguments.on.training;
    if training.preset == Preset::Reference {
        return Err("the published network cannot learn from label images here; leave --preset away".into());
    }
    let out = &arguments.on.output.out;
    begin(out, &arguments.on.scenes)?;
    let threads = training.reading.threads();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let open = |argument: &Path| -> Result<Arc<Scene>, Failure> {
        let source = SceneSource::from_argument(argument);
        let scene = Scene::open(&source, training.reading.open_options(), &|_, _| {})?;
        Ok(Arc::new(scene))
    };
    let taught_by = arguments.train_on.iter().map(|argument| open(argument));
    let taught_by = taught_by.collect::<Result<Vec<Arc<Scene>>, Failure>>()?;
    let mut points = Vec::new();
    for argument in &arguments.on.scenes {
        let scene = open(argument)?;
        if taught_by.iter().any(|other| other.source == scene.source) {
            let name = argument.display();
            return Err(format!("{name}: is in --train-on; predictions are for other scenes").into());
        }
        for run in 0..arguments.seeds {
            let seed = training.reading.seed.wrapping_add(run);
            let measured = pool.install(|| -> Result<Vec<PaperPoint>, Failure> {
                let progress = Progress::default();
                let name = argument.display();
                let mut tell = |what: &str| progress.show(format!("{name}, seed {seed}: {what}"));
                let classifier = if taught_by.is_empty() {
                    None
                } else {
                    tell("teaching the pixel classifier");
                    let classifier = PixelClassifier::learn(&taught_by, seed)?;
                    eprintln!("{}", describe(&classifier, &scene)?);
                    Some(classifier)
                };
                paper_experiments(&scene, arguments, seed, classifier.as_ref(), &mut tell)
            });
            points.extend(measured?);
        }
    }
    export::write(&out.join("paper.csv"), csv(&points, COLUMNS)?.as_bytes())?;
    page(&points).publish(&arguments.on.output, "paper", &points)
}

/// What the predictions are, in a sentence.
fn describe(classifier: &PixelClassifier, scene: &Scene) -> Result<String, Failure> {
    let known = classifier.known(scene)?;
    let names: Vec<&str> = known.iter().map(|(_, name, _)| name.as_str()).collect();
    Ok(format!(
        "{}: predictions of a pixel classifier trained on {}; measured on the {} classes of both: {}; pixels of \
         other classes are wrong votes",
        scene.name(),
        classifier.scenes.join(", "),
        names.len(),
        names.join(", ")
    ))
}

/// A row for each scene and experiment: means over the seeds.
fn page(points: &[PaperPoint]) -> Page {
    let mut page = Page::default();
    page.paragraph(
        "The experiments of the Semantic-NeRF paper. *Input* is the mIoU of the label images that were given; *paper* \
         the published mIoU, of Replica rooms, without depth, after 200,000 steps on a GPU.",
    );
    let mut rows = Vec::new();
    for ((scene, depth, experiment), runs) in grouped(points, |point| {
        (point.scene.clone(), point.depth, point.experiment)
    }) {
        let of = |value: &dyn Fn(&PaperPoint) -> f64, decimals| {
            known(mean(runs.iter().map(|run| value(run))), decimals)
        };
        rows.push(vec![
            scene,
            experiment.to_owned(),
            if depth { "yes" } else { "no" }.to_owned(),
            of(&|run| run.input_miou, 3),
            of(&|run| run.scores.miou, 3),
            of(&|run| run.scores.average_accuracy, 3),
            of(&|run| run.scores.total_accuracy, 3),
            of(&|run| run.wall_s, 1),
            known(runs[0].paper_miou, 3),
        ]);
    }
    page.table(
        "scene | experiment | depth | input | mIoU | average accuracy | total accuracy | \
         seconds | paper",
        &rows,
    );
    page
}
