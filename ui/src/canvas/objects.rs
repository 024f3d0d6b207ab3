//! The objects of the scene and of the frame in view, found on a thread of its own: it may take longer than a map may wait.

use std::collections::BTreeMap;
use std::sync::Arc;

use egui::{Align2, Color32, FontId, Painter, vec2};
use inplace_core::labels::{ClassId, FoundObject, LabelSet, Object, ObjectId, Pixel, VOID, default_color};
use inplace_core::semantics::{KnownPart, Posterior, Surface, SurfaceObjects, innermost};
use inplace_core::session::FrameMap;
use inplace_model::palette::Palette;
use inplace_model::versioned::{Version, Versioned};

use super::view::Placement;
use crate::background::{Desk, Gone};

/// Colours that few classes have begin behind those of so many.
const FEW_CLASSES: u16 = 12;
/// How much of the colour of stuff is grey, so that objects stand out.
const PALE: f32 = 0.65;
/// That grey.
const GREY: f32 = 150.0;
/// Size of names on the image, in points, and how far around them their ground reaches.
const NAME: f32 = 12.0;
const AROUND: egui::Vec2 = vec2(5.0, 2.0);
/// Room that a click's mark takes on each side, in points.
const MARK: f32 = 8.0;
/// A name may be so much wider than the square inside its object.
const WIDER: f32 = 1.5;

/// A map whose objects are asked for, with the labels.
#[derive(Clone, Debug)]
pub struct Question {
    pub map: Versioned<Arc<FrameMap>>,
    pub labels: LabelSet,
    /// The objects that no stroke names, as they were known when the project was opened.
    pub parts: Arc<[KnownPart]>,
}

/// The objects of a scene.
#[derive(Debug)]
pub struct SceneObjects {
    /// The surface that they are on.
    pub surface: Arc<Surface>,
    /// What was known of its nodes when they were found.
    pub posterior: Arc<Posterior>,
    /// What is listed, by its place.
    pub entries: Entries,
    /// Where each is.
    pub found: Arc<[FoundObject]>,
    /// Those that no stroke names, to find them again.
    pub parts: Arc<[KnownPart]>,
    labels: LabelSet,
    objects: SurfaceObjects,
}

/// What the pixels of the layer of objects can show: the classes, for what belongs to no object, and then the objects.
#[derive(Clone, Debug)]
pub struct Entries {
    /// No other entries have it.
    pub version: Version,
    listed: Vec<Entry>,
    of_class: BTreeMap<ClassId, u16>,
    of_object: BTreeMap<u16, u16>,
}

/// An object, or what of a class belongs to none.
#[derive(Clone, Debug, PartialEq)]
pub struct Entry {
    pub class: ClassId,
    pub object: Option<Object>,
    /// Whether it is the first of its class.
    is_first: bool,
}

/// The objects that a map shows, pixel for pixel.
#[derive(Clone, Debug)]
pub struct ObjectPlane {
    /// Width and height.
    pub size: [u32; 2],
    /// 0 = void; others are one more than a place in the entries. Row-major.
    pub values: Versioned<Arc<[u16]>>,
    /// What they stand for.
    pub entries: Entries,
    /// Version of the map.
    pub map: Version,
    /// All objects of the scene, also of other frames; `None` where the map follows from no surface.
    pub scene: Option<Arc<SceneObjects>>,
    /// By value, the number of its pixels, and the pixel that is farthest inside with its distance from the border.
    seen: BTreeMap<u16, (u32, Pixel, u32)>,
}

/// Answers the newest question.
pub fn find(desk: &Desk<Question, ObjectPlane>) -> Result<(), Gone> {
    let mut known: Option<Arc<SceneObjects>> = None;
    loop {
        let question = desk.newest()?;
        let found = question.map.surface().map(|surface| match known.take() {
            Some(known) if known.answers(surface, &question.labels) => known,
            before => Arc::new(SceneObjects::new(surface, &question, before.as_deref())),
        });
        desk.tell(ObjectPlane::new(&question, found.clone()))?;
        known = found.or(known);
    }
}

