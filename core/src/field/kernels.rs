//! The field's hot loops as a candle custom op with hand-written gradients.
//!
//! [`render`] does all of it in one op for the CPU's vector unit, chosen at run time ([`Dispatch`]). Its
//! gradients are tested against those of the same computation in plain candle ops.

// Loops over lanes are written by index, as the vectors that they become.
#![allow(clippy::needless_range_loop, clippy::too_many_arguments)]

mod adam;
mod chunk;
mod composite;
mod encode;
mod fused;
mod grid;
mod network;

use candle_core::{CpuStorage, Layout, Result, bail};

pub use crate::lanes::{Dispatch, F32x16, LANES};
pub use adam::Adam;
pub use composite::{EXTRA, RayPacking};
pub use encode::encode;
pub use fused::{Buffers, Evaluated, Parameters, VALUE_CHANNELS, Wanted, evaluate, render};
pub use network::{
    DIRECTION_FEATURES, GEOMETRY_FEATURES, INITIAL_LOG_DENSITY, LOG_DENSITY_RANGE, NetworkShape,
};

/// The `f32` values behind a contiguous tensor on the CPU.
fn values<'a>(storage: &'a CpuStorage, layout: &Layout, op: &str) -> Result<&'a [f32]> {
    let Some((start, end)) = layout.contiguous_offsets() else {
        bail!("{op} needs contiguous arguments")
    };
    Ok(&storage.as_slice::<f32>()?[start..end])
}

/// Takes the first `count` elements off a slice.
pub(super) fn split_off<'a, T>(rest: &mut &'a mut [T], count: usize) -> &'a mut [T] {
    let (own, others) = std::mem::take(rest).split_at_mut(count);
    *rest = others;
    own
}
