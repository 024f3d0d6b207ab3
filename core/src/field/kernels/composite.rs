//! Volume rendering along rays (Semantic-NeRF, Eq. 1, 2 and 4), with the distortion of mip-NeRF 360.

use std::sync::Arc;

use candle_core::{CpuStorage, CustomOp2, Device, Layout, Result, Shape, Tensor, bail};
use rayon::prelude::*;

use super::values;

/// Samples of many rays, one ray after another.
#[derive(Clone, Debug, Default)]
pub struct RayPacking {
    /// First sample of each ray, and the number of samples at the end: `[rays + 1]`.
    pub starts: Vec<u32>,
    /// Distance of each sample along its ray, in metres, ascending within a ray.
    pub t: Vec<f32>,
    /// Length of each sample's interval, in metres.
    pub dt: Vec<f32>,
    /// Distance in metres below which a sample's gradients are scaled by (t / ramp)^2, so that noise
    /// in the images is not fitted right before the camera (Philip and Deschaintre 2023); 0 = never.
    pub gradient_ramp: f32,
}

impl RayPacking {
    /// Number of rays.
    pub fn rays(&self) -> usize {
        self.starts.len().saturating_sub(1)
    }

    /// Number of samples.
    pub fn samples(&self) -> usize {
        self.t.len()
    }

    /// The samples of a ray.
    pub fn range(&self, ray: usize) -> std::ops::Range<usize> {
        self.starts[ray] as usize..self.starts[ray + 1] as usize
    }

    /// Where the samples of a ray lie.
    pub(super) fn of_ray(&self, ray: usize) -> OfRay<'_> {
        let range = self.range(ray);
        OfRay {
            t: &self.t[range.clone()],
            dt: &self.dt[range],
            gradient_ramp: self.gradient_ramp,
        }
    }

    /// Weights w_i = T_i (1 - exp(-sigma_i dt_i)) of one ray's samples (Eq. 1) from its densities.
    pub fn weights<'a>(&'a self, ray: usize, density: &'a [f32]) -> impl Iterator<Item = f32> + 'a {
        let mut transmittance = 1.0;
        self.range(ray).map(move |i| {
            let kept = (-density[i] * self.dt[i]).exp();
            let weight = transmittance * (1.0 - kept);
            transmittance *= kept;
            weight
        })
    }
}

/// Composites densities `[N]` (per metre) and values `[N, C]` to `[rays, C + 3]`: the C composited
/// values, then expected ray length, opacity and distortion.
///
/// - w_i = T_i (1 - exp(-sigma_i dt_i)), T_i = exp(-sum_{j<i} sigma_j dt_j)
/// - value = sum_i w_i v_i; ray length = sum_i w_i t_i; opacity = sum_i w_i
/// - distortion = sum_ij w_i w_j |t_i - t_j| + sum_i w_i^2 dt_i / 3 (Barron et al. 2022, Eq. 15)
///
/// Differentiable in densities and values.
pub struct Composite(pub Arc<RayPacking>);

/// Channels after the composited values.
pub(super) const EXTRA: usize = 3;

impl Composite {
    /// Applies the op.
    ///
    /// # Errors
    /// Arguments whose shapes do not fit the packing, or not contiguous `f32` on the CPU.
    pub fn apply(self, density: &Tensor, values: &Tensor) -> Result<Tensor> {
        density.apply_op2(values, self)
    }
}

