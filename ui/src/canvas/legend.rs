//! What the colours of a layer mean, in the lower left corner of its part of the canvas.

use egui::{Color32, FontId, Mesh, Painter, Pos2, Rect, Role, Sense, Shape, Ui, WidgetInfo, pos2, vec2};
use inplace_core::export::Difference;
use inplace_core::scene::Frame;
use inplace_model::comparison::Counts;
use inplace_model::layer::Layer;
use inplace_model::palette::{Agreement, PALETTE_COLUMNS, Table, difference_color};
use inplace_model::workspace::Workspace;

use super::field_view::FieldView;
use super::frame_view::FrameView;
use super::objects::{Entry, ObjectPlane};
use super::split::Part;
use crate::numbers;
use crate::theme;
use crate::widgets::{painted_line, swatch};

/// Most classes listed.
const MOST_CLASSES: usize = 12;
/// Height of a line, and distance of the border.
const LINE: f32 = 18.0;
const PADDING: f32 = 8.0;
const WIDEST: f32 = 288.0;
const SWATCH: f32 = 12.0;
const FONT: f32 = 12.0;
const BAR: egui::Vec2 = vec2(160.0, 10.0);
/// About how far the marker of a place reaches, in points.
const MARKER: f32 = 16.0;
/// Legends lie on images, so they are the same in both themes.
const BACKGROUND: Color32 = Color32::from_rgba_premultiplied(12, 13, 15, 215);
const TEXT: Color32 = Color32::from_rgb(236, 239, 244);
const WEAK: Color32 = Color32::from_rgb(178, 184, 194);

/// A line of a legend.
#[derive(Clone, Debug, PartialEq)]
enum Row {
    /// A colour and what it stands for.
    Swatch([u8; 3], String),
    /// What pixels without a value look like.
    Hatched(String),
    /// A table of colours with the values at its ends.
    Bar(Table, [String; 2]),
    /// Words.
    Title(String),
    /// Words that matter less.
    Note(String),
}

/// Draws the legend of a part of the canvas, where it does not lie over a place on screen that is `asked` about.
pub fn show(ui: &Ui, known: (&Workspace, &FrameView), side: usize, part: Part, asked: &[Pos2]) {
    let room = part.clip.height() - 2.0 * theme::GAP - 2.0 * PADDING;
    let lines = (room / LINE).floor().max(0.0) as usize;
    // On a small canvas the image matters more.
    let rows = rows(known, part.layer, (lines / 2).min(MOST_CLASSES));
    if rows.is_empty() || rows.len() > lines {
        return;
    }
    let painter = ui.painter_at(part.clip);
    let widest = (part.clip.width() - 2.0 * (theme::GAP + PADDING)).min(WIDEST);
    let width = rows.iter().map(|row| row.width(&painter)).fold(0.0, f32::max);
    let width = width.min(widest);
    if width < 2.0 * LINE {
        return;
    }
    let size = vec2(width, rows.len() as f32 * LINE) + egui::Vec2::splat(2.0 * PADDING);
    let corner = part.clip.left_bottom() + vec2(theme::GAP, -theme::GAP - size.y);
    let rect = Rect::from_min_size(corner, size);
    // What is under the legend can be seen by pointing at it, and labelled, as hovering takes no clicks.
    let around = rect.expand(MARKER);
    if !ui.rect_contains_pointer(rect) && !asked.iter().any(|&place| around.contains(place)) {
        painter.rect_filled(rect, 6, BACKGROUND);
        for (index, row) in rows.iter().enumerate() {
            let top = rect.top() + PADDING + index as f32 * LINE;
            let line = Rect::from_min_size(pos2(rect.left() + PADDING, top), vec2(width, LINE));
            row.paint(&painter, line);
        }
    }
    let words = rows.iter().map(Row::words);
    let words: Vec<&str> = words.filter(|words| !words.is_empty()).collect();
    let words = format!("{}: {}", part.layer.name(), words.join(", "));
    let response = ui.interact(rect, ui.scope_id().with(("legend", side)), Sense::hover());
    response.widget_info(|| WidgetInfo::labeled(Role::Label, true, &words));
}

