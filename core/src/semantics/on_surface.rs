//! What the pixels of a map follow from: the surface, what is known of its nodes, and the labels of the frame itself.

use std::sync::{Arc, OnceLock};

use rayon::prelude::*;
use rustc_hash::FxHashMap;

use super::borders::nodes_at_borders;
use super::label_images::LabelImages;
use super::superpixels::nodes_along_edges;
use super::{CERTAIN, Posterior, Surface, SurfaceImport, SurfaceObjects};
use crate::labels::{ClassId, ImportedMap, Label, ObjectId, VOID};
use crate::scene::Scene;

/// A map that is not looked up yet: its pixels have the values of the nodes that they show, which along borders are
/// chosen by the colours and depths of the frame.
#[derive(Clone, Debug)]
pub(super) struct OnSurface {
    pub(super) scene: Arc<Scene>,
    pub(super) surface: Arc<Surface>,
    pub(super) posterior: Arc<Posterior>,
    /// Entropy where there is no node.
    pub(super) unknown: u16,
    /// Label images. Where they are trusted, their pixels have their class for certain.
    pub(super) import: Option<Arc<SurfaceImport>>,
    /// Where the posterior is known only of the nodes that the frame shows: that of all nodes, as soon as it is known.
    pub(super) whole: Option<Arc<OnceLock<Arc<Posterior>>>>,
    /// Painted pixels and their labels, which they have for certain.
    pub(super) painted: Arc<[(u32, Label)]>,
}

impl OnSurface {
    /// The surface and the posterior of all its nodes; `None` before that is known.
    pub(super) fn surface(&self) -> Option<(&Arc<Surface>, &Arc<Posterior>)> {
        let posterior = match &self.whole {
            Some(whole) => whole.get()?,
            None => &self.posterior,
        };
        Some((&self.surface, posterior))
    }

    /// The node that every pixel of a frame takes its class from.
    pub(super) fn nodes(&self, frame: usize) -> Vec<u32> {
        let shown = self.surface.nodes_of(frame).unpack();
        let (number, frame) = (frame, &self.scene.frames[frame]);
        let images = self.import.as_deref().map(|import| LabelImages {
            scene: &self.scene,
            surface: &self.surface,
            posterior: &self.posterior,
            import,
            number,
        });
        match frame.depth() {
            Some(depth) if self.surface.is_sharp => {
                let (nodes, labels) = (self.surface.graph.nodes(), &self.posterior.labels);
                let chosen = nodes_at_borders(frame, &depth, &shown, nodes, labels);
                match images {
                    Some(images) => images.nodes_where_exact(&shown, chosen),
                    None => chosen,
                }
            }
            _ => {
                let superpixels = || self.surface.superpixels.of_frame(number, frame);
                nodes_along_edges(frame, shown, &self.posterior, images, superpixels)
            }
        }
    }

    pub(super) fn labels(&self, frame: usize, nodes: &[u32]) -> Vec<ClassId> {
        self.read(frame, nodes, (&self.posterior.labels, VOID), |class| class)
    }

    pub(super) fn entropy(&self, frame: usize, nodes: &[u32]) -> Vec<u16> {
        self.read(frame, nodes, (&self.posterior.entropy, self.unknown), |_| 0)
    }

    pub(super) fn confidence(&self, frame: usize, nodes: &[u32]) -> Vec<u16> {
        self.read(frame, nodes, (&self.posterior.confidence, 0), |_| CERTAIN)
    }

    /// Labelled pixels have no second class.
    pub(super) fn runners_up(&self, frame: usize, nodes: &[u32]) -> Vec<ClassId> {
        self.read(frame, nodes, (&self.posterior.runners_up, VOID), |_| VOID)
    }

