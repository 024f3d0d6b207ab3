//! Pinhole cameras and their poses.

use glam::{Affine3A, DAffine3, DMat3, DVec2, DVec3, Vec3};

use super::LARGEST_SIDE;
use super::error::NOT_FINITE;
use super::pixel_errors::median;

/// Longest side of the box around the cameras of a capture that is scaled by them, in metres.
const CAMERA_EXTENT: f64 = 2.0;

/// Where tracking failed, a few cameras are far away from where they were: at most one in so many at each end of an axis,
/// beyond a gap of so many times what most cameras span.
const LOST: usize = 20;
const GAP: f64 = 10.0;
/// The narrowest such gap, in metres: where most cameras are in one place, others may be some steps away.
pub const NARROWEST_GAP: f64 = 10.0;

/// Moving by so many metres changes what a camera sees as much as turning by a radian does: a usual distance of what
/// it sees in a room.
const METRES_PER_RADIAN: f32 = 2.5;

/// Farthest that a camera, or what it sees, may be from zero along an axis, in metres or whatever the capture's unit
/// is: far beyond every capture, and near enough for sums and squares in single precision.
pub const FARTHEST: f64 = 1e12;
/// Largest distance from the optical axis that an image may show, at a distance of 1 along it: 89.9 degrees.
const WIDEST: f32 = 600.0;

/// A pinhole camera: intrinsics in pixels, without distortion.
///
/// Axes are OpenCV's (x right, y down, z forward); the centre of pixel (column, row) is at
/// (column + 0.5, row + 0.5).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    /// Image width in pixels.
    pub width: u32,
    /// Image height in pixels.
    pub height: u32,
    /// Focal length along x, in pixels.
    pub fx: f32,
    /// Focal length along y, in pixels.
    pub fy: f32,
    /// Principal point, x, in pixels from the left edge of the image.
    pub cx: f32,
    /// Principal point, y, in pixels from the top edge of the image.
    pub cy: f32,
}

impl Camera {
    /// A camera of images of this width and height, with its intrinsics fx, fy, cx, cy in pixels.
    pub const fn new([width, height]: [u32; 2], [fx, fy, cx, cy]: [f32; 4]) -> Self {
        Self {
            width,
            height,
            fx,
            fy,
            cx,
            cy,
        }
    }

    /// The same, if such a camera can be used.
    ///
    /// # Errors
    /// What is wrong with these values.
    pub(super) fn checked(size: [u32; 2], intrinsics: [f64; 4]) -> Result<Self, String> {
        let camera = Self::new(size, intrinsics.map(|value| value as f32));
        match camera.problem() {
            None => Ok(camera),
            Some(problem) => Err(problem.to_owned()),
        }
    }

    /// A camera with square pixels, a centred principal point and the given horizontal field of view.
    pub fn with_horizontal_fov(width: u32, height: u32, degrees: f32) -> Self {
        let focal = 0.5 * width as f32 / (0.5 * degrees.to_radians()).tan();
        let center = [width, height].map(|side| 0.5 * side as f32);
        Self::new([width, height], [focal, focal, center[0], center[1]])
    }

    /// Focal lengths and principal point along x and y, in pixels.
    pub(super) fn intrinsics(&self) -> (DVec2, DVec2) {
        let [fx, fy, cx, cy] = [self.fx, self.fy, self.cx, self.cy].map(f64::from);
        (DVec2::new(fx, fy), DVec2::new(cx, cy))
    }

    /// Number of pixels.
    pub fn pixels(&self) -> usize {
        self.width as usize * self.height as usize
    }

    /// Direction through image position (x, y), in camera axes, with z = 1 (not of unit length).
    pub fn direction(&self, x: f32, y: f32) -> Vec3 {
        Vec3::new((x - self.cx) / self.fx, (y - self.cy) / self.fy, 1.0)
    }

    /// Direction through the centre of pixel (column, row), in camera axes, with z = 1.
    pub fn pixel_direction(&self, column: u32, row: u32) -> Vec3 {
        self.direction(column as f32 + 0.5, row as f32 + 0.5)
    }

    /// The same of the pixel with this row-major index.
    pub fn direction_at(&self, index: usize) -> Vec3 {
        let (x, y) = self.center_of(index);
        self.direction(x, y)
    }

    /// Image position of the centre of the pixel with this row-major index.
    pub(crate) fn center_of(&self, index: usize) -> (f32, f32) {
        let (column, row) = (index as u32 % self.width, index as u32 / self.width);
        (column as f32 + 0.5, row as f32 + 0.5)
    }

