//! An oriented box around each object, for 3D detection.

use std::fmt::Write as _;
use std::ops::ControlFlow;
use std::path::Path;

use glam::{DMat3, DQuat, DVec2, DVec3};
use serde::Serialize;

use super::layout::{LabelledScene, OutputFile, Written, json_file};
use super::objects::ExportedObject;
use super::ply::{self, Vertex};
use super::solid::{self, Solid};
use super::{ExportError, Options, Refusal};
use crate::labels::ClassId;

/// Share of an object's points beyond each side of its box: strays.
const BEYOND: f64 = 0.01;
/// Points that are looked at for the yaw, at most.
const MOST_POINTS: usize = 2000;
/// Angle below which the vertical is taken for an axis of the capture, in degrees.
const ALIGNED: f64 = 5.0;

/// A line of `boxes.json`, in the coordinates and the unit of the capture's poses.
#[derive(Serialize)]
struct ObjectBox {
    id: u16,
    class_id: ClassId,
    class_name: String,
    name: String,
    center: [f64; 3],
    /// Along the box's own axes: the longer side of the footprint, the shorter one, the height.
    size: [f64; 3],
    /// From the box's own axes to the capture's, row by row.
    rotation: [[f64; 3]; 3],
    /// Number of its points.
    points: usize,
}

/// An upright box, z up.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Upright {
    center: DVec3,
    size: DVec3,
    /// Of its longer side about z from x, in radians, above -pi/2 up to pi/2.
    yaw: f64,
}

/// Writes `boxes.json`: a box around each thing with points on the surface. For viewers also `pointclouds/cloud.ply`, turned so
/// that z is up, in metres, and in the same coordinates `labels/cloud.txt`, a line for each box with the fields of KITTI, as
/// labelCloud reads them (`kitti_untransformed`): `class 0 0 0 0 0 0 0 height width length x y z yaw`, where x, y, z is the centre
/// and the yaw turns about z.
///
/// Boxes stand upright: their yaw is that of the smallest rectangle around the footprint. The outermost hundredth of the points
/// on each side is left out, and half a voxel added, as a point is the middle of a voxel.
///
/// # Errors
/// [`ExportError::Incomplete`] where the maps follow from no surface or no class is a thing; [`ExportError::Cancelled`];
/// [`ExportError::Unwritable`].
pub(super) fn write(
    folder: &Path,
    labelled: LabelledScene<'_>,
    options: &Options,
    progress: &(dyn Fn(usize, usize) -> ControlFlow<()> + Sync),
) -> Result<Written, ExportError> {
    let incomplete = |reason: Refusal| ExportError::incomplete(folder, reason);
    let shape = solid::shape(Solid::Cloud, labelled, options).map_err(incomplete)?;
    if !shape.classes.iter().any(|class| class.thing) {
        let reason = "no class is a thing, so that there are no objects to put boxes around; say in the menu of a class that it is one";
        return Err(incomplete(reason.into()));
    }
    let (unit, voxel) = (labelled.scene.unit, f64::from(shape.surface.voxel));
    let turn = levelling(shape.surface.look.vertical.as_dvec3());
    let level = |vertex: &Vertex| Vertex {
        position: turn * vertex.position / unit,
        normal: turn.as_mat3() * vertex.normal,
        ..*vertex
    };
    let cloud: Vec<Vertex> = shape.vertices.iter().map(level).collect();
    let around = |object: &ExportedObject| {
        let own = cloud.iter().filter(|vertex| vertex.object == object.id);
        let points: Vec<DVec3> = own.map(|vertex| vertex.position).collect();
        Some((object.clone(), points.len(), upright(&points, voxel)?))
    };
    let things = shape.objects.iter().filter(|object| object.thing);
    let boxes: Vec<(ExportedObject, usize, Upright)> = things.filter_map(around).collect();
    let mut text = String::new();
    let mut records = Vec::with_capacity(boxes.len());
    for (object, points, found) in boxes {
        let class = shape.classes.iter().find(|class| class.id == object.class);
        let class_name = class.map_or_else(String::new, |class| class.name.clone());
        let (DVec3 { x, y, z }, size) = (found.center, found.size);
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "{} 0 0 0 0 0 0 0 {:.4} {:.4} {:.4} {x:.4} {y:.4} {z:.4} {:.4}",
            class_name.split_whitespace().collect::<Vec<_>>().join("_"),
            size.z,
            size.y,
            size.x,
            found.yaw
        );
        let axes = turn.transpose() * DMat3::from_rotation_z(found.yaw);
        records.push(ObjectBox {
            id: object.id,
            class_id: object.class,
            class_name,
            name: object.name,
            center: (turn.transpose() * found.center * unit).to_array(),
            size: (size * unit).to_array(),
            rotation: [0, 1, 2].map(|row| axes.row(row).to_array()),
            points,
        });
    }
    let comments = ["metres, z up, in the axes of labels/cloud.txt".to_owned()];
    let files = [
        json_file("boxes.json", &records).map_err(incomplete)?,
        OutputFile::new("pointclouds/cloud.ply", ply::encode(&comments, &cloud, None)),
        OutputFile::new("labels/cloud.txt", text.into_bytes()),
    ];
    let frames = labelled.scene.frames.len();
    Written::at_once(folder, (&["pointclouds", "labels"], files), frames, progress)
}

