//! What is known of the scene as a whole: the frames' states, what the strokes say of each other, how it went.

use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;
use std::time::{Duration, Instant};

use inplace_core::labels::{ClassId, Label, LabelSet, StrokeId, VOID};
use inplace_core::scene::Scene;
use inplace_core::session::{FrameSummary, MapSlots, StrokeCheck};

use crate::comparison::Comparison;
use crate::document::Document;
use crate::frames::{FrameFacts, FrameList};
use crate::progress_log::ProgressLog;
use crate::versioned::Versioned;

/// Maps are summed up at most this often.
const PAUSE: Duration = Duration::from_millis(250);

/// Strokes that the others contradict, each with the class that those say.
pub type Contradicted = BTreeMap<StrokeId, ClassId>;

/// What is known about the labels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Evidence {
    /// Whether there are strokes or imported labels.
    pub says_anything: bool,
    /// Number of classes that strokes say; with imported labels, at least those there are.
    pub classes: usize,
    /// Strokes that say a class, so without void ones.
    pub strokes: usize,
    /// Strokes that could be checked against the others.
    pub checked: usize,
    /// Those that the others contradict.
    pub contradicted: usize,
    /// Mean share of unclear pixels over the frames, and the name of the frame that has most; `None` before all
    /// frames have maps.
    pub unclear: Option<(f32, String)>,
}

/// The state of a scene as a whole.
#[derive(Debug)]
pub struct Overview {
    /// The frames that the filmstrip shows, with the state of each.
    pub frames: FrameList,
    /// The frames' summaries, each with the version of the map that it was made from.
    summaries: Vec<(u64, Option<FrameSummary>)>,
    /// Whether summaries are being made.
    summarising: bool,
    next_summaries: Instant,
    checks: Vec<StrokeCheck>,
    /// The strokes of now that the others contradict.
    pub contradicted: Versioned<Arc<Contradicted>>,
    /// Cross-validated accuracy of the strokes, 0..=1.
    pub accuracy: Option<f32>,
    /// What speaks for and against exporting now.
    pub evidence: Evidence,
    /// How it went.
    pub log: ProgressLog,
    /// Whether something that the frames' states and the evidence follow from has changed.
    stale: bool,
}

impl Overview {
    /// Nothing is known of these frames.
    pub fn new(frames: usize, now: Instant) -> Self {
        Self {
            frames: FrameList::default(),
            summaries: vec![(0, None); frames],
            summarising: false,
            next_summaries: now,
            checks: Vec::new(),
            contradicted: Versioned::new(Arc::default()),
            accuracy: None,
            evidence: Evidence::default(),
            log: ProgressLog::new(now),
            stale: true,
        }
    }

    /// Mean of a number over the keyframes, whose maps can be summed up; `None` before every frame has a map.
    pub fn mean(&self, number: fn(&FrameSummary) -> f32) -> Option<f32> {
        let looked_at = self.summaries.iter().all(|&(version, _)| version > 0);
        let summaries = self.summaries.iter().filter_map(|(_, summary)| summary.as_ref());
        let (sum, count) = summaries
            .map(number)
            .fold((0.0, 0), |(sum, count), number| (sum + number, count + 1));
        (looked_at && count > 0).then(|| sum / count as f32)
    }

    /// The worker has checked the strokes.
    pub fn take_stroke_checks(&mut self, checks: Vec<StrokeCheck>, accuracy: Option<f32>) {
        (self.checks, self.accuracy) = (checks, accuracy);
        self.stale = true;
    }

    /// Labels or maps are new.
    pub fn changed(&mut self) {
        self.stale = true;
    }

    /// Brings frames and evidence up to date; costs nothing where nothing has changed.
    pub fn refresh(&mut self, scene: &Scene, document: &Document, comparison: Option<&Comparison>) {
        if !std::mem::take(&mut self.stale) {
            return;
        }
        let labels = document.labels();
        let mut facts: Vec<FrameFacts> = (self.summaries.iter().zip(0..))
            .map(|(&(_, summary), frame)| FrameFacts {
                strokes: document.strokes_of_frame(frame),
                contradicted: 0,
                checked: labels.checked.contains(&frame),
                summary,
                compared: comparison.and_then(|comparison| comparison.of_frame(frame)),
                has_no_summary: scene.frames.get(frame).is_some_and(|frame| !frame.is_keyframe()),
            })
            .collect();
        let mut contradicted = Contradicted::new();
        // Strokes may have gone, or got another class, since they were checked.
        let present = |check: &&StrokeCheck| labels.strokes.contains_key(&check.stroke);
        let checked = self.checks.iter().filter(present).count();
        for check in self.checks.iter().filter(|check| check.is_contradicted()) {
            let stroke = labels.strokes.get(&check.stroke);
            if let Some(stroke) = stroke.filter(|stroke| stroke.class != check.class) {
                contradicted.insert(check.stroke, check.class);
                if let Some(facts) = facts.get_mut(stroke.frame) {
                    facts.contradicted += 1;
                }
            }
        }
        if **self.contradicted != contradicted {
            self.contradicted = Versioned::new(Arc::new(contradicted));
        }
        self.frames.set_facts(facts);
        let said = labels.strokes.values().map(|stroke| stroke.class);
        let said = said.filter(|&class| class != VOID);
        let classes: BTreeSet<ClassId> = said.clone().collect();
        self.evidence = Evidence {
            says_anything: labels.says_anything(),
            // Imported labels have brought their classes.
            classes: if labels.imported.is_some() {
                labels.classes.len()
            } else {
                classes.len()
            },
            strokes: said.count(),
            checked,
            contradicted: self.contradicted.len(),
            unclear: self.unclear(scene),
        };
    }

