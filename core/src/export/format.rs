//! The data set formats that a scene can be exported in.

use std::ops::ControlFlow;
use std::path::Path;
use std::time::Instant;

use super::boxes;
use super::cityscapes::Cityscapes;
use super::coco_instances::CocoInstances;
use super::coco_panoptic::CocoPanoptic;
use super::hugging_face::HuggingFace;
use super::labelme::Labelme;
use super::layout::{self, LabelledScene, Written};
use super::overlay::Overlay;
use super::pngs::Pngs;
use super::solid::{self, Solid};
use super::voc::Voc;
use super::yolo::Yolo;
use super::{ExportError, Options};
use crate::TOLD;

/// A kind of data set.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Format {
    /// Label, entropy and colour PNGs.
    #[default]
    Png,
    /// The class colours half over the images, for people.
    Overlay,
    /// Pascal VOC segmentation, and the same for CVAT ("Segmentation mask 1.1").
    Voc,
    /// Label, instance and colour images as in the ground truth of Cityscapes.
    Cityscapes,
    /// COCO panoptic: one segment for each object of a frame, and one for each class that is stuff.
    CocoPanoptic,
    /// COCO instances: one annotation for each object of a frame, and one for each connected region of stuff.
    CocoInstances,
    /// Polygons for labelme.
    Labelme,
    /// Polygons for the segmentation of YOLO.
    Yolo,
    /// A folder for the `datasets` of Hugging Face.
    HuggingFace,
    /// The surface as points with their classes.
    PointCloud,
    /// The surface as a triangle mesh with the classes of its vertices.
    Mesh,
    /// An oriented box around each object, with the points.
    Boxes,
}

impl Format {
    /// All of them, the plain one first.
    pub const ALL: [Self; 12] = [
        Self::Png,
        Self::Overlay,
        Self::Voc,
        Self::Cityscapes,
        Self::CocoPanoptic,
        Self::CocoInstances,
        Self::Labelme,
        Self::Yolo,
        Self::HuggingFace,
        Self::PointCloud,
        Self::Mesh,
        Self::Boxes,
    ];

