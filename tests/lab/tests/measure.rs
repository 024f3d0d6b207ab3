//! Measurements tell what they are of, and are fit to be read.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;
use std::path::Path;

use inplace_tests::{Outcome, Running, inplace, inplace_lab, one_line};
use serde_json::Value;

/// Writes the demo, photographed in a small way.
fn small_demo(folder: &Path) {
    let mut command = inplace();
    command.args(["demo", "--frames", "8", "--size", "64x48"]);
    let outcome = Running::to_the_end(command.arg("--out").arg(folder));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
}

/// Runs the laboratory with these words, on these captures, to its end.
fn lab(words: &str, scenes: &[&Path], out: &Path) -> Outcome {
    let mut command = inplace_lab();
    command.args(words.split(' ')).arg("--out").arg(out).args(scenes);
    Running::to_the_end(&mut command)
}

/// What it prints as JSON; it has nothing to complain about.
fn measured(words: &str, out: &Path) -> Value {
    let outcome = lab(&format!("{words} --json"), &[], out);
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""));
    serde_json::from_str(&outcome.stdout).unwrap()
}

#[test]
fn captures_of_one_name_are_not_measured_together() {
    let root = tempfile::tempdir().unwrap();
    let folders = ["a/room", "b/room"].map(|name| root.path().join(name));
    for folder in &folders {
        fs::create_dir_all(folder.parent().unwrap()).unwrap();
        small_demo(folder);
    }
    for protocol in ["all", "latency", "pareto", "paper"] {
        let scenes = [&*folders[0], &folders[1]];
        let outcome = lab(&format!("bench {protocol}"), &scenes, &root.path().join("out"));
        assert_eq!(outcome.code, Some(1), "{outcome:?}");
        let told = one_line(&outcome.stderr);
        assert!(told.contains("room: two captures have this name"), "{outcome:?}");
    }
}

#[test]
fn a_condition_is_tried_and_its_page_says_how_it_went() {
    let root = tempfile::tempdir().unwrap();
    let (scene, out) = (root.path().join("scene"), root.path().join("out"));
    small_demo(&scene);
    let words = "bench stability --conditions labels-one-click --seeds 2 --seconds 0.2";
    let outcome = lab(words, &[&scene], &out);
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""));
    let page = fs::read_to_string(out.join("stability.md")).unwrap();
    assert_eq!(page, outcome.stdout);
    for text in ["Every line is met.", "| labels-one-click |"] {
        assert!(page.contains(text), "{page}");
    }
    let table = fs::read_to_string(out.join("stability.csv")).unwrap();
    assert_eq!(table.lines().count(), 3, "{table}");
}

#[test]
fn a_simulated_annotator_labels_the_demo() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let graph_alone = "simulate demo --policy random --clicks 1 --seeds 1 --geometry 0 --settle 0";
    let point = &measured(graph_alone, &out)[0];
    let (policy, clicks) = (&point["policy"], &point["clicks_per_class"]);
    assert_eq!((policy, clicks), (&"random".into(), &1.into()));
    assert!(point["miou"].as_f64().unwrap() > 0.2, "{point}");
    let table = fs::read_to_string(out.join("results.csv")).unwrap();
    assert!(table.starts_with("scene,policy,seed,clicks_per_class,strokes,miou,"));
    assert_eq!(table.lines().count(), 2);
    assert!(out.join("results.svg").is_file());
}

#[test]
fn how_long_clicks_wait_is_measured_in_the_demo() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let latency = measured("bench latency demo --clicks 3", &out);
    assert_eq!(latency["clicks"], 3);
    for (count, least) in [("frames", 4), ("surface_nodes", 1), ("sessions", 1)] {
        assert!(latency[count].as_u64().unwrap() >= least, "{count}: {latency}");
    }
    for percentile in ["p50", "p95", "p99"] {
        let of = |key: &str| latency[key][percentile].as_f64().unwrap();
        let waited = ["in_view_ms", "all_frames_ms", "suggestions_ms"].map(of);
        assert!(0.0 < waited[0] && waited.is_sorted(), "{latency}");
    }
    let written = fs::read_to_string(out.join("latency.json")).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&written).unwrap(), latency);
}

#[test]
fn how_cost_grows_with_frames_is_measured_and_fitted() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let words = "bench scale --sweep frames --frames 8,24 --json --at-size 64x48 --seconds 0.5 --threads 2";
    let outcome = lab(words, &[], &out);
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let result: Value = serde_json::from_str(&outcome.stdout).unwrap();
    let written = fs::read_to_string(out.join("scale.json")).unwrap();
    assert_eq!(serde_json::from_str::<Value>(&written).unwrap(), result);

    let measured = result["measured"].as_array().unwrap();
    assert_eq!(measured.len(), 2);
    for (one, frames) in measured.iter().zip([8, 24]) {
        let counts = ["frames", "classes", "strokes"].map(|count| one[count].as_u64().unwrap());
        assert_eq!(counts, [frames, 20, 60]);
        let figures = "opening_s surface_s map_in_view_s all_maps_s update_s steps_per_s surface_nodes \
                       parameters peak_memory_bytes";
        for figure in figures.split(' ') {
            assert!(one[figure].as_f64().unwrap() > 0.0, "{figure} in {one}");
        }
    }
    let exponents = result["exponents"].as_array().unwrap();
    assert_eq!(exponents.len(), 9);
    let is_fitted = |one: &Value| one["sweep"] == "frames" && one["points"] == 2 && one["exponent"].is_f64();
    assert!(exponents.iter().all(is_fitted), "{exponents:?}");
    let table = fs::read_to_string(out.join("scale.csv")).unwrap();
    let header = "sweep,frames,width,height,rooms,classes,strokes,opening_s,";
    assert!(table.starts_with(header), "{table}");
    assert_eq!(table.lines().count(), 3);
    let chart = fs::read_to_string(out.join("scale.svg")).unwrap();
    for text in ["By frames", "one more click, "] {
        assert!(chart.contains(text), "{text}");
    }
}
