//! `inplace label`: the main job without the window, through the same session.

use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

use inplace_core::export::{self, PhaseSeconds, Report, peak_memory};
use inplace_core::field::Preset;
use inplace_core::labels::{History, LabelSet, Trust, read_label_images, read_strokes};
use inplace_core::project::{Contents, Project};
use inplace_core::scene::{OpenOptions, Scene, SceneSource, demo};
use inplace_core::session::{Command, Event, FrameMap, Session, SessionOptions, Status};

use super::progress::Progress;
use super::{Failure, cores, refuse_endless, session_options};
use crate::arguments::LabelArguments;

/// Generation of the labels: they never change here.
const GENERATION: u64 = 1;
/// Seconds that writing takes, for each million pixels and in any case; measured generously.
const WRITE_SECONDS_PER_MEGAPIXEL: f64 = 0.12;
const WRITE_SECONDS: f64 = 0.5;
/// Share of the budget kept for the last look at the surface.
const LAST_LOOK: f64 = 0.12;
/// Share of the budget in which the published network renders its maps.
const REFERENCE_RENDERING: f64 = 0.5;

/// Where the labels come from; they are read when the scene is open.
enum Strokes {
    Project(Box<Contents>, OpenOptions),
    File(PathBuf),
    Demo,
    /// There are label images alone.
    Nothing,
}

impl Strokes {
    fn read(self, scene: &Scene) -> Result<LabelSet, Failure> {
        Ok(match self {
            Self::Project(contents, open) => contents.matched(scene, open)?.history.labels().clone(),
            Self::File(path) => read_strokes(&path, scene)?,
            Self::Demo => demo::clicks(),
            Self::Nothing => LabelSet::default(),
        })
    }
}

