//! What the measurements say of the default: where it stops, whether anything is ahead of it, what less and more of the
//! model would do.

use std::collections::BTreeSet;

use crate::pareto::{CapacityPoint, Curve, Difference, ParetoPoint, Part, Summary, difference_to_chosen};
use inplace_core::field::Preset;
use serde::Serialize;

use super::{Results, Stopped};
use crate::commands::grouped;
use crate::page::{Page, known};
use crate::{mean, mean_and_deviation};

/// Share of the final accuracy of the preset "accurate" whose time is told.
const SHARE: f64 = 0.95;

/// What is said of the preset "auto" on one scene.
#[derive(Debug, Serialize)]
pub(super) struct Verdict {
    scene: String,
    /// Where it stopped by itself, by seed.
    stops: Vec<Stopped>,
    /// Its seeds.
    seeds: usize,
    /// Its maps in the end.
    end: Summary,
    /// The methods with a higher mean mIoU in less time, beyond the spread over the seeds: none, where it is on the
    /// Pareto front.
    beaten_by: Vec<(String, Summary)>,
    /// Beside the preset "accurate", where that was measured.
    accurate: Option<Reached>,
}

/// How soon most of the accuracy of the preset "accurate" is there.
#[derive(Debug, Serialize)]
struct Reached {
    /// mIoU of "accurate" in the end.
    final_miou: f64,
    /// Wall seconds that it took in all.
    whole_s: f64,
    /// Wall seconds until "auto" and "accurate" have 95% of what "accurate" ends with, seed by seed; `None` where they do
    /// not reach it.
    auto_s: Option<f64>,
    accurate_s: Option<f64>,
}

pub(super) fn miou(point: &ParetoPoint) -> Option<f64> {
    Some(point.miou)
}

/// One for each scene on which the preset "auto" was measured.
pub(super) fn verdicts(results: &Results) -> Vec<Verdict> {
    let scenes = grouped(&results.points, |point| point.scene.clone());
    let of_scene = |(scene, points): (String, Vec<&ParetoPoint>)| {
        let methods = grouped(points, |point| point.method.clone()).into_iter();
        let curves = methods.map(|(method, own)| (method, Curve::of(own, miou)));
        let curves: Vec<(String, Curve)> = curves.collect();
        let of = |preset: Preset| {
            let own = |(method, _): &&(String, Curve)| method == preset.name();
            curves.iter().find(own).map(|(_, curve)| curve)
        };
        let auto = of(Preset::Auto)?;
        let end = auto.last()?;
        let others = curves.iter().filter(|(method, _)| method != Preset::Auto.name());
        let beaten_by =
            others.filter_map(|(method, other)| Some((method.clone(), auto.beaten_by(end.wall_s, other)?)));
        let accurate = of(Preset::Accurate).and_then(|accurate| {
            let last = accurate.last()?;
            Some(Reached {
                final_miou: last.mean,
                whole_s: last.wall_s,
                auto_s: auto.reaches(SHARE, accurate),
                accurate_s: accurate.reaches(SHARE, accurate),
            })
        });
        let own = |stop: &&Stopped| stop.scene == scene && stop.method == Preset::Auto.name();
        Some(Verdict {
            stops: results.stops.iter().filter(own).cloned().collect(),
            seeds: auto.at(f64::INFINITY).len(),
            end,
            beaten_by: beaten_by.collect(),
            accurate,
            scene,
        })
    };
    scenes.into_iter().filter_map(of_scene).collect()
}

impl Verdict {
    fn sentences(&self) -> Vec<String> {
        let mut sentences = vec![self.stopped()];
        let told = |at: &Summary| format!("{:.3} ({:.3}) after {:.1} s", at.mean, at.deviation, at.wall_s);
        let end = format!("with {}", told(&self.end));
        sentences.push(if self.beaten_by.is_empty() {
            format!("auto is on the Pareto front {end}: nothing has more in less time, beyond the spread over the seeds")
        } else {
            let ahead = |(method, at): &(String, Summary)| format!("{method} has {}", told(at));
            let all: Vec<String> = self.beaten_by.iter().map(ahead).collect();
            format!("auto is not on the Pareto front {end}: {}", all.join(", "))
        });
        if let Some(reached) = &self.accurate {
            let (share, whole_s) = (100.0 * SHARE, reached.whole_s);
            let most = format!("{share:.0}% of accurate's final {:.3}", reached.final_miou);
            sentences.push(match (reached.auto_s, reached.accurate_s) {
                (Some(auto), Some(accurate)) => format!(
                    "auto has {most} within {auto:.1} s, {:.0}% of the {accurate:.1} s that accurate needs for it and {:.0}% of its whole {whole_s:.1} s",
                    100.0 * auto / accurate,
                    100.0 * auto / whole_s,
                ),
                _ => format!("auto does not reach {most}"),
            });
        }
        sentences
    }

