//! Captures that do not fit in memory: the frames whose pixels stay there, and how they are chosen.

use std::sync::Arc;

use rayon::prelude::*;

use super::cache::Cache;
use super::pixels::{FirstReading, FramePixels, OnDisk, Pixels, Unread};
use super::{Bounds, Camera, ColorImage, Frame, OpenOptions, Scene, SceneError, Viewpoint};

/// Bytes of the pixels read last of frames that are no keyframes.
const CACHE_BYTES: usize = 128 << 20;
/// A frame that is nearer than this to a keyframe, in radians, shows nothing new.
const NOTHING_NEW: f32 = 0.005;
/// The sharpest of so many frames before and after is taken, as far as they are nearer than this share of the distance
/// to the next keyframe.
const WINDOW: usize = 3;
const WINDOW_SHARE: f32 = 0.5;
/// Images are reduced to about this width before their sharpness is measured, in pixels: noise vanishes, blur stays.
const SHARPNESS_WIDTH: u32 = 320;

/// Bytes that a frame's pixels take in memory.
fn bytes(camera: &Camera, has_depth: bool) -> u64 {
    let of_pixel = if has_depth { 3 + size_of::<u16>() } else { 3 };
    (camera.pixels() * of_pixel) as u64
}

/// What happens to the pixels of frames while a capture is read: all stay in memory, or none until the keyframes are
/// chosen.
pub(super) struct Keeping {
    everything: bool,
    cache: Arc<Cache<Pixels>>,
}

impl Keeping {
    /// For frames with these cameras, each with whether it has measured depth.
    pub fn of<'a>(frames: impl Iterator<Item = (&'a Camera, bool)>, options: OpenOptions) -> Self {
        let total: u64 = frames.map(|(camera, has_depth)| bytes(camera, has_depth)).sum();
        Self {
            everything: total <= options.image_bytes,
            cache: Arc::new(Cache::new(CACHE_BYTES)),
        }
    }

    /// The pixels of frame `number` before it is read.
    pub fn unread(&self, number: usize, files: Arc<Unread>, has_depth: bool) -> FramePixels {
        if self.everything {
            return FramePixels::unread(files, has_depth);
        }
        let place = OnDisk {
            number,
            sharpness: 0.0,
            decode: Box::new(move || files.pixels(files.read())),
            cache: Arc::clone(&self.cache),
        };
        FramePixels::on_disk(has_depth.then_some(1.0), 0, place)
    }

    /// Reads a frame for the first time; whoever looks at it meanwhile shares what stays in memory.
    pub fn read(&self, files: &Unread) -> FirstReading {
        if self.everything {
            files.shared()
        } else {
            files.read()
        }
    }

    /// What becomes of the pixels of frame `number` that were just read; `again` reads them once more.
    pub fn keep(
        &self,
        number: usize,
        pixels: Pixels,
        again: impl Fn() -> Result<Pixels, SceneError> + Send + Sync + 'static,
    ) -> FramePixels {
        if self.everything {
            return pixels.into();
        }
        let coverage = pixels.depth.as_ref().map(|depth| depth.coverage());
        let place = OnDisk {
            number,
            sharpness: sharpness(&pixels.color),
            decode: Box::new(again),
            cache: Arc::clone(&self.cache),
        };
        FramePixels::on_disk(coverage, pixels.color.hidden(), place)
    }
}

