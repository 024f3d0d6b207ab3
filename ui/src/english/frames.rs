//! The filmstrip and its filters.

use crate::frames::{FrameFacts, FrameFilter, FrameOrder};

use super::counted;

/// Name of the field that goes to a frame, also shown in it while it is empty.
pub const GO_TO: &str = "Go to frame";
/// The field's tooltip.
pub const GO_TO_MEANS: &str = "A frame's number or name, or a part of the name; Enter goes there";
/// Name of the choice of the filter.
pub const FILTER: &str = "Frames shown";
/// Name of the choice of the order.
pub const ORDER: &str = "Order of the frames";

/// A filter's name.
pub fn filter(filter: FrameFilter) -> &'static str {
    match filter {
        FrameFilter::All => "All",
        FrameFilter::Unlabelled => "Unlabelled",
        FrameFilter::Uncertain => "Uncertain",
        FrameFilter::Disagreeing => "Disagreeing",
    }
}

/// What a filter lets through.
pub fn filter_means(filter: FrameFilter) -> &'static str {
    match filter {
        FrameFilter::All => "All frames",
        FrameFilter::Unlabelled => "Frames without strokes",
        FrameFilter::Uncertain => "Frames with more than 5% of unclear pixels",
        FrameFilter::Disagreeing => {
            "Frames with strokes that the others contradict, or whose imported labels differ from the map on more than 10% of the pixels"
        }
    }
}

/// An order's name.
pub fn order(order: FrameOrder) -> &'static str {
    match order {
        FrameOrder::Capture => "In order",
        FrameOrder::Uncertainty => "Most uncertain first",
    }
}

/// What stands where no frame passes a filter.
pub fn none(filter: FrameFilter) -> &'static str {
    match filter {
        FrameFilter::All => "This scene has no frames.",
        FrameFilter::Unlabelled => "No frame is unlabelled: there are strokes on all of them.",
        FrameFilter::Uncertain => "No frame is uncertain.",
        FrameFilter::Disagreeing => "No frame is disagreeing: nothing contradicts your strokes.",
    }
}

/// A name that no frame has.
pub fn not_found(text: &str) -> String {
    format!("No frame has this number, or a name with \"{text}\" in it.")
}

/// The state of a frame.
pub fn frame(stem: &str, facts: &FrameFacts) -> String {
    let mut words = match facts.strokes {
        0 => "no strokes".to_owned(),
        some => counted(some, "stroke", "strokes"),
    };
    if facts.contradicted > 0 {
        words += &format!(", {} contradicted", facts.contradicted);
    }
    let without = if facts.has_no_summary {
        "labelled from the keyframes"
    } else {
        "no labels yet"
    };
    let map = facts.summary.map_or_else(
        || without.to_owned(),
        |summary| {
            format!(
                "{:.0}% labelled, uncertainty {:.2} nats",
                100.0 * summary.coverage,
                summary.mean_entropy
            )
        },
    );
    format!("Frame {stem}: {words}, {map}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use inplace_core::session::FrameSummary;

    #[test]
    fn a_frames_state_is_a_sentence() {
        let summary = FrameSummary {
            mean_entropy: 0.25,
            coverage: 0.871,
            ..FrameSummary::default()
        };
        let facts = |strokes, contradicted, summary| FrameFacts {
            strokes,
            contradicted,
            summary,
            has_no_summary: false,
        };
        assert_eq!(
            frame("rgb_3", &facts(1, 0, Some(summary))),
            "Frame rgb_3: 1 stroke, 87% labelled, uncertainty 0.25 nats"
        );
        assert_eq!(
            frame("rgb_3", &facts(4, 2, None)),
            "Frame rgb_3: 4 strokes, 2 contradicted, no labels yet"
        );
        let other = FrameFacts {
            has_no_summary: true,
            ..facts(0, 0, None)
        };
        assert_eq!(
            frame("a", &facts(0, 0, None)),
            "Frame a: no strokes, no labels yet"
        );
        assert_eq!(
            frame("a", &other),
            "Frame a: no strokes, labelled from the keyframes"
        );
    }
}
