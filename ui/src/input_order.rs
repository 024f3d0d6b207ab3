//! Input in the order in which it came, at any frame rate.
//!
//! Within one frame egui knows a single place of the pointer and a single focus. On a slow machine several things that a
//! person did one after the other come in one frame: the letters typed after a click on a field would go where the focus
//! was before that click. So egui is given the events of a frame only as far as their order cannot matter; the rest
//! waits for the next frame, which is asked for at once.

use std::collections::VecDeque;

use egui::{Context, Event, Key, Order, Pos2, RawInput, Rect};

use crate::keys;

/// The plugin of egui that keeps the order.
#[derive(Debug, Default)]
pub struct InputOrder {
    waiting: VecDeque<Event>,
    /// Whether nothing is handed over in the next frame.
    waits: bool,
    /// Where clicks are drawn with. The canvas looks at every event of a frame in turn, so that several clicks on it may
    /// come in one frame.
    canvas: Option<Rect>,
    /// Where controls lie on it.
    covered: Vec<Rect>,
}

impl InputOrder {
    /// Tells where the canvas is, and where controls lie on it, in points; until the next call.
    pub fn set_canvas(ctx: &Context, rect: Option<Rect>, covered: &[Rect]) {
        ctx.with_plugin(|order: &mut Self| {
            order.canvas = rect;
            order.covered = covered.to_vec();
        });
    }

    /// Hands nothing over in the next frame: a dialog that was opened gets the keyboard then, and one that was closed
    /// no longer covers what is under it.
    pub fn wait_a_frame(ctx: &Context) {
        ctx.with_plugin(|order: &mut Self| order.waits = true);
        ctx.request_repaint();
    }
}

impl egui::Plugin for InputOrder {
    fn debug_name(&self) -> &'static str {
        "input order"
    }

    fn input_hook(&mut self, ctx: &Context, input: &mut RawInput) {
        // A pass that is repeated has no input: what waits is for the next frame.
        if ctx.current_pass_index() > 0 {
            return;
        }
        self.waiting.extend(input.events.drain(..));
        if std::mem::take(&mut self.waits) {
            ctx.request_repaint();
            return;
        }
        let on_canvas = |pos: Pos2| {
            let layer = ctx.layer_id_at(pos);
            self.canvas.is_some_and(|rect| rect.contains(pos))
                && !self.covered.iter().any(|rect| rect.contains(pos))
                && layer.is_none_or(|layer| layer.order == Order::Background)
        };
        let is_typing = ctx.text_edit_focused();
        let moves_focus = |event: &Event| {
            keys::pressed(event).is_some_and(|(modifiers, key)| {
                matches!(key, Key::Enter | Key::Escape | Key::Tab)
                    || !is_typing && keys::moves_focus(ctx, modifiers, key)
            })
        };
        let end = end_of_step(self.waiting.make_contiguous(), is_typing, on_canvas, moves_focus);
        input.events = self.waiting.drain(..end).collect();
        if !self.waiting.is_empty() {
            ctx.request_repaint();
        }
    }
}

