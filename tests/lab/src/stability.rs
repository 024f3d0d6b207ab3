//! `inplace-lab bench stability`, the places where methods of this kind fail: each condition disturbs a scene, its labels or the session itself, and
//! has a line that its figure must reach.

mod capture;
mod depth;
mod images;
mod labels;
mod objects;
mod poses;
mod rooms;
mod session;
mod trial;

use std::collections::BTreeSet;
use std::rc::Rc;
use std::sync::Arc;
use std::time::Instant;

use rand::{SeedableRng, rngs::SmallRng};
use serde::Serialize;

use trial::{Measured, Trial};

use super::commands::{begin, grouped, processor};
use super::page::Page;
use super::table::csv;
use super::{Failure, SceneTruth, unusable_scene};
use crate::arguments::StabilityArguments as Settings;
use inplace_core::export;
use inplace_core::scene::{Scene, SceneSource};
use inplace_core::session::Progress;

/// What a figure must be, at least.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Line {
    /// This.
    Least(f64),
    /// This share of what the undisturbed scene gives with the same seed.
    OfClean(f64),
    /// This share of what the undisturbed scene gives without depth, with the same seed.
    OfCleanWithoutDepth(f64),
}

type Disturb = dyn Fn(&mut Trial, &Settings, &mut SmallRng) -> Result<(), Failure>;

/// How a condition is tried.
#[derive(Clone)]
enum Way {
    /// Something is disturbed, and the scene is labelled as ever.
    Disturb(Rc<Disturb>),
    /// A course of its own, with its figure.
    Course(fn(&Trial, &Settings, &mut SmallRng) -> Result<Measured, Failure>),
}

/// One place where such methods fail.
#[derive(Clone)]
pub struct Condition {
    /// Its name in the results.
    pub name: &'static str,
    /// What is disturbed, and how, for people.
    pub what: &'static str,
    /// What the program does about it, for people.
    pub answer: &'static str,
    /// What the figure must be.
    pub line: Line,
    /// What is still wrong, and why, for people; empty where there is nothing to say.
    pub limit: &'static str,
    /// Whether it belongs to the short form of the suite.
    pub quick: bool,
    /// Whether it is tried with the demo alone: a room of its own takes the demo's place.
    pub demo_only: bool,
    way: Way,
}

/// The figure of a condition with one seed.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Outcome {
    /// Name of the scene.
    pub scene: String,
    /// Name of the condition.
    pub condition: &'static str,
    /// Seed of the disturbance, the clicks and the field.
    pub seed: u64,
    /// The figure; `None` where the run failed.
    pub figure: Option<f64>,
    /// What it must be at least.
    pub line: f64,
    /// What the program told the person meanwhile, sentences; or why the run failed.
    pub told: Vec<String>,
    /// Wall seconds.
    pub wall_s: f64,
}

impl Outcome {
    /// Whether the figure reaches its line.
    pub fn is_met(&self) -> bool {
        self.figure.is_some_and(|figure| figure >= self.line)
    }
}

/// Names of the undisturbed conditions, which others are compared with.
const CLEAN: &str = "clean";
const CLEAN_WITHOUT_DEPTH: &str = "clean-no-depth";

/// A condition in which the scene is disturbed and then labelled.
fn disturbed(
    name: &'static str,
    what: &'static str,
    answer: &'static str,
    line: Line,
    disturb: impl Fn(&mut Trial, &mut SmallRng) + 'static,
) -> Condition {
    let way = Way::Disturb(Rc::new(move |trial, _, rng| {
        disturb(trial, rng);
        Ok(())
    }));
    Condition::new(name, what, answer, line, way)
}

impl Condition {
    fn new(name: &'static str, what: &'static str, answer: &'static str, line: Line, way: Way) -> Self {
        Self {
            name,
            what,
            answer,
            line,
            limit: "",
            quick: false,
            demo_only: false,
            way,
        }
    }

