//! `inplace bench paper`: the experiments of the Semantic-NeRF paper.

use std::sync::Arc;
use std::time::Duration;

use inplace_core::eval::paper::{EXPERIMENTS, PaperPoint, paper_experiments, table};
use inplace_core::field::Preset;
use inplace_core::scene::{Scene, SceneSource};

use crate::arguments::PaperArguments;
use crate::commands::progress::Progress;
use crate::commands::{Failure, cores, open_options};

/// Runs the experiments on every scene, writes `paper.csv`, and prints.
pub fn run(arguments: &PaperArguments) -> Result<(), Failure> {
    let training = &arguments.training;
    if training.preset == Preset::Reference {
        return Err("the published network cannot learn from label images here; leave --preset away".into());
    }
    let out = &arguments.out;
    std::fs::create_dir_all(out).map_err(|error| format!("{}: cannot be made: {error}", out.display()))?;
    let threads = training.threads.map_or(cores(), usize::from);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let mut points = Vec::new();
    for argument in &arguments.scenes {
        let source = SceneSource::from_argument(argument);
        let scene = Arc::new(Scene::open(&source, open_options(training), &|_, _| {})?);
        for run in 0..arguments.seeds {
            let seed = training.seed.wrapping_add(run);
            let seconds = Duration::from_secs_f64(arguments.seconds);
            let measured = pool.install(|| {
                let mut progress = Progress::new();
                paper_experiments(&scene, training.preset, seconds, seed, &mut |what| {
                    progress.show(&format!(
                        "{argument}, seed {seed}: {what}",
                        argument = argument.display()
                    ));
                })
            });
            points.extend(measured?);
        }
    }
    table(&points).write(&out.join("paper.csv"))?;
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&points)?);
    } else {
        print(&points);
    }
    Ok(())
}

/// A row for each scene and experiment: means over the seeds.
fn print(points: &[PaperPoint]) {
    println!("scene            experiment       depth   input    mIoU  average   total  seconds   paper");
    for ((scene, depth), own) in super::engine::grouped(points, |point| (point.scene.clone(), point.depth)) {
        for experiment in EXPERIMENTS {
            let runs = || own.iter().filter(|point| point.experiment == experiment.name);
            let mean = |value: &dyn Fn(&PaperPoint) -> f64| {
                runs().map(|point| value(point)).sum::<f64>() / runs().count().max(1) as f64
            };
            println!(
                "{scene:16} {:16} {:5} {:>7.3} {:>7.3} {:>8.3} {:>7.3} {:>8.1}   {}",
                experiment.name,
                if depth { "yes" } else { "no" },
                mean(&|point| point.input_miou),
                mean(&|point| point.scores.miou),
                mean(&|point| point.scores.average_accuracy),
                mean(&|point| point.scores.total_accuracy),
                mean(&|point| point.wall_s),
                experiment
                    .paper_miou
                    .map_or("-".to_owned(), |miou| format!("{miou:.3}")),
            );
        }
    }
}
