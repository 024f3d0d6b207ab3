//! `inplace-lab bench all`: all measurements, one after the other, on one page that begins with ten lines and two charts.

mod charts;
mod summary;

use std::collections::BTreeMap;
use std::fs;
use std::io;
use std::path::Path;
use std::process::Command;
use std::time::Instant;

use inplace_core::export;
use inplace_core::scene::{OpenOptions, Scene, SceneSource};
use inplace_core::session::Progress;
use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::{Failure, begin, counted, machine};
use crate::SceneTruth;
use crate::arguments::AllArguments;
use crate::page::Page;

/// The folder of the measurements' own files, beside the page.
const FOLDER: &str = "benchmarks";

/// The measurements: title, folder, command, and its short form. Words in capitals are captures, see [`chosen`]; what has none is left
/// out, and a folder that ends with NAME is one for each.
const STEPS: &str = "\
From a few clicks: NAME | clicks-NAME | simulate TRUTH --policy guided,random --clicks 1,2,3,5,10 --seeds 3 --geometry 10 --settle 0 | simulate TRUTH --policy guided,random --clicks 1,3,5 --seeds 1 --geometry 5 --settle 0
From a few clicks, without depth | no-depth-clicks | simulate ROOM --no-depth --policy guided,random --clicks 1,5,10 --seeds 3 --geometry 60 --settle 0 | left out
Other methods on the same clicks: NAME | beside-NAME | simulate TRUTH --policy random --clicks 5 --seeds 1 --geometry 10 --settle 0 --baselines | simulate TRUTH --policy random --clicks 5 --seeds 1 --geometry 5 --settle 0 --baselines
A real capture's own clicks: NAME | own-NAME | simulate OWN --policy own --clicks 1,3 --seeds 1 --geometry 20 --settle 0 --baselines | simulate OWN --policy own --clicks 1,3 --seeds 1 --geometry 10 --settle 0
Objects: NAME | objects-NAME | simulate OBJECTS --objects --policy guided,random --clicks 1,2,3 --seeds 1 --geometry 10 | simulate OBJECTS --objects --policy guided --clicks 1 --seeds 1 --geometry 5
Accuracy against time | pareto | bench pareto DEPTH --preset fast,auto,accurate --seeds 1 --marks 2,5,10 | bench pareto DEPTH --preset fast,auto --seeds 1 --marks 2,5
Accuracy against time, without depth | pareto-no-depth | bench pareto ALL --no-depth --preset auto --seeds 1 --marks 10,20,40 | bench pareto ROOM --no-depth --preset auto --seeds 1 --marks 10,20
Without depth: stereo and the field alone | alone | bench pareto ROOM --no-depth --preset auto --alone --seeds 1 --marks 10,20,40 | left out
Accuracy against size | capacity | bench pareto FIRST --preset auto --capacity --seeds 1 --marks 8 | left out
How long a click waits | latency | bench latency TRUTH --clicks 100 | bench latency TRUTH --clicks 50
How cost grows | scale | bench scale --frames 20,50,100,200,500,1000 --sizes 160x120,320x240,640x480 --classes 2,20,200 --strokes 1,100,10000 --seconds 2 | bench scale --sweep frames,strokes --frames 20,50,100 --strokes 10,100,1000 --seconds 2
Label images: the paper's experiments | paper | bench paper TRUTH --seconds 20 | bench paper TRUTH --seconds 5 --experiments frames-10%,pixel-noise-90%,sparse-16,click,grown-1%
Label images, without depth | paper-no-depth | bench paper TRUTH --no-depth --seconds 90 | left out
The semantic field | field | bench field ROOM --geometry 15 --noise 90 --marks 1,5,10 --stride 8 | left out
The semantic field, without depth | field-no-depth | bench field ROOM --no-depth --geometry 40 --noise 90 --marks 1,5,10 --stride 8 | left out
Audits | audit | bench audit TRUTH --clicks 5 --seeds 1 | left out
Depth from colours alone | stereo | bench stereo DEPTH | bench stereo FIRST
The engine | engine | bench engine DEPTH --rounds 10 --marks 5,15 | bench engine FIRST --rounds 5 --marks 5
Stability | stability | bench stability --seeds 2 | bench stability --quick --seeds 1";

/// A capture, and what it can be measured with.
#[derive(Clone, Debug)]
struct Capture {
    /// As it was given.
    argument: String,
    name: String,
    /// Frames with their size, for people.
    frames: String,
    /// Frames that are measured on.
    test: usize,
    /// Whether its training frames have label images; if not, it has clicks of its own.
    truth: bool,
    /// Whether it has measured depth.
    depth: bool,
    /// Whether its objects are known.
    objects: bool,
}

