//! What holds for published intrinsics.

use super::*;

#[test]
fn published_intrinsics_follow_the_size_of_the_images_and_refuse_other_proportions() {
    let camera = published_camera([585.0, 584.0], [320.0, 240.0], 320, 240).unwrap();
    assert_eq!(
        (camera.fx, camera.fy, camera.cx, camera.cy),
        (292.5, 292.0, 160.0, 120.0)
    );
    let reason = published_camera([585.0; 2], [320.0, 240.0], 640, 360)
        .unwrap_err()
        .to_string();
    assert!(
        reason.contains("640x360") && reason.contains("fx fy cx cy"),
        "{reason}"
    );
}
