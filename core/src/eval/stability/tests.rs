use super::*;
use crate::eval::simulate::testing::capture;
use crate::field::Preset;
use crate::scene::{OpenOptions, SceneSource};

fn settings() -> Settings {
    Settings {
        preset: Preset::Fast,
        threads: 2,
        seed: 3,
        seconds: 0.2,
        seconds_without_depth: 0.2,
        long_seconds: 0.2,
    }
}

/// The wall of two halves, as a capture with its truth.
fn wall() -> (tempfile::TempDir, Arc<Scene>) {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("wall");
    capture(&folder);
    let source = SceneSource::Folder(folder);
    let scene = Scene::open(&source, OpenOptions::default(), &|_, _| {}).unwrap();
    (root, Arc::new(scene))
}

#[test]
fn names_are_unlike_and_every_line_can_be_missed_and_met() {
    let all = conditions();
    let mut names: Vec<&str> = all.iter().map(|condition| condition.name).collect();
    names.sort_unstable();
    names.dedup();
    assert_eq!(names.len(), all.len());
    for condition in &all {
        let (Line::Least(share) | Line::OfClean(share) | Line::OfCleanWithoutDepth(share)) = condition.line;
        assert!(share > 0.0 && share <= 1.0, "{}", condition.name);
    }
}

#[test]
fn a_condition_brings_the_undisturbed_one_that_its_line_needs() {
    let of = |name: &str| -> Vec<&str> {
        let chosen: Vec<Condition> = conditions().into_iter().filter(|own| own.name == name).collect();
        needed(&chosen).iter().map(|condition| condition.name).collect()
    };
    assert_eq!(of("frames-shuffled"), [CLEAN, "frames-shuffled"]);
    assert_eq!(of("millimetres"), [CLEAN_WITHOUT_DEPTH, "millimetres"]);
    assert_eq!(of("frames-2"), ["frames-2"]);
}

#[test]
fn a_wall_of_two_halves_stands_what_keeps_it_whole() {
    let (_root, scene) = wall();
    let chosen: Vec<Condition> = conditions()
        .into_iter()
        .filter(|condition| {
            [
                "frames-shuffled",
                "frame-black",
                "edits-classes",
                "worker-dies",
                "far-origin",
            ]
            .contains(&condition.name)
        })
        .collect();
    assert_eq!(chosen.len(), 5);
    let outcomes = stability(&scene, &chosen, &settings(), 1, &mut |_| {}).unwrap();
    assert_eq!(outcomes.len(), 6, "the undisturbed scene is the first");
    for outcome in &outcomes {
        assert!(outcome.is_met(), "{outcome:?}");
    }
    assert!(
        outcomes
            .iter()
            .any(|outcome| outcome.told.iter().any(|told| told.contains("labels are safe")))
    );
    let table = table(&outcomes);
    assert_eq!(table.as_str().lines().count(), 7);
}

#[test]
fn wrong_labels_miss_the_line() {
    let (_root, scene) = wall();
    let wrong = disturbed("wrong", "every label is wrong", Line::Least(0.5), |trial, _| {
        for stroke in trial.labels.strokes.values_mut() {
            let mut other = stroke.as_ref().clone();
            other.class = 3 - other.class;
            *stroke = other.into();
        }
    });
    let truth = SceneTruth::read(&scene).unwrap();
    let outcome = tried(&scene, &truth, &wrong, &settings(), &[]);
    assert!(outcome.figure.unwrap() < 0.1 && !outcome.is_met(), "{outcome:?}");
}
