//! Two labellings of one scene: how far they agree, and where they differ.

use std::collections::HashMap;
use std::io;
use std::path::Path;
use std::sync::Arc;

use rayon::prelude::*;
use rustc_hash::FxHashMap;
use serde::Serialize;

use super::{ExportError, write};
use crate::labels::{Class, ClassId, png};
use crate::scene::Scene;
use crate::session::FrameMap;

/// The pixels of a difference image: both say the same or nothing, one alone says something, they differ.
const SAME: u16 = 0;
const ONE: u16 = 96;
const DIFFERENT: u16 = 255;

/// What two labellings say of a pixel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Difference {
    /// Neither gives it a class.
    Nothing,
    /// The same class.
    Same,
    /// One alone gives it a class.
    Alone,
    /// Different classes.
    Different,
}

impl Difference {
    /// Of two numbers of a [`ClassMatching`].
    fn of(pair: [usize; 2]) -> Self {
        match pair {
            [0, 0] => Self::Nothing,
            [a, b] if a == b => Self::Same,
            [0, _] | [_, 0] => Self::Alone,
            _ => Self::Different,
        }
    }
}

/// A scene with maps of its frames.
#[derive(Clone, Debug)]
pub struct Labelling {
    /// The scene.
    pub scene: Arc<Scene>,
    /// Its classes.
    pub classes: Vec<Class>,
    /// One map for each frame, in any order.
    pub maps: Vec<Arc<FrameMap>>,
}

/// How far two labellings agree. Shares and counts are of the pixels that both give a class.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Agreement {
    /// Frames that both have, by name and size.
    pub frames: usize,
    /// Pixels of these frames, in their images on disk.
    pub pixels: u64,
    /// Pixels to which both give a class.
    pub compared: u64,
    /// Share of those with the same class; `None` without any.
    pub agreement: Option<f64>,
    /// Cohen's kappa: the agreement beyond that of chance, as a share of what there could be (Cohen 1960). `None` where
    /// chance alone would agree everywhere.
    pub kappa: Option<f64>,
    /// Mean intersection over union of the classes that either has.
    pub miou: Option<f64>,
    /// The classes that either has, in the order of the first list, then of the second.
    pub classes: Vec<ClassAgreement>,
}

/// How far two labellings agree about a class.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct ClassAgreement {
    /// Its name, by which it is the same in both (capitals aside).
    pub name: String,
    /// Pixels to which the first labelling gives it.
    pub first: u64,
    /// Pixels to which the second does.
    pub second: u64,
    /// Pixels to which both do.
    pub both: u64,
    /// Intersection over union.
    pub iou: f64,
}

/// The classes of two labellings, which are the same where they have the same name (capitals aside).
#[derive(Debug)]
pub struct ClassMatching {
    /// The name of each number; number 0 is void.
    names: Vec<String>,
    numbers: [FxHashMap<ClassId, usize>; 2],
}

impl ClassMatching {
    /// Matches the classes of two lists.
    pub fn new(lists: [&[Class]; 2]) -> Self {
        let mut names = vec![String::new()];
        let numbers = lists.map(|classes| {
            let number = |class: &Class| {
                let known = names
                    .iter()
                    .skip(1)
                    .position(|name| class.is_named(name))
                    .map(|at| at + 1);
                let number = known.unwrap_or_else(|| {
                    names.push(class.name.clone());
                    names.len() - 1
                });
                (class.id, number)
            };
            classes.iter().map(number).collect()
        });
        Self { names, numbers }
    }

    /// The numbers of two classes, one of each list.
    fn pair(&self, [first, second]: [ClassId; 2]) -> [usize; 2] {
        let number = |list: usize, id| self.numbers[list].get(&id).copied().unwrap_or(0);
        [number(0, first), number(1, second)]
    }

    /// What two labellings say of a pixel to which they give these classes, one of each list.
    pub fn difference(&self, labels: [ClassId; 2]) -> Difference {
        Difference::of(self.pair(labels))
    }

    /// Pixels by the number that each gives them, `[first, second]`, and the difference image.
    fn compare(&self, labels: [&[ClassId]; 2]) -> (Vec<u64>, Vec<u16>) {
        let mut counts = vec![0; self.names.len() * self.names.len()];
        let [first, second] = labels;
        let pixel = |(&a, &b): (&ClassId, &ClassId)| {
            let pair = self.pair([a, b]);
            counts[pair[0] * self.names.len() + pair[1]] += 1;
            match Difference::of(pair) {
                Difference::Nothing | Difference::Same => SAME,
                Difference::Alone => ONE,
                Difference::Different => DIFFERENT,
            }
        };
        let image = first.iter().zip(second).map(pixel).collect();
        (counts, image)
    }

    fn agreement(self, frames: usize, counts: &[u64]) -> Agreement {
        let listed = 1..self.names.len();
        let count = |first: usize, second: usize| counts[first * self.names.len() + second];
        let classes = listed.clone().map(|class| {
            let first: u64 = listed.clone().map(|other| count(class, other)).sum();
            let second: u64 = listed.clone().map(|other| count(other, class)).sum();
            let both = count(class, class);
            ClassAgreement {
                name: self.names[class].clone(),
                first,
                second,
                both,
                iou: both as f64 / (first + second - both) as f64,
            }
        });
        let classes: Vec<_> = classes.filter(|class| class.first + class.second > 0).collect();
        let compared: u64 = classes.iter().map(|class| class.first).sum();
        let of_compared = |pixels: f64| (compared > 0).then(|| pixels / compared as f64);
        let agreement = of_compared(classes.iter().map(|class| class.both as f64).sum());
        let chance = classes
            .iter()
            .map(|class| class.first as f64 * class.second as f64);
        let chance = of_compared(chance.sum()).and_then(of_compared);
        let kappa = agreement.zip(chance).filter(|(_, chance)| *chance < 1.0);
        let ious: f64 = classes.iter().map(|class| class.iou).sum();
        Agreement {
            frames,
            pixels: counts.iter().sum(),
            compared,
            agreement,
            kappa: kappa.map(|(agreement, chance)| (agreement - chance) / (1.0 - chance)),
            miou: (compared > 0).then(|| ious / classes.len() as f64),
            classes,
        }
    }
}

