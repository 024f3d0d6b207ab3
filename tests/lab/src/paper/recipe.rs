//! Recipes that make imperfect label images from perfect ones: of one frame, or with a wrong class for whole objects in
//! some of the frames.
//!
//! All are deterministic in the random numbers that they are given. Void pixels stay void.

use std::collections::BTreeMap;

use rand::seq::IndexedRandom;
use rand::{Rng, SeedableRng, rngs::SmallRng};

use inplace_core::labels::{ClassId, ImportedLabels, ImportedMap, VOID};
use inplace_core::semantics::{NodeVotes, Surface};

/// Each pixel gets a random one of `classes` (its own among them) with this probability.
pub fn pixel_noise(labels: &mut [ClassId], classes: &[ClassId], share: f64, rng: &mut SmallRng) {
    for label in labels.iter_mut().filter(|label| **label != VOID) {
        if rng.random_bool(share)
            && let Some(&other) = classes.choose(rng)
        {
            *label = other;
        }
    }
}

/// The image scaled down by `factor` and up again, both to the nearest pixel.
pub fn coarse(labels: &[ClassId], width: usize, factor: usize) -> Vec<ClassId> {
    let height = labels.len() / width.max(1);
    let (columns, rows) = ((width / factor).max(1), (height / factor).max(1));
    // The pixel of the small image at a place, and the one that it was taken from.
    let through = |at: usize, size: usize, small: usize| (at * small / size) * size / small;
    let row = |y: usize| {
        let row = through(y, height, rows) * width;
        (0..width).map(move |x| labels[row + through(x, width, columns)])
    };
    (0..height).flat_map(row).collect()
}

/// Every `factor`-th pixel along each axis, from the first on; the others void.
pub fn grid(labels: &[ClassId], width: usize, factor: usize) -> Vec<ClassId> {
    let kept = |at: usize| (at % width).is_multiple_of(factor) && (at / width).is_multiple_of(factor);
    let label = |at| if kept(at) { labels[at] } else { VOID };
    (0..labels.len()).map(label).collect()
}

/// One random pixel of every class; the others void.
pub fn clicks(labels: &[ClassId], rng: &mut SmallRng) -> Vec<ClassId> {
    grown(labels, labels.len().max(1), 0.0, rng)
}

/// Of every class a region that grows from a random pixel, by dilation with 5x5 pixels inside the class, until
/// it covers this share of the class; when it can grow no more, another starts. The others void.
pub fn grown(labels: &[ClassId], width: usize, share: f64, rng: &mut SmallRng) -> Vec<ClassId> {
    let mut classes: Vec<ClassId> = labels.to_vec();
    classes.sort_unstable();
    classes.dedup();
    let mut kept = vec![VOID; labels.len()];
    for class in classes.into_iter().filter(|&class| class != VOID) {
        let all = 0..labels.len();
        let own: Vec<usize> = all.filter(|&index| labels[index] == class).collect();
        let target = (share * own.len() as f64) as usize;
        // Dilating is not kept to the class: each start covers a square.
        let mut squares: Vec<(usize, usize)> = own.choose(rng).map(|&start| (start, 0)).into_iter().collect();
        let near = |index: usize, &(start, reach): &(usize, usize)| {
            (index % width).abs_diff(start % width) <= reach
                && (index / width).abs_diff(start / width) <= reach
        };
        let covered = |squares: &[(usize, usize)]| -> (Vec<usize>, Vec<usize>) {
            own.iter()
                .partition(|&&index| squares.iter().any(|square| near(index, square)))
        };
        let (mut region, _) = covered(&squares);
        while region.len() < target {
            squares.iter_mut().for_each(|(_, reach)| *reach += 2);
            let before = region.len();
            let rest;
            (region, rest) = covered(&squares);
            if region.len() == before
                && let Some(&start) = rest.choose(rng)
            {
                squares.push((start, 0));
                region.push(start);
            }
        }
        for index in region {
            kept[index] = class;
        }
    }
    kept
}

/// Which `count` of `total` frames, evenly spaced from the first on.
pub fn evenly(total: usize, count: usize) -> Vec<usize> {
    let count = count.min(total);
    let some = count.max(1);
    let (gap, left) = (total / some, total % some);
    (0..count).map(|index| gap * index + index.min(left)).collect()
}

/// The frames in which an object is given a wrong class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Flipped {
    /// Those in which it is smallest.
    Smallest,
    /// Those evenly spaced in the order of its size.
    Even,
}

/// Pixels of an object's own class that have to show it, as a share of all labelled pixels.
const SMALLEST_OBJECT: f64 = 0.001;
/// Nodes farther apart than this many voxels are not of one object.
const REACH: f32 = 3.0;

/// The objects of one class, and the pixels of each in each image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Objects {
    /// The class that all of them have.
    pub class: ClassId,
    /// For each object the images that show it, by their place in the list of images, with its pixels there.
    pub pixels: Vec<Vec<(usize, Vec<usize>)>>,
}