/// Chooses the keyframes of a scene that does not stay in memory as a whole, and reads their pixels to stay.
///
/// # Errors
/// A keyframe's files can no longer be read.
pub(super) fn choose(scene: &mut Scene, options: OpenOptions) -> Result<(), SceneError> {
    let frames = &mut scene.frames;
    let sharpness: Vec<f32> = frames
        .iter()
        .filter_map(|frame| frame.pixels.sharpness())
        .collect();
    if sharpness.len() < frames.len() || frames.is_empty() {
        return Ok(());
    }
    let views: Vec<Viewpoint> = frames.iter().map(Frame::viewpoint).collect();
    let sizes: Vec<u64> = frames
        .iter()
        .map(|frame| bytes(&frame.camera, frame.has_depth()))
        .collect();
    let chosen = spread_out(&views, &sharpness, &sizes, options.image_bytes);
    let read: Vec<(usize, Pixels)> = chosen
        .par_iter()
        .map(|&frame| Ok((frame, frames[frame].pixels()?)))
        .collect::<Result<_, SceneError>>()?;
    let count = read.len();
    for (frame, pixels) in read {
        frames[frame].pixels = pixels.into();
    }
    scene.notes.push(format!(
        "{count} of {} frames are keyframes, chosen by pose and sharpness, as {:.1} GB of memory are for images and all \
         take {:.1}: the field and the surface are made from them, and the other frames are labelled from the surface",
        frames.len(),
        options.image_bytes as f64 / 1e9,
        sizes.iter().sum::<u64>() as f64 / 1e9,
    ));
    Ok(())
}

/// Indices of frames that fit in `budget` bytes, ascending, at least one: again and again the one whose view is
/// farthest from those of all chosen before (farthest-first traversal: Gonzalez, "Clustering to minimize the maximum
/// intercluster distance", 1985), or rather the sharpest of the frames around it.
fn spread_out(views: &[Viewpoint], sharpness: &[f32], sizes: &[u64], budget: u64) -> Vec<usize> {
    // Cameras that are lost far away would be taken first, and others learn nothing from what they see.
    let cameras = Bounds::of_cameras(views.iter().map(Viewpoint::center));
    let gap = |view: &Viewpoint| match cameras.contains(view.center()) {
        true => f32::INFINITY,
        false => 0.0,
    };
    let mut gaps: Vec<f32> = views.iter().map(gap).collect();
    let mut chosen = Vec::new();
    let mut left = budget;
    while let Some(farthest) = (0..views.len()).max_by(|&a, &b| gaps[a].total_cmp(&gaps[b]).then(b.cmp(&a))) {
        let gap = gaps[farthest];
        if gap < NOTHING_NEW {
            break;
        }
        let around = farthest.saturating_sub(WINDOW)..(farthest + WINDOW + 1).min(views.len());
        let near = |&frame: &usize| {
            let is_new = gaps[frame] >= NOTHING_NEW;
            is_new && views[frame].distance(&views[farthest]) <= WINDOW_SHARE * gap
        };
        let sharpest = around.filter(near).max_by(|&a, &b| {
            let nearer = b.abs_diff(farthest).cmp(&a.abs_diff(farthest));
            sharpness[a].total_cmp(&sharpness[b]).then(nearer).then(b.cmp(&a))
        });
        let pick = sharpest.unwrap_or(farthest);
        if !chosen.is_empty() && sizes[pick] > left {
            break;
        }
        left = left.saturating_sub(sizes[pick]);
        for (gap, view) in gaps.iter_mut().zip(views) {
            *gap = gap.min(view.distance(&views[pick]));
        }
        gaps[pick] = 0.0;
        chosen.push(pick);
    }
    chosen.sort_unstable();
    chosen
}

/// How sharp an image is: the variance of the Laplacian of its brightness (0..=255), reduced to about 320 pixels of
/// width (Pech-Pacheco et al., "Diatom autofocusing in brightfield microscopy: a comparative study", 2000).
pub(super) fn sharpness(image: &ColorImage) -> f32 {
    let factor = (image.width() / SHARPNESS_WIDTH).max(1) as usize;
    let (width, height) = (image.width() as usize / factor, image.height() as usize / factor);
    let full = image.width() as usize;
    let mut gray = vec![0.0_f32; width * height];
    let scale = 1.0 / (3 * factor * factor) as f32;
    for (y, row) in image
        .bytes()
        .chunks_exact(3 * full)
        .take(height * factor)
        .enumerate()
    {
        let sums = &mut gray[y / factor * width..(y / factor + 1) * width];
        for (x, pixel) in row.chunks_exact(3).take(width * factor).enumerate() {
            sums[x / factor] += scale * pixel.iter().map(|&v| f32::from(v)).sum::<f32>();
        }
    }
    let (mut sum, mut squared, mut count) = (0.0_f64, 0.0_f64, 0.0_f64);
    for y in 1..height.saturating_sub(1) {
        for x in 1..width.saturating_sub(1) {
            let at = y * width + x;
            let around = gray[at - 1] + gray[at + 1] + gray[at - width] + gray[at + width];
            let laplacian = f64::from(around - 4.0 * gray[at]);
            sum += laplacian;
            squared += laplacian * laplacian;
            count += 1.0;
        }
    }
    let mean = sum / count.max(1.0);
    (squared / count.max(1.0) - mean * mean).max(0.0) as f32
}

