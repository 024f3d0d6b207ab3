//! What panels are made of.

use egui::{Align, Button, Layout, ScrollArea, Ui};
use inplace_core::guide::Likely;
use inplace_core::labels::{ClassId, Label, Object, VOID};
use inplace_model::preferences::{Pane, PreferenceChange};
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use crate::keys::table::UiCommand;
use crate::theme;
use crate::widgets::{Icon, icon_button};

/// What the uncertainty of a scene is.
pub const UNCERTAINTY_MEANS: &str =
    "Mean over all pixels of all frames: 0% is sure, 100% is a guess among all classes";

/// The frame of a panel with these margins.
pub fn panel_frame(horizontal: i8, vertical: i8) -> egui::Frame {
    egui::Frame::new().inner_margin(egui::Margin::symmetric(horizontal, vertical))
}

/// Folds a panel that is shown in full to its first line, or unfolds it; `name` says which.
pub fn fold_button(ui: &mut Ui, pane: Pane, full: bool, name: &str, commands: &mut Commands) {
    let icon = if full { Icon::Down } else { Icon::Up };
    if icon_button(ui, icon, name).clicked() {
        commands.push(shown(ui, pane, !full));
    }
}

/// Shows or hides a panel; what is usual in a window of this size is left to its size.
pub fn shown(ui: &Ui, pane: Pane, shown: bool) -> Command {
    let usual = pane.fits(ui.ctx().content_rect().size()) == shown;
    Command::Prefer(PreferenceChange::Pane(pane, (!usual).then_some(shown)))
}

/// A card on a panel.
pub fn card(ui: &Ui) -> egui::Frame {
    egui::Frame::new()
        .fill(theme::of(ui.visuals()).raised)
        .stroke(egui::Stroke::new(1.0, theme::of(ui.visuals()).line))
        .corner_radius(6)
        .inner_margin(8)
}

/// The digit that chooses a class, where it has one.
fn digit_of(workspace: &Workspace, id: ClassId) -> Option<String> {
    if id == VOID {
        return Some("0".to_owned());
    }
    let mut classes = workspace.document.classes().iter().take(9);
    let index = classes.position(|class| class.id == id)?;
    Some((index + 1).to_string())
}

/// The key that answers a suggestion with what is most likely there (rank 0), or second. A digit says only the class.
pub fn answer_key(workspace: &Workspace, rank: usize, label: Label) -> String {
    let digit = || digit_of(workspace, label.class).filter(|_| label.object.is_none());
    match rank {
        0 => "Enter".to_owned(),
        _ => digit().unwrap_or_else(|| "Shift+Enter".to_owned()),
    }
}

/// The object that a likely class of a suggestion says.
pub fn object_near<'a>(workspace: &'a Workspace, likely: &Likely) -> Option<&'a Object> {
    workspace
        .document
        .labels()
        .object(workspace.likely_label(likely).object?)
}

/// How many frames are done.
pub fn frames_done(done: usize, total: usize) -> String {
    format!("{done} of {total} frames")
}

/// Something opened lately that is not where it was.
pub fn not_found(name: &str) -> String {
    format!("{name} (not found)")
}

/// A menu with the commands that its entries push; each closes it.
pub struct Menu<'a> {
    pub ui: &'a mut Ui,
    pub commands: &'a mut Commands,
}

impl Menu<'_> {
    /// An entry without a key.
    pub fn entry(&mut self, enabled: bool, text: &str, command: Command) {
        self.button(enabled, Button::new(text), command);
    }

    /// An entry with a key.
    pub fn keyed(&mut self, enabled: bool, command: &UiCommand) {
        self.keyed_as(enabled, command, command.name);
    }

    /// An entry with a key and another name.
    pub fn keyed_as(&mut self, enabled: bool, command: &UiCommand, name: &str) {
        let button = Button::new(name).shortcut_text(command.key(self.ui.ctx()));
        self.button(enabled, button, command.command.clone());
    }

    fn button(&mut self, enabled: bool, button: Button<'_>, command: Command) {
        if self.ui.add_enabled(enabled, button).clicked() {
            self.commands.push(command);
            self.ui.close();
        }
    }
}

/// Height of a list of texts to press, at most.
const LIST: f32 = 132.0;

/// A list of texts to press, each as wide as the list, with all of it and this hint as its tooltip; `text` gives that of a
/// place, where it has one. Returns the place that was pressed.
pub fn pressed_in_list(
    ui: &mut Ui,
    id: &str,
    count: usize,
    hint: &str,
    text: impl Fn(usize) -> Option<String>,
) -> Option<usize> {
    let height = ui.spacing().interact_size.y;
    let mut pressed = None;
    ScrollArea::vertical()
        .id_salt(id)
        .max_height(LIST)
        .auto_shrink([false, true])
        .show_rows(ui, height, count, |ui, shown| {
            for (place, text) in shown.filter_map(|place| Some((place, text(place)?))) {
                let size = egui::vec2(ui.available_width(), height);
                let layout = Layout::top_down_justified(Align::LEFT);
                ui.allocate_ui_with_layout(size, layout, |ui| {
                    let whole = format!("{text}. {hint}");
                    let button = ui.add(Button::new(text).truncate());
                    if button.gained_focus() {
                        button.scroll_to_me(None);
                    }
                    if button.on_hover_text(whole).clicked() {
                        pressed = Some(place);
                    }
                });
            }
        });
    pressed
}

/// Facts with what each means, its name at least this wide.
pub fn facts(ui: &mut Ui, id: &str, width: f32, facts: impl IntoIterator<Item = Fact>) {
    egui::Grid::new(id)
        .num_columns(2)
        .spacing([16.0, 4.0])
        .min_col_width(width)
        .min_row_height(20.0)
        .show(ui, |ui| {
            for (name, value, meaning) in facts {
                let name = ui.weak(name);
                if !meaning.is_empty() {
                    name.on_hover_text(meaning);
                }
                let value = value.unwrap_or_else(|| "not known yet".to_owned());
                ui.add(egui::Label::new(value).truncate());
                ui.end_row();
            }
        });
}

/// A name, a value where it is known, and what it means.
pub type Fact = (&'static str, Option<String>, &'static str);
