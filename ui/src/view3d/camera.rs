//! The camera of the 3D view with its area of the screen.
//!
//! Camera axes are OpenCV's (x right, y down, z forward), lengths are metres, screen positions and focal
//! lengths are in points.

use egui::{Pos2, Rect, Vec2, pos2};
use glam::{Affine3A, Mat3, Mat4, Quat, Vec3, Vec4};
use inplace_core::scene::{Camera, Scene, Viewpoint};
use inplace_model::space::{HALF_FIELD_OF_VIEW, OrbitCamera};

/// Nothing nearer to the eye is drawn, in metres.
pub const NEAR: f32 = 0.02;

/// A rotation from level axes, whose y axis points down as gravity does, to the world.
///
/// Scenes have arbitrary axes; people hold cameras upright, so down is the mean of the cameras' y axes.
pub fn level_axes(scene: &Scene) -> Quat {
    let downs = scene.frames.iter();
    let sum: Vec3 = downs
        .map(|frame| Vec3::from(frame.camera_to_world.matrix3.y_axis))
        .sum();
    let down = sum.try_normalize().unwrap_or(Vec3::Y);
    Quat::from_rotation_arc(Vec3::Y, down)
}

/// Moves the camera sideways so that its pivot follows a drag over so many points.
pub fn pan(camera: &mut OrbitCamera, drag: Vec2, area: Rect) {
    camera.pan(glam::vec2(drag.x, drag.y), focal_length(area));
}

/// Comes `factor` times as near; what is at the pivot's depth under a screen position stays there.
pub fn zoom_at(camera: &mut OrbitCamera, area: Rect, cursor: Pos2, factor: f32) {
    let aside = cursor - area.center();
    camera.zoom(glam::vec2(aside.x, aside.y), focal_length(area), factor);
}

fn focal_length(area: Rect) -> f32 {
    0.5 * area.size().min_elem().max(1.0) / HALF_FIELD_OF_VIEW.tan()
}

/// A ray of the world.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts, in metres.
    pub origin: Vec3,
    /// Unit direction.
    pub direction: Vec3,
}

/// A camera with its area of the screen: the way between world and screen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sight {
    /// Where the camera is, in metres.
    pub eye: Vec3,
    /// Camera axes to world.
    pub rotation: Mat3,
    /// Focal length in points.
    pub focal: f32,
    /// Where it is drawn.
    pub area: Rect,
}

impl Sight {
    /// What a camera sees in an area of the screen.
    pub fn new(camera: &OrbitCamera, area: Rect) -> Self {
        Self {
            eye: camera.eye(),
            rotation: Mat3::from_quat(camera.rotation()),
            focal: focal_length(area),
            area,
        }
    }

    /// Screen position of a point of the world, and its depth in metres; `None` behind the near plane.
    pub fn project(&self, point: Vec3) -> Option<(Pos2, f32)> {
        let local = self.rotation.transpose() * (point - self.eye);
        (local.z > NEAR).then(|| {
            let middle = self.area.center();
            let scale = self.focal / local.z;
            (
                pos2(middle.x + scale * local.x, middle.y + scale * local.y),
                local.z,
            )
        })
    }

    /// The ray through a screen position.
    pub fn ray(&self, position: Pos2) -> Ray {
        let aside = (position - self.area.center()) / self.focal;
        let direction = self.rotation * Vec3::new(aside.x, aside.y, 1.0);
        Ray {
            origin: self.eye,
            direction: direction.normalize(),
        }
    }

    /// The same as a camera whose pixels are the area's points.
    pub fn viewpoint(&self) -> Viewpoint {
        // A cast saturates.
        let [width, height] =
            [self.area.width(), self.area.height()].map(|side| side.round().max(1.0) as u32);
        let middle = [width, height].map(|side| 0.5 * side as f32);
        Viewpoint {
            camera: Camera::new([width, height], [self.focal, self.focal, middle[0], middle[1]]),
            camera_to_world: Affine3A::from_mat3_translation(self.rotation, self.eye),
        }
    }

