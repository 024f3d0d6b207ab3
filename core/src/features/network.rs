//! MobileNetV2 (Sandler et al., "MobileNetV2: Inverted Residuals and Linear Bottlenecks", CVPR 2018), up to its last block.

use std::collections::HashMap;

use candle_core::{DType, Device, Error, Result, Tensor};

/// Blocks: factor of expansion, channels, repetitions, stride of the first (Table 2).
const BLOCKS: [(usize, usize, usize, usize); 7] = [
    (1, 16, 1, 1),
    (6, 24, 2, 2),
    (6, 32, 3, 2),
    (6, 64, 4, 2),
    (6, 96, 3, 1),
    (6, 160, 3, 2),
    (6, 320, 1, 1),
];
/// The blocks whose output is read, counted from 1: at 1/16 and 1/32 of the image's size.
const READ: [usize; 2] = [13, 17];
/// Channels of these.
pub(super) const CHANNELS: [usize; 2] = [96, 320];
/// Mean and deviation of the colours that the network was trained on, of red, green and blue in 0..=1.
const MEAN: [f32; 3] = [0.485, 0.456, 0.406];
const DEVIATION: [f32; 3] = [0.229, 0.224, 0.225];
/// Added to variances before their root is taken, as in training.
const EPSILON: f64 = 1e-5;
/// Largest output of the activation.
const MOST_ACTIVE: f32 = 6.0;

/// Numbers of an image or layer, `[channels, height, width]`.
#[derive(Clone)]
pub(super) struct Planes {
    pub height: usize,
    pub width: usize,
    pub values: Vec<f32>,
}

impl Planes {
    pub fn new(height: usize, width: usize, values: Vec<f32>) -> Self {
        Self {
            height,
            width,
            values,
        }
    }
}

/// A convolution and the normalisation behind it, in torchvision's names.
struct Layer {
    name: String,
    norm: String,
    /// `[out, in, height, width]`; with a single `in` where each channel has a kernel of its own.
    shape: [usize; 4],
    stride: usize,
    is_active: bool,
}

/// The layers block by block; the stem is the block before the first.
fn layers() -> Vec<Vec<Layer>> {
    let layer = |name: String, norm: String, shape, stride, is_active| Layer {
        name: format!("features.{name}"),
        norm: format!("features.{norm}"),
        shape,
        stride,
        is_active,
    };
    let mut blocks = vec![vec![layer("0.0".into(), "0.1".into(), [32, 3, 3, 3], 2, true)]];
    let mut channels = 32;
    for (expansion, out, repetitions, first) in BLOCKS {
        for repetition in 0..repetitions {
            let number = blocks.len();
            let part = |part: &str| format!("{number}.conv.{part}");
            let (inner, stride) = (channels * expansion, if repetition == 0 { first } else { 1 });
            let mut block = Vec::new();
            if expansion > 1 {
                block.push(layer(part("0.0"), part("0.1"), [inner, channels, 1, 1], 1, true));
            }
            let at = block.len();
            let [own, norm] = [0, 1].map(|index| part(&format!("{at}.{index}")));
            block.push(layer(own, norm, [inner, 1, 3, 3], stride, true));
            let [own, norm] = [at + 1, at + 2].map(|index| part(&index.to_string()));
            block.push(layer(own, norm, [out, inner, 1, 1], 1, false));
            blocks.push(block);
            channels = out;
        }
    }
    blocks
}

/// A layer's weights, with the normalisation folded in.
struct Convolution {
    weight: Tensor,
    bias: Vec<f32>,
    stride: usize,
    is_active: bool,
}

/// The network.
pub struct Network {
    blocks: Vec<Vec<Convolution>>,
}

impl Network {
    /// Of torchvision's tensors.
    pub(super) fn new(tensors: &HashMap<String, Tensor>) -> Result<Self> {
        let block = |block: &Vec<Layer>| {
            block
                .iter()
                .map(|layer| Convolution::new(tensors, layer))
                .collect()
        };
        let blocks = layers().iter().map(block).collect::<Result<_>>()?;
        Ok(Self { blocks })
    }

