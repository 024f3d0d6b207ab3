//! Actions on the suggestions.

use inplace_core::labels::ClassId;
use inplace_core::project::Step;

use crate::model::Model;
use crate::suggestions::Suggestions;
use crate::workspace::Workspace;

impl Model {
    pub(crate) fn go_to_suggestion(&mut self, index: usize) {
        self.go_on(|suggestions| suggestions.go_to(index).then_some(index));
    }

    /// Goes on to another place and shows it; returns whether there is one.
    fn go_on(&mut self, step: impl FnOnce(&mut Suggestions) -> Option<usize>) -> bool {
        let next = self.with_workspace(|workspace| {
            let next = step(&mut workspace.suggestions);
            workspace.auditing.at = None;
            next.inspect(|&index| workspace.show_suggestion(index))
        });
        if next.is_some() {
            self.arrived();
        }
        next.is_some()
    }

    pub(crate) fn step_suggestion(&mut self, backwards: bool) {
        if !self.go_on(|suggestions| suggestions.step(backwards)) {
            self.say_why_no_suggestion();
        }
    }

    pub(crate) fn skip_suggestion(&mut self) {
        if self.suggestion_at_hand().is_some() && !self.go_on(Suggestions::skip) {
            self.say_why_no_suggestion();
        }
    }

    fn say_why_no_suggestion(&mut self) {
        if let Some(why) = self.state.workspace().map(Workspace::why_no_suggestion) {
            self.state.messages.info(why);
        }
    }

    /// Another place is in view: keys belong to it, not to the control that was used last.
    fn arrived(&mut self) {
        self.give_up_focus();
        self.looked_away();
    }

    /// The suggestion that keys answer.
    fn suggestion_at_hand(&self) -> Option<usize> {
        self.state.workspace()?.suggestions().at()
    }

    pub(crate) fn answer_suggestion(&mut self, index: usize, class: ClassId) {
        let edit = self.with_workspace(|workspace| {
            // So that it is seen what the answer does.
            if workspace.suggestions().at() != Some(index) {
                workspace.show_suggestion(index);
            }
            workspace.answer_suggestion(index, class)
        });
        if edit.is_some() {
            self.give_up_focus();
            self.note_click();
        }
        self.keep(edit.map(Step::Do));
    }

    pub(crate) fn answer_likely(&mut self, rank: usize) {
        let answer = self.state.workspace().and_then(|workspace| {
            let index = workspace.suggestions().at()?;
            let likely = workspace.suggestions().listed[index].classes.get(rank)?;
            Some((index, likely.class))
        });
        if let Some((index, class)) = answer {
            self.answer_suggestion(index, class);
        }
    }

    pub(crate) fn answer_slot(&mut self, slot: usize) {
        if let Some(class) = self.class_of_slot(slot) {
            self.answer_with(class);
        }
    }

    /// Labels the suggestion at hand with a class that was found.
    pub(crate) fn answer_with(&mut self, class: ClassId) {
        if let Some(index) = self.suggestion_at_hand() {
            self.answer_suggestion(index, class);
        }
    }

    pub(crate) fn leave_suggestions(&mut self) {
        self.with_workspace(|workspace| workspace.suggestions.leave());
        self.leave_audit();
    }
}
