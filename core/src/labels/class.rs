//! Semantic classes.

use serde::{Deserialize, Serialize};

/// A class's number: the pixel value in exported label maps.
pub type ClassId = u16;

/// "Nothing here": never trained on, exported as 0.
pub const VOID: ClassId = 0;

/// A semantic class.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Class {
    /// Pixel value in label maps; stable for the life of a project.
    pub id: ClassId,
    /// Name for people.
    pub name: String,
    /// Display colour, sRGB.
    pub color: [u8; 3],
}

impl Class {
    /// A class with its default colour.
    pub fn new(id: ClassId, name: impl Into<String>) -> Self {
        Self {
            id,
            name: name.into(),
            color: default_color(id),
        }
    }

    /// Whether a name is that of this class, capitals and surrounding blanks aside.
    pub fn is_named(&self, name: &str) -> bool {
        self.name.trim().to_lowercase() == name.trim().to_lowercase()
    }
}

/// The default colour of a class, sRGB: one of [`DEFAULT_COLORS`], and beyond them hues by golden ratio at three
/// values (HSV).
pub fn default_color(id: ClassId) -> [u8; 3] {
    let index = usize::from(id.max(1) - 1);
    if let Some(&color) = DEFAULT_COLORS.get(index) {
        return color;
    }
    let hue = (index as f32 * 0.618_034).fract() * 6.0;
    let value = [0.95, 0.7, 0.5][index % 3];
    let saturation = [0.55, 0.75][index % 2];
    let channel = |offset: f32| {
        let k = (offset + hue).rem_euclid(6.0);
        let v = value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0);
        (v * 255.0).round() as u8
    };
    [channel(5.0), channel(3.0), channel(1.0)]
}

/// Colours that stay distinct for most kinds of colour vision: first those of Okabe and Ito (2008), then each time the
/// colour that is farthest from all before it, in CIELAB, as seen without a deficiency, with deuteranopia and with
/// protanopia (Machado et al. 2009). Lightness 30 to 90 and chroma from 30 on, to be seen on photographs.
#[rustfmt::skip]
pub const DEFAULT_COLORS: [[u8; 3]; 64] = [
    [230, 159, 0],
    [86, 180, 233],
    [0, 158, 115],
    [240, 228, 66],
    [0, 114, 178],
    [213, 94, 0],
    [204, 121, 167],
    [0, 0, 255],
    [135, 240, 150],
    [105, 105, 255],
    [150, 30, 30],
    [120, 45, 90],
    [135, 240, 255],
    [90, 240, 195],
    [255, 0, 90],
    [90, 30, 180],
    [105, 150, 255],
    [255, 150, 90],
    [120, 30, 120],
    [180, 45, 0],
    [210, 0, 180],
    [30, 75, 255],
    [150, 15, 60],
    [105, 195, 135],
    [60, 195, 210],
    [165, 75, 135],
    [75, 135, 75],
    [195, 240, 105],
    [90, 225, 210],
    [75, 210, 105],
    [90, 0, 210],
    [150, 75, 105],
    [105, 195, 165],
    [195, 90, 225],
    [240, 30, 60],
    [135, 210, 255],
    [150, 60, 210],
    [120, 15, 150],
    [30, 255, 180],
    [60, 210, 30],
    [105, 240, 120],
    [210, 0, 60],
    [90, 165, 105],
    [105, 75, 150],
    [165, 135, 195],
    [150, 165, 255],
    [180, 150, 45],
    [240, 195, 75],
    [15, 150, 135],
    [105, 45, 210],
    [165, 105, 165],
    [165, 90, 195],
    [135, 180, 75],
    [60, 225, 165],
    [90, 60, 180],
    [60, 105, 45],
    [135, 210, 135],
    [30, 90, 240],
    [210, 150, 195],
    [90, 180, 135],
    [0, 225, 225],
    [0, 135, 90],
    [120, 45, 105],
    [150, 30, 0],
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Row-major matrices on linear RGB: full colour vision, deuteranopia and protanopia (Machado, Oliveira and
    /// Fernandes 2009, severity 1.0).
    const VISIONS: [[[f64; 3]; 3]; 3] = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ],
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ],
    ];

    fn product(matrix: &[[f64; 3]; 3], vector: [f64; 3]) -> [f64; 3] {
        matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
    }

    /// CIELAB under D65 of an sRGB colour as it is seen.
    fn seen(color: [u8; 3], vision: &[[f64; 3]; 3]) -> [f64; 3] {
        const XYZ_OF_RGB: [[f64; 3]; 3] = [
            [0.4124564, 0.3575761, 0.1804375],
            [0.2126729, 0.7151522, 0.0721750],
            [0.0193339, 0.1191920, 0.9503041],
        ];
        let linear = color.map(|value| {
            let v = f64::from(value) / 255.0;
            if v <= 0.04045 {
                v / 12.92
            } else {
                ((v + 0.055) / 1.055).powf(2.4)
            }
        });
        let linear = product(vision, linear).map(|v| v.clamp(0.0, 1.0));
        let [x, y, z] = product(&XYZ_OF_RGB, linear);
        let [x, y, z] = [x / 0.95047, y, z / 1.08883].map(|t| {
            if t > 0.008856 {
                t.cbrt()
            } else {
                7.787037 * t + 16.0 / 116.0
            }
        });
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// The smallest CIELAB distance between any two of the first colours, whoever looks.
    fn smallest_distance(count: ClassId) -> f64 {
        let mut smallest = f64::INFINITY;
        for vision in &VISIONS {
            let colors: Vec<_> = (1..=count).map(|id| seen(default_color(id), vision)).collect();
            for (index, a) in colors.iter().enumerate() {
                for b in &colors[..index] {
                    let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
                    smallest = smallest.min(squares.sum::<f64>().sqrt());
                }
            }
        }
        smallest
    }

    #[test]
    fn the_first_colors_differ_for_the_colour_blind_too() {
        for (count, least) in [(12, 16.9), (24, 16.0), (48, 9.0), (64, 8.0)] {
            let smallest = smallest_distance(count);
            assert!(smallest >= least, "{count} colours: {smallest}");
        }
    }

    #[test]
    fn default_colors_are_neither_pale_nor_dark() {
        for color in DEFAULT_COLORS {
            let [lightness, a, b] = seen(color, &VISIONS[0]);
            assert!((30.0..92.0).contains(&lightness), "{color:?}");
            assert!(a.hypot(b) >= 29.0, "{color:?}");
        }
    }

    #[test]
    fn default_colors_of_the_first_hundred_classes_differ() {
        let colors: HashSet<_> = (1..=100).map(default_color).collect();
        assert_eq!(colors.len(), 100);
    }
}
