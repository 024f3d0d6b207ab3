//! The commands do what their description says, from files to files.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::Stdio;
use std::sync::Arc;

use image::ColorType;
use inplace_core::field::Preset;
use inplace_core::labels::{Class, History, LabelSet, Stroke, VOID};
use inplace_core::project::{Journal, Project, Step};
use inplace_core::scene::{OpenOptions, SceneSource};
use inplace_core::session::{Client, FrameMap, ModelState, SessionOptions};
use inplace_lab::ConfusionMatrix;
use inplace_tests::{
    OnDisk, Outcome, Running, Small, class_ids, contents_of, info, inplace, json, label, miou_with_clicks,
    succeed,
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
        // It has learnt all it can, as views of it want, in a third of the steps.
        preset: Preset::Fast,
        threads: 2,
        seed: 0,
        views: true,
        first_look: false,
        features: None,
        state: None,
    };
    let mut client = Client::start(options);
    while client.status().steps < 20 {
        client.next(None).unwrap();
    }
    ModelState::clone(&client.saved().unwrap())
}

/// Exports `room.inplace` into a folder.
fn export(disk: &OnDisk, out: &str, more: &[&str]) -> Outcome {
    let mut command = inplace();
    command.arg("export").arg(disk.path("room.inplace"));
    succeed(command.arg("--out").arg(disk.path(out)).args(more))
}

/// Every frame has its three images, in size and kind as documented, and nothing else lies there.
fn assert_complete(out: &Path) {
    let frames = &Small::get().scene.frames;
    let kinds = [
        ("labels", ColorType::L8),
        ("entropy", ColorType::L16),
        ("color", ColorType::Rgb8),
    ];
    for (folder, kind) in kinds {
        assert_eq!(fs::read_dir(out.join(folder)).unwrap().count(), frames.len());
        for frame in frames {
            let image = image::open(out.join(folder).join(format!("{}.png", frame.stem))).unwrap();
            let (size, camera) = ((image.width(), image.height()), &frame.camera);
            assert_eq!(size, (camera.width, camera.height), "{folder}");
            assert_eq!(image.color(), kind, "{folder}");
        }
    }
}

