//! The bar over the canvas while keys answer suggestions or judge places of an audit: which one is at hand, and what the
//! keys do.

use std::sync::Arc;

use egui::{
    Align2, Area, Color32, Galley, Id, Order, Painter, Pos2, Rect, Role, Sense, Ui, Vec2, WidgetInfo, vec2,
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
/// Room inside the bar.
const MARGIN: Vec2 = vec2(14.0, 6.0);
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
            let laid = Laid::new(ui, &first, &items, canvas.width() - 32.0);
            let (rect, response) = ui.allocate_exact_size(laid.size, Sense::click());
            response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &sentence));
            ui.ctx().accesskit_node_builder(response.id, |node| {
                node.set_live(egui::accesskit::Live::Polite);
            });
            laid.paint(ui, rect);
        });
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

/// An item with its texts laid out.
struct Piece {
    key: Option<Arc<Galley>>,
    color: Option<[u8; 3]>,
    words: Arc<Galley>,
}

impl Piece {
    fn key_width(&self) -> f32 {
        self.key
            .as_ref()
            .map_or(0.0, |key| (key.size().x + 10.0).max(20.0) + 6.0)
    }

    fn width(&self) -> f32 {
        self.key_width() + self.color.map_or(0.0, |_| 16.0) + self.words.size().x
    }

    fn paint(&self, painter: &Painter, mut left: Pos2, colors: [Color32; 2]) {
        let [line, text] = colors;
        if let Some(key) = &self.key {
            let cap = Rect::from_min_size(left - vec2(0.0, 9.0), vec2(self.key_width() - 6.0, 18.0));
            let stroke = egui::Stroke::new(1.0, line);
            painter.rect_stroke(cap, 4, stroke, egui::StrokeKind::Inside);
            painter.galley(cap.center() - 0.5 * key.size(), Arc::clone(key), text);
            left.x += self.key_width();
        }
        if let Some(color) = self.color {
            swatch(painter, left + vec2(6.0, 0.0), color, 12.0);
            left.x += 16.0;
        }
        let top = left - vec2(0.0, 0.5 * self.words.size().y);
        painter.galley(top, Arc::clone(&self.words), text);
    }
}

/// The bar's pieces with where each lies, from the bar's top left corner to the middle of its left side.
struct Laid {
    pieces: Vec<(Vec2, Piece)>,
    size: Vec2,
}

impl Laid {
    fn new(ui: &Ui, first: &str, items: &[Item], room: f32) -> Self {
        let visuals = ui.visuals();
        let (strong, text) = (visuals.strong_text_color(), visuals.text_color());
        let layout = |text: &str, size: f32, color| {
            let font = egui::FontId::proportional(size);
            ui.painter().layout_no_wrap(text.to_owned(), font, color)
        };
        let heading = Piece {
            key: None,
            color: None,
            words: layout(first, 14.0, strong),
        };
        let of_item = |item: &Item| Piece {
            key: Some(layout(&item.key, 12.0, text)),
            color: item.color,
            words: layout(&item.words, 13.0, text),
        };
        let mut pieces = Vec::new();
        let (mut at, mut widest) = (MARGIN + vec2(0.0, 0.5 * LINE), 0.0_f32);
        for piece in std::iter::once(heading).chain(items.iter().map(of_item)) {
            let width = piece.width();
            if at.x > MARGIN.x && at.x + width + MARGIN.x > room {
                at = vec2(MARGIN.x, at.y + LINE);
            }
            pieces.push((at, piece));
            widest = widest.max(at.x + width);
            at.x += width + GAP;
        }
        let size = vec2(widest + MARGIN.x, at.y + 0.5 * LINE + MARGIN.y);
        Self { pieces, size }
    }

    fn paint(&self, ui: &Ui, rect: Rect) {
        let visuals = ui.visuals();
        let line = egui::Stroke::new(1.0, theme::of(visuals).accent);
        let painter = ui.painter();
        painter.rect(rect, 8, visuals.window_fill, line, egui::StrokeKind::Inside);
        let colors = [visuals.widgets.hovered.bg_fill, visuals.text_color()];
        for (offset, piece) in &self.pieces {
            piece.paint(painter, rect.min + *offset, colors);
        }
    }
}
