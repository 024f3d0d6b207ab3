//! How large a field a scene gets.

use std::fmt;

use serde::{Deserialize, Serialize};

use super::{GridShape, Volume};
use crate::scene::{Frame, Scene};

/// How large a field may grow, and for how long it trains.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[cfg_attr(feature = "clap", derive(clap::ValueEnum))]
#[serde(rename_all = "lowercase")]
pub enum Preset {
    /// Chosen from the scene.
    #[default]
    Auto,
    /// Coarser and sooner.
    Fast,
    /// Finer and later.
    Accurate,
}

impl Preset {
    /// Its name on the command line and in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Auto => "auto",
            Self::Fast => "fast",
            Self::Accurate => "accurate",
        }
    }
}

/// The size of a field, and how long it trains.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Capacity {
    /// Levels of the grid.
    pub levels: usize,
    /// Cells a side of the coarsest level.
    pub coarsest: u32,
    /// Cells a side of the finest level.
    pub finest: u32,
    /// Logarithm (base 2) of the largest number of rows of a level.
    pub table_log2: u32,
    /// Upper bound of [`Capacity::table_log2`], which grows while the held-out error falls.
    pub most_log2: u32,
    /// Width of the hidden layers.
    pub hidden: usize,
    /// Steps until the learning rate has come down; fewer when the held-out error no longer falls.
    pub steps: u64,
    /// Side of the finest cell, in metres.
    pub cell: f32,
}

impl Capacity {
    /// The capacity for a scene: the finest cells are as large as a pixel's footprint at a typical surface.
    pub fn for_scene(scene: &Scene, volume: &Volume, preset: Preset) -> Self {
        // With measured depth there is less to learn.
        let auto_steps = if scene.has_depth() { 2_500 } else { 12_000 };
        let (coarser, (table_log2, most_log2), steps) = match preset {
            Preset::Fast => (2.0, (15, 15), 800),
            Preset::Auto => (1.0, (17, 19), auto_steps),
            Preset::Accurate => (0.5, (19, 19), 12_000),
        };
        let cell = coarser * pixel_footprint(scene, volume);
        let coarsest = 16;
        let finest = ((volume.side / cell).round() as u32).clamp(2 * coarsest, 2048);
        Self {
            levels: 8,
            coarsest,
            finest,
            table_log2,
            most_log2,
            hidden: 64,
            steps,
            cell: volume.side / finest as f32,
        }
    }

    /// The same with about `size` times the rows in each hashed level, at first and at most, to the next power of two.
    /// The finest cells shrink by the root of that, since a surface then has as many times more of them.
    #[must_use]
    pub fn scaled(self, size: f32) -> Self {
        let doublings = size.log2().round() as i32;
        let rows = |log2: u32| log2.saturating_add_signed(doublings).clamp(4, 24);
        let finest = (self.finest as f32 * 2.0_f32.powf(0.5 * doublings as f32)).round() as u32;
        let finest = finest.clamp(2 * self.coarsest, 4096);
        Self {
            finest,
            table_log2: rows(self.table_log2),
            most_log2: rows(self.most_log2),
            cell: self.cell * (self.finest as f32 / finest as f32),
            ..self
        }
    }

    /// How often the table may still double.
    pub fn doublings(&self) -> u32 {
        self.most_log2.saturating_sub(self.table_log2)
    }

    /// The shape of the semantic field's own grid: its finest cells are five of the field's, about two voxels of the
    /// surface. Things are larger than their texture, and finer cells would learn the noise of labels.
    pub fn semantic_grid(&self) -> GridShape {
        GridShape::new(6, self.coarsest, (self.finest / 5).max(self.coarsest + 1), 15)
    }

    /// The shape of the grid.
    pub fn grid(&self) -> GridShape {
        GridShape::new(self.levels, self.coarsest, self.finest, self.table_log2)
    }
}

impl fmt::Display for Capacity {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "{} levels down to {:.1} cm, 2^{} rows a level, {} hidden units",
            self.levels,
            100.0 * self.cell,
            self.table_log2,
            self.hidden
        )
    }
}

/// The median of values, the upper one of two in the middle; `None` of no values.
pub(crate) fn median(mut values: Vec<f32>) -> Option<f32> {
    let middle = values.len() / 2;
    (!values.is_empty()).then(|| *values.select_nth_unstable_by(middle, f32::total_cmp).1)
}

/// Size of a pixel at a typical surface, in metres: at the median measured depth, else at that of the sparse
/// points, else half way from the centre to a side of the volume.
fn pixel_footprint(scene: &Scene, volume: &Volume) -> f32 {
    let keyframes = scene.frames.iter().filter(|frame| frame.is_keyframe());
    let lengths = keyframes.filter_map(Frame::depth).flat_map(|depth| {
        let sampled = depth.sampled(100).map(|(_, length)| length);
        sampled.collect::<Vec<f32>>()
    });
    let sparse = || {
        let points = scene.frames.iter().flat_map(|frame| &frame.points);
        points.map(|point| point.length).collect()
    };
    let length = median(lengths.collect())
        .or_else(|| median(sparse()))
        .unwrap_or(0.25 * volume.side);
    let focal = median(scene.frames.iter().map(|frame| frame.camera.fx).collect()).unwrap_or(1.0);
    length / focal
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::wall;

    #[test]
    fn four_times_the_rows_have_cells_of_half_the_side() {
        let scene = wall(3, 640, 480);
        let volume = Volume::around(&scene.bounds());
        let chosen = Capacity::for_scene(&scene, &volume, Preset::Auto);
        assert_eq!(chosen.scaled(1.0), chosen);
        let larger = chosen.scaled(4.0);
        assert_eq!(larger.table_log2, chosen.table_log2 + 2);
        assert_eq!(larger.most_log2, chosen.most_log2 + 2);
        assert_eq!(larger.finest, 2 * chosen.finest);
        assert!((larger.cell - 0.5 * chosen.cell).abs() < 1e-5 * chosen.cell);
        let smaller = chosen.scaled(0.5);
        assert_eq!(smaller.table_log2, chosen.table_log2 - 1);
        assert!((smaller.cell / chosen.cell - 2.0_f32.sqrt()).abs() < 0.01);
        assert_eq!((smaller.levels, smaller.steps), (chosen.levels, chosen.steps));
    }
}