impl SceneObjects {
    /// The objects on a surface, with the numbers and names that they had before.
    fn new(
        (surface, posterior): (&Arc<Surface>, &Arc<Posterior>),
        Question { labels, parts, .. }: &Question,
        before: Option<&Self>,
    ) -> Self {
        let moved = match before {
            Some(before) if Arc::ptr_eq(&before.surface, surface) => None,
            Some(before) => Some(before.objects.on(&before.surface, (surface, posterior))),
            None => (!parts.is_empty()).then(|| SurfaceObjects::recalled(surface, parts)),
        };
        let before = moved.as_ref().or(before.map(|before| &before.objects));
        let listed = (labels.classes.as_slice(), labels.objects.as_slice());
        let objects = SurfaceObjects::new(surface, posterior, listed, before);
        Self {
            entries: Entries::new(labels, objects.objects.iter()),
            found: objects.found(surface, labels).into(),
            parts: objects.parts(surface).into(),
            objects,
            surface: Arc::clone(surface),
            posterior: Arc::clone(posterior),
            labels: labels.clone(),
        }
    }

    /// Whether these are the objects of a question, as where only the frame is another.
    fn answers<'a>(
        &'a self,
        (surface, posterior): (&Arc<Surface>, &Arc<Posterior>),
        labels: &'a LabelSet,
    ) -> bool {
        let said = |labels: &'a LabelSet| (&labels.classes, &labels.objects, &labels.strokes);
        Arc::ptr_eq(&self.surface, surface)
            && Arc::ptr_eq(&self.posterior, posterior)
            && said(&self.labels) == said(labels)
    }

    /// What a node shows, as a value of an `ObjectPlane`.
    pub fn value(&self, node: u32) -> u16 {
        let class = self.posterior.labels.get(node as usize).copied().unwrap_or(0);
        let number = self.objects.of_node(node).map_or(0, ObjectId::number);
        self.entries.value(class, number)
    }
}

impl Entries {
    fn new<'a>(labels: &LabelSet, objects: impl Iterator<Item = &'a Object>) -> Self {
        let objects: Vec<&Object> = objects.collect();
        let mut first: BTreeMap<ClassId, ObjectId> = BTreeMap::new();
        for object in &objects {
            let first = first.entry(object.class).or_insert(object.id);
            *first = object.id.min(*first);
        }
        let classes = labels.classes.iter().map(|class| (class.id, None));
        let objects = objects.into_iter().map(|object| (object.class, Some(object)));
        let listed = classes.chain(objects).map(|(class, object)| Entry {
            class,
            object: object.cloned(),
            is_first: object.is_some_and(|object| first[&class] == object.id),
        });
        let listed: Vec<Entry> = listed.take(usize::from(u16::MAX)).collect();
        let (mut of_class, mut of_object) = (BTreeMap::new(), BTreeMap::new());
        for (entry, value) in listed.iter().zip(1..) {
            match &entry.object {
                Some(object) => of_object.insert(object.id.number(), value),
                None => of_class.insert(entry.class, value),
            };
        }
        Self {
            version: Version::new(),
            listed,
            of_class,
            of_object,
        }
    }

    /// The value of an object by its number, or of a class for 0.
    fn value(&self, class: ClassId, number: u16) -> u16 {
        let of_class = || self.of_class.get(&class);
        self.of_object
            .get(&number)
            .or_else(of_class)
            .copied()
            .unwrap_or(0)
    }

    /// What a value stands for; `None` for void.
    pub fn of(&self, value: u16) -> Option<&Entry> {
        self.listed.get(usize::from(value.checked_sub(1)?))
    }

    /// The colours of the values: objects have their own, other pixels a pale one of their class; what is hidden has none.
    pub fn palette(&self, classes: &Palette) -> Arc<Palette> {
        Palette::listing(self.listed.iter().map(|entry| entry.color(classes)))
    }
}

/// The colours of entries, which are made anew when these or the classes' colours change.
#[derive(Debug, Default)]
pub struct EntryColors(Option<([Version; 2], Versioned<Arc<Palette>>)>);

impl EntryColors {
    /// The colours of these entries, where these are those of the classes.
    pub fn follow(
        &mut self,
        entries: &Entries,
        classes: &Versioned<Arc<Palette>>,
    ) -> &Versioned<Arc<Palette>> {
        let made_of = [entries.version, classes.version()];
        let kept = self.0.take().filter(|(of, _)| *of == made_of);
        &self
            .0
            .insert(kept.unwrap_or_else(|| (made_of, Versioned::new(entries.palette(classes)))))
            .1
    }

