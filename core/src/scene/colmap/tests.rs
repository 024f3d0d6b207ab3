//! What holds for captures with a model.

mod refused;

use std::fmt::Write as _;
use std::fs;

use glam::{DVec3, Vec3};
use tempfile::TempDir;

use super::model::CAMERA_MODELS;
use super::*;
use crate::scene::testing::{
    assert_outside, assert_refused, change_files, check_changes, far_away, open, opened,
    opened_without_depth, stems, wall,
};
use crate::scene::{Distortion, Lens, SparsePoint};

const WIDTH: u32 = 32;
const HEIGHT: u32 = 24;
/// Units of the model in a metre of the wall.
const SCALE: f64 = 7.0;
const BARREL: [f64; 4] = [-0.12, 0.01, 0.001, -0.002];

/// Where an image shows a point: x, y and the point's id, or -1.
type Place = (f64, f64, i64);

/// Name, quaternion and translation, camera, places.
type Image = (String, [f64; 7], u32, Vec<Place>);

/// A model as a person would write it down.
#[derive(Clone)]
struct Fixture {
    /// (id, camera model, parameters)
    cameras: Vec<(u32, i32, Vec<f64>)>,
    images: Vec<Image>,
    /// (id, position, error, views)
    points: Vec<(u64, DVec3, f64, usize)>,
}

impl Fixture {
    /// The wall of three cameras of the given model, and points on it that all of them see.
    fn of_wall(model: i32) -> Self {
        let scene = wall(3, WIDTH, HEIGHT);
        let [k1, k2, p1, p2] = BARREL;
        let camera = scene.frames[0].camera;
        let (f, cx, cy) = (f64::from(camera.fx), f64::from(camera.cx), f64::from(camera.cy));
        let (parameters, distortion) = match model {
            0 => (vec![f, cx, cy], Distortion::default()),
            1 => (vec![f, f, cx, cy], Distortion::default()),
            // Alone it would fold the corners over.
            2 => (vec![f, cx, cy, 0.5 * k1], Distortion::opencv([0.5 * k1])),
            3 => (vec![f, cx, cy, k1, k2], Distortion::opencv([k1, k2])),
            4 => (vec![f, f, cx, cy, k1, k2, p1, p2], Distortion::opencv(BARREL)),
            5 => (
                vec![f, f, cx, cy, 0.3, -0.01, 0.002, -0.0005],
                Distortion::fisheye([0.3, -0.01, 0.002, -0.0005]),
            ),
            6 => (
                vec![f, f, cx, cy, k1, k2, p1, p2, 0.05, 0.03, 0.01, 0.001],
                Distortion::opencv([k1, k2, p1, p2, 0.05, 0.03, 0.01, 0.001]),
            ),
            8 => (vec![f, cx, cy, 0.3], Distortion::fisheye([0.3])),
            _ => (vec![f, cx, cy, 0.3, 0.01], Distortion::fisheye([0.3, 0.01])),
        };
        let lens = Lens {
            image: camera,
            distortion,
        };
        let (turn, shift) = far_away();
        let local = |column: u32, row: u32| DVec3::new(f64::from(column) - 1.5, f64::from(row) - 1.0, 2.0);
        let grid = || (0..4).flat_map(|column| (0..3).map(move |row| local(column, row)));
        let images = (0..3).map(|number| {
            let centre = scene.frames[number].center().as_dvec3();
            let place = |(id, point): (i64, DVec3)| {
                let seen = point - centre;
                let (x, y) = lens.place(seen.x / seen.z, seen.y / seen.z).unwrap();
                (x, y, id)
            };
            let mut places: Vec<Place> = (1..).zip(grid()).map(place).collect();
            places.insert(1, (3.0, 4.0, -1));
            let rotation = turn.inverse();
            let translation = -(rotation * (turn * centre * SCALE + shift));
            let [x, y, z, w] = rotation.to_array();
            let [tx, ty, tz] = translation.to_array();
            // Not of unit length: it is made so.
            let pose = [2.0 * w, 2.0 * x, 2.0 * y, 2.0 * z, tx, ty, tz];
            let name = ["view c.png", "b.png", "a.png"][number].to_owned();
            (name, pose, 1 + number as u32, places)
        });
        Self {
            cameras: (1..=3).map(|id| (id, model, parameters.clone())).collect(),
            images: images.collect(),
            points: (1..)
                .zip(grid())
                .map(|(id, point)| (id, turn * point * SCALE + shift, 0.5, 3))
                .collect(),
        }
    }

