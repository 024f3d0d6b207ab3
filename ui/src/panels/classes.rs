//! The class list: choose, add, find, order, rename, recolour, merge, delete, lock, hide.

mod color;
mod menu;
mod row;

use egui::{Key, Rect, ScrollArea, Ui, vec2};
use inplace_core::labels::{Class, ClassId, PALETTES, VOID};
use inplace_model::dialogs::{AddClasses, Dialog};
use inplace_model::palette::VOID_COLOR;
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use crate::theme;
use crate::widgets::{Icon, empty_state, heading, icon_button, scroll_to, text_line};
use row::{ROW, Row};

/// So many classes have a field to search in them.
const SEARCH_FROM: usize = 10;

/// The class list with what is being typed in it.
#[derive(Debug, Default)]
pub struct ClassPanel {
    new_name: String,
    search: String,
    renaming: Option<(ClassId, String)>,
    /// The class that was chosen when the list was drawn last, to bring another one into view.
    chosen: Option<ClassId>,
}

impl ClassPanel {
    /// Draws the list.
    pub fn show(&mut self, ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
        heading(ui, "Classes", |ui| menu::of_list(ui, workspace, commands));
        self.add_field(ui, workspace, commands);
        let classes = workspace.document.classes();
        if classes.is_empty() {
            palettes(ui, commands);
        }
        if classes.len() >= SEARCH_FROM {
            self.search_field(ui);
        } else {
            self.search.clear();
        }
        let found = self.found(classes);
        if found.is_empty() && !classes.is_empty() {
            empty_state(ui, "No class has this in its name.");
        }
        ui.spacing_mut().item_spacing.y = 2.0;
        let chosen = workspace.class;
        let moved_to = chosen.filter(|_| self.chosen != chosen).map(|chosen| {
            let line = found.iter().position(|&index| classes[index].id == chosen);
            line.unwrap_or(found.len())
        });
        self.chosen = chosen;
        // Void is the line after the last.
        ScrollArea::vertical()
            .auto_shrink([false, true])
            .show_rows(ui, ROW, found.len() + 1, |ui, range| {
                if let Some(line) = moved_to {
                    let step = ROW + ui.spacing().item_spacing.y;
                    let top = ui.max_rect().top() + (line as f32 - range.start as f32) * step;
                    let place = Rect::from_x_y_ranges(ui.max_rect().x_range(), top..=top + ROW);
                    scroll_to(ui, place);
                }
                for line in range {
                    match found.get(line) {
                        Some(&index) => {
                            let class = &classes[index];
                            ui.push_id(class.id, |ui| self.row(ui, workspace, index, class, commands));
                        }
                        None => void_row(ui, workspace, commands),
                    }
                }
            });
    }

    /// Indices of the classes that have the text of the search field in their name.
    fn found(&self, classes: &[Class]) -> Vec<usize> {
        let text = self.search.trim().to_lowercase();
        let classes = classes.iter().enumerate();
        let found = classes.filter(|(_, class)| text.is_empty() || class.name.to_lowercase().contains(&text));
        found.map(|(index, _)| index).collect()
    }

    fn search_field(&mut self, ui: &mut Ui) {
        let field = text_line(&mut self.search, "Search classes", f32::INFINITY);
        let response = ui.add(field).accessible_name("Search classes");
        if response.has_focus() && self.search.is_empty() && pointer_left(ui) {
            response.surrender_focus();
        }
        if response.lost_focus() && ui.input(|input| input.key_pressed(Key::Escape)) {
            self.search.clear();
        }
    }

    fn add_field(&mut self, ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
        ui.horizontal(|ui| {
            let width = ui.available_width() - ui.spacing().interact_size.y - theme::GAP;
            let field = text_line(&mut self.new_name, "New class", width);
            let response = ui.add(field).accessible_name("New class");
            let entered = response.lost_focus() && ui.input(|input| input.key_pressed(Key::Enter));
            let name = self.new_name.trim();
            let mut classes = workspace.document.classes().iter();
            let known = classes.find(|class| class.is_named(name)).map(|class| class.id);
            let possible = !name.is_empty() && known.is_none();
            let clicked = ui
                .add_enabled_ui(possible, |ui| icon_button(ui, Icon::Add, "Add class").clicked())
                .inner;
            if possible && (entered || clicked) {
                commands.push(Command::AddClass(name.to_owned()));
                self.new_name.clear();
                // Ready for the next name.
                response.request_focus();
            } else if let (Some(known), true) = (known, entered) {
                commands.push(Command::ChooseClass(known));
                self.new_name.clear();
            } else if response.has_focus() && self.new_name.is_empty() && pointer_left(ui) {
                response.surrender_focus();
            }
        });
    }

