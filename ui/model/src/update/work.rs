//! Work that takes a while: exporting, importing, summing up the maps.

use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

use inplace_core::labels::{ImportError, LabelImages, Trust, read_label_images};
use inplace_core::semantics::united;

use crate::dialogs::ExportChoice;
use crate::effect::Effect;
use crate::exporting::{Export, ExportProgress};
use crate::jobs::Done;
use crate::model::Model;
use crate::overview::{Summarised, summarise};
use crate::text::counted;

impl Model {
    /// Whether files are being written.
    pub(crate) fn is_exporting(&self) -> bool {
        matches!(self.state.export, Some(ExportProgress::Writing(..)))
    }

    pub(crate) fn export(&mut self, choice: ExportChoice) {
        self.state.dialog = None;
        if self.is_exporting() {
            self.state
                .messages
                .info("An export is under way: wait for its end, or cancel it.");
            return;
        }
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        self.state.export = Some(ExportProgress::Writing(0, workspace.scene.frames.len()));
        self.state.export_choice = choice.clone();
        self.state.stopping_export = false;
        self.waiting_export = Some(choice);
        self.go_on_with_export();
    }

    /// Starts the export that waits, once all maps follow the labels as they are by then; none do when the worker ends.
    pub(crate) fn go_on_with_export(&mut self) {
        let (Some(workspace), Some(choice)) = (self.state.workspace(), &self.waiting_export) else {
            return;
        };
        let Some(maps) = workspace.following_maps() else {
            if workspace.ended {
                self.give_up_export();
            }
            return;
        };
        let stop = Arc::new(AtomicBool::new(false));
        let export = Export {
            scene: Arc::clone(&workspace.scene),
            labels: workspace.document.labels().clone(),
            parts: workspace.parts.to_vec(),
            format: choice.format,
            options: choice.options(),
            maps,
            stop: Arc::clone(&stop),
        };
        let folder = choice.folder();
        self.waiting_export = None;
        self.export_stop = stop;
        let broken = |sentence| Done::Exported(ExportProgress::Failed(sentence));
        self.start("export", broken, move |_, tell| {
            Done::Exported(export.run(&folder, &|progress| tell(Done::Exported(progress))))
        });
    }

    /// The maps that an export waits for do not come any more.
    pub(crate) fn give_up_export(&mut self) {
        if let Some(choice) = self.waiting_export.take() {
            let sentence = format!(
                "{}: nothing was exported, because the work on the scene ended before its maps followed the \
                 labels; open it again to export it.",
                choice.folder().display()
            );
            self.exported(ExportProgress::Failed(sentence));
        }
    }

    pub(crate) fn cancel_export(&mut self) {
        if let Some(choice) = self.waiting_export.take() {
            return self.exported(ExportProgress::Cancelled(choice.folder(), 0, 0));
        }
        self.state.stopping_export = self.is_exporting();
        self.export_stop.store(true, Ordering::Relaxed);
    }

    /// The export has come further, or has ended.
    pub(crate) fn exported(&mut self, progress: ExportProgress) {
        self.state.export = match progress {
            ExportProgress::Failed(sentence) => {
                // The window stays open, for this to be read.
                self.closes_after_export = false;
                self.state.messages.error(sentence);
                None
            }
            ExportProgress::Cancelled(folder, written, frames) => {
                let folder = folder.display();
                self.state.messages.info(match written {
                    0 => format!("The export was cancelled; nothing was written to {folder}."),
                    _ => format!(
                        "The export was cancelled: {folder} has {written} of {frames} frames, and each of those files is whole."
                    ),
                });
                None
            }
            progress => Some(progress),
        };
        if !self.is_exporting() && self.closes_after_export {
            self.effects.push(Effect::CloseWindow);
        }
    }

    /// The system asks to close the window. During an export it closes after its end; asked once more, it stops the
    /// export first, and asked then, it closes at once: a disk may hang. Where labels are on no disk, it stays open.
    pub(crate) fn close_window(&mut self) {
        if self.loses_labels() {
            self.closes_after_export = false;
            return self.effects.push(Effect::KeepWindowOpen);
        }
        if !self.is_exporting() || self.closes_after_export && self.state.stopping_export {
            return;
        }
        self.effects.push(Effect::KeepWindowOpen);
        if std::mem::replace(&mut self.closes_after_export, true) {
            self.cancel_export();
        } else {
            let sentence =
                "The window closes when the export has ended; close it again to cancel the export.";
            self.state.messages.info(sentence);
        }
    }

