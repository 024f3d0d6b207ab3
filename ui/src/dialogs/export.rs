//! Asking what is exported, and where to.

use std::path::PathBuf;

use egui::{ComboBox, Label, RichText, Slider, Ui};
use inplace_core::export::{Format, IdMap, Options};
use inplace_core::labels::{ClassPalette, PALETTES};

use super::{Purpose, confirm, path_field};
use crate::action::{Action, Actions};
use crate::english::{dialogs, export as words};

/// Per cent below which a class is left away where that is asked for first: it is no better than a guess.
const FIRST_THRESHOLD: u8 = 50;

/// What is exported, and where to, as chosen so far.
#[derive(Clone, Debug, PartialEq)]
pub struct ExportChoice {
    /// The folder typed so far.
    pub path: String,
    /// The kind of data set.
    pub format: Format,
    /// The data set whose class numbers are taken, by name.
    pub ids: Option<&'static ClassPalette>,
    /// Pixels whose class is less probable become void, per cent.
    pub least_percent: Option<u8>,
}

impl Default for ExportChoice {
    fn default() -> Self {
        Self::new()
    }
}

impl ExportChoice {
    /// Everything as in the project; the path is filled in when it is shown.
    pub const fn new() -> Self {
        Self {
            path: String::new(),
            format: Format::Png,
            ids: None,
            least_percent: None,
        }
    }

    /// The folder.
    pub fn folder(&self) -> PathBuf {
        PathBuf::from(self.path.trim())
    }

    /// What is exported of each map.
    pub fn options(&self) -> Options {
        Options {
            least_probability: self.least_percent.map(|percent| f32::from(percent) / 100.0),
            ids: self.ids.map(IdMap::of),
        }
    }

    /// Draws the question.
    pub(super) fn show(&mut self, ui: &mut Ui, actions: &mut Actions) {
        let entered = path_field(ui, &mut self.path, dialogs::EXPORT_FOLDER);
        if ui.button(dialogs::BROWSE).clicked() {
            actions.push(Action::Browse(Purpose::Export));
        }
        ui.add_space(4.0);
        egui::Grid::new("export")
            .num_columns(2)
            .spacing([16.0, 8.0])
            .show(ui, |ui| {
                ui.label(words::FORMAT);
                self.format(ui);
                ui.end_row();
                ui.label(words::NUMBERS);
                self.numbers(ui);
                ui.end_row();
                ui.label(words::UNCERTAIN);
                self.threshold(ui);
                ui.end_row();
            });
        ui.add(Label::new(RichText::new(words::description(self.format)).weak()).wrap());
        if self.ids.is_some() {
            ui.add(Label::new(RichText::new(words::NUMBERS_EXPLAINED).weak()).wrap());
        }
        let possible = !self.path.trim().is_empty();
        confirm(ui, dialogs::EXPORT, possible, entered, actions, || {
            Action::Export(self.clone())
        });
    }

    fn format(&mut self, ui: &mut Ui) {
        // High enough for all of them at once.
        let shown = ComboBox::from_id_salt("format")
            .width(220.0)
            .height(400.0)
            .selected_text(words::title(self.format))
            .show_ui(ui, |ui| {
                for format in Format::ALL {
                    ui.selectable_value(&mut self.format, format, words::title(format));
                }
            });
        shown.response.accessible_name(words::FORMAT);
    }

    fn numbers(&mut self, ui: &mut Ui) {
        let shown = ComboBox::from_id_salt("numbers")
            .width(220.0)
            .selected_text(self.ids.map_or(words::OWN_NUMBERS, |palette| palette.name))
            .show_ui(ui, |ui| {
                ui.selectable_value(&mut self.ids, None, words::OWN_NUMBERS);
                for palette in &PALETTES {
                    ui.selectable_value(&mut self.ids, Some(palette), palette.name);
                }
            });
        shown.response.accessible_name(words::NUMBERS);
    }

    fn threshold(&mut self, ui: &mut Ui) {
        ui.horizontal(|ui| {
            let mut is_set = self.least_percent.is_some();
            if ui.checkbox(&mut is_set, words::LEAVE_VOID).changed() {
                self.least_percent = is_set.then_some(FIRST_THRESHOLD);
            }
            if let Some(percent) = &mut self.least_percent {
                let slider = Slider::new(percent, 1..=99).suffix(" %");
                ui.add(slider).accessible_name(words::LEAST_PROBABILITY);
            }
        });
    }
}
