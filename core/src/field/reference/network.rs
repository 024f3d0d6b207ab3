//! The network: a trunk on positions, and branches for density, classes and colour.

use candle_core::{Device, Result, Tensor, Var};
use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::ReferenceSettings;

/// Output of the network for `N` samples.
pub struct Prediction {
    /// Colour `[N, 3]`, 0..=1.
    pub color: Tensor,
    /// Density before its ReLU `[N]`, per metre.
    pub raw_density: Tensor,
    /// Class logits `[N, classes]`; `None` when the network has no classes.
    pub logits: Option<Tensor>,
}

/// The network F of Eq. 3: (x, d) to density, logits and colour. Density and logits do not see d.
#[derive(Debug)]
pub struct ReferenceNetwork {
    skip: usize,
    trunk: Vec<AffineLayer>,
    density: AffineLayer,
    feature: AffineLayer,
    view: AffineLayer,
    color: AffineLayer,
    semantic: Option<[AffineLayer; 2]>,
}

impl ReferenceNetwork {
    /// A network with random weights, for any number of classes; with none it has no semantic branch.
    ///
    /// # Errors
    /// A lack of memory on the device.
    pub fn new(settings: &ReferenceSettings, classes: usize, device: &Device, seed: u64) -> Result<Self> {
        let mut rng = SmallRng::seed_from_u64(seed);
        let mut layer = |inputs: usize, outputs: usize| AffineLayer::new(inputs, outputs, device, &mut rng);
        let position = 3 + 6 * settings.position_frequencies;
        let direction = 3 + 6 * settings.direction_frequencies;
        let (width, half) = (settings.width, settings.width / 2);
        let trunk = (0..settings.layers).map(|number| match number {
            0 => layer(position, width),
            _ if number == settings.skip + 1 => layer(position + width, width),
            _ => layer(width, width),
        });
        let trunk = trunk.collect::<Result<Vec<_>>>()?;
        Ok(Self {
            skip: settings.skip,
            trunk,
            density: layer(width, 1)?,
            feature: layer(width, width)?,
            view: layer(width + direction, half)?,
            color: layer(half, 3)?,
            semantic: match classes {
                0 => None,
                _ => Some([layer(width, half)?, layer(half, classes)?]),
            },
        })
    }

    /// From encoded positions `[N, 3 + 6 position frequencies]` and directions
    /// `[N, 3 + 6 direction frequencies]`; unless it is `differentiable`, without what a gradient would need.
    ///
    /// # Errors
    /// Inputs of other shapes.
    pub fn forward(
        &self,
        positions: &Tensor,
        directions: &Tensor,
        differentiable: bool,
    ) -> Result<Prediction> {
        let apply = |layer: &AffineLayer, input: &Tensor| layer.forward(input, differentiable);
        let mut hidden = positions.clone();
        for (number, layer) in self.trunk.iter().enumerate() {
            hidden = apply(layer, &hidden)?.relu()?;
            if number == self.skip {
                hidden = Tensor::cat(&[positions, &hidden], 1)?;
            }
        }
        let logits = match &self.semantic {
            Some([first, second]) => Some(apply(second, &apply(first, &hidden)?.relu()?)?),
            None => None,
        };
        let seen = Tensor::cat(&[&apply(&self.feature, &hidden)?, directions], 1)?;
        let seen = apply(&self.view, &seen)?.relu()?;
        Ok(Prediction {
            color: candle_nn::ops::sigmoid(&apply(&self.color, &seen)?)?,
            raw_density: apply(&self.density, &hidden)?.squeeze(1)?,
            logits,
        })
    }

    /// The parameters with their names.
    pub fn named(&self) -> Vec<(String, &Var)> {
        let trunk = self.trunk.iter().enumerate();
        let branches = [
            ("density", &self.density),
            ("feature", &self.feature),
            ("view", &self.view),
            ("color", &self.color),
        ];
        let semantic = self.semantic.iter().flatten().enumerate();
        trunk
            .map(|(number, layer)| (format!("trunk.{number}"), layer))
            .chain(branches.map(|(name, layer)| (name.to_owned(), layer)))
            .chain(semantic.map(|(number, layer)| (format!("semantic.{number}"), layer)))
            .flat_map(|(name, layer)| {
                let bias = (format!("{name}.bias"), &layer.bias);
                let weights = layer.weights.iter().enumerate();
                weights
                    .map(move |(part, weight)| (format!("{name}.weight.{part}"), weight))
                    .chain([bias])
            })
            .collect()
    }
}

/// candle hands operations on this many numbers to threads of its own, which spin while they wait and so take
/// the cores from those that work on other rays.
const SPLIT_BY_CANDLE: usize = 64 * 1024;

/// An affine layer: x W + b.
#[derive(Debug)]
struct AffineLayer {
    /// W, cut along its outputs into parts `[inputs, outputs / parts]` of fewer than [`SPLIT_BY_CANDLE`] numbers.
    weights: Vec<Var>,
    /// `[outputs]`
    bias: Var,
}

impl AffineLayer {
    /// Weights and biases are uniform within 1 / sqrt(inputs), PyTorch's default, which the published
    /// code keeps.
    fn new(inputs: usize, outputs: usize, device: &Device, rng: &mut SmallRng) -> Result<Self> {
        let bound = 1.0 / (inputs as f32).sqrt();
        let mut uniform = |shape: (usize, usize)| {
            let values = (0..shape.0 * shape.1).map(|_| rng.random_range(-bound..bound));
            Tensor::from_vec(values.collect::<Vec<f32>>(), shape, device)
        };
        let widest = ((SPLIT_BY_CANDLE - 1) / inputs).max(1);
        let width = outputs.div_ceil(outputs.div_ceil(widest));
        let weights = (0..outputs).step_by(width).map(|from| {
            let part = uniform((inputs, width.min(outputs - from)))?;
            Var::from_tensor(&part)
        });
        Ok(Self {
            weights: weights.collect::<Result<_>>()?,
            bias: Var::from_tensor(&uniform((1, outputs))?.squeeze(0)?)?,
        })
    }

    fn forward(&self, input: &Tensor, differentiable: bool) -> Result<Tensor> {
        let parameter = |var: &Var| match differentiable {
            true => var.as_tensor().clone(),
            false => var.as_detached_tensor(),
        };
        let parts = self.weights.iter().map(|weight| input.matmul(&parameter(weight)));
        let parts = parts.collect::<Result<Vec<_>>>()?;
        let product = match parts.as_slice() {
            [whole] => whole.clone(),
            parts => Tensor::cat(parts, 1)?,
        };
        product.broadcast_add(&parameter(&self.bias))
    }
}
