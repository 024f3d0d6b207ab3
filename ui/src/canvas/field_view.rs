//! The field as seen from one place: asked for again while it learns, and made ready for the renderer on a thread of its
//! own.

use std::sync::Arc;
use std::time::{Duration, Instant};

use inplace_core::scene::{ColorImage, Viewpoint};
use inplace_core::session::RenderedView;
use inplace_model::layer::Layer;
use inplace_model::palette::Palette;
use inplace_model::versioned::{Version, Versioned};
use inplace_model::workspace::Workspace;
use inplace_model::{Command, Commands};

use super::content::{Content, Picture};
use super::plane::{DepthPlane, Over, Texels};
use crate::background::{Background, Desk, Gone};

/// How old a view of the field becomes at least before it is rendered again; one that took longer becomes as old
/// as that, so that training has half of the time.
const VIEW_EVERY: Duration = Duration::from_secs(2);

/// A view of the field at the size of the image that its camera takes.
#[derive(Clone, Debug)]
pub struct FieldView {
    /// As it was rendered.
    pub rendered: Arc<RenderedView>,
    /// Its depths.
    pub depth: Versioned<DepthPlane>,
    picture: Arc<Picture>,
    /// Of its classes and entropies as what lies over its colours.
    versions: [Version; 2],
}

impl FieldView {
    /// Makes a view ready; `None` of one without pixels.
    fn new(rendered: Arc<RenderedView>) -> Option<Self> {
        let color = enlarged(&rendered)?;
        Some(Self {
            picture: Arc::new(Picture::new(Arc::new(color))),
            depth: Versioned::new(DepthPlane::rendered(&rendered)),
            versions: [Version::new(), Version::new()],
            rendered,
        })
    }

    /// Whether it has what a layer shows of the field: classes come later than the rest.
    pub fn shows(&self, layer: Layer) -> bool {
        let needs_labels = matches!(layer, Layer::RenderedLabels | Layer::RenderedEntropy);
        !needs_labels || self.rendered.labels.is_some()
    }

    /// What a layer of the field looks like; its colours alone where it has not more yet.
    pub fn content(&self, layer: Layer, palette: &Versioned<Arc<Palette>>) -> Content {
        let labels = self.rendered.labels.as_ref();
        let size = [self.rendered.color.width(), self.rendered.color.height()];
        let [classes, entropy] = self.versions;
        let over = match layer {
            Layer::RenderedLabels => labels.map(|labels| {
                let texels = Texels::Made(Arc::clone(&labels.classes));
                Over::classes(size, texels, classes)
            }),
            Layer::RenderedEntropy => labels.map(|labels| {
                let texels = Texels::Made(Arc::clone(&labels.entropy));
                Over::entropy(size, texels, entropy, palette)
            }),
            Layer::RenderedDepth => Some(Over::depth(&self.depth)),
            _ => None,
        };
        Content {
            picture: Some(Arc::clone(&self.picture)),
            over,
            map: None,
            palette: palette.clone(),
        }
    }
}

/// The colours of a view at the size of its camera's image, nearest-neighbour.
fn enlarged(view: &RenderedView) -> Option<ColorImage> {
    let camera = &view.viewpoint.camera;
    let mut rgb = Vec::with_capacity(3 * camera.pixels());
    for y in 0..camera.height {
        let row = (y / view.stride).min(view.color.height().saturating_sub(1)) * view.color.width();
        for x in 0..camera.width {
            let column = (x / view.stride).min(view.color.width().saturating_sub(1));
            rgb.extend(view.color.pixel((row + column) as usize));
        }
    }
    ColorImage::new(camera.width, camera.height, rgb)
}

/// What is shown of the field from where somebody looks.
#[derive(Debug)]
pub struct FieldViewer {
    thread: Background<Arc<RenderedView>, FieldView>,
    viewpoint: Option<Viewpoint>,
    /// Version of the newest view that the scene had.
    seen: Option<Version>,
    /// The view that was asked for last.
    asked: Option<Asked>,
    /// Whether a view from here is there, or is being made ready.
    has_any: bool,
    view: Option<FieldView>,
}

/// A view that was asked for.
#[derive(Clone, Copy, Debug)]
struct Asked {
    when: Instant,
    /// When all of it was there.
    answered: Option<Instant>,
}

impl Asked {
    /// Whether another one may be asked for.
    fn is_old(&self, now: Instant) -> bool {
        self.answered.is_some_and(|answered| {
            let took = answered.duration_since(self.when);
            now.duration_since(answered) >= took.max(VIEW_EVERY)
        })
    }
}

