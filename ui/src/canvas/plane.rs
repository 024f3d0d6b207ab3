//! Planes of numbers over the image, and how they are made. All of it is work for another thread than the window's.

use std::borrow::Cow;
use std::sync::Arc;

use inplace_core::labels::{ImportedMap, LabelSet, rasterise};
use inplace_core::scene::{DepthMap, Frame};
use inplace_core::session::{FrameMap, RenderedView};
use inplace_model::overview::Contradicted;
use inplace_model::palette::{Agreement, PALETTE_COLUMNS, Palette, Table};
use inplace_model::versioned::{Version, Versioned};

/// Value of a [`DepthPlane`] where there is no depth.
const HOLE: u16 = 0;
/// Shares of the depths that lie below and above the range of colours.
const OUTSIDE: f32 = 0.02;

/// A number for every pixel of a plane, row-major `[height, width]`.
#[derive(Clone, Debug)]
pub enum Texels {
    /// The classes of a map.
    Labels(Arc<FrameMap>),
    /// The entropies of a map.
    Entropy(Arc<FrameMap>),
    /// Values made for the canvas.
    Made(Arc<[u16]>),
}

impl Texels {
    /// The numbers; borrowed of a map that is looked up.
    pub fn values(&self) -> Cow<'_, [u16]> {
        match self {
            Self::Labels(map) => map.labels(),
            Self::Entropy(map) => map.entropy(),
            Self::Made(values) => Cow::Borrowed(values),
        }
    }
}

/// How the numbers of a plane become colours.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Reading {
    /// They are class ids.
    Classes,
    /// They are values.
    Values {
        table: Table,
        /// A value times this is a column of the table; the last column stands for all beyond.
        scale: f32,
        /// The value of pixels without one, which are hatched.
        hole: Option<u16>,
    },
}

/// What lies over the image.
#[derive(Clone, Debug)]
pub struct Over {
    /// Width and height of the plane, which covers the whole image.
    pub size: [u32; 2],
    pub texels: Texels,
    /// Different for all numbers.
    pub version: Version,
    /// What they mean.
    pub reading: Reading,
    /// Whether the image under it is dimmed to grey, so that the colours jump out.
    pub greyed: bool,
}

impl Over {
    pub fn classes(size: [u32; 2], texels: Texels, version: Version) -> Self {
        Self {
            size,
            texels,
            version,
            reading: Reading::Classes,
            greyed: false,
        }
    }

    /// Entropies, from none to that of an even guess among all classes.
    pub fn entropy(size: [u32; 2], texels: Texels, version: Version, palette: &Palette) -> Self {
        let reading = Reading::Values {
            table: Table::Entropy,
            scale: palette.entropy_scale(),
            hole: None,
        };
        Self {
            reading,
            ..Self::classes(size, texels, version)
        }
    }

    pub fn depth(plane: &Versioned<DepthPlane>) -> Self {
        let texels = Texels::Made(Arc::clone(&plane.values));
        Self {
            reading: DepthPlane::READING,
            ..Self::classes(plane.size, texels, plane.version())
        }
    }

    /// Numbers that have a column of this table each, over an image that is dimmed to grey.
    pub fn marks(size: [u32; 2], values: Arc<[u16]>, table: Table) -> Self {
        let reading = Reading::Values {
            table,
            scale: 1.0,
            hole: None,
        };
        Self {
            reading,
            greyed: true,
            ..Self::classes(size, Texels::Made(values), Version::new())
        }
    }

    /// Width of the stripes that mark pixels without a value, in pixels of the plane.
    pub fn stripe(&self) -> u32 {
        (self.size[0] / 96).max(2)
    }
}

/// Depths of a frame as values.
#[derive(Clone, Debug, PartialEq)]
pub struct DepthPlane {
    /// Width and height.
    pub size: [u32; 2],
    /// From 1 at the near end of the range to 65,535 at its far end; 0 = no depth. Row-major.
    pub values: Arc<[u16]>,
    /// The 2nd and the 98th percentile of the depths, in metres; `None` where there are none.
    pub range: Option<[f32; 2]>,
}

impl DepthPlane {
    /// How its values are read.
    pub const READING: Reading = Reading::Values {
        table: Table::Depth,
        scale: (PALETTE_COLUMNS - 1) as f32 / u16::MAX as f32,
        hole: Some(HOLE),
    };

    /// Of depths (z) in metres, row-major; 0 = none.
    pub fn new(size: [u32; 2], depths: &[f32]) -> Self {
        let mut known: Vec<f32> = depths.iter().copied().filter(|&depth| depth > 0.0).collect();
        let percentile = |known: &mut [f32], share: f32| {
            let index = (share * (known.len() - 1) as f32).round() as usize;
            *known.select_nth_unstable_by(index, f32::total_cmp).1
        };
        let range =
            (!known.is_empty()).then(|| [OUTSIDE, 1.0 - OUTSIDE].map(|share| percentile(&mut known, share)));
        let [near, far] = range.unwrap_or([0.0, 1.0]);
        let steps = f32::from(u16::MAX - 1) / (far - near).max(1e-6);
        let value = |&depth: &f32| {
            if depth > 0.0 {
                // A cast saturates.
                1 + (((depth - near) * steps).round() as u16).min(u16::MAX - 1)
            } else {
                HOLE
            }
        };
        Self {
            size,
            values: depths.iter().map(value).collect(),
            range,
        }
    }

