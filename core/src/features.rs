//! What a pretrained network sees in the images: which parts of a scene are alike, beyond their colours. The network is
//! in a file that the person brings; nothing is shipped or fetched.

mod components;
mod network;
mod weights;

use std::panic::catch_unwind;
use std::path::Path;
use std::sync::atomic::{AtomicBool, Ordering};

use candle_core::Error;
use image::RgbImage;
use image::imageops::{FilterType, resize};
use rayon::prelude::*;

use crate::scene::{ColorImage, Scene, in_one_line};
use components::Components;
use network::{CHANNELS, Planes};

pub use network::Network;
#[cfg(test)]
pub(crate) use network::tests::write_untrained;

/// Principal components that are kept of the network's features.
pub const COMPONENTS: usize = 48;
/// Longer side of an image as the network gets it, in pixels.
const SIDE: u32 = 640;
/// Most frames that are looked at, evenly chosen of the keyframes: more show the same once more.
const MOST_FRAMES: usize = 100;
/// The components are found with every so many of these.
const SAMPLED_EVERY: usize = 8;

/// Why there are no features.
#[derive(Debug, thiserror::Error)]
pub enum FeatureError {
    /// A file of something else, or one that cannot be read.
    #[error(
        "{path}: this is not MobileNetV2 as torchvision saves it ({reason}); the guide says where to get the file"
    )]
    Unknown {
        /// The file.
        path: String,
        /// What is wrong with it.
        reason: String,
    },
    /// The network did not work.
    #[error("the pretrained network failed ({}), so labels spread without it", in_one_line(.0))]
    Failed(#[from] Error),
    /// The thread that it runs on died.
    #[error("the pretrained network was ended by an internal error, so labels spread without it")]
    Ended,
}

impl Network {
    /// Reads MobileNetV2 in torchvision's names, from a file of torch.save or safetensors.
    ///
    /// # Errors
    /// A file that cannot be read, or of something else.
    pub fn read(path: &Path) -> Result<Self, FeatureError> {
        // candle takes a pickle at its word, and panics over one that lies.
        let read = catch_unwind(|| weights::read(path))
            .unwrap_or_else(|_| Err(Error::Msg("it is damaged".to_owned())));
        let network = read.and_then(|tensors| Self::new(&tensors));
        network.map_err(|error| FeatureError::Unknown {
            path: path.display().to_string(),
            reason: in_one_line(error),
        })
    }
}

/// Features of an image at a sixteenth of the size that the network gets it at.
#[derive(Clone, Debug)]
pub struct FrameFeatures {
    height: usize,
    width: usize,
    /// Row-major `[height, width, dimensions]`.
    values: Vec<f32>,
}

/// Features of a scene's images, reduced to their principal components.
#[derive(Clone, Debug)]
pub struct ImageFeatures {
    /// Those of the frames that were looked at, with the index of the frame, ascending.
    pub frames: Vec<(usize, FrameFeatures)>,
}

impl ImageFeatures {
    /// Looks at the keyframes, or at some of them where there are many, with the threads of the rayon pool in which this is
    /// called; `None` once it is told to stop.
    ///
    /// # Errors
    /// The network does not work.
    pub fn of(scene: &Scene, network: &Network, stop: &AtomicBool) -> Result<Option<Self>, FeatureError> {
        let keyframes = scene.keyframes();
        let every = keyframes.len().div_ceil(MOST_FRAMES).max(1);
        let chosen: Vec<usize> = keyframes.into_iter().step_by(every).collect();
        let looked_at = |frame: usize| match stop.load(Ordering::Relaxed) {
            true => Ok(None),
            false => raw(&scene.frames[frame].color(), network).map(Some),
        };
        let sample = chosen
            .par_iter()
            .step_by(SAMPLED_EVERY)
            .map(|&frame| looked_at(frame));
        let Some(sample) = sample.collect::<Result<Option<Vec<_>>, Error>>()? else {
            return Ok(None);
        };
        let values: Vec<Vec<f32>> = sample.into_iter().map(|frame| frame.values).collect();
        let dimensions = CHANNELS.iter().sum();
        let components = Components::of(&values.concat(), dimensions, COMPONENTS);
        let reduced = |raw: FrameFeatures| FrameFeatures {
            values: raw
                .values
                .chunks_exact(dimensions)
                .flat_map(|cell| components.project(cell))
                .collect(),
            ..raw
        };
        let frames = chosen
            .par_iter()
            .map(|&frame| Ok(looked_at(frame)?.map(|raw| (frame, reduced(raw)))));
        let frames = frames.collect::<Result<Option<Vec<_>>, FeatureError>>()?;
        Ok(frames.map(|frames| Self { frames }))
    }
}

