//! Random input for as long as one likes: the window does not fall, loses nothing and does not grow.
//!
//! A short run on every push; `INPLACE_MONKEY_SECONDS=1800 cargo test -p inplace-tests --test monkey -- --nocapture`
//! is the long one, `INPLACE_MONKEY_SEED` another one. `INPLACE_MONKEY_SCENE=DIR` takes a capture of one's own, such as
//! `inplace demo --out DIR --frames 1000 --size 640x480`.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use inplace_core::labels::Stroke;
use inplace_core::project::Project;
use inplace_tests::{Hands, Small, TRACE, Window, contents_of, number, skip};
use rand::{Rng, SeedableRng, rngs::SmallRng, seq::IteratorRandom};

const SECONDS: &str = "INPLACE_MONKEY_SECONDS";
const SEED: &str = "INPLACE_MONKEY_SEED";
const SCENE: &str = "INPLACE_MONKEY_SCENE";
/// From this length on the memory has had time to settle, so that its growth means something.
const LONG: Duration = Duration::from_secs(600);
/// What the memory may grow by from the second to the last quarter of a long run.
const GROWTH: f64 = 1.1;
/// After so long the window has caught up with the input, and what was accepted is on the disk.
const REST: Duration = Duration::from_secs(2);
/// Time that the window has to open what a key asks for.
const STEP: Duration = Duration::from_millis(300);

/// Keys that do something somewhere. No slash: whatever is typed as a path stays in the window's home.
const KEYS: &str = "a b c d e f g l m n o p q q r s t v w x y 0 1 2 3 5 9 Tab Tab Escape Escape Return Delete BackSpace space \
                    bracketleft bracketright Left Right Up Down F1 question Home End";
const CONTROL_KEYS: &str = "z y s e o comma plus minus 0 a";
/// Releases the buttons and keys that may be held.
const LET_GO: &str = "mouseup 1 mouseup 2 mouseup 3 keyup ctrl keyup shift";
/// A place of the menu bar without a menu: from there Tab goes from control to control.
const BAR: &str = "mousemove 640 14";
/// The menu File, and its entries that begin and end a comparison, on the screen.
const FILE_MENU: &str = "mousemove 24 14 click 1";
const COMPARE: &str = "mousemove 60 393 click 1";
const END_COMPARISON: &str = "mousemove 60 429 click 1";
/// Another project of the small capture, in the window's home.
const OTHER: &str = "other.inplace";

/// Moves the pointer to a place on the screen; two of three are on the frame in view.
fn moved(random: &mut SmallRng) -> String {
    let (x, y) = match random.random_range(0..3) {
        0 => (0..1280, 0..800),
        _ => (300..960, 130..600),
    };
    format!("mousemove {} {}", random.random_range(x), random.random_range(y))
}

fn one_of<'a>(words: &'a str, random: &mut SmallRng) -> &'a str {
    words.split(' ').choose(random).unwrap()
}

/// Presses the button at one place and lets it go at another.
fn drag(hands: &Hands, button: u32, random: &mut SmallRng) {
    hands.act(&format!("{} mousedown {button}", moved(random)));
    for _ in 0..random.random_range(0..12) {
        hands.act(&moved(random));
    }
    hands.act(&format!("mouseup {button}"));
}

/// Goes from control to control, forwards or backwards, and presses one.
fn walk(hands: &Hands, random: &mut SmallRng) {
    hands.act(BAR);
    let to_the_next = one_of("Tab shift+Tab", random);
    for _ in 0..random.random_range(1..40) {
        hands.press(to_the_next);
    }
    hands.press(one_of("Return space", random));
}

/// Begins or ends a comparison with another project, once the window has caught up with the input.
fn compare(hands: &Hands, random: &mut SmallRng) {
    std::thread::sleep(REST);
    for key in ["Escape", "Escape", "ctrl+0"] {
        hands.press(key);
    }
    let begins = random.random_range(0..3) > 0;
    for step in [FILE_MENU, if begins { COMPARE } else { END_COMPARISON }] {
        std::thread::sleep(2 * STEP);
        hands.act(step);
    }
    if begins {
        std::thread::sleep(2 * STEP);
        hands.act(&format!("key ctrl+a type {OTHER}"));
        hands.press("Return");
    }
}

/// One thing that a hand does, and a moment of rest.
fn act(hands: &Hands, random: &mut SmallRng) {
    if random.random_range(0..8) == 0 {
        // Out of whatever is open.
        hands.press("Escape");
        hands.press("Escape");
    }
    match random.random_range(0..120) {
        0..=1 => compare(hands, random),
        2..=9 => walk(hands, random),
        10..=14 => {
            // With Ctrl a new object, with Shift a straight line.
            let held = one_of("ctrl shift", random);
            hands.act(&format!("keydown {held}"));
            drag(hands, 1, random);
            hands.act(&format!("keyup {held}"));
        }
        15..=18 => hands.act(&format!("{} click --repeat 2 --delay 40 1", moved(random))),
        19..=54 => drag(hands, [1, 1, 1, 2, 3][random.random_range(0..5)], random),
        55..=64 => {
            let wheel = random.random_range(4..6);
            hands.act(&moved(random));
            for _ in 0..random.random_range(1..4) {
                hands.act(&format!("mousedown {wheel} mouseup {wheel}"));
            }
        }
        65..=74 => hands.press(&format!("ctrl+{}", one_of(CONTROL_KEYS, random))),
        75..=84 => hands.press(&format!("shift+{}", one_of("z n Tab 1", random))),
        _ => hands.press(one_of(KEYS, random)),
    }
    std::thread::sleep(Duration::from_millis(15));
}