/// Compares two labellings of the frames that both have, by their names and sizes. With a folder, an image for each frame goes
/// there as `STEM.png`, gray: 0 where both say the same or nothing, 96 where one alone gives a class, 255 where they
/// differ.
///
/// # Errors
/// [`ExportError::Unwritable`].
pub fn compare(
    first: &Labelling,
    second: &Labelling,
    folder: Option<&Path>,
) -> Result<Agreement, ExportError> {
    let matching = ClassMatching::new([&first.classes, &second.classes]);
    let in_second: HashMap<&str, &FrameMap> = second
        .maps
        .iter()
        .map(|map| (second.scene.frames[map.frame].stem.as_str(), map.as_ref()))
        .collect();
    let compared = first.maps.par_iter().filter_map(|map| {
        let frame = &first.scene.frames[map.frame];
        let other = in_second.get(frame.stem.as_str())?;
        let own = map.in_image(frame);
        let other = other.in_image(&second.scene.frames[other.frame]);
        let is_same_size = (own.width, own.height) == (other.width, other.height);
        is_same_size.then(|| {
            let (counts, image) = matching.compare([&own.labels(), &other.labels()]);
            if let Some(folder) = folder {
                let path = folder.join(format!("{}.png", frame.stem));
                let png = png::encode_labels(own.width, own.height, &image);
                let png = png.map_err(|error| ExportError::unwritable(&path, io::Error::other(error)))?;
                write(&path, &png)?;
            }
            Ok::<_, ExportError>((1, counts))
        })
    });
    let empty = || (0, vec![0; matching.names.len() * matching.names.len()]);
    let (frames, counts) = compared.try_reduce(empty, |a, b| {
        let counts = a.1.iter().zip(&b.1).map(|(a, b)| a + b);
        Ok((a.0 + b.0, counts.collect()))
    })?;
    Ok(matching.agreement(frames, &counts))
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::super::testing::{self, HEIGHT, SIZE, WIDTH, scene};
    use super::*;
    use crate::labels::VOID;

    /// The first half of the rows is as listed, repeated along each row, and the second void.
    fn maps(row: &[ClassId]) -> Vec<Arc<FrameMap>> {
        let upper = (0..WIDTH * HEIGHT / 2).map(|pixel| row[pixel as usize % row.len()]);
        let labels: Vec<ClassId> = upper.chain((0..WIDTH * HEIGHT / 2).map(|_| VOID)).collect();
        testing::maps(SIZE, &[labels.clone(), labels])
    }

    #[test]
    fn classes_are_matched_by_name_and_pixels_that_one_leaves_void_do_not_count() {
        let (scene, folder) = (Arc::new(scene()), tempfile::tempdir().unwrap());
        let first = [Class::new(1, "wall"), Class::new(2, "floor")];
        let second = [
            Class::new(7, "lamp"),
            Class::new(2, "Wall"),
            Class::new(1, "floor"),
        ];
        // By name: wall wall, wall wall, floor floor, floor wall, wall lamp, wall void.
        let labelled = |classes: &[Class], maps| Labelling {
            scene: Arc::clone(&scene),
            classes: classes.to_vec(),
            maps,
        };
        let own = labelled(&first, maps(&[1, 1, 2, 2, 1, 1]));
        let other = labelled(&second, maps(&[2, 2, 1, 2, 7, VOID]));
        let agreement = compare(&own, &other, Some(folder.path())).unwrap();
        // Two frames, half of each.
        let pixels = u64::from(WIDTH * HEIGHT);
        assert_eq!((agreement.frames, agreement.pixels), (2, 2 * pixels));
        assert_eq!(agreement.compared, pixels * 5 / 6);
        let close = |a: Option<f64>, b: f64| assert!((a.unwrap() - b).abs() < 1e-12, "{a:?} is not {b}");
        close(agreement.agreement, 3.0 / 5.0);
        // Chance: wall 3 x 3, floor 2 x 1, of 25.
        close(agreement.kappa, (15.0 - 11.0) / (25.0 - 11.0));
        close(agreement.miou, (2.0 / 4.0 + 1.0 / 2.0) / 3.0);
        let names: Vec<&str> = agreement
            .classes
            .iter()
            .map(|class| class.name.as_str())
            .collect();
        assert_eq!(names, ["wall", "floor", "lamp"]);
        let image = fs::read(folder.path().join("rgb_1.png")).unwrap();
        let (_, _, image) = png::decode_gray(&image).unwrap();
        assert_eq!(image[..6], [SAME, SAME, SAME, DIFFERENT, DIFFERENT, ONE]);
        assert_eq!(image.last(), Some(&SAME));

        let same = compare(&own, &own, None).unwrap();
        assert_eq!(
            (same.agreement, same.kappa, same.miou),
            (Some(1.0), Some(1.0), Some(1.0))
        );
        let nothing = compare(&own, &labelled(&second, Vec::new()), None).unwrap();
        assert_eq!(
            (nothing.frames, nothing.agreement, nothing.kappa),
            (0, None, None)
        );
    }
}
