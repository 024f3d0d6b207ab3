//! The strokes of the frame in view as one mesh, made anew only when what it shows changes.

use std::collections::BTreeMap;
use std::sync::Arc;

use egui::epaint::{TessellationOptions, Tessellator};
use egui::{Color32, Mesh, Painter, Pos2, Shape, Stroke as Pen};
use inplace_core::labels::{ClassId, FoundObject, Stroke, StrokeId, StrokeKind, runs_of};
use inplace_model::palette::Agreement;
use inplace_model::versioned::Version;
use inplace_model::workspace::Workspace;

use super::region::Region;
use super::shapes::{FILL, HALO, disc, line_shapes, stroke_color};
use super::view::Placement;
use crate::theme;

/// The meshes of a frame's strokes.
#[derive(Debug, Default)]
pub struct StrokeLayer {
    built: Option<Built>,
    /// The polygons of the frame, with the strokes that they were made of.
    regions: BTreeMap<StrokeId, (Arc<Stroke>, Region)>,
    /// How often a mesh was made so far.
    pub builds: u64,
}

/// A mesh and what it was made of.
#[derive(Debug)]
struct Built {
    of: Key,
    /// The objects that strokes lie on, which decide what is hidden.
    found: Arc<[FoundObject]>,
    /// Where the image lies in `mesh`.
    origin: Pos2,
    mesh: Arc<Mesh>,
}

/// All that the mesh depends on, its place and the objects aside.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Key {
    scene: u64,
    frame: usize,
    generation: u64,
    /// Changes with what is hidden.
    palette: Version,
    /// Version of the contradicted strokes, where their colours are shown instead of the classes'.
    agreement: Option<Version>,
    zoom: f32,
    pixels_per_point: f32,
    selected: Option<StrokeId>,
    accent: Color32,
}

impl StrokeLayer {
    /// Paints the strokes of the frame in view, the selected one marked: in the colours of their classes, or in those of
    /// what the others say of them.
    pub fn paint(&mut self, painter: &Painter, workspace: &Workspace, placement: Placement, agreement: bool) {
        let of = Key {
            scene: workspace.serial,
            frame: workspace.frame_index,
            generation: workspace.document.generation(),
            palette: workspace.document.palette().version(),
            agreement: agreement.then(|| workspace.overview.contradicted.version()),
            zoom: placement.zoom,
            pixels_per_point: painter.pixels_per_point(),
            selected: workspace.selected,
            accent: theme::of(&painter.ctx().global_style().visuals).accent,
        };
        let is_old = |built: &Built| built.of != of || !Arc::ptr_eq(&built.found, &workspace.found);
        if self.built.as_ref().is_none_or(is_old) {
            self.builds += 1;
            let here = Placement {
                origin: Pos2::ZERO,
                ..placement
            };
            self.built = Some(Built {
                mesh: Arc::new(self.build(workspace, here, &of)),
                found: Arc::clone(&workspace.found),
                origin: Pos2::ZERO,
                of,
            });
        }
        let Some(built) = &mut self.built else {
            return;
        };
        if built.origin != placement.origin {
            Arc::make_mut(&mut built.mesh).translate(placement.origin - built.origin);
            built.origin = placement.origin;
        }
        if !built.mesh.is_empty() {
            painter.add(Arc::clone(&built.mesh));
        }
    }

    fn build(&mut self, workspace: &Workspace, placement: Placement, of: &Key) -> Mesh {
        let [width, height] = [placement.size.x as u32, placement.size.y as u32];
        let before = std::mem::take(&mut self.regions);
        let mut pen = MeshPen::new(of.pixels_per_point);
        let mut marked = None;
        for (id, stroke) in workspace.document.strokes_on(of.frame) {
            let color = if of.agreement.is_some() {
                agreement_color(workspace, id, stroke.class)
            } else {
                stroke_color(workspace, stroke.class)
            };
            let region = (stroke.kind() == StrokeKind::Polygon).then(|| {
                let known = before.get(&id).filter(|(of, _)| Arc::ptr_eq(of, stroke));
                let region = known.map_or_else(
                    || Region::new(runs_of(stroke, width, height)),
                    |(_, region)| region.clone(),
                );
                self.regions.insert(id, (Arc::clone(stroke), region.clone()));
                region
            });
            if of.selected == Some(id) {
                // Over all others, so that nothing hides it.
                marked = Some((stroke, region, color));
                continue;
            }
            if workspace.is_stroke_hidden(id, stroke) {
                continue;
            }
            match region {
                Some(region) => {
                    let lines = [(1.75, HALO), (1.0, color)];
                    region.paint(&mut pen.mesh, placement, color.gamma_multiply(FILL), &lines);
                }
                None => pen.line(stroke, placement, color),
            }
        }
        if let Some((stroke, region, color)) = marked {
            match region {
                Some(region) => {
                    let lines = [(4.0, of.accent), (1.75, Color32::WHITE)];
                    region.paint(&mut pen.mesh, placement, color.gamma_multiply(1.8 * FILL), &lines);
                }
                None => pen.marked_line(stroke, placement, color, of.accent),
            }
        }
        pen.mesh
    }
}

/// The colour of what the other strokes say of a stroke.
fn agreement_color(workspace: &Workspace, id: StrokeId, class: ClassId) -> Color32 {
    let others = workspace.overview.contradicted.get(&id).copied();
    let agreement = if others.is_some_and(|others| others != class) {
        Agreement::StrokeContradicted
    } else {
        Agreement::Agreed
    };
    let [r, g, b, _] = agreement.color();
    Color32::from_rgb(r, g, b)
}

/// Draws into a mesh.
struct MeshPen {
    mesh: Mesh,
    tessellator: Tessellator,
}

impl MeshPen {
    fn new(pixels_per_point: f32) -> Self {
        // Without the discs in the font's texture, whose place changes while the mesh is kept.
        let options = TessellationOptions {
            prerasterized_discs: false,
            coarse_tessellation_culling: false,
            ..TessellationOptions::default()
        };
        Self {
            mesh: Mesh::default(),
            tessellator: Tessellator::new(pixels_per_point, options, [1, 1], Vec::new()),
        }
    }

    fn shapes(&mut self, shapes: impl IntoIterator<Item = Shape>) {
        for shape in shapes {
            self.tessellator.tessellate_shape(shape, &mut self.mesh);
        }
    }

    fn line(&mut self, stroke: &Stroke, placement: Placement, color: Color32) {
        for line in &stroke.lines {
            self.shapes(line_shapes(placement, line, stroke.radius, color));
        }
    }

    /// The line with a glow that no class has, as wide as the eye needs whatever the brush.
    fn marked_line(&mut self, stroke: &Stroke, placement: Placement, color: Color32, accent: Color32) {
        let half = ((stroke.radius as f32 + 0.5) * placement.zoom).max(1.5);
        for (wider, color) in [(7.0, HALO), (6.0, accent), (3.0, Color32::WHITE)] {
            for line in &stroke.lines {
                let points: Vec<Pos2> = line.iter().map(|&pixel| placement.pixel_center(pixel)).collect();
                let half = if points.len() == 1 { half.max(4.0) } else { half } + wider;
                let joints = points.iter().map(|&point| disc(point, half, color));
                self.shapes(joints.collect::<Vec<_>>());
                if points.len() > 1 {
                    self.shapes([Shape::line(points, Pen::new(2.0 * half, color))]);
                }
            }
        }
        self.line(stroke, placement, color);
    }
}
