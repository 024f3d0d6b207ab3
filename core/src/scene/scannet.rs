//! A scan of ScanNet (Dai et al., CVPR 2017), as its tools export it from a `.sens` file, or of its 25,000 selected
//! frames.
//!
//! - `color/N.jpg` (or PNG)
//! - `depth/N.png`, where there is depth: 16 bit, millimetres along z, 0 = none, with a camera of its own
//! - `pose/N.txt`: 4x4 camera-to-world, OpenCV axes, metres, a row a line; all `-inf` where tracking was lost
//! - `intrinsic/intrinsic_color.txt` and `intrinsic/intrinsic_depth.txt` (or `intrinsics_color.txt` and
//!   `intrinsics_depth.txt` beside the folders): 4x4, pixels, with the centre of the top left pixel at (0, 0)

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Arc;

use super::depth::{DepthCamera, DepthImages};
use super::error::{refusal, refuse};
use super::files::numbered_files;
use super::formats::Format;
use super::reading::Progress;
use super::rgbd::pose_files::{self, FrameFiles, Places};
use super::rgbd::text::read_numbers;
use super::rgbd::{self, Layout};
use super::{Camera, OpenOptions, Scene, SceneError};

/// The format.
pub(super) const FORMAT: Format = Format {
    name: "ScanNet",
    expected: "color/0.jpg, depth/0.png and pose/0.txt, ... with intrinsic/intrinsic_color.txt",
    poses: "pose/",
    recognise,
    read,
};

/// Sizes that the data set was calibrated at: the colour camera's images and the depth camera's.
const COLOR_SIZE: [u32; 2] = [1296, 968];
const DEPTH_SIZE: [u32; 2] = [640, 480];
/// Share of an image's size by which a principal point may miss the middle.
const MOST_OFF_CENTER: f32 = 0.15;
/// Share by which images that were resized may differ in proportions from those of the calibration: 1296x968 is often
/// resized to 640x480.
const MOST_STRETCHED: f32 = 0.02;
/// What to say of `intrinsics.txt` where nothing tells the colour camera.
const NO_CAMERA: &str = "no such file, and no intrinsic/intrinsic_color.txt; copy that from the scan, or \
                         write six numbers here: fx fy cx cy width height";

/// Whether a folder looks like this format, complete or not.
fn recognise(folder: &Path) -> bool {
    let has = |name: &str| folder.join(name).is_dir();
    has("color") && (has("pose") || has("intrinsic"))
}

/// Reads a folder in this format.
fn read(folder: &Path, options: OpenOptions, progress: Progress) -> Result<Scene, SceneError> {
    let (mut warnings, mut notes) = (Vec::new(), Vec::new());
    let places = Places {
        folder,
        poses: &folder.join("pose"),
        without_pose: "images in color/ have no file in pose/",
        without_image: "poses in pose/ have no image in color/",
        remedy: "export the scan again",
        unusable: "frames were left out because their pose is unusable, as where tracking was lost",
    };
    let frames = find_files(folder, options)?.into_values();
    let listed = pose_files::list(&places, frames, options, &mut warnings)?;
    let color = Calibration::read(folder, "color", COLOR_SIZE)?;
    let depth = Calibration::read(folder, "depth", DEPTH_SIZE)?;
    if depth.is_none() && listed.iter().any(|frame| frame.depth.is_some()) {
        notes.push("no intrinsic_depth.txt: depth is taken to show what the colour images show".to_owned());
    }
    warn_of_extrinsics(folder, &mut warnings)?;
    let camera =
        depth.map(|depth| -> Arc<DepthCamera> { Arc::new(move |width, height| depth.camera(width, height)) });
    let layout = Layout {
        format: FORMAT.name,
        folder,
        images: &folder.join("color"),
        depths: &folder.join("depth"),
        depth: DepthImages {
            camera,
            ..DepthImages::MILLIMETRES
        },
        default_camera: &|width, height| match &color {
            Some(color) => color.camera(width, height).map_err(|reason| {
                format!("no such file, and {reason}, or write six numbers here: fx fy cx cy width height")
            }),
            None => Err(NO_CAMERA.to_owned()),
        },
        default_camera_note: None,
    };
    rgbd::read(&layout, listed, warnings, notes, options, progress)
}

