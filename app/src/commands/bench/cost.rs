//! What captures of several sizes cost, each measured in a process of its own.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use inplace_core::eval::{Cost, session_cost};
use inplace_core::scene::{SceneSource, demo, write_replica};

use crate::arguments::{EngineArguments, TrainingArguments};
use crate::commands::{Failure, cores, session_options};

/// Number of frames at which the image size is varied.
pub(super) const FRAMES_OF_SIZES: usize = 100;

/// A folder that is removed in the end.
struct Scratch(PathBuf);

impl Drop for Scratch {
    fn drop(&mut self) {
        // What could not be removed lies in the system's folder for temporary files.
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// Image size at which the number of frames is varied.
pub(super) fn size_of_frames(arguments: &EngineArguments) -> (u32, u32) {
    let sizes = &arguments.cost_sizes;
    sizes.get(2).or(sizes.last()).copied().unwrap_or((640, 480))
}

/// Renders the demo room in every size and measures each capture; prints how it goes on stderr.
pub(super) fn measure(arguments: &EngineArguments, threads: usize) -> Result<Vec<Cost>, Failure> {
    let name = format!("inplace-cost-{}", std::process::id());
    let scratch = Scratch(std::env::temp_dir().join(name));
    let failed = |path: &Path, error: std::io::Error| -> Failure {
        format!(
            "{}: cannot be written: {error}; free some space there",
            path.display()
        )
        .into()
    };
    let swept = size_of_frames(arguments);
    let mut costs = Vec::new();
    for &(width, height) in &arguments.cost_sizes {
        let mut counts = BTreeSet::from([FRAMES_OF_SIZES]);
        if (width, height) == swept {
            counts.extend(arguments.cost_frames.iter().map(|&frames| usize::from(frames)));
        }
        let shot = demo::Shot {
            rooms: 1,
            frames: counts.last().copied().unwrap_or(FRAMES_OF_SIZES),
            width,
            height,
        };
        let whole = scratch.0.join(format!("{width}x{height}"));
        eprintln!("rendering {} frames of {width}x{height}", shot.frames);
        fs::create_dir_all(&scratch.0).map_err(|error| failed(&scratch.0, error))?;
        write_replica(&shot.scene(&|_, _| {}), &whole, None)?;
        for frames in counts {
            let part = scratch.0.join(format!("{width}x{height}-{frames}"));
            link_first(&whole, &part, frames).map_err(|error| failed(&part, error))?;
            eprintln!("measuring {frames} frames of {width}x{height}");
            costs.push(in_own_process(&part, arguments, threads)?);
            fs::remove_dir_all(&part).map_err(|error| failed(&part, error))?;
        }
        fs::remove_dir_all(&whole).map_err(|error| failed(&whole, error))?;
    }
    Ok(costs)
}

/// Makes a capture of the first frames of another one.
fn link_first(whole: &Path, part: &Path, frames: usize) -> std::io::Result<()> {
    for kind in ["rgb", "depth"] {
        fs::create_dir_all(part.join(kind))?;
        for frame in 0..frames {
            let file = format!("{kind}/{kind}_{frame}.png");
            // Not every file system has links.
            fs::hard_link(whole.join(&file), part.join(&file))
                .or_else(|_| fs::copy(whole.join(&file), part.join(&file)).map(|_| ()))?;
        }
    }
    fs::copy(whole.join("intrinsics.txt"), part.join("intrinsics.txt"))?;
    let poses = fs::read_to_string(whole.join("traj_w_c.txt"))?;
    let first: Vec<&str> = poses.lines().take(frames).collect();
    fs::write(part.join("traj_w_c.txt"), first.join("\n") + "\n")
}

/// Runs this program again for one capture, so that the peak of its memory is that of this capture.
fn in_own_process(scene: &Path, arguments: &EngineArguments, threads: usize) -> Result<Cost, Failure> {
    let mut command = Command::new(std::env::current_exe()?);
    command
        .args(["bench", "cost-of"])
        .arg(scene)
        .args(["--seconds", &arguments.cost_seconds.to_string()])
        .args(["--threads", &threads.to_string()])
        .args(["--seed", &arguments.seed.to_string()]);
    if arguments.no_depth {
        command.arg("--no-depth");
    }
    let output = command.output()?;
    if !output.status.success() {
        let reason = String::from_utf8_lossy(&output.stderr);
        return Err(format!(
            "{}: its cost was not measured: {}",
            scene.display(),
            reason.trim()
        )
        .into());
    }
    Ok(serde_json::from_slice(&output.stdout)?)
}

/// `inplace bench cost-of`: measures one capture in this process and prints JSON.
pub(super) fn of_one(scene: &Path, seconds: f64, training: &TrainingArguments) -> Result<(), Failure> {
    let options = session_options(training, SceneSource::from_argument(scene), cores());
    let cost = session_cost(options, seconds, |scene| {
        let camera = &scene.frames[0].camera;
        let shot = demo::Shot {
            rooms: 1,
            frames: scene.frames.len(),
            width: camera.width,
            height: camera.height,
        };
        shot.clicks()
    })?;
    println!("{}", serde_json::to_string(&cost)?);
    Ok(())
}

pub(super) fn print(costs: &[Cost]) {
    if costs.is_empty() {
        return;
    }
    println!(
        "frames  size        opening s  surface s  map in view s  all maps s  steps/s    rays/s  samples/s  open GB  peak GB"
    );
    let gigabytes =
        |bytes: Option<u64>| bytes.map_or("-".to_owned(), |bytes| format!("{:.2}", bytes as f64 / 1e9));
    for cost in costs {
        println!(
            "{:6}  {:10} {:10.2} {:10.2} {:14.3} {:11.2} {:8.1} {:9.0} {:10.0} {:>8} {:>8}",
            cost.frames,
            format!("{}x{}", cost.width, cost.height),
            cost.opening_s,
            cost.surface_s,
            cost.map_in_view_s,
            cost.all_maps_s,
            cost.steps_per_s,
            cost.rays_per_s,
            cost.samples_per_s,
            gigabytes(cost.peak_opening_bytes),
            gigabytes(cost.peak_memory_bytes)
        );
    }
}

/// Name of the processor, where the system tells.
pub(super) fn processor() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("model name"));
    line.and_then(|line| line.split_once(':')).map_or_else(
        || std::env::consts::ARCH.to_owned(),
        |(_, name)| name.trim().to_owned(),
    )
}
