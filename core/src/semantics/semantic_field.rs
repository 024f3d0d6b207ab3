//! The semantic field: class logits by the radiance field's features and a grid of its own, trained continuously.

mod network;

use std::collections::HashMap;
use std::ops::Range;

use candle_core::{DType, Device, Result, Tensor, Var};
use candle_nn::ops::log_softmax;
use glam::Vec3;
use rand::{Rng, SeedableRng, rngs::SmallRng};
use rayon::prelude::*;

use self::network::{HIDDEN, Network, fitting};
use super::places::CompositedPlaces;
use super::{RayTargets, SoftTargets};
use crate::field::kernels::{Adam, Dispatch, Wanted, encode};
use crate::field::{GridShape, OccupancyGrid, RadianceField, Ray, Samples, Sampling};
use crate::labels::ClassId;

/// Learning rates of the networks and of the grid.
const NETWORK_RATE: f32 = 0.005;
const GRID_RATE: f32 = 0.02;
const FEATURES: Wanted = Wanted {
    color: false,
    features: true,
};
/// Rays and points evaluated at a time.
const RAYS: usize = 4096;
const POINTS: usize = 16 * 1024;
/// Numbers of a tensor from which candle shares it among threads of its own, which spin while they wait and slow down a
/// busy machine several times.
const SHARED: usize = 65_536;

/// The parts of a semantic field.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SemanticPart {
    /// What things look like: a network on the field's features alone, which knows places without labels, too.
    Appearance,
    /// What is where: a network that sees a hash grid of its own beside the features, and adds to the logits of the
    /// appearance. With it, the field can represent any labelling of the scene.
    Residual,
}

/// Logits of every class at any point of the scene, and composited along any ray. Labels never disturb the geometry: the
/// features of the radiance field are detached.
#[derive(Debug)]
pub struct SemanticField {
    classes: Vec<ClassId>,
    appearance: Network,
    residual: Network,
    grid: SemanticGrid,
}

/// A hash grid that belongs to the semantic field.
#[derive(Debug)]
struct SemanticGrid {
    shape: GridShape,
    /// `[rows, 2]`.
    table: Var,
    optimiser: Adam,
}

impl SemanticGrid {
    fn new(shape: GridShape, table: &Tensor) -> Result<Self> {
        let table = Var::from_tensor(table)?;
        let optimiser = Adam::new(&table);
        Ok(Self {
            shape,
            table,
            optimiser,
        })
    }
}

/// Inputs of the networks at some points.
struct Inputs {
    /// The field's features `[N, width]`.
    features: Vec<f32>,
    width: usize,
    /// Features of the semantic grid `[N, own width]`, where they are asked for: differentiable in its table, and as
    /// plain numbers.
    grid: Option<(Tensor, Vec<f32>)>,
}

/// Loss of a piece, and its gradients with respect to a network and to the grid's features `[n, own width]`.
struct PartialLoss {
    loss: f32,
    network: [Option<Tensor>; 3],
    grid: Vec<f32>,
}

impl SemanticField {
    /// A semantic field for these classes on this many features of the radiance field, with a grid of this shape. From
    /// `earlier`, one of the same shape, it takes over the grid and what it knows of shared classes.
    ///
    /// # Errors
    /// None on the CPU.
    pub fn new(
        classes: &[ClassId],
        features: usize,
        shape: GridShape,
        earlier: Option<&Self>,
        seed: u64,
    ) -> Result<Self> {
        let mut rng = SmallRng::seed_from_u64(seed ^ 0x4ead);
        let known = |class| earlier?.classes.iter().position(|known| known == class);
        let known: Vec<Option<usize>> = classes.iter().map(known).collect();
        let mut network =
            |inputs, scale, earlier| Network::new((inputs, classes.len()), scale, earlier, &known, &mut rng);
        let appearance = network(features, 1.0, earlier.map(|earlier| &earlier.appearance))?;
        // At first the residual adds nothing.
        let inputs = features + shape.features();
        let residual = network(inputs, 0.0, earlier.map(|earlier| &earlier.residual))?;
        let table = match earlier {
            Some(earlier) => earlier.grid.table.copy()?,
            None => {
                let values = (0..2 * shape.rows()).map(|_| rng.random_range(-1e-2..1e-2_f32));
                Tensor::from_vec(values.collect(), (shape.rows(), 2), &Device::Cpu)?
            }
        };
        Ok(Self {
            classes: classes.to_vec(),
            appearance,
            residual,
            grid: SemanticGrid::new(shape, &table)?,
        })
    }