    /// Mean share of unclear pixels, and the frame that has most.
    fn unclear(&self, scene: &Scene) -> Option<(f32, String)> {
        let share = self.mean(|summary| summary.unclear)?;
        let of_frames = self.summaries.iter().zip(&scene.frames);
        let most = of_frames.max_by(|((_, a), _), ((_, b), _)| {
            let unclear = |summary: &Option<FrameSummary>| summary.map_or(0.0, |summary| summary.unclear);
            unclear(a).total_cmp(&unclear(b))
        });
        most.map(|(_, frame)| (share, frame.stem.clone()))
    }

    /// What to sum up now, if anything: frames whose map is newer than their summary, with its version. One request
    /// is under way at a time; [`Overview::wake_in`] tells when to ask again.
    pub fn due(&mut self, versions: &[u64], now: Instant) -> Option<Vec<(usize, u64)>> {
        if self.summarising || now < self.next_summaries {
            return None;
        }
        let due: Vec<(usize, u64)> = (self.summaries.iter().zip(versions).enumerate())
            .filter(|(_, ((made, _), version))| made != *version)
            .map(|(frame, (_, &version))| (frame, version))
            .collect();
        self.summarising = !due.is_empty();
        self.summarising.then_some(due)
    }

    /// When the next summaries can be made, if not now.
    pub fn wake_in(&self, now: Instant) -> Option<Duration> {
        self.next_summaries
            .checked_duration_since(now)
            .filter(|wait| !wait.is_zero())
    }

    /// Takes summaries over.
    pub fn take_summaries(&mut self, made: Vec<Summarised>, now: Instant) {
        self.summarising = false;
        self.next_summaries = now + PAUSE;
        for (frame, version, summary) in made {
            if let Some(slot) = self.summaries.get_mut(frame) {
                *slot = (version, summary);
            }
        }
        self.stale = true;
    }
}

/// A frame, the version of its map, and what that comes to.
pub type Summarised = (usize, u64, Option<FrameSummary>);

/// Sums up the newest maps of frames by these labels: off the UI thread.
pub fn summarise(maps: &MapSlots, labels: &LabelSet, due: Vec<(usize, u64)>) -> Vec<Summarised> {
    // What images say of deleted classes, nobody says.
    let listed = |label: Label| match labels.class(label.class) {
        Some(_) => label,
        None => VOID.into(),
    };
    let summary = |frame: usize| {
        let map = maps.get(frame)?;
        let image = labels
            .imported
            .as_ref()
            .and_then(|imported| imported.of_frame(frame));
        map.summary(image.map(|image| image.relabelled(listed)).as_ref())
    };
    due.into_iter()
        .map(|(frame, version)| (frame, version, summary(frame)))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_new_maps_are_summed_up_and_one_request_at_a_time() {
        let start = Instant::now();
        let mut overview = Overview::new(3, start);
        assert_eq!(overview.due(&[0, 0, 0], start), None);
        assert_eq!(overview.due(&[1, 0, 2], start), Some(vec![(0, 1), (2, 2)]));
        assert_eq!(overview.due(&[1, 1, 2], start), None);
        let summary = FrameSummary {
            unclear: 0.5,
            ..FrameSummary::default()
        };
        overview.take_summaries(vec![(0, 1, Some(summary)), (2, 2, Some(summary))], start);
        assert_eq!(overview.due(&[1, 1, 2], start), None);
        assert_eq!(overview.wake_in(start), Some(PAUSE));
        assert_eq!(overview.due(&[1, 1, 2], start + PAUSE), Some(vec![(1, 1)]));
        assert_eq!(overview.mean(|summary| summary.unclear), None);
        overview.take_summaries(vec![(1, 1, Some(FrameSummary::default()))], start + PAUSE);
        let mean = overview.mean(|summary| summary.unclear);
        assert!(mean.is_some_and(|mean| (mean - 1.0 / 3.0).abs() < 1e-6));
    }
}
