//! How far the labelling has come: whether it is good enough, what contradicts itself, and charts.

use egui::{Align, Label, Layout, RichText, ScrollArea, Ui};
use egui_plot::{AxisHints, GridInput, GridMark, HoverPosition, Line, Plot, PlotPoint, PlotPoints, VLine};
use inplace_core::labels::{ClassId, StrokeId};
use inplace_model::text::counted;
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use super::audit::AuditPart;
use super::charted::{Axis, Charted, NUMBERS, Number};
use super::comparison;
use super::parts::{UNCERTAINTY_MEANS, card, facts, frames_done, pressed_in_list};
use super::readiness::{Readiness, readiness};
use crate::numbers;
use crate::theme;
use crate::widgets::{heading, weak_text};

/// What the agreement of strokes means.
const AGREEMENT_MEANS: &str = "Each stroke is left out once, and the others say what is there: the share of strokes that get their own class so, averaged over the classes. It shows contradictions, not how right the maps are";

/// What a contradicted stroke is.
const CONTRADICTED_MEANS: &str = "Without such a stroke, the others would give most of its pixels another class: one of them may be wrong, or there are too few strokes around it";

/// Suggestions of which it is summed up what they settle.
const NEXT: usize = 5;
/// Height of a chart, without the names of its axis.
const CHART: f32 = 76.0;
/// Room for the numbers beside a chart, so that all begin at the same place.
const NUMBERS_WIDTH: f32 = 40.0;

/// The panel with what its charts show.
#[derive(Default)]
pub struct ProgressPanel {
    axis: Axis,
    charted: Charted,
    audit: AuditPart,
}

impl ProgressPanel {
    pub fn show(&mut self, ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
        ScrollArea::vertical().auto_shrink([false, false]).show(ui, |ui| {
            answer(ui, workspace);
            numbers(ui, workspace);
            contradicted(ui, workspace, commands);
            ui.add_space(theme::GAP);
            comparison::show(ui, workspace, commands);
            self.audit.show(ui, workspace, commands);
            ui.add_space(theme::GAP);
            self.charts(ui, workspace);
        });
    }

    fn charts(&mut self, ui: &mut Ui, workspace: &Workspace) {
        let log = &workspace.overview.log;
        if log.samples.is_empty() {
            weak_text(
                ui,
                "Charts of uncertainty, agreement and image quality begin with your first stroke.",
            );
            return;
        }
        ui.horizontal(|ui| {
            ui.spacing_mut().item_spacing.x = 4.0;
            ui.label("Charts over");
            for axis in [Axis::Time, Axis::Strokes] {
                let name = match axis {
                    Axis::Time => "time",
                    Axis::Strokes => "strokes",
                };
                if ui.selectable_label(self.axis == axis, name).clicked() {
                    self.axis = axis;
                }
            }
        });
        let most = workspace.document.palette().most_entropy();
        self.charted.follow(log, self.axis, most);
        let shown: Vec<Number> = NUMBERS
            .into_iter()
            .filter(|&number| !self.charted.line(number).is_empty())
            .collect();
        for &number in &shown {
            self.chart(ui, number, shown.last() == Some(&number));
        }
        let axis = match self.axis {
            Axis::Time => "Across: minutes open.",
            Axis::Strokes => "Across: strokes.",
        };
        let marks = (!self.charted.marks.is_empty()).then_some("Upright lines: strokes were made.");
        let meaning: Vec<&str> = [axis].into_iter().chain(marks).collect();
        let meaning = RichText::new(meaning.join(" ")).weak().size(12.0);
        ui.add(Label::new(meaning).wrap());
    }

