//! What a frame's map comes to, in a few numbers.

use super::map::{OnSurface, Pixels};
use super::{ENTROPY_STEPS_PER_NAT, FrameMap, NO_NODE};
use crate::labels::{ClassId, ImportedMap, VOID};

/// Numbers about a frame's map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameSummary {
    /// Mean entropy in nats.
    pub mean_entropy: f32,
    /// Share of the pixels that have a class, 0..=1.
    pub coverage: f32,
    /// Share of the pixels whose entropy is above the threshold asked for, 0..=1.
    pub unclear: f32,
    /// Share of the pixels for which an imported label image says another class than the map, 0..=1.
    pub disagreeing: f32,
}

/// Pixels counted by what holds for them.
#[derive(Default)]
struct Counts {
    pixels: usize,
    entropy: u64,
    labelled: usize,
    unclear: usize,
    disagreeing: usize,
}

impl FrameMap {
    /// What the map comes to; `unclear_above` is in nats. A map that follows from a surface is summed up by the nodes
    /// that its pixels show, before borders are drawn along the colours and what was painted is laid over it: that
    /// moves few pixels, and a thousand frames take a fraction of a second.
    pub fn summary(&self, unclear_above: f32, imported: Option<&ImportedMap>) -> FrameSummary {
        let threshold = (unclear_above * ENTROPY_STEPS_PER_NAT) as u16;
        let pixels = self.width as usize * self.height as usize;
        let said = imported.filter(|image| image.pixels() == pixels);
        let said = said.map(ImportedMap::labels);
        let mut counts = Counts::default();
        match self.pixels() {
            Pixels::Listed { labels, entropy, .. } => {
                let mut start = 0;
                let same = |a: &(&ClassId, &u16), b: &(&ClassId, &u16)| a == b;
                let all: Vec<(&ClassId, &u16)> = labels.iter().zip(entropy).collect();
                for run in all.chunk_by(same) {
                    let (&label, &entropy) = run[0];
                    let range = start..start + run.len();
                    start = range.end;
                    counts.add(range, (label, entropy), threshold, said.as_deref());
                }
            }
            Pixels::OnSurface(shown) => {
                let OnSurface {
                    surface,
                    posterior,
                    unknown,
                    ..
                } = shown;
                for (node, range) in surface.pixels[self.frame].runs() {
                    let value = if node == NO_NODE {
                        (VOID, *unknown)
                    } else {
                        (posterior.labels[node as usize], posterior.entropy[node as usize])
                    };
                    counts.add(range, value, threshold, said.as_deref());
                }
            }
        }
        counts.shares()
    }
}

impl Counts {
    /// Adds a run of pixels with the same class and entropy.
    fn add(
        &mut self,
        range: std::ops::Range<usize>,
        (label, entropy): (ClassId, u16),
        threshold: u16,
        said: Option<&[ClassId]>,
    ) {
        let length = range.len();
        self.pixels += length;
        self.entropy += length as u64 * u64::from(entropy);
        self.labelled += if label == VOID { 0 } else { length };
        self.unclear += if entropy > threshold { length } else { 0 };
        let other = |&&said: &&ClassId| said != VOID && said != label;
        let others = said.map_or(0, |said| said[range].iter().filter(other).count());
        self.disagreeing += if label == VOID { 0 } else { others };
    }

    fn shares(&self) -> FrameSummary {
        let all = self.pixels.max(1) as f32;
        FrameSummary {
            mean_entropy: self.entropy as f32 / all / ENTROPY_STEPS_PER_NAT,
            coverage: self.labelled as f32 / all,
            unclear: self.unclear as f32 / all,
            disagreeing: self.disagreeing as f32 / all,
        }
    }
}
