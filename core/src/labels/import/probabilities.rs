//! Arrays of class probabilities: which axis is which, and what is kept of them.

use std::path::Path;

use rayon::prelude::*;

use super::ClassList;
use super::numpy::{self, Header, Values};
use crate::labels::{ClassId, Likeliest, Probabilities};
use crate::scene::{Frame, has_proportions, sampled};

/// Half floats are off by a thousandth, and sums of hundreds of them by more.
const ROUNDING: f32 = 0.05;

/// Class probabilities `[height, width, classes]` as a file has them.
pub(super) struct Array {
    layout: Layout,
    classes: Vec<ClassId>,
    values: Values,
}

/// Which axis is which.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Layout {
    /// Width and height.
    size: [u32; 2],
    channels: usize,
    /// From one value to the next along columns, rows and channels.
    strides: [usize; 3],
}

impl Array {
    /// Reads the probabilities of a frame: of the listed classes, void among them or not, or of the ids from 1 on.
    ///
    /// # Errors
    /// Why the file has no such probabilities: part of a sentence, as of the others.
    pub fn read(path: &Path, frame: &Frame, list: Option<&ClassList>) -> Result<Self, String> {
        let size = [frame.image().width, frame.image().height];
        let ((layout, classes), values) = numpy::read(path, |header| {
            let layout = Layout::of(header, size, list)?;
            Ok((layout, classes_of(layout.channels, list)))
        })?;
        Ok(Self {
            layout,
            classes,
            values,
        })
    }

    /// Width and height.
    pub fn size(&self) -> [u32; 2] {
        self.layout.size
    }

    /// What is kept of the probabilities at a place.
    fn likeliest(&self, [column, row]: [u32; 2]) -> Result<Likeliest, String> {
        let [across, down, deep] = self.layout.strides;
        let start = column as usize * across + row as usize * down;
        let value = |channel: usize| self.values.at(start + channel * deep);
        let mut sum = 0.0;
        for channel in 0..self.classes.len() {
            let value = value(channel);
            if !(-1e-6..=1.0 + ROUNDING).contains(&value) {
                return Err(format!(
                    "has the value {value} at column {column}, row {row}, which is no probability; save what softmax \
                     makes of the network's scores"
                ));
            }
            sum += value;
        }
        if sum > 1.0 + ROUNDING {
            return Err(format!(
                "has values at column {column}, row {row} that add up to {sum:.2}; probabilities of one pixel add up to 1"
            ));
        }
        Ok(Likeliest::of(
            self.classes
                .iter()
                .enumerate()
                .map(|(channel, &class)| (class, value(channel))),
        ))
    }

    /// The likeliest class of every place, row-major.
    ///
    /// # Errors
    /// Values that are no probabilities.
    pub fn labels(&self) -> Result<Vec<ClassId>, String> {
        row_major(self.layout.size, |place| Ok(self.likeliest(place)?.class()))
    }

    /// The probabilities on a grid over the frame's own pixels, as fine as they are, but no finer than the frame and of
    /// at most so many cells.
    ///
    /// # Errors
    /// Values that are no probabilities.
    pub fn on_grid(&self, frame: &Frame, most_cells: usize) -> Result<Probabilities, String> {
        let (own, image) = (&frame.camera, frame.image());
        let (own, on_disk) = ([own.width, own.height], [image.width, image.height]);
        let size = grid(
            [0, 1].map(|axis| {
                let scaled =
                    f64::from(own[axis]) * f64::from(self.layout.size[axis]) / f64::from(on_disk[axis]);
                (scaled.round() as u32).clamp(1, own[axis])
            }),
            most_cells,
        );
        let cell = |[column, row]: [u32; 2]| {
            let pixel = [sampled(column, size[0], own[0]), sampled(row, size[1], own[1])];
            let Some(place) = frame.to_image(pixel) else {
                return Ok(Likeliest::default());
            };
            self.likeliest([0, 1].map(|axis| sampled(place[axis], on_disk[axis], self.layout.size[axis])))
        };
        let grid = Probabilities::new(size, own, row_major(size, cell)?);
        grid.ok_or_else(|| "has no values".to_owned())
    }
}

/// What is found at every column and row of a grid of this size, row-major; the rows in parallel.
fn row_major<T: Clone + Send>(
    [width, height]: [u32; 2],
    find: impl Fn([u32; 2]) -> Result<T, String> + Sync,
) -> Result<Vec<T>, String> {
    let row = |row| (0..width).map(|column| find([column, row])).collect();
    let rows: Result<Vec<Vec<T>>, String> = (0..height).into_par_iter().map(row).collect();
    Ok(rows?.concat())
}

/// A grid with fewer columns and rows where it has more than so many cells.
fn grid(size: [u32; 2], most_cells: usize) -> [u32; 2] {
    let cells = f64::from(size[0]) * f64::from(size[1]);
    let scale = (most_cells as f64 / cells).sqrt().min(1.0);
    size.map(|count| ((f64::from(count) * scale) as u32).max(1))
}

/// The classes of an array's channels.
fn classes_of(channels: usize, list: Option<&ClassList>) -> Vec<ClassId> {
    match list {
        Some(list) if list.order.len() == channels => list.order.clone(),
        Some(list) => list.classes.iter().map(|class| class.id).collect(),
        None => (1..=channels as ClassId).collect(),
    }
}

impl Layout {
    /// Finds out which axis has the classes: the others have the frame's aspect.
    fn of(header: &Header, frame: [u32; 2], list: Option<&ClassList>) -> Result<Self, String> {
        const AXES: &str = "save (classes, height, width) or (height, width, classes)";
        let array = format!("has an array of the shape {}", header.shape);
        let (mut shape, mut strides) = (header.shape.0.as_slice(), header.strides());
        // A batch of one.
        while shape.len() > 3 && shape[0] == 1 {
            shape = &shape[1..];
            strides.remove(0);
        }
        let (&[a, b, c], &[first, second, third]) = (shape, strides.as_slice()) else {
            return Err(format!("{array}; {AXES}"));
        };
        let fits = |channels: usize, height: usize, width: usize, strides: [usize; 3]| {
            let size = [u32::try_from(width).ok()?, u32::try_from(height).ok()?];
            let counts = match list {
                Some(list) => channels == list.order.len() || channels == list.classes.len(),
                None => (1..=usize::from(ClassId::MAX)).contains(&channels),
            };
            (counts && has_proportions(size, frame)).then_some(Self {
                size,
                channels,
                strides,
            })
        };
        let classes_first = fits(a, b, c, [third, second, first]);
        let classes_last = fits(c, a, b, [second, first, third]);
        match (classes_first, classes_last) {
            (Some(layout), None) | (None, Some(layout)) => Ok(layout),
            (Some(_), Some(_)) => Err(format!(
                "{array}, in which both the first and the last axis could be the classes; save it at another size"
            )),
            (None, None) => {
                let classes = list.map_or_else(String::new, |list| format!(" {}", list.classes.len()));
                let [width, height] = frame;
                Err(format!(
                    "{array}, which is not that of{classes} classes and a frame of {width}x{height} pixels; {AXES} of the \
                     frame's aspect"
                ))
            }
        }
    }
}
