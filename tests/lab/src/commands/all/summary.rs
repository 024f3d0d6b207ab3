//! What all measurements say, in ten lines.

use std::collections::BTreeMap;

use serde_json::Value;

use crate::commands::{counted, grouped};
use crate::engine::PLAIN;
use crate::mean;

/// What the measurements printed, by their folders.
pub(super) type Results = BTreeMap<String, Value>;

/// The rows of a measurement, or of all whose folders begin so, if `folder` ends with a dash.
pub(super) fn rows<'a>(results: &'a Results, folder: &str) -> Vec<&'a Value> {
    let is_own = |name: &str| name == folder || (folder.ends_with('-') && name.starts_with(folder));
    let own = results.iter().filter(|(name, _)| is_own(name));
    let rows = own.flat_map(|(_, result)| match (result, &result["points"]) {
        (Value::Array(rows), _) | (_, Value::Array(rows)) => rows.iter().collect(),
        _ => vec![result],
    });
    rows.collect()
}

pub(super) fn text<'a>(row: &'a Value, key: &str) -> &'a str {
    row[key].as_str().unwrap_or_default()
}

/// Not a number where none is known.
pub(super) fn number(row: &Value, key: &str) -> f64 {
    row[key].as_f64().unwrap_or(f64::NAN)
}

/// The mean of a value for each scene, as `0.923 demo, 0.858 room`; `None` without rows.
fn by_scene(rows: &[&Value], value: impl Fn(&Value) -> f64, decimals: usize) -> Option<String> {
    let scenes = grouped(rows.iter().copied(), |row| text(row, "scene")).into_iter();
    let means = scenes.map(|(scene, own)| {
        let mean = mean(own.into_iter().map(&value));
        format!("{mean:.decimals$} {scene}")
    });
    let all: Vec<String> = means.collect();
    (!all.is_empty()).then(|| all.join(", "))
}

/// The same of the mIoU.
fn miou(rows: &[&Value]) -> Option<String> {
    by_scene(rows, |row| number(row, "miou"), 3)
}

/// The mean mIoU of all rows.
fn mean_miou(rows: Vec<&Value>) -> f64 {
    mean(rows.into_iter().map(|row| number(row, "miou")))
}

/// The most important figures; what was not measured is left out.
pub(super) fn lines(results: &Results) -> Vec<String> {
    let all = [
        few_clicks(results),
        without_depth(results),
        own_clicks(results),
        other_methods(results),
        waiting(results),
        first_labels(results),
        paper(results),
        stability(results),
        objects(results),
        cost(results),
    ];
    all.into_iter().flatten().collect()
}

/// Rows of one policy, after so many clicks a class.
fn after<'a>(rows: Vec<&'a Value>, policy: &str, clicks: u64) -> Vec<&'a Value> {
    let is_own = |row: &&Value| text(row, "policy") == policy && row["clicks_per_class"] == clicks;
    rows.into_iter().filter(is_own).collect()
}

fn few_clicks(results: &Results) -> Option<String> {
    let of = |policy| miou(&after(rows(results, "clicks-"), policy, 5));
    let (guided, random) = (of("guided")?, of("random")?);
    Some(format!(
        "**A few clicks are enough.** mIoU on frames without clicks after five suggested clicks a class: {guided}; after five \
         random ones: {random}."
    ))
}

/// The first and the last point of each run of "auto".
fn ends<'a>(results: &'a Results, folder: &str) -> (Vec<&'a Value>, Vec<&'a Value>) {
    let auto = rows(results, folder).into_iter();
    let auto = auto.filter(|row| row["method"] == "auto");
    let runs = grouped(auto, |row| (text(row, "scene"), row["seed"].as_u64())).into_iter();
    runs.map(|(_, own)| (own[0], own[own.len() - 1])).unzip()
}

fn without_depth(results: &Results) -> Option<String> {
    let (_, last) = ends(results, "pareto-no-depth");
    let random = miou(&last)?;
    let seconds = last.iter().map(|row| number(row, "wall_s")).fold(0.0, f64::max);
    let guided = miou(&after(rows(results, "no-depth-clicks"), "guided", 5));
    let guided = guided.map(|guided| format!(" Five suggested clicks a class give {guided}."));
    Some(format!(
        "**Without depth**, after {seconds:.0} s with five random clicks a class or a real capture's own: {random}.{}",
        guided.unwrap_or_default()
    ))
}

fn own_clicks(results: &Results) -> Option<String> {
    let own = rows(results, "own-");
    let most = own
        .iter()
        .filter_map(|row| row["clicks_per_class"].as_u64())
        .max()?;
    let miou = miou(&after(own, "own", most))?;
    Some(format!(
        "**Real captures** with at most {most} clicks a class, on frames that were labelled by hand: {miou}."
    ))
}

fn other_methods(results: &Results) -> Option<String> {
    let of = |policy: &str| mean_miou(after(rows(results, "beside-"), policy, 5));
    let others = ["joint-mlp", "nearest", "pixels"].map(|method| {
        let miou = of(&format!("random/{method}"));
        format!("{} {miou:.3}", super::charts::name(method))
    });
    let ours = of("random");
    ours.is_finite().then(|| {
        format!(
            "**Other methods** on the same five random clicks a class, mean of the scenes: Inplace {ours:.3}, {}.",
            others.join(", ")
        )
    })
}