impl CustomOp2 for Composite {
    fn name(&self) -> &'static str {
        "composite"
    }

    fn cpu_fwd(
        &self,
        density: &CpuStorage,
        density_layout: &Layout,
        value: &CpuStorage,
        value_layout: &Layout,
    ) -> Result<(CpuStorage, Shape)> {
        let packing = &*self.0;
        let samples = density_layout.shape().dims1()?;
        let (value_samples, channels) = value_layout.shape().dims2()?;
        if samples != packing.samples() || value_samples != samples {
            bail!(
                "composite: {samples} densities, {value_samples} values, {} packed",
                packing.samples()
            );
        }
        let density = values(density, density_layout, self.name())?;
        let value = values(value, value_layout, self.name())?;
        let width = channels + EXTRA;
        let mut out = vec![0.0_f32; packing.rays() * width];
        out.par_chunks_exact_mut(width)
            .enumerate()
            .with_min_len(64)
            .for_each(|(ray, out)| {
                let range = packing.range(ray);
                let value = &value[range.start * channels..range.end * channels];
                composite_ray(packing.of_ray(ray), &density[range], value, out);
            });
        Ok((CpuStorage::F32(out), Shape::from((packing.rays(), width))))
    }

    fn bwd(
        &self,
        density: &Tensor,
        value: &Tensor,
        _out: &Tensor,
        grad: &Tensor,
    ) -> Result<(Option<Tensor>, Option<Tensor>)> {
        let packing = &*self.0;
        let (samples, channels) = value.dims2()?;
        let density = density.to_vec1::<f32>()?;
        let value = value.flatten_all()?.to_vec1::<f32>()?;
        let grad = grad.flatten_all()?.to_vec1::<f32>()?;
        let mut density_grad = vec![0.0_f32; samples];
        let mut value_grad = vec![0.0_f32; samples * channels];
        let mut rest: (&mut [f32], &mut [f32]) = (&mut density_grad, &mut value_grad);
        let mut tasks = Vec::with_capacity(packing.rays());
        for ray in 0..packing.rays() {
            let length = packing.range(ray).len();
            let (of_density, densities) = std::mem::take(&mut rest.0).split_at_mut(length);
            let (of_value, values) = std::mem::take(&mut rest.1).split_at_mut(length * channels);
            rest = (densities, values);
            tasks.push((ray, of_density, of_value));
        }
        tasks
            .into_par_iter()
            .with_min_len(64)
            .for_each(|(ray, of_density, of_value)| {
                let range = packing.range(ray);
                let value = &value[range.start * channels..range.end * channels];
                let own = &grad[ray * (channels + EXTRA)..(ray + 1) * (channels + EXTRA)];
                let of_ray = packing.of_ray(ray);
                gradient_of_ray(of_ray, &density[range], value, own, of_density, of_value);
            });
        let density_grad = Tensor::from_vec(density_grad, samples, &Device::Cpu)?;
        let value_grad = Tensor::from_vec(value_grad, (samples, channels), &Device::Cpu)?;
        Ok((Some(density_grad), Some(value_grad)))
    }
}

/// Where the samples of one ray lie, and how gradients near the camera are scaled.
#[derive(Clone, Copy)]
pub(super) struct OfRay<'a> {
    t: &'a [f32],
    dt: &'a [f32],
    gradient_ramp: f32,
}

/// Composites one ray's densities `[n]` and values `[n, channels]` to `out`, `[channels + 3]`.
pub(super) fn composite_ray(ray: OfRay, density: &[f32], value: &[f32], out: &mut [f32]) {
    let channels = out.len() - EXTRA;
    out.fill(0.0);
    // Running sums over earlier samples: opacity and first moment of t.
    let (mut before, mut moment) = (0.0, 0.0);
    let mut distortion = 0.0;
    let mut transmittance = 1.0;
    for (i, &density) in density.iter().enumerate() {
        let (t, dt) = (ray.t[i], ray.dt[i]);
        let next = transmittance * (-density * dt).exp();
        let w = transmittance - next;
        transmittance = next;
        for (sum, v) in out.iter_mut().zip(&value[i * channels..(i + 1) * channels]) {
            *sum += w * v;
        }
        distortion += 2.0 * w * (t * before - moment) + w * w * dt / 3.0;
        before += w;
        moment += w * t;
    }
    out[channels] = moment;
    out[channels + 1] = before;
    out[channels + 2] = distortion;
}

