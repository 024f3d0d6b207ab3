//! The dialogs that add many classes and write them to a file.

use std::path::{Path, PathBuf};

use egui::{RichText, ScrollArea, Ui, vec2};
use inplace_core::labels::{Class, PALETTES};

use super::{Purpose, confirm, path_field, text_field};
use crate::action::{Action, Actions};
use crate::english::{classes as english, dialogs as words};
use crate::widgets::{line_of_text, swatch};

/// Longer lists start without a tick: a person who wants all of them is rare.
const TICKED_FROM_THE_START: usize = 40;

/// Height of a line of the list, in points.
const LINE: f32 = 26.0;

/// The classes of a data set or a file, to tick and to add.
#[derive(Clone, Debug, PartialEq)]
pub struct AddClasses {
    source: Source,
    path: String,
    /// The classes of the source.
    choices: Vec<Choice>,
    search: String,
    /// The classes that the project has.
    present: Vec<Class>,
    problem: Option<String>,
}

/// A class to choose.
#[derive(Clone, Debug, PartialEq)]
struct Choice {
    class: Class,
    ticked: bool,
    /// Whether the project has a class of this name.
    there: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Source {
    /// One of [`PALETTES`].
    Palette(usize),
    File,
}

impl AddClasses {
    /// Begins with one of [`PALETTES`]; the project's classes come by [`AddClasses::begin`].
    pub fn new(palette: usize) -> Self {
        Self {
            source: Source::Palette(palette.min(PALETTES.len() - 1)),
            path: String::new(),
            choices: Vec::new(),
            search: String::new(),
            present: Vec::new(),
            problem: None,
        }
    }

    /// Takes over which classes the project has.
    pub fn begin(&mut self, present: Vec<Class>) {
        self.present = present;
        self.choose(self.source);
    }

    /// Takes over what a file holds, or a sentence that says why it cannot be used.
    pub fn take_file(&mut self, read: Result<Vec<Class>, String>) {
        if self.source == Source::File {
            match read {
                Ok(classes) => self.list(classes),
                Err(sentence) => {
                    self.list(Vec::new());
                    self.problem = Some(sentence);
                }
            }
        }
    }

    pub(super) fn take_path(&mut self, path: &Path) {
        self.path = path.display().to_string();
    }

    fn choose(&mut self, source: Source) {
        self.source = source;
        self.list(match source {
            Source::Palette(index) => PALETTES[index].classes(),
            Source::File => Vec::new(),
        });
    }

    fn list(&mut self, classes: Vec<Class>) {
        let ticked = classes.len() <= TICKED_FROM_THE_START;
        let choice = |class: Class| Choice {
            there: self.present.iter().any(|present| present.is_named(&class.name)),
            ticked,
            class,
        };
        self.choices = classes.into_iter().map(choice).collect();
        self.search.clear();
        self.problem = None;
    }

    /// Indices of the classes that have the text of the search field in their name.
    fn found(&self) -> Vec<usize> {
        let text = self.search.trim().to_lowercase();
        let choices = self.choices.iter().enumerate();
        let found = choices.filter(|(_, choice)| choice.class.name.to_lowercase().contains(&text));
        found.map(|(index, _)| index).collect()
    }

    fn ticked(&self) -> impl Iterator<Item = &Class> {
        let ticked = self
            .choices
            .iter()
            .filter(|choice| choice.ticked && !choice.there);
        ticked.map(|choice| &choice.class)
    }

    pub(super) fn show(&mut self, ui: &mut Ui, actions: &mut Actions) {
        self.sources(ui);
        match self.source {
            Source::Palette(index) => {
                let palette = &PALETTES[index];
                ui.weak(english::about(palette.scenes, self.choices.len()));
            }
            Source::File => self.file(ui, actions),
        }
        if let Some(problem) = &self.problem {
            let color = ui.visuals().error_fg_color;
            ui.add(egui::Label::new(RichText::new(problem).color(color)).wrap());
        }
        let found = self.found();
        if !self.choices.is_empty() {
            self.search_line(ui, &found);
        }
        self.lines(ui, &found);
        let count = self.ticked().count();
        let verb = english::add_ticked(count);
        confirm(ui, &verb, count > 0, false, actions, || {
            Action::AddClasses(self.ticked().cloned().collect())
        });
    }

    fn sources(&mut self, ui: &mut Ui) {
        ui.horizontal_wrapped(|ui| {
            for (index, palette) in PALETTES.iter().enumerate() {
                let chosen = self.source == Source::Palette(index);
                if ui.selectable_label(chosen, palette.name).clicked() {
                    self.choose(Source::Palette(index));
                }
            }
            if ui
                .selectable_label(self.source == Source::File, english::FROM_FILE)
                .clicked()
            {
                self.choose(Source::File);
            }
        });
    }

