//! Propagates the labels of strokes and imported images over a surface, and so to every pixel.

mod preview;

use std::borrow::Cow;
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
use crate::scene::Scene;

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
    /// The strokes that `painted` was made from, and the nodes where each slipped over an edge, ascending.
    strokes: BTreeMap<StrokeId, Arc<Stroke>>,
    strays: BTreeMap<StrokeId, Vec<u32>>,
    /// What strokes paint on each frame that has any.
    painted: BTreeMap<usize, Paint>,
    /// The newest weights by the semantic prior: the classes that it was trained on, and positive weights
    /// `[nodes, classes]`. They are kept when the classes change, so that an undo restores the maps of before.
    prior: Option<(Vec<ClassId>, Arc<Vec<f32>>)>,
    /// The imported images, and the class weights that they give the nodes where they count as votes.
    import: Option<Arc<SurfaceImport>>,
    votes: Option<Arc<[f32]>>,
}

/// What strokes paint on a frame.
#[derive(Clone, Debug)]
struct Paint {
    /// The painted pixels and what they say, ascending; shared with the maps.
    pixels: Arc<[(u32, Label)]>,
    /// The nodes under them that labels spread from, and the strokes that say so.
    sources: Vec<(StrokeId, u32, Label)>,
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
            strays: BTreeMap::new(),
            painted: BTreeMap::new(),
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
        let kinds = Kinds::new(&labels.classes);
        let is_other_kind = |stroke: &Stroke| {
            stroke.object.is_some() && kinds.of(stroke.class).thing != self.kinds.of(stroke.class).thing
        };
        let mut changed = changed_frames(&self.strokes, &labels.strokes);
        let of_other_kind = labels.strokes.values().filter(|stroke| is_other_kind(stroke));
        changed.extend(of_other_kind.map(|stroke| stroke.frame));
        self.strays
            .retain(|id, _| self.strokes.get(id) == labels.strokes.get(id));
        self.strokes.clone_from(&labels.strokes);
        self.kinds = kinds;
        for frame in changed {
            self.paint(scene, labels, frame);
        }
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

    /// Paints the strokes of a frame anew.
    fn paint(&mut self, scene: &Scene, labels: &LabelSet, frame: usize) {
        let Some(own) = scene.frames.get(frame) else {
            return;
        };
        for (id, stroke) in labels.strokes_of(frame) {
            let strays = || strays(&self.surface, &own.camera, stroke);
            self.strays.entry(id).or_insert_with(strays);
        }
        let mut pixels = rasterise(labels, frame, own.camera.width, own.camera.height);
        let hidden = own.hidden_pixels();
        pixels.retain(|&(pixel, _)| hidden.binary_search(&(pixel as usize)).is_err());
        if pixels.is_empty() {
            self.painted.remove(&frame);
            return;
        }
        let indices: Vec<u32> = pixels.iter().map(|&(pixel, _)| pixel).collect();
        let nodes = self.surface.nodes_at(frame, &indices);
        let said = pixels.iter().map(|&(_, (_, stroke))| stroke).zip(nodes);
        let mut sources: Vec<(StrokeId, u32)> =
            said.filter_map(|(stroke, node)| Some((stroke, node?))).collect();
        // Most pixels beside each other are of one voxel.
        sources.dedup();
        sources.sort_unstable();
        sources.dedup();
        let is_meant = |(stroke, node): &(StrokeId, u32)| self.strays[stroke].binary_search(node).is_err();
        let sources = sources.into_iter().filter(is_meant);
        let sources = sources.map(|(stroke, node)| (stroke, node, self.label(&self.strokes[&stroke])));
        let paint = Paint {
            sources: sources.filter(|(_, _, label)| label.class != VOID).collect(),
            pixels: pixels
                .chunk_by(|(_, a), (_, b)| a == b)
                .flat_map(|run| {
                    let label = self.label(&self.strokes[&run[0].1.1]);
                    run.iter().map(move |&(pixel, _)| (pixel, label))
                })
                .collect(),
        };
        self.painted.insert(frame, paint);
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

    /// The same as long as no semantic prior is known, as on a surface that has just been built.
    pub(crate) fn without_prior(&self) -> Cow<'_, Self> {
        if self.prior.is_none() {
            return Cow::Borrowed(self);
        }
        let mut bare = Self {
            prior: None,
            ..self.clone()
        };
        bare.refresh();
        Cow::Owned(bare)
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
        let painted = self.painted.get(&frame);
        OnSurface {
            scene: Arc::clone(scene),
            surface: Arc::clone(&self.surface),
            posterior: Arc::clone(&self.posterior),
            unknown: NodeSummary::unknown(self.classes.len()).entropy,
            import: self.import.clone(),
            whole: None,
            painted: painted.map_or_else(Arc::default, |painted| Arc::clone(&painted.pixels)),
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
        let of_frame = |(&frame, painted): (&usize, &Paint)| {
            let pixels: Vec<u32> = painted.pixels.iter().map(|&(pixel, _)| pixel).collect();
            self.surface.nodes_at(frame, &pixels).into_iter().flatten()
        };
        let mut nodes: Vec<u32> = self.painted.iter().flat_map(of_frame).collect();
        nodes.sort_unstable();
        nodes.dedup();
        nodes
    }

    /// Whether there are any labels on the surface.
    pub(super) fn is_labelled(&self) -> bool {
        !self.geodesics.seeds().is_empty() || self.votes.is_some()
    }

    /// The painted pixels of each frame that has any, with what they say.
    pub(super) fn painted(&self) -> impl Iterator<Item = (usize, &[(u32, Label)])> {
        let all = self.painted.iter();
        all.map(|(&frame, painted)| (frame, &*painted.pixels))
    }

    /// A copy of the present labels, to check the strokes against each other in the background.
    pub fn cross_validation(&self, scene: &Arc<Scene>) -> CrossValidation {
        CrossValidation {
            scene: Arc::clone(scene),
            surface: Arc::clone(&self.surface),
            classes: self.classes.clone(),
            strokes: self.strokes.clone(),
            strays: self.strays.clone(),
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

    /// What a stroke says.
    fn label(&self, stroke: &Stroke) -> Label {
        let object = stroke.object.filter(|_| self.kinds.of(stroke.class).thing);
        Label::new(stroke.class, object)
    }

    /// The label of each labelled node: that of the latest stroke on it, or else that by trusted images. A stroke that says
    /// only the class leaves the object to them.
    fn seeds(&self) -> FxHashMap<u32, Label> {
        let mut latest: FxHashMap<u32, (StrokeId, Label)> = FxHashMap::default();
        for &(stroke, node, label) in self.painted.values().flat_map(|painted| &painted.sources) {
            let entry = latest.entry(node).or_insert((stroke, label));
            if stroke > entry.0 {
                *entry = (stroke, label);
            }
        }
        let imported = self.import.iter().flat_map(|import| import.seeds());
        let mut seeds: FxHashMap<u32, Label> = imported.collect();
        for (node, (_, label)) in latest {
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