    /// What its figure is: the mIoU of the label maps of the test frames, or the share of what was there, or is right,
    /// that is so in the end.
    pub fn figure(&self) -> &'static str {
        match self.way {
            Way::Disturb(_) => "mIoU",
            Way::Course(_) => "share",
        }
    }

    fn limited_by(self, limit: &'static str) -> Self {
        Self { limit, ..self }
    }

    fn in_short(self) -> Self {
        Self { quick: true, ..self }
    }
}

/// All conditions, the undisturbed ones first.
pub fn conditions() -> Vec<Condition> {
    let mut all = vec![
        disturbed(
            CLEAN,
            "nothing is disturbed",
            "makes the surface from the depth at once, and spreads the labels along it",
            Line::Least(0.6),
            |_, _| {},
        )
        .in_short(),
        disturbed(
            CLEAN_WITHOUT_DEPTH,
            "nothing is disturbed, colours alone",
            "learns the surface with the field, and moves the labels to each better one",
            Line::Least(0.4),
            |trial, _| trial.without_depth(),
        ),
    ];
    all.extend(capture::conditions());
    all.extend(images::conditions());
    all.extend(poses::conditions());
    all.extend(depth::conditions());
    all.extend(labels::conditions());
    all.extend(objects::conditions());
    all.extend(session::conditions());
    all.extend(rooms::conditions());
    all
}

/// Tries conditions on a scene with seeds that count up, those of the demo alone on that only; `begins` is told of each run
/// before it, by condition and seed.
///
/// # Errors
/// A scene without ground truth, or with nothing to try on it. A run that fails is an outcome without a figure.
pub fn stability(
    scene: &Arc<Scene>,
    conditions: &[Condition],
    settings: &Settings,
    begins: &mut dyn FnMut(&str, u64),
) -> Result<Vec<Outcome>, Failure> {
    let truth = SceneTruth::read(scene)?;
    let mut outcomes: Vec<Outcome> = Vec::new();
    let conditions = tried_on(scene, conditions)?;
    for condition in needed(&conditions) {
        for run in 0..settings.seeds {
            let mut settings = settings.clone();
            let seed = &mut settings.training.reading.seed;
            *seed = seed.wrapping_add(run);
            begins(condition.name, *seed);
            outcomes.push(tried(scene, &truth, &condition, &settings, &outcomes));
        }
    }
    Ok(outcomes)
}

/// Those of the conditions that are tried on this scene.
fn tried_on(scene: &Scene, conditions: &[Condition]) -> Result<Vec<Condition>, Failure> {
    let is_demo = scene.source == SceneSource::Demo;
    let all = conditions.iter().cloned();
    let tried: Vec<Condition> = all.filter(|condition| is_demo || !condition.demo_only).collect();
    if tried.is_empty() && !conditions.is_empty() {
        let rooms = "these conditions are rooms of their own in place of the demo; try them on \"demo\"";
        return Err(unusable_scene(scene, rooms));
    }
    Ok(tried)
}

/// These conditions, and before them the undisturbed ones that their lines need.
fn needed(conditions: &[Condition]) -> Vec<Condition> {
    let chosen = |name: &str| conditions.iter().any(|condition| condition.name == name);
    let needs = |name: &str| {
        conditions.iter().any(|condition| match condition.line {
            Line::Least(_) => false,
            Line::OfClean(_) => name == CLEAN,
            Line::OfCleanWithoutDepth(_) => name == CLEAN_WITHOUT_DEPTH,
        })
    };
    let mut all = self::conditions();
    all.retain(|condition| chosen(condition.name) || needs(condition.name));
    all
}

