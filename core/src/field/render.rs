//! Rendering of the field: colour and depth of rays.

use candle_core::Result;
use glam::{Affine3A, Vec3};

use super::kernels::{Evaluated, Wanted};
use super::{OccupancyGrid, RadianceField, Ray, Samples, Sampling};
use crate::scene::{Camera, Frame};

/// Rays rendered at a time.
const CHUNK: usize = 1024;

/// What a ray sees.
#[derive(Clone, Copy, Debug, Default)]
pub struct RenderedRay {
    /// Colour composited over black, each channel in 0..=1 (Eq. 1).
    pub color: Vec3,
    /// Ray length at which half of the light is stopped, in metres; `None` where less than half is.
    pub length: Option<f32>,
}

/// The rays through the pixels of a frame at 1/`stride` of its resolution, row-major, and that camera.
pub fn frame_rays(frame: &Frame, stride: u32) -> (Camera, Vec<Ray>) {
    let camera = frame.camera.reduced(stride);
    let rays = camera_rays(&camera, &frame.camera_to_world);
    (camera, rays)
}

/// The rays through the centres of a camera's pixels, row-major.
pub fn camera_rays(camera: &Camera, camera_to_world: &Affine3A) -> Vec<Ray> {
    let (origin, rotation) = (camera_to_world.translation.into(), camera_to_world.matrix3);
    let ray = |index: usize| Ray {
        origin,
        direction: (rotation * camera.direction_at(index)).normalize(),
        length: None,
    };
    (0..camera.pixels()).map(ray).collect()
}

/// Renders rays with samples `step` metres apart.
///
/// # Errors
/// None on the CPU short of a lack of memory.
pub fn render_rays(
    field: &RadianceField,
    occupancy: &OccupancyGrid,
    rays: &[Ray],
    step: f32,
    with_color: bool,
) -> Result<Vec<RenderedRay>> {
    let sampling = Sampling {
        step,
        ..Sampling::default()
    };
    let mut rendered = Vec::with_capacity(rays.len());
    for rays in rays.chunks(CHUNK) {
        let samples = Samples::along(field, occupancy, rays, sampling)?;
        if samples.is_empty() {
            rendered.resize(rendered.len() + rays.len(), RenderedRay::default());
            continue;
        }
        let wanted = Wanted {
            color: with_color,
            features: false,
        };
        let Evaluated { density, color, .. } = field.evaluate(&samples, wanted)?;
        rendered.extend((0..rays.len()).map(|ray| composite(&samples, ray, &density, &color)));
    }
    Ok(rendered)
}

fn composite(samples: &Samples, ray: usize, density: &[f32], color: &[f32]) -> RenderedRay {
    let packing = &samples.packing;
    let mut out = RenderedRay::default();
    let mut stopped = 0.0;
    for (i, weight) in packing.range(ray).zip(packing.weights(ray, density)) {
        if out.length.is_none() && stopped + weight >= 0.5 {
            // Within the interval the light that is left falls off exponentially.
            let left = 1.0 - stopped;
            let share = (left / 0.5).ln() / (density[i] * packing.dt[i]).max(1e-6);
            out.length = Some(packing.t[i] + (share.clamp(0.0, 1.0) - 0.5) * packing.dt[i]);
        }
        stopped += weight;
        if let Some(own) = color.get(3 * i..3 * i + 3) {
            out.color += weight * Vec3::new(own[0], own[1], own[2]);
        }
    }
    out
}
