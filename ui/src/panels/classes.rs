//! The class list: choose, add, find, order, rename, recolour, merge, delete, lock, hide; with the objects of the classes.

mod color;
mod menu;
mod objects;
mod row;

use egui::{Key, Rect, ScrollArea, Ui, vec2};
use inplace_core::labels::{Class, ClassId, ObjectId, PALETTES, VOID};
use inplace_model::class_view::Named;
use inplace_model::dialogs::{AddClasses, ClassUse, Dialog};
use inplace_model::palette::VOID_COLOR;
use inplace_model::text::counted;
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use crate::theme;
use crate::widgets::{Icon, heading, icon_button, scroll_to, text_line, weak_text};
use objects::Listed;
use row::{ROW, Row};

/// So many classes have a field to search in them.
const SEARCH_FROM: usize = 10;

/// The class list with what is being typed in it.
#[derive(Debug, Default)]
pub struct ClassPanel {
    new_name: String,
    search: String,
    /// What is being renamed, and the name so far.
    renaming: Option<(Named, String)>,
    /// The class that was chosen when the list was drawn last, to bring another one into view.
    chosen: Option<ClassId>,
}

/// A line of the list.
enum Line<'a> {
    /// The class with this index, or an object of it.
    Of(usize, Option<Listed<'a>>),
    /// There is none of an unfolded class.
    NoObject,
    Void,
}

impl ClassPanel {
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
            weak_text(ui, "No class has this in its name.");
        }
        ui.spacing_mut().item_spacing.y = 2.0;
        let lines = lines(workspace, &found);
        let chosen = workspace.class;
        let moved_to = chosen.filter(|_| self.chosen != chosen).and_then(|chosen| {
            let is_chosen = |line: &Line<'_>| match line {
                Line::Of(index, None) => classes[*index].id == chosen,
                Line::Void => chosen == VOID,
                _ => false,
            };
            lines.iter().position(is_chosen)
        });
        self.chosen = chosen;
        ScrollArea::vertical()
            .auto_shrink([false, true])
            .show_rows(ui, ROW, lines.len(), |ui, range| {
                if let Some(line) = moved_to {
                    let step = ROW + ui.spacing().item_spacing.y;
                    let top = ui.max_rect().top() + (line as f32 - range.start as f32) * step;
                    let place = Rect::from_x_y_ranges(ui.max_rect().x_range(), top..=top + ROW);
                    scroll_to(ui, place);
                }
                for line in &lines[range] {
                    match *line {
                        Line::Of(index, own) => self.row(ui, workspace, index, own, commands),
                        Line::NoObject => objects::none(ui, workspace.followed.is_none()),
                        Line::Void => void_row(ui, workspace, commands),
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
                commands.push(Command::AddClass(ClassUse::Choose, name.to_owned()));
                self.new_name.clear();
                // Ready for the next name.
                response.request_focus();
            } else if let (Some(known), true) = (known, entered) {
                commands.push(Command::Choose(Named::Class(known)));
                self.new_name.clear();
            } else if response.has_focus() && self.new_name.is_empty() && pointer_left(ui) {
                response.surrender_focus();
            }
        });
    }

    /// The line of the class with this index, or of an object of it.
    fn row(
        &mut self,
        ui: &mut Ui,
        workspace: &Workspace,
        index: usize,
        own: Option<Listed<'_>>,
        commands: &mut Commands,
    ) {
        let class = &workspace.document.classes()[index];
        let row = match own {
            None => class_row(workspace, class, (index < 9).then_some(index + 1)),
            Some(own) => objects::row(workspace, class, own),
        };
        ui.push_id(row.named, |ui| {
            if let Some(name) = self.rename_field(ui, row.named, row.name) {
                commands.extend(name.map(|name| Command::Rename(row.named, name)));
                return;
            }
            let (mut response, parts) = row.show(ui, commands);
            let mut rename = response.double_clicked();
            match own {
                None => {
                    if self.search.trim().is_empty() {
                        let count = workspace.document.classes().len();
                        row::reorder(ui, &response, class.id, index, count, commands);
                    }
                    color::recolor_popup(ui, class, parts.swatch, commands);
                }
                Some(own) => {
                    objects::merge_by_drag(ui, workspace, &response, own.0, commands);
                    response = response.on_hover_ui(|ui| {
                        ui.label(objects::explained(workspace, class, own));
                    });
                }
            }
            row.buttons(ui, &response, &parts, commands);
            rename |= menu::of_row(ui, &row, &response, parts.menu, |ui| match own {
                None => menu::of_class(ui, workspace, index, &row, commands),
                Some(own) => objects::entries(ui, workspace, (class, own), &row, commands),
            });
            if rename && (row.locked || workspace.is_locked(class.id)) {
                // Refused with the reason.
                commands.push(Command::Rename(row.named, row.name.to_owned()));
            } else if rename {
                self.renaming = Some((row.named, row.name.to_owned()));
            }
        });
    }

    /// A text field in place of the line, if that is being renamed; with its new name, once it has one.
    fn rename_field(&mut self, ui: &mut Ui, of: Named, before: &str) -> Option<Option<String>> {
        let (_, name) = self.renaming.as_mut().filter(|(renamed, _)| *renamed == of)?;
        let field = egui::TextEdit::singleline(name)
            .margin(vec2(8.0, 6.0))
            .min_size(vec2(0.0, ROW))
            .desired_width(f32::INFINITY);
        let response = ui.add(field).accessible_name(format!("Rename {before}"));
        if response.lost_focus() {
            let cancelled = ui.input(|input| input.key_pressed(Key::Escape));
            let name = name.trim().to_owned();
            self.renaming = None;
            return Some(Some(name).filter(|name| !cancelled && !name.is_empty() && name != before));
        }
        if !response.has_focus() {
            response.request_focus();
        }
        Some(None)
    }
}

