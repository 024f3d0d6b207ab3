//! Work on the pixels of the frame in view, on a thread of its own: the newest request wins.

use std::sync::Arc;

use inplace_core::labels::{ClassId, LabelSet, VOID};
use inplace_core::scene::{ColorImage, Scene};
use inplace_core::session::{FrameMap, RenderedFrame};

use super::content::Picture;
use super::plane::{DepthPlane, disagreement};
use crate::background::{Background, Desk, Gone};
use crate::overview::Contradicted;

/// Everything about a frame that is wanted and not there yet.
#[derive(Clone, Debug)]
pub struct Request {
    /// The scene.
    pub scene: Arc<Scene>,
    /// The frame in view.
    pub frame: usize,
    /// Frames whose images are wanted for the renderer, the first first.
    pub pictures: Vec<usize>,
    /// The newest map of the frame, with its number, to be looked up.
    pub map: Option<(Arc<FrameMap>, u64)>,
    /// Whether the classes that the map shows are wanted.
    pub visible: bool,
    /// What was said, to be compared with the map.
    pub said: Option<Said>,
    /// Whether the frame's measured depth is wanted.
    pub depth: bool,
    /// A view of the field, to be enlarged to the frame's size.
    pub view: Option<Arc<RenderedFrame>>,
}

/// What was said about the frames.
#[derive(Clone, Debug)]
pub struct Said {
    /// Strokes and imported images.
    pub labels: LabelSet,
    /// What the strokes say of each other.
    pub contradicted: Arc<Contradicted>,
    /// Generation of the labels, and a number that changes with the contradicted strokes.
    pub version: (u64, u64),
}

/// A view of the field at the size of its frame.
#[derive(Clone, Debug)]
pub struct FieldView {
    /// As it was rendered.
    pub rendered: Arc<RenderedFrame>,
    /// Its colours.
    pub color: Arc<ColorImage>,
    /// The same for the renderer.
    pub picture: Arc<Picture>,
    /// Its depths.
    pub depth: DepthPlane,
    /// Serial number of the depths.
    pub depth_serial: u64,
}

/// Something that is ready now.
#[derive(Debug)]
pub enum Part {
    /// The image of a frame, or a sentence that says why its file cannot be read any more.
    Picture(usize, Result<Arc<Picture>, String>),
    /// The map with this number, looked up.
    Map(Arc<FrameMap>, u64),
    /// The classes that the map with this number shows, with their pixels; void is not among them.
    Visible(u64, Vec<(ClassId, u32)>),
    /// The verdicts on the pixels, by the number of the map and the version of what was said.
    Verdicts(u64, (u64, u64), Made),
    /// The measured depth of a frame; `None` where it has none.
    Depth(usize, Option<DepthPlane>, u64),
    /// A view of the field.
    View(Box<FieldView>),
}

/// Values of a plane with their serial number.
#[derive(Clone, Debug)]
pub struct Made {
    /// Width and height.
    pub size: [u32; 2],
    /// Row-major.
    pub values: Arc<[u16]>,
    /// Never 0, and different for everything made by this thread.
    pub serial: u64,
}

/// The window's end of the thread: what is asked takes the place of what was asked before.
pub type Preparer = Background<Request, Part>;

/// Starts the thread. The serial numbers that it gives are `first` and every fourth after it.
pub fn preparer(ctx: egui::Context, first: u64) -> Preparer {
    Background::new(ctx, "canvas", move |desk| Worker::new(desk, first).run())
}

/// From one serial number to the next; those between are given by the window.
pub const STEP: u64 = 4;

/// The thread's end.
struct Worker<'a> {
    desk: &'a Desk<Request, Part>,
    serial: u64,
    /// The map that was looked up last.
    looked_up: Option<(Arc<FrameMap>, u64)>,
}

impl<'a> Worker<'a> {
    fn new(desk: &'a Desk<Request, Part>, first: u64) -> Self {
        Self {
            desk,
            serial: first,
            looked_up: None,
        }
    }

    fn run(mut self) -> Result<(), Gone> {
        let mut next = self.desk.newest()?;
        loop {
            next = match self.prepare(next)? {
                Some(newer) => newer,
                None => self.desk.newest()?,
            };
        }
    }

    /// Makes what is asked for, part by part, unless something newer is asked for meanwhile.
    fn prepare(&mut self, mut request: Request) -> Result<Option<Request>, Gone> {
        let steps = [
            Self::picture,
            Self::look_up,
            Self::verdicts,
            Self::depth,
            Self::view,
            Self::visible,
        ];
        for step in steps {
            if let Some(newer) = self.desk.newer()? {
                return Ok(Some(newer));
            }
            step(self, &mut request)?;
        }
        while !request.pictures.is_empty() {
            if let Some(newer) = self.desk.newer()? {
                return Ok(Some(newer));
            }
            self.picture(&mut request)?;
        }
        Ok(None)
    }

    fn next_serial(&mut self) -> u64 {
        let serial = self.serial;
        self.serial += STEP;
        serial
    }

