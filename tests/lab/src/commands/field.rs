//! `inplace-lab bench field`: the labels that the semantic field renders, beside those of the surface.

use crate::chart::{Axis, Figure, Panel, Point, Scale, Series};
use crate::field::{COLUMNS, FieldPoint, marks, semantic_field};
use crate::table::csv;
use inplace_core::arguments::TrainingArguments;
use inplace_core::export;
use inplace_core::field::Preset;
use inplace_core::scene::SceneSource;

use super::{Failure, begin, counted, grouped};
use crate::arguments::FieldArguments;
use crate::page::{Page, known};
use inplace_core::session::Progress;

/// Measures every scene, writes `field.csv` and `field.svg`, and prints.
pub fn run(arguments: &FieldArguments) -> Result<(), Failure> {
    if arguments.on.training.preset == Preset::Reference {
        return Err("the published network learns labels and colours at once; leave --preset away".into());
    }
    let out = &arguments.on.output.out;
    begin(out, &arguments.on.scenes)?;
    let marks = marks(arguments);
    let threads = arguments.on.training.reading.threads();
    let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
    let mut points = Vec::new();
    for argument in &arguments.on.scenes {
        for run in 0..arguments.seeds {
            let source = SceneSource::from_argument(argument);
            let mut session = arguments.on.training.session_options(source);
            session.seed = session.seed.wrapping_add(run);
            let seed = session.seed;
            let measured = pool.install(|| {
                let progress = Progress::default();
                semantic_field(arguments, session, &mut |what| {
                    progress.show(format!("{}, seed {seed}: {what}", argument.display()));
                })
            });
            points.extend(measured?);
        }
    }
    export::write(&out.join("field.csv"), csv(&points, COLUMNS)?.as_bytes())?;
    figure(arguments, threads, &marks, &points).write(&out.join("field.svg"))?;
    page(&marks, &points).publish(&arguments.on.output, "field", &points)
}

/// The points of one answer at a time; those that do not change are there at all times.
fn at<'a>(own: &'a [&FieldPoint], answer: &'a str, mark: f64) -> impl Iterator<Item = f64> + 'a {
    own.iter()
        .filter(move |point| point.answer == answer && (point.seconds.is_nan() || point.seconds == mark))
        .map(|point| point.miou)
}

/// A row for each answer, a column for each time: medians over the seeds.
fn page(marks: &[f64], points: &[FieldPoint]) -> Page {
    let mut page = Page::default();
    page.paragraph("mIoU on the test frames against the seconds since the labels: medians over the seeds.");
    let mut rows = Vec::new();
    for ((scene, labels), own) in grouped(points, |point| (point.scene.clone(), point.labels.clone())) {
        for (answer, _) in grouped(&own, |point| point.answer) {
            let median = |&mark: &f64| {
                let median = Point::of_values(mark, at(&own, answer, mark));
                known(median.map(|point| point.y), 3)
            };
            let mut row = vec![scene.clone(), labels.clone(), answer.to_owned()];
            row.extend(marks.iter().map(median));
            rows.push(row);
        }
    }
    let times: String = marks.iter().map(|mark| format!(" | {mark} s")).collect();
    page.table(&format!("scene | labels | answer{times}"), &rows);
    page.chart("What the semantic field renders", "field.svg");
    page
}

/// A row of panels for each scene, one for each kind of labels; a line for each answer.
fn figure(arguments: &FieldArguments, threads: usize, marks: &[f64], points: &[FieldPoint]) -> Figure {
    let panel = |scene: &str, labels: &str, own: &[&FieldPoint]| {
        let series = grouped(own.iter().copied(), |point| point.answer).into_iter();
        let point = |answer, mark: f64| Point::of_values(mark, at(own, answer, mark));
        let series = series
            .map(|(answer, _)| Series::new(answer, marks.iter().filter_map(|&mark| point(answer, mark))));
        Panel::new(
            format!("{scene}, {labels}"),
            Axis::new("seconds since the last label", Scale::Logarithmic),
            Axis::new("mIoU on the test frames", Scale::Linear),
            series.collect(),
        )
    };
    let TrainingArguments { preset, reading } = &arguments.on.training;
    Figure {
        title: "What the semantic field renders, beside what the surface says".to_owned(),
        subtitle: format!(
            "{}{} preset, {threads} threads; median and range over {} from {}; every {} pixels along each axis",
            if reading.no_depth { "without depth; " } else { "" },
            preset.name(),
            counted(arguments.seeds, "seed"),
            reading.seed,
            arguments.stride,
        ),
        rows: grouped(points, |point| point.scene.clone())
            .into_iter()
            .map(|(scene, own)| {
                let labels = grouped(own, |point| point.labels.clone()).into_iter();
                labels.map(|(labels, own)| panel(&scene, &labels, &own)).collect()
            })
            .collect(),
    }
}
