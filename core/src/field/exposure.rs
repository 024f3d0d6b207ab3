//! Exposure and white balance of each frame.

use candle_core::{DType, Device, Result, Tensor, Var};
use glam::Vec3;

use super::kernels::Adam;

/// Weight of the mean square of gains and offsets, so that they explain only what the scene cannot.
const PENALTY: f64 = 0.05;
/// Logarithmic gain, then offset, of red, green and blue.
const PARAMETERS: usize = 6;

/// A small affine correction of each frame's colours, learnt with the field: color' = exp(gain) color +
/// offset, each channel on its own (what the appearance embeddings of Martin-Brualla et al. 2021 are for,
/// in six numbers).
///
/// It is used in training only: rendering shows the scene as the average frame does.
#[derive(Debug)]
pub struct Exposure {
    /// Gains and offsets of every frame, `[frames, 6]`.
    pub parameters: Var,
    optimiser: Adam,
}

impl Exposure {
    /// No correction yet, for this number of frames.
    ///
    /// # Errors
    /// Candle's.
    pub fn new(frames: usize) -> Result<Self> {
        let parameters = Var::zeros((frames, PARAMETERS), DType::F32, &Device::Cpu)?;
        Ok(Self {
            optimiser: Adam::new(&parameters),
            parameters,
        })
    }

    /// The colours `[rays, 3]` of rays of these frames as their cameras would show them, and the penalty to add to the
    /// loss. `opacity` `[rays, 1]` scales the offsets, since colours are composited over black.
    ///
    /// # Errors
    /// A frame that it does not know.
    pub fn apply(&self, colors: &Tensor, opacity: &Tensor, frames: &[u32]) -> Result<(Tensor, Tensor)> {
        let frames = Tensor::new(frames, &Device::Cpu)?;
        let own = self.parameters.index_select(&frames, 0)?;
        let gain = own.narrow(1, 0, 3)?.exp()?;
        let offset = own.narrow(1, 3, 3)?.broadcast_mul(opacity)?;
        let shown = (colors.mul(&gain)? + offset)?;
        let penalty = own.sqr()?.mean_all()?.affine(PENALTY, 0.0)?;
        Ok((shown, penalty))
    }

    /// One step against the gradient of the parameters.
    ///
    /// # Errors
    /// A gradient of another shape.
    pub fn step(&self, gradient: &Tensor, learning_rate: f32) -> Result<()> {
        self.optimiser.step(gradient, learning_rate)
    }
}

/// Mean squared error, over pixels and channels, of colours of one frame that was not trained on. Every second pixel is
/// corrected by the exposure that fits the other half, so that a frame's exposure does not count as an error, and no
/// pixel is judged by a fit to itself.
pub fn corrected_error(rendered: &[Vec3], measured: &[Vec3]) -> f32 {
    let mut squared = 0.0;
    for half in 0..2 {
        for channel in 0..3 {
            let pairs = |half: usize| {
                let of_half = rendered.iter().zip(measured).skip(half).step_by(2);
                of_half.map(move |(a, b)| (a[channel], b[channel]))
            };
            let (gain, offset) = fit(pairs(1 - half));
            squared += pairs(half)
                .map(|(a, b)| (gain * a + offset - b).powi(2))
                .sum::<f32>();
        }
    }
    squared / (3 * rendered.len().max(1)) as f32
}

/// The gain near 1 and the offset near 0 that map the first of each pair to the second: least squares with the penalty
/// of training.
fn fit(pairs: impl Iterator<Item = (f32, f32)>) -> (f32, f32) {
    let (mut n, mut a, mut aa, mut d, mut ad) = (0.0, 0.0, 0.0, 0.0, 0.0);
    for (x, y) in pairs {
        n += 1.0;
        a += x;
        aa += x * x;
        d += y - x;
        ad += x * (y - x);
    }
    let penalty = n * PENALTY as f32 / 2.0;
    // (gain - 1, offset) of the two normal equations.
    let (p, q) = (aa + penalty, n + penalty);
    let determinant = p * q - a * a;
    if determinant <= 0.0 {
        return (1.0, 0.0);
    }
    (
        1.0 + (ad * q - d * a) / determinant,
        (d * p - ad * a) / determinant,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_brighter_frame_gets_a_larger_gain() {
        let exposure = Exposure::new(3).unwrap();
        let colors = [[0.2_f32, 0.5, 0.8], [0.6, 0.3, 0.1]];
        let measured = Tensor::new(&colors.map(|c| c.map(|v| 1.2 * v)), &Device::Cpu).unwrap();
        let colors = Tensor::new(&colors, &Device::Cpu).unwrap();
        let opaque = Tensor::new(&[[1.0_f32], [1.0]], &Device::Cpu).unwrap();
        for _ in 0..400 {
            let (shown, penalty) = exposure.apply(&colors, &opaque, &[1, 1]).unwrap();
            let error = shown.sub(&measured).unwrap().sqr().unwrap().mean_all().unwrap();
            let gradients = (error + penalty).unwrap().backward().unwrap();
            let gradient = gradients.get(&exposure.parameters).unwrap();
            exposure.step(gradient, 0.01).unwrap();
        }
        let learnt = exposure.parameters.to_vec2::<f32>().unwrap();
        assert_eq!([&learnt[0], &learnt[2]], [&vec![0.0; 6]; 2]);
        assert!(learnt[1].iter().all(|&v| v > 0.0), "{learnt:?}");
    }

    #[test]
    fn a_frames_exposure_is_no_error_and_noise_is() {
        let colors: Vec<Vec3> = (0..200)
            .map(|k| Vec3::new(k as f32 / 200.0, (k * 7 % 200) as f32 / 200.0, 0.5))
            .collect();
        let brighter: Vec<Vec3> = colors.iter().map(|c| 1.1 * *c + 0.02).collect();
        let plain = |other: &[Vec3]| {
            let pairs = colors.iter().zip(other);
            let squares: f32 = pairs.map(|(a, b)| (*a - *b).length_squared() / 3.0).sum();
            squares / colors.len() as f32
        };
        assert!(corrected_error(&colors, &brighter) < 0.2 * plain(&brighter));
        let noisy: Vec<Vec3> = colors
            .iter()
            .enumerate()
            .map(|(k, c)| *c + if k / 2 % 2 == 0 { 0.1 } else { -0.1 })
            .collect();
        assert!(corrected_error(&colors, &noisy) > 0.9 * plain(&noisy));
        assert_eq!(corrected_error(&[], &[]), 0.0);
    }
}
