//! The suggested places as the person goes through them: which one is at hand, what was answered, what was skipped.
//!
//! The worker makes a new list whenever maps change. A place that somebody looks at must not change under their hands,
//! so it stays as it is until it is answered, skipped or left; and a list that does not know the newest answer yet is
//! not taken at all.

use std::time::{Duration, Instant};

use inplace_core::guide::Suggestion;
use inplace_core::labels::{ClassId, Edit, StrokeId};

use crate::view::crossings;

/// How long the next place may take before it is said that it takes longer.
pub const A_MOMENT: Duration = Duration::from_secs(2);
/// Places nearer to each other than this are the same, in metres: half as far as suggestions keep apart.
const SAME: f32 = 0.2;
/// Most suggestions listed: as many as the worker makes.
const MOST: usize = 8;

/// What the person is at.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Mode {
    /// Something other than the suggestions.
    #[default]
    Away,
    /// The place with this index in the list.
    At(usize),
    /// Waiting for the next place, since then.
    Looking(Instant),
}

/// An answer that can be taken back.
#[derive(Clone, Debug)]
struct Answer {
    stroke: StrokeId,
    index: usize,
    class: ClassId,
    place: Suggestion,
}

/// The suggested places and where the person is among them.
#[derive(Debug, Default)]
pub struct Suggestions {
    /// The places, best first; one that the person is at keeps its number.
    pub listed: Vec<Suggestion>,
    /// Generation of the labels that the list was made from.
    pub generation: u64,
    /// Changes with the list.
    pub version: u64,
    /// What the person is at.
    pub mode: Mode,
    /// What each listed place was answered with, until the next list.
    answers: Vec<Option<ClassId>>,
    /// Whether other labels have settled the place at hand meanwhile.
    pub settled: bool,
    skipped: Vec<Suggestion>,
    given: Vec<Answer>,
    taken_back: Vec<Answer>,
    /// Whether the list must stay as it is, since a hand is on it.
    pub held: bool,
    /// The list that waits for the end of that.
    waiting: Option<Vec<Suggestion>>,
}

impl Suggestions {
    /// Whether keys answer suggestions.
    pub fn is_active(&self) -> bool {
        self.mode != Mode::Away
    }

    /// Index of the place that the person is at.
    pub fn at(&self) -> Option<usize> {
        match self.mode {
            Mode::At(index) => Some(index),
            Mode::Away | Mode::Looking(_) => None,
        }
    }

    /// The place that the person is at.
    pub fn place_at_hand(&self) -> Option<&Suggestion> {
        self.listed.get(self.at()?)
    }

    /// What a listed place was answered with, until the next list.
    pub fn answer_of(&self, index: usize) -> Option<ClassId> {
        self.answers.get(index).copied().flatten()
    }

    /// The class of the newest answer that can be taken back.
    pub fn last_answer(&self) -> Option<ClassId> {
        self.given.last().map(|answer| answer.class)
    }

    /// Number of skipped places that are not suggested.
    pub fn skipped(&self) -> usize {
        self.skipped.len()
    }

    /// Takes a new list over, made from labels of `generation`; `newest` is that of the labels of now. Returns the index
    /// of the place that was waited for, if there is one now; where there is no place any more, the waiting ends.
    pub fn take_list(&mut self, generation: u64, mut list: Vec<Suggestion>, newest: u64) -> Option<usize> {
        if generation < newest {
            return None;
        }
        let labels_changed = generation > self.generation;
        if self.held && !labels_changed && !matches!(self.mode, Mode::Looking(_)) {
            self.waiting = Some(list);
            return None;
        }
        self.generation = generation;
        self.waiting = None;
        self.skipped.retain(|skipped| is_as_before(skipped, &list));
        list.retain(|place| !self.skipped.iter().any(|skipped| is_same(skipped, place)));
        let kept = self.at().map(|index| (index, self.listed[index].clone()));
        self.version += 1;
        let Some((index, place)) = kept else {
            self.list(list);
            return self.arrive();
        };
        let still_there = list.iter().any(|other| is_same(other, &place));
        if labels_changed {
            self.settled = !still_there;
        }
        list.retain(|other| !is_same(other, &place) && !is_in_region(other, &place));
        let index = index.min(list.len());
        list.insert(index, place);
        list.truncate(MOST.max(index + 1));
        self.list(list);
        self.mode = Mode::At(index);
        None
    }

