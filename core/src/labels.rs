//! What the person said: classes, strokes and label images from elsewhere, with undo and redo.
//!
//! Strokes are vectors in pixel coordinates; they and the imported images are the only truth, from which every
//! map is derived.

mod class;
mod edit;
mod file;
mod history;
mod import;
mod imported;
mod object;
mod palette;
pub(crate) mod png;
mod polygon;
mod raster;
mod runs;
mod stroke;
#[cfg(test)]
pub(crate) mod testing;

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

pub use class::{Class, ClassId, VOID, default_color, is_thing};
pub(crate) use class::{DEFAULT_COLORS, RoomPart, lies_flat, rgb};
pub use edit::{CheckChange, Edit, ImportChange, StrokeChange};
pub use file::{StrokesError, parse_strokes, read_strokes, strokes_json};
pub use history::{AddedClasses, History};
pub use import::{ImportError, LabelImages, in_frame, label_image_files, read_class_list, read_label_images};
pub use imported::{ImportId, ImportedLabels, ImportedMap, Likeliest, Probabilities, Trust};
pub(crate) use object::unused_name;
pub use object::{FoundObject, Label, Object, ObjectId};
pub use palette::{ClassPalette, PALETTES, parse_class_list};
pub use png::decode_gray;
pub use polygon::polygon_runs;
pub use raster::{erase, pixels_of, rasterise, runs_of};
pub(crate) use runs::contains;
pub use runs::{Run, runs_of_equal};
pub use stroke::{Pixel, Stroke, StrokeId, StrokeKind};

/// Everything the person said about a scene. Cloning is cheap: strokes and images are shared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct LabelSet {
    /// The classes, in the order in which they are shown; void is not among them.
    pub classes: Vec<Class>,
    /// The objects that strokes name, in the order in which they are shown.
    pub objects: Vec<Object>,
    /// The strokes by id; later ids cover earlier ones.
    pub strokes: BTreeMap<StrokeId, Arc<Stroke>>,
    /// Label images from elsewhere; strokes cover them.
    pub imported: Option<Arc<ImportedLabels>>,
    /// Indices of the frames that a person has marked as checked.
    pub checked: BTreeSet<usize>,
}

impl LabelSet {
    /// These classes, of which nothing is labelled yet.
    pub fn of_classes(classes: Vec<Class>) -> Self {
        Self {
            classes,
            ..Self::default()
        }
    }

    /// Whether these labels are `before` with this stroke as the newest.
    pub fn is_one_more(&self, before: &Self, stroke: &Stroke) -> bool {
        let mut others = self.clone();
        let newest = others.strokes.pop_last();
        newest.is_some_and(|(_, newest)| *newest == *stroke) && others == *before
    }

    /// Whether anything is said about any pixel.
    pub fn says_anything(&self) -> bool {
        !self.strokes.is_empty() || self.imported.is_some()
    }

    /// The class with this id.
    pub fn class(&self, id: ClassId) -> Option<&Class> {
        self.classes.iter().find(|class| class.id == id)
    }

    /// The object with this id.
    pub fn object(&self, id: ObjectId) -> Option<&Object> {
        self.objects.iter().find(|object| object.id == id)
    }

    /// The strokes of one frame, earliest first.
    pub fn strokes_of(&self, frame: usize) -> impl Iterator<Item = (StrokeId, &Stroke)> {
        self.strokes
            .iter()
            .filter(move |(_, stroke)| stroke.frame == frame)
            .map(|(&id, stroke)| (id, stroke.as_ref()))
    }

    /// An id above those of all present strokes.
    pub fn next_stroke_id(&self) -> StrokeId {
        StrokeId(self.strokes.last_key_value().map_or(1, |(id, _)| id.0 + 1))
    }
}

#[cfg(test)]
mod tests {
    use super::testing::clicked;
    use super::*;

    #[test]
    fn labels_are_one_more_with_the_stroke_as_the_newest_and_all_else_as_before() {
        let clicks = [(0, 1, [10, 20]), (3, 1, [4, 5])];
        let stroke = Stroke::click(3, 1, [4, 5]);
        let [before, now] = [&clicks[..1], &clicks].map(|clicks| clicked(&["a"], clicks).labels().clone());
        assert!(now.is_one_more(&before, &stroke));
        assert!(!now.is_one_more(&before, &Stroke::click(3, 1, [4, 6])));
        assert!(!now.is_one_more(&now, &stroke) && !before.is_one_more(&before, &stroke));
        let mut others = now.clone();
        others.classes[0].thing ^= true;
        assert!(!others.is_one_more(&before, &stroke));
    }
}