    /// The class and the entropy of every `stride`th pixel along rows and columns, with borders where the surface has them.
    pub(super) fn rough(&self, frame: usize, stride: u32) -> (Vec<ClassId>, Vec<u16>) {
        let own = &self.scene.frames[frame];
        let (camera, hidden) = (&own.camera, own.hidden_pixels());
        let painted: FxHashMap<u32, Label> = self.painted.iter().copied().collect();
        let image = self.trusted(frame, camera.pixels()).map(ImportedMap::labels);
        let said = |pixel: usize| {
            let of_image = || {
                image
                    .as_ref()
                    .map(|image| image[pixel])
                    .filter(|&class| class != VOID)
            };
            let is_hidden = hidden.binary_search(&pixel).is_ok();
            let painted = painted.get(&(pixel as u32)).map(|label| label.class);
            is_hidden.then_some(VOID).or(painted).or_else(of_image)
        };
        let of_node = |node: u32| {
            let node = node as usize;
            (self.posterior.labels[node], self.posterior.entropy[node])
        };
        let middle = |at| camera.middle_of_reduced(stride, at) as u32;
        let pixels: Vec<u32> = (0..camera.reduced(stride).pixels()).map(middle).collect();
        let nodes = self.surface.nodes_at(frame, &pixels);
        let value = |(pixel, node): (u32, Option<u32>)| match said(pixel as usize) {
            Some(class) => (class, 0),
            None => node.map_or((VOID, self.unknown), of_node),
        };
        pixels.into_iter().zip(nodes).map(value).unzip()
    }

    /// The number of every pixel's object, 0 where it has none: that of its node, if that has the pixel's class, or that
    /// of the trusted image or of the stroke that painted it.
    pub(super) fn objects(
        &self,
        frame: usize,
        (nodes, labels): (&[u32], &[ClassId]),
        objects: &SurfaceObjects,
    ) -> Vec<u16> {
        let known = &self.posterior.labels;
        let of_node = |(&node, &label): (&u32, &ClassId)| match known.get(node as usize) {
            Some(&class) if class == label => objects.of_node(node).map_or(0, ObjectId::number),
            _ => 0,
        };
        let mut pixels: Vec<u16> = nodes.iter().zip(labels).map(of_node).collect();
        let image = self.trusted(frame, pixels.len());
        if let Some((image, objects)) = image.and_then(|image| Some((image, image.objects()?))) {
            let said = image.labels().into_iter().zip(objects);
            for ((pixel, label), (class, object)) in pixels.iter_mut().zip(labels).zip(said) {
                if let Some(object) = object.filter(|_| *label == class) {
                    *pixel = object.number();
                }
            }
        }
        for (pixel, label) in &*self.painted {
            let is_shown = labels[*pixel as usize] == label.class;
            if let Some(object) = label.object.filter(|_| is_shown) {
                pixels[*pixel as usize] = object.number();
            }
        }
        pixels
    }

    /// The trusted image of a frame with this number of pixels.
    fn trusted(&self, frame: usize, pixels: usize) -> Option<&ImportedMap> {
        let image = self.import.as_deref()?.trusted()?.of_frame(frame);
        image.filter(|image| image.pixels() == pixels)
    }

    /// The value of every pixel: that of its node, or that of pixels `without` one; labelled pixels have what `said`
    /// gives for their class.
    fn read(
        &self,
        frame: usize,
        nodes: &[u32],
        (values, without): (&[u16], u16),
        said: impl Fn(ClassId) -> u16,
    ) -> Vec<u16> {
        // No surface has as many nodes as `NO_NODE`.
        let value = |&node: &u32| values.get(node as usize).copied().unwrap_or(without);
        let mut pixels: Vec<u16> = nodes.par_iter().map(value).collect();
        if let Some(image) = self.trusted(frame, pixels.len()) {
            for (pixel, class) in pixels.iter_mut().zip(image.labels()) {
                if class != VOID {
                    *pixel = said(class);
                }
            }
        }
        for &(pixel, label) in &*self.painted {
            pixels[pixel as usize] = said(label.class);
        }
        // Hidden pixels are no part of the scene: they are void for certain.
        for pixel in self.scene.frames[frame].hidden_pixels() {
            pixels[pixel] = said(VOID);
        }
        pixels
    }
}
