use std::path::Path;

use super::*;
use crate::testing::{capture, options};

fn run(folder: &Path, method: Method, marks: &[f64]) -> Vec<ParetoPoint> {
    let run = ParetoRun {
        session: options(SceneSource::Folder(folder.to_path_buf())),
        method,
        clicks: 2,
        marks: marks.to_vec(),
    };
    run.measure().unwrap()
}

#[test]
fn a_session_is_measured_when_there_are_maps_and_at_the_marks() {
    let (_root, folder) = capture();
    // Maps come within half a second, also on slow machines within five.
    let own = run(&folder, Method::Preset(Preset::Fast), &[4.0, 5.0]);
    let last = own.last().unwrap();
    assert!((1..=3).contains(&own.len()) && own[0].miou > 0.9, "{own:?}");
    assert!(
        own[0].wall_s < 4.0 && (last.stop.is_some() || last.wall_s >= 4.0),
        "{own:?}"
    );
    let is_own = |point: &ParetoPoint| point.method == "fast" && point.seed == 4;
    assert!(own.iter().all(is_own), "{own:?}");
    assert!(last.voxels > 0 && last.parameters.is_some());
}

#[test]
fn a_model_of_another_size_has_another_field_or_another_surface() {
    let (_root, folder) = capture();
    let sized = |size| {
        let own = run(&folder, Method::Sized(size), &[0.2]);
        assert!(own.len() == 1 && own[0].miou > 0.5, "{own:?}");
        (own[0].parameters, own[0].voxels)
    };
    let (chosen, smaller, coarser) = (sized(0), sized(1), sized(3));
    let (is_smaller, is_coarser) = (smaller.0 < chosen.0, coarser.1 < chosen.1);
    assert!(is_smaller && smaller.1 == chosen.1, "{chosen:?} {smaller:?}");
    assert!(is_coarser && coarser.0 == chosen.0, "{chosen:?} {coarser:?}");
}

#[test]
fn the_table_has_a_row_for_each_point_and_nothing_where_nothing_is_known() {
    let point = ParetoPoint {
        scene: "wall".to_owned(),
        method: "auto".to_owned(),
        seed: 3,
        wall_s: 1.234,
        miou: 0.5,
        psnr_db: Some(28.456),
        peak_mb: Some(123.4),
        ..ParetoPoint::default()
    };
    assert_eq!(
        csv(std::slice::from_ref(&point), COLUMNS).unwrap(),
        "scene,method,seed,wall_s,miou,depth_error_m,psnr_db,parameters,peak_mb\n\
         wall,auto,3,1.23,0.5000,,28.46,,123\n"
    );
}
