//! The audit: how right the maps are by places that a person judged, and the places that were wrong.

use egui::{Button, DragValue, Label, RichText, Ui};
use inplace_core::guide::audit::{Accuracy, Audit, AuditPlace, Verdict};
use inplace_core::labels::VOID;
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use super::parts::pressed_in_list;
use crate::widgets::{heading, weak_text};

/// Share of the frames that places are drawn from unless another one is chosen, in per cent.
const USUAL: u8 = 5;

/// What a place in the list is.
const WRONG_MEANS: &str = "You have judged the label there to be wrong";

/// The part of the progress panel, with the share that is chosen.
#[derive(Debug)]
pub struct AuditPart {
    percent: u8,
}

impl Default for AuditPart {
    fn default() -> Self {
        Self { percent: USUAL }
    }
}

impl AuditPart {
    /// Draws it.
    pub fn show(&mut self, ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
        heading(ui, "Audit", |_| {});
        let auditing = &workspace.auditing;
        match &auditing.audit {
            None => {
                let about = "Judge random places, and the program tells how right all labels are.";
                weak_text(ui, about);
            }
            Some(audit) => result(ui, workspace, audit, commands),
        }
        ui.horizontal_wrapped(|ui| {
            let percent = DragValue::new(&mut self.percent)
                .range(1..=100)
                .suffix("% of the frames");
            ui.add(percent).on_hover_text(
                "60 places are drawn in each of these frames; 5% of 180 frames are enough for 3 points",
            );
            let (enabled, name) = match auditing.is_drawing {
                true => (false, "Drawing places"),
                false => (true, "New audit"),
            };
            if ui.add_enabled(enabled, Button::new(name)).clicked() {
                commands.push(Command::DrawAudit(self.percent));
            }
        });
    }
}

fn result(ui: &mut Ui, workspace: &Workspace, audit: &Audit, commands: &mut Commands) {
    let judged = audit
        .places
        .iter()
        .filter(|place| place.verdict.is_some())
        .count();
    if let Some(accuracy) = audit.accuracy() {
        ui.add(Label::new(RichText::new(in_words(&accuracy)).strong()).wrap());
    }
    ui.horizontal_wrapped(|ui| {
        ui.label(format!("{judged} of {} places judged", audit.places.len()));
        if let Some(next) = workspace.next_audited()
            && workspace.auditing.at.is_none()
            && ui.button("Go on").clicked()
        {
            commands.push(Command::GoToAudited(next));
        }
    });
    if audit.edits != workspace.document.history().map_edits() {
        weak_text(ui, "The labels have changed since the places were drawn.");
    }
    let is_wrong = |(_, place): &(usize, &AuditPlace)| place.verdict == Some(Verdict::Wrong);
    let wrong: Vec<(usize, &AuditPlace)> = audit.places.iter().enumerate().filter(is_wrong).collect();
    if wrong.is_empty() {
        return;
    }
    heading(ui, "Wrong places", |ui| {
        ui.weak(wrong.len().to_string());
    });
    let text = |number: usize| {
        let (index, place) = wrong[number];
        Some(row(workspace, audit, index, place))
    };
    let pressed = pressed_in_list(ui, "wrong places", wrong.len(), WRONG_MEANS, text);
    commands.extend(pressed.map(|number| Command::GoToAudited(wrong[number].0)));
}

/// What is said of a wrong place: also whether the map has another class there now.
fn row(workspace: &Workspace, audit: &Audit, index: usize, place: &AuditPlace) -> String {
    let is_gone = |class| class != VOID && workspace.document.labels().class(class).is_none();
    let name = |class| match is_gone(class) {
        true => "a class that is gone",
        false => workspace.document.name_and_color(class).0,
    };
    let stem = audit.frames.get(place.frame).map_or("", |frame| &frame.stem);
    let now = workspace.audited_place(index).and_then(|(frame, pixel)| {
        let answer = workspace.newest_map(frame)?.at(pixel)?;
        (answer.class != place.class).then(|| format!(", now {}", name(answer.class)))
    });
    format!("not {} at {stem}{}", name(place.class), now.unwrap_or_default())
}

/// The accuracy with its interval.
fn in_words(accuracy: &Accuracy) -> String {
    let [share, low, high] =
        [accuracy.share, accuracy.low, accuracy.high].map(|share| format!("{:.1}%", 100.0 * share));
    format!("{share} of the labelled pixels are right; with 95% confidence, {low} to {high}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_accuracy_is_said_with_its_interval() {
        let accuracy = Accuracy {
            share: 0.934,
            low: 0.887,
            high: 0.962,
            judged: 540,
        };
        let words = "93.4% of the labelled pixels are right; with 95% confidence, 88.7% to 96.2%";
        assert_eq!(in_words(&accuracy), words);
    }
}
