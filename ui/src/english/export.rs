//! Exporting: what is written.

use inplace_core::export::Format;

/// Name of the choice of a format.
pub const FORMAT: &str = "Format";
/// Name of the choice of class numbers.
pub const NUMBERS: &str = "Class numbers";
/// The project's numbers.
pub const OWN_NUMBERS: &str = "As in this project";
/// What other numbers mean.
pub const NUMBERS_EXPLAINED: &str = "Classes take the numbers, names and colours of that list by name; classes that are not in it become void.";
/// What is done with pixels that are not sure.
pub const UNCERTAIN: &str = "Uncertain pixels";
/// They become void.
pub const LEAVE_VOID: &str = "Void below a probability of";
/// Name of the slider beside it.
pub const LEAST_PROBABILITY: &str = "Least probability";

/// A format's name.
pub fn title(format: Format) -> &'static str {
    match format {
        Format::Png => "Label images",
    }
}

/// What a format is for, in a sentence or two.
pub fn description(format: Format) -> &'static str {
    match format {
        Format::Png => {
            "A PNG of class numbers, one of entropies and one of colours for every frame, and the list of classes."
        }
    }
}

/// What is in the folder of an export, beside the strokes.
pub fn files(format: Format) -> &'static str {
    match format {
        Format::Png => "labels, entropy and color as PNGs; classes.json; strokes.json",
    }
}
