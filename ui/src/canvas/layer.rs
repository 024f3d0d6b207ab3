//! What the canvas can show of a frame.

use crate::english::layers;

/// What the canvas shows of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Layer {
    /// The image alone.
    Color,
    /// The class of every pixel.
    #[default]
    Labels,
    /// How unsure the class of every pixel is.
    Entropy,
    /// Where what was said and what became of it are different classes.
    Disagreement,
    /// How far away every pixel is.
    Depth,
    /// The field as seen from the frame.
    Rendered,
}

impl Layer {
    /// All layers, in the order in which the key cycles through them and in which projects number them.
    pub const ALL: [Self; 6] = [
        Self::Color,
        Self::Labels,
        Self::Entropy,
        Self::Disagreement,
        Self::Depth,
        Self::Rendered,
    ];

    /// Name for people.
    pub fn name(self) -> &'static str {
        layers::NAMES[self.number()]
    }

    /// What it shows, in a sentence.
    pub fn explanation(self) -> &'static str {
        layers::EXPLANATIONS[self.number()]
    }

    /// Its place in [`Layer::ALL`].
    pub fn number(self) -> usize {
        self as usize
    }

    /// The next layer.
    #[must_use]
    pub fn next(self) -> Self {
        Self::ALL[(self.number() + 1) % Self::ALL.len()]
    }

    /// Whether it lies over the image, so that it can be more or less opaque.
    pub fn covers(self) -> bool {
        !matches!(self, Self::Color | Self::Rendered)
    }

    /// What a small picture of a frame shows instead: its map, where this needs more than that.
    #[must_use]
    pub fn in_small(self) -> Self {
        match self {
            Self::Color | Self::Labels | Self::Entropy => self,
            Self::Disagreement | Self::Depth | Self::Rendered => Self::Labels,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_key_shows_every_layer_before_it_comes_back() {
        let mut layer = Layer::Color;
        for expected in Layer::ALL {
            assert_eq!((layer, layer.number()), (expected, expected as usize));
            layer = layer.next();
        }
        assert_eq!(layer, Layer::Color);
    }
}
