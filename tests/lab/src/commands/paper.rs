//! `inplace-lab bench paper`: the experiments of the Semantic-NeRF paper.

use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

use crate::paper::{PaperOptions, PaperPoint, PixelClassifier, paper_experiments, table};
use inplace_core::export;
use inplace_core::field::Preset;
use inplace_core::scene::{Scene, SceneSource};

use crate::arguments::PaperArguments;
use crate::commands::{Failure, cores, open_options};
use crate::page::Page;
use crate::progress::Progress;

/// Runs the experiments on every scene, writes `paper.csv`, and prints.
pub fn run(arguments: &PaperArguments) -> Result<(), Failure> {
    let training = &arguments.training;
    if training.preset == Preset::Reference {
        return Err("the published network cannot learn from label images here; leave --preset away".into());
    }
    let out = &arguments.out;
    export::prepare(out, &[])?;
    super::refuse_same_names(&arguments.scenes)?;
    let threads = training.threads.map_or(cores(), usize::from);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let open = |argument: &Path| -> Result<Arc<Scene>, Failure> {
        let source = SceneSource::from_argument(argument);
        Ok(Arc::new(Scene::open(
            &source,
            open_options(training),
            &|_, _| {},
        )?))
    };
    let taught_by = arguments.train_on.iter().map(|argument| open(argument));
    let taught_by = taught_by.collect::<Result<Vec<Arc<Scene>>, Failure>>()?;
    let mut points = Vec::new();
    for argument in &arguments.scenes {
        let scene = open(argument)?;
        if taught_by.iter().any(|other| other.source == scene.source) {
            return Err(format!(
                "{}: is in --train-on; predictions are for other scenes",
                argument.display()
            )
            .into());
        }
        for run in 0..arguments.seeds {
            let seed = training.seed.wrapping_add(run);
            let measured = pool.install(|| -> Result<Vec<PaperPoint>, Failure> {
                let mut progress = Progress::new();
                let mut tell = |what: &str| {
                    progress.show(&format!(
                        "{argument}, seed {seed}: {what}",
                        argument = argument.display()
                    ));
                };
                let classifier = if taught_by.is_empty() {
                    None
                } else {
                    tell("teaching the pixel classifier");
                    let classifier = PixelClassifier::learn(&taught_by, seed)?;
                    eprintln!("{}", describe(&classifier, &scene)?);
                    Some(Arc::new(classifier))
                };
                let options = PaperOptions {
                    preset: training.preset,
                    training: Duration::from_secs_f64(arguments.seconds),
                    seed,
                    experiments: arguments.experiments.clone(),
                    classifier,
                };
                Ok(paper_experiments(&scene, &options, &mut tell)?)
            });
            points.extend(measured?);
        }
    }
    export::write(&out.join("paper.csv"), table(&points)?.as_bytes())?;
    page(&points).publish(out, "paper", arguments.json, &points)
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
    let by_experiment = super::grouped(points, |point| {
        (point.scene.clone(), point.depth, point.experiment)
    });
    let rows = by_experiment
        .into_iter()
        .map(|((scene, depth, experiment), runs)| {
            let mean = |value: &dyn Fn(&PaperPoint) -> f64| {
                runs.iter().map(|point| value(point)).sum::<f64>() / runs.len().max(1) as f64
            };
            let shares = [
                mean(&|point| point.input_miou),
                mean(&|point| point.scores.miou),
                mean(&|point| point.scores.average_accuracy),
                mean(&|point| point.scores.total_accuracy),
            ];
            let mut row = vec![
                scene,
                experiment.to_owned(),
                if depth { "yes" } else { "no" }.to_owned(),
            ];
            row.extend(shares.map(|share| {
                if share.is_nan() {
                    "-".to_owned()
                } else {
                    format!("{share:.3}")
                }
            }));
            row.push(format!("{:.1}", mean(&|point| point.wall_s)));
            row.push(
                runs[0]
                    .paper_miou
                    .map_or("-".to_owned(), |miou| format!("{miou:.3}")),
            );
            row
        });
    page.table(
        "scene | experiment | depth | input | mIoU | average accuracy | total accuracy | \
         seconds | paper",
        &rows.collect::<Vec<_>>(),
    );
    page
}
