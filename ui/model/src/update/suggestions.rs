//! Actions on the suggestions.

use inplace_core::labels::{ClassId, FoundObject, Label, Stroke};
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
            // Keys belong to the place in view, not to the control that was used last.
            self.give_up_focus();
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

    /// The suggestion that keys answer.
    fn suggestion_at_hand(&self) -> Option<usize> {
        self.state.workspace()?.suggestions().at()
    }

    pub(crate) fn answer_suggestion(&mut self, index: usize, label: Label) {
        let object = label.object.and_then(|id| self.known_object(id));
        self.answer(index, label.class, object);
    }

    /// Labels the suggestion at hand as a new object of its likeliest class.
    pub(crate) fn answer_new(&mut self) {
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let suggestions = workspace.suggestions();
        let likeliest = suggestions.at().and_then(|index| {
            let likely = suggestions.listed[index].classes.first()?;
            Some((index, likely.class))
        });
        if let Some((index, class)) = likeliest {
            let object = workspace.new_object(class);
            let sentence = object.is_none().then(|| workspace.why_no_object(class));
            if !self.refuse(sentence) {
                self.answer(index, class, object);
            }
        }
    }

    fn answer(&mut self, index: usize, class: ClassId, object: Option<FoundObject>) {
        let locked = self.state.workspace().and_then(|workspace| {
            let place = workspace.suggestions().listed.get(index)?;
            let click = Stroke::click(place.frame, class, place.pixel);
            workspace.lock_on_saying(&click, object.as_ref().map(|object| &object.object))
        });
        if self.refuse(locked) {
            return;
        }
        let edit = self.with_workspace(|workspace| {
            // So that it is seen what the answer does.
            if workspace.suggestions().at() != Some(index) {
                workspace.show_suggestion(index);
            }
            workspace.answer_suggestion(index, class, object.as_ref())
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
            Some((index, workspace.likely_label(likely)))
        });
        if let Some((index, label)) = answer {
            self.answer_suggestion(index, label);
        }
    }

    /// Labels the suggestion at hand with a class.
    pub(crate) fn answer_with(&mut self, class: ClassId) {
        if let Some(index) = self.suggestion_at_hand() {
            self.answer_suggestion(index, class.into());
        }
    }

    pub(crate) fn leave_suggestions(&mut self) {
        self.with_workspace(|workspace| workspace.suggestions.leave());
        self.leave_audit();
    }
}