    /// Whether image position (x, y) is inside the image.
    pub(crate) fn contains(&self, x: f32, y: f32) -> bool {
        x >= 0.0 && y >= 0.0 && x < self.width as f32 && y < self.height as f32
    }

    /// Row-major indices of the pixels that share a side with the one that has this index.
    pub(crate) fn beside(&self, index: usize) -> impl Iterator<Item = usize> {
        let width = self.width as usize;
        let column = index % width;
        let neighbours = [
            (column > 0).then(|| index - 1),
            (column + 1 < width).then_some(index + 1),
            index.checked_sub(width),
            Some(index + width).filter(|&below| below < self.pixels()),
        ];
        neighbours.into_iter().flatten()
    }

    /// Image position of a point in camera axes; `None` behind the camera.
    pub fn project(&self, point: Vec3) -> Option<(f32, f32)> {
        (point.z > 1e-6).then(|| {
            (
                self.fx * point.x / point.z + self.cx,
                self.fy * point.y / point.z + self.cy,
            )
        })
    }

    /// The same view at 1/`stride` of the resolution, rounded up.
    pub fn reduced(&self, stride: u32) -> Self {
        let width = self.width.div_ceil(stride);
        let height = self.height.div_ceil(stride);
        self.scaled([width, height], [1.0 / stride as f32; 2])
    }

    /// Row-major index of the pixel in the middle of those that are one pixel, by row-major index, of the view
    /// [reduced](Self::reduced) by `stride`.
    pub fn middle_of_reduced(&self, stride: u32, reduced: usize) -> usize {
        let width = self.width.div_ceil(stride);
        let middle = |at: u32, limit: u32| (at * stride + stride / 2).min(limit - 1);
        let (column, row) = (reduced as u32 % width, reduced as u32 / width);
        (middle(row, self.height) * self.width + middle(column, self.width)) as usize
    }

    /// The same view as an image of another width and height in pixels; `None` for other proportions, as of a part of
    /// it, beyond the pixel that rounding may cost.
    pub fn resized(&self, width: u32, height: u32) -> Option<Self> {
        let is_whole = has_proportions([width, height], [self.width, self.height]);
        is_whole.then(|| self.stretched(width, height))
    }

    /// The camera of images that were stretched to this width and height in pixels, each axis by itself.
    pub fn stretched(&self, width: u32, height: u32) -> Self {
        let (x, y) = (
            width as f32 / self.width as f32,
            height as f32 / self.height as f32,
        );
        self.scaled([width, height], [x, y])
    }

    fn scaled(&self, size: [u32; 2], [x, y]: [f32; 2]) -> Self {
        Self::new(size, [self.fx * x, self.fy * y, self.cx * x, self.cy * y])
    }

    /// What is wrong with these intrinsics, if anything: part of a sentence.
    pub fn problem(&self) -> Option<&'static str> {
        let values = [self.fx, self.fy, self.cx, self.cy];
        if self.width == 0 || self.height == 0 {
            Some("the image size is zero")
        } else if values.iter().any(|v| !v.is_finite()) {
            Some("a value is not a finite number")
        } else if self.fx <= 0.0 || self.fy <= 0.0 {
            Some("a focal length is zero or negative")
        } else {
            let corners = [(0, 0), (self.width - 1, self.height - 1)];
            let directions = corners.map(|(column, row)| self.pixel_direction(column, row));
            let is_too_wide = directions.iter().any(|d| d.abs().max_element() > WIDEST);
            is_too_wide.then_some("it looks farther to a side than a pinhole camera can")
        }
    }
}

/// A camera at its place: all that a view of a scene depends on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Viewpoint {
    /// Size of the image and intrinsics.
    pub camera: Camera,
    /// Camera-to-world pose: rotation, and position in metres relative to the scene's origin.
    pub camera_to_world: Affine3A,
}

impl Viewpoint {
    /// The camera's centre in the world, in metres.
    pub(crate) fn center(&self) -> Vec3 {
        self.camera_to_world.translation.into()
    }

    /// How much the view changes from one to another, in radians.
    pub(crate) fn distance(&self, other: &Self) -> f32 {
        let [own, other] = [self, other].map(|view| view.camera_to_world);
        let turned = own.matrix3.z_axis.angle_between(other.matrix3.z_axis);
        turned.hypot(own.translation.distance(other.translation) / METRES_PER_RADIAN)
    }
}

