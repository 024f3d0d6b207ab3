//! Hash-grid encoding: trilinear interpolation of table rows, level by level.

use candle_core::{CpuStorage, CustomOp2, Layout, Result, Shape, Tensor, bail};
use rayon::prelude::*;

use super::values;
use crate::field::encoding::{FEATURES_PER_LEVEL, GridShape};

/// Samples that one task encodes.
const CHUNK: usize = 1024;

/// Encodes positions `[N, 3]` in the unit cube with a table `[rows, 2]` to features `[N, levels * 2]`.
///
/// Differentiable in the table; positions get no gradient.
///
/// # Errors
/// Arguments of other shapes, or not contiguous `f32` on the CPU.
pub fn encode(shape: &GridShape, positions: &Tensor, table: &Tensor) -> Result<Tensor> {
    positions.apply_op2(table, Encode(shape.clone()))
}

struct Encode(GridShape);

impl CustomOp2 for Encode {
    fn name(&self) -> &'static str {
        "hash-grid encode"
    }

    fn cpu_fwd(
        &self,
        positions: &CpuStorage,
        positions_layout: &Layout,
        table: &CpuStorage,
        table_layout: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let (samples, three) = positions_layout.shape().dims2()?;
        let table_dims = table_layout.shape().dims2()?;
        if three != 3 || table_dims != (self.0.rows(), FEATURES_PER_LEVEL) {
            bail!(
                "{}: positions [{samples}, {three}] with a table {table_dims:?}",
                self.name()
            );
        }
        let positions = values(positions, positions_layout, self.name())?;
        let table: &[[f32; 2]] = bytemuck::cast_slice(values(table, table_layout, self.name())?);
        let width = self.0.features();
        let mut features = vec![0.0_f32; samples * width];
        features
            .par_chunks_mut(CHUNK * width)
            .zip(positions.par_chunks(CHUNK * 3))
            .for_each(|(features, positions)| {
                for (level_index, level) in self.0.levels().iter().enumerate() {
                    let place = level_index * FEATURES_PER_LEVEL;
                    for (row, position) in features.chunks_exact_mut(width).zip(positions.chunks_exact(3)) {
                        let (rows, weights) = level.corners([position[0], position[1], position[2]]);
                        let mut sum = [0.0; 2];
                        for corner in 0..8 {
                            let entry = table[rows[corner] as usize];
                            sum[0] += weights[corner] * entry[0];
                            sum[1] += weights[corner] * entry[1];
                        }
                        row[place..place + 2].copy_from_slice(&sum);
                    }
                }
            });
        Ok((CpuStorage::F32(features), Shape::from((samples, width))))
    }

    fn bwd(
        &self,
        positions: &Tensor,
        table: &Tensor,
        _features: &Tensor,
        grad: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        let scatter = EncodeBackward(self.0.clone());
        let table_grad = positions.apply_op2_no_bwd(&grad.contiguous()?, &scatter)?;
        debug_assert_eq!(table_grad.dims(), table.dims());
        Ok((None, Some(table_grad)))
    }
}

/// Gradient of the table: each level scatters on its own, samples in order, so that the sum is the
/// same for any number of threads.
struct EncodeBackward(GridShape);

