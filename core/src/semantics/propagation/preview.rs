//! What one more stroke would change on its frame, before it is made.

use std::sync::Arc;

use super::LabelPropagation;
use crate::labels::{Pixel, Run, Stroke, VOID, pixels_of};
use crate::scene::Scene;
use crate::semantics::strays::strays;
use crate::semantics::{Evidence, FrameMap, Posterior};

/// What a stroke would win on its frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Preview {
    /// The stroke.
    pub stroke: Stroke,
    /// The pixels of the frame that have another class now and would get the stroke's, by row and column; no run touches
    /// another.
    pub won: Vec<Run>,
    /// Those of them that a person takes who takes what is outlined: the part at the stroke's first point, without the
    /// voxels that reach beyond what is won, since the label would spread over what lies there. None where that point
    /// wins nothing.
    pub part: Vec<Run>,
}

impl Preview {
    /// Number of pixels that it would win.
    pub fn pixels(&self) -> u64 {
        self.won.iter().map(Run::pixels).sum()
    }

    /// A stroke of its class that covers just the part at it, if there is any.
    pub fn filled(&self) -> Option<Stroke> {
        (!self.part.is_empty()).then(|| Stroke {
            radius: 0,
            lines: self.part.iter().map(Run::line).collect(),
            ..self.stroke
        })
    }
}

impl LabelPropagation {
    /// What one more stroke of a class would win on its frame, whose present map is `now`, and the map that the frame would
    /// then have. It is what [`set_labels`](Self::set_labels) makes of the labels with the stroke as the newest; nothing is
    /// changed here. A scribble that slips over an edge is the exception: what it covers beyond the edge counts as it did
    /// before. Void spreads nowhere, and wins nothing.
    ///
    /// There is no map where the stroke labels no node, or where imported images count, as they are read across frames. It
    /// has no [surface](FrameMap::surface) before it is [the frame's](Self::set_labels_foreseen).
    pub fn preview(
        &self,
        scene: &Arc<Scene>,
        stroke: &Stroke,
        now: &FrameMap,
    ) -> (Preview, Option<FrameMap>) {
        let (won, map) = self.won_by(scene, stroke, now).unzip();
        let [won, part] = won.unwrap_or_default();
        let preview = Preview {
            stroke: stroke.clone(),
            won,
            part,
        };
        (preview, map.filter(|_| self.import.is_none()))
    }

    /// What it wins, the part at it, and the map; `None` where the stroke labels no node.
    fn won_by(
        &self,
        scene: &Arc<Scene>,
        stroke: &Stroke,
        now: &FrameMap,
    ) -> Option<([Vec<Run>; 2], FrameMap)> {
        let frame = scene.frames.get(stroke.frame)?;
        let mut pixels = pixels_of(stroke, frame.camera.width, frame.camera.height);
        let hidden = frame.hidden_pixels();
        pixels.retain(|&pixel| hidden.binary_search(&(pixel as usize)).is_err());
        let mut nodes = self.surface.nodes_at(stroke.frame, &pixels);
        let strays = strays(&self.surface, &frame.camera, stroke);
        nodes.retain(|node| node.is_some_and(|node| strays.binary_search(&node).is_err()));
        if nodes.is_empty() || stroke.class == VOID {
            return None;
        }

        let mut seeds = self.geodesics.seeds().clone();
        seeds.extend(
            nodes
                .into_iter()
                .flatten()
                .map(|node| (node, stroke.class.into())),
        );
        let (mut likeness, mut geodesics) = (self.likeness.clone(), self.geodesics.clone());
        let nearer = geodesics.update(&self.surface.graph, seeds);
        let classes = (self.classes.as_slice(), &self.kinds);
        let differs = self.looks_count().then(|| likeness.update(classes, &geodesics));
        let evidence = Evidence {
            geodesics: &geodesics,
            likeness: differs.is_some().then_some(&likeness),
            ..self.evidence()
        };
        let is_shown = self.shown_in(stroke.frame);
        let mut changed = self.changed(nearer, differs);
        changed.retain(|&node| is_shown[node as usize]);
        let mut posterior = Posterior::clone(&self.posterior);
        posterior.update(&evidence, &changed);

        let mut shown = self.on_surface(scene, stroke.frame);
        shown.posterior = Arc::new(posterior);
        shown.whole = Some(Arc::default());
        shown
            .painted
            .extend(pixels.into_iter().map(|pixel| (pixel, stroke.class.into())));
        let map = FrameMap::on_surface((stroke.frame, now.generation), shown);
        let map = map.looked_up().into_owned();
        let (before, after) = (now.labels(), map.labels());
        let is_won = |index: usize| after[index] == stroke.class && before.get(index) != Some(&stroke.class);
        let won: Vec<bool> = (0..after.len()).map(is_won).collect();
        let nodes = self.surface.nodes_of(stroke.frame).unpack();
        let nodes = (nodes.as_slice(), self.surface.graph.len());
        let part = part_at(stroke.first_point()?, &won, nodes, map.width);
        Some(([won, part].map(|pixels| runs(map.width, &pixels)), map))
    }
}

