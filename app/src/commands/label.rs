//! `inplace label`: the main job without the window, through the same session.

use std::path::{Path, PathBuf, absolute};
use std::sync::Arc;
use std::time::Instant;

use inplace_core::export::{self, Format, Inputs, LabelledScene, Options, PhaseSeconds, Report, peak_memory};
use inplace_core::labels::{
    Class, History, ImportError, LabelImages, LabelSet, Trust, label_image_files, read_label_images,
    read_strokes,
};
use inplace_core::project::Contents;
use inplace_core::scene::{Frame, OpenOptions, Scene, SceneSource, demo};
use inplace_core::semantics::{KnownPart, united};
use inplace_core::session::{Client, Command, Progress, Saved, SessionOptions};
use serde_json::json;

use super::Failure;
use super::budget::Budget;
use super::run::{self, GENERATION};
use crate::arguments::LabelArguments;

/// Where the labels come from; they are read when the scene is open.
enum Strokes {
    Project(Box<Contents>),
    File(PathBuf),
    Demo,
    /// There are label images alone.
    Nothing,
}

impl Strokes {
    /// The classes of the labels, which must be on frames that the capture lists.
    fn classes(&self, listed: &Scene) -> Result<Vec<Class>, Failure> {
        Ok(match self {
            Self::Project(contents) => {
                contents.check(listed)?;
                contents.history.labels().classes.clone()
            }
            Self::File(path) => read_strokes(path, listed)?.classes,
            Self::Demo => demo::classes(),
            Self::Nothing => Vec::new(),
        })
    }

    /// The labels, and the parts that a project knows.
    fn read(self, scene: &Scene, open: OpenOptions) -> Result<(LabelSet, Vec<KnownPart>), Failure> {
        let labels = match self {
            Self::Project(contents) => {
                let contents = contents.matched(scene, open)?;
                for warning in &contents.warnings {
                    eprintln!("inplace: {warning}");
                }
                return Ok((contents.history.labels().clone(), contents.parts()));
            }
            Self::File(path) => read_strokes(&path, scene)?,
            Self::Demo => demo::Shot::default().clicks(),
            Self::Nothing => LabelSet::default(),
        };
        Ok((labels, Vec::new()))
    }
}

/// The label images that are to be imported for a scene's frames.
fn read_images(
    arguments: &LabelArguments,
    scene: &Scene,
    known: &[Class],
) -> Result<Option<LabelImages>, ImportError> {
    let trust = arguments.trust.unwrap_or(Trust::VOTES);
    let read = |folder: &PathBuf| read_label_images(folder, scene, known, trust);
    arguments.import.as_ref().map(read).transpose()
}

/// The labels with the label images of a folder, in place of those that a project has.
fn with_images(
    labels: LabelSet,
    (folder, mut images): (&Path, LabelImages),
    client: &mut Client,
) -> Result<LabelSet, Failure> {
    if images.is_by_frame() {
        images = united(&*run::surface(client)?, images, &labels);
    }
    if images.unmatched > 0 {
        eprintln!(
            "inplace: {}: images that are named like no frame were left out: {}",
            folder.display(),
            images.unmatched
        );
    }
    let mut history = History::new(labels);
    history.import(images);
    Ok(history.labels().clone())
}

/// Labels every frame and writes maps and report, unless that was done; with `--json`, a failure is told as JSON too.
pub fn run(arguments: &LabelArguments) -> Result<(), Failure> {
    let start = Instant::now();
    // Files are written on the threads of the pool that this runs in.
    let threads = arguments.training.reading.threads();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let done = pool.install(|| label_unless_finished(arguments, start));
    if let Err(failure) = &done
        && arguments.json
    {
        println!("{:#}", json!({ "error": failure.to_string() }))?;
    }
    done
}

