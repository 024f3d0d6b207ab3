//! Pointer gestures on the canvas: labelling, erasing, panning, zooming, brush size.
//!
//! Every event of a frame is looked at, not only the last pointer position, so that fast drags lose
//! nothing.

use egui::{Event, MouseWheelUnit, PointerButton, Pos2, Rect, Vec2};
use inplace_core::labels::Pixel;

use super::view::View;

/// What the left button does.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Tool {
    /// Labels with the current class.
    #[default]
    Label,
    /// Erases strokes.
    Erase,
}

/// A line being drawn, or just finished.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Line {
    /// What it does.
    pub tool: Tool,
    /// Its pixels, in the order drawn.
    pub points: Vec<Pixel>,
}

/// What a pointer event led to.
#[derive(Clone, Debug, PartialEq)]
pub enum Outcome {
    /// The button was released: this line is complete.
    Finished(Line),
    /// The view moved.
    Moved(View),
    /// The brush should grow (positive) or shrink (negative) by so many steps.
    Brush(i32),
}

/// Where gestures happen.
#[derive(Clone, Copy, Debug)]
pub struct Surroundings {
    /// The canvas on screen.
    pub canvas: Rect,
    /// Image size in pixels.
    pub size: Vec2,
    /// The chosen tool.
    pub tool: Tool,
    /// Whether the key that turns a left drag into panning is held.
    pub pan_key: bool,
    /// Where the pointer is, if over the canvas: the fixed point of zooming.
    pub cursor: Option<Pos2>,
}

/// The gesture in progress.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Gesture {
    line: Option<(PointerButton, Line)>,
    /// The panning button and where the pointer was last.
    pan: Option<(PointerButton, Pos2)>,
}

impl Gesture {
    /// The line being drawn.
    pub fn line(&self) -> Option<&Line> {
        self.line.as_ref().map(|(_, line)| line)
    }

    /// Whether the image is being dragged.
    pub fn is_panning(&self) -> bool {
        self.pan.is_some()
    }

    /// Whether a button of this gesture is still held.
    pub fn is_active(&self) -> bool {
        self.line.is_some() || self.pan.is_some()
    }

    /// Drops the line being drawn.
    pub fn cancel(&mut self) {
        *self = Self::default();
    }

    /// Follows one event. `reachable` tells whether nothing lies over the canvas at a position.
    pub fn follow(
        &mut self,
        event: &Event,
        view: View,
        around: &Surroundings,
        reachable: impl Fn(Pos2) -> bool,
    ) -> Option<Outcome> {
        match *event {
            Event::PointerButton {
                pos,
                button,
                pressed: true,
                ..
            } if !self.is_active() && reachable(pos) => {
                self.press(pos, button, view, around);
                None
            }
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
                wheel(steps, modifiers.command, view, around)
            }
            _ => None,
        }
    }

    fn press(&mut self, pos: Pos2, button: PointerButton, view: View, around: &Surroundings) {
        let tool = match button {
            PointerButton::Middle => None,
            PointerButton::Primary if around.pan_key => None,
            PointerButton::Primary => Some(around.tool),
            PointerButton::Secondary => Some(Tool::Erase),
            PointerButton::Extra1 | PointerButton::Extra2 => return,
        };
        let Some(tool) = tool else {
            self.pan = Some((button, pos));
            return;
        };
        if let Some(pixel) = view.place(around.canvas, around.size).pixel_at(pos) {
            let points = vec![pixel];
            self.line = Some((button, Line { tool, points }));
        }
    }

    fn drag(&mut self, pos: Pos2, mut view: View, around: &Surroundings) -> Option<Outcome> {
        if let Some((_, last)) = &mut self.pan {
            view.pan(around.canvas, around.size, pos - *last);
            *last = pos;
            return Some(Outcome::Moved(view));
        }
        if let Some((_, line)) = &mut self.line {
            extend(line, view, around, pos);
        }
        None
    }

    fn release(
        &mut self,
        pos: Pos2,
        button: PointerButton,
        view: View,
        around: &Surroundings,
    ) -> Option<Outcome> {
        if self.pan.is_some_and(|(panning, _)| panning == button) {
            self.pan = None;
        }
        if self.line.as_ref().is_some_and(|(drawing, _)| *drawing == button) {
            let (_, mut line) = self.line.take()?;
            extend(&mut line, view, around, pos);
            return Some(Outcome::Finished(line));
        }
        None
    }
}

fn wheel(steps: f32, brush: bool, mut view: View, around: &Surroundings) -> Option<Outcome> {
    if steps == 0.0 {
        return None;
    }
    if brush {
        return Some(Outcome::Brush(steps.signum() as i32));
    }
    let cursor = around.cursor.unwrap_or_else(|| around.canvas.center());
    view.zoom_at(around.canvas, around.size, cursor, 1.2_f32.powf(steps));
    Some(Outcome::Moved(view))
}