    /// Lists these places, none of them answered.
    fn list(&mut self, list: Vec<Suggestion>) {
        self.answers = vec![None; list.len()];
        self.listed = list;
    }

    /// Goes on to the first place if that is what was waited for.
    fn arrive(&mut self) -> Option<usize> {
        if !matches!(self.mode, Mode::Looking(_)) {
            return None;
        }
        if self.go_to(0) {
            return Some(0);
        }
        self.leave();
        None
    }

    /// While `held`, a new list of the same labels waits, so that nothing moves under the pointer.
    pub fn hold(&mut self, held: bool) {
        self.held = held;
        if !held && let Some(list) = self.waiting.take() {
            let generation = self.generation;
            self.take_list(generation, list, generation);
        }
    }

    /// Goes to a listed place; returns whether there is one with this index.
    pub fn go_to(&mut self, index: usize) -> bool {
        let there = index < self.listed.len();
        if there {
            self.mode = Mode::At(index);
            self.settled = false;
        }
        there
    }

    /// Goes to the first place, or on to the next one that was not answered, or with `backwards` to the one before;
    /// returns its index.
    pub fn step(&mut self, backwards: bool) -> Option<usize> {
        let count = self.listed.len();
        let from = match (self.at(), backwards) {
            (Some(index), false) => index + 1,
            (Some(index), true) => index + count - 1,
            (None, false) => 0,
            (None, true) => count.saturating_sub(1),
        };
        self.go_on(from, backwards)
    }

    /// Goes to the first place that was not answered, looking from this one on or back; returns its index.
    fn go_on(&mut self, from: usize, backwards: bool) -> Option<usize> {
        let count = self.listed.len();
        let order = |offset: usize| match backwards {
            false => (from + offset) % count,
            true => (from + count - offset) % count,
        };
        let mut places = (0..count).map(order);
        let next = places.find(|&index| self.answers[index].is_none())?;
        self.go_to(next);
        Some(next)
    }

    /// Ends the going from place to place: keys do what they always do.
    pub fn leave(&mut self) {
        self.mode = Mode::Away;
        self.settled = false;
    }

    /// A listed place was answered by a stroke. Whoever goes from place to place now waits for the next one.
    pub fn answered(&mut self, index: usize, class: ClassId, stroke: StrokeId) {
        let Some(place) = self.listed.get(index) else {
            return;
        };
        self.given.push(Answer {
            stroke,
            index,
            class,
            place: place.clone(),
        });
        self.taken_back.clear();
        self.mark(index, class);
    }

    fn mark(&mut self, index: usize, class: ClassId) {
        self.answers[index] = Some(class);
        // That list does not know the answer.
        self.waiting = None;
        if self.is_active() {
            self.mode = Mode::Looking(Instant::now());
            self.settled = false;
        }
    }

    /// Leaves the place at hand out until something else is likely there; returns the index of the next one.
    pub fn skip(&mut self) -> Option<usize> {
        let index = self.at()?;
        self.skipped.push(self.listed.remove(index));
        self.version += 1;
        self.answers.remove(index);
        self.leave();
        self.go_on(index, false)
    }

    /// Lists the skipped places again, behind the others.
    pub fn list_skipped(&mut self) {
        self.listed.append(&mut self.skipped);
        self.answers.resize(self.listed.len(), None);
        self.version += 1;
    }

    /// An undo or a redo was applied. An undone answer is shown again to whoever goes from place to place, a redone one
    /// counts as answered again; returns the index of a place to show.
    pub fn history_stepped(&mut self, edit: &Edit) -> Option<usize> {
        let change_of = |stroke: StrokeId| edit.strokes.iter().find(|change| change.id == stroke);
        let removed = |stroke| change_of(stroke).is_some_and(|change| change.after.is_none());
        let added = |stroke| change_of(stroke).is_some_and(|change| change.before.is_none());
        if let Some(answer) = self.given.pop_if(|answer| removed(answer.stroke)) {
            let index = self.list_again(&answer);
            self.taken_back.push(answer);
            return (self.is_active() && self.go_to(index)).then_some(index);
        }
        if let Some(answer) = self.taken_back.pop_if(|answer| added(answer.stroke)) {
            let index = self.list_again(&answer);
            self.mark(index, answer.class);
            self.given.push(answer);
        }
        None
    }

