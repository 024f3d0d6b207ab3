//! A posed capture of one static scene: cameras, frames, and the formats they are read from.

mod cache;
mod camera;
mod colmap;
pub mod demo;
mod depth;
mod error;
mod files;
mod formats;
mod frame;
mod image_edges;
mod image_pixels;
mod images;
mod keyframes;
mod label_images;
mod lens;
mod pixel_errors;
mod pixels;
mod reading;
mod replica;
pub mod reprojection;
mod rgbd;
mod scannet;
mod seven_scenes;
#[cfg(test)]
pub(crate) mod testing;
mod trajectory;
mod transforms;
mod tum;

use std::fmt;
use std::path::{Path, PathBuf};
use std::time::Instant;

use glam::{Affine3A, DAffine3, DVec3, Vec3};
use rayon::prelude::*;

use crate::TOLD;
pub(crate) use cache::Cache;
pub use camera::{Camera, Viewpoint};
pub(crate) use camera::{has_proportions, sampled};
pub use error::{ImageError, SceneError};
pub(crate) use error::{in_one_line, shown};
pub(crate) use files::check_size;
pub(crate) use files::decode as decode_image;
pub use frame::{ColorImage, DepthMap, Frame, SparsePoint};
pub(crate) use image_edges::{ImageEdges, PassWeights};
pub use image_pixels::ImagePixels;
pub(crate) use images::{PlainImage, original_colors, plain_image};
pub use label_images::{frame_number, label_images, numbered_images};
pub(crate) use lens::LARGEST_SIDE;
pub use lens::{Distortion, Lens};
use pixel_errors::PixelErrors;
pub use pixels::{FramePixels, Pixels};
pub use replica::{GroundTruth, TrueObjects, write as write_replica};
pub(crate) use replica::{intrinsics_line, pose_line, z_millimetres};
use reprojection::PoseRefinement;
pub use trajectory::Trajectory;

/// Where a scene comes from.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum SceneSource {
    /// The embedded procedural room.
    Demo,
    /// A folder in a supported format, found out by looking.
    Folder(PathBuf),
}

impl SceneSource {
    /// Name for people: the folder's name, or "demo".
    pub fn name(&self) -> String {
        match self {
            Self::Demo => "demo".to_owned(),
            Self::Folder(path) => {
                let name = |path: &Path| Some(path.file_name()?.to_string_lossy().into_owned());
                // The disk is asked only for what ends in dots: this name is on the screen all the time.
                let found = || name(&path.canonicalize().ok()?);
                name(path)
                    .or_else(found)
                    .unwrap_or_else(|| path.display().to_string())
            }
        }
    }

    /// The word `demo`, or else a folder.
    pub fn from_argument(argument: &Path) -> Self {
        if argument.as_os_str() == "demo" {
            Self::Demo
        } else {
            Self::Folder(argument.to_path_buf())
        }
    }
}

impl fmt::Display for SceneSource {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Demo => formatter.write_str("demo"),
            Self::Folder(path) => shown(path.display()).fmt(formatter),
        }
    }
}

/// What to read of a capture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct OpenOptions {
    /// Read measured depth, and the points of a structure-from-motion, where there are any.
    pub depth: bool,
    /// Bytes that decoded images may take in memory. Of a capture that takes more only the keyframes' stay there.
    pub image_bytes: u64,
    /// Read images that a file of the capture names outside its folder. A capture from elsewhere could name any file of
    /// this computer, so that the person has to allow it. Links in the folder are followed in any case.
    pub outside_files: bool,
}

/// Images of about a thousand frames of 640 x 480 pixels with depth.
const IMAGE_BYTES: u64 = 3 << 29;

impl Default for OpenOptions {
    fn default() -> Self {
        Self {
            depth: true,
            image_bytes: IMAGE_BYTES,
            outside_files: false,
        }
    }
}

/// An axis-aligned box in the world, in metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Corner with the smallest coordinates.
    pub min: Vec3,
    /// Corner with the largest coordinates.
    pub max: Vec3,
}

impl Bounds {
    /// Around the centres of cameras in metres, without the few that are [lost](camera::box_around).
    pub(crate) fn of_cameras(centers: impl Iterator<Item = Vec3> + Clone) -> Self {
        let centers = centers.map(|center| center.as_dvec3());
        let [min, max] = camera::box_around(centers, camera::NARROWEST_GAP);
        Self {
            min: min.as_vec3(),
            max: max.as_vec3(),
        }
    }

    /// Length of each side, in metres.
    pub fn size(&self) -> Vec3 {
        self.max - self.min
    }