    /// The chart of a number; the last one has the numbers of the horizontal axis.
    fn chart(&self, ui: &mut Ui, number: Number, last: bool) {
        let points = self.charted.line(number);
        let (name, meaning) = named(number);
        ui.horizontal(|ui| {
            ui.label(RichText::new(name).size(13.0)).on_hover_text(meaning);
            ui.with_layout(Layout::right_to_left(Align::Center), |ui| {
                let newest = points.last().map(|point| in_unit(number, point.y));
                ui.label(RichText::new(newest.unwrap_or_default()).strong());
            });
        });
        let axis = self.axis;
        let hovered = move |position: &HoverPosition<'_>| {
            let HoverPosition::NearDataPoint { position, .. } = position else {
                return None;
            };
            let x = match axis {
                Axis::Time => format!("{:.1} min", position.x),
                Axis::Strokes => counted(position.x.round() as usize, "stroke", "strokes"),
            };
            Some(format!("{x}: {}", in_unit(number, position.y)))
        };
        // Close enough for a chart of this height.
        let upright = AxisHints::new_y()
            .formatter(move |mark, _| ticked(number, mark.value))
            .min_thickness(NUMBERS_WIDTH)
            .label_spacing(12.0..=16.0);
        let across = AxisHints::new_x().formatter(|mark, _| round(mark.value));
        let mut plot = Plot::new(("progress", name))
            .height(CHART + if last { 20.0 } else { 0.0 })
            .show_axes([last, true])
            // Upright lines are strokes.
            .show_grid([false, true])
            .custom_x_axes(vec![across.label_spacing(20.0..=32.0)])
            .custom_y_axes(vec![upright])
            .x_grid_spacer(|input| marks(input, 4.0))
            .y_grid_spacer(|input| marks(input, 2.5))
            .label_formatter(hovered)
            .set_margin_fraction(egui::vec2(0.02, 0.12))
            .grid_spacing(egui::Rangef::new(8.0, 16.0))
            .allow_drag(false)
            .allow_zoom(false)
            .allow_scroll(false)
            .allow_boxed_zoom(false)
            .allow_axis_zoom_drag(false)
            .allow_double_click_reset(false)
            .show_crosshair(false);
        let range = self.charted.range();
        plot = plot.include_x(*range.start()).include_x(*range.end());
        if number == Number::Accuracy {
            plot = plot.include_y(0.0).include_y(1.0);
        } else if number == Number::Unsure {
            plot = plot.include_y(0.0);
        }
        let (color, mark) = (
            theme::of(ui.visuals()).accent,
            ui.visuals().weak_text_color().gamma_multiply(0.35),
        );
        plot.show(ui, |plot| {
            for (index, &x) in self.charted.marks.iter().enumerate() {
                let line = VLine::new("", x).color(mark).width(1.0);
                plot.vline(line.id(("mark", index)).allow_hover(false));
            }
            let line = Line::new(name, PlotPoints::Borrowed(points));
            plot.line(line.color(color).width(1.8));
            if let [only] = points {
                let only = PlotPoints::Owned(vec![PlotPoint::new(only.x, only.y)]);
                plot.points(egui_plot::Points::new(name, only).color(color).radius(3.0));
            }
        });
    }
}

/// Whether the labels are good enough, and what the next ones would settle.
fn answer(ui: &mut Ui, workspace: &Workspace) {
    let (answer, sentence) = readiness(&workspace.overview.evidence);
    let color = match answer {
        Readiness::NotYet => ui.visuals().warn_fg_color,
        Readiness::Nearly => theme::of(ui.visuals()).accent,
        Readiness::Yes => theme::of(ui.visuals()).good,
    };
    let card = card(ui).show(ui, |ui| {
        ui.set_width(ui.available_width());
        ui.spacing_mut().item_spacing.y = 4.0;
        ui.label(RichText::new("Good enough to export?").strong());
        ui.add(Label::new(RichText::new(sentence).color(color)).wrap());
        let next = workspace.suggestions().listed.iter().take(NEXT);
        let shares: Vec<f32> = next.map(|suggestion| suggestion.share).collect();
        if let Some(settled) = next_labels(&shares) {
            ui.add(Label::new(settled).wrap());
        }
    });
    // A bar in the answer's colour along the card's edge.
    let edge = card.response.rect;
    let bar = egui::Rect::from_min_size(edge.min, egui::vec2(3.0, edge.height()));
    ui.painter().rect_filled(bar, 2, color);
}

fn numbers(ui: &mut Ui, workspace: &Workspace) {
    let (overview, document) = (&workspace.overview, &workspace.document);
    let evidence = &overview.evidence;
    let checked = (evidence.checked > 0).then(|| {
        let agreeing = evidence.checked.saturating_sub(evidence.contradicted);
        format!("{agreeing} of {} checked", evidence.checked)
    });
    let rows = [
        ("Strokes", Some(document.labels().strokes.len().to_string()), ""),
        (
            "Drawn on",
            Some(frames_done(
                document.labelled_frames(),
                workspace.scene.frames.len(),
            )),
            "Frames that have strokes; labels spread to all the others",
        ),
        (
            "Frames",
            Some(format!(
                "{} of {} checked",
                document.labels().checked.len(),
                workspace.scene.frames.len()
            )),
            "Frames that you have marked as checked",
        ),
        ("Agreeing strokes", checked, AGREEMENT_MEANS),
        (
            "Covered",
            overview.mean(|summary| summary.coverage).map(numbers::share),
            "Share of the pixels of all frames that have a class",
        ),
        (
            "Clear",
            overview.mean(|summary| 1.0 - summary.unclear).map(numbers::share),
            "Share of the pixels of all frames whose class is more likely right than wrong",
        ),
        (
            "Labelling time",
            Some(numbers::duration(overview.log.labelling.as_secs_f64())),
            "Time with something done at least once a minute; breaks do not count",
        ),
    ];
    facts(ui, "progress numbers", 104.0, rows);
}

