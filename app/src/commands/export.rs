//! `inplace export`: a project's labels as a data set, its surface, or views of it.

use std::ops::ControlFlow;
use std::path::Path;
use std::sync::Arc;
use std::time::Instant;

use inplace_core::export::{self, Format, IdMap, LabelledScene, Options, Views, Written};
use inplace_core::labels::Class;
use inplace_core::project::{Contents, SceneRecord, same_file};
use inplace_core::scene::{Scene, Trajectory};
use inplace_core::semantics::NovelViews;
use inplace_core::session::{Command, Measured, ModelState, Progress};

use super::Failure;
use super::budget::Budget;
use super::run::{self, GENERATION};
use crate::arguments::ExportArguments;

/// Wall time from the start to the last file written, in seconds, where depth was measured and nothing was learnt before.
const BUDGET: f64 = 20.0;

/// Writes the labels that the project holds, or else those that are learnt now, as a data set or as views along a path.
///
/// - The maps of a project are exported as they are, where they say all that is asked for and no frame is new or changed.
/// - Otherwise a saved model gives the surface, without further training; views are rendered once all is learnt.
/// - Without a model training ends as that of `label` does, or before that by the budget.
pub fn run(arguments: &ExportArguments) -> Result<(), Failure> {
    let start = Instant::now();
    let progress = Arc::new(Progress::default());
    progress.show("reading the project");
    let options = Options {
        least_probability: arguments.least_probability,
        ids: arguments.ids.as_deref().map(IdMap::named).transpose()?,
    };
    let trajectory = arguments.trajectory.as_deref();
    let trajectory = trajectory.map(|path| Trajectory::read(path, arguments.intrinsics.as_deref()));
    let trajectory = trajectory.transpose()?;
    let contents = Contents::read(&arguments.project)?;
    let classes = &contents.history.labels().classes;
    if classes.is_empty() {
        return Err(format!(
            "{}: there are no classes to export; add classes and strokes",
            arguments.project.display()
        )
        .into());
    }
    if let Some(ids) = &options.ids {
        let missing = ids.missing(classes);
        if !missing.is_empty() {
            eprintln!(
                "inplace: classes that are not in the list become void: {}",
                missing.join(", ")
            );
        }
    }
    if trajectory.is_some() {
        let source = &contents.scene.source;
        if export::is_capture(&arguments.out, source) || has_other_images(&arguments.out) {
            return Err(format!(
                "{}: is a capture itself, whose poses would be lost; choose another folder with --out",
                arguments.out.display()
            )
            .into());
        }
        let read = [&arguments.trajectory, &arguments.intrinsics];
        let written = ["traj_w_c.txt", "intrinsics.txt"].map(|name| arguments.out.join(name));
        let mut read = read.into_iter().flatten();
        if let Some(path) = read.find(|path| written.iter().any(|file| same_file(path, file))) {
            return Err(format!(
                "{}: would be replaced by the poses of the views; keep the camera path elsewhere, or choose another folder with --out",
                path.display()
            )
            .into());
        }
    }
    export::prepare(&arguments.out, &[])?;
    let session = run::of_project(&contents, &arguments.training, trajectory.is_some());
    let open = session.open;
    let exported = |labelled: LabelledScene<'_>| {
        let format = arguments.format;
        let written = export::export(
            &arguments.out,
            labelled,
            format,
            &options,
            &run::writing(&progress),
        )?;
        let what = match format.has_frames() {
            true => format!("{} frames", labelled.scene.frames.len()),
            false => "the surface".to_owned(),
        };
        Ok::<_, Failure>((format!("exported {what} as {}", format.name()), written))
    };
    let read = |done, total| progress.show_share("reading frames", done as f32 / total as f32);
    let is_held = trajectory.is_none() && has_what_is_asked(&contents, arguments);
    let scene = is_held.then(|| Scene::open(&session.source, open, &read));
    let is_known = |scene: &Scene| {
        let mut frames = SceneRecord::of(scene, open).frames.into_iter();
        frames.all(|frame| contents.scene.frames.contains(&frame))
    };
    let (what, written) = if let Some(scene) = scene.transpose()?.filter(is_known) {
        let contents = run::matched(contents, &scene, open)?;
        let (labels, parts) = (contents.history.labels(), contents.parts());
        exported(LabelledScene::new(&scene, labels, &parts, &contents.maps))?
    } else {
        let saved_steps = session.state.as_ref().map_or(0, |saved| saved.model.steps);
        let mut client = run::start(session, &progress);
        let listed = client.listed()?;
        contents.check(&listed)?;
        if trajectory.is_none() && arguments.format == Format::Png {
            export::prepare_pngs(&arguments.out, &listed)?;
        }
        let scene = client.opened()?;
        // A model that does not fit is left out.
        let is_learnt = saved_steps > 0 && run::first_status(&mut client)?.steps >= saved_steps;
        let usual = (scene.has_depth() && trajectory.is_none() && !is_learnt).then_some(BUDGET);
        let budget = arguments.budget.filter(|_| !is_learnt).or(usual);
        if trajectory.is_some() {
            // Views are rendered from a field that has learnt all it can, without a budget. Labels teach only the
            // semantic field.
            client.settled(0, None)?;
            if !reads_semantic_field(&scene) {
                client.send(Command::Settle);
            }
        }
        let contents = run::matched(contents, &scene, open)?;
        let (labels, parts) = (contents.history.labels(), contents.parts());
        client.label(labels.clone(), GENERATION);
        let maps = match budget {
            Some(seconds) => {
                let mut budget = Budget::of(seconds, &scene);
                let maps = run::maps_within(&mut client, (&scene, labels), &mut budget, start)?;
                let status = client.status();
                if status.training_end.is_none() {
                    println!(
                        "the budget of {seconds} s ended training after {} steps; --budget gives it more",
                        status.steps
                    )?;
                }
                maps
            }
            None => run::maps(&mut client)?,
        };
        let labelled = LabelledScene::new(&scene, labels, &parts, &maps);
        match trajectory {
            Some(trajectory) => {
                let model = client.saved()?;
                // Its worker would keep the memory.
                drop(client);
                let written = render(
                    arguments,
                    (&scene, &progress),
                    labelled,
                    &trajectory,
                    &model,
                    &options,
                )?;
                (format!("rendered {} views", trajectory.poses.len()), written)
            }
            None => {
                // Writing has the machine for itself.
                client.send(Command::Stop);
                exported(labelled)?
            }
        }
    };
    drop(progress);
    println!(
        "{what} in {:.1} s: {} files written, {} unchanged: {}",
        start.elapsed().as_secs_f64(),
        written.files,
        written.unchanged,
        arguments.out.display()
    )
}

