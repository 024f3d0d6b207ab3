//! `inplace-lab bench audit`, what finds wrong labels: sampled audits beside the true accuracy, and planted wrong strokes beside the list of
//! contradicted ones.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::Duration;

use rand::rngs::SmallRng;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng};
use serde::Serialize;

use super::arguments::AuditArguments;
use super::commands::begin;
use super::learnt::settle;
use super::page::Page;
use super::simulate::{Annotator, Policy};
use super::table::csv;
use super::{Failure, SceneTruth, mean, unusable_scene};
use inplace_core::export;
use inplace_core::guide::audit::{Accuracy, Audit, Verdict};
use inplace_core::labels::{ClassId, LabelSet, StrokeId, VOID};
use inplace_core::scene::{Scene, SceneSource};
use inplace_core::semantics::StrokeCheck;
use inplace_core::session::{Client, Command, Event, FrameMap, Progress, SessionOptions};

/// Most seconds of training before the maps are audited.
const TRAINING: Duration = Duration::from_secs(20);
/// An audit that is off by no more than this is good.
const GOOD: f64 = 0.03;
/// One stroke in so many is planted with a wrong class.
const PLANTED: usize = 10;

/// The columns of `audit.csv`.
const COLUMNS: &str = "scene clicks seed accuracy:4 frames places audits within_3:4 error:4 covered:4 half_width:4 \
                       planted listed listed_right missed";

/// How well audits of some labels predict their accuracy, and how many planted wrong strokes are listed.
#[derive(Clone, Debug, PartialEq, Serialize)]
struct AuditPoint {
    /// Name of the scene.
    scene: String,
    /// Random clicks for each class.
    clicks: usize,
    /// Seed of the clicks and the session.
    seed: u64,
    /// Share of the pixels with a class and a truth whose class is right.
    accuracy: f64,
    /// Frames that an audit draws from.
    frames: usize,
    /// Places of an audit.
    places: usize,
    /// Audits.
    audits: usize,
    /// Share of the audits within 3 points of the accuracy.
    within_3: f64,
    /// Root of the mean squared error of the audits.
    error: f64,
    /// Share of the audits whose 95% interval holds the accuracy.
    covered: f64,
    /// Mean half width of the interval.
    half_width: f64,
    /// Strokes that were given a wrong class.
    planted: usize,
    /// How many of them are listed as contradicted.
    listed: usize,
    /// How many of the others are listed, too.
    listed_right: usize,
    /// What was planted and is not listed: the class it should have, the one it got, and why it is not listed.
    missed: Vec<String>,
}

/// Measures every scene, writes `audit.csv`, and prints.
pub fn run(arguments: &AuditArguments) -> Result<(), Failure> {
    let out = &arguments.on.output.out;
    begin(out, &arguments.on.scenes)?;
    let mut points = Vec::new();
    let progress = Progress::default();
    for argument in &arguments.on.scenes {
        for &clicks in &arguments.clicks {
            for number in 0..arguments.seeds {
                let source = SceneSource::from_argument(argument);
                let mut options = arguments.on.training.session_options(source);
                options.seed = options.seed.wrapping_add(number);
                progress.show(format!(
                    "{}: {clicks} clicks, seed {}",
                    argument.display(),
                    options.seed
                ));
                let share = arguments.share / 100.0;
                points.push(audits(&options, clicks.into(), share, arguments.audits.into())?);
            }
        }
    }
    export::write(&out.join("audit.csv"), csv(&points, COLUMNS)?.as_bytes())?;
    page(&points)?.publish(&arguments.on.output, "audit", &points)
}

fn page(points: &[AuditPoint]) -> Result<Page, Failure> {
    let mut page = Page::default();
    page.paragraph(
        "Audits of the maps after random clicks of every class: the true accuracy, per cent of the audits within 3 points \
         of it, their root mean squared error in points, per cent whose 95% interval holds it, and half of its mean width \
         in points. Then one stroke in ten gets a wrong class: how many of those are listed as contradicted, and of the \
         others.",
    );
    page.means(
        points,
        "scene | clicks | seed | accuracy:1% | frames:0 | places:0 | within 3=within_3:0% | error:2% | covered:0% | \
         half width=half_width:1% | planted:0 | listed:0 | others listed=listed_right:0",
    )?;
    Ok(page)
}

