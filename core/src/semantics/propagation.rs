//! Propagates the labels of strokes and imported images over a surface, and so to every pixel.

mod preview;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::{Arc, OnceLock};

use rustc_hash::FxHashMap;

pub use preview::Preview;

use super::on_surface::OnSurface;
use super::posterior::NodeSummary;
use super::strays::strays;
use super::{
    ClassGeodesics, CrossValidation, ENTROPY_STEPS_PER_NAT, Evidence, FrameMap, Kinds, Likeness, NO_NODE,
    Posterior, Surface, SurfaceImport,
};
use crate::labels::{ClassId, Label, LabelSet, Stroke, StrokeId, VOID, rasterise};
use crate::scene::{Camera, Scene};

/// The labels of a scene on its surface, kept in step with the strokes.
#[derive(Clone, Debug)]
pub struct LabelPropagation {
    surface: Arc<Surface>,
    geodesics: ClassGeodesics,
    likeness: Likeness,
    /// Shared with the maps.
    posterior: Arc<Posterior>,
    classes: Vec<ClassId>,
    kinds: Kinds,
    /// The strokes that `painted` was made from.
    strokes: BTreeMap<StrokeId, Arc<Stroke>>,
    /// Labelled pixels of each frame that has strokes.
    painted: BTreeMap<usize, BTreeMap<u32, (ClassId, StrokeId)>>,
    /// The nodes under them that labels spread from, by frame.
    sources: BTreeMap<usize, Vec<(StrokeId, u32, ClassId)>>,
    /// The newest weights by the semantic prior: the classes that it was trained on, and positive weights
    /// `[nodes, classes]`. They are kept when the classes change, so that an undo restores the maps of before.
    prior: Option<(Vec<ClassId>, Arc<Vec<f32>>)>,
    /// The imported images, and the class weights that they give the nodes where they count as votes.
    import: Option<Arc<SurfaceImport>>,
    votes: Option<Arc<[f32]>>,
}

impl LabelPropagation {
    /// A surface without labels.
    pub fn new(surface: Arc<Surface>) -> Self {
        let mut propagation = Self {
            likeness: Likeness::new(Arc::clone(&surface.look)),
            surface,
            geodesics: ClassGeodesics::default(),
            posterior: Arc::default(),
            classes: Vec::new(),
            kinds: Kinds::default(),
            strokes: BTreeMap::new(),
            painted: BTreeMap::new(),
            sources: BTreeMap::new(),
            prior: None,
            import: None,
            votes: None,
        };
        propagation.refresh();
        propagation
    }

    /// The surface.
    pub fn surface(&self) -> &Arc<Surface> {
        &self.surface
    }

    /// Class probabilities of each node, summarised.
    pub fn posterior(&self) -> &Posterior {
        &self.posterior
    }

    /// The classes, in the order of the probabilities.
    pub fn classes(&self) -> &[ClassId] {
        &self.classes
    }

    /// Replaces the labels; only what changed is computed. Imported images are added by
    /// [`LabelPropagation::set_import`]; here they are only removed.
    pub fn set_labels(&mut self, scene: &Scene, labels: &LabelSet) {
        if let Some(changed) = self.spread(scene, labels) {
            self.update(&changed);
        }
    }

    /// The same, and tells the map of a frame as soon as what it shows is known, before the rest of the scene is; until then
    /// that map has no [surface](FrameMap::surface). Returns whether it did: nothing is told where all had to be computed, or
    /// where imported images count, as they are read across frames.
    pub fn set_labels_seen_in(
        &mut self,
        (scene, labels): (&Arc<Scene>, &LabelSet),
        (frame, generation): (usize, u64),
        tell: impl FnOnce(FrameMap),
    ) -> bool {
        let Some(changed) = self.spread(scene, labels) else {
            return false;
        };
        if self.import.is_some() {
            self.update(&changed);
            return false;
        }
        let is_shown = self.shown_in(frame);
        let (seen, others): (Vec<u32>, Vec<u32>) = changed.iter().partition(|&&node| is_shown[node as usize]);
        self.update(&seen);
        let whole = Arc::new(OnceLock::new());
        let shown = OnSurface {
            whole: Some(Arc::clone(&whole)),
            ..self.on_surface(scene, frame)
        };
        let map = FrameMap::on_surface((frame, generation), shown);
        tell(map.looked_up().into_owned());
        self.update(&others);
        // It is set nowhere else.
        let _ = whole.set(Arc::clone(&self.posterior));
        true
    }

