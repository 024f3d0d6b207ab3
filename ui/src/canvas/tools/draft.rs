//! Polylines and polygons, drawn corner by corner.

use egui::Pos2;
use inplace_core::labels::Pixel;
use inplace_model::tool::{DrawnLine, Tool};

/// How far the pointer moves, in points, before a held button draws freely.
const FREEHAND: f32 = 4.0;
/// How near to the first corner, in points, the pointer closes a polygon.
pub const CLOSING: f32 = 9.0;

/// A polyline or polygon that is being drawn. It needs no button held, and stays on its frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Draft {
    /// What it becomes.
    pub tool: Tool,
    /// All its points in order, those drawn freely included.
    pub points: Vec<Pixel>,
    /// How many points there were before each press: what taking back goes back to.
    presses: Vec<usize>,
    held: Option<Held>,
}

/// The button is held.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Held {
    from: Pos2,
    freehand: bool,
}

impl Draft {
    /// Starts with a first corner, at this screen position.
    pub(super) fn new(tool: Tool, pixel: Pixel, position: Pos2) -> Self {
        let mut draft = Self {
            tool,
            points: Vec::new(),
            presses: Vec::new(),
            held: None,
        };
        draft.press(pixel, position);
        draft
    }

    /// The points that were clicked.
    pub fn corners(&self) -> impl Iterator<Item = Pixel> {
        self.presses
            .iter()
            .filter_map(|&index| self.points.get(index).copied())
    }

    /// Whether the button is held.
    pub fn is_held(&self) -> bool {
        self.held.is_some()
    }

    /// Whether a corner here would close it; `first` is where its first corner is on screen.
    pub fn closes_at(&self, position: Pos2, first: Pos2) -> bool {
        self.tool == Tool::Polygon && self.points.len() >= 3 && position.distance(first) <= CLOSING
    }

    /// What it is when it ends now.
    pub fn into_line(self) -> DrawnLine {
        DrawnLine {
            tool: self.tool,
            points: self.points,
        }
    }

    /// Adds a corner.
    pub(super) fn press(&mut self, pixel: Pixel, position: Pos2) {
        self.held = Some(Held {
            from: position,
            freehand: false,
        });
        if self.points.last() != Some(&pixel) {
            self.presses.push(self.points.len());
            self.points.push(pixel);
        }
    }

    /// The pointer moved with the button held: draws freely once it is clear that it is no click.
    pub(super) fn drag(&mut self, pixel: Pixel, position: Pos2) {
        let Some(held) = &mut self.held else {
            return;
        };
        held.freehand |= held.from.distance(position) > FREEHAND;
        if held.freehand && self.points.last() != Some(&pixel) {
            self.points.push(pixel);
        }
    }

    /// The button was released; returns whether something was drawn freely.
    pub(super) fn release(&mut self) -> bool {
        self.held.take().is_some_and(|held| held.freehand)
    }

    /// Takes the last corner back, with what was drawn freely after it; returns whether any point is left.
    pub(super) fn take_back(&mut self) -> bool {
        self.held = None;
        self.points.truncate(self.presses.pop().unwrap_or(0));
        !self.points.is_empty()
    }
}
