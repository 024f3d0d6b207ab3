//! What the label images of frames say of the pixels of a frame, their own and others.
//!
//! On the surface all label images become one, so that the errors of each vanish. But a voxel is some pixels wide, and where
//! depth is estimated it is off by more: borders are lost. A frame's own image still has them in the right place, and so have
//! those of frames that were taken nearby: an error of depth moves a pixel by little between two such frames, and colours
//! tell on which side of a border it lies.

use std::sync::Arc;

use glam::Vec3;

use super::superpixels::depths;
use super::windows::{dilated, window};
use super::{CERTAIN, NO_NODE, Node, Posterior, Surface, SurfaceImport};
use crate::labels::{ClassId, ImportedMap, VOID};
use crate::lanes::{F32x16, LANES};
use crate::scene::{Camera, ColorImage, Frame, ImageEdges, PassWeights, Scene};

/// Weight of the surface at a pixel, when it is certain, as a share of the weight of labels where all pixels have one. It
/// grows with the distance between labelled pixels.
const SURFACE: f32 = 1.0 / 6.0;
/// Weight of an exact surface at a pixel beside the image of the nearest other frame, which has up to 1.
const EXACT_SURFACE: f32 = 0.5;
/// Scale of the sums: this many times the distance between labels that are right, and at least so many pixels. Where it
/// would be more than the most, the surface knows better.
const SPACINGS: f32 = 0.75;
const PIXELS: (f32, f32) = (2.0, 16.0);
/// How far a pixel may be from where the surface has its class, in pixels; farther away, the image is wrong.
const MOST_OFF: usize = 8;
/// How far from a border images decide where the surface is exact, in steps along rows and columns.
const EXACT_REACH: u8 = 3;
/// How many images of other frames are looked at, those that were taken the nearest: so many, and the more the fewer pixels
/// are labelled, up to so many. Each counts for less than the one before; one more would count for so many times less than
/// the first.
const OTHERS: (usize, usize) = (6, 24);
const LAST: f32 = 4.0;
/// Standard deviation of the colours of one place in two frames, each channel in 0..=1.
const COLOR: f32 = 0.16;
/// How far apart two points that are one place may be, in voxels.
const SAME: f32 = 2.0;
/// Where a surface is seen along, its plane says little of where a ray meets it.
const LEAST_FACING: f32 = 0.2;

/// What a label image says of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Vote {
    /// Row-major index.
    pixel: usize,
    class: ClassId,
    /// From 0 to 1.
    weight: f32,
}

/// The label images of a scene, as seen from one of its frames.
#[derive(Clone, Copy)]
pub(super) struct LabelImages<'a> {
    pub scene: &'a Scene,
    pub surface: &'a Surface,
    pub posterior: &'a Posterior,
    pub import: &'a SurfaceImport,
    /// The frame.
    pub number: usize,
}

/// A frame with a label image.
struct Labelled<'a> {
    frame: &'a Frame,
    color: Arc<ColorImage>,
    nodes: Vec<u32>,
    labels: Vec<ClassId>,
}

