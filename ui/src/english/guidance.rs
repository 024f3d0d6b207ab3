//! The suggestions: what to label next, and the keys that answer.

use inplace_core::session::Phase;

use super::counted;
use super::layers::percent;
use crate::workspace::Workspace;

/// Heading of the list.
pub const HEADING: &str = "Suggestions";
/// The button that goes on.
pub const NEXT: &str = "Next (N)";
/// Tooltip of what a label settles.
pub const SETTLES_HINT: &str = "The share of all pixels that a label there would settle";
/// Every listed place was skipped.
pub const ALL_SKIPPED: &str = "All suggested places are skipped.";
/// The worker has no place any more.
pub const NOTHING_LEFT: &str = "There is nothing left to suggest.";
/// The button that lists skipped places again.
pub const LIST_SKIPPED: &str = "List them again";
/// The button that skips a place.
pub const SKIP: &str = "Skip (X)";
/// The button that asks for a name.
pub const BY_NAME: &str = "Name it (C)";
/// The button that takes the answer back.
pub const TAKE_BACK: &str = "Undo (Ctrl+Z)";
/// Other labels have settled the place.
pub const SETTLED: &str = "settled meanwhile";

/// The next place is being looked for.
pub const LOOKING: &str = "Looking for the next place";
/// It takes longer.
pub const STILL_LOOKING: &str = "Still looking for the next place";
/// The end of going from place to place.
pub const LEAVE: &str = "leave";
/// To the next place.
pub const GO_ON: &str = "next";
/// To the next place of the list that is shown.
pub const GO_ON_ANYWAY: &str = "next of this list";
/// Not this one.
pub const LEAVE_OUT: &str = "skip";
/// A class by its number.
pub const ANOTHER: &str = "class";
/// A class by its name.
pub const NAME_IT: &str = "name";

/// Tooltip of the button that goes on; `back` is the key that goes back, empty where there is none.
pub fn next_hint(back: &str) -> String {
    let goes_on = "Goes to the next suggestion; the keys then answer it";
    match back {
        "" => goes_on.to_owned(),
        back => format!("{goes_on}. {back} goes back"),
    }
}

/// Heading of the list.
pub fn listed(count: usize) -> String {
    match count {
        0 => "No suggestions".to_owned(),
        some => counted(some, "suggestion", "suggestions"),
    }
}

/// Which of how many.
pub fn number(index: usize, count: usize) -> String {
    format!("Suggestion {} of {count}", index + 1)
}

/// Name of the picture that goes there.
pub fn go_there(index: usize) -> String {
    format!("Go to suggestion {}", index + 1)
}

/// What a label would settle, as a share of all pixels.
pub fn settles(share: f32) -> String {
    let percent = 100.0 * share;
    if percent < 0.1 {
        "settles less than 0.1% of the scene".to_owned()
    } else {
        format!("settles {percent:.1}% of the scene")
    }
}

/// Name of the button that gives a place a class; the place at hand needs no number.
pub fn label_as(index: Option<usize>, class: &str) -> String {
    match index {
        None => format!("Label as {class}"),
        Some(index) => format!("Label suggestion {} as {class}", index + 1),
    }
}

/// Tooltip of that button.
pub fn label_as_hint(class: &str, probability: f32, key: Option<&str>) -> String {
    let likely = format!(
        "Labels this place as {class}, which is {} likely",
        percent(probability)
    );
    key.map_or(likely.clone(), |key| format!("{likely}: {key}"))
}

/// What a place was labelled with.
pub fn labelled(class: &str) -> String {
    format!("Labelled {class}")
}

/// What was answered last.
pub fn last_answer(class: &str) -> String {
    format!("Last answer: {class}")
}

/// How many places are left out.
pub fn skipped(count: usize) -> String {
    format!("{count} skipped")
}

/// Why no place is listed, and what to do.
pub fn why_empty(workspace: &Workspace) -> &'static str {
    let status = workspace.status();
    if workspace.guidance().skipped() > 0 {
        ALL_SKIPPED
    } else if workspace.has_ended() {
        "Training has stopped: there are no suggestions."
    } else if matches!(status.phase, Phase::Opening | Phase::FindingSurface) {
        "Suggestions come as soon as the surface of the scene is found; you can label meanwhile."
    } else {
        "Looking for the places that would settle most."
    }
}
