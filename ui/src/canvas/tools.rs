//! Pointer gestures on the canvas: drawing, erasing, selecting, panning, zooming, brush size.
//!
//! Every event of a frame is looked at, not only the last pointer position, so that fast drags lose
//! nothing.

mod draft;

use egui::{Event, Modifiers, MouseWheelUnit, MultiTouchInfo, PointerButton, Pos2, Rect, Vec2};
use inplace_core::labels::Pixel;
use inplace_model::tool::{DrawnLine, Tool};
use inplace_model::view::View;

pub use draft::Draft;

use super::view::{Placement, panned, zoomed_at};

/// Two presses are a double-click within this many seconds and points.
const DOUBLE_CLICK: (f64, f32) = (0.35, 6.0);

/// What a pointer event led to.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// This line is complete.
    Finished(DrawnLine),
    /// This line is complete, and on an object of its own.
    FinishedObject(DrawnLine),
    /// A stroke was pointed at, or no stroke: the image position (the centre of pixel 0 is 0.5), which may be
    /// outside the image.
    Picked(Pos2),
    Moved(View),
    /// The brush should grow (positive) or shrink (negative) by so many steps.
    Brush(i32),
}

/// Where gestures happen.
#[derive(Clone, Copy, Debug)]
pub struct CanvasPlace {
    /// The canvas on screen.
    pub canvas: Rect,
    /// Image size in pixels.
    pub size: Vec2,
    pub tool: Tool,
    /// Whether the key that turns a left drag into panning is held.
    pub pan_key: bool,
    /// Where the pointer is, if over the canvas: the fixed point of zooming.
    pub cursor: Option<Pos2>,
    /// Where the newest line of the frame ends: from there a straight line is drawn with Shift.
    pub line_end: Option<Pixel>,
    /// Seconds, from any fixed moment on.
    pub time: f64,
}

impl CanvasPlace {
    /// Where the image lies with this view.
    pub fn placement(&self, view: View) -> Placement {
        Placement::new(view, self.canvas, self.size)
    }
}

/// The gesture in progress.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gesture {
    line: Option<(PointerButton, DrawnLine)>,
    /// Whether the line is on an object of its own.
    on_object: bool,
    /// The panning button and where the pointer was last.
    pan: Option<(PointerButton, Pos2)>,
    draft: Option<Draft>,
    /// When and where a corner was added last.
    corner_added: Option<(f64, Pos2)>,
    /// The part of a step of the brush's size that a touchpad has gone.
    brush_turned: f32,
}

impl Gesture {
    /// The line being drawn with a button held.
    pub fn line(&self) -> Option<&DrawnLine> {
        self.line.as_ref().map(|(_, line)| line)
    }

    /// The polyline or polygon being drawn.
    pub fn draft(&self) -> Option<&Draft> {
        self.draft.as_ref()
    }

    /// Puts another draft, or none, in the place of the one being drawn, which is returned.
    pub fn swap_draft(&mut self, draft: Option<Draft>) -> Option<Draft> {
        let mut before = std::mem::replace(&mut self.draft, draft);
        if let Some(before) = &mut before {
            // Its button may be released elsewhere.
            before.release();
        }
        self.line = None;
        self.corner_added = None;
        before
    }

    /// Whether the image is being dragged.
    pub fn is_panning(&self) -> bool {
        self.pan.is_some()
    }

    /// Whether a button of this gesture is still held.
    pub fn is_active(&self) -> bool {
        self.line.is_some() || self.pan.is_some() || self.draft.as_ref().is_some_and(Draft::is_held)
    }

    /// Whether something is being drawn.
    pub fn is_drawing(&self) -> bool {
        self.line.is_some() || self.draft.is_some()
    }

    /// Drops what is being drawn.
    pub fn cancel(&mut self) {
        *self = Self::default();
    }

