//! `inplace-lab bench all`: all measurements, one after the other, on one page.

use std::fs;
use std::io;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::Instant;

use inplace_core::export;
use inplace_core::scene::SceneSource;
use inplace_core::session::Progress;
use serde::{Deserialize, Serialize};

use super::{Failure, begin, machine};
use crate::arguments::AllArguments;
use crate::page::Page;

/// The folder of the measurements' own files, beside the page.
const FOLDER: &str = "benchmarks";

/// The benches: title, folder, page and command, options of the whole form, and of the short one. SCENES are all of them;
/// FIRST is the first alone, since a learnt surface takes its time; without either it is the demo, in whose place some of
/// the conditions of stability are rooms.
const BENCHES: &str = "\
Accuracy against time | pareto | pareto | SCENES --baselines --seeds 3 --marks 2,5,10,20 | SCENES --baselines --seeds 1 --marks 2,5,10,20
Accuracy against size | capacity | pareto | SCENES --preset auto --capacity --seeds 2 --marks 12 | left out
Accuracy against time, without depth | pareto-no-depth | pareto | SCENES --no-depth --preset auto --alone --seeds 1 --marks 10,20,40,80,160,300 | left out
How cost grows | scale | scale | | --sweep frames,strokes --frames 20,50,100 --strokes 10,100,1000 --seconds 2
How long a click waits | latency | latency | SCENES --clicks 200 | SCENES --clicks 50
Label images: the paper's experiments | paper | paper | SCENES | SCENES --experiments frames-10%,pixel-noise-90%,sparse-16,click,grown-1%
The engine | engine | engine | SCENES --rounds 15 --marks 5,15 | SCENES --rounds 5 --marks 5
Stability | stability | stability | | --quick --seeds 1
Accuracy against size, without depth | capacity-no-depth | pareto | FIRST --no-depth --preset auto --capacity --seeds 2 --marks 30 | left out";

/// One measurement: a command of this program.
struct Step {
    title: String,
    /// Its folder.
    folder: String,
    /// The page that it writes, without the extension.
    page: &'static str,
    /// Its arguments, without `--out`.
    arguments: Vec<String>,
}

/// What a measurement was and how it ended, `step.json` in its folder.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Ended {
    arguments: Vec<String>,
    /// SHA-256 of the program.
    build: String,
    /// The commit that it was built from.
    commit: String,
    /// Wall seconds.
    seconds: f64,
    /// Why it failed; also where a line was missed.
    failure: Option<String>,
}

/// Runs all measurements, writes `benchmarks.md`, and prints where it is.
pub fn run(arguments: &AllArguments) -> Result<(), Failure> {
    let out = &arguments.out;
    let folder = out.join(FOLDER);
    begin(&folder, &arguments.scenes)?;
    let steps = steps(&arguments.scenes, arguments.quick);
    let build = export::digest(&[std::env::current_exe()?])?;
    let mut page = Page::default();
    page.heading(1, "Benchmarks");
    page.paragraph(&format!(
        "Written by `inplace-lab bench all{}`, which runs the commands below. {} Every scene is in the Replica layout, \
         with ground truth.",
        if arguments.quick { " --quick" } else { "" },
        machine()
    ));
    let mut failed = Vec::new();
    let progress = Progress::default();
    for (number, step) in steps.iter().enumerate() {
        let (count, words) = (steps.len(), step.arguments.join(" "));
        progress.show_share(format!("inplace-lab {words}"), number as f32 / count as f32);
        let own = folder.join(&step.folder);
        let ended = step.measure(&own, &build, arguments.force)?;
        page.heading(2, &step.title);
        page.paragraph(&format!("    inplace-lab {} --out DIR", step.shown()));
        if let Ok(text) = fs::read_to_string(own.join(format!("{}.md", step.page))) {
            page.include(&below(&text), &format!("{FOLDER}/{}", step.folder));
        }
        if let Some(reason) = &ended.failure {
            let reason = reason.trim_start_matches("inplace-lab: ");
            page.paragraph(&format!("**Failed:** {reason}."));
            failed.push(step.folder.clone());
        }
        let Ended { seconds, commit, .. } = &ended;
        page.paragraph(&format!("This took {seconds:.0} s, at commit {commit}."));
        // What has been measured stays readable if a later measurement is interrupted.
        export::write(&out.join("benchmarks.md"), page.as_str().as_bytes())?;
    }
    drop(progress);
    println!("{}", out.join("benchmarks.md").display());
    if failed.is_empty() {
        Ok(())
    } else {
        Err(format!("failed, or missed a line: {}", failed.join(", ")).into())
    }
}

/// A page under a heading of level 2: its title is left out, its headings go one level down.
fn below(page: &str) -> String {
    let mut below = String::new();
    for line in page.lines().filter(|line| !line.starts_with("# ")) {
        let deeper = if line.starts_with("##") { "#" } else { "" };
        below += &format!("{deeper}{line}\n");
    }
    below.trim().to_owned()
}

