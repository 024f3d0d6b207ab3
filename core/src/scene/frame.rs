//! One posed image and its depth.

use std::path::PathBuf;
use std::sync::Arc;

use glam::{Affine3A, Vec3, Vec3A};

use super::{Camera, FramePixels, Lens, Pixels, SceneError, Viewpoint};

/// Share of pixels with measured depth above which what is missing follows from what lies beside it.
const COMPLETE_DEPTH: f32 = 0.98;

/// Pixels of an image, a bit each by row-major index, up to the last of them.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct PixelSet(Vec<u64>);

impl PixelSet {
    fn insert(&mut self, index: usize) {
        if self.0.len() <= index / 64 {
            self.0.resize(index / 64 + 1, 0);
        }
        self.0[index / 64] |= 1 << (index % 64);
    }

    fn contains(&self, index: usize) -> bool {
        self.0
            .get(index / 64)
            .is_some_and(|word| word >> (index % 64) & 1 == 1)
    }

    fn len(&self) -> usize {
        self.0.iter().map(|word| word.count_ones() as usize).sum()
    }

    /// The pixels in order.
    fn iter(&self) -> impl Iterator<Item = usize> + '_ {
        self.0.iter().enumerate().flat_map(|(number, &word)| {
            // The lowest bit of what is left, which is then cleared.
            let left = std::iter::successors(Some(word), |left| Some(left & left.wrapping_sub(1)));
            let bits = left.take_while(|&left| left != 0).map(u64::trailing_zeros);
            bits.map(move |bit| 64 * number + bit as usize)
        })
    }
}

/// A colour image: 8-bit sRGB, row-major `[height, width, 3]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ColorImage {
    width: u32,
    height: u32,
    rgb: Vec<u8>,
    /// The pixels that alpha or a mask hides: no part of the scene.
    hidden: PixelSet,
    /// The pixels beyond the image on disk, which a lens bent.
    beyond: PixelSet,
}

impl ColorImage {
    /// Wraps row-major RGB bytes; `None` unless there are `width * height * 3` of them.
    pub fn new(width: u32, height: u32, rgb: Vec<u8>) -> Option<Self> {
        (rgb.len() == width as usize * height as usize * 3).then_some(Self {
            width,
            height,
            rgb,
            hidden: PixelSet::default(),
            beyond: PixelSet::default(),
        })
    }

    /// The same image with these pixels, by row-major index, hidden as well: black, and no part of the scene.
    pub fn hiding(mut self, hidden: impl Fn(usize) -> bool) -> Self {
        for (index, pixel) in self.rgb.chunks_exact_mut(3).enumerate() {
            if hidden(index) {
                self.hidden.insert(index);
                pixel.fill(0);
            }
        }
        self
    }

    /// The same image, of which these pixels, by row-major index, lie beyond the image on disk.
    pub(super) fn lacking(mut self, beyond: impl IntoIterator<Item = usize>) -> Self {
        beyond.into_iter().for_each(|index| self.beyond.insert(index));
        self
    }

    /// Whether alpha or a mask hides the pixel with this row-major index.
    pub fn is_hidden(&self, index: usize) -> bool {
        self.hidden.contains(index)
    }

    /// Whether the pixel with this row-major index shows a part of the scene: it is neither hidden nor beyond the image
    /// on disk. The colours of others mean nothing.
    pub fn is_valid(&self, index: usize) -> bool {
        !self.hidden.contains(index) && !self.beyond.contains(index)
    }

