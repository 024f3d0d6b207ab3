//! The semantic head: class logits from the field's features, trained continuously.

use std::collections::HashMap;

use candle_core::{Device, Result, Tensor, Var};
use candle_nn::ops::log_softmax;
use glam::Vec3;
use rand::{Rng, SeedableRng, rngs::SmallRng};

use crate::field::kernels::{Adam, Wanted};
use crate::field::{OccupancyGrid, RadianceField, Ray, Samples, Sampling, sum_by_ray};
use crate::labels::ClassId;

/// Width of the hidden layer.
const HIDDEN: usize = 64;
const LEARNING_RATE: f32 = 0.005;
const FEATURES: Wanted = Wanted {
    color: false,
    features: true,
};
/// Rays rendered at a time.
const CHUNK: usize = 1024;

/// Logits of every class at any point of the field: a network of one hidden layer on the field's
/// (detached) features, so that labels never disturb the geometry.
#[derive(Debug)]
pub struct SemanticHead {
    classes: Vec<ClassId>,
    hidden: Var,
    output: Var,
    bias: Var,
    optimisers: [Adam; 3],
    steps: u64,
}

/// Places on the surface with the class probabilities that the labels' spreading gives them.
pub struct SoftTargets {
    /// World positions.
    pub positions: Vec<Vec3>,
    /// Probabilities, row-major `[positions, classes]`.
    pub probabilities: Vec<f32>,
    /// How sure each row is, 0..=1.
    pub weights: Vec<f32>,
}

/// Labelled rays: what the person said.
pub struct RayTargets {
    /// The rays.
    pub rays: Vec<Ray>,
    /// Index of each ray's class in the head's class list.
    pub classes: Vec<u32>,
}

impl SemanticHead {
    /// A head for these classes; the rows of classes that `earlier` knows are taken over.
    ///
    /// # Errors
    /// None on the CPU.
    pub fn new(classes: &[ClassId], features: usize, earlier: Option<&Self>, seed: u64) -> Result<Self> {
        let mut rng = SmallRng::seed_from_u64(seed ^ 0x4ead);
        let mut layer = |inputs: usize, outputs: usize| -> Vec<f32> {
            let bound = (6.0 / (inputs + outputs) as f32).sqrt();
            (0..inputs * outputs)
                .map(|_| rng.random_range(-bound..bound))
                .collect()
        };
        let count = classes.len();
        let mut hidden = Tensor::from_vec(layer(features, HIDDEN), (features, HIDDEN), &Device::Cpu)?;
        let mut output = layer(HIDDEN, count);
        let mut bias = vec![0.0; count];
        if let Some(earlier) = earlier {
            hidden = earlier.hidden.copy()?;
            let old_output: Vec<Vec<f32>> = earlier.output.to_vec2()?;
            let old_bias: Vec<f32> = earlier.bias.to_vec1()?;
            for (column, class) in classes.iter().enumerate() {
                if let Some(old) = earlier.classes.iter().position(|known| known == class) {
                    bias[column] = old_bias[old];
                    for (row, values) in old_output.iter().enumerate() {
                        output[row * count + column] = values[old];
                    }
                }
            }
        }
        let hidden = Var::from_tensor(&hidden)?;
        let output = Var::from_tensor(&Tensor::from_vec(output, (HIDDEN, count), &Device::Cpu)?)?;
        let bias = Var::from_tensor(&Tensor::from_vec(bias, count, &Device::Cpu)?)?;
        let optimisers = [Adam::new(&hidden), Adam::new(&output), Adam::new(&bias)];
        Ok(Self {
            classes: classes.to_vec(),
            hidden,
            output,
            bias,
            optimisers,
            steps: 0,
        })
    }

    /// The classes, in the order of the logits.
    pub fn classes(&self) -> &[ClassId] {
        &self.classes
    }

    /// Steps since the head was made, those of earlier sessions included.
    pub fn steps(&self) -> u64 {
        self.steps
    }

    /// Trainable parameters.
    pub fn parameters(&self) -> usize {
        [&self.hidden, &self.output, &self.bias]
            .iter()
            .map(|var| var.elem_count())
            .sum()
    }

    fn logits(&self, features: &Tensor) -> Result<Tensor> {
        let hidden = features.matmul(&self.hidden)?.relu()?;
        hidden.matmul(&self.output)?.broadcast_add(&self.bias)
    }

