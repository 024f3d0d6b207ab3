//! The page, and what the measurements say of the default: whether anything is ahead of it.

use super::{Curve, ParetoPoint, Summary};
use inplace_core::field::Preset;

use crate::commands::grouped;
use crate::page::{Page, known};

pub(super) fn miou(point: &ParetoPoint) -> Option<f64> {
    Some(point.miou)
}

/// What is said of the preset "auto" on each scene on which it was measured.
pub(super) fn verdicts(points: &[ParetoPoint]) -> Vec<String> {
    let of_scene = |(scene, points): (&str, Vec<&ParetoPoint>)| {
        let methods = grouped(points, |point| point.method.as_str()).into_iter();
        let curves: Vec<(&str, Curve)> = methods
            .map(|(method, own)| (method, Curve::of(own, miou)))
            .collect();
        let is_auto = |(method, _): &&(&str, Curve)| curves.len() > 1 && *method == Preset::Auto.name();
        let (_, auto) = curves.iter().find(is_auto)?;
        Some(format!("{scene}: {}", on_the_front(&curves, auto, auto.last()?)))
    };
    let scenes = grouped(points, |point| point.scene.as_str()).into_iter();
    scenes.filter_map(of_scene).collect()
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

/// The tables, the sentences and the charts.
pub(super) fn page(points: &[ParetoPoint], verdicts: &[String]) -> Page {
    let mut page = Page::default();
    page.paragraph(
        "Accuracy against wall time: the mIoU on the test frames, with its standard deviation over the seeds, and the \
         field's error and PSNR on held-out frames as of its newest look at them. The clock starts with the program \
         and stands still while maps are measured; a session is measured first when all frames have maps.",
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
