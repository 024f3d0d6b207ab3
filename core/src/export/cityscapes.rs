//! Images as in the ground truth of Cityscapes.

use std::collections::BTreeMap;

use rustc_hash::FxHashMap;

use super::Refusal;
use super::components::{Neighbours, components};
use super::layout::{About, Labelled, Layout, OutputFile, json_file};
use super::pngs::{CLASSES, class_colors};
use crate::labels::{Class, ClassId, VOID, png};

/// Class numbers in `_labelIds.png` are 8 bit.
const LARGEST_ID: ClassId = 255;
/// What the class is multiplied with in `_instanceIds.png`.
const INSTANCES: u16 = 1000;

/// `gtFine/<stem>_gtFine_labelIds.png`, `_instanceIds.png` and `_color.png`, and `classes.json`.
///
/// - labelIds: class ids, 8 bit
/// - instanceIds: class * 1000 + instance, 16 bit, an instance being an object, counted from 0 for each class and the same in
///   all frames; stuff is the class id alone, and so is a thing that this has no room for, or of which it is not known which
///   it is, as Cityscapes has it for groups. Where nothing is known of objects an instance is a connected region, by sides
///   and corners, of any class in one frame. Void is 0.
/// - color: the classes' colours; void is black
pub(super) struct Cityscapes;

impl Layout for Cityscapes {
    type Entry = ();
    const FOLDERS: &'static [&'static str] = &["gtFine"];

    fn check(&self, classes: &[Class]) -> Result<(), Refusal> {
        let Some(class) = classes.iter().find(|class| class.id > LARGEST_ID) else {
            return Ok(());
        };
        Err(format!(
            "class \"{}\" has the number {}, and its images hold numbers up to {LARGEST_ID}; export with other ids",
            class.name, class.id
        )
        .into())
    }

    fn frame(&self, frame: &Labelled<'_>) -> Result<(Vec<OutputFile>, ()), Refusal> {
        let [width, height] = frame.size;
        // Every class is known, so that none exceeds 8 bits.
        frame.positions()?;
        let images = [
            ("labelIds", png::encode_labels(width, height, &frame.labels)),
            (
                "instanceIds",
                png::encode_steps(width, height, &instance_ids(frame)),
            ),
            ("color", png::encode_rgb(width, height, &class_colors(frame))),
        ];
        let files = images.into_iter().map(|(kind, image)| {
            let path = format!("gtFine/{}_gtFine_{kind}.png", frame.stem());
            Ok(OutputFile::new(path, image?))
        });
        Ok((files.collect::<Result<_, Refusal>>()?, ()))
    }

    fn index(&self, about: About<'_>, _: Vec<()>) -> Result<Vec<OutputFile>, Refusal> {
        Ok(vec![json_file(CLASSES, about.classes)?])
    }
}

/// The instance of every pixel, row-major `[height, width]`.
fn instance_ids(frame: &Labelled<'_>) -> Vec<u16> {
    let Some(objects) = &frame.objects else {
        return regions(frame);
    };
    let mut count: BTreeMap<ClassId, u16> = BTreeMap::new();
    let mut instance: FxHashMap<u16, u16> = FxHashMap::default();
    for object in frame.listed.iter().filter(|object| object.thing) {
        let next = count.entry(object.class).or_default();
        let id = object.class.checked_mul(INSTANCES).filter(|_| *next < INSTANCES);
        if let Some(id) = id.and_then(|first| first.checked_add(*next)) {
            instance.insert(object.id, id);
        }
        *next = next.saturating_add(1);
    }
    let of_pixel = frame.labels.iter().zip(objects);
    let id = |(&label, object): (&ClassId, &u16)| instance.get(object).copied().unwrap_or(label);
    of_pixel.map(id).collect()
}

/// The connected region of every pixel, row-major `[height, width]`.
fn regions(frame: &Labelled<'_>) -> Vec<u16> {
    let width = frame.size[0];
    let components = components(&frame.labels, width, Neighbours::SidesAndCorners);
    let mut counts = [0_u32; LARGEST_ID as usize + 1];
    for component in &components {
        counts[usize::from(component.label)] += 1;
    }
    let first_of = |class: ClassId| {
        let first = class.checked_mul(INSTANCES).filter(|_| class != VOID)?;
        let room = u32::from((u16::MAX - first).saturating_add(1).min(INSTANCES));
        (counts[usize::from(class)] <= room).then_some(first)
    };
    let mut next: Vec<Option<u16>> = (0..=LARGEST_ID).map(first_of).collect();
    let mut ids = frame.labels.clone();
    for component in &components {
        let Some(id) = &mut next[usize::from(component.label)] else {
            continue;
        };
        for run in &component.runs {
            ids[run.indices(width)].fill(*id);
        }
        *id = id.saturating_add(1);
    }
    ids
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::export::testing;

    #[test]
    fn a_class_with_too_many_regions_is_a_group() {
        let labels: Vec<u16> = (0..64 * 64)
            .map(|index| u16::from(index % 64 % 2 == 0 && index / 64 % 2 == 0) * 3)
            .collect();
        let scene = testing::scene();
        let classes = [Class::new(3, "dust")];
        let frame = testing::labelled(&scene, [64, 64], &classes, labels.clone());
        assert_eq!(instance_ids(&frame), labels);
    }
}