/// The smallest turn of the capture's axes after which z is up; none, or of quarters, where the vertical is about an axis.
fn levelling(vertical: DVec3) -> DMat3 {
    let axes = [
        DVec3::Z,
        DVec3::NEG_Z,
        DVec3::Y,
        DVec3::NEG_Y,
        DVec3::X,
        DVec3::NEG_X,
    ];
    let is_near = |axis: &DVec3| axis.dot(vertical) > ALIGNED.to_radians().cos();
    let up = axes.into_iter().find(is_near).unwrap_or(vertical).try_normalize();
    DMat3::from_quat(DQuat::from_rotation_arc(up.unwrap_or(DVec3::Z), DVec3::Z))
}

/// The box around points of which each is the middle of a voxel with this side; `None` without points.
fn upright(points: &[DVec3], voxel: f64) -> Option<Upright> {
    let few: Vec<DVec3> = points
        .iter()
        .copied()
        .step_by(points.len().div_ceil(MOST_POINTS).max(1))
        .collect();
    let area = |yaw: f64| {
        let [(left, right), (back, front)] = footprint(&few, yaw)?;
        Some((right - left) * (front - back))
    };
    let yaws = (0..90).map(|degrees| f64::from(degrees).to_radians());
    let areas = yaws.filter_map(|yaw| Some((area(yaw)?, yaw)));
    let (_, mut yaw) = areas.min_by(|(a, _), (b, _)| a.total_cmp(b))?;
    let [across, along] = footprint(points, yaw)?;
    let (low, high) = extent(points.iter().map(|point| point.z))?;
    let middle = |(low, high): (f64, f64)| 0.5 * (low + high);
    let [length, width] = [across, along].map(|(low, high)| high - low + voxel);
    let center = DVec2::from_angle(yaw).rotate(DVec2::new(middle(across), middle(along)));
    let mut size = DVec3::new(length, width, high - low + voxel);
    if width > length {
        size = DVec3::new(width, length, size.z);
        yaw += std::f64::consts::FRAC_PI_2;
    }
    if yaw > std::f64::consts::FRAC_PI_2 {
        yaw -= std::f64::consts::PI;
    }
    Some(Upright {
        center: center.extend(middle((low, high))),
        size,
        yaw,
    })
}

/// How far points reach along axes that are turned by a yaw about z.
fn footprint(points: &[DVec3], yaw: f64) -> Option<[(f64, f64); 2]> {
    let along = DVec2::from_angle(yaw);
    let reach = |axis: DVec2| extent(points.iter().map(|point| point.truncate().dot(axis)));
    Some([reach(along)?, reach(along.perp())?])
}

/// The least and the largest of values, without the outermost on each side; `None` without values.
fn extent(values: impl Iterator<Item = f64>) -> Option<(f64, f64)> {
    let mut values: Vec<f64> = values.collect();
    let last = values.len().checked_sub(1)?;
    let beyond = (BEYOND * last as f64).round() as usize;
    let low = *values.select_nth_unstable_by(beyond, f64::total_cmp).1;
    let high = *values.select_nth_unstable_by(last - beyond, f64::total_cmp).1;
    Some((low, high))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_turned_block_has_its_own_box_in_spite_of_strays() {
        let (size, center) = (DVec3::new(1.8, 0.9, 0.7), DVec3::new(3.0, -2.0, 0.35));
        for degrees in [-75.0_f64, 0.0, 30.0, 90.0] {
            let axes = DMat3::from_rotation_z(degrees.to_radians());
            let place = |k: usize| {
                let cell = [k % 36, k / 36 % 18, k / 36 / 18].map(|cell| cell as f64 + 0.5);
                center + axes * (0.05 * DVec3::from_array(cell) - 0.5 * size)
            };
            let mut points: Vec<DVec3> = (0..36 * 18 * 14).map(place).collect();
            points.extend((0..40).map(|k| center + DVec3::new(5.0, 0.1 * f64::from(k), 4.0)));
            let found = upright(&points, 0.05).unwrap();
            assert!((found.yaw.to_degrees() - degrees).abs() < 1.01, "{found:?}");
            assert!((found.size - size).abs().max_element() < 0.11, "{found:?}");
            assert!(found.center.distance(center) < 0.06, "{found:?}");
        }
        assert_eq!(upright(&[], 0.05), None);
    }

    #[test]
    fn axes_of_a_capture_stay_where_one_of_them_is_about_vertical() {
        let about = |x: f64, y: f64, z: f64| levelling(DVec3::new(x, y, z).normalize());
        assert_eq!(about(0.02, -0.03, 1.0), DMat3::IDENTITY);
        let turned = about(0.01, -1.0, 0.02);
        assert!((turned * DVec3::NEG_Y).distance(DVec3::Z) < 1e-12);
        let slanted = DVec3::new(0.0, 0.6, 0.8);
        assert!((levelling(slanted) * slanted).distance(DVec3::Z) < 1e-12);
    }
}
