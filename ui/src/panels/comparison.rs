//! The comparison with another project: how far both agree, and its end.

use egui::{Label, RichText, Ui};
use inplace_model::comparison::Comparison;
use inplace_model::frames::FrameOrder;
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use super::parts::frames_done;
use crate::numbers;
use crate::theme;
use crate::widgets::heading;

/// What the shares are of.
const MEANS: &str = "Of the pixels to which both projects give a class, the share that has the same one";

/// Draws the part of the progress panel, while there is a comparison.
pub fn show(ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
    let Some(comparison) = &workspace.comparison else {
        return;
    };
    heading(ui, "Comparison", |_| {});
    let words = in_words(comparison, workspace.frame_index);
    ui.add(Label::new(RichText::new(words).strong()).wrap())
        .on_hover_text(MEANS);
    ui.horizontal_wrapped(|ui| {
        if ui.button("Different frames first").clicked() {
            commands.push(Command::OrderFrames(FrameOrder::Difference));
        }
        if ui.button("End comparison").clicked() {
            commands.push(Command::EndComparison);
        }
    });
    ui.add_space(theme::GAP);
}

/// How far both agree, as far as it is known.
fn in_words(comparison: &Comparison, frame: usize) -> String {
    let name = &comparison.other.name;
    let Some(counts) = comparison.of_scene() else {
        let (done, frames) = comparison.progress();
        return format!("Comparing with {name}: {}", frames_done(done, frames));
    };
    let Some(share) = counts.agreement() else {
        return format!("No pixel has a class both here and in {name}");
    };
    let here = comparison.of_frame(frame).and_then(|counts| counts.agreement());
    let here = here.map(|share| format!(", {} of this frame", numbers::percent(share)));
    format!(
        "{} of the scene{} has the same class in {name}",
        numbers::percent(share),
        here.unwrap_or_default()
    )
}
