//! The loss of a training step.

use std::sync::Arc;

use candle_core::{Device, Result, Tensor};
use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::super::Samples;
use super::Trainer;
use super::batch::Batch;

/// Weight of the mean distance (in sides of the volume) between samples and the measured surface.
const DEPTH_WEIGHT: f64 = 1.0;
/// Light that passes the measured surface counts as if it was off by this share of a side.
const PASSING: f64 = 0.02;
/// Weight of the distortion (in sides of the volume) of rays of unknown depth.
const DISTORTION_WEIGHT: f64 = 0.02;
/// Weight of the bend of surfaces of unknown depth.
const SMOOTHNESS_WEIGHT: f64 = 0.1;
/// Relative bend above which the loss grows slowly: it is an edge of something.
const EDGE_BEND: f64 = 0.1;
/// How fast a difference of colour makes an edge likely, per unit of colour.
const EDGE_COLOR: f32 = 20.0;
/// Steps over which distortion and smoothness come in: in full from the start they can collapse a field that has no
/// shape yet.
const RAMP_STEPS: f64 = 500.0;

/// A part of the loss beside the colours of the pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum LossPart {
    /// Rays that are not stopped see a random colour, which only an opaque surface can avoid.
    RandomBackground,
    /// The samples that stop a ray lie together (mip-NeRF 360, Eq. 15).
    Distortion,
    /// Surfaces are smooth where the image is: inverse z-depth is linear across the image of a plane.
    Smoothness,
    /// Each frame has its own exposure and white balance.
    Exposure,
}

/// The parts of the loss beside the colours of the pixels: all of them by default, or all but one.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Recipe {
    without: Option<LossPart>,
}

impl Recipe {
    /// All parts, and all but one each, by name.
    pub fn ablations() -> [(&'static str, Self); 5] {
        [
            ("all", None),
            ("no random background", Some(LossPart::RandomBackground)),
            ("no distortion", Some(LossPart::Distortion)),
            ("no smoothness", Some(LossPart::Smoothness)),
            ("no exposure", Some(LossPart::Exposure)),
        ]
        .map(|(name, without)| (name, Self { without }))
    }

    /// Whether a part counts.
    pub(super) fn has(self, part: LossPart) -> bool {
        self.without != Some(part)
    }
}

impl Trainer {
    /// The loss of a batch along its samples; `gaps` is memory for one number per sample.
    ///
    /// # Errors
    /// Candle's.
    pub(super) fn loss(&self, batch: &Batch, samples: Samples, mut gaps: Vec<f32>) -> Result<Tensor> {
        let side = self.field.volume().side;
        gaps.clear();
        gaps.resize(samples.len(), 0.0);
        for (number, ray) in batch.rays.iter().enumerate() {
            if let Some(length) = ray.length {
                for i in samples.packing.range(number) {
                    gaps[i] = (samples.packing.t[i] - length).abs() / side;
                }
            }
        }
        let out = self.field.render(Arc::new(samples), gaps)?;
        let clear = out.narrow(1, 5, 1)?.affine(-1.0, 1.0)?;
        let mut loss = self.color_loss(batch, &out, &clear)?;

        let (count, measured) = (batch.rays.len(), batch.measured());
        if measured > 0 {
            loss = (loss + self.depth_loss(batch, &out, &clear)?)?;
        }
        let ramp = (self.steps as f64 / RAMP_STEPS).min(1.0);
        if measured < count && self.recipe.has(LossPart::Distortion) {
            let weight = ramp * DISTORTION_WEIGHT / f64::from(side) / count as f64;
            loss = (loss + out.narrow(1, 6, 1)?.sum_all()?.affine(weight, 0.0)?)?;
        }
        if batch.triples > 0 {
            loss = (loss + bend(batch, &out)?.affine(ramp * SMOOTHNESS_WEIGHT, 0.0)?)?;
        }
        Ok(loss)
    }

    /// Squared error of the colours, over a random background.
    fn color_loss(&self, batch: &Batch, out: &Tensor, clear: &Tensor) -> Result<Tensor> {
        let count = batch.rays.len();
        let mut shown = out.narrow(1, 0, 3)?;
        let mut penalty = None;
        if self.recipe.has(LossPart::Exposure) {
            let (corrected, size) =
                self.exposure
                    .apply(&shown, &out.narrow(1, 5, 1)?.detach(), &batch.frames)?;
            shown = corrected;
            penalty = Some(size);
        }
        if self.recipe.has(LossPart::RandomBackground) {
            let mut rng = SmallRng::seed_from_u64(self.seed ^ self.steps);
            let background: Vec<f32> = (0..3 * count).map(|_| rng.random()).collect();
            let background = Tensor::from_vec(background, (count, 3), &Device::Cpu)?;
            shown = (shown + background.broadcast_mul(clear)?)?;
        }
        let target = Tensor::from_slice(&batch.colors, (count, 3), &Device::Cpu)?;
        let error = shown.sub(&target)?.sqr()?.mean_all()?;
        match penalty {
            Some(penalty) => error + penalty,
            None => Ok(error),
        }
    }

