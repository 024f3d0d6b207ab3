//! Actions of the comparison with another project of the scene.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crate::comparison::{Comparison, Counted, OtherLabels, Reader, name_of};
use crate::frames::FrameOrder;
use crate::jobs::Done;
use crate::layer::Layer;
use crate::model::{BeginningComparison, Model};
use crate::versioned::Version;

impl Model {
    /// Reads another project of the open scene, to compare with it.
    pub(crate) fn compare_with(&mut self, project: PathBuf) {
        self.state.dialog = None;
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        if workspace.reading.is_some() {
            let sentence = "The scene is still being read: compare when that is done.";
            return self.state.messages.info(sentence);
        }
        let scene = Arc::clone(&workspace.scene);
        self.stop_beginning_comparison();
        self.last_ticket += 1;
        let ticket = self.last_ticket;
        let stop = Arc::new(AtomicBool::new(false));
        self.state.beginning_comparison = Some(BeginningComparison {
            ticket,
            name: name_of(&project),
            words: "Reading the project".to_owned(),
            stop: Arc::clone(&stop),
        });
        let reader = Reader {
            project,
            own: self.state.project.as_ref().map(|project| project.path.clone()),
            session: self.session_options(scene.source.clone(), self.read, None),
            scene,
            stop,
        };
        let broken = move |sentence| Done::OtherRead(ticket, Box::new(Err(sentence)));
        self.start("comparison", broken, move |tools, tell| {
            let read = reader.read(tools, &|words| tell(Done::ComparisonGoesOn(ticket, words)));
            Done::OtherRead(ticket, Box::new(read))
        });
    }

    /// Stops reading the other project.
    pub(crate) fn stop_beginning_comparison(&mut self) {
        if let Some(beginning) = self.state.beginning_comparison.take() {
            beginning.stop.store(true, Ordering::Relaxed);
        }
    }

    /// How the reading of the other project goes, in words.
    pub(crate) fn comparison_goes_on(&mut self, ticket: u64, words: String) {
        let beginning = self.state.beginning_comparison.as_mut();
        if let Some(beginning) = beginning.filter(|beginning| beginning.ticket == ticket) {
            beginning.words = words;
        }
    }

    /// The other project was read, or could not be; one that is waited for no more is dropped.
    pub(crate) fn other_read(&mut self, ticket: u64, read: Result<OtherLabels, String>) {
        let beginning = &mut self.state.beginning_comparison;
        if beginning
            .take_if(|beginning| beginning.ticket == ticket)
            .is_none()
        {
            return;
        }
        let other = match read {
            Ok(other) => other,
            Err(sentence) => return self.state.messages.error(sentence),
        };
        for warning in &other.warnings {
            self.state.messages.warning(warning);
        }
        self.with_workspace(|workspace| {
            let comparison = Comparison::new(Arc::new(other), workspace.document.classes());
            workspace.comparison = Some(comparison);
            workspace.overview.changed();
            workspace.overview.frames.forget_order();
            workspace.space.shown = false;
        });
        self.state.settings.layer = Layer::Differences;
    }

    /// Ends the comparison: nothing of the other project is left.
    pub(crate) fn end_comparison(&mut self) {
        self.with_workspace(|workspace| {
            workspace.comparison = None;
            workspace.overview.changed();
            let frames = &mut workspace.overview.frames;
            if frames.order == FrameOrder::Difference {
                frames.set_order(FrameOrder::Capture);
            }
        });
        let settings = &mut self.state.settings;
        let preferred = self.state.preferences.settings();
        for (layer, preferred) in [
            (&mut settings.layer, preferred.layer),
            (&mut settings.other_layer, preferred.other_layer),
        ] {
            if *layer == Layer::Differences {
                *layer = preferred;
            }
        }
    }

    /// Has frames counted whose maps are new to the comparison.
    pub(crate) fn count_differences(&mut self) {
        let Some(workspace) = self.state.workspace_mut() else {
            return;
        };
        let Some((due, comparison)) = workspace.due_differences() else {
            return;
        };
        let (other, matching) = (Arc::clone(&comparison.other), comparison.matching.clone());
        let (serial, maps) = (workspace.serial, Arc::clone(workspace.session.maps()));
        self.start("differences", Done::Failed, move |_, _| {
            let counted = Comparison::count(&other, &matching, &maps, due);
            Done::DifferencesCounted(serial, matching.version(), counted)
        });
    }

    /// Frames were counted.
    pub(crate) fn differences_counted(&mut self, serial: u64, matching: Version, counted: Counted) {
        if let Some(workspace) = self.state.workspace_numbered(serial)
            && let Some(comparison) = &mut workspace.comparison
        {
            comparison.take(matching, counted);
            workspace.overview.changed();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Command;
    use crate::model::Start;
    use crate::preferences::Preferences;

    #[test]
    fn after_a_comparison_the_layer_is_again_the_one_that_the_person_chose() {
        let mut model = Model::new(Start::default(), Preferences::default());
        model.update(Command::ChooseLayer(Layer::Entropy));
        model.update(Command::ChooseLayer(Layer::Differences));
        model.update(Command::SetOpacity(0.25));
        model.update(Command::EndComparison);
        assert_eq!(model.settings.layer, Layer::Entropy);
        assert_eq!(model.preferences.settings(), model.settings);
    }
}
