//! Folders as people and networks write them.

use super::*;
use crate::labels::png::{encode_labels, encode_rgb};
use crate::labels::testing::{clicked, named};
use crate::scene::testing::{bend, hide, wall};

fn write(folder: &Path, name: &str, width: u32, labels: &[ClassId]) {
    let png = encode_labels(width, labels.len() as u32 / width, labels).unwrap();
    fs::write(folder.join(name), png).unwrap();
}

fn read(folder: &Path, scene: &Scene) -> Result<LabelImages, String> {
    read_label_images(folder, scene, &[], Trust::VOTES).map_err(|error| error.to_string())
}

#[test]
fn hidden_pixels_are_void_whatever_the_image_says() {
    let mut scene = wall(1, 8, 6);
    hide(&mut scene.frames[0], |index| index % 8 < 3);
    let expected: Vec<ClassId> = (0..48)
        .map(|index| if index % 8 < 3 { VOID } else { 7 })
        .collect();
    assert_eq!(in_frame(&scene.frames[0], [8, 6], &[7; 48]), expected);
    let root = tempfile::tempdir().unwrap();
    write(root.path(), "rgb_0.png", 8, &[7; 48]);
    let found = read(root.path(), &scene).unwrap();
    assert_eq!(found.labels.maps[0].labels(), expected);
}

#[test]
fn images_are_found_by_stem_and_ids_become_classes_by_name_number_and_palette() {
    let scene = wall(3, 8, 6);
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("labels");
    fs::create_dir(&folder).unwrap();
    let mut labels = vec![0; 48];
    labels[..5].copy_from_slice(&[1, 2, 3, 300, 300]);
    write(&folder, "rgb_2.png", 8, &labels);
    write(&folder, "legend.png", 3, &[1, 2, 3]);
    let classes = r#"[{"id": 1, "name": "Floor"}, {"id": 2, "name": "door", "color": [1, 2, 3]}]"#;
    fs::write(root.path().join("classes.json"), classes).unwrap();
    // The folder above stands for the one with the images, as an export does.
    let found = read(root.path(), &scene).unwrap();
    assert_eq!(found, read(&folder, &scene).unwrap());
    assert_eq!((found.labels.maps.len(), found.unmatched), (1, 1));
    assert_eq!(found.labels.maps[0].labels(), labels);

    let mut history = clicked(&["wall", "floor"], &[(0, 1, [0, 0])]);
    history.import(found);
    let now = history.labels();
    let named: Vec<(ClassId, &str)> = now.classes.iter().map(|c| (c.id, c.name.as_str())).collect();
    // Floor is 2 here, so that the images' door, 2 there, gets an id of its own.
    assert_eq!(
        named,
        [
            (1, "wall"),
            (2, "floor"),
            (3, "class 3"),
            (300, "class 300"),
            (301, "door")
        ]
    );
    assert_eq!(now.class(301).unwrap().color, [1, 2, 3]);
    let imported = now.imported.as_ref().unwrap();
    assert_eq!(imported.maps[0].labels()[..5], [2, 301, 3, 300, 300]);
}

#[test]
fn what_cannot_be_used_is_one_sentence_that_names_it() {
    let scene = wall(2, 8, 6);
    let root = tempfile::tempdir().unwrap();
    let refused = |part: &str, word: &str| {
        let error = read(root.path(), &scene).unwrap_err();
        assert!(error.contains(part) && error.contains(word), "{error}");
        assert!(!error.contains('\n'), "{error}");
    };
    let error = read(&root.path().join("nowhere"), &scene).unwrap_err();
    assert!(
        error.contains("nowhere") && error.contains("check that it is there"),
        "{error}"
    );
    refused("", "has no label images");
    write(root.path(), "other.png", 8, &[1; 48]);
    refused("", "named like a frame");
    let name = "rgb_0.png";
    write(root.path(), name, 8, &[0; 48]);
    refused("", "void everywhere");
    write(root.path(), name, 8, &[1; 40]);
    refused(name, "8x5 pixels");
    put(root.path(), name, b"no image");
    refused(name, "is no label image");
    put(root.path(), name, &encode_rgb(8, 6, &[9; 144]).unwrap());
    refused(name, "colour (9, 9, 9) at column 0, row 0");
    write(root.path(), name, 8, &[1; 48]);
    for classes in ["[1]", r#"[{"id": 1, "name": "a"}, {"id": 1, "name": "b"}]"#] {
        fs::write(root.path().join("classes.json"), classes).unwrap();
        refused("classes.json", "cannot be used");
    }
}