    pub(crate) fn import_from(&mut self, folder: PathBuf, trust: Trust) {
        self.state.dialog = None;
        if self.state.importing.is_some() {
            self.state
                .messages
                .info("An import is under way: wait for its end, or cancel it.");
            return;
        }
        let Some(workspace) = self.state.workspace() else {
            return;
        };
        let scene = Arc::clone(&workspace.scene);
        let known = workspace.document.labels().clone();
        let maps = Arc::clone(workspace.session.maps());
        self.last_ticket += 1;
        let ticket = self.last_ticket;
        self.state.importing = Some(ticket);
        let broken = move |sentence| Done::Imported(ticket, Box::new(Err(sentence)));
        self.start("import", broken, move |_, _| {
            let images = read_label_images(&folder, &scene, &known.classes, trust);
            let images = images.and_then(|images| {
                if !images.is_by_frame() {
                    return Ok(images);
                }
                let surface = maps
                    .surface()
                    .ok_or_else(|| ImportError::without_surface(&folder))?;
                Ok(united(&surface, images, &known))
            });
            Done::Imported(ticket, Box::new(images.map_err(|error| error.to_string())))
        });
    }

    pub(crate) fn cancel_import(&mut self) {
        if self.state.importing.take().is_some() {
            self.state.messages.info("Nothing was imported.");
        }
    }

    /// Label images were read, or could not be; those of an import that was cancelled are dropped.
    pub(crate) fn imported(&mut self, ticket: u64, images: Result<LabelImages, String>) {
        if self.state.importing != Some(ticket) {
            return;
        }
        self.state.importing = None;
        let images = match images {
            Ok(images) => images,
            Err(sentence) => return self.state.messages.error(sentence),
        };
        let (count, unmatched) = (images.labels.maps.len(), images.unmatched);
        let objects = match images.objects.len() {
            0 => String::new(),
            objects => format!(" with {}", counted(objects, "object", "objects")),
        };
        self.edit(|history| Some(history.import(images)));
        let mut sentence = format!(
            "Imported {}{objects}.",
            counted(count, "label image", "label images")
        );
        if unmatched > 0 {
            sentence += &format!(" Left out, because they are named like no frame: {unmatched}.");
        }
        self.state.messages.info(sentence);
    }

    /// A frame of the window begins: brings what is known of the scene as a whole up to date, has new maps summed up, and
    /// removes old messages.
    pub(crate) fn frame_begins(&mut self, now: Instant, window: Option<[f32; 2]>) {
        if window.is_some() {
            self.state.preferences.window = window;
        }
        let mut wake = self.state.messages.expire(now);
        if let Some(workspace) = self.state.workspace_mut() {
            let due = workspace.refresh_overview(now);
            wake = wake.into_iter().chain(workspace.overview.wake_in(now)).min();
            if let Some(due) = due {
                let (serial, maps) = (workspace.serial, Arc::clone(workspace.session.maps()));
                let labels = workspace.document.labels().clone();
                self.start("summaries", Done::Failed, move |_, _| {
                    Done::Summarised(serial, summarise(&maps, &labels, due))
                });
            }
        }
        self.effects.extend(wake.map(Effect::WakeIn));
        self.count_differences();
    }

