//! What holds for models that are spoilt.

use super::*;

/// The model of the wall with one change, which names images and cameras from 1.
fn changed(change: &str) -> Fixture {
    let mut model = Fixture::of_wall(1);
    let number = |word: &str| -> f64 { word.parse().unwrap() };
    let place = |word: &str| -> usize { word.parse::<usize>().unwrap() - 1 };
    match change.split(' ').collect::<Vec<&str>>()[..] {
        ["images", "none"] => model.images.clear(),
        ["images", "quaternion", value] => {
            let turns = model.images.iter_mut().map(|image| &mut image.1[..4]);
            turns.for_each(|turn| turn.fill(number(value)));
        }
        ["images", "y", value] => model
            .images
            .iter_mut()
            .for_each(|image| image.1[5] = number(value)),
        ["image", image, "name", name] => model.images[place(image)].0 = name.to_owned(),
        ["image", image, "camera", id] => model.images[place(image)].2 = id.parse().unwrap(),
        ["camera", camera, "id", id] => model.cameras[place(camera)].0 = id.parse().unwrap(),
        ["camera", camera, "focal", value] => model.cameras[place(camera)].2[0] = number(value),
        ["camera", camera, "cx", value] => model.cameras[place(camera)].2[2] = number(value),
        ["camera", camera, "k1", value] => {
            model.cameras[place(camera)].1 = 2;
            model.cameras[place(camera)].2[3] = number(value);
        }
        _ => panic!("{change}"),
    }
    model
}

/// What opening a capture with a changed model says. With a k1 of -1e6 the image folds over within a pixel of its middle.
const MODELS: &str = r#"
image 2 name ../b.png       | refused | images. & "../b.png" & --outside-files
image 2 name x/../../b.png  | refused | images. & not a path inside
image 2 name /etc/passwd    | refused | images. & "/etc/passwd"
image 2 name .              | refused | images. & "." & not the path of a file
image 2 name a.png          | refused | images. & "a.png" twice
image 2 name a.jpg          | refused | images. & "a.jpg" & one name
image 3 camera 8            | refused | images. & camera 8
images none                 | refused | images. & no images
images quaternion 0         | refused | 3 of 3 & quaternion
images quaternion inf       | refused | 3 of 3 & quaternion
images y nan                | refused | 3 of 3 & finite
camera 2 id 1               | refused | cameras. & camera 1 twice
camera 2 focal 0            | refused | cameras. & camera 2 & focal
camera 2 cx nan             | refused | cameras. & camera 2 & finite
camera 1 k1 inf             | refused | cameras. & camera 1 & distortion
camera 1 k1 -1e6            | refused | cameras. & camera 1 & undone
"#;

#[test]
fn models_that_cannot_be_used_are_refused_in_one_sentence_whichever_way_they_are_written() {
    let without_model = || capture::<&str>("sparse/0", &[]);
    let as_binary = |folder: &Path, change: &str| write(&folder.join("sparse/0"), &changed(change).binary());
    let as_text = |folder: &Path, change: &str| write(&folder.join("sparse/0"), &changed(change).text());
    check_changes(without_model, as_binary, MODELS);
    check_changes(without_model, as_text, MODELS);
}

#[test]
fn camera_models_that_are_not_known_are_named() {
    let mut fixture = Fixture::of_wall(4);
    let (root, folder) = capture("sparse/0", &fixture.binary());
    let place = folder.join("sparse/0");
    for (model, name) in [
        (7, "FOV"),
        (10, "THIN_PRISM_FISHEYE"),
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
    let files = Fixture::of_wall(4).text();
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
    let files = Fixture::of_wall(4).binary();
    let (root, folder) = capture("sparse/0", &files);
    let place = folder.join("sparse/0");
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