/// Labels a scene with so many random clicks of every class, audits this share of its frames so many times with the truth
/// for answers, and then plants wrong classes.
///
/// # Errors
/// A scene without ground truth, and whatever stops a session.
fn audits(options: &SessionOptions, clicks: usize, share: f64, audits: usize) -> Result<AuditPoint, Failure> {
    let seed = options.seed;
    let mut run = Client::start(options.clone());
    let scene = run.opened()?;
    let truth = SceneTruth::read(&scene)?;
    let annotator = Annotator::new(&scene, &truth);
    let labels = annotator.labels(&annotator.clicks(Policy::Random, clicks, seed));
    run.label(labels.clone(), 1);
    settle(&mut run, 1, Some(TRAINING))?;
    run.send(Command::Pause);
    let maps: Vec<Arc<FrameMap>> = match run.all_maps(1) {
        Some(maps) => maps
            .iter()
            .map(|map| Arc::new(map.looked_up().into_owned()))
            .collect(),
        None => return Err(unusable_scene(&scene, "its maps are not complete")),
    };
    let truths: BTreeMap<usize, Vec<ClassId>> = truth
        .images
        .keys()
        .map(|&frame| (frame, truth.in_frame(&scene, frame)))
        .collect();
    let accuracy = accuracy(&maps, &truths);
    let map = |frame: usize| truths.contains_key(&frame).then(|| Arc::clone(&maps[frame]));
    let drawn = (0..audits as u64)
        .filter_map(|number| Audit::draw(&scene, &map, (share, seed.wrapping_add(number)), 0));
    let mut drawn: Vec<Audit> = drawn.collect();
    drawn.iter_mut().for_each(|audit| answer(audit, &scene, &truths));
    let told: Vec<Accuracy> = drawn.iter().filter_map(Audit::accuracy).collect();
    let held =
        |holds: &dyn Fn(&Accuracy) -> bool| mean(told.iter().map(|told| f64::from(u8::from(holds(told)))));
    let squared = mean(told.iter().map(|told| (told.share - accuracy).powi(2)));

    let (wrong, planted) = plant(&labels, &annotator, seed);
    let checks = checks(&mut run, wrong, 2)?;
    let is_listed = |id: &&StrokeId| checks.get(*id).is_some_and(StrokeCheck::is_contradicted);
    let right = labels.strokes.keys().filter(|id| !planted.contains_key(*id));
    let missed = planted.iter().filter(|(id, _)| !is_listed(id)).map(|(id, got)| {
        let why = match checks.get(id) {
            Some(check) => format!("{:.0}% contradicted", 100.0 * check.contradicting),
            None => "not checked".to_owned(),
        };
        format!("{} as {got}: {why}", labels.strokes[id].class)
    });
    Ok(AuditPoint {
        scene: scene.name(),
        clicks,
        seed,
        accuracy,
        frames: drawn.first().map_or(0, |audit| audit.frames.len()),
        places: drawn.first().map_or(0, |audit| audit.places.len()),
        audits: told.len(),
        within_3: held(&|told| (told.share - accuracy).abs() <= GOOD),
        error: squared.sqrt(),
        covered: held(&|told| (told.low..=told.high).contains(&accuracy)),
        half_width: mean(told.iter().map(|told| (told.high - told.low) / 2.0)),
        planted: planted.len(),
        listed: planted.keys().filter(is_listed).count(),
        listed_right: right.filter(is_listed).count(),
        missed: missed.collect(),
    })
}

/// Share of the pixels with a class and a truth whose class is right.
fn accuracy(maps: &[Arc<FrameMap>], truths: &BTreeMap<usize, Vec<ClassId>>) -> f64 {
    let (mut right, mut all) = (0, 0);
    for (&frame, truth) in truths {
        for (&class, &truth) in maps[frame].labels().iter().zip(truth) {
            let counts = class != VOID && truth != VOID;
            all += usize::from(counts);
            right += usize::from(counts && class == truth);
        }
    }
    right as f64 / all as f64
}

/// Judges every place by the truth; where that is void it cannot be told.
fn answer(audit: &mut Audit, scene: &Scene, truths: &BTreeMap<usize, Vec<ClassId>>) {
    for place in &mut audit.places {
        let stem = audit.frames[place.frame].stem.as_str();
        let frame = scene.frames.iter().position(|frame| frame.stem == stem);
        let Some((frame, truth)) = frame.and_then(|frame| Some((frame, truths.get(&frame)?))) else {
            continue;
        };
        let [x, y] = place.pixel;
        place.verdict = Some(match truth[(y * scene.frames[frame].camera.width + x) as usize] {
            VOID => Verdict::Skipped,
            class if class == place.class => Verdict::Right,
            _ => Verdict::Wrong,
        });
    }
}

/// The labels with a random wrong class for one stroke in ten, and which got which.
fn plant(labels: &LabelSet, annotator: &Annotator<'_>, seed: u64) -> (LabelSet, BTreeMap<StrokeId, ClassId>) {
    let mut rng = SmallRng::seed_from_u64(seed);
    let (mut wrong, mut planted) = (labels.clone(), BTreeMap::new());
    let first = rng.random_range(0..PLANTED);
    for (&id, stroke) in wrong.strokes.iter_mut().skip(first).step_by(PLANTED) {
        let others = annotator.classes().iter().filter(|&&class| class != stroke.class);
        let others: Vec<ClassId> = others.copied().collect();
        if let Some(&class) = others.choose(&mut rng) {
            Arc::make_mut(stroke).class = class;
            planted.insert(id, class);
        }
    }
    (wrong, planted)
}

/// The strokes of these labels checked against each other.
fn checks(
    run: &mut Client,
    labels: LabelSet,
    generation: u64,
) -> Result<BTreeMap<StrokeId, StrokeCheck>, Failure> {
    run.send(Command::CheckStrokes);
    run.label(labels, generation);
    let checks = run.wait(|event| match event {
        Event::StrokeChecks {
            generation: of,
            checks,
            ..
        } if *of == generation => Some(checks.clone()),
        _ => None,
    })?;
    Ok(checks.into_iter().map(|check| (check.stroke, check)).collect())
}
