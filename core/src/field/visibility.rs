//! Where rays end: samples behind an opaque surface are neither rendered nor trained.

use std::cell::Cell;

use candle_core::Result;

use super::kernels::{Evaluated, Wanted};
use super::{RadianceField, Samples};

/// Transmittance below which a ray has ended.
const DARK: f32 = 1e-3;
/// Samples of each ray that are evaluated before rays that have ended are left out.
const BLOCK: usize = 32;

thread_local! {
    /// Evaluated points and their densities: memory from one call to the next.
    static LOOKED_AT: Cell<(Samples, Evaluated)> = Cell::default();
}

/// Leaves out the samples of each ray behind the first at which hardly any light is left. Only the rays that `open`
/// picks are evaluated; the others are known to end at a surface.
///
/// # Errors
/// None on the CPU.
pub fn until_opaque(
    field: &RadianceField,
    mut samples: Samples,
    open: impl Fn(usize) -> bool,
) -> Result<Samples> {
    let packing = &samples.packing;
    let mut counts: Vec<usize> = (0..packing.rays()).map(|ray| packing.range(ray).len()).collect();
    let mut alive: Vec<(usize, f32)> = (0..packing.rays())
        .filter(|&ray| open(ray) && counts[ray] > BLOCK / 2)
        .map(|ray| (ray, 1.0))
        .collect();
    let (mut points, mut found) = LOOKED_AT.take();
    let mut looked = 0;
    while !alive.is_empty() {
        let block = |ray: usize| {
            let range = packing.range(ray);
            (range.start + looked).min(range.end)..(range.start + looked + BLOCK).min(range.end)
        };
        let positions = alive.iter().flat_map(|&(ray, _)| block(ray));
        points.refill_points(positions.map(|sample| samples.position(sample)));
        field.evaluate_into(&points, Wanted::default(), &mut found)?;
        let mut density = found.density.iter().copied();
        alive.retain_mut(|(ray, transmittance)| {
            for sample in block(*ray) {
                let optical_depth = density.next().unwrap_or(0.0) * packing.dt[sample];
                let before = *transmittance;
                *transmittance *= (-optical_depth).exp();
                if before >= DARK && *transmittance < DARK {
                    counts[*ray] = sample + 1 - packing.range(*ray).start;
                }
            }
            *transmittance >= DARK && looked + BLOCK < packing.range(*ray).len()
        });
        looked += BLOCK;
    }
    LOOKED_AT.set((points, found));
    samples.truncate(&counts);
    Ok(samples)
}
