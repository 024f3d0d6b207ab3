//! Dense label maps.

use std::borrow::Cow;
use std::sync::Arc;

use super::on_surface::OnSurface;
use super::posterior::NodeSummary;
use super::{CERTAIN, ENTROPY_STEPS_PER_NAT, Posterior, Surface, SurfaceObjects};
use crate::labels::{ClassId, LabelSet, Pixel, VOID};
use crate::scene::{Frame, ImagePixels};

/// Dense labels of one frame, row-major `[height, width]`.
///
/// A map that follows from a surface holds only the surface and its labels, which all maps share; its pixels are looked
/// up when they are read. Making all maps therefore costs next to nothing.
#[derive(Clone, Debug)]
pub struct FrameMap {
    /// Index of the frame.
    pub frame: usize,
    /// Generation of the labels it was made from.
    pub generation: u64,
    /// Width in pixels.
    pub width: u32,
    /// Height in pixels.
    pub height: u32,
    pub(super) pixels: MapPixels,
}

/// The pixels of a map, in one of two forms.
#[derive(Clone, Debug)]
pub(super) enum MapPixels {
    /// One by one.
    Listed {
        labels: Vec<ClassId>,
        entropy: Vec<u16>,
        /// `None` where it is not known: it is not kept on disk.
        likelihood: Option<Likelihood>,
        /// The number of every pixel's object, 0 where it has none; `None` where nobody asked for objects.
        objects: Option<Vec<u16>>,
        /// What they were looked up from.
        source: Option<OnSurface>,
    },
    /// By the nodes that they show, not looked up yet.
    OnSurface(OnSurface),
}

/// Values of a map's pixels that are not kept on disk.
#[derive(Clone, Debug)]
pub(super) struct Likelihood {
    /// Probability of every pixel's class, times [`CERTAIN`].
    pub(super) confidence: Vec<u16>,
    /// Second most likely class of every pixel.
    runners_up: Vec<ClassId>,
}

/// The values of a map at one pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PixelAnswer {
    /// Most likely class; void where nothing is known or a stroke says so.
    pub class: ClassId,
    /// Entropy of the class distribution, in nats.
    pub entropy: f32,
    /// Probability of the class, 0..=1; `None` where it is not known.
    pub probability: Option<f32>,
    /// Second most likely class; `None` where there is none or it is not known.
    pub runner_up: Option<ClassId>,
}

impl FrameMap {
    /// Wraps the class and entropy of every pixel; `None` unless there are `width * height` of both.
    pub fn new(
        frame: usize,
        generation: u64,
        [width, height]: [u32; 2],
        labels: Vec<ClassId>,
        entropy: Vec<u16>,
    ) -> Option<Self> {
        let pixels = width as usize * height as usize;
        (labels.len() == pixels && entropy.len() == pixels).then_some(Self {
            frame,
            generation,
            width,
            height,
            pixels: MapPixels::Listed {
                labels,
                entropy,
                likelihood: None,
                objects: None,
                source: None,
            },
        })
    }

    /// A map of a frame of the scene that follows from a surface.
    pub(super) fn on_surface((frame, generation): (usize, u64), shown: OnSurface) -> Self {
        let camera = &shown.scene.frames[frame].camera;
        Self {
            frame,
            generation,
            width: camera.width,
            height: camera.height,
            pixels: MapPixels::OnSurface(shown),
        }
    }

    /// A map of a view of this size, by what is known of each of its pixels.
    pub(super) fn of_view(view: usize, [width, height]: [u32; 2], pixels: &[NodeSummary]) -> Self {
        Self {
            frame: view,
            generation: 0,
            width,
            height,
            pixels: MapPixels::Listed {
                labels: pixels.iter().map(|pixel| pixel.label).collect(),
                entropy: pixels.iter().map(|pixel| pixel.entropy).collect(),
                likelihood: Some(Likelihood {
                    confidence: pixels.iter().map(|pixel| pixel.confidence).collect(),
                    runners_up: pixels.iter().map(|pixel| pixel.runner_up).collect(),
                }),
                objects: None,
                source: None,
            },
        }
    }

