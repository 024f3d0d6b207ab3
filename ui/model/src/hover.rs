//! What a click at the pointer would win.

use std::collections::BTreeSet;
use std::sync::Arc;

use inplace_core::labels::{Pixel, Run, Stroke};
use inplace_core::semantics::NO_NODE;
use inplace_core::session::Preview;

/// The place under the pointer, and what is known of a click there.
#[derive(Debug, Default)]
pub struct Hover {
    /// The pixel of the frame in view where a press would begin to label, if the pointer is on one.
    pub pixel: Option<Pixel>,
    /// What the worker was asked last; `None` where there is nothing to ask.
    asked: Option<Question>,
    /// What a click would win, if anything. While the pointer moves or the maps get better it is the newest that is known,
    /// of a place that the pointer has just left, so that the outline moves along and does not flicker.
    pub shown: Option<Arc<Preview>>,
}

/// A click, and the version of its frame's map that it would change.
#[derive(Clone, Debug, PartialEq)]
pub struct Question {
    /// The click.
    pub stroke: Stroke,
    /// The map.
    pub map: u64,
}

impl Hover {
    /// Takes over what there is to ask now; returns what the worker is to be asked, if it is something new.
    pub(crate) fn ask(&mut self, question: Option<Question>) -> Option<Stroke> {
        if question == self.asked {
            return None;
        }
        self.asked = question;
        let asked = self.asked.as_ref().map(|question| &question.stroke);
        let is_like = |shown: &Arc<Preview>| asked.is_some_and(|asked| same_but_place(asked, &shown.stroke));
        if !self.shown.as_ref().is_some_and(is_like) {
            self.shown = None;
        }
        asked.cloned()
    }

    /// Takes over an answer that is about the present labels; one to another kind of question came too late.
    pub(crate) fn take(&mut self, preview: Arc<Preview>) {
        let asked = self.asked.as_ref();
        if asked.is_some_and(|asked| same_but_place(&asked.stroke, &preview.stroke)) {
            self.shown = Some(preview).filter(|preview| !preview.won.is_empty());
        }
    }
}

/// Whether two clicks are the same but for their places on a frame.
fn same_but_place(a: &Stroke, b: &Stroke) -> bool {
    (a.frame, a.class, a.radius) == (b.frame, b.class, b.radius)
}

/// The pixels that a person takes who takes what is outlined, as runs by row and column: the part at the pointer, without
/// the voxels that reach beyond it, since the label would spread over what lies there. None where the pointer is on no
/// such part. `nodes` has the voxel of every pixel of the frame, row-major, where the surface is known.
pub(crate) fn taken(preview: &Preview, [width, height]: [u32; 2], nodes: Option<&[u32]>) -> Vec<Run> {
    let mut is_open = vec![false; width as usize * height as usize];
    for run in &preview.won {
        is_open[run.indices(width)].fill(true);
    }
    let index = |[x, y]: Pixel| y as usize * width as usize + x as usize;
    let place = preview.stroke.first_point();
    let Some(place) = place.filter(|&place| is_open.get(index(place)) == Some(&true)) else {
        return Vec::new();
    };
    if let Some(nodes) = nodes {
        let outside = is_open.iter().zip(nodes).filter(|(open, _)| !**open);
        let beyond: BTreeSet<u32> = outside.map(|(_, &node)| node).collect();
        let stays = |node: &u32| *node != NO_NODE && !beyond.contains(node);
        is_open
            .iter_mut()
            .zip(nodes)
            .for_each(|(open, node)| *open &= stays(node));
    }
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    let gap = |[x, y]: &Pixel| x.abs_diff(place[0]).pow(2) + y.abs_diff(place[1]).pow(2);
    let nearest = pixels.filter(|&pixel| is_open[index(pixel)]).min_by_key(gap);
    let mut reached: Vec<Pixel> = nearest.into_iter().collect();
    let mut part: BTreeSet<(u32, u32)> = BTreeSet::new();
    while let Some([x, y]) = reached.pop() {
        let inside = x < width && y < height;
        if inside && std::mem::take(&mut is_open[index([x, y])]) {
            part.insert((y, x));
            let beside = [
                [x + 1, y],
                [x, y + 1],
                [x.wrapping_sub(1), y],
                [x, y.wrapping_sub(1)],
            ];
            reached.extend(beside);
        }
    }
    let part: Vec<(u32, u32)> = part.into_iter().collect();
    let runs = part.chunk_by(|a, b| (a.0, a.1 + 1) == *b);
    runs.map(|run| Run {
        row: run[0].0,
        first: run[0].1,
        last: run[run.len() - 1].1,
    })
    .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_taken_is_the_part_at_the_pointer_without_voxels_that_reach_beyond_it() {
        let run = |row, first, last| Run { row, first, last };
        let preview = |place| Preview {
            stroke: Stroke::click(0, 1, place),
            // A block, a hook on it, and a part of its own.
            won: vec![run(0, 1, 5), run(1, 1, 5), run(1, 8, 9), run(2, 5, 5)],
        };
        let all = taken(&preview([4, 1]), [10, 3], None);
        assert_eq!(all, [run(0, 1, 5), run(1, 1, 5), run(2, 5, 5)]);
        assert_eq!(taken(&preview([8, 1]), [10, 3], None), [run(1, 8, 9)]);
        assert!(taken(&preview([7, 1]), [10, 3], None).is_empty());
        // Two columns are a voxel in each row: on the left of the block and below it they reach beyond.
        let nodes: Vec<u32> = (0..30).map(|pixel| pixel / 2).collect();
        let whole = taken(&preview([5, 1]), [10, 3], Some(&nodes));
        assert_eq!(whole, [run(0, 2, 5), run(1, 2, 5)]);
        assert_eq!(taken(&preview([1, 0]), [10, 3], Some(&nodes)), whole);
    }
}
