//! Layout and drawing of a panel.

use super::axis::{Range, is_drawable, number, tick_texts};
use super::svg::{Svg, class, shortened, widest};
use super::{Panel, Point};

/// Width of a panel in the fullest row, and height of all, in pixels.
pub(super) const WIDTH: f64 = 440.0;
pub(super) const HEIGHT: f64 = 300.0;
/// Where the plot begins, below title and axis label, and what is kept below it.
const HEAD: f64 = 48.0;
const FOOT: f64 = 40.0;
/// Size of the text and room between the names of lines, in pixels.
const LABEL: f64 = 11.5;
const NAME_HEIGHT: f64 = 15.0;
/// Size of markers, in pixels from the middle.
const MARKER: f64 = 3.6;
const RING: f64 = 8.0;

/// Draws a panel at a place.
pub(super) fn draw(out: &mut Svg, panel: &Panel, (x, y): (f64, f64), width: f64) {
    out.text("head", x, y + 12.0, &panel.title);
    if lines(out, panel, (x, y), width).is_none() {
        out.text("muted middle", x + width / 2.0, y + HEIGHT / 2.0, "no data");
    }
}

/// Draws the lines of a panel; `None` when there is nothing to draw.
fn lines(out: &mut Svg, panel: &Panel, (x, y): (f64, f64), width: f64) -> Option<()> {
    let (across, up, series) = (&panel.x, &panel.y, &panel.series);
    let drawable = |point: &Point| is_drawable(across.scale, point.x) && is_drawable(up.scale, point.y);
    let all = || series.iter().flat_map(|own| &own.points);
    let points = || all().filter(|point| drawable(point));
    let (top, bottom) = (y + HEAD, y + HEIGHT - FOOT);
    let values = points().flat_map(|point| [point.y, point.range.0, point.range.1]);
    let vertical = Range::of(up.scale, values, bottom - top, 38.0)?;
    let texts = tick_texts(&vertical.ticks);
    let left = widest(&texts, 11.0) + 8.0;
    let names = series.iter().map(|own| &own.name);
    let right = (widest(names, LABEL) + 16.0).min(0.4 * width);
    let length = width - left - right;
    let horizontal = Range::of(across.scale, points().map(|point| point.x), length, 46.0)?;
    let place_x = |value: f64| x + left + length * horizontal.place(value);
    let place_y = |value: f64| bottom - (bottom - top) * vertical.place(value);

    out.text("muted label", x, y + 32.0, &up.label);
    for (&tick, text) in vertical.ticks.iter().zip(&texts) {
        let at = place_y(tick);
        out.line("grid", (x + left, at), (x + left + length, at));
        out.text("tick end", x + left - 6.0, at + 4.0, text);
    }
    for (&tick, text) in horizontal.ticks.iter().zip(tick_texts(&horizontal.ticks)) {
        let at = place_x(tick);
        out.line("axis", (at, bottom), (at, bottom + 4.0));
        out.text("tick middle", at, bottom + 17.0, &text);
    }
    out.line("axis", (x + left, bottom), (x + left + length, bottom));
    out.text("muted label end", x + left + length, bottom + 34.0, &across.label);

    // Not a number breaks a line: nothing is claimed about what is between.
    for (index, own) in series.iter().enumerate() {
        for run in own.points.split(|point| !drawable(point)) {
            if run.len() > 1 && run.iter().any(|point| point.range.0 < point.range.1) {
                let edge = |point: &Point, end: f64| {
                    let end = if is_drawable(up.scale, end) { end } else { point.y };
                    (place_x(point.x), place_y(end))
                };
                let upper = run.iter().map(|point| edge(point, point.range.1));
                let lower = run.iter().rev().map(|point| edge(point, point.range.0));
                let outline: Vec<(f64, f64)> = upper.chain(lower).collect();
                out.through("polygon", &class("band f", index), &outline, "");
            }
        }
    }
    let mut names = Vec::new();
    for (index, own) in series.iter().enumerate() {
        for run in own.points.split(|point| !drawable(point)) {
            let line: Vec<(f64, f64)> = run.iter().map(|p| (place_x(p.x), place_y(p.y))).collect();
            if line.len() > 1 {
                out.through("polyline", &class("line l", index), &line, "");
            }
            for (point, &at) in run.iter().zip(&line) {
                if point.ring {
                    out.circle(&class("ring l", index), at, RING, "");
                }
                marker(out, index, at, &hint(&own.name, point));
            }
        }
        if let Some(last) = own.points.iter().rev().find(|point| drawable(point)) {
            names.push((index, (place_x(last.x), place_y(last.y))));
        }
    }
    let wanted: Vec<f64> = names.iter().map(|(_, (_, at))| *at).collect();
    let places = apart(&wanted, NAME_HEIGHT, (top, bottom));
    let edge = x + left + length;
    for ((index, (from_x, from_y)), at) in names.into_iter().zip(places) {
        if edge - from_x > 40.0 || (at - from_y).abs() > 3.0 {
            out.line("leader", (from_x + MARKER + 2.0, from_y), (edge + 3.0, at));
        }
        let name = shortened(&series[index].name, LABEL, right - 8.0);
        out.text(&class("label f", index), edge + 6.0, at + 4.0, &name);
    }
    Some(())
}

