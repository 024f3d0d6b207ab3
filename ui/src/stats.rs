//! How fast the window is: what is presented and when, from a click to its overlay, and CPU time of each frame.

use std::sync::PoisonError;
use std::time::{Duration, Instant};

use inplace_core::labels::Stroke;

use crate::canvas::UploadClock;

/// Most values kept of one kind; the newest stay.
const MOST: usize = 100_000;

/// Longest time between two frames that is no rest of the pointer.
const MOST_INTERVAL: Duration = Duration::from_secs(1);

/// Measured durations of one kind.
#[derive(Debug, Default)]
pub struct Samples {
    milliseconds: std::collections::VecDeque<f32>,
}

/// The values that stand for many.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Number of values.
    pub count: usize,
    /// Half of the values are at most this, in milliseconds.
    pub p50: f32,
    /// 95% of the values are at most this, in milliseconds.
    pub p95: f32,
    /// The largest value, in milliseconds.
    pub max: f32,
}

impl Samples {
    fn add(&mut self, duration: Duration) {
        if self.milliseconds.len() == MOST {
            self.milliseconds.pop_front();
        }
        self.milliseconds.push_back(duration.as_secs_f32() * 1000.0);
    }

    /// Percentiles (nearest rank) of the values so far.
    pub fn summary(&self) -> Summary {
        let mut sorted: Vec<f32> = self.milliseconds.iter().copied().collect();
        sorted.sort_by(f32::total_cmp);
        let rank = |share: f32| {
            let index = (share * sorted.len() as f32).ceil() as usize;
            sorted.get(index.saturating_sub(1)).copied().unwrap_or(0.0)
        };
        Summary {
            count: sorted.len(),
            p50: rank(0.5),
            p95: rank(0.95),
            max: rank(1.0),
        }
    }
}

impl Summary {
    fn json(&self) -> String {
        format!(
            r#"{{"n":{},"p50":{:.2},"p95":{:.2},"max":{:.2}}}"#,
            self.count, self.p50, self.p95, self.max
        )
    }
}

/// When something was shown for the first time.
#[derive(Clone, Copy, Debug, Default)]
enum First {
    /// Not yet.
    #[default]
    Missing,
    /// In the frame that was made last.
    Made,
    /// In a frame that was presented by then.
    Presented(Instant),
}

impl First {
    fn frame_begins(&mut self, now: Instant) {
        if matches!(self, Self::Made) {
            *self = Self::Presented(now);
        }
    }

    /// A frame was made that shows it or not. Returns whether that is the first that does.
    fn frame_made(&mut self, shown: bool) -> bool {
        if shown && matches!(self, Self::Missing) {
            *self = Self::Made;
        }
        matches!(self, Self::Made)
    }

    /// Milliseconds from `start` until it was presented.
    fn json(self, start: Option<Instant>) -> String {
        match (self, start) {
            (Self::Presented(when), Some(start)) => format!("{:.0}", (when - start).as_secs_f64() * 1000.0),
            _ => "null".to_owned(),
        }
    }
}

/// Everything measured.
#[derive(Debug, Default)]
pub struct Stats {
    /// What draws the window, in words.
    renderer: String,
    /// When the program started.
    started: Option<Instant>,
    /// The first image of a frame.
    first_frame: First,
    /// The first map over it.
    first_map: First,
    /// From a presented frame in which the pointer moved or a button was down to the next.
    pub presented: Samples,
    /// From the release of a click to the end of the frame that was the first to show its labels.
    pub click_to_presented: Samples,
    /// From the beginning of the frame in which the pointer reached a place to the end of the frame that was the first to
    /// outline what a click there would win.
    pub hover_to_presented: Samples,
    /// CPU time of the window's thread from one frame to the next: everything that it does, waiting excluded.
    pub thread: Samples,
    clock: UploadClock,
    /// CPU time of this thread when the last frame began.
    thread_time: Option<Duration>,
    /// The last click that still waits for its overlay: label generation, frame, time of release.
    waiting: Option<(u64, usize, Instant)>,
    /// Release of the click whose labels the newest frame is the first to show.
    showing: Option<Instant>,
    /// The click that was asked about last, and when the pointer reached its place.
    asked: Option<(Stroke, Instant)>,
    /// When the pointer reached the place whose outline the newest frame is the first to show.
    outlining: Option<Instant>,
    /// When the newest frame began.
    began: Option<Instant>,
    /// When the newest frame began, if the pointer was active in it.
    active_since: Option<Instant>,
}

impl Stats {
    /// Measures uploads with this clock, in a window that this draws, of a program that started then.
    pub fn new(clock: UploadClock, renderer: String, started: Instant) -> Self {
        Self {
            renderer,
            clock,
            started: Some(started),
            ..Self::default()
        }
    }

    /// A click led to labels of this generation.
    pub fn clicked(&mut self, generation: u64, frame: usize) {
        self.waiting.get_or_insert((generation, frame, Instant::now()));
    }

    /// The worker is asked what this click at the pointer would win.
    pub fn asked(&mut self, stroke: Stroke) {
        self.asked = self.began.map(|began| (stroke, began));
    }

    /// What this click would win is outlined in the frame being made.
    pub fn outlined(&mut self, stroke: &Stroke) {
        if let Some((_, began)) = self.asked.take_if(|(asked, _)| *asked == *stroke) {
            self.outlining = Some(began);
        }
    }

    /// This frame is in view: what is waited for on another one may never be shown.
    pub fn in_view(&mut self, frame: usize) {
        self.waiting.take_if(|(_, clicked, _)| *clicked != frame);
    }

