//! What is known of the frame in view: its image for the renderer, its map looked up, and the planes of the
//! layers that are shown. Nothing of another frame ever is among it.

use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};

use inplace_core::labels::{ClassId, Pixel};
use inplace_core::scene::Scene;
use inplace_core::session::{Command, FrameMap, RenderedFrame};

use crate::canvas::{
    Content, DepthPlane, FieldView, Image, Layer, Made, Over, Palette, Part, Picture, Preparer, Request,
    SERIAL_STEP, Said, ShownMap, Texels, VERDICTS, measured_depth, preparer,
};
use crate::document::Document;
use crate::overview::Contradicted;
use crate::session_link::Running;

/// How old a view of the field becomes at least before it is rendered again; one that took longer becomes as old
/// as that, so that training has half of the time.
const VIEW_EVERY: Duration = Duration::from_secs(2);

/// What is known of the frame in view.
#[derive(Debug)]
pub struct Shown {
    scene: Arc<Scene>,
    /// First serial number of this scene.
    first: u64,
    frame: usize,
    preparer: Preparer,
    /// Images for the renderer: of the frame in view and those beside it.
    pictures: BTreeMap<usize, Arc<Picture>>,
    /// Why the file of any of these frames cannot be read any more, a sentence.
    unreadable: BTreeMap<usize, String>,
    /// The newest map, looked up or not, with its number.
    newest: Option<(Arc<FrameMap>, u64)>,
    /// The newest map that is looked up.
    map: Option<ShownMap>,
    /// The classes that the map with this number shows.
    visible: Option<(u64, Vec<(ClassId, u32)>)>,
    /// Verdicts on the pixels, by the number of the map and the version of what was said.
    verdicts: Option<(u64, (u64, u64), Made)>,
    /// The measured depth once it was asked for, and its serial number.
    depth: Option<(Option<DepthPlane>, u64)>,
    /// The field as seen from the frame.
    view: Option<FieldView>,
    /// A view that has yet to be enlarged.
    rendered: Option<Arc<RenderedFrame>>,
    /// Counts up with every view that was rendered.
    rendered_version: u64,
    /// Why there is no view, if there will be none.
    no_view: Option<String>,
    /// The view that was asked for last.
    asked: Option<Asked>,
    /// Number of the last map, of this frame or another; a multiple of [`SERIAL_STEP`].
    last_number: u64,
    /// What it was when the frame came into view: what was made from maps up to that one is of other frames.
    number_before: u64,
    /// What was asked of the thread last.
    wanted: Option<Wanted>,
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
    map: u64,
    visible: bool,
    /// Version of the labels and of the contradicted strokes.
    said: Option<(u64, u64)>,
    depth: bool,
    rendered: u64,
}

impl Shown {
    /// Nothing yet of the first frame of a scene; whenever something is ready, this window is woken. `serial`
    /// tells scenes apart.
    pub fn new(scene: &Arc<Scene>, serial: u64, ctx: &egui::Context) -> Self {
        // What the renderer holds of another scene must not be taken for something of this one.
        let first = serial << 32;
        Self {
            scene: Arc::clone(scene),
            first,
            frame: 0,
            // The numbers of a map and its entropy lie before these.
            preparer: preparer(ctx.clone(), first + 2),
            pictures: BTreeMap::new(),
            unreadable: BTreeMap::new(),
            newest: None,
            map: None,
            visible: None,
            verdicts: None,
            depth: None,
            view: None,
            rendered: None,
            rendered_version: 0,
            no_view: None,
            asked: None,
            last_number: first,
            number_before: first,
            wanted: None,
        }
    }

    /// Another frame comes into view, with its newest map if it has one.
    pub fn go_to(&mut self, frame: usize, map: Option<Arc<FrameMap>>) {
        self.frame = frame;
        self.newest = None;
        self.map = None;
        self.visible = None;
        self.verdicts = None;
        self.depth = None;
        self.view = None;
        self.rendered = None;
        self.asked = None;
        self.number_before = self.last_number;
        self.pictures.retain(|&kept, _| kept.abs_diff(frame) <= 1);
        self.unreadable.retain(|&kept, _| kept.abs_diff(frame) <= 1);
        self.take_map(map);
    }