impl LabelImages<'_> {
    fn frame(&self) -> &Frame {
        &self.scene.frames[self.number]
    }

    fn class(&self, node: u32) -> ClassId {
        self.posterior.labels.get(node as usize).copied().unwrap_or(VOID)
    }

    /// Whether strokes know better at a node.
    fn is_overruled(&self, node: u32) -> bool {
        self.import.is_overruled(node, self.class(node))
    }

    /// The frame's own image.
    fn own(&self) -> Option<&ImportedMap> {
        let own = self.import.shown.of_frame(self.number);
        own.filter(|image| image.pixels() == self.frame().camera.pixels())
    }

    /// The node that every pixel takes its class from where depth is exact, [`NO_NODE`] where there is none: `shown` are
    /// those that the pixels show, `nodes` those that depth and colours have chosen. Beside borders a pixel has the class
    /// that most of the nearest other frames' images give it. Where images are not trusted, or strokes have overruled them,
    /// the surface knows better, and where the frame's own image has a label, that is certain already.
    pub(super) fn nodes_where_exact(&self, shown: &[u32], nodes: Vec<u32>) -> Vec<u32> {
        if self.import.trusted().is_none() {
            return nodes;
        }
        let camera = &self.frame().camera;
        let mut wanted = self.near_borders(camera, &nodes, EXACT_REACH);
        for vote in self.of_own(camera, 1) {
            wanted[vote.pixel] = false;
        }
        let mut chosen = nodes.clone();
        for votes in self
            .of_others(1, shown, &wanted)
            .chunk_by(|a, b| a.pixel == b.pixel)
        {
            let at = votes[0].pixel;
            let own = self.class(nodes[at]);
            // What the images do not label, the surface knows better.
            let is_for_own = |vote: &&Vote| [own, VOID].contains(&vote.class);
            let for_own: f32 = votes.iter().filter(is_for_own).map(|vote| vote.weight).sum();
            let others = votes.iter().filter(|vote| !is_for_own(vote));
            if let Some(best) = others.max_by(|a, b| a.weight.total_cmp(&b.weight))
                && best.weight > EXACT_SURFACE + for_own
                && !self.is_overruled(nodes[at])
            {
                chosen[at] = self.nearest(&nodes, camera.width as usize, at, best.class);
            }
        }
        chosen
    }

    /// The node that every pixel takes its class from by label images, [`NO_NODE`] where there is none; `nodes` are
    /// those that the pixels would take it from otherwise and `shown` those that they show, at the size of `camera` and
    /// `edges`, which are the frame's reduced by `stride`. `None` where the images say too little.
    ///
    /// Of the classes that the surface has nearby, a pixel takes the one with the largest sum of weights around it, up to
    /// the edges of the image: of labels, which weigh the more the fewer there are, and of the surface, which weighs less.
    /// Where strokes have overruled the images on the surface, labels do not count.
    pub(super) fn nodes_along_edges(
        &self,
        (camera, stride): (&Camera, u32),
        edges: &ImageEdges,
        shown: &[u32],
        nodes: &[u32],
    ) -> Option<Vec<u32>> {
        let wanted = self.near_borders(camera, shown, MOST_OFF as u8);
        let own = self.of_own(camera, stride);
        let own_share = own.len() as f32 / nodes.len() as f32;
        let others: f32 = (0..self.count_of_others()).map(|rank| self.weight_of(rank)).sum();
        if SPACINGS / (own_share + self.import.labelled_share * others).sqrt() > PIXELS.1 {
            return None;
        }
        let mut others = self.of_others(stride, shown, &wanted);
        others.retain(|vote| vote.class != VOID);
        let of_others: f32 = others.iter().map(|vote| vote.weight).sum();
        let asked = wanted.iter().filter(|&&wanted| wanted).count().max(1);
        let per_pixel = own_share + of_others / asked as f32;
        let right = per_pixel.sqrt() * (1.0 - self.import.random_share);
        let scale = (SPACINGS / right).max(PIXELS.0);
        let of_surface = SURFACE / per_pixel.sqrt();
        if !(PIXELS.0..=PIXELS.1).contains(&scale) {
            return None;
        }
        let width = camera.width as usize;
        let mut classes: Vec<ClassId> = nodes.iter().map(|&node| self.class(node)).collect();
        classes.sort_unstable();
        classes.dedup();
        classes.retain(|&class| class != VOID);
        let mut best: Vec<(f32, ClassId)> = nodes.iter().map(|&node| (0.0, self.class(node))).collect();
        let mut values = vec![F32x16::ZERO; nodes.len()];
        let mut weights = PassWeights::default();
        for classes in classes.chunks(LANES) {
            let place = |class: ClassId| classes.binary_search(&class).ok();
            values.fill(F32x16::ZERO);
            let mut near = vec![0_u16; nodes.len()];
            for (at, &node) in nodes.iter().enumerate() {
                if let Some(place) = place(self.class(node)) {
                    near[at] = 1 << place;
                    let confidence =
                        || f32::from(self.posterior.confidence[node as usize]) / f32::from(CERTAIN);
                    values[at].0[place] = match self.is_overruled(node) {
                        true => 1.0,
                        false => of_surface * confidence(),
                    };
                }
            }
            for vote in own.iter().chain(&others) {
                if let Some(place) = place(vote.class)
                    && !self.is_overruled(nodes[vote.pixel])
                {
                    values[vote.pixel].0[place] += vote.weight / per_pixel;
                }
            }
            edges.sum_nearest(&mut values, scale, &mut weights);
            let near = dilated(&near, width, MOST_OFF, |all, own| all | own);
            for ((best, values), near) in best.iter_mut().zip(&values).zip(near) {
                for (place, &value) in values.0.iter().enumerate() {
                    if near & (1 << place) != 0 && value > best.0 {
                        *best = (value, classes[place]);
                    }
                }
            }
        }
        let chosen = best.iter().zip(nodes).enumerate();
        let chosen = chosen.map(|(at, (&(_, best), &node))| match node {
            NO_NODE => node,
            _ => self.nearest(nodes, width, at, best),
        });
        Some(chosen.collect())
    }

    /// Which pixels are at most so many steps along rows and columns away from a border between classes.
    fn near_borders(&self, camera: &Camera, nodes: &[u32], reach: u8) -> Vec<bool> {
        let (depths, _) = depths(camera, nodes, &|node| self.class(node), reach + 1);
        depths.into_iter().map(|depth| depth <= reach).collect()
    }

    /// The nearest node of a class, as seen from a pixel; the pixel's own where there is none near.
    fn nearest(&self, nodes: &[u32], width: usize, at: usize, class: ClassId) -> u32 {
        if self.class(nodes[at]) == class {
            return nodes[at];
        }
        let (column, row) = (at % width, at / width);
        let squared = |x: usize, y: usize| x.abs_diff(column).pow(2) + y.abs_diff(row).pow(2);
        let of_row = |y: usize| window(column, width, MOST_OFF).map(move |x| (squared(x, y), y * width + x));
        let all = window(row, nodes.len() / width, MOST_OFF).flat_map(of_row);
        let nearest = all.filter(|&(_, other)| self.class(nodes[other]) == class).min();
        nodes[nearest.map_or(at, |(_, other)| other)]
    }

    /// The labels of the frame's own image, on the pixels of its camera reduced by `stride`.
    fn of_own(&self, camera: &Camera, stride: u32) -> Vec<Vote> {
        let labels = self.own().map_or_else(Vec::new, ImportedMap::labels);
        let (full, width) = (self.frame().camera.width as usize, camera.width as usize);
        let vote = |(at, class): (usize, ClassId)| Vote {
            pixel: at / full / stride as usize * width + at % full / stride as usize,
            class,
            weight: 1.0,
        };
        let said = labels.into_iter().enumerate().filter(|&(_, class)| class != VOID);
        said.map(vote).collect()
    }

    /// The labels that pixels of the frame reduced by `stride` have in the images of the nearest other frames, in the order
    /// of the pixels; `shown` are the nodes that they show.
    fn of_others(&self, stride: u32, shown: &[u32], wanted: &[bool]) -> Vec<Vote> {
        let frame = self.frame();
        let others = self.others();
        let (nodes, color) = (self.surface.graph.nodes(), frame.color());
        let mut votes: Vec<Vote> = Vec::new();
        for (pixel, &node) in shown.iter().enumerate() {
            if node == NO_NODE || !wanted[pixel] {
                continue;
            }
            let node = &nodes[node as usize];
            let middle = frame.camera.middle_of_reduced(stride, pixel);
            let point = meeting(frame.center(), frame.ray_direction(middle), node);
            let own = color.color(middle);
            let first = votes.len();
            for (rank, other) in others.iter().enumerate() {
                let of_rank = self.weight_of(rank);
                other.say(point, own, (nodes, node.voxel), |class, weight| {
                    let weight = weight * of_rank;
                    match votes[first..].iter_mut().find(|vote| vote.class == class) {
                        Some(vote) => vote.weight += weight,
                        None => votes.push(Vote { pixel, class, weight }),
                    }
                });
            }
        }
        votes
    }

    /// How many images of other frames are looked at.
    fn count_of_others(&self) -> usize {
        let wanted = OTHERS.0 as f32 / self.import.labelled_share;
        (wanted as usize).clamp(OTHERS.0, OTHERS.1)
    }

    /// What the image of another frame counts for, the nearest first.
    fn weight_of(&self, rank: usize) -> f32 {
        1.0 / (1.0 + (LAST - 1.0) * rank as f32 / self.count_of_others() as f32)
    }

    /// The other frames with a label image whose views are the nearest.
    fn others(&self) -> Vec<Labelled<'_>> {
        let view = self.frame().viewpoint();
        let apart = |other: &Frame| view.distance(&other.viewpoint());
        let images = self.import.shown.maps.iter();
        let mut others: Vec<(f32, &ImportedMap)> = images
            .filter(|image| image.frame != self.number)
            .filter_map(|image| Some((apart(self.scene.frames.get(image.frame)?), image)))
            .collect();
        others.sort_by(|a, b| a.0.total_cmp(&b.0));
        let others = others
            .into_iter()
            .take(self.count_of_others())
            .map(|(_, image)| Labelled {
                frame: &self.scene.frames[image.frame],
                color: self.scene.frames[image.frame].color(),
                nodes: self.surface.nodes_of(image.frame).unpack(),
                labels: image.labels(),
            });
        others.filter(|own| own.labels.len() == own.nodes.len()).collect()
    }
}

