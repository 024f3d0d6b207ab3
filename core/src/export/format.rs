//! The data set formats that a scene can be exported in.

use std::ops::ControlFlow;
use std::path::Path;

use super::layout::{self, LabelledScene, Written};
use super::pngs::Pngs;
use super::solid::{self, Solid};
use super::{ExportError, Options};

/// A kind of data set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Format {
    /// Label, entropy and colour PNGs.
    #[default]
    Png,
    /// The surface as points with their classes.
    PointCloud,
    /// The surface as a triangle mesh with the classes of its vertices.
    Mesh,
}

impl Format {
    /// All of them, the plain one first.
    pub const ALL: [Self; 3] = [Self::Png, Self::PointCloud, Self::Mesh];

    /// What it is called on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::PointCloud => "point-cloud",
            Self::Mesh => "mesh",
        }
    }

    /// The format of a name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|format| format.name() == name)
    }
}

/// Writes a labelled scene into a folder. Each file is written under a temporary name and renamed; files that have
/// the right content already are left alone, and the same maps give the same bytes.
///
/// Label images have the pixels of the frame's image on disk, distortion included.
///
/// `progress` is called with (frames written, frames in all), from any thread; when it answers
/// [`ControlFlow::Break`], no further frame is begun. What was written by then is found by the next export. The surface
/// is written at once, without it.
///
/// # Errors
/// [`ExportError::Incomplete`] unless there is exactly one map of the right size for every frame,
/// before anything is written, or where the surface is to be written and the maps follow from none;
/// [`ExportError::Cancelled`]; [`ExportError::Unwritable`].
pub fn export(
    folder: &Path,
    labelled: LabelledScene<'_>,
    format: Format,
    options: &Options,
    progress: &(dyn Fn(usize, usize) -> ControlFlow<()> + Sync),
) -> Result<Written, ExportError> {
    match format {
        Format::Png => layout::write(&Pngs, folder, labelled, options, progress),
        Format::PointCloud => solid::write(Solid::Cloud, folder, labelled, options),
        Format::Mesh => solid::write(Solid::Mesh, folder, labelled, options),
    }
}
