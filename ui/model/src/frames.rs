//! Which frames the filmstrip shows and in which order: filters, sorting, stepping, finding one by name.

use inplace_core::session::FrameSummary;

use crate::comparison::Counts;

/// With more than this share of unclear pixels a scene is not quite done, and a frame is uncertain.
pub const UNCERTAIN: f32 = 0.05;
/// A frame's imported labels differ from its map above this share of the pixels.
const DISAGREEING: f32 = 0.1;

/// Which frames are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FrameFilter {
    /// All of them.
    #[default]
    All,
    /// Those without strokes.
    Unlabelled,
    /// Those with more unclear pixels than a finished frame has.
    Uncertain,
    /// Those that nobody has marked as checked.
    Unchecked,
    /// Those whose strokes or imported labels are contradicted.
    Disagreeing,
}

impl FrameFilter {
    /// All filters, in the order shown.
    pub const ALL: [Self; 5] = [
        Self::All,
        Self::Unlabelled,
        Self::Uncertain,
        Self::Unchecked,
        Self::Disagreeing,
    ];
}

/// In which order frames are shown.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FrameOrder {
    /// As in the scene.
    #[default]
    Capture,
    /// The highest mean entropy first.
    Uncertainty,
    /// Those that differ most from the project that is compared with first.
    Difference,
}

impl FrameOrder {
    /// The orders that there are, in the order shown; `compared` says whether there is another project.
    pub fn present(compared: bool) -> impl Iterator<Item = Self> {
        let difference = compared.then_some(Self::Difference);
        [Self::Capture, Self::Uncertainty].into_iter().chain(difference)
    }
}

/// What is known of a frame.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct FrameFacts {
    /// Number of strokes.
    pub strokes: usize,
    /// Number of strokes that the others contradict.
    pub contradicted: usize,
    /// Whether a person has marked it as checked.
    pub checked: bool,
    /// What its map comes to, once it has one.
    pub summary: Option<FrameSummary>,
    /// How it was counted against the project that is compared with, if it was.
    pub compared: Option<Counts>,
    /// Whether its map is summed up at all: those of frames that are no keyframes are not.
    pub has_no_summary: bool,
}

impl FrameFacts {
    /// Whether a filter lets the frame through.
    pub fn passes(&self, filter: FrameFilter) -> bool {
        let summary = |holds: fn(&FrameSummary) -> bool| self.summary.as_ref().is_some_and(holds);
        match filter {
            FrameFilter::All => true,
            FrameFilter::Unlabelled => self.strokes == 0,
            FrameFilter::Uncertain => summary(|summary| summary.unclear > UNCERTAIN),
            FrameFilter::Disagreeing => {
                self.contradicted > 0 || summary(|summary| summary.disagreeing > DISAGREEING)
            }
            FrameFilter::Unchecked => !self.checked,
        }
    }
}

/// The frames shown.
#[derive(Clone, Debug, Default)]
pub struct FrameList {
    /// The filter in force.
    pub filter: FrameFilter,
    /// The order in force.
    pub order: FrameOrder,
    facts: Vec<FrameFacts>,
    /// Place of every frame among all. By what is known of the frames it stays as it was when that was chosen: frames that change
    /// their places while one steps through them would be seen twice, or never.
    rank: Vec<usize>,
    /// Whether everything was known of every frame when the places were given.
    complete: bool,
    /// The frames shown, in order.
    pub shown: Vec<usize>,
    counts: [usize; FrameFilter::ALL.len()],
}

impl FrameList {
    /// How many frames pass a filter.
    pub fn count(&self, filter: FrameFilter) -> usize {
        self.counts[filter as usize]
    }

    /// What is known of a frame.
    pub fn facts(&self, frame: usize) -> FrameFacts {
        self.facts.get(frame).copied().unwrap_or_default()
    }

    /// Takes over what is known now of every frame.
    pub fn set_facts(&mut self, facts: Vec<FrameFacts>) {
        let grown = facts.len() != self.rank.len();
        self.facts = facts;
        if grown || !self.complete {
            self.sort();
        }
        self.select();
    }

    /// What frames were sorted by no longer holds: they are sorted anew as soon as all is known of them.
    pub fn forget_order(&mut self) {
        self.complete = false;
    }

    /// Chooses a filter; frames are sorted anew.
    pub fn set_filter(&mut self, filter: FrameFilter) {
        self.filter = filter;
        self.sort();
        self.select();
    }

    /// Chooses an order.
    pub fn set_order(&mut self, order: FrameOrder) {
        self.order = order;
        self.sort();
        self.select();
    }

    /// The frame so many places from another one, which need not be shown itself; `None` beyond the ends.
    pub fn step(&self, from: usize, by: isize) -> Option<usize> {
        let target = match self.search(from) {
            Ok(index) => index.checked_add_signed(by),
            // Where it would stand: the next one forward is at that place already.
            Err(index) if by > 0 => index.checked_add_signed(by - 1),
            Err(index) => index.checked_add_signed(by),
        };
        self.shown.get(target?).copied()
    }

    /// Where a frame is shown.
    pub fn index_of(&self, frame: usize) -> Option<usize> {
        self.search(frame).ok()
    }

    /// Where a frame is shown, or else would stand.
    fn search(&self, frame: usize) -> Result<usize, usize> {
        let place = self.place(frame);
        self.shown
            .binary_search_by_key(&place, |&shown| self.place(shown))
    }

    fn place(&self, frame: usize) -> usize {
        self.rank.get(frame).copied().unwrap_or(usize::MAX)
    }