fn label_unless_finished(arguments: &LabelArguments, start: Instant) -> Result<(), Failure> {
    let (options, strokes) = job(arguments)?;
    let inputs = inputs(arguments, &options)?;
    let finished = || export::finished(&arguments.out, env!("CARGO_PKG_VERSION"), &inputs);
    match (!arguments.force).then(finished).flatten() {
        Some(report) if arguments.json => println!("{}", report.trim_end()),
        Some(_) => println!(
            "{}: was labelled already from the same scene, strokes and options; --force labels it anew",
            arguments.out.display()
        ),
        None => label(arguments, inputs, options, strokes, start),
    }
}

/// What the labels follow from.
fn inputs(arguments: &LabelArguments, options: &SessionOptions) -> Result<Inputs, Failure> {
    let own = is_project(&arguments.scene).then_some(&arguments.scene);
    let strokes = arguments.strokes.as_ref().or(own);
    let images = arguments.import.as_deref().map(label_image_files).transpose()?;
    Ok(Inputs {
        scene: match SceneSource::from_argument(&arguments.scene) {
            SceneSource::Demo => arguments.scene.clone(),
            SceneSource::Folder(path) => absolute(path)?,
        },
        strokes_sha256: strokes.map(|file| export::digest(&[file])).transpose()?,
        import_sha256: images.map(|files| export::digest(&files)).transpose()?,
        trust: arguments.trust.map(Trust::value),
        features_sha256: options
            .features
            .as_ref()
            .map(|file| export::digest(&[file]))
            .transpose()?,
        preset: options.preset,
        seed: options.seed,
        depth: options.open.depth,
        outside_files: options.open.outside_files,
        image_bytes: options.open.image_bytes,
        budget_s: arguments.budget,
    })
}

fn is_project(path: &Path) -> bool {
    path.extension().is_some_and(|extension| extension == "inplace")
}

fn label(
    arguments: &LabelArguments,
    inputs: Inputs,
    options: SessionOptions,
    strokes: Strokes,
    start: Instant,
) -> Result<(), Failure> {
    let progress = Arc::new(Progress::default());
    let mut client = run::start(options.clone(), &progress);
    // Depth that has to be estimated makes opening slow: what cannot be used is refused before.
    let listed = client.listed()?;
    let known = strokes.classes(&listed)?;
    let mut images = read_images(arguments, &listed, &known)?;
    if known.is_empty() && images.is_none() {
        let from = arguments.strokes.as_ref().unwrap_or(&arguments.scene);
        return Err(format!(
            "{}: there are no classes to label with; add classes and strokes",
            from.display()
        )
        .into());
    }
    export::prepare_pngs(&arguments.out, &listed)?;
    let scene = client.opened()?;
    let load = start.elapsed().as_secs_f64();
    for warning in &scene.warnings {
        eprintln!("inplace: {warning}");
    }
    let (mut labels, parts) = strokes.read(&scene, options.open)?;
    // Only now it is known which images cannot be used, and where they hide pixels.
    let hides_pixels = |frame: &Frame| !frame.hidden_pixels().is_empty();
    if !scene.has_frames_of(&listed) || scene.frames.iter().any(hides_pixels) {
        images = read_images(arguments, &scene, &known)?;
    }
    if let Some((folder, images)) = arguments.import.as_deref().zip(images) {
        labels = with_images(labels, (folder, images), &mut client)?;
    }
    client.label(labels.clone(), GENERATION);
    let budget = arguments.budget;
    let mut budget = budget.map(|seconds| Budget::of(seconds, &scene));
    let maps = match &mut budget {
        Some(budget) => run::maps_within(&mut client, (&scene, &labels), budget, start)?,
        None => run::maps(&mut client)?,
    };
    let final_maps_s = start.elapsed().as_secs_f64();
    // Writing has the machine for itself; how training went stays known.
    client.send(Command::Stop);

    let writing = Instant::now();
    let labelled = LabelledScene::new(&scene, &labels, &parts, &maps);
    export::export(
        &arguments.out,
        labelled,
        Format::Png,
        &Options::default(),
        &run::writing(&progress),
    )?;
    drop(progress);
    let status = client.status();
    let write = writing.elapsed().as_secs_f64();
    let total = start.elapsed().as_secs_f64();
    if status.finding_features {
        eprintln!(
            "inplace: the budget was over before the pretrained network had looked at the images; the labels do without it"
        );
    }
    let over_budget = budget.and_then(|budget| budget.exceeded(total, load, write));
    let report = Report {
        version: env!("CARGO_PKG_VERSION").to_owned(),
        inputs: Some(inputs),
        scene: scene.name(),
        frames: scene.frames.len(),
        strokes: labels.strokes.len(),
        imported_images: labels.imported.as_ref().map_or(0, |images| images.maps.len()),
        imported_trust: labels.imported.as_ref().map(|images| images.trust.value()),
        preset: options.preset,
        seed: options.seed,
        threads: options.threads,
        wall_s: PhaseSeconds {
            load,
            geometry: status.geometry_seconds,
            semantics: status.semantics_seconds,
            render: status.render_seconds,
            write,
        },
        total_s: total,
        training_end: status.training_end,
        training_steps: status.steps,
        final_maps_s,
        budget_s: arguments.budget,
        over_budget,
        peak_memory_bytes: peak_memory(),
        capacity: status.capacity.clone(),
        parameters: status.parameters,
        pose_refinement: scene.pose_refinement,
        held_out_psnr_db: status.held_out_psnr,
        depth_error_m: status.depth_error,
        mean_entropy: status.mean_entropy,
    };
    export::write_report(&arguments.out, &report)?;
    drop(client);
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?)?;
    } else {
        println!(
            "labelled {} frames from {}{} in {:.1} s: {}",
            report.frames,
            counted(report.strokes, "stroke"),
            match report.imported_images {
                0 => String::new(),
                images => format!(" and {}", counted(images, "label image")),
            },
            start.elapsed().as_secs_f64(),
            arguments.out.display()
        )?;
        if let Some(refinement) = report.pose_refinement {
            println!("{refinement}")?;
        }
        if let Some(end) = report.training_end {
            println!(
                "training ended after {} steps: {}",
                report.training_steps,
                end.sentence()
            )?;
        }
        if let Some(sentence) = &report.over_budget {
            println!("{sentence}")?;
        }
    }
    Ok(())
}