    /// Ends the polyline or polygon being drawn.
    pub fn finish(&mut self) -> Option<DrawnLine> {
        self.corner_added = None;
        self.draft.take().map(Draft::into_line)
    }

    /// Takes the last corner of the polyline or polygon back; with its only corner it is dropped.
    pub fn take_back(&mut self) {
        self.corner_added = None;
        if self.draft.as_mut().is_some_and(|draft| !draft.take_back()) {
            self.draft = None;
        }
    }

    /// Follows one event. `reachable` tells whether nothing lies over the canvas at a position.
    pub fn follow(
        &mut self,
        event: &Event,
        view: View,
        around: &CanvasPlace,
        reachable: impl Fn(Pos2) -> bool,
    ) -> Option<Outcome> {
        match *event {
            Event::PointerButton {
                pos,
                button,
                pressed: true,
                modifiers,
            } if !self.is_active() && reachable(pos) => self.press(pos, button, modifiers, view, around),
            Event::PointerButton {
                pos,
                button,
                pressed: false,
                ..
            } => self.release(pos, button, view, around),
            Event::PointerMoved(pos) => self.drag(pos, view, around),
            Event::MouseWheel {
                unit,
                delta,
                modifiers,
                ..
            } => {
                let steps = match unit {
                    MouseWheelUnit::Line | MouseWheelUnit::Page => delta.y,
                    MouseWheelUnit::Point => delta.y / 50.0,
                };
                if steps == 0.0 {
                    None
                } else if modifiers.command {
                    self.turn_brush(steps, unit)
                } else {
                    Some(zoomed(1.2_f32.powf(steps), view, around))
                }
            }
            // The system may tell of a pinch without a number.
            Event::Zoom(factor) if factor.is_finite() => Some(zoomed(factor, view, around)),
            // Nothing may be told of the button that is released elsewhere.
            Event::WindowFocused(false) => self.let_go(),
            _ => None,
        }
    }

    /// Two fingers move and zoom the image; what the first of them began is dropped.
    pub fn pinch(&mut self, touch: &MultiTouchInfo, view: View, around: &CanvasPlace) -> View {
        if self.draft.as_ref().is_some_and(Draft::is_held) {
            self.take_back();
        }
        (self.line, self.pan) = (None, None);
        let moved = panned(view, around.canvas, around.size, touch.translation_delta);
        // At one place, they have no distance that could grow.
        let factor = Some(touch.zoom_delta).filter(|factor| factor.is_finite());
        let factor = factor.unwrap_or(1.0);
        zoomed_at(moved, around.canvas, around.size, touch.center_pos, factor)
    }

    /// Every notch of a wheel is a step, however far it goes; on a touchpad steps add up.
    fn turn_brush(&mut self, steps: f32, unit: MouseWheelUnit) -> Option<Outcome> {
        self.brush_turned = match unit {
            MouseWheelUnit::Line | MouseWheelUnit::Page => steps.signum(),
            MouseWheelUnit::Point => self.brush_turned + steps,
        };
        let whole = self.brush_turned.trunc();
        self.brush_turned -= whole;
        (whole != 0.0).then_some(Outcome::Brush(whole as i32))
    }

    fn press(
        &mut self,
        pos: Pos2,
        button: PointerButton,
        modifiers: Modifiers,
        view: View,
        around: &CanvasPlace,
    ) -> Option<Outcome> {
        let tool = match button {
            PointerButton::Middle => None,
            PointerButton::Primary if around.pan_key => None,
            PointerButton::Primary => Some(around.tool),
            PointerButton::Secondary => Some(Tool::Erase),
            PointerButton::Extra1 | PointerButton::Extra2 => return None,
        };
        let Some(tool) = tool else {
            self.pan = Some((button, pos));
            return None;
        };
        let placement = around.placement(view);
        match tool {
            Tool::Select => return Some(Outcome::Picked(placement.to_image(pos))),
            Tool::Polyline | Tool::Polygon => return self.add_corner(tool, pos, view, around),
            Tool::Brush | Tool::Erase => {}
        }
        if let Some(pixel) = placement.pixel_at(pos) {
            let straight = around.line_end.filter(|_| tool == Tool::Brush && modifiers.shift);
            let mut points: Vec<Pixel> = straight.into_iter().collect();
            if points.last() != Some(&pixel) {
                points.push(pixel);
            }
            self.on_object = tool == Tool::Brush && modifiers.command;
            self.line = Some((button, DrawnLine { tool, points }));
        }
        None
    }

