//! The strip under the canvas: what is known of the pixel under the pointer.

use egui::{Rect, Role, Sense, Ui, WidgetInfo, pos2, vec2};
use inplace_core::labels::{ClassId, Pixel, VOID};
use inplace_core::session::PixelAnswer;
use inplace_model::palette::VOID_COLOR;
use inplace_model::workspace::Workspace;

use crate::canvas::{FrameView, object_words};
use crate::numbers;
use crate::theme;
use crate::widgets::{line_of_text, swatch};

/// Name of the strip for screen readers while nothing is pointed at.
const POINT: &str = "Point at the image to read its pixels";

/// Height of the strip in points.
pub const HEIGHT: f32 = 26.0;

/// Widths of the cells in points where there is room: pixel, class, runner-up, entropy, depth.
const WIDTHS: [f32; 5] = [96.0, 200.0, 144.0, 112.0, 104.0];
/// Cells that share what room is left, or missing.
const FLEXIBLE: [bool; 5] = [false, true, true, false, false];
const NARROWEST: f32 = 72.0;
/// Room that what a click would win needs to be shown behind the cells.
const WINS_WIDTH: f32 = 80.0;

/// What is known of a pixel.
#[derive(Clone, Debug, PartialEq)]
struct Reading {
    pixel: Pixel,
    class: Option<Named>,
    runner_up: Option<Named>,
    /// What the project that is compared with says there, while that is shown: its name, and the class.
    other: Option<(String, Named)>,
    /// Entropy, as a share of that of an even guess among all classes.
    unsure: Option<f32>,
    /// In metres, and whether it is measured.
    depth: Option<(f32, bool)>,
    /// What a click there would win, as a share of the frame.
    wins: Option<f32>,
}

/// A class with its probability, 0..=1, where that is known.
#[derive(Clone, Debug, PartialEq)]
struct Named {
    name: String,
    color: [u8; 3],
    probability: Option<f32>,
}

/// Draws the strip; its cells stay where they are, whatever is in them.
pub fn show(ui: &mut Ui, workspace: &Workspace, frame: Option<&FrameView>, pixel: Option<Pixel>) {
    let (rect, response) = ui.allocate_exact_size(ui.available_size(), Sense::hover());
    let visuals = ui.visuals();
    let (weak, text) = (visuals.weak_text_color(), visuals.text_color());
    let line = egui::Stroke::new(1.0, theme::of(visuals).line);
    ui.painter().hline(rect.x_range(), rect.top() + 0.5, line);
    let inside = rect.shrink2(vec2(12.0, 0.0));
    let reading = frame
        .zip(pixel)
        .map(|(frame, pixel)| Reading::of(workspace, frame, pixel));
    let words = reading.as_ref().map(Reading::words);
    response.widget_info(|| WidgetInfo::labeled(Role::Status, true, words.as_deref().unwrap_or(POINT)));
    let Some(reading) = reading else {
        line_of_text(ui, inside, POINT, 12.0, weak);
        return;
    };
    let cells = cells(inside);
    let rest = inside.with_min_x(cells[WIDTHS.len() - 1].right() + theme::GAP);
    if let Some(words) = reading.wins().filter(|_| rest.width() >= WINS_WIDTH) {
        line_of_text(ui, rest, &words, 12.0, weak);
    }
    for (index, cell) in cells.into_iter().enumerate() {
        let class = match index {
            1 => reading.class.as_ref(),
            2 => {
                let other = reading.other.as_ref().map(|(_, class)| class);
                other.or(reading.runner_up.as_ref())
            }
            _ => None,
        };
        let mut place = cell;
        if let Some(class) = class {
            let center = pos2(cell.left() + 6.0, cell.center().y);
            let side = if index == 1 { 12.0 } else { 8.0 };
            swatch(ui.painter(), center, class.color, side);
            place.min.x += 18.0;
        }
        let color = if index == 1 { text } else { weak };
        if let Some(words) = &reading.cell(index)
            && place.width() > 0.0
        {
            line_of_text(ui, place, words, 12.0, color);
        }
    }
}

/// Where the cells are: the fixed ones as wide as they have to be, the others sharing the rest; those that find
/// no room are empty.
fn cells(inside: Rect) -> [Rect; 5] {
    let wanted: f32 = WIDTHS.iter().sum();
    let flexible = FLEXIBLE.iter().filter(|&&flexible| flexible).count() as f32;
    let more = (inside.width() - wanted).min(0.0) / flexible;
    let mut left = inside.left();
    std::array::from_fn(|index| {
        let width = if FLEXIBLE[index] {
            (WIDTHS[index] + more).max(NARROWEST)
        } else {
            WIDTHS[index]
        };
        let cell = Rect::from_x_y_ranges(left..=left + width - theme::GAP, inside.y_range());
        left += width;
        if cell.right() > inside.right() + 0.5 {
            Rect::from_min_size(cell.min, vec2(0.0, cell.height()))
        } else {
            cell
        }
    })
}