/// "1 stroke", "2 strokes".
fn counted(count: usize, what: &str) -> String {
    format!("{count} {what}{}", if count == 1 { "" } else { "s" })
}

/// Finds out what to label: a project with its own strokes, or a scene with a strokes file.
fn job(arguments: &LabelArguments) -> Result<(SessionOptions, Strokes), Failure> {
    if let Some(folder) = &arguments.import
        && !folder.is_dir()
    {
        return Err(format!("{}: is no folder; give one with label images", folder.display()).into());
    }
    let source = SceneSource::from_argument(&arguments.scene);
    let mut options = arguments.training.session_options(source);
    if let Some(gigabytes) = arguments.image_memory {
        options.open.image_bytes = (1e9 * gigabytes) as u64;
    }
    if is_project(&arguments.scene) {
        if arguments.strokes.is_some() {
            return Err("a project brings its own strokes; leave out --strokes".into());
        }
        let contents = Contents::read(&arguments.scene)?;
        options.source = contents.scene.source.clone();
        options.open.depth &= contents.scene.depth;
        options.state = contents.model.clone().map(Saved::from);
        return Ok((options, Strokes::Project(Box::new(contents))));
    }
    let strokes = match (&arguments.strokes, &options.source) {
        (Some(path), _) => Strokes::File(path.clone()),
        (None, SceneSource::Demo) => Strokes::Demo,
        (None, SceneSource::Folder(_)) if arguments.import.is_some() => Strokes::Nothing,
        (None, SceneSource::Folder(_)) => {
            return Err(format!(
                "{}: nothing says what is where; give a strokes file with --strokes, or label images with --import",
                arguments.scene.display()
            )
            .into());
        }
    };
    Ok((options, strokes))
}
