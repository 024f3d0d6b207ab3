//! How cost grows is measured, fitted and charted.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;

use inplace_tests::{Running, inplace_lab};
use serde_json::Value;

#[test]
fn how_cost_grows_with_frames_is_measured_and_fitted() {
    let root = tempfile::tempdir().unwrap();
    let out = root.path().join("out");
    let mut command = inplace_lab();
    command.args("bench scale --sweep frames --frames 8,24 --json".split(' '));
    command.args("--at-size 64x48 --seconds 0.5 --threads 2".split(' '));
    let outcome = Running::to_the_end(command.arg("--out").arg(&out));
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
        let of = |figure: &str| one[figure].as_f64().unwrap();
        assert!(of("map_in_view_s") <= of("all_maps_s"), "{one}");
    }
    let exponents = result["exponents"].as_array().unwrap();
    assert_eq!(exponents.len(), 9);
    for exponent in exponents {
        assert_eq!(exponent["sweep"], "frames");
        let fitted = ["points", "from", "to"].map(|key| exponent[key].as_f64().unwrap());
        assert_eq!(fitted, [2.0, 8.0, 24.0]);
        assert!(exponent["exponent"].as_f64().unwrap().is_finite(), "{exponent}");
    }
    let table = fs::read_to_string(out.join("scale.csv")).unwrap();
    let header = "sweep,frames,width,height,rooms,classes,strokes,opening_s,";
    assert!(table.starts_with(header), "{table}");
    assert_eq!(table.lines().count(), 3);
    let chart = fs::read_to_string(out.join("scale.svg")).unwrap();
    for text in ["By frames", "Peak memory", "one more click, "] {
        assert!(chart.contains(text), "{text}");
    }
}
