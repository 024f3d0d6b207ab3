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
    /// A class with the next colour of the default palette.
    pub fn new(id: ClassId, name: impl Into<String>) -> Self {
        Self {
            id,
            name: name.into(),
            color: default_color(id),
        }
    }
}

/// Colours that stay distinct for most kinds of colour vision (Okabe-Ito first, then hues by golden
/// ratio at three lightnesses).
fn default_color(id: ClassId) -> [u8; 3] {
    const OKABE_ITO: [[u8; 3]; 7] = [
        [230, 159, 0],
        [86, 180, 233],
        [0, 158, 115],
        [240, 228, 66],
        [0, 114, 178],
        [213, 94, 0],
        [204, 121, 167],
    ];
    let index = usize::from(id.max(1) - 1);
    if let Some(&color) = OKABE_ITO.get(index) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    #[test]
    fn default_colors_of_the_first_forty_classes_differ() {
        let colors: HashSet<_> = (1..=40).map(|id| Class::new(id, "x").color).collect();
        assert_eq!(colors.len(), 40);
    }
}
