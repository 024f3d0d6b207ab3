//! A frame's map in a few numbers.

use std::f32::consts::LN_2;
use std::ops::Range;

use super::map::MapPixels;
use super::{CERTAIN, ENTROPY_STEPS_PER_NAT, FrameMap, NO_NODE};
use crate::labels::{ClassId, ImportedMap, VOID};

/// Numbers about a frame's map.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameSummary {
    /// Mean entropy in nats.
    pub mean_entropy: f32,
    /// Share of the pixels that have a class, 0..=1.
    pub coverage: f32,
    /// Share of the pixels whose class has a probability below one half, 0..=1. For maps without probabilities, such as
    /// those of a project file, the share of pixels with more entropy than an even choice of two classes (ln 2).
    pub unclear: f32,
    /// Share of the pixels whose class differs from that of an imported label image, 0..=1.
    pub disagreeing: f32,
}

/// Numbers of pixels.
#[derive(Default)]
struct Counts {
    pixels: usize,
    entropy: u64,
    labelled: usize,
    unclear: usize,
    disagreeing: usize,
}

/// The values that a run of pixels has in common; void for certain by default.
#[derive(Clone, Copy, Default)]
struct PixelValue {
    label: ClassId,
    entropy: u16,
    unclear: bool,
}

impl FrameMap {
    /// The map in a few numbers. A map that follows from a surface is summed up by the nodes that its pixels show,
    /// without the refined borders and the painted pixels: that differs in few pixels, and a thousand frames take a
    /// fraction of a second. `None` for such a map of a frame that is no keyframe, whose files would have to be read.
    pub fn summary(&self, imported: Option<&ImportedMap>) -> Option<FrameSummary> {
        let pixels = self.width as usize * self.height as usize;
        let said = imported.filter(|image| image.pixels() == pixels);
        let said = said.map(ImportedMap::labels);
        let mut counts = Counts::default();
        match &self.pixels {
            MapPixels::Listed {
                labels,
                entropy,
                likelihood,
                ..
            } => {
                let toss_up = (LN_2 * ENTROPY_STEPS_PER_NAT) as u16;
                for pixel in 0..labels.len() {
                    let entropy = entropy[pixel];
                    let unclear = match likelihood {
                        Some(likelihood) => likelihood.confidence[pixel] < CERTAIN / 2,
                        None => entropy > toss_up,
                    };
                    let value = PixelValue {
                        label: labels[pixel],
                        entropy,
                        unclear,
                    };
                    counts.add(pixel..pixel + 1, value, said.as_deref());
                }
            }
            MapPixels::OnSurface(shown) => {
                let posterior = &shown.posterior;
                let nodes = shown.surface.pixels.get(self.frame);
                let nodes = nodes.filter(|nodes| !nodes.is_empty())?;
                let color = shown.scene.frames[self.frame].color();
                for (node, mut range) in nodes.runs() {
                    if node == NO_NODE {
                        // Hidden pixels are void for certain. Which pixels of a run they are does not matter.
                        let hidden = range.clone().filter(|&pixel| color.is_hidden(pixel)).count();
                        counts.add(range.start..range.start + hidden, PixelValue::default(), None);
                        range.start += hidden;
                    }
                    let value = match node {
                        NO_NODE => PixelValue {
                            label: VOID,
                            entropy: shown.unknown,
                            unclear: true,
                        },
                        node => PixelValue {
                            label: posterior.labels[node as usize],
                            entropy: posterior.entropy[node as usize],
                            unclear: posterior.confidence[node as usize] < CERTAIN / 2,
                        },
                    };
                    counts.add(range, value, said.as_deref());
                }
            }
        }
        Some(counts.shares())
    }
}

impl Counts {
    /// Adds a run of pixels.
    fn add(&mut self, range: Range<usize>, value: PixelValue, said: Option<&[ClassId]>) {
        let length = range.len();
        self.pixels += length;
        self.entropy += length as u64 * u64::from(value.entropy);
        self.unclear += if value.unclear { length } else { 0 };
        if value.label != VOID {
            self.labelled += length;
            let other = |&&said: &&ClassId| said != VOID && said != value.label;
            self.disagreeing += said.map_or(0, |said| said[range].iter().filter(other).count());
        }
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