/// The strokes that the others contradict; a click goes there.
fn contradicted(ui: &mut Ui, workspace: &Workspace, commands: &mut Commands) {
    let strokes = &workspace.overview.contradicted;
    if strokes.is_empty() {
        return;
    }
    heading(ui, "Contradicted strokes", |ui| {
        ui.weak(strokes.len().to_string());
    });
    let at = |place| strokes.iter().nth(place).map(|(&id, &others)| (id, others));
    let text = |place| at(place).and_then(|(id, others)| row(workspace, id, others));
    let pressed = pressed_in_list(ui, "contradicted", strokes.len(), CONTRADICTED_MEANS, text);
    commands.extend(pressed.and_then(at).map(|(id, _)| Command::GoToStroke(id)));
}

/// What is said of a contradicted stroke.
fn row(workspace: &Workspace, id: StrokeId, others: ClassId) -> Option<String> {
    let document = &workspace.document;
    let stroke = document.labels().strokes.get(&id)?;
    let frame = workspace.scene.frames.get(stroke.frame)?;
    let [class, others] = [stroke.class, others].map(|class| document.name_and_color(class).0);
    Some(format!("{class} at {}: the others say {others}", frame.stem))
}

fn named(number: Number) -> (&'static str, &'static str) {
    match number {
        Number::Unsure => ("Uncertainty", UNCERTAINTY_MEANS),
        Number::Accuracy => ("Agreement of strokes", AGREEMENT_MEANS),
        Number::Psnr => (
            "Image quality",
            "How well the field predicts frames that it was not trained on (PSNR); more is better",
        ),
    }
}

fn in_unit(number: Number, value: f64) -> String {
    match number {
        Number::Unsure => numbers::unsure(value as f32, 1.0),
        Number::Accuracy => numbers::share(value as f32),
        Number::Psnr => numbers::decibels(value),
    }
}

fn ticked(number: Number, value: f64) -> String {
    match number {
        Number::Accuracy | Number::Unsure => format!("{:.0}%", 100.0 * value),
        Number::Psnr => round(value),
    }
}

/// Evenly spaced marks at round numbers, about so many over what is shown.
fn marks(input: GridInput, about: f64) -> Vec<GridMark> {
    let (low, high) = input.bounds;
    let step = round_step((high - low) / about);
    let first = (low / step).ceil();
    let marks = (0..64).map(|index| (first + f64::from(index)) * step);
    marks
        .take_while(|&value| value <= high)
        .map(|value| GridMark {
            value,
            step_size: step,
        })
        .collect()
}

/// The nearest of 1, 2, 5, 10, 20, ... and their fractions that is not smaller.
fn round_step(step: f64) -> f64 {
    let power = 10.0_f64.powf(step.max(1e-6).log10().floor());
    let of_ten = step / power;
    let digit = [1.0, 2.0, 5.0].into_iter().find(|&digit| of_ten <= digit + 1e-9);
    digit.unwrap_or(10.0) * power
}

/// With as many digits as it has, three at most.
fn round(value: f64) -> String {
    let text = format!("{value:.3}");
    text.trim_end_matches('0').trim_end_matches('.').to_owned()
}

/// What the next labels would settle; `None` when that is next to nothing.
fn next_labels(shares: &[f32]) -> Option<String> {
    let share: f32 = shares.iter().sum();
    let labels = match shares.len() {
        0 => return None,
        1 => "label".to_owned(),
        many => format!("{many} labels"),
    };
    (share >= 0.005).then(|| {
        let much = if share < 0.01 {
            "less than 1%".to_owned()
        } else {
            format!("about {}", numbers::share(share))
        };
        format!("The next {labels} would settle {much} of the scene.")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_are_round_and_few_without_needless_digits() {
        for (bounds, expected) in [
            ((-0.05, 0.92), vec![0.0, 0.5]),
            ((20.0, 31.0), vec![20.0, 25.0, 30.0]),
            ((-0.1, 1.1), vec![0.0, 0.5, 1.0]),
        ] {
            let input = GridInput {
                bounds,
                base_step_size: 1.0,
            };
            let values: Vec<f64> = marks(input, 2.5).iter().map(|mark| mark.value).collect();
            assert_eq!(values, expected);
        }
        assert_eq!([0.3, 7.0, 10.0].map(round_step), [0.5, 10.0, 10.0]);
        assert_eq!([0.5, 20.0, 1.0 / 3.0].map(round), ["0.5", "20", "0.333"]);
    }

    #[test]
    fn what_the_next_labels_settle_is_said_only_when_there_is_some() {
        for (shares, said) in [
            (&[0.05, 0.04, 0.03][..], Some("3 labels would settle about 12%")),
            (&[0.2], Some("label would settle about 20%")),
            (&[0.004, 0.003], Some("2 labels would settle less than 1%")),
            (&[0.001, 0.001], None),
            (&[], None),
        ] {
            let said = said.map(|said| format!("The next {said} of the scene."));
            assert_eq!(next_labels(shares), said);
        }
    }
}
