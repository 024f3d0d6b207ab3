//! Work on the pixels of the frame in view, on a thread of its own: the newest request wins.

use std::sync::Arc;

use inplace_core::export::ClassMatching;
use inplace_core::labels::{ClassId, LabelSet, Pixel, VOID};
use inplace_core::scene::{Scene, SceneError};
use inplace_core::session::FrameMap;
use inplace_model::comparison::OtherLabels;
use inplace_model::overview::Contradicted;
use inplace_model::palette::Table;
use inplace_model::versioned::{Version, Versioned};

use super::content::Picture;
use super::plane::{DepthPlane, Over, disagreement};
use crate::background::{Desk, Gone};

/// Everything about a frame that is wanted and not there yet.
#[derive(Clone, Debug)]
pub struct Request {
    pub scene: Arc<Scene>,
    /// The frame in view.
    pub frame: usize,
    /// Frames whose images are wanted for the renderer, the first first.
    pub pictures: Vec<usize>,
    /// The newest map of the frame, to be looked up.
    pub map: Option<Versioned<Arc<FrameMap>>>,
    /// Whether the classes that the map shows are wanted.
    pub visible: bool,
    /// What was said, to be compared with the map.
    pub said: Option<Said>,
    /// Another project and which of its classes are the own ones, to be compared with the map.
    pub other: Option<(Arc<OtherLabels>, Versioned<Arc<ClassMatching>>)>,
    /// Whether the frame's measured depth is wanted.
    pub depth: bool,
}

/// What was said about the frames.
#[derive(Clone, Debug)]
pub struct Said {
    /// Strokes and imported images.
    pub labels: LabelSet,
    /// What the strokes say of each other.
    pub contradicted: Versioned<Arc<Contradicted>>,
}

/// Something that is ready now.
#[derive(Debug)]
pub enum Part {
    /// The image of a frame, or why its file cannot be read any more.
    Picture(usize, Result<Arc<Picture>, SceneError>),
    /// A map, looked up.
    Map(Versioned<Arc<FrameMap>>),
    /// The classes that the map with this version shows, with their pixels; void is not among them.
    Visible(Version, Vec<(ClassId, u32)>),
    /// How the labels agree with a map.
    Agreement(AgreementPlane),
    /// Where a map differs from another project's.
    Differences(DifferencePlane),
    /// The measured depth of a frame; `None` where it has none.
    Depth(usize, Option<Versioned<DepthPlane>>),
}

/// How the labels agree with a map, pixel for pixel.
#[derive(Clone, Debug)]
pub struct AgreementPlane {
    /// Numbers of [`Agreement`](inplace_model::palette::Agreement).
    pub over: Over,
    /// Version of the map.
    pub map: Version,
}

/// Where a map differs from another project's, pixel for pixel.
#[derive(Clone, Debug)]
pub struct DifferencePlane {
    /// Numbers of [`Difference`](inplace_core::export::Difference).
    pub over: Over,
    /// The other project's classes, row-major.
    pub other: Vec<ClassId>,
    /// Version of the map.
    pub map: Version,
}

impl DifferencePlane {
    /// The other project's class of a pixel; `None` outside.
    pub fn other_at(&self, [x, y]: Pixel) -> Option<ClassId> {
        let [width, height] = self.over.size;
        let index = y as usize * width as usize + x as usize;
        (x < width && y < height).then(|| self.other[index])
    }
}

/// Answers requests: what is asked takes the place of what was asked before.
pub fn answer(desk: &Desk<Request, Part>) -> Result<(), Gone> {
    let mut worker = Worker {
        desk,
        looked_up: None,
    };
    loop {
        worker.prepare(desk.newest()?)?;
    }
}

/// The thread's end.
struct Worker<'a> {
    desk: &'a Desk<Request, Part>,
    /// The map of the request, looked up.
    looked_up: Option<Versioned<Arc<FrameMap>>>,
}

impl Worker<'_> {
    /// Makes what is asked for, part by part, unless something newer is asked for meanwhile.
    fn prepare(&mut self, mut request: Request) -> Result<(), Gone> {
        let steps = [
            Self::picture,
            Self::look_up,
            Self::agreement,
            Self::differences,
            Self::depth,
            Self::visible,
        ];
        for step in steps {
            if self.desk.is_asked() {
                return Ok(());
            }
            step(self, &mut request)?;
        }
        while !request.pictures.is_empty() && !self.desk.is_asked() {
            self.picture(&mut request)?;
        }
        Ok(())
    }

    fn picture(&mut self, request: &mut Request) -> Result<(), Gone> {
        if request.pictures.is_empty() {
            return Ok(());
        }
        let index = request.pictures.remove(0);
        let Some(frame) = request.scene.frames.get(index) else {
            return Ok(());
        };
        let picture = frame.pixels().map(|pixels| Arc::new(Picture::new(pixels.color)));
        self.desk.tell(Part::Picture(index, picture))
    }

    fn look_up(&mut self, request: &mut Request) -> Result<(), Gone> {
        let Some(map) = &request.map else {
            self.looked_up = None;
            return Ok(());
        };
        if self
            .looked_up
            .as_ref()
            .is_some_and(|last| last.version() == map.version())
        {
            return Ok(());
        }
        let new = !map.is_looked_up();
        let map = if new {
            Versioned::with(Arc::new(map.looked_up().into_owned()), map.version())
        } else {
            map.clone()
        };
        self.looked_up = Some(map.clone());
        if new {
            self.desk.tell(Part::Map(map))?;
        }
        Ok(())
    }

    fn visible(&mut self, request: &mut Request) -> Result<(), Gone> {
        match &self.looked_up {
            Some(map) if request.visible => self.desk.tell(Part::Visible(map.version(), classes_of(map))),
            _ => Ok(()),
        }
    }

    fn agreement(&mut self, request: &mut Request) -> Result<(), Gone> {
        let (Some(said), Some(map)) = (&request.said, &self.looked_up) else {
            return Ok(());
        };
        let imported = said.labels.imported.as_deref();
        let image = imported.and_then(|images| images.of_frame(map.frame));
        let values = disagreement(map, image, &said.labels, &said.contradicted);
        self.desk.tell(Part::Agreement(AgreementPlane {
            over: Over::marks([map.width, map.height], values.into(), Table::Disagreement),
            map: map.version(),
        }))
    }

    fn differences(&mut self, request: &mut Request) -> Result<(), Gone> {
        let (Some((other, matching)), Some(map)) = (&request.other, &self.looked_up) else {
            return Ok(());
        };
        let Some(other) = other.of_frame(map.frame) else {
            return Ok(());
        };
        let own = map.labels();
        let difference = |(&own, &other): (&ClassId, &ClassId)| matching.difference([own, other]) as u16;
        let values: Arc<[u16]> = own.iter().zip(&other).map(difference).collect();
        self.desk.tell(Part::Differences(DifferencePlane {
            over: Over::marks([map.width, map.height], values, Table::Differences),
            other,
            map: map.version(),
        }))
    }

    fn depth(&mut self, request: &mut Request) -> Result<(), Gone> {
        if !request.depth {
            return Ok(());
        }
        let frame = request.scene.frames.get(request.frame);
        let plane = frame.and_then(DepthPlane::measured).map(Versioned::new);
        self.desk.tell(Part::Depth(request.frame, plane))
    }
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
}
