//! Which stroke lies under the pointer.

use std::sync::Arc;

use egui::{Pos2, Vec2};
use inplace_core::labels::{Pixel, Stroke, StrokeId};

/// How near, in points, a click has to be to a stroke that is thinner than that.
const REACH: f32 = 5.0;

/// The topmost of the strokes of a frame, which are by age, at an image position, at a zoom of so many points per image
/// pixel.
pub fn stroke_at<'a>(
    strokes: impl DoubleEndedIterator<Item = (StrokeId, &'a Arc<Stroke>)>,
    position: Pos2,
    zoom: f32,
) -> Option<StrokeId> {
    let found = strokes.rev().find(|(_, stroke)| {
        let reach = (stroke.radius as f32 + 0.5).max(REACH / zoom);
        is_within(stroke, position, reach)
    });
    found.map(|(id, _)| id)
}

fn is_within(stroke: &Stroke, position: Pos2, reach: f32) -> bool {
    let center = |&[x, y]: &Pixel| Pos2::new(x as f32 + 0.5, y as f32 + 0.5);
    stroke.lines.iter().any(|line| match line.as_slice() {
        [point] => center(point).distance(position) <= reach,
        points => points
            .windows(2)
            .any(|pair| distance_to_segment(position, center(&pair[0]), center(&pair[1])) <= reach),
    })
}

fn distance_to_segment(position: Pos2, from: Pos2, to: Pos2) -> f32 {
    let along: Vec2 = to - from;
    let share = (position - from).dot(along) / along.length_sq().max(f32::MIN_POSITIVE);
    position.distance(from + share.clamp(0.0, 1.0) * along)
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;
    use inplace_core::labels::History;
    use inplace_model::document::Document;

    #[test]
    fn the_topmost_stroke_is_picked_inside_polygons_too() {
        let mut document = Document::new(History::default(), 0);
        let mut add = |stroke: Stroke| {
            let edit = document.edit(|history| Some(history.add_stroke(stroke)));
            edit.unwrap().strokes[0].id
        };
        let region = add(Stroke::polygon(0, 0, &[[10, 10], [40, 10], [40, 40], [10, 40]]));
        let line = add(Stroke::drawn(0, 0, 2, vec![vec![[0, 20], [60, 20]]]));
        let click = add(Stroke::click(0, 0, [30, 21]));
        add(Stroke::click(1, 0, [30, 30]));
        for (position, zoom, picked) in [
            (pos2(30.5, 30.5), 10.0, Some(region)),
            (pos2(20.5, 22.9), 10.0, Some(line)),
            (pos2(20.5, 23.1), 10.0, Some(region)),
            (pos2(30.5, 21.5), 10.0, Some(click)),
            (pos2(50.0, 30.0), 10.0, None),
            // Zoomed out, a click is hit from farther away.
            (pos2(33.5, 21.5), 1.0, Some(click)),
            (pos2(33.5, 21.5), 10.0, Some(line)),
        ] {
            let found = stroke_at(document.strokes_on(0), position, zoom);
            assert_eq!(found, picked, "{position:?}");
        }
    }
}