#[cfg(test)]
mod tests {
    use glam::{Affine3A, Quat, Vec3};

    use super::*;

    fn at(x: f32, angle: f32) -> Viewpoint {
        Viewpoint {
            camera: Camera::with_horizontal_fov(4, 3, 90.0),
            camera_to_world: Affine3A::from_rotation_translation(Quat::from_rotation_y(angle), x * Vec3::X),
        }
    }

    #[test]
    fn keyframes_cover_the_way_where_the_camera_lingers_and_where_it_hurries() {
        // 80 frames on one spot, 20 that walk 4 m and turn.
        let still = (0..80).map(|k| at(0.001 * k as f32, 0.0));
        let walk = (0..20).map(|k| at(0.2 * k as f32, 0.1 * k as f32));
        let views: Vec<Viewpoint> = still.chain(walk).collect();
        let chosen = spread_out(&views, &[1.0; 100], &[10; 100], 105);
        assert_eq!(chosen.len(), 10);
        let of_still = chosen.iter().filter(|&&frame| frame < 80).count();
        assert!(of_still <= 2, "{chosen:?}");
        for view in &views {
            let nearest = chosen.iter().map(|&frame| view.distance(&views[frame]));
            assert!(nearest.fold(f32::INFINITY, f32::min) < 0.25);
        }
    }

    #[test]
    fn the_sharpest_of_the_frames_around_is_taken_and_repetitions_never() {
        let views: Vec<Viewpoint> = (0..40).map(|k| at(0.05 * k as f32, 0.0)).collect();
        let sharpness: Vec<f32> = (0..40).map(|k| if k % 4 == 2 { 5.0 } else { 1.0 }).collect();
        let chosen = spread_out(&views, &sharpness, &[1; 40], 5);
        assert!(chosen.iter().all(|frame| frame % 4 == 2), "{chosen:?}");
        let same = vec![at(1.0, 0.5); 30];
        assert_eq!(spread_out(&same, &[1.0; 30], &[1; 30], 30), [0]);
        // One that is larger than all memory for images is still taken.
        assert_eq!(spread_out(&views, &[1.0; 40], &[9; 40], 5).len(), 1);
    }

    #[test]
    fn a_camera_that_is_lost_far_away_is_none() {
        let mut views: Vec<Viewpoint> = (0..40).map(|k| at(0.05 * k as f32, 0.0)).collect();
        views[17] = at(500.0, 0.0);
        let chosen = spread_out(&views, &[1.0; 40], &[1; 40], 40);
        assert!(chosen.len() == 39 && !chosen.contains(&17), "{chosen:?}");
    }

    #[test]
    fn a_blurred_image_is_less_sharp() {
        let image = |period: u32| {
            let bright = |x: u32| if (x / period).is_multiple_of(2) { 255 } else { 0 };
            let rgb = (0..64 * 48).flat_map(|index| [bright(index % 64); 3]).collect();
            ColorImage::new(64, 48, rgb).unwrap()
        };
        assert!(sharpness(&image(2)) > 2.0 * sharpness(&image(8)));
        assert!(sharpness(&image(100)) < 1e-3);
        assert!(sharpness(&ColorImage::new(1, 1, vec![9; 3]).unwrap()) < 1e-3);
    }
}
