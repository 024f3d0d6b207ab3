//! Random input for as long as one likes: the window does not fall, loses nothing and does not grow.
//!
//! A short run on every push; `INPLACE_MONKEY_SECONDS=1800 cargo test -p inplace-tests --test monkey -- --nocapture`
//! is the long one, `INPLACE_MONKEY_SEED` another one. `INPLACE_MONKEY_SCENE=DIR` takes a capture of one's own, such as
//! `inplace demo --out DIR --frames 1000 --size 640x480`.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use std::time::{Duration, Instant};

use inplace_core::project::Project;
use inplace_tests::{Hands, PATIENCE, Small, TRACE, Window, projects_below, skip};
use rand::{Rng, SeedableRng, rngs::SmallRng};
use serde_json::Value;

const SECONDS: &str = "INPLACE_MONKEY_SECONDS";
const SEED: &str = "INPLACE_MONKEY_SEED";
const SCENE: &str = "INPLACE_MONKEY_SCENE";
/// From this length on the memory has had time to settle, so that its growth means something.
const LONG: Duration = Duration::from_secs(600);
/// What the memory may grow by from the second to the last quarter of a long run.
const GROWTH: f64 = 1.1;
/// CPU time of the window's thread for a frame, in milliseconds: 95% of the frames stay below. The window's own code is
/// not optimised in builds for tests.
const THREAD_P95: f64 = if cfg!(debug_assertions) { 24.0 } else { 8.0 };
/// After the last input: what was accepted is on the disk.
const REST: Duration = Duration::from_secs(2);
/// Time that the window has to open what a key asks for.
const STEP: Duration = Duration::from_millis(300);

/// Keys that do something somewhere. No slash: whatever is typed as a path stays in the window's home.
const KEYS: &str = "a b c d e f g l n p q s t v w x 0 1 2 3 5 9 Tab Tab Escape Escape Return Delete BackSpace space \
                    bracketleft bracketright Left Right Up Down F1 question Home End";
const CONTROL_KEYS: &str = "z y s e o comma plus minus 0 a";

/// A sequence of numbers that follows from its seed.
struct Random(SmallRng);

impl Random {
    fn below(&mut self, limit: usize) -> usize {
        self.0.random_range(0..limit)
    }

    /// One of several words.
    fn one_of<'a>(&mut self, words: &'a str) -> &'a str {
        let words: Vec<&str> = words.split(' ').collect();
        words[self.below(words.len())]
    }

    /// A place on the screen; two of three are on the frame in view.
    fn place(&mut self) -> [i16; 2] {
        let place = |random: &mut Self, [from, to]: [usize; 2]| (from + random.below(to - from)) as i16;
        if self.below(3) == 0 {
            [place(self, [0, 1280]), place(self, [0, 800])]
        } else {
            [place(self, [300, 960]), place(self, [130, 600])]
        }
    }
}

/// Names classes through the class finder, so that there is something to label with.
fn name_classes(hands: &Hands) {
    for name in ["wall", "floor", "table"] {
        hands.press("c");
        std::thread::sleep(STEP);
        for letter in name.split_inclusive(|_| true) {
            hands.press(letter);
        }
        std::thread::sleep(STEP);
        hands.press("Return");
        std::thread::sleep(STEP);
    }
}

/// One thing that a hand does.
fn act(hands: &Hands, random: &mut Random) {
    if random.below(8) == 0 {
        // Out of whatever is open.
        hands.press("Escape");
        hands.press("Escape");
    }
    match random.below(10) {
        0..=3 => {
            let button = [1, 1, 1, 2, 3][random.below(5)];
            hands.move_to(random.place());
            hands.button(button, true);
            for _ in 0..random.below(12) {
                hands.move_to(random.place());
            }
            hands.button(button, false);
        }
        4 => {
            let wheel = 4 + random.below(2) as u8;
            hands.move_to(random.place());
            for _ in 0..=random.below(3) {
                hands.button(wheel, true);
                hands.button(wheel, false);
            }
        }
        5 => hands.with("Control_L", random.one_of(CONTROL_KEYS)),
        6 => hands.with("Shift_L", random.one_of("z n Tab 1")),
        _ => hands.press(random.one_of(KEYS)),
    }
}

/// The project file below a folder that was written last, backups aside.
fn newest_project(folder: &Path) -> Option<PathBuf> {
    let written = |path: &Path| fs::metadata(path).and_then(|file| file.modified()).ok();
    projects_below(folder).into_iter().max_by_key(|path| {
        let write_ahead = PathBuf::from(format!("{}-wal", path.display()));
        written(path).max(written(&write_ahead))
    })
}

