//! The bar over the canvas while keys answer suggestions or judge places of an audit: which one is at hand, and what the
//! keys do.

use egui::{
    Align2, Area, FontId, Frame, Id, Margin, Order, Rect, Role, Sense, Stroke, StrokeKind, Ui, WidgetInfo,
    vec2,
};
use inplace_core::guide::Likely;
use inplace_model::suggestions::{A_MOMENT, Mode};
use inplace_model::workspace::Workspace;

use super::parts::{answer_key, object_near};
use crate::keys::table::{ANSWER_NEW, NEXT_SUGGESTION};
use crate::theme;
use crate::widgets::swatch;

/// Height of a line of the bar.
const LINE: f32 = 24.0;
/// Room between one key's words and the next key.
const GAP: f32 = 14.0;
/// Longest name in the bar, in letters.
const LONGEST: usize = 24;

/// A key with what it does.
struct Item {
    key: String,
    color: Option<[u8; 3]>,
    words: String,
}

impl Item {
    fn new(key: &str, words: &str) -> Self {
        Self {
            key: key.to_owned(),
            color: None,
            words: words.to_owned(),
        }
    }

    /// Draws it in the line, or in the next one where it finds no room.
    fn show(&self, ui: &mut Ui) {
        let (text, line) = (ui.visuals().text_color(), ui.visuals().widgets.hovered.bg_fill);
        let [key, words] = [(&self.key, 12.0), (&self.words, 13.0)].map(|(words, size)| {
            ui.painter()
                .layout_no_wrap(words.clone(), FontId::proportional(size), text)
        });
        let cap = vec2((key.size().x + 10.0).max(20.0), 18.0);
        let before = cap.x + 6.0 + self.color.map_or(0.0, |_| 16.0);
        let size = vec2(before + words.size().x, LINE);
        let (rect, _) = ui.allocate_exact_size(size, Sense::hover());
        let painter = ui.painter();
        let left = rect.left_center();
        let cap = Rect::from_min_size(left - vec2(0.0, 0.5 * cap.y), cap);
        painter.rect_stroke(cap, 4, Stroke::new(1.0, line), StrokeKind::Inside);
        painter.galley(cap.center() - 0.5 * key.size(), key, text);
        if let Some(color) = self.color {
            swatch(painter, left + vec2(before - 10.0, 0.0), color, 12.0);
        }
        let top = left + vec2(before, -0.5 * words.size().y);
        painter.galley(top, words, text);
    }
}

/// Draws the bar over the upper edge of the canvas while suggestions are answered or places judged; asks for another frame
/// where what it says changes with time.
pub fn show(ui: &Ui, workspace: &Workspace, canvas: Rect) {
    let next = NEXT_SUGGESTION.key(ui.ctx());
    let (first, items) = match workspace.suggestions().mode {
        Mode::Away => match workspace.auditing.at.and_then(|at| place(workspace, at)) {
            Some(said) => said,
            None => return,
        },
        Mode::At(index) => {
            let place = workspace.suggestions().listed.get(index);
            let classes = place.map(|place| place.classes.as_slice()).unwrap_or_default();
            (at(workspace, index, classes), keys(workspace, classes, &next))
        }
        Mode::Looking(since) => {
            let patience = A_MOMENT.saturating_sub(since.elapsed());
            if patience.is_zero() {
                let items = vec![
                    Item::new(&next, "next of this list"),
                    Item::new("Escape", "leave"),
                ];
                ("Still looking for the next place".to_owned(), items)
            } else {
                ui.ctx().request_repaint_after(patience);
                (
                    "Looking for the next place".to_owned(),
                    vec![Item::new("Escape", "leave")],
                )
            }
        }
    };
    // A key may have been taken away from what it did.
    let items: Vec<Item> = items.into_iter().filter(|item| !item.key.is_empty()).collect();
    let said: Vec<String> = items
        .iter()
        .map(|item| format!("{}: {}", item.key, item.words))
        .collect();
    let sentence = format!("{first}. {}", said.join(", "));
    Area::new(Id::unique("suggestion bar"))
        .order(Order::Middle)
        .pivot(Align2::CENTER_TOP)
        .fixed_pos(canvas.center_top() + vec2(0.0, 8.0))
        .show(ui.ctx(), |ui| {
            ui.set_max_width((canvas.width() - 32.0).max(0.0));
            let line = Stroke::new(1.0, theme::of(ui.visuals()).accent);
            let frame = Frame::new().fill(ui.visuals().window_fill).stroke(line);
            let frame = frame.corner_radius(8).inner_margin(Margin::symmetric(13, 5));
            let bar = frame.show(ui, |ui| {
                ui.spacing_mut().item_spacing = vec2(GAP, 0.0);
                ui.spacing_mut().interact_size.y = LINE;
                ui.horizontal_wrapped(|ui| {
                    heading(ui, &first);
                    items.iter().for_each(|item| item.show(ui));
                });
            });
            let response = ui.interact(bar.response.rect, ui.scope_id().with("words"), Sense::click());
            response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &sentence));
            ui.ctx().accesskit_node_builder(response.id, |node| {
                node.set_live(egui::accesskit::Live::Polite);
            });
        });
}