#[test]
fn a_label_image_says_neither_more_than_its_file_holds_nor_half_a_class() {
    let scene = wall(1, 8, 6);
    let root = tempfile::tempdir().unwrap();
    let path = root.path().join("rgb_0.png");
    let mut png = encode_labels(8, 6, &[7; 48]).unwrap();
    // 8192 x 8192 pixels, and the checksum of such a header.
    png[16..24].copy_from_slice(&[0, 0, 0x20, 0, 0, 0, 0x20, 0]);
    png[29..33].copy_from_slice(&[0x57, 0xc1, 0x95, 0x85]);
    fs::write(&path, png).unwrap();
    let error = read(root.path(), &scene).unwrap_err();
    assert!(error.contains("cannot hold 8192x8192 pixels"), "{error}");
    let mut gray = ::image::GrayAlphaImage::from_pixel(8, 6, ::image::LumaA([7, 255]));
    gray.put_pixel(3, 2, ::image::LumaA([7, 0]));
    gray.save(&path).unwrap();
    let labels = read(root.path(), &scene).unwrap().labels.maps[0].labels();
    assert!((0..48).all(|pixel| labels[pixel] == if pixel == 2 * 8 + 3 { VOID } else { 7 }));
    gray.put_pixel(3, 2, ::image::LumaA([7, 128]));
    gray.save(&path).unwrap();
    let error = read(root.path(), &scene).unwrap_err();
    let told = "rgb_0.png: is half transparent at column 3, row 2";
    assert!(error.contains(told), "{error}");
}

#[test]
fn images_of_bent_frames_are_straightened() {
    let mut scene = wall(1, 64, 48);
    bend(&mut scene.frames[0], -0.1);
    let root = tempfile::tempdir().unwrap();
    let mut labels = vec![2; 64 * 48];
    (0..48).for_each(|y| labels[y * 64..y * 64 + 32].fill(1));
    write(root.path(), "rgb_0.png", 64, &labels);
    let found = read(root.path(), &scene).unwrap();
    let frame = &scene.frames[0];
    let own = found.labels.maps[0].labels();
    assert_eq!(own.len(), frame.camera.pixels());
    let at = |[x, y]: [u32; 2]| own[(y * frame.camera.width + x) as usize];
    assert_eq!(at(frame.of_image([10, 40]).unwrap()), 1);
    assert_eq!(at(frame.of_image([50, 5]).unwrap()), 2);
}

/// A file that NumPy 2.4 or Pillow 13 wrote; `fixtures/README.md` has the lines that did.
fn fixture(name: &str) -> Vec<u8> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("src/labels/import/fixtures");
    fs::read(folder.join(name)).unwrap()
}

fn put(folder: &Path, name: &str, bytes: &[u8]) {
    fs::write(folder.join(name), bytes).unwrap();
}

const LISTED: &str = r#"[{"id": 0, "name": "void", "color": [0, 0, 0]}, {"id": 4, "name": "floor", "color": [10, 20, 30]},
                         {"id": 9, "name": "door", "color": [200, 0, 0]}]"#;

/// What `fixtures/palette.png` and `fixtures/colours-*.png` show: void, then 4, 9 in the lower half.
fn halves() -> Vec<ClassId> {
    (0..48)
        .map(|pixel| [0, 4, 9][usize::from(pixel >= 8) + usize::from(pixel >= 24)])
        .collect()
}

#[test]
fn indices_of_a_palette_are_ids_and_the_border_of_voc_says_nothing() {
    let scene = wall(1, 8, 6);
    let root = tempfile::tempdir().unwrap();
    for palette in ["palette.png", "palette-4-bits.png", "palette-border.png"] {
        put(root.path(), "rgb_0.png", &fixture(palette));
        let found = read(root.path(), &scene).unwrap();
        assert_eq!(found.labels.maps[0].labels(), halves(), "{palette}");
    }
    // Where a class has the id of the border, it is that class.
    let known = [Class::new(255, "sky")];
    let named = read_label_images(root.path(), &scene, &known, Trust::VOTES).unwrap();
    assert_eq!(named.labels.maps[0].labels()[0], 255);
}