    /// The pixels that are not [valid](Self::is_valid); some may come twice.
    pub(crate) fn invalid(&self) -> impl Iterator<Item = usize> + '_ {
        self.hidden.iter().chain(self.beyond.iter())
    }

    /// Number of the hidden pixels.
    pub(super) fn hidden(&self) -> usize {
        self.hidden.len()
    }

    /// Row-major indices of the hidden pixels, ascending.
    pub fn hidden_pixels(&self) -> impl Iterator<Item = usize> + '_ {
        self.hidden.iter()
    }

    /// An image without light.
    pub(super) fn black(width: u32, height: u32) -> Self {
        Self {
            width,
            height,
            rgb: vec![0; width as usize * height as usize * 3],
            hidden: PixelSet::default(),
            beyond: PixelSet::default(),
        }
    }

    /// Image width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Image height in pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// All bytes, row-major `[height, width, 3]`.
    pub fn bytes(&self) -> &[u8] {
        &self.rgb
    }

    /// The bytes of the pixel with this row-major index.
    pub fn pixel(&self, index: usize) -> [u8; 3] {
        let bytes = &self.rgb[3 * index..3 * index + 3];
        [bytes[0], bytes[1], bytes[2]]
    }

    /// The colour of the pixel with this row-major index, each channel in 0..=1.
    pub fn color(&self, index: usize) -> Vec3 {
        let [r, g, b] = self.pixel(index);
        Vec3::new(f32::from(r), f32::from(g), f32::from(b)) / 255.0
    }

    /// Mean bytes of the pixels of each block of `stride` x `stride`, row-major, with what remains at the right and at the
    /// bottom as smaller blocks.
    pub(crate) fn reduced(&self, stride: u32) -> Vec<[f32; 3]> {
        let (width, stride) = (self.width as usize, stride as usize);
        let mut means = Vec::new();
        // Of a column of each channel.
        let mut sums = vec![0_u32; 3 * width];
        for rows in self.rgb.chunks(3 * width * stride) {
            sums.fill(0);
            for row in rows.chunks_exact(3 * width) {
                for (sum, &value) in sums.iter_mut().zip(row) {
                    *sum += u32::from(value);
                }
            }
            for columns in sums.chunks(3 * stride) {
                let mut sum = [0; 3];
                for column in columns.chunks_exact(3) {
                    for (sum, value) in sum.iter_mut().zip(column) {
                        *sum += value;
                    }
                }
                let count = (rows.len() / (3 * width) * columns.len() / 3) as f32;
                means.push(sum.map(|sum| sum as f32 / count));
            }
        }
        means
    }
}

/// Distances along the rays of a frame's pixels, in metres, row-major `[height, width]`; 0 = unknown.
///
/// Kept as 16-bit steps, so that a thousand frames fit in memory: at 10 m the
/// step is 0.15 mm.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthMap {
    width: u32,
    unit: f32,
    steps: Vec<u16>,
}

impl DepthMap {
    /// Packs ray lengths in metres; values that are not positive and finite become unknown.
    pub fn from_ray_lengths(width: u32, lengths: &[f32]) -> Self {
        let valid = |v: f32| v.is_finite() && v > 0.0;
        let farthest = lengths.iter().copied().filter(|&v| valid(v)).fold(0.0, f32::max);
        let unit = (farthest / 65535.0).max(f32::MIN_POSITIVE);
        let packed = |&v: &f32| match valid(v) {
            true => ((v / unit).round() as u16).max(1),
            false => 0,
        };
        let steps = lengths.iter().map(packed).collect();
        Self { width, unit, steps }
    }

    /// Converts z-depths in metres (0 = unknown) of the given camera to ray lengths.
    pub fn from_z_depths(camera: &Camera, mut z: Vec<f32>) -> Self {
        for (index, value) in z.iter_mut().enumerate() {
            *value *= camera.direction_at(index).length();
        }
        Self::from_ray_lengths(camera.width, &z)
    }

    /// Image width in pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.steps.len()
    }

    /// Whether the map has no pixels.
    pub fn is_empty(&self) -> bool {
        self.steps.is_empty()
    }

    /// Distance along the ray of the pixel with this row-major index, in metres; `None` = unknown.
    pub fn ray_length(&self, index: usize) -> Option<f32> {
        match self.steps[index] {
            0 => None,
            steps => Some(f32::from(steps) * self.unit),
        }
    }

    /// About `count` pixels, evenly spread over their row-major indices: those of known depth, each with its ray length in
    /// metres.
    pub(crate) fn sampled(&self, count: usize) -> impl Iterator<Item = (usize, f32)> + '_ {
        let stride = (self.len() / count).max(1) | 1;
        let pixels = (0..self.len()).step_by(stride);
        pixels.filter_map(|index| Some((index, self.ray_length(index)?)))
    }

    /// Share of the pixels whose depth is known, 0..=1.
    pub fn coverage(&self) -> f32 {
        let known = self.steps.iter().filter(|&&s| s > 0).count();
        known as f32 / self.steps.len().max(1) as f32
    }
}