/// Gradients of one ray's densities `[n]` and values `[n, channels]`, from that of its outputs.
///
/// With g_i the derivative by w_i, the derivative by sigma_k is
/// dt_k (T_{k+1} g_k - sum_{i>k} w_i g_i).
pub(super) fn gradient_of_ray(
    ray: OfRay,
    density: &[f32],
    value: &[f32],
    grad: &[f32],
    of_density: &mut [f32],
    of_value: &mut [f32],
) {
    let channels = grad.len() - EXTRA;
    let (to_values, to_extra) = grad.split_at(channels);
    // First the transmittance behind each sample, in the place of its gradient.
    let (mut opacity, mut moment) = (0.0, 0.0);
    let mut transmittance = 1.0;
    for (i, behind) in of_density.iter_mut().enumerate() {
        *behind = transmittance * (-density[i] * ray.dt[i]).exp();
        opacity += transmittance - *behind;
        moment += (transmittance - *behind) * ray.t[i];
        transmittance = *behind;
    }
    let (mut after, mut moment_after, mut later) = (0.0, 0.0, 0.0);
    for k in (0..density.len()).rev() {
        let (t, dt) = (ray.t[k], ray.dt[k]);
        let next = of_density[k];
        let w = if k == 0 { 1.0 } else { of_density[k - 1] } - next;
        let before = opacity - after - w;
        let moment_before = moment - moment_after - w * t;
        // sum_j w_j |t_k - t_j|
        let spread = t * before - moment_before + moment_after - t * after;
        let own = &value[k * channels..(k + 1) * channels];
        let through_value: f32 = own.iter().zip(to_values).map(|(v, g)| v * g).sum();
        let by_weight =
            through_value + to_extra[0] * t + to_extra[1] + to_extra[2] * (2.0 * spread + 2.0 / 3.0 * w * dt);
        let scale = if ray.gradient_ramp > 0.0 {
            (t / ray.gradient_ramp).powi(2).min(1.0)
        } else {
            1.0
        };
        of_density[k] = scale * dt * (next * by_weight - later);
        for (of_value, g) in of_value[k * channels..(k + 1) * channels]
            .iter_mut()
            .zip(to_values)
        {
            *of_value = scale * w * g;
        }
        later += w * by_weight;
        after += w;
        moment_after += w * t;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use candle_core::Var;
    use rand::{Rng, SeedableRng, rngs::SmallRng};

    fn packing() -> Arc<RayPacking> {
        // Three rays: 4 samples, none, 3 samples.
        Arc::new(RayPacking {
            starts: vec![0, 4, 4, 7],
            t: vec![0.5, 0.8, 1.4, 2.0, 0.3, 0.6, 1.0],
            dt: vec![0.3, 0.4, 0.6, 0.5, 0.3, 0.3, 0.5],
            gradient_ramp: 0.0,
        })
    }

    fn inputs() -> (Tensor, Tensor) {
        let mut rng = SmallRng::seed_from_u64(1);
        let density: Vec<f32> = (0..7).map(|_| rng.random_range(0.1..4.0)).collect();
        let value: Vec<f32> = (0..14).map(|_| rng.random_range(-1.0..1.0)).collect();
        (
            Tensor::from_vec(density, 7, &Device::Cpu).unwrap(),
            Tensor::from_vec(value, (7, 2), &Device::Cpu).unwrap(),
        )
    }

    /// Any smooth function of all outputs.
    fn loss(out: &Tensor) -> Tensor {
        let scale = Tensor::new(&[[1.0_f32, -0.5, 0.7, 0.9, 0.3]], &Device::Cpu).unwrap();
        let scaled = out.broadcast_mul(&scale).unwrap();
        (scaled.sqr().unwrap().sum_all().unwrap() + scaled.sum_all().unwrap()).unwrap()
    }

    #[test]
    fn a_ray_composites_as_computed_by_hand() {
        // Two samples of opacity 1/2 each: weights 1/2 and 1/4.
        let half = std::f32::consts::LN_2;
        let packing = Arc::new(RayPacking {
            starts: vec![0, 2],
            t: vec![1.0, 2.0],
            dt: vec![1.0, 0.5],
            gradient_ramp: 0.0,
        });
        let density = Tensor::new(&[half, 2.0 * half], &Device::Cpu).unwrap();
        let value = Tensor::new(&[[1.0_f32], [3.0]], &Device::Cpu).unwrap();
        let out = Composite(packing).apply(&density, &value).unwrap();
        let out = out.to_vec2::<f32>().unwrap().remove(0);
        let distortion = 2.0 * 0.5 * 0.25 + (0.25 + 0.0625 * 0.5) / 3.0;
        for (got, expected) in out.iter().zip([1.25, 1.0, 0.75, distortion]) {
            assert!((got - expected).abs() < 1e-6, "{out:?}");
        }
    }

    #[test]
    fn a_ray_without_samples_is_empty() {
        let (density, value) = inputs();
        let out = Composite(packing()).apply(&density, &value).unwrap();
        assert_eq!(out.to_vec2::<f32>().unwrap()[1], [0.0; 5]);
    }

    #[test]
    fn gradients_equal_central_differences() {
        let (density, value) = inputs();
        let density_var = Var::from_tensor(&density).unwrap();
        let value_var = Var::from_tensor(&value).unwrap();
        let out = Composite(packing()).apply(&density_var, &value_var).unwrap();
        let grads = loss(&out).backward().unwrap();
        for (which, tensor, gradient) in [
            ("density", &density, grads.get(&density_var).unwrap()),
            ("value", &value, grads.get(&value_var).unwrap()),
        ] {
            let flat: Vec<f32> = tensor.flatten_all().unwrap().to_vec1().unwrap();
            let gradient: Vec<f32> = gradient.flatten_all().unwrap().to_vec1().unwrap();
            for index in 0..flat.len() {
                let shifted = |by: f32| {
                    let mut moved = flat.clone();
                    moved[index] += by;
                    let moved = Tensor::from_vec(moved, tensor.dims(), &Device::Cpu).unwrap();
                    let (d, v) = if which == "density" {
                        (&moved, &value)
                    } else {
                        (&density, &moved)
                    };
                    let out = Composite(packing()).apply(d, v).unwrap();
                    loss(&out).to_scalar::<f32>().unwrap()
                };
                let numeric = (shifted(1e-2) - shifted(-1e-2)) / 2e-2;
                let error = (gradient[index] - numeric).abs();
                assert!(
                    error < 5e-3 * (1.0 + numeric.abs()),
                    "{which} {index}: {} {numeric}",
                    gradient[index]
                );
            }
        }
    }

    #[test]
    fn gradients_equal_plain_candle_ops() {
        // The same sums with a strictly lower triangular matrix, one ray.
        let packing = Arc::new(RayPacking {
            starts: vec![0, 7],
            t: vec![0.3, 0.5, 0.6, 0.8, 1.0, 1.4, 2.0],
            dt: vec![0.2, 0.1, 0.2, 0.2, 0.4, 0.6, 0.5],
            gradient_ramp: 0.0,
        });
        let (density, value) = inputs();
        let density = Var::from_tensor(&density).unwrap();
        let value = Var::from_tensor(&value).unwrap();
        let plain = || -> Result<Tensor> {
            let t = Tensor::from_slice(&packing.t, (7, 1), &Device::Cpu)?;
            let dt = Tensor::from_slice(&packing.dt, (7, 1), &Device::Cpu)?;
            let lower: Vec<f32> = (0..49).map(|k| if k % 7 < k / 7 { 1.0 } else { 0.0 }).collect();
            let lower = Tensor::from_vec(lower, (7, 7), &Device::Cpu)?;
            let optical = density.reshape((7, 1))?.mul(&dt)?;
            let transmittance = lower.matmul(&optical)?.neg()?.exp()?;
            let weights = transmittance.mul(&optical.neg()?.exp()?.affine(-1.0, 1.0)?)?;
            let values = weights.t()?.matmul(&value)?;
            let length = weights.mul(&t)?.sum_all()?.reshape((1, 1))?;
            let opacity = weights.sum_all()?.reshape((1, 1))?;
            let gaps = t.broadcast_sub(&t.t()?)?.abs()?;
            let pairs = weights.matmul(&weights.t()?)?.mul(&gaps)?.sum_all()?;
            let own = weights.sqr()?.mul(&dt)?.sum_all()?.affine(1.0 / 3.0, 0.0)?;
            let distortion = (pairs + own)?.reshape((1, 1))?;
            Tensor::cat(&[values, length, opacity, distortion], 1)
        };
        let expected = plain().unwrap();
        let got = Composite(packing.clone()).apply(&density, &value).unwrap();
        for (a, b) in got.to_vec2::<f32>().unwrap()[0]
            .iter()
            .zip(&expected.to_vec2::<f32>().unwrap()[0])
        {
            assert!((a - b).abs() < 1e-5);
        }
        let (a, b) = (
            loss(&got).backward().unwrap(),
            loss(&expected).backward().unwrap(),
        );
        for var in [&density, &value] {
            let a: Vec<f32> = a.get(var).unwrap().flatten_all().unwrap().to_vec1().unwrap();
            let b: Vec<f32> = b.get(var).unwrap().flatten_all().unwrap().to_vec1().unwrap();
            assert!(
                a.iter()
                    .zip(&b)
                    .all(|(a, b)| (a - b).abs() < 1e-4 * (1.0 + b.abs()))
            );
        }
    }
}