fn extend(line: &mut Line, view: View, around: &Surroundings, pos: Pos2) {
    let pixel = view.place(around.canvas, around.size).nearest_pixel(pos);
    if line.points.last() != Some(&pixel) {
        line.points.push(pixel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Modifiers, MouseWheelSource, TouchPhase, pos2, vec2};

    const AROUND: Surroundings = Surroundings {
        canvas: Rect {
            min: pos2(0.0, 0.0),
            max: pos2(352.0, 272.0),
        },
        size: vec2(320.0, 240.0),
        tool: Tool::Label,
        pan_key: false,
        cursor: None,
    };

    fn button(x: f32, y: f32, button: PointerButton, pressed: bool) -> Event {
        Event::PointerButton {
            pos: pos2(x, y),
            button,
            pressed,
            modifiers: Modifiers::NONE,
        }
    }

    fn follow(gesture: &mut Gesture, around: &Surroundings, events: &[Event]) -> Vec<Outcome> {
        let follow = |event| gesture.follow(event, View::FITTED, around, |_| true);
        events.iter().filter_map(follow).collect()
    }

    #[test]
    fn a_click_is_a_line_of_one_pixel() {
        let events = [
            button(26.5, 36.5, PointerButton::Primary, true),
            button(26.5, 36.5, PointerButton::Primary, false),
        ];
        let line = Line {
            tool: Tool::Label,
            points: vec![[10, 20]],
        };
        assert_eq!(
            follow(&mut Gesture::default(), &AROUND, &events),
            [Outcome::Finished(line)]
        );
    }

    #[test]
    fn a_fast_drag_keeps_every_position_and_stays_in_the_image() {
        let events = [
            button(16.5, 16.5, PointerButton::Primary, true),
            Event::PointerMoved(pos2(26.5, 16.5)),
            Event::PointerMoved(pos2(26.5, 46.5)),
            Event::PointerMoved(pos2(-400.0, 46.5)),
            button(-400.0, 46.5, PointerButton::Primary, false),
        ];
        let outcomes = follow(&mut Gesture::default(), &AROUND, &events);
        let Outcome::Finished(line) = &outcomes[0] else {
            panic!("not finished: {outcomes:?}")
        };
        assert_eq!(line.points, [[0, 0], [10, 0], [10, 30], [0, 30]]);
    }

    #[test]
    fn the_right_button_erases_whatever_the_tool() {
        let events = [
            button(30.0, 30.0, PointerButton::Secondary, true),
            button(30.0, 30.0, PointerButton::Secondary, false),
        ];
        let outcomes = follow(&mut Gesture::default(), &AROUND, &events);
        assert!(matches!(&outcomes[0], Outcome::Finished(line) if line.tool == Tool::Erase));
    }

    #[test]
    fn dragging_with_the_pan_key_moves_the_view_and_draws_nothing() {
        let around = Surroundings {
            pan_key: true,
            ..AROUND
        };
        let mut gesture = Gesture::default();
        let events = [
            button(30.0, 30.0, PointerButton::Primary, true),
            Event::PointerMoved(pos2(50.0, 30.0)),
            button(50.0, 30.0, PointerButton::Primary, false),
        ];
        let outcomes = follow(&mut gesture, &around, &events);
        assert!(matches!(outcomes.as_slice(), [Outcome::Moved(_)]));
        assert!(!gesture.is_active());
    }

    #[test]
    fn a_press_outside_the_image_or_under_a_window_starts_nothing() {
        let mut gesture = Gesture::default();
        follow(
            &mut gesture,
            &AROUND,
            &[button(2.0, 2.0, PointerButton::Primary, true)],
        );
        assert!(!gesture.is_active());
        gesture.follow(
            &button(40.0, 40.0, PointerButton::Primary, true),
            View::FITTED,
            &AROUND,
            |_| false,
        );
        assert!(!gesture.is_active());
    }

    #[test]
    fn the_wheel_zooms_and_with_ctrl_changes_the_brush() {
        let wheel = |modifiers| Event::MouseWheel {
            unit: MouseWheelUnit::Line,
            delta: vec2(0.0, 1.0),
            phase: TouchPhase::Move,
            source: MouseWheelSource::Unknown,
            modifiers,
        };
        let mut gesture = Gesture::default();
        let plain = follow(&mut gesture, &AROUND, &[wheel(Modifiers::NONE)]);
        assert!(matches!(plain[0], Outcome::Moved(view) if !view.is_fitted()));
        let ctrl = follow(&mut gesture, &AROUND, &[wheel(Modifiers::COMMAND)]);
        assert_eq!(ctrl, [Outcome::Brush(1)]);
    }
}
