//! Small pictures of frames, made off the UI thread and kept as textures.

use std::collections::HashMap;
use std::hash::Hash;

use egui::{Rect, TextureHandle};
use inplace_core::guide::Suggestion;
use inplace_core::labels::Pixel;
use inplace_model::layer::{Layer, Look};
use inplace_model::versioned::Version;
use inplace_model::view::{ImagePart, crossings};
use inplace_model::workspace::Workspace;
use inplace_model::workspace::source::FrameSource;

use crate::background::{Background, Desk};
use crate::canvas::{pictures, rect_of};

/// Most textures kept.
const MOST: usize = 300;

/// What a thumbnail shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Subject {
    /// A whole frame.
    Frame(usize),
    /// The surroundings of a pixel of a frame.
    Place(usize, Pixel),
}

/// All that a thumbnail depends on, but for its subject: when this changes, it is made anew. The layer, the number of the
/// frame's map or of the list that a suggestion is from, and the version of the classes' colours, where they are shown.
type Shown = (Layer, u64, Option<Version>);

/// Draws all of a thumbnail in the middle of an area, as large as fits; returns where.
pub fn paint(thumbnail: &TextureHandle, painter: &egui::Painter, area: Rect) -> Rect {
    let size = thumbnail.size_vec2();
    let fitted = Rect::from_center_size(area.center(), size * (area.size() / size).min_elem());
    let whole = Rect::from_min_max(egui::pos2(0.0, 0.0), egui::pos2(1.0, 1.0));
    painter.image(thumbnail.id(), fitted, whole, egui::Color32::WHITE);
    fitted
}

struct Request {
    subject: Subject,
    shown: Shown,
    source: FrameSource,
    /// Of a place: the outline of its region; empty where it has none.
    outline: Vec<[f32; 2]>,
}

/// A thumbnail, with what it shows; none where the file of its frame cannot be read.
type Made = (Subject, Shown, Option<egui::ColorImage>);

#[derive(Default)]
struct Slot {
    /// What was asked for last.
    asked: Option<Shown>,
    /// What arrived last.
    arrived: Option<Shown>,
    thumbnail: Option<TextureHandle>,
    /// When it was last wanted.
    wanted: u64,
}

/// Thumbnails of a scene by subject. One request per subject is under way at a time; the newest version wins.
pub struct Thumbnails {
    thread: Background<Request, Made>,
    ctx: egui::Context,
    slots: HashMap<Subject, Slot>,
    clock: u64,
}

impl Thumbnails {
    /// Starts the thread that makes thumbnails of at most `size` pixels.
    pub fn new(ctx: egui::Context, size: [usize; 2]) -> Self {
        Self {
            thread: started(&ctx, size),
            ctx,
            slots: HashMap::new(),
            clock: 0,
        }
    }

    /// Takes finished thumbnails over; call once per frame.
    pub fn collect(&mut self) {
        self.clock += 1;
        while let Some((subject, shown, image)) = self.thread.next() {
            // One that was forgotten meanwhile is asked for again when it is wanted.
            let Some(slot) = self.slots.get_mut(&subject) else {
                continue;
            };
            slot.arrived = Some(shown);
            let Some(image) = image else {
                continue;
            };
            let options = egui::TextureOptions::LINEAR;
            match &mut slot.thumbnail {
                Some(thumbnail) => thumbnail.set(image, options),
                empty => *empty = Some(self.ctx.load_texture("thumbnail", image, options)),
            }
        }
        if self.slots.len() > MOST {
            let oldest = self.clock.saturating_sub(2);
            self.slots.retain(|_, slot| slot.wanted >= oldest);
        }
    }

    /// The newest thumbnail of a frame in this look; asks for a newer one if it shows something else by now.
    pub fn frame(&mut self, workspace: &Workspace, frame: usize, look: Look) -> Option<TextureHandle> {
        let has_map = look.layer != Layer::Color;
        let number = if has_map { workspace.map_version(frame) } else { 0 };
        let palette = has_map.then(|| workspace.document.palette().version());
        self.get(Subject::Frame(frame), (look.layer, number, palette), || {
            (FrameSource::new(workspace, frame, look), Vec::new())
        })
    }

    /// The thumbnail of the surroundings of a pixel, the image alone.
    pub fn place(&mut self, workspace: &Workspace, frame: usize, pixel: Pixel) -> Option<TextureHandle> {
        self.get(Subject::Place(frame, pixel), (Layer::Color, 0, None), || {
            (FrameSource::new(workspace, frame, Look::PLAIN), Vec::new())
        })
    }

    /// The newest thumbnail of a suggested place: as much of its region as there is room for, and the layer in that region
    /// alone.
    pub fn suggestion(
        &mut self,
        workspace: &Workspace,
        place: &Suggestion,
        look: Look,
    ) -> Option<TextureHandle> {
        let palette = Some(workspace.document.palette().version());
        let shown = (look.layer, workspace.suggestions().version, palette);
        self.get(Subject::Place(place.frame, place.pixel), shown, || {
            (
                FrameSource::new(workspace, place.frame, look),
                place.outline.clone(),
            )
        })
    }

    fn get(
        &mut self,
        subject: Subject,
        shown: Shown,
        source: impl FnOnce() -> (FrameSource, Vec<[f32; 2]>),
    ) -> Option<TextureHandle> {
        let slot = self.slots.entry(subject).or_default();
        // What could not be read is tried again when it comes into view again.
        let again = slot.thumbnail.is_none() && slot.wanted + 1 < self.clock;
        slot.wanted = self.clock;
        let idle = slot.asked == slot.arrived;
        if idle && (again || slot.arrived != Some(shown)) {
            slot.asked = Some(shown);
            let (source, outline) = source();
            self.thread.ask(Request {
                subject,
                shown,
                source,
                outline,
            });
        }
        slot.thumbnail.clone()
    }
}

