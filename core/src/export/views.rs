//! Views of a labelled scene along a camera path, as a capture in the Replica layout with its labels.

use std::ops::ControlFlow;
use std::path::Path;

use super::layout::{About, Labelled, Layout, OutputFile, Written, exported};
use super::pngs::Pngs;
use super::{ExportError, Options, Refusal};
use crate::labels::{Class, png};
use crate::scene::{
    Camera, Frame, ImagePixels, Scene, Trajectory, Viewpoint, intrinsics_line, pose_line, z_millimetres,
};
use crate::semantics::NovelViews;

/// Views to render.
#[derive(Clone, Copy)]
pub struct Views<'a> {
    /// The scene.
    pub scene: &'a Scene,
    /// Its classes.
    pub classes: &'a [Class],
    /// Where they are seen from. Without a camera of its own, that of the first frame is taken, without distortion.
    pub trajectory: &'a Trajectory,
    /// What renders them.
    pub renderer: &'a NovelViews<'a>,
}

/// Renders the views and writes them, one after the other: `rgb/view_N.png` and `depth/view_N.png` (16 bit, millimetres
/// along z, 0 = none), `traj_w_c.txt` (metres) and `intrinsics.txt` as in the Replica layout, so that the folder opens as
/// a capture; and `labels/`, `entropy/`, `color/` and `classes.json` as for the frames. Each file is written under a
/// temporary name and renamed.
///
/// `progress` is called with (views written, views in all); when it answers [`ControlFlow::Break`], no further view is
/// begun. What an export of another path left in the folder is removed: its poses at once, so that they are not taken for
/// those of these views, and views that are more than these at the end.
///
/// # Errors
/// [`ExportError::Incomplete`] where there is no camera or a view cannot be rendered; [`ExportError::Cancelled`];
/// [`ExportError::Unwritable`].
pub fn export_views(
    folder: &Path,
    views: Views<'_>,
    options: &Options,
    progress: &mut dyn FnMut(usize, usize) -> ControlFlow<()>,
) -> Result<Written, ExportError> {
    let incomplete = |reason: Refusal| ExportError::incomplete(folder, reason);
    let Views {
        scene, trajectory, ..
    } = views;
    let first = scene.frames.first().map(|frame| frame.camera);
    let Some(camera) = trajectory.camera.or(first) else {
        return Err(incomplete(
            "the scene has no frame whose camera could be taken".into(),
        ));
    };
    let ids = options.ids_of(views.classes);
    let folders: Vec<&str> = [&["rgb", "depth"], Pngs::FOLDERS].concat();
    super::prepare(folder, &folders)?;
    super::remove(&folder.join(super::REPORT))?;
    let capture = capture(scene, trajectory, &camera);
    for file in capture.iter().filter(|file| !file.is_there(folder)) {
        super::remove(&folder.join(&file.path))?;
    }
    let mut written = Written::default();
    let total = trajectory.poses.len();
    for (number, pose) in trajectory.poses.iter().enumerate() {
        let viewpoint = Viewpoint {
            camera,
            camera_to_world: scene.of_capture(pose),
        };
        let rendered = views.renderer.view(number, &viewpoint);
        let (frame, map) = rendered.map_err(|error| incomplete(error.into()))?;
        let files = exported(
            &frame,
            (&map, None),
            &ids,
            options.least_probability,
            &ImagePixels::default(),
        )
        .and_then(|labelled| files(&frame, &labelled))
        .map_err(|reason| ExportError::incomplete(folder, format!("view {number}: {reason}")))?;
        files.iter().try_for_each(|file| written.write(folder, file))?;
        if progress(number + 1, total).is_break() && number + 1 < total {
            return Err(ExportError::cancelled(folder, number + 1, total));
        }
    }
    let about = About {
        classes: ids.classes(),
        objects: None,
    };
    let mut index = Pngs.index(about, Vec::new()).map_err(incomplete)?;
    index.extend(capture);
    index.iter().try_for_each(|file| written.write(folder, file))?;
    folders
        .iter()
        .try_for_each(|inner| remove_from(&folder.join(inner), total))?;
    Ok(written)
}

