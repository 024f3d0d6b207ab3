//! Dense label maps.

use std::borrow::Cow;

use crate::labels::{ClassId, VOID};
use crate::scene::Frame;

/// Steps of [`FrameMap::entropy`] per nat.
pub const ENTROPY_STEPS_PER_NAT: f32 = 10_000.0;

/// Dense labels of one frame, row-major `[height, width]`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FrameMap {
    /// Index of the frame.
    pub frame: usize,
    /// Generation of the labels it was made from.
    pub generation: u64,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    /// Most likely class of every pixel; void where nothing is known or the person said so.
    pub labels: Vec<ClassId>,
    /// Entropy of every pixel's class distribution, in nats times [`ENTROPY_STEPS_PER_NAT`].
    pub entropy: Vec<u16>,
}

impl FrameMap {
    /// Mean entropy over all pixels, in nats.
    pub fn mean_entropy(&self) -> f32 {
        let sum: u64 = self.entropy.iter().map(|&e| u64::from(e)).sum();
        sum as f32 / self.entropy.len().max(1) as f32 / ENTROPY_STEPS_PER_NAT
    }

    /// Share of the pixels that have a class, 0..=1.
    pub fn coverage(&self) -> f32 {
        let labelled = self.labels.iter().filter(|&&label| label != VOID).count();
        labelled as f32 / self.labels.len().max(1) as f32
    }

    /// The map in the pixels of the frame's image on disk: each has what the frame's pixel at the same
    /// place has. Pixels that the frame does not reach, behind the strongest lenses, are void and as unsure
    /// as the frame's most unsure pixel.
    pub fn in_image<'a>(&'a self, frame: &Frame) -> Cow<'a, Self> {
        if frame.lens.is_none() {
            return Cow::Borrowed(self);
        }
        let (width, height) = (frame.image().width, frame.image().height);
        let unknown = self.entropy.iter().copied().max().unwrap_or(0);
        let at = |index: u32| match frame.of_image([index % width, index / width]) {
            Some([x, y]) if x < self.width && y < self.height => {
                let index = (y * self.width + x) as usize;
                (self.labels[index], self.entropy[index])
            }
            _ => (VOID, unknown),
        };
        let (labels, entropy) = (0..width * height).map(at).unzip();
        Cow::Owned(Self {
            width,
            height,
            labels,
            entropy,
            ..*self
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::testing::wall;
    use crate::scene::{Distortion, Lens};

    #[test]
    fn a_map_of_a_straight_frame_is_looked_up_through_the_lens() {
        let mut frame = wall(1, 64, 48).frames.remove(0);
        let map_of = |frame: &Frame| {
            let pixels = frame.camera.pixels();
            FrameMap {
                frame: 0,
                generation: 1,
                width: frame.camera.width,
                height: frame.camera.height,
                labels: (0..pixels).map(|index| index as ClassId).collect(),
                entropy: (0..pixels).map(|index| index as u16).collect(),
            }
        };
        let same = map_of(&frame);
        assert!(matches!(same.in_image(&frame), Cow::Borrowed(map) if *map == same));
        let lens = Lens {
            image: frame.camera,
            distortion: Distortion {
                k1: -0.1,
                ..Distortion::default()
            },
        };
        frame.camera = lens.pinhole().unwrap();
        frame.lens = Some(lens);
        let map = map_of(&frame);
        let bent = map.in_image(&frame);
        assert_eq!(
            [bent.width, bent.height, bent.labels.len() as u32],
            [64, 48, 64 * 48]
        );
        let [x, y] = frame.of_image([10, 40]).unwrap();
        let index = (y * frame.camera.width + x) as usize;
        assert_eq!(bent.labels[40 * 64 + 10], map.labels[index]);
        assert_eq!(bent.entropy[40 * 64 + 10], map.entropy[index]);
        // The middle of the image stays the middle.
        let middle = (frame.camera.height / 2 * frame.camera.width + frame.camera.width / 2) as usize;
        assert_eq!(bent.labels[24 * 64 + 32], map.labels[middle]);
    }
}
