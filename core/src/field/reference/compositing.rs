//! Volume rendering with plain ops.

use candle_core::{D, Result, Tensor};
use candle_nn::ops::log_softmax;

/// Weight of every sample, `[R, S]`: T_k alpha(sigma_k delta_k) with T_k = exp(-sum of sigma delta before
/// k) and alpha(x) = 1 - exp(-x) (Eq. 1 and 2), from densities per metre and distances to the next sample
/// in metres, both `[R, S]`.
///
/// # Errors
/// Tensors of other shapes.
pub fn ray_weights(density: &Tensor, deltas: &Tensor) -> Result<Tensor> {
    let depth = density.mul(deltas)?;
    let samples = depth.dim(1)?;
    let stopped = depth.neg()?.exp()?.affine(-1.0, 1.0)?;
    // The last sample shades nothing, and its distance to the next is huge.
    let before = depth
        .narrow(1, 0, samples - 1)?
        .cumsum(1)?
        .pad_with_zeros(1, 1, 0)?;
    before.neg()?.exp()?.mul(&stopped)
}

/// Weighted sum over the samples of each ray, `[R, C]`, of values `[R, S, C]` with weights `[R, S]`: colours
/// (Eq. 1) or class logits (Eq. 4).
///
/// # Errors
/// Tensors of other shapes.
pub fn composite(weights: &Tensor, values: &Tensor) -> Result<Tensor> {
    weights.unsqueeze(1)?.matmul(values)?.squeeze(1)
}

/// Entropy `[R]`, in nats, of the softmax of logits `[R, classes]`.
///
/// # Errors
/// A tensor of another shape.
pub fn entropy(logits: &Tensor) -> Result<Tensor> {
    let log_p = log_softmax(logits, D::Minus1)?;
    log_p.exp()?.mul(&log_p)?.sum(D::Minus1)?.neg()
}
