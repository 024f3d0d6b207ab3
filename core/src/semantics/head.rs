//! The semantic head: class logits from the field's features and a grid of its own, trained continuously.

use std::collections::HashMap;
use std::ops::Range;

use candle_core::{DType, Device, Result, Tensor, Var};
use candle_nn::ops::log_softmax;
use glam::Vec3;
use rand::{Rng, SeedableRng, rngs::SmallRng};
use rayon::prelude::*;

use super::places::CompositedPlaces;
use super::{RayTargets, SoftTargets};
use crate::field::kernels::{Adam, Dispatch, Wanted, encode};
use crate::field::{GridShape, OccupancyGrid, RadianceField, Ray, Samples, Sampling};
use crate::labels::ClassId;

/// Width of the hidden layer.
const HIDDEN: usize = 64;
/// Learning rates of the network and of the own grid.
const NETWORK_RATE: f32 = 0.005;
const GRID_RATE: f32 = 0.02;
const FEATURES: Wanted = Wanted {
    color: false,
    features: true,
};
/// Rays and points evaluated at a time.
const RAYS: usize = 4096;
const POINTS: usize = 16 * 1024;
/// Samples of a piece, which one thread works on: candle shares tensors of 65,536 numbers and more among
/// threads of its own, which spin while they wait and slow down a busy machine several times.
const PIECE: usize = 65_536 / HIDDEN - 1;

/// Logits of every class at any point of the field: a network with one hidden layer. Its inputs are the field's
/// features, detached so that labels never disturb the geometry, and those of a hash grid of its own where it has one.
///
/// With a grid of its own, the head can represent any labelling of the scene: it is a semantic field. Without one it
/// knows only what things look like, which makes it a prior for labels elsewhere.
#[derive(Debug)]
pub struct SemanticHead {
    classes: Vec<ClassId>,
    own: Option<OwnGrid>,
    hidden: Var,
    output: Var,
    bias: Var,
    optimisers: [Adam; 3],
    steps: u64,
}

/// A hash grid that belongs to a head.
#[derive(Debug)]
struct OwnGrid {
    shape: GridShape,
    /// `[rows, 2]`.
    table: Var,
    optimiser: Adam,
}

impl OwnGrid {
    fn new(shape: GridShape, table: Tensor) -> Result<Self> {
        let table = Var::from_tensor(&table)?;
        let optimiser = Adam::new(&table);
        Ok(Self {
            shape,
            table,
            optimiser,
        })
    }
}

/// Inputs of the network at some points.
struct HeadInputs {
    /// The field's features `[N, width]`.
    features: Vec<f32>,
    width: usize,
    /// Features of its own grid `[N, own width]`: differentiable in its table, and as plain numbers.
    own: Option<(Tensor, Vec<f32>)>,
}

/// Loss of a piece, and its gradients with respect to the network and to the own features `[n, own width]`.
struct PartialLoss {
    loss: f32,
    network: [Option<Tensor>; 3],
    own: Vec<f32>,
}

impl SemanticHead {
    /// A head for these classes on this many features of the field, with a grid of its own of the shape `own`. From
    /// `earlier`, a head of the same shape, it takes over the grid, the hidden layer and the rows of shared classes.
    ///
    /// # Errors
    /// None on the CPU.
    pub fn new(
        classes: &[ClassId],
        features: usize,
        own: Option<GridShape>,
        earlier: Option<&Self>,
        seed: u64,
    ) -> Result<Self> {
        let mut rng = SmallRng::seed_from_u64(seed ^ 0x4ead);
        let features = features + own.as_ref().map_or(0, GridShape::features);
        let own = match (own, earlier.and_then(|earlier| earlier.own.as_ref())) {
            (None, _) => None,
            (Some(shape), Some(earlier)) => Some(OwnGrid::new(shape, earlier.table.copy()?)?),
            (Some(shape), None) => {
                let values: Vec<f32> = (0..2 * shape.rows())
                    .map(|_| rng.random_range(-1e-2..1e-2))
                    .collect();
                let table = Tensor::from_vec(values, (shape.rows(), 2), &Device::Cpu)?;
                Some(OwnGrid::new(shape, table)?)
            }
        };
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
        let output = Tensor::from_vec(output, (HIDDEN, count), &Device::Cpu)?;
        let bias = Tensor::from_vec(bias, count, &Device::Cpu)?;
        Self::of(classes.to_vec(), own, [&hidden, &output, &bias], 0)
    }

