//! The commands do what their description says, from files to files.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;
use std::path::Path;

use inplace_core::field::Preset;
use inplace_core::project::Project;
use inplace_core::scene::{OpenOptions, SceneSource};
use inplace_core::session::{Client, ModelState, SessionOptions};
use inplace_lab::ConfusionMatrix;
use inplace_tests::{
    OnDisk, Running, Small, class_ids, contents_of, info, inplace, json, label, miou_with_clicks, succeed,
};
use serde_json::Value;

/// Seconds that a small scene may take.
const BUDGET: [&str; 2] = ["--budget", "6"];
/// What the labels of the small scene reach at least, tiny classes included; one class everywhere gives 0.02.
const MIOU_WITH_DEPTH: f64 = 0.3;
const MIOU_WITHOUT_DEPTH: f64 = 0.05;

/// A project of the capture with the strokes, in `room.inplace`.
fn project(disk: &OnDisk) -> Project {
    let contents = contents_of(&disk.path("room"), Some(&disk.path("strokes.json")));
    Project::create(&disk.path("room.inplace"), &contents).unwrap()
}

/// What a field has learnt of the capture after a few steps.
fn trained(disk: &OnDisk) -> ModelState {
    let options = SessionOptions {
        source: SceneSource::Folder(disk.path("room")),
        open: OpenOptions::default(),
        preset: Preset::Auto,
        threads: 2,
        seed: 0,
        views: false,
        state: None,
    };
    let mut client = Client::start(options);
    while client.status().steps < 20 {
        client.next(None).unwrap();
    }
    ModelState::clone(&client.saved().unwrap())
}

/// Every frame has its three images, in size and kind as documented, and nothing else lies there.
fn assert_complete(out: &Path) {
    let frames = &Small::get().scene.frames;
    for folder in ["labels", "entropy", "color"] {
        assert_eq!(fs::read_dir(out.join(folder)).unwrap().count(), frames.len());
        for frame in frames {
            let image = image::open(out.join(folder).join(format!("{}.png", frame.stem))).unwrap();
            assert_eq!(image.width(), frame.camera.width);
            assert_eq!(image.height(), frame.camera.height);
            let kind = match folder {
                "labels" => image::ColorType::L8,
                "entropy" => image::ColorType::L16,
                _ => image::ColorType::Rgb8,
            };
            assert_eq!(image.color(), kind, "{folder}");
        }
    }
}

/// Every clicked pixel carries its class; returns the agreement of all pixels with the truth.
fn assert_clicks_hold(out: &Path) -> f64 {
    let small = Small::get();
    let stems = small.scene.frames.iter().map(|frame| frame.stem.as_str());
    let truth = stems.zip(small.truth.iter().cloned());
    miou_with_clicks(out, (64, 48), &small.clicks(), truth)
}

#[test]
fn the_demo_can_be_looked_at_and_written_as_a_capture() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("demo");
    succeed(inplace().arg("demo").arg("--out").arg(&folder));
    let facts = info(&folder, &[]);
    assert_eq!(facts["format"], "Replica");
    assert_eq!([&facts["width"], &facts["height"]], [320, 240]);
    for count in ["frames", "frames_with_depth", "frames_with_labels"] {
        assert_eq!(facts[count], 60, "{count}");
    }
    assert!(facts["depth_coverage"].as_f64().unwrap() > 0.9);
    assert_eq!(facts["warnings"].as_array().unwrap().len(), 0);
    let corners = &facts["reprojection"]["corners"];
    assert_eq!(corners["lifted_by_depth"], true, "{facts}");
    assert!(corners["median_px"].as_f64().unwrap() < 1.0, "{facts}");
    let again = Running::to_the_end(inplace().arg("demo").arg("--out").arg(&folder));
    assert_eq!(again.code, Some(1), "a folder with files is not overwritten");

    let shown = succeed(inplace().args(["info", "demo"]));
    assert_eq!(shown.stderr, "");
    for fact in [
        "60 of 320 x 240",
        "depth",
        "labels",
        "bounds",
        "reprojection by depth",
    ] {
        assert!(shown.stdout.contains(fact), "{fact} is not in: {}", shown.stdout);
    }
}