    fn binary(&self) -> [(&'static str, Vec<u8>); 3] {
        let mut cameras = (self.cameras.len() as u64).to_le_bytes().to_vec();
        for (id, model, parameters) in &self.cameras {
            cameras.extend(id.to_le_bytes());
            cameras.extend(model.to_le_bytes());
            cameras.extend(u64::from(WIDTH).to_le_bytes());
            cameras.extend(u64::from(HEIGHT).to_le_bytes());
            cameras.extend(parameters.iter().flat_map(|value| value.to_le_bytes()));
        }
        let mut images = (self.images.len() as u64).to_le_bytes().to_vec();
        for (id, (name, pose, camera, places)) in (1_u32..).zip(&self.images) {
            images.extend(id.to_le_bytes());
            images.extend(pose.iter().flat_map(|value| value.to_le_bytes()));
            images.extend(camera.to_le_bytes());
            images.extend(name.bytes().chain([0]));
            images.extend((places.len() as u64).to_le_bytes());
            for (x, y, point) in places {
                images.extend([x.to_le_bytes(), y.to_le_bytes(), point.to_le_bytes()].concat());
            }
        }
        let mut points = (self.points.len() as u64).to_le_bytes().to_vec();
        for (id, position, error, views) in &self.points {
            points.extend(id.to_le_bytes());
            points.extend(position.to_array().iter().flat_map(|value| value.to_le_bytes()));
            points.extend([9, 9, 9]);
            points.extend(error.to_le_bytes());
            points.extend((*views as u64).to_le_bytes());
            points.extend(vec![1; 8 * views]);
        }
        [
            ("cameras.bin", cameras),
            ("images.bin", images),
            ("points3D.bin", points),
        ]
    }

    fn text(&self) -> [(&'static str, String); 3] {
        let (mut cameras, mut images, mut points) =
            ("# cameras\n".to_owned(), "# images\n\n".to_owned(), String::new());
        let joined = |values: &[f64]| values.iter().map(f64::to_string).collect::<Vec<_>>().join(" ");
        for (id, model, parameters) in &self.cameras {
            let (name, _) = CAMERA_MODELS[*model as usize];
            writeln!(cameras, "{id} {name} {WIDTH} {HEIGHT} {}", joined(parameters)).unwrap();
        }
        for (id, (name, pose, camera, places)) in (1..).zip(&self.images) {
            writeln!(images, "{id} {} {camera} {name}", joined(pose)).unwrap();
            let place = |(x, y, point): &Place| format!("{x} {y} {point}");
            let places: Vec<String> = places.iter().map(place).collect();
            writeln!(images, "{}", places.join(" ")).unwrap();
        }
        for (id, position, error, views) in &self.points {
            let (position, track) = (joined(&position.to_array()), " 1 0".repeat(*views));
            writeln!(points, "{id} {position} 9 9 9 {error}{track}").unwrap();
        }
        [
            ("cameras.txt", cameras),
            ("images.txt", images),
            ("points3D.txt", points),
        ]
    }
}

/// A capture on disk with a model in the folder `place`.
fn capture<T: AsRef<[u8]>>(place: &str, model: &[(&'static str, T)]) -> (TempDir, PathBuf) {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().to_path_buf();
    fs::create_dir(folder.join("images")).unwrap();
    let scene = wall(3, WIDTH, HEIGHT);
    for (frame, name) in scene.frames.iter().zip(["view c.png", "b.png", "a.png"]) {
        let path = folder.join("images").join(name);
        image::save_buffer(path, frame.color().bytes(), WIDTH, HEIGHT, image::ColorType::Rgb8).unwrap();
    }
    write(&folder.join(place), model);
    (root, folder)
}

/// A capture of three plain cameras, with its model in `sparse/0`.
fn plain() -> (TempDir, PathBuf) {
    capture("sparse/0", &Fixture::of_wall(1).binary())
}

fn write<T: AsRef<[u8]>>(place: &Path, files: &[(&'static str, T)]) {
    fs::create_dir_all(place).unwrap();
    for (name, content) in files {
        fs::write(place.join(name), content).unwrap();
    }
}

#[test]
fn frames_and_points_lie_where_the_model_says_whichever_way_it_is_written() {
    for model in [0, 1, 2, 3, 4, 5, 6, 8, 9] {
        let fixture = Fixture::of_wall(model);
        let (as_binary, _) = capture("sparse/0", &fixture.binary());
        let (as_text, _) = capture("colmap/sparse/0", &fixture.text());
        for folder in [&as_binary, &as_text] {
            let scene = opened(folder.path());
            assert_eq!(scene.format, "COLMAP");
            assert_eq!(stems(&scene), ["a", "b", "view c"]);
            let (turn, shift) = far_away();
            let mut depths = Vec::new();
            for (frame, number) in scene.frames.iter().zip([2, 1, 0]) {
                let centre = wall(3, WIDTH, HEIGHT).frames[number].center().as_dvec3();
                let gap = scene.to_capture(frame.center()) - (turn * centre * SCALE + shift);
                assert!(gap.length() < 1e-5 * SCALE, "{gap}");
                assert_eq!(frame.image().width, WIDTH);
                assert_eq!(frame.lens.is_some(), model >= 2);
                assert_eq!(frame.points.len(), fixture.points.len());
                for point in &frame.points {
                    assert!(point.error < 1e-3);
                    depths.push(point.length);
                    let seen = frame.place(point.pixel as usize, point.length);
                    // A ray goes through the centre of a pixel, up to 0.71 pixels from the point.
                    let pixel = 0.75 * point.length / frame.camera.fx;
                    let nearest = fixture
                        .points
                        .iter()
                        .map(|(_, position, ..)| (scene.to_capture(seen) - *position).length() / scene.unit);
                    assert!(nearest.fold(f64::INFINITY, f64::min) < f64::from(pixel));
                }
            }
            depths.sort_by(f32::total_cmp);
            assert!((depths[depths.len() / 2] - 2.5).abs() < 1e-4);
        }
    }
}

#[test]
fn bent_images_lead_back_to_their_own_pixels_and_masks_hide_pixels_and_points_under_either_name() {
    let fixture = Fixture::of_wall(4);
    let (root, _) = capture("sparse/0", &fixture.binary());
    let whole = opened(root.path());
    fs::create_dir(root.path().join("masks")).unwrap();
    let mask = |x, _| image::Luma([if x < WIDTH / 2 { 0 } else { 255 }]);
    let mask = image::GrayImage::from_fn(WIDTH, HEIGHT, mask);
    for name in ["a.png.png", "b.png"] {
        mask.save(root.path().join("masks").join(name)).unwrap();
    }
    let scene = opened(root.path());
    for frame in &scene.frames[..2] {
        let pixels = 0..frame.camera.pixels();
        let outside: Vec<usize> = pixels.filter(|&index| !whole.frames[0].is_valid(index)).collect();
        assert!(outside.iter().all(|&index| !frame.is_valid(index)));
        // Bent inwards, the middle of the border is nearer to the centre than the corners are.
        assert!(outside.contains(&((frame.camera.height / 2 * frame.camera.width) as usize)));
        assert_eq!(frame.to_image([0, frame.camera.height / 2]), None);
        for row in 0..HEIGHT {
            for column in 0..WIDTH {
                let [x, y] = frame.of_image([column, row]).unwrap();
                let index = (y * frame.camera.width + x) as usize;
                let [shown, back] = frame.to_image([x, y]).unwrap();
                assert!(shown.abs_diff(column) <= 1 && back.abs_diff(row) <= 1);
                assert_eq!(frame.is_valid(index), shown >= WIDTH / 2);
            }
        }
        let is_shown = |point: &SparsePoint| frame.is_valid(point.pixel as usize);
        assert!(frame.points.iter().all(is_shown));
        assert!(!frame.points.is_empty() && frame.points.len() < fixture.points.len());
    }
    let (before, after) = (&whole.frames[2], &scene.frames[2]);
    assert_eq!((&before.color(), &before.points), (&after.color(), &after.points));
}

#[test]
fn the_box_is_around_the_points_and_no_depth_means_no_points() {
    let (root, _) = plain();
    let scene = opened(root.path());
    assert!(scene.frames.iter().any(|frame| !frame.points.is_empty()));
    let bounds = scene.bounds();
    for frame in &scene.frames {
        for point in &frame.points {
            let place = frame.place(point.pixel as usize, point.length);
            assert!(place.cmpge(bounds.min).all() && place.cmple(bounds.max).all());
        }
    }
    let without = opened_without_depth(root.path());
    assert!(without.frames.iter().all(|frame| frame.points.is_empty()));
    assert_eq!(without.unit, scene.unit);
    assert!(without.bounds().size().max_element() > bounds.size().max_element());
}

#[test]
fn points_that_few_images_agree_on_do_not_count() {
    let mut fixture = Fixture::of_wall(1);
    fixture.points[0].3 = 2;
    fixture.points[1].2 = 2.5;
    // Seen five pixels beside its projection by the first image.
    fixture.images[0].3[4].0 += 5.0;
    fixture.points.remove(5);
    let (root, _) = capture("sparse/0", &fixture.binary());
    let scene = open(root.path()).unwrap();
    let points: Vec<usize> = scene.frames.iter().map(|frame| frame.points.len()).collect();
    assert_eq!(points, [9, 9, 8]);
}

#[test]
fn points_that_miss_their_images_are_counted_and_warned_of() {
    let mut fixture = Fixture::of_wall(4);
    let (root, folder) = capture("sparse/0", &fixture.binary());
    let place = folder.join("sparse/0");
    let scene = open(root.path()).unwrap();
    let errors = scene.point_errors.unwrap();
    let shown: usize = scene.frames.iter().map(|frame| frame.points.len()).sum();
    assert_eq!(errors.count, shown);
    assert!(errors.p90_px < 1e-3, "{errors:?}");
    for image in &mut fixture.images {
        image.3.iter_mut().for_each(|seen| seen.0 += 5.0);
    }
    write(&place, &fixture.binary());
    let scene = open(root.path()).unwrap();
    assert!((scene.point_errors.unwrap().median_px - 5.0).abs() < 1e-3);
    let warning = &scene.warnings[0];
    assert!(warning.contains("by 5.0 pixels"), "{warning}");
    // Half a turn of the first camera around its vertical axis: all of its points are behind it.
    let [w, x, y, z, tx, ty, tz] = fixture.images[0].1;
    fixture.images[0].1 = [-y, z, w, -x, -tx, ty, -tz];
    write(&place, &fixture.binary());
    let behind = open(root.path()).unwrap().point_errors.unwrap();
    assert_eq!(behind.count, errors.count);
    assert!(behind.p90_px > 20.0, "{behind:?}");
}

#[test]
fn without_points_the_cameras_span_two_metres() {
    let (_root, folder) = plain();
    change_files(&folder, "remove sparse/0/points3D.bin");
    let scene = open(&folder).unwrap();
    let centres = scene.frames.iter().map(|frame| frame.center());
    let low = centres.clone().fold(Vec3::INFINITY, Vec3::min);
    let high = centres.fold(Vec3::NEG_INFINITY, Vec3::max);
    assert!(((high - low).max_element() - 2.0).abs() < 1e-4);
}

/// What opening a capture of three plain cameras says after changes to its files.
const CHANGES: &str = r#"
remove sparse/0/points3D.bin | 3 | no points
remove images/b.png          | 2 | "b.png" & no such file
rgb8 images/b.png 4x3        | 2 | "b.png" & 4x3 instead of 32x24
spoil images/b.png           | 2 | b.png & cannot be used
remove images                | refused | images & 3 of the model's 3 & no such file & "a.png"
"#;

#[test]
fn faults_are_warned_of_where_they_are_few_and_refused_by_the_file_otherwise() {
    check_changes(plain, change_files, CHANGES);
}

#[test]
fn a_folder_named_rgb_beside_the_images_does_not_make_it_a_replica() {
    let (_root, folder) = plain();
    fs::create_dir(folder.join("rgb")).unwrap();
    assert_eq!(opened(&folder).format, FORMAT.name);
}

#[test]
fn images_in_several_folders_keep_their_names_apart() {
    let (root, folder) = plain();
    let mut fixture = Fixture::of_wall(1);
    for (image, side) in fixture.images.iter_mut().zip(["left", "right", "up"]) {
        let images = folder.join("images");
        fs::create_dir(images.join(side)).unwrap();
        let name = format!("{side}/1.png");
        fs::rename(images.join(&image.0), images.join(&name)).unwrap();
        image.0 = name;
    }
    write(&folder.join("sparse/0"), &fixture.binary());
    assert_eq!(stems(&opened(root.path())), ["left_1", "right_1", "up_1"]);
}

#[test]
fn images_outside_the_folder_are_read_where_that_is_allowed() {
    let (root, folder) = plain();
    let mut fixture = Fixture::of_wall(1);
    let outside = tempfile::tempdir().unwrap();
    let images = root.path().join("images");
    fs::rename(images.join("a.png"), outside.path().join("a.png")).unwrap();
    fs::rename(images.join("b.png"), root.path().join("b.png")).unwrap();
    fixture.images[2].0 = outside.path().join("a.png").to_str().unwrap().to_owned();
    fixture.images[1].0 = "../b.png".to_owned();
    write(&folder.join("sparse/0"), &fixture.binary());
    assert_outside(root.path(), &["images.bin"], 3);
}

#[test]
fn of_several_models_that_with_most_images_is_read_and_named() {
    let (root, folder) = plain();
    let whole = Fixture::of_wall(1);
    let mut part = whole.clone();
    part.images.truncate(1);
    write(&folder.join("sparse/0"), &part.binary());
    write(&folder.join("sparse/2"), &part.binary());
    write(&folder.join("sparse/10"), &whole.text());
    let scene = opened(root.path());
    assert_eq!(scene.frames.len(), 3);
    assert!(
        scene.notes[0].contains("text model in sparse/10"),
        "{:?}",
        scene.notes
    );
    let others = "beside sparse/0 with 1 images, sparse/2 with 1 images";
    assert!(scene.notes[0].contains(others), "{:?}", scene.notes);
    // Of like ones the first; and one without a number counts, too.
    write(&folder.join("sparse/0"), &whole.binary());
    assert!(opened(root.path()).notes[0].starts_with("binary model in sparse/0: 3 images"));
    write(&folder.join("sparse"), &whole.binary());
    fs::remove_dir_all(folder.join("sparse/10")).unwrap();
    fs::remove_dir_all(folder.join("sparse/0")).unwrap();
    assert!(opened(root.path()).notes[0].starts_with("binary model in sparse: 3 images"));
}