impl FieldViewer {
    /// Shows nothing yet; whenever a view is ready, this window is woken.
    pub fn new(ctx: egui::Context) -> Self {
        Self {
            thread: Background::new(ctx, "field-view", make_ready),
            viewpoint: None,
            seen: None,
            asked: None,
            has_any: false,
            view: None,
        }
    }

    /// Takes over what has come of the field as seen from here, and nothing from elsewhere. If the view is wanted, it is
    /// asked for, and again when it has become old. Costs next to nothing when nothing has changed.
    pub fn follow(
        &mut self,
        workspace: &Workspace,
        viewpoint: Viewpoint,
        wanted: bool,
        commands: &mut Commands,
    ) {
        if self.viewpoint != Some(viewpoint) {
            self.viewpoint = Some(viewpoint);
            self.asked = None;
            self.has_any = false;
            self.view = None;
        }
        if let Some(rendered) = &workspace.rendered
            && self.seen != Some(rendered.version())
        {
            self.seen = Some(rendered.version());
            if rendered.viewpoint == viewpoint {
                self.take(rendered);
            }
        }
        if let Some(view) = self.thread.newest()
            && view.rendered.viewpoint == viewpoint
        {
            self.view = Some(view);
        }
        if wanted {
            self.ask_if_due(workspace, viewpoint, commands);
        } else {
            // Somebody else may ask for another view meanwhile: what was asked for may never come.
            self.asked.take_if(|asked| asked.answered.is_none());
        }
    }

    /// The field as seen from here; `None` until it is ready.
    pub fn view(&self) -> Option<&FieldView> {
        self.view.as_ref()
    }

    fn take(&mut self, rendered: &Arc<RenderedView>) {
        if let Some(asked) = self.asked.as_mut().filter(|_| rendered.is_last) {
            asked.answered = Some(Instant::now());
        }
        // A coarse one is better than nothing, but not than a fine one of a little while ago.
        if rendered.is_last || !self.has_any {
            self.has_any = true;
            self.thread.ask(Arc::clone(rendered));
        }
    }

    /// Asks for a view when there is none, or when the one there is has become old.
    fn ask_if_due(&mut self, workspace: &Workspace, viewpoint: Viewpoint, commands: &mut Commands) {
        let (now, status) = (Instant::now(), &workspace.status);
        let due = self.asked.is_none_or(|asked| {
            let outdated = |view: &FieldView| {
                let of = &view.rendered;
                (of.steps, of.semantic_steps, of.generation)
                    != (status.steps, status.semantic_steps, status.generation)
            };
            self.view.as_ref().is_some_and(outdated) && asked.is_old(now)
        });
        if due {
            self.asked = Some(Asked {
                when: now,
                answered: None,
            });
            commands.push(Command::Render(viewpoint));
        }
    }
}

/// Makes views ready, the newest first.
fn make_ready(desk: &Desk<Arc<RenderedView>, FieldView>) -> Result<(), Gone> {
    loop {
        if let Some(view) = FieldView::new(desk.newest()?) {
            desk.tell(view)?;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use inplace_core::scene::Camera;

    #[test]
    fn a_view_is_enlarged_to_its_cameras_image_by_repeating_pixels() {
        let view = RenderedView {
            viewpoint: Viewpoint {
                camera: Camera::with_horizontal_fov(3, 2, 60.0),
                camera_to_world: glam::Affine3A::IDENTITY,
            },
            steps: 1,
            semantic_steps: 0,
            is_last: true,
            stride: 2,
            color: ColorImage::new(2, 1, vec![1, 1, 1, 9, 9, 9]).unwrap(),
            depth: vec![1.0, 2.0],
            generation: 0,
            labels: None,
        };
        let color = enlarged(&view).unwrap();
        let row = [1, 1, 1, 1, 1, 1, 9, 9, 9];
        assert_eq!(color.bytes(), [row, row].concat());
    }

    #[test]
    fn a_view_that_took_long_is_not_rendered_again_before_as_long_again() {
        let when = Instant::now();
        let after = |seconds| when + Duration::from_secs(seconds);
        let asked = |answered| Asked { when, answered };
        assert!(!asked(None).is_old(after(100)));
        let quick = asked(Some(after(1)));
        assert!(!quick.is_old(after(2)) && quick.is_old(after(3)));
        let slow = asked(Some(after(10)));
        assert!(!slow.is_old(after(19)) && slow.is_old(after(20)));
    }
}
