//! The two losses, as shares of a batch.

use candle_core::{Result, Tensor};
use candle_nn::loss::cross_entropy;

/// Photometric loss (Eq. 6) of one network on some rays of a batch of `rays`: the sum of the squared colour
/// errors `[R, 3]` over 3 `rays`. Shares of a whole batch add up to its mean squared error.
///
/// # Errors
/// Tensors of other shapes.
pub fn photometric(color: &Tensor, truth: &Tensor, rays: usize) -> Result<Tensor> {
    let sum = color.sub(truth)?.sqr()?.sum_all()?;
    sum.affine(1.0 / (3 * rays) as f64, 0.0)
}

/// Semantic loss (Eq. 7) of one network on some rays of a batch with `labelled` labelled rays: cross-entropy
/// of the composited logits `[R, classes]` with the classes, over the rays that have one. Shares of a whole
/// batch add up to its mean; `None` when none of these rays has a class.
///
/// # Errors
/// A class outside of the logits.
pub fn semantic(logits: &Tensor, classes: &[Option<u32>], labelled: usize) -> Result<Option<Tensor>> {
    // candle's cross-entropy has no ignore index, so the labelled rows are picked out.
    let (rows, targets): (Vec<u32>, Vec<u32>) = (0..)
        .zip(classes)
        .filter_map(|(row, class)| class.map(|class| (row, class)))
        .unzip();
    if rows.is_empty() {
        return Ok(None);
    }
    let share = rows.len() as f64 / labelled as f64;
    let rows = Tensor::new(rows, logits.device())?;
    let targets = Tensor::new(targets, logits.device())?;
    let mean = cross_entropy(&logits.index_select(&rows, 0)?, &targets)?;
    Ok(Some(mean.affine(share, 0.0)?))
}