impl Step {
    /// Its command line, with the names of the scenes in place of their folders.
    fn shown(&self) -> String {
        let name = |argument: &String| {
            let path = Path::new(argument);
            let file = path.file_name().filter(|_| path.components().count() > 1);
            file.map_or_else(|| argument.clone(), |name| name.to_string_lossy().into_owned())
        };
        self.arguments.iter().map(name).collect::<Vec<String>>().join(" ")
    }

    /// Measures in a process of its own, unless this build has done that here before.
    fn measure(&self, out: &Path, build: &str, force: bool) -> Result<Ended, Failure> {
        let (record, page) = (out.join("step.json"), out.join(format!("{}.md", self.page)));
        let before = fs::read(&record).ok();
        let before: Option<Ended> = before.and_then(|bytes| serde_json::from_slice(&bytes).ok());
        if let Some(before) = before
            && !force
            && before.arguments == self.arguments
            && before.build == build
            && page.is_file()
        {
            return Ok(before);
        }
        export::prepare(out, &[])?;
        // What stays without a page has not been measured.
        if let Err(error) = fs::remove_file(&page)
            && error.kind() != io::ErrorKind::NotFound
        {
            return Err(format!("{}: cannot be replaced: {error}", page.display()).into());
        }
        let start = Instant::now();
        let mut command = Command::new(std::env::current_exe()?);
        command.args(&self.arguments).arg("--out").arg(out);
        let output = command.stdout(Stdio::null()).output()?;
        let failure = (!output.status.success()).then(|| {
            let told = String::from_utf8_lossy(&output.stderr);
            let last = told.lines().last();
            last.unwrap_or("it ended without a reason").to_owned()
        });
        let ended = Ended {
            arguments: self.arguments.clone(),
            build: build.to_owned(),
            commit: env!("INPLACE_COMMIT").to_owned(),
            seconds: start.elapsed().as_secs_f64(),
            failure,
        };
        export::write_json(&record, &ended)?;
        Ok(ended)
    }
}

/// The measurements, in the order of the page.
fn steps(scenes: &[PathBuf], quick: bool) -> Vec<Step> {
    let step = |title: &str, folder: &str, page: &'static str, command: &str, scenes: &[PathBuf]| {
        let given = |scenes: &[PathBuf]| scenes.iter().map(|scene| scene.display().to_string()).collect();
        let arguments = command.split_whitespace().flat_map(|word| match word {
            "SCENES" => given(scenes),
            "FIRST" => given(&scenes[..1]),
            word => vec![word.to_owned()],
        });
        Step {
            title: title.to_owned(),
            folder: folder.to_owned(),
            page,
            arguments: arguments.collect(),
        }
    };
    let clicks = scenes.chunks(1).map(|own| {
        let name = SceneSource::from_argument(&own[0]).name();
        let (title, folder) = (format!("From a few clicks: {name}"), format!("clicks-{name}"));
        let command = if quick {
            "simulate SCENES --policy guided,random --clicks 1,3,5 --seeds 1 --geometry 5 --settle 0"
        } else {
            "simulate SCENES --policy guided,random,uniform --clicks 1,2,3,5,10 --seeds 3 --geometry 10 --settle 0"
        };
        step(&title, &folder, "results", command, own)
    });
    let benches = BENCHES.lines().filter_map(|line| {
        let mut cells = line.split('|').map(str::trim);
        let (title, folder, page) = (cells.next()?, cells.next()?, cells.next()?);
        let (whole, short) = (cells.next()?, cells.next()?);
        let options = if quick { short } else { whole };
        if options == "left out" {
            return None;
        }
        let command = format!("bench {page} {options}");
        Some(step(title, folder, page, &command, scenes))
    });
    clicks.chain(benches).collect()
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::Parser;

    use super::*;
    use crate::arguments::Arguments;

    #[test]
    fn every_measurement_is_a_command_of_this_program_with_a_folder_of_its_own() {
        for (quick, count) in [(false, 11), (true, 8)] {
            let steps = steps(&[PathBuf::from("demo"), PathBuf::from("/captures/room")], quick);
            let folders: BTreeSet<&str> = steps.iter().map(|step| step.folder.as_str()).collect();
            assert_eq!((folders.len(), steps.len()), (count, count));
            for step in &steps {
                let own = step.arguments.iter().map(String::as_str);
                let words = std::iter::once("inplace-lab").chain(own).chain(["--out", "DIR"]);
                let parsed = Arguments::try_parse_from(words);
                assert!(parsed.is_ok(), "{}: {parsed:?}", step.shown());
                assert!(!step.shown().contains("/captures"), "{}", step.shown());
            }
        }
    }

    #[test]
    fn headings_go_below_that_of_the_measurement() {
        assert_eq!(below("# Stability\n\nText.\n\n## demo"), "Text.\n\n### demo");
    }
}
