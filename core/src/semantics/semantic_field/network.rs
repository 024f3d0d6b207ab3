//! A network of the semantic field.

use candle_core::{DType, Device, Result, Tensor, Var};
use rand::{Rng, rngs::SmallRng};

use crate::field::kernels::Adam;

/// Width of the hidden layer.
pub(super) const HIDDEN: usize = 64;

/// A network with one hidden layer and the steps that it was trained for.
#[derive(Debug)]
pub(super) struct Network {
    /// Weights of the hidden layer `[inputs, 64]` and of the output `[64, classes]`, and its bias `[classes]`.
    pub(super) parameters: [Var; 3],
    pub(super) optimisers: [Adam; 3],
    pub(super) steps: u64,
}

/// Names of a network's parameters in a saved model, and of its number of steps.
const PARAMETERS: [&str; 3] = ["hidden", "output", "bias"];
const STEPS: &str = "steps";

impl Network {
    /// A network of these parameters.
    fn of(parameters: [&Tensor; 3], steps: u64) -> Result<Self> {
        let [hidden, output, bias] = parameters.map(Var::from_tensor);
        let parameters = [hidden?, output?, bias?];
        let optimisers = [0, 1, 2].map(|index: usize| Adam::new(&parameters[index]));
        Ok(Self {
            parameters,
            optimisers,
            steps,
        })
    }

    /// A network whose hidden layer is random, and its output within `scale` of what is usual. From `earlier`, a network
    /// of other classes, it takes over the hidden layer and what leads to the classes in both: `known` tells the number
    /// that a class had there.
    pub(super) fn new(
        (inputs, outputs): (usize, usize),
        scale: f32,
        earlier: Option<&Self>,
        known: &[Option<usize>],
        rng: &mut SmallRng,
    ) -> Result<Self> {
        let mut layer = |inputs: usize, outputs: usize, scale: f32| -> Vec<f32> {
            let bound = (6.0 / (inputs + outputs) as f32).sqrt();
            (0..inputs * outputs)
                .map(|_| scale * rng.random_range(-bound..bound))
                .collect()
        };
        let mut hidden = Tensor::from_vec(layer(inputs, HIDDEN, 1.0), (inputs, HIDDEN), &Device::Cpu)?;
        let mut output = layer(HIDDEN, outputs, scale);
        let mut bias = vec![0.0; outputs];
        if let Some(earlier) = earlier {
            let [old_hidden, old_output, old_bias] = &earlier.parameters;
            hidden = old_hidden.copy()?;
            let old_output: Vec<Vec<f32>> = old_output.to_vec2()?;
            let old_bias: Vec<f32> = old_bias.to_vec1()?;
            for (column, old) in known.iter().enumerate() {
                if let Some(old) = *old {
                    bias[column] = old_bias[old];
                    for (row, values) in old_output.iter().enumerate() {
                        output[row * outputs + column] = values[old];
                    }
                }
            }
        }
        let output = Tensor::from_vec(output, (HIDDEN, outputs), &Device::Cpu)?;
        let bias = Tensor::from_vec(bias, outputs, &Device::Cpu)?;
        Self::of([&hidden, &output, &bias], 0)
    }

    /// Logits `[n, classes]` of inputs `[n, inputs]`.
    pub(super) fn logits(&self, inputs: &Tensor) -> Result<Tensor> {
        let [hidden, output, bias] = &self.parameters;
        inputs.matmul(hidden)?.relu()?.matmul(output)?.broadcast_add(bias)
    }

    /// The parameters and the steps by name, for saving.
    pub(super) fn state(&self) -> Result<Vec<(&'static str, Tensor)>> {
        let parameters = PARAMETERS.into_iter().zip(&self.parameters);
        let parameters = parameters.map(|(name, parameter)| Ok((name, parameter.copy()?)));
        let mut state = parameters.collect::<Result<Vec<_>>>()?;
        state.push((STEPS, Tensor::new(&[self.steps as u32], &Device::Cpu)?));
        Ok(state)
    }

    /// A network of what was saved under these names; `None` where that has other numbers of inputs and outputs.
    pub(super) fn restored<'a>(
        saved: impl Fn(&str) -> Option<&'a Tensor>,
        (inputs, outputs): (usize, usize),
    ) -> Option<Self> {
        let dims: [&[usize]; 3] = [&[inputs, HIDDEN], &[HIDDEN, outputs], &[outputs]];
        let part = |index: usize| fitting(saved(PARAMETERS[index])?, dims[index]);
        let steps: Vec<u32> = saved(STEPS)?.to_vec1().ok()?;
        Self::of([part(0)?, part(1)?, part(2)?], u64::from(*steps.first()?)).ok()
    }
}

/// A saved tensor, where it has these dimensions and holds `f32`.
pub(super) fn fitting<'a>(tensor: &'a Tensor, dims: &[usize]) -> Option<&'a Tensor> {
    (tensor.dims() == dims && tensor.dtype() == DType::F32).then_some(tensor)
}
