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
use crate::canvas::{fitted, pictures, rect_of, whole};

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
    pub fn new(ctx: egui::Context, size: [f32; 2]) -> Self {
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

fn started(ctx: &egui::Context, size: [f32; 2]) -> Background<Request, Made> {
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
    /// The picture, of at most so many pixels along each axis.
    fn make(&self, largest: [f32; 2]) -> Option<egui::ColorImage> {
        let source = &self.source;
        let camera = &source.scene.frames.get(source.frame)?.camera;
        let part = match self.subject {
            Subject::Frame(_) => whole([camera.width, camera.height]),
            Subject::Place(_, pixel) => {
                let size = glam::vec2(camera.width as f32, camera.height as f32);
                rect_of(ImagePart::around(size, pixel, &self.outline))
            }
        };
        let size = fitted(part, largest);
        if matches!(self.subject, Subject::Frame(_)) {
            let [picture] = pictures(source, [source.look], part, size)?;
            return Some(picture);
        }
        let [inside, outside] = pictures(source, [source.look, Look::PLAIN], part, size)?;
        Some(place_picture(&inside, outside, part, &self.outline))
    }
}

/// A part of an image, in its pixels: one picture inside the region of a place, the other one around it.
fn place_picture(
    inside: &egui::ColorImage,
    outside: egui::ColorImage,
    part: Rect,
    outline: &[[f32; 2]],
) -> egui::ColorImage {
    let mut picture = outside;
    let [width, height] = picture.size;
    let step = part.size() / egui::vec2(width as f32, height as f32);
    for row in 0..height {
        let crossings = crossings(outline, part.top() + (row as f32 + 0.5) * step.y);
        for column in 0..width {
            let x = part.left() + (column as f32 + 0.5) * step.x;
            if crossings.iter().filter(|&&crossing| crossing < x).count() % 2 == 1 {
                picture.pixels[row * width + column] = inside.pixels[row * width + column];
            }
        }
    }
    picture
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
        let mut thumbnails = Thumbnails::new(egui::Context::default(), [48.0, 48.0]);
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
        let outline = [[26.0, 16.0], [26.0, 24.0], [34.0, 24.0], [34.0, 16.0]];
        let part = Rect::from_min_max(egui::pos2(20.0, 10.0), egui::pos2(40.0, 30.0));
        for (scale, expected) in [(1, 64), (3, 576)] {
            let [labels, image] = [egui::Color32::RED, egui::Color32::GRAY]
                .map(|color| egui::ColorImage::filled([20 * scale; 2], color));
            let picture = place_picture(&labels, image, part, &outline);
            let is_red = |pixel: &&egui::Color32| **pixel == egui::Color32::RED;
            assert_eq!(picture.pixels.iter().filter(is_red).count(), expected);
            assert_eq!(picture.pixels[0], egui::Color32::GRAY);
        }
    }
}