/// Removes the views from this one on, which an export of a longer path left: with them the folder would be no capture.
fn remove_from(folder: &Path, first: usize) -> Result<(), ExportError> {
    for number in first.. {
        if !super::remove(&folder.join(format!("view_{number}.png")))? {
            break;
        }
    }
    Ok(())
}

/// The images of a view.
fn files(frame: &Frame, labelled: &Labelled<'_>) -> Result<Vec<OutputFile>, Refusal> {
    let [width, height] = labelled.size;
    let (mut files, _) = Pngs.frame(labelled)?;
    let pixels = frame.pixels()?;
    let depth = pixels
        .depth
        .map(|depth| z_millimetres(frame, &depth))
        .unwrap_or_default();
    let images = [
        ("rgb", png::encode_rgb(width, height, pixels.color.bytes())),
        ("depth", png::encode_steps(width, height, &depth)),
    ];
    for (folder, image) in images {
        files.push(OutputFile::new(format!("{folder}/{}.png", frame.stem), image?));
    }
    Ok(files)
}

/// What makes the folder a capture.
fn capture(scene: &Scene, trajectory: &Trajectory, camera: &Camera) -> [OutputFile; 2] {
    let line = |pose: &glam::DAffine3| {
        let rotation = pose.matrix3;
        let rows = [0, 1, 2].map(|row| rotation.row(row).to_array());
        pose_line(rows, pose.translation / scene.unit)
    };
    let poses: String = trajectory.poses.iter().map(line).collect();
    [
        OutputFile::new("traj_w_c.txt", poses.into_bytes()),
        OutputFile::new("intrinsics.txt", intrinsics_line(camera).into_bytes()),
    ]
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use glam::{DAffine3, Mat3};

    use super::*;
    use crate::export::testing::files;
    use crate::export::tests::distant_wall;
    use crate::field::{Preset, Trainer};
    use crate::scene::ColorImage;
    use crate::scene::testing::open;
    use crate::semantics::LabelPropagation;

    /// The distant wall, taught.
    struct Taught {
        scene: Arc<Scene>,
        trainer: Trainer,
        spread: LabelPropagation,
        classes: Vec<Class>,
    }

    fn taught(steps: usize) -> Taught {
        let classes = vec![Class::new(3, "dark"), Class::new(7, "bright")];
        let (scene, spread) = distant_wall(9, &classes);
        let mut trainer = Trainer::new(Arc::clone(&scene), Preset::Fast, 1).unwrap();
        for _ in 0..steps {
            trainer.step().unwrap();
        }
        Taught {
            scene,
            trainer,
            spread,
            classes,
        }
    }

    impl Taught {
        fn export(&self, folder: &Path, trajectory: &Trajectory) -> Result<Written, ExportError> {
            let map = self.spread.map(&self.scene, 0, 1);
            let (surface, posterior) = map.surface().unwrap();
            let renderer = NovelViews::new(&self.trainer, surface, posterior, self.classes.len());
            let views = Views {
                scene: &self.scene,
                classes: &self.classes,
                trajectory,
                renderer: &renderer,
            };
            let stop_after = 9;
            export_views(folder, views, &Options::default(), &mut |done, _| {
                if done == stop_after {
                    ControlFlow::Break(())
                } else {
                    ControlFlow::Continue(())
                }
            })
        }

        /// The poses of the frames as the capture has them.
        fn path(&self) -> Trajectory {
            let pose = |frame: &Frame| {
                let rotation = Mat3::from(frame.camera_to_world.matrix3).as_dmat3();
                DAffine3::from_mat3_translation(rotation, self.scene.to_capture(frame.center()))
            };
            Trajectory {
                poses: self.scene.frames.iter().map(pose).collect(),
                camera: None,
            }
        }
    }

    #[test]
    fn views_from_where_the_frames_were_taken_open_as_a_capture_and_agree_with_the_maps() {
        let root = tempfile::tempdir().unwrap();
        let (taught, out) = (taught(150), root.path().join("out"));
        let trajectory = taught.path();
        let count = taught.export(&out, &trajectory).unwrap();
        assert_eq!((count.files, count.unchanged), (9 * 5 + 3, 0));
        let again = taught.export(&out, &trajectory).unwrap();
        assert_eq!((again.files, again.unchanged), (0, 9 * 5 + 3));

        let scene = open(&out).unwrap();
        assert_eq!((scene.format, scene.frames.len()), ("Replica", 9));
        assert!(scene.warnings.is_empty(), "{:?}", scene.warnings);
        let written = files(&out);
        let (mut right, mut pixels) = ([0; 3], 0);
        for (number, (view, own)) in scene.frames.iter().zip(&taught.scene.frames).enumerate() {
            assert_eq!(view.stem, format!("view_{number}"));
            assert_eq!(view.camera, own.camera);
            // In metres, where the capture has feet.
            let gap = scene.to_capture(view.center()) - taught.scene.to_capture(own.center()) / 3.28;
            assert!(gap.length() < 1e-3, "{gap}");
            let labels = png::decode_gray(&written[&format!("labels/view_{number}.png")])
                .unwrap()
                .2;
            let map = taught.spread.map(&taught.scene, number, 1);
            let (depth, own_depth) = (view.depth().unwrap(), own.depth().unwrap());
            let (color, own_color) = (view.color(), own.color());
            for (pixel, (label, own_label)) in labels.iter().zip(map.labels().iter()).enumerate() {
                let length = |depth: Option<f32>| depth.unwrap_or(0.0);
                let gap = length(depth.ray_length(pixel)) - own_depth.ray_length(pixel).unwrap();
                let gray = |color: &ColorImage| i32::from(color.pixel(pixel)[0]);
                right[0] += usize::from(label == own_label);
                right[1] += usize::from(gap.abs() < 0.1);
                right[2] += usize::from((gray(&color) - gray(&own_color)).abs() < 60);
                pixels += 1;
            }
        }
        let is_most = |&count: &usize| 20 * count > 19 * pixels;
        assert!(right.iter().all(is_most), "of {pixels}: {right:?}");
        let classes: Vec<Class> = serde_json::from_slice(&written["classes.json"]).unwrap();
        assert_eq!(classes, taught.classes);

        let mut shorter = trajectory;
        shorter.poses.truncate(4);
        taught.export(&out, &shorter).unwrap();
        assert_eq!(open(&out).unwrap().frames.len(), 4);
        assert_eq!(files(&out).len(), 4 * 5 + 3);
    }

    #[test]
    fn a_path_with_a_camera_of_its_own_is_seen_by_that_and_can_be_stopped() {
        let root = tempfile::tempdir().unwrap();
        let taught = taught(0);
        let camera = Camera::with_horizontal_fov(20, 12, 40.0);
        let mut trajectory = taught.path();
        trajectory.camera = Some(camera);
        trajectory.poses.truncate(1);
        taught.export(root.path(), &trajectory).unwrap();
        let scene = open(root.path()).unwrap();
        assert_eq!((scene.frames.len(), scene.frames[0].camera), (1, camera));
        let seen = scene.frames[0].center();
        let capture = scene.to_capture(seen).as_vec3();
        let expected = (taught.path().poses[0].translation / 3.28).as_vec3();
        assert!(capture.distance(expected) < 1e-3, "{capture} {expected}");

        let pose = trajectory.poses[0];
        trajectory.poses = vec![pose; 10];
        let error = taught.export(root.path(), &trajectory).unwrap_err();
        assert!(error.to_string().contains("9 of 10"), "{error}");
        let poses = root.path().join("traj_w_c.txt");
        assert!(!poses.exists(), "those of the export before are of other views");
    }
}