    fn add_corner(&mut self, tool: Tool, pos: Pos2, view: View, around: &CanvasPlace) -> Option<Outcome> {
        let placement = around.placement(view);
        let Some(draft) = self.draft.as_mut().filter(|draft| draft.tool == tool) else {
            // What the other tool began stays only until this one begins.
            let pixel = placement.pixel_at(pos)?;
            self.draft = Some(Draft::new(tool, pixel, pos));
            self.corner_added = Some((around.time, pos));
            return None;
        };
        let twice = self.corner_added.is_some_and(|(time, at)| {
            around.time - time <= DOUBLE_CLICK.0 && at.distance(pos) <= DOUBLE_CLICK.1
        });
        let first = draft.points.first();
        let closes = first.is_some_and(|&first| draft.closes_at(pos, placement.pixel_center(first)));
        if twice || closes {
            return self.finish().map(Outcome::Finished);
        }
        // Clicks beside the image are corners on its border.
        draft.press(placement.nearest_pixel(pos), pos);
        self.corner_added = Some((around.time, pos));
        None
    }

    fn drag(&mut self, pos: Pos2, view: View, around: &CanvasPlace) -> Option<Outcome> {
        if let Some((_, last)) = &mut self.pan {
            let moved = panned(view, around.canvas, around.size, pos - *last);
            *last = pos;
            return Some(Outcome::Moved(moved));
        }
        if let Some((_, line)) = &mut self.line {
            extend(line, view, around, pos);
        } else if let Some(draft) = &mut self.draft {
            let pixel = around.placement(view).nearest_pixel(pos);
            draft.drag(pixel, pos);
        }
        None
    }

    fn release(
        &mut self,
        pos: Pos2,
        button: PointerButton,
        view: View,
        around: &CanvasPlace,
    ) -> Option<Outcome> {
        if self.pan.is_some_and(|(panning, _)| panning == button) {
            self.pan = None;
        }
        if let Some((drawing, line)) = &mut self.line
            && *drawing == button
        {
            extend(line, view, around, pos);
            return self.let_go();
        }
        if button == PointerButton::Primary
            && let Some(draft) = &mut self.draft
            && draft.release()
        {
            let placement = around.placement(view);
            let first = placement.pixel_center(*draft.points.first()?);
            if draft.closes_at(pos, first) {
                return self.finish().map(Outcome::Finished);
            }
        }
        None
    }

    /// Ends what is done with a button held; a polyline or polygon stays without its end.
    fn let_go(&mut self) -> Option<Outcome> {
        self.pan = None;
        if let Some(draft) = &mut self.draft {
            draft.release();
        }
        let (_, line) = self.line.take()?;
        Some(match self.on_object {
            true => Outcome::FinishedObject(line),
            false => Outcome::Finished(line),
        })
    }
}

fn zoomed(factor: f32, view: View, around: &CanvasPlace) -> Outcome {
    let cursor = around.cursor.unwrap_or_else(|| around.canvas.center());
    Outcome::Moved(zoomed_at(view, around.canvas, around.size, cursor, factor))
}

fn extend(line: &mut DrawnLine, view: View, around: &CanvasPlace, pos: Pos2) {
    let pixel = around.placement(view).nearest_pixel(pos);
    if line.points.last() != Some(&pixel) {
        line.points.push(pixel);
    }
}

#[cfg(test)]
mod tests;
