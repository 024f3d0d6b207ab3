//! Connected regions of label maps.

use crate::labels::{Run, runs_of_equal};
use crate::semantics::DisjointSets;

/// Which pixels touch each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Neighbours {
    /// Those that share a side: four of each pixel.
    Sides,
    /// Those that share a side or a corner: eight of each pixel.
    SidesAndCorners,
}

/// Pixels of one label, each of which can be reached from every other through them.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Component {
    /// Their label.
    pub(super) label: u16,
    /// The pixels, from the top and in each row from the left; no run touches another in its row.
    pub(super) runs: Vec<Run>,
}

impl Component {
    /// Number of pixels.
    pub(super) fn area(&self) -> u64 {
        self.runs.iter().map(Run::pixels).sum()
    }
}

/// The smallest box around some runs that are ordered by row, as COCO has it: x, y, width, height; empty around none.
pub(super) fn box_around(runs: &[Run]) -> [u32; 4] {
    let rows = runs.first().zip(runs.last());
    let first = runs.iter().map(|run| run.first).min();
    let last = runs.iter().map(|run| run.last).max();
    let (Some((top, bottom)), Some(x), Some(last)) = (rows, first, last) else {
        return [0; 4];
    };
    [x, top.row, last - x + 1, bottom.row - top.row + 1]
}

/// The connected components of all labels of a map, row-major `[height, width]`, void included, in the order in
/// which their first pixels come, row by row.
pub(super) fn components(labels: &[u16], width: u32, neighbours: Neighbours) -> Vec<Component> {
    let runs = runs_of_equal(labels, width);
    let reach = match neighbours {
        Neighbours::Sides => 0,
        Neighbours::SidesAndCorners => 1,
    };
    let mut sets = DisjointSets::new(runs.len());
    // The first run of the row above that may still touch one of this row.
    let mut above = 0;
    for (index, (label, run)) in runs.iter().enumerate() {
        while runs[above].1.row + 1 < run.row
            || (runs[above].1.row < run.row && runs[above].1.last + reach < run.first)
        {
            above += 1;
        }
        let touching = runs[above..index]
            .iter()
            .zip(above..)
            .take_while(|((_, other), _)| other.row < run.row && other.first <= run.last + reach);
        for ((other_label, _), other) in touching {
            if other_label == label {
                sets.join(index as u32, other as u32);
            }
        }
    }
    let mut number_of_root = vec![usize::MAX; runs.len()];
    let mut found: Vec<Component> = Vec::new();
    for (index, &(label, run)) in runs.iter().enumerate() {
        // The earliest run is the root: it has the component's first pixel.
        let root = sets.root(index as u32) as usize;
        if root == index {
            number_of_root[root] = found.len();
            found.push(Component {
                label,
                runs: Vec::new(),
            });
        }
        found[number_of_root[root]].runs.push(run);
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::testing::{WIDTH, labels};

    /// Components by flooding pixel after pixel.
    fn flooded(labels: &[u16], neighbours: Neighbours) -> Vec<Vec<usize>> {
        let width = WIDTH as usize;
        let touch = |a: usize, b: usize| {
            let (across, down) = ((a % width).abs_diff(b % width), (a / width).abs_diff(b / width));
            match neighbours {
                Neighbours::Sides => across + down == 1,
                Neighbours::SidesAndCorners => across.max(down) == 1,
            }
        };
        let mut left: Vec<usize> = (0..labels.len()).collect();
        let mut found = Vec::new();
        while !left.is_empty() {
            let mut pixels = vec![left.remove(0)];
            let mut next = 0;
            while let Some(&pixel) = pixels.get(next) {
                next += 1;
                let joins = |&other: &usize| labels[other] == labels[pixel] && touch(pixel, other);
                pixels.extend(left.extract_if(.., |other| joins(other)));
            }
            pixels.sort_unstable();
            found.push(pixels);
        }
        found
    }

    #[test]
    fn components_are_those_that_a_flood_finds() {
        for frame in 0..8 {
            let labels = labels(frame);
            for neighbours in [Neighbours::Sides, Neighbours::SidesAndCorners] {
                let found = components(&labels, WIDTH, neighbours);
                let pixels = |component: &Component| -> Vec<usize> {
                    component.runs.iter().flat_map(|run| run.indices(WIDTH)).collect()
                };
                let as_pixels: Vec<Vec<usize>> = found.iter().map(pixels).collect();
                let expected = flooded(&labels, neighbours);
                assert_eq!(as_pixels, expected, "{neighbours:?} of {frame}");
                for (component, pixels) in found.iter().zip(as_pixels) {
                    assert!(pixels.iter().all(|&pixel| labels[pixel] == component.label));
                    assert_eq!(component.area(), pixels.len() as u64);
                }
            }
        }
    }
}