impl Capture {
    fn of(argument: &Path) -> Result<Self, Failure> {
        let source = SceneSource::from_argument(argument);
        // Of its images the sizes are enough.
        let options = OpenOptions {
            image_bytes: 0,
            ..OpenOptions::default()
        };
        let scene = Scene::open(&source, options, &|_, _| {})?;
        let truth = SceneTruth::read_or_clicks(&scene)?;
        let size = scene.frames.first().map(|frame| frame.image());
        let size = size.map_or_else(String::new, |size| {
            format!(" of {} x {}", size.width, size.height)
        });
        Ok(Self {
            argument: argument.display().to_string(),
            name: scene.name(),
            frames: format!("{}{size}", scene.frames.len()),
            test: truth.test.len(),
            truth: !truth.train.is_empty(),
            depth: scene.has_depth(),
            objects: match &source {
                SceneSource::Demo => true,
                SceneSource::Folder(folder) => folder.join("objects.json").is_file(),
            },
        })
    }
}

/// The captures that a word of a command stands for: those with label images to click on, with clicks of their own, with
/// measured depth, with known objects, or all; FIRST is the first to click on, and ROOM the first that is not the demo, if
/// there is one. `None` of every other word.
fn chosen<'a>(word: &str, captures: &'a [Capture]) -> Option<Vec<&'a Capture>> {
    let all = captures.iter();
    let mut clickable = captures.iter().filter(|capture| capture.truth);
    Some(match word {
        "ALL" => all.collect(),
        "TRUTH" => clickable.collect(),
        "OWN" => all.filter(|capture| !capture.truth).collect(),
        "DEPTH" => all.filter(|capture| capture.depth).collect(),
        "OBJECTS" => clickable.filter(|capture| capture.objects).collect(),
        "FIRST" => clickable.take(1).collect(),
        "ROOM" => {
            let first = clickable.clone().next();
            let room = clickable.find(|capture| capture.argument != "demo");
            room.or(first).into_iter().collect()
        }
        _ => return None,
    })
}

/// One measurement: a command of this program.
struct Step {
    title: String,
    /// Its folder.
    folder: String,
    /// Its arguments, without `--json` and `--out`.
    arguments: Vec<String>,
}

