//! Dialogs over the window: opening, saving, exporting, the first class, the keys.

mod classes;
mod export;
mod finder;
mod import;
mod moved;
mod settings;

use std::path::{Path, PathBuf};

use egui::{Key, Ui};
use inplace_core::labels::{Stroke, Trust};
use inplace_core::scene::SceneSource;

pub use classes::AddClasses;
pub use export::ExportChoice;
pub use finder::{ClassFinder, ClassUse};
pub use moved::MovedScene;
pub use settings::SettingsPage;

use crate::action::{Action, Actions};
use crate::english;
use crate::english::{classes as class_words, dialogs as words};
use crate::keymap::KeyMap;
use crate::keys;
use crate::state::AppState;
use crate::widgets::main_button_enabled;

/// What a path is asked for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Purpose {
    /// The folder of a capture, to open.
    Scene,
    /// A project file, to open.
    Project,
    /// A project file, to write.
    SaveAs,
    /// A folder, to export into.
    Export,
    /// A folder of label images, to import.
    Import,
    /// The folder that a project's scene has moved into.
    Moved,
    /// A class list, to read.
    Classes,
    /// A class list, to write.
    SaveClasses,
}

impl Purpose {
    /// Title of the system's dialog.
    pub fn title(self) -> &'static str {
        words::system_title(self)
    }
}

/// The dialog shown.
#[derive(Clone, Debug, PartialEq)]
pub enum Dialog {
    /// Asks for a scene or project to open.
    Open {
        /// The path typed so far.
        path: String,
    },
    /// Asks for a project file to write.
    SaveAs {
        /// The path typed so far.
        path: String,
    },
    /// Asks what to export, and for a folder to export into.
    Export(ExportChoice),
    /// Asks for a folder of label images.
    Import {
        /// The path typed so far.
        path: String,
        /// How far its pixels can be believed.
        trust: Trust,
    },
    /// Asks for the name of the first class; the stroke that waited for it is then added.
    FirstClass {
        /// The name typed so far.
        name: String,
        /// The stroke, without its class.
        waiting: Stroke,
    },
    /// Adds classes of a data set or a file.
    AddClasses(Box<AddClasses>),
    /// Asks for a file to write the classes to.
    SaveClasses {
        /// The path typed so far.
        path: String,
    },
    /// Finds a class by part of its name.
    FindClass(Box<ClassFinder>),
    /// Shows the keys.
    Help,
    /// Shows what the person can choose once for all scenes.
    Settings(SettingsPage),
    /// Asks where the scene of a project is now.
    Moved(MovedScene),
}

impl Dialog {
    /// Asks for something to open.
    pub const fn open() -> Self {
        Self::Open { path: String::new() }
    }

    /// Asks what to export; the path, and what was chosen last, are filled in when it is shown.
    pub const fn export() -> Self {
        Self::Export(ExportChoice::new())
    }

    /// Asks for a folder of label images.
    pub const fn import() -> Self {
        Self::Import {
            path: String::new(),
            trust: Trust::VOTES,
        }
    }

    /// Shows the settings.
    pub const fn settings() -> Self {
        Self::Settings(SettingsPage::new())
    }

    /// Puts a path that the system's dialog gave into the path field.
    pub fn take_path(&mut self, picked: &Path) {
        match self {
            Self::Open { path }
            | Self::SaveAs { path }
            | Self::Export(ExportChoice { path, .. })
            | Self::Import { path, .. }
            | Self::SaveClasses { path } => {
                *path = picked.display().to_string();
            }
            Self::Moved(moved) => moved.path = picked.display().to_string(),
            Self::AddClasses(dialog) => dialog.take_path(picked),
            Self::FirstClass { .. } | Self::FindClass(_) | Self::Help | Self::Settings(_) => {}
        }
    }

    fn title(&self) -> &'static str {
        match self {
            Self::Open { .. } => words::OPEN,
            Self::SaveAs { .. } => words::SAVE_AS,
            Self::Export(_) => words::EXPORT,
            Self::Import { .. } => words::IMPORT,
            Self::FirstClass { .. } => words::FIRST_CLASS,
            Self::AddClasses(_) => class_words::ADD_MANY_TITLE,
            Self::SaveClasses { .. } => class_words::SAVE_TITLE,
            Self::FindClass(_) => class_words::FIND,
            Self::Help => words::KEYS,
            Self::Settings(_) => english::settings::TITLE,
            Self::Moved(_) => english::opening::MOVED,
        }
    }

    /// Draws the dialog; pushes what was asked for.
    pub fn show(&mut self, ctx: &egui::Context, state: &AppState, actions: &mut Actions) {
        if let Self::FindClass(finder) = self {
            finder.show(ctx, actions);
            return;
        }
        let width: f32 = match self {
            Self::Help | Self::Settings(_) | Self::AddClasses(_) => 560.0,
            _ => 460.0,
        };
        let width = width.min(ctx.content_rect().width() - 64.0);
        if let Self::Settings(page) = self {
            page.listen(ctx, actions);
        }
        let frame = egui::Frame::popup(&ctx.global_style()).inner_margin(20);
        let modal = egui::Modal::new(egui::Id::unique(self.title())).frame(frame);
        let modal = modal.show(ctx, |ui| {
            ui.set_width(width);
            ui.heading(self.title());
            ui.add_space(4.0);
            match self {
                Self::Open { path } => open(ui, path, actions),
                Self::SaveAs { path } => save_as(ui, path, actions),
                Self::Export(choice) => choice.show(ui, actions),
                Self::Import { path, trust } => import::show(ui, path, trust, actions),
                Self::FirstClass { name, .. } => first_class(ui, name, actions),
                Self::AddClasses(dialog) => dialog.show(ui, actions),
                Self::SaveClasses { path } => classes::save_classes(ui, path, actions),
                Self::FindClass(_) => {}
                Self::Help => help(ui, actions),
                Self::Settings(page) => page.show(ui, state, actions),
                Self::Moved(moved) => moved.show(ui, actions),
            }
        });
        if modal.should_close() {
            actions.push(Action::Show(None));
        }
    }
}

