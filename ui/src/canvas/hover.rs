//! The outline of what a click at the pointer would win.

use std::sync::Arc;

use egui::{Color32, Mesh, Painter};
use inplace_core::session::Preview;
use inplace_model::workspace::Workspace;

use super::region::Region;
use super::shapes::{HALO, stroke_color};
use super::view::Placement;

/// How much its inside covers: enough to tell it from its outside.
const INSIDE: f32 = 0.15;

/// The outline that was painted last.
#[derive(Debug, Default)]
pub struct HoverLayer(Option<(Arc<Preview>, Region)>);

impl HoverLayer {
    /// Outlines what a click at the pointer would win, if anything is known of it.
    pub fn paint(&mut self, painter: &Painter, workspace: &Workspace, placement: Placement) {
        let Some(preview) = &workspace.hover.shown else {
            self.0 = None;
            return;
        };
        if self.0.as_ref().is_none_or(|(of, _)| !Arc::ptr_eq(of, preview)) {
            self.0 = Some((Arc::clone(preview), Region::new(preview.won.clone())));
        }
        let Some((_, region)) = &self.0 else {
            return;
        };
        let own = stroke_color(workspace, preview.stroke.class);
        let mut mesh = Mesh::default();
        let lines = [(2.25, HALO), (1.5, Color32::WHITE), (1.0, own)];
        region.paint(&mut mesh, placement, own.gamma_multiply(INSIDE), &lines);
        painter.add(mesh);
    }
}
