use std::path::Path;

use super::*;
use crate::testing::{capture, options};

fn run(folder: &Path, method: Method, marks: &[f64], scaled: Option<(Part, f32)>) -> Vec<ParetoPoint> {
    let run = ParetoRun {
        session: options(SceneSource::Folder(folder.to_path_buf())),
        method,
        clicks: 2,
        marks: marks.to_vec(),
        scaled,
    };
    run.measure().unwrap()
}

fn point(seed: u64, miou: f64) -> ParetoPoint {
    ParetoPoint {
        scene: "wall".to_owned(),
        method: "nearest".to_owned(),
        seed,
        wall_s: 1.234,
        miou,
        depth_error_m: None,
        psnr_db: Some(28.456),
        parameters: None,
        peak_mb: Some(123.4),
        voxels: 7,
        bytes: 500,
        stop: None,
    }
}

#[test]
fn a_session_is_measured_at_the_marks_and_a_baseline_once() {
    let (_root, folder) = capture();
    // Maps come within half a second, also on slow machines within five.
    let own = run(&folder, Method::Preset(Preset::Fast), &[4.0, 5.0], None);
    let last = own.last().unwrap();
    assert!((1..=3).contains(&own.len()) && own[0].miou > 0.9, "{own:?}");
    assert!(own[0].wall_s < 4.0 && (last.stop.is_some() || last.wall_s >= 4.0), "{own:?}");
    let is_own = |point: &ParetoPoint| point.method == "fast" && point.seed == 4;
    assert!(own.iter().all(is_own), "{own:?}");
    assert!(last.voxels > 0 && last.bytes > 4 * last.parameters.unwrap());

    let nearest = run(&folder, Method::Baseline(Baseline::Nearest), &[10.0], None);
    let [nearest] = &nearest[..] else {
        panic!("{nearest:?}");
    };
    assert_eq!((nearest.stop, nearest.voxels), (None, last.voxels));
    assert!(nearest.miou > 0.5 && nearest.parameters.is_none());
}

#[test]
fn a_model_of_another_size_has_another_field_or_another_surface() {
    let (_root, folder) = capture();
    let sized = |part, factor| {
        let own = run(
            &folder,
            Method::Preset(Preset::Fast),
            &[0.2],
            Some((part, factor)),
        );
        assert!(own.len() == 1 && own[0].miou > 0.5, "{own:?}");
        (own[0].parameters, own[0].voxels)
    };
    let chosen = sized(Part::Field, 1.0);
    let (smaller, coarser) = (sized(Part::Field, 0.25), sized(Part::Surface, 0.25));
    let (is_smaller, is_coarser) = (smaller.0 < chosen.0, coarser.1 < chosen.1);
    assert!(is_smaller && smaller.1 == chosen.1, "{chosen:?} {smaller:?}");
    assert!(is_coarser && coarser.0 == chosen.0, "{chosen:?} {coarser:?}");
}

#[test]
fn the_tables_have_a_row_for_each_point_and_nothing_where_nothing_is_known() {
    let point = point(3, 0.5);
    assert_eq!(
        csv(std::slice::from_ref(&point), COLUMNS).unwrap(),
        "scene,method,seed,wall_s,miou,depth_error_m,psnr_db,parameters,peak_mb\n\
         wall,nearest,3,1.23,0.5000,,28.46,,123\n"
    );
    let scaled = CapacityPoint {
        part: Part::Surface,
        factor: 0.25,
        end: ParetoPoint {
            parameters: Some(100),
            ..point
        },
    };
    assert_eq!(
        csv(&[scaled], CAPACITY_COLUMNS).unwrap(),
        "scene,part,factor,seed,parameters,bytes,voxels,miou,depth_error_m,psnr_db,wall_s\n\
         wall,surface,0.25,3,100,500,7,0.5000,,28.46,1.23\n"
    );
}