    fn sort(&mut self) {
        // Frames without a map are the least known; of those that are no keyframes nothing is.
        let entropy = |frame: usize| {
            let summary = self.facts[frame].summary;
            summary.map_or(f32::INFINITY, |summary| summary.mean_entropy)
        };
        let unknown = |frame: usize| self.facts[frame].has_no_summary;
        // Frames on which nothing is labelled twice come last.
        let agreement = |frame: usize| {
            let agreement = self.facts[frame].compared.and_then(|counts| counts.agreement());
            agreement.unwrap_or(f64::INFINITY)
        };
        let mut sorted: Vec<usize> = (0..self.facts.len()).collect();
        match self.order {
            FrameOrder::Capture => {}
            FrameOrder::Uncertainty => sorted.sort_by(|&a, &b| {
                let keyframes_first = unknown(a).cmp(&unknown(b));
                keyframes_first.then(entropy(b).total_cmp(&entropy(a)))
            }),
            FrameOrder::Difference => sorted.sort_by(|&a, &b| agreement(a).total_cmp(&agreement(b))),
        }
        let by_difference = self.order == FrameOrder::Difference;
        let is_known = |facts: &FrameFacts| {
            let is_summed_up = facts.has_no_summary || facts.summary.is_some();
            is_summed_up && (!by_difference || facts.has_no_summary || facts.compared.is_some())
        };
        self.complete = self.facts.iter().all(is_known);
        self.rank = vec![0; sorted.len()];
        for (place, frame) in sorted.into_iter().enumerate() {
            self.rank[frame] = place;
        }
    }

    fn select(&mut self) {
        self.counts =
            FrameFilter::ALL.map(|filter| self.facts.iter().filter(|facts| facts.passes(filter)).count());
        let mut shown: Vec<usize> = (0..self.facts.len())
            .filter(|&frame| self.facts[frame].passes(self.filter))
            .collect();
        shown.sort_by_key(|&frame| self.rank[frame]);
        self.shown = shown;
    }
}

/// The frame that a text means: the one with this name, or else with this number, counted from 1, or else the next
/// one after `current` with the text in its name, whatever the case.
pub fn find(stems: &[&str], text: &str, current: usize) -> Option<usize> {
    let text = text.trim();
    if text.is_empty() {
        return None;
    }
    let named = stems.iter().position(|stem| *stem == text);
    let numbered = || {
        let number = text.parse::<usize>().ok()?.checked_sub(1)?;
        (number < stems.len()).then_some(number)
    };
    let containing = || {
        let part = text.to_lowercase();
        let after = (1..=stems.len()).map(|step| (current + step) % stems.len());
        let mut found = after.filter(|&frame| stems[frame].to_lowercase().contains(&part));
        found.next()
    };
    named.or_else(numbered).or_else(containing)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn facts(strokes: usize, contradicted: usize, entropy: f32) -> FrameFacts {
        FrameFacts {
            strokes,
            contradicted,
            summary: Some(FrameSummary {
                mean_entropy: entropy,
                coverage: 1.0,
                unclear: entropy,
                disagreeing: 0.0,
            }),
            ..FrameFacts::default()
        }
    }

    fn list() -> FrameList {
        let mut list = FrameList::default();
        list.set_facts(vec![
            facts(2, 0, 0.01),
            facts(0, 0, 0.3),
            facts(1, 1, 0.04),
            facts(0, 0, 0.6),
            facts(0, 0, 0.02),
        ]);
        list
    }

    #[test]
    fn a_frame_disagrees_where_its_imported_labels_differ_and_without_a_map_nothing_is_known() {
        let imported = FrameFacts {
            summary: Some(FrameSummary {
                disagreeing: 0.4,
                ..FrameSummary::default()
            }),
            ..FrameFacts::default()
        };
        assert!(imported.passes(FrameFilter::Disagreeing));
        let unknown = FrameFacts::default();
        assert!(!unknown.passes(FrameFilter::Uncertain) && !unknown.passes(FrameFilter::Disagreeing));
    }

    #[test]
    fn the_order_by_uncertainty_stays_until_it_is_chosen_again() {
        let mut list = list();
        list.set_order(FrameOrder::Uncertainty);
        assert_eq!(list.shown, [3, 1, 2, 4, 0]);
        let mut settled = list.facts.clone();
        settled[3] = facts(1, 0, 0.0);
        list.set_facts(settled);
        assert_eq!(list.shown, [3, 1, 2, 4, 0]);
        list.set_order(FrameOrder::Uncertainty);
        assert_eq!(list.shown, [1, 2, 4, 0, 3]);
    }

    #[test]
    fn frames_that_differ_most_come_first_and_those_not_labelled_twice_last() {
        let mut list = list();
        let mut compared = list.facts.clone();
        for (facts, [same, different]) in compared.iter_mut().zip([[9, 1], [0, 0], [4, 6], [9, 0], [2, 3]]) {
            facts.compared = Some(Counts {
                same,
                different,
                alone: 5,
            });
        }
        list.set_facts(compared);
        list.set_order(FrameOrder::Difference);
        assert_eq!(list.shown, [2, 4, 0, 3, 1]);
    }

    #[test]
    fn a_frame_is_found_by_name_number_or_part_of_its_name() {
        let stems = ["3", "door_left", "Door_right", "wall"];
        assert_eq!(find(&stems, "3", 0), Some(0));
        assert_eq!(find(&stems, "4", 0), Some(3));
        assert_eq!(find(&stems, " door ", 0), Some(1));
        assert_eq!(find(&stems, "door", 1), Some(2));
        assert_eq!(find(&stems, "door", 2), Some(1));
        assert_eq!(find(&stems, "5", 0), None);
        assert_eq!(find(&stems, "0", 0), None);
        assert_eq!(find(&stems, "  ", 0), None);
        assert_eq!(find(&[], "a", 0), None);
    }
}
