//! Whether the labels are good enough to export, and why.

/// With more than this mean share of unclear pixels
/// ([`FrameSummary::unclear`](inplace_core::session::FrameSummary::unclear)), a scene is far from done.
const FAR: f32 = 0.2;
/// With more than this share of unclear pixels a scene is not quite done, and a frame is uncertain.
pub const NEAR: f32 = 0.05;
/// Above this share of contradicted strokes they say too little of each other. Strokes are made where the program is
/// wrong, so many are contradicted in good labels, too.
const CONTRADICTED: f32 = 0.5;

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

/// Whether the labels are good enough.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Readiness {
    /// Something is missing or wrong.
    NotYet,
    /// A little is left.
    Nearly,
    /// Nothing speaks against it.
    Yes,
}

/// What the answer rests on.
#[derive(Clone, Debug, PartialEq)]
pub enum Reason {
    /// There are no labels.
    NothingSaid,
    /// Not every frame has a map.
    NoMaps,
    /// Only one class is used.
    OneClass,
    /// Most strokes are contradicted by the others.
    Contradicted {
        /// Strokes that the others contradict.
        contradicted: usize,
        /// Strokes that could be checked.
        checked: usize,
    },
    /// Pixels are unclear.
    Unclear {
        /// Their share, 0..=1.
        share: f32,
        /// The frame that has most of them.
        frame: String,
    },
    /// Most strokes could not be checked.
    Unchecked {
        /// Strokes that could be.
        checked: usize,
        /// All strokes.
        strokes: usize,
    },
    /// Nothing speaks against it.
    Clear {
        /// Share of the pixels that are clear, 0..=1.
        share: f32,
        /// Strokes that could be checked.
        checked: usize,
        /// Those that the others contradict.
        contradicted: usize,
    },
}

/// Whether the labels are good enough to export: what is worst is the reason.
pub fn readiness(evidence: &Evidence) -> (Readiness, Reason) {
    use Readiness::{Nearly, NotYet, Yes};
    let Evidence {
        says_anything,
        classes,
        strokes,
        checked,
        contradicted,
        ref unclear,
    } = *evidence;
    if !says_anything {
        return (NotYet, Reason::NothingSaid);
    }
    if classes < 2 {
        return (NotYet, Reason::OneClass);
    }
    let Some((share, frame)) = unclear else {
        return (NotYet, Reason::NoMaps);
    };
    let unclear = Reason::Unclear {
        share: *share,
        frame: frame.clone(),
    };
    let contradictions = Reason::Contradicted {
        contradicted,
        checked,
    };
    if *share > FAR {
        (NotYet, unclear)
    } else if *share > NEAR {
        (Nearly, unclear)
    } else if contradicted as f32 > CONTRADICTED * checked as f32 {
        (Nearly, contradictions)
    } else if 2 * checked < strokes {
        (Nearly, Reason::Unchecked { checked, strokes })
    } else {
        let share = 1.0 - share;
        let clear = Reason::Clear {
            share,
            checked,
            contradicted,
        };
        (Yes, clear)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn good() -> Evidence {
        Evidence {
            says_anything: true,
            classes: 4,
            strokes: 20,
            checked: 18,
            contradicted: 0,
            unclear: Some((0.03, "rgb_12".to_owned())),
        }
    }

    fn answer(change: impl FnOnce(&mut Evidence)) -> (Readiness, Reason) {
        let mut evidence = good();
        change(&mut evidence);
        readiness(&evidence)
    }

    #[test]
    fn the_worst_is_the_reason() {
        use Readiness::{Nearly, NotYet, Yes};
        assert_eq!(readiness(&Evidence::default()), (NotYet, Reason::NothingSaid));
        assert_eq!(answer(|e| e.classes = 1), (NotYet, Reason::OneClass));
        assert_eq!(answer(|e| e.unclear = None), (NotYet, Reason::NoMaps));
        let contradicted = |contradicted| Reason::Contradicted {
            contradicted,
            checked: 18,
        };
        assert_eq!(answer(|e| e.contradicted = 10), (Nearly, contradicted(10)));
        assert_eq!(answer(|e| e.contradicted = 9).0, Yes);
        let unclear = |share: f32| Reason::Unclear {
            share,
            frame: "a".to_owned(),
        };
        let with = |share: f32| answer(|e| e.unclear = Some((share, "a".to_owned())));
        assert_eq!(with(0.21), (NotYet, unclear(0.21)));
        assert_eq!(with(0.08), (Nearly, unclear(0.08)));
        let unchecked = Reason::Unchecked {
            checked: 9,
            strokes: 20,
        };
        assert_eq!(answer(|e| e.checked = 9), (Nearly, unchecked));
        let clear = Reason::Clear {
            share: 0.97,
            checked: 18,
            contradicted: 0,
        };
        assert_eq!(answer(|_| ()), (Yes, clear));
    }
}
