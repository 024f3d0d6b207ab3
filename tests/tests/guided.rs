//! A whole scene labelled without a mouse: a real window, real keys, the suggestions answered from the ground truth.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::collections::BTreeMap;
use std::path::Path;
use std::time::{Duration, Instant};

use inplace_core::labels::{Class, ClassId, LabelSet, Pixel, VOID};
use inplace_core::scene::demo::{self, Shot};
use inplace_tests::{TRACE, Window, inplace, json, miou_with_clicks, skip, succeed};

/// Width and height of the frames.
const SIZE: (u32, u32) = (320, 240);
/// What the maps must reach.
const GOAL: f64 = 0.8;
/// Answers before the first look at the maps, four for each of the demo's classes; and before each further one.
const FIRST_LOOK: usize = 80;
const LOOK_EVERY: usize = 10;
/// Answers to reach it with: of time a busy machine may need any amount.
const MOST: u64 = 160;

/// The scene's frames by their stems with their true classes, row-major, and the names of these.
struct Truth {
    images: BTreeMap<String, Vec<ClassId>>,
    classes: Vec<Class>,
}

impl Truth {
    /// Name of what is at a pixel; `None` = void.
    fn name_at(&self, frame: &str, [x, y]: Pixel) -> Option<&str> {
        let id = self.images[frame][(y * SIZE.0 + x) as usize];
        let class = self.classes.iter().find(|class| class.id == id)?;
        Some(&class.name)
    }

    /// Mean intersection over union of exported label images over all frames; classes are matched by their names.
    fn miou(&self, export: &Path) -> f64 {
        let classes = json(&export.join("classes.json"));
        let exported: Vec<Class> = serde_json::from_value(classes).unwrap();
        // What the export has no class for gets a number that no pixel has.
        let id_of = |class: &Class| {
            let exported = exported.iter().find(|other| other.name == class.name);
            (
                class.id,
                exported.map_or(ClassId::MAX - class.id, |other| other.id),
            )
        };
        let ids: BTreeMap<ClassId, ClassId> = self.classes.iter().map(id_of).collect();
        let id = |id: &ClassId| ids.get(id).copied().unwrap_or(VOID);
        let images = self.images.iter();
        let truth = images.map(|(stem, labels)| (stem.as_str(), labels.iter().map(id).collect()));
        miou_with_clicks(export, SIZE, &LabelSet::default(), truth)
    }
}

/// The hand on the keyboard.
struct Hand<'a> {
    window: &'a Window,
    truth: Truth,
    answers: u64,
}

impl Hand<'_> {
    /// Goes to the first place. A window that has only just appeared may miss the key: then it is pressed again.
    fn begin(&self) {
        let mut pressed: Option<Instant> = None;
        self.window.until_told("a place is at hand", |trace| {
            if pressed.is_none_or(|at| at.elapsed() > Duration::from_secs(2)) {
                self.window.focus()?;
                self.window.screen.key("n");
                pressed = Some(Instant::now());
            }
            (trace.last("place")?["mode"] == "at").then_some(())
        });
    }

    /// Waits for the next place; false when there is nothing left to suggest.
    fn next_place(&self) -> bool {
        self.window.until_told("the next place is at hand", |trace| {
            let all_known = trace.strokes() == self.answers;
            match trace.last("place")?["mode"].as_str()? {
                "at" if all_known => Some(true),
                "away" if all_known => Some(false),
                _ => None,
            }
        })
    }

    /// Answers the place at hand from the ground truth: by Enter where the likely class is right, by its digit where
    /// it has one, by its name otherwise.
    fn answer(&mut self) {
        let trace = self.window.trace();
        let place = &trace.last("place").unwrap()["suggestion"];
        let pixel: Pixel = serde_json::from_value(place["pixel"].clone()).unwrap();
        let frame = place["frame"].as_str().unwrap();
        let classes = trace.classes();
        match self.truth.name_at(frame, pixel) {
            None => self.window.screen.key("0"),
            Some(name) => {
                let slot = classes.iter().position(|(_, known)| known == name);
                let likely = place["classes"][0]["id"].as_u64();
                match slot {
                    Some(slot) if likely == Some(classes[slot].0) => self.window.screen.key("Return"),
                    Some(slot @ 0..9) => self.window.screen.key(&(slot + 1).to_string()),
                    _ => self.window.fill(|window| window.screen.key("c"), name),
                }
            }
        }
        self.answers += 1;
        let answers = self.answers;
        self.window.until_told("the answer is taken", |trace| {
            (trace.strokes() == answers).then_some(())
        });
    }
}

#[test]
fn a_scene_is_labelled_by_answering_suggestions_with_keys() {
    let write = |folder: &Path| {
        succeed(inplace().args(["demo", "--out"]).arg(folder));
    };
    let window = match Window::open(write, &["--trace", TRACE]) {
        Ok(window) => window,
        Err(missing) => return skip(&missing),
    };
    let stems = window.until("there are suggestions", |window| {
        let trace = window.trace();
        let listed = trace.last("suggestions")?["suggestions"].as_array()?;
        (!listed.is_empty()).then_some(())?;
        serde_json::from_value::<Vec<String>>(trace.last("opened")?["frames"].clone()).ok()
    });
    let mut hand = Hand {
        window: &window,
        truth: Truth {
            images: stems.into_iter().zip(Shot::default().ground_truth()).collect(),
            classes: demo::classes(),
        },
        answers: 0,
    };
    let start = Instant::now();
    hand.begin();
    // In a pause the maps follow the labels alone: the same answers give the same maps on every machine.
    window.screen.key("p");
    let mut scores = Vec::new();
    loop {
        let mut left = if scores.is_empty() { FIRST_LOOK } else { LOOK_EVERY };
        while left > 0 && hand.next_place() {
            hand.answer();
            left -= 1;
        }
        let folder = window.home.path().join(format!("labels-{}", hand.answers));
        window.export(&folder);
        scores.push((hand.answers, hand.truth.miou(&folder)));
        println!("{:.1} s: {scores:?}", start.elapsed().as_secs_f64());
        if scores.iter().any(|&(_, miou)| miou >= GOAL) {
            break;
        }
        assert!(left == 0, "nothing is suggested any more: {scores:?}");
        assert!(hand.answers < MOST, "not with {MOST} answers: {scores:?}");
    }
}
