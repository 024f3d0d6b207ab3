//! The two charts of all measurements: accuracy against clicks and against seconds, beside other methods.

use std::path::Path;

use serde_json::Value;

use super::summary::{Results, number, rows, text};
use super::{Capture, FOLDER};
use crate::Failure;
use crate::chart::{Axis, Figure, Panel, Point, Scale, Series};
use crate::commands::processor;
use crate::page::Page;
use crate::pareto::{ParetoPoint, line};

/// Clicks a class of the courses over time.
const CLICKS: u64 = 5;

/// What the lines of a method are called.
pub(super) fn name(method: &str) -> &str {
    match method {
        "guided" => "Inplace, suggested",
        "random" => "Inplace, random",
        "uniform" => "Inplace, uniform",
        "own" => "Inplace, own clicks",
        "joint-mlp" => "joint MLP",
        "nearest" => "nearest click",
        "pixels" => "pixel classifier",
        other => other,
    }
}

/// Writes both charts and adds them to the page.
pub(super) fn add(
    page: &mut Page,
    results: &Results,
    captures: &[Capture],
    folder: &Path,
) -> Result<(), Failure> {
    for (file, figure) in [
        ("clicks.svg", clicks(results, captures)),
        ("seconds.svg", seconds(results, captures)?),
    ] {
        figure.write(&folder.join(file))?;
        page.chart(&figure.title, &format!("{FOLDER}/{file}"));
    }
    Ok(())
}

fn figure(title: &str, subtitle: &str, panels: Vec<Panel>) -> Figure {
    Figure {
        title: title.to_owned(),
        subtitle: format!("{subtitle}; {}", processor()),
        panels,
    }
}

/// Those of a scene; of another method those on the same clicks.
fn of_scene<'a>(results: &'a Results, folders: &[&str], scene: &str) -> Vec<&'a Value> {
    let all = folders.iter().flat_map(|folder| rows(results, folder));
    all.filter(|row| text(row, "scene") == scene).collect()
}

/// The method of a row, such as `nearest` of the policy `random/nearest`.
fn method(row: &Value) -> &str {
    let policy = text(row, "policy");
    policy.split_once('/').map_or(policy, |(_, method)| method)
}

/// A panel for each scene, one more without depth.
fn clicks(results: &Results, captures: &[Capture]) -> Figure {
    let panel = |title: String, own: Vec<&Value>| {
        let methods = [
            "guided",
            "random",
            "own",
            "joint-mlp",
            "nearest",
            "pixels",
            "uniform",
        ];
        let series = methods.map(|wanted| {
            let own = own.iter().filter(|row| method(row) == wanted);
            let told = own.map(|row| {
                let clicks = row["clicks_per_class"].as_u64().unwrap_or(0);
                (clicks, clicks as f64, number(row, "miou"))
            });
            Series::of_means(name(wanted), told)
        });
        Panel::new(
            title,
            Axis::new("clicks a class in the whole scene", Scale::FromZero),
            Axis::new("mIoU on frames without clicks", Scale::FromZero),
            series.to_vec(),
        )
    };
    let mut panels = Vec::new();
    for Capture { name, .. } in captures {
        let mut own = of_scene(results, &["clicks-", "own-"], name);
        let beside = of_scene(results, &["beside-"], name).into_iter();
        own.extend(beside.filter(|row| text(row, "policy").contains('/')));
        panels.push(panel(name.clone(), own));
        let without = of_scene(results, &["no-depth-clicks"], name);
        if !without.is_empty() {
            panels.push(panel(format!("{name}, no depth"), without));
        }
    }
    figure(
        "Accuracy against clicks, beside other methods on the same clicks",
        "as the surface answers at once; mean and range over the seeds",
        panels,
    )
}

/// A panel for each scene: the session with and without depth, and other methods when they answer.
fn seconds(results: &Results, captures: &[Capture]) -> Result<Figure, Failure> {
    let points = |folder: &str| -> Result<Vec<ParetoPoint>, Failure> {
        match results.get(folder) {
            Some(result) => Ok(serde_json::from_value(result["points"].clone())?),
            None => Ok(Vec::new()),
        }
    };
    let courses = [
        ("Inplace", "auto", points("pareto")?),
        ("Inplace, no depth", "auto", points("pareto-no-depth")?),
    ];
    let panel = |capture: &Capture| {
        let scene = capture.name.as_str();
        let course = |(name, method, points): &(&str, &str, Vec<ParetoPoint>)| {
            let own = points
                .iter()
                .filter(|own| own.scene == scene && own.method == *method);
            line((*name).to_owned(), &own.collect::<Vec<_>>())
        };
        let mut series: Vec<Series> = courses.iter().map(course).collect();
        let own = of_scene(results, &["beside-", "own-"], scene);
        let counts = own.iter().filter_map(|row| row["clicks_per_class"].as_u64());
        let most = counts.filter(|&count| count <= CLICKS).max();
        series.extend(["joint-mlp", "nearest", "pixels"].map(|wanted| {
            let is_own = |row: &&&Value| method(row) == wanted && row["clicks_per_class"].as_u64() == most;
            let point = |row: &&Value| Point::new(number(row, "wall_s"), number(row, "miou"));
            Series::new(name(wanted), own.iter().filter(is_own).map(point))
        }));
        Panel::new(
            scene,
            Axis::new("wall seconds since the start", Scale::Logarithmic),
            Axis::new("mIoU on frames without clicks", Scale::FromZero),
            series,
        )
    };
    Ok(figure(
        "Accuracy against time, beside other methods on the same clicks",
        "five random clicks a class, or a real capture's own, given at the start; mean and range over the seeds; a ring \
         is where training stopped by itself",
        captures.iter().map(panel).collect(),
    ))
}
