//! Adam (Kingma and Ba, 2015), in place and lazy.

use std::sync::{Mutex, PoisonError};

use candle_core::{CpuStorage, InplaceOp2, Layout, Result, Tensor, Var, bail};
use rayon::prelude::*;

use super::values;
use crate::lanes::{Dispatch, VectorUnit, dispatched};

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
    moments: [Vec<f32>; 2],
    steps: i32,
}

/// What a step's number and learning rate make of Adam's update rule.
#[derive(Clone, Copy)]
struct Rates {
    rate: f32,
    epsilon: f32,
}

impl Adam {
    /// Starts with zero moments.
    pub fn new(parameter: &Var) -> Self {
        let zeros = || vec![0.0; parameter.elem_count()];
        Self::with(parameter, [zeros(), zeros()], 0)
    }

    fn with(parameter: &Var, moments: [Vec<f32>; 2], steps: i32) -> Self {
        Self {
            parameter: parameter.clone(),
            state: Mutex::new(State { moments, steps }),
        }
    }

    /// Goes on with another parameter, whose every row was a row of this one, with the moments of that row.
    ///
    /// # Errors
    /// A parameter of one dimension.
    pub fn regrown(&self, parameter: &Var, sources: &[u32]) -> Result<Self> {
        let state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let width = self.parameter.dim(1)?;
        let moments = state.moments.each_ref().map(|old| {
            let row = |&row: &u32| &old[row as usize * width..(row as usize + 1) * width];
            sources.iter().flat_map(row).copied().collect()
        });
        Ok(Self::with(parameter, moments, state.steps))
    }

    /// One step against the gradient.
    ///
    /// # Errors
    /// A gradient of another shape or type than the parameter.
    pub fn step(&self, gradient: &Tensor, learning_rate: f32) -> Result<()> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        state.steps += 1;
        let corrected = 1.0 - BETA2.powi(state.steps);
        let rates = Rates {
            rate: learning_rate * corrected.sqrt() / (1.0 - BETA1.powi(state.steps)),
            epsilon: EPSILON * corrected.sqrt(),
        };
        let moments = Mutex::new(&mut state.moments);
        let op = AdamStep { moments, rates };
        self.parameter.inplace_op2(&gradient.contiguous()?, &op)
    }
}

struct AdamStep<'a> {
    moments: Mutex<&'a mut [Vec<f32>; 2]>,
    rates: Rates,
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
        let mut moments = self.moments.lock().unwrap_or_else(PoisonError::into_inner);
        let CpuStorage::F32(parameter) = parameter else {
            bail!("adam needs f32 parameters")
        };
        let whole = parameter_layout.contiguous_offsets() == Some((0, parameter.len()));
        if !whole || gradient.len() != parameter.len() {
            bail!("adam: gradient and parameter differ in shape");
        }
        let [first, second] = &mut **moments;
        let dispatch = Dispatch::detect();
        parameter
            .par_chunks_mut(CHUNK)
            .zip(gradient.par_chunks(CHUNK))
            .zip(first.par_chunks_mut(CHUNK).zip(second.par_chunks_mut(CHUNK)))
            .for_each(|((parameter, gradient), (first, second))| {
                descend(dispatch, parameter, gradient, first, second, self.rates);
            });
        Ok(())
    }
}

dispatched! {
    /// One step of some elements. The same to the last bit on every vector unit.
    fn descend = descend_on(
        parameter: &mut [f32],
        gradient: &[f32],
        first: &mut [f32],
        second: &mut [f32],
        rates: Rates,
    )
}

#[inline(always)]
fn descend_on<U: VectorUnit>(
    _unit: U,
    parameter: &mut [f32],
    gradient: &[f32],
    first: &mut [f32],
    second: &mut [f32],
    rates: Rates,
) {
    // Written without a branch, so that the compiler makes vectors of it.
    let elements = parameter
        .iter_mut()
        .zip(gradient)
        .zip(first.iter_mut().zip(second));
    for ((p, &g), (m, v)) in elements {
        let first = BETA1 * *m + (1.0 - BETA1) * g;
        let second = BETA2 * *v + (1.0 - BETA2) * g * g;
        let stepped = *p - rates.rate * first / (second.sqrt() + rates.epsilon);
        let touched = g != 0.0;
        *m = if touched { first } else { *m };
        *v = if touched { second } else { *v };
        *p = if touched { stepped } else { *p };
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::Device;

    #[test]
    fn elements_step_as_adam_says_and_only_where_they_were_touched() {
        let mut expected = [1.0_f32, 2.0, 3.0, -4.0];
        let parameter = Var::new(&expected, &Device::Cpu).unwrap();
        let adam = Adam::new(&parameter);
        let mut moments = [[0.0_f32; 2]; 4];
        for step in 1..=20 {
            // The second is touched in every other step, the last never.
            let sometimes = if step % 2 == 0 { 0.0 } else { 0.3 };
            let gradient = [0.1 * step as f32, sometimes, -2.0, 0.0];
            adam.step(&Tensor::new(&gradient, &Device::Cpu).unwrap(), 0.1)
                .unwrap();
            for ((value, [m, v]), g) in expected.iter_mut().zip(&mut moments).zip(gradient) {
                if g != 0.0 {
                    *m += (1.0 - BETA1) * (g - *m);
                    *v += (1.0 - BETA2) * (g * g - *v);
                    let [mean, square] = [*m / (1.0 - BETA1.powi(step)), *v / (1.0 - BETA2.powi(step))];
                    *value -= 0.1 * mean / (square.sqrt() + EPSILON);
                }
            }
            let values = parameter.to_vec1::<f32>().unwrap();
            for (value, expected) in values.iter().zip(expected) {
                assert!((value - expected).abs() < 1e-5, "{step}: {value} {expected}");
            }
        }
    }

    #[test]
    fn rows_go_on_as_the_rows_that_they_were() {
        let rows = Tensor::new(&[[1.0_f32, 2.0], [3.0, 4.0]], &Device::Cpu).unwrap();
        let gradient = Tensor::new(&[[0.5_f32, -1.0], [2.0, 0.25]], &Device::Cpu).unwrap();
        let grown = |t: &Tensor| Tensor::cat(&[t, t], 0).unwrap();
        let parameter = Var::from_tensor(&rows).unwrap();
        let adam = Adam::new(&parameter);
        adam.step(&gradient, 0.1).unwrap();
        let larger = Var::from_tensor(&grown(&parameter)).unwrap();
        let regrown = adam.regrown(&larger, &[0, 1, 0, 1]).unwrap();
        adam.step(&gradient, 0.1).unwrap();
        regrown.step(&grown(&gradient), 0.1).unwrap();
        let expected = grown(&parameter).to_vec2::<f32>().unwrap();
        assert_eq!(larger.to_vec2::<f32>().unwrap(), expected);
    }
}