    /// What the [read](READ) blocks make of an image with channels in 0..=1.
    pub(super) fn run(&self, mut image: Planes) -> Result<[Planes; 2]> {
        let pixels = image.height * image.width;
        for (channel, plane) in image.values.chunks_exact_mut(pixels).enumerate() {
            let (mean, deviation) = (MEAN[channel], DEVIATION[channel]);
            plane
                .iter_mut()
                .for_each(|value| *value = (*value - mean) / deviation);
        }
        let mut now = image;
        let mut read = Vec::new();
        for (number, block) in self.blocks.iter().enumerate() {
            let mut inner = block[0].apply(&now)?;
            for layer in &block[1..] {
                inner = layer.apply(&inner)?;
            }
            // Blocks that leave the shape as it is add to what they get.
            if inner.values.len() == now.values.len() {
                let values = inner.values.iter_mut().zip(&now.values);
                values.for_each(|(new, old)| *new += old);
            }
            now = inner;
            if READ.contains(&number) {
                read.push(now.clone());
            }
        }
        read.try_into()
            .map_err(|_| Error::Msg("a block is missing".to_owned()))
    }
}

impl Convolution {
    fn new(tensors: &HashMap<String, Tensor>, layer: &Layer) -> Result<Self> {
        let get = |name: String, shape: &[usize]| {
            let tensor = tensors.get(&name).filter(|tensor| tensor.dims() == shape);
            let tensor = tensor.ok_or_else(|| Error::Msg(format!("{name} of shape {shape:?} is missing")))?;
            tensor.to_dtype(DType::F32)
        };
        let out = layer.shape[0];
        let norm = |part: &str| get(format!("{}.{part}", layer.norm), &[out]);
        let scale = norm("weight")?.div(&(norm("running_var")? + EPSILON)?.sqrt()?)?;
        let bias = norm("bias")?.sub(&norm("running_mean")?.mul(&scale)?)?;
        let weight = get(format!("{}.weight", layer.name), &layer.shape)?;
        Ok(Self {
            weight: finite(
                weight.broadcast_mul(&scale.reshape((out, 1, 1, 1))?)?,
                &layer.name,
            )?,
            bias: finite(bias, &layer.norm)?.to_vec1()?,
            stride: layer.stride,
            is_active: layer.is_active,
        })
    }

    fn apply(&self, input: &Planes) -> Result<Planes> {
        let (out, inner, side, _) = self.weight.dims4()?;
        let mut output = if side == 1 {
            let (height, width) = (input.height, input.width);
            let pixels = Tensor::from_slice(&input.values, (inner, height * width), &Device::Cpu)?;
            let values = self.weight.reshape((out, inner))?.matmul(&pixels)?;
            Planes::new(height, width, values.flatten_all()?.to_vec1()?)
        } else if inner == 1 {
            self.depthwise(input)?
        } else {
            let image =
                Tensor::from_slice(&input.values, (1, inner, input.height, input.width), &Device::Cpu)?;
            let values = image.conv2d(&self.weight, 1, self.stride, 1, 1)?;
            let (_, _, height, width) = values.dims4()?;
            Planes::new(height, width, values.flatten_all()?.to_vec1()?)
        };
        let pixels = output.height * output.width;
        let (lowest, highest) = if self.is_active {
            (0.0, MOST_ACTIVE)
        } else {
            (f32::MIN, f32::MAX)
        };
        for (plane, bias) in output.values.chunks_exact_mut(pixels).zip(&self.bias) {
            plane
                .iter_mut()
                .for_each(|value| *value = (*value + bias).clamp(lowest, highest));
        }
        Ok(output)
    }

    /// Each channel by a kernel of its own, 3 x 3.
    fn depthwise(&self, input: &Planes) -> Result<Planes> {
        let kernels: Vec<f32> = self.weight.flatten_all()?.to_vec1()?;
        let (height, width, stride) = (input.height, input.width, self.stride);
        let (rows, columns) = ((height - 1) / stride + 1, (width - 1) / stride + 1);
        let mut values = vec![0.0; kernels.len() / 9 * rows * columns];
        let planes = input
            .values
            .chunks_exact(height * width)
            .zip(kernels.chunks_exact(9));
        for (output, (plane, kernel)) in values.chunks_exact_mut(rows * columns).zip(planes) {
            for (row, output) in output.chunks_exact_mut(columns).enumerate() {
                for (down, weights) in kernel.chunks_exact(3).enumerate() {
                    let Some(from) = (row * stride + down).checked_sub(1).filter(|&from| from < height)
                    else {
                        continue;
                    };
                    let line = &plane[from * width..][..width];
                    for (across, weight) in weights.iter().enumerate() {
                        // The first column that the kernel reads inside the line, and what it reads there.
                        let first = usize::from(across == 0);
                        let seen = line[first * stride + across - 1..].iter().step_by(stride);
                        for (output, value) in output[first..].iter_mut().zip(seen) {
                            *output += weight * value;
                        }
                    }
                }
            }
        }
        Ok(Planes::new(rows, columns, values))
    }
}

