//! What happens to colours: exposure, blur, noise, something that moves through the scene.

use std::f32::consts::TAU;

use glam::Vec3;
use rand::{Rng, rngs::SmallRng};

use super::trial::Trial;
use super::{Condition, Line, disturbed};
use inplace_core::scene::{ColorImage, DepthMap, Frame};

/// Pixels of the longest blur, at 320 pixels across.
const BLUR: f32 = 12.0;
/// Half the width of what moves, as a share of the image's.
const MOVING: f32 = 0.12;

pub(super) fn conditions() -> Vec<Condition> {
    vec![
        disturbed(
            "exposure-drift",
            "exposure swings by a stop, the white balance by 15%",
            "averages colours over views, and learns a gain for each frame and channel",
            Line::OfClean(0.85),
            exposure_drift,
        )
        .in_short(),
        disturbed(
            "exposure-drift-no-depth",
            "exposure swings by a stop, the white balance by 15%, colours alone",
            "learns a gain for each frame and channel beside the surface",
            Line::OfCleanWithoutDepth(0.8),
            |trial, rng| {
                trial.without_depth();
                exposure_drift(trial, rng);
            },
        )
        .limited_by(
            "gains are learnt beside the surface: in the same seconds it is a worse one, and the graph's colours keep \
             the drift",
        ),
        disturbed(
            "motion-blur",
            "frames are blurred by up to 12 pixels of 320",
            "averages over views; outlines come from depth too",
            Line::OfClean(0.9),
            motion_blur,
        ),
        disturbed(
            "rolling-noise",
            "bands of noise roll through the images, 8% of full scale",
            "averages over views, and normals and colours with the neighbours'",
            Line::OfClean(0.85),
            rolling_noise,
        ),
        disturbed(
            "moving-object",
            "something as wide as a quarter of the image passes through every third frame, in depth too",
            "gives what moved voxels of its own; the other views outvote it where it hid the room",
            Line::OfClean(0.85),
            moving_object,
        ),
    ]
}

/// Changes the colour of every pixel of every frame: `change` gets the frame, the pixel and its colour in 0..=1.
fn recolour(trial: &mut Trial, mut change: impl FnMut(usize, usize, Vec3) -> Vec3) {
    for (number, frame) in trial.scene.frames.iter_mut().enumerate() {
        let before = frame.color();
        let bytes = (0..frame.camera.pixels()).flat_map(|pixel| {
            let color = change(number, pixel, before.color(pixel)).to_array();
            color.map(|v| (255.0 * v.clamp(0.0, 1.0)).round() as u8)
        });
        replace(frame, bytes.collect());
    }
}

/// Gives a frame these colours, row-major, three bytes a pixel.
pub(super) fn replace(frame: &mut Frame, rgb: Vec<u8>) {
    if let Some(image) = ColorImage::new(frame.camera.width, frame.camera.height, rgb) {
        frame.set_color(image);
    }
}

fn exposure_drift(trial: &mut Trial, rng: &mut SmallRng) {
    let count = trial.scene.frames.len() as f32;
    let phases: [f32; 4] = std::array::from_fn(|_| rng.random_range(0.0..TAU));
    recolour(trial, |frame, _, color| {
        let at = |rounds: f32, phase: f32| (rounds * TAU * frame as f32 / count + phase).sin();
        let gain = 2.0_f32.powf(0.5 * at(3.0, phases[0]));
        let balance = Vec3::new(at(2.0, phases[1]), at(2.0, phases[2]), at(2.0, phases[3]));
        // Display values: a stop is a factor of 2 of the light.
        let light = color.powf(2.2) * gain * (Vec3::ONE + 0.15 * balance);
        light.powf(1.0 / 2.2)
    });
}

fn motion_blur(trial: &mut Trial, rng: &mut SmallRng) {
    for frame in &mut trial.scene.frames {
        let (width, height) = (frame.camera.width as i32, frame.camera.height as i32);
        let length = BLUR * frame.camera.width as f32 / 320.0 * rng.random::<f32>();
        let angle = rng.random_range(0.0..TAU);
        let steps = (length.round() as i32).max(1);
        let place = |step: i32| {
            let along = step as f32 - 0.5 * (steps - 1) as f32;
            [angle.cos(), angle.sin()].map(|share| (along * share).round() as i32)
        };
        let path: Vec<[i32; 2]> = (0..steps).map(place).collect();
        let before = frame.color();
        let mut bytes = Vec::with_capacity(3 * frame.camera.pixels());
        for row in 0..height {
            for column in 0..width {
                let mut sum = Vec3::ZERO;
                for [dx, dy] in &path {
                    let x = (column + dx).clamp(0, width - 1);
                    let y = (row + dy).clamp(0, height - 1);
                    sum += before.color((y * width + x) as usize);
                }
                bytes.extend((sum / steps as f32).to_array().map(|v| (255.0 * v).round() as u8));
            }
        }
        replace(frame, bytes);
    }
}

fn rolling_noise(trial: &mut Trial, rng: &mut SmallRng) {
    let frames = trial.scene.frames.iter();
    let sizes: Vec<[u32; 2]> = frames
        .map(|frame| [frame.camera.width, frame.camera.height])
        .collect();
    recolour(trial, |frame, pixel, color| {
        let [width, height] = sizes[frame];
        let row = pixel as u32 / width;
        // A band a quarter of the image high, farther down in every frame.
        let band = (TAU * (4.0 * row as f32 / height as f32 - 0.13 * frame as f32)).sin();
        color + 0.08 * band + 0.08 * rng.random_range(-1.0..1.0_f32)
    });
}

fn moving_object(trial: &mut Trial, rng: &mut SmallRng) {
    let count = trial.scene.frames.len() as f32;
    let color: [u8; 3] = std::array::from_fn(|_| rng.random_range(30..220));
    let train = trial.truth.train.clone();
    for &number in train.iter().step_by(3) {
        let frame = &mut trial.scene.frames[number];
        let (width, height) = (frame.camera.width as f32, frame.camera.height as f32);
        let middle = (
            width * (0.15 + 0.7 * number as f32 / count),
            height * rng.random_range(0.4..0.6),
        );
        let camera = frame.camera;
        let inside = |pixel: usize| {
            let x = (pixel as u32 % camera.width) as f32 + 0.5 - middle.0;
            let y = (pixel as u32 / camera.width) as f32 + 0.5 - middle.1;
            (x / (MOVING * width)).powi(2) + (y / (0.3 * height)).powi(2) < 1.0
        };
        let (before, depth) = (frame.color(), frame.depth());
        let pixels = 0..camera.pixels();
        let rgb = pixels
            .clone()
            .flat_map(|pixel| if inside(pixel) { color } else { before.pixel(pixel) });
        replace(frame, rgb.collect());
        if let Some(depth) = depth {
            let near = |pixel| match inside(pixel) {
                true => 0.8,
                false => depth.ray_length(pixel).unwrap_or(0.0),
            };
            let lengths: Vec<f32> = pixels.map(near).collect();
            frame.set_depth(Some(DepthMap::from_ray_lengths(camera.width, &lengths)));
        }
        // Nobody clicks on what is in the way.
        trial.labels.strokes.retain(|_, stroke| {
            let [x, y] = stroke.first_point().unwrap_or_default();
            stroke.frame != number || !inside((y * camera.width + x) as usize)
        });
    }
}
