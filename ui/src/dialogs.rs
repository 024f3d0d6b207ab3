//! Dialogs over the window: opening, saving, exporting, importing, comparing, classes, keys and settings.

mod classes;
mod export;
mod finder;
mod form;
mod settings;

use std::path::{Path, PathBuf};

use egui::{Pos2, Rect, Slider, Ui};
use inplace_core::labels::Trust;
use inplace_core::scene::SceneSource;
use inplace_model::dialogs::{ClassUse, Dialog, MovedScene, Purpose, typed_path};
use inplace_model::opening::Target;
use inplace_model::{Command, Commands, Model};

use crate::keys;
use crate::keys::table::{AT_A_PLACE, AT_A_SUGGESTION, Line, TABLE};
use crate::numbers;
use crate::widgets::main_button_enabled;
use form::{at_the_end, browse, close, confirm, path_field, room, text_field};

/// Files that are saved: what is said of them, the name of the field, the extension.
const PROJECT_FILE: [&str; 3] = [
    "Everything is kept in one file: classes, strokes, their history, and the result so far.",
    "Project file",
    "inplace",
];
const CLASS_FILE: [&str; 3] = [
    "Names, numbers and colours, for another scene or for a script.",
    "Class list file",
    "json",
];

/// The dialogs, with what they remember between frames.
#[derive(Debug, Default)]
pub struct Dialogs {
    /// Where the class finder is, while it is shown.
    finder_at: Option<Pos2>,
}

impl Dialogs {
    /// Draws the dialog that is shown, if any; pushes what was asked for, and returns what was typed or chosen in it.
    pub fn show(
        &mut self,
        ctx: &egui::Context,
        model: &Model,
        canvas: Rect,
        commands: &mut Commands,
    ) -> Option<Command> {
        let before = model.dialog.as_ref();
        if !matches!(before, Some(Dialog::FindClass(_))) {
            self.finder_at = None;
        }
        let before = before?;
        let mut dialog = before.clone();
        if let Dialog::FindClass(finder) = &mut dialog {
            let at = *self.finder_at.get_or_insert_with(|| {
                let pointer = ctx.pointer_latest_pos();
                let over_canvas = pointer.filter(|&position| canvas.contains(position));
                over_canvas.unwrap_or_else(|| canvas.center())
            });
            finder::show(ctx, finder, at, commands);
        } else {
            modal(ctx, &mut dialog, model, commands);
        }
        (dialog != *before).then_some(Command::Edit(dialog))
    }
}

fn title(dialog: &Dialog) -> &'static str {
    match dialog {
        Dialog::Open(_) => "Open",
        Dialog::SaveAs(_) => "Save project as",
        Dialog::ReplaceFile(_) => "Replace this file?",
        Dialog::Export(_) => "Export",
        Dialog::Import { .. } => "Import labels",
        Dialog::Compare(_) => "Compare with another project",
        Dialog::FirstClass { .. } => "Name the first class",
        Dialog::AddClasses(_) => "Add classes",
        Dialog::SaveClasses(_) => "Save classes",
        Dialog::FindClass(_) => "Find a class",
        Dialog::Help => "Keys and gestures",
        Dialog::Settings(_) => "Settings",
        Dialog::Moved(_) => "Where is the scene now?",
    }
}

fn modal(ctx: &egui::Context, dialog: &mut Dialog, model: &Model, commands: &mut Commands) {
    let width: f32 = match dialog {
        Dialog::Help | Dialog::Settings(_) | Dialog::AddClasses(_) => 560.0,
        _ => 460.0,
    };
    let width = width.min(ctx.content_rect().width() - 64.0);
    if let Dialog::Settings(choosing) = dialog {
        settings::listen(choosing, ctx, commands);
    }
    let title = title(dialog);
    let frame = egui::Frame::popup(&ctx.global_style()).inner_margin(20);
    let modal = egui::Modal::new(egui::Id::unique(title)).frame(frame);
    let modal = modal.show(ctx, |ui| {
        ui.set_width(width);
        ui.heading(title);
        ui.add_space(4.0);
        match dialog {
            Dialog::Open(path) => open(ui, path, commands),
            Dialog::SaveAs(path) => save(ui, path, Purpose::SaveAs, commands),
            Dialog::ReplaceFile(path) => replace(ui, path, commands),
            Dialog::Export(choice) => export::show(ui, choice, commands),
            Dialog::Import { path, trust } => import(ui, path, trust, commands),
            Dialog::Compare(path) => compare(ui, path, commands),
            Dialog::FirstClass { name, .. } => first_class(ui, name, commands),
            Dialog::AddClasses(dialog) => classes::show(ui, dialog, commands),
            Dialog::SaveClasses(path) => save(ui, path, Purpose::SaveClasses, commands),
            Dialog::FindClass(_) => {}
            Dialog::Help => help(ui, commands),
            Dialog::Settings(choosing) => settings::show(choosing, ui, model, commands),
            Dialog::Moved(scene) => moved(ui, scene, commands),
        }
    });
    // What waits for its class is not given up by a click beside the question.
    let waits = matches!(dialog, Dialog::FirstClass { .. }) && modal.backdrop_response.clicked();
    if modal.should_close() && !waits {
        commands.push(Command::Show(None));
    }
}

