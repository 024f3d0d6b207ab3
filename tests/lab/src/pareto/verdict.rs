//! What the measurements say of the default: where it stops, whether anything is ahead of it, what less and more of the
//! model would do.

use std::collections::BTreeSet;

use super::{CapacityPoint, Curve, Difference, ParetoPoint, Part, Summary, difference_to_chosen};
use inplace_core::field::Preset;
use inplace_core::session::TrainingEnd;

use crate::commands::grouped;
use crate::page::{Page, known};
use crate::{mean, mean_and_deviation};

/// Share of the final accuracy of the preset "accurate" whose time is told.
const SHARE: f64 = 0.95;

pub(super) fn miou(point: &ParetoPoint) -> Option<f64> {
    Some(point.miou)
}

/// What is said of the preset "auto" on each scene on which it was measured.
pub(super) fn verdicts(points: &[ParetoPoint]) -> Vec<String> {
    let mut all = Vec::new();
    for (scene, points) in grouped(points, |point| point.scene.clone()) {
        let methods = grouped(points.iter().copied(), |point| point.method.as_str()).into_iter();
        let curves = methods.map(|(method, own)| (method, Curve::of(own, miou)));
        let curves: Vec<(&str, Curve)> = curves.collect();
        let of = |preset: Preset| {
            let own = |(method, _): &&(&str, Curve)| *method == preset.name();
            curves.iter().find(own).map(|(_, curve)| curve)
        };
        let Some((auto, end)) = of(Preset::Auto).and_then(|auto| Some((auto, auto.last()?))) else {
            continue;
        };
        let stops = points.iter().filter(|point| point.method == Preset::Auto.name());
        let stops: Vec<(f64, TrainingEnd)> = stops
            .filter_map(|point| Some((point.wall_s, point.stop?)))
            .collect();
        let mut sentences = vec![stopped(&stops, auto.at(f64::INFINITY).len(), end.wall_s)];
        sentences.push(on_the_front(&curves, auto, end));
        sentences.extend(of(Preset::Accurate).and_then(|accurate| beside_accurate(auto, accurate)));
        all.extend(
            sentences
                .into_iter()
                .map(|sentence| format!("{scene}: {sentence}")),
        );
    }
    all
}

/// When and why runs stopped by themselves, of so many seeds.
fn stopped(stops: &[(f64, TrainingEnd)], seeds: usize, last_mark: f64) -> String {
    if stops.is_empty() {
        return format!("auto had not stopped by itself at the last mark, after {last_mark:.1} s");
    }
    let times: Vec<f64> = stops.iter().map(|(wall_s, _)| *wall_s).collect();
    let (mean, deviation) = mean_and_deviation(&times);
    let reasons: BTreeSet<&str> = stops.iter().map(|(_, reason)| reason.sentence()).collect();
    let (count, reasons) = (stops.len(), Vec::from_iter(reasons).join("; "));
    format!("auto stopped after {mean:.1} s ({deviation:.1}), {count} of {seeds} runs: {reasons}")
}

/// The methods with a higher mean mIoU in less time, beyond the spread over the seeds: none, where "auto" is on the Pareto
/// front.
fn on_the_front(curves: &[(&str, Curve)], auto: &Curve, end: Summary) -> String {
    let told = |at: Summary| format!("{:.3} ({:.3}) after {:.1} s", at.mean, at.deviation, at.wall_s);
    let others = curves.iter().filter(|(method, _)| *method != Preset::Auto.name());
    let ahead = others.filter_map(|(method, other)| {
        let at = auto.beaten_by(end.wall_s, other)?;
        Some(format!("{method} has {}", told(at)))
    });
    let (ahead, end) = (ahead.collect::<Vec<String>>(), told(end));
    if ahead.is_empty() {
        return format!(
            "auto is on the Pareto front with {end}: nothing has more in less time, beyond the spread over the seeds"
        );
    }
    format!("auto is not on the Pareto front with {end}: {}", ahead.join(", "))
}

/// How soon most of the accuracy of the preset "accurate" is there, seed by seed.
fn beside_accurate(auto: &Curve, accurate: &Curve) -> Option<String> {
    let Summary { mean, wall_s, .. } = accurate.last()?;
    let most = format!("{:.0}% of accurate's final {mean:.3}", 100.0 * SHARE);
    let reach = |curve: &Curve| curve.reaches(SHARE, accurate);
    Some(match (reach(auto), reach(accurate)) {
        (Some(auto), Some(accurate)) => format!(
            "auto has {most} within {auto:.1} s, {:.0}% of the {accurate:.1} s that accurate needs for it and {:.0}% of its whole {wall_s:.1} s",
            100.0 * auto / accurate,
            100.0 * auto / wall_s,
        ),
        _ => format!("auto does not reach {most}"),
    })
}