    /// A newer map of the frame in view. It is shown at once where it is looked up already, and else as soon
    /// as it is; until then the one before stays.
    pub fn take_map(&mut self, map: Option<Arc<FrameMap>>) {
        let Some(map) = map.filter(|map| map.frame == self.frame && map.width > 0 && map.height > 0) else {
            return;
        };
        self.last_number += SERIAL_STEP;
        let serial = self.last_number;
        if map.is_looked_up() {
            let map = Arc::clone(&map);
            self.map = Some(ShownMap { map, serial });
        }
        self.newest = Some((map, serial));
    }

    /// A view of the field was rendered.
    pub fn take_view(&mut self, view: Arc<RenderedFrame>) {
        if view.frame != self.frame {
            return;
        }
        if let Some(asked) = self.asked.as_mut().filter(|_| view.is_last) {
            asked.answered = Some(Instant::now());
        }
        self.no_view = None;
        // A coarse one is better than nothing, but not than a fine one of a little while ago.
        if view.is_last || (self.view.is_none() && self.rendered.is_none()) {
            self.rendered = Some(view);
            self.rendered_version += 1;
        }
    }

    /// There will be no view of the field, for a reason that is a sentence.
    pub fn take_no_view(&mut self, reason: String) {
        self.no_view = Some(reason);
    }

