//! Exports are opened with the programs that they are made for.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::collections::BTreeMap;
use std::env;
use std::fs;
use std::ops::ControlFlow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Arc;
use std::time::Duration;

use image::ImageEncoder;
use image::codecs::jpeg::JpegEncoder;
use image::codecs::png::PngEncoder;
use inplace_core::export::{Format, LabelledScene, Options, export};
use inplace_core::labels::{Class, ClassId, History, LabelSet, VOID};
use inplace_core::scene::Scene;
use inplace_core::semantics::{ENTROPY_STEPS_PER_NAT, Mesh, MeshVertex};
use inplace_core::session::FrameMap;
use inplace_tests::{Outcome, Running, Small, open, propagated};
use serde_json::{Value, json};

/// Set where the readers have to be there.
const REQUIRED: &str = "INPLACE_REQUIRE_READERS";
/// How long downloading the readers may take.
const PATIENCE: Duration = Duration::from_secs(900);

fn folder() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("readers")
}

/// A folder below the target folder, which stays there.
fn kept(name: &str) -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join(name)
}

/// The Python that has the readers, in an environment that is made when it is not there yet or was made from other
/// requirements.
fn python() -> Result<PathBuf, String> {
    let environment = kept("readers");
    let python = environment.join("bin/python");
    let requirements = folder().join("requirements.txt");
    let wanted = fs::read(&requirements).unwrap();
    let made_from = environment.join("requirements.txt");
    if fs::read(&made_from).is_ok_and(|made_from| made_from == wanted) {
        return Ok(python);
    }
    let run = |command: &mut Command, what: &str| {
        let Outcome {
            code, stdout, stderr, ..
        } = Running::start(command).wait(PATIENCE);
        match code {
            Some(0) => Ok(()),
            _ => Err(format!("{what}: {stdout}{stderr}")),
        }
    };
    if Command::new("python3").arg("--version").output().is_err() {
        return Err("there is no python3".to_owned());
    }
    run(
        Command::new("python3")
            .args(["-m", "venv", "--clear"])
            .arg(&environment),
        "no virtual environment can be made; on Debian install python3-venv",
    )?;
    let mut install = Command::new(&python);
    install.args(["-m", "pip", "install", "--quiet", "--retries", "1", "--no-deps"]);
    install.arg("--requirement").arg(&requirements);
    run(&mut install, "the readers cannot be downloaded")?;
    fs::write(made_from, wanted).unwrap();
    Ok(python)
}

/// Labels with holes, specks and lone pixels, as a few strokes leave them where nothing is sure: one pixel in eight is
/// void or of the class of another pixel.
fn specked(labels: &[ClassId]) -> Vec<ClassId> {
    let speck = |(index, &label): (usize, &ClassId)| {
        // Fibonacci hashing: spread evenly, the same in every run.
        let hash = (index as u32).wrapping_mul(2_654_435_769) >> 16;
        match hash % 16 {
            0 => VOID,
            1 => labels[hash as usize % labels.len()],
            _ => label,
        }
    };
    labels.iter().enumerate().map(speck).collect()
}

/// Gives two images EXIF metadata that ask to turn them, which their poses do not mean: a JPEG and a PNG.
fn turn_some(images: &Path) {
    // TIFF with one entry: tag 0x112, one short.
    let entry = [0x12, 0x01, 3, 0, 1, 0, 0, 0, 6, 0, 0, 0];
    let quarter_turn = [&b"II*\0\x08\0\0\0\x01\0"[..], &entry, &[0; 4]].concat();
    let jpeg = images.join("rgb_2.png");
    let image = image::open(&jpeg).unwrap();
    fs::remove_file(&jpeg).unwrap();
    let mut encoder = JpegEncoder::new(fs::File::create(jpeg.with_extension("jpg")).unwrap());
    encoder.set_exif_metadata(quarter_turn.clone()).unwrap();
    image.write_with_encoder(encoder).unwrap();
    let png = images.join("rgb_5.png");
    let image = image::open(&png).unwrap();
    let mut encoder = PngEncoder::new(fs::File::create(&png).unwrap());
    encoder.set_exif_metadata(quarter_turn).unwrap();
    image.write_with_encoder(encoder).unwrap();
}

/// What readers should find in exports of the surface of a map: every vertex of cloud and mesh with what is known of its
/// voxel, and the triangles.
fn expected(scene: &Scene, map: &FrameMap) -> Value {
    let (surface, _) = map.surface().unwrap();
    let nodes = (0..).zip(surface.graph.nodes());
    let seen = nodes.filter(|(_, node)| !surface.is_on_shell(node));
    let points = seen.map(|(node, seen)| MeshVertex {
        position: seen.position,
        node,
    });
    let mesh = Mesh::of_surface(surface);
    json!({
        "cloud": shape(scene, map, &points.collect::<Vec<_>>(), &[]),
        "mesh": shape(scene, map, &mesh.vertices, &mesh.triangles),
    })
}