fn open(ui: &mut Ui, path: &mut String, commands: &mut Commands) {
    ui.label("The folder of a scene, or a project file (.inplace).");
    let entered = path_field(ui, path, "Path to open");
    ui.horizontal(|ui| {
        browse(ui, "Browse folders...", Purpose::Scene, commands);
        browse(ui, "Browse projects...", Purpose::Project, commands);
        if ui.button("Demo scene").clicked() {
            commands.push(Command::open_scene(SceneSource::Demo));
        }
    });
    let path = path.trim();
    confirm(ui, "Open", !path.is_empty(), entered, commands, || {
        Command::Open(Target::Path(typed_path(path)))
    });
}

/// Asks for a file to write: the classes, or else the project.
fn save(ui: &mut Ui, path: &mut String, purpose: Purpose, commands: &mut Commands) {
    let is_project = purpose != Purpose::SaveClasses;
    let [about, field, extension] = if is_project { PROJECT_FILE } else { CLASS_FILE };
    ui.label(about);
    let entered = path_field(ui, path, field);
    browse(ui, "Browse...", purpose, commands);
    let path = path.trim();
    confirm(ui, "Save", !path.is_empty(), entered, commands, || {
        let file = with_extension(path, extension);
        if is_project {
            Command::SaveTo(file)
        } else {
            Command::SaveClassesTo(file)
        }
    });
}

/// Asks before a file is replaced. Where "Save" was is what loses nothing, for whoever pressed twice.
fn replace(ui: &mut Ui, path: &Path, commands: &mut Commands) {
    ui.label(format!(
        "{} already exists. Its contents would be lost.",
        path.display()
    ));
    ui.add_space(8.0);
    at_the_end(ui, |ui| {
        if main_button_enabled(ui, true, "Choose another name").clicked() {
            commands.push(Command::Show(Some(Dialog::SaveAs(path.display().to_string()))));
        }
        if ui.button("Replace it").clicked() {
            commands.push(Command::ReplaceFile(path.to_path_buf()));
        }
        if ui.button("Cancel").clicked() {
            commands.push(Command::Show(None));
        }
    });
}

/// The file at a path, whose name gets this extension where it ends otherwise: "room 1.2" has none.
fn with_extension(path: &str, extension: &str) -> PathBuf {
    let mut file = typed_path(path);
    let own = file.extension();
    if !own.is_some_and(|own| own.eq_ignore_ascii_case(extension))
        && let Some(name) = file.file_name()
    {
        let mut name = name.to_owned();
        name.push(format!(".{extension}"));
        file.set_file_name(name);
    }
    file
}

fn first_class(ui: &mut Ui, name: &mut String, commands: &mut Commands) {
    ui.label("What is it that you clicked on? Your click is kept and gets this class.");
    let entered = text_field(ui, name, "Class name", "for example: wall");
    let name = name.trim();
    confirm(ui, "Add class", !name.is_empty(), entered, commands, || {
        Command::AddClass(ClassUse::Choose, name.to_owned())
    });
}

fn help(ui: &mut Ui, commands: &mut Commands) {
    let map = keys::map_of(ui.ctx());
    egui::ScrollArea::vertical()
        .auto_shrink([false, true])
        .max_height(room(ui.ctx()))
        .show(ui, |ui| {
            egui::Grid::new("keys")
                .num_columns(2)
                .min_row_height(18.0)
                .spacing([24.0, 8.0])
                .show(ui, |ui| {
                    for line in TABLE.iter().chain(AT_A_SUGGESTION).chain(AT_A_PLACE) {
                        let (keys, does) = match line {
                            Line::Command(command) => (command.present(&map), command.does),
                            Line::Gesture(gesture, does) => ((*gesture).to_owned(), *does),
                        };
                        ui.label(egui::RichText::new(keys).strong());
                        ui.add(egui::Label::new(does).wrap());
                        ui.end_row();
                    }
                });
        });
    close(ui, commands);
}