    /// World to clip space of the area: x right, y up, depth [`NEAR`] / z, so that nearer is greater.
    pub fn clip_from_world(&self) -> Mat4 {
        let size = self.area.size().max(Vec2::splat(1.0));
        let clip_from_camera = Mat4::from_cols(
            Vec4::new(2.0 * self.focal / size.x, 0.0, 0.0, 0.0),
            Vec4::new(0.0, -2.0 * self.focal / size.y, 0.0, 0.0),
            Vec4::new(0.0, 0.0, 0.0, 1.0),
            Vec4::new(0.0, 0.0, NEAR, 0.0),
        );
        let camera_from_world = self.rotation.transpose();
        clip_from_camera * Mat4::from_mat3_translation(camera_from_world, -(camera_from_world * self.eye))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::vec2;
    use inplace_model::space::{Ball, Direction};

    const AREA: Rect = Rect {
        min: pos2(200.0, 80.0),
        max: pos2(1000.0, 580.0),
    };
    const BALL: Ball = Ball {
        center: Vec3::new(1.0, -2.0, 3.0),
        radius: 2.5,
    };

    fn camera() -> OrbitCamera {
        let level = Quat::from_rotation_arc(Vec3::Y, Vec3::new(0.3, 0.2, -0.9).normalize());
        OrbitCamera::fitted(BALL, Direction::default(), level)
    }

    #[test]
    fn drags_turn_around_the_pivot_with_a_level_horizon_and_pan_it_along() {
        let mut camera = camera();
        let on_screen = |camera: &OrbitCamera, point| Sight::new(camera, AREA).project(point).unwrap().0;
        let near = camera.pivot - 0.5 * (camera.rotation() * Vec3::Z);
        let before = on_screen(&camera, near);
        camera.orbit(glam::vec2(20.0, 20.0));
        let moved = on_screen(&camera, near) - before;
        assert!(moved.x > 0.0 && moved.y > 0.0, "what is near goes along: {moved}");
        let down = camera.level * Vec3::Y;
        for drag in [[40.0, 10.0], [-300.0, 900.0], [5.0, -4000.0]] {
            camera.orbit(drag.into());
            assert_eq!(camera.pivot, BALL.center);
            assert!((camera.eye().distance(camera.pivot) - camera.distance).abs() < 1e-3);
            assert!((camera.rotation() * Vec3::X).dot(down).abs() < 1e-5);
            assert!((camera.rotation() * Vec3::Y).dot(down) > 0.0);
        }
        pan(&mut camera, vec2(60.0, -25.0), AREA);
        let pivot = on_screen(&camera, BALL.center);
        assert!((pivot - (AREA.center() + vec2(60.0, -25.0))).length() < 0.05);
    }

    #[test]
    fn a_fitted_view_shows_the_whole_ball_and_not_much_else() {
        let sight = Sight::new(&camera(), AREA);
        let mut farthest: f32 = 0.0;
        for step in 0..200 {
            let (a, b) = (step as f32 * 0.7, step as f32 * 0.11);
            let side = Vec3::new(a.cos() * b.sin(), a.sin() * b.sin(), b.cos());
            let (position, _) = sight.project(BALL.center + BALL.radius * side).unwrap();
            assert!(AREA.contains(position));
            farthest = farthest.max((position - AREA.center()).y.abs());
        }
        assert!(farthest > 0.8 * 0.5 * AREA.height());
    }

    #[test]
    fn a_screen_position_survives_the_way_into_the_world_and_back_and_is_that_of_clip_space() {
        let sight = Sight::new(&camera(), AREA);
        for position in [AREA.center(), pos2(210.0, 90.0), pos2(700.0, 555.0)] {
            let ray = sight.ray(position);
            let (back, _) = sight.project(ray.origin + 3.0 * ray.direction).unwrap();
            assert!((back - position).length() < 0.01);
            assert_eq!(sight.project(ray.origin - 3.0 * ray.direction), None);
        }
        let point = BALL.center + Vec3::new(0.4, -0.3, 0.2);
        let (position, depth) = sight.project(point).unwrap();
        let Viewpoint {
            camera,
            camera_to_world,
        } = sight.viewpoint();
        let (x, y) = camera
            .project(camera_to_world.inverse().transform_point3(point))
            .unwrap();
        assert!((AREA.min + vec2(x, y) - position).length() < 0.01);
        let clip = sight.clip_from_world() * point.extend(1.0);
        let screen = AREA.center() + vec2(clip.x, -clip.y) / clip.w * 0.5 * AREA.size();
        assert!((screen - position).length() < 0.01);
        // Nearer is greater.
        assert!((clip.w - depth).abs() < 1e-3 && (clip.z - NEAR).abs() < 1e-4);
    }

    #[test]
    fn zooming_keeps_what_is_under_the_cursor_at_the_pivots_depth() {
        let mut camera = camera();
        let cursor = pos2(800.0, 200.0);
        let ray = Sight::new(&camera, AREA).ray(cursor);
        let forward = camera.rotation() * Vec3::Z;
        let point = ray.origin + ray.direction * (camera.distance / ray.direction.dot(forward));
        let before = camera.distance;
        zoom_at(&mut camera, AREA, cursor, 1.5);
        let (after, _) = Sight::new(&camera, AREA).project(point).unwrap();
        assert!((after - cursor).length() < 0.05);
        assert!(camera.distance < before);
    }

    #[test]
    fn a_flight_starts_here_and_ends_there_by_the_shorter_turn() {
        let (from, mut to) = (camera(), camera());
        to.orbit(glam::vec2(-900.0, 100.0));
        to.pivot += Vec3::ONE;
        for (share, end) in [(0.0, &from), (1.0, &to)] {
            let camera = from.towards(&to, share);
            assert!(camera.eye().distance(end.eye()) < 1e-3);
            assert!(camera.rotation().angle_between(end.rotation()) < 1e-2);
        }
        let turned = from.towards(&to, 1.0).direction.yaw - from.direction.yaw;
        assert!(turned.abs() <= std::f32::consts::PI + 1e-3);
    }

    #[test]
    fn the_view_of_a_frame_is_from_where_it_was_taken_along_its_axis() {
        let rotation = Quat::from_rotation_y(0.8) * Quat::from_rotation_x(-0.4);
        let scene = scene_of(Affine3A::from_rotation_translation(
            rotation,
            Vec3::new(1.0, 2.0, 3.0),
        ));
        let camera = OrbitCamera::at_frame(&scene.frames[0], Quat::IDENTITY, 2.0);
        assert!(camera.eye().distance(Vec3::new(1.0, 2.0, 3.0)) < 1e-4);
        assert!(camera.rotation().angle_between(rotation) < 1e-3);
    }

    #[test]
    fn down_is_where_the_cameras_feet_are() {
        // A camera whose image is upright in a world whose z axis points up.
        let rotation = Mat3::from_cols(Vec3::X, Vec3::NEG_Z, Vec3::Y);
        let scene = scene_of(Affine3A::from_mat3(rotation));
        assert!((level_axes(&scene) * Vec3::Y).distance(Vec3::NEG_Z) < 1e-5);
    }

    fn scene_of(camera_to_world: Affine3A) -> Scene {
        let color = inplace_core::scene::ColorImage::new(4, 3, vec![0; 36]).unwrap();
        let mut scene = crate::tests::scene([color]);
        scene.frames[0].camera_to_world = camera_to_world;
        scene
    }
}
