//! From the files of frames to frames: what the readers of all formats share.

use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{DAffine3, DVec3};
use rayon::prelude::*;

use super::camera::placed;
use super::depth::DepthImages;
use super::error::ImageError;
use super::files::{file_name, leave_out, unreadable};
use super::images::{ImageFile, Turn, warn_of_turns};
use super::keyframes::Keeping;
use super::pixels::{FirstRead, FirstReading, Unread};
use super::{ColorImage, Frame, FramePixels, OpenOptions, Pixels, SceneError};

/// Who follows the reading of a capture.
#[derive(Clone, Copy)]
pub(super) struct Progress<'a> {
    /// Called once with the frames that are going to be read, without sparse points.
    pub listed: &'a (dyn Fn(Vec<Frame>) + Sync),
    /// Called with (frames read, frames in all), from any thread; `false` stops the reading.
    pub read: &'a (dyn Fn(usize, usize) -> bool + Sync),
}

/// A frame that is still on disk, in the capture's own coordinates.
pub(super) struct Listed {
    /// Its name, which its labels are named by.
    pub stem: String,
    /// What messages call its image.
    pub name: String,
    /// The colour image, with its mask and its cameras.
    pub image: ImageFile,
    /// The depth image, where there is one and it is wanted.
    pub depth: Option<PathBuf>,
    /// Camera-to-world in the capture's own coordinates and unit.
    pub camera_to_world: DAffine3,
}

/// From the capture's coordinates to the scene's.
#[derive(Clone, Copy)]
pub(super) struct Placing {
    /// The zero of the scene, in the capture's coordinates.
    pub origin: DVec3,
    /// The length of a metre, in the capture's unit.
    pub unit: f64,
}

/// The files of a frame.
struct Files {
    image: ImageFile,
    depth: Option<(PathBuf, DepthImages)>,
}

impl Files {
    /// Reads them for the first time: a depth image that cannot be used, or is empty, is left out.
    fn read(&self) -> FirstReading {
        let (color, turn) = self.image.decode()?;
        let (mut measured, mut depth_problem) = (None, None);
        if let Some((path, depth)) = &self.depth {
            match depth.decode(path, &self.image, &color) {
                Ok(map) => measured = Some(map).filter(|map| map.coverage() > 0.0),
                Err(error) => depth_problem = Some(format!("{} ({error})", file_name(path))),
            }
        }
        Ok(FirstRead {
            pixels: Pixels::new(color, measured),
            turn,
            depth_problem,
        })
    }

    /// Reads them once more.
    fn read_again(&self, with_depth: bool) -> Result<Pixels, SceneError> {
        let image = &self.image;
        let (color, _) = image.decode().map_err(|error| unreadable(&image.path, error))?;
        let depth = self.depth.as_ref().filter(|_| with_depth);
        let depth = depth.map(|(path, depth)| {
            let decoded = depth.decode(path, image, &color);
            decoded.map_err(|error| unreadable(path, error))
        });
        Ok(Pixels::new(color, depth.transpose()?))
    }
}

/// A frame that was read.
pub(super) struct ReadFrame<T> {
    /// The frame, without sparse points.
    pub frame: Frame,
    /// What became of the orientation of its image.
    pub turn: Turn,
    /// Its depth image, and why that cannot be used.
    pub depth_problem: Option<String>,
    /// What was found in its colour image.
    pub seen: T,
}

