//! What one more stroke would change on its frame, before it is made.

use std::ops::Range;
use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::FxHashSet;

use super::LabelPropagation;
use crate::labels::{ClassId, Pixel, Run, Stroke, VOID, contains, pixels_of, runs_of_equal};
use crate::scene::Scene;
use crate::semantics::on_surface::OnSurface;
use crate::semantics::strays::strays;
use crate::semantics::{Evidence, FrameMap, NO_NODE, NodeMap, Posterior};

/// What a stroke would win on its frame.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Preview {
    /// The stroke.
    pub stroke: Stroke,
    /// The pixels of the frame that have another class now and would get the stroke's, by row and column; no run touches
    /// another.
    pub won: Vec<Run>,
    /// The node of every pixel of the frame.
    pub nodes: Arc<NodeMap>,
}

impl Preview {
    /// Number of pixels that it would win.
    pub fn pixels(&self) -> u64 {
        self.won.iter().map(Run::pixels).sum()
    }

    /// A stroke of its class that covers what a person takes who takes what is outlined: the part at the stroke's first
    /// point, without the voxels that reach beyond what is won, since the label would spread over what lies there. `None`
    /// where that point wins nothing.
    pub fn filled(&self) -> Option<Stroke> {
        let part = part_at(self.stroke.first_point()?, &self.won, &self.nodes);
        (!part.is_empty()).then(|| Stroke {
            radius: 0,
            lines: part.iter().map(Run::line).collect(),
            ..self.stroke
        })
    }
}

impl LabelPropagation {
    /// Tells what one more stroke of a class would win on its frame, whose present map is `now`; then returns the map that
    /// the frame would have. It is what [`set_labels`](Self::set_labels) makes of the labels with the stroke as the newest;
    /// nothing is changed here. A scribble that slips over an edge is the exception: what it covers beyond the edge counts
    /// as it did before. Void spreads nowhere, and wins nothing.
    ///
    /// There is no map where the stroke labels no node, or where imported images count, as they are read across frames. It
    /// has no [surface](FrameMap::surface) before it is [the frame's](Self::set_labels_foreseen).
    pub fn preview(
        &self,
        scene: &Arc<Scene>,
        stroke: &Stroke,
        now: &FrameMap,
        tell: impl FnOnce(Preview),
    ) -> Option<FrameMap> {
        let mut preview = Preview {
            stroke: stroke.clone(),
            won: Vec::new(),
            nodes: self.surface.nodes_of(stroke.frame),
        };
        let Some(shown) = self.with(scene, stroke) else {
            tell(preview);
            return None;
        };
        let nodes = shown.nodes(stroke.frame);
        let labels = shown.labels(stroke.frame, &nodes);
        let before = now.labels();
        let is_won =
            |(index, &after): (usize, &ClassId)| after == stroke.class && before.get(index) != Some(&after);
        let won: Vec<bool> = labels.par_iter().enumerate().map(is_won).collect();
        let runs = runs_of_equal(&won, now.width).into_iter();
        preview.won = runs.filter(|(won, _)| *won).map(|(_, run)| run).collect();
        tell(preview);
        let no_import = self.import.is_none();
        no_import.then(|| FrameMap::listed((stroke.frame, now.generation), shown, (&nodes, labels), None))
    }

    /// What the frame of a stroke would show with it; `None` where the stroke labels no node.
    fn with(&self, scene: &Arc<Scene>, stroke: &Stroke) -> Option<OnSurface> {
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
        let label = self.label(stroke);
        seeds.extend(nodes.into_iter().flatten().map(|node| (node, label)));
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
        let mut painted = shown.painted.to_vec();
        painted.retain(|(pixel, _)| pixels.binary_search(pixel).is_err());
        painted.extend(pixels.into_iter().map(|pixel| (pixel, label)));
        shown.painted = painted.into();
        Some(shown)
    }
}

/// The part of what is won at one of its pixels, which is connected along rows and columns, without the nodes that reach
/// beyond what is won: where these divide it, the piece nearest to the pixel.
fn part_at([x, y]: Pixel, won: &[Run], nodes: &NodeMap) -> Vec<Run> {
    let gap = |run: &Run| x.clamp(run.first, run.last).abs_diff(x).pow(2) + run.row.abs_diff(y).pow(2);
    let own = won.iter().position(|run| gap(run) == 0);
    let own = own.map_or_else(Vec::new, |own| connected(won, own));
    let mut open = within(won, nodes);
    open.retain(|run| contains(&own, [run.first, run.row]));
    let nearest = (0..open.len()).min_by_key(|&index| gap(&open[index]));
    nearest.map_or_else(Vec::new, |nearest| connected(&open, nearest))
}