    /// Replaces the labels by those of before with one stroke more, whose [preview](Self::preview) gave this map, and tells the
    /// map at once; it has no surface until the rest of the scene follows.
    pub fn set_labels_foreseen(
        &mut self,
        (scene, labels): (&Arc<Scene>, &LabelSet),
        generation: u64,
        foreseen: FrameMap,
        tell: impl FnOnce(FrameMap),
    ) {
        let whole = foreseen.source().and_then(|source| source.whole.clone());
        tell(FrameMap {
            generation,
            ..foreseen
        });
        self.set_labels(scene, labels);
        if let Some(whole) = whole {
            let _ = whole.set(Arc::clone(&self.posterior));
        }
    }

    /// Spreads these labels in place of those before; returns the nodes whose classes then have to be updated, ascending,
    /// or `None` where all of them are already.
    fn spread(&mut self, scene: &Scene, labels: &LabelSet) -> Option<Vec<u32>> {
        let changed = changed_frames(&self.strokes, &labels.strokes);
        self.strokes.clone_from(&labels.strokes);
        for frame in changed {
            let Some(own) = scene.frames.get(frame) else {
                continue;
            };
            let mut pixels = rasterise(labels, frame, own.camera.width, own.camera.height);
            for pixel in own.hidden_pixels() {
                pixels.remove(&(pixel as u32));
            }
            if pixels.is_empty() {
                self.painted.remove(&frame);
                self.sources.remove(&frame);
            } else {
                self.sources
                    .insert(frame, self.sources_of(&own.camera, frame, &pixels));
                self.painted.insert(frame, pixels);
            }
        }
        self.kinds = Kinds::new(&labels.classes);
        // In a fixed order, so that moving a class in the user's list changes nothing here.
        let mut classes: Vec<ClassId> = labels.classes.iter().map(|class| class.id).collect();
        classes.sort_unstable();
        let mut same_votes = classes == self.classes;
        if !same_votes {
            self.classes = classes;
            self.votes = self
                .import
                .as_ref()
                .and_then(|import| import.votes(&self.classes));
        }
        if labels.imported.is_none() && self.import.is_some() {
            (self.import, self.votes) = (None, None);
            same_votes = false;
        }
        let seeds = self.seeds();
        let looks_count = self.looks_count();
        let nearer = self.geodesics.update(&self.surface.graph, seeds);
        let classes = (self.classes.as_slice(), &self.kinds);
        let differs = looks_count.then(|| self.likeness.update(classes, &self.geodesics));
        if !same_votes {
            self.refresh();
            return None;
        }
        Some(self.changed(nearer, differs))
    }

    /// Computes the classes of these nodes anew.
    fn update(&mut self, nodes: &[u32]) {
        // Earlier maps may still share the posterior: then it is copied, which costs little.
        let mut posterior = Arc::unwrap_or_clone(std::mem::take(&mut self.posterior));
        posterior.update(&self.evidence(), nodes);
        self.posterior = Arc::new(posterior);
    }

    /// Of each node, whether a frame shows it.
    fn shown_in(&self, frame: usize) -> Vec<bool> {
        let mut is_shown = vec![false; self.surface.graph.len()];
        let shown = self.surface.nodes_of(frame);
        for (node, _) in shown.runs().filter(|&(node, _)| node != NO_NODE) {
            is_shown[node as usize] = true;
        }
        is_shown
    }

    /// The nodes of which something else is known, ascending: those with other distances, and where looks count those
    /// in regions with other factors.
    fn changed(&self, nearer: Vec<u32>, differs: Option<Vec<bool>>) -> Vec<u32> {
        let Some(differs) = differs else {
            return nearer;
        };
        let look = &self.surface.look;
        let of_node = |node| differs[look.region(node) as usize];
        let mut is_changed: Vec<bool> = (0..self.surface.graph.len()).map(of_node).collect();
        nearer.iter().for_each(|&node| is_changed[node as usize] = true);
        (0..is_changed.len() as u32)
            .filter(|&node| is_changed[node as usize])
            .collect()
    }

    /// Imported images show each class in many places; looks add nothing to them.
    fn looks_count(&self) -> bool {
        self.import.is_none()
    }

    /// Takes over imported images that have been propagated over this surface.
    pub fn set_import(&mut self, import: SurfaceImport) {
        self.votes = import.votes(&self.classes);
        self.import = Some(Arc::new(import));
        let seeds = self.seeds();
        self.geodesics.update(&self.surface.graph, seeds);
        self.refresh();
    }

    /// Whether the imported images of a label set are taken into account.
    pub fn has_import_of(&self, labels: &LabelSet) -> bool {
        self.import.as_ref().is_some_and(|import| import.is_of(labels))
    }

