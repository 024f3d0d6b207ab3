//! A keyframe at the size that it is matched at, and where its pixels lie in another.

use glam::{Mat3, Vec3};

use crate::scene::{Camera, ColorImage, Frame, ImageEdges};

/// Steps of [`View::grey`] in one of an 8-bit image.
const STEPS: f32 = 64.0;

/// A reduced image and its camera.
pub struct View {
    /// Pixels of the frame per pixel, along each axis.
    pub stride: u32,
    pub camera: Camera,
    rotation: Mat3,
    pub center: Vec3,
    /// Means of the pixels' luma, in 64ths of an 8-bit step, row-major `[height, width]`.
    grey: Vec<u16>,
    pub edges: ImageEdges,
    /// The pixels that show a part of the scene; `None` where all do.
    valid: Option<Vec<bool>>,
}

impl View {
    /// The frame at 1/`stride` of its resolution.
    pub fn new(frame: &Frame, color: &ColorImage, stride: u32) -> Self {
        let camera = frame.camera.reduced(stride);
        let means = color.reduced(stride);
        let luma = |[r, g, b]: &[f32; 3]| (STEPS * (0.299 * r + 0.587 * g + 0.114 * b)) as u16;
        let pixels = 0..camera.pixels();
        let is_valid = |at: usize| color.is_valid(frame.camera.middle_of_reduced(stride, at));
        Self {
            stride,
            camera,
            rotation: frame.camera_to_world.matrix3.into(),
            center: frame.center(),
            grey: means.iter().map(luma).collect(),
            edges: ImageEdges::new(&means, camera.width as usize),
            valid: (!frame.is_whole()).then(|| pixels.map(is_valid).collect()),
        }
    }

    /// Whether a pixel shows a part of the scene.
    pub fn is_valid(&self, index: usize) -> bool {
        self.valid.as_ref().is_none_or(|valid| valid[index])
    }

    /// Scale and offset from 64ths, as those in [quads](Self::quads), to luma in 8-bit steps around zero.
    pub const LUMA: (f32, f32) = (1.0 / STEPS, -128.0);

    /// Luma of the pixels in 8-bit steps, around zero.
    pub fn luma(&self) -> Vec<f32> {
        let (scale, offset) = Self::LUMA;
        let grey = self.grey.iter();
        grey.map(|&grey| f32::from(grey) * scale + offset).collect()
    }

    /// The luma of each pixel, of the one to its right, of the one below and of the one below that, 16 bits each from
    /// the lowest: one load gives all that interpolation needs.
    pub fn quads(&self) -> Vec<u64> {
        let width = self.camera.width as usize;
        let last_row = self.grey.len() - width;
        let quad = |at: usize| {
            let right = usize::from(!(at + 1).is_multiple_of(width));
            let below = if at < last_row { width } else { 0 };
            let corners = [at, at + right, at + below, at + below + right];
            let shifted = corners.iter().zip([0, 16, 32, 48]);
            shifted.fold(0, |quad, (&at, shift)| quad | u64::from(self.grey[at]) << shift)
        };
        (0..self.grey.len()).map(quad).collect()
    }

    /// World position of an image position at an inverse z-depth, per metre.
    pub fn place(&self, x: f32, y: f32, inverse: f32) -> Vec3 {
        self.center + self.rotation * (self.camera.direction(x, y) / inverse)
    }

    /// A world point in camera axes.
    pub fn local(&self, point: Vec3) -> Vec3 {
        self.rotation.transpose() * (point - self.center)
    }

    /// Unit direction of the optical axis.
    pub fn forward(&self) -> Vec3 {
        self.rotation.z_axis
    }
}

/// Where the pixels of one view lie in another: at `turn * (x, y, 1) + inverse z-depth * shift`, homogeneous.
#[derive(Clone, Copy)]
pub struct Warp {
    pub turn: Mat3,
    pub shift: Vec3,
}

impl Warp {
    pub fn new(from: &View, to: &View) -> Self {
        let Camera { fx, fy, cx, cy, .. } = to.camera;
        let intrinsics = Mat3::from_cols(
            Vec3::new(fx, 0.0, 0.0),
            Vec3::new(0.0, fy, 0.0),
            Vec3::new(cx, cy, 1.0),
        );
        let Camera { fx, fy, cx, cy, .. } = from.camera;
        let inverse = Mat3::from_cols(
            Vec3::new(1.0 / fx, 0.0, 0.0),
            Vec3::new(0.0, 1.0 / fy, 0.0),
            Vec3::new(-cx / fx, -cy / fy, 1.0),
        );
        let back = to.rotation.transpose();
        Self {
            turn: intrinsics * (back * from.rotation) * inverse,
            shift: intrinsics * (back * (from.center - to.center)),
        }
    }

    /// Image position in the other view, and the inverse z-depth there; `None` behind its camera.
    pub fn apply(&self, (x, y): (f32, f32), inverse: f32) -> Option<(f32, f32, f32)> {
        let at = self.turn * Vec3::new(x, y, 1.0) + inverse * self.shift;
        (at.z > 1e-6).then(|| (at.x / at.z, at.y / at.z, inverse / at.z))
    }

    /// Row-major index of the other view's pixel, and the inverse z-depth there; `None` outside of its image.
    pub fn pixel(&self, at: (f32, f32), inverse: f32, camera: &Camera) -> Option<(usize, f32)> {
        let (x, y, inverse) = self.apply(at, inverse)?;
        let inside = camera.contains(x, y);
        inside.then(|| (y as usize * camera.width as usize + x as usize, inverse))
    }
}