fn open(ui: &mut Ui, path: &mut String, actions: &mut Actions) {
    ui.label(words::OPEN_EXPLAINED);
    let entered = path_field(ui, path, english::start::PATH);
    ui.horizontal(|ui| {
        if ui.button(words::BROWSE_FOLDERS).clicked() {
            actions.push(Action::Browse(Purpose::Scene));
        }
        if ui.button(words::BROWSE_PROJECTS).clicked() {
            actions.push(Action::Browse(Purpose::Project));
        }
        if ui.button(words::DEMO).clicked() {
            actions.push(Action::OpenScene(SceneSource::Demo));
        }
    });
    let path = path.trim();
    confirm(ui, words::OPEN, !path.is_empty(), entered, actions, || {
        Action::OpenPath(PathBuf::from(path))
    });
}

fn save_as(ui: &mut Ui, path: &mut String, actions: &mut Actions) {
    ui.label(words::SAVE_AS_EXPLAINED);
    let entered = path_field(ui, path, words::PROJECT_FILE);
    if ui.button(words::BROWSE).clicked() {
        actions.push(Action::Browse(Purpose::SaveAs));
    }
    let path = path.trim();
    confirm(ui, words::SAVE, !path.is_empty(), entered, actions, || {
        let mut file = PathBuf::from(path);
        if file.extension().is_none() {
            file.set_extension("inplace");
        }
        Action::SaveTo(file)
    });
}

fn first_class(ui: &mut Ui, name: &mut String, actions: &mut Actions) {
    ui.label(words::FIRST_CLASS_EXPLAINED);
    let entered = text_field(ui, name, words::CLASS_NAME, words::CLASS_NAME_HINT);
    let name = name.trim();
    confirm(ui, class_words::ADD, !name.is_empty(), entered, actions, || {
        Action::AddClass(name.to_owned())
    });
}

fn help(ui: &mut Ui, actions: &mut Actions) {
    let map = KeyMap::of(ui.ctx());
    egui::ScrollArea::vertical()
        .auto_shrink([false, true])
        .max_height(room(ui.ctx()))
        .show(ui, |ui| {
            egui::Grid::new("keys")
                .num_columns(2)
                .min_row_height(18.0)
                .spacing([24.0, 8.0])
                .show(ui, |ui| {
                    for row in keys::TABLE.iter().chain(keys::AT_A_SUGGESTION) {
                        ui.label(egui::RichText::new(row.present(&map)).strong());
                        ui.add(egui::Label::new(row.words.does).wrap());
                        ui.end_row();
                    }
                });
        });
    ui.add_space(8.0);
    at_the_end(ui, |ui| {
        if ui.button(words::CLOSE).clicked() {
            actions.push(Action::Show(None));
        }
    });
}

/// Height for what scrolls in a dialog.
fn room(ctx: &egui::Context) -> f32 {
    (ctx.content_rect().height() - 176.0).max(96.0)
}

/// A text field for a path that has the focus first; returns whether Enter was pressed in it.
fn path_field(ui: &mut Ui, path: &mut String, name: &str) -> bool {
    text_field(ui, path, name, words::PATH_HINT)
}

fn text_field(ui: &mut Ui, text: &mut String, name: &str, hint: &'static str) -> bool {
    let edit = egui::TextEdit::singleline(text)
        .hint_text(hint)
        .desired_width(f32::INFINITY)
        .margin(egui::vec2(8.0, 6.0));
    let response = ui.add(edit).accessible_name(name);
    let first = ui.memory(|memory| memory.focused().is_none());
    if first && !response.lost_focus() {
        response.request_focus();
    }
    response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter))
}

/// One line of controls from the right.
fn at_the_end(ui: &mut Ui, controls: impl FnOnce(&mut Ui)) {
    ui.horizontal(|ui| {
        ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), controls);
    });
}

/// The row of buttons at the end of a dialog.
fn confirm(
    ui: &mut Ui,
    verb: &str,
    possible: bool,
    entered: bool,
    actions: &mut Actions,
    action: impl FnOnce() -> Action,
) {
    ui.add_space(8.0);
    at_the_end(ui, |ui| {
        let confirmed = main_button_enabled(ui, possible, verb).clicked();
        if possible && (confirmed || entered) {
            actions.push(action());
        }
        if ui.button(words::CANCEL).clicked() {
            actions.push(Action::Show(None));
        }
    });
}
