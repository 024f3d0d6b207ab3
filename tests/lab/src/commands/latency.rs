//! `inplace-lab bench latency`: how long a click waits for its maps.

use crate::chart::{Axis, Figure, Panel, Point, Scale, Series};
use crate::{Latency, Percentiles, click_latency};
use inplace_core::export;
use inplace_core::field::Preset;
use inplace_core::scene::SceneSource;

use super::{Failure, begin, processor};
use crate::arguments::LatencyArguments;
use crate::page::Page;
use inplace_core::session::Progress;

/// Most milliseconds that half of the clicks may wait for the map in view, and for all of them.
const TARGETS: (f64, f64) = (100.0, 2000.0);

/// Measures every scene, writes `latency.json` and `latency.svg`, and prints.
pub fn run(arguments: &LatencyArguments) -> Result<(), Failure> {
    let training = &arguments.on.training;
    if training.preset == Preset::Reference {
        return Err("the published network has no maps while it trains; leave --preset away".into());
    }
    let out = &arguments.on.output.out;
    begin(out, &arguments.on.scenes)?;
    let mut measured = Vec::new();
    for argument in &arguments.on.scenes {
        let options = training.session_options(SceneSource::from_argument(argument));
        let progress = Progress::default();
        let clicks = (arguments.clicks.into(), arguments.objects.into());
        measured.push(click_latency(&options, clicks, &mut |what| {
            progress.show(format!("{}: {what}", argument.display()));
        })?);
    }
    let result = match measured.as_slice() {
        [one] => serde_json::to_value(one)?,
        several => serde_json::to_value(several)?,
    };
    export::write_json(&out.join("latency.json"), &result)?;
    figure(training.preset, &measured).write(&out.join("latency.svg"))?;
    page(&measured).publish(&arguments.on.output, "latency", &result)
}

fn page(measured: &[Latency]) -> Page {
    let mut page = Page::default();
    page.paragraph(
        "Milliseconds from a click to the map of the frame in view, and to those of all frames, while the field is \
         being trained: half, 95% and 99% of the clicks wait no longer.",
    );
    let rows = measured.iter().map(|scene| {
        let (view, all) = (&scene.in_view_ms, &scene.all_frames_ms);
        let times = [view.p50, view.p95, view.p99, all.p50, all.p95, all.p99];
        let mut row = vec![scene.scene.clone(), scene.frames.to_string()];
        row.extend(times.map(|time| format!("{time:.0}")));
        row
    });
    let header = "scene | frames | in view 50% | 95% | 99% | all frames 50% | 95% | 99%";
    page.table(header, &rows.collect::<Vec<_>>());
    page.chart("How long a click waits for its maps", "latency.svg");
    page
}

/// The clicks sorted by how long they waited, a line for each scene.
fn figure(preset: Preset, measured: &[Latency]) -> Figure {
    let panel = |title: &str, target: f64, of: fn(&Latency) -> &Percentiles| {
        let across = Axis::new("% of clicks", Scale::Linear);
        let up = Axis::new("milliseconds at most", Scale::Logarithmic);
        let up = up.with_mark(target, "target for half of them");
        let series = measured.iter().map(|scene| line(scene, &of(scene).sorted));
        Panel::new(title, across, up, series.collect())
    };
    let first = measured.first();
    Figure {
        title: "How long a click waits for its maps while the field is being trained".to_owned(),
        subtitle: format!(
            "{}, {} threads, {} preset; {} clicks in each scene",
            processor(),
            first.map_or(0, |scene| scene.threads),
            preset.name(),
            first.map_or(0, |scene| scene.clicks),
        ),
        rows: vec![vec![
            panel("The map of the frame in view", TARGETS.0, |own| &own.in_view_ms),
            panel("The maps of all frames", TARGETS.1, |own| &own.all_frames_ms),
        ]],
    }
}

fn line(scene: &Latency, sorted: &[f64]) -> Series {
    let share = |rank: usize| 100.0 * (rank + 1) as f64 / sorted.len() as f64;
    let depth = if scene.depth { "" } else { ", no depth" };
    let points = sorted.iter().enumerate();
    let points = points.map(|(rank, &value)| Point::new(share(rank), value));
    Series::new(format!("{}, {} frames{depth}", scene.scene, scene.frames), points)
}