/// Whether a folder is a capture in the Replica layout whose images are not rendered views.
fn has_other_images(folder: &Path) -> bool {
    let files = folder.join("rgb").read_dir().into_iter().flatten().flatten();
    let mut names = files.map(|file| file.file_name().to_string_lossy().into_owned());
    let is_image = |name: &str| [".png", ".jpg", ".jpeg"].iter().any(|end| name.ends_with(end));
    let is_other = |name: String| is_image(&name) && !name.starts_with("view_");
    folder.join("traj_w_c.txt").is_file() && names.any(is_other)
}

/// Whether the maps that a project holds say all that is asked for: objects and probabilities are told by the surface,
/// which it does not hold.
fn has_what_is_asked(contents: &Contents, arguments: &ExportArguments) -> bool {
    let tells_objects = |class: &Class| class.thing && arguments.format != Format::Overlay;
    contents.maps.len() == contents.scene.frames.len()
        && arguments.format.has_frames()
        && arguments.least_probability.is_none()
        && !contents.history.labels().classes.iter().any(tells_objects)
}

/// Whether the semantic field says the classes of views: it does where the surface, which is better where it was measured,
/// is mostly the field's.
fn reads_semantic_field(scene: &Scene) -> bool {
    Measured::of(scene) == Measured::Little
}

/// Renders the views along a path with a model of the scene, and writes them.
fn render(
    arguments: &ExportArguments,
    (scene, progress): (&Arc<Scene>, &Progress),
    labelled: LabelledScene<'_>,
    trajectory: &Trajectory,
    model: &ModelState,
    options: &Options,
) -> Result<Written, Failure> {
    let Some((surface, posterior)) = labelled.maps.first().and_then(|map| map.surface()) else {
        return Err("this preset finds no surface whose labels could be seen; leave out --preset".into());
    };
    let training = &arguments.training;
    let pool = rayon::ThreadPoolBuilder::new().num_threads(training.reading.threads());
    let pool = pool.build()?;
    pool.install(|| {
        let trainer = model.field(scene, training.preset, training.reading.seed)?;
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
        let written = export::export_views(&arguments.out, views, options, &mut |done, total| {
            progress.show_share("rendering views", done as f32 / total as f32);
            ControlFlow::Continue(())
        })?;
        Ok(written)
    })
}