/// The labels with the label images of a folder, in place of those that a project has.
fn with_images(labels: LabelSet, folder: &Path, trust: Trust, scene: &Scene) -> Result<LabelSet, Failure> {
    let images = read_label_images(folder, scene, &labels.classes, trust)?;
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

/// Labels every frame and writes maps and report.
pub fn run(arguments: &LabelArguments) -> Result<(), Failure> {
    let start = Instant::now();
    refuse_endless(&arguments.training, arguments.budget)?;
    let (options, strokes) = job(arguments)?;
    let mut run = Run {
        session: Session::start(options.clone(), || {}),
        progress: Progress::new(),
        start,
        status: Status::default(),
    };
    let scene = run.opened()?;
    let load = start.elapsed().as_secs_f64();
    for warning in &scene.warnings {
        eprintln!("inplace: {warning}");
    }
    let mut labels = strokes.read(&scene)?;
    if let Some(folder) = &arguments.import {
        labels = with_images(labels, folder, arguments.trust.unwrap_or(Trust::VOTES), &scene)?;
    }
    if labels.classes.is_empty() {
        return Err(format!(
            "{}: there are no classes to label with",
            arguments.scene.display()
        )
        .into());
    }
    export::prepare(&arguments.out)?;
    run.session.send(Command::Labels {
        labels: labels.clone(),
        generation: GENERATION,
    });
    let kept = match options.preset {
        Preset::Reference => REFERENCE_RENDERING,
        Preset::Auto | Preset::Fast | Preset::Accurate => LAST_LOOK,
    };
    let maps = run.maps(&scene, arguments.budget, kept)?;

    let writing = Instant::now();
    export::write_maps(&arguments.out, &scene, &labels.classes, &maps, &|_, _| {
        ControlFlow::Continue(())
    })?;
    let status = &run.status;
    let report = Report {
        version: env!("CARGO_PKG_VERSION").to_owned(),
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
            write: writing.elapsed().as_secs_f64(),
        },
        peak_memory_bytes: peak_memory(),
        capacity: status.capacity.clone(),
        parameters: status.parameters,
        held_out_psnr_db: status.held_out_psnr,
        depth_error_m: status.depth_error,
        mean_entropy: status.mean_entropy,
        map_stride: status.map_stride,
    };
    export::write_report(&arguments.out, &report)?;
    drop(run);
    if arguments.json {
        println!("{}", serde_json::to_string_pretty(&report)?);
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
        );
        if let Some(stride) = report.map_stride.filter(|&stride| stride > 1) {
            println!("maps were rendered at one pixel in {stride} along each axis");
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
    let threads = cores();
    if let Some(folder) = &arguments.import {
        if arguments.training.preset == Preset::Reference {
            return Err(
                "the published network does not learn from label images here; leave --preset away".into(),
            );
        }
        if !folder.is_dir() {
            return Err(format!("{}: is no folder; give one with label images", folder.display()).into());
        }
    }
    if arguments
        .scene
        .extension()
        .is_some_and(|extension| extension == "inplace")
    {
        if arguments.strokes.is_some() {
            return Err("a project brings its own strokes; leave --strokes away".into());
        }
        let (_, contents) = Project::open(&arguments.scene)?;
        let mut options = session_options(&arguments.training, contents.scene.source.clone(), threads);
        options.open.depth &= contents.scene.depth;
        options.state = contents.model.clone();
        let open = options.open;
        return Ok((options, Strokes::Project(Box::new(contents), open)));
    }
    let source = SceneSource::from_argument(&arguments.scene);
    let strokes = match (&arguments.strokes, &source) {
        (Some(path), _) => {
            readable(path)?;
            Strokes::File(path.clone())
        }
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
    Ok((session_options(&arguments.training, source, threads), strokes))
}

/// Fails before any work when a file is not there.
fn readable(path: &Path) -> Result<(), Failure> {
    match std::fs::File::open(path) {
        Ok(_) => Ok(()),
        Err(error) => Err(format!("{}: cannot be read: {error}", path.display()).into()),
    }
}

struct Run {
    session: Session,
    progress: Progress,
    start: Instant,
    status: Status,
}

impl Run {
    /// Waits for the scene.
    fn opened(&mut self) -> Result<Arc<Scene>, Failure> {
        loop {
            match self.session.events().recv()? {
                Event::Opening { done, total } => {
                    self.progress.show(&format!("reading frame {done} of {total}"));
                }
                Event::Opened(scene) => return Ok(scene),
                Event::Error(reason) => return Err(reason.into()),
                _ => {}
            }
        }
    }

    /// Waits until the maps are final, or for as long as the budget allows, with a share of it kept for what
    /// follows training; then returns them.
    fn maps(&mut self, scene: &Scene, budget: Option<f64>, kept: f64) -> Result<Vec<Arc<FrameMap>>, Failure> {
        let megapixels = scene
            .frames
            .iter()
            .map(|frame| frame.camera.pixels())
            .sum::<usize>() as f64
            / 1e6;
        let writing = WRITE_SECONDS + WRITE_SECONDS_PER_MEGAPIXEL * megapixels;
        // When to train no more, and when to write whatever there is.
        let at = |seconds: f64| self.start + Duration::from_secs_f64(seconds.max(0.0));
        let deadlines = budget.map(|budget| (at(budget - writing - kept * budget), at(budget - writing)));
        let mut settling = false;
        loop {
            let now = Instant::now();
            if let Some((settle, end)) = deadlines {
                if now >= settle && !settling {
                    settling = true;
                    self.session.send(Command::Settle);
                }
                if now >= end
                    && let Some(maps) = self.all_maps(scene)
                {
                    return Ok(maps);
                }
            }
            match self.session.events().recv_timeout(Duration::from_millis(50)) {
                Ok(Event::Status(status)) => {
                    self.progress.show(&describe(&status));
                    let done = status.is_final(GENERATION);
                    self.status = status;
                    if done && let Some(maps) = self.all_maps(scene) {
                        return Ok(maps);
                    }
                }
                Ok(Event::Warning(sentence)) => eprintln!("inplace: {sentence}"),
                Ok(Event::Error(reason)) => return Err(reason.into()),
                Ok(Event::Stopped) | Err(crossbeam_channel::RecvTimeoutError::Disconnected) => {
                    return Err("training ended before the maps were made".into());
                }
                Ok(_) | Err(crossbeam_channel::RecvTimeoutError::Timeout) => {}
            }
        }
    }

    /// The maps of all frames, where every frame has one of these labels.
    fn all_maps(&self, scene: &Scene) -> Option<Vec<Arc<FrameMap>>> {
        let slots = self.session.maps();
        (0..scene.frames.len())
            .map(|frame| slots.get(frame).filter(|map| map.generation == GENERATION))
            .collect()
    }
}

fn describe(status: &Status) -> String {
    let psnr = status
        .held_out_psnr
        .map_or(String::new(), |psnr| format!(", {psnr:.1} dB"));
    let entropy = status
        .mean_entropy
        .map_or(String::new(), |entropy| format!(", entropy {entropy:.2}"));
    format!("training: step {}{psnr}{entropy}", status.steps)
}