impl Objects {
    /// The objects of the class that has the most, as chairs are in the paper's room: parts of the surface that
    /// are connected and of one true class.
    pub fn find(surface: &Surface, classes: &[ClassId], truth: &ImportedLabels) -> Self {
        let of_node = NodeVotes::count(surface, classes, truth).majority();
        let graph = &surface.graph;
        let mut part_of: Vec<Option<usize>> = vec![None; graph.len()];
        let mut class_of: Vec<ClassId> = Vec::new();
        for start in 0..graph.len() as u32 {
            let is_new = part_of[start as usize].is_none();
            let Some(&class) = of_node.get(&start).filter(|_| is_new) else {
                continue;
            };
            let part = Some(class_of.len());
            class_of.push(class);
            let mut open = vec![start];
            part_of[start as usize] = part;
            while let Some(node) = open.pop() {
                let own = &graph.nodes()[node as usize];
                for (other, _) in graph.edges(node) {
                    let there = &graph.nodes()[other as usize];
                    let near = own.position.distance(there.position) <= REACH * own.voxel;
                    if near && part_of[other as usize].is_none() && of_node.get(&other) == Some(&class) {
                        part_of[other as usize] = part;
                        open.push(other);
                    }
                }
            }
        }
        // The pixels of each part, by image.
        let mut pixels: Vec<BTreeMap<usize, Vec<usize>>> = vec![BTreeMap::new(); class_of.len()];
        let mut labelled = 0;
        for (image, map) in truth.maps.iter().enumerate() {
            let labels = map.labels();
            labelled += labels.iter().filter(|&&label| label != VOID).count();
            for (node, run) in surface.nodes_of(map.frame).runs() {
                // Pixels without a node are of none.
                let Some(part) = part_of.get(node as usize).copied().flatten() else {
                    continue;
                };
                for pixel in run.filter(|&pixel| labels[pixel] == class_of[part]) {
                    pixels[part].entry(image).or_default().push(pixel);
                }
            }
        }
        let least = SMALLEST_OBJECT * labelled as f64;
        let size = |part: usize| pixels[part].values().map(Vec::len).sum::<usize>() as f64;
        let large: Vec<usize> = (0..class_of.len()).filter(|&part| size(part) >= least).collect();
        let objects_of = |class: ClassId| large.iter().filter(|&&part| class_of[part] == class).count();
        let from_last = classes.iter().copied().rev();
        let class = from_last.max_by_key(|&class| objects_of(class)).unwrap_or(VOID);
        let own = large.iter().filter(|&&part| class_of[part] == class);
        let pixels = own.map(|&part| pixels[part].clone().into_iter().collect());
        let pixels = pixels.collect();
        Self { class, pixels }
    }

