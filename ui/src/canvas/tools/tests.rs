//! Gestures by the events that make them.

use egui::{MouseWheelSource, TouchPhase, pos2, vec2};

use super::*;

const AROUND: CanvasPlace = CanvasPlace {
    canvas: Rect {
        min: pos2(0.0, 0.0),
        max: pos2(352.0, 272.0),
    },
    size: vec2(320.0, 240.0),
    tool: Tool::Brush,
    pan_key: false,
    cursor: None,
    line_end: None,
    time: 0.0,
};

fn button(x: f32, y: f32, button: PointerButton, pressed: bool) -> Event {
    Event::PointerButton {
        pos: pos2(x, y),
        button,
        pressed,
        modifiers: Modifiers::NONE,
    }
}

fn press(x: f32, y: f32) -> Event {
    button(x, y, PointerButton::Primary, true)
}

fn release(x: f32, y: f32) -> Event {
    button(x, y, PointerButton::Primary, false)
}

fn follow(gesture: &mut Gesture, around: &CanvasPlace, events: &[Event]) -> Vec<Outcome> {
    let follow = |event| gesture.follow(event, View::Whole, around, |_| true);
    events.iter().filter_map(follow).collect()
}

#[test]
fn a_press_outside_the_image_or_under_a_window_starts_nothing() {
    let mut gesture = Gesture::default();
    follow(&mut gesture, &AROUND, &[press(2.0, 2.0)]);
    assert!(!gesture.is_active());
    gesture.follow(&press(40.0, 40.0), View::Whole, &AROUND, |_| false);
    assert!(!gesture.is_active());
}

#[test]
fn the_wheel_zooms_and_with_ctrl_changes_the_brush() {
    let wheel = |unit, y, modifiers| Event::MouseWheel {
        unit,
        delta: vec2(0.0, y),
        phase: TouchPhase::Move,
        source: MouseWheelSource::Unknown,
        modifiers,
    };
    let mut gesture = Gesture::default();
    let plain = wheel(MouseWheelUnit::Line, 1.0, Modifiers::NONE);
    let plain = follow(&mut gesture, &AROUND, &[plain]);
    assert!(matches!(plain[0], Outcome::Moved(View::Free { .. })));
    for notch in [0.1, 1.0, 3.0] {
        let ctrl = wheel(MouseWheelUnit::Line, notch, Modifiers::COMMAND);
        assert_eq!(follow(&mut gesture, &AROUND, &[ctrl]), [Outcome::Brush(1)]);
    }
    // A step is 50 points of a touchpad.
    let swipe = |y| wheel(MouseWheelUnit::Point, y, Modifiers::COMMAND);
    let swipes = [30.0, 30.0, 30.0, 30.0, -80.0].map(swipe);
    let steps = [1, 1, -1].map(Outcome::Brush);
    assert_eq!(follow(&mut gesture, &AROUND, &swipes), steps);
}

#[test]
fn a_pinch_zooms_at_the_pointer() {
    let cursor = pos2(100.0, 80.0);
    let around = CanvasPlace {
        cursor: Some(cursor),
        ..AROUND
    };
    let pinches = [f32::NAN, 2.0].map(Event::Zoom);
    let zoomed = zoomed_at(View::Whole, AROUND.canvas, AROUND.size, cursor, 2.0);
    let outcomes = follow(&mut Gesture::default(), &around, &pinches);
    assert_eq!(outcomes, [Outcome::Moved(zoomed)]);
}

fn with(tool: Tool) -> CanvasPlace {
    CanvasPlace { tool, ..AROUND }
}

/// A click on the centre of a pixel of the fitted image, long after the one before.
fn click(gesture: &mut Gesture, around: &mut CanvasPlace, [x, y]: Pixel) -> Vec<Outcome> {
    around.time += 1.0;
    let (x, y) = (x as f32 + 16.5, y as f32 + 16.5);
    follow(gesture, around, &[press(x, y), release(x, y)])
}

const CORNERS: [Pixel; 3] = [[10, 10], [60, 10], [60, 50]];

