//! Actions of an audit.

use std::sync::Arc;

use inplace_core::guide::audit::{Audit, Verdict};

use crate::jobs::Done;
use crate::model::{Model, Side};

impl Model {
    /// Draws places from these per cent of the frames.
    pub(crate) fn draw_audit(&mut self, percent: u8) {
        let first = self.start.seed;
        let workspace = self.state.workspace_mut();
        let Some(workspace) = workspace.filter(|workspace| !workspace.auditing.is_drawing) else {
            return;
        };
        workspace.auditing.is_drawing = true;
        let (scene, maps) = (Arc::clone(&workspace.scene), Arc::clone(workspace.session.maps()));
        let (serial, edits) = (workspace.serial, workspace.document.history().map_edits());
        let before = workspace.auditing.audit.as_ref();
        let seed = before.map_or(first, |audit| audit.seed.wrapping_add(1));
        let broken = move |sentence| Done::AuditDrawn(serial, Err(sentence));
        self.start("audit", broken, move |_, _| {
            let share = f64::from(percent) / 100.0;
            let audit = Audit::draw(&scene, &|frame| maps.get(frame), (share, seed), edits);
            Done::AuditDrawn(serial, Ok(audit.map(Box::new)))
        });
    }

    /// Places were drawn, if anything is labelled, or could not be.
    pub(crate) fn audit_drawn(&mut self, serial: u64, drawn: Result<Option<Box<Audit>>, String>) {
        let Some(workspace) = self.state.workspace_numbered(serial) else {
            return;
        };
        workspace.auditing.is_drawing = false;
        let audit = match drawn {
            Ok(Some(audit)) => audit,
            Ok(None) => {
                let sentence = "Nothing is labelled yet: there are no places to judge.";
                return self.state.messages.info(sentence);
            }
            Err(sentence) => return self.state.messages.error(sentence),
        };
        workspace.auditing.audit = Some(*audit);
        self.keep_view();
        self.go_to_audited(0);
    }

    pub(crate) fn go_to_audited(&mut self, index: usize) {
        if self.with_workspace(|workspace| workspace.show_audited(index)) {
            self.give_up_focus();
        } else {
            let sentence = "The frame of this place is not in the scene any more.";
            self.state.messages.info(sentence);
        }
    }

    pub(crate) fn judge(&mut self, verdict: Verdict) {
        let workspace = self.state.workspace_mut();
        let Some(workspace) = workspace.filter(|workspace| workspace.auditing.at.is_some()) else {
            return;
        };
        let goes_on = workspace.judge(verdict);
        self.keep_view();
        if !goes_on {
            self.state.side = Side::Progress;
            self.state.messages.info("All places of the audit are judged.");
        }
    }

    pub(crate) fn leave_audit(&mut self) {
        self.with_workspace(|workspace| workspace.auditing.at = None);
    }
}