#[test]
fn colours_are_those_of_the_classes_listed_or_else_known() {
    let scene = wall(1, 8, 6);
    let root = tempfile::tempdir().unwrap();
    let listed = parse_class_list(LISTED).unwrap();
    for what in ["8", "transparent", "16"] {
        let labels = |known: &[Class]| {
            let images = read_label_images(root.path(), &scene, known, Trust::VOTES);
            images
                .map(|images| images.labels.maps[0].labels())
                .map_err(|error| error.to_string())
        };
        put(root.path(), "rgb_0.png", &fixture(&format!("colours-{what}.png")));
        assert_eq!(labels(&listed).unwrap(), halves(), "{what}");
        let unknown = labels(&listed[1..]).unwrap_err();
        let told = "rgb_0.png: has the colour (10, 20, 30) at column 0, row 1,";
        assert!(unknown.contains(told), "{unknown}");
        let red = Class {
            color: [200, 0, 0],
            ..listed[0].clone()
        };
        let twice = labels(&[listed[0].clone(), red, listed[1].clone()]).unwrap_err();
        assert!(twice.contains("several classes"), "{twice}");
        // The list of the folder comes first.
        put(root.path(), "classes.json", LISTED.as_bytes());
        assert_eq!(labels(&listed[1..]).unwrap(), halves(), "{what}");
        fs::remove_file(root.path().join("classes.json")).unwrap();
    }
}

#[test]
fn smaller_images_speak_for_the_pixels_in_the_middle_of_theirs_and_larger_ones_for_all() {
    let scene = wall(1, 8, 6);
    let root = tempfile::tempdir().unwrap();
    let small: Vec<ClassId> = (1..=12).collect();
    write(root.path(), "rgb_0.png", 4, &small);
    let labels = |trust| {
        let images = read_label_images(root.path(), &scene, &[], trust).unwrap();
        images.labels.maps[0].labels()
    };
    assert_eq!(labels(Trust::VOTES), labels(Trust::RIGHT));
    let expected = [[0; 8], [0, 1, 0, 2, 0, 3, 0, 4]].concat();
    assert_eq!(labels(Trust::VOTES)[..16], expected);
    let large: Vec<ClassId> = (0..16 * 12).map(|pixel| 1 + pixel % 16).collect();
    write(root.path(), "rgb_0.png", 16, &large);
    assert_eq!(labels(Trust::RIGHT)[..8], [2, 4, 6, 8, 10, 12, 14, 16]);
}

/// The cells of the only map.
fn cells(images: &LabelImages) -> (Vec<Vec<(ClassId, u32)>>, [u32; 2]) {
    let grid = images.labels.maps[0].probabilities().unwrap();
    let per_cent = |cell: &super::super::Likeliest| {
        cell.iter()
            .map(|(class, p)| (class, (100.0 * p).round() as u32))
            .collect()
    };
    (grid.cells().iter().map(per_cent).collect(), grid.size())
}

#[test]
fn probabilities_of_every_kind_and_order_that_numpy_writes_are_the_same() {
    let scene = wall(1, 8, 6);
    let of = |name: &str, file: &str| {
        let root = tempfile::tempdir().unwrap();
        put(root.path(), name, &fixture(file));
        put(root.path(), "classes.json", LISTED.as_bytes());
        read(root.path(), &scene).unwrap()
    };
    let expected = of("rgb_0.npy", "classes-first-f32.npy");
    let (found, size) = cells(&expected);
    assert_eq!(size, [4, 3]);
    // Void is the likeliest of the first, and takes a part of the second.
    let [second, third] = [[(4, 50), (9, 12)], [(9, 75), (4, 25)]];
    assert_eq!(found[..3], [vec![], second.to_vec(), third.to_vec()]);
    assert_eq!(expected.labels.maps[0].labels()[..8], [0, 0, 4, 4, 9, 9, 9, 9]);
    for (name, file) in [
        ("rgb_0.npy", "classes-last-f16.npy"),
        ("rgb_0.npy", "classes-first-fortran-f64.npy"),
        ("rgb_0.npz", "batch-f16.npz"),
        ("rgb_0.NPZ", "compressed-f32.npz"),
    ] {
        assert_eq!(of(name, file), expected, "{file}");
    }
}

#[test]
fn probabilities_without_a_list_are_of_the_ids_from_1_on_and_trusted_ones_are_labels() {
    let scene = wall(1, 8, 6);
    let root = tempfile::tempdir().unwrap();
    put(root.path(), "rgb_0.npy", &fixture("five.npy"));
    let (found, _) = cells(&read(root.path(), &scene).unwrap());
    assert_eq!(found[0], [(1, 80), (2, 20)]);
    assert_eq!(found[1], [(2, 50), (1, 38), (3, 12)]);
    let right = read_label_images(root.path(), &scene, &[], Trust::RIGHT).unwrap();
    let map = &right.labels.maps[0];
    assert!(map.probabilities().is_none());
    assert_eq!(map.labels()[8..16], [0, 1, 0, 2, 0, 3, 0, 3]);
    // Classes that are nowhere the likeliest are left out.
    put(root.path(), "rgb_0.npy", &fixture("unlikely.npy"));
    let images = read(root.path(), &scene).unwrap();
    assert_eq!(images.labels.classes(), [2].into());
    assert_eq!(cells(&images).0[0], [(2, 70)]);
}