    fn file(&mut self, ui: &mut Ui, actions: &mut Actions) {
        ui.add(egui::Label::new(RichText::new(english::FILE_HOLDS).weak()).wrap());
        let entered = path_field(ui, &mut self.path, english::FILE);
        ui.horizontal(|ui| {
            let path = self.path.trim();
            let read = ui.add_enabled(!path.is_empty(), egui::Button::new(english::READ));
            if read.clicked() || entered && !path.is_empty() {
                actions.push(Action::ReadClasses(PathBuf::from(path)));
            }
            if ui.button(words::BROWSE).clicked() {
                actions.push(Action::Browse(Purpose::Classes));
            }
        });
    }

    fn search_line(&mut self, ui: &mut Ui, found: &[usize]) {
        ui.horizontal(|ui| {
            ui.with_layout(egui::Layout::right_to_left(egui::Align::Center), |ui| {
                for (text, tick) in [(english::TICK_NONE, false), (english::TICK_ALL, true)] {
                    if ui.button(text).clicked() {
                        for &index in found {
                            self.choices[index].ticked = tick;
                        }
                    }
                }
                text_field(
                    ui,
                    &mut self.search,
                    english::SEARCH_SOURCE,
                    english::SEARCH_SOURCE,
                );
            });
        });
    }

    fn lines(&mut self, ui: &mut Ui, found: &[usize]) {
        // As high with few lines as with many, so that the buttons below stay where they are.
        let room = ui.ctx().content_rect().height() - 380.0;
        let height = room.clamp(4.0 * LINE, 12.0 * LINE);
        ui.allocate_ui(vec2(ui.available_width(), height), |ui| {
            ui.set_min_height(height);
            if found.is_empty() && !self.choices.is_empty() {
                ui.weak(english::NOT_FOUND);
            }
            ui.spacing_mut().item_spacing.y = 0.0;
            ScrollArea::vertical()
                .auto_shrink([false, false])
                .max_height(height)
                .show_rows(ui, LINE, found.len(), |ui, range| {
                    for &index in &found[range] {
                        self.line(ui, index);
                    }
                });
        });
    }

    fn line(&mut self, ui: &mut Ui, index: usize) {
        let Choice { class, ticked, there } = &mut self.choices[index];
        let there = *there;
        let (rect, response) = ui.allocate_exact_size(vec2(ui.available_width(), LINE), egui::Sense::hover());
        let mut line = ui.new_child(
            egui::UiBuilder::new()
                .max_rect(rect)
                .id_salt(class.id)
                .layout(egui::Layout::left_to_right(egui::Align::Center)),
        );
        let mut shown = *ticked && !there;
        let check = line
            .add_enabled(!there, egui::Checkbox::without_text(&mut shown))
            .accessible_name(&class.name);
        // The whole line is a target, not the little box alone.
        let row = line.interact(response.rect, line.scope_id().with("line"), egui::Sense::CLICK);
        if !there && (check.changed() || row.clicked()) {
            *ticked = !*ticked;
        }
        let mut left = check.rect.right() + 8.0;
        swatch(
            line.painter(),
            egui::pos2(left + 8.0, rect.center().y),
            class.color,
            16.0,
        );
        left += 26.0;
        let weak = ui.visuals().weak_text_color();
        let number = egui::Rect::from_min_max(
            egui::pos2(left, rect.top()),
            egui::pos2(left + 44.0, rect.bottom()),
        );
        line_of_text(ui, number, &class.id.to_string(), 13.0, weak);
        let end = if there {
            rect.right() - 100.0
        } else {
            rect.right() - 8.0
        };
        let name = egui::Rect::from_min_max(number.right_top(), egui::pos2(end, rect.bottom()));
        let color = if there { weak } else { ui.visuals().text_color() };
        line_of_text(ui, name, &class.name, 14.0, color);
        if there {
            let note = egui::Rect::from_min_max(egui::pos2(end + 4.0, rect.top()), rect.max);
            line_of_text(ui, note, english::THERE, 13.0, weak);
        }
    }
}

/// Asks for a file to write the classes to.
pub(super) fn save_classes(ui: &mut Ui, path: &mut String, actions: &mut Actions) {
    ui.label(english::SAVE_EXPLAINED);
    let entered = path_field(ui, path, english::FILE);
    if ui.button(words::BROWSE).clicked() {
        actions.push(Action::Browse(Purpose::SaveClasses));
    }
    let path = path.trim();
    confirm(ui, words::SAVE, !path.is_empty(), entered, actions, || {
        let mut file = PathBuf::from(path);
        if file.extension().is_none() {
            file.set_extension("json");
        }
        Action::SaveClassesTo(file)
    });
}