fn heading(ui: &mut Ui, text: &str) {
    let color = ui.visuals().strong_text_color();
    let words = ui
        .painter()
        .layout_no_wrap(text.to_owned(), FontId::proportional(14.0), color);
    let (rect, _) = ui.allocate_exact_size(vec2(words.size().x, LINE), Sense::hover());
    let top = rect.left_center() - vec2(0.0, 0.5 * words.size().y);
    ui.painter().galley(top, words, color);
}

/// A place of an audit: what the map said there, and the keys that judge it.
fn place(workspace: &Workspace, index: usize) -> Option<(String, Vec<Item>)> {
    let places = &workspace.auditing.audit.as_ref()?.places;
    let (name, _) = workspace.document.name_and_color(places.get(index)?.class);
    let first = format!("Place {} of {}: is this {name}?", index + 1, places.len());
    let keys = [
        ("Y", "right"),
        ("N", "wrong"),
        ("X", "cannot tell"),
        ("Escape", "leave"),
    ];
    Some((first, keys.map(|(key, does)| Item::new(key, does)).into()))
}

fn at(workspace: &Workspace, index: usize, classes: &[Likely]) -> String {
    let count = workspace.suggestions().listed.len();
    let number = format!("Suggestion {} of {count}", index + 1);
    if workspace.suggestions().settled {
        return format!("{number}, settled meanwhile");
    }
    match classes.first().and_then(|likely| object_near(workspace, likely)) {
        Some(object) => format!("{number}: {}, or a new one?", cut(&object.name)),
        None => number,
    }
}

fn keys(workspace: &Workspace, classes: &[Likely], next: &str) -> Vec<Item> {
    let mut items = Vec::new();
    for (rank, likely) in classes.iter().take(2).enumerate() {
        let Some(class) = workspace.document.labels().class(likely.class) else {
            continue;
        };
        let object = object_near(workspace, likely);
        items.push(Item {
            key: answer_key(workspace, rank, workspace.likely_label(likely)),
            color: Some(class.color),
            words: cut(object.map_or(&class.name, |object| &object.name)),
        });
        if rank == 0 && class.thing {
            // Nobody can move this key.
            items.push(Item::new(
                &ANSWER_NEW.keys[0].to_string(),
                &format!("new {}", cut(&class.name)),
            ));
        }
    }
    if !workspace.document.classes().is_empty() {
        items.push(Item::new("0-9", "class"));
    }
    for (key, does) in [("C", "name"), ("X", "skip"), (next, "next"), ("Escape", "leave")] {
        items.push(Item::new(key, does));
    }
    items
}

/// A name that is not too long for the bar.
fn cut(name: &str) -> String {
    let mut short: String = name.chars().take(LONGEST).collect();
    if short.len() < name.len() {
        short.push('…');
    }
    short
}