fn hint(name: &str, point: &Point) -> String {
    let (low, high) = point.range;
    let spread = if low < high {
        format!(" ({} to {})", number(low), number(high))
    } else {
        String::new()
    };
    format!("{name}: {} at {}{spread}", number(point.y), number(point.x))
}

/// A shape for each line, so that colour is not all that tells them apart.
fn marker(out: &mut Svg, index: usize, (x, y): (f64, f64), hint: &str) {
    let corners: &[(f64, f64)] = match index % 4 {
        0 => return out.circle(&class("point f", index), (x, y), MARKER, hint),
        1 => &[(-0.95, -0.95), (0.95, -0.95), (0.95, 0.95), (-0.95, 0.95)],
        2 => &[(0.0, -1.3), (1.2, 0.85), (-1.2, 0.85)],
        _ => &[(0.0, -1.35), (1.35, 0.0), (0.0, 1.35), (-1.35, 0.0)],
    };
    let corner = |(dx, dy): &(f64, f64)| (x + MARKER * dx, y + MARKER * dy);
    let corners: Vec<(f64, f64)> = corners.iter().map(corner).collect();
    out.through("polygon", &class("point f", index), &corners, hint);
}

/// Places near the wanted ones, in the same order from the top, at least `gap` apart and between
/// `limits` where all fit.
pub(super) fn apart(wanted: &[f64], gap: f64, (top, bottom): (f64, f64)) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|&a, &b| wanted[a].total_cmp(&wanted[b]));
    // Blocks of touching names (members, middle of the wanted places); overlapping blocks merge.
    let mut blocks: Vec<(Vec<usize>, f64)> = Vec::new();
    for index in order {
        let (mut block, mut middle) = (vec![index], wanted[index]);
        while let Some((mut above, its_middle)) = blocks.pop() {
            let (count, more) = (above.len() as f64, block.len() as f64);
            if middle - its_middle >= 0.5 * gap * (count + more) {
                blocks.push((above, its_middle));
                break;
            }
            above.append(&mut block);
            block = above;
            let half = 0.5 * gap * (count + more - 1.0);
            middle = (its_middle * count + middle * more) / (count + more);
            middle = middle.min(bottom - half).max(top + half);
        }
        blocks.push((block, middle));
    }
    let mut places = vec![0.0; wanted.len()];
    for (members, middle) in blocks {
        let first = middle - 0.5 * gap * (members.len() as f64 - 1.0);
        for (rank, index) in members.into_iter().enumerate() {
            places[index] = first + gap * rank as f64;
        }
    }
    places
}