/// The part of the pixels that are won at one of them, which is connected along rows and columns, without the nodes that
/// reach beyond them; `nodes`, of `count`, has that of every pixel of the image, which is this wide.
fn part_at(place: Pixel, won: &[bool], (nodes, count): (&[u32], usize), width: u32) -> Vec<bool> {
    let mut part = vec![false; won.len()];
    let index = |[x, y]: Pixel| y as usize * width as usize + x as usize;
    if won.get(index(place)) != Some(&true) {
        return part;
    }
    // Whether a pixel that shows the node is not won; pixels without a node are open to nobody.
    let mut is_beyond = vec![false; count];
    for (_, &node) in won.iter().zip(nodes).filter(|(won, _)| !**won) {
        if let Some(is_beyond) = is_beyond.get_mut(node as usize) {
            *is_beyond = true;
        }
    }
    let is_within = |node: u32| is_beyond.get(node as usize) == Some(&false);
    let mut is_open: Vec<bool> = won
        .iter()
        .zip(nodes)
        .map(|(&won, &node)| won && is_within(node))
        .collect();
    let height = (won.len() / width as usize) as u32;
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| [x, y]));
    let gap = |[x, y]: &Pixel| x.abs_diff(place[0]).pow(2) + y.abs_diff(place[1]).pow(2);
    let nearest = pixels.filter(|&pixel| is_open[index(pixel)]).min_by_key(gap);
    let mut reached: Vec<Pixel> = nearest.into_iter().collect();
    while let Some([x, y]) = reached.pop() {
        let inside = x < width && y < height;
        if inside && std::mem::take(&mut is_open[index([x, y])]) {
            part[index([x, y])] = true;
            let beside = [
                [x + 1, y],
                [x, y + 1],
                [x.wrapping_sub(1), y],
                [x, y.wrapping_sub(1)],
            ];
            reached.extend(beside);
        }
    }
    part
}

