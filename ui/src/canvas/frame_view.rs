//! What is known of the frame in view: its image for the renderer, its map looked up, and the planes of the
//! layers that are shown. Nothing of another frame ever is among it.

use std::collections::BTreeMap;
use std::sync::Arc;

use inplace_core::labels::{ClassId, Pixel};
use inplace_core::scene::Scene;
use inplace_core::session::FrameMap;
use inplace_model::layer::Layer;
use inplace_model::palette::Palette;
use inplace_model::versioned::{Version, Versioned};
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use super::content::{Content, Picture, ShownMap};
use super::field_view::{FieldView, FieldViewer};
use super::objects::{self, EntryColors, ObjectPlane, Question, SceneObjects};
use super::plane::{DepthPlane, Over, Texels, measured_depth};
use super::preparing::{self, AgreementPlane, DifferencePlane, Part, Request, Said};
use crate::background::Background;

/// What is known of the frame in view. It follows the open scene: [`FrameView::follow`] notices what is new there, and
/// has a thread make what the layers need.
#[derive(Debug)]
pub struct FrameView {
    /// Serial number of the scene.
    pub(super) serial: u64,
    scene: Arc<Scene>,
    frame: usize,
    preparer: Background<Request, Part>,
    objects: Background<Question, ObjectPlane>,
    /// Images for the renderers: of the frame in view and those beside it.
    pictures: BTreeMap<usize, Arc<Picture>>,
    /// Why the file of any of these frames cannot be read any more, a sentence.
    unreadable: BTreeMap<usize, String>,
    /// What became of the frame in view.
    known: Known,
    /// The field as seen from it.
    field: FieldViewer,
    /// When the frame came into view: what was made from earlier maps is of other frames.
    since: Version,
    /// What was asked of the thread last.
    wanted: Option<Wanted>,
    /// The map whose objects were asked for last, with whether it had a surface and the generation of the labels then.
    asked_objects: Option<(Version, bool, u64)>,
}

/// What is known of one frame.
#[derive(Debug, Default)]
struct Known {
    /// The newest map, looked up or not, and what the scene counted it as.
    newest: Option<Versioned<Arc<FrameMap>>>,
    newest_count: u64,
    /// The newest map that is looked up.
    map: Option<ShownMap>,
    /// The classes that the map with this version shows.
    visible: Option<(Version, Vec<(ClassId, u32)>)>,
    /// How the labels agree with a map.
    agreement: Option<AgreementPlane>,
    /// Where a map differs from another project's.
    differences: Option<DifferencePlane>,
    /// The objects that a map shows, once they were asked for.
    objects: Option<ObjectPlane>,
    /// Their colours.
    object_colors: EntryColors,
    /// The measured depth, once it was asked for.
    depth: Option<Option<Versioned<DepthPlane>>>,
}

/// What the layers that are shown need, by versions.
#[derive(Clone, Debug, PartialEq)]
struct Wanted {
    frame: usize,
    map: Option<Version>,
    visible: bool,
    /// Generation of the labels and version of the contradicted strokes.
    said: Option<(u64, Version)>,
    /// Version of the matching of the own classes with those of another project.
    other: Option<Version>,
    depth: bool,
}

impl FrameView {
    /// Nothing yet of the frame in view of a scene; whenever something is ready, this window is woken.
    pub fn new(workspace: &Workspace, ctx: &egui::Context) -> Self {
        Self {
            serial: workspace.serial,
            scene: Arc::clone(&workspace.scene),
            frame: workspace.frame_index,
            preparer: Background::new(ctx.clone(), "canvas", preparing::answer),
            objects: Background::new(ctx.clone(), "objects", objects::find),
            pictures: BTreeMap::new(),
            unreadable: BTreeMap::new(),
            known: Known::default(),
            field: FieldViewer::new(ctx.clone()),
            since: Version::new(),
            wanted: None,
            asked_objects: None,
        }
    }

    /// Takes over what is new in the scene and what was made of it, and has whatever these layers need made, and the objects
    /// found where they are wanted. Costs next to nothing when nothing has changed.
    pub fn follow(
        &mut self,
        workspace: &Workspace,
        (layers, objects): (&[Layer], bool),
        commands: &mut Commands,
    ) {
        if !Arc::ptr_eq(&self.scene, &workspace.scene) {
            // All of it is read by now.
            self.scene = Arc::clone(&workspace.scene);
            self.unreadable.clear();
            self.wanted = None;
        }
        if self.frame != workspace.frame_index {
            self.go_to(workspace.frame_index);
        }
        let count = workspace.map_version(self.frame);
        if self.known.newest_count != count {
            self.known.newest_count = count;
            self.take_map(workspace.newest_map(self.frame));
        }
        self.collect();
        let measured = workspace.frame().is_some_and(|frame| frame.has_depth());
        if let Some(frame) = workspace.frame() {
            let of_field = |layer: &Layer| layer.is_rendered() || (*layer == Layer::Depth && !measured);
            let wanted = layers.iter().any(of_field);
            self.field.follow(workspace, frame.viewpoint(), wanted, commands);
        }
        self.want(workspace, layers, measured);
        self.follow_objects(workspace, objects, commands);
    }

