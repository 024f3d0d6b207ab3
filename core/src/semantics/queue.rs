//! The priority queue of shortest paths.

use super::SurfaceGraph;

/// The lowest bits of a distance, which do not count for the order.
const FREE_BITS: u32 = 11;

/// Nodes by distance, smallest first: a radix heap (Ahuja et al., "Faster Algorithms for the Shortest Path Problem",
/// 1990). It needs what Dijkstra's algorithm has, that nothing is pushed below what was popped last, and is faster
/// than a binary heap.
///
/// The bits of floating-point numbers from zero on are ordered as the numbers are, so the upper ones serve as integer
/// keys. Distances that differ by less than one part in 4096 come in any order: a node may come again with a smaller
/// distance, which happens to one or two in a hundred, while the order of all bits takes half as long again.
pub(crate) struct DistanceQueue {
    /// Bucket 0 holds the key popped last; bucket k those that differ from it in bit k - 1 and in none above.
    buckets: [Vec<(f32, u32)>; (u32::BITS - FREE_BITS) as usize + 1],
    last: u32,
}

impl DistanceQueue {
    pub(crate) fn new() -> Self {
        Self {
            buckets: Default::default(),
            last: 0,
        }
    }

    /// Adds a node; its distance is not negative and does not come before the one popped last.
    pub(crate) fn push(&mut self, distance: f32, node: u32) {
        debug_assert!(key(distance) >= self.last, "{distance} is below what was popped");
        self.buckets[bucket(key(distance), self.last)].push((distance, node));
    }

    /// Takes a node of the smallest distance, if any. The edges of all that come next are fetched together.
    pub(crate) fn pop(&mut self, graph: &SurfaceGraph) -> Option<(f32, u32)> {
        if self.buckets[0].is_empty() {
            let first = self.buckets.iter().position(|entries| !entries.is_empty())?;
            let mut entries = std::mem::take(&mut self.buckets[first]);
            self.last = entries.iter().map(|&(distance, _)| key(distance)).min()?;
            // All of them differ from their smallest in lower bits than before.
            for entry in entries.drain(..) {
                self.buckets[bucket(key(entry.0), self.last)].push(entry);
            }
            self.buckets[first] = entries;
            graph.fetch(self.buckets[0].iter().map(|&(_, node)| node));
        }
        self.buckets[0].pop()
    }
}

fn key(distance: f32) -> u32 {
    distance.to_bits() >> FREE_BITS
}

fn bucket(key: u32, last: u32) -> usize {
    (u32::BITS - (key ^ last).leading_zeros()) as usize
}
