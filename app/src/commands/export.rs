//! `inplace export`: a project's labels as a data set.

use std::ops::ControlFlow;
use std::time::Instant;

use inplace_core::export::{self, IdMap, LabelledScene, Options};
use inplace_core::project::Contents;

use super::run::Run;
use super::{Failure, cores, require_place, session_options};
use crate::arguments::ExportArguments;

/// Labels every frame with the field as the project keeps it, and writes the data set.
pub fn run(arguments: &ExportArguments) -> Result<(), Failure> {
    let start = Instant::now();
    let options = Options {
        least_probability: arguments.least_probability,
        ids: arguments.ids.as_deref().map(IdMap::named).transpose()?,
    };
    let contents = Contents::read(&arguments.project)?;
    require_place(&contents, &arguments.project)?;
    for warning in &contents.warnings {
        eprintln!("inplace: {warning}");
    }
    let mut session = session_options(&arguments.training, contents.scene.source.clone(), cores());
    session.open.depth &= contents.scene.depth;
    session.state = contents.model.clone();
    let open = session.open;
    export::prepare(&arguments.out, &[])?;
    let mut run = Run::start(session, start);
    if let Some(model) = &contents.model {
        run.train_to(model.steps);
    }
    let scene = run.opened()?;
    for warning in &scene.warnings {
        eprintln!("inplace: {warning}");
    }
    let labels = contents.matched(&scene, open)?.history.labels().clone();
    if labels.classes.is_empty() {
        return Err(format!("{}: there are no classes to export", arguments.project.display()).into());
    }
    if let Some(ids) = &options.ids {
        let missing = ids.missing(&labels.classes);
        if !missing.is_empty() {
            eprintln!(
                "inplace: classes that are not in the list become void: {}",
                missing.join(", ")
            );
        }
    }
    run.label(labels.clone());
    let maps = run.maps(&scene, None, 0.0)?;
    let labelled = LabelledScene {
        scene: &scene,
        classes: &labels.classes,
        maps: &maps,
    };
    let format = arguments.format;
    let written = export::export(&arguments.out, labelled, format, &options, &|_, _| {
        ControlFlow::Continue(())
    })?;
    println!(
        "exported {} frames as {} in {:.1} s: {} files written, {} unchanged: {}",
        scene.frames.len(),
        format.name(),
        start.elapsed().as_secs_f64(),
        written.files,
        written.unchanged,
        arguments.out.display()
    );
    Ok(())
}
