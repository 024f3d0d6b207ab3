//! Volume rendering along rays (Semantic-NeRF, Eq. 1, 2 and 4), with the distortion of mip-NeRF 360.

/// Samples of many rays, one ray after another.
#[derive(Clone, Debug, Default)]
pub struct RayPacking {
    /// First sample of each ray, and the number of samples at the end: `[rays + 1]`.
    pub starts: Vec<u32>,
    /// Distance of each sample along its ray, in metres, ascending within a ray.
    pub t: Vec<f32>,
    /// Length of each sample's interval, in metres.
    pub dt: Vec<f32>,
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

/// Channels after the composited values: ray length, opacity, distortion.
pub const EXTRA: usize = 3;

/// Where the samples of one ray lie.
#[derive(Clone, Copy)]
pub(super) struct OfRay<'a> {
    t: &'a [f32],
    dt: &'a [f32],
}

/// Composites one ray's densities `[n]` (per metre) and values `[n, channels]` to `out`, `[channels + 3]`:
/// the composited values, then expected ray length, opacity and distortion.
///
/// - w_i = T_i (1 - exp(-sigma_i dt_i)), T_i = exp(-sum_{j<i} sigma_j dt_j)
/// - value = sum_i w_i v_i; ray length = sum_i w_i t_i; opacity = sum_i w_i
/// - distortion = sum_ij w_i w_j |t_i - t_j| + sum_i w_i^2 dt_i / 3 (Barron et al. 2022, Eq. 15)
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
        of_density[k] = dt * (next * by_weight - later);
        for (of_value, g) in of_value[k * channels..(k + 1) * channels]
            .iter_mut()
            .zip(to_values)
        {
            *of_value = w * g;
        }
        later += w * by_weight;
        after += w;
        moment_after += w * t;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_ray_composites_as_computed_by_hand() {
        // Two samples of opacity 1/2 each: weights 1/2 and 1/4.
        let half = std::f32::consts::LN_2;
        let ray = OfRay {
            t: &[1.0, 2.0],
            dt: &[1.0, 0.5],
        };
        let mut out = [0.0; 1 + EXTRA];
        composite_ray(ray, &[half, 2.0 * half], &[1.0, 3.0], &mut out);
        let distortion = 2.0 * 0.5 * 0.25 + (0.25 + 0.0625 * 0.5) / 3.0;
        for (got, expected) in out.iter().zip([1.25, 1.0, 0.75, distortion]) {
            assert!((got - expected).abs() < 1e-6, "{out:?}");
        }
    }
}
