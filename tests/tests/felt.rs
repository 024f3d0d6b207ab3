//! What a person feels of the window: frames presented while the pointer moves and a brush is dragged, the time from a
//! click to its labels on the screen, and a window at rest that takes no time.
//!
//! A short run on every push; `INPLACE_FELT_SECONDS=60 cargo test --release -p inplace-tests --test felt -- --nocapture`
//! on a quiet machine is the measurement, with the demo at its full size.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use inplace_core::scene::demo::Shot;
use inplace_tests::{Hands, PATIENCE, Small, TRACE, Window, number, skip};
use serde_json::Value;

const SECONDS: &str = "INPLACE_FELT_SECONDS";
/// Shortest length of a run at which the limits hold: builds for tests are slower, and run beside other tests.
const LONG: u64 = 60;
const SLACK: f64 = if cfg!(debug_assertions) { 8.0 } else { 4.0 };
/// Milliseconds between presented frames, at the 95th percentile, at rest and while training.
const PRESENTED: [f64; 2] = [33.0, 50.0];
/// Milliseconds from a click to its labels on the screen, at the median and the 95th percentile.
const CLICK: [f64; 2] = [120.0, 250.0];
/// Share of one core that a settled window takes.
const AT_REST: f64 = 0.02;
/// Screens are refreshed, and pointers move, about every so many milliseconds.
const MOVE: Duration = Duration::from_millis(16);
/// After a click: its labels are there, and a person goes to the next place.
const NEXT: Duration = Duration::from_millis(400);
/// A brush is dragged so long in a frame, then in the next one.
const STROKE: Duration = Duration::from_secs(2);
/// Where frames are on the screen: left, top, width and height, away from all panels.
const FRAME: [u64; 4] = [420, 180, 420, 320];

/// One window at a time: what is measured of one is not to be that of the other.
static ALONE: Mutex<()> = Mutex::new(());

/// The place with this number on a path that fills the frame.
fn place(number: u64) -> String {
    let [left, top, width, height] = FRAME;
    let (x, y) = (left + 7 * number % width, top + 5 * number % height);
    format!("mousemove {x} {y}")
}

/// Moves the pointer over the frame for some time.
fn wander(hands: &Hands, length: Duration) {
    let start = Instant::now();
    for number in 0.. {
        if start.elapsed() > length {
            break;
        }
        hands.act(&place(number));
        std::thread::sleep(MOVE);
    }
}

/// CPU seconds that a process has used.
fn used(process: u32) -> f64 {
    let stat = fs::read_to_string(format!("/proc/{process}/stat")).unwrap();
    // Behind the name in brackets: ticks of a hundredth of a second in user and in kernel mode.
    let fields = stat.rsplit_once(") ").unwrap().1.split(' ').skip(11).take(2);
    let ticks = fields.map(|ticks| ticks.parse::<f64>().unwrap());
    ticks.sum::<f64>() / 100.0
}

/// Measures a window opened with these arguments; `trains` tells whether it trains all the while.
fn measured(trains: bool, arguments: &[&str]) {
    let _alone = ALONE.lock();
    let seconds = number(SECONDS, 6);
    let write = |scene: &Path| {
        if seconds >= LONG {
            Small::of(Shot::default()).write(scene);
        } else {
            Small::get().write(scene);
        }
    };
    let arguments = [&["--stats", "--trace", TRACE], arguments].concat();
    let window = match Window::open(write, &arguments) {
        Ok(window) => window,
        Err(missing) => return skip(&missing),
    };
    for name in ["wall", "floor"] {
        window.fill(|window| window.screen.key("c"), name);
    }
    let hands = Hands::new(&window.screen);
    let click = |number: u64| {
        hands.press(["1", "2"][number as usize % 2]);
        let place = place(31 * number);
        hands.act(&format!("{place} sleep 0.02 mousedown 1 sleep 0.02 mouseup 1"));
        std::thread::sleep(NEXT);
    };
    // The first labels wait for a surface, which is not what a click takes: it counts no more in another frame.
    (0..2).for_each(click);
    hands.press("d");
    window.follow();
    (2..2 + 2 * seconds).for_each(click);
    wander(&hands, Duration::from_secs(seconds) / 2);
    for _ in 0..(seconds / 4) {
        hands.press("d");
        hands.act("mousedown 1");
        wander(&hands, STROKE);
        hands.act("mouseup 1");
    }
    window.follow();
    let share = (!trains).then(|| {
        std::thread::sleep(Duration::from_secs(2));
        let (start, before) = (Instant::now(), used(window.running.id()));
        std::thread::sleep(Duration::from_secs(seconds));
        (used(window.running.id()) - before) / start.elapsed().as_secs_f64()
    });

    window.screen.close_window(&window.id);
    let outcome = window.running.wait(PATIENCE);
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let line = outcome.stderr.lines().find(|line| line.starts_with('{')).unwrap();
    println!("training: {trains}, share of a core at rest: {share:?}, {line}");
    let felt: Value = serde_json::from_str(line).unwrap();
    let slack = if seconds >= LONG { 1.0 } else { SLACK };
    let at_most = |name: &str, percentile: &str, limit: f64| {
        assert!(felt[name]["n"].as_u64().unwrap() >= seconds, "{name}: {line}");
        let measured = felt[name][percentile].as_f64().unwrap();
        assert!(measured <= slack * limit, "{name} {percentile}: {line}");
    };
    at_most("presented_ms", "p95", PRESENTED[usize::from(trains)]);
    at_most("click_to_presented_ms", "p50", CLICK[0]);
    at_most("click_to_presented_ms", "p95", CLICK[1]);
    assert!(share.is_none_or(|share| share <= slack * AT_REST), "{share:?}");
}

#[test]
fn a_settled_window_follows_the_hand_and_then_takes_no_time() {
    measured(false, &[]);
}

#[test]
fn a_window_that_trains_follows_the_hand() {
    measured(true, &["--no-depth", "--preset", "accurate"]);
}