    /// One step: cross-entropy with the soft targets at their places, each weighted by its certainty,
    /// plus cross-entropy of the composited logits with the person's labels (Eq. 4 and 5).
    ///
    /// # Errors
    /// None on the CPU; a step that is not finite changes nothing and returns `false`.
    pub fn step(
        &mut self,
        field: &RadianceField,
        occupancy: &OccupancyGrid,
        soft: &SoftTargets,
        labelled: &RayTargets,
        sampling: Sampling,
    ) -> Result<bool> {
        let count = self.classes.len();
        let mut losses = Vec::new();
        if !soft.positions.is_empty() {
            let n = soft.positions.len();
            let features = features_at(field, &soft.positions)?;
            let log_p = log_softmax(&self.logits(&features)?, 1)?;
            let target = Tensor::from_slice(&soft.probabilities, (n, count), &Device::Cpu)?;
            let weight = Tensor::from_slice(&soft.weights, (n, 1), &Device::Cpu)?;
            let total: f32 = soft.weights.iter().sum();
            let cross = log_p.mul(&target)?.broadcast_mul(&weight)?.sum_all()?;
            losses.push(cross.affine(-1.0 / f64::from(total.max(1e-3)), 0.0)?);
        }
        if !labelled.rays.is_empty() {
            let samples = Samples::along(&labelled.rays, field.volume(), occupancy, sampling);
            if !samples.is_empty() {
                let logits = self.composited(field, samples)?;
                let rows = labelled.rays.len();
                let mut target = vec![0.0_f32; rows * count];
                for (row, &class) in labelled.classes.iter().enumerate() {
                    target[row * count + class as usize] = 1.0;
                }
                let target = Tensor::from_vec(target, (rows, count), &Device::Cpu)?;
                let cross = log_softmax(&logits, 1)?.mul(&target)?.sum_all()?;
                losses.push(cross.affine(-1.0 / rows as f64, 0.0)?);
            }
        }
        self.steps += 1;
        let Some(loss) = losses.into_iter().map(Ok).reduce(|a: Result<Tensor>, b| a? + b?) else {
            return Ok(true);
        };
        let loss = loss?;
        if !loss.to_scalar::<f32>()?.is_finite() {
            return Ok(false);
        }
        let gradients = loss.backward()?;
        for optimiser in &self.optimisers {
            if let Some(gradient) = gradients.get(optimiser.parameter()) {
                optimiser.step(gradient, LEARNING_RATE)?;
            }
        }
        Ok(true)
    }

    /// Class probabilities at world positions, row-major `[positions, classes]`.
    ///
    /// # Errors
    /// None on the CPU.
    pub fn at_points(&self, field: &RadianceField, positions: &[Vec3]) -> Result<Vec<f32>> {
        let mut probabilities = Vec::with_capacity(positions.len() * self.classes.len());
        for positions in positions.chunks(16 * CHUNK) {
            let features = features_at(field, positions)?;
            let p = log_softmax(&self.logits(&features)?, 1)?.exp()?;
            probabilities.extend(p.flatten_all()?.to_vec1::<f32>()?);
        }
        Ok(probabilities)
    }

    /// Class probabilities of rays, row-major `[rays, classes]`: the softmax of the composited logits
    /// (Eq. 4), for any camera. A ray that meets nothing is equally likely to be anything.
    ///
    /// # Errors
    /// None on the CPU.
    pub fn along_rays(
        &self,
        field: &RadianceField,
        occupancy: &OccupancyGrid,
        rays: &[Ray],
        sampling: Sampling,
    ) -> Result<Vec<f32>> {
        let count = self.classes.len();
        let mut probabilities = Vec::with_capacity(rays.len() * count);
        for rays in rays.chunks(CHUNK) {
            let samples = Samples::along(rays, field.volume(), occupancy, sampling);
            if samples.is_empty() {
                probabilities.resize(probabilities.len() + rays.len() * count, 1.0 / count as f32);
                continue;
            }
            let logits = self.composited(field, samples)?;
            probabilities.extend(log_softmax(&logits, 1)?.exp()?.flatten_all()?.to_vec1::<f32>()?);
        }
        Ok(probabilities)
    }