    /// Distance between the samples that stop the light of rays of known length and the measured surface.
    fn depth_loss(&self, batch: &Batch, out: &Tensor, clear: &Tensor) -> Result<Tensor> {
        let known = batch
            .rays
            .iter()
            .map(|ray| f32::from(u8::from(ray.length.is_some())));
        let known = Tensor::from_vec(known.collect(), (batch.rays.len(), 1), &Device::Cpu)?;
        // What passes the surface is as wrong as what stops a margin away from it.
        let passing = clear.mul(&known)?.affine(PASSING, 0.0)?;
        let depth = (out.narrow(1, 3, 1)? + passing)?.sum_all()?;
        // Depth images cover everything that a camera sees; sparse points count as much as their share of the rays.
        let among = if self.scene.has_depth() {
            batch.measured()
        } else {
            batch.rays.len()
        };
        depth.affine(DEPTH_WEIGHT / among as f64, 0.0)
    }
}

/// Mean bend of the surfaces that rays in threes meet: by how much, relatively, the inverse z-depth of the
/// middle one differs from the mean of the outer ones, less where the colours differ, and hardly more
/// than [`EDGE_BEND`].
fn bend(batch: &Batch, out: &Tensor) -> Result<Tensor> {
    let count = batch.triples;
    let flat: Vec<f32> = (0..count)
        .map(|k| {
            let [first, middle, last] = [0, 1, 2].map(|place| batch.color(place * count + k));
            let change = (first - middle).length().max((last - middle).length());
            (-EDGE_COLOR * change).exp()
        })
        .collect();
    let flat = Tensor::from_vec(flat, count, &Device::Cpu)?;
    let slants = Tensor::from_slice(&batch.slants, (3, count), &Device::Cpu)?;
    let of_triples = |channel| {
        out.narrow(1, channel, 1)?
            .narrow(0, 0, 3 * count)?
            .reshape((3, count))
    };
    // Small numbers keep rays that nothing stops finite.
    let length = of_triples(4)?.div(&of_triples(5)?.affine(1.0, 1e-2)?)?;
    let inverse = slants.div(&length.affine(1.0, 1e-2)?)?;
    let place = |place| inverse.narrow(0, place, 1)?.squeeze(0);
    let middle = place(1)?;
    let outer = (place(0)? + place(2)?)?.affine(0.5, 0.0)?;
    let relative = outer.sub(&middle)?.div(&middle.detach())?;
    let size = relative.sqr()?.affine(1.0, 1e-6)?.sqrt()?;
    let saturating = size.div(&size.affine(1.0, EDGE_BEND)?)?;
    saturating.mul(&flat)?.mean_all()?.affine(EDGE_BEND, 0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rendered rays `[6, 7]` of two threes with these ray lengths, all opaque.
    fn rendered(lengths: [[f32; 3]; 2]) -> Tensor {
        let row = |place: usize, k: usize| [0.0, 0.0, 0.0, 0.0, lengths[k][place], 1.0, 0.0];
        let rows: Vec<f32> = (0..6).flat_map(|i| row(i / 2, i % 2)).collect();
        Tensor::from_vec(rows, (6, 7), &Device::Cpu).unwrap()
    }

    fn batch(colors: [f32; 3]) -> Batch {
        Batch {
            colors: (0..6).flat_map(|i| [colors[i / 2]; 3]).collect(),
            triples: 2,
            slants: vec![1.0; 6],
            ..Batch::default()
        }
    }

    fn bend_of(lengths: [f32; 3], colors: [f32; 3]) -> f32 {
        let out = rendered([lengths, [2.0; 3]]);
        bend(&batch(colors), &out).unwrap().to_scalar().unwrap()
    }

    #[test]
    fn planes_do_not_bend_and_corners_do_unless_the_colour_changes() {
        // 1/z of a slanted plane: 0.5, 0.4, 0.3.
        let plane = bend_of([2.0, 2.5, 1.0 / 0.3], [0.5; 3]);
        let corner = bend_of([2.0, 2.5, 2.0], [0.5; 3]);
        let edge = bend_of([2.0, 2.5, 2.0], [0.1, 0.5, 0.1]);
        let flat = bend_of([2.0; 3], [0.5; 3]);
        assert!((plane - flat).abs() < 1e-3, "{plane} {flat}");
        assert!(
            corner > 10.0 * flat && edge < 0.01 * corner,
            "{corner} {edge} {flat}"
        );
        // Twice the jump costs less than twice as much.
        assert!(bend_of([2.0, 4.0, 2.0], [0.5; 3]) < 1.8 * corner);
    }

    #[test]
    fn rays_that_nothing_stops_stay_finite() {
        let out = Tensor::zeros((6, 7), candle_core::DType::F32, &Device::Cpu).unwrap();
        let bend = bend(&batch([0.5; 3]), &out).unwrap();
        assert!(bend.to_scalar::<f32>().unwrap().is_finite());
    }
}