/// Reads the listed frames in parallel: each one, or why its image cannot be used. `look` looks at the colour image of the
/// frame with this index.
///
/// # Errors
/// Whoever follows the reading stopped it.
pub(super) fn read_frames<T: Send>(
    listed: &[Listed],
    placing: Placing,
    options: OpenOptions,
    progress: Progress,
    depth: &DepthImages,
    look: impl Fn(usize, &ColorImage) -> T + Sync,
) -> Result<Vec<Result<ReadFrame<T>, ImageError>>, SceneError> {
    let cameras = listed
        .iter()
        .map(|frame| (&frame.image.pinhole, frame.depth.is_some()));
    let keeping = Keeping::of(cameras, options);
    let unread = listed.iter().map(|frame| {
        let depth = frame.depth.clone().map(|path| (path, depth.clone()));
        let files = Arc::new(Files {
            image: frame.image.clone(),
            depth,
        });
        let path = frame.image.path.clone();
        let own = Arc::clone(&files);
        (files, Arc::new(Unread::new(path, move || own.read())))
    });
    let unread: Vec<(Arc<Files>, Arc<Unread>)> = unread.collect();
    let frames = listed.iter().zip(&unread).enumerate();
    let frames = frames.map(|(number, (frame, (_, unread)))| {
        let pixels = keeping.unread(number, Arc::clone(unread), frame.depth.is_some());
        frame.with(pixels, placing)
    });
    (progress.listed)(frames.collect());
    let done = AtomicUsize::new(0);
    let read = listed.par_iter().zip(&unread).enumerate();
    let read = read.map(|(number, (frame, (files, unread)))| {
        let read = keeping.read(unread).map(|first| {
            let seen = look(number, &first.pixels.color);
            let (files, with_depth) = (Arc::clone(files), first.pixels.depth.is_some());
            let again = move || files.read_again(with_depth);
            let pixels = keeping.keep(number, first.pixels, again);
            ReadFrame {
                frame: frame.with(pixels, placing),
                turn: first.turn,
                depth_problem: first.depth_problem,
                seen,
            }
        });
        let done = 1 + done.fetch_add(1, Ordering::Relaxed);
        let goes_on = (progress.read)(done, listed.len());
        goes_on.then_some(read).ok_or(SceneError::Stopped)
    });
    read.collect()
}

impl Listed {
    /// The frame with these pixels, without sparse points.
    fn with(&self, pixels: FramePixels, placing: Placing) -> Frame {
        Frame {
            stem: self.stem.clone(),
            path: self.image.path.clone(),
            camera: self.image.pinhole,
            camera_to_world: placed(&self.camera_to_world, placing.origin, placing.unit),
            pixels,
            points: Vec::new(),
            lens: self.image.bent(),
        }
    }
}

/// What a format says of images and of depth images that cannot be used.
pub(super) struct Unusable<'a> {
    /// Folder of the images.
    pub images: &'a Path,
    /// Folder of the depth images.
    pub depths: &'a Path,
    /// What is between the number of those and that of all.
    pub of: &'a str,
    /// What to do where most images are unusable.
    pub remedy: &'a str,
    /// What depth images are that cannot be used.
    pub depth: &'a str,
}

/// The frames that were read, with what was seen in them, if most images and most depth images can be used; of the others
/// there are warnings.
pub(super) fn keep_usable<T>(
    listed: &[Listed],
    read: Vec<Result<ReadFrame<T>, ImageError>>,
    said: &Unusable,
    warnings: &mut Vec<String>,
) -> Result<Vec<(Frame, T)>, SceneError> {
    let (total, of) = (listed.len(), said.of);
    let (mut frames, mut turns) = (Vec::new(), Vec::new());
    let (mut bad, mut bad_depth) = (Vec::new(), Vec::new());
    for (listed, read) in listed.iter().zip(read) {
        match read {
            Ok(read) => {
                frames.push((read.frame, read.seen));
                turns.push((listed.name.clone(), read.turn));
                bad_depth.extend(read.depth_problem);
            }
            Err(error) => bad.push(format!("{} ({error})", listed.name)),
        }
    }
    let what = "images cannot be used";
    let left_out = format!("{what} and were left out");
    leave_out(warnings, said.images, (&bad, total), &left_out, |count, first| {
        format!("{count} {of} {total} {what}, first {first}; {}", said.remedy)
    })?;
    warn_of_turns(warnings, &turns);
    let depth = said.depth;
    let without = format!("frames are used without depth because it is {depth}");
    leave_out(
        warnings,
        said.depths,
        (&bad_depth, total),
        &without,
        |count, first| {
            format!(
                "{count} {of} {total} depth images are {depth}, first {first}; copy the capture again, or open it without \
             depth"
            )
        },
    )?;
    let is_listed = listed.iter().any(|frame| frame.depth.is_some());
    if is_listed && !frames.iter().any(|(frame, _)| frame.has_depth()) {
        warnings.push(format!(
            "the depth images in {} are all empty, so that the capture is used as one without depth",
            said.depths.display()
        ));
    }
    Ok(frames)
}