#[test]
fn arrays_that_cannot_be_used_are_refused_in_one_sentence() {
    let scene = wall(1, 8, 6);
    let root = tempfile::tempdir().unwrap();
    let refused = |name: &str, bytes: &[u8], part: &str| {
        put(root.path(), name, bytes);
        let error = read(root.path(), &scene).unwrap_err();
        assert!(error.contains(&format!("{name}: ")), "{error}");
        assert!(error.contains(part), "{error}");
        assert!(!error.contains('\n'), "{error}");
        fs::remove_file(root.path().join(name)).unwrap();
    };
    let good = &fixture("five.npy");
    let short = &good[..good.len() - 1];
    refused("rgb_0.npy", short, "less data than its shape (5, 3, 4) says");
    for (file, part) in [
        ("both-ways.npy", "both the first and the last axis"),
        ("square.npy", "(3, 7, 7), which is not that of classes"),
        ("flat.npy", "of the shape (3, 4)"),
        ("scores.npy", "which is no probability"),
        ("sums.npy", "add up to 1.80"),
        ("ids.npy", "of the kind <i8"),
    ] {
        refused("rgb_0.npy", &fixture(file), part);
    }
    refused("rgb_0.npz", &fixture("two.npz"), "holds 2 arrays");
    refused("rgb_0.npz", b"PK", "is no NPZ file");
    let two = br#"[{"id": 1, "name": "one"}, {"id": 2, "name": "two"}]"#;
    put(root.path(), "classes.json", two);
    refused("rgb_0.npy", good, "not that of 2 classes");
    put(root.path(), "rgb_0.png", &fixture("palette.png"));
    refused("rgb_0.npy", good, "beside rgb_0.png");
}

#[test]
fn fine_probabilities_are_thinned_out_to_what_memory_allows() {
    let scene = wall(1, 8, 6);
    let root = tempfile::tempdir().unwrap();
    put(root.path(), "rgb_0.npy", &fixture("fine.npy"));
    let path = root.path().join("rgb_0.npy");
    let array = Array::read(&path, &scene.frames[0], None).unwrap();
    assert_eq!(array.size(), [16, 12]);
    // No finer than the frame.
    assert_eq!(array.on_grid(&scene.frames[0], 1000).unwrap().size(), [8, 6]);
    let thin = array.on_grid(&scene.frames[0], 12).unwrap();
    assert_eq!((thin.size(), thin.cells().len()), ([4, 3], 12));
    assert!(thin.cells().iter().all(|cell| cell.class() == 1));
}

/// The numbers in the object image of [`write_objects`], over and over.
const NUMBERS: [u16; 4] = [0, 1, 300, 4];

/// A folder as an export writes it: two chairs, one of them named, and a floor.
fn write_objects(root: &Path, image: &str) {
    let folder = root.join("objects");
    fs::create_dir(&folder).unwrap();
    write(&folder, image, 8, &NUMBERS.repeat(12));
    let listed = r#"[{"id": 1, "class_id": 6, "class_name": "floor", "thing": false, "pixels": 12},
        {"id": 300, "class_id": 5, "class_name": "chair", "name": "stool"},
        {"id": 4, "class_id": 5, "class_name": "chair", "thing": true},
        {"id": 9, "class_id": 5, "name": "chair 1"}]"#;
    // As some editors save it, with a byte order mark.
    fs::write(root.join("objects.json"), format!("\u{feff}{listed}")).unwrap();
}