    /// The classes, in the order of the logits.
    pub fn classes(&self) -> &[ClassId] {
        &self.classes
    }

    /// Training steps of a part since the field was made, those of earlier sessions included.
    pub fn steps(&self, part: SemanticPart) -> u64 {
        self.network(part).steps
    }

    fn network(&self, part: SemanticPart) -> &Network {
        match part {
            SemanticPart::Appearance => &self.appearance,
            SemanticPart::Residual => &self.residual,
        }
    }

    /// Trainable parameters.
    pub fn parameters(&self) -> usize {
        let networks = [&self.appearance, &self.residual].map(|network| &network.parameters);
        let all = networks.into_iter().flatten().chain([&self.grid.table]);
        all.map(|var| var.elem_count()).sum()
    }

    /// One step of a part: cross-entropy with the soft targets at their points, plus that of the composited logits with
    /// the targets of rays (Eq. 4 and 5); each row is weighted by its certainty. The appearance learns as if it was
    /// alone, the residual what the appearance leaves.
    ///
    /// # Errors
    /// None on the CPU; a step that is not finite changes nothing.
    pub fn step(
        &mut self,
        part: SemanticPart,
        (field, occupancy): (&RadianceField, &OccupancyGrid),
        soft: &SoftTargets,
        along: &RayTargets,
        sampling: Sampling,
    ) -> Result<()> {
        match part {
            SemanticPart::Appearance => self.appearance.steps += 1,
            SemanticPart::Residual => self.residual.steps += 1,
        }
        let mut places = CompositedPlaces::at_points(field, &soft.positions);
        places.add_rays(field, occupancy, &along.rays, sampling)?;
        if places.positions.is_empty() {
            return Ok(());
        }
        let mut weights = Vec::with_capacity(places.rows());
        for own in [&soft.weights, &along.weights] {
            let total: f32 = own.iter().sum();
            weights.extend(own.iter().map(|weight| weight / total.max(1e-3)));
        }
        let targets = [&soft.probabilities[..], &along.probabilities[..]].concat();
        let inputs = self.inputs(part, field, &places)?;
        let parts: Vec<PartialLoss> = places
            .pieces(self.piece())
            .into_par_iter()
            .map(|rows| self.loss(part, &places, &inputs, &targets, &weights, rows))
            .collect::<Result<_>>()?;
        if !parts.iter().map(|part| part.loss).sum::<f32>().is_finite() {
            return Ok(());
        }
        for (index, optimiser) in self.network(part).optimisers.iter().enumerate() {
            let own = parts.iter().filter_map(|part| part.network[index].clone());
            if let Some(gradient) = own.map(Ok).reduce(|a: Result<Tensor>, b| a? + b?) {
                optimiser.step(&gradient?, NETWORK_RATE)?;
            }
        }
        if let Some((encoded, _)) = &inputs.grid {
            let gradient: Vec<f32> = parts.into_iter().flat_map(|part| part.grid).collect();
            // The loss of (features * gradient) passes the features' gradient on to the table.
            let arrived = Tensor::from_vec(gradient, encoded.shape(), &Device::Cpu)?;
            let gradients = encoded.mul(&arrived)?.sum_all()?.backward()?;
            if let Some(gradient) = gradients.get(&self.grid.table) {
                self.grid.optimiser.step(gradient, GRID_RATE)?;
            }
        }
        Ok(())
    }

    /// Class probabilities at world positions, row-major `[positions, classes]`: by the appearance alone, or by the
    /// whole field with the residual.
    ///
    /// # Errors
    /// None on the CPU.
    pub fn at_points(
        &self,
        part: SemanticPart,
        field: &RadianceField,
        positions: &[Vec3],
    ) -> Result<Vec<f32>> {
        let mut probabilities = Vec::with_capacity(positions.len() * self.classes.len());
        for positions in positions.chunks(POINTS) {
            let places = CompositedPlaces::at_points(field, positions);
            self.add_probabilities(part, field, &places, &mut probabilities)?;
        }
        Ok(probabilities)
    }

