//! A network of positions, trained jointly on the surface, its colours and the clicks.

use std::time::{Duration, Instant};

use candle_core::{D, Device, Result, Tensor, Var};
use candle_nn::loss::{cross_entropy, mse};
use candle_nn::{AdamW, Optimizer, ParamsAdamW};
use glam::Vec3;
use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng, rngs::SmallRng};

use crate::learnt::NodeLabels;
use inplace_core::labels::{ClassId, VOID};
use inplace_core::semantics::Surface;

const FREQUENCIES: usize = 7;
const LAYERS: usize = 4;
const WIDTH: usize = 256;
const LEARNING_RATE: f64 = 1e-3;
/// Places of the surface, and clicks, in a step.
const PLACES: usize = 1024;
const CLICKS: usize = 256;
/// Farthest from the surface that the distance is trained, in metres.
const BAND: f32 = 0.1;
/// Nodes asked about at a time.
const CHUNK: usize = 4096;

/// Trains on clicks (places with a class) for so long, at least a step, and tells the class of every node.
pub(super) fn classes(
    surface: &Surface,
    clicks: &[(Vec3, ClassId)],
    training: Duration,
    seed: u64,
) -> Result<NodeLabels> {
    let nodes = surface.graph.nodes();
    let mut classes: Vec<ClassId> = clicks.iter().map(|click| click.1).collect();
    classes.sort_unstable();
    classes.dedup();
    if classes.is_empty() || nodes.is_empty() {
        return Ok(NodeLabels(vec![VOID; nodes.len()]));
    }
    let mut rng = SmallRng::seed_from_u64(seed);
    let network = Network::new(classes.len(), &mut rng)?;
    let parameters = ParamsAdamW {
        lr: LEARNING_RATE,
        weight_decay: 0.0,
        ..ParamsAdamW::default()
    };
    let mut optimiser = AdamW::new(network.variables(), parameters)?;
    let frame = Room::around(nodes.iter().map(|node| node.position));
    let start = Instant::now();
    loop {
        let places: Vec<_> = nodes.choose_multiple(&mut rng, PLACES).collect();
        let gaps: Vec<f32> = places.iter().map(|_| rng.random_range(-BAND..BAND)).collect();
        let with_gaps = places.iter().zip(&gaps);
        let off = with_gaps.map(|(node, gap)| node.position + *gap * node.normal);
        let colors: Vec<f32> = places.iter().flat_map(|node| node.color.to_array()).collect();
        let shown: Vec<_> = clicks.choose_multiple(&mut rng, CLICKS).collect();
        let index = |click: &&(Vec3, ClassId)| classes.partition_point(|&class| class < click.1) as u32;
        let labels: Vec<u32> = shown.iter().map(index).collect();

        let count = places.len();
        let said = network.forward(&frame.tensor(off)?)?;
        let distance =
            Tensor::from_vec(gaps, (count, 1), &Device::Cpu)?.affine(f64::from(1.0 / BAND), 0.0)?;
        let color = Tensor::from_vec(colors, (count, 3), &Device::Cpu)?;
        let of_clicks = network.forward(&frame.tensor(shown.iter().map(|click| click.0))?)?;
        let logits = of_clicks.narrow(1, 4, classes.len())?;
        let labels = Tensor::new(labels, &Device::Cpu)?;
        let loss = (mse(&said.narrow(1, 0, 1)?, &distance)? + mse(&said.narrow(1, 1, 3)?, &color)?)?;
        optimiser.backward_step(&(loss + cross_entropy(&logits, &labels)?)?)?;
        if start.elapsed() >= training {
            break;
        }
    }
    let mut best = Vec::with_capacity(nodes.len());
    for chunk in nodes.chunks(CHUNK) {
        let said = network.forward(&frame.tensor(chunk.iter().map(|node| node.position))?)?;
        let logits = said.narrow(1, 4, classes.len())?.contiguous()?;
        let indices = logits.argmax(D::Minus1)?.to_vec1::<u32>()?.into_iter();
        best.extend(indices.map(|index| classes[index as usize]));
    }
    Ok(NodeLabels(best))
}

/// The scene's box, whose longest side becomes 2 pi.
struct Room {
    center: Vec3,
    scale: f32,
}

impl Room {
    fn around(places: impl Iterator<Item = Vec3> + Clone) -> Self {
        let low = places.clone().fold(Vec3::INFINITY, Vec3::min);
        let high = places.fold(Vec3::NEG_INFINITY, Vec3::max);
        Self {
            center: 0.5 * (low + high),
            scale: std::f32::consts::TAU / (high - low).max_element().max(1e-6),
        }
    }

    /// Encoded places.
    fn tensor(&self, places: impl Iterator<Item = Vec3>) -> Result<Tensor> {
        let scaled = places.flat_map(|place| ((place - self.center) * self.scale).to_array());
        let values: Vec<f32> = scaled.collect();
        let rows = values.len() / 3;
        positional_encoding(&Tensor::from_vec(values, (rows, 3), &Device::Cpu)?, FREQUENCIES)
    }
}

/// Rows of values, then the sine and the cosine of each times 1, 2, 4 and so on to `2^(frequencies - 1)`.
fn positional_encoding(rows: &Tensor, frequencies: usize) -> Result<Tensor> {
    let mut parts = vec![rows.clone()];
    for octave in 0..frequencies {
        let scaled = rows.affine(f64::from(1_u32 << octave), 0.0)?;
        parts.extend([scaled.sin()?, scaled.cos()?]);
    }
    Tensor::cat(&parts, D::Minus1)
}

/// Affine layers with ReLU between them; the last gives the distance over [`BAND`], the colour and the logits.
struct Network(Vec<(Var, Var)>);

impl Network {
    fn new(classes: usize, rng: &mut SmallRng) -> Result<Self> {
        let mut widths = vec![3 + 6 * FREQUENCIES];
        widths.extend([WIDTH; LAYERS]);
        widths.push(4 + classes);
        let layers = widths.windows(2).map(|pair| {
            let bound = (6.0 / pair[0] as f32).sqrt();
            let values = (0..pair[0] * pair[1]).map(|_| rng.random_range(-bound..bound));
            let weight = Tensor::from_vec(values.collect::<Vec<f32>>(), (pair[0], pair[1]), &Device::Cpu)?;
            let bias = Tensor::from_vec(vec![0.0_f32; pair[1]], pair[1], &Device::Cpu)?;
            Ok((Var::from_tensor(&weight)?, Var::from_tensor(&bias)?))
        });
        Ok(Self(layers.collect::<Result<_>>()?))
    }

    fn variables(&self) -> Vec<Var> {
        let both = self.0.iter().flat_map(|(weight, bias)| [weight, bias]);
        both.cloned().collect()
    }

    fn forward(&self, input: &Tensor) -> Result<Tensor> {
        let mut hidden = input.clone();
        for (number, (weight, bias)) in self.0.iter().enumerate() {
            hidden = hidden.matmul(weight)?.broadcast_add(bias)?;
            if number < LAYERS {
                hidden = hidden.relu()?;
            }
        }
        Ok(hidden)
    }
}
