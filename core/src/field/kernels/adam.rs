//! Adam (Kingma and Ba, 2015), in place and lazy.

use std::sync::{Mutex, PoisonError};

use candle_core::{CpuStorage, InplaceOp2, Layout, Result, Tensor, Var, bail};
use rayon::prelude::*;

use super::values;

const BETA1: f32 = 0.9;
const BETA2: f32 = 0.99;
const EPSILON: f32 = 1e-10;
const CHUNK: usize = 16 * 1024;

/// The optimiser's state for one parameter tensor.
///
/// Lazy: an element whose gradient is exactly zero was not touched by this step's samples; neither it
/// nor its moments change. That keeps a large hash table cheap.
#[derive(Debug)]
pub struct Adam {
    parameter: Var,
    state: Mutex<State>,
}

#[derive(Debug)]
struct State {
    /// First and second moment of each element.
    moments: Vec<[f32; 2]>,
    steps: i32,
}

impl Adam {
    /// Starts with zero moments.
    pub fn new(parameter: &Var) -> Self {
        Self {
            parameter: parameter.clone(),
            state: Mutex::new(State {
                moments: vec![[0.0; 2]; parameter.elem_count()],
                steps: 0,
            }),
        }
    }

    /// The parameter that is stepped.
    pub fn parameter(&self) -> &Var {
        &self.parameter
    }

    /// One step against the gradient.
    ///
    /// # Errors
    /// A gradient of another shape, or not contiguous `f32` on the CPU.
    pub fn step(&self, gradient: &Tensor, learning_rate: f32) -> Result<()> {
        let gradient = gradient.contiguous()?;
        let op = AdamStep {
            state: &self.state,
            learning_rate,
        };
        self.parameter.inplace_op2(&gradient, &op)
    }
}

struct AdamStep<'a> {
    state: &'a Mutex<State>,
    learning_rate: f32,
}

impl InplaceOp2 for AdamStep<'_> {
    fn name(&self) -> &'static str {
        "adam"
    }

    fn cpu_fwd(
        &self,
        parameter: &mut CpuStorage,
        parameter_layout: &Layout,
        gradient: &CpuStorage,
        gradient_layout: &Layout,
    ) -> Result<()> {
        let gradient = values(gradient, gradient_layout, self.name())?;
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let CpuStorage::F32(parameter) = parameter else {
            bail!("adam needs f32 parameters")
        };
        let whole = parameter_layout.contiguous_offsets() == Some((0, parameter.len()));
        if !whole || gradient.len() != parameter.len() {
            bail!("adam: gradient and parameter differ in shape");
        }
        state.steps += 1;
        let corrected = 1.0 - BETA2.powi(state.steps);
        let rate = self.learning_rate * corrected.sqrt() / (1.0 - BETA1.powi(state.steps));
        let epsilon = EPSILON * corrected.sqrt();
        parameter
            .par_chunks_mut(CHUNK)
            .zip(gradient.par_chunks(CHUNK))
            .zip(state.moments.par_chunks_mut(CHUNK))
            .for_each(|((parameter, gradient), moments)| {
                for ((p, &g), [m, v]) in parameter.iter_mut().zip(gradient).zip(moments) {
                    if g != 0.0 {
                        *m = BETA1 * *m + (1.0 - BETA1) * g;
                        *v = BETA2 * *v + (1.0 - BETA2) * g * g;
                        *p -= rate * *m / (v.sqrt() + epsilon);
                    }
                }
            });
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::Device;

    #[test]
    fn the_first_step_has_the_size_of_the_learning_rate() {
        let parameter = Var::from_tensor(&Tensor::new(&[1.0_f32, 2.0, 3.0], &Device::Cpu).unwrap()).unwrap();
        let adam = Adam::new(&parameter);
        let gradient = Tensor::new(&[0.5_f32, 0.0, -2.0], &Device::Cpu).unwrap();
        adam.step(&gradient, 0.1).unwrap();
        let values = parameter.to_vec1::<f32>().unwrap();
        for (value, expected) in values.iter().zip([0.9, 2.0, 3.1]) {
            assert!((value - expected).abs() < 1e-5);
        }
    }

    #[test]
    fn it_finds_the_minimum_of_a_parabola() {
        let parameter = Var::from_tensor(&Tensor::new(&[4.0_f32], &Device::Cpu).unwrap()).unwrap();
        let adam = Adam::new(&parameter);
        for _ in 0..500 {
            let loss = parameter
                .affine(1.0, -1.5)
                .unwrap()
                .sqr()
                .unwrap()
                .sum_all()
                .unwrap();
            let gradients = loss.backward().unwrap();
            adam.step(gradients.get(&parameter).unwrap(), 0.05).unwrap();
        }
        assert!((parameter.to_vec1::<f32>().unwrap()[0] - 1.5).abs() < 1e-2);
    }
}
