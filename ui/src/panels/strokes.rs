//! The strokes as a list: found, gone to, given another class, deleted.

use std::collections::BTreeMap;
use std::sync::Arc;

use egui::{EventFilter, Id, Key, Modifiers, Rect, Role, ScrollArea, Sense, Ui, WidgetInfo, pos2, vec2};
use inplace_core::labels::{ClassId, Stroke, StrokeId, StrokeKind, VOID};
use inplace_model::palette::VOID_NAME;
use inplace_model::preferences::Pane;
use inplace_model::text::counted;
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use super::parts::{fold_button, panel_frame};
use crate::keys::table::DELETE;
use crate::theme;
use crate::widgets::{
    Icon, choice_box, focus_ring, heading, icon_button, line_of_text, swatch, text_line, weak_text,
};

const ROW: f32 = 42.0;
/// Height of the heading alone.
const FOLDED: f32 = 44.0;
/// Rows that a page key moves over.
const PAGE: usize = 8;

/// The list with its filters.
#[derive(Debug, Default)]
pub struct StrokePanel {
    filter: Filter,
    rows: Rows,
    /// Pixels of the strokes that were in view, with the strokes that they were counted of.
    pixels: BTreeMap<StrokeId, (Arc<Stroke>, u64)>,
    /// The selected stroke that was scrolled to last, and its row.
    followed: Option<(StrokeId, usize)>,
}

/// Which strokes are listed.
#[derive(Clone, Debug, Default, PartialEq)]
struct Filter {
    text: String,
    class: Option<ClassId>,
    this_frame: bool,
}

/// The strokes that a filter leaves, newest first, until something of it changes.
#[derive(Debug, Default)]
struct Rows {
    ids: Vec<StrokeId>,
    /// Generation, and frame if that matters.
    made_of: Option<(u64, Option<usize>, Filter)>,
}

impl Rows {
    fn update(&mut self, workspace: &Workspace, filter: &Filter) {
        let frame = filter.this_frame.then_some(workspace.frame_index);
        let generation = workspace.document.generation();
        let made_of = Some((generation, frame, filter.clone()));
        if self.made_of != made_of {
            self.ids = found(workspace, filter, frame);
            self.made_of = made_of;
        }
    }

    /// The row of a stroke.
    fn place(&self, stroke: StrokeId) -> Option<usize> {
        self.ids.binary_search_by(|id| stroke.cmp(id)).ok()
    }
}

fn found(workspace: &Workspace, filter: &Filter, frame: Option<usize>) -> Vec<StrokeId> {
    let document = &workspace.document;
    let text = filter.text.to_lowercase();
    let words: Vec<&str> = text.split_whitespace().collect();
    let frames = &workspace.scene.frames;
    let named = |stroke: &Stroke| {
        let class = workspace.document.name_and_color(stroke.class).0.to_lowercase();
        let said = workspace.document.name_said(stroke).to_lowercase();
        let frame = frames.get(stroke.frame).map(|frame| frame.stem.to_lowercase());
        let kind = stroke.kind().name();
        words.iter().all(|word| {
            class.contains(word)
                || said.contains(word)
                || frame.as_ref().is_some_and(|frame| frame.contains(word))
                || kind.starts_with(word)
        })
    };
    let wanted = |(id, stroke): (StrokeId, &Arc<Stroke>)| {
        let of_class = filter.class.is_none_or(|class| class == stroke.class);
        (of_class && (words.is_empty() || named(stroke))).then_some(id)
    };
    match frame {
        Some(frame) => document.strokes_on(frame).rev().filter_map(wanted).collect(),
        None => {
            let newest_first = document.labels().strokes.iter().rev();
            newest_first
                .map(|(&id, stroke)| (id, stroke))
                .filter_map(wanted)
                .collect()
        }
    }
}

impl StrokePanel {
    /// Draws the list at the lower end of a panel, as high as it was dragged, or folded to its heading.
    pub fn show_below(&mut self, ui: &mut Ui, workspace: &Workspace, full: bool, commands: &mut Commands) {
        let room = ui.available_height();
        let panel = if !full {
            egui::Panel::bottom("strokes folded")
                .resizable(false)
                .exact_size(FOLDED.min(room))
        } else {
            egui::Panel::bottom("strokes")
                .resizable(true)
                .default_size((0.45 * room).min(320.0))
                .size_range((0.25 * room).min(200.0)..=0.75 * room)
        };
        let frame = panel_frame(12, 8);
        panel
            .frame(frame)
            .show(ui, |ui| self.show(ui, workspace, full, commands));
    }