/// Every clicked pixel carries its class; returns the agreement of all pixels with the truth.
fn assert_clicks_hold(out: &Path, clicks: &LabelSet) -> f64 {
    let small = Small::get();
    let stems = small.scene.frames.iter().map(|frame| frame.stem.as_str());
    let truth = stems.zip(small.truth.iter().cloned());
    miou_with_clicks(out, (64, 48), clicks, truth)
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

    let two = root.path().join("two");
    let mut demo = inplace();
    demo.args("demo --rooms 2 --frames 8 --size 64x48 --out".split(' '));
    succeed(demo.arg(&two));
    let of_two = info(&two, &[]);
    assert_eq!([&of_two["frames"], &of_two["width"]], [8, 64]);
    let bound = |facts: &Value, key: &str| facts[key][0].as_f64().unwrap();
    let length = |facts: &Value| bound(facts, "bounds_max_m") - bound(facts, "bounds_min_m");
    assert!(length(&of_two) > 1.5 * length(&facts));

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
fn a_reader_that_stops_early_is_no_failure() {
    let mut info = inplace();
    info.args(["info", "demo"]).stdout(Stdio::piped());
    let mut running = info.stderr(Stdio::piped()).spawn().unwrap();
    drop(running.stdout.take());
    let ended = running.wait_with_output().unwrap();
    let told = String::from_utf8_lossy(&ended.stderr);
    assert!(ended.status.success() && !told.contains("panicked"), "{told}");
}

#[cfg(target_os = "linux")]
#[test]
fn results_that_cannot_be_printed_are_a_failure() {
    let root = tempfile::tempdir().unwrap();
    let mut demo = inplace();
    demo.args("demo --frames 2 --size 64x48 --out".split(' '));
    demo.arg(root.path().join("demo"));
    let ended = demo.stdout(fs::File::create("/dev/full").unwrap()).output();
    let ended = ended.unwrap();
    let told = String::from_utf8_lossy(&ended.stderr);
    assert_eq!(ended.status.code(), Some(1), "{told}");
    assert!(told.contains("the results cannot be printed"), "{told}");
}

#[test]
fn label_images_alone_label_every_frame_and_a_stroke_covers_them() {
    let small = Small::get();
    let on_disk = OnDisk::default();
    let images = on_disk.path("predictions");
    fs::create_dir(&images).unwrap();
    for number in (0..10).step_by(2) {
        let truth = format!("room/semantic_class/semantic_class_{number}.png");
        fs::copy(on_disk.path(&truth), images.join(format!("rgb_{number}.png"))).unwrap();
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

    // A budget that is over before the images are spread waits for them.
    let hurried = on_disk.path("hurried");
    let mut command = label(&on_disk.path("room"), &hurried);
    succeed(command.arg("--import").arg(&images).args(["--budget", "0.1"]));
    let (_, _, labels) = class_ids(&hurried.join("labels/rgb_1.png"));
    assert!(labels.iter().any(|&class| class != VOID));

    // The colours that were written are read again by the list beside them, and right under the strokes.
    let colors = out.join("color");
    let import = ["--import", colors.to_str().unwrap(), "--trust", "1"];
    let trusted = succeed(on_disk.label(&import).args(BUDGET));
    assert_eq!(trusted.stderr, "");
    assert_clicks_hold(&on_disk.path("out"), &Small::get().labels());
    assert_eq!(json(&on_disk.path("out/report.json"))["imported_trust"], 1.0);
}

#[test]
fn a_few_clicks_label_every_pixel_of_every_frame() {
    let disk = OnDisk::default();
    let options = ["--json", "--seed", "7", "--threads", "2"];
    let outcome = succeed(disk.label(&options).args(BUDGET));
    assert_eq!(outcome.stderr, "");
    let out = disk.path("out");
    assert_complete(&out);
    let miou = assert_clicks_hold(&out, &Small::get().labels());
    println!("mIoU with depth: {miou:.3}");
    assert!(miou > MIOU_WITH_DEPTH, "{miou}");

    let classes = json(&out.join("classes.json"));
    assert_eq!(classes, Small::get().strokes()["classes"]);
    let report = json(&out.join("report.json"));
    assert_eq!(report, serde_json::from_str::<Value>(&outcome.stdout).unwrap());
    assert_eq!(report["version"], env!("CARGO_PKG_VERSION"));
    assert_eq!(report["strokes"], Small::get().labels().strokes.len());
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
fn colour_alone_is_enough_to_finish() {
    let disk = OnDisk::default();
    let outcome = succeed(disk.label(&["--no-depth"]).args(BUDGET));
    assert!(outcome.stderr.is_empty(), "{outcome:?}");
    assert_complete(&disk.path("out"));
    let miou = assert_clicks_hold(&disk.path("out"), &Small::get().labels());
    println!("mIoU without depth: {miou:.3}");
    assert!(miou > MIOU_WITHOUT_DEPTH, "{miou}");
}

#[test]
fn a_trained_project_is_exported_twice_to_the_same_bytes_and_along_a_path_as_a_capture() {
    let disk = OnDisk::default();
    project(&disk).save_model(&trained(&disk)).unwrap();
    let ids = ["--ids", "NYU-40", "--preset", "fast"];
    export(&disk, "first", &ids);
    assert_complete(&disk.path("first"));
    // The classes have the numbers of the list that have the same names there, and the others become void.
    let listed = json(&disk.path("first/classes.json"));
    let listed: Vec<Class> = serde_json::from_value(listed).unwrap();
    let own = Small::get().labels();
    let mut clicks = own.clone();
    for click in clicks.strokes.values_mut() {
        let name = &own.class(click.class).unwrap().name;
        let listed = listed.iter().find(|class| class.is_named(name));
        Arc::make_mut(click).class = listed.map_or(VOID, |class| class.id);
    }
    assert!(clicks.strokes.values().any(|click| click.class > 0));
    assert_clicks_hold(&disk.path("first"), &clicks);
    let again = export(&disk, "first", &ids).stdout;
    assert!(again.contains("0 files written, 42 unchanged"), "{again}");
    let second = export(&disk, "second", &ids).stdout;
    assert!(second.contains("42 files written, 0 unchanged"), "{second}");

    fs::copy(disk.path("room.inplace"), disk.path("copy.inplace")).unwrap();
    let mut compare = inplace();
    compare
        .arg("compare")
        .args(["room.inplace", "copy.inplace"].map(|name| disk.path(name)))
        .args(["--preset", "fast"]);
    succeed(compare.arg("--out").arg(disk.path("compared")));
    let compared = json(&disk.path("compared/comparison.json"));
    assert_eq!(
        (&compared["frames"], &compared["agreement"]),
        (&10.into(), &1.0.into())
    );
    assert!(disk.path("compared/differences").read_dir().unwrap().count() > 0);

    let path = disk.path("room/traj_w_c.txt");
    let views = ["--trajectory", path.to_str().unwrap(), "--preset", "fast"];
    let views = export(&disk, "views", &views);
    assert!(views.stdout.contains("rendered 10 views"), "{views:?}");
    let facts = info(&disk.path("views"), &[]);
    assert_eq!(facts["format"], "Replica");
    assert_eq!(facts["frames"], 10);
    assert_eq!(facts["warnings"].as_array().unwrap().len(), 0);
    assert!(disk.path("views/labels/view_9.png").is_file());
}

#[test]
fn maps_that_a_project_holds_are_exported_as_they_are_and_others_are_made_within_the_budget() {
    let disk = OnDisk::default();
    let path = disk.path("room.inplace");
    let mut contents = contents_of(&disk.path("room"), Some(&disk.path("strokes.json")));
    let mut labels = contents.history.labels().clone();
    // Objects are told by the surface.
    labels.classes.iter_mut().for_each(|class| class.thing = false);
    let class = labels.classes[0].id;
    contents.history = History::new(labels);
    drop(Project::create(&path, &contents).unwrap());
    export(&disk, "made", &["--budget", "4"]);
    assert_clicks_hold(&disk.path("made"), &Small::get().labels());

    // One class everywhere, which the strokes would not say.
    let frames = Small::get().scene.frames.iter().enumerate();
    let maps = frames.map(|(number, frame)| {
        let (size, pixels) = ([frame.camera.width, frame.camera.height], frame.camera.pixels());
        Arc::new(FrameMap::new(number, 0, size, vec![class; pixels], vec![0; pixels]).unwrap())
    });
    contents.maps = maps.collect();
    drop(Project::create(&path, &contents).unwrap());
    export(&disk, "held", &[]);
    let (_, _, held) = class_ids(&disk.path("held/labels/rgb_3.png"));
    assert!(held.iter().all(|&id| id == class));
    // They are not of an image that has changed since.
    let mut changed = contents.clone();
    changed.scene.frames[3].bytes += 1;
    drop(Project::create(&path, &changed).unwrap());
    export(&disk, "changed", &["--budget", "4"]);
    assert_clicks_hold(&disk.path("changed"), &Small::get().labels());
    drop(Project::create(&path, &contents).unwrap());
    // Their probabilities are not held.
    export(&disk, "asked", &["--least-probability", "0", "--budget", "4"]);
    assert_clicks_hold(&disk.path("asked"), &Small::get().labels());
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
    assert!(assert_clicks_hold(&disk.path("out"), &Small::get().labels()) > MIOU_WITH_DEPTH);

    // The next edit is in a backup, which stands in for the file.
    let path = disk.path("room.inplace");
    let (project, contents) = Project::open(&path).unwrap();
    let journal = Journal::start(project, &contents, || ()).unwrap();
    let class = contents.history.labels().classes[0].id;
    let stroke = Stroke::click(0, class, [1, 1]);
    journal.record(Step::Do(contents.history.clone().add_stroke(stroke)));
    journal.close().unwrap();
    let damaged = [0; 4096];
    fs::write(&path, damaged).unwrap();
    let outcome = succeed(label(&path, &disk.path("again")).args(BUDGET));
    let told = format!("inplace: {}: is damaged", path.display());
    assert!(outcome.stderr.contains(&told), "{outcome:?}");
    assert!(outcome.stderr.contains("its backup of"), "{outcome:?}");
    assert_clicks_hold(&disk.path("again"), &Small::get().labels());
    assert_eq!(fs::read(&path).unwrap(), damaged);
}

#[test]
fn the_log_is_in_the_file_asked_for_or_the_users_data_and_stops_nothing_where_it_cannot_be_written() {
    let folder = tempfile::tempdir().unwrap();
    let [data, file, asked] = ["data", "file", "asked.log"].map(|name| folder.path().join(name));
    let run = |scene: &str, data: &Path, more: &[&str]| {
        let mut command = inplace();
        command.args(["info", scene]).args(more);
        Running::to_the_end(command.env("XDG_DATA_HOME", data).env_remove("RUST_LOG"))
    };
    let outcome = run("demo", &data, &["--log", asked.to_str().unwrap()]);
    assert_eq!((outcome.code, outcome.stderr.as_str()), (Some(0), ""));
    let log = fs::read_to_string(asked).unwrap();
    for part in [
        "INFO",
        "arguments=[\"info\"",
        "a scene is open",
        "format=\"demo\" frames=60",
    ] {
        assert!(log.contains(part), "{part} is not in: {log}");
    }
    assert!(!data.exists(), "a log was asked for elsewhere");
    let failed = run("no-such-folder", &data, &[]);
    assert_eq!(failed.stderr.lines().count(), 1, "said once: {failed:?}");
    fs::write(&file, "").unwrap();
    let unlogged = run("no-such-folder", &file, &[]).stderr;
    assert!(unlogged.contains("no such folder"), "{unlogged}");
    if cfg!(target_os = "linux") {
        let log = fs::read_to_string(data.join("inplace/inplace.log")).unwrap();
        assert!(log.contains("ERROR") && log.contains("no such folder"), "{log}");
        assert!(unlogged.contains("the log cannot be written"), "{unlogged}");
        assert_eq!(unlogged.lines().count(), 2, "{unlogged}");
    }
}

#[test]
fn an_export_brings_its_classes_and_objects_back() {
    let on_disk = OnDisk::default();
    let mut strokes = Small::get().strokes();
    let things = strokes["classes"].as_array().unwrap().clone().into_iter();
    let things: Vec<_> = things
        .filter(|class| class["thing"] == true)
        .map(|class| class["id"].clone())
        .collect();
    let named = strokes["strokes"].as_array_mut().unwrap().iter_mut();
    let named = named.filter(|stroke| things.contains(&stroke["class"])).take(3);
    let objects = named.zip([7, 3, 900]).map(|(stroke, number)| {
        stroke["object"] = number.into();
        serde_json::json!({"id": number, "class": stroke["class"], "name": format!("the {number}th")})
    });
    let objects: Vec<_> = objects.collect();
    strokes["objects"] = objects.into();
    on_disk.write_strokes(&strokes);
    let (out, again) = (on_disk.path("out"), on_disk.path("again"));
    succeed(on_disk.label(&[]).args(BUDGET));
    let imported = succeed(
        label(&on_disk.path("room"), &again)
            .arg("--import")
            .arg(&out)
            .args(BUDGET),
    );
    assert_eq!(imported.stderr, "");
    let known = |folder: &Path| -> BTreeMap<u64, Value> {
        let objects = json(&folder.join("objects.json"));
        let objects = objects.as_array().unwrap().clone().into_iter();
        objects
            .map(|mut object| {
                object.as_object_mut().unwrap().remove("pixels");
                (object["id"].as_u64().unwrap(), object)
            })
            .collect()
    };
    let before = known(&out);
    assert!(
        [3, 7, 900].iter().all(|number| before.contains_key(number)),
        "{before:?}"
    );
    let after = known(&again);
    for number in [3, 7, 900] {
        assert_eq!(after.get(&number), before.get(&number));
    }
}