    /// Maps were summed up.
    pub(crate) fn summarised(&mut self, serial: u64, made: Vec<Summarised>) {
        if let Some(workspace) = self.state.workspace_numbered(serial) {
            workspace.overview.take_summaries(made, Instant::now());
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::Mutex;

    use inplace_core::scene::SceneSource;
    use inplace_core::scene::demo::Shot;
    use inplace_core::session::{Event, FrameMap};

    use super::*;
    use crate::dialogs::{ClassUse, Dialog};
    use crate::jobs::JobTools;
    use crate::model::{Stage, Start};
    use crate::opening::Target;
    use crate::preferences::Preferences;
    use crate::project_session::ProjectSession;
    use crate::tool::{DrawnLine, Tool};
    use crate::workspace::Workspace;
    use crate::{Command, Input};

    #[test]
    fn a_window_that_waits_for_an_export_stays_open_where_that_fails() {
        let mut model = Model::new(Start::default(), Preferences::default());
        for (outcome, closes) in [
            (ExportProgress::Failed("The disk is full.".to_owned()), false),
            (ExportProgress::Cancelled(PathBuf::from("out"), 0, 1), true),
        ] {
            model.state.export = Some(ExportProgress::Writing(0, 1));
            model.update(Command::CloseWindow);
            let effects = model.update(Input::Done(Done::Exported(outcome)));
            let is_close = |effect: &Effect| matches!(effect, Effect::CloseWindow);
            assert_eq!(effects.iter().any(is_close), closes);
        }
    }

    #[test]
    fn an_export_waits_until_all_maps_follow_the_labels_and_has_those_that_they_follow() {
        let folder = tempfile::tempdir().unwrap();
        let mut model = Model::new(Start::default(), Preferences::default());
        let workspace = Workspace::of_test(Shot::new(1, [16, 16]).scene(&|_, _| {}));
        let maps = Arc::clone(workspace.session.maps());
        maps.reset(1);
        model.state.stage = Stage::Open(Box::new(workspace));
        let add = |model: &mut Model, name: &str| {
            model.update(Command::AddClass(ClassUse::Choose, name.to_owned()));
        };
        let export = |model: &mut Model| {
            let path = folder.path().display().to_string();
            let choice = ExportChoice {
                path,
                ..ExportChoice::default()
            };
            model.update(Command::Export(choice))
        };
        let job = |effects: Vec<Effect>| {
            effects.into_iter().find_map(|effect| match effect {
                Effect::Start(job) => Some(job),
                _ => None,
            })
        };
        add(&mut model, "wall");
        assert!(job(export(&mut model)).is_none() && model.is_exporting());
        add(&mut model, "floor");
        let generation = model.workspace().unwrap().document.generation();
        let map = FrameMap::new(0, generation, [16, 16], vec![0; 256], vec![0; 256]);
        assert!(maps.publish(map.unwrap()));
        let started = job(model.update(Input::Session(Event::AllMaps { generation })));
        let done = Mutex::new(Vec::new());
        let tell = |told| done.lock().unwrap().push(told);
        started.unwrap().run(&JobTools::of_test(), &tell);
        for told in done.into_inner().unwrap() {
            model.update(Input::Done(told));
        }
        assert!(!model.is_exporting());
        let classes = std::fs::read_to_string(folder.path().join("classes.json")).unwrap();
        assert!(classes.contains("floor"), "{classes}");

        add(&mut model, "door");
        assert!(job(export(&mut model)).is_none());
        model.update(Input::Session(Event::Stopped));
        let mut shown = model.messages.shown.iter();
        assert!(shown.any(|message| message.text.ends_with("open it again to export it.")));
        assert!(!model.is_exporting());
    }

    #[test]
    fn labels_that_are_on_no_disk_are_lost_only_when_one_insists() {
        let mut model = Model::new(Start::default(), Preferences::default());
        let open = |model: &mut Model| {
            let workspace = Workspace::of_test(Shot::new(1, [16, 16]).scene(&|_, _| {}));
            model.state.project = Some(ProjectSession::of_test(&workspace.scene));
            model.state.stage = Stage::Open(Box::new(workspace));
            model.update(Command::AddClass(ClassUse::Choose, "wall".to_owned()));
            model.state.dialog = None;
        };
        let stays = |effects: Vec<Effect>| {
            let keeps = |effect: &Effect| matches!(effect, Effect::KeepWindowOpen);
            effects.iter().any(keeps)
        };
        open(&mut model);
        assert!(!stays(model.update(Command::CloseWindow)), "nothing is labelled");
        let click = |model: &mut Model| {
            let (tool, points) = (Tool::Brush, vec![[8, 8]]);
            model.update(Command::Draw(DrawnLine { tool, points }));
        };
        click(&mut model);
        assert!(stays(model.update(Command::CloseWindow)));
        assert!(matches!(model.dialog, Some(Dialog::SaveAs(_))));
        model.update(Command::Show(None));
        click(&mut model);
        assert!(stays(model.update(Command::CloseWindow)), "more would be lost");
        // While a file is being made the window closes neither.
        model.update(Command::SaveTo(PathBuf::from("slow.inplace")));
        assert!(stays(model.update(Command::CloseWindow)) && model.dialog.is_none());
        assert!(!stays(model.update(Command::CloseWindow)));

        let closes = |model: &mut Model| {
            let ended = ExportProgress::Cancelled(PathBuf::from("out"), 0, 1);
            let effects = model.update(Input::Done(Done::Exported(ended)));
            effects.iter().any(|effect| matches!(effect, Effect::CloseWindow))
        };
        open(&mut model);
        model.state.export = Some(ExportProgress::Writing(0, 1));
        model.update(Command::CloseWindow);
        click(&mut model);
        assert!(closes(&mut model));
        assert!(stays(model.update(Command::CloseWindow)));
        assert!(!closes(&mut model), "the window stays open after the next export");

        open(&mut model);
        click(&mut model);
        model.update(Command::Open(Target::Scene(SceneSource::Demo)));
        assert!(matches!(model.stage, Stage::Open(_)));
        model.update(Command::CloseScene);
        assert!(matches!(model.stage, Stage::Start));
    }
}