impl FrameFeatures {
    /// Adds what is at a place, as a share of the image's width and height, between the four cells around it.
    pub fn add_at(&self, x: f32, y: f32, sum: &mut [f32]) {
        let [(column, right), (row, down)] = [(x, self.width), (y, self.height)].map(|(share, size)| {
            let at = (share * size as f32 - 0.5).clamp(0.0, size as f32 - 1.0);
            (at as usize, at.fract())
        });
        let dimensions = sum.len();
        for (row, vertically) in [(row, 1.0 - down), ((row + 1).min(self.height - 1), down)] {
            for (column, across) in [(column, 1.0 - right), ((column + 1).min(self.width - 1), right)] {
                let cell = &self.values[(row * self.width + column) * dimensions..][..dimensions];
                let weight = vertically * across;
                sum.iter_mut()
                    .zip(cell)
                    .for_each(|(sum, value)| *sum += weight * value);
            }
        }
    }
}

/// Scales a vector to unit length; zero stays zero.
pub(crate) fn normalise(vector: &mut [f32]) {
    let length = dot(vector, vector).sqrt();
    if length > 0.0 {
        vector.iter_mut().for_each(|value| *value /= length);
    }
}

/// The scalar product of two vectors.
pub(crate) fn dot(a: &[f32], b: &[f32]) -> f32 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// The network's features of an image, those of each block of unit length, brought to the size of the first.
fn raw(image: &ColorImage, network: &Network) -> Result<FrameFeatures, Error> {
    let [fine, coarse] = network.run(planes(image))?.map(unit_cells);
    let (height, width) = (fine.height, fine.width);
    let [own, lent] = CHANNELS;
    let mut values = vec![0.0; height * width * (own + lent)];
    for (index, cell) in values.chunks_exact_mut(own + lent).enumerate() {
        cell[..own].copy_from_slice(&fine.values[index * own..][..own]);
        let [x, y] = [(index % width, width), (index / width, height)]
            .map(|(at, size)| (at as f32 + 0.5) / size as f32);
        coarse.add_at(x, y, &mut cell[own..]);
    }
    Ok(FrameFeatures {
        height,
        width,
        values,
    })
}

/// Planes turned into a vector of unit length for each place.
fn unit_cells(planes: Planes) -> FrameFeatures {
    let (height, width) = (planes.height, planes.width);
    let cell = |cell: usize| planes.values.iter().skip(cell).step_by(height * width).copied();
    let mut values: Vec<f32> = (0..height * width).flat_map(cell).collect();
    values
        .chunks_exact_mut(planes.values.len() / (height * width))
        .for_each(normalise);
    FrameFeatures {
        height,
        width,
        values,
    }
}

/// An image as the network gets it, channels in 0..=1.
fn planes(image: &ColorImage) -> Planes {
    let scale = f64::from(SIDE) / f64::from(image.width().max(image.height()));
    let side = |length: u32| ((f64::from(length) * scale).round() as u32).max(32);
    let (width, height) = (side(image.width()), side(image.height()));
    let own = RgbImage::from_raw(image.width(), image.height(), image.bytes().to_vec()).unwrap_or_default();
    let resized = resize(&own, width, height, FilterType::Triangle);
    let channel = |channel: usize| {
        resized
            .pixels()
            .map(move |pixel| f32::from(pixel[channel]) / 255.0)
    };
    let values = (0..3).flat_map(channel).collect();
    Planes::new(height as usize, width as usize, values)
}