/// A point of the scene that many frames agree on, as one frame sees it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SparsePoint {
    /// Row-major index of the pixel that shows it.
    pub pixel: u32,
    /// Distance from the camera's centre, in metres.
    pub length: f32,
    /// Distance between where the frame shows it and where its position projects to, in pixels of the image
    /// on disk.
    pub error: f32,
    /// Whether stereo found it: such points are less exact than those of a structure from motion.
    pub by_stereo: bool,
}

/// One posed image of the scene, without lens distortion.
#[derive(Clone, Debug)]
pub struct Frame {
    /// File stem of the colour image: the frame's name everywhere.
    pub stem: String,
    /// The colour image on disk; empty for the demo scene.
    pub path: PathBuf,
    /// Intrinsics.
    pub camera: Camera,
    /// Camera-to-world, rigid, relative to [`Scene::origin`](super::Scene::origin), in metres.
    pub camera_to_world: Affine3A,
    /// Colours and, where the capture has it, measured depth: in memory for a keyframe, else read when wanted.
    pub pixels: FramePixels,
    /// Points that a structure-from-motion found, where the capture has them; at most one for a pixel.
    pub points: Vec<SparsePoint>,
    /// The lens that the image on disk was taken with; `None` where that image is this one.
    pub lens: Option<Lens>,
}

impl Frame {
    /// Whether the pixels stay in memory: such frames teach the field and make the surface.
    pub fn is_keyframe(&self) -> bool {
        self.pixels.are_in_memory()
    }

    /// Colours and measured depth; of a frame that is no keyframe they are read from its files, unless that was done
    /// lately.
    ///
    /// # Errors
    /// A file that can no longer be read.
    pub fn pixels(&self) -> Result<Pixels, SceneError> {
        self.pixels.get()
    }

    /// Colours and measured depth, as far as no file has to be read for them.
    pub fn pixels_at_hand(&self) -> Option<Pixels> {
        self.pixels.at_hand()
    }

    /// The colour image. It is black where the file can no longer be read: [`Frame::pixels`] says why.
    pub fn color(&self) -> Arc<ColorImage> {
        match self.pixels() {
            Ok(pixels) => pixels.color,
            Err(_) => Arc::new(ColorImage::black(self.camera.width, self.camera.height)),
        }
    }

    /// Measured depth, where the capture has it. `None` too where the file can no longer be read:
    /// [`Frame::pixels`] says why.
    pub fn depth(&self) -> Option<Arc<DepthMap>> {
        let pixels = self.has_depth().then(|| self.pixels())?;
        pixels.ok()?.depth
    }

    /// Colour of the pixel with this row-major index, each channel in 0..=1. For single pixels: nothing is shared or
    /// copied for it, as [`Frame::color`] does. Black as there, where the file can no longer be read.
    pub fn color_of(&self, index: usize) -> Vec3 {
        let color = self.pixels.look(|pixels| pixels.color.color(index));
        color.unwrap_or(Vec3::ZERO)
    }

    /// Measured distance along the ray of the pixel with this row-major index, in metres; `None` = unknown. For single
    /// pixels, as [`Frame::color_of`].
    pub fn ray_length(&self, index: usize) -> Option<f32> {
        let length = |pixels: &Pixels| pixels.depth.as_ref()?.ray_length(index);
        let looked = self.has_depth().then(|| self.pixels.look(length))?;
        looked.ok()?
    }

    /// Whether the capture has measured depth of this frame.
    pub fn has_depth(&self) -> bool {
        self.pixels.coverage.is_some()
    }

    /// Share of the pixels whose measured depth is known, 0..=1; `None` without depth.
    pub fn depth_coverage(&self) -> Option<f32> {
        self.pixels.coverage
    }

    /// Whether nearly all pixels have measured depth, so that nothing else has to be asked for theirs.
    pub fn has_complete_depth(&self) -> bool {
        self.depth_coverage()
            .is_some_and(|coverage| coverage >= COMPLETE_DEPTH)
    }

    /// Takes another image in place of the colours; the pixels stay in memory from now on.
    pub fn set_color(&mut self, color: ColorImage) {
        let depth = self.depth();
        let color = Arc::new(color);
        self.pixels = Pixels { color, depth }.into();
    }

    /// Takes another depth, or none, in place of the measured one; the pixels stay in memory from now on.
    pub fn set_depth(&mut self, depth: Option<DepthMap>) {
        let color = self.color();
        let depth = depth.map(Arc::new);
        self.pixels = Pixels { color, depth }.into();
    }