impl CustomOp2 for EncodeBackward {
    fn name(&self) -> &'static str {
        "hash-grid encode backward"
    }

    fn cpu_fwd(
        &self,
        positions: &CpuStorage,
        positions_layout: &Layout,
        grad: &CpuStorage,
        grad_layout: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let positions = values(positions, positions_layout, self.name())?;
        let grad = values(grad, grad_layout, self.name())?;
        let width = self.0.features();
        let mut table_grad = vec![0.0_f32; self.0.rows() * FEATURES_PER_LEVEL];
        let mut rest: &mut [[f32; 2]] = bytemuck::cast_slice_mut(&mut table_grad);
        let mut tasks = Vec::with_capacity(self.0.levels().len());
        for (index, level) in self.0.levels().iter().enumerate() {
            let (own, others) = rest.split_at_mut(level.rows);
            rest = others;
            tasks.push((index, level, own));
        }
        tasks.into_par_iter().for_each(|(index, level, own)| {
            let place = index * FEATURES_PER_LEVEL;
            for (position, grad) in positions.chunks_exact(3).zip(grad.chunks_exact(width)) {
                let (rows, weights) = level.corners([position[0], position[1], position[2]]);
                let (a, b) = (grad[place], grad[place + 1]);
                for corner in 0..8 {
                    let entry = &mut own[rows[corner] as usize - level.first_row];
                    entry[0] += weights[corner] * a;
                    entry[1] += weights[corner] * b;
                }
            }
        });
        let shape = Shape::from((self.0.rows(), FEATURES_PER_LEVEL));
        Ok((CpuStorage::F32(table_grad), shape))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::{Device, Var};
    use rand::{Rng, SeedableRng, rngs::SmallRng};

    fn random(rng: &mut SmallRng, shape: (usize, usize), low: f32, high: f32) -> Tensor {
        let values: Vec<f32> = (0..shape.0 * shape.1)
            .map(|_| rng.random_range(low..high))
            .collect();
        Tensor::from_vec(values, shape, &Device::Cpu).unwrap()
    }

    /// The same interpolation by plain candle ops.
    fn plain(shape: &GridShape, positions: &Tensor, table: &Tensor) -> Result<Tensor> {
        let positions: Vec<Vec<f32>> = positions.to_vec2()?;
        let mut columns = Vec::new();
        for level in shape.levels() {
            let mut rows = Vec::new();
            let mut weights = Vec::new();
            for p in &positions {
                let (r, w) = level.corners([p[0], p[1], p[2]]);
                rows.extend(r);
                weights.extend(w);
            }
            let n = positions.len();
            let rows = Tensor::from_vec(rows, 8 * n, &Device::Cpu)?;
            let weights = Tensor::from_vec(weights, (n, 8, 1), &Device::Cpu)?;
            let entries = table.index_select(&rows, 0)?.reshape((n, 8, 2))?;
            columns.push(entries.broadcast_mul(&weights)?.sum(1)?);
        }
        Tensor::cat(&columns, 1)
    }

    #[test]
    fn forward_and_table_gradient_equal_plain_candle_ops() {
        let mut rng = SmallRng::seed_from_u64(3);
        let shape = GridShape::new(4, 4, 40, 9);
        let positions = random(&mut rng, (3000, 3), -0.1, 1.1);
        let table = Var::from_tensor(&random(&mut rng, (shape.rows(), 2), -1.0, 1.0)).unwrap();
        let target = random(&mut rng, (3000, shape.features()), -1.0, 1.0);
        let run = |features: Tensor| {
            let loss = features.sub(&target).unwrap().sqr().unwrap().sum_all().unwrap();
            let gradient = loss
                .backward()
                .unwrap()
                .get(&table)
                .unwrap()
                .flatten_all()
                .unwrap();
            (
                loss.to_scalar::<f32>().unwrap(),
                gradient.to_vec1::<f32>().unwrap(),
            )
        };
        let (loss, gradient) = run(encode(&shape, &positions, &table).unwrap());
        let (plain_loss, plain_gradient) = run(plain(&shape, &positions, &table).unwrap());
        assert!((loss - plain_loss).abs() < 1e-4 * plain_loss);
        let scale = plain_gradient.iter().fold(0.0_f32, |m, g| m.max(g.abs()));
        for (a, b) in gradient.iter().zip(&plain_gradient) {
            assert!((a - b).abs() < 1e-4 * scale);
        }
    }

    #[test]
    fn table_gradient_equals_central_differences() {
        let mut rng = SmallRng::seed_from_u64(4);
        let shape = GridShape::new(2, 2, 5, 6);
        let positions = random(&mut rng, (40, 3), 0.0, 1.0);
        let values = random(&mut rng, (shape.rows(), 2), -1.0, 1.0);
        let loss_of = |table: &Tensor| encode(&shape, &positions, table)?.sqr()?.sum_all();
        let table = Var::from_tensor(&values).unwrap();
        let gradient = loss_of(&table).unwrap().backward().unwrap();
        let gradient: Vec<f32> = gradient
            .get(&table)
            .unwrap()
            .flatten_all()
            .unwrap()
            .to_vec1()
            .unwrap();
        let flat: Vec<f32> = values.flatten_all().unwrap().to_vec1().unwrap();
        for index in (0..flat.len()).step_by(7) {
            let shifted = |by: f32| {
                let mut moved = flat.clone();
                moved[index] += by;
                let table = Tensor::from_vec(moved, values.dims(), &Device::Cpu).unwrap();
                loss_of(&table).unwrap().to_scalar::<f32>().unwrap()
            };
            let numeric = (shifted(0.01) - shifted(-0.01)) / 0.02;
            assert!((gradient[index] - numeric).abs() < 1e-2 * (1.0 + numeric.abs()));
        }
    }
}
