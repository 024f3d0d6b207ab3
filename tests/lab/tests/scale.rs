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
    let counts: Vec<_> = measured
        .iter()
        .map(|one| one["frames"].as_u64().unwrap())
        .collect();
    assert_eq!(counts, [8, 24]);
    for one in measured {
        assert_eq!((&one["classes"], &one["strokes"]), (&20.into(), &60.into()));
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
        assert_eq!(
            (&exponent["sweep"], &exponent["points"]),
            (&"frames".into(), &2.into())
        );
        assert_eq!((&exponent["from"], &exponent["to"]), (&8.0.into(), &24.0.into()));
        assert!(exponent["exponent"].as_f64().unwrap().is_finite(), "{exponent}");
    }
    let table = fs::read_to_string(out.join("scale.csv")).unwrap();
    assert!(
        table.starts_with("sweep,frames,width,height,rooms,classes,strokes,opening_s,"),
        "{table}"
    );
    assert_eq!(table.lines().count(), 3);
    let chart = fs::read_to_string(out.join("scale.svg")).unwrap();
    for text in ["By frames", "Peak memory", "one more click, "] {
        assert!(chart.contains(text), "{text}");
    }
}