    fn row(
        &mut self,
        ui: &mut Ui,
        workspace: &Workspace,
        index: usize,
        class: &Class,
        commands: &mut Commands,
    ) {
        if let Some((id, name)) = &mut self.renaming
            && *id == class.id
        {
            if rename_field(ui, class, name, commands) {
                self.renaming = None;
            }
            return;
        }
        let row = Row {
            id: class.id,
            name: &class.name,
            color: class.color,
            strokes: workspace.document.strokes_of_class(class.id),
            slot: (index < 9).then_some(index + 1),
            chosen: workspace.class == Some(class.id),
            said: workspace
                .said()
                .filter(|said| said.class == class.id)
                .map(|said| said.name.as_str()),
            locked: workspace.is_locked(class.id),
            hidden: workspace.is_hidden(class.id),
        };
        let (response, parts) = row.show(ui, commands);
        let mut rename = response.double_clicked();
        if self.search.trim().is_empty() {
            let count = workspace.document.classes().len();
            row::reorder(ui, &response, class.id, index, count, commands);
        }
        color::recolor_popup(ui, class, parts.swatch, commands);
        row.buttons(ui, &response, &parts, commands);
        rename |= menu::of_class(ui, &response, workspace, index, parts.menu, commands);
        if rename && row.locked {
            // Refused with the reason.
            commands.push(Command::RenameClass(class.id, class.name.clone()));
        } else if rename {
            self.renaming = Some((class.id, class.name.clone()));
        }
    }
}

/// What to start from where there is no class yet.
fn palettes(ui: &mut Ui, commands: &mut Commands) {
    ui.add_space(0.5 * theme::GAP);
    empty_state(
        ui,
        "No classes yet. Type a name and press Enter, click on something in the image, or start from the classes of a data set:",
    );
    ui.horizontal_wrapped(|ui| {
        for (index, palette) in PALETTES.iter().enumerate() {
            let button = ui.button(palette.name).on_hover_text(palette.scenes);
            if button.clicked() {
                let add = Dialog::AddClasses(Box::new(AddClasses::new(index)));
                commands.push(Command::Show(Some(add)));
            }
        }
    });
    ui.add_space(theme::GAP);
}

/// Whether the pointer moves elsewhere: then keys are meant for the image again.
fn pointer_left(ui: &Ui) -> bool {
    let panel = ui.clip_rect();
    ui.input(|input| {
        let position = input.pointer.hover_pos();
        position.is_some_and(|position| !panel.contains(position))
            && input.pointer.delta() != egui::Vec2::ZERO
    })
}

fn void_row(ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
    let row = Row {
        id: VOID,
        name: "void",
        color: VOID_COLOR,
        strokes: workspace.document.strokes_of_class(VOID),
        slot: Some(0),
        chosen: workspace.class == Some(VOID),
        said: None,
        locked: false,
        hidden: false,
    };
    let (response, _) = row.show(ui, commands);
    response.on_hover_text("Nothing here: not trained on, and exported as 0");
}

/// A text field in place of the row; returns whether renaming is over.
fn rename_field(ui: &mut Ui, class: &Class, name: &mut String, commands: &mut Commands) -> bool {
    let field = egui::TextEdit::singleline(name)
        .margin(vec2(8.0, 6.0))
        .min_size(vec2(0.0, ROW))
        .desired_width(f32::INFINITY);
    let response = ui.add(field).accessible_name(format!("Rename {}", class.name));
    if response.lost_focus() {
        let cancelled = ui.input(|input| input.key_pressed(Key::Escape));
        let trimmed = name.trim();
        if !cancelled && !trimmed.is_empty() && trimmed != class.name {
            commands.push(Command::RenameClass(class.id, trimmed.to_owned()));
        }
        return true;
    }
    if !response.has_focus() {
        response.request_focus();
    }
    false
}
