//! Region noise: whole objects with a wrong class in some of the frames.

use std::collections::BTreeMap;

use rand::seq::IndexedRandom;
use rand::{SeedableRng, rngs::SmallRng};

use super::recipe::evenly;
use inplace_core::labels::{ClassId, ImportedLabels, ImportedMap, VOID};
use inplace_core::semantics::{NodeVotes, Surface};

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
        let trust = Trust::RIGHT;
        (surface, ImportedLabels { maps, trust })
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