/// From one trust to the next, in per cent.
const TRUST_STEP: f64 = 5.0;

/// Asks for the folder, and how far its pixels can be believed.
fn import(ui: &mut Ui, path: &mut String, trust: &mut Trust, commands: &mut Commands) {
    ui.label("A folder of files named like the frames, such as a network's predictions or an earlier export: PNGs with class ids or colours, NPYs or NPZs with probabilities, or PNGs with numbers of objects, which an objects.json lists. Pixels that may be wrong are outvoted where many disagree.");
    let entered = path_field(ui, path, "Folder of label images");
    browse(ui, "Browse...", Purpose::Import, commands);
    ui.add_space(4.0);
    ui.horizontal(|ui| {
        ui.label("Trust");
        let mut percent = 100.0 * trust.value();
        let slider = Slider::new(&mut percent, 0.0..=100.0)
            .step_by(TRUST_STEP)
            .show_value(false);
        let response = ui.add(slider).accessible_name("Trust in the imported pixels");
        if response.changed()
            && let Some(chosen) = Trust::new(percent / 100.0)
        {
            *trust = chosen;
        }
        ui.label(numbers::share(trust.value()));
    });
    ui.label(meaning(*trust));
    let path = path.trim();
    confirm(ui, "Import", !path.is_empty(), entered, commands, || {
        Command::ImportFrom(typed_path(path), *trust)
    });
}

/// Asks for the project to compare with.
fn compare(ui: &mut Ui, path: &mut String, commands: &mut Commands) {
    ui.label("Another project of this scene, such as a colleague's. The layer \"Differences\" then shows where its labels and yours are not the same; nothing of it is kept in yours.");
    let entered = path_field(ui, path, "Project to compare with");
    browse(ui, "Browse...", Purpose::Compare, commands);
    let path = path.trim();
    confirm(ui, "Compare", !path.is_empty(), entered, commands, || {
        Command::CompareWith(typed_path(path))
    });
}

/// What a trust means.
fn meaning(trust: Trust) -> &'static str {
    match trust.value() {
        1.0 => "Every labelled pixel is right, as your strokes are.",
        above if above > 0.6 => "Mostly right: your strokes correct them close by.",
        about if about >= 0.4 => {
            "They may be wrong: your strokes correct them on what they are connected with."
        }
        below if below > 0.0 => "Often wrong: your strokes correct them from afar, too.",
        _ => "They only fill in what none of your strokes leads to.",
    }
}

fn moved(ui: &mut Ui, moved: &mut MovedScene, commands: &mut Commands) {
    match &moved.problem {
        Some(problem) => ui.colored_label(ui.visuals().error_fg_color, problem),
        None => ui.label(question(&moved.project, &moved.missing)),
    };
    ui.label(
        "Choose the folder where it is now. The project remembers it, and all of your work is there again.",
    );
    let entered = path_field(ui, &mut moved.path, "Folder of the scene");
    browse(ui, "Browse...", Purpose::Moved, commands);
    let path = moved.path.trim().to_owned();
    confirm(ui, "Open from there", !path.is_empty(), entered, commands, || {
        Command::Open(Target::Moved {
            project: moved.project.clone(),
            folder: typed_path(&path),
        })
    });
}

/// What is missing.
fn question(project: &Path, missing: &Path) -> String {
    let name = project
        .file_name()
        .unwrap_or(project.as_os_str())
        .to_string_lossy();
    if missing.as_os_str().is_empty() {
        return format!("{name} no longer says where the scene is that it labels.");
    }
    format!(
        "{name} labels a scene that is no longer at {}.",
        missing.display()
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_gets_its_extension_unless_its_name_ends_so() {
        let files = [
            ("room", "room.inplace"),
            ("a/room 1.2", "a/room 1.2.inplace"),
            ("room.Inplace", "room.Inplace"),
            ("folder/", "folder.inplace"),
        ];
        for (path, file) in files {
            assert_eq!(with_extension(path, "inplace"), PathBuf::from(file));
        }
    }
}