/// What a part of the model being half or twice as large does on each scene.
pub(super) fn capacity_verdicts(points: &[CapacityPoint]) -> Vec<String> {
    let groups = grouped(points, |point| (point.end.scene.clone(), point.part));
    let verdict = |((scene, part), own): ((String, Part), Vec<&CapacityPoint>)| {
        let of = |factor, unit: &str, value: fn(&ParetoPoint) -> Option<f64>| {
            let Some(difference) = difference_to_chosen(&own, factor, value) else {
                return "not measured".to_owned();
            };
            let word = match (difference.is_gain(), difference.is_loss()) {
                (true, _) => "better",
                (_, true) => "worse",
                _ => "the same within the spread",
            };
            let Difference { mean, deviation } = difference;
            format!("{word} ({mean:+.3} \u{b1} {deviation:.3}{unit})")
        };
        let both = |factor| {
            let psnr = of(factor, " dB", |point| point.psnr_db);
            format!("mIoU {}, PSNR {psnr}", of(factor, "", miou))
        };
        format!(
            "{scene}: half of the chosen {part}: {}; twice: {}",
            both(0.5),
            both(2.0)
        )
    };
    groups.into_iter().map(verdict).collect()
}

/// The tables, the sentences and the charts.
pub(super) fn page(points: &[ParetoPoint], verdicts: &[String]) -> Page {
    let mut page = Page::default();
    page.paragraph(
        "Accuracy against wall time: the mIoU on the test frames, with its standard deviation over the seeds, and the \
         field's error and PSNR on held-out frames as of its newest look at them. The clock starts with the program \
         and stands still while maps are measured.",
    );
    let mut rows = Vec::new();
    for ((scene, method), own) in grouped(points, |point| (point.scene.clone(), point.method.clone())) {
        let curve = |value: &dyn Fn(&ParetoPoint) -> Option<f64>| Curve::of(own.iter().copied(), value);
        let curves = [
            curve(&|point| point.depth_error_m.map(|error| 100.0 * error)),
            curve(&|point| point.psnr_db),
            curve(&|point| point.parameters.map(|count| count as f64)),
            curve(&|point| point.peak_mb),
        ];
        for at in curve(&miou).summaries() {
            let text = |index: usize, decimals| {
                let summary: Option<Summary> = curves[index].summary(at.wall_s);
                known(summary.map(|summary| summary.mean), decimals)
            };
            rows.push(vec![
                scene.clone(),
                method.clone(),
                format!("{:.1}", at.wall_s),
                format!("{:.3} ({:.3})", at.mean, at.deviation),
                text(0, 2),
                text(1, 1),
                text(2, 0),
                text(3, 0),
            ]);
        }
    }
    let header = "scene | method | seconds | mIoU | error, cm | PSNR, dB | parameters | peak, MB";
    page.table(header, &rows);
    page.list(verdicts);
    page.chart("Accuracy against wall time", "pareto.svg");
    page
}

/// The same for sizes, where those were measured.
pub(super) fn add_capacity(page: &mut Page, points: &[CapacityPoint], verdicts: &[String]) {
    if points.is_empty() {
        return;
    }
    page.paragraph(
        "Accuracy against the size of the model, when training had stopped or the last mark came: the field's table \
         and the surface's voxels, each by itself so many times as large as \"auto\" chooses.",
    );
    let mut rows = Vec::new();
    for ((scene, part), of_part) in grouped(points, |point| (point.end.scene.clone(), point.part)) {
        let mut sizes = grouped(of_part, |point| point.factor);
        sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (factor, runs) in sizes {
            let of = |value: &dyn Fn(&ParetoPoint) -> Option<f64>, decimals| {
                known(mean(runs.iter().filter_map(|run| value(&run.end))), decimals)
            };
            let (miou, deviation) =
                mean_and_deviation(&runs.iter().map(|run| run.end.miou).collect::<Vec<_>>());
            rows.push(vec![
                scene.clone(),
                part.to_string(),
                factor.to_string(),
                of(&|run| run.parameters.map(|count| count as f64), 0),
                of(&|run| Some(run.bytes as f64 / 1e6), 1),
                of(&|run| Some(run.voxels as f64), 0),
                format!("{miou:.3} ({deviation:.3})"),
                of(&|run| run.depth_error_m.map(|error| 100.0 * error), 2),
                of(&|run| run.psnr_db, 1),
                of(&|run| Some(run.wall_s), 1),
            ]);
        }
    }
    page.table(
        "scene | part | times | parameters | MB | voxels | mIoU | error, cm | PSNR, dB | \
         seconds",
        &rows,
    );
    page.list(verdicts);
    page.chart("Accuracy against the size of the model", "capacity.svg");
}