    fn picture(&mut self, request: &mut Request) -> Result<(), Gone> {
        if request.pictures.is_empty() {
            return Ok(());
        }
        let index = request.pictures.remove(0);
        let Some(frame) = request.scene.frames.get(index) else {
            return Ok(());
        };
        let picture = match frame.pixels() {
            Ok(pixels) => Ok(Arc::new(Picture::new(&pixels.color, self.next_serial()))),
            Err(error) => Err(error.to_string()),
        };
        self.desk.tell(Part::Picture(index, picture))
    }

    fn look_up(&mut self, request: &mut Request) -> Result<(), Gone> {
        let Some((map, number)) = &request.map else {
            return Ok(());
        };
        if self.looked_up.as_ref().is_some_and(|(_, last)| last == number) {
            return Ok(());
        }
        let new = !map.is_looked_up();
        let map = if new {
            Arc::new(map.looked_up().into_owned())
        } else {
            Arc::clone(map)
        };
        self.looked_up = Some((Arc::clone(&map), *number));
        if new {
            self.desk.tell(Part::Map(map, *number))?;
        }
        Ok(())
    }

    fn visible(&mut self, request: &mut Request) -> Result<(), Gone> {
        match &self.looked_up {
            Some((map, number)) if request.visible && request.map.is_some() => {
                self.desk.tell(Part::Visible(*number, classes_of(map)))
            }
            _ => Ok(()),
        }
    }

    fn verdicts(&mut self, request: &mut Request) -> Result<(), Gone> {
        let serial = self.next_serial();
        let (Some(said), Some((map, number))) = (&request.said, &self.looked_up) else {
            return Ok(());
        };
        if request.map.is_none() {
            return Ok(());
        }
        let imported = said.labels.imported.as_deref();
        let image = imported.and_then(|images| images.of_frame(map.frame));
        let made = Made {
            size: [map.width, map.height],
            values: disagreement(map, image, &said.labels, &said.contradicted).into(),
            serial,
        };
        self.desk.tell(Part::Verdicts(*number, said.version, made))
    }

    fn depth(&mut self, request: &mut Request) -> Result<(), Gone> {
        if !request.depth {
            return Ok(());
        }
        let plane = request
            .scene
            .frames
            .get(request.frame)
            .and_then(DepthPlane::measured);
        let serial = self.next_serial();
        self.desk.tell(Part::Depth(request.frame, plane, serial))
    }

    fn view(&mut self, request: &mut Request) -> Result<(), Gone> {
        let (picture_serial, depth_serial) = (self.next_serial(), self.next_serial());
        let Some(rendered) = request.view.take() else {
            return Ok(());
        };
        let Some(frame) = request.scene.frames.get(rendered.frame) else {
            return Ok(());
        };
        let (width, height) = (frame.camera.width, frame.camera.height);
        let Some(color) = enlarged(&rendered, [width, height]) else {
            return Ok(());
        };
        let view = FieldView {
            picture: Arc::new(Picture::new(&color, picture_serial)),
            color: Arc::new(color),
            depth: DepthPlane::rendered(frame, &rendered),
            depth_serial,
            rendered,
        };
        self.desk.tell(Part::View(Box::new(view)))
    }
}

/// The colours of a view at the size of its frame, nearest-neighbour.
fn enlarged(view: &RenderedFrame, [width, height]: [u32; 2]) -> Option<ColorImage> {
    let mut rgb = Vec::with_capacity((width * height * 3) as usize);
    for y in 0..height {
        let row = (y / view.stride).min(view.color.height().saturating_sub(1)) * view.color.width();
        for x in 0..width {
            let column = (x / view.stride).min(view.color.width().saturating_sub(1));
            rgb.extend(view.color.pixel((row + column) as usize));
        }
    }
    ColorImage::new(width, height, rgb)
}

/// The classes that a map shows with their pixels, void left out, most pixels first.
fn classes_of(map: &FrameMap) -> Vec<(ClassId, u32)> {
    let labels = map.labels();
    let mut counts: Vec<(ClassId, u32)> = Vec::new();
    for run in labels.chunk_by(|a, b| a == b) {
        let (class, pixels) = (run[0], run.len() as u32);
        match counts.iter_mut().find(|(known, _)| *known == class) {
            Some((_, count)) => *count += pixels,
            None => counts.push((class, pixels)),
        }
    }
    counts.retain(|&(class, _)| class != VOID);
    counts.sort_by_key(|&(class, pixels)| (std::cmp::Reverse(pixels), class));
    counts
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn visible_classes_come_with_the_most_seen_first_and_without_void() {
        let labels = vec![0, 3, 3, 1, 0, 3, 1, 2];
        let map = FrameMap::new(0, 1, [4, 2], labels, vec![0; 8]).unwrap();
        assert_eq!(classes_of(&map), [(3, 3), (1, 2), (2, 1)]);
    }

    #[test]
    fn a_view_is_enlarged_to_its_frame_by_repeating_pixels() {
        let view = RenderedFrame {
            frame: 0,
            steps: 1,
            is_last: true,
            stride: 2,
            color: ColorImage::new(2, 1, vec![1, 1, 1, 9, 9, 9]).unwrap(),
            depth: vec![1.0, 2.0],
        };
        let color = enlarged(&view, [3, 2]).unwrap();
        let row = [1, 1, 1, 1, 1, 1, 9, 9, 9];
        assert_eq!(color.bytes(), [row, row].concat());
    }
}