fn shape(scene: &Scene, map: &FrameMap, vertices: &[MeshVertex], triangles: &[[u32; 3]]) -> Value {
    let (surface, posterior) = map.surface().unwrap();
    let nodes = || vertices.iter().map(|vertex| vertex.node as usize);
    let mut classes: BTreeMap<ClassId, usize> = BTreeMap::new();
    for node in nodes() {
        *classes.entry(posterior.labels[node]).or_default() += 1;
    }
    let color = |node: usize| (255.0 * surface.graph.nodes()[node].color).round().to_array();
    json!({
        "positions": vertices.iter().map(|vertex| scene.to_capture(vertex.position).to_array()).collect::<Vec<_>>(),
        "colors": nodes().map(color).collect::<Vec<_>>(),
        "labels": nodes().map(|node| posterior.labels[node]).collect::<Vec<_>>(),
        "entropy": nodes().map(|node| f32::from(posterior.entropy[node]) / ENTROPY_STEPS_PER_NAT).collect::<Vec<_>>(),
        "classes": classes,
        "triangles": triangles,
    })
}

/// The labels with each click on some kinds of things as an object of its own, which no other click covers; the other things
/// are parts of the surface.
fn with_objects(labels: &LabelSet) -> LabelSet {
    let mut history = History::new(labels.clone());
    let named = |class: &&Class| ["pillow", "cushion", "chair", "shelf"].contains(&class.name.as_str());
    for class in labels.classes.iter().filter(named) {
        for stroke in labels.strokes.values().filter(|stroke| stroke.class == class.id) {
            history.add_object(stroke.as_ref().clone(), &[]).unwrap();
        }
    }
    assert!(history.labels().objects.len() > 1);
    history.labels().clone()
}

#[test]
fn every_format_is_read_by_others_as_the_labels_that_were_exported() {
    let python = match python() {
        Ok(python) => python,
        Err(reason) => {
            assert!(env::var_os(REQUIRED).is_none(), "{reason}");
            println!("skipped: {reason}");
            return;
        }
    };
    let small = Small::get();
    let root = kept("exports");
    if root.exists() {
        fs::remove_dir_all(&root).unwrap();
    }
    let room = root.join("room");
    small.write(&room);
    turn_some(&room.join("rgb"));
    // Read again, so that its images are files.
    let scene = Arc::new(open(&room));
    let said = scene.warnings.join(" ");
    assert!(said.contains("EXIF orientation asks to turn them"), "{said}");
    assert!(said.contains("2 in all"), "{said}");
    let map = |(frame, labels): (usize, &Vec<ClassId>)| {
        let camera = &scene.frames[frame].camera;
        let size = [camera.width, camera.height];
        Arc::new(FrameMap::new(frame, 0, size, specked(labels), vec![0; labels.len()]).unwrap())
    };
    let maps: Vec<Arc<FrameMap>> = small.truth.iter().enumerate().map(map).collect();
    // Its surface is labelled by clicks.
    let solids = propagated(&scene, &small.labels(), 8.0);
    let surface = expected(&scene, &solids[0]).to_string();
    fs::write(root.join("surface.json"), surface).unwrap();
    let things = with_objects(&small.labels());
    let with_objects = propagated(&scene, &things, 8.0);
    for format in Format::ALL {
        let maps = if format.has_frames() { &maps } else { &solids };
        let labelled = LabelledScene {
            scene: &scene,
            classes: &small.classes,
            objects: &[],
            parts: &[],
            maps,
        };
        let of_objects = LabelledScene {
            objects: &things.objects,
            maps: &with_objects,
            ..labelled
        };
        for (folder, labelled) in [(root.clone(), labelled), (root.join("objects"), of_objects)] {
            let go_on = |_, _| ControlFlow::Continue(());
            let out = folder.join(format.name());
            export(&out, labelled, format, &Options::default(), &go_on).unwrap();
        }
    }
    let check = folder().join("check.py");
    let outcome = Running::to_the_end(Command::new(python).arg(check).arg(&root));
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    println!("{}", outcome.stdout);
    // All but the plain one, which the others are compared with, and boxes, which are around objects.
    let of_classes = Format::ALL.len() - 2;
    let (all, of_objects) = (
        outcome.stdout.matches("is right"),
        outcome.stdout.matches("of objects is right"),
    );
    assert_eq!((all.count(), of_objects.count()), (of_classes + 9, 9));
}