    /// Gives each object one random class in a share of the images that show it; the images are those that
    /// [`Objects::find`] was given.
    pub fn flip(
        &self,
        maps: &mut [ImportedMap],
        classes: &[ClassId],
        flipped: Flipped,
        share: f64,
        seed: u64,
    ) {
        let mut rng = SmallRng::seed_from_u64(seed);
        let mut labels: Vec<Vec<ClassId>> = maps.iter().map(ImportedMap::labels).collect();
        for images in &self.pixels {
            let mut order: Vec<&(usize, Vec<usize>)> = images.iter().collect();
            order.sort_by_key(|(image, pixels)| (pixels.len(), *image));
            let count = (share * order.len() as f64) as usize;
            let chosen = match flipped {
                Flipped::Smallest => (0..count).collect(),
                Flipped::Even => evenly(order.len(), count),
            };
            for place in chosen {
                let (image, pixels) = order[place];
                let class = classes.choose(&mut rng).copied().unwrap_or(VOID);
                for &pixel in pixels {
                    labels[*image][pixel] = class;
                }
            }
        }
        for (map, labels) in maps.iter_mut().zip(labels) {
            *map = ImportedMap::new(map.frame, &labels);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::wall;
    use inplace_core::labels::Trust;

    /// 40 x 30 pixels: void in the first row, class 1 on the left, 2 on the right, and a pixel of 9.
    fn labels() -> Vec<ClassId> {
        let class = |index: usize| match (index % 40, index / 40) {
            (_, 0) => VOID,
            (7, 7) => 9,
            (x, _) => 1 + ClassId::from(x >= 20),
        };
        (0..1200).map(class).collect()
    }

    /// Whether all that is kept is true.
    fn is_true(kept: &[ClassId]) -> bool {
        kept.iter()
            .zip(labels())
            .all(|(&own, label)| own == VOID || own == label)
    }

    #[test]
    fn pixel_noise_changes_its_share_and_the_same_seed_changes_the_same() {
        let noisy = |seed| {
            let mut noisy = labels();
            pixel_noise(&mut noisy, &[1, 2, 9, 4], 0.5, &mut SmallRng::seed_from_u64(seed));
            noisy
        };
        // A quarter of the random classes are the pixel's own.
        let pairs = noisy(1).into_iter().zip(labels());
        let changed = pairs.filter(|(own, label)| own != label).count() as f64 / 1160.0;
        assert!((changed - 0.5 * 0.75).abs() < 0.05, "{changed}");
        assert_eq!(noisy(1), noisy(1));
        assert_ne!(noisy(1), noisy(2));
        assert!(noisy(1)[..40].iter().all(|&label| label == VOID));
    }

    #[test]
    fn a_coarse_image_consists_of_squares_and_a_grid_of_their_corners() {
        let coarse = coarse(&labels(), 40, 10);
        for (index, &label) in coarse.iter().enumerate() {
            let corner = (index / 40 / 10 * 10) * 40 + index % 40 / 10 * 10;
            assert_eq!(label, labels()[corner]);
        }
        let grid = grid(&labels(), 40, 10);
        assert_eq!(grid.iter().filter(|&&label| label != VOID).count(), 8);
        assert_eq!(grid[10 * 40 + 20], 2);
        // A size that the factor does not divide.
        assert_eq!(super::coarse(&[1, 2, 3, 4, 5], 5, 2), [1, 1, 1, 3, 3]);
    }

    #[test]
    fn a_region_grows_to_its_share_of_every_class_and_starts_anew_when_it_is_stuck() {
        // A click is a region of one pixel.
        let clicked = clicks(&labels(), &mut SmallRng::seed_from_u64(1));
        assert_eq!(clicked.iter().filter(|&&label| label != VOID).count(), 3);
        assert!(is_true(&clicked));
        let grown_to = |share| grown(&labels(), 40, share, &mut SmallRng::seed_from_u64(4));
        let small = grown_to(0.1);
        for (class, size) in [(1, 579), (2, 580)] {
            let covered = small.iter().filter(|&&label| label == class).count();
            assert!(covered >= size / 10 && covered < size / 3, "{covered}");
        }
        assert!(is_true(&small) && small.contains(&9));
        assert_eq!(grown_to(1.0), labels());
        // Two far islands of one class: the second is only reached by a second start.
        let islands: Vec<ClassId> = (0..100).map(|x| ClassId::from(!(3..97).contains(&x))).collect();
        let all = grown(&islands, 100, 1.0, &mut SmallRng::seed_from_u64(2));
        assert_eq!(all, islands);
    }

    #[test]
    fn frames_are_chosen_evenly() {
        for (total, count, chosen) in [
            (10, 3, &[0, 4, 7][..]),
            (6, 2, &[0, 3]),
            (3, 5, &[0, 1, 2]),
            (4, 0, &[]),
        ] {
            assert_eq!(evenly(total, count), chosen);
        }
    }

    /// A wall of class 1 with two pictures of class 2, as wide as a twentieth and a tenth of two metres.
    fn pictures() -> (Surface, ImportedLabels) {
        let scene = wall(8, 64, 48);
        let surface = Surface::build(&scene, &[], 5.0).unwrap();
        let maps = (0..8)
            .map(|frame| {
                let camera = &scene.frames[frame].camera;
                let eye = scene.frames[frame].center().x;
                let class = |pixel: u32| {
                    let direction = camera.pixel_direction(pixel % 64, pixel / 64);
                    let (x, y) = (eye + 2.0 * direction.x, 2.0 * direction.y);
                    let picture = (0.4..0.8).contains(&x) || (-1.1..-0.3).contains(&x);
                    1 + ClassId::from(picture && y.abs() < 0.4)
                };
                let labels: Vec<ClassId> = (0..64 * 48).map(class).collect();
                ImportedMap::new(frame, &labels)
            })
            .collect();
        (surface, ImportedLabels::new(maps, Trust::RIGHT))
    }

    #[test]
    fn whole_connected_objects_are_flipped_in_the_frames_in_which_they_are_smallest_or_evenly() {
        let (surface, truth) = pictures();
        let objects = Objects::find(&surface, &[1, 2], &truth);
        assert_eq!((objects.class, objects.pixels.len()), (2, 2));
        assert!(objects.pixels.iter().all(|images| images.len() == 8));
        for flipped in [Flipped::Smallest, Flipped::Even] {
            let mut maps = truth.maps.clone();
            objects.flip(&mut maps, &[7], flipped, 0.5, 3);
            let labels: Vec<Vec<ClassId>> = maps.iter().map(ImportedMap::labels).collect();
            for images in &objects.pixels {
                // Numbers of pixels of the images in which it is flipped, and of the others.
                let (mut changed, mut kept) = (Vec::new(), Vec::new());
                for (image, pixels) in images {
                    match pixels.iter().filter(|&&pixel| labels[*image][pixel] == 7).count() {
                        0 => kept.push(pixels.len()),
                        count => {
                            assert_eq!(count, pixels.len());
                            changed.push(count);
                        }
                    }
                }
                assert_eq!((changed.len(), kept.len()), (4, 4));
                assert!(flipped == Flipped::Even || changed.iter().max() <= kept.iter().min());
            }
            let mut elsewhere = labels[0]
                .iter()
                .zip(truth.maps[0].labels())
                .filter(|(_, own)| *own == 1);
            assert!(elsewhere.all(|(label, _)| *label == 1));
        }
    }
}
