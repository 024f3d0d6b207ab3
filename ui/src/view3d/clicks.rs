//! Clicks on the 3D view, and objects under the pointer: what becomes of them when it is known what is met.

use std::sync::Arc;

use egui::{PointerButton, Pos2, Response, Ui};

use inplace_core::labels::{ClassId, Stroke};
use inplace_core::semantics::CERTAIN;
use inplace_model::space::OrbitCamera;
use inplace_model::workspace::{Chosen, Workspace};
use inplace_model::{Command, Commands};

use super::camera::Sight;
use super::cloud::Prepared;
use super::controls::Notice;
use super::overlay::Mark;
use super::pick::{Hit, Purpose, Question};
use super::{Click, View3d};
use crate::canvas::{SceneObjects, object_words};
use crate::numbers;

/// How far beside a splat a click may be, in points.
const SLACK: f32 = 3.0;
/// Seconds for which the pointer rests before it is told what lies under it.
const TOLD_AFTER: f32 = 0.12;

/// What the pointer rests on.
pub(super) struct Told {
    position: Pos2,
    /// The object or class with its probability; `None` until it is known, and where there is none.
    words: Option<String>,
}

impl View3d {
    /// A click on a mark goes there, one on the surface labels it, a double click turns around that place.
    pub(super) fn follow_clicks(
        &mut self,
        ui: &Ui,
        response: &Response,
        (workspace, prepared): (&Workspace, &Prepared),
        (camera, sight): (OrbitCamera, Sight),
        pointed: Option<Mark>,
    ) {
        let now = ui.input(|input| input.time);
        let patience = ui
            .ctx()
            .options(|options| options.input_options.max_double_click_delay);
        let slack = SLACK / sight.focal;
        let ask = |ray, slack, purpose| Question {
            scene: Arc::clone(&workspace.scene),
            cloud: Arc::clone(&prepared.cloud),
            ray,
            slack,
            see_through: workspace.space.see_through,
            purpose,
        };
        let free = response
            .hover_pos()
            .filter(|_| prepared.objects.is_some() && pointed.is_none() && !response.dragged());
        self.told = self.told.take().filter(|told| Some(told.position) == free);
        if let Some(position) = free.filter(|_| self.told.is_none()) {
            if ui.input(|input| input.pointer.is_still()) {
                self.picker.ask(ask(sight.ray(position), slack, Purpose::Tell));
                self.told = Some(Told {
                    position,
                    words: None,
                });
            } else {
                ui.ctx().request_repaint_after_secs(TOLD_AFTER);
            }
        }
        if let Some(words) = self.told.as_ref().and_then(|told| told.words.as_ref()) {
            response.clone().on_hover_text_at_pointer(words);
        }
        if let Some(position) = response.interact_pointer_pos() {
            if response.double_clicked_by(PointerButton::Primary) {
                self.click = None;
                self.picker.ask(ask(sight.ray(position), slack, Purpose::Pivot));
            } else if response.clicked_by(PointerButton::Primary) && !self.pinched {
                if let Some(mark) = pointed {
                    let (frame, pixel) = match mark {
                        Mark::Frame(frame) => (frame, None),
                        Mark::Suggestion(index) => {
                            let place = &workspace.suggestions().listed[index];
                            (place.frame, Some(place.pixel))
                        }
                    };
                    let then = Some((frame, pixel));
                    self.fly_to(frame, (workspace, prepared), camera, now, then);
                    ui.ctx().request_repaint();
                } else {
                    let purpose = Purpose::Label(workspace.chosen());
                    self.click = Some(Click {
                        position,
                        question: ask(sight.ray(position), slack, purpose),
                        due: now + patience,
                    });
                }
            }
        }
        if let Some(click) = self.click.take_if(|click| now >= click.due) {
            self.asked = Some(click.position);
            self.picker.ask(click.question);
        } else if let Some(click) = &self.click {
            let left = (click.due - now).max(0.0);
            ui.ctx().request_repaint_after_secs(left as f32);
        }
    }

    /// Does what the answers of the picker are for.
    pub(super) fn take_answers(
        &mut self,
        ui: &Ui,
        camera: &OrbitCamera,
        (workspace, prepared): (&Workspace, &Prepared),
        now: f64,
        commands: &mut Commands,
    ) {
        while let Some(picked) = self.picker.next() {
            match (picked.purpose, picked.hit) {
                (Purpose::Pivot, Some(hit)) => {
                    self.turn_to(ui, camera, hit.position, now);
                }
                (Purpose::Pivot, None) => {}
                (Purpose::Tell, hit) => {
                    let words = hit.zip(prepared.objects.as_ref());
                    let words = words.and_then(|(hit, objects)| told(workspace, objects, hit.node));
                    if let Some(told) = &mut self.told {
                        told.words = words;
                    }
                }
                (Purpose::Label(chosen), hit) if Arc::ptr_eq(&picked.scene, &workspace.scene) => {
                    self.asked = None;
                    self.label(hit, chosen, workspace, now, commands);
                }
                (Purpose::Label(_), _) => self.asked = None,
            }
        }
    }

    fn label(
        &mut self,
        hit: Option<Hit>,
        chosen: Chosen,
        workspace: &Workspace,
        now: f64,
        commands: &mut Commands,
    ) {
        let seen = hit.map(|hit| hit.seen);
        if let Some(Some((frame, pixel))) = seen {
            // Without a class the name of the first one is asked for; a lock's refusal is told elsewhere.
            let taken = |class: &ClassId| {
                let click = Stroke::click(frame, *class, pixel);
                workspace.lock_on(&click).is_none()
            };
            if let Some(class) = chosen.class.or(workspace.class).filter(taken) {
                let stem = workspace.scene.frames.get(frame).map(|frame| frame.stem.as_str());
                let said = chosen.object.as_ref().map(|said| &said.object);
                let (name, _) = workspace.document.name_and_color(class);
                let name = said
                    .filter(|said| said.class == class)
                    .map_or(name, |said| &said.name);
                let words = format!("{name}, on frame {}", stem.unwrap_or_default());
                self.notice = Some(Notice::new(words, Some((frame, pixel, class)), now));
            }
            commands.push(Command::LabelSeen(frame, pixel, chosen));
        } else {
            let words = if seen.is_some() {
                "No frame shows this place well enough to label it"
            } else {
                "There is no surface under the pointer"
            };
            self.notice = Some(Notice::new(words.to_owned(), None, now));
        }
    }
}

/// The object or class that a node shows, with its probability; `None` where it has no class.
fn told(workspace: &Workspace, objects: &SceneObjects, node: u32) -> Option<String> {
    let entry = objects.entries.of(objects.value(node))?;
    let (class, _) = workspace.document.name_and_color(entry.class);
    let name = match &entry.object {
        Some(object) => object_words(class, object),
        None => class.to_owned(),
    };
    let likely = objects.posterior.confidence.get(node as usize);
    let likely = likely.map(|&steps| numbers::probability(f32::from(steps) / f32::from(CERTAIN)));
    Some([likely.unwrap_or_default(), name].join(" "))
}