    /// Takes over the objects that were found, and asks for those of the newest map while they are wanted.
    fn follow_objects(&mut self, workspace: &Workspace, wanted: bool, commands: &mut Commands) {
        if !wanted {
            self.known.objects = None;
            self.asked_objects = None;
            return;
        }
        if let Some(plane) = self.objects.newest()
            && plane.map > self.since
        {
            if let Some(scene) = &plane.scene {
                let (found, parts) = (Arc::clone(&scene.found), Arc::clone(&scene.parts));
                commands.push(Command::SeeObjects(found, parts));
            }
            self.known.objects = Some(plane);
        }
        if let Some(plane) = &self.known.objects {
            let classes = workspace.document.palette();
            self.known.object_colors.follow(&plane.entries, classes);
        }
        let Some(map) = &self.known.newest else {
            return;
        };
        // With newer labels an older map would show objects for a moment that neither has, and one without a surface none:
        // what a click says in view comes before the rest of the scene.
        let generation = workspace.document.generation();
        let has_surface = map.surface().is_some();
        let may_ask = map.generation == generation && has_surface || self.known.objects.is_none();
        let asked = (map.version(), has_surface, generation);
        if may_ask && self.asked_objects != Some(asked) {
            self.asked_objects = Some(asked);
            self.objects.ask(Question {
                map: map.clone(),
                labels: workspace.document.labels().clone(),
                parts: Arc::clone(&workspace.parts),
            });
        }
    }

    /// Another frame has come into view.
    fn go_to(&mut self, frame: usize) {
        self.frame = frame;
        self.known = Known::default();
        self.since = Version::new();
        self.pictures.retain(|&kept, _| kept.abs_diff(frame) <= 1);
        self.unreadable.retain(|&kept, _| kept.abs_diff(frame) <= 1);
    }

    /// A newer map of the frame in view. It is shown at once where it is looked up already, and else as soon
    /// as it is; until then the one before stays.
    fn take_map(&mut self, map: Option<Arc<FrameMap>>) {
        let Some(map) = map.filter(|map| map.frame == self.frame && map.width > 0 && map.height > 0) else {
            return;
        };
        let map = Versioned::new(map);
        if map.is_looked_up() {
            self.known.map = Some(ShownMap::new(map.clone()));
        }
        self.known.newest = Some(map);
    }

    /// Takes over what is ready; what is of another frame by now is dropped.
    fn collect(&mut self) {
        while let Some(part) = self.preparer.next() {
            let known = &mut self.known;
            let shown = known.map.as_ref().map(|shown| shown.map.version());
            match part {
                Part::Picture(frame, picture) if frame.abs_diff(self.frame) <= 1 => {
                    self.unreadable.remove(&frame);
                    match picture {
                        Ok(picture) => drop(self.pictures.insert(frame, picture)),
                        Err(error) => drop(self.unreadable.insert(frame, error.to_string())),
                    }
                }
                Part::Map(map) if map.frame == self.frame && shown < Some(map.version()) => {
                    known.map = Some(ShownMap::new(map));
                }
                Part::Visible(map, classes) if map > self.since => known.visible = Some((map, classes)),
                Part::Agreement(plane) if plane.map > self.since => known.agreement = Some(plane),
                Part::Differences(plane) if plane.map > self.since => known.differences = Some(plane),
                Part::Depth(frame, plane) if frame == self.frame => known.depth = Some(plane),
                _ => {}
            }
        }
    }

    /// Asks for whatever these layers need and what is not there yet.
    fn want(&mut self, workspace: &Workspace, layers: &[Layer], measured: bool) {
        let shows = |layer| layers.contains(&layer);
        let (document, contradicted) = (&workspace.document, &workspace.overview.contradicted);
        let said = (document.generation(), contradicted.version());
        let map = self.known.newest.as_ref().map(Versioned::version);
        let comparison = workspace
            .comparison
            .as_ref()
            .filter(|_| shows(Layer::Differences));
        let other = comparison.map(|comparison| comparison.matching.version());
        if other.is_none() {
            self.known.differences = None;
        }
        let wanted = Wanted {
            frame: self.frame,
            map,
            visible: shows(Layer::Labels) || shows(Layer::RenderedLabels),
            said: shows(Layer::Disagreement).then_some(said),
            other,
            depth: shows(Layer::Depth) && measured,
        };
        if self.wanted.as_ref() == Some(&wanted) {
            return;
        }
        let near = [
            Some(self.frame),
            self.frame.checked_add(1),
            self.frame.checked_sub(1),
        ];
        let missing = |frame: &usize| !self.pictures.contains_key(frame) && *frame < self.scene.frames.len();
        self.preparer.ask(Request {
            scene: Arc::clone(&self.scene),
            frame: self.frame,
            pictures: near.into_iter().flatten().filter(missing).collect(),
            map: self.known.newest.clone(),
            visible: wanted.visible,
            said: wanted.said.map(|_| Said {
                labels: document.labels().clone(),
                contradicted: contradicted.clone(),
            }),
            other: comparison.map(|comparison| (Arc::clone(&comparison.other), comparison.matching.clone())),
            depth: wanted.depth && self.known.depth.is_none(),
        });
        self.wanted = Some(wanted);
    }