#[test]
fn label_images_alone_label_every_frame_and_a_stroke_covers_them() {
    let small = Small::get();
    let on_disk = OnDisk::default();
    let images = on_disk.path("predictions");
    fs::create_dir(&images).unwrap();
    for (frame, truth) in small.scene.frames.iter().zip(&small.truth).step_by(2) {
        let ids: Vec<u8> = truth.iter().map(|&id| u8::try_from(id).unwrap()).collect();
        let image = image::GrayImage::from_raw(frame.camera.width, frame.camera.height, ids).unwrap();
        image.save(images.join(format!("{}.png", frame.stem))).unwrap();
    }
    // The same classes as those of the strokes.
    let classes = small.strokes()["classes"].to_string();
    fs::write(images.join("classes.json"), classes).unwrap();
    let out = on_disk.path("from-images");
    let mut command = label(&on_disk.path("room"), &out);
    succeed(command.arg("--import").arg(&images).args(BUDGET));
    assert_complete(&out);
    let report = json(&out.join("report.json"));
    let expected = small.scene.frames.len().div_ceil(2);
    assert_eq!(report["strokes"], 0);
    assert_eq!(report["imported_images"], expected);
    assert_eq!(report["imported_trust"], 0.5);
    let mut matrix = ConfusionMatrix::default();
    for (frame, truth) in small.scene.frames.iter().zip(&small.truth).skip(1).step_by(2) {
        let (_, _, labels) = class_ids(&out.join("labels").join(format!("{}.png", frame.stem)));
        matrix.add(truth, &labels).unwrap();
    }
    let accuracy = matrix.scores().unwrap().total_accuracy;
    assert!(accuracy > 0.8, "{accuracy}");

    // The colours that were written are read again by the list beside them, and right under the strokes.
    let colors = out.join("color");
    let import = ["--import", colors.to_str().unwrap(), "--trust", "1"];
    let trusted = succeed(on_disk.label(&import).args(BUDGET));
    assert_eq!(trusted.stderr, "");
    assert_clicks_hold(&on_disk.path("out"));
    assert_eq!(json(&on_disk.path("out/report.json"))["imported_trust"], 1.0);
    for (index, frame) in small.scene.frames.iter().enumerate() {
        let name = format!("labels/{}.png", frame.stem);
        let (width, _, before) = class_ids(&out.join(&name));
        let (_, _, after) = class_ids(&on_disk.path("out").join(&name));
        let clicked: Vec<usize> = small
            .clicks()
            .iter()
            .filter(|click| click.frame == index)
            .map(|click| (click.pixel[1] * width + click.pixel[0]) as usize)
            .collect();
        // Of void pixels nothing is said: there the maps may say more.
        let said = |&pixel: &usize| before[pixel] != 0 && !clicked.contains(&pixel);
        let others = (0..before.len()).filter(said);
        let changed = others.filter(|&pixel| before[pixel] != after[pixel]).count();
        assert_eq!(changed, 0, "{name}");
    }
}