impl Labelled<'_> {
    /// Tells the labels of the four pixels around a point of this colour, with weights that add up to at most 1: those of
    /// pixels that show the point, and the more the more alike the colours are. `voxel` is the side of the point's voxel.
    fn say(
        &self,
        point: Vec3,
        color: Vec3,
        (nodes, voxel): (&[Node], f32),
        mut say: impl FnMut(ClassId, f32),
    ) {
        let Some((x, y, _)) = self.frame.project(point) else {
            return;
        };
        let (left, above) = ((x - 0.5).floor(), (y - 0.5).floor());
        for (column, row) in [
            (left, above),
            (left + 1.0, above),
            (left, above + 1.0),
            (left + 1.0, above + 1.0),
        ] {
            let camera = &self.frame.camera;
            if column < 0.0 || row < 0.0 || column >= camera.width as f32 || row >= camera.height as f32 {
                continue;
            }
            let at = row as usize * camera.width as usize + column as usize;
            let Some(there) = nodes.get(self.nodes[at] as usize) else {
                continue;
            };
            let is_same = there.position.distance(point) <= SAME * there.voxel.max(voxel);
            if is_same {
                let share = (1.0 - (x - 0.5 - column).abs()) * (1.0 - (y - 0.5 - row).abs());
                let apart = (self.color.color(at) - color).length_squared() / COLOR.powi(2);
                say(self.labels[at], share * (-0.5 * apart).exp());
            }
        }
    }
}

