//! A hash grid by itself: positions to features, for networks that are not part of the fused field.

use candle_core::{CpuStorage, CustomOp1, Layout, Result, Shape, Tensor, bail};
use rayon::prelude::*;

use super::chunk::{encode_groups, gather_rows};
use super::grid::scatter_levels;
use super::values;
use crate::field::encoding::{FEATURES_PER_LEVEL, GridShape};
use crate::lanes::{Dispatch, F32x16, LANES};

/// Groups that one task encodes.
const PORTION: usize = 16;

/// Features `[N, levels * 2]` of unit positions (x, y, z one after another), interpolated between rows of
/// the table `[rows, 2]`; differentiable in the table.
///
/// # Errors
/// A table of another shape than the grid's, or not contiguous `f32` on the CPU.
pub fn encode(grid: &GridShape, table: &Tensor, positions: &[f32], dispatch: Dispatch) -> Result<Tensor> {
    let count = positions.len() / 3;
    let mut groups = vec![F32x16::ZERO; 3 * count.div_ceil(LANES)];
    gather_rows(positions, 3, &mut groups);
    table.apply_op1(Encode {
        grid: grid.clone(),
        positions: groups,
        count,
        dispatch,
    })
}

struct Encode {
    grid: GridShape,
    /// `[groups, 3]`; lanes beyond the last position are zero.
    positions: Vec<F32x16>,
    count: usize,
    dispatch: Dispatch,
}

impl CustomOp1 for Encode {
    fn name(&self) -> &'static str {
        "encode"
    }

    fn cpu_fwd(&self, table: &CpuStorage, layout: &Layout) -> Result<(CpuStorage, Shape)> {
        if layout.shape().dims2()? != (self.grid.rows(), FEATURES_PER_LEVEL) {
            bail!("encode: a table {:?} of another grid", layout.shape());
        }
        let table: &[[f32; 2]] = bytemuck::cast_slice(values(table, layout, self.name())?);
        let width = self.grid.features();
        let mut out = vec![0.0_f32; self.count * width];
        out.par_chunks_mut(PORTION * LANES * width)
            .zip(self.positions.par_chunks(3 * PORTION))
            .for_each_init(Vec::new, |encoding, (out, positions)| {
                encoding.resize(positions.len() / 3 * width, F32x16::ZERO);
                encode_groups(&self.grid, table, positions, encoding, self.dispatch);
                for (k, row) in out.chunks_exact_mut(width).enumerate() {
                    let own = &encoding[k / LANES * width..(k / LANES + 1) * width];
                    for (place, feature) in row.iter_mut().zip(own) {
                        *place = feature.0[k % LANES];
                    }
                }
            });
        Ok((CpuStorage::F32(out), Shape::from((self.count, width))))
    }

    fn bwd(&self, table: &Tensor, _out: &Tensor, grad: &Tensor) -> Result<Option<Tensor>> {
        let width = self.grid.features();
        let grad = grad.flatten_all()?.to_vec1::<f32>()?;
        let mut derivatives = vec![F32x16::ZERO; self.positions.len() / 3 * width];
        gather_rows(&grad, width, &mut derivatives);
        let mut gradient = vec![[0.0_f32; FEATURES_PER_LEVEL]; self.grid.rows()];
        let (grid, positions) = (&self.grid, &self.positions);
        scatter_levels(self.dispatch, grid, &mut gradient, positions, &derivatives);
        let gradient: &[f32] = bytemuck::cast_slice(&gradient);
        Ok(Some(Tensor::from_slice(gradient, table.shape(), table.device())?))
    }
}

#[cfg(test)]
mod tests {
    use candle_core::{Device, Var};
    use rand::{Rng, SeedableRng, rngs::SmallRng};

    use super::*;
    use crate::field::plain;
    use crate::field::rays::Samples;

    /// A grid with dense and hashed levels, its table, and positions that fill no group whole, some outside of the grid.
    fn case() -> (GridShape, Var, Samples) {
        let grid = GridShape::new(4, 3, 40, 9);
        let mut rng = SmallRng::seed_from_u64(4);
        let table: Vec<f32> = (0..2 * grid.rows())
            .map(|_| rng.random_range(-1.0..1.0))
            .collect();
        let table = Tensor::from_vec(table, (grid.rows(), 2), &Device::Cpu).unwrap();
        let positions: Vec<_> = (0..333)
            .map(|_| glam::Vec3::from([(); 3].map(|()| rng.random_range(-0.05..1.05))))
            .collect();
        let samples = Samples::at_points(&positions);
        (grid, Var::from_tensor(&table).unwrap(), samples)
    }

    /// A smooth function of the features.
    fn loss(features: &Tensor) -> Tensor {
        (features.sqr().unwrap() + features).unwrap().sum_all().unwrap()
    }

    #[test]
    fn features_and_gradient_equal_plain_candle_ops_on_every_vector_unit() {
        let (grid, table, samples) = case();
        let numbers = |tensor: &Tensor| tensor.flatten_all().unwrap().to_vec1::<f32>().unwrap();
        let gradient = |features: &Tensor| {
            let gradients = loss(features).backward().unwrap();
            numbers(gradients.get(&table).unwrap())
        };
        let expected = plain::encode(&grid, &table, &samples, 0..samples.len()).unwrap();
        let expected_gradient = gradient(&expected);
        for dispatch in Dispatch::available() {
            let features = encode(&grid, &table, samples.positions(), dispatch).unwrap();
            assert_eq!(features.dims(), expected.dims());
            for (a, b) in numbers(&features).iter().zip(numbers(&expected)) {
                assert!((a - b).abs() < 1e-5, "{dispatch}: {a} {b}");
            }
            for (a, b) in gradient(&features).iter().zip(&expected_gradient) {
                assert!((a - b).abs() < 1e-4, "{dispatch}: {a} {b}");
            }
        }
    }
}