    /// What it is called on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Png => "png",
            Self::Overlay => "overlay",
            Self::Voc => "voc",
            Self::Cityscapes => "cityscapes",
            Self::CocoPanoptic => "coco-panoptic",
            Self::CocoInstances => "coco-instances",
            Self::Labelme => "labelme",
            Self::Yolo => "yolo",
            Self::HuggingFace => "hugging-face",
            Self::PointCloud => "point-cloud",
            Self::Mesh => "mesh",
            Self::Boxes => "boxes",
        }
    }

    /// Whether it has files for every frame; otherwise it is the surface, once.
    pub fn has_frames(self) -> bool {
        !matches!(self, Self::PointCloud | Self::Mesh | Self::Boxes)
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
/// is written at once: it is called before, with no frame written.
///
/// # Errors
/// [`ExportError::Incomplete`] before anything is written, unless there is exactly one map of the right size for every
/// frame, when the classes cannot be written in this format, or where the surface is to be written and the maps follow from
/// none; and where a frame cannot be written. [`ExportError::Cancelled`]; [`ExportError::Unwritable`].
pub fn export(
    folder: &Path,
    labelled: LabelledScene<'_>,
    format: Format,
    options: &Options,
    progress: &(dyn Fn(usize, usize) -> ControlFlow<()> + Sync),
) -> Result<Written, ExportError> {
    let start = Instant::now();
    let written = match format {
        Format::Png => layout::write(&Pngs, folder, labelled, options, progress),
        Format::Overlay => layout::write(&Overlay, folder, labelled, options, progress),
        Format::Voc => layout::write(&Voc, folder, labelled, options, progress),
        Format::Cityscapes => layout::write(&Cityscapes, folder, labelled, options, progress),
        Format::CocoPanoptic => layout::write(&CocoPanoptic, folder, labelled, options, progress),
        Format::CocoInstances => layout::write(&CocoInstances, folder, labelled, options, progress),
        Format::Labelme => layout::write(&Labelme, folder, labelled, options, progress),
        Format::Yolo => layout::write(&Yolo, folder, labelled, options, progress),
        Format::HuggingFace => layout::write(&HuggingFace, folder, labelled, options, progress),
        Format::PointCloud => solid::write(Solid::Cloud, folder, labelled, options, progress),
        Format::Mesh => solid::write(Solid::Mesh, folder, labelled, options, progress),
        Format::Boxes => boxes::write(folder, labelled, options, progress),
    };
    match &written {
        Ok(written) => tracing::info!(
            format = format.name(),
            folder = %folder.display(),
            files = written.files,
            unchanged = written.unchanged,
            seconds = start.elapsed().as_secs_f64(),
            "labels are exported"
        ),
        Err(error) => tracing::warn!(target: TOLD, "{error}"),
    }
    written
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;
    use crate::export::testing::{SIZE, classes, export_all, files, labelled_scene, labels, maps, scene};
    use crate::labels::Class;
    use crate::scene::testing::on_threads;

    /// Why the maps 2 and 3 cannot be exported, and what lies in the folder then.
    fn refused(format: Format, classes: &[Class]) -> (String, usize) {
        let root = tempfile::tempdir().unwrap();
        let maps = maps(SIZE, &[labels(2), labels(3)]);
        let options = (format, &Options::default());
        let error = export_all(root.path(), &scene(), classes, &maps, options).unwrap_err();
        (error.to_string(), fs::read_dir(root.path()).unwrap().count())
    }

    #[test]
    fn classes_that_a_format_has_no_room_for_are_refused_before_anything_is_written() {
        for (format, class) in [
            (Format::Voc, Class::new(1, "background")),
            (Format::Cityscapes, Class::new(256, "lobster")),
            (Format::Labelme, Class::new(1, "_background_")),
        ] {
            let (reason, files) = refused(format, std::slice::from_ref(&class));
            assert!(reason.contains(&class.name), "{reason}");
            assert_eq!(files, 0, "{}", format.name());
        }
    }

    #[test]
    fn a_pixel_of_an_unlisted_class_is_never_written_as_something_else() {
        let of_frames = Format::ALL.into_iter().filter(|format| format.has_frames());
        // The first two take any number.
        for format in of_frames.skip(2) {
            let (reason, _) = refused(format, &[Class::new(1, "wall")]);
            assert!(reason.contains("frame \"rgb_"), "{reason}");
            assert!(reason.contains("not in the list"), "{reason}");
        }
    }

    #[test]
    fn the_same_maps_give_the_same_bytes() {
        let maps = maps(SIZE, &[labels(2), labels(3)]);
        for format in Format::ALL.into_iter().filter(|format| format.has_frames()) {
            let root = tempfile::tempdir().unwrap();
            let options = (format, &Options::default());
            let export = || export_all(root.path(), &scene(), &classes(), &maps, options).unwrap();
            let (first, again) = (export(), export());
            let written = (again.files, again.unchanged);
            assert_eq!(written, (0, first.files), "{}", format.name());
        }
    }

    #[test]
    fn what_lists_all_frames_goes_before_a_file_of_theirs_is_replaced() {
        // Of COCO instances the frames have their images alone, which stay.
        let has_labels = |format: &Format| format.has_frames() && *format != Format::CocoInstances;
        for format in Format::ALL.into_iter().filter(has_labels) {
            let (root, scene, classes) = (tempfile::tempdir().unwrap(), scene(), classes());
            let export = |numbers: [usize; 2], answer: ControlFlow<()>| {
                let maps = maps(SIZE, &numbers.map(labels));
                let labelled = labelled_scene(&scene, &classes, &maps);
                let written = export(root.path(), labelled, format, &Options::default(), &|_, _| answer);
                (written.is_ok(), files(root.path()).len())
            };
            on_threads(1, || {
                let (is_done, whole) = export([2, 3], ControlFlow::Continue(()));
                assert!(is_done);
                assert_eq!(
                    export([2, 3], ControlFlow::Break(())),
                    (false, whole),
                    "{}",
                    format.name()
                );
                assert!(!export([4, 5], ControlFlow::Break(())).0);
                // A list of classes alone tells nothing of frames.
                let lists = |name: &String| !name.contains("rgb_") && name != "classes.json";
                let others: Vec<String> = files(root.path()).into_keys().filter(lists).collect();
                assert!(others.is_empty(), "{}: {others:?}", format.name());
            });
        }
    }
}