#[test]
fn a_double_click_ends_and_two_quick_clicks_apart_do_not() {
    for tool in [Tool::Polyline, Tool::Polygon] {
        let (mut gesture, mut around) = (Gesture::default(), with(tool));
        for corner in CORNERS {
            click(&mut gesture, &mut around, corner);
            // As fast as a double-click, but elsewhere.
            around.time -= 0.8;
        }
        around.time -= 0.2;
        let points = CORNERS.to_vec();
        assert_eq!(
            click(&mut gesture, &mut around, [61, 50]),
            [Outcome::Finished(DrawnLine { tool, points })]
        );
    }
}

#[test]
fn a_drag_draws_an_outline_that_closes_near_its_beginning() {
    let mut gesture = Gesture::default();
    let around = with(Tool::Polygon);
    let moved = |x, y| Event::PointerMoved(pos2(x, y));
    let events = [
        press(26.5, 26.5),
        moved(28.0, 26.5),
        moved(66.5, 26.5),
        moved(66.5, 66.5),
        moved(29.5, 29.5),
        release(29.5, 29.5),
    ];
    let outcomes = follow(&mut gesture, &around, &events);
    let [Outcome::Finished(line)] = outcomes.as_slice() else {
        panic!("not finished: {outcomes:?}")
    };
    assert_eq!(line.points, [[10, 10], [50, 10], [50, 50], [13, 13]]);
    // Released elsewhere, it goes on, and all of the drag is taken back at once.
    let open = follow(&mut gesture, &around, &events[..4]);
    assert_eq!(open, []);
    follow(&mut gesture, &around, &[release(66.5, 66.5)]);
    assert_eq!(gesture.draft().unwrap().points.len(), 3);
    gesture.take_back();
    assert!(!gesture.is_drawing());
}

#[test]
fn where_the_window_loses_the_focus_a_line_ends_and_an_outline_waits() {
    let events = [
        press(26.5, 26.5),
        Event::WindowFocused(false),
        Event::PointerMoved(pos2(90.0, 90.0)),
        release(90.0, 90.0),
    ];
    let mut gesture = Gesture::default();
    let (tool, points) = (Tool::Brush, vec![[10, 10]]);
    let ended = Outcome::Finished(DrawnLine { tool, points });
    assert_eq!(follow(&mut gesture, &AROUND, &events), [ended]);
    assert_eq!(follow(&mut gesture, &with(Tool::Polygon), &events), []);
    assert_eq!(gesture.draft().unwrap().points, [[10, 10]]);
}

#[test]
fn an_outline_that_was_left_with_the_button_held_does_not_follow_the_pointer_afterwards() {
    let mut gesture = Gesture::default();
    let around = with(Tool::Polygon);
    follow(&mut gesture, &around, &[press(26.5, 26.5)]);
    let left = gesture.swap_draft(None);
    follow(&mut gesture, &around, &[release(26.5, 26.5)]);
    gesture.swap_draft(left);
    follow(&mut gesture, &around, &[Event::PointerMoved(pos2(90.0, 90.0))]);
    assert_eq!(gesture.draft().unwrap().points, [[10, 10]]);
}

#[test]
fn panning_moves_the_view_and_draws_nothing_also_in_the_middle_of_a_polygon() {
    let pan_key = CanvasPlace {
        pan_key: true,
        ..AROUND
    };
    let (mut nothing, mut polygon) = (Gesture::default(), Gesture::default());
    click(&mut polygon, &mut with(Tool::Polygon), CORNERS[0]);
    for (gesture, around, held) in [
        (&mut nothing, pan_key, PointerButton::Primary),
        (&mut polygon, with(Tool::Polygon), PointerButton::Middle),
    ] {
        let before = gesture.draft().cloned();
        let events = [
            button(100.0, 100.0, held, true),
            Event::PointerMoved(pos2(150.0, 100.0)),
            button(150.0, 100.0, held, false),
        ];
        let outcomes = follow(gesture, &around, &events);
        assert!(matches!(outcomes.as_slice(), [Outcome::Moved(_)]));
        assert!(!gesture.is_active());
        assert_eq!(gesture.draft(), before.as_ref());
    }
}