#[test]
fn a_few_clicks_label_every_pixel_of_every_frame() {
    let disk = OnDisk::default();
    let options = ["--json", "--seed", "7", "--threads", "2"];
    let outcome = succeed(disk.label(&options).args(BUDGET));
    assert_eq!(outcome.stderr, "");
    let out = disk.path("out");
    assert_complete(&out);
    let miou = assert_clicks_hold(&out);
    println!("mIoU with depth: {miou:.3}");
    assert!(miou > MIOU_WITH_DEPTH, "{miou}");

    let classes = json(&out.join("classes.json"));
    assert_eq!(classes, Small::get().strokes()["classes"]);
    let report = json(&out.join("report.json"));
    assert_eq!(report, serde_json::from_str::<Value>(&outcome.stdout).unwrap());
    assert_eq!(report["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(report["strokes"], Small::get().clicks().len());
    assert_eq!(
        [&report["frames"], &report["seed"], &report["threads"]],
        [10, 7, 2]
    );
    let phases = report["wall_s"].as_object().unwrap();
    for phase in ["load", "geometry", "semantics", "render", "write"] {
        assert!(phases[phase].as_f64().unwrap() >= 0.0, "{phase}");
    }
    for figure in ["peak_memory_bytes", "parameters", "mean_entropy"] {
        assert!(report[figure].as_f64().unwrap() > 0.0, "{figure}");
    }
    for key in ["scene", "preset", "capacity", "held_out_psnr_db", "depth_error_m"] {
        assert!(report.get(key).is_some(), "{key}");
    }
}

#[test]
fn the_published_network_labels_every_frame_within_its_budget() {
    let disk = OnDisk::default();
    succeed(disk.label(&["--preset", "reference"]).args(BUDGET));
    assert_complete(&disk.path("out"));
    let report = json(&disk.path("out").join("report.json"));
    assert_eq!(report["preset"], "reference");
    assert!(report["map_stride"].as_u64().unwrap() <= 128);
    // Coarse and fine, with as many logits as there are classes.
    let classes = Small::get().strokes()["classes"].as_array().unwrap().len();
    assert_eq!(report["parameters"], 2 * (628_740 + 129 * classes));
    for phase in ["geometry", "render"] {
        assert!(report["wall_s"][phase].as_f64().unwrap() > 0.0, "{phase}");
    }
}

#[test]
fn colour_alone_is_enough_to_finish() {
    let disk = OnDisk::default();
    succeed(disk.label(&["--no-depth"]).args(BUDGET));
    assert_complete(&disk.path("out"));
    let miou = assert_clicks_hold(&disk.path("out"));
    println!("mIoU without depth: {miou:.3}");
    assert!(miou > MIOU_WITHOUT_DEPTH, "{miou}");
}

#[test]
fn a_trained_project_is_exported_twice_to_the_same_bytes_and_along_a_path_as_a_capture() {
    let disk = OnDisk::default();
    project(&disk).save_model(&trained(&disk)).unwrap();
    let export = |out: &str, more: &[&str]| {
        let mut command = inplace();
        command.arg("export").arg(disk.path("room.inplace"));
        succeed(command.arg("--out").arg(disk.path(out)).args(more))
    };
    let ids = ["--ids", "NYU-40"];
    export("first", &ids);
    assert_complete(&disk.path("first"));
    let again = export("first", &ids).stdout;
    assert!(again.contains("0 files written, 31 unchanged"), "{again}");
    let second = export("second", &ids).stdout;
    assert!(second.contains("31 files written, 0 unchanged"), "{second}");

    let path = disk.path("room/traj_w_c.txt");
    let views = export("views", &["--trajectory", path.to_str().unwrap()]);
    assert!(views.stdout.contains("rendered 10 views"), "{views:?}");
    assert!(views.stderr.contains("not trained to the end"), "{views:?}");
    let facts = info(&disk.path("views"), &[]);
    assert_eq!(facts["format"], "Replica");
    assert_eq!(facts["frames"], 10);
    assert_eq!(facts["warnings"].as_array().unwrap().len(), 0);
    assert!(disk.path("views/labels/view_9.png").is_file());
}

#[test]
fn a_project_is_labelled_from_its_own_strokes() {
    let disk = OnDisk::default();
    // As of another version of the program: it is left out, and the strokes count.
    let foreign = ModelState {
        steps: 5,
        tensors: vec![1, 2, 3],
    };
    project(&disk).save_model(&foreign).unwrap();
    let outcome = succeed(label(&disk.path("room.inplace"), &disk.path("out")).args(BUDGET));
    assert!(outcome.stdout.contains("labelled 10 frames"), "{outcome:?}");
    assert!(outcome.stderr.contains("training starts anew"), "{outcome:?}");
    assert_complete(&disk.path("out"));
    assert!(assert_clicks_hold(&disk.path("out")) > MIOU_WITH_DEPTH);
}

#[test]
fn several_rooms_share_the_frames() {
    let root = tempfile::tempdir().unwrap();
    let length = |rooms: &str| {
        let folder = root.path().join(rooms);
        let mut demo = inplace();
        demo.args([
            "demo", "--frames", "8", "--size", "64x48", "--rooms", rooms, "--out",
        ]);
        succeed(demo.arg(&folder));
        let facts = info(&folder, &[]);
        assert_eq!(facts["frames"], 8);
        facts["bounds_max_m"][0].as_f64().unwrap() - facts["bounds_min_m"][0].as_f64().unwrap()
    };
    assert!(length("2") > 1.5 * length("1"));
}