    pub(crate) fn contains(&self, place: Vec3) -> bool {
        place.cmpge(self.min).all() && place.cmple(self.max).all()
    }
}

/// Share of the measured and of the sparse points on each side that may lie outside the scene's box.
const TRIMMED: f32 = 0.002;
const TRIMMED_SPARSE: f32 = 0.01;

/// Without depth, a metre of so many units of the poses is taken as it is: cameras that span 0.1 to 40 m.
const SMALLEST_UNIT: f64 = 0.05;
const LARGEST_UNIT: f64 = 20.0;

/// A posed capture of one static scene.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Where it was read from.
    pub source: SceneSource,
    /// Name of the format it was read as.
    pub format: &'static str,
    /// The frames, in the order of the capture.
    pub frames: Vec<Frame>,
    /// World position, in the capture's own coordinates, that is the zero of every pose here: keeps
    /// single precision exact for captures far from their origin.
    pub origin: DVec3,
    /// Length of a metre here, in the capture's own unit: 1 where that is the metre. Where it is arbitrary,
    /// as after a structure-from-motion, the reader chooses metres that make the scene the size of a room.
    pub unit: f64,
    /// How far the points of a structure from motion are from where its images show them, in pixels of the images
    /// on disk; `None` where there are none.
    pub point_errors: Option<PixelErrors>,
    /// How the poses of the frames differ from the capture's own; `None` where they are these.
    pub pose_refinement: Option<PoseRefinement>,
    /// Suspicious but usable input, a sentence each.
    pub warnings: Vec<String>,
    /// What else is to say about how the capture was read, a sentence each.
    pub notes: Vec<String>,
}

impl Scene {
    /// Of frames in metres around the zero of their capture, with nothing to say about how they were read.
    pub fn new(source: SceneSource, format: &'static str, frames: Vec<Frame>) -> Self {
        Self {
            source,
            format,
            frames,
            origin: DVec3::ZERO,
            unit: 1.0,
            point_errors: None,
            pose_refinement: None,
            warnings: Vec::new(),
            notes: Vec::new(),
        }
    }

    /// Opens a capture; `progress` is called with (frames decoded, frames in all), from any thread.
    ///
    /// # Errors
    /// A sentence that names the file and what to do.
    pub fn open(
        source: &SceneSource,
        options: OpenOptions,
        progress: &(dyn Fn(usize, usize) + Sync),
    ) -> Result<Self, SceneError> {
        Self::open_listed(source, options, &|_| {}, &|done, total| {
            progress(done, total);
            true
        })
    }

    /// Whether a folder looks like a scene.
    ///
    /// # Errors
    /// Those of [`Scene::open`] for a folder that does not.
    pub fn recognise(folder: &Path) -> Result<(), SceneError> {
        formats::recognised(folder).map(drop)
    }

    /// As [`Scene::open`]. `listed` is called once, before images are decoded, with the scene as its files promise it:
    /// with the names, cameras and poses of its frames, whose pixels are decoded when they are wanted, once for both
    /// scenes where all of them stay in memory. The opened scene lacks the frames whose images turn out to be unusable,
    /// and without depth its metre may be another. `progress` stops the reading of a folder by `false`.
    ///
    /// # Errors
    /// Those of [`Scene::open`], and that it was stopped.
    pub fn open_listed(
        source: &SceneSource,
        options: OpenOptions,
        listed: &(dyn Fn(Self) + Sync),
        progress: &(dyn Fn(usize, usize) -> bool + Sync),
    ) -> Result<Self, SceneError> {
        let start = Instant::now();
        let mut scene = match source {
            SceneSource::Demo => demo::Shot::default().read(options.depth, listed, &|done, total| {
                progress(done, total);
            }),
            SceneSource::Folder(folder) => formats::read(folder, options, listed, progress)?,
        };
        if !options.depth {
            // No reader lists depth images then; COLMAP's needs the points for the unit.
            scene.frames.iter_mut().for_each(|frame| frame.points.clear());
        }
        scene.take_the_size_of_a_room();
        keyframes::choose(&mut scene, options)?;
        scene.warn_of_lost_cameras();
        scene.warn_of_wide_lenses();
        for sentence in scene.warnings.iter_mut().chain(&mut scene.notes) {
            *sentence = shown(&*sentence);
        }
        tracing::info!(
            %source,
            format = scene.format,
            frames = scene.frames.len(),
            keyframes = scene.keyframes().len(),
            depth = scene.has_depth(),
            seconds = start.elapsed().as_secs_f64(),
            "a scene is open"
        );
        for warning in &scene.warnings {
            tracing::warn!(target: TOLD, "{warning}");
        }
        Ok(scene)
    }

