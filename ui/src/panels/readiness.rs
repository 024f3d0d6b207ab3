//! Whether the labels are good enough to export, and why.

use inplace_model::frames::UNCERTAIN;
use inplace_model::overview::Evidence;

use crate::numbers;

/// With more than this mean share of unclear pixels
/// ([`FrameSummary::unclear`](inplace_core::session::FrameSummary::unclear)), a scene is far from done.
const FAR: f32 = 0.2;
/// Above this share of contradicted strokes they say too little of each other. Strokes are made where the program is
/// wrong, so many are contradicted in good labels, too.
const CONTRADICTED: f32 = 0.5;

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

/// Whether the labels are good enough to export, and the same with the reason in a sentence: what is worst.
pub fn readiness(evidence: &Evidence) -> (Readiness, String) {
    let (readiness, why) = worst(evidence);
    let answer = match readiness {
        Readiness::NotYet => "Not yet",
        Readiness::Nearly => "Nearly",
        Readiness::Yes => "Yes",
    };
    (readiness, format!("{answer}: {why}"))
}

fn worst(evidence: &Evidence) -> (Readiness, String) {
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
        return (NotYet, "nothing is labelled.".to_owned());
    }
    if classes < 2 {
        return (
            NotYet,
            "with one class alone, everything is that class.".to_owned(),
        );
    }
    let Some((share, frame)) = unclear else {
        return (
            NotYet,
            "the labels have not spread over the frames so far.".to_owned(),
        );
    };
    if *share > UNCERTAIN {
        let unclear = numbers::share(*share);
        return (
            if *share > FAR { NotYet } else { Nearly },
            format!("{unclear} of the pixels are unclear, most in {frame}."),
        );
    }
    if contradicted as f32 > CONTRADICTED * checked as f32 {
        let are = if contradicted == 1 { "is" } else { "are" };
        return (
            Nearly,
            format!("{contradicted} of {checked} strokes {are} contradicted by the others."),
        );
    }
    if 2 * checked < strokes {
        return (
            Nearly,
            format!(
                "only {checked} of {strokes} strokes can be checked; label each class in at least two places."
            ),
        );
    }
    let agreement = match (checked, contradicted) {
        (0, _) => String::new(),
        (1, 0) => ", and the stroke that could be checked agrees with the others".to_owned(),
        (many, 0) => format!(", and all {many} strokes that could be checked agree"),
        (many, some) => {
            format!("; look whether the {some} of {many} strokes that the others contradict are right")
        }
    };
    let clear = numbers::share(1.0 - share);
    (Yes, format!("{clear} of the pixels are clear{agreement}."))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers of classes, strokes, checked and contradicted strokes, unclear pixels in per cent (- = no maps yet), and
    /// what is said of them.
    const ROWS: &str = "\
        0 0 0 0 - Not yet: nothing is labelled.
        1 20 18 0 3 Not yet: with one class alone, everything is that class.
        4 20 18 0 - Not yet: the labels have not spread over the frames so far.
        4 20 18 0 21 Not yet: 21% of the pixels are unclear, most in rgb_12.
        4 20 18 0 8 Nearly: 8% of the pixels are unclear, most in rgb_12.
        4 20 18 10 3 Nearly: 10 of 18 strokes are contradicted by the others.
        4 1 1 1 3 Nearly: 1 of 1 strokes is contradicted by the others.
        4 20 9 0 3 Nearly: only 9 of 20 strokes can be checked; label each class in at least two places.
        4 20 18 0 3 Yes: 97% of the pixels are clear, and all 18 strokes that could be checked agree.
        4 20 18 9 3 Yes: 97% of the pixels are clear; look whether the 9 of 18 strokes that the others contradict are right.
        4 1 1 0 3 Yes: 97% of the pixels are clear, and the stroke that could be checked agrees with the others.
        4 0 0 0 3 Yes: 97% of the pixels are clear.";

    #[test]
    fn the_worst_is_the_reason() {
        for row in ROWS.lines() {
            let mut words = row.trim().splitn(6, ' ');
            let mut next = || words.next().unwrap();
            let [classes, strokes, checked, contradicted] =
                std::array::from_fn(|_| next().parse::<usize>().unwrap());
            let unclear = next().parse::<f32>().ok();
            let evidence = Evidence {
                says_anything: classes > 0,
                classes,
                strokes,
                checked,
                contradicted,
                unclear: unclear.map(|percent| (percent / 100.0, "rgb_12".to_owned())),
            };
            let (answer, said) = readiness(&evidence);
            assert_eq!(said, next(), "{row}");
            assert_eq!(answer == Readiness::Yes, said.starts_with("Yes"));
        }
    }
}