/// The lines of a layer's legend, with at most so many classes.
fn rows((workspace, shown): (&Workspace, &FrameView), layer: Layer, most: usize) -> Vec<Row> {
    let note = |text: &str| vec![Row::Note(text.to_owned())];
    let entropy_bar = || Row::Bar(Table::Entropy, ["sure", "unsure"].map(str::to_owned));
    match layer {
        Layer::Color => Vec::new(),
        Layer::Labels | Layer::Objects | Layer::Entropy | Layer::Disagreement | Layer::Differences
            if shown.map().is_none() =>
        {
            note("No labels to show yet")
        }
        Layer::Labels => class_rows(workspace, shown, most),
        Layer::Objects => shown.objects().map_or_else(
            || note("One moment"),
            |objects| object_rows(workspace, objects, most),
        ),
        Layer::Entropy => vec![Row::Title(layer.name().to_owned()), entropy_bar()],
        Layer::Disagreement => agreement_rows(workspace, shown),
        Layer::Differences => difference_rows(workspace, shown),
        Layer::Depth => depth_rows(shown).unwrap_or_else(|| {
            note(if workspace.frame().is_some_and(|frame| frame.has_depth()) {
                "One moment"
            } else if workspace.ended {
                no_view(workspace)
            } else {
                "No measured depth: it is being rendered"
            })
        }),
        _ => match shown.view().filter(|view| view.shows(layer)) {
            None => note(&field_words(workspace, shown.view(), layer)),
            Some(view) => {
                let mut rows = vec![Row::Title(layer.name().to_owned())];
                match layer {
                    Layer::RenderedLabels => rows.extend(class_rows(workspace, shown, most)),
                    Layer::RenderedEntropy => rows.push(entropy_bar()),
                    Layer::RenderedDepth => rows.extend(view.depth.range.map(depth_bar)),
                    _ => {}
                }
                rows.push(Row::Note(field_words(workspace, Some(view), layer)));
                rows
            }
        },
    }
}

/// Why there is no view of the field.
fn no_view(workspace: &Workspace) -> &str {
    if workspace.ended {
        workspace.phase_in_words()
    } else {
        "The view is being rendered"
    }
}

/// How far a view of the field has come, or what is still missing of this layer.
pub fn field_words(workspace: &Workspace, view: Option<&FieldView>, layer: Layer) -> String {
    match view {
        None => no_view(workspace).to_owned(),
        Some(view) if !view.shows(layer) => "The field is learning the labels".to_owned(),
        Some(view) => format!("after {} training steps", view.rendered.steps),
    }
}

fn depth_bar(range: [f32; 2]) -> Row {
    Row::Bar(Table::Depth, range.map(numbers::metres))
}

/// The classes that are visible, in the order of the class list; where there are more than fit, those with the
/// most pixels.
fn class_rows(workspace: &Workspace, shown: &FrameView, most: usize) -> Vec<Row> {
    let Some(visible) = shown.visible() else {
        return Vec::new();
    };
    let largest = &visible[..visible.len().min(most)];
    let is_listed = |id| largest.iter().any(|&(class, _)| class == id);
    let classes = workspace.document.classes().iter();
    let mut rows: Vec<Row> = classes
        .filter(|class| is_listed(class.id))
        .map(|class| Row::Swatch(class.color, class.name.clone()))
        .collect();
    if visible.len() > largest.len() {
        let more = visible.len() - largest.len();
        rows.push(Row::Note(format!("and {more} more")));
    }
    if rows.is_empty() {
        rows.push(Row::Note("Nothing has a class here yet".to_owned()));
    }
    rows
}

