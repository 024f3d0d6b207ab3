//! Semantic classes.

use serde::{Deserialize, Serialize};

/// A class's number: the pixel value in exported label maps.
pub type ClassId = u16;

/// "Nothing here": never trained on, exported as 0.
pub const VOID: ClassId = 0;

/// A semantic class.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(from = "ClassRecord")]
pub struct Class {
    /// Pixel value in label maps; stable for the life of a project.
    pub id: ClassId,
    /// Name for people.
    pub name: String,
    /// Display colour, sRGB.
    pub color: [u8; 3],
    /// Whether it has objects that can be counted, such as chairs; walls and grass are stuff.
    pub thing: bool,
}

/// A class as it is written; those of earlier versions and of other programs do not say whether they are things, and some
/// have no colour.
#[derive(Deserialize)]
struct ClassRecord {
    id: ClassId,
    name: String,
    color: Option<[u8; 3]>,
    thing: Option<bool>,
}

impl From<ClassRecord> for Class {
    fn from(record: ClassRecord) -> Self {
        Self {
            id: record.id,
            color: record.color.unwrap_or_else(|| default_color(record.id)),
            thing: record.thing.unwrap_or_else(|| is_thing(&record.name)),
            name: record.name,
        }
    }
}

impl Class {
    /// A class with its default colour, thing or stuff [by its name](is_thing).
    pub fn new(id: ClassId, name: impl Into<String>) -> Self {
        let name = name.into();
        Self {
            id,
            color: default_color(id),
            thing: is_thing(&name),
            name,
        }
    }

    /// A class of which only the id is known.
    pub(crate) fn unnamed(id: ClassId) -> Self {
        Self::new(id, format!("class {id}"))
    }

    /// Whether a name is that of this class, capitals and surrounding blanks aside.
    pub fn is_named(&self, name: &str) -> bool {
        self.name.trim().to_lowercase() == name.trim().to_lowercase()
    }
}

/// Whether a class with this name is one of things, as long as nobody says otherwise: it is none of the usual stuff
/// ("kitchen floor", but not "floor lamp").
pub fn is_thing(name: &str) -> bool {
    RoomPart::named(name).is_none() && !is_among(name, STUFF)
}

/// Whether things with this name lie flat on walls, floors or ceilings, so that they may look like these.
pub(crate) fn lies_flat(name: &str) -> bool {
    is_among(name, FLAT)
}

/// What a room consists of.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum RoomPart {
    /// What one walks on.
    Floor,
    /// What is overhead.
    Ceiling,
    /// What is around.
    Wall,
}

impl RoomPart {
    /// All of them.
    pub(crate) const ALL: [Self; 3] = [Self::Floor, Self::Ceiling, Self::Wall];

    /// The part that a class of stuff is, if any; COCO-Stuff calls one "wall-brick".
    pub(crate) fn of(class: &Class) -> Option<Self> {
        let name = class.name.split('-').next()?;
        Self::named(name).filter(|_| !class.thing)
    }

    /// The part that a class with this name is, if any.
    fn named(name: &str) -> Option<Self> {
        let words = |part: &Self| match part {
            Self::Floor => "carpet floor flooring",
            Self::Ceiling => "ceiling",
            Self::Wall => "wall wallpaper",
        };
        Self::ALL.into_iter().find(|part| is_among(name, words(part)))
    }
}

/// Whether the last word of a name is one of these words, or their plural.
fn is_among(name: &str, words: &str) -> bool {
    let name = name.trim().to_lowercase();
    let last = name.split_whitespace().next_back().unwrap_or_default();
    let one = last.strip_suffix('s').unwrap_or(last);
    words.split(' ').any(|word| word == last || word == one)
}

/// The last words of other classes that are stuff: what rooms, streets and landscapes consist of.
const STUFF: &str = "\
    background baseboard beach building cloud cornice dirt facade foliage grass gravel ground hill ice lake \
    lawn moulding molding mountain mud outdoors outside pavement podium rail river road roof sand sea sidewalk \
    skirting sky snow soil stairs street stucco terrain tiles vegetation water";