/// What a measurement was and how it ended, `step.json` in its folder.
#[derive(Debug, PartialEq, Serialize, Deserialize)]
struct Ended {
    arguments: Vec<String>,
    /// SHA-256 of the program.
    build: String,
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
    let captures = arguments.scenes.iter().map(|scene| Capture::of(scene));
    let captures = captures.collect::<Result<Vec<Capture>, Failure>>()?;
    let steps = steps(&captures, arguments.quick);
    let build = export::digest(&[std::env::current_exe()?])?;
    let form = if arguments.quick { " --quick" } else { "" };
    let (mut failed, mut seconds) = (Vec::new(), 0.0);
    let mut results: BTreeMap<String, Value> = BTreeMap::new();
    let mut sections = Page::default();
    let progress = Progress::default();
    for (number, step) in steps.iter().enumerate() {
        let (count, words) = (steps.len(), step.arguments.join(" "));
        progress.show_share(format!("inplace-lab {words}"), number as f32 / count as f32);
        let ended = step.measure(&folder.join(&step.folder), &build, arguments.force)?;
        step.describe(&mut sections, &folder, &ended);
        if ended.failure.is_some() {
            failed.push(step.folder.clone());
        }
        // What failed early has printed nothing.
        let result = fs::read(folder.join(&step.folder).join("result.json")).ok();
        if let Some(result) = result.and_then(|text| serde_json::from_slice(&text).ok()) {
            results.insert(step.folder.clone(), result);
        }
        seconds += ended.seconds;
        // What has been measured stays readable if a later measurement is interrupted.
        let mut page = Page::default();
        page.heading(1, "Benchmarks");
        page.paragraph(&format!(
            "Written by `inplace-lab bench all{form}` in {:.0} minutes: {} of one build, [each](measuring.md) with its command. {}",
            seconds / 60.0,
            counted(number as u64 + 1, "measurement"),
            machine()
        ));
        page.list(&summary::lines(&results));
        charts::add(&mut page, &results, &captures, &folder)?;
        page.table(
            "scene | frames | depth | clicks | measured on | objects",
            &captures.iter().map(row).collect::<Vec<_>>(),
        );
        page.paragraph(sections.as_str().trim_end());
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

/// What a capture is.
fn row(capture: &Capture) -> Vec<String> {
    let word = |is: bool, yes: &str, no: &str| if is { yes } else { no }.to_owned();
    vec![
        capture.name.clone(),
        capture.frames.clone(),
        word(capture.depth, "measured", "none"),
        word(capture.truth, "simulated on training frames", "its own"),
        counted(capture.test as u64, "other frame"),
        word(capture.objects, "known", "-"),
    ]
}

impl Step {
    /// The page that it writes, without the extension.
    fn page(&self) -> &str {
        let objects = || self.arguments.iter().any(|argument| argument == "--objects");
        match self.arguments.as_slice() {
            [bench, protocol, ..] if bench == "bench" => protocol,
            _ if objects() => "objects",
            _ => "results",
        }
    }

    /// Its command, with captures by their names.
    fn shown(&self) -> String {
        let name = |argument: &String| {
            let path = Path::new(argument);
            let file = path.file_name().filter(|_| path.components().count() > 1);
            file.map_or_else(|| argument.clone(), |name| name.to_string_lossy().into_owned())
        };
        self.arguments.iter().map(name).collect::<Vec<String>>().join(" ")
    }

    /// Adds what it found: its page, of a long one what comes before the first heading.
    fn describe(&self, page: &mut Page, folder: &Path, ended: &Ended) {
        page.heading(2, &self.title);
        page.paragraph(&format!("    inplace-lab {} --out DIR", self.shown()));
        let own = format!("{FOLDER}/{}", self.folder);
        let file = format!("{}.md", self.page());
        let text = fs::read_to_string(folder.join(&self.folder).join(&file)).unwrap_or_default();
        let begins = |line: &&str| !line.starts_with("## ");
        let lines: Vec<&str> = text.lines().filter(|line| !line.starts_with("# ")).collect();
        let first: Vec<&str> = lines.iter().copied().take_while(begins).collect();
        page.include(first.join("\n").trim(), &own);
        if first.len() < lines.len() {
            page.paragraph(&format!("All of it: [{file}]({own}/{file})."));
        }
        if let Some(reason) = &ended.failure {
            let reason = reason.trim_start_matches("inplace-lab: ");
            page.paragraph(&format!("**Failed:** {reason}."));
        }
        page.paragraph(&format!("[Files]({own}); {:.0} s.", ended.seconds));
    }

    /// Measures in a process of its own, unless this build has done that here before.
    fn measure(&self, out: &Path, build: &str, force: bool) -> Result<Ended, Failure> {
        let (record, page) = (out.join("step.json"), out.join(format!("{}.md", self.page())));
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
        command.args(&self.arguments).args(["--json", "--out"]).arg(out);
        let output = command.output()?;
        export::write(&out.join("result.json"), &output.stdout)?;
        let failure = (!output.status.success()).then(|| {
            let told = String::from_utf8_lossy(&output.stderr);
            let last = told.lines().last();
            last.unwrap_or("it ended without a reason").to_owned()
        });
        let ended = Ended {
            arguments: self.arguments.clone(),
            build: build.to_owned(),
            seconds: start.elapsed().as_secs_f64(),
            failure,
        };
        export::write_json(&record, &ended)?;
        Ok(ended)
    }
}

/// The measurements, in the order of the page.
fn steps(captures: &[Capture], quick: bool) -> Vec<Step> {
    let mut steps = Vec::new();
    for line in STEPS.lines() {
        let cells: Vec<&str> = line.split(" | ").collect();
        let &[title, folder, whole, short] = cells.as_slice() else {
            continue;
        };
        let command = if quick { short } else { whole };
        let own = command.split(' ').find_map(|word| chosen(word, captures));
        let groups: Vec<Vec<&Capture>> = match own {
            _ if command == "left out" => continue,
            None => vec![Vec::new()],
            Some(own) if folder.ends_with("NAME") => own.into_iter().map(|one| vec![one]).collect(),
            Some(own) if own.is_empty() => continue,
            Some(own) => vec![own],
        };
        for group in groups {
            let named = |text: &str| match group.first() {
                Some(first) => text.replace("NAME", &first.name),
                None => text.to_owned(),
            };
            let arguments = command.split(' ').flat_map(|word| match chosen(word, captures) {
                Some(_) => group.iter().map(|capture| capture.argument.clone()).collect(),
                None => vec![word.to_owned()],
            });
            steps.push(Step {
                title: named(title),
                folder: named(folder),
                arguments: arguments.collect(),
            });
        }
    }
    steps
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use clap::Parser;

    use super::*;
    use crate::arguments::Arguments;

    fn capture(argument: &str, truth: bool, depth: bool) -> Capture {
        Capture {
            argument: argument.to_owned(),
            name: argument.rsplit('/').next().unwrap().to_owned(),
            frames: String::new(),
            test: 1,
            truth,
            depth,
            objects: truth,
        }
    }

    #[test]
    fn every_measurement_is_a_command_of_this_program_with_a_folder_of_its_own() {
        let captures = [
            capture("demo", true, true),
            capture("/captures/room", true, true),
            capture("/captures/photos", false, false),
        ];
        for (quick, count) in [(false, 22), (true, 15)] {
            let steps = steps(&captures, quick);
            let folders: BTreeSet<&str> = steps.iter().map(|step| step.folder.as_str()).collect();
            assert_eq!((folders.len(), steps.len()), (count, count));
            for step in &steps {
                let own = step.arguments.iter().map(String::as_str);
                let words = std::iter::once("inplace-lab")
                    .chain(own)
                    .chain(["--json", "--out", "DIR"]);
                let parsed = Arguments::try_parse_from(words);
                assert!(parsed.is_ok(), "{}: {parsed:?}", step.shown());
                assert!(!step.shown().contains("/captures"), "{}", step.shown());
            }
        }
    }

    #[test]
    fn a_capture_is_measured_with_what_it_has() {
        let photos = [capture("/captures/photos", false, false)];
        let folders: Vec<String> = steps(&photos, false)
            .into_iter()
            .map(|step| step.folder)
            .collect();
        assert_eq!(folders, ["own-photos", "pareto-no-depth", "scale", "stability"]);
        let demo = [capture("demo", true, true)];
        assert_eq!(chosen("ROOM", &demo).unwrap()[0].name, "demo");
    }
}
