use super::*;
use crate::LabelImage;
use crate::testing::{capture, opened, parsed};
use inplace_core::scene::demo::Shot;

fn settings() -> Settings {
    let seconds = "--seconds 0.2 --seconds-without-depth 0.2 --long-seconds 0.2";
    parsed(&format!(
        "--out x --preset fast --threads 2 --seed 3 --seeds 1 {seconds}"
    ))
}

/// The wall of two halves, as a capture with its truth.
fn wall() -> (tempfile::TempDir, Arc<Scene>) {
    let (root, folder) = capture();
    (root, opened(&folder))
}

fn named(name: &str) -> Condition {
    conditions().into_iter().find(|own| own.name == name).unwrap()
}

#[test]
fn names_are_unlike_and_every_line_can_be_missed_and_met() {
    let all = conditions();
    let names: BTreeSet<&str> = all.iter().map(|condition| condition.name).collect();
    assert_eq!(names.len(), all.len());
    for condition in &all {
        let (Line::Least(share) | Line::OfClean(share) | Line::OfCleanWithoutDepth(share)) = condition.line;
        assert!(share > 0.0 && share <= 1.0, "{}", condition.name);
    }
}

#[test]
fn a_condition_brings_the_undisturbed_one_that_its_line_needs() {
    let of = |name: &str| -> Vec<&str> { needed(&[named(name)]).iter().map(|own| own.name).collect() };
    assert_eq!(of("frames-shuffled"), [CLEAN, "frames-shuffled"]);
    assert_eq!(of("millimetres"), [CLEAN_WITHOUT_DEPTH, "millimetres"]);
    assert_eq!(of("frames-2"), ["frames-2"]);
}

#[test]
fn a_wall_of_two_halves_stands_what_keeps_it_whole() {
    let (_root, scene) = wall();
    let names =
        "frames-shuffled frame-black objects-300 objects-contradictory edits-classes worker-dies far-origin";
    let chosen: Vec<Condition> = names.split(' ').map(named).collect();
    let outcomes = stability(&scene, &chosen, &settings(), &mut |_, _| {}).unwrap();
    assert_eq!(outcomes.len(), 8, "the undisturbed scene is the first");
    for outcome in &outcomes {
        assert!(outcome.is_met(), "{outcome:?}");
    }
    let mut told = outcomes.iter().flat_map(|outcome| &outcome.told);
    assert!(told.any(|told| told.contains("labels are safe")));
    assert_eq!(table(&outcomes).unwrap().lines().count(), 9);
}

#[test]
fn hard_rooms_take_the_place_of_the_demo_alone() {
    let rooms: Vec<Condition> = conditions().into_iter().filter(|own| own.demo_only).collect();
    assert_eq!(rooms.len(), 7);
    let (_root, scene) = wall();
    let error = stability(&scene, &rooms, &settings(), &mut |_, _| {}).unwrap_err();
    assert!(error.to_string().contains("try them on \"demo\""), "{error}");
    let with_others = [&rooms[..], &conditions()[..1]].concat();
    assert_eq!(tried_on(&scene, &with_others).unwrap().len(), 1);

    // Six small frames of the plain room: its own truth, classes and clicks.
    let (width, height) = (80, 60);
    let shot = Shot::new(6, [width, height]);
    let image = LabelImage::new([width, height], vec![9; 80 * 60]);
    let truth = SceneTruth {
        images: (0..6).map(|frame| (frame, image.clone())).collect(),
        train: vec![0, 2, 4],
        test: vec![1, 3, 5],
        ..SceneTruth::default()
    };
    let mut trial = Trial::new(&shot.scene(&|_, _| {}), &truth, 0);
    let Way::Disturb(enter) = named("plain").way else {
        panic!("a room is entered");
    };
    enter(&mut trial, &settings(), &mut SmallRng::seed_from_u64(1)).unwrap();
    assert_eq!(trial.truth.classes(), [1, 2, 3, 4]);
    assert_eq!(trial.labels.classes.len(), 4);
    let frames = &trial.scene.frames;
    assert_eq!((frames.len(), frames[0].camera.width), (6, width));
    for stroke in trial.labels.strokes.values() {
        let [x, y] = stroke.first_point().unwrap();
        let labels = &trial.truth.images[&stroke.frame].labels;
        assert!(
            stroke.frame % 2 == 0 && labels[(y * width + x) as usize] == stroke.class,
            "{stroke:?}"
        );
    }
}

#[test]
fn wrong_labels_miss_the_line() {
    let (_root, scene) = wall();
    let wrong = disturbed("wrong", "", "", Line::Least(0.5), |trial, _| {
        for stroke in trial.labels.strokes.values_mut() {
            Arc::make_mut(stroke).class = 3 - stroke.class;
        }
    });
    let truth = SceneTruth::read(&scene).unwrap();
    let outcome = tried(&scene, &truth, &wrong, &settings(), &[]);
    assert!(outcome.figure.unwrap() < 0.1 && !outcome.is_met(), "{outcome:?}");
}