/// Where a ray of this unit direction meets the plane of a node, within its voxel.
fn meeting(origin: Vec3, direction: Vec3, node: &Node) -> Vec3 {
    let middle = (node.position - origin).dot(direction);
    let facing = node.normal.dot(direction);
    let length = match facing.abs() > LEAST_FACING {
        true => (node.position - origin).dot(node.normal) / facing,
        false => middle,
    };
    origin + length.clamp(middle - node.voxel, middle + node.voxel) * direction
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::labels::{Class, ImportedLabels, LabelSet, Stroke, StrokeId, Trust};
    use crate::scene::testing::{wall, without_depth};
    use crate::semantics::LabelPropagation;
    use crate::semantics::testing::surface;

    const SIZE: [u32; 2] = [64, 48];

    /// The wall in two greys left and right of x = 0.3 m, which the first frame has between two of its pixels, and the
    /// class of each pixel of a frame.
    fn two_greys() -> (Scene, impl Fn(usize) -> Vec<ClassId>) {
        let mut scene = wall(2, SIZE[0], SIZE[1]);
        let classes = |frame: &Frame| -> Vec<ClassId> {
            let x = |pixel: usize| frame.center().x + 2.0 * frame.camera.direction_at(pixel).x;
            (0..frame.camera.pixels())
                .map(|pixel| 1 + ClassId::from(x(pixel) > 0.3))
                .collect()
        };
        let of_frames: Vec<Vec<ClassId>> = scene.frames.iter().map(classes).collect();
        for (frame, classes) in scene.frames.iter_mut().zip(&of_frames) {
            let rgb = classes
                .iter()
                .flat_map(|&class| [54 + 6 * class as u8; 3])
                .collect();
            frame.set_color(ColorImage::new(SIZE[0], SIZE[1], rgb).unwrap());
        }
        (scene, move |frame| of_frames[frame].clone())
    }

    /// The labels of the second frame where the first has a trusted label image, and these strokes.
    fn labels_of_second(
        scene: &Scene,
        surface: &Arc<Surface>,
        image: &[ClassId],
        strokes: &[Stroke],
    ) -> Vec<ClassId> {
        let labels = LabelSet {
            classes: [1, 2].map(|id| Class::new(id, id.to_string())).into(),
            strokes: (0..)
                .map(StrokeId)
                .zip(strokes.iter().cloned().map(Arc::new))
                .collect(),
            imported: Some(Arc::new(ImportedLabels {
                maps: vec![ImportedMap::new(0, image)],
                trust: Trust::RIGHT,
            })),
            ..LabelSet::default()
        };
        let mut spread = LabelPropagation::new(Arc::clone(surface));
        spread.set_labels(scene, &labels);
        spread.set_import(SurfaceImport::new(surface, &labels).unwrap());
        spread.map(&Arc::new(scene.clone()), 1, 0).labels().into_owned()
    }

    #[test]
    fn a_label_image_places_the_borders_of_a_frame_beside_to_the_pixel() {
        let (scene, classes) = two_greys();
        let surface = surface(&scene);
        for scene in [scene.clone(), without_depth(scene)] {
            let labels = labels_of_second(&scene, &surface, &classes(0), &[]);
            assert!(labels == classes(1), "depth: {}", scene.has_depth());
        }
    }

    #[test]
    fn what_a_stroke_has_overruled_stays_so_beside_it() {
        let (scene, classes) = two_greys();
        let surface = surface(&scene);
        // Every voxel of a square where the image says the other class.
        let places = (0..36).map(|k| [12 + 3 * (k % 6), 14 + 3 * (k / 6)]);
        let strokes: Vec<Stroke> = places.map(|pixel| Stroke::click(1, 2, pixel)).collect();
        let labels = labels_of_second(&scene, &surface, &classes(0), &strokes);
        let overruled = labels
            .iter()
            .zip(classes(1))
            .filter(|&(&label, truth)| (label, truth) == (2, 1));
        let overruled = overruled.count();
        assert!(overruled > 230, "{overruled}");
    }
}