fn tried(
    scene: &Arc<Scene>,
    truth: &SceneTruth,
    condition: &Condition,
    settings: &Settings,
    before: &[Outcome],
) -> Outcome {
    let start = Instant::now();
    let seed = settings.training.reading.seed;
    // Every condition has random numbers of its own, whichever others are tried.
    let own = condition.name.bytes().fold(seed, |hash, byte| {
        (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3)
    });
    let mut rng = SmallRng::seed_from_u64(own);
    let mut trial = Trial::new(scene, truth, seed);
    let measured = match &condition.way {
        Way::Disturb(disturb) => {
            disturb(&mut trial, settings, &mut rng).and_then(|()| trial.labelled(settings))
        }
        Way::Course(course) => course(&trial, settings, &mut rng),
    };
    let (figure, told) = match measured {
        Ok((figure, told)) => (Some(figure), told),
        Err(error) => (None, vec![error.to_string()]),
    };
    Outcome {
        scene: scene.name(),
        condition: condition.name,
        seed,
        figure,
        line: least(condition.line, seed, before),
        told,
        wall_s: start.elapsed().as_secs_f64(),
    }
}

/// The least figure by a line; infinite where what it is compared with failed.
fn least(line: Line, seed: u64, before: &[Outcome]) -> f64 {
    let clean = |name: &str, share: f64| {
        let same = |outcome: &&Outcome| outcome.condition == name && outcome.seed == seed;
        let same = before.iter().find(same);
        let figure = same.and_then(|outcome| outcome.figure);
        figure.map_or(f64::INFINITY, |figure| share * figure)
    };
    match line {
        Line::Least(least) => least,
        Line::OfClean(share) => clean(CLEAN, share),
        Line::OfCleanWithoutDepth(share) => clean(CLEAN_WITHOUT_DEPTH, share),
    }
}

/// The outcomes as comma-separated values, `stability.csv`.
pub fn table(outcomes: &[Outcome]) -> serde_json::Result<String> {
    let row = |outcome: &Outcome| {
        let mut row = serde_json::to_value(outcome)?;
        // JSON has no infinite line.
        row["line"] = format!("{:.4}", outcome.line).into();
        row["met"] = outcome.is_met().into();
        Ok(row)
    };
    csv(
        &outcomes.iter().map(row).collect::<serde_json::Result<Vec<_>>>()?,
        "scene condition seed figure:4 line met wall_s:2 told",
    )
}

/// Tries the conditions on every scene, writes `stability.csv` and `stability.md`, and prints.
pub fn run(arguments: &Settings) -> Result<(), Failure> {
    let training = &arguments.training;
    let out = &arguments.output.out;
    begin(out, &arguments.scenes)?;
    let wanted = |condition: &Condition| {
        if arguments.conditions.is_empty() {
            condition.quick || !arguments.quick
        } else {
            arguments.conditions.iter().any(|name| name == condition.name)
        }
    };
    let wanted: Vec<Condition> = conditions().into_iter().filter(wanted).collect();
    let mut outcomes = Vec::new();
    for argument in &arguments.scenes {
        let source = SceneSource::from_argument(argument);
        let scene = Arc::new(Scene::open(&source, training.reading.open_options(), &|_, _| {})?);
        let progress = Progress::default();
        let mut begins = |name: &str, seed| {
            progress.show(format!("{}, seed {seed}: {name}", argument.display()));
        };
        outcomes.extend(stability(&scene, &wanted, arguments, &mut begins)?);
    }
    export::write(&out.join("stability.csv"), table(&outcomes)?.as_bytes())?;
    page(arguments, &outcomes).publish(&arguments.output, "stability", &outcomes)?;
    let failed = rows(&outcomes).into_iter().filter(|row| !row.is_met);
    let failed: Vec<&str> = failed.map(|row| row.condition.name).collect();
    if failed.is_empty() {
        Ok(())
    } else {
        Err(format!("conditions missed their line: {}", failed.join(", ")).into())
    }
}

fn number(figure: Option<f64>) -> String {
    figure.map_or("failed".to_owned(), |figure| format!("{figure:.3}"))
}

/// A condition on a scene, over the seeds.
struct Row<'a> {
    scene: &'a str,
    condition: Condition,
    mean: Option<f64>,
    worst: Option<f64>,
    /// The mean of the lines, which differ by seed where they are shares.
    line: f64,
    is_met: bool,
    told: BTreeSet<&'a str>,
}

