//! Charts as SVG that need nothing around them: panels of lines in a grid, readable on light and on
//! dark pages, in colours that the colour-blind can tell apart.

mod axis;
mod panel;
mod svg;
#[cfg(test)]
mod tests;

use std::collections::BTreeMap;
use std::path::Path;

use crate::mean;
use inplace_core::export::{self, ExportError};
use svg::Svg;

/// Several panels under one title.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Figure {
    /// What is shown.
    pub title: String,
    /// One line of conditions: machine, threads, seeds.
    pub subtitle: String,
    /// The panels, two in a row; all have the same size.
    pub panels: Vec<Panel>,
}

/// Lines with markers, named at their right end. Values that are not finite (or not positive, on a logarithmic axis) are
/// left out.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// What is shown.
    pub title: String,
    /// The horizontal axis.
    pub x: Axis,
    /// The vertical axis.
    pub y: Axis,
    /// The lines.
    pub series: Vec<Series>,
}

/// An axis.
#[derive(Clone, Debug, PartialEq)]
pub struct Axis {
    /// Quantity and unit, as in `PSNR, dB`.
    pub label: String,
    /// How values become places.
    pub scale: Scale,
}

/// How values become places on an axis.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Scale {
    /// Evenly, over the range of the data.
    Linear,
    /// Evenly, from zero.
    FromZero,
    /// By logarithm.
    Logarithmic,
}

/// A line.
#[derive(Clone, Debug, PartialEq)]
pub struct Series {
    /// Its name.
    pub name: String,
    /// Its points, from left to right.
    pub points: Vec<Point>,
}

/// A point of a line, with the spread around it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Place along the horizontal axis.
    pub x: f64,
    /// Value.
    pub y: f64,
    /// Smallest and largest value, where there are several; equal to `y` otherwise.
    pub range: (f64, f64),
    /// Whether a ring is drawn around it: a point unlike the others, as the subtitle says.
    pub ring: bool,
}

impl Panel {
    /// Lines between two axes.
    pub fn new(title: impl Into<String>, x: Axis, y: Axis, series: Vec<Series>) -> Self {
        let title = title.into();
        Self { title, x, y, series }
    }
}

impl Axis {
    /// An axis.
    pub fn new(label: impl Into<String>, scale: Scale) -> Self {
        let label = label.into();
        Self { label, scale }
    }
}

impl Series {
    /// A line through points, from left to right.
    pub fn new(name: impl Into<String>, points: impl IntoIterator<Item = Point>) -> Self {
        let (name, points) = (name.into(), points.into_iter().collect());
        Self { name, points }
    }

    /// A line through the means of what has the same key, in the order of the keys: key, place and value.
    pub fn of_means<K: Ord>(
        name: impl Into<String>,
        measured: impl IntoIterator<Item = (K, f64, f64)>,
    ) -> Self {
        let mut groups: BTreeMap<K, Vec<(f64, f64)>> = BTreeMap::new();
        for (key, x, y) in measured {
            groups.entry(key).or_default().push((x, y));
        }
        Self::new(name, groups.into_values().filter_map(Point::of_means))
    }
}

impl Point {
    /// A single measurement.
    pub fn new(x: f64, y: f64) -> Self {
        let (range, ring) = ((y, y), false);
        Self { x, y, range, ring }
    }

    /// The same point with a ring around it.
    #[must_use]
    pub fn ringed(mut self) -> Self {
        self.ring = true;
        self
    }

    /// Mean and range of several measurements, at the mean of their places; `None` without any finite one.
    pub fn of_means(measured: impl IntoIterator<Item = (f64, f64)>) -> Option<Self> {
        let finite = measured.into_iter().filter(|(_, y)| y.is_finite());
        let (x, y): (Vec<f64>, Vec<f64>) = finite.unzip();
        let low = y.iter().copied().fold(f64::INFINITY, f64::min);
        let high = y.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let point = Self::new(mean(x), mean(y));
        (low <= high).then_some(Self {
            range: (low, high),
            ..point
        })
    }
}

impl Figure {
    /// The figure as a whole SVG file.
    pub fn svg(&self) -> String {
        const MARGIN: f64 = 24.0;
        const GAP: f64 = 28.0;
        const COLUMNS: usize = 2;
        let columns = self.panels.len().clamp(1, COLUMNS);
        // A single panel is no narrower than a line of conditions.
        let narrowest = if columns == 1 { 640.0 } else { panel::WIDTH };
        let inside = columns as f64 * (narrowest + GAP) - GAP;
        let width = 2.0 * MARGIN + inside;
        let subtitle = svg::wrapped(&self.subtitle, 12.0, inside);
        let top = MARGIN + 18.0 + 16.0 * subtitle.len() as f64 + 18.0;
        let body = self.panels.len().div_ceil(columns) as f64 * (panel::HEIGHT + GAP);
        let height = top + (body - GAP).max(0.0) + MARGIN;

        let mut out = Svg::new(width, height, &self.title, &self.subtitle);
        out.text("title", MARGIN, MARGIN + 14.0, &self.title);
        for (line, text) in subtitle.iter().enumerate() {
            out.text("muted", MARGIN, MARGIN + 34.0 + 16.0 * line as f64, text);
        }
        let panel_width = (inside + GAP) / columns as f64 - GAP;
        for (index, panel) in self.panels.iter().enumerate() {
            let x = MARGIN + (index % columns) as f64 * (panel_width + GAP);
            let y = top + (index / columns) as f64 * (panel::HEIGHT + GAP);
            panel::draw(&mut out, panel, (x, y), panel_width);
        }
        out.finish()
    }

    /// Writes the SVG file, under a temporary name first.
    ///
    /// # Errors
    /// [`ExportError::Unwritable`].
    pub fn write(&self, path: &Path) -> Result<(), ExportError> {
        export::write(path, self.svg().as_bytes())
    }
}