    /// The newest colours.
    pub fn newest(&self) -> Option<&Versioned<Arc<Palette>>> {
        self.0.as_ref().map(|(_, colors)| colors)
    }
}

impl ObjectPlane {
    /// Of a map with the objects on its surface, if it has one.
    fn new(Question { map, labels, .. }: &Question, scene: Option<Arc<SceneObjects>>) -> Self {
        let with_objects = map.looked_up_with(scene.as_ref().map(|scene| &scene.objects));
        let classes = with_objects.labels();
        let entries = match &scene {
            Some(scene) => scene.entries.clone(),
            None => Entries::new(labels, std::iter::empty()),
        };
        let numbers = with_objects.objects();
        // Most pixels show the same as the one before.
        let mut last = ((VOID, 0), 0);
        let value = |(pixel, &class): (usize, &ClassId)| {
            let shown = (class, numbers.map_or(0, |numbers| numbers[pixel]));
            if last.0 != shown {
                last = (shown, entries.value(shown.0, shown.1));
            }
            last.1
        };
        let values: Vec<u16> = classes.iter().enumerate().map(value).collect();
        let mut counts: BTreeMap<u16, u32> = BTreeMap::new();
        for run in values.chunk_by(|a, b| a == b) {
            *counts.entry(run[0]).or_default() += run.len() as u32;
        }
        let spots = innermost(&values, map.width as usize)
            .into_iter()
            .filter(|(value, _)| *value != 0);
        let seen = spots.map(|(value, (pixel, depth))| {
            let pixel = pixel as u32;
            let place = [pixel % map.width, pixel / map.width];
            (value, (counts[&value], place, depth))
        });
        Self {
            size: [map.width, map.height],
            seen: seen.collect(),
            values: Versioned::new(values.into()),
            entries,
            map: map.version(),
            scene,
        }
    }

    /// What a pixel shows; `None` for void and outside.
    pub fn at(&self, [x, y]: Pixel) -> Option<&Entry> {
        let index = (x < self.size[0]).then_some(y as usize * self.size[0] as usize + x as usize)?;
        self.entries.of(*self.values.get(index)?)
    }

    /// What the frame shows, with the number of its pixels.
    pub fn seen(&self) -> impl Iterator<Item = (&Entry, u32)> {
        let seen = self.seen.iter();
        seen.filter_map(|(&value, &(pixels, ..))| Some((self.entries.of(value)?, pixels)))
    }

    /// Writes the name of each object well inside of it, below any of these pixels; the number where there is no room for
    /// that, and nothing where there is none for a number.
    pub fn paint_names(&self, painter: &Painter, placement: Placement, classes: &Palette, marks: &[Pixel]) {
        for (&value, &(_, pixel, depth)) in &self.seen {
            let entry = self.entries.of(value).filter(|entry| entry.color(classes)[3] > 0);
            let Some(object) = entry.and_then(|entry| entry.object.as_ref()) else {
                continue;
            };
            // A square of pixels that are all its own.
            let room = (2 * depth - 1) as f32 * placement.zoom;
            let words = [object.name.clone(), object.id.number().to_string()];
            let written = words.into_iter().find_map(|words| {
                let galley = painter.layout_no_wrap(words, FontId::proportional(NAME), Color32::WHITE);
                let fits = galley.size().y <= room && galley.size().x <= WIDER * room;
                fits.then_some(galley)
            });
            if let Some(galley) = written {
                let center = placement.pixel_center(pixel);
                let mut rect = Align2::CENTER_CENTER.anchor_size(center, galley.size());
                let marks = marks.iter().map(|&mark| placement.pixel_center(mark));
                let mut hidden = marks.filter(|mark| rect.expand(MARK).contains(*mark));
                if let Some(mark) = hidden.next() {
                    rect = rect.translate(vec2(0.0, mark.y + MARK + AROUND.y - rect.top()));
                }
                painter.rect_filled(rect.expand2(AROUND), 4, Color32::from_black_alpha(190));
                painter.galley(rect.min, galley, Color32::WHITE);
            }
        }
    }
}