/// The objects that are visible and not hidden, those with the most pixels where there are more than fit.
fn object_rows(workspace: &Workspace, plane: &ObjectPlane, most: usize) -> Vec<Row> {
    let palette = workspace.document.palette();
    let is_shown = |entry: &Entry| entry.object.is_some() && entry.color(palette)[3] > 0;
    let mut objects: Vec<(&Entry, u32)> = plane.seen().filter(|(entry, _)| is_shown(entry)).collect();
    objects.sort_by_key(|&(_, pixels)| std::cmp::Reverse(pixels));
    let more = objects.len().saturating_sub(most);
    objects.truncate(most);
    objects.sort_by_key(|(entry, _)| entry.object.as_ref().map(|object| (object.class, object.id)));
    let row = |(entry, _): (&Entry, u32)| {
        let [r, g, b, _] = entry.color(palette);
        Some(Row::Swatch([r, g, b], entry.object.as_ref()?.name.clone()))
    };
    let mut rows: Vec<Row> = objects.into_iter().filter_map(row).collect();
    if more > 0 {
        rows.push(Row::Note(format!("and {more} more")));
    }
    if rows.is_empty() {
        let hidden = palette.hidden.is_some();
        let note = if hidden {
            "No objects here that are not hidden"
        } else {
            "No objects here"
        };
        rows.push(Row::Note(note.to_owned()));
    }
    rows
}

fn agreement_rows(workspace: &Workspace, shown: &FrameView) -> Vec<Row> {
    let labels = workspace.document.labels();
    let frame = workspace.frame_index;
    let imported = labels.imported.as_deref();
    let is_imported = imported.is_some_and(|images| images.of_frame(frame).is_some());
    let is_drawn_on = workspace.document.strokes_of_frame(frame) > 0;
    if !is_imported && !is_drawn_on {
        return vec![Row::Note(
            "Nothing is labelled in this frame: no strokes, no imported image".to_owned(),
        )];
    }
    if shown.agreement().is_none() {
        return vec![Row::Note("One moment".to_owned())];
    }
    let mark = |agreement: Agreement, words: &str| {
        let [r, g, b, _] = agreement.color();
        Row::Swatch([r, g, b], words.to_owned())
    };
    let mut rows = Vec::new();
    if is_imported {
        rows.push(mark(
            Agreement::ImportContradicted,
            "Imported label, and the map says otherwise",
        ));
    }
    if is_drawn_on {
        rows.push(mark(
            Agreement::StrokeContradicted,
            "Your stroke, and the others say otherwise",
        ));
    }
    rows.push(mark(Agreement::Agreed, "Labelled, and undisputed"));
    rows.push(Row::Swatch([86; 3], "Not labelled by hand or import".to_owned()));
    rows
}

fn difference_rows(workspace: &Workspace, shown: &FrameView) -> Vec<Row> {
    let Some(comparison) = &workspace.comparison else {
        return vec![Row::Note("No project is compared with".to_owned())];
    };
    let mut rows = vec![Row::Title(format!("Compared with {}", comparison.other.name))];
    if shown.differences().is_none() {
        let is_keyframe = workspace.frame().is_some_and(Frame::is_keyframe);
        let words = match is_keyframe {
            true => "One moment",
            false => "Only keyframes are compared",
        };
        rows.push(Row::Note(words.to_owned()));
        return rows;
    }
    for (difference, words) in [
        (Difference::Different, "Another class there"),
        (Difference::Alone, "A class in only one of the two"),
    ] {
        let [r, g, b, _] = difference_color(difference);
        rows.push(Row::Swatch([r, g, b], words.to_owned()));
    }
    let same = |counts: Option<Counts>| counts.and_then(|counts| counts.agreement()).map(numbers::percent);
    if let Some(here) = same(comparison.of_frame(workspace.frame_index)) {
        rows.push(Row::Note(match same(comparison.of_scene()) {
            Some(all) => format!("Same class: {here} here, {all} in the scene"),
            None => format!("Same class: {here} here"),
        }));
    }
    rows
}

fn depth_rows(shown: &FrameView) -> Option<Vec<Row>> {
    let (plane, measured) = shown.depth()?;
    let (title, hole) = if measured {
        ("Measured depth", "not measured")
    } else {
        ("Rendered depth", "nothing met")
    };
    let bar = plane.range.map(depth_bar);
    let title = [Row::Title(title.to_owned())].into_iter();
    Some(title.chain(bar).chain([Row::Hatched(hole.to_owned())]).collect())
}

