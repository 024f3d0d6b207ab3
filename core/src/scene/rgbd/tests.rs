//! What holds for the frames of a long sequence and for published intrinsics.

use super::*;

fn listed(count: usize) -> Vec<Listed> {
    let frame = |number: usize| Listed {
        path: PathBuf::from(number.to_string()),
        depth: None,
        camera_to_world: DAffine3::IDENTITY,
    };
    (0..count).map(frame).collect()
}

#[test]
fn up_to_a_thousand_frames_are_all_kept() {
    let mut notes = Vec::new();
    assert_eq!(thinned(listed(1000), &mut notes).len(), 1000);
    assert!(notes.is_empty());
}

#[test]
fn a_thousand_evenly_spaced_frames_of_a_longer_sequence_are_kept_in_order() {
    for total in [1001, 2500, 5182] {
        let mut notes = Vec::new();
        let numbers: Vec<usize> = thinned(listed(total), &mut notes)
            .iter()
            .map(|frame| frame.path.to_str().unwrap().parse().unwrap())
            .collect();
        assert_eq!(numbers.len(), 1000);
        let steps = || numbers.windows(2).map(|pair| pair[1] - pair[0]);
        let (least, most) = (steps().min().unwrap(), steps().max().unwrap());
        assert!(
            least >= total / 1000 && most <= total.div_ceil(1000),
            "{least} {most}"
        );
        assert_eq!(notes.len(), 1);
        assert!(notes[0].contains(&total.to_string()), "{notes:?}");
    }
}

#[test]
fn of_larger_images_fewer_frames_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("0.jpg");
    image::RgbImage::new(1296, 968).save(&path).unwrap();
    let mut frames = listed(300);
    for frame in &mut frames[7..] {
        frame.path.clone_from(&path);
    }
    let mut notes = Vec::new();
    assert_eq!(thinned(frames, &mut notes).len(), 1000 * 640 * 480 / (1296 * 968));
    assert!(notes[0].contains("300"), "{notes:?}");
}

#[test]
fn published_intrinsics_follow_the_size_of_the_images_and_refuse_other_proportions() {
    let camera = published_camera([585.0, 584.0], [320.0, 240.0], 320, 240).unwrap();
    assert_eq!(
        (camera.fx, camera.fy, camera.cx, camera.cy),
        (292.5, 292.0, 160.0, 120.0)
    );
    let reason = published_camera([585.0; 2], [320.0, 240.0], 640, 360).unwrap_err();
    assert!(
        reason.contains("640x360") && reason.contains("fx fy cx cy"),
        "{reason}"
    );
}
