//! `inplace compare`: how far two projects of one scene agree.

use std::sync::Arc;

use inplace_core::arguments::TrainingArguments;
use inplace_core::export::{self, Agreement, Labelling};
use inplace_core::project::Contents;
use inplace_core::session::Progress;

use super::Failure;
use super::run::{self, GENERATION};
use crate::arguments::CompareArguments;

/// The folder of the images that show where they differ.
const DIFFERENCES: &str = "differences";

/// A project with maps of all its frames: by its saved model, or else trained until they have settled.
fn labelled(
    contents: Contents,
    training: &TrainingArguments,
    progress: &Arc<Progress>,
) -> Result<Labelling, Failure> {
    let session = run::of_project(&contents, training, false);
    let open = session.open;
    let mut client = run::start(session, progress);
    contents.check(&*client.listed()?)?;
    let scene = client.opened()?;
    let contents = run::matched(contents, &scene, open)?;
    let labels = contents.history.labels();
    client.label(labels.clone(), GENERATION);
    Ok(Labelling {
        maps: run::maps(&mut client)?,
        classes: labels.classes.clone(),
        scene,
    })
}

/// Labels every frame by each project, one after the other, compares the maps and prints.
pub fn run(arguments: &CompareArguments) -> Result<(), Failure> {
    if let Some(out) = &arguments.out {
        export::prepare(out, &[DIFFERENCES])?;
    }
    let progress = Arc::new(Progress::default());
    // Both, before the work on the first.
    let (first, second) = (
        Contents::read(&arguments.first)?,
        Contents::read(&arguments.second)?,
    );
    let first = labelled(first, &arguments.training, &progress)?;
    let second = labelled(second, &arguments.training, &progress)?;
    progress.show("comparing");
    let differences = arguments.out.as_ref().map(|out| out.join(DIFFERENCES));
    let pool = rayon::ThreadPoolBuilder::new().num_threads(arguments.training.reading.threads());
    let compare = || export::compare(&first, &second, differences.as_deref());
    let agreement = pool.build()?.install(compare)?;
    drop(progress);
    if agreement.frames == 0 {
        return Err(format!(
            "{} and {}: no frame of one has the name and size of one of the other; compare projects of one scene",
            arguments.first.display(),
            arguments.second.display()
        )
        .into());
    }
    if let Some(out) = &arguments.out {
        export::write_json(&out.join("comparison.json"), &agreement)?;
    }
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&agreement)?)
    } else {
        println!("{}", table(&agreement).trim_end())
    }
}

fn table(agreement: &Agreement) -> String {
    let known = |value: Option<f64>| value.map_or("-".to_owned(), |value| format!("{value:.4}"));
    let share = agreement.compared as f64 / agreement.pixels.max(1) as f64;
    let mut text = format!(
        "frames          {}\nlabelled twice  {share:.4} of the pixels, to which the rest applies\n\
         agreement       {}\nCohen's kappa   {}\nmean IoU        {}\n\n{:<24} {:>7} {:>12} {:>12}\n",
        agreement.frames,
        known(agreement.agreement),
        known(agreement.kappa),
        known(agreement.miou),
        "class",
        "IoU",
        "first",
        "second",
    );
    for class in &agreement.classes {
        text += &format!(
            "{:<24} {:>7.4} {:>12} {:>12}\n",
            class.name, class.iou, class.first, class.second
        );
    }
    text
}