/// Whether an image of this width and height in pixels can show the same as one of that size: their proportions differ by
/// less than the pixel that rounding may cost.
pub(crate) fn has_proportions(size: [u32; 2], that: [u32; 2]) -> bool {
    let [[width, height], [own_width, own_height]] = [size, that].map(|size| size.map(u64::from));
    let difference = (width * own_height).abs_diff(height * own_width);
    !size.contains(&0) && difference < own_width.max(own_height)
}

/// Of `to` pixels along an axis the one over the centre of pixel `at` of `from`.
pub(crate) fn sampled(at: u32, from: u32, to: u32) -> u32 {
    let place = (2 * u64::from(at) + 1) * u64::from(to) / (2 * u64::from(from));
    place.min(u64::from(to) - 1) as u32
}

/// These numbers as the width and height of an image in pixels; `None` where no image has that size.
pub fn image_size(size: [f64; 2]) -> Option<[u32; 2]> {
    let is_side = |v: f64| v >= 1.0 && v <= LARGEST_SIDE as f64 && v.fract() == 0.0;
    size.into_iter().all(is_side).then(|| size.map(|v| v as u32))
}

/// A camera-to-world matrix, which must be finite and rigid; or what is wrong with it.
pub fn rigid(camera_to_world: DAffine3) -> Result<DAffine3, &'static str> {
    if !camera_to_world.is_finite() {
        return Err(NOT_FINITE);
    }
    if camera_to_world.translation.abs().max_element() > FARTHEST {
        return Err("its position is too far from zero");
    }
    let rotation = camera_to_world.matrix3;
    let deviation = rotation.transpose() * rotation - DMat3::IDENTITY;
    let is_orthonormal = deviation.to_cols_array().iter().all(|v| v.abs() <= 1e-2);
    if !is_orthonormal || rotation.determinant() < 0.0 {
        return Err("its rotation part is not a rotation");
    }
    Ok(camera_to_world)
}

/// A pose in the coordinates and the unit of a capture, camera-to-world, in metres relative to `origin`; `unit` is the
/// length of a metre in the capture's unit.
pub fn placed(camera_to_world: &DAffine3, origin: DVec3, unit: f64) -> Affine3A {
    Affine3A::from_mat3_translation(
        orthonormalised(camera_to_world.matrix3).as_mat3(),
        ((camera_to_world.translation - origin) / unit).as_vec3(),
    )
}

/// The rotation nearest to an almost orthonormal matrix (Gram-Schmidt on its columns).
fn orthonormalised(rotation: DMat3) -> DMat3 {
    let z = rotation.z_axis.normalize();
    let x: DVec3 = (rotation.x_axis - z * z.dot(rotation.x_axis)).normalize();
    DMat3::from_cols(x, z.cross(x), z)
}

/// The median of positions, axis by axis; zero where there are none.
pub fn median_position(positions: impl Iterator<Item = DVec3> + Clone) -> DVec3 {
    let middle = |axis: usize| median(positions.clone().map(|position| position[axis])).unwrap_or(0.0);
    DVec3::new(middle(0), middle(1), middle(2))
}

/// The lowest and the highest corner of the box around camera positions, without the few of them that are lost: those beyond
/// a gap along an axis, which has at least this width. Zero where there are none.
pub fn box_around(positions: impl Iterator<Item = DVec3> + Clone, narrowest_gap: f64) -> [DVec3; 2] {
    let sorted = [0, 1, 2].map(|axis: usize| {
        let mut values: Vec<f64> = positions.clone().map(|position| position[axis]).collect();
        values.sort_by(f64::total_cmp);
        values
    });
    let span_of_most = |values: &Vec<f64>| {
        let few = values.len() / LOST;
        let ends = values.get(few).zip(values.iter().nth_back(few));
        ends.map_or(0.0, |(low, high)| high - low)
    };
    let span = sorted.iter().map(span_of_most).fold(0.0, f64::max);
    let gap = narrowest_gap.max(GAP * span);
    let [x, y, z] = sorted.map(|values| {
        let together = values.chunk_by(|a, b| b - a <= gap);
        let kept = together.max_by_key(|values| values.len());
        kept.map_or([0.0; 2], |kept| [kept[0], kept[kept.len() - 1]])
    });
    [DVec3::new(x[0], y[0], z[0]), DVec3::new(x[1], y[1], z[1])]
}