    /// Takes over the weights of the classes at each node by the semantic prior, positive, `[nodes, classes]`; weights
    /// of another number are ignored. They count as long as the classes stay as they are now.
    pub fn set_prior(&mut self, weights: Vec<f32>) {
        if weights.len() == self.surface.graph.len() * self.classes.len() {
            self.prior = Some((self.classes.clone(), Arc::new(weights)));
            self.refresh();
        }
    }

    fn refresh(&mut self) {
        let posterior = Posterior::new(&self.evidence(), self.surface.graph.len());
        self.posterior = Arc::new(posterior);
    }

    /// What is known of the classes.
    pub(crate) fn evidence(&self) -> Evidence<'_> {
        let prior = self
            .prior
            .as_ref()
            .filter(|(classes, _)| *classes == self.classes);
        Evidence {
            classes: &self.classes,
            geodesics: &self.geodesics,
            likeness: self.looks_count().then_some(&self.likeness),
            second_likeness: None,
            votes: self.votes.as_deref(),
            objects: self.import.as_deref().and_then(SurfaceImport::objects),
            prior: prior.map(|(_, weights)| weights.as_slice()),
        }
    }

    /// What would be known if no class were part of the room. Where there is a pretrained network, half counts what would then
    /// be known without it, half what is known (query by committee, Seung et al. 1992). `None` where that is no different.
    pub(crate) fn doubted(&self) -> Option<(Likeness, Posterior)> {
        if self.classes.is_empty() || !self.looks_count() {
            return None;
        }
        let (kinds, look) = (self.kinds.without_room(), self.surface.look.without_features());
        if kinds.is_none() && look.is_none() {
            return None;
        }
        let mut likeness = match look {
            Some(look) => Likeness::new(Arc::new(look)),
            None => self.likeness.clone(),
        };
        let kinds = kinds.as_ref().unwrap_or(&self.kinds);
        likeness.update((&self.classes, kinds), &self.geodesics);
        let differs = likeness.differing(&self.likeness.stretches);
        let mut posterior = Posterior::clone(&self.posterior);
        let changed = self.changed(Vec::new(), Some(differs));
        posterior.update(&self.doubted_evidence(&likeness), &changed);
        Some((likeness, posterior))
    }

    /// The evidence of [`LabelPropagation::doubted`], with the likeness that it returns.
    pub(crate) fn doubted_evidence<'a>(&'a self, likeness: &'a Likeness) -> Evidence<'a> {
        Evidence {
            likeness: Some(likeness),
            second_likeness: self.surface.look.has_features().then_some(&self.likeness),
            ..self.evidence()
        }
    }

    /// The dense map of a frame. Painted pixels have the class of their stroke, and those of trusted images theirs.
    pub fn map(&self, scene: &Arc<Scene>, frame: usize, generation: u64) -> FrameMap {
        FrameMap::on_surface((frame, generation), self.on_surface(scene, frame))
    }

    /// What the map of a frame is looked up from.
    fn on_surface(&self, scene: &Arc<Scene>, frame: usize) -> OnSurface {
        let painted = self.painted.get(&frame).into_iter().flatten();
        let mut last = None;
        let mut label = |said| match last {
            Some((same, label)) if same == said => label,
            _ => last.insert((said, self.label(said))).1,
        };
        OnSurface {
            scene: Arc::clone(scene),
            surface: Arc::clone(&self.surface),
            posterior: Arc::clone(&self.posterior),
            unknown: NodeSummary::unknown(self.classes.len()).entropy,
            import: self.import.clone(),
            whole: None,
            painted: painted.map(|(&pixel, &said)| (pixel, label(said))).collect(),
        }
    }

    /// Mean entropy over all pixels that show the surface, in nats.
    pub fn mean_entropy(&self) -> f32 {
        let nodes = self.surface.graph.nodes();
        let (sum, pixels) = nodes.iter().zip(&self.posterior.entropy).fold(
            (0.0_f64, 0.0_f64),
            |(sum, pixels), (node, &entropy)| {
                let weight = f64::from(node.pixels);
                (sum + weight * f64::from(entropy), pixels + weight)
            },
        );
        (sum / pixels.max(1.0)) as f32 / ENTROPY_STEPS_PER_NAT
    }

    /// Nodes that any stroke lies on, void ones included.
    pub fn said(&self) -> Vec<u32> {
        let mut nodes: Vec<u32> = self
            .painted
            .iter()
            .flat_map(|(&frame, pixels)| self.nodes_of(frame, pixels))
            .map(|(_, node)| node)
            .collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Whether there are any labels on the surface.
    pub(super) fn is_labelled(&self) -> bool {
        !self.geodesics.seeds().is_empty() || self.votes.is_some()
    }

    /// Labelled pixels of classes that are trained on: (frame, pixel index, class).
    pub fn labelled_pixels(&self) -> impl Iterator<Item = (usize, u32, ClassId)> + '_ {
        self.painted.iter().flat_map(|(&frame, pixels)| {
            pixels
                .iter()
                .filter(|(_, (class, _))| *class != VOID)
                .map(move |(&pixel, &(class, _))| (frame, pixel, class))
        })
    }

    /// The painted pixels of a frame with their nodes; pixels without a node are left out.
    fn nodes_of<'a>(
        &self,
        frame: usize,
        painted: &'a BTreeMap<u32, (ClassId, StrokeId)>,
    ) -> Vec<(&'a (ClassId, StrokeId), u32)> {
        let pixels: Vec<u32> = painted.keys().copied().collect();
        let nodes = self.surface.nodes_at(frame, &pixels);
        let all = painted.values().zip(nodes);
        all.filter_map(|(what, node)| Some((what, node?))).collect()
    }

    /// A copy of the present labels, to check the strokes against each other in the background.
    pub fn cross_validation(&self, scene: &Arc<Scene>) -> CrossValidation {
        CrossValidation {
            scene: Arc::clone(scene),
            surface: Arc::clone(&self.surface),
            classes: self.classes.clone(),
            strokes: self.strokes.clone(),
            geodesics: self.geodesics.clone(),
            labelled: self.evidence().likeness.map(|likeness| likeness.labelled.clone()),
            imported: self
                .import
                .iter()
                .flat_map(|import| import.seeds())
                .map(|(node, label)| (node, label.class))
                .collect(),
            votes: self.votes.clone(),
        }
    }

    /// The nodes that labels spread from: those under the painted pixels of a frame, except void ones and those where
    /// a scribble slipped over an edge.
    fn sources_of(
        &self,
        camera: &Camera,
        frame: usize,
        painted: &BTreeMap<u32, (ClassId, StrokeId)>,
    ) -> Vec<(StrokeId, u32, ClassId)> {
        let nodes = self.nodes_of(frame, painted).into_iter();
        let mut sources: Vec<(StrokeId, u32, ClassId)> = nodes
            .map(|(&(class, stroke), node)| (stroke, node, class))
            .filter(|&(_, _, class)| class != VOID)
            .collect();
        // Most pixels beside each other are of one voxel.
        sources.dedup();
        sources.sort_unstable();
        sources.dedup();
        let of_stroke = sources.chunk_by(|a, b| a.0 == b.0);
        let kept = of_stroke.flat_map(|own| {
            let stroke = self.strokes.get(&own[0].0);
            let strays = stroke.map_or_else(Vec::new, |stroke| strays(&self.surface, camera, stroke));
            let is_meant = move |node: u32| strays.binary_search(&node).is_err();
            own.iter().filter(move |(_, node, _)| is_meant(*node))
        });
        kept.copied().collect()
    }

    /// What a stroke says that says this class.
    fn label(&self, (class, stroke): (ClassId, StrokeId)) -> Label {
        let object = self.strokes.get(&stroke).and_then(|stroke| stroke.object);
        Label::new(class, object.filter(|_| self.kinds.of(class).thing))
    }

    /// The label of each labelled node: that of the latest stroke on it, or else that by trusted images. A stroke that says
    /// only the class leaves the object to them.
    fn seeds(&self) -> FxHashMap<u32, Label> {
        let mut latest: FxHashMap<u32, (ClassId, StrokeId)> = FxHashMap::default();
        for &(stroke, node, class) in self.sources.values().flatten() {
            let entry = latest.entry(node).or_insert((class, stroke));
            if stroke > entry.1 {
                *entry = (class, stroke);
            }
        }
        let imported = self.import.iter().flat_map(|import| import.seeds());
        let mut seeds: FxHashMap<u32, Label> = imported.collect();
        for (node, said) in latest {
            let label = self.label(said);
            let imported = seeds.get(&node).filter(|imported| imported.class == label.class);
            let object = label.object.or(imported.and_then(|imported| imported.object));
            seeds.insert(node, Label { object, ..label });
        }
        seeds
    }
}

/// Frames with strokes that differ.
fn changed_frames(
    before: &BTreeMap<StrokeId, Arc<Stroke>>,
    after: &BTreeMap<StrokeId, Arc<Stroke>>,
) -> BTreeSet<usize> {
    let changed = [(before, after), (after, before)].map(|(own, others)| {
        let differing = own
            .iter()
            .filter(move |&(id, stroke)| others.get(id) != Some(stroke));
        differing.map(|(_, stroke)| stroke.frame)
    });
    changed.into_iter().flatten().collect()
}
