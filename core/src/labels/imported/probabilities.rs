//! Class probabilities of a frame's pixels, as far as they are kept.

use crate::labels::{ClassId, VOID};
use crate::scene::sampled;

/// Classes that are kept of each cell.
const KEPT: usize = 4;
/// A probability of 1 in the steps that are kept.
const ONE: f32 = 255.0;

/// The likeliest classes of a cell with their probabilities in steps of 1/255, likeliest first. What is missing to 1
/// is said of no class.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Likeliest {
    /// Void behind the last.
    classes: [ClassId; KEPT],
    steps: [u8; KEPT],
}

impl Likeliest {
    /// Keeps the four likeliest of some classes with probabilities, the first of equals. Where void is among them
    /// and the likeliest, nothing is said.
    pub fn of(probabilities: impl Iterator<Item = (ClassId, f32)>) -> Self {
        let mut best = [(VOID, 0.0_f32); KEPT];
        let mut void = 0.0;
        for (class, probability) in probabilities {
            if class == VOID {
                void += probability;
                continue;
            }
            let mut new = (class, probability);
            for kept in &mut best {
                if new.1 > kept.1 {
                    std::mem::swap(kept, &mut new);
                }
            }
        }
        if void > best[0].1 {
            return Self::default();
        }
        Self::sorted(
            best.map(|(class, probability)| (class, (ONE * probability).round().clamp(0.0, ONE) as u8)),
        )
    }

    /// Of classes in falling order.
    fn sorted(best: [(ClassId, u8); KEPT]) -> Self {
        let said = best.map(|(class, steps)| {
            if class == VOID || steps == 0 {
                (VOID, 0)
            } else {
                (class, steps)
            }
        });
        Self {
            classes: said.map(|(class, _)| class),
            steps: said.map(|(_, steps)| steps),
        }
    }

    /// The likeliest class; void where nothing is said.
    pub fn class(&self) -> ClassId {
        self.classes[0]
    }

    /// The classes with their probabilities, likeliest first.
    pub fn iter(&self) -> impl Iterator<Item = (ClassId, f32)> + '_ {
        let said = self.classes.iter().zip(&self.steps);
        said.filter(|(class, _)| **class != VOID)
            .map(|(&class, &steps)| (class, f32::from(steps) / ONE))
    }

    /// The same of other classes; those that become one add up, and those that become void are left out.
    fn relabelled(&self, class: impl Fn(ClassId) -> ClassId) -> Self {
        let classes = self
            .classes
            .map(|own| if own == VOID { VOID } else { class(own) });
        // Most cells of most edits.
        if classes == self.classes {
            return *self;
        }
        let mut merged = [(VOID, 0_u8); KEPT];
        for (own, &steps) in classes.into_iter().zip(&self.steps) {
            let place = merged
                .iter_mut()
                .find(|(known, _)| *known == own || *known == VOID);
            if let Some(place) = place.filter(|_| own != VOID) {
                *place = (own, place.1.saturating_add(steps));
            }
        }
        merged.sort_by_key(|&(_, steps)| std::cmp::Reverse(steps));
        Self::sorted(merged)
    }
}

/// Class probabilities of a frame on a grid over its pixels, which may be coarser than they are.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Probabilities {
    /// Columns and rows of the grid.
    size: [u32; 2],
    /// Width and height of the frame in pixels.
    frame: [u32; 2],
    /// Row-major.
    cells: Vec<Likeliest>,
}

impl Probabilities {
    /// Classes that are kept of each cell.
    pub(crate) const KEPT: usize = KEPT;

    /// A grid of `size` columns and rows over a frame of `frame` pixels, the cells row-major; `None` unless there are
    /// as many cells as that.
    pub fn new(size: [u32; 2], frame: [u32; 2], cells: Vec<Likeliest>) -> Option<Self> {
        let fits = !cells.is_empty() && cells.len() as u64 == u64::from(size[0]) * u64::from(size[1]);
        fits.then_some(Self { size, frame, cells })
    }

    /// Columns and rows of the grid.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Number of the frame's pixels.
    pub(super) fn frame_pixels(&self) -> usize {
        self.frame[0] as usize * self.frame[1] as usize
    }

    /// The cells, row-major.
    pub fn cells(&self) -> &[Likeliest] {
        &self.cells
    }

    /// Index of the cell over the centre of the frame's pixel with this row-major index.
    pub fn cell_at(&self, pixel: usize) -> usize {
        let width = self.frame[0] as usize;
        let column = sampled((pixel % width) as u32, self.frame[0], self.size[0]);
        let row = sampled((pixel / width) as u32, self.frame[1], self.size[1]);
        row as usize * self.size[0] as usize + column as usize
    }

    /// Row-major index of the frame's pixel in the middle of a cell.
    pub fn middle_of(&self, cell: usize) -> usize {
        let columns = self.size[0] as usize;
        let column = sampled((cell % columns) as u32, self.size[0], self.frame[0]);
        let row = sampled((cell / columns) as u32, self.size[1], self.frame[1]);
        row as usize * self.frame[0] as usize + column as usize
    }

