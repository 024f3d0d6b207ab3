//! The objects of the frame in view, found on a thread of its own: it may take longer than a map may wait.

use std::collections::BTreeMap;
use std::sync::Arc;

use inplace_core::labels::{Class, ClassId, Object, ObjectId, VOID, default_color};
use inplace_core::semantics::{Posterior, Surface, SurfaceObjects};
use inplace_core::session::FrameMap;
use inplace_model::palette::Palette;
use inplace_model::versioned::{Version, Versioned};

use crate::background::{Background, Desk, Gone};

/// How much of the colour of stuff is grey, so that objects stand out.
const PALE: f32 = 0.65;
/// That grey.
const GREY: f32 = 150.0;

/// A map whose objects are asked for, with the labels' classes and objects.
#[derive(Clone, Debug)]
pub struct Question {
    /// The map.
    pub map: Versioned<Arc<FrameMap>>,
    /// All classes.
    pub classes: Vec<Class>,
    /// The objects that strokes name.
    pub told: Vec<Object>,
}

/// The objects that a map shows, pixel for pixel.
#[derive(Clone, Debug)]
pub struct ObjectPlane {
    /// Width and height.
    pub size: [u32; 2],
    /// 0 = void; others are one more than a place in `seen`. Row-major.
    pub values: Versioned<Arc<[u16]>>,
    /// What is seen, by class and number.
    pub seen: Vec<Seen>,
    /// Version of the map.
    pub map: Version,
    /// All objects of the scene, also of other frames.
    pub all: Arc<[Object]>,
}

/// An object that a map shows, or the pixels of a class that belong to none.
#[derive(Clone, Debug, PartialEq)]
pub struct Seen {
    /// The class.
    pub class: ClassId,
    /// The object.
    pub object: Option<Object>,
    /// Number of its pixels.
    pub pixels: u32,
}

/// The window's end of the thread.
pub type ObjectFinder = Background<Question, ObjectPlane>;

/// Starts the thread.
pub fn object_finder(ctx: egui::Context) -> ObjectFinder {
    Background::new(ctx, "objects", find)
}

/// Answers the newest question.
fn find(desk: &Desk<Question, ObjectPlane>) -> Result<(), Gone> {
    let mut known: Option<Known> = None;
    loop {
        let question = desk.newest()?;
        let found = question.map.surface().map(|surface| match known.take() {
            Some(known) if known.answers(surface, &question) => known,
            before => Known::new(surface, &question, before.as_ref()),
        });
        let objects = found.as_ref().map(|found| &found.objects);
        desk.tell(ObjectPlane::new(&question.map, objects))?;
        known = found.or(known);
    }
}

/// The objects that were found last, with what they were found from.
struct Known {
    surface: Arc<Surface>,
    posterior: Arc<Posterior>,
    classes: Vec<Class>,
    told: Vec<Object>,
    objects: SurfaceObjects,
}

impl Known {
    /// The objects on a surface, with the numbers and names that they had before.
    fn new(
        (surface, posterior): (&Arc<Surface>, &Arc<Posterior>),
        Question { classes, told, .. }: &Question,
        before: Option<&Self>,
    ) -> Self {
        let moved = before
            .filter(|before| !Arc::ptr_eq(&before.surface, surface))
            .map(|before| before.objects.on(&before.surface, (surface, posterior)));
        let before = moved.as_ref().or(before.map(|before| &before.objects));
        Self {
            objects: SurfaceObjects::new(surface, posterior, (classes, told), before),
            surface: Arc::clone(surface),
            posterior: Arc::clone(posterior),
            classes: classes.clone(),
            told: told.clone(),
        }
    }

    /// Whether these are the objects of a question, as where only the frame is another.
    fn answers(&self, (surface, posterior): (&Arc<Surface>, &Arc<Posterior>), question: &Question) -> bool {
        Arc::ptr_eq(&self.surface, surface)
            && Arc::ptr_eq(&self.posterior, posterior)
            && (&self.classes, &self.told) == (&question.classes, &question.told)
    }
}

