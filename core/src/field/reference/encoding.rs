//! The positional encoding.

use candle_core::{Result, Tensor};

/// `[N, 3]` to `[N, 3 + 6 frequencies]`: the input itself, then sin(2^k x) and cos(2^k x) for k = 0, 1, ...
///
/// As in the published code there is no factor of pi, and the raw input comes first.
///
/// # Errors
/// None for a tensor of that shape.
pub fn positional_encoding(input: &Tensor, frequencies: usize) -> Result<Tensor> {
    let rows = input.dim(0)?;
    let octaves: Vec<f32> = (0..frequencies as i32).map(|k| 2.0_f32.powi(k)).collect();
    let octaves = Tensor::from_vec(octaves, (1, frequencies, 1), input.device())?;
    // [N, frequencies, 3]
    let angles = input.unsqueeze(1)?.broadcast_mul(&octaves)?;
    let waves = Tensor::stack(&[angles.sin()?, angles.cos()?], 2)?;
    Tensor::cat(&[input, &waves.reshape((rows, 6 * frequencies))?], 1)
}
