//! What one more stroke would change on its frame, before it is made.

use std::sync::Arc;

use super::LabelPropagation;
use crate::labels::{Run, Stroke, VOID, pixels_of};
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
}

impl Preview {
    /// Number of pixels that it would win.
    pub fn pixels(&self) -> u64 {
        self.won.iter().map(Run::pixels).sum()
    }

    /// A stroke of its class that covers just these pixels.
    pub fn filled(&self) -> Stroke {
        Stroke {
            radius: 0,
            lines: self.won.iter().map(Run::line).collect(),
            ..self.stroke
        }
    }
}

impl LabelPropagation {
    /// What one more stroke of a class would win on its frame, whose present map is `now`. It is what
    /// [`set_labels`](Self::set_labels) makes of the labels with the stroke as the newest, for the nodes that the frame
    /// shows; nothing is changed here. A scribble that slips over an edge is the exception: what it covers beyond the
    /// edge counts as it did before. Void spreads nowhere, and wins nothing.
    pub fn preview(&self, scene: &Arc<Scene>, stroke: &Stroke, now: &FrameMap) -> Preview {
        Preview {
            stroke: stroke.clone(),
            won: self.won_by(scene, stroke, now).unwrap_or_default(),
        }
    }

    /// `None` where the stroke labels no node.
    fn won_by(&self, scene: &Arc<Scene>, stroke: &Stroke, now: &FrameMap) -> Option<Vec<Run>> {
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
        let classes = (self.classes.as_slice(), &self.things);
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

        let mut map = self.on_surface(scene, stroke.frame);
        map.posterior = Arc::new(posterior);
        map.painted
            .extend(pixels.into_iter().map(|pixel| (pixel, stroke.class.into())));
        let map = FrameMap::on_surface((stroke.frame, now.generation), map);
        let (before, after) = (now.labels(), map.labels());
        let is_won = |index: usize| after[index] == stroke.class && before.get(index) != Some(&stroke.class);
        Some(runs(map.width, after.len(), is_won))
    }
}

/// The pixels of an image of this width and number of pixels that are in it, as runs by row and column.
fn runs(width: u32, pixels: usize, is_in: impl Fn(usize) -> bool) -> Vec<Run> {
    let mut runs: Vec<Run> = Vec::new();
    for index in (0..pixels).filter(|&index| is_in(index)) {
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
    use crate::labels::testing::clicked;
    use crate::labels::{ClassId, Pixel};
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
            let preview = |stroke: &Stroke| {
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
                let mut then = propagation.clone();
                then.set_labels(&scene, history.labels());
                let [now, then] = [&propagation, &then].map(|at| at.map(&scene, stroke.frame, 1));
                let (now, then) = (now.labels(), then.labels());
                let is_won = |index: usize| then[index] == stroke.class && now[index] != stroke.class;
                let preview = preview(&stroke);
                assert_eq!(preview.won, runs(80, 80 * 60, is_won), "{stroke:?}");
                assert_eq!(preview.filled().pixel_count(80, 60), preview.pixels());
                sizes.push(preview.pixels());
            }
            assert!(sizes[..3].iter().all(|&pixels| pixels > 20), "{sizes:?}");
            assert_eq!(sizes[3], 0, "it says nothing new");
            assert_eq!(preview(&Stroke::click(0, VOID, [50, 40])).pixels(), 0);
        }
    }
}