/// The files of each frame, in the order of their numbers; depth only where it is wanted.
fn find_files(folder: &Path, options: OpenOptions) -> Result<BTreeMap<usize, FrameFiles>, SceneError> {
    let images = files(folder, "color", &["jpg", "jpeg", "png"])?;
    let poses = files(folder, "pose", &["txt"])?;
    if images.is_empty() {
        refuse!(
            folder.join("color"),
            "holds no JPEG or PNG whose name ends in a number; export the colour images of the scan there, as 0.jpg, \
             1.jpg, ..."
        );
    }
    let depths = rgbd::depths(folder, options)?;
    let mut frames: BTreeMap<usize, FrameFiles> = BTreeMap::new();
    for (number, path) in images {
        frames.entry(number).or_default().color = Some(path);
    }
    for (number, path) in poses {
        frames.entry(number).or_default().pose = Some(path);
    }
    for (number, path) in depths {
        frames.entry(number).or_default().depth = Some(path);
    }
    Ok(frames)
}

/// The files of a folder of the scan by number.
fn files(folder: &Path, name: &str, extensions: &[&str]) -> Result<BTreeMap<usize, PathBuf>, SceneError> {
    // What has no number is no frame.
    numbered_files(&folder.join(name), extensions, &mut Vec::new())
}

/// The intrinsics of one of the scan's cameras, for images of a size that its file does not tell.
struct Calibration {
    path: PathBuf,
    /// Of images of the size that the data set's cameras of this kind have.
    camera: Camera,
}

impl Calibration {
    /// Reads that of the camera `color` or `depth`; `None` where there is no file.
    fn read(folder: &Path, kind: &str, size: [u32; 2]) -> Result<Option<Self>, SceneError> {
        let places = [
            format!("intrinsic/intrinsic_{kind}.txt"),
            format!("intrinsics_{kind}.txt"),
        ];
        let Some(path) = places
            .iter()
            .map(|place| folder.join(place))
            .find(|path| path.is_file())
        else {
            return Ok(None);
        };
        let (fx, cx, fy, cy) = match read_numbers(&path)?.as_slice() {
            &[fx, _, cx, _, _, fy, cy, _, _, _, _, _, _, _, _, _] => (fx, cx, fy, cy),
            &[fx, _, cx, _, fy, cy, _, _, _] => (fx, cx, fy, cy),
            values => refuse!(
                path,
                "has {} numbers; write the 4x4 matrix of the camera's intrinsics",
                values.len()
            ),
        };
        let camera = Camera::checked(size, [fx, fy, cx + 0.5, cy + 0.5]).map_err(|problem| {
            refusal!(
                &path,
                "{problem}; copy the matrix of the camera's intrinsics from the scan"
            )
        })?;
        Ok(Some(Self { path, camera }))
    }

    /// The camera of images of this width and height: the intrinsics as they are, or scaled from the data set's own size,
    /// whichever has the principal point nearer to the middle; about there it has to be.
    fn camera(&self, width: u32, height: u32) -> Result<Camera, String> {
        let as_given = |width: u32, height: u32| {
            let own = Camera {
                width,
                height,
                ..self.camera
            };
            let is_middle = |v: f32, size: u32| (v / size as f32 - 0.5).abs() <= MOST_OFF_CENTER;
            (is_middle(own.cx, width) && is_middle(own.cy, height)).then_some(own)
        };
        let given = &self.camera;
        let proportions = |width: u32, height: u32| width as f32 / height as f32;
        let stretch = proportions(width, height) / proportions(given.width, given.height);
        let resized = || {
            as_given(given.width, given.height)
                .filter(|_| (stretch - 1.0).abs() <= MOST_STRETCHED)
                .map(|camera| camera.stretched(width, height))
        };
        let off_center = |camera: &Camera| {
            let off = |v: f32, size: u32| (v / size as f32 - 0.5).abs();
            off(camera.cx, camera.width).max(off(camera.cy, camera.height))
        };
        let readings = [as_given(width, height), resized()].into_iter().flatten();
        let nearest = readings.min_by(|a, b| off_center(a).total_cmp(&off_center(b)));
        nearest.ok_or_else(|| {
            format!(
                "the principal point ({}, {}) in {} is far from the middle of images of {width}x{height}, so that they \
                 were cropped or resized; use the images of the scan",
                given.cx - 0.5,
                given.cy - 0.5,
                self.path.display()
            )
        })
    }
}

/// Warns of cameras that do not stand where the poses are, which nothing accounts for.
fn warn_of_extrinsics(folder: &Path, warnings: &mut Vec<String>) -> Result<(), SceneError> {
    for kind in ["color", "depth"] {
        let path = folder.join(format!("intrinsic/extrinsic_{kind}.txt"));
        if !path.is_file() {
            continue;
        }
        let identity = |index: usize| f64::from(u8::from(index.is_multiple_of(5)));
        let values = read_numbers(&path)?;
        let is_off = |(index, value): (usize, &f64)| (value - identity(index)).abs() > 1e-6;
        if values.len() != 16 || values.iter().enumerate().any(is_off) {
            warnings.push(format!(
                "{} is not the identity and was not applied: colour and depth are taken from one place",
                path.display()
            ));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests;
