//! Line charts.

use super::axis::{Range, is_drawable, number, tick_texts};
use super::panel::{FOOT, HEAD};
use super::svg::{COLORS, Svg, shortened, text_width};
use super::{Axis, Point, Series};

/// Size of the text and room between the names of lines, in pixels.
const LABEL: f64 = 11.5;
const NAME_HEIGHT: f64 = 15.0;
/// Size of markers, in pixels from the middle.
const MARKER: f64 = 3.6;
const RING: f64 = 8.0;

/// Draws the lines in a panel; `false` when there is nothing to draw.
pub(super) fn draw(
    out: &mut Svg,
    (across, up): (&Axis, &Axis),
    series: &[Series],
    (x, y): (f64, f64),
    (width, height): (f64, f64),
) -> bool {
    let drawable = |point: &Point| is_drawable(across.scale, point.x) && is_drawable(up.scale, point.y);
    let points = || {
        series
            .iter()
            .flat_map(|own| &own.points)
            .filter(|point| drawable(point))
    };
    let (top, bottom) = (y + HEAD, y + height - FOOT);
    let in_bands = points().flat_map(|point| [point.y, point.range.0, point.range.1]);
    let values = in_bands.chain(up.mark.iter().map(|(at, _)| *at));
    let Some(vertical) = Range::of(up.scale, values, bottom - top, 38.0) else {
        return false;
    };
    let texts = tick_texts(&vertical.ticks);
    let left = texts
        .iter()
        .map(|text| text_width(text, 11.0))
        .fold(0.0, f64::max)
        + 8.0;
    let widest = series
        .iter()
        .map(|own| text_width(&own.name, LABEL))
        .fold(0.0, f64::max);
    let right = (widest + 16.0).min(0.4 * width);
    let length = width - left - right;
    let Some(horizontal) = Range::of(across.scale, points().map(|point| point.x), length, 46.0) else {
        return false;
    };
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
    if let Some((at, name)) = up.mark.as_ref().filter(|(at, _)| is_drawable(up.scale, *at)) {
        let at = place_y(*at);
        out.line("mark", (x + left, at), (x + left + length, at));
        // Beside the label of the axis the name would crowd: then it goes below the line.
        let above = if at - top < 14.0 { 14.0 } else { -5.0 };
        out.text("tick", x + left + 4.0, at + above, name);
    }

    // Not a number breaks a line: nothing is claimed about what is between.
    let runs = |own: &Series| -> Vec<Vec<Point>> {
        let runs = own.points.split(|point| !drawable(point));
        runs.filter(|run| !run.is_empty())
            .map(<[Point]>::to_vec)
            .collect()
    };
    for (index, own) in series.iter().enumerate() {
        for run in runs(own) {
            if run.len() > 1 && run.iter().any(|point| point.range.0 < point.range.1) {
                let edge = |point: &Point, end: f64| {
                    let end = if is_drawable(up.scale, end) { end } else { point.y };
                    (place_x(point.x), place_y(end))
                };
                let upper = run.iter().map(|point| edge(point, point.range.1));
                let lower = run.iter().rev().map(|point| edge(point, point.range.0));
                let outline: Vec<(f64, f64)> = upper.chain(lower).collect();
                out.polygon(&format!("band f{}", index % COLORS), &outline, "");
            }
        }
    }
    let mut names = Vec::new();
    for (index, own) in series.iter().enumerate() {
        for run in runs(own) {
            let line: Vec<(f64, f64)> = run.iter().map(|p| (place_x(p.x), place_y(p.y))).collect();
            if line.len() > 1 {
                out.polyline(&format!("line l{}", index % COLORS), &line);
            }
            for (point, &at) in run.iter().zip(&line) {
                if point.ring {
                    out.circle(&format!("ring l{}", index % COLORS), at, RING, "");
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
        out.text(&format!("label f{}", index % COLORS), edge + 6.0, at + 4.0, &name);
    }
    true
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
    let class = format!("point f{}", index % COLORS);
    let corners = |offsets: &[(f64, f64)]| -> Vec<(f64, f64)> {
        let corner = |&(dx, dy): &(f64, f64)| (x + MARKER * dx, y + MARKER * dy);
        offsets.iter().map(corner).collect()
    };
    match index % 4 {
        0 => out.circle(&class, (x, y), MARKER, hint),
        1 => out.polygon(
            &class,
            &corners(&[(-0.95, -0.95), (0.95, -0.95), (0.95, 0.95), (-0.95, 0.95)]),
            hint,
        ),
        2 => out.polygon(&class, &corners(&[(0.0, -1.3), (1.2, 0.85), (-1.2, 0.85)]), hint),
        _ => out.polygon(
            &class,
            &corners(&[(0.0, -1.35), (1.35, 0.0), (0.0, 1.35), (-1.35, 0.0)]),
            hint,
        ),
    }
}

/// Places near the wanted ones, in the same order from the top, at least `gap` apart and between
/// `limits` where all fit.
pub(super) fn apart(wanted: &[f64], gap: f64, (top, bottom): (f64, f64)) -> Vec<f64> {
    let mut order: Vec<usize> = (0..wanted.len()).collect();
    order.sort_by(|&a, &b| wanted[a].total_cmp(&wanted[b]));
    // Blocks of touching names (members, middle of the wanted places); overlapping blocks merge.
    let mut blocks: Vec<(Vec<usize>, f64)> = Vec::new();
    for index in order {
        let mut block = (vec![index], wanted[index]);
        while let Some((members, middle)) = blocks.pop() {
            let reach = 0.5 * gap * (members.len() + block.0.len()) as f64;
            if block.1 - middle >= reach {
                blocks.push((members, middle));
                break;
            }
            let count = (members.len(), block.0.len());
            let sum = middle * count.0 as f64 + block.1 * count.1 as f64;
            let mut merged = members;
            merged.append(&mut block.0);
            let half = 0.5 * gap * (merged.len() - 1) as f64;
            let center = (sum / (count.0 + count.1) as f64)
                .min(bottom - half)
                .max(top + half);
            block = (merged, center);
        }
        blocks.push(block);
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