impl Entry {
    /// RGBA, where these are the colours of the classes.
    pub fn color(&self, classes: &Palette) -> [u8; 4] {
        let [r, g, b, opacity] = classes.class(self.class);
        let hidden = &classes.hidden;
        let ([r, g, b], is_hidden) = match &self.object {
            Some(object) => (
                object_color([r, g, b], object.id, self.is_first),
                hidden.has(object.id),
            ),
            None => (
                [r, g, b].map(|channel| (f32::from(channel) + PALE * (GREY - f32::from(channel))) as u8),
                hidden.all_but.is_some(),
            ),
        };
        [r, g, b, if is_hidden { 0 } else { opacity }]
    }
}

/// The colour of an object: the first of a class, by the numbers, has that of the class.
pub fn object_color(class: [u8; 3], object: ObjectId, is_first: bool) -> [u8; 3] {
    match is_first {
        true => class,
        false => default_color(object.number().saturating_add(FEW_CLASSES)),
    }
}

/// An object for people: its name, and its class where the name does not tell it.
pub fn object_words(class: &str, object: &Object) -> String {
    if object.name.contains(class) {
        return object.name.clone();
    }
    format!("{} ({class})", object.name)
}

#[cfg(test)]
mod tests {
    use super::*;
    use inplace_core::labels::Class;
    use inplace_model::class_view::Hidden;

    fn hiding(classes: &[ClassId], objects: &[u16], all_but: Option<u16>) -> Hidden {
        Hidden {
            classes: classes.iter().copied().collect(),
            objects: objects.iter().copied().filter_map(ObjectId::new).collect(),
            all_but: all_but.and_then(ObjectId::new),
        }
    }

    #[test]
    fn what_belongs_to_no_object_is_pale_and_hidden_classes_are_not_shown() {
        let map = FrameMap::new(0, 1, [2, 2], vec![0, 2, 2, 1], vec![0; 4]).unwrap();
        let classes = vec![Class::new(1, "floor"), Class::new(2, "chair")];
        let labels = LabelSet::of_classes(classes.clone());
        let question = Question {
            map: Versioned::new(Arc::new(map)),
            labels: labels.clone(),
            parts: Arc::default(),
        };
        let plane = ObjectPlane::new(&question, None);
        assert_eq!(&plane.values[..], [0, 2, 2, 1]);
        let class = |pixel| plane.at(pixel).map(|entry| entry.class);
        assert_eq!(
            [class([0, 0]), class([1, 0]), class([1, 1]), class([2, 0])],
            [None, Some(2), Some(1), None]
        );
        let seen: Vec<_> = plane
            .seen()
            .map(|(entry, pixels)| (entry.class, pixels))
            .collect();
        assert_eq!(seen, [(1, 1), (2, 2)]);
        let colors = plane
            .entries
            .palette(&Palette::hiding(&classes, &hiding(&[2], &[], None)));
        let spread = |[r, g, b, _]: [u8; 4]| r.max(g).max(b) - r.min(g).min(b);
        assert!(spread(colors.class(1)) < spread(Palette::new(&classes).class(1)));
        assert_eq!(
            (colors.class(1)[3], colors.class(2)[3], colors.class(0)),
            (255, 0, [0; 4])
        );
        let [armchair, stool] = [(2, "armchair"), (1, "stool")].map(|(number, name)| Object {
            id: ObjectId::new(number).unwrap(),
            class: 2,
            name: name.to_owned(),
        });
        let entries = Entries::new(&labels, [&armchair, &stool].into_iter());
        let values = [(2, 2), (2, 1), (2, 0), (1, 8), (0, 0)];
        let values = values.map(|(class, number)| entries.value(class, number));
        assert_eq!(values, [3, 4, 2, 1, 0]);
        let colors = entries.palette(&Palette::new(&classes));
        assert_eq!(
            colors.class(4)[..3],
            classes[1].color,
            "the first has that of its class"
        );
        let others = [classes[0].color, classes[1].color];
        assert!(others.iter().all(|other| colors.class(3)[..3] != *other));
        let shown = |hidden: Hidden| {
            let colors = entries.palette(&Palette::hiding(&classes, &hidden));
            [1, 2, 4].map(|value| colors.class(value)[3] > 0)
        };
        assert_eq!(shown(hiding(&[], &[1], None)), [true, true, false]);
        assert_eq!(shown(hiding(&[], &[], Some(1))), [false, false, true]);
        assert_eq!(shown(hiding(&[2], &[], Some(1))), [false; 3]);
    }
}