    fn show(&mut self, ui: &mut Ui, workspace: &Workspace, full: bool, commands: &mut Commands) {
        // As high as it was dragged, also while there is little to show.
        ui.take_available_height();
        let document = &workspace.document;
        let strokes = document.labels().strokes.len();
        heading(ui, &format!("Strokes ({strokes})"), |ui| {
            let name = if full {
                "Hide the list of strokes"
            } else {
                "Show the list of strokes"
            };
            fold_button(ui, Pane::Strokes, full, name, commands);
        });
        if !full {
            return;
        }
        if strokes == 0 {
            weak_text(
                ui,
                "No strokes yet. What you draw on the frames is listed here, to be found and changed.",
            );
            return;
        }
        // A class that is gone has no strokes to look for.
        let gone = |class: &ClassId| *class != VOID && document.labels().class(*class).is_none();
        if self.filter.class.as_ref().is_some_and(gone) {
            self.filter.class = None;
        }
        self.show_filter(ui, workspace);
        self.rows.update(workspace, &self.filter);
        if self.rows.ids.is_empty() {
            weak_text(ui, "No stroke is like that.");
            if ui.button("Show all strokes").clicked() {
                self.filter = Filter::default();
            }
            return;
        }
        let below = ui.spacing().interact_size.y + theme::GAP;
        let height = (ui.available_height() - below).max(ROW);
        self.list(ui, workspace, height, commands);
        selected_line(ui, workspace, commands);
    }

    fn show_filter(&mut self, ui: &mut Ui, workspace: &Workspace) {
        let field = text_line(&mut self.filter.text, "Find strokes", f32::INFINITY);
        ui.add(field)
            .accessible_name("Find strokes")
            .on_hover_text("Part of the name of a class, an object or a frame, or click, scribble, polygon");
        ui.horizontal(|ui| {
            let name = |class| workspace.document.name_and_color(class).0;
            let check = 96.0;
            let chosen = self.filter.class.map_or("All classes", name);
            let width = (ui.available_width() - check - theme::GAP).max(56.0);
            choice_box(ui, "Strokes of class", width, chosen, |ui| {
                ui.selectable_value(&mut self.filter.class, None, "All classes");
                class_choices(ui, workspace, |ui, class, name| {
                    ui.selectable_value(&mut self.filter.class, Some(class), name);
                });
            });
            ui.checkbox(&mut self.filter.this_frame, "This frame");
        });
    }

    fn list(&mut self, ui: &mut Ui, workspace: &Workspace, height: f32, commands: &mut Commands) {
        let id = ui.scope_id().with("list");
        let count = self.rows.ids.len();
        let selected = workspace.selected;
        let place = selected.and_then(|stroke| self.rows.place(stroke));
        self.take_keys(ui, workspace, id, place, commands);
        let moved = self.followed.map(|(stroke, _)| stroke) != selected;
        let mut clicked = false;
        let area = ScrollArea::vertical()
            .auto_shrink([false, false])
            .max_height(height);
        let area = area.show_viewport(ui, |ui, viewport| {
            let size = vec2(ui.available_width(), count as f32 * ROW);
            let (whole, _) = ui.allocate_exact_size(size, Sense::hover());
            let row = |index: usize| {
                let corner = whole.min + vec2(0.0, index as f32 * ROW);
                Rect::from_min_size(corner, vec2(whole.width(), ROW))
            };
            if let Some(place) = place.filter(|_| moved) {
                ui.scroll_to_rect(row(place), None);
            }
            let first = (viewport.top() / ROW).floor().max(0.0) as usize;
            let last = ((viewport.bottom() / ROW).ceil().max(0.0) as usize).min(count);
            for index in first..last {
                clicked |= self.row(ui, workspace, self.rows.ids[index], row(index), commands);
            }
            // Only what is in view is kept.
            if self.pixels.len() > 64 + 4 * last.saturating_sub(first) {
                self.pixels.clear();
            }
        });
        self.followed = selected
            .zip(place)
            .or(self.followed.filter(|_| selected.is_none()));
        let list = ui.interact(area.inner_rect, id, Sense::focusable_noninteractive());
        list.widget_info(|| WidgetInfo::labeled(Role::ListBox, true, "List of strokes"));
        // Only now: to the list, the click was one elsewhere.
        if clicked {
            list.request_focus();
        }
        if list.has_focus() {
            focus_ring(ui, area.inner_rect);
        }
    }

    /// With the keyboard in the list, arrows move the selection, and what takes the place of a deleted stroke is next.
    fn take_keys(
        &self,
        ui: &Ui,
        workspace: &Workspace,
        list: Id,
        place: Option<usize>,
        commands: &mut Commands,
    ) {
        if !ui.memory(|memory| memory.has_focus(list)) {
            return;
        }
        let filter = EventFilter {
            vertical_arrows: true,
            ..EventFilter::default()
        };
        ui.memory_mut(|memory| memory.set_focus_lock_filter(list, filter));
        let last = self.rows.ids.len() - 1;
        let mut wanted = None;
        for (key, step) in [
            (Key::ArrowDown, 1),
            (Key::ArrowUp, -1),
            (Key::PageDown, PAGE as isize),
            (Key::PageUp, -(PAGE as isize)),
            (Key::Home, isize::MIN),
            (Key::End, isize::MAX),
        ] {
            if ui.input_mut(|input| input.consume_key(Modifiers::NONE, key)) {
                let from = wanted.or(place);
                wanted = Some(match from {
                    Some(from) => (from as isize).saturating_add(step).clamp(0, last as isize) as usize,
                    None => 0,
                });
            }
        }
        if let Some((stroke, at)) = self.followed
            && workspace.selected.is_none()
            && !workspace.document.labels().strokes.contains_key(&stroke)
        {
            wanted = wanted.or(Some(at.min(last)));
        }
        if let Some(index) = wanted.filter(|index| Some(*index) != place) {
            commands.push(Command::GoToStroke(self.rows.ids[index]));
        }
    }

