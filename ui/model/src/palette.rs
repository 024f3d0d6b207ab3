//! Colours of classes and of values: one table for the shader and for the CPU composite.

use std::sync::Arc;

use inplace_core::export::Difference;
use inplace_core::labels::{Class, ClassId, VOID};
use inplace_core::session::ENTROPY_STEPS_PER_NAT;

use crate::class_view::Hidden;

/// Name of class 0.
pub const VOID_NAME: &str = "void";
/// Colour of class 0.
pub const VOID_COLOR: [u8; 3] = [96, 100, 108];

/// Columns of the palette as a texture.
pub const PALETTE_COLUMNS: usize = 256;

/// A row of colours for values.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Table {
    /// Dark violet over red and orange to light yellow, evenly brighter.
    Entropy,
    /// Light yellow over green to dark blue, evenly darker: near is light.
    Depth,
    /// One colour for each [`Agreement`].
    Disagreement,
    /// One colour for each [`Difference`], by its number.
    Differences,
}

impl Table {
    const ALL: [Self; 4] = [Self::Entropy, Self::Depth, Self::Disagreement, Self::Differences];

    /// RGBA of a column.
    pub fn color(self, column: usize) -> [u8; 4] {
        match self {
            Self::Entropy => between(&ENTROPY_STOPS, column),
            Self::Depth => between(&DEPTH_STOPS, column),
            Self::Disagreement => Agreement::ALL
                .get(column)
                .map_or([0; 4], |agreement| agreement.color()),
            Self::Differences => [Difference::Alone, Difference::Different]
                .into_iter()
                .find(|&difference| difference as usize == column)
                .map_or([0; 4], difference_color),
        }
    }
}

/// Whether a labelled pixel agrees with what came of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Agreement {
    /// It is not labelled by hand or import.
    Unlabelled,
    /// It is as it was labelled.
    Agreed,
    /// An imported image says another class than the map.
    ImportContradicted,
    /// A stroke says another class than the others would.
    StrokeContradicted,
}

impl Agreement {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 4] = [
        Self::Unlabelled,
        Self::Agreed,
        Self::ImportContradicted,
        Self::StrokeContradicted,
    ];

    /// RGBA over the dimmed image: blue, amber and magenta are told apart by colour-blind people too, and by
    /// their brightness.
    pub fn color(self) -> [u8; 4] {
        match self {
            Self::Unlabelled => [0; 4],
            Self::Agreed => [100, 143, 255, 90],
            Self::ImportContradicted => [255, 176, 0, 255],
            Self::StrokeContradicted => [230, 30, 130, 255],
        }
    }
}

/// RGBA of what two projects say of a pixel over the dimmed image: amber and violet are told apart by colour-blind people
/// too, and by their brightness.
pub fn difference_color(difference: Difference) -> [u8; 4] {
    match difference {
        Difference::Nothing | Difference::Same => [0; 4],
        Difference::Alone => [120, 94, 240, 255],
        Difference::Different => [255, 176, 0, 255],
    }
}

/// RGBA of every class id, and of values.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Palette {
    /// Indexed by class id; a multiple of [`PALETTE_COLUMNS`] long; transparent where there is no class.
    classes: Vec<[u8; 4]>,
    /// The rows of [`Table::ALL`].
    tables: Vec<[u8; 4]>,
    /// Number of classes.
    count: usize,
    /// What is transparent of it.
    pub hidden: Hidden,
}

impl Palette {
    /// The colours of these classes.
    pub fn new(classes: &[Class]) -> Arc<Self> {
        Self::hiding(classes, &Hidden::default())
    }

    /// The colours of these classes; the hidden ones are transparent.
    pub fn hiding(classes: &[Class], hidden: &Hidden) -> Arc<Self> {
        let highest = classes.iter().map(|class| class.id).max().unwrap_or(VOID);
        let length = (usize::from(highest) + 1).next_multiple_of(PALETTE_COLUMNS);
        let mut table = vec![[0; 4]; length];
        for class in classes.iter().filter(|class| !hidden.classes.contains(&class.id)) {
            let [r, g, b] = class.color;
            table[usize::from(class.id)] = [r, g, b, 255];
        }
        Arc::new(Self {
            hidden: hidden.clone(),
            ..Self::of(table, classes.len())
        })
    }

    /// The same with these RGBA in place of the colours of classes 1, 2 and so on.
    pub fn listing(colors: impl Iterator<Item = [u8; 4]>) -> Arc<Self> {
        let mut classes: Vec<[u8; 4]> = std::iter::once([0; 4]).chain(colors).collect();
        let count = classes.len() - 1;
        classes.resize(classes.len().next_multiple_of(PALETTE_COLUMNS), [0; 4]);
        Arc::new(Self::of(classes, count))
    }

    fn of(classes: Vec<[u8; 4]>, count: usize) -> Self {
        let row = |table: Table| (0..PALETTE_COLUMNS).map(move |column| table.color(column));
        Self {
            classes,
            tables: Table::ALL.into_iter().flat_map(row).collect(),
            count,
            hidden: Hidden::default(),
        }
    }