    /// Without depth nothing says how long a metre is: cameras that are much nearer together or farther apart than in
    /// a room have their poses in another unit, whatever the format promises, and now span 2 m.
    fn take_the_size_of_a_room(&mut self) {
        let is_metric = self.has_depth() || self.frames.iter().any(|frame| !frame.points.is_empty());
        let centers = self.frames.iter().map(|frame| frame.center().as_dvec3());
        let unit = camera::unit_of_cameras(centers, camera::NARROWEST_GAP);
        if is_metric || self.unit != 1.0 || (SMALLEST_UNIT..=LARGEST_UNIT).contains(&unit) {
            return;
        }
        for frame in &mut self.frames {
            let own = frame.camera_to_world.translation.as_dvec3() / unit;
            frame.camera_to_world.translation = own.as_vec3a();
        }
        self.unit = unit;
        self.notes.push(format!(
            "a metre here is {unit:.4} units of the poses: without depth their scale is arbitrary, and the cameras now span 2 m"
        ));
    }

    fn warn_of_lost_cameras(&mut self) {
        let cameras = self.cameras();
        let lost = self.frames.iter();
        let lost = lost.filter(|frame| !cameras.contains(frame.center()));
        let lost: Vec<String> = lost.map(|frame| frame.stem.clone()).collect();
        let poses = formats::pose_file(self.format);
        let what = format!("cameras are far away from all others; check their poses in {poses}");
        files::warn(&mut self.warnings, &what, &lost);
    }

    fn warn_of_wide_lenses(&mut self) {
        let bent = self.frames.par_iter();
        let beyond = bent.filter_map(|frame| Some(frame.lens?.share_beyond(&frame.camera)));
        let beyond: Vec<f32> = beyond.filter(|&share| share > 0.0).collect();
        if let Some(most) = beyond.iter().copied().reduce(f32::max) {
            self.warnings.push(format!(
                "{} frames have a lens that sees more than their straightened image shows: up to {:.0}% of their pixels, \
                 at the rim, stay void",
                beyond.len(),
                100.0 * most
            ));
        }
    }

    /// Name for people: [`SceneSource::name`].
    pub fn name(&self) -> String {
        self.source.name()
    }

    /// Whether the frames are those of another scene, in the same order.
    pub fn has_frames_of(&self, other: &Self) -> bool {
        let (own, others) = (self.frames.iter(), other.frames.iter());
        own.map(|frame| &frame.stem).eq(others.map(|frame| &frame.stem))
    }

    /// Index of the frame with this stem.
    pub fn frame_index(&self, stem: &str) -> Option<usize> {
        self.frames.iter().position(|frame| frame.stem == stem)
    }

    /// Whether any frame has measured depth.
    pub fn has_depth(&self) -> bool {
        self.frames.iter().any(Frame::has_depth)
    }

    /// Indices of the frames whose pixels stay in memory, ascending: all frames of a capture that fits there.
    pub fn keyframes(&self) -> Vec<usize> {
        let numbered = self.frames.iter().enumerate();
        let kept = numbered.filter(|(_, frame)| frame.is_keyframe());
        kept.map(|(number, _)| number).collect()
    }

    /// Box around the centres of the cameras, in metres, without the few that are lost far away.
    pub(crate) fn cameras(&self) -> Bounds {
        Bounds::of_cameras(self.frames.iter().map(Frame::center))
    }

    /// A position here (in metres, relative to the origin) in the capture's own coordinates and unit.
    pub fn to_capture(&self, position: Vec3) -> DVec3 {
        self.origin + self.unit * position.as_dvec3()
    }

    /// A pose in the capture's own coordinates and unit, camera-to-world, in metres here, relative to the origin.
    pub fn of_capture(&self, camera_to_world: &DAffine3) -> Affine3A {
        camera::placed(camera_to_world, self.origin, self.unit)
    }

    /// Box around what the cameras see, in metres: around the cameras and the measured points where there
    /// is depth (without the farthest 0.2% on each side) or else sparse points (without 1%), else around
    /// the cameras with a room's margin. The few cameras that are lost far away do not count, nor does what they see.
    pub fn bounds(&self) -> Bounds {
        let cameras = self.cameras();
        let frames = self.frames.iter();
        let frames = frames.filter(|frame| cameras.contains(frame.center()));
        let Bounds { mut min, mut max } = cameras;
        let (points, trimmed) = if self.has_depth() {
            (sampled_points(frames), TRIMMED)
        } else {
            (sparse_points(frames), TRIMMED_SPARSE)
        };
        if points.is_empty() {
            let margin = (max - min).max_element().max(2.5);
            return Bounds {
                min: min - margin,
                max: max + margin,
            };
        }
        for axis in 0..3 {
            let mut values: Vec<f32> = points.iter().map(|point| point[axis]).collect();
            values.sort_by(f32::total_cmp);
            let trim = (trimmed * values.len() as f32) as usize;
            min[axis] = min[axis].min(values[trim]);
            max[axis] = max[axis].max(values[values.len() - 1 - trim]);
        }
        let margin = 0.02 * (max - min).max_element() + 0.02;
        Bounds {
            min: min - margin,
            max: max + margin,
        }
    }
}