    /// A head of these parameters: the hidden layer, the output layer and its bias.
    fn of(classes: Vec<ClassId>, own: Option<OwnGrid>, network: [&Tensor; 3], steps: u64) -> Result<Self> {
        let [hidden, output, bias] = network.map(Var::from_tensor);
        let (hidden, output, bias) = (hidden?, output?, bias?);
        let optimisers = [Adam::new(&hidden), Adam::new(&output), Adam::new(&bias)];
        Ok(Self {
            classes,
            own,
            hidden,
            output,
            bias,
            optimisers,
            steps,
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
        let own = self.own.as_ref().map(|own| &own.table);
        [&self.hidden, &self.output, &self.bias]
            .into_iter()
            .chain(own)
            .map(|var| var.elem_count())
            .sum()
    }

    /// One step: cross-entropy with the soft targets at their points, plus that of the composited logits
    /// with the targets of rays (Eq. 4 and 5); each row is weighted by its certainty.
    ///
    /// # Errors
    /// None on the CPU; a step that is not finite changes nothing and returns `false`.
    pub fn step(
        &mut self,
        field: &RadianceField,
        occupancy: &OccupancyGrid,
        soft: &SoftTargets,
        along: &RayTargets,
        sampling: Sampling,
    ) -> Result<bool> {
        self.steps += 1;
        let mut places = CompositedPlaces::at_points(field, &soft.positions);
        places.add_rays(field, occupancy, &along.rays, sampling)?;
        if places.positions.is_empty() {
            return Ok(true);
        }
        let mut weights = Vec::with_capacity(places.rows());
        for own in [&soft.weights, &along.weights] {
            let total: f32 = own.iter().sum();
            weights.extend(own.iter().map(|weight| weight / total.max(1e-3)));
        }
        let targets = [&soft.probabilities[..], &along.probabilities[..]].concat();
        let inputs = self.inputs(field, &places)?;
        let parts: Vec<PartialLoss> = places
            .pieces(PIECE)
            .into_par_iter()
            .map(|rows| self.part(&places, &inputs, &targets, &weights, rows))
            .collect::<Result<_>>()?;
        if !parts.iter().map(|part| part.loss).sum::<f32>().is_finite() {
            return Ok(false);
        }
        for (index, optimiser) in self.optimisers.iter().enumerate() {
            let own = parts.iter().filter_map(|part| part.network[index].clone());
            if let Some(gradient) = own.map(Ok).reduce(|a: Result<Tensor>, b| a? + b?) {
                optimiser.step(&gradient?, NETWORK_RATE)?;
            }
        }
        if let (Some(own), Some((encoded, _))) = (&self.own, &inputs.own) {
            let gradient: Vec<f32> = parts.into_iter().flat_map(|part| part.own).collect();
            // The loss of (features * gradient) passes the features' gradient on to the table.
            let arrived = Tensor::from_vec(gradient, encoded.shape(), &Device::Cpu)?;
            let gradients = encoded.mul(&arrived)?.sum_all()?.backward()?;
            if let Some(gradient) = gradients.get(&own.table) {
                own.optimiser.step(gradient, GRID_RATE)?;
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
        for positions in positions.chunks(POINTS) {
            let places = CompositedPlaces::at_points(field, positions);
            self.add_probabilities(field, &places, &mut probabilities)?;
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
        let mut probabilities = Vec::with_capacity(rays.len() * self.classes.len());
        for rays in rays.chunks(RAYS) {
            let mut places = CompositedPlaces::at_points(field, &[]);
            places.add_rays(field, occupancy, rays, sampling)?;
            self.add_probabilities(field, &places, &mut probabilities)?;
        }
        Ok(probabilities)
    }

    /// Appends the class probabilities of all rows.
    fn add_probabilities(
        &self,
        field: &RadianceField,
        places: &CompositedPlaces,
        probabilities: &mut Vec<f32>,
    ) -> Result<()> {
        let inputs = self.inputs(field, places)?;
        let parts: Vec<Vec<f32>> = places
            .pieces(PIECE)
            .into_par_iter()
            .map(|rows| {
                let (logits, _) = self.composited(places, &inputs, &rows)?;
                log_softmax(&logits, 1)?.exp()?.flatten_all()?.to_vec1()
            })
            .collect::<Result<_>>()?;
        probabilities.extend(parts.into_iter().flatten());
        Ok(())
    }

    fn inputs(&self, field: &RadianceField, places: &CompositedPlaces) -> Result<HeadInputs> {
        let samples = Samples::at_points(&places.positions);
        let own = match &self.own {
            None => None,
            Some(own) => {
                let encoded = encode(&own.shape, &own.table, samples.positions(), Dispatch::detect())?;
                let values = encoded.flatten_all()?.to_vec1()?;
                Some((encoded, values))
            }
        };
        Ok(HeadInputs {
            features: field.evaluate(&samples, FEATURES)?.features,
            width: field.feature_width(),
            own,
        })
    }

    /// Loss and gradients of some rows.
    fn part(
        &self,
        places: &CompositedPlaces,
        inputs: &HeadInputs,
        targets: &[f32],
        weights: &[f32],
        rows: Range<usize>,
    ) -> Result<PartialLoss> {
        let count = self.classes.len();
        let (logits, own) = self.composited(places, inputs, &rows)?;
        let target = &targets[rows.start * count..rows.end * count];
        let target = Tensor::from_slice(target, (rows.len(), count), &Device::Cpu)?;
        let weight = Tensor::from_slice(&weights[rows.clone()], (rows.len(), 1), &Device::Cpu)?;
        let cross = log_softmax(&logits, 1)?.mul(&target)?.broadcast_mul(&weight)?;
        let loss = cross.sum_all()?.neg()?;
        let gradients = loss.backward()?;
        let own = match own.and_then(|own| gradients.get(&own).cloned()) {
            Some(gradient) => gradient.flatten_all()?.to_vec1()?,
            None => Vec::new(),
        };
        Ok(PartialLoss {
            loss: loss.to_scalar()?,
            network: [&self.hidden, &self.output, &self.bias].map(|var| gradients.get(var).cloned()),
            own,
        })
    }

    /// Composited class logits `[rows, classes]` of some rows (Eq. 4), differentiable in the network and
    /// in the features of the own grid that come with them.
    fn composited(
        &self,
        places: &CompositedPlaces,
        inputs: &HeadInputs,
        rows: &Range<usize>,
    ) -> Result<(Tensor, Option<Var>)> {
        let samples = places.samples(rows);
        let sums = Tensor::zeros((rows.len(), self.classes.len()), DType::F32, &Device::Cpu)?;
        if samples.is_empty() {
            return Ok((sums, None));
        }
        let of_samples = |values: &[f32], width: usize| {
            let own = &values[samples.start * width..samples.end * width];
            Tensor::from_slice(own, (samples.len(), width), &Device::Cpu)
        };
        let mut features = of_samples(&inputs.features, inputs.width)?;
        let mut own = None;
        if let Some((encoded, values)) = &inputs.own {
            let var = Var::from_tensor(&of_samples(values, encoded.dim(1)?)?)?;
            features = Tensor::cat(&[&features, var.as_tensor()], 1)?;
            own = Some(var);
        }
        let hidden = features.matmul(&self.hidden)?.relu()?;
        let logits = hidden.matmul(&self.output)?.broadcast_add(&self.bias)?;
        let shared = logits.broadcast_mul(&of_samples(&places.shares, 1)?)?;
        let row = Tensor::from_vec(places.row_of_samples(rows), samples.len(), &Device::Cpu)?;
        Ok((sums.index_add(&row, &shared, 0)?, own))
    }

    /// The parameters by name, for saving; the names begin with `name`.
    ///
    /// # Errors
    /// None on the CPU.
    pub fn state(&self, name: &str) -> Result<HashMap<String, Tensor>> {
        let ids: Vec<u32> = self.classes.iter().map(|&class| u32::from(class)).collect();
        let mut tensors = HashMap::from([
            (format!("{name}.hidden"), self.hidden.copy()?),
            (format!("{name}.output"), self.output.copy()?),
            (format!("{name}.bias"), self.bias.copy()?),
            (format!("{name}.classes"), Tensor::new(ids, &Device::Cpu)?),
            (
                format!("{name}.steps"),
                Tensor::new(&[self.steps as u32], &Device::Cpu)?,
            ),
        ]);
        if let Some(own) = &self.own {
            tensors.insert(format!("{name}.table"), own.table.copy()?);
        }
        Ok(tensors)
    }

    /// A head from saved parameters whose names begin with `name`; `None` where there is none that fits a
    /// field of this feature width and a grid of this shape.
    pub fn restored(
        name: &str,
        tensors: &HashMap<String, Tensor>,
        features: usize,
        own: Option<GridShape>,
    ) -> Option<Self> {
        let saved = |part: &str| tensors.get(&format!("{name}.{part}"));
        let [hidden, output, bias, ids] = ["hidden", "output", "bias", "classes"].map(saved);
        let ids: Vec<u32> = ids?.to_vec1().ok()?;
        let steps: Vec<u32> = saved("steps")?.to_vec1().ok()?;
        let (hidden, output, bias) = (hidden?, output?, bias?);
        let count = ids.len();
        let features = features + own.as_ref().map_or(0, GridShape::features);
        let fits =
            hidden.dims() == [features, HIDDEN] && output.dims() == [HIDDEN, count] && bias.dims() == [count];
        let are_numbers = [hidden, output, bias].map(|part| part.dtype() == DType::F32);
        if !fits || count == 0 || are_numbers.contains(&false) {
            return None;
        }
        let own = match own {
            None => None,
            Some(shape) => {
                let table = saved("table")
                    .filter(|table| table.dims() == [shape.rows(), 2] && table.dtype() == DType::F32)?;
                Some(OwnGrid::new(shape, table.copy().ok()?).ok()?)
            }
        };
        let classes = ids.into_iter().map(|id| ClassId::try_from(id).ok());
        let steps = u64::from(*steps.first()?);
        Self::of(
            classes.collect::<Option<_>>()?,
            own,
            [hidden, output, bias],
            steps,
        )
        .ok()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid() -> GridShape {
        GridShape::new(3, 4, 16, 8)
    }

    #[test]
    fn classes_keep_their_weights_when_the_list_changes() {
        let first = SemanticHead::new(&[3, 5], 8, Some(grid()), None, 1).unwrap();
        let second = SemanticHead::new(&[5, 9, 3], 8, Some(grid()), Some(&first), 2).unwrap();
        let (old, new) = (
            first.output.to_vec2::<f32>().unwrap(),
            second.output.to_vec2::<f32>().unwrap(),
        );
        for (old, new) in old.iter().zip(&new) {
            assert_eq!((old[0], old[1]), (new[2], new[0]));
        }
        let table = |head: &SemanticHead| head.own.as_ref().unwrap().table.to_vec2::<f32>().unwrap();
        assert_eq!(table(&first), table(&second));
    }

    #[test]
    fn a_saved_head_comes_back_and_a_foreign_one_does_not() {
        let head = SemanticHead::new(&[3, 5], 8, Some(grid()), None, 1).unwrap();
        let state = head.state("semantics").unwrap();
        let back = SemanticHead::restored("semantics", &state, 8, Some(grid())).unwrap();
        assert_eq!(back.classes(), [3, 5]);
        assert_eq!(
            back.hidden.to_vec2::<f32>().unwrap(),
            head.hidden.to_vec2::<f32>().unwrap()
        );
        let larger = GridShape::new(3, 4, 16, 10);
        for (name, features, own) in [
            ("semantics", 9, Some(grid())),
            ("semantics", 8, None),
            ("semantics", 8, Some(larger)),
            ("other", 8, Some(grid())),
        ] {
            assert!(SemanticHead::restored(name, &state, features, own).is_none());
        }
        let double = |name: &str| state[name].to_dtype(DType::F64).unwrap();
        for (name, spoilt) in [
            ("semantics.bias", double("semantics.bias")),
            ("semantics.table", double("semantics.table")),
            (
                "semantics.classes",
                Tensor::new(&[3_u32, 65_536], &Device::Cpu).unwrap(),
            ),
            ("semantics.classes", Tensor::new(&[3_u32], &Device::Cpu).unwrap()),
        ] {
            let mut state = state.clone();
            state.insert(name.to_owned(), spoilt);
            assert!(
                SemanticHead::restored("semantics", &state, 8, Some(grid())).is_none(),
                "{name}"
            );
        }
    }
}