impl ObjectPlane {
    /// Of a map with the objects on its surface, if it has one.
    fn new(map: &Versioned<Arc<FrameMap>>, objects: Option<&SurfaceObjects>) -> Self {
        let labels = map.labels();
        let with_objects = map.looked_up_with(objects);
        let numbers = with_objects.objects().map(<[u16]>::to_vec);
        let number = |pixel: usize| numbers.as_ref().map_or(0, |numbers| numbers[pixel]);
        let pixels = labels.iter().enumerate();
        let shown: Vec<(ClassId, u16)> = pixels.map(|(pixel, &class)| (class, number(pixel))).collect();
        let mut counts: BTreeMap<(ClassId, u16), u32> = BTreeMap::new();
        for run in shown.chunk_by(|a, b| a == b) {
            *counts.entry(run[0]).or_default() += run.len() as u32;
        }
        counts.retain(|(class, _), _| *class != VOID);
        let known = objects.map_or(&[][..], |objects| &objects.objects);
        let seen = counts.iter().map(|(&(class, number), &pixels)| {
            let id = ObjectId::new(number);
            let object = known.iter().map(|known| &known.object);
            Seen {
                class,
                object: object.clone().find(|object| Some(object.id) == id).cloned(),
                pixels,
            }
        });
        // No frame shows as many objects as there are numbers.
        let places: BTreeMap<(ClassId, u16), u16> = counts.keys().copied().zip(1..).collect();
        let values = shown.iter().map(|label| places.get(label).copied().unwrap_or(0));
        Self {
            size: [map.width, map.height],
            values: Versioned::new(values.collect()),
            seen: seen.collect(),
            map: map.version(),
            all: known.iter().map(|known| known.object.clone()).collect(),
        }
    }

    /// What a pixel shows; `None` for void and outside.
    pub fn at(&self, [x, y]: [u32; 2]) -> Option<&Seen> {
        let index = (x < self.size[0]).then_some(y as usize * self.size[0] as usize + x as usize)?;
        let place = self.values.get(index)?.checked_sub(1)?;
        self.seen.get(usize::from(place))
    }

    /// The colours of its values: objects have one of their own, other pixels a pale one of their class; hidden classes
    /// have none.
    pub fn palette(&self, classes: &Palette) -> Arc<Palette> {
        Palette::listing(self.seen.iter().map(|seen| seen.color(classes)))
    }
}

impl Seen {
    /// RGBA, where these are the colours of the classes.
    pub fn color(&self, classes: &Palette) -> [u8; 4] {
        let [r, g, b, opacity] = classes.class(self.class);
        let [r, g, b] = match &self.object {
            Some(object) => default_color(object.id.number()),
            None => [r, g, b].map(|channel| (f32::from(channel) + PALE * (GREY - f32::from(channel))) as u8),
        };
        [r, g, b, opacity]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_belongs_to_no_object_is_pale_and_hidden_classes_are_not_shown() {
        let labels = vec![0, 2, 2, 1];
        let map = FrameMap::new(0, 1, [2, 2], labels, vec![0; 4]).unwrap();
        let plane = ObjectPlane::new(&Versioned::new(Arc::new(map)), None);
        assert_eq!(&plane.values[..], [0, 2, 2, 1]);
        let seen = |pixel| plane.at(pixel).map(|seen| (seen.class, seen.pixels));
        assert_eq!(
            [seen([0, 0]), seen([1, 0]), seen([1, 1]), seen([2, 0])],
            [None, Some((2, 2)), Some((1, 1)), None]
        );
        let classes = [Class::new(1, "floor"), Class::new(2, "chair")];
        let colors = plane.palette(&Palette::hiding(&classes, &[2].into()));
        let spread = |[r, g, b, _]: [u8; 4]| r.max(g).max(b) - r.min(g).min(b);
        assert!(spread(colors.class(1)) < spread(Palette::new(&classes).class(1)));
        assert_eq!(
            (colors.class(1)[3], colors.class(2)[3], colors.class(0)),
            (255, 0, [0; 4])
        );
        let chair = Seen {
            object: ObjectId::new(7).map(|id| Object {
                id,
                class: 1,
                name: String::new(),
            }),
            ..plane.seen[0].clone()
        };
        assert_eq!(chair.color(&Palette::new(&classes))[..3], default_color(7));
    }
}
