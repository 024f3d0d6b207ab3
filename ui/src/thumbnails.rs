//! Small pictures of frames, made off the UI thread and kept as textures.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Arc;

use crossbeam_channel::{Receiver, Sender, unbounded};
use inplace_core::labels::Pixel;
use inplace_core::scene::Scene;
use inplace_core::session::FrameMap;

use crate::canvas::{Look, Palette, composite};

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

/// What a thumbnail is made from.
#[derive(Clone, Debug)]
pub struct Source {
    /// The scene.
    pub scene: Arc<Scene>,
    /// The frame's newest map.
    pub map: Option<Arc<FrameMap>>,
    /// The classes' colours.
    pub palette: Arc<Palette>,
    /// How it is composed.
    pub look: Look,
}

/// A finished thumbnail.
#[derive(Clone)]
pub struct Thumbnail {
    /// The picture.
    pub texture: egui::TextureHandle,
}

struct Request {
    subject: Subject,
    version: u64,
    source: Source,
}

struct Made {
    subject: Subject,
    version: u64,
    image: egui::ColorImage,
}

#[derive(Default)]
struct Slot {
    /// Version asked for last.
    asked: Option<u64>,
    /// Version that arrived last.
    arrived: Option<u64>,
    thumbnail: Option<Thumbnail>,
    /// When it was last wanted.
    wanted: u64,
}

/// Thumbnails by subject. One request per subject is under way at a time; the newest version wins.
pub struct Thumbnails {
    requests: Sender<Request>,
    made: Receiver<Made>,
    slots: HashMap<Subject, Slot>,
    clock: u64,
}

impl Thumbnails {
    /// Starts the thread that makes thumbnails of at most `size` pixels.
    pub fn new(ctx: egui::Context, size: [usize; 2]) -> Self {
        let (requests, receiver) = unbounded::<Request>();
        let (sender, made) = unbounded();
        // Without the thread there are no pictures, and nothing else is lost.
        let _ = std::thread::Builder::new()
            .name("inplace-thumbnails".to_owned())
            .spawn(move || {
                for request in receiver {
                    if let Some(made) = request.make(size)
                        && sender.send(made).is_err()
                    {
                        return;
                    }
                    ctx.request_repaint();
                }
            });
        Self {
            requests,
            made,
            slots: HashMap::new(),
            clock: 0,
        }
    }

    /// Takes finished thumbnails over; call once per frame.
    pub fn collect(&mut self, ctx: &egui::Context) {
        self.clock += 1;
        for made in self.made.try_iter() {
            let slot = self.slots.entry(made.subject).or_default();
            slot.arrived = Some(made.version);
            let options = egui::TextureOptions::LINEAR;
            match &mut slot.thumbnail {
                Some(thumbnail) => thumbnail.texture.set(made.image, options),
                None => {
                    slot.thumbnail = Some(Thumbnail {
                        texture: ctx.load_texture("thumbnail", made.image, options),
                    });
                }
            }
        }
        if self.slots.len() > MOST {
            let oldest = self.clock.saturating_sub(2);
            self.slots.retain(|_, slot| slot.wanted >= oldest);
        }
    }

    /// The newest thumbnail of a subject; asks for `version` of it if that is not there yet.
    pub fn get(
        &mut self,
        subject: Subject,
        version: u64,
        source: impl FnOnce() -> Source,
    ) -> Option<Thumbnail> {
        let slot = self.slots.entry(subject).or_default();
        slot.wanted = self.clock;
        let idle = slot.asked == slot.arrived;
        if idle && slot.arrived != Some(version) {
            slot.asked = Some(version);
            // Without the thread there are no pictures.
            let _ = self.requests.send(Request {
                subject,
                version,
                source: source(),
            });
        }
        slot.thumbnail.clone()
    }

    /// Forgets everything: another scene was opened.
    pub fn clear(&mut self) {
        self.slots.clear();
    }
}

impl Request {
    fn make(self, [width, height]: [usize; 2]) -> Option<Made> {
        let Source {
            scene,
            map,
            palette,
            look,
        } = self.source;
        let map = map.as_deref().map(FrameMap::looked_up);
        let map = map.as_deref();
        let (Subject::Frame(frame) | Subject::Place(frame, _)) = self.subject;
        let color = &scene.frames.get(frame)?.color;
        let image = match self.subject {
            Subject::Frame(_) => {
                let aspect = color.width() as f32 / color.height().max(1) as f32;
                let width = width.min((height as f32 * aspect).round() as usize).max(1);
                let height = height.min((width as f32 / aspect).round() as usize).max(1);
                composite(color, map, &palette, look, [width, height])
            }
            Subject::Place(_, pixel) => {
                let full = [color.width() as usize, color.height() as usize];
                let whole = composite(color, map, &palette, look, full);
                whole.region_by_pixels(crop(full, pixel), crop_size(full))
            }
        };
        Some(Made {
            subject: self.subject,
            version: self.version,
            image,
        })
    }
}

/// Size of the surroundings that a place's thumbnail shows: a third of the image, with its aspect.
fn crop_size([width, height]: [usize; 2]) -> [usize; 2] {
    [(width / 3).max(1), (height / 3).max(1)]
}

/// Top left corner of the surroundings of a pixel, inside the image.
fn crop(full: [usize; 2], pixel: Pixel) -> [usize; 2] {
    let size = crop_size(full);
    std::array::from_fn(|axis| {
        let start = (pixel[axis] as usize).saturating_sub(size[axis] / 2);
        start.min(full[axis] - size[axis])
    })
}

/// Where in a place's thumbnail its pixel lies, 0..=1 along each axis.
pub fn place_in_crop(full: [usize; 2], pixel: Pixel) -> egui::Vec2 {
    let (size, start) = (crop_size(full), crop(full, pixel));
    let share = |axis: usize| (pixel[axis] as f32 + 0.5 - start[axis] as f32) / size[axis] as f32;
    egui::vec2(share(0), share(1))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_crop_stays_inside_the_image_and_shows_its_pixel() {
        for pixel in [[0, 0], [319, 239], [160, 10]] {
            let start = crop([320, 240], pixel);
            assert!(start[0] + 106 <= 320 && start[1] + 80 <= 240);
            let place = place_in_crop([320, 240], pixel);
            assert!((0.0..=1.0).contains(&place.x) && (0.0..=1.0).contains(&place.y));
        }
    }
}