/// Resident memory of a process, in megabytes.
fn memory(process: u32) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes / 1000.0)
}

fn number(variable: &str, otherwise: u64) -> u64 {
    std::env::var(variable).map_or(otherwise, |text| text.parse().unwrap())
}

/// One window at a time: what is measured of one is not to be that of the other.
static ALONE: Mutex<()> = Mutex::new(());

/// Opens the capture that the environment names, or a small one.
fn open(arguments: &[&str]) -> Result<Window, String> {
    let write = |scene: &Path| match std::env::var_os(SCENE) {
        Some(own) => std::os::unix::fs::symlink(own, scene).unwrap(),
        None => Small::get().write(scene),
    };
    Window::open(write, arguments)
}

#[test]
fn the_windows_thread_is_light_while_training() {
    let _alone = ALONE.lock();
    let length = Duration::from_secs(number(SECONDS, 20));
    let mut random = Random(SmallRng::seed_from_u64(number(SEED, 1)));
    let mut window = match open(&["--stats"]) {
        Ok(window) => window,
        Err(missing) => return skip(&missing),
    };
    let hands = Hands::new(&window.screen);
    name_classes(&hands);
    let start = Instant::now();
    while start.elapsed() < length && window.running.ended().is_none() {
        act(&hands, &mut random);
        std::thread::sleep(Duration::from_millis(15));
    }
    hands.let_go();
    if window.running.ended().is_none() {
        window.screen.close_window(&window.id);
    }
    let outcome = window.running.wait(PATIENCE);
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let line = outcome.stderr.lines().find(|line| line.starts_with('{')).unwrap();
    println!("{line}");
    let measured: Value = serde_json::from_str(line).unwrap();
    let thread = &measured["thread_ms"];
    assert!(thread["count"].as_u64().unwrap() >= 20, "{line}");
    assert!(thread["p95"].as_f64().unwrap() <= THREAD_P95, "{line}");
}

#[test]
fn random_input_breaks_and_loses_nothing() {
    let _alone = ALONE.lock();
    let length = Duration::from_secs(number(SECONDS, 20));
    let mut random = Random(SmallRng::seed_from_u64(!number(SEED, 1)));
    let mut window = match open(&["--trace", TRACE]) {
        Ok(window) => window,
        Err(missing) => return skip(&missing),
    };
    let mut hands = Hands::new(&window.screen);
    name_classes(&hands);
    let (start, mut memories, mut windows) = (Instant::now(), Vec::new(), 1);
    while start.elapsed() < length {
        act(&hands, &mut random);
        std::thread::sleep(Duration::from_millis(15));
        if let Some(ended) = window.running.ended() {
            // Random input finds File > Quit, too.
            assert!(ended.success(), "{ended}: {}", window.running.stderr());
            window = open(&["--trace", TRACE]).unwrap();
            hands = Hands::new(&window.screen);
            name_classes(&hands);
            memories.clear();
            windows += 1;
        }
        memories.extend(memory(window.running.id()).map(|memory| (start.elapsed(), memory)));
    }
    hands.let_go();
    std::thread::sleep(REST);
    assert!(window.running.ended().is_none(), "{}", window.running.stderr());
    let accepted = window.trace().last("labels").cloned();
    window.running.kill();
    let said = window.running.stderr();
    assert!(!said.contains("panicked"), "{said}");

    if let Some(accepted) = accepted {
        let file = newest_project(window.home.path()).unwrap();
        let (_, contents) = Project::open(&file).unwrap();
        let labels = contents.history.labels();
        let newest = labels
            .strokes
            .last_key_value()
            .map(|(id, stroke)| (id.0, stroke.class));
        let told = &accepted["newest"];
        let told = (!told.is_null()).then(|| {
            (
                told["id"].as_u64().unwrap(),
                told["class"].as_u64().unwrap() as u16,
            )
        });
        println!(
            "{windows} windows; {} edits, {} strokes in {}",
            contents.history.edits().0.len(),
            labels.strokes.len(),
            file.display()
        );
        assert_eq!(labels.strokes.len() as u64, accepted["strokes"].as_u64().unwrap());
        assert_eq!(newest, told);
    }
    let quarter = |index: usize| {
        let part = memories.len() / 4;
        memories[index * part..(index + 1) * part]
            .iter()
            .map(|&(_, memory)| memory)
            .fold(0.0, f64::max)
    };
    if memories.len() >= 8 {
        println!(
            "memory: {:.0} MB in the second quarter, {:.0} MB in the last",
            quarter(1),
            quarter(3)
        );
    }
    if length >= LONG && windows == 1 {
        assert!(quarter(3) <= GROWTH * quarter(1));
    }
}
