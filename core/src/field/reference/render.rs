//! The coarse and the fine network along rays.

use candle_core::{Device, Result, Tensor, Var};
use candle_nn::ops::softmax;
use glam::Vec3;
use rand::{Rng, SeedableRng, rngs::SmallRng};
use rayon::prelude::*;

use super::sampling::{deltas, refined};
use super::{
    ReferenceNetwork, ReferenceSettings, composite, entropy, positional_encoding, ray_weights, stratified,
};
use crate::field::{Ray, RenderedRay, Volume};
use crate::scene::Scene;

/// Output of one network along `R` rays.
pub struct Composited {
    /// Colours `[R, 3]` (Eq. 1).
    pub color: Tensor,
    /// Class logits `[R, classes]` (Eq. 4); `None` when there are no classes.
    pub logits: Option<Tensor>,
    /// Weights of the samples `[R, S]`.
    pub weights: Tensor,
    /// Distances of the samples, in metres, row-major `[R, S]`.
    pub t: Vec<f32>,
}

/// Output of the fine network along one ray.
#[derive(Clone, Debug)]
pub struct ReferenceRay {
    /// Colour over black, opacity and ray length.
    pub seen: RenderedRay,
    /// Class probabilities: the softmax of the composited logits (Eq. 4). Empty without classes.
    pub probabilities: Vec<f32>,
    /// Their entropy, in nats; 0 without classes.
    pub entropy: f32,
}

/// The two networks and the range that their rays are sampled in.
#[derive(Debug)]
pub struct ReferenceField {
    settings: ReferenceSettings,
    coarse: ReferenceNetwork,
    fine: ReferenceNetwork,
    /// Distance of the farthest sample, in metres.
    far: f32,
    device: Device,
}

impl ReferenceField {
    /// Networks with random weights for a scene.
    ///
    /// The published code samples from 0.1 m to 10 m, which fits the rooms that it was made for. Here the
    /// far end is the distance from the camera to the corner of the volume that is farthest from it, over
    /// all cameras: nothing of the scene lies behind it, and a smaller scene wastes fewer samples.
    ///
    /// # Errors
    /// A lack of memory on the device.
    pub fn new(
        scene: &Scene,
        settings: ReferenceSettings,
        classes: usize,
        device: &Device,
        seed: u64,
    ) -> Result<Self> {
        let volume = Volume::around(&scene.bounds());
        let half = 0.5 * volume.side;
        let farthest = |center: Vec3| ((center - volume.min - half).abs() + half).length();
        let far = scene.frames.iter().map(|frame| farthest(frame.center()));
        Ok(Self {
            settings,
            coarse: ReferenceNetwork::new(&settings, classes, device, seed)?,
            fine: ReferenceNetwork::new(&settings, classes, device, seed ^ 0xf17e)?,
            far: far.fold(2.0 * settings.near, f32::max),
            device: device.clone(),
        })
    }

    /// The sizes.
    pub fn settings(&self) -> &ReferenceSettings {
        &self.settings
    }

    /// The device that it is computed on.
    pub fn device(&self) -> &Device {
        &self.device
    }

    /// Distance of the farthest sample, in metres.
    pub fn far(&self) -> f32 {
        self.far
    }

    /// Trainable parameters.
    pub fn parameters(&self) -> usize {
        self.named().iter().map(|(_, var)| var.elem_count()).sum()
    }