    /// Class probabilities of rays by the whole field, row-major `[rays, classes]`: the softmax of the composited logits
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
            self.add_probabilities(SemanticPart::Residual, field, &places, &mut probabilities)?;
        }
        Ok(probabilities)
    }

    /// Appends the class probabilities of all rows.
    fn add_probabilities(
        &self,
        part: SemanticPart,
        field: &RadianceField,
        places: &CompositedPlaces,
        probabilities: &mut Vec<f32>,
    ) -> Result<()> {
        let inputs = self.inputs(part, field, places)?;
        let parts: Vec<Vec<f32>> = places
            .pieces(self.piece())
            .into_par_iter()
            .map(|rows| {
                let (logits, _) = self.composited(places, &inputs, &rows)?;
                log_softmax(&logits, 1)?.exp()?.flatten_all()?.to_vec1()
            })
            .collect::<Result<_>>()?;
        probabilities.extend(parts.into_iter().flatten());
        Ok(())
    }

    /// Samples of a piece, which one thread works on.
    fn piece(&self) -> usize {
        (SHARED / HIDDEN.max(self.classes.len()) - 1).max(1)
    }

    /// What the networks up to this one see.
    fn inputs(&self, part: SemanticPart, field: &RadianceField, places: &CompositedPlaces) -> Result<Inputs> {
        let samples = Samples::at_points(&places.positions);
        let grid = match part {
            SemanticPart::Appearance => None,
            SemanticPart::Residual => {
                let (shape, table) = (&self.grid.shape, &self.grid.table);
                let encoded = encode(shape, table, samples.positions(), Dispatch::detect())?;
                let values = encoded.flatten_all()?.to_vec1()?;
                Some((encoded, values))
            }
        };
        Ok(Inputs {
            features: field.evaluate(&samples, FEATURES)?.features,
            width: field.feature_width(),
            grid,
        })
    }

    /// Loss of some rows, and its gradients in this part.
    fn loss(
        &self,
        part: SemanticPart,
        places: &CompositedPlaces,
        inputs: &Inputs,
        targets: &[f32],
        weights: &[f32],
        rows: Range<usize>,
    ) -> Result<PartialLoss> {
        let count = self.classes.len();
        let (logits, grid) = self.composited(places, inputs, &rows)?;
        let target = &targets[rows.start * count..rows.end * count];
        let target = Tensor::from_slice(target, (rows.len(), count), &Device::Cpu)?;
        let weight = Tensor::from_slice(&weights[rows.clone()], (rows.len(), 1), &Device::Cpu)?;
        let cross = log_softmax(&logits, 1)?.mul(&target)?.broadcast_mul(&weight)?;
        let loss = cross.sum_all()?.neg()?;
        let gradients = loss.backward()?;
        let grid = match grid.and_then(|grid| gradients.get(&grid).cloned()) {
            Some(gradient) => gradient.flatten_all()?.to_vec1()?,
            None => Vec::new(),
        };
        let parameters = self.network(part).parameters.each_ref();
        Ok(PartialLoss {
            loss: loss.to_scalar()?,
            network: parameters.map(|var| gradients.get(var).cloned()),
            grid,
        })
    }

    /// Composited class logits `[rows, classes]` of some rows (Eq. 4). Without features of the grid they are those of the
    /// appearance, differentiable in its network; with them those of the whole field, differentiable in the residual's
    /// network and in the grid's features, which are returned too.
    fn composited(
        &self,
        places: &CompositedPlaces,
        inputs: &Inputs,
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
        let features = of_samples(&inputs.features, inputs.width)?;
        let mut logits = self.appearance.logits(&features)?;
        let mut grid = None;
        if let Some((encoded, values)) = &inputs.grid {
            let var = Var::from_tensor(&of_samples(values, encoded.dim(1)?)?)?;
            let both = Tensor::cat(&[&features, var.as_tensor()], 1)?;
            logits = (logits.detach() + self.residual.logits(&both)?)?;
            grid = Some(var);
        }
        let shared = logits.broadcast_mul(&of_samples(&places.shares, 1)?)?;
        let row = Tensor::from_vec(places.row_of_samples(rows), samples.len(), &Device::Cpu)?;
        Ok((sums.index_add(&row, &shared, 0)?, grid))
    }

    /// The parameters by name, for saving.
    ///
    /// # Errors
    /// None on the CPU.
    pub fn state(&self) -> Result<HashMap<String, Tensor>> {
        let ids: Vec<u32> = self.classes.iter().map(|&class| u32::from(class)).collect();
        let mut tensors = HashMap::from([
            ("semantics.classes".to_owned(), Tensor::new(ids, &Device::Cpu)?),
            ("semantics.table".to_owned(), self.grid.table.copy()?),
        ]);
        for (name, network) in [("appearance", &self.appearance), ("residual", &self.residual)] {
            for (part, tensor) in network.state()? {
                tensors.insert(format!("semantics.{name}.{part}"), tensor);
            }
        }
        Ok(tensors)
    }

    /// A semantic field from saved parameters; `None` where there is none that fits a radiance field of this feature
    /// width and a grid of this shape.
    pub fn restored(tensors: &HashMap<String, Tensor>, features: usize, shape: GridShape) -> Option<Self> {
        let saved = |name: &str| tensors.get(&format!("semantics.{name}"));
        let ids: Vec<u32> = saved("classes")?.to_vec1().ok()?;
        let classes = ids.into_iter().map(|id| ClassId::try_from(id).ok());
        let classes: Vec<ClassId> = classes.collect::<Option<_>>()?;
        let network = |name: &str, inputs: usize| {
            let saved = |part: &str| saved(&format!("{name}.{part}"));
            Network::restored(saved, (inputs, classes.len()))
        };
        let appearance = network("appearance", features)?;
        let residual = network("residual", features + shape.features())?;
        let table = fitting(saved("table")?, &[shape.rows(), 2])?.copy().ok()?;
        (!classes.is_empty()).then_some(Self {
            classes,
            appearance,
            residual,
            grid: SemanticGrid::new(shape, &table).ok()?,
        })
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
        let first = SemanticField::new(&[3, 5], 8, grid(), None, 1).unwrap();
        let second = SemanticField::new(&[5, 9, 3], 8, grid(), Some(&first), 2).unwrap();
        let output = |field: &SemanticField| field.appearance.parameters[1].to_vec2::<f32>().unwrap();
        for (old, new) in output(&first).iter().zip(output(&second)) {
            assert_eq!((old[0], old[1]), (new[2], new[0]));
        }
        let table = |field: &SemanticField| field.grid.table.to_vec2::<f32>().unwrap();
        assert_eq!(table(&first), table(&second));
    }

    #[test]
    fn a_saved_field_comes_back_and_a_foreign_one_does_not() {
        let field = SemanticField::new(&[3, 5], 8, grid(), None, 1).unwrap();
        let state = field.state().unwrap();
        let back = SemanticField::restored(&state, 8, grid()).unwrap();
        assert_eq!(back.classes(), [3, 5]);
        let hidden = |field: &SemanticField| field.residual.parameters[0].to_vec2::<f32>().unwrap();
        assert_eq!(hidden(&back), hidden(&field));
        let larger = GridShape::new(3, 4, 16, 10);
        for (features, shape) in [(9, grid()), (8, larger)] {
            assert!(SemanticField::restored(&state, features, shape).is_none());
        }
        let double = |name: &str| state[name].to_dtype(DType::F64).unwrap();
        let ids = |ids: &[u32]| Tensor::new(ids, &Device::Cpu).unwrap();
        for (name, spoilt) in [
            ("semantics.appearance.bias", double("semantics.appearance.bias")),
            ("semantics.table", double("semantics.table")),
            ("semantics.classes", ids(&[3, 65_536])),
            ("semantics.classes", ids(&[3])),
        ] {
            let mut state = state.clone();
            state.insert(name.to_owned(), spoilt);
            assert!(SemanticField::restored(&state, 8, grid()).is_none(), "{name}");
        }
    }
}
