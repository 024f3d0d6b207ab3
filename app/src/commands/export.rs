//! `inplace export`: a project's labels as a data set, its surface, or views of it.

use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

use inplace_core::export::{self, IdMap, LabelledScene, Options, Views, Written};
use inplace_core::project::Contents;
use inplace_core::scene::{Scene, Trajectory};
use inplace_core::semantics::NovelViews;
use inplace_core::session::{Measured, ModelState, Progress};

use super::run::{self, GENERATION};
use super::{Failure, threads};
use crate::arguments::ExportArguments;

/// Labels every frame with the field as the project keeps it, and writes the data set, or the views along a path.
pub fn run(arguments: &ExportArguments) -> Result<(), Failure> {
    let start = Instant::now();
    let options = Options {
        least_probability: arguments.least_probability,
        ids: arguments.ids.as_deref().map(IdMap::named).transpose()?,
    };
    let trajectory = arguments.trajectory.as_deref();
    let trajectory = trajectory.map(|path| Trajectory::read(path, arguments.intrinsics.as_deref()));
    let trajectory = trajectory.transpose()?;
    let contents = Contents::read(&arguments.project)?;
    export::prepare(&arguments.out, &[])?;
    let (mut client, open) = run::of_project(&contents, &arguments.training, trajectory.is_some());
    let mut enough = contents.model.as_ref().map(|model| model.steps);
    let scene = client.opened()?;
    if trajectory.is_some() {
        // Views are rendered from a field that has learnt all it can. Labels teach only the semantic field.
        client.settled(0, None)?;
        enough = (!reads_semantic_field(&scene)).then_some(0);
    }
    let contents = contents.matched(&scene, open)?;
    for warning in contents.warnings.iter().chain(&scene.warnings) {
        eprintln!("inplace: {warning}");
    }
    let (labels, parts) = (contents.history.labels(), contents.parts());
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
    client.label(labels.clone(), GENERATION);
    let maps = run::maps(&mut client, enough)?;
    let labelled = LabelledScene {
        scene: &scene,
        classes: &labels.classes,
        objects: &labels.objects,
        parts: &parts,
        maps: &maps,
    };
    let (what, written) = match trajectory {
        Some(trajectory) => {
            let model = client.saved()?;
            // Its worker would keep the memory.
            drop(client);
            let written = render(arguments, &scene, labelled, &trajectory, &model, &options)?;
            (format!("rendered {} views", trajectory.poses.len()), written)
        }
        None => {
            let format = arguments.format;
            let go_on = |_, _| ControlFlow::Continue(());
            let written = export::export(&arguments.out, labelled, format, &options, &go_on)?;
            let what = match format.has_frames() {
                true => format!("{} frames", scene.frames.len()),
                false => "the surface".to_owned(),
            };
            (format!("exported {what} as {}", format.name()), written)
        }
    };
    println!(
        "{what} in {:.1} s: {} files written, {} unchanged: {}",
        start.elapsed().as_secs_f64(),
        written.files,
        written.unchanged,
        arguments.out.display()
    );
    Ok(())
}

/// Whether the semantic field says the classes of views: it does where the surface, which is better where it was measured,
/// is mostly the field's.
fn reads_semantic_field(scene: &Scene) -> bool {
    Measured::of(scene) == Measured::Little
}

/// Renders the views along a path with a model of the scene, and writes them.
fn render(
    arguments: &ExportArguments,
    scene: &Arc<Scene>,
    labelled: LabelledScene<'_>,
    trajectory: &Trajectory,
    model: &ModelState,
    options: &Options,
) -> Result<Written, Failure> {
    let Some((surface, posterior)) = labelled.maps.first().and_then(|map| map.surface()) else {
        return Err("this preset finds no surface whose labels could be seen; leave --preset away".into());
    };
    let training = &arguments.training;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads(training));
    let pool = pool.build()?;
    pool.install(|| {
        let trainer = model.field(scene, training.preset, training.seed)?;
        let semantics = match reads_semantic_field(scene) {
            true => model.semantic_field(&trainer)?,
            false => None,
        };
        let mut renderer = NovelViews::new(&trainer, surface, posterior, labelled.classes.len());
        if let Some(semantics) = &semantics {
            renderer = renderer.labelled_by(semantics);
        }
        let views = Views {
            scene,
            classes: labelled.classes,
            trajectory,
            renderer: &renderer,
        };
        let mut progress = Progress::default();
        let written = export::export_views(&arguments.out, views, options, &mut |done, total| {
            progress.show(&format!("rendering view {done} of {total}"));
            ControlFlow::Continue(())
        })?;
        Ok(written)
    })
}