/// Of these runs, by row and column, those that are connected with one of them along rows and columns.
fn connected(runs: &[Run], with: usize) -> Vec<Run> {
    let mut reached = vec![with];
    let mut is_part = vec![false; runs.len()];
    while let Some(index) = reached.pop() {
        if std::mem::replace(&mut is_part[index], true) {
            continue;
        }
        let Run { row, first, last } = runs[index];
        for row in [row.wrapping_sub(1), row + 1] {
            let beside = runs.partition_point(|run| (run.row, run.last) < (row, first));
            let touching = runs[beside..]
                .iter()
                .take_while(|run| run.row == row && run.first <= last);
            reached.extend(beside..beside + touching.count());
        }
    }
    let part = runs.iter().zip(is_part).filter(|(_, is_part)| *is_part);
    part.map(|(run, _)| *run).collect()
}

/// The pixels of these runs whose nodes no other pixel shows, as runs by row and column.
fn within(won: &[Run], nodes: &NodeMap) -> Vec<Run> {
    let width = nodes.width();
    let mut parts: Vec<(u32, Range<usize>)> = Vec::new();
    let mut reach_beyond = FxHashSet::from_iter([NO_NODE]);
    let mut ranges = won.iter().map(|run| run.indices(width as u32)).peekable();
    for (node, pixels) in nodes.runs() {
        let mut outside = pixels.len();
        while let Some(range) = ranges.peek() {
            let part = pixels.start.max(*range.start())..pixels.end.min(range.end() + 1);
            let ends_later = *range.end() >= pixels.end;
            if !part.is_empty() {
                outside -= part.len();
                parts.push((node, part));
            }
            if ends_later {
                break;
            }
            ranges.next();
        }
        if outside > 0 {
            reach_beyond.insert(node);
        }
    }
    parts.retain(|(node, _)| !reach_beyond.contains(node));
    let touches = |a: &Range<usize>, b: &Range<usize>| a.end == b.start && !b.start.is_multiple_of(width);
    let rows = parts.chunk_by(|(_, a), (_, b)| touches(a, b));
    let run = |parts: &[(u32, Range<usize>)]| {
        let (first, end) = (parts[0].1.start, parts[parts.len() - 1].1.end);
        Run {
            row: (first / width) as u32,
            first: (first % width) as u32,
            last: ((end - 1) % width) as u32,
        }
    };
    rows.map(run).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
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
                let (now, mut told) = (propagation.map(&scene, stroke.frame, 1), None);
                let map = propagation.preview(&scene, stroke, &now, |preview| told = Some(preview));
                (told.unwrap(), map)
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
                let runs = runs_of_equal(&won, 80).into_iter();
                let won: Vec<Run> = runs.filter(|(won, _)| *won).map(|(_, run)| run).collect();
                assert_eq!(preview.won, won, "{stroke:?}");
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
        let all = [run(0, 1, 5), run(1, 1, 5), run(1, 8, 9), run(2, 5, 5)];
        let part = |place, nodes: &[u32]| part_at(place, &all, &NodeMap::pack(10, nodes));
        let single: Vec<u32> = (0..30).collect();
        assert_eq!(part([4, 1], &single), [all[0], all[1], all[3]]);
        assert_eq!(part([8, 1], &single), all[2..3]);
        assert!(part([7, 1], &single).is_empty());
        // All of the part at the pixel is one voxel with what is beside it: nothing, and not the other part.
        let one: Vec<u32> = (0..30)
            .map(|pixel| if pixel % 10 > 6 { 0 } else { pixel })
            .collect();
        assert!(part([8, 1], &one).is_empty());
        // Two columns are a voxel in each row: on the left of the block and below it they reach beyond.
        let pairs: Vec<u32> = (0..30).map(|pixel| pixel / 2).collect();
        let whole = [run(0, 2, 5), run(1, 2, 5)];
        assert_eq!(part([5, 1], &pairs), whole);
        assert_eq!(part([1, 0], &pairs), whole);
    }
}
