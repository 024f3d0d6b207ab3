//! What is known of the frame in view: its image for the renderer, its map looked up, and the planes of the
//! layers that are shown. Nothing of another frame ever is among it.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use inplace_core::labels::{ClassId, Pixel};
use inplace_core::scene::Scene;
use inplace_core::session::{FrameMap, RenderedFrame, Status};
use inplace_model::layer::Layer;
use inplace_model::palette::Palette;
use inplace_model::versioned::{Version, Versioned};
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use super::content::{Content, Image, Picture, ShownMap};
use super::plane::{AGREEMENT, DepthPlane, Over, Texels, measured_depth};
use super::preparing::{AgreementPlane, FieldView, Part, Preparer, Request, Said, preparer};

/// How old a view of the field becomes at least before it is rendered again; one that took longer becomes as old
/// as that, so that training has half of the time.
const VIEW_EVERY: Duration = Duration::from_secs(2);

/// What is known of the frame in view. It follows the open scene: [`FrameView::follow`] notices what is new there, and
/// has a thread make what the layers need.
#[derive(Debug)]
pub struct FrameView {
    /// Serial number of the scene.
    serial: u64,
    scene: Arc<Scene>,
    frame: usize,
    preparer: Preparer,
    /// Images for the renderer: of the frame in view and those beside it.
    pictures: BTreeMap<usize, Arc<Picture>>,
    /// Why the file of any of these frames cannot be read any more, a sentence.
    unreadable: BTreeMap<usize, String>,
    /// Version of the image of the frame in view.
    image: Version,
    /// What became of the frame in view.
    known: Known,
    /// Version of the newest view that the scene had.
    rendered_seen: Option<Version>,
    /// When the frame came into view: what was made from earlier maps is of other frames.
    since: Version,
    /// What was asked of the thread last.
    wanted: Option<Wanted>,
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
    /// The measured depth, once it was asked for.
    depth: Option<Option<Versioned<DepthPlane>>>,
    /// The field as seen from the frame.
    view: Option<FieldView>,
    /// A view that has yet to be enlarged.
    rendered: Option<Versioned<Arc<RenderedFrame>>>,
    /// The view that was asked for last.
    asked: Option<Asked>,
}

/// A view that was asked for.
#[derive(Clone, Copy, Debug)]
struct Asked {
    when: Instant,
    /// When all of it was there.
    answered: Option<Instant>,
}

impl Asked {
    /// Whether another one may be asked for.
    fn is_old(&self, now: Instant) -> bool {
        self.answered.is_some_and(|answered| {
            let took = answered.duration_since(self.when);
            now.duration_since(answered) >= took.max(VIEW_EVERY)
        })
    }
}

/// What the layers that are shown need, by versions.
#[derive(Clone, Debug, PartialEq)]
struct Wanted {
    frame: usize,
    map: Option<Version>,
    visible: bool,
    /// Generation of the labels and version of the contradicted strokes.
    said: Option<(u64, Version)>,
    depth: bool,
    rendered: Option<Version>,
}

impl FrameView {
    /// Nothing yet of the frame in view of a scene; whenever something is ready, this window is woken.
    pub fn new(workspace: &Workspace, ctx: &egui::Context) -> Self {
        Self {
            serial: workspace.serial,
            scene: Arc::clone(&workspace.scene),
            frame: workspace.frame_index,
            preparer: preparer(ctx.clone()),
            pictures: BTreeMap::new(),
            unreadable: BTreeMap::new(),
            image: Version::new(),
            known: Known::default(),
            rendered_seen: None,
            since: Version::new(),
            wanted: None,
        }
    }

    /// Whether it is of this scene.
    pub fn is_of(&self, workspace: &Workspace) -> bool {
        self.serial == workspace.serial
    }

    /// Takes over what is new in the scene and what was made of it, and has whatever these layers need made. Costs next
    /// to nothing when nothing has changed.
    pub fn follow(&mut self, workspace: &Workspace, layers: &[Layer], now: Instant, commands: &mut Commands) {
        if self.frame != workspace.frame_index {
            self.go_to(workspace.frame_index);
        }
        let count = workspace.map_version(self.frame);
        if self.known.newest_count != count {
            self.known.newest_count = count;
            self.take_map(workspace.newest_map(self.frame));
        }
        if let Some(rendered) = workspace.rendered.as_ref()
            && self.rendered_seen != Some(rendered.version())
        {
            self.rendered_seen = Some(rendered.version());
            self.take_rendered(rendered, now);
        }
        self.collect();
        self.want(workspace, layers, now, commands);
    }