    /// The parameters of both networks with their names.
    pub fn named(&self) -> Vec<(String, &Var)> {
        let of = |name: &'static str, network| {
            ReferenceNetwork::named(network)
                .into_iter()
                .map(move |(part, var)| (format!("reference.{name}.{part}"), var))
        };
        of("coarse", &self.coarse).chain(of("fine", &self.fine)).collect()
    }

    /// Output of the coarse and the fine network along rays: in training with a generator for each ray,
    /// which moves the samples and adds noise to the density, otherwise without anything random.
    ///
    /// # Errors
    /// A lack of memory on the device.
    pub fn forward(&self, rays: &[Ray], mut random: Option<&mut [SmallRng]>) -> Result<[Composited; 2]> {
        let near = self.settings.near;
        let (coarse_samples, fine_samples) = (self.settings.coarse_samples, self.settings.fine_samples);
        let mut t = Vec::with_capacity(rays.len() * coarse_samples);
        for ray in 0..rays.len() {
            let mut offset = random.as_mut().map(|random| || random[ray].random());
            let offset = offset.as_mut().map(|offset| offset as &mut dyn FnMut() -> f32);
            t.extend(stratified(near, self.far, coarse_samples, offset));
        }
        let coarse = self.along(&self.coarse, rays, t, random.as_deref_mut())?;

        // The samples of the fine network are constants: no gradient flows through their choice.
        let weights: Vec<f32> = coarse.weights.flatten_all()?.to_vec1()?;
        let mut t = Vec::with_capacity(rays.len() * (coarse_samples + fine_samples));
        let last = fine_samples.saturating_sub(1).max(1) as f32;
        for ray in 0..rays.len() {
            let range = ray * coarse_samples..(ray + 1) * coarse_samples;
            let (from, weights) = (&coarse.t[range.clone()], &weights[range]);
            let all = match &mut random {
                Some(random) => refined(from, weights, (0..fine_samples).map(|_| random[ray].random())),
                None => refined(from, weights, (0..fine_samples).map(|k| k as f32 / last)),
            };
            t.extend(all);
        }
        let fine = self.along(&self.fine, rays, t, random)?;
        Ok([coarse, fine])
    }

    /// Output of the fine network along rays.
    ///
    /// # Errors
    /// A lack of memory on the device.
    pub fn render(&self, rays: &[Ray]) -> Result<Vec<ReferenceRay>> {
        let chunks = rays.par_chunks(self.settings.chunk);
        let rendered: Vec<Vec<ReferenceRay>> = chunks
            .map(|rays| self.render_chunk(rays))
            .collect::<Result<_>>()?;
        Ok(rendered.into_iter().flatten().collect())
    }

    fn render_chunk(&self, rays: &[Ray]) -> Result<Vec<ReferenceRay>> {
        let [_, fine] = self.forward(rays, None)?;
        let colors: Vec<Vec<f32>> = fine.color.to_vec2()?;
        let weights: Vec<Vec<f32>> = fine.weights.to_vec2()?;
        let (probabilities, entropies) = match &fine.logits {
            Some(logits) => (softmax(logits, 1)?.to_vec2()?, entropy(logits)?.to_vec1()?),
            None => (vec![Vec::new(); rays.len()], vec![0.0; rays.len()]),
        };
        let samples = fine.t.len() / rays.len();
        let said = probabilities.into_iter().zip(entropies).enumerate();
        Ok(said
            .map(|(ray, (probabilities, entropy))| ReferenceRay {
                seen: RenderedRay {
                    color: Vec3::from_slice(&colors[ray]),
                    opacity: weights[ray].iter().sum(),
                    length: half_stopped(&weights[ray], &fine.t[ray * samples..]),
                },
                probabilities,
                entropy,
            })
            .collect())
    }

    /// One network along rays at the distances `t`, row-major `[R, S]`.
    fn along(
        &self,
        network: &ReferenceNetwork,
        rays: &[Ray],
        t: Vec<f32>,
        random: Option<&mut [SmallRng]>,
    ) -> Result<Composited> {
        let (count, samples) = (rays.len(), t.len() / rays.len());
        let of_ray = |ray: usize| &t[ray * samples..(ray + 1) * samples];
        let mut positions = Vec::with_capacity(3 * t.len());
        let mut gaps = Vec::with_capacity(t.len());
        for (number, ray) in rays.iter().enumerate() {
            for &t in of_ray(number) {
                positions.extend((ray.origin + t * ray.direction).to_array());
            }
            gaps.extend(deltas(of_ray(number)));
        }
        let directions: Vec<f32> = rays.iter().flat_map(|ray| ray.direction.to_array()).collect();
        let positions = Tensor::from_vec(positions, (count * samples, 3), &self.device)?;
        let positions = positions.affine(1.0 / self.settings.position_scale, 0.0)?;
        let directions = Tensor::from_vec(directions, (count, 3), &self.device)?;
        let directions = positional_encoding(&directions, self.settings.direction_frequencies)?;
        let width = directions.dim(1)?;
        let directions = directions
            .unsqueeze(1)?
            .broadcast_as((count, samples, width))?
            .reshape((count * samples, width))?;
        let positions = positional_encoding(&positions, self.settings.position_frequencies)?;
        let said = network.forward(&positions, &directions, random.is_some())?;

        let mut raw_density = said.raw_density.reshape((count, samples))?;
        if let Some(random) = random {
            let deviation = self.settings.density_noise;
            let noise = random.iter_mut().flat_map(|rng| {
                std::iter::repeat_with(|| deviation * normal(rng))
                    .take(samples)
                    .collect::<Vec<_>>()
            });
            let noise: Vec<f32> = noise.collect();
            raw_density = (raw_density + Tensor::from_vec(noise, (count, samples), &self.device)?)?;
        }
        let gaps = Tensor::from_vec(gaps, (count, samples), &self.device)?;
        let weights = ray_weights(&raw_density.relu()?, &gaps)?;
        let values = |values: &Tensor| composite(&weights, &values.reshape((count, samples, ()))?);
        Ok(Composited {
            color: values(&said.color)?,
            logits: said.logits.as_ref().map(values).transpose()?,
            weights,
            t,
        })
    }
}

/// The generator of a ray of a batch.
pub(super) fn generator(seed: u64, step: u64, ray: usize) -> SmallRng {
    let step = step.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    SmallRng::seed_from_u64(seed ^ step ^ (ray as u64).wrapping_mul(0xd1b5_4a32_d192_ed03))
}

/// A number of the standard normal distribution (Box and Muller, 1958).
fn normal(rng: &mut SmallRng) -> f32 {
    let radius = (-2.0 * (1.0 - rng.random::<f32>()).ln()).sqrt();
    radius * (std::f32::consts::TAU * rng.random::<f32>()).cos()
}

/// Distance at which half of the light has stopped; `None` where less than half does.
fn half_stopped(weights: &[f32], t: &[f32]) -> Option<f32> {
    let mut stopped = 0.0;
    weights.iter().zip(t).find_map(|(weight, &t)| {
        stopped += weight;
        (stopped >= 0.5).then_some(t)
    })
}