    /// Takes over what is ready; what is of another frame by now is dropped.
    pub fn collect(&mut self) {
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
                Part::Map(map, serial) => {
                    let newer = self.map.as_ref().is_none_or(|shown| shown.serial < serial);
                    if map.frame == self.frame && newer {
                        self.map = Some(ShownMap { map, serial });
                    }
                }
                Part::Visible(number, classes) => {
                    if number > self.number_before {
                        self.visible = Some((number, classes));
                    }
                }
                Part::Verdicts(number, version, made) => {
                    if number > self.number_before {
                        self.verdicts = Some((number, version, made));
                    }
                }
                Part::Depth(frame, plane, serial) => {
                    if frame == self.frame {
                        self.depth = Some((plane, serial));
                    }
                }
                Part::View(view) => {
                    if view.rendered.frame == self.frame {
                        self.rendered
                            .take_if(|rendered| Arc::ptr_eq(rendered, &view.rendered));
                        self.view = Some(*view);
                    }
                }
            }
        }
    }

    /// Asks for whatever these layers need and what is not there yet. Costs next to nothing when nothing has
    /// changed.
    pub fn want(
        &mut self,
        layers: &[Layer],
        (document, (contradicted, contradicted_version)): (&Document, (&Arc<Contradicted>, u64)),
        session: &Running,
        steps: u64,
        now: Instant,
    ) {
        let measured = self
            .scene
            .frames
            .get(self.frame)
            .is_some_and(|frame| frame.has_depth());
        let shows = |layer| layers.contains(&layer);
        if shows(Layer::Rendered) || (shows(Layer::Depth) && !measured) {
            self.ask_for_view(session, steps, now);
        }
        let said = (document.generation(), contradicted_version);
        let map = self.newest.as_ref().map_or(0, |(_, number)| *number);
        let wanted = Wanted {
            frame: self.frame,
            map,
            visible: shows(Layer::Labels),
            said: shows(Layer::Disagreement).then_some(said),
            depth: shows(Layer::Depth) && measured,
            rendered: self.rendered_version,
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
        let counted = self.visible.as_ref().is_some_and(|(number, _)| *number == map);
        let judged = |(number, version, _): &(u64, (u64, u64), Made)| *number == map && *version == said;
        let judged = self.verdicts.as_ref().is_some_and(judged);
        self.preparer.ask(Request {
            scene: Arc::clone(&self.scene),
            frame: self.frame,
            pictures: near.into_iter().flatten().filter(missing).collect(),
            map: self.newest.clone(),
            visible: wanted.visible && !counted,
            said: wanted.said.filter(|_| !judged).map(|version| Said {
                labels: document.labels().clone(),
                contradicted: Arc::clone(contradicted),
                version,
            }),
            depth: wanted.depth && self.depth.is_none(),
            view: self.rendered.clone(),
        });
        self.wanted = Some(wanted);
    }

    /// Asks for a view when there is none, or when the one there is has become old.
    fn ask_for_view(&mut self, session: &Running, steps: u64, now: Instant) {
        let due = self.asked.is_none_or(|asked| {
            let outdated = |view: &FieldView| view.rendered.steps != steps;
            self.view.as_ref().is_some_and(outdated) && asked.is_old(now)
        });
        if due {
            self.asked = Some(Asked {
                when: now,
                answered: None,
            });
            session.send(Command::Render { frame: self.frame });
        }
    }

    /// Why the file of the frame in view cannot be read any more, a sentence; `None` of an image that is there or being
    /// read. It is tried again when the frame comes into view again.
    pub fn unreadable(&self) -> Option<&str> {
        self.unreadable.get(&self.frame).map(String::as_str)
    }

    /// The map shown.
    pub fn map(&self) -> Option<&ShownMap> {
        self.map.as_ref()
    }

    /// The field as seen from the frame.
    pub fn view(&self) -> Option<&FieldView> {
        self.view.as_ref()
    }

    /// Why the field cannot be seen.
    pub fn no_view(&self) -> Option<&str> {
        self.no_view.as_deref()
    }

    /// The classes that the map shows with their pixels, most first; those of the map before while the new ones
    /// are counted.
    pub fn visible(&self) -> Option<&[(ClassId, u32)]> {
        let (_, classes) = self.visible.as_ref().filter(|_| self.map.is_some())?;
        Some(classes)
    }

    /// Depths of the frame, with whether they are measured; `None` while they are not known.
    pub fn depth(&self) -> Option<(&DepthPlane, bool)> {
        match (&self.depth, &self.view) {
            (Some((Some(plane), _)), _) => Some((plane, true)),
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
        measured.or_else(|| Some((self.view.as_ref()?.rendered.depth_at([x, y])?, false)))
    }

    /// Whether a pixel's disagreement is known: the verdicts on the pixels of the frame.
    pub fn has_verdicts(&self) -> bool {
        self.verdicts().is_some()
    }

    fn verdicts(&self) -> Option<&Made> {
        let (_, _, made) = self.verdicts.as_ref().filter(|_| self.map.is_some())?;
        Some(made)
    }

    /// What a layer of the frame looks like; `None` in a scene without frames. A layer that is not ready is
    /// the image alone.
    pub fn content(&self, layer: Layer, palette: (&Arc<Palette>, u64)) -> Option<Content> {
        self.scene.frames.get(self.frame)?;
        let (palette, palette_serial) = palette;
        let map = self.map.as_ref();
        let picture = self.pictures.get(&self.frame);
        let mut content = Content {
            image: Image::OfFrame(Arc::clone(&self.scene), self.frame),
            image_serial: 2 * (self.first + self.frame as u64),
            picture: picture.cloned(),
            over: None,
            map: map.map(|shown| (shown.map.generation, shown.map.frame, shown.serial)),
            palette: Arc::clone(palette),
            palette_serial: self.first + palette_serial,
        };
        match layer {
            Layer::Color => {}
            Layer::Labels => content.over = map.map(ShownMap::labels),
            Layer::Entropy => content.over = map.map(|map| map.entropy(palette)),
            Layer::Disagreement => content.over = self.verdicts().map(verdicts_over),
            Layer::Depth => content.over = self.depth_over(),
            Layer::Rendered => {
                if let Some(view) = &self.view {
                    content.image = Image::Own(Arc::clone(&view.color));
                    content.image_serial = 2 * view.picture.serial + 1;
                    content.picture = Some(Arc::clone(&view.picture));
                }
            }
        }
        Some(content)
    }

    fn depth_over(&self) -> Option<Over> {
        let serial = match (&self.depth, &self.view) {
            (Some((Some(_), serial)), _) => *serial,
            (_, view) => view.as_ref()?.depth_serial,
        };
        let (plane, _) = self.depth()?;
        Some(Over {
            size: plane.size,
            texels: Texels::Made(Arc::clone(&plane.values)),
            serial,
            reading: DepthPlane::READING,
            greyed: false,
        })
    }
}

fn verdicts_over(made: &Made) -> Over {
    Over {
        size: made.size,
        texels: Texels::Made(Arc::clone(&made.values)),
        serial: made.serial,
        reading: VERDICTS,
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