impl Row {
    fn words(&self) -> &str {
        match self {
            Self::Swatch(_, text) | Self::Hatched(text) | Self::Title(text) | Self::Note(text) => text,
            Self::Bar(..) => "",
        }
    }

    fn font() -> FontId {
        FontId::proportional(FONT)
    }

    fn width(&self, painter: &Painter) -> f32 {
        let text = |text: &str| {
            let galley = painter.layout_no_wrap(text.to_owned(), Self::font(), TEXT);
            galley.size().x.ceil() + 1.0
        };
        match self {
            Self::Swatch(_, words) | Self::Hatched(words) => SWATCH + 8.0 + text(words),
            Self::Bar(_, ends) => BAR.x.max(text(&ends[0]) + 16.0 + text(&ends[1])),
            Self::Title(words) | Self::Note(words) => text(words),
        }
    }

    fn paint(&self, painter: &Painter, line: Rect) {
        let square = Rect::from_center_size(
            pos2(line.left() + 0.5 * SWATCH, line.center().y),
            egui::Vec2::splat(SWATCH),
        );
        let cut = |line: Rect, words: &str, color: Color32| {
            painted_line(painter, line, words, FONT, color);
        };
        let beside = line.with_min_x(line.left() + SWATCH + 8.0);
        match self {
            Self::Swatch(color, words) => {
                swatch(painter, square.center(), *color, SWATCH);
                cut(beside, words, TEXT);
            }
            Self::Hatched(words) => {
                hatched(painter, square);
                cut(beside, words, TEXT);
            }
            Self::Title(words) => cut(line, words, TEXT),
            Self::Note(words) => cut(line, words, WEAK),
            Self::Bar(table, [low, high]) => {
                let galley = |words: &String| painter.layout_no_wrap(words.clone(), Self::font(), TEXT);
                let (low, high) = (galley(low), galley(high));
                let (left, right) = (low.size().x + 6.0, high.size().x + 6.0);
                let center = line.center().y;
                let ends = (line.left() + left)..=(line.right() - right);
                let bar = Rect::from_x_y_ranges(ends, center - 0.5 * BAR.y..=center + 0.5 * BAR.y);
                painter.add(colors(*table, bar));
                let top = |height: f32| center - 0.5 * height;
                painter.galley(pos2(line.left(), top(low.size().y)), low, TEXT);
                let place = pos2(line.right() - right + 6.0, top(high.size().y));
                painter.galley(place, high, TEXT);
            }
        }
    }
}

/// The colours of a table from left to right.
fn colors(table: Table, bar: Rect) -> Shape {
    const STRIPS: usize = 32;
    let mut mesh = Mesh::default();
    for strip in 0..=STRIPS {
        let share = strip as f32 / STRIPS as f32;
        let [r, g, b, _] = table.color((share * (PALETTE_COLUMNS - 1) as f32) as usize);
        let color = Color32::from_rgb(r, g, b);
        let x = bar.left() + share * bar.width();
        mesh.colored_vertex(pos2(x, bar.top()), color);
        mesh.colored_vertex(pos2(x, bar.bottom()), color);
        if strip > 0 {
            let last = 2 * strip as u32;
            mesh.add_triangle(last - 2, last - 1, last);
            mesh.add_triangle(last - 1, last, last + 1);
        }
    }
    Shape::mesh(mesh)
}

/// Stripes as on pixels without a value.
fn hatched(painter: &Painter, square: Rect) {
    painter.rect_filled(square, 3, Color32::from_gray(70));
    let painter = painter.with_clip_rect(square.intersect(painter.clip_rect()));
    for step in 0..6 {
        let x = square.left() + step as f32 * 4.0;
        let from: Pos2 = pos2(x, square.top());
        let to = from + vec2(-square.height(), square.height());
        painter.line_segment([from, to], egui::Stroke::new(1.5, Color32::from_gray(200)));
    }
}
