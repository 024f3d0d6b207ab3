//! Layout of a panel, and bars.

use super::axis::{Range, number, tick_texts};
use super::lines;
use super::svg::{Svg, class, shortened, text_width, widest};
use super::{Chart, Panel, Scale};

/// Width of a panel in the fullest row, in pixels.
pub(super) const WIDTH: f64 = 440.0;
/// Height of a panel unless its bars need more.
const HEIGHT: f64 = 300.0;
/// Where the plot begins, below title and axis label, and what is kept below it.
pub(super) const HEAD: f64 = 48.0;
pub(super) const FOOT: f64 = 40.0;
/// Thickness of a bar, room between groups, and height of the legend.
const BAR: f64 = 17.0;
const GROUP_GAP: f64 = 10.0;
const LEGEND: f64 = 22.0;

/// Height that a panel needs.
pub(super) fn height(panel: &Panel) -> f64 {
    match &panel.chart {
        Chart::Lines { .. } => HEIGHT,
        Chart::Bars { groups, series, .. } => {
            let rows = groups.len() as f64 * (series.len() as f64 * BAR + GROUP_GAP);
            (HEAD + legend_height(series) + rows + FOOT).max(HEIGHT)
        }
    }
}

pub(super) fn draw(out: &mut Svg, panel: &Panel, (x, y): (f64, f64), size: (f64, f64)) {
    out.text("head", x, y + 12.0, &panel.title);
    let drawn = match &panel.chart {
        Chart::Lines {
            x: across,
            y: up,
            series,
        } => lines::draw(out, (across, up), series, (x, y), size),
        Chart::Bars {
            label,
            groups,
            series,
        } => bars(out, label, groups, series, (x, y), size),
    };
    if !drawn {
        out.text("muted middle", x + size.0 / 2.0, y + size.1 / 2.0, "no data");
    }
}

fn legend_height<T>(series: &[T]) -> f64 {
    if series.len() > 1 { LEGEND } else { 0.0 }
}

/// Draws bars; `false` when there is nothing to draw.
fn bars(
    out: &mut Svg,
    label: &str,
    groups: &[String],
    series: &[(String, Vec<f64>)],
    (x, y): (f64, f64),
    (width, height): (f64, f64),
) -> bool {
    const LABEL: f64 = 11.5;
    let values = series
        .iter()
        .flat_map(|(_, values)| values.iter().take(groups.len()));
    let finite: Vec<f64> = values.copied().filter(|value| value.is_finite()).collect();
    let numbers: Vec<String> = finite.iter().copied().map(number).collect();
    let left = (widest(groups, LABEL) + 10.0).min(0.45 * width);
    let length = width - left - widest(&numbers, LABEL) - 8.0;
    let Some(range) = Range::of(Scale::FromZero, finite, length, 64.0) else {
        return false;
    };
    let mut legend = x;
    if series.len() > 1 {
        for (index, (name, _)) in series.iter().enumerate() {
            out.rectangle(&class("f", index), (legend, y + 24.0), (11.0, 11.0), "");
            out.text("label", legend + 16.0, y + 34.0, name);
            legend += 16.0 + text_width(name, LABEL) + 16.0;
        }
    }
    let top = y + 26.0 + legend_height(series);
    let bottom = y + height - FOOT;
    let place = |value: f64| x + left + length * range.place(value);
    for (&tick, text) in range.ticks.iter().zip(tick_texts(&range.ticks)) {
        out.line("grid", (place(tick), top), (place(tick), bottom));
        out.text("tick middle", place(tick), bottom + 16.0, &text);
    }
    out.text("muted label end", x + left + length, bottom + 33.0, label);
    let group_height = (bottom - top) / groups.len() as f64;
    let thickness = ((group_height - GROUP_GAP) / series.len() as f64).clamp(4.0, 24.0);
    for (row, group) in groups.iter().enumerate() {
        let middle = top + (row as f64 + 0.5) * group_height;
        let short = shortened(group, LABEL, left - 10.0);
        out.text("label end", x + left - 8.0, middle + 4.0, &short);
        for (index, (name, values)) in series.iter().enumerate() {
            let Some(&bar) = values.get(row).filter(|bar| bar.is_finite()) else {
                continue;
            };
            let from = middle + (index as f64 - 0.5 * series.len() as f64) * thickness;
            let (start, end) = (place(bar.min(0.0)), place(bar.max(0.0)));
            let text = number(bar);
            let hint = format!("{group}, {name}: {text}");
            let size = ((end - start).max(1.0), thickness - 2.0);
            out.rectangle(&class("f", index), (start, from + 1.0), size, &hint);
            out.text("label", end + 5.0, from + 0.5 * thickness + 4.0, &text);
        }
    }
    out.line("axis", (place(0.0), top), (place(0.0), bottom));
    true
}
