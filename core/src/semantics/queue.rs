//! The priority queue of shortest paths.

/// Nodes by distance, smallest first: a radix heap (Ahuja et al., "Faster Algorithms for the Shortest Path Problem",
/// 1990). It needs what Dijkstra's algorithm has, that nothing is pushed below what was popped last, and is faster
/// than a binary heap.
///
/// The bits of floating-point numbers from zero on are ordered as the numbers are, so they serve as integer keys.
pub(crate) struct DistanceQueue {
    /// Bucket 0 holds the key popped last; bucket k those that differ from it in bit k - 1 and in none above.
    buckets: [Vec<(u32, u32)>; 33],
    last: u32,
}

impl DistanceQueue {
    pub(crate) fn new() -> Self {
        Self {
            buckets: [const { Vec::new() }; 33],
            last: 0,
        }
    }

    /// Adds a node; its distance is not negative and not below the one popped last.
    pub(crate) fn push(&mut self, distance: f32, node: u32) {
        let key = distance.to_bits();
        debug_assert!(key >= self.last, "{distance} is below what was popped");
        self.buckets[bucket(key, self.last)].push((key, node));
    }

    /// Takes a node of the smallest distance, if any.
    pub(crate) fn pop(&mut self) -> Option<(f32, u32)> {
        if self.buckets[0].is_empty() {
            let first = self.buckets.iter().position(|entries| !entries.is_empty())?;
            let mut entries = std::mem::take(&mut self.buckets[first]);
            self.last = entries.iter().map(|&(key, _)| key).min()?;
            // All of them differ from their smallest in lower bits than before.
            for entry in entries.drain(..) {
                self.buckets[bucket(entry.0, self.last)].push(entry);
            }
            self.buckets[first] = entries;
        }
        let (key, node) = self.buckets[0].pop()?;
        Some((f32::from_bits(key), node))
    }
}

fn bucket(key: u32, last: u32) -> usize {
    (u32::BITS - (key ^ last).leading_zeros()) as usize
}
