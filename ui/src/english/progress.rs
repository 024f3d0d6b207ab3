//! How far the labelling has come.

use crate::readiness::{Answer, Reason};

/// The tab of the suggestions.
pub const LABEL_NEXT: &str = "Label next";
/// The tab of the progress.
pub const PROGRESS: &str = "Progress";
/// What the key does.
pub const SWITCH: &str = "Show the other tab (T)";
/// The question above the answer.
pub const GOOD_ENOUGH: &str = "Good enough to export?";
/// Instead of charts.
pub const NO_CHARTS: &str =
    "Charts of uncertainty, agreement and image quality begin with your first stroke.";
/// Above the choice of the charts' horizontal axis.
pub const CHARTS_OVER: &str = "Charts over";
/// Charts over time.
pub const OVER_TIME: &str = "time";
/// Charts over strokes.
pub const OVER_STROKES: &str = "strokes";
/// The horizontal axis over time.
pub const MINUTES: &str = "Across: minutes open.";
/// The horizontal axis over strokes.
pub const STROKES: &str = "Across: strokes.";
/// What the ticks under the charts mean.
pub const MARKS: &str = "Upright lines: strokes were made.";
/// Mean entropy.
pub const UNCERTAINTY: &str = "Uncertainty";
/// What it means.
pub const UNCERTAINTY_MEANS: &str = "Mean entropy of all pixels of all frames; less is surer";
/// Cross-validated accuracy.
pub const AGREEMENT: &str = "Agreement of strokes";
/// What it means.
pub const AGREEMENT_MEANS: &str = "Each stroke is left out once, and the others say what is there: the share of strokes that get their own class so, averaged over the classes. It shows contradictions, not how right the maps are";
/// Image quality.
pub const QUALITY: &str = "Image quality";
/// What it means.
pub const QUALITY_MEANS: &str =
    "How well the field predicts frames that it was not trained on (PSNR); more is better";
/// A number that is not known.
pub const UNKNOWN: &str = "not known yet";
/// Above the contradicted strokes.
pub const CONTRADICTED: &str = "Contradicted strokes";
/// What that means.
pub const CONTRADICTED_MEANS: &str = "Without such a stroke, the others would give most of its pixels another class: one of them may be wrong, or there are too few strokes around it";
/// Row: strokes.
pub const ROW_STROKES: &str = "Strokes";
/// Row: frames with strokes.
pub const ROW_LABELLED: &str = "Drawn on";
/// What it means.
pub const ROW_LABELLED_MEANS: &str = "Frames that have strokes; labels spread to all the others";
/// Row: time.
pub const ROW_TIME: &str = "Labelling time";
/// What it means.
pub const ROW_TIME_MEANS: &str = "Time with something done at least once a minute; breaks do not count";
/// Row: pixels with a class.
pub const ROW_COVERED: &str = "Covered";
/// What it means.
pub const ROW_COVERED_MEANS: &str = "Share of the pixels of all frames that have a class";
/// Row: clear pixels.
pub const ROW_CLEAR: &str = "Clear";
/// What it means.
pub const ROW_CLEAR_MEANS: &str =
    "Share of the pixels of all frames whose class is more likely right than wrong";
/// Row: checked strokes.
pub const ROW_CHECKED: &str = "Agreeing strokes";

/// So many frames of all.
pub fn frames(some: usize, all: usize) -> String {
    format!("{some} of {all} frames")
}

/// Strokes that agree with the others, of those that could be checked.
pub fn agreeing(agreeing: usize, checked: usize) -> String {
    format!("{agreeing} of {checked} checked")
}

/// A share as a percentage: never 100% when something is missing, never 0% when there is something.
pub fn percent(share: f32) -> String {
    let percent = 100.0 * share.clamp(0.0, 1.0);
    if percent > 0.0 && percent < 1.0 {
        "below 1%".to_owned()
    } else if percent > 99.0 && percent < 100.0 {
        "above 99%".to_owned()
    } else {
        format!("{percent:.0}%")
    }
}

/// A span of time.
pub fn duration(seconds: f64) -> String {
    let seconds = seconds.max(0.0) as u64;
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, seconds) => format!("{seconds} s"),
        (0, minutes, seconds) => format!("{minutes} min {seconds:02} s"),
        (hours, minutes, _) => format!("{hours} h {minutes:02} min"),
    }
}

/// What the next labels are worth; `None` when that is next to nothing.
pub fn next_labels(shares: &[f32]) -> Option<String> {
    let share: f32 = shares.iter().sum();
    let labels = match shares.len() {
        0 => return None,
        1 => "label".to_owned(),
        many => format!("{many} labels"),
    };
    (share >= 0.005).then(|| {
        let much = if share < 0.01 {
            "less than 1%".to_owned()
        } else {
            format!("about {}", percent(share))
        };
        format!("The next {labels} would settle {much} of the scene.")
    })
}

/// A place on the axis of time.
pub fn at_minute(minutes: f64) -> String {
    format!("{minutes:.1} min")
}

/// A place on the axis of strokes.
pub fn at_stroke(strokes: f64) -> String {
    format!("{strokes:.0} {STROKES}")
}