    /// The same frame without its sparse points, which can be many.
    pub(crate) fn without_points(&self) -> Self {
        Self {
            stem: self.stem.clone(),
            path: self.path.clone(),
            camera: self.camera,
            camera_to_world: self.camera_to_world,
            pixels: self.pixels.clone(),
            points: Vec::new(),
            lens: self.lens,
        }
    }

    /// Size and intrinsics of the image on disk, which labels are exchanged with.
    pub fn image(&self) -> &Camera {
        self.lens.as_ref().map_or(&self.camera, |lens| &lens.image)
    }

    /// Whether the pixel with this row-major index shows a part of the scene, as by [`ColorImage::is_valid`]. For single
    /// pixels, as [`Frame::color_of`].
    pub fn is_valid(&self, index: usize) -> bool {
        self.is_whole()
            || self
                .pixels
                .look(|pixels| pixels.color.is_valid(index))
                .unwrap_or(false)
    }

    /// Row-major indices of the pixels that alpha or masks hide, ascending. No file is read where there are none.
    pub fn hidden_pixels(&self) -> Vec<usize> {
        if self.pixels.hidden > 0 {
            self.color().hidden_pixels().collect()
        } else {
            Vec::new()
        }
    }

    /// Whether every pixel is [valid](Self::is_valid) because nothing bends lines or hides pixels.
    pub fn is_whole(&self) -> bool {
        self.lens.is_none() && self.pixels.hidden == 0
    }

    /// The pixel `[column, row]` of the image on disk at the centre of a pixel of this frame.
    pub fn to_image(&self, pixel: [u32; 2]) -> Option<[u32; 2]> {
        to_image(&self.camera, self.lens.as_ref(), pixel)
    }

    /// The pixel `[column, row]` of this frame at the centre of a pixel of the image on disk.
    pub fn of_image(&self, pixel: [u32; 2]) -> Option<[u32; 2]> {
        let Some(lens) = &self.lens else {
            return Some(pixel);
        };
        let [x, y] = pixel.map(|v| f64::from(v) + 0.5);
        let (x, y) = lens.to_pinhole(&self.camera, x, y)?;
        Some([x as u32, y as u32])
    }

    /// Where the frame was taken, and by which camera.
    pub fn viewpoint(&self) -> Viewpoint {
        Viewpoint {
            camera: self.camera,
            camera_to_world: self.camera_to_world,
        }
    }

    /// The camera's centre in the world, in metres.
    pub fn center(&self) -> Vec3 {
        self.camera_to_world.translation.into()
    }

    /// Unit direction, in the world, of the ray through the centre of the pixel with this row-major index.
    pub fn ray_direction(&self, index: usize) -> Vec3 {
        let direction = self.camera.direction_at(index);
        Vec3::from(self.camera_to_world.matrix3 * Vec3A::from(direction)).normalize()
    }

    /// World position at this distance, in metres, along the ray through the centre of the pixel with this row-major index.
    pub fn place(&self, index: usize, length: f32) -> Vec3 {
        self.center() + length * self.ray_direction(index)
    }

    /// Image position (x, y) and ray length of a world point; `None` outside the image or behind the camera.
    pub fn project(&self, point: Vec3) -> Option<(f32, f32, f32)> {
        let local = self.camera_to_world.matrix3.transpose()
            * (Vec3A::from(point) - self.camera_to_world.translation);
        let (x, y) = self.camera.project(local.into())?;
        self.camera.contains(x, y).then(|| (x, y, local.length()))
    }
}

/// The pixel `[column, row]` of the image on disk, taken with `lens`, at the centre of a pixel of a frame with this camera.
pub(super) fn to_image(camera: &Camera, lens: Option<&Lens>, pixel: [u32; 2]) -> Option<[u32; 2]> {
    let Some(lens) = lens else {
        return Some(pixel);
    };
    let [x, y] = pixel.map(|v| f64::from(v) + 0.5);
    let (x, y) = lens.to_image(camera, x, y)?;
    // Up to half a pixel beyond the border is still the border's.
    let inside = |v: f64, size: u32| (v.max(0.0) as u32).min(size - 1);
    Some([inside(x, lens.image.width), inside(y, lens.image.height)])
}