/// The lines of these classes, by their indices, with the objects of those that are unfolded; void is the last.
fn lines<'a>(workspace: &'a Workspace, found: &[usize]) -> Vec<Line<'a>> {
    let classes = workspace.document.classes();
    let mut lines = Vec::new();
    for &index in found {
        let class = &classes[index];
        lines.push(Line::Of(index, None));
        if can_have_objects(workspace, class) && workspace.class_view.unfolded.contains(&class.id) {
            let objects = workspace.objects_of(class.id);
            if objects.is_empty() {
                lines.push(Line::NoObject);
            }
            lines.extend(objects.into_iter().map(|own| Line::Of(index, Some(own))));
        }
    }
    lines.push(Line::Void);
    lines
}

/// The line of a class that this digit chooses.
fn class_row<'a>(workspace: &'a Workspace, class: &'a Class, slot: Option<usize>) -> Row<'a> {
    let said = workspace.said().filter(|said| said.class == class.id);
    let unlisted = said.filter(|said| !lists(workspace, class, said.id));
    let strokes = workspace.document.strokes_of_class(class.id);
    Row {
        named: Named::Class(class.id),
        name: &class.name,
        color: class.color,
        facts: counted(strokes, "stroke", "strokes"),
        number: (strokes > 0).then(|| strokes.to_string()),
        slot,
        chosen: workspace.class == Some(class.id),
        said: unlisted.map(|said| said.name.as_str()),
        locked: workspace.is_locked(class.id),
        hidden: workspace.is_hidden(class.id),
        unfolded: can_have_objects(workspace, class)
            .then(|| workspace.class_view.unfolded.contains(&class.id)),
    }
}

/// Whether an object has a line of its own.
fn lists(workspace: &Workspace, class: &Class, object: ObjectId) -> bool {
    let objects = workspace.objects_of(class.id);
    workspace.class_view.unfolded.contains(&class.id) && objects.iter().any(|(own, _)| own.id == object)
}

/// Whether a class can have objects to list: it is one of things, and something is labelled so.
fn can_have_objects(workspace: &Workspace, class: &Class) -> bool {
    let document = &workspace.document;
    class.thing && (document.strokes_of_class(class.id) > 0 || document.labels().imported.is_some())
}

/// What to start from where there is no class yet.
fn palettes(ui: &mut Ui, commands: &mut Commands) {
    ui.add_space(0.5 * theme::GAP);
    weak_text(
        ui,
        "No classes yet. Type a name and press Enter, click on something in the image, or start from the classes of a data set:",
    );
    ui.horizontal_wrapped(|ui| {
        for (index, palette) in PALETTES.iter().enumerate() {
            let button = ui.button(palette.name).on_hover_text(palette.scenes);
            if button.clicked() {
                let add = Dialog::AddClasses(Box::new(AddClasses::new(index, Vec::new())));
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
    let void = Class {
        color: VOID_COLOR,
        thing: false,
        ..Class::new(VOID, "void")
    };
    let (response, _) = class_row(workspace, &void, Some(0)).show(ui, commands);
    response.on_hover_text("Nothing here: not trained on, and exported as 0");
}
