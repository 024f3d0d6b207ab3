//! Colours of classes and of entropy: one table for the shader and for the CPU composite.

use std::collections::BTreeSet;
use std::sync::Arc;

use inplace_core::labels::{Class, ClassId, VOID};
use inplace_core::session::ENTROPY_STEPS_PER_NAT;

/// What the canvas lays over the colour image.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layer {
    /// Nothing.
    Color,
    /// The class of every pixel.
    #[default]
    Labels,
    /// How unsure the class of every pixel is.
    Entropy,
}

impl Layer {
    /// All layers, in the order in which the key cycles through them.
    pub const ALL: [Self; 3] = [Self::Color, Self::Labels, Self::Entropy];

    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Color => "Colour",
            Self::Labels => "Labels",
            Self::Entropy => "Entropy",
        }
    }

    /// The next layer.
    pub fn next(self) -> Self {
        match self {
            Self::Color => Self::Labels,
            Self::Labels => Self::Entropy,
            Self::Entropy => Self::Color,
        }
    }
}

/// Colour of strokes that say void.
pub const VOID_COLOR: [u8; 3] = [96, 100, 108];

/// Columns of the palette as a texture.
pub const PALETTE_COLUMNS: usize = 256;

/// RGBA of every class id, and of entropy.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Palette {
    /// Indexed by class id; a multiple of [`PALETTE_COLUMNS`] long; transparent where there is no class.
    classes: Vec<[u8; 4]>,
    /// From sure to unsure.
    entropy: Vec<[u8; 4]>,
    /// Number of classes.
    count: usize,
}

impl Palette {
    /// The colours of these classes.
    pub fn new(classes: &[Class]) -> Arc<Self> {
        Self::hiding(classes, &BTreeSet::new())
    }

    /// The colours of these classes; the hidden ones are transparent.
    pub fn hiding(classes: &[Class], hidden: &BTreeSet<ClassId>) -> Arc<Self> {
        let highest = classes.iter().map(|class| class.id).max().unwrap_or(VOID);
        let length = (usize::from(highest) + 1).next_multiple_of(PALETTE_COLUMNS);
        let mut table = vec![[0; 4]; length];
        for class in classes.iter().filter(|class| !hidden.contains(&class.id)) {
            let [r, g, b] = class.color;
            table[usize::from(class.id)] = [r, g, b, 255];
        }
        Arc::new(Self {
            classes: table,
            entropy: (0..PALETTE_COLUMNS).map(entropy_color).collect(),
            count: classes.len(),
        })
    }

    /// RGBA of a class; transparent for void and for unknown classes.
    pub fn class(&self, id: ClassId) -> [u8; 4] {
        self.classes.get(usize::from(id)).copied().unwrap_or_default()
    }

    /// RGBA of an entropy in steps of [`FrameMap::entropy`](inplace_core::session::FrameMap::entropy).
    pub fn entropy(&self, steps: u16) -> [u8; 4] {
        let index = (f32::from(steps) * self.entropy_scale()) as usize;
        self.entropy[index.min(PALETTE_COLUMNS - 1)]
    }

    /// Entropy steps to an index into the entropy colours: the last stands for an even guess among all classes.
    pub fn entropy_scale(&self) -> f32 {
        let most = (self.count.max(2) as f32).ln() * ENTROPY_STEPS_PER_NAT;
        (PALETTE_COLUMNS - 1) as f32 / most
    }

    /// Row of the texture that holds the entropy colours; the rows above hold the classes.
    pub fn entropy_row(&self) -> usize {
        self.classes.len() / PALETTE_COLUMNS
    }

    /// RGBA texels, row-major, `PALETTE_COLUMNS` wide and [`Palette::entropy_row`] + 1 high.
    pub fn texels(&self) -> Vec<u8> {
        let rows = self.classes.iter().chain(&self.entropy);
        rows.flatten().copied().collect()
    }
}

/// Dark violet over red and orange to light yellow, evenly brighter.
fn entropy_color(index: usize) -> [u8; 4] {
    const STOPS: [[f32; 3]; 6] = [
        [11.0, 8.0, 35.0],
        [67.0, 16.0, 104.0],
        [140.0, 41.0, 99.0],
        [212.0, 72.0, 66.0],
        [251.0, 155.0, 38.0],
        [252.0, 250.0, 170.0],
    ];
    let place = index as f32 / (PALETTE_COLUMNS - 1) as f32 * (STOPS.len() - 1) as f32;
    let below = (place as usize).min(STOPS.len() - 2);
    let t = place - below as f32;
    let channel = |c: usize| (STOPS[below][c] + t * (STOPS[below + 1][c] - STOPS[below][c])).round() as u8;
    [channel(0), channel(1), channel(2), 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn void_and_unknown_classes_are_transparent() {
        let palette = Palette::new(&[Class::new(3, "wall")]);
        assert_eq!(palette.class(VOID)[3], 0);
        assert_eq!(palette.class(2)[3], 0);
        assert_eq!(palette.class(3)[3], 255);
        assert_eq!(palette.class(60_000)[3], 0);
    }

    #[test]
    fn hidden_classes_are_transparent_and_change_nothing_else() {
        let classes = [Class::new(1, "wall"), Class::new(2, "lamp")];
        let palette = Palette::hiding(&classes, &BTreeSet::from([2]));
        assert_eq!((palette.class(1)[3], palette.class(2)[3]), (255, 0));
        assert_eq!(palette.entropy_scale(), Palette::new(&classes).entropy_scale());
    }

    #[test]
    fn the_texture_holds_classes_above_the_entropy_row() {
        let palette = Palette::new(&[Class::new(300, "lamp")]);
        assert_eq!(palette.entropy_row(), 2);
        let texels = palette.texels();
        assert_eq!(texels.len(), 3 * PALETTE_COLUMNS * 4);
        assert_eq!(texels[300 * 4..300 * 4 + 4], palette.class(300));
    }

    #[test]
    fn entropy_runs_from_the_first_to_the_last_colour() {
        let palette = Palette::new(&[Class::new(1, "a"), Class::new(2, "b")]);
        let even_guess = (2.0_f32.ln() * ENTROPY_STEPS_PER_NAT).ceil() as u16;
        assert_eq!(palette.entropy(0), entropy_color(0));
        assert_eq!(palette.entropy(even_guess), entropy_color(255));
        assert_eq!(palette.entropy(u16::MAX), entropy_color(255));
    }
}