    /// The same map with its pixels looked up, for reading more than one thing of it.
    pub fn looked_up(&self) -> Cow<'_, Self> {
        self.looked_up_with(None)
    }

    /// The same with the object of every pixel, where these are the objects on the map's surface. A map stays as it is where
    /// its objects are known, or where it follows from no surface.
    pub fn looked_up_with(&self, objects: Option<&SurfaceObjects>) -> Cow<'_, Self> {
        let shown = match &self.pixels {
            MapPixels::OnSurface(shown) => shown,
            MapPixels::Listed {
                source: Some(shown),
                objects: None,
                ..
            } if objects.is_some() => shown,
            MapPixels::Listed { .. } => return Cow::Borrowed(self),
        };
        let nodes = shown.nodes(self.frame);
        let labels = shown.labels(self.frame, &nodes);
        let objects = objects.map(|objects| shown.objects(self.frame, (&nodes, &labels), objects));
        let at = (self.frame, self.generation);
        Cow::Owned(Self::listed(at, shown.clone(), (&nodes, labels), objects))
    }

    /// A map of a frame that is looked up: the node that every pixel takes its class from, and its label and object.
    pub(super) fn listed(
        (frame, generation): (usize, u64),
        shown: OnSurface,
        (nodes, labels): (&[u32], Vec<ClassId>),
        objects: Option<Vec<u16>>,
    ) -> Self {
        let camera = &shown.scene.frames[frame].camera;
        Self {
            frame,
            generation,
            width: camera.width,
            height: camera.height,
            pixels: MapPixels::Listed {
                labels,
                entropy: shown.entropy(frame, nodes),
                likelihood: Some(Likelihood {
                    confidence: shown.confidence(frame, nodes),
                    runners_up: shown.runners_up(frame, nodes),
                }),
                objects,
                source: Some(shown),
            },
        }
    }

    /// Every `stride`th pixel along rows and columns, for small pictures: borders between classes stay where the surface has
    /// them, as moving them to the edges of the image takes longer than all the rest. `None` for a map that is looked up.
    pub fn rough(&self, stride: u32) -> Option<Self> {
        let MapPixels::OnSurface(shown) = &self.pixels else {
            return None;
        };
        let (labels, entropy) = shown.rough(self.frame, stride);
        let size = [self.width, self.height].map(|side| side.div_ceil(stride));
        Self::new(self.frame, self.generation, size, labels, entropy)
    }

    /// Whether the pixels are looked up, so that reading them costs nothing.
    pub fn is_looked_up(&self) -> bool {
        matches!(self.pixels, MapPixels::Listed { .. })
    }

    /// The values at one pixel of a map that [is looked up](Self::is_looked_up); `None` for other maps, and outside.
    pub fn at(&self, [x, y]: Pixel) -> Option<PixelAnswer> {
        let MapPixels::Listed {
            labels,
            entropy,
            likelihood,
            ..
        } = &self.pixels
        else {
            return None;
        };
        if x >= self.width || y >= self.height {
            return None;
        }
        let index = y as usize * self.width as usize + x as usize;
        let likelihood = likelihood.as_ref();
        let runner_up = likelihood.map(|known| known.runners_up[index]);
        Some(PixelAnswer {
            class: labels[index],
            entropy: f32::from(entropy[index]) / ENTROPY_STEPS_PER_NAT,
            probability: likelihood.map(|known| f32::from(known.confidence[index]) / f32::from(CERTAIN)),
            runner_up: runner_up.filter(|&class| class != VOID),
        })
    }

    /// The surface that the map follows from, and the posterior of its nodes; `None` for a map that was made pixel by
    /// pixel, such as one of a project file, or before the rest of the scene followed.
    pub fn surface(&self) -> Option<(&Arc<Surface>, &Arc<Posterior>)> {
        self.source()?.surface()
    }

    /// Whether the imported images of a label set, where it has any, are taken into account: they come into the maps later
    /// than strokes. A map that was made pixel by pixel is as it is.
    pub fn has_import_of(&self, labels: &LabelSet) -> bool {
        let has = |shown: &OnSurface| shown.import.as_ref().is_some_and(|import| import.is_of(labels));
        labels.imported.is_none() || self.source().is_none_or(has)
    }

    /// What the pixels are looked up from; `None` where the map was made pixel by pixel.
    pub(super) fn source(&self) -> Option<&OnSurface> {
        match &self.pixels {
            MapPixels::Listed { source, .. } => source.as_ref(),
            MapPixels::OnSurface(shown) => Some(shown),
        }
    }

    /// Most likely class of every pixel; void where nothing is known or a stroke says so.
    pub fn labels(&self) -> Cow<'_, [ClassId]> {
        match &self.pixels {
            MapPixels::Listed { labels, .. } => Cow::Borrowed(labels),
            MapPixels::OnSurface(shown) => Cow::Owned(shown.labels(self.frame, &shown.nodes(self.frame))),
        }
    }

    /// Entropy of every pixel's class distribution, in nats times [`ENTROPY_STEPS_PER_NAT`].
    pub fn entropy(&self) -> Cow<'_, [u16]> {
        match &self.pixels {
            MapPixels::Listed { entropy, .. } => Cow::Borrowed(entropy),
            MapPixels::OnSurface(shown) => Cow::Owned(shown.entropy(self.frame, &shown.nodes(self.frame))),
        }
    }

    /// Probability of every pixel's class, times [`CERTAIN`]; 0 where nothing is known. `None` for a map that
    /// was made from labels and entropy alone, such as one of a project file.
    pub fn confidence(&self) -> Option<Cow<'_, [u16]>> {
        match &self.pixels {
            MapPixels::Listed { likelihood, .. } => {
                let known = likelihood.as_ref();
                known.map(|known| Cow::Borrowed(known.confidence.as_slice()))
            }
            MapPixels::OnSurface(shown) => {
                let nodes = shown.nodes(self.frame);
                Some(Cow::Owned(shown.confidence(self.frame, &nodes)))
            }
        }
    }

    /// The number of every pixel's object, 0 where it has none; `None` unless the map was
    /// [looked up with objects](Self::looked_up_with).
    pub fn objects(&self) -> Option<&[u16]> {
        match &self.pixels {
            MapPixels::Listed { objects, .. } => objects.as_deref(),
            MapPixels::OnSurface(_) => None,
        }
    }

    /// The map in the pixels of the frame's image on disk, looked up: each has the values of the frame's pixel at the
    /// same place. Pixels outside the frame, as with the strongest lenses, are void, without confidence and as
    /// uncertain as the frame's most uncertain pixel.
    pub fn in_image<'a>(&'a self, frame: &Frame) -> Cow<'a, Self> {
        self.in_image_with(frame, None, &ImagePixels::default())
    }

    /// The same with the object of every pixel, as by [`FrameMap::looked_up_with`]; `places` remembers the lens of the frames
    /// before.
    pub fn in_image_with<'a>(
        &'a self,
        frame: &Frame,
        objects: Option<&SurfaceObjects>,
        places: &ImagePixels,
    ) -> Cow<'a, Self> {
        let straight = self.looked_up_with(objects);
        let Some(places) = places.of(frame) else {
            return straight;
        };
        let (width, height) = (frame.image().width, frame.image().height);
        let (own_labels, own_entropy) = (straight.labels(), straight.entropy());
        let MapPixels::Listed {
            likelihood, objects, ..
        } = &straight.pixels
        else {
            return straight;
        };
        let unknown = own_entropy.iter().copied().max().unwrap_or(0);
        let moved = |values: &[u16], without: u16| -> Vec<u16> {
            let value = |&pixel: &u32| values.get(pixel as usize).copied();
            let moved = places.iter().map(|place| value(place).unwrap_or(without));
            moved.collect()
        };
        Cow::Owned(Self {
            width,
            height,
            pixels: MapPixels::Listed {
                labels: moved(&own_labels, VOID),
                entropy: moved(&own_entropy, unknown),
                likelihood: likelihood.as_ref().map(|known| Likelihood {
                    confidence: moved(&known.confidence, 0),
                    runners_up: moved(&known.runners_up, VOID),
                }),
                objects: objects.as_ref().map(|objects| moved(objects, 0)),
                source: None,
            },
            ..*self
        })
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3;

    use super::*;
    use crate::labels::Label;
    use crate::scene::testing::{bend, wall};
    use crate::scene::{ColorImage, DepthMap, Pixels, Scene};
    use crate::semantics::testing::{loose, node};
    use crate::semantics::{NO_NODE, NodeMap};

    impl PartialEq for FrameMap {
        /// Whether frame, generation, size and all pixels are the same.
        fn eq(&self, other: &Self) -> bool {
            (self.frame, self.generation, self.width, self.height)
                == (other.frame, other.generation, other.width, other.height)
                && {
                    let (own, others) = (self.looked_up(), other.looked_up());
                    own.labels() == others.labels() && own.entropy() == others.entropy()
                }
        }
    }

    /// A map of the first frame of a scene whose pixels show these nodes, on a surface without edges.
    fn map_of(
        scene: Scene,
        shown: &[u32],
        posterior: Posterior,
        unknown: u16,
        painted: Vec<(u32, Label)>,
    ) -> FrameMap {
        let width = scene.frames[0].camera.width as usize;
        let surface = Surface {
            pixels: vec![Arc::new(NodeMap::pack(width, shown))],
            ..loose(vec![node(Vec3::Z); posterior.labels.len()], 0.1)
        };
        let shown = OnSurface {
            scene: Arc::new(scene),
            surface: Arc::new(surface),
            posterior: Arc::new(posterior),
            unknown,
            import: None,
            whole: None,
            painted: painted.into(),
        };
        FrameMap::on_surface((0, 9), shown)
    }

    /// A node of class 5 and one of class 7.
    fn two_classes() -> Posterior {
        Posterior {
            labels: vec![5, 7],
            entropy: vec![100, 200],
            confidence: vec![60_000, 50_000],
            runners_up: vec![7, VOID],
            ..Posterior::default()
        }
    }

    #[test]
    fn a_rough_map_leaves_borders_where_the_surface_has_them() {
        let mut scene = wall(1, 9, 9);
        scene.frames[0].set_color(ColorImage::new(9, 9, vec![80; 243]).unwrap());
        scene.frames[0].set_depth(None);
        let mut shown = [0; 81];
        shown[40] = 1;
        let map = map_of(scene, &shown, two_classes(), 999, Vec::new());
        let rough = map.rough(1).unwrap();
        assert!(map.labels().iter().all(|&label| label == 5));
        let of_node = |&node: &u32| [5, 7][node as usize];
        assert_eq!(*rough.labels(), shown.iter().map(of_node).collect::<Vec<_>>());
        let third = map.rough(3).unwrap();
        assert_eq!([third.width, third.height], [3, 3]);
        assert_eq!(third.labels()[..], [5, 5, 5, 5, 7, 5, 5, 5, 5]);
        assert_eq!(third.entropy()[..2], [100; 2]);
        assert!(map.looked_up().rough(1).is_none());
    }

    #[test]
    fn a_map_on_a_surface_reads_like_one_that_lists_its_pixels() {
        // A single bright pixel, which shows a node of its own.
        let mut scene = wall(1, 3, 2);
        let rgb = [[0; 9], [0, 0, 0, 255, 255, 255, 0, 0, 0]].concat();
        scene.frames[0].set_color(ColorImage::new(3, 2, rgb).unwrap());
        let shown = [0, 0, 0, 0, 1, NO_NODE];
        let map = map_of(
            scene,
            &shown,
            two_classes(),
            999,
            vec![(1, 7.into()), (3, VOID.into())],
        );
        let labels = vec![5, 7, 5, VOID, 7, VOID];
        let listed = FrameMap::new(0, 9, [3, 2], labels, vec![100, 0, 100, 0, 200, 999]).unwrap();
        assert_eq!(map, listed);
        assert_eq!(map.rough(1).unwrap(), listed);
        assert_eq!(listed.confidence(), None);
        let confidence = [60_000, CERTAIN, 60_000, CERTAIN, 50_000, 0];
        assert_eq!(map.confidence().as_deref(), Some(&confidence[..]));
        let looked_up = map.looked_up();
        assert!(matches!(looked_up.labels(), Cow::Borrowed(_)) && *looked_up == map);
        let (surface, posterior) = map.surface().unwrap();
        let (same_surface, same_posterior) = looked_up.surface().unwrap();
        assert!(Arc::ptr_eq(surface, same_surface) && Arc::ptr_eq(posterior, same_posterior));
        assert!(listed.surface().is_none());
        assert_eq!(looked_up.confidence(), map.confidence());
        assert!(looked_up.is_looked_up() && !map.is_looked_up());
        assert_eq!(map.at([0, 0]), None);
        let answer = |x, y| {
            let own = looked_up.at([x, y])?;
            Some((own.class, own.runner_up, own.probability?, own.entropy))
        };
        let likely = f32::from(60_000_u16) / f32::from(CERTAIN);
        assert_eq!(answer(0, 0), Some((5, Some(7), likely, 0.01)));
        assert_eq!(answer(1, 0), Some((7, None, 1.0, 0.0)));
        assert_eq!(looked_up.at([1, 1]).unwrap().runner_up, None);
        assert_eq!(looked_up.at([3, 0]), None);
        assert_eq!(listed.at([2, 1]).unwrap().probability, None);
        let summary = looked_up.summary(None).unwrap();
        assert!((summary.coverage - 4.0 / 6.0).abs() < 1e-6);
        assert!((summary.mean_entropy - 1399.0 / 6.0 / ENTROPY_STEPS_PER_NAT).abs() < 1e-6);
        assert_ne!(map, FrameMap::new(0, 9, [3, 2], vec![5; 6], vec![0; 6]).unwrap());
        assert!(FrameMap::new(0, 1, [3, 2], vec![1; 6], vec![0; 5]).is_none());
    }

    #[test]
    fn a_map_of_a_straight_frame_is_looked_up_through_the_lens() {
        let mut frame = wall(1, 64, 48).frames.remove(0);
        let listing = |frame: &Frame| {
            let mut scene = wall(1, 64, 48);
            scene.frames[0] = frame.clone();
            let pixels = frame.camera.pixels();
            let shown: Vec<u32> = (0..pixels as u32).collect();
            let posterior = Posterior {
                labels: (0..pixels).map(|index| index as ClassId).collect(),
                entropy: (0..pixels).map(|index| index as u16).collect(),
                confidence: (0..pixels).map(|index| 3 * index as u16).collect(),
                runners_up: vec![VOID; pixels],
                ..Posterior::default()
            };
            map_of(scene, &shown, posterior, 0, Vec::new())
        };
        let same = listing(&frame);
        assert_eq!(*same.in_image(&frame), same);
        bend(&mut frame, -0.1);
        let (width, height) = (frame.camera.width, frame.camera.height);
        let black = ColorImage::new(width, height, vec![0; 3 * frame.camera.pixels()]).unwrap();
        let depth = DepthMap::from_ray_lengths(width, &vec![2.0; frame.camera.pixels()]);
        frame.pixels = Pixels::new(black, Some(depth)).into();
        let map = listing(&frame);
        let bent = map.in_image(&frame);
        assert_eq!([bent.width, bent.height], [64, 48]);
        assert_eq!(bent.labels().len(), 64 * 48);
        let [x, y] = frame.of_image([10, 40]).unwrap();
        let index = (y * frame.camera.width + x) as usize;
        assert_eq!(bent.labels()[40 * 64 + 10], map.labels()[index]);
        assert_eq!(bent.entropy()[40 * 64 + 10], map.entropy()[index]);
        assert_eq!(bent.confidence().unwrap()[40 * 64 + 10], 3 * index as u16);
        // The middle of the image stays the middle.
        let middle = (frame.camera.height / 2 * frame.camera.width + frame.camera.width / 2) as usize;
        assert_eq!(bent.labels()[24 * 64 + 32], map.labels()[middle]);
    }
}