    /// Composited class logits `[rays, classes]` (Eq. 4); differentiable in the head alone.
    fn composited(&self, field: &RadianceField, samples: Samples) -> Result<Tensor> {
        let evaluated = field.evaluate(&samples, FEATURES)?;
        let features = Tensor::from_vec(
            evaluated.features,
            (samples.len(), field.feature_width()),
            &Device::Cpu,
        )?;
        let logits = self.logits(&features)?;
        let packing = &samples.packing;
        let weights: Vec<f32> = (0..packing.rays())
            .flat_map(|ray| packing.weights(ray, &evaluated.density))
            .collect();
        let weights = Tensor::from_vec(weights, (samples.len(), 1), &Device::Cpu)?;
        sum_by_ray(packing, &logits.broadcast_mul(&weights)?)
    }

    /// The parameters by name, for saving.
    ///
    /// # Errors
    /// None on the CPU.
    pub fn state(&self) -> Result<HashMap<String, Tensor>> {
        let ids: Vec<u32> = self.classes.iter().map(|&class| u32::from(class)).collect();
        Ok(HashMap::from([
            ("head.hidden".to_owned(), self.hidden.copy()?),
            ("head.output".to_owned(), self.output.copy()?),
            ("head.bias".to_owned(), self.bias.copy()?),
            ("head.classes".to_owned(), Tensor::new(ids, &Device::Cpu)?),
            (
                "head.steps".to_owned(),
                Tensor::new(&[self.steps as u32], &Device::Cpu)?,
            ),
        ]))
    }

    /// A head from saved parameters; `None` where there is none that fits a field of this feature width.
    pub fn restored(tensors: &HashMap<String, Tensor>, features: usize) -> Option<Self> {
        let [hidden, output, bias, ids] =
            ["head.hidden", "head.output", "head.bias", "head.classes"].map(|name| tensors.get(name));
        let ids: Vec<u32> = ids?.to_vec1().ok()?;
        let steps: Vec<u32> = tensors.get("head.steps")?.to_vec1().ok()?;
        let (hidden, output, bias) = (hidden?, output?, bias?);
        let count = ids.len();
        let fits =
            hidden.dims() == [features, HIDDEN] && output.dims() == [HIDDEN, count] && bias.dims() == [count];
        if !fits {
            return None;
        }
        let [hidden, output, bias] = [hidden, output, bias].map(Var::from_tensor);
        let (hidden, output, bias) = (hidden.ok()?, output.ok()?, bias.ok()?);
        let optimisers = [Adam::new(&hidden), Adam::new(&output), Adam::new(&bias)];
        Some(Self {
            classes: ids.into_iter().map(|id| id as ClassId).collect(),
            hidden,
            output,
            bias,
            optimisers,
            steps: u64::from(*steps.first()?),
        })
    }
}

/// The field's features at world positions, `[N, feature_width]`.
fn features_at(field: &RadianceField, positions: &[Vec3]) -> Result<Tensor> {
    let unit: Vec<Vec3> = positions
        .iter()
        .map(|&position| field.volume().to_unit(position))
        .collect();
    let evaluated = field.evaluate(&Samples::at_points(&unit), FEATURES)?;
    Tensor::from_vec(
        evaluated.features,
        (positions.len(), field.feature_width()),
        &Device::Cpu,
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn classes_keep_their_weights_when_the_list_changes() {
        let first = SemanticHead::new(&[3, 5], 8, None, 1).unwrap();
        let second = SemanticHead::new(&[5, 9, 3], 8, Some(&first), 2).unwrap();
        let (old, new) = (
            first.output.to_vec2::<f32>().unwrap(),
            second.output.to_vec2::<f32>().unwrap(),
        );
        for (old, new) in old.iter().zip(&new) {
            assert_eq!((old[0], old[1]), (new[2], new[0]));
        }
    }

    #[test]
    fn a_saved_head_comes_back_and_a_foreign_one_does_not() {
        let head = SemanticHead::new(&[3, 5], 8, None, 1).unwrap();
        let state = head.state().unwrap();
        let back = SemanticHead::restored(&state, 8).unwrap();
        assert_eq!(back.classes(), [3, 5]);
        assert_eq!(
            back.hidden.to_vec2::<f32>().unwrap(),
            head.hidden.to_vec2::<f32>().unwrap()
        );
        assert!(SemanticHead::restored(&state, 9).is_none());
    }
}