/// The line counts for the mean over the seeds, and every run has to end.
fn rows(outcomes: &[Outcome]) -> Vec<Row<'_>> {
    let known = conditions();
    let mut rows = Vec::new();
    for ((scene, name), runs) in grouped(outcomes, |own| (own.scene.as_str(), own.condition)) {
        let Some(condition) = known.iter().find(|condition| condition.name == name) else {
            continue;
        };
        let figures: Option<Vec<f64>> = runs.iter().map(|run| run.figure).collect();
        let mean = figures.clone().map(crate::mean);
        let line = crate::mean(runs.iter().map(|run| run.line));
        let told = runs.iter().flat_map(|run| &run.told);
        rows.push(Row {
            scene,
            condition: condition.clone(),
            mean,
            worst: figures.map(|figures| figures.into_iter().fold(f64::INFINITY, f64::min)),
            line,
            is_met: mean.is_some_and(|mean| mean >= line),
            told: told.map(String::as_str).collect(),
        });
    }
    rows
}

/// What is tried and what came of it.
fn page(arguments: &Settings, outcomes: &[Outcome]) -> Page {
    let reading = &arguments.training.reading;
    let mut page = Page::default();
    page.heading(1, "Stability");
    page.paragraph(
        "Where methods of this kind fail. Each condition disturbs a scene, its labels or the session itself, in a way \
         that its seed decides; then a session labels the scene from five random clicks a class, unless the condition \
         says otherwise. Every run has to end, and to measure numbers; its figure, the mean over the seeds, has to \
         reach the line. *mIoU* is that of the test frames; *share* is the part of what was there, or is right, that \
         is so in the end. Lines of mIoU are shares of what the undisturbed scene gives with the same seed, or numbers \
         where there is nothing to compare with.",
    );
    page.paragraph(&format!(
        "{}, {} threads; seeds {} to {}; {} s of training at most with depth, {} s without, {} s where it is long.",
        processor(),
        reading.threads(),
        reading.seed,
        reading.seed.wrapping_add(arguments.seeds - 1),
        arguments.seconds,
        arguments.seconds_without_depth,
        arguments.long_seconds
    ));
    let rows = rows(outcomes);
    let missed: Vec<&Row<'_>> = rows.iter().filter(|row| !row.is_met).collect();
    page.paragraph(&match missed.len() {
        0 => "Every line is met.".to_owned(),
        count => {
            let names = missed
                .iter()
                .map(|row| format!("{} ({})", row.condition.name, row.scene));
            let names = names.collect::<Vec<String>>().join(", ");
            let (met, all) = (rows.len() - count, rows.len());
            format!("{met} of {all} lines are met; missed: {names}.")
        }
    });
    for (scene, rows) in grouped(&rows, |row| row.scene) {
        page.heading(2, scene);
        let cells = rows.iter().map(|row| {
            vec![
                row.condition.name.to_owned(),
                row.condition.what.to_owned(),
                row.condition.figure().to_owned(),
                number(row.mean),
                number(row.worst),
                format!("{:.3}", row.line),
                if row.is_met { "met" } else { "**missed**" }.to_owned(),
            ]
        });
        let header = "condition | what happens | figure | mean | worst | line | ";
        page.table(header, &cells.collect::<Vec<_>>());
    }
    page.heading(2, "What the program does");
    let cells = grouped(&rows, |row| row.condition.name).into_iter();
    let cells = cells.map(|(name, rows)| {
        let told: BTreeSet<&str> = rows.iter().flat_map(|row| row.told.iter().copied()).collect();
        let condition = &rows[0].condition;
        vec![
            name.to_owned(),
            condition.answer.to_owned(),
            Vec::from_iter(told).join("; "),
            condition.limit.to_owned(),
        ]
    });
    let header = "condition | what it does | what it tells | what remains";
    page.table(header, &cells.collect::<Vec<_>>());
    page
}

#[cfg(test)]
mod tests;