#[test]
fn images_of_objects_say_class_and_object_and_class_images_say_the_rest() {
    let scene = wall(2, 8, 6);
    let root = tempfile::tempdir().unwrap();
    write_objects(root.path(), "rgb_1.png");
    let found = read(root.path(), &scene).unwrap();
    assert_eq!(found, read(&root.path().join("objects"), &scene).unwrap());
    // What no frame shows is left out, and its name is not free.
    assert_eq!(named(&found.objects), [(300, "stool"), (4, "chair 2")]);
    let things: Vec<_> = found
        .classes
        .iter()
        .map(|class| (class.id, class.thing))
        .collect();
    assert_eq!(things, [(6, false), (5, true)]);
    let map = &found.labels.maps[0];
    assert_eq!(map.labels(), [0, 6, 5, 5].repeat(12));
    let things = [0, 0, 300, 4].map(ObjectId::new);
    assert_eq!(map.objects().unwrap(), things.repeat(12));
    let files = label_image_files(root.path()).unwrap();
    assert_eq!(files.len(), 2, "{files:?}");

    // The names of a capture in the Replica layout, and class images beside.
    fs::rename(root.path().join("objects"), root.path().join("semantic_instance")).unwrap();
    fs::create_dir(root.path().join("semantic_class")).unwrap();
    let place = |kind: &str, frame: usize| {
        root.path()
            .join(format!("semantic_{kind}/semantic_{kind}_{frame}.png"))
    };
    let instance = root.path().join("semantic_instance/rgb_1.png");
    fs::rename(instance, place("instance", 1)).unwrap();
    write(root.path(), place("class", 0).to_str().unwrap(), 8, &[5; 48]);
    write(root.path(), place("class", 1).to_str().unwrap(), 8, &[7; 48]);
    let both = read(root.path(), &scene).unwrap();
    assert_eq!((both.labels.maps.len(), both.unmatched), (2, 0));
    assert_eq!(
        (both.labels.maps[0].labels(), both.labels.maps[0].objects()),
        (vec![5; 48], None)
    );
    assert_eq!(both.labels.maps[1].objects(), map.objects());
    assert_eq!(both.labels.maps[1].labels()[..4], [7, 6, 5, 5]);
    fs::remove_file(root.path().join("objects.json")).unwrap();
    let by_frame = read(root.path(), &scene).unwrap();
    assert!(by_frame.is_by_frame() && !both.is_by_frame());
    let map = &by_frame.labels.maps[1];
    assert_eq!(map.labels(), [7; 48]);
    assert_eq!(map.objects().unwrap(), NUMBERS.map(ObjectId::new).repeat(12));
}

#[test]
fn objects_that_cannot_be_used_are_refused_by_name() {
    let scene = wall(1, 8, 6);
    let refusal = |listed: Option<&str>, image: &[u16]| {
        let root = tempfile::tempdir().unwrap();
        write_objects(root.path(), "rgb_0.png");
        write(&root.path().join("objects"), "rgb_0.png", 8, image);
        if let Some(listed) = listed {
            fs::write(root.path().join("objects.json"), listed).unwrap();
        }
        let error = read(root.path(), &scene).unwrap_err();
        assert!(!error.contains('\n'), "{error}");
        error
    };
    let number = refusal(None, &[7; 48]);
    assert!(
        number.contains("number 7, which objects.json does not list"),
        "{number}"
    );
    for (listed, told) in [
        ("[{}]", "missing field"),
        (r#"[{"id": 0, "class_id": 5}]"#, "nonzero"),
        (r#"[{"id": 3, "class_id": 0}]"#, "object 3 is of class 0"),
        (
            r#"[{"id": 3, "class_id": 5}, {"id": 3, "class_id": 5}]"#,
            "object 3 is there twice",
        ),
        (
            r#"[{"id": 3, "class_id": 5, "class_name": "chair"}, {"id": 4, "class_id": 5, "class_name": "table"}]"#,
            "class 5 is called chair and table",
        ),
    ] {
        let error = refusal(Some(listed), &[3; 48]);
        assert!(error.contains("objects.json") && error.contains(told), "{error}");
    }
}

#[test]
fn what_a_file_says_to_be_transparent_says_nothing() {
    let scene = wall(1, 8, 6);
    let root = tempfile::tempdir().unwrap();
    let values: Vec<u8> = (0..48).map(|pixel| [3, 7, 5][pixel % 3]).collect();
    let expected: Vec<ClassId> = values
        .iter()
        .map(|&value| if value == 7 { VOID } else { value.into() })
        .collect();
    let opacity: [u8; 8] = [255, 255, 255, 255, 255, 128, 255, 0];
    for (color, transparency) in [
        (::png::ColorType::Grayscale, &[0, 7][..]),
        (::png::ColorType::Indexed, &opacity[..]),
    ] {
        let mut file = Vec::new();
        let mut encoder = ::png::Encoder::new(&mut file, 8, 6);
        encoder.set_color(color);
        if color == ::png::ColorType::Indexed {
            encoder.set_palette(vec![9; 3 * 8]);
        }
        encoder.set_trns(transparency.to_vec());
        let mut writer = encoder.write_header().unwrap();
        writer.write_image_data(&values).unwrap();
        writer.finish().unwrap();
        fs::write(root.path().join("rgb_0.png"), file).unwrap();
        let found = read(root.path(), &scene).unwrap();
        assert_eq!(found.labels.maps[0].labels(), expected, "{color:?}");
    }
}
