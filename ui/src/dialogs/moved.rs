//! Asking where the scene of a project is now.

use std::path::{Path, PathBuf};

use egui::Ui;
use inplace_model::dialogs::{MovedScene, Purpose};
use inplace_model::opening::Target;
use inplace_model::{Command, Commands};

use super::form::{confirm, path_field};

/// Draws the question.
pub fn show(ui: &mut Ui, moved: &mut MovedScene, commands: &mut Commands) {
    match &moved.problem {
        Some(problem) => ui.colored_label(ui.visuals().error_fg_color, problem),
        None => ui.label(question(&moved.project, &moved.missing)),
    };
    ui.label(
        "Choose the folder where it is now. The project remembers it, and all of your work is there again.",
    );
    let entered = path_field(ui, &mut moved.path, "Folder of the scene");
    if ui.button("Browse...").clicked() {
        commands.push(Command::Browse(Purpose::Moved));
    }
    let path = moved.path.trim().to_owned();
    confirm(ui, "Open from there", !path.is_empty(), entered, commands, || {
        Command::Open(Target::Moved {
            project: moved.project.clone(),
            folder: PathBuf::from(path),
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