/// Resident memory of a process, in megabytes.
fn memory(process: u32) -> Option<f64> {
    let status = fs::read_to_string(format!("/proc/{process}/status")).ok()?;
    let line = status.lines().find(|line| line.starts_with("VmRSS:"))?;
    let kilobytes: f64 = line.split_whitespace().nth(1)?.parse().ok()?;
    Some(kilobytes / 1000.0)
}

/// Writes another project beside the capture: two classes and an object, and no maps.
fn write_other(scene: &Path) {
    let mut contents = contents_of(scene, None);
    for (class, pixel) in [("wall", [5, 5]), ("chair", [30, 30])] {
        let (id, _) = contents.history.add_class(class);
        let click = Stroke::click(0, id, pixel);
        if contents.history.add_object(click.clone(), &[]).is_none() {
            contents.history.add_stroke(click);
        }
    }
    drop(Project::create(&scene.with_file_name(OTHER), &contents).unwrap());
}

/// Opens the capture that the environment names, or a small one, and names classes through the class finder, so that
/// there is something to label with.
fn open(arguments: &[&str]) -> Result<(Window, Hands), String> {
    let write = |scene: &Path| match std::env::var_os(SCENE) {
        Some(own) => std::os::unix::fs::symlink(own, scene).unwrap(),
        None => {
            Small::get().write(scene);
            write_other(scene);
        }
    };
    let window = Window::open(write, arguments)?;
    let hands = Hands::new(&window.screen);
    for name in ["wall", "floor", "table"] {
        for commands in ["key c", &format!("type {name}"), "key Return"] {
            hands.act(commands);
            std::thread::sleep(STEP);
        }
    }
    Ok((window, hands))
}

#[test]
fn random_input_breaks_and_loses_nothing() {
    let length = Duration::from_secs(number(SECONDS, 20));
    let mut random = SmallRng::seed_from_u64(!number(SEED, 1));
    let (mut window, mut hands) = match open(&["--trace", TRACE]) {
        Ok(opened) => opened,
        Err(missing) => return skip(&missing),
    };
    let (start, mut memories, mut windows) = (Instant::now(), Vec::new(), 1);
    while start.elapsed() < length {
        act(&hands, &mut random);
        if let Some(ended) = window.running.ended() {
            // Random input finds File > Quit, too.
            assert!(ended.success(), "{ended}: {}", window.running.stderr());
            (window, hands) = open(&["--trace", TRACE]).unwrap();
            memories.clear();
            windows += 1;
        }
        memories.extend(memory(window.running.id()));
    }
    hands.act(LET_GO);
    std::thread::sleep(REST);
    assert!(window.running.ended().is_none(), "{}", window.running.stderr());
    let accepted = window.trace().last("labels").cloned();
    window.running.kill();
    let said = window.running.stderr();
    assert!(!said.contains("panicked"), "{said}");

    if let Some(accepted) = accepted {
        for event in ["compared", "audit", "exported"] {
            println!("{event}: {}", window.trace().count(event));
        }
        let file = window.trace().last("project").unwrap()["file"]
            .as_str()
            .map(PathBuf::from)
            .unwrap();
        let (_, contents) = Project::open(&file).unwrap();
        let labels = contents.history.labels();
        let newest = labels.strokes.last_key_value();
        let newest = newest.map(|(id, stroke)| (id.0, u64::from(stroke.class)));
        let told = &accepted["newest"];
        let told = told["id"].as_u64().zip(told["class"].as_u64());
        let (edits, strokes) = (contents.history.edits().0.len(), labels.strokes.len());
        println!("{windows} windows; {edits} edits, {strokes} strokes in {file:?}");
        assert_eq!(strokes as u64, accepted["strokes"].as_u64().unwrap());
        assert_eq!(newest, told);
    }
    let quarter = |index: usize| {
        let part = memories.len() / 4;
        let memories = memories[index * part..(index + 1) * part].iter();
        memories.copied().fold(0.0, f64::max)
    };
    if memories.len() >= 8 {
        let [second, last] = [1, 3].map(quarter);
        println!("memory: {second:.0} MB in the second quarter, {last:.0} MB in the last");
    }
    if length >= LONG && windows == 1 {
        assert!(quarter(3) <= GROWTH * quarter(1));
    }
}