    /// Of a frame's measured depth; `None` where there is none.
    pub fn measured(frame: &Frame) -> Option<Self> {
        let depth = frame.depth()?;
        let depths: Vec<f32> = (0..frame.camera.pixels())
            .map(|index| measured_depth(frame, &depth, index).unwrap_or(0.0))
            .collect();
        Some(Self::new([frame.camera.width, frame.camera.height], &depths))
    }

    /// Of a view of the field, in the pixels of its camera.
    pub fn rendered(view: &RenderedView) -> Self {
        let (width, height) = (view.viewpoint.camera.width, view.viewpoint.camera.height);
        let depths: Vec<f32> = (0..height)
            .flat_map(|y| (0..width).map(move |x| [x, y]))
            .map(|pixel| view.depth_at(pixel).unwrap_or(0.0))
            .collect();
        Self::new([width, height], &depths)
    }
}

/// Measured depth (z) in metres of the pixel of a frame with this row-major index; `None` = unknown.
pub fn measured_depth(frame: &Frame, depth: &DepthMap, index: usize) -> Option<f32> {
    if index >= depth.len() {
        return None;
    }
    let (column, row) = (
        index as u32 % frame.camera.width,
        index as u32 / frame.camera.width,
    );
    Some(depth.ray_length(index)? / frame.camera.pixel_direction(column, row).length())
}

/// The [`Agreement`] on every pixel of a map, as its number, row-major.
///
/// A pixel of an imported image is contradicted where the map has another class; what it says of deleted classes does not
/// count. A pixel of a stroke counts as the stroke says, whatever the image says there; it is contradicted where
/// `contradicted` has the stroke with another class, which is what the other strokes say.
pub fn disagreement(
    map: &FrameMap,
    imported: Option<&ImportedMap>,
    labels: &LabelSet,
    contradicted: &Contradicted,
) -> Vec<u16> {
    let shown = map.labels();
    let mut agreement = vec![Agreement::Unlabelled as u16; shown.len()];
    if let Some(image) = imported.filter(|image| image.pixels() == shown.len()) {
        for ((pixel_agreement, &label), class) in agreement.iter_mut().zip(shown.iter()).zip(image.labels()) {
            if labels.class(class).is_some() {
                *pixel_agreement = if label == class {
                    Agreement::Agreed as u16
                } else {
                    Agreement::ImportContradicted as u16
                };
            }
        }
    }
    for (pixel, (class, stroke)) in rasterise(labels, map.frame, map.width, map.height) {
        let disputed = contradicted.get(&stroke).is_some_and(|&others| others != class);
        agreement[pixel as usize] = if disputed {
            Agreement::StrokeContradicted as u16
        } else {
            Agreement::Agreed as u16
        };
    }
    agreement
}

#[cfg(test)]
mod tests {
    use inplace_core::labels::{History, Stroke, StrokeId, VOID};

    use super::*;

    #[test]
    fn depth_runs_from_the_2nd_to_the_98th_percentile_and_holes_stay_holes() {
        let mut depths: Vec<f32> = (0..101).map(|index| 1.0 + 0.01 * index as f32).collect();
        depths[50] = 0.0;
        depths[100] = 900.0;
        let plane = DepthPlane::new([101, 1], &depths);
        let [near, far] = plane.range.unwrap();
        assert!(
            (near - 1.02).abs() < 1e-4 && (far - 1.98).abs() < 1e-4,
            "{near} {far}"
        );
        assert_eq!(
            (plane.values[0], plane.values[50], plane.values[100]),
            (1, HOLE, u16::MAX)
        );
        assert!(plane.values[40] < plane.values[60]);
        let empty = DepthPlane::new([2, 1], &[0.0, 0.0]);
        assert_eq!((empty.range, &empty.values[..]), (None, &[HOLE, HOLE][..]));
        let flat = DepthPlane::new([2, 1], &[2.0, 2.0]);
        assert_eq!(&flat.values[..], [1, 1]);
    }

    #[test]
    fn a_stroke_covers_the_imported_image_and_each_is_contradicted_only_by_another_class() {
        use Agreement::{Agreed, ImportContradicted, StrokeContradicted, Unlabelled};
        let map = FrameMap::new(0, 1, [4, 1], vec![1; 4], vec![0; 4]).unwrap();
        let mut history = History::default();
        history.add_class("wall");
        history.add_class("lamp");
        let unlabelled = history.labels().clone();
        for x in 0..3 {
            history.add_stroke(Stroke::click(0, 2, [x, 0]));
        }
        let ids: Vec<StrokeId> = history.labels().strokes.keys().copied().collect();
        let contradicted = Contradicted::from([(ids[0], 1), (ids[1], 2)]);
        for (imported, labels, expected) in [
            (
                // The last class was deleted.
                [1, 2, VOID, 9],
                &unlabelled,
                [Agreed, ImportContradicted, Unlabelled, Unlabelled],
            ),
            (
                [1; 4],
                history.labels(),
                [StrokeContradicted, Agreed, Agreed, Agreed],
            ),
        ] {
            let image = ImportedMap::new(0, &imported);
            let agreement = disagreement(&map, Some(&image), labels, &contradicted);
            assert_eq!(
                agreement,
                expected.map(|agreement| agreement as u16),
                "{imported:?}"
            );
        }
    }
}