/// World points of about 200 measured pixels of every keyframe.
fn sampled_points<'a>(frames: impl Iterator<Item = &'a Frame>) -> Vec<Vec3> {
    let mut points = Vec::new();
    for frame in frames.filter(|frame| frame.is_keyframe()) {
        let Some(depth) = frame.depth() else { continue };
        let sampled = depth.sampled(200);
        points.extend(sampled.map(|(index, length)| frame.place(index, length)));
    }
    points
}

/// World positions of the sparse points of every frame; one that many frames see counts as often.
fn sparse_points<'a>(frames: impl Iterator<Item = &'a Frame>) -> Vec<Vec3> {
    let of_frame = |frame: &Frame| {
        let place = |point: &SparsePoint| frame.place(point.pixel as usize, point.length);
        frame.points.iter().map(place).collect::<Vec<Vec3>>()
    };
    frames.flat_map(of_frame).collect()
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicUsize, Ordering};

    use super::testing::{on_threads, open, wall, without_depth};
    use super::*;

    /// A wall in poses of another unit, written without depth, and read again.
    fn reread(scale: f32) -> Scene {
        let mut scene = without_depth(wall(5, 16, 12));
        for frame in &mut scene.frames {
            frame.camera_to_world.translation *= scale;
        }
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("wall");
        write_replica(&scene, &folder, None).unwrap();
        open(&folder).unwrap()
    }

    #[test]
    fn a_camera_that_is_lost_far_away_does_not_widen_the_box_and_is_told() {
        let lost = |frames: usize| {
            let mut scene = wall(frames, 16, 12);
            scene.frames[frames - 1].camera_to_world.translation.x += 500.0;
            scene
        };
        for has_depth in [true, false] {
            let scene = lost(30);
            let all = if has_depth { scene } else { without_depth(scene) };
            let mut others = all.clone();
            others.frames.pop();
            assert_eq!(all.bounds(), others.bounds());
        }
        assert!(lost(10).bounds().max.x > 500.0, "one of ten can be another place");
        let mut scene = lost(30);
        scene.warn_of_lost_cameras();
        assert!(
            scene.warnings[0].ends_with("(1 in all): rgb_29"),
            "{:?}",
            scene.warnings
        );
        let mut scene = lost(10);
        scene.warn_of_lost_cameras();
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
    }

    #[test]
    fn reading_that_is_stopped_ends_after_the_image_at_hand() {
        let root = tempfile::tempdir().unwrap();
        let folder = root.path().join("wall");
        write_replica(&wall(9, 16, 12), &folder, None).unwrap();
        let (source, read) = (SceneSource::Folder(folder), AtomicUsize::new(0));
        let goes_on = |_: usize, _: usize| read.fetch_add(1, Ordering::Relaxed) < 2;
        let stopped = on_threads(1, || {
            Scene::open_listed(&source, OpenOptions::default(), &|_| {}, &goes_on)
        });
        assert!(matches!(stopped, Err(SceneError::Stopped)), "{stopped:?}");
        assert_eq!(read.into_inner(), 3);
    }

    #[test]
    fn poses_in_millimetres_or_kilometres_without_depth_get_the_size_of_a_room() {
        for scale in [1000.0, 0.001] {
            let scene = reread(scale);
            // The cameras of the wall are 0.4 m apart.
            let unit = f64::from(scale) * 0.4 / 2.0;
            assert!((scene.unit / unit - 1.0).abs() < 1e-4, "{}", scene.unit);
            let (first, last) = (scene.frames[0].center(), scene.frames[4].center());
            assert!((first.distance(last) - 2.0).abs() < 1e-3);
            let x = scene.to_capture(last).x;
            assert!((x / f64::from(scale) - 0.2).abs() < 1e-4, "{x}");
            let said = scene.notes.join(" ");
            assert!(said.contains("span 2 m"), "{said}");
        }
        assert_eq!(reread(1.0).unit, 1.0);
    }
}
