//! What holds for models that are spoilt.

use rand::{Rng, SeedableRng, rngs::SmallRng};

use super::*;

fn each_image(model: &mut Fixture, spoil: fn(&mut Image)) {
    model.images.iter_mut().for_each(spoil);
}

#[test]
fn models_that_cannot_be_used_are_refused_in_one_sentence() {
    type Spoil = fn(&mut Fixture);
    let cases: [(Spoil, &[&str]); 16] = [
        (
            |model| model.images[1].0 = "../b.png".into(),
            &["images.", "\"../b.png\"", "--outside-files"],
        ),
        (
            |model| model.images[1].0 = "x/../../b.png".into(),
            &["images.", "not a path inside"],
        ),
        (
            |model| model.images[1].0 = "/etc/passwd".into(),
            &["images.", "\"/etc/passwd\""],
        ),
        (
            |model| model.images[1].0 = ".".into(),
            &["images.", "\".\"", "not the path of a file"],
        ),
        (
            |model| model.images[1].0 = "a.png".into(),
            &["images.", "\"a.png\" twice"],
        ),
        (
            |model| model.images[1].0 = "a.jpg".into(),
            &["images.", "\"a.jpg\"", "one name"],
        ),
        (|model| model.images[2].2 = 8, &["images.", "camera 8"]),
        (|model| model.images.clear(), &["images.", "no images"]),
        (|model| model.cameras[1].0 = 1, &["cameras.", "camera 1 twice"]),
        (
            |model| model.cameras[1].2[0] = 0.0,
            &["cameras.", "camera 2", "focal"],
        ),
        (
            |model| model.cameras[1].2[2] = f64::NAN,
            &["cameras.", "camera 2", "finite"],
        ),
        (
            |model| {
                model.cameras[0].1 = 2;
                model.cameras[0].2[3] = f64::INFINITY;
            },
            &["cameras.", "camera 1", "distortion"],
        ),
        (
            |model| {
                // The image folds over within a pixel of its middle.
                model.cameras[0].1 = 2;
                model.cameras[0].2[3] = -1e6;
            },
            &["cameras.", "camera 1", "undone"],
        ),
        (
            |model| each_image(model, |image| image.1[..4].fill(0.0)),
            &["3 of 3", "quaternion"],
        ),
        (
            |model| each_image(model, |image| image.1[5] = f64::NAN),
            &["3 of 3", "finite"],
        ),
        (
            |model| each_image(model, |image| image.1[0] = f64::INFINITY),
            &["3 of 3", "quaternion"],
        ),
    ];
    let (root, place) = capture("sparse/0");
    for (spoil, parts) in cases {
        let mut fixture = Fixture::of_wall(1, Distortion::default());
        spoil(&mut fixture);
        write(&place, &fixture.binary());
        assert_refused(root.path(), parts);
        for (name, _) in fixture.binary() {
            fs::remove_file(place.join(name)).unwrap();
        }
        write(&place, &fixture.text());
        assert_refused(root.path(), parts);
    }
}

#[test]
fn camera_models_that_are_not_known_are_named() {
    let (root, place) = capture("sparse/0");
    let mut fixture = Fixture::of_wall(4, BARREL);
    for (model, name) in [
        (5, "OPENCV_FISHEYE"),
        (7, "FOV"),
        (77, "number 77"),
        (-1, "number -1"),
    ] {
        fixture.cameras[1].1 = model;
        write(&place, &fixture.binary());
        assert_refused(root.path(), &["cameras.bin", "camera 2", name, "undistort"]);
    }
    for (name, _) in fixture.binary() {
        fs::remove_file(place.join(name)).unwrap();
    }
    let files = Fixture::of_wall(4, BARREL).text();
    for (line, parts) in [
        ("2 FOV 32 24 1 2 3 4 5", ["camera 2", "FOV"]),
        ("2 PINHOLE 32 24 1 2 3", ["camera 2", "3 parameters instead of 4"]),
        ("2 PINHOLE 32 24 1 2 3 x", ["line 5", "\"x\""]),
        ("2 PINHOLE 32", ["line 5", "height"]),
        ("2 PINHOLE 0 24 1 2 3 4", ["camera 2", "0 x 24"]),
    ] {
        write(&place, &files);
        fs::write(place.join("cameras.txt"), format!("{}{line}\n", files[0].1)).unwrap();
        assert_refused(root.path(), &[&["cameras.txt"], parts.as_slice()].concat());
    }
    let images = files[1].1.trim_end();
    let cut = images.rfind('\n').unwrap();
    for (text, part) in [
        (images[..cut].to_owned(), "no line with its points"),
        (images.replace(" -1 ", " one "), "\"one\""),
        (images[..images.len() - 2].to_owned(), "line 8"),
    ] {
        write(&place, &files);
        fs::write(place.join("images.txt"), text).unwrap();
        assert_refused(root.path(), &["images.txt", part]);
    }
}

#[test]
fn every_truncated_or_lengthened_binary_file_is_named() {
    let (root, place) = capture("sparse/0");
    let files = Fixture::of_wall(4, BARREL).binary();
    for (name, whole) in &files {
        write(&place, &files);
        for length in (0..whole.len()).step_by(5) {
            fs::write(place.join(name), &whole[..length]).unwrap();
            assert_refused(root.path(), &[name, "copy the model again"]);
        }
        fs::write(place.join(name), [whole.as_slice(), &[0]].concat()).unwrap();
        assert_refused(root.path(), &[name, "1 bytes follow"]);
        for count in [u64::MAX, 1 << 40, 1_000] {
            let mut spoilt = whole.clone();
            spoilt[..8].copy_from_slice(&count.to_le_bytes());
            fs::write(place.join(name), spoilt).unwrap();
            assert_refused(root.path(), &[name, "truncated"]);
        }
    }
    write(&place, &files);
    fs::remove_file(place.join("images.bin")).unwrap();
    assert_refused(root.path(), &["images.bin", "cannot be read"]);
}

#[test]
fn no_spoilt_byte_is_a_panic() {
    let (root, place) = capture("sparse/0");
    let files = Fixture::of_wall(4, BARREL).binary();
    let mut rng = SmallRng::seed_from_u64(5);
    for (name, whole) in &files {
        write(&place, &files);
        for _ in 0..100 {
            let mut spoilt = whole.clone();
            for _ in 0..rng.random_range(1..4) {
                let at = rng.random_range(0..spoilt.len());
                spoilt[at] = rng.random();
            }
            fs::write(place.join(name), spoilt).unwrap();
            if let Ok(scene) = open(root.path()) {
                let bounds = scene.bounds();
                assert!(bounds.min.is_finite() && bounds.max.is_finite());
            }
        }
    }
}