    /// A frame begins, so the one before was presented; `active` = the pointer moves or a button is down.
    pub fn frame_begins(&mut self, now: Instant, active: bool) {
        self.first_frame.frame_begins(now);
        self.first_map.frame_begins(now);
        if let Some(clicked) = self.showing.take() {
            self.click_to_presented.add(now - clicked);
        }
        if let Some(reached) = self.outlining.take() {
            self.hover_to_presented.add(now - reached);
        }
        self.began = Some(now);
        // After a longer time the pointer rested.
        if let Some(interval) = self.active_since.map(|before| now - before)
            && interval < MOST_INTERVAL
        {
            self.presented.add(interval);
        }
        self.active_since = active.then_some(now);
        let spent = thread_time();
        if let (Some(before), Some(spent)) = (self.thread_time, spent) {
            self.thread.add(spent.saturating_sub(before));
        }
        self.thread_time = spent;
    }

    /// A frame was made. Returns whether another one has to follow, to tell when this one was presented.
    pub fn frame_made(&mut self) -> bool {
        let uploaded = *self.clock.lock().unwrap_or_else(PoisonError::into_inner);
        if let (Some((wanted, frame, clicked)), Some((generation, shown, time))) =
            (self.waiting, uploaded.map)
            && generation >= wanted
            && shown == frame
            && time >= clicked
        {
            self.waiting = None;
            self.showing = Some(clicked);
        }
        let image = self.first_frame.frame_made(uploaded.image);
        let map = self.first_map.frame_made(uploaded.map.is_some());
        image || map || self.showing.is_some() || self.outlining.is_some()
    }

    /// All summaries as one line of JSON, in milliseconds.
    pub fn json(&self) -> String {
        format!(
            r#"{{"renderer":{:?},"first_frame_ms":{},"first_map_ms":{},"presented_ms":{},"click_to_presented_ms":{},"hover_to_presented_ms":{},"thread_ms":{}}}"#,
            self.renderer,
            self.first_frame.json(self.started),
            self.first_map.json(self.started),
            self.presented.summary().json(),
            self.click_to_presented.summary().json(),
            self.hover_to_presented.summary().json(),
            self.thread.summary().json()
        )
    }
}

/// CPU time that this thread has used; `None` where the system does not tell.
#[cfg(unix)]
fn thread_time() -> Option<Duration> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ThreadCPUTime);
    Duration::try_from(time).ok()
}

/// CPU time that this thread has used; `None` where the system does not tell.
#[cfg(not(unix))]
fn thread_time() -> Option<Duration> {
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_values_that_were_measured() {
        let mut samples = Samples::default();
        for milliseconds in 1..=100 {
            samples.add(Duration::from_millis(milliseconds));
        }
        let summary = samples.summary();
        assert_eq!((summary.p50, summary.p95, summary.max), (50.0, 95.0, 100.0));
        assert_eq!(Samples::default().summary(), Summary::default());
    }

    #[test]
    #[cfg(unix)]
    fn waiting_takes_no_cpu_time_of_the_thread() {
        let mut stats = Stats::default();
        stats.frame_begins(Instant::now(), false);
        std::thread::sleep(Duration::from_millis(40));
        stats.frame_begins(Instant::now(), false);
        let summary = stats.thread.summary();
        assert_eq!(summary.count, 1);
        assert!(summary.max < 20.0, "{summary:?}");
    }

    #[test]
    fn intervals_count_while_the_pointer_is_active_and_a_click_until_its_frame_is_presented() {
        let mut stats = Stats::default();
        let start = Instant::now();
        let at = |milliseconds| start + Duration::from_millis(milliseconds);
        for milliseconds in [0, 20, 50, 90, 150, 1190] {
            stats.frame_begins(at(milliseconds), milliseconds != 90);
        }
        let summary = stats.presented.summary();
        assert_eq!((summary.count, summary.p50, summary.max), (3, 30.0, 40.0));
        stats.showing = Some(at(1000));
        assert!(stats.frame_made());
        stats.frame_begins(at(1100), false);
        assert_eq!(stats.click_to_presented.summary().max, 100.0);
        assert!(!stats.frame_made());
    }

    #[test]
    fn what_is_shown_first_counts_until_its_frame_is_presented() {
        let (clock, start) = (UploadClock::default(), Instant::now());
        let mut stats = Stats::new(UploadClock::clone(&clock), String::new(), start);
        let begins = |stats: &mut Stats, at| stats.frame_begins(start + Duration::from_millis(at), false);
        begins(&mut stats, 100);
        assert!(!stats.frame_made());
        clock.lock().unwrap().image = true;
        assert!(stats.frame_made());
        begins(&mut stats, 250);
        assert!(!stats.frame_made());
        begins(&mut stats, 400);
        let json = stats.json();
        let first = r#""first_frame_ms":250,"first_map_ms":null"#;
        assert!(json.contains(first), "{json}");
    }

    #[test]
    fn a_click_waits_for_a_map_of_its_own_generation_and_frame() {
        let clock = UploadClock::default();
        let mut stats = Stats::new(UploadClock::clone(&clock), String::new(), Instant::now());
        stats.clicked(5, 2);
        let upload =
            |generation, frame| clock.lock().unwrap().map = Some((generation, frame, Instant::now()));
        for (generation, frame) in [(4, 2), (5, 1)] {
            upload(generation, frame);
            stats.frame_made();
            assert!(stats.showing.is_none());
        }
        upload(6, 2);
        assert!(stats.frame_made() && stats.showing.is_some());
    }
}