    /// Why the file of the frame in view cannot be read any more, a sentence; `None` of an image that is there or being
    /// read. It is tried again when the frame comes into view again.
    pub fn unreadable(&self) -> Option<&str> {
        self.unreadable.get(&self.frame).map(String::as_str)
    }

    /// The map shown.
    pub fn map(&self) -> Option<&ShownMap> {
        self.known.map.as_ref()
    }

    /// The field as seen from the frame.
    pub fn view(&self) -> Option<&FieldView> {
        self.field.view()
    }

    /// The classes that the map shows with their pixels, most first; those of the map before while the new ones
    /// are counted.
    pub fn visible(&self) -> Option<&[(ClassId, u32)]> {
        let (_, classes) = self.known.visible.as_ref().filter(|_| self.known.map.is_some())?;
        Some(classes)
    }

    /// Depths of the frame, with whether they are measured; `None` while they are not known.
    pub fn depth(&self) -> Option<(&Versioned<DepthPlane>, bool)> {
        match (&self.known.depth, self.field.view()) {
            (Some(Some(plane)), _) => Some((plane, true)),
            (_, Some(view)) => Some((&view.depth, false)),
            _ => None,
        }
    }

    /// Depth (z) in metres of a pixel with whether it is measured; `None` where it is not known.
    pub fn depth_at(&self, [x, y]: Pixel) -> Option<(f32, bool)> {
        let frame = self.scene.frames.get(self.frame)?;
        let index = y as usize * frame.camera.width as usize + x as usize;
        let depth = frame.pixels_at_hand().and_then(|pixels| pixels.depth);
        let measured = depth.and_then(|depth| measured_depth(frame, &depth, index));
        let measured = measured.map(|depth| (depth, true));
        measured.or_else(|| Some((self.view()?.rendered.depth_at([x, y])?, false)))
    }

    /// How the labels agree with the map; `None` while that is not known.
    pub fn agreement(&self) -> Option<&AgreementPlane> {
        self.known.agreement.as_ref().filter(|_| self.known.map.is_some())
    }

    /// Where the map differs from that of another project; `None` while that is not known, or not shown.
    pub fn differences(&self) -> Option<&DifferencePlane> {
        self.known
            .differences
            .as_ref()
            .filter(|_| self.known.map.is_some())
    }

    /// The objects that the map shows; those of the map before while the new ones are found.
    pub fn objects(&self) -> Option<&ObjectPlane> {
        self.known.objects.as_ref().filter(|_| self.known.map.is_some())
    }

    /// The objects of the scene, as they were found last.
    pub fn scene_objects(&self) -> Option<&Arc<SceneObjects>> {
        self.known.objects.as_ref()?.scene.as_ref()
    }

    /// What a layer of the frame looks like; `None` in a scene without frames. A layer that is not ready is
    /// the image alone.
    pub fn content(&self, layer: Layer, palette: &Versioned<Arc<Palette>>) -> Option<Content> {
        self.scene.frames.get(self.frame)?;
        let map = self.known.map.as_ref();
        let mut content = Content {
            picture: self.pictures.get(&self.frame).cloned(),
            over: None,
            map: map.map(|shown| shown.map.clone()),
            palette: palette.clone(),
        };
        match layer {
            Layer::Color => {}
            Layer::Labels | Layer::Entropy => content.over = map.and_then(|map| map.over(layer, palette)),
            Layer::Objects => {
                if let Some((plane, palette)) = self.objects().zip(self.known.object_colors.newest()) {
                    let texels = Texels::Made(Arc::clone(&plane.values));
                    content.over = Some(Over::classes(plane.size, texels, plane.values.version()));
                    content.palette = palette.clone();
                }
            }
            Layer::Disagreement => {
                content.over = self.agreement().map(|plane| plane.over.clone());
            }
            Layer::Differences => {
                content.over = self.differences().map(|plane| plane.over.clone());
            }
            Layer::Depth => content.over = self.depth().map(|(plane, _)| Over::depth(plane)),
            _ => {
                if let Some(view) = self.field.view() {
                    content = Content {
                        map: content.map,
                        ..view.content(layer, palette)
                    };
                }
            }
        }
        Some(content)
    }
}