/// The pixels of an image of this width that are in it, as runs by row and column.
fn runs(width: u32, is_in: &[bool]) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for index in (0..is_in.len()).filter(|&index| is_in[index]) {
        let (row, column) = (index as u32 / width, index as u32 % width);
        match runs.last_mut() {
            Some(run) if run.row == row && run.last + 1 == column => run.last = column,
            _ => runs.push(Run {
                row,
                first: column,
                last: column,
            }),
        }
    }
    runs
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::ClassId;
    use crate::labels::testing::clicked;
    use crate::scene::testing::{wall, without_depth};
    use crate::semantics::testing::propagated;

    fn disc(frame: usize, class: ClassId, pixel: Pixel, radius: u32) -> Stroke {
        Stroke::drawn(frame, class, radius, vec![vec![pixel]])
    }

    #[test]
    fn a_preview_is_what_the_map_becomes() {
        let measured = Arc::new(wall(2, 80, 60));
        let bare = without_depth(wall(2, 80, 60));
        let clicks = [(0, 1, [10, 30]), (1, 2, [70, 30]), (0, 2, [60, 10])];
        let history = clicked(&["left", "right", "other"], &clicks);
        let mut propagation = propagated(&measured, history.labels());
        let nodes = propagation.surface().graph.len();
        let prior = (0..3 * nodes).map(|index| 0.5 + (index % 7) as f32 / 7.0);
        propagation.set_prior(prior.collect());
        // Borders are looked for where depth was measured, and where not.
        for scene in [measured, Arc::new(bare)] {
            let foresee = |stroke: &Stroke| {
                let now = propagation.map(&scene, stroke.frame, 1);
                propagation.preview(&scene, stroke, &now)
            };
            let mut sizes = Vec::new();
            for stroke in [
                disc(0, 1, [50, 40], 0),
                disc(1, 3, [20, 20], 3),
                // Over a stroke of another class, which then says nothing, and over one of its own.
                disc(0, 2, [10, 30], 4),
                disc(0, 1, [10, 30], 0),
                Stroke::polygon(0, 3, &[[5, 5], [40, 9], [20, 50]]),
            ] {
                let mut history = history.clone();
                history.add_stroke(stroke.clone());
                let (preview, foreseen) = foresee(&stroke);
                let mut told = None;
                let mut then = propagation.clone();
                then.set_labels_foreseen((&scene, history.labels()), 2, foreseen.unwrap(), |map| {
                    assert!(map.surface().is_none());
                    told = Some(map);
                });
                let told = told.unwrap();
                let [now, then] = [&propagation, &then].map(|at| at.map(&scene, stroke.frame, 2));
                assert!(told.is_looked_up() && told == then, "{stroke:?}");
                assert_eq!(told.confidence(), then.confidence());
                assert!(told.surface().unwrap().1 == then.surface().unwrap().1);
                let (now, then) = (now.labels(), then.labels());
                let is_won = |index: usize| then[index] == stroke.class && now[index] != stroke.class;
                let won: Vec<bool> = (0..80 * 60).map(is_won).collect();
                assert_eq!(preview.won, runs(80, &won), "{stroke:?}");
                let part: u64 = preview.part.iter().map(Run::pixels).sum();
                let filled = preview.filled();
                assert_eq!(filled.map_or(0, |filled| filled.pixel_count(80, 60)), part);
                sizes.push(preview.pixels());
            }
            assert!(sizes[..3].iter().all(|&pixels| pixels > 20), "{sizes:?}");
            assert_eq!(sizes[3], 0, "it says nothing new");
            let (preview, foreseen) = foresee(&Stroke::click(0, VOID, [50, 40]));
            assert!(preview.pixels() == 0 && foreseen.is_none());
        }
    }

    #[test]
    fn the_part_at_a_pixel_is_connected_and_without_voxels_that_reach_beyond_what_is_won() {
        let run = |row, first, last| Run { row, first, last };
        // A block, a hook on it, and a part of its own.
        let all = [run(0, 1, 5), run(1, 1, 5), run(2, 5, 5), run(1, 8, 9)];
        let mut won = vec![false; 30];
        for run in &all {
            won[run.indices(10)].fill(true);
        }
        let part = |place, nodes: &[u32]| runs(10, &part_at(place, &won, (nodes, 30), 10));
        let single: Vec<u32> = (0..30).collect();
        assert_eq!(part([4, 1], &single), all[..3]);
        assert_eq!(part([8, 1], &single), all[3..]);
        assert!(part([7, 1], &single).is_empty());
        // Two columns are a voxel in each row: on the left of the block and below it they reach beyond.
        let pairs: Vec<u32> = (0..30).map(|pixel| pixel / 2).collect();
        let whole = [run(0, 2, 5), run(1, 2, 5)];
        assert_eq!(part([5, 1], &pairs), whole);
        assert_eq!(part([1, 0], &pairs), whole);
    }
}
