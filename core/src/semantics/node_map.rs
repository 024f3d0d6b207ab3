//! Which node every pixel of a frame shows, in runs: a voxel is some pixels wide, and a thousand frames
//! have to fit in memory.

use std::ops::Range;

/// A pixel that shows no node: the image on disk does not reach it, or the whole frame has no depth.
pub const NO_NODE: u32 = u32::MAX;
/// Bits of a run's length; the others are its node.
const LENGTH_BITS: u32 = 8;
const LONGEST: usize = 1 << LENGTH_BITS;
/// A run of pixels without a node. Nodes have to be below this.
const NONE: u32 = u32::MAX >> LENGTH_BITS;

/// The node of every pixel of a frame, row-major `[height, width]`, as runs along the rows.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct NodeMap {
    width: usize,
    /// First run of each row, and the number of all runs.
    rows: Vec<u32>,
    /// Node, and length less one, of each run.
    runs: Vec<u32>,
}

impl NodeMap {
    /// Packs the nodes of pixels, row-major, [`NO_NODE`] where there is none; nodes are below 16,777,215.
    pub fn pack(width: usize, nodes: &[u32]) -> Self {
        let mut rows = Vec::with_capacity(nodes.len() / width.max(1) + 1);
        let mut runs = Vec::new();
        for row in nodes.chunks(width.max(1)) {
            rows.push(runs.len() as u32);
            let same = row.chunk_by(|a, b| a == b);
            for run in same.flat_map(|run| run.chunks(LONGEST)) {
                debug_assert!(run[0] < NONE || run[0] == NO_NODE);
                runs.push((run[0].min(NONE) << LENGTH_BITS) | (run.len() - 1) as u32);
            }
        }
        rows.push(runs.len() as u32);
        runs.shrink_to_fit();
        Self { width, rows, runs }
    }

    /// Pixels of a row.
    pub fn width(&self) -> usize {
        self.width
    }

    /// Number of pixels.
    pub fn len(&self) -> usize {
        self.width * (self.rows.len().max(1) - 1)
    }

    /// Whether there are no pixels.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Bytes that it takes in memory.
    pub(super) fn size(&self) -> usize {
        size_of::<u32>() * (self.rows.len() + self.runs.len())
    }

    /// Nodes with the pixels that show them, in the order of the pixels.
    pub fn runs(&self) -> impl Iterator<Item = (u32, Range<usize>)> + '_ {
        let mut end = 0;
        self.runs.iter().map(move |&run| {
            let (node, length) = unpacked(run);
            end += length;
            (node, end - length..end)
        })
    }

    /// The node of a pixel; `None` where it shows none.
    pub fn node(&self, pixel: usize) -> Option<u32> {
        let row = pixel / self.width.max(1);
        let first = *self.rows.get(row)? as usize;
        let mut end = row * self.width;
        let run = self.runs[first..].iter().find(|&&run| {
            end += unpacked(run).1;
            pixel < end
        });
        run.map(|&run| unpacked(run).0).filter(|&node| node != NO_NODE)
    }

    /// The node of every pixel, [`NO_NODE`] where there is none.
    pub fn unpack(&self) -> Vec<u32> {
        let mut nodes = Vec::with_capacity(self.len());
        for (node, pixels) in self.runs() {
            nodes.resize(pixels.end, node);
        }
        nodes
    }
}

fn unpacked(run: u32) -> (u32, usize) {
    let node = run >> LENGTH_BITS;
    let length = (run as usize & (LONGEST - 1)) + 1;
    (if node == NONE { NO_NODE } else { node }, length)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_comes_back_and_there_is_none_outside() {
        let width = 700;
        // Runs of all lengths, some across the ends of rows, some without a node.
        let mut nodes = Vec::new();
        for length in 0..200_usize {
            let node = [length as u32 * 80_000, NO_NODE][usize::from(length % 7 == 3)];
            nodes.resize(nodes.len() + 3 * length + 1, node);
        }
        nodes.truncate(nodes.len() / width * width);
        let map = NodeMap::pack(width, &nodes);
        assert_eq!(map.len(), nodes.len());
        assert_eq!(map.unpack(), nodes);
        for (pixel, &node) in nodes.iter().enumerate().step_by(13) {
            assert_eq!(map.node(pixel), (node != NO_NODE).then_some(node));
        }
        for (_, pixels) in map.runs() {
            assert_eq!(pixels.start / width, (pixels.end - 1) / width);
        }
        assert_eq!(map.node(nodes.len()), None);
        for empty in [NodeMap::pack(0, &[]), NodeMap::default()] {
            assert!(empty.is_empty() && empty.unpack().is_empty() && empty.node(0).is_none());
        }
    }
}