/// A tensor of numbers that are all finite.
fn finite(tensor: Tensor, name: &str) -> Result<Tensor> {
    let values: Vec<f32> = tensor.flatten_all()?.to_vec1()?;
    match values.iter().all(|value| value.is_finite()) {
        true => Ok(tensor),
        false => Err(Error::Msg(format!(
            "{name} has values that are not finite numbers"
        ))),
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use std::path::Path;

    use rand::rngs::StdRng;
    use rand::{Rng, SeedableRng};

    use super::*;

    /// Writes a network with random weights as safetensors.
    pub(crate) fn write_untrained(path: &Path) {
        let mut random = StdRng::seed_from_u64(0);
        let mut tensors = HashMap::new();
        let mut layer = |name: &str, norm: &str, shape: [usize; 4]| {
            let spread = (2.0 / (shape[1] * shape[2] * shape[3]) as f32).sqrt();
            let count = shape.iter().product::<usize>();
            let numbers: Vec<f32> = (0..count)
                .map(|_| spread * random.random_range(-1.7..1.7))
                .collect();
            let weight = Tensor::from_vec(numbers, &shape, &Device::Cpu).unwrap();
            tensors.insert(format!("{name}.weight"), weight);
            let parts = [
                ("weight", 1.0),
                ("bias", 0.0),
                ("running_mean", 0.0),
                ("running_var", 1.0),
            ];
            for (part, value) in parts {
                let value = Tensor::full(value, shape[0], &Device::Cpu)
                    .unwrap()
                    .to_dtype(DType::F32);
                tensors.insert(format!("{norm}.{part}"), value.unwrap());
            }
        };
        for of in layers().iter().flatten() {
            layer(&of.name, &of.norm, of.shape);
        }
        candle_core::safetensors::save(&tensors, path).unwrap();
    }

    #[test]
    fn kernels_of_single_channels_are_what_candle_computes_in_groups() {
        let numbers = |count: usize| {
            (0..count)
                .map(|k| ((k * 37) % 19) as f32 - 9.0)
                .collect::<Vec<f32>>()
        };
        for (stride, height, width) in [(1, 5, 8), (2, 6, 7), (2, 5, 8)] {
            let weight = Tensor::from_vec(numbers(27), (3, 1, 3, 3), &Device::Cpu).unwrap();
            let values = numbers(3 * height * width);
            let image = Tensor::from_slice(&values, (1, 3, height, width), &Device::Cpu).unwrap();
            let expected = image.conv2d(&weight, 1, stride, 1, 3).unwrap();
            let own = Convolution {
                weight,
                bias: vec![0.0; 3],
                stride,
                is_active: false,
            };
            let own = own.apply(&Planes::new(height, width, values)).unwrap();
            assert_eq!(expected.dims(), [1, 3, own.height, own.width]);
            assert_eq!(
                expected.flatten_all().unwrap().to_vec1::<f32>().unwrap(),
                own.values
            );
        }
    }

    #[test]
    fn two_blocks_are_read_at_a_sixteenth_and_a_thirty_second_of_the_size() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("untrained.safetensors");
        write_untrained(&path);
        let network = Network::read(&path).unwrap();
        let image = Planes::new(64, 96, vec![0.5; 3 * 64 * 96]);
        let [fine, coarse] = network.run(image).unwrap();
        assert_eq!(
            (fine.height, fine.width, fine.values.len()),
            (4, 6, CHANNELS[0] * 24)
        );
        assert_eq!(
            (coarse.height, coarse.width, coarse.values.len()),
            (2, 3, CHANNELS[1] * 6)
        );
    }
}
