//! What the canvas can show of a frame.

/// What the canvas shows of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Layer {
    /// The image alone.
    Color = 0,
    /// The class of every pixel.
    #[default]
    Labels = 1,
    /// Which thing of its class every pixel is on.
    Objects = 9,
    /// How unsure the class of every pixel is.
    Entropy = 2,
    /// Where the labels and the map made from them are of different classes.
    Disagreement = 3,
    /// Where the map and that of another project are of different classes.
    Differences = 10,
    /// How far away every pixel is.
    Depth = 4,
    /// The field as seen from the frame, or from the camera of the 3D view: its colours,
    Rendered = 5,
    /// its classes,
    RenderedLabels = 6,
    /// how unsure they are,
    RenderedEntropy = 7,
    /// and how far away it is.
    RenderedDepth = 8,
}

impl Layer {
    /// All layers, in the order in which the key cycles through them.
    pub const ALL: [Self; 11] = [
        Self::Color,
        Self::Labels,
        Self::Objects,
        Self::Entropy,
        Self::Disagreement,
        Self::Differences,
        Self::Depth,
        Self::Rendered,
        Self::RenderedLabels,
        Self::RenderedEntropy,
        Self::RenderedDepth,
    ];

    /// The layers that there are, in this order; `compared` says whether the scene is compared with another project.
    pub fn present(compared: bool) -> impl Iterator<Item = Self> {
        Self::ALL
            .into_iter()
            .filter(move |layer| layer.is_there(compared))
    }

    fn is_there(self, compared: bool) -> bool {
        compared || self != Self::Differences
    }

    /// Name for people.
    pub fn name(self) -> &'static str {
        match self {
            Self::Color => "Colour",
            Self::Labels => "Labels",
            Self::Objects => "Objects",
            Self::Entropy => "Entropy",
            Self::Disagreement => "Disagreement",
            Self::Differences => "Differences",
            Self::Depth => "Depth",
            Self::Rendered => "Field colour",
            Self::RenderedLabels => "Field labels",
            Self::RenderedEntropy => "Field entropy",
            Self::RenderedDepth => "Field depth",
        }
    }

    /// What it shows, in a sentence.
    pub fn explanation(self) -> &'static str {
        match self {
            Self::Color => "The image alone",
            Self::Labels => "The class of every pixel",
            Self::Objects => "Every thing that can be counted in a colour of its own",
            Self::Entropy => "How unsure the class of every pixel is",
            Self::Disagreement => {
                "Where what you or an imported image said is another class than what became of it"
            }
            Self::Differences => "Where the project that you compare with has another class",
            Self::Depth => {
                "How far away every pixel is: as measured, or as rendered where the capture has no depth"
            }
            Self::Rendered => "The learnt scene as seen from this frame, or from the camera of the 3D view",
            Self::RenderedLabels => "The classes that the learnt scene has as seen from there",
            Self::RenderedEntropy => "How unsure the classes of the learnt scene are",
            Self::RenderedDepth => "How far away the learnt scene is",
        }
    }

    /// Its number in projects, which stays the same.
    pub fn number(self) -> u64 {
        self as u64
    }

    /// The layer with this number.
    pub fn numbered(number: u64) -> Option<Self> {
        Self::ALL.into_iter().find(|layer| layer.number() == number)
    }

    /// The next layer of those that there are; it need not be one of them itself.
    #[must_use]
    pub fn next(self, compared: bool) -> Self {
        let from = Self::ALL.into_iter().cycle().skip_while(|&layer| layer != self);
        let next = from.skip(1).find(|layer| layer.is_there(compared));
        next.unwrap_or(self)
    }

    /// Whether it is a view of the field.
    pub fn is_rendered(self) -> bool {
        self == self.of_field(true)
    }

    /// The layer that shows the same of the field, or of the frame.
    #[must_use]
    pub fn of_field(self, field: bool) -> Self {
        let pairs = [
            (Self::Color, Self::Rendered),
            (Self::Labels, Self::RenderedLabels),
            (Self::Entropy, Self::RenderedEntropy),
            (Self::Depth, Self::RenderedDepth),
        ];
        let same = pairs
            .into_iter()
            .find(|&(own, rendered)| self == own || self == rendered);
        match (same, field) {
            (Some((_, rendered)), true) => rendered,
            (Some((own, _)), false) => own,
            (None, true) => Self::RenderedLabels,
            (None, false) => self,
        }
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
            _ => Self::Labels,
        }
    }
}

/// How a frame is composed with what lies over it.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Look {
    /// What lies over the image.
    pub layer: Layer,
    /// How much it covers, 0..=1.
    pub opacity: f32,
    /// Whether borders between classes are drawn.
    pub outlines: bool,
}

impl Look {
    /// The image alone.
    pub const PLAIN: Self = Self {
        layer: Layer::Color,
        opacity: 0.0,
        outlines: false,
    };
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layer_of_a_comparison_has_its_turn_only_in_one_and_a_next_one_after_it() {
        for (layer, compared, next) in [
            (Layer::Disagreement, true, Layer::Differences),
            (Layer::Disagreement, false, Layer::Depth),
            (Layer::Differences, false, Layer::Depth),
            (Layer::RenderedDepth, false, Layer::Color),
        ] {
            assert_eq!(layer.next(compared), next);
        }
    }
}