    /// RGBA of a class; transparent for void and for unknown classes.
    pub fn class(&self, id: ClassId) -> [u8; 4] {
        self.classes.get(usize::from(id)).copied().unwrap_or_default()
    }

    /// RGBA of a column of a table; that of the last column beyond it.
    pub fn value(&self, table: Table, column: usize) -> [u8; 4] {
        self.tables[table as usize * PALETTE_COLUMNS + column.min(PALETTE_COLUMNS - 1)]
    }

    /// The largest entropy that there can be, in nats: an even guess among all classes.
    pub fn most_entropy(&self) -> f32 {
        (self.count.max(2) as f32).ln()
    }

    /// Steps of [`FrameMap::entropy`](inplace_core::session::FrameMap::entropy) to a column of their table: the
    /// last stands for an even guess among all classes.
    pub fn entropy_scale(&self) -> f32 {
        (PALETTE_COLUMNS - 1) as f32 / (self.most_entropy() * ENTROPY_STEPS_PER_NAT)
    }

    /// Rows of the texture that hold classes.
    pub fn class_rows(&self) -> usize {
        self.classes.len() / PALETTE_COLUMNS
    }

    /// Row of the texture that holds a table.
    pub fn row(&self, table: Table) -> usize {
        self.class_rows() + table as usize
    }

    /// Rows of the texture.
    pub fn rows(&self) -> usize {
        self.class_rows() + Table::ALL.len()
    }

    /// RGBA texels, row-major, `PALETTE_COLUMNS` wide and [`Palette::rows`] high.
    pub fn texels(&self) -> Vec<u8> {
        let rows = self.classes.iter().chain(&self.tables);
        rows.flatten().copied().collect()
    }
}

const ENTROPY_STOPS: [[f32; 3]; 6] = [
    [11.0, 8.0, 35.0],
    [67.0, 16.0, 104.0],
    [140.0, 41.0, 99.0],
    [212.0, 72.0, 66.0],
    [251.0, 155.0, 38.0],
    [252.0, 250.0, 170.0],
];

const DEPTH_STOPS: [[f32; 3]; 6] = [
    [253.0, 231.0, 84.0],
    [160.0, 206.0, 92.0],
    [74.0, 168.0, 124.0],
    [44.0, 121.0, 142.0],
    [52.0, 74.0, 134.0],
    [40.0, 22.0, 70.0],
];

/// The colour of a column between evenly spaced stops.
fn between(stops: &[[f32; 3]; 6], column: usize) -> [u8; 4] {
    let place = column as f32 / (PALETTE_COLUMNS - 1) as f32 * (stops.len() - 1) as f32;
    let below = (place as usize).min(stops.len() - 2);
    let t = place - below as f32;
    let channel = |c: usize| (stops[below][c] + t * (stops[below + 1][c] - stops[below][c])).round() as u8;
    [channel(0), channel(1), channel(2), 255]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn void_unknown_and_hidden_classes_are_transparent() {
        let classes = [Class::new(1, "wall"), Class::new(2, "lamp")];
        let palette = Palette::hiding(
            &classes,
            &Hidden {
                classes: [2].into(),
                ..Hidden::default()
            },
        );
        for (class, alpha) in [(VOID, 0), (1, 255), (2, 0), (3, 0), (60_000, 0)] {
            assert_eq!(palette.class(class)[3], alpha, "{class}");
        }
        // Nothing else changes.
        assert_eq!(palette.entropy_scale(), Palette::new(&classes).entropy_scale());
    }

    #[test]
    fn an_even_guess_among_all_classes_has_the_last_colour_of_entropy() {
        let palette = Palette::new(&[Class::new(1, "a"), Class::new(2, "b")]);
        let even_guess = (2.0_f32.ln() * ENTROPY_STEPS_PER_NAT).ceil();
        let column = (even_guess * palette.entropy_scale()) as usize;
        assert_eq!(column, PALETTE_COLUMNS - 1);
        let last = palette.value(Table::Entropy, PALETTE_COLUMNS - 1);
        assert_eq!(palette.value(Table::Entropy, 100_000), last);
    }

    /// Lightness of a colour as everybody sees it, colour-blind people included.
    fn brightness([r, g, b, _]: [u8; 4]) -> f32 {
        0.2126 * f32::from(r) + 0.7152 * f32::from(g) + 0.0722 * f32::from(b)
    }

    #[test]
    fn values_are_told_apart_by_brightness_alone() {
        let rows = |table: Table| (0..PALETTE_COLUMNS).map(move |column| brightness(table.color(column)));
        let steps = rows(Table::Entropy).zip(rows(Table::Entropy).skip(8));
        assert!(steps.into_iter().all(|(dark, light)| light > dark));
        let steps = rows(Table::Depth).zip(rows(Table::Depth).skip(8));
        assert!(steps.into_iter().all(|(light, dark)| light > dark));
        let [import, stroke] = [Agreement::ImportContradicted, Agreement::StrokeContradicted];
        assert!(brightness(import.color()) > brightness(stroke.color()) + 60.0);
        let [alone, different] = [Difference::Alone, Difference::Different].map(difference_color);
        assert!(brightness(different) > brightness(alone) + 60.0);
        assert_eq!(
            Table::Differences.color(Difference::Different as usize),
            different
        );
    }
}