fn waiting(results: &Results) -> Option<String> {
    let rows = rows(results, "latency");
    let of = |percentile: &'static str| {
        let wait = move |row: &Value| number(&row["in_view_ms"], percentile);
        by_scene(&rows, wait, 0)
    };
    let (half, most) = (of("p50")?, of("p95")?);
    Some(format!(
        "**A click is fast.** Milliseconds until the map in view follows, for half of the clicks: {half}; for 95%: {most}."
    ))
}

fn first_labels(results: &Results) -> Option<String> {
    let of = |folder| by_scene(&ends(results, folder).0, |row| number(row, "wall_s"), 1);
    let (with, without) = (of("pareto")?, of("pareto-no-depth")?);
    Some(format!(
        "**First labels of all frames**, seconds after the start: {with}; without depth: {without}."
    ))
}

fn paper(results: &Results) -> Option<String> {
    let of = |folder| {
        let rows = rows(results, folder).into_iter();
        // The rows of Table 4 above the last are other methods.
        let own = rows.filter(|row| !text(row, "experiment").starts_with("fusion-"));
        let known: Vec<&Value> = own.filter(|row| row["paper_miou"].is_f64()).collect();
        let scenes = grouped(known, |row| text(row, "scene")).into_iter();
        let counts = scenes.map(|(scene, own)| {
            let reached = |row: &&&Value| number(row, "miou") >= number(row, "paper_miou");
            let count = own.iter().filter(reached).count();
            format!("{count} of {} {scene}", own.len())
        });
        let counts: Vec<String> = counts.collect();
        (!counts.is_empty()).then(|| counts.join(", "))
    };
    let without =
        of("paper-no-depth").map_or_else(String::new, |counts| format!("; without depth: {counts}"));
    Some(format!(
        "**The paper's mIoU** is reached in {} of its experiments{without}.",
        of("paper")?
    ))
}

fn stability(results: &Results) -> Option<String> {
    let conditions = grouped(rows(results, "stability"), |row| {
        (text(row, "scene"), text(row, "condition"))
    });
    let is_met = |(_, runs): &&((&str, &str), Vec<&Value>)| {
        let of = |key: &str| mean(runs.iter().map(|run| number(run, key)));
        of("figure") >= of("line")
    };
    let met = conditions.iter().filter(is_met).count();
    (!conditions.is_empty()).then(|| {
        let all = conditions.len();
        format!("**Stability**: {met} of {all} conditions under which such methods fail meet their line.")
    })
}

fn objects(results: &Results) -> Option<String> {
    let own = rows(results, "objects-");
    let clicks = |row: &&Value| row["clicks_per_object"].as_u64();
    let most = own.iter().filter_map(clicks).max()?;
    let guided = |row: &&Value| row["policy"] == "guided" && clicks(row) == Some(most);
    let own: Vec<&Value> = own.into_iter().filter(guided).collect();
    let (iou, quality) = (
        by_scene(&own, |row| number(row, "iou"), 3)?,
        by_scene(&own, |row| number(row, "pq_things"), 3)?,
    );
    Some(format!(
        "**Objects**: mean IoU with {} on each: {iou}; panoptic quality of things: {quality}.",
        counted(most, "suggested click")
    ))
}

fn cost(results: &Results) -> Option<String> {
    let peaks = by_scene(&ends(results, "pareto").1, |row| number(row, "peak_mb"), 0)?;
    let measured = results.get("scale")?["measured"].as_array()?;
    let largest = measured.iter().rfind(|row| row["sweep"] == "frames")?;
    let paths = results.get("engine")?["paths"].as_array()?;
    let speed = |row: Option<&Value>| row.map_or(f64::NAN, |row| number(row, "samples_per_s"));
    let plain = paths.iter().find(|path| path["name"] == PLAIN);
    Some(format!(
        "**Cost**: MB at most, {peaks}; {} frames of 320 x 240 take {:.2} GB. The field's kernels are {:.1} times as fast as \
         plain candle operations.",
        largest["frames"],
        number(largest, "peak_memory_bytes") / 1e9,
        speed(paths.first()) / speed(plain)
    ))
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    #[test]
    fn lines_are_means_by_scene_of_what_was_measured() {
        let clicked = |policy: &str, seed: u64, miou: f64| json!({"scene": "demo", "policy": policy, "seed": seed, "clicks_per_class": 5, "miou": miou});
        let rows = [
            clicked("guided", 0, 0.9),
            clicked("guided", 1, 0.8),
            clicked("random", 0, 0.7),
        ];
        let tried = |condition: &str, figure: Value| json!({"scene": "demo", "condition": condition, "figure": figure, "line": 0.5});
        let tried = [
            tried("thin", json!(0.6)),
            tried("glass", json!(0.4)),
            tried("mirror", Value::Null),
        ];
        let results = Results::from([
            ("clicks-demo".to_owned(), json!(rows)),
            ("stability".to_owned(), json!(tried)),
        ]);
        let lines = lines(&results);
        assert_eq!(lines.len(), 2);
        assert!(lines[0].contains("clicks a class: 0.850 demo; after five random ones: 0.700 demo."));
        assert!(lines[1].contains("1 of 3 conditions"), "{lines:?}");
    }
}