/// How many of these events may come in one frame: keys and then clicks, but nothing after a click beside the canvas, no
/// key after a click, and nothing after a key that moves the focus.
fn end_of_step(
    events: &[Event],
    is_typing: bool,
    on_canvas: impl Fn(Pos2) -> bool,
    moves_focus: impl Fn(&Event) -> bool,
) -> usize {
    /// What the last click was on.
    #[derive(Clone, Copy, PartialEq)]
    enum Click {
        Canvas,
        Beside { released: bool },
    }
    let mut click = None;
    let mut has_typed = false;
    for (index, event) in events.iter().enumerate() {
        match event {
            Event::PointerButton { pos, pressed, .. } => {
                let goes_on = match click {
                    // A field that is left takes what was typed before.
                    None => !(is_typing && has_typed && *pressed),
                    Some(Click::Canvas) => !pressed || on_canvas(*pos),
                    Some(Click::Beside { released }) => !released && !pressed,
                };
                if !goes_on {
                    return index;
                }
                if click != Some(Click::Canvas) {
                    click = Some(if on_canvas(*pos) {
                        Click::Canvas
                    } else {
                        Click::Beside { released: !pressed }
                    });
                }
            }
            Event::PointerMoved(_) if matches!(click, Some(Click::Beside { .. })) => return index,
            Event::Key { .. }
            | Event::Text(_)
            | Event::Ime(_)
            | Event::Paste(_)
            | Event::Cut
            | Event::Copy => {
                if click.is_some() {
                    return index;
                }
                has_typed = true;
                if moves_focus(event) {
                    // The letter that this key types belongs to it.
                    let types = matches!(events.get(index + 1), Some(Event::Text(_)));
                    return index + 1 + usize::from(types);
                }
            }
            _ => {}
        }
    }
    events.len()
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::{Modifiers, PointerButton, pos2};

    const FIELD: Pos2 = pos2(-1.0, 0.0);
    const CANVAS: Pos2 = pos2(1.0, 0.0);

    fn button(pos: Pos2, pressed: bool) -> Event {
        Event::PointerButton {
            pos,
            button: PointerButton::Primary,
            pressed,
            modifiers: Modifiers::NONE,
        }
    }

    fn click(pos: Pos2) -> Vec<Event> {
        vec![Event::PointerMoved(pos), button(pos, true), button(pos, false)]
    }

    fn typed(key: Key) -> Vec<Event> {
        let pressed = Event::Key {
            key,
            physical_key: None,
            pressed: true,
            repeat: false,
            modifiers: Modifiers::NONE,
        };
        vec![pressed, Event::Text(key.name().to_lowercase())]
    }

    /// What is done: a click on a field (f) or on the canvas (c), a letter (5), or the key that opens a field (o).
    fn done(parts: &str) -> Vec<Event> {
        let part = |part| match part {
            'f' => click(FIELD),
            'c' => click(CANVAS),
            'o' => typed(Key::C),
            _ => typed(Key::Num5),
        };
        parts.chars().flat_map(part).collect()
    }

    /// Numbers of events in the frames that these come in; the key C moves the focus, and so does a click.
    fn frames(mut events: Vec<Event>, mut is_typing: bool) -> Vec<usize> {
        let mut frames = Vec::new();
        let opens = |event: &Event| matches!(event, Event::Key { key: Key::C, .. });
        while !events.is_empty() {
            let moves = |event: &Event| !is_typing && opens(event);
            let end = end_of_step(&events, is_typing, |pos| pos.x > 0.0, moves);
            let step: Vec<Event> = events.drain(..end).collect();
            let clicked = |pos| step.contains(&button(pos, true));
            is_typing = (is_typing || step.iter().any(opens) || clicked(FIELD)) && !clicked(CANVAS);
            frames.push(end);
        }
        frames
    }

    #[test]
    fn what_depends_on_what_was_before_comes_in_a_later_frame() {
        for (name, parts, is_typing, expected) in [
            ("a key and a click", "5c", false, vec![5]),
            ("clicks on the canvas", "ccc", false, vec![9]),
            ("a key after a click", "5c5c", false, vec![5, 5]),
            ("letters after a click on a field", "f55", false, vec![3, 4]),
            ("clicks beside the canvas", "ffc", false, vec![3, 3, 3]),
            ("letters after a key that opens a field", "o5", false, vec![2, 2]),
            ("a click after letters in a field", "5c5", true, vec![3, 2, 2]),
            ("letters in a field", "o5o", true, vec![6]),
        ] {
            assert_eq!(frames(done(parts), is_typing), expected, "{name}");
        }
    }

    #[test]
    fn a_drag_beside_the_canvas_begins_where_it_was_pressed() {
        let drag = [
            button(FIELD, true),
            Event::PointerMoved(CANVAS),
            Event::PointerMoved(FIELD),
            button(FIELD, false),
        ];
        assert_eq!(frames(drag.to_vec(), false), [1, 3]);
        let stroke = [
            button(CANVAS, true),
            Event::PointerMoved(FIELD),
            button(FIELD, false),
        ];
        assert_eq!(frames(stroke.to_vec(), false), [3]);
    }
}