fn started(ctx: &egui::Context, size: [usize; 2]) -> Background<Request, Made> {
    Background::new(ctx.clone(), "thumbnails", move |desk: &Desk<Request, Made>| {
        let mut waiting = Vec::new();
        loop {
            // What was asked for last is most likely in view still.
            waiting.extend(desk.waiting());
            let request = waiting.pop().map_or_else(|| desk.next(), Ok)?;
            desk.tell((request.subject, request.shown, request.make(size)))?;
        }
    })
}

impl Request {
    fn make(&self, [width, height]: [usize; 2]) -> Option<egui::ColorImage> {
        let source = &self.source;
        let camera = &source.scene.frames.get(source.frame)?.camera;
        let full = [camera.width as usize, camera.height as usize];
        Some(match self.subject {
            Subject::Frame(_) => {
                let aspect = full[0] as f32 / full[1].max(1) as f32;
                let width = width.min((height as f32 * aspect).round() as usize).max(1);
                let height = height.min((width as f32 / aspect).round() as usize).max(1);
                let [picture] = pictures(source, [source.look], [width, height])?;
                picture
            }
            Subject::Place(_, pixel) => {
                let [shown, plain] = pictures(source, [source.look, Look::PLAIN], full)?;
                place_picture(&shown, &plain, (pixel, &self.outline), [width, height])
            }
        })
    }
}

/// The surroundings of a place, at most `largest` pixels: `shown` inside its region, `plain` around it.
fn place_picture(
    shown: &egui::ColorImage,
    plain: &egui::ColorImage,
    (pixel, outline): (Pixel, &[[f32; 2]]),
    largest: [usize; 2],
) -> egui::ColorImage {
    let full = plain.size;
    let size = glam::vec2(full[0] as f32, full[1] as f32);
    let part = rect_of(ImagePart::around(size, pixel, outline));
    let scale = (egui::vec2(largest[0] as f32, largest[1] as f32) / part.size())
        .min_elem()
        .min(1.0);
    let size = [part.width(), part.height()].map(|length| ((length * scale).round() as usize).max(1));
    let step = part.size() / egui::vec2(size[0] as f32, size[1] as f32);
    let mut pixels = Vec::with_capacity(size[0] * size[1]);
    for row in 0..size[1] {
        let y = part.top() + (row as f32 + 0.5) * step.y;
        let crossings = crossings(outline, y);
        for column in 0..size[0] {
            let x = part.left() + (column as f32 + 0.5) * step.x;
            let inside = crossings.iter().filter(|&&crossing| crossing < x).count() % 2 == 1;
            let at = |position: f32, length: usize| (position.max(0.0) as usize).min(length - 1);
            let index = at(y, full[1]) * full[0] + at(x, full[0]);
            pixels.push(if inside {
                shown.pixels[index]
            } else {
                plain.pixels[index]
            });
        }
    }
    egui::ColorImage::new(size, pixels)
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use inplace_model::palette::Palette;

    use super::*;
    use inplace_core::scene::ColorImage;

    #[test]
    fn what_could_not_be_read_is_tried_again_when_it_comes_into_view_again() {
        let get = |thumbnails: &mut Thumbnails, frame| {
            let source = || {
                let color = ColorImage::new(40, 60, vec![9; 3 * 40 * 60]).unwrap();
                let source = FrameSource {
                    scene: Arc::new(crate::tests::scene([color])),
                    frame,
                    map: None,
                    palette: Palette::new(&[]),
                    look: Look::PLAIN,
                };
                (source, Vec::new())
            };
            thumbnails.get(Subject::Frame(0), (Layer::Color, 0, None), source)
        };
        let start = std::time::Instant::now();
        let wait = || {
            assert!(start.elapsed().as_secs() < 20, "nothing was made");
            std::thread::sleep(std::time::Duration::from_millis(1));
        };
        let mut thumbnails = Thumbnails::new(egui::Context::default(), [48, 48]);
        thumbnails.collect();
        // The scene has one frame alone.
        assert!(get(&mut thumbnails, 1).is_none());
        while thumbnails.slots[&Subject::Frame(0)].arrived.is_none() {
            wait();
            thumbnails.collect();
        }
        thumbnails.collect();
        let size = loop {
            if let Some(thumbnail) = get(&mut thumbnails, 0) {
                break thumbnail.size();
            }
            wait();
            thumbnails.collect();
        };
        assert_eq!(size, [32, 48]);
    }

    #[test]
    fn a_place_shows_labels_inside_its_region_and_the_image_around_it() {
        let [shown, plain] =
            [egui::Color32::RED, egui::Color32::GRAY].map(|color| egui::ColorImage::filled([60, 40], color));
        let outline = [[26.0, 16.0], [26.0, 24.0], [34.0, 24.0], [34.0, 16.0]];
        let place = ([30, 20], &outline[..]);
        let picture = place_picture(&shown, &plain, place, [300, 300]);
        let part = rect_of(ImagePart::around(glam::vec2(60.0, 40.0), place.0, place.1));
        let size = [part.width(), part.height()].map(|side| side.round() as usize);
        assert_eq!(picture.size, size);
        let is_red = |pixel: &&egui::Color32| **pixel == egui::Color32::RED;
        let red = picture.pixels.iter().filter(is_red).count();
        assert!((56..=72).contains(&red), "{red} pixels of a region of 64");
        assert_eq!(picture.pixels[0], egui::Color32::GRAY);
        assert_eq!(place_picture(&shown, &plain, place, [10, 10]).size[0], 10);
    }
}