    fn stopped(&self) -> String {
        if self.stops.is_empty() {
            let wall_s = self.end.wall_s;
            return format!("auto had not stopped by itself at the last mark, after {wall_s:.1} s");
        }
        let times: Vec<f64> = self.stops.iter().map(|own| own.stop.wall_s).collect();
        let (mean, deviation) = mean_and_deviation(&times);
        let reasons = self.stops.iter().map(|own| own.stop.reason.sentence());
        let reasons = Vec::from_iter(reasons.collect::<BTreeSet<_>>()).join("; ");
        let (count, seeds) = (self.stops.len(), self.seeds);
        format!("auto stopped after {mean:.1} s ({deviation:.1}), {count} of {seeds} runs: {reasons}")
    }
}

/// What a part of the model being half or twice as large does on one scene.
#[derive(Debug, Serialize)]
pub(super) struct CapacityVerdict {
    scene: String,
    part: Part,
    /// Differences of the mIoU to the chosen size.
    half_miou: Option<Difference>,
    twice_miou: Option<Difference>,
    /// Differences of the held-out PSNR, in dB.
    half_psnr_db: Option<Difference>,
    twice_psnr_db: Option<Difference>,
}

pub(super) fn capacity_verdicts(points: &[CapacityPoint]) -> Vec<CapacityVerdict> {
    let groups = grouped(points, |point| (point.scene.clone(), point.part));
    let verdict = |((scene, part), own): ((String, Part), Vec<&CapacityPoint>)| {
        let miou = |factor| difference_to_chosen(&own, factor, |point| Some(point.miou));
        let psnr = |factor| difference_to_chosen(&own, factor, |point| point.psnr_db);
        CapacityVerdict {
            half_miou: miou(0.5),
            twice_miou: miou(2.0),
            half_psnr_db: psnr(0.5),
            twice_psnr_db: psnr(2.0),
            scene,
            part,
        }
    };
    groups.into_iter().map(verdict).collect()
}

impl CapacityVerdict {
    fn sentence(&self) -> String {
        let said = |difference: Option<Difference>, unit: &str| match difference {
            None => "not measured".to_owned(),
            Some(difference) => {
                let word = match (difference.is_gain(), difference.is_loss()) {
                    (true, _) => "better",
                    (_, true) => "worse",
                    _ => "the same within the spread",
                };
                let Difference { mean, deviation } = difference;
                format!("{word} ({mean:+.3} \u{b1} {deviation:.3}{unit})")
            }
        };
        format!(
            "half of the chosen {}: mIoU {}, PSNR {}; twice: mIoU {}, PSNR {}",
            self.part,
            said(self.half_miou, ""),
            said(self.half_psnr_db, " dB"),
            said(self.twice_miou, ""),
            said(self.twice_psnr_db, " dB")
        )
    }
}

/// The tables, the sentences and the charts.
pub(super) fn page(results: &Results, verdicts: &[Verdict]) -> Page {
    let mut page = Page::default();
    page.paragraph(
        "Accuracy against wall time: the mIoU on the test frames, with its standard deviation over the seeds, and the \
         field's error and PSNR on held-out frames as of its newest look at them. The clock starts with the program \
         and stands still while maps are measured.",
    );
    let mut rows = Vec::new();
    for ((scene, method), own) in grouped(&results.points, |point| {
        (point.scene.clone(), point.method.clone())
    }) {
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
    let said = verdicts.iter().flat_map(|verdict| {
        let sentences = verdict.sentences().into_iter();
        sentences.map(|sentence| format!("{}: {sentence}", verdict.scene))
    });
    page.list(&said.collect::<Vec<String>>());
    page.chart("Accuracy against wall time", "pareto.svg");
    add_capacity(&mut page, &results.capacity);
    page
}

fn add_capacity(page: &mut Page, points: &[CapacityPoint]) {
    if points.is_empty() {
        return;
    }
    page.paragraph(
        "Accuracy against the size of the model, when training had stopped or the last mark came: the field's table \
         and the surface's voxels, each by itself so many times as large as \"auto\" chooses.",
    );
    let mut rows = Vec::new();
    for ((scene, part), of_part) in grouped(points, |point| (point.scene.clone(), point.part)) {
        let mut sizes = grouped(of_part, |point| point.factor);
        sizes.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (factor, runs) in sizes {
            let of = |value: &dyn Fn(&CapacityPoint) -> Option<f64>, decimals| {
                known(mean(runs.iter().filter_map(|run| value(run))), decimals)
            };
            let (miou, deviation) = mean_and_deviation(&runs.iter().map(|run| run.miou).collect::<Vec<_>>());
            rows.push(vec![
                scene.clone(),
                part.to_string(),
                factor.to_string(),
                of(&|run| Some(run.parameters as f64), 0),
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
    let said = capacity_verdicts(points).into_iter();
    let said = said.map(|verdict| format!("{}: {}", verdict.scene, verdict.sentence()));
    page.list(&said.collect::<Vec<String>>());
    page.chart("Accuracy against the size of the model", "capacity.svg");
}