    /// One stroke; returns whether it was clicked.
    fn row(
        &mut self,
        ui: &Ui,
        workspace: &Workspace,
        id: StrokeId,
        rect: Rect,
        commands: &mut Commands,
    ) -> bool {
        let Some(stroke) = workspace.document.labels().strokes.get(&id) else {
            return false;
        };
        let pixels = self.pixels_of(workspace, id, stroke);
        let (_, color) = workspace.document.name_and_color(stroke.class);
        let said = workspace.document.name_said(stroke);
        let frame = workspace.scene.frames.get(stroke.frame);
        let frame = frame.map_or("", |frame| &frame.stem);
        let words = in_words(said, stroke.kind(), pixels, frame);
        let chosen = workspace.selected == Some(id);
        let response = ui.interact(rect, ui.scope_id().with(("stroke", id)), Sense::CLICK);
        response.widget_info(|| WidgetInfo::selected(Role::ListBoxOption, true, chosen, &words));
        if response.clicked() {
            commands.push(Command::GoToStroke(id));
        }
        let visuals = ui.visuals();
        if chosen || response.hovered() {
            let fill = if chosen {
                visuals.widgets.hovered.bg_fill
            } else {
                theme::of(visuals).raised
            };
            ui.painter().rect_filled(rect.shrink2(vec2(0.0, 1.0)), 4, fill);
        }
        if chosen {
            let bar = Rect::from_min_size(rect.min + vec2(0.0, 4.0), vec2(3.0, rect.height() - 8.0));
            ui.painter().rect_filled(bar, 1, theme::of(visuals).accent);
        }
        let center = pos2(rect.left() + 18.0, rect.center().y);
        swatch(ui.painter(), center, color, 16.0);
        let (left, right) = (rect.left() + 36.0, rect.right() - 8.0);
        let line = |top: f32, bottom: f32| {
            Rect::from_min_max(pos2(left, rect.top() + top), pos2(right, rect.top() + bottom))
        };
        let strong = if chosen {
            visuals.strong_text_color()
        } else {
            visuals.text_color()
        };
        line_of_text(ui, line(4.0, 22.0), said, 14.0, strong);
        let details = format!("{}, {pixels} px, {frame}", stroke.kind().name());
        line_of_text(ui, line(22.0, 38.0), &details, 12.0, visuals.weak_text_color());
        let clicked = response.clicked();
        response.on_hover_text(words);
        clicked
    }

    fn pixels_of(&mut self, workspace: &Workspace, id: StrokeId, stroke: &Arc<Stroke>) -> u64 {
        if let Some((of, pixels)) = self.pixels.get(&id)
            && Arc::ptr_eq(of, stroke)
        {
            return *pixels;
        }
        let frame = workspace.scene.frames.get(stroke.frame);
        let pixels = frame.map_or(0, |frame| {
            stroke.pixel_count(frame.camera.width, frame.camera.height)
        });
        self.pixels.insert(id, (Arc::clone(stroke), pixels));
        pixels
    }
}

/// What can be done with the selected stroke.
fn selected_line(ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
    let selected = workspace.selected;
    let stroke = selected.and_then(|id| Some((id, workspace.document.labels().strokes.get(&id)?)));
    ui.add_enabled_ui(stroke.is_some(), |ui| {
        ui.horizontal(|ui| {
            let side = ui.spacing().interact_size.y;
            let text = stroke.map_or("No stroke selected", |(_, stroke)| {
                workspace.document.name_and_color(stroke.class).0
            });
            let width = (ui.available_width() - side - theme::GAP).max(56.0);
            choice_box(ui, "Class of the stroke", width, text, |ui| {
                let Some((id, stroke)) = stroke else {
                    return;
                };
                class_choices(ui, workspace, |ui, class, name| {
                    if ui.selectable_label(stroke.class == class, name).clicked() {
                        commands.push(Command::ChangeStrokeClass(id, class));
                    }
                });
            });
            let delete = DELETE.named(ui.ctx());
            if icon_button(ui, Icon::Delete, &delete).clicked()
                && let Some((id, _)) = stroke
            {
                commands.push(Command::DeleteStroke(id));
            }
        });
    });
}

fn class_choices(ui: &mut Ui, workspace: &Workspace, mut choice: impl FnMut(&mut Ui, ClassId, &str)) {
    for class in workspace.document.classes() {
        choice(ui, class.id, &class.name);
    }
    choice(ui, VOID, VOID_NAME);
}

/// A stroke in words, for screen readers and tooltips.
fn in_words(class: &str, kind: StrokeKind, pixels: u64, frame: &str) -> String {
    let pixels = counted(pixels as usize, "pixel", "pixels");
    format!("{class}, {}, {pixels}, frame {frame}", kind.name())
}
