//! `inplace-lab bench stability`: what such methods fail at.

use std::collections::BTreeSet;
use std::sync::Arc;

use crate::stability::{Condition, Outcome, conditions, stability, table};
use inplace_core::export;
use inplace_core::field::Preset;
use inplace_core::scene::{Scene, SceneSource};

use super::{Failure, begin, grouped, processor};
use crate::arguments::StabilityArguments;
use crate::page::Page;
use inplace_core::session::Progress;

/// Tries the conditions on every scene, writes `stability.csv` and `stability.md`, and prints.
pub fn run(arguments: &StabilityArguments) -> Result<(), Failure> {
    let training = &arguments.training;
    if training.preset == Preset::Reference {
        return Err("the published network has no maps while it trains; leave --preset away".into());
    }
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
        let ended = |outcome: &Outcome| {
            if !outcome.is_met() {
                eprintln!("{}", missed(outcome));
            }
        };
        let tried = stability(&scene, &wanted, arguments, &mut begins, &ended)?;
        outcomes.extend(tried);
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

fn missed(outcome: &Outcome) -> String {
    let mut sentence = format!(
        "{}, {} with seed {}: {}, below its line of {:.3}",
        outcome.scene,
        outcome.condition,
        outcome.seed,
        number(outcome.figure),
        outcome.line
    );
    for told in &outcome.told {
        sentence += &format!("; {told}");
    }
    sentence
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

/// What is tried and what came of it: docs/stability.md.
fn page(arguments: &StabilityArguments, outcomes: &[Outcome]) -> Page {
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