impl Reading {
    fn of(workspace: &Workspace, frame: &FrameView, pixel: Pixel) -> Self {
        let most = workspace.document.palette().most_entropy();
        let answer = frame.map().and_then(|shown| shown.map.at(pixel));
        let seen = frame.objects().and_then(|objects| objects.at(pixel));
        let named = |id: ClassId, probability| {
            let class = workspace.document.labels().class(id)?;
            let object = seen.filter(|seen| seen.class == id);
            let object = object.and_then(|seen| seen.object.as_ref());
            Some(Named {
                name: object.map_or_else(|| class.name.clone(), |object| object_words(&class.name, object)),
                color: class.color,
                probability,
            })
        };
        let void = || Named {
            name: "no class".to_owned(),
            color: VOID_COLOR,
            probability: None,
        };
        // Certain is what was said, not what is likely beyond the steps in which it is kept.
        let likely = |answer: PixelAnswer| {
            let probability = answer.probability?;
            Some(answer.runner_up.map_or(probability, |_| probability.min(0.99)))
        };
        Self {
            pixel,
            class: answer.and_then(|answer| match answer.class {
                VOID => Some(void()),
                class => named(class, likely(answer)),
            }),
            runner_up: answer.and_then(|answer| named(answer.runner_up?, None)),
            other: workspace.comparison.as_ref().and_then(|comparison| {
                let other = &comparison.other;
                let class = match other.class(frame.differences()?.other_at(pixel)?) {
                    Some(class) => Named {
                        name: class.name.clone(),
                        color: class.color,
                        probability: None,
                    },
                    None => void(),
                };
                Some((other.name.clone(), class))
            }),
            unsure: answer
                .filter(|answer| answer.class != VOID)
                .map(|answer| answer.entropy / most),
            depth: frame.depth_at(pixel),
            wins: workspace
                .hover
                .shown
                .as_ref()
                .zip(workspace.frame())
                .map(|(preview, frame)| preview.pixels() as f32 / frame.camera.pixels() as f32),
        }
    }

    /// The words of a cell.
    fn cell(&self, index: usize) -> Option<String> {
        match index {
            0 => Some(format!("{}, {}", self.pixel[0], self.pixel[1])),
            1 => self.class.as_ref().map(Named::words),
            // Both cannot stand there, and whoever compares wants to know this.
            2 => match &self.other {
                Some((project, class)) => Some(format!("{project}: {}", class.name)),
                None => self.runner_up.as_ref().map(|class| format!("or {}", class.name)),
            },
            3 => self.unsure.map(|unsure| numbers::unsure(unsure, 1.0)),
            _ => self.depth.map(|(depth, measured)| match measured {
                true => numbers::metres(depth),
                false => format!("about {}", numbers::metres(depth)),
            }),
        }
    }

    fn words(&self) -> String {
        let cells = (0..WIDTHS.len()).filter_map(|index| self.cell(index));
        let wins = self.wins().map(|wins| format!("a click {wins}"));
        let all: Vec<String> = cells.chain(wins).collect();
        all.join("; ")
    }

    /// What a click there would win, in words.
    fn wins(&self) -> Option<String> {
        let share = numbers::share(self.wins?);
        Some(format!("wins {share}"))
    }
}

impl Named {
    fn words(&self) -> String {
        // The number first: a long name is cut at its end.
        match self.probability {
            Some(probability) => format!("{} {}", numbers::probability(probability), self.name),
            None => self.name.clone(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_is_read_out_in_words() {
        let named = |name: &str, probability| Named {
            name: name.to_owned(),
            color: [0; 3],
            probability,
        };
        let mut reading = Reading {
            pixel: [12, 30],
            class: Some(named("wall", Some(0.874))),
            runner_up: Some(named("floor", None)),
            other: None,
            unsure: Some(0.312),
            depth: Some((2.306, true)),
            wins: None,
        };
        assert_eq!(reading.words(), "12, 30; 87% wall; or floor; 31% unsure; 2.31 m");
        reading.class = Some(named("wall", Some(1.0)));
        reading.runner_up = None;
        reading.depth = Some((2.306, false));
        reading.wins = Some(0.12);
        assert_eq!(
            reading.words(),
            "12, 30; 100% wall; 31% unsure; about 2.31 m; a click wins 12%"
        );
        reading.class = Some(named("wall", Some(0.999)));
        assert!(reading.words().contains("99% wall"));
        reading.runner_up = Some(named("floor", None));
        reading.other = Some(("anna".to_owned(), named("rug", None)));
        assert!(reading.words().contains("99% wall; anna: rug; 31% unsure"));
    }

    #[test]
    fn cells_stay_in_the_strip_and_do_not_overlap() {
        for width in [300.0, 480.0, 656.0, 2000.0] {
            let strip = Rect::from_min_size(pos2(10.0, 0.0), vec2(width, 26.0));
            let cells = cells(strip);
            for pair in cells.windows(2) {
                assert!(pair[0].right() <= pair[1].left() + 0.01);
            }
            for cell in &cells {
                assert!(cell.width() == 0.0 || cell.right() <= strip.right() + 0.5);
            }
            assert!(cells[1].width() >= 60.0);
        }
    }
}