/// The last words of classes that lie flat on what a room consists of.
const FLAT: &str = "blind curtain light mat mirror painting paper picture poster rug window";

/// The default colour of a class, sRGB: one of `DEFAULT_COLORS`, and beyond them hues by golden ratio at three
/// values (HSV).
pub fn default_color(id: ClassId) -> [u8; 3] {
    let index = usize::from(id.max(1) - 1);
    if let Some(&color) = DEFAULT_COLORS.get(index) {
        return rgb(color);
    }
    let hue = (index as f32 * 0.618_034).fract() * 6.0;
    let value = [0.95, 0.7, 0.5][index % 3];
    let saturation = [0.55, 0.75][index % 2];
    let channel = |offset: f32| {
        let k = (offset + hue).rem_euclid(6.0);
        let v = value - value * saturation * k.min(4.0 - k).clamp(0.0, 1.0);
        (v * 255.0).round() as u8
    };
    [channel(5.0), channel(3.0), channel(1.0)]
}

/// The channels of 0xRRGGBB.
pub(crate) fn rgb(hex: u32) -> [u8; 3] {
    let [_, rgb @ ..] = hex.to_be_bytes();
    rgb
}

/// Colours that stay distinct for most kinds of colour vision: first those of Okabe and Ito (2008), then each time the
/// colour that is farthest from all before it, in CIELAB, as seen without a deficiency, with deuteranopia and with
/// protanopia (Machado et al. 2009). Lightness 30 to 90 and chroma from 30 on, to be seen on photographs. 0xRRGGBB.
pub(crate) const DEFAULT_COLORS: [u32; 64] = [
    0xE6_9F00, 0x56_B4E9, 0x00_9E73, 0xF0_E442, 0x00_72B2, 0xD5_5E00, 0xCC_79A7, 0x00_00FF, 0x87_F096,
    0x69_69FF, 0x96_1E1E, 0x78_2D5A, 0x87_F0FF, 0x5A_F0C3, 0xFF_005A, 0x5A_1EB4, 0x69_96FF, 0xFF_965A,
    0x78_1E78, 0xB4_2D00, 0xD2_00B4, 0x1E_4BFF, 0x96_0F3C, 0x69_C387, 0x3C_C3D2, 0xA5_4B87, 0x4B_874B,
    0xC3_F069, 0x5A_E1D2, 0x4B_D269, 0x5A_00D2, 0x96_4B69, 0x69_C3A5, 0xC3_5AE1, 0xF0_1E3C, 0x87_D2FF,
    0x96_3CD2, 0x78_0F96, 0x1E_FFB4, 0x3C_D21E, 0x69_F078, 0xD2_003C, 0x5A_A569, 0x69_4B96, 0xA5_87C3,
    0x96_A5FF, 0xB4_962D, 0xF0_C34B, 0x0F_9687, 0x69_2DD2, 0xA5_69A5, 0xA5_5AC3, 0x87_B44B, 0x3C_E1A5,
    0x5A_3CB4, 0x3C_692D, 0x87_D287, 0x1E_5AF0, 0xD2_96C3, 0x5A_B487, 0x00_E1E1, 0x00_875A, 0x78_2D69,
    0x96_1E00,
];

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::HashSet;

    /// Row-major matrices on linear RGB: full colour vision, deuteranopia and protanopia (Machado, Oliveira and
    /// Fernandes 2009, severity 1.0).
    const VISIONS: [[[f64; 3]; 3]; 3] = [
        [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ],
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ],
    ];

    fn product(matrix: &[[f64; 3]; 3], vector: [f64; 3]) -> [f64; 3] {
        matrix.map(|row| row.iter().zip(vector).map(|(a, b)| a * b).sum())
    }

    /// CIELAB under D65 of an sRGB colour as it is seen.
    fn seen(color: [u8; 3], vision: &[[f64; 3]; 3]) -> [f64; 3] {
        const XYZ_OF_RGB: [[f64; 3]; 3] = [
            [0.4124564, 0.3575761, 0.1804375],
            [0.2126729, 0.7151522, 0.0721750],
            [0.0193339, 0.1191920, 0.9503041],
        ];
        let linear = color.map(|value| {
            let v = f64::from(value) / 255.0;
            if v <= 0.04045 {
                v / 12.92
            } else {
                ((v + 0.055) / 1.055).powf(2.4)
            }
        });
        let linear = product(vision, linear).map(|v| v.clamp(0.0, 1.0));
        let [x, y, z] = product(&XYZ_OF_RGB, linear);
        let [x, y, z] = [x / 0.95047, y, z / 1.08883].map(|t| {
            if t > 0.008856 {
                t.cbrt()
            } else {
                7.787037 * t + 16.0 / 116.0
            }
        });
        [116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)]
    }

    /// The smallest CIELAB distance between any two of the first colours, whoever looks.
    fn smallest_distance(count: ClassId) -> f64 {
        let mut smallest = f64::INFINITY;
        for vision in &VISIONS {
            let colors: Vec<_> = (1..=count).map(|id| seen(default_color(id), vision)).collect();
            for (index, a) in colors.iter().enumerate() {
                for b in &colors[..index] {
                    let squares = a.iter().zip(b).map(|(a, b)| (a - b).powi(2));
                    smallest = smallest.min(squares.sum::<f64>().sqrt());
                }
            }
        }
        smallest
    }

    #[test]
    fn the_first_colors_differ_for_the_colour_blind_too() {
        for (count, least) in [(12, 16.9), (24, 16.0), (48, 9.0), (64, 8.0)] {
            let smallest = smallest_distance(count);
            assert!(smallest >= least, "{count} colours: {smallest}");
        }
        let first_hundred: HashSet<_> = (1..=100).map(default_color).collect();
        assert_eq!(first_hundred.len(), 100);
    }

    #[test]
    fn classes_are_things_or_stuff_by_their_last_word_unless_they_say_so() {
        for (name, thing) in [
            ("chair", true),
            ("Floor lamp", true),
            ("kitchen floor ", false),
            ("Walls", false),
            ("", true),
        ] {
            assert_eq!(Class::new(1, name).thing, thing, "{name}");
            let json = serde_json::json!({ "id": 1, "name": name, "color": [1, 2, 3] });
            assert_eq!(serde_json::from_value::<Class>(json).unwrap().thing, thing);
        }
        let said = serde_json::json!({ "id": 1, "name": "wall", "color": [1, 2, 3], "thing": true });
        let class: Class = serde_json::from_value(said.clone()).unwrap();
        assert_eq!(serde_json::to_value(&class).unwrap(), said);
        let bare = serde_json::json!({ "id": 2, "name": "door" });
        assert_eq!(
            serde_json::from_value::<Class>(bare).unwrap(),
            Class::new(2, "door")
        );
    }

    #[test]
    fn names_tell_what_a_room_consists_of_and_what_lies_flat_on_it() {
        let parts = [
            "Green walls",
            "kitchen floor",
            "ceiling ",
            "ceiling light",
            "wallaby",
        ]
        .map(RoomPart::named);
        let [wall, floor, ceiling] = [RoomPart::Wall, RoomPart::Floor, RoomPart::Ceiling].map(Some);
        assert_eq!(parts, [wall, floor, ceiling, None, None]);
        let brick = |thing| Class {
            thing,
            ..Class::new(1, "wall-brick")
        };
        assert_eq!(
            [false, true].map(|thing| RoomPart::of(&brick(thing))),
            [wall, None]
        );
        assert!(["ceiling light", "Windows"].into_iter().all(lies_flat));
        assert!(!["window seat", "chair"].into_iter().any(lies_flat));
    }

    #[test]
    fn default_colors_are_neither_pale_nor_dark() {
        for color in DEFAULT_COLORS.map(rgb) {
            let [lightness, a, b] = seen(color, &VISIONS[0]);
            assert!((30.0..92.0).contains(&lightness), "{color:?}");
            assert!(a.hypot(b) >= 29.0, "{color:?}");
        }
    }
}