/// An image quality.
pub fn decibels(psnr: f64) -> String {
    format!("{psnr:.1} dB")
}

/// A stroke that the others contradict.
pub fn contradicted(class: &str, frame: &str, others: &str) -> String {
    format!("{class} at {frame}: the others say {others}")
}

/// Whether the labels are good enough, with the reason.
pub fn readiness(answer: Answer, reason: &Reason) -> String {
    let answer = match answer {
        Answer::NotYet => "Not yet",
        Answer::Nearly => "Nearly",
        Answer::Yes => "Yes",
    };
    format!("{answer}: {}", why(reason))
}

fn why(reason: &Reason) -> String {
    match reason {
        Reason::NothingSaid => "nothing is labelled.".to_owned(),
        Reason::NoMaps => "the labels have not spread over the frames so far.".to_owned(),
        Reason::OneClass => "with one class alone, everything is that class.".to_owned(),
        Reason::Contradicted {
            contradicted,
            checked,
        } => {
            let are = if *contradicted == 1 { "is" } else { "are" };
            format!("{contradicted} of {checked} strokes {are} contradicted by the others.")
        }
        Reason::Unclear { share, frame } => {
            format!("{} of the pixels are unclear, most in {frame}.", percent(*share))
        }
        Reason::Unchecked { checked, strokes } => format!(
            "only {checked} of {strokes} strokes can be checked; label each class in at least two places."
        ),
        Reason::Clear {
            share,
            checked,
            contradicted,
        } => {
            let strokes = match (checked, contradicted) {
                (0, _) => String::new(),
                (1, 0) => ", and the stroke that could be checked agrees with the others".to_owned(),
                (many, 0) => format!(", and all {many} strokes that could be checked agree"),
                (many, some) => format!(
                    "; look whether the {some} of {many} strokes that the others contradict are right"
                ),
            };
            format!("{} of the pixels are clear{strokes}.", percent(*share))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_and_times_are_honest_words() {
        assert_eq!(percent(0.004), "below 1%");
        assert_eq!(percent(0.123), "12%");
        assert_eq!(percent(0.9999), "above 99%");
        assert_eq!((percent(0.0), percent(1.0)), ("0%".to_owned(), "100%".to_owned()));
        assert_eq!(duration(59.9), "59 s");
        assert_eq!(duration(61.0), "1 min 01 s");
        assert_eq!(duration(7325.0), "2 h 02 min");
    }

    #[test]
    fn the_worth_of_the_next_labels_is_said_only_when_there_is_some() {
        assert_eq!(
            next_labels(&[0.05, 0.04, 0.03]).as_deref(),
            Some("The next 3 labels would settle about 12% of the scene.")
        );
        assert_eq!(
            next_labels(&[0.2]).as_deref(),
            Some("The next label would settle about 20% of the scene.")
        );
        assert_eq!(
            next_labels(&[0.004, 0.003]).as_deref(),
            Some("The next 2 labels would settle less than 1% of the scene.")
        );
        assert_eq!(next_labels(&[0.001, 0.001]), None);
        assert_eq!(next_labels(&[]), None);
    }

    #[test]
    fn every_answer_names_its_reason() {
        for (answer, reason, sentence) in [
            (
                Answer::NotYet,
                Reason::NothingSaid,
                "Not yet: nothing is labelled.",
            ),
            (
                Answer::NotYet,
                Reason::NoMaps,
                "Not yet: the labels have not spread over the frames so far.",
            ),
            (
                Answer::NotYet,
                Reason::OneClass,
                "Not yet: with one class alone, everything is that class.",
            ),
            (
                Answer::Nearly,
                Reason::Contradicted {
                    contradicted: 8,
                    checked: 12,
                },
                "Nearly: 8 of 12 strokes are contradicted by the others.",
            ),
            (
                Answer::Nearly,
                Reason::Contradicted {
                    contradicted: 1,
                    checked: 1,
                },
                "Nearly: 1 of 1 strokes is contradicted by the others.",
            ),
            (
                Answer::Nearly,
                Reason::Unclear {
                    share: 0.08,
                    frame: "rgb_12".to_owned(),
                },
                "Nearly: 8% of the pixels are unclear, most in rgb_12.",
            ),
            (
                Answer::Nearly,
                Reason::Unchecked {
                    checked: 2,
                    strokes: 9,
                },
                "Nearly: only 2 of 9 strokes can be checked; label each class in at least two places.",
            ),
            (
                Answer::Yes,
                Reason::Clear {
                    share: 0.97,
                    checked: 14,
                    contradicted: 0,
                },
                "Yes: 97% of the pixels are clear, and all 14 strokes that could be checked agree.",
            ),
            (
                Answer::Yes,
                Reason::Clear {
                    share: 0.97,
                    checked: 14,
                    contradicted: 5,
                },
                "Yes: 97% of the pixels are clear; look whether the 5 of 14 strokes that the others contradict are right.",
            ),
            (
                Answer::Yes,
                Reason::Clear {
                    share: 0.97,
                    checked: 0,
                    contradicted: 0,
                },
                "Yes: 97% of the pixels are clear.",
            ),
        ] {
            assert_eq!(readiness(answer, &reason), sentence);
        }
    }
}