    /// Index of the place of an answer, which is listed again if it no longer is.
    fn list_again(&mut self, answer: &Answer) -> usize {
        let known = self.listed.iter().position(|place| is_same(place, &answer.place));
        let index = known.unwrap_or_else(|| {
            let index = answer.index.min(self.listed.len());
            self.listed.insert(index, answer.place.clone());
            self.answers.insert(index, None);
            index
        });
        self.version += 1;
        self.answers[index] = None;
        index
    }
}

fn is_same(a: &Suggestion, b: &Suggestion) -> bool {
    a.position.distance(b.position) < SAME
}

/// Whether a place lies in the region of another, as far as one frame tells.
fn is_in_region(place: &Suggestion, of: &Suggestion) -> bool {
    let [x, y] = place.pixel.map(|at| at as f32 + 0.5);
    let crossings = crossings(&of.outline, y);
    let left = crossings.iter().filter(|&&crossing| crossing < x);
    place.frame == of.frame && left.count() % 2 == 1
}

/// Whether a list says of a place what it said before, or nothing.
fn is_as_before(place: &Suggestion, list: &[Suggestion]) -> bool {
    let likely = |place: &Suggestion| place.classes.first().map(|likely| likely.class);
    let mut same = list.iter().filter(|other| is_same(other, place));
    same.all(|other| likely(other) == likely(place))
}

#[cfg(test)]
mod tests {
    use super::*;
    use inplace_core::guide::Likely;

    /// A place at `x` metres that is most likely of a class.
    fn place(x: f32, class: ClassId) -> Suggestion {
        Suggestion {
            frame: 0,
            pixel: [10, 10],
            position: [x, 0.0, 0.0].into(),
            outline: Vec::new(),
            share: 0.1,
            classes: vec![Likely {
                class,
                object: None,
                probability: 0.6,
            }],
        }
    }

    fn positions(suggestions: &Suggestions) -> Vec<f32> {
        suggestions.listed.iter().map(|place| place.position.x).collect()
    }

    fn at_the_second_of(list: &[f32]) -> Suggestions {
        let mut suggestions = Suggestions::default();
        suggestions.take_list(1, list.iter().map(|&x| place(x, 1)).collect(), 1);
        suggestions.step(false);
        suggestions.step(false);
        suggestions
    }

    #[test]
    fn the_place_at_hand_keeps_its_number_and_its_words() {
        let mut suggestions = at_the_second_of(&[1.0, 2.0, 3.0]);
        let list = vec![place(4.0, 2), place(2.05, 2), place(1.0, 2)];
        assert_eq!(suggestions.take_list(1, list, 1), None);
        assert_eq!(positions(&suggestions), [4.0, 2.0, 1.0]);
        assert_eq!(suggestions.at(), Some(1));
        assert_eq!(suggestions.listed[1].classes[0].class, 1);
        assert!(!suggestions.settled);
        suggestions.take_list(1, Vec::new(), 1);
        assert_eq!((positions(&suggestions), suggestions.at()), (vec![2.0], Some(0)));
        assert!(!suggestions.settled, "the labels are the same");
        suggestions.take_list(2, vec![place(5.0, 1)], 2);
        assert!(suggestions.settled, "other labels have settled it");
    }

    #[test]
    fn what_lies_in_the_region_at_hand_is_not_listed_beside_it() {
        let mut suggestions = Suggestions::default();
        let mut wall = place(1.0, 1);
        wall.outline = vec![[0.0, 0.0], [0.0, 50.0], [50.0, 50.0], [50.0, 0.0]];
        suggestions.take_list(1, vec![wall], 1);
        suggestions.step(false);
        let at = |x: f32, frame: usize, pixel| Suggestion {
            frame,
            pixel,
            ..place(x, 1)
        };
        let list = vec![at(2.0, 0, [40, 40]), at(3.0, 0, [60, 40]), at(4.0, 1, [40, 40])];
        suggestions.take_list(1, list, 1);
        assert_eq!(positions(&suggestions), [1.0, 3.0, 4.0]);
    }
}
