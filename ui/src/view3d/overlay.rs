//! Vectors over the splats: the cameras of the frames and the suggestions.

use egui::{Color32, Painter, Pos2, Stroke};
use glam::{Vec3, Vec3A};
use inplace_core::scene::Frame;
use inplace_model::workspace::{LabelledSurface, Workspace};

use super::camera::Sight;
use crate::canvas::marker;
use crate::theme;

/// About how many cameras are drawn.
const CAMERAS: usize = 120;
/// A pointer this near to something points at it, in points.
const NEAR_POINTER: f32 = 14.0;

/// Something drawn over the splats that can be clicked on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mark {
    /// The camera of a frame.
    Frame(usize),
    /// A suggestion, by its rank.
    Suggestion(usize),
}

/// The frames whose cameras are drawn: all, or every so many of a long capture, and the one in view.
fn drawn_frames(frames: usize, in_view: usize) -> impl Iterator<Item = usize> {
    let step = frames.div_ceil(CAMERAS).max(1);
    let others = (0..frames).step_by(step).filter(move |&frame| frame != in_view);
    others.chain((in_view < frames).then_some(in_view))
}

/// The mark under the pointer: the nearest, suggestions first.
pub fn mark_at(
    workspace: &Workspace,
    surface: &LabelledSurface,
    sight: &Sight,
    pointer: Pos2,
) -> Option<Mark> {
    let near = |position: Vec3| {
        let gap = sight.project(position)?.0.distance(pointer);
        (gap < NEAR_POINTER).then_some(gap)
    };
    let nearest = |found: &mut dyn Iterator<Item = (f32, Mark)>| {
        found.min_by(|a, b| a.0.total_cmp(&b.0)).map(|(_, mark)| mark)
    };
    let mut suggestions = suggestion_places(workspace, surface)
        .filter_map(|(index, place)| near(place).map(|gap| (gap, Mark::Suggestion(index))));
    nearest(&mut suggestions).or_else(|| {
        let frames = &workspace.scene.frames;
        let drawn = drawn_frames(frames.len(), workspace.frame_index);
        let drawn = drawn.filter(|_| workspace.space.cameras);
        let mut found = drawn.filter_map(|frame| {
            let gap = near(frames[frame].center())?;
            Some((gap, Mark::Frame(frame)))
        });
        nearest(&mut found)
    })
}

/// The cameras of the frames as pyramids this deep, in metres.
pub fn cameras(painter: &Painter, workspace: &Workspace, sight: &Sight, depth: f32, pointed: Option<Mark>) {
    let visuals = &painter.ctx().global_style().visuals;
    let frames = &workspace.scene.frames;
    for number in drawn_frames(frames.len(), workspace.frame_index) {
        let in_view = number == workspace.frame_index;
        let (width, color, depth) = if in_view {
            (2.0, theme::of(visuals).accent, 1.8 * depth)
        } else if pointed == Some(Mark::Frame(number)) {
            (2.0, visuals.strong_text_color(), 1.4 * depth)
        } else {
            (1.0, visuals.strong_text_color().gamma_multiply(0.35), depth)
        };
        pyramid(painter, &frames[number], sight, depth, Stroke::new(width, color));
        if in_view && let Some((eye, _)) = sight.project(frames[number].center()) {
            painter.circle_filled(eye, 3.0, color);
        }
    }
}

fn pyramid(painter: &Painter, frame: &Frame, sight: &Sight, depth: f32, stroke: Stroke) {
    let camera = &frame.camera;
    let (right, bottom) = (camera.width as f32, camera.height as f32);
    let corner = |x: f32, y: f32| {
        let direction = frame.camera_to_world.matrix3 * Vec3A::from(camera.direction(x, y));
        sight.project(frame.center() + depth * Vec3::from(direction))
    };
    let Some((eye, _)) = sight.project(frame.center()) else {
        return;
    };
    let corners = [(0.0, 0.0), (right, 0.0), (right, bottom), (0.0, bottom)].map(|(x, y)| corner(x, y));
    let [Some(a), Some(b), Some(c), Some(d)] = corners.map(|corner| corner.map(|(position, _)| position))
    else {
        return;
    };
    for (from, to) in [(a, b), (b, c), (c, d), (d, a)] {
        painter.line_segment([from, to], stroke);
        painter.line_segment([eye, from], stroke);
    }
}

/// Where the suggestions lie in the world, in metres, with their ranks.
pub fn suggestion_places(
    workspace: &Workspace,
    surface: &LabelledSurface,
) -> impl Iterator<Item = (usize, Vec3)> {
    let suggestions = workspace.suggestions().listed.iter().enumerate();
    suggestions.filter_map(|(index, suggestion)| {
        let width = workspace.scene.frames.get(suggestion.frame)?.camera.width;
        let [x, y] = suggestion.pixel;
        let pixels = surface.surface.pixels.get(suggestion.frame)?;
        let node = pixels.node((y * width + x) as usize)?;
        Some((index, surface.surface.graph.nodes().get(node as usize)?.position))
    })
}

/// The suggestions as numbered markers.
pub fn suggestions(painter: &Painter, workspace: &Workspace, surface: &LabelledSurface, sight: &Sight) {
    for (index, place) in suggestion_places(workspace, surface) {
        if let Some((center, _)) = sight.project(place) {
            let current = workspace.suggestions().at() == Some(index);
            marker(painter, center, index, current, true);
        }
    }
}

/// A ring where a click waits for its answer.
pub fn ring(painter: &Painter, center: Pos2, color: Color32) {
    painter.circle_stroke(center, 7.0, Stroke::new(3.0, Color32::from_black_alpha(150)));
    painter.circle_stroke(center, 7.0, Stroke::new(1.5, color));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_capture_shows_some_of_its_cameras_and_always_the_one_in_view() {
        let all: Vec<usize> = drawn_frames(5, 2).collect();
        assert_eq!(all, [0, 1, 3, 4, 2]);
        let some: Vec<usize> = drawn_frames(1000, 501).collect();
        assert!(some.len() <= CAMERAS + 1 && some.contains(&501));
        assert_eq!(drawn_frames(0, 0).count(), 0);
    }
}