    /// Another frame has come into view.
    fn go_to(&mut self, frame: usize) {
        self.frame = frame;
        self.image = Version::new();
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

    /// A view of the field was rendered.
    fn take_rendered(&mut self, rendered: &Versioned<Arc<RenderedFrame>>, now: Instant) {
        if let Some(asked) = self.known.asked.as_mut().filter(|_| rendered.is_last) {
            asked.answered = Some(now);
        }
        // A coarse one is better than nothing, but not than a fine one of a little while ago.
        if rendered.is_last || (self.known.view.is_none() && self.known.rendered.is_none()) {
            self.known.rendered = Some(rendered.clone());
        }
    }

    /// Takes over what is ready; what is of another frame by now is dropped.
    fn collect(&mut self) {
        while let Some(part) = self.preparer.next() {
            match part {
                Part::Picture(frame, picture) => {
                    if frame.abs_diff(self.frame) <= 1 {
                        self.unreadable.remove(&frame);
                        match picture {
                            Ok(picture) => drop(self.pictures.insert(frame, picture)),
                            Err(reason) => drop(self.unreadable.insert(frame, reason)),
                        }
                    }
                }
                Part::Map(map) => {
                    let newer = self
                        .known
                        .map
                        .as_ref()
                        .is_none_or(|shown| shown.map.version() < map.version());
                    if map.frame == self.frame && newer {
                        self.known.map = Some(ShownMap::new(map));
                    }
                }
                Part::Visible(map, classes) => {
                    if map > self.since {
                        self.known.visible = Some((map, classes));
                    }
                }
                Part::Agreement(plane) => {
                    if plane.map > self.since {
                        self.known.agreement = Some(plane);
                    }
                }
                Part::Depth(frame, plane) => {
                    if frame == self.frame {
                        self.known.depth = Some(plane);
                    }
                }
                Part::View(view) => {
                    if view.rendered.frame == self.frame {
                        self.known
                            .rendered
                            .take_if(|rendered| Arc::ptr_eq(rendered, &view.rendered));
                        self.known.view = Some(*view);
                    }
                }
            }
        }
    }

    /// Asks for whatever these layers need and what is not there yet.
    fn want(&mut self, workspace: &Workspace, layers: &[Layer], now: Instant, commands: &mut Commands) {
        let measured = workspace.frame().is_some_and(|frame| frame.has_depth());
        let shows = |layer| layers.contains(&layer);
        if layers.iter().any(|layer| layer.is_rendered()) || (shows(Layer::Depth) && !measured) {
            self.ask_for_view(&workspace.status, now, commands);
        }
        let (document, contradicted) = (&workspace.document, &workspace.overview.contradicted);
        let said = (document.generation(), contradicted.version());
        let map = self.known.newest.as_ref().map(Versioned::version);
        let wanted = Wanted {
            frame: self.frame,
            map,
            visible: shows(Layer::Labels) || shows(Layer::RenderedLabels),
            said: shows(Layer::Disagreement).then_some(said),
            depth: shows(Layer::Depth) && measured,
            rendered: self.known.rendered.as_ref().map(Versioned::version),
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
        let counted = self
            .known
            .visible
            .as_ref()
            .is_some_and(|(of, _)| Some(*of) == map);
        let compared = |plane: &AgreementPlane| Some(plane.map) == map && plane.said == said;
        let compared = self.known.agreement.as_ref().is_some_and(compared);
        self.preparer.ask(Request {
            scene: Arc::clone(&self.scene),
            frame: self.frame,
            pictures: near.into_iter().flatten().filter(missing).collect(),
            map: self.known.newest.clone(),
            visible: wanted.visible && !counted,
            said: wanted.said.filter(|_| !compared).map(|(generation, _)| Said {
                labels: document.labels().clone(),
                contradicted: contradicted.clone(),
                generation,
            }),
            depth: wanted.depth && self.known.depth.is_none(),
            view: self.known.rendered.as_deref().cloned(),
        });
        self.wanted = Some(wanted);
    }

    /// Asks for a view when there is none, or when the one there is has become old.
    fn ask_for_view(&mut self, status: &Status, now: Instant, commands: &mut Commands) {
        let due = self.known.asked.is_none_or(|asked| {
            let outdated = |view: &FieldView| {
                let of = &view.rendered;
                (of.steps, of.semantic_steps, of.generation)
                    != (status.steps, status.semantic_steps, status.generation)
            };
            self.known.view.as_ref().is_some_and(outdated) && asked.is_old(now)
        });
        if due {
            self.known.asked = Some(Asked {
                when: now,
                answered: None,
            });
            commands.push(Command::Render);
        }
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
        self.known.view.as_ref()
    }

    /// The classes that the map shows with their pixels, most first; those of the map before while the new ones
    /// are counted.
    pub fn visible(&self) -> Option<&[(ClassId, u32)]> {
        let (_, classes) = self.known.visible.as_ref().filter(|_| self.known.map.is_some())?;
        Some(classes)
    }

    /// Depths of the frame, with whether they are measured; `None` while they are not known.
    pub fn depth(&self) -> Option<(&Versioned<DepthPlane>, bool)> {
        match (&self.known.depth, &self.known.view) {
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
        measured.or_else(|| Some((self.known.view.as_ref()?.rendered.depth_at([x, y])?, false)))
    }

    /// How the labels agree with the map; `None` while that is not known.
    pub fn agreement(&self) -> Option<&AgreementPlane> {
        self.known.agreement.as_ref().filter(|_| self.known.map.is_some())
    }

    /// What a layer of the frame looks like; `None` in a scene without frames. A layer that is not ready is
    /// the image alone.
    pub fn content(&self, layer: Layer, palette: &Versioned<Arc<Palette>>) -> Option<Content> {
        self.scene.frames.get(self.frame)?;
        let map = self.known.map.as_ref();
        let mut content = Content {
            image: Image::OfFrame(Arc::clone(&self.scene), self.frame),
            image_version: self.image,
            picture: self.pictures.get(&self.frame).cloned(),
            over: None,
            map: map.map(|shown| shown.map.clone()),
            palette: palette.clone(),
        };
        match layer {
            Layer::Color => {}
            Layer::Labels | Layer::Entropy => content.over = map.and_then(|map| map.over(layer, palette)),
            Layer::Disagreement => content.over = self.agreement().map(agreement_over),
            Layer::Depth => content.over = self.depth().map(|(plane, _)| depth_over(plane)),
            _ => {
                if let Some(view) = &self.known.view {
                    content.image = Image::Own(Arc::clone(&view.color));
                    content.image_version = view.picture.version;
                    content.picture = Some(Arc::clone(&view.picture));
                    let labels = view.labels.as_ref();
                    content.over = match layer {
                        Layer::RenderedLabels => labels.and_then(|map| map.over(Layer::Labels, palette)),
                        Layer::RenderedEntropy => labels.and_then(|map| map.over(Layer::Entropy, palette)),
                        Layer::RenderedDepth => Some(depth_over(&view.depth)),
                        _ => None,
                    };
                }
            }
        }
        Some(content)
    }
}

fn depth_over(plane: &Versioned<DepthPlane>) -> Over {
    Over {
        size: plane.size,
        texels: Texels::Made(Arc::clone(&plane.values)),
        version: plane.version(),
        reading: DepthPlane::READING,
        greyed: false,
    }
}

fn agreement_over(plane: &AgreementPlane) -> Over {
    Over {
        size: plane.size,
        texels: Texels::Made(Arc::clone(&plane.values)),
        version: plane.values.version(),
        reading: AGREEMENT,
        greyed: true,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_view_that_took_long_is_not_rendered_again_before_as_long_again() {
        let when = Instant::now();
        let after = |seconds| when + Duration::from_secs(seconds);
        let asked = |answered| Asked { when, answered };
        assert!(!asked(None).is_old(after(100)));
        let quick = asked(Some(after(1)));
        assert!(!quick.is_old(after(2)) && quick.is_old(after(3)));
        let slow = asked(Some(after(10)));
        assert!(!slow.is_old(after(19)) && slow.is_old(after(20)));
    }
}