    /// The likeliest class of every pixel of the frame, row-major.
    pub(super) fn labels(&self) -> Vec<ClassId> {
        let of_pixel = |pixel| self.cells[self.cell_at(pixel)].class();
        (0..self.frame_pixels()).map(of_pixel).collect()
    }

    /// The classes of all cells, void and repetitions among them.
    pub(super) fn classes(&self) -> impl Iterator<Item = ClassId> + '_ {
        self.cells.iter().flat_map(|cell| cell.classes)
    }

    pub(super) fn relabelled(&self, class: impl Fn(ClassId) -> ClassId) -> Self {
        Self {
            size: self.size,
            frame: self.frame,
            cells: self.cells.iter().map(|cell| cell.relabelled(&class)).collect(),
        }
    }

    /// The classes and their probabilities in steps of 1/255, each as planes one below the other: the likeliest of
    /// all cells, row-major, then the second, to the fourth.
    pub(crate) fn planes(&self) -> (Vec<ClassId>, Vec<ClassId>) {
        let ranks = || (0..KEPT).flat_map(|rank| self.cells.iter().map(move |cell| (rank, cell)));
        let classes = ranks().map(|(rank, cell)| cell.classes[rank]);
        let steps = ranks().map(|(rank, cell)| ClassId::from(cell.steps[rank]));
        (classes.collect(), steps.collect())
    }

    /// The grid that has these planes, `width` cells wide; `None` where there is none.
    pub(crate) fn from_planes(
        frame: [u32; 2],
        width: u32,
        classes: &[ClassId],
        steps: &[ClassId],
    ) -> Option<Self> {
        let count = classes.len() / KEPT;
        if classes.len() != KEPT * count || steps.len() != classes.len() || width == 0 {
            return None;
        }
        let steps: Vec<u8> = steps
            .iter()
            .map(|&step| u8::try_from(step).ok())
            .collect::<Option<_>>()?;
        let cell = |index| {
            let best =
                std::array::from_fn(|rank| (classes[rank * count + index], steps[rank * count + index]));
            Likeliest::sorted(best)
        };
        Self::new(
            [width, count as u32 / width],
            frame,
            (0..count).map(cell).collect(),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn likeliest(said: &[(ClassId, f32)]) -> Likeliest {
        Likeliest::of(said.iter().copied())
    }

    fn said(cell: &Likeliest) -> Vec<(ClassId, u8)> {
        cell.iter()
            .map(|(class, p)| (class, (p * ONE).round() as u8))
            .collect()
    }

    #[test]
    fn the_four_likeliest_classes_are_kept_and_void_says_nothing() {
        let cell = likeliest(&[(1, 0.1), (2, 0.3), (3, 0.05), (4, 0.3), (5, 0.2), (6, 0.001)]);
        assert_eq!(said(&cell), [(2, 77), (4, 77), (5, 51), (1, 26)]);
        assert_eq!(said(&likeliest(&[(VOID, 0.2), (9, 0.8), (8, 0.001)])), [(9, 204)]);
        assert_eq!(likeliest(&[(VOID, 0.6), (9, 0.4)]), Likeliest::default());
        assert_eq!(Likeliest::default().class(), VOID);
    }

    #[test]
    fn merged_classes_add_up_and_may_become_the_likeliest() {
        let cell = likeliest(&[(1, 0.4), (2, 0.3), (3, 0.3)]);
        let merged = cell.relabelled(|class| if class == 2 { 3 } else { class });
        assert_eq!(said(&merged), [(3, 154), (1, 102)]);
        let less = cell.relabelled(|class| if class == 1 { VOID } else { class });
        assert_eq!(said(&less), [(2, 77), (3, 77)]);
    }

    #[test]
    fn every_pixel_has_the_cell_over_its_centre_and_planes_give_the_cells_back() {
        let cells: Vec<Likeliest> = (1..=6)
            .map(|class| likeliest(&[(class, 0.9), (300, 0.1)]))
            .collect();
        let grid = Probabilities::new([3, 2], [8, 4], cells).unwrap();
        let rows = [[1, 1, 1, 2, 2, 3, 3, 3], [4, 4, 4, 5, 5, 6, 6, 6]];
        assert_eq!(grid.labels(), [rows[0], rows[0], rows[1], rows[1]].concat());
        let middles = [0, 1, 2, 3, 4, 5].map(|cell| grid.middle_of(cell));
        assert_eq!(middles, [9, 12, 14, 25, 28, 30]);
        let (classes, steps) = grid.planes();
        assert_eq!(classes[..8], [1, 2, 3, 4, 5, 6, 300, 300]);
        let again = Probabilities::from_planes([8, 4], 3, &classes, &steps);
        assert_eq!(again, Some(grid));
        assert_eq!(Probabilities::from_planes([8, 4], 4, &classes, &steps), None);
        assert_eq!(Probabilities::from_planes([8, 4], 3, &classes, &steps[1..]), None);
        assert_eq!(Probabilities::new([3, 2], [8, 4], Vec::new()), None);
    }
}
