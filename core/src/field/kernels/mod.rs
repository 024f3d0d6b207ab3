//! The field's hot loops as candle custom ops with hand-written gradients.
//!
//! Each op has its formula, its backward pass, and tests against central differences and against the
//! same computation in plain candle ops.

mod adam;
mod composite;
mod encode;

use candle_core::{CpuStorage, Layout, Result, bail};

pub use adam::Adam;
pub use composite::{Composite, RayPacking};
pub use encode::encode;

/// The `f32` values behind a contiguous tensor on the CPU.
fn values<'a>(storage: &'a CpuStorage, layout: &Layout, op: &str) -> Result<&'a [f32]> {
    let Some((start, end)) = layout.contiguous_offsets() else {
        bail!("{op} needs contiguous arguments")
    };
    Ok(&storage.as_slice::<f32>()?[start..end])
}