/// The length of a metre, in the unit of these camera positions, that lets them span 2 m: for captures
/// whose scale is arbitrary. 1 where they are all in one place. The gap is that of [`box_around`].
pub fn unit_of_cameras(positions: impl Iterator<Item = DVec3> + Clone, narrowest_gap: f64) -> f64 {
    let [low, high] = box_around(positions, narrowest_gap);
    let unit = (high - low).max_element() / CAMERA_EXTENT;
    if unit.is_finite() && unit > 0.0 { unit } else { 1.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_size_of_the_same_proportions_scales_the_intrinsics() {
        let camera = Camera {
            cx: 330.0,
            ..Camera::with_horizontal_fov(640, 480, 90.0)
        };
        let half = camera.resized(320, 240).unwrap();
        assert_eq!((half.fx, half.fy, half.cx, half.cy), (160.0, 160.0, 165.0, 120.0));
        // A third of 640 is rounded; ScanNet's colour is not 4:3, though nearly.
        assert!(camera.resized(213, 160).is_some());
        assert_eq!(camera.resized(1296, 968), None);
        assert_eq!(camera.resized(480, 640), None);
        for (size, rounded) in [([1920, 1080], [275, 154]), ([1080, 1920], [154, 275])] {
            assert!(has_proportions(rounded, size), "{size:?}");
            assert!(!has_proportions([150, 150], size), "{size:?}");
            assert!(!has_proportions([1, 0], size), "{size:?}");
        }
    }

    #[test]
    fn an_image_has_whole_numbers_of_pixels_and_not_too_many() {
        assert_eq!(image_size([1.0, 65535.0]), Some([1, 65535]));
        for side in [0.0, -4.0, 0.5, 65536.0, f64::NAN, f64::INFINITY] {
            assert_eq!(image_size([side, 480.0]), None, "{side}");
            assert_eq!(image_size([640.0, side]), None, "{side}");
        }
    }

    /// Camera positions at these places along y.
    fn line(places: impl IntoIterator<Item = f64>) -> Vec<DVec3> {
        let places = places.into_iter();
        places.map(|y| DVec3::new(1.0, y, -2.0)).collect()
    }

    #[test]
    fn a_few_cameras_far_from_all_others_are_lost_and_those_of_a_walk_are_not() {
        let ends = |positions: &[DVec3], gap: f64| {
            let [low, high] = box_around(positions.iter().copied(), gap);
            assert_eq!([low.x, high.x, low.z, high.z], [1.0, 1.0, -2.0, -2.0]);
            [low.y, high.y]
        };
        let around = |more: &[f64]| {
            let room = (0..40).map(|k| 0.1 * f64::from(k));
            line(room.chain(more.iter().copied()))
        };
        let room = ends(&around(&[]), 0.0);
        assert_eq!(room, [0.0, 0.1 * 39.0]);
        for gap in [0.0, NARROWEST_GAP] {
            assert_eq!(ends(&around(&[500.0]), gap), room);
            assert_eq!(ends(&around(&[-60.0, 500.0, -700.0]), gap), room);
        }
        // A tenth of the cameras is another place, and of ten, of few metres or upstairs nobody can tell.
        let another = [500.0; 4];
        assert_eq!(ends(&around(&another), 0.0)[1], 500.0);
        let ten = line((0_i32..9).map(f64::from).chain([500.0]));
        assert_eq!(ends(&ten, 0.0), [0.0, 500.0]);
        let corridor = line((0..100).map(|k| 2.0 * f64::from(k)));
        assert_eq!(ends(&corridor, 0.0), [0.0, 198.0]);
        let few_steps = line([0.0; 97].into_iter().chain([1.0, 2.0, 9.0]));
        assert_eq!(ends(&few_steps, NARROWEST_GAP), [0.0, 9.0]);
        let mut upstairs = around(&[]);
        upstairs[39].z = 12.0;
        assert_eq!(box_around(upstairs.into_iter(), 0.0)[1].z, 12.0);

        let unit = |positions: Vec<DVec3>| unit_of_cameras(positions.into_iter(), 0.0);
        assert_eq!(unit(around(&[500.0])), unit(around(&[])));
        assert_eq!(unit(Vec::new()), 1.0);
    }

    #[test]
    fn a_camera_has_rays_for_all_of_its_pixels() {
        let camera = Camera::with_horizontal_fov(320, 240, 150.0);
        assert_eq!(camera.problem(), None);
        for (fx, cx) in [(1e-30, 160.0), (160.0, 1e30), (f32::MIN_POSITIVE, 0.5)] {
            assert!(Camera { fx, cx, ..camera }.problem().is_some(), "{fx} {cx}");
        }
    }
}
