//! The splats drawn by wgpu into a picture of their own, which has depth, and that picture in the window.
//!
//! The picture is drawn anew only when it would differ. While the camera moves, the beginning of the splats is drawn
//! larger, as many as the budget allows; at rest all of them are drawn, over several frames where they are
//! too many for one, into a second picture that takes the place of the first when it is complete.

use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use bytemuck::{Pod, Zeroable};
use egui_wgpu::{CallbackResources, CallbackTrait, ScreenDescriptor};
use glam::Mat4;
use inplace_model::layer::Layer;
use inplace_model::palette::{PALETTE_COLUMNS, Table};
use inplace_model::versioned::Versioned;
use wgpu::util::DeviceExt;

use super::cloud::{Prepared, Splat};
use super::shot::{LEAST_PIXELS, SPLAT_RADIUS, Shot};
use super::targets::{COLOR_FORMAT, DEPTH_FORMAT, Target};
use crate::gpu::{bind, is_older, pipeline, texture_of, uniform_buffer};

/// A view of the splats to draw.
pub struct Draw {
    pub shot: Shot,
    /// Whether the camera is moving.
    pub moving: bool,
    /// Splats that may be drawn in this frame.
    pub budget: usize,
    /// The window's pixel format.
    pub target: wgpu::TextureFormat,
    /// Learns how many were drawn.
    pub drawn: Arc<AtomicUsize>,
    /// To go on in the next frame.
    pub ctx: egui::Context,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct SplatUniforms {
    clip_from_world: [f32; 16],
    eye: [f32; 3],
    radius: f32,
    least: f32,
    opacity: f32,
    entropy_scale: f32,
    layer: u32,
    class_rows: u32,
    entropy_row: u32,
    see_through: u32,
    padding: u32,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct PlaceUniforms {
    origin: [f32; 2],
    linear_target: u32,
    padding: u32,
}

/// What stays with the renderer between frames.
pub struct Renderer {
    splat_pipeline: wgpu::RenderPipeline,
    splat_uniforms: wgpu::Buffer,
    show_pipeline: wgpu::RenderPipeline,
    place_uniforms: wgpu::Buffer,
    splats: Option<Versioned<wgpu::Buffer>>,
    values: Option<Versioned<wgpu::Buffer>>,
    /// Binds the uniforms and the palette.
    palette: Option<Versioned<wgpu::BindGroup>>,
    /// What is shown, and what is being drawn to take its place.
    targets: Option<[Target; 2]>,
}

impl Renderer {
    /// Draws into windows of this format.
    pub fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::include_wgsl!("points.wgsl"));
        let covering = wgpu::PrimitiveTopology::TriangleList;
        Self {
            splat_pipeline: splat_pipeline(device, &module),
            splat_uniforms: uniform_buffer::<SplatUniforms>(device, "splats"),
            show_pipeline: pipeline(device, &module, ["cover", "show"], &[], covering, None, target),
            place_uniforms: uniform_buffer::<PlaceUniforms>(device, "splats"),
            splats: None,
            values: None,
            palette: None,
            targets: None,
        }
    }

    /// Uploads what is new and draws what is missing from the picture.
    pub fn prepare(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        encoder: &mut wgpu::CommandEncoder,
        draw: &Draw,
        pixels_per_point: f32,
    ) {
        self.upload(device, queue, draw);
        let size = draw.shot.size(pixels_per_point);
        if self.targets.as_ref().is_none_or(|[shown, _]| shown.size != size) {
            let target = || Target::new(device, size, &self.show_pipeline, &self.place_uniforms);
            self.targets = Some([target(), target()]);
        }
        let area = draw.shot.sight.area;
        let place = PlaceUniforms {
            origin: [area.left(), area.top()].map(|v| (v * pixels_per_point).round()),
            linear_target: u32::from(draw.target.is_srgb()),
            padding: 0,
        };
        queue.write_buffer(&self.place_uniforms, 0, bytemuck::bytes_of(&place));

        let total = draw.shot.splats();
        let wanted = draw.shot.picture();
        let Some([shown, next]) = &mut self.targets else {
            return;
        };
        if shown.holds(&wanted, total) || draw.moving && shown.picture.as_ref() == Some(&wanted) {
            draw.drawn.store(0, Ordering::Relaxed);
            return;
        }
        let same_view = |target: &Target| target.picture.as_ref().is_some_and(|own| own.same_view(&wanted));
        let budget = draw.budget.max(1);
        let (range, growth) = if draw.moving || !same_view(shown) {
            next.picture = None;
            shown.picture = Some(wanted);
            shown.drawn = 0;
            let (count, growth) = draw.shot.beginning(budget);
            (0..count, growth)
        } else {
            // One that was begun is finished, even if there are newer values: those come next.
            if !same_view(next) || next.drawn >= total {
                next.picture = Some(wanted);
                next.drawn = 0;
            }
            (next.drawn..(next.drawn + budget).min(total), 1.0)
        };
        let coarse = next.picture.is_none();
        let target = if coarse { shown } else { next };
        let uniforms = draw.shot.uniforms(growth, pixels_per_point);
        queue.write_buffer(&self.splat_uniforms, 0, bytemuck::bytes_of(&uniforms));
        let mut pass = target.pass(encoder, draw.shot.look.background);
        if let (Some(splats), Some(values), Some(palette)) = (&self.splats, &self.values, &self.palette) {
            pass.set_pipeline(&self.splat_pipeline);
            pass.set_bind_group(0, &**palette, &[]);
            pass.set_vertex_buffer(0, splats.slice(..));
            pass.set_vertex_buffer(1, values.slice(..));
            pass.draw(0..4, range.start as u32..range.end as u32);
        }
        drop(pass);
        target.drawn = range.end;
        let complete = target.drawn >= total;
        if complete && !coarse {
            self.targets
                .as_mut()
                .into_iter()
                .for_each(|targets| targets.swap(0, 1));
        }
        draw.drawn.store(range.len(), Ordering::Relaxed);
        // Newer values may have come while this picture was drawn.
        draw.ctx.request_repaint();
    }

    fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, draw: &Draw) {
        let Prepared { cloud, values, .. } = &draw.shot.prepared;
        let vertices = |contents: &[u8]| {
            device.create_buffer_init(&wgpu::util::BufferInitDescriptor {
                label: Some("splats"),
                contents,
                usage: wgpu::BufferUsages::VERTEX | wgpu::BufferUsages::COPY_DST,
            })
        };
        if is_older(&self.splats, cloud.version) {
            let buffer = vertices(bytemuck::cast_slice(&cloud.splats));
            self.splats = Some(Versioned::with(buffer, cloud.version));
        }
        if is_older(&self.values, values.version) {
            let buffer = vertices(bytemuck::cast_slice(&values.values));
            self.values = Some(Versioned::with(buffer, values.version));
        }
        let palette = &draw.shot.palette;
        let version = palette.version();
        if is_older(&self.palette, version) {
            let size = [PALETTE_COLUMNS as u32, palette.rows() as u32];
            let texels = palette.texels();
            let texture = texture_of(device, queue, "splat palette", COLOR_FORMAT, size, &texels);
            let uniforms = self.splat_uniforms.as_entire_binding();
            let texels = wgpu::BindingResource::TextureView(&texture);
            let held = bind(device, &self.splat_pipeline, 0.., [uniforms, texels]);
            self.palette = Some(Versioned::with(held, version));
        }
    }
}

fn splat_pipeline(device: &wgpu::Device, module: &wgpu::ShaderModule) -> wgpu::RenderPipeline {
    let splats = wgpu::VertexBufferLayout {
        array_stride: size_of::<Splat>() as u64,
        step_mode: wgpu::VertexStepMode::Instance,
        attributes: &wgpu::vertex_attr_array![0 => Float32x3, 1 => Float32, 2 => Unorm8x4, 3 => Snorm8x4],
    };
    let values = wgpu::VertexBufferLayout {
        array_stride: size_of::<u32>() as u64,
        step_mode: wgpu::VertexStepMode::Instance,
        attributes: &wgpu::vertex_attr_array![4 => Uint32],
    };
    let depth = wgpu::DepthStencilState {
        format: DEPTH_FORMAT,
        depth_write_enabled: Some(true),
        // Nearer is greater.
        depth_compare: Some(wgpu::CompareFunction::Greater),
        stencil: wgpu::StencilState::default(),
        bias: wgpu::DepthBiasState::default(),
    };
    pipeline(
        device,
        module,
        ["splat", "disc"],
        &[Some(splats), Some(values)],
        wgpu::PrimitiveTopology::TriangleStrip,
        Some(depth),
        COLOR_FORMAT,
    )
}

impl Shot {
    fn uniforms(&self, growth: f32, pixels_per_point: f32) -> SplatUniforms {
        let palette = &self.palette;
        let clip_from_world: Mat4 = self.sight.clip_from_world();
        SplatUniforms {
            clip_from_world: clip_from_world.to_cols_array(),
            eye: self.sight.eye.to_array(),
            radius: SPLAT_RADIUS * growth,
            least: growth * LEAST_PIXELS / (self.sight.focal * pixels_per_point),
            opacity: self.look.opacity,
            entropy_scale: palette.entropy_scale(),
            layer: match self.look.layer {
                Layer::Labels | Layer::Objects => 1,
                Layer::Entropy => 2,
                _ => 0,
            },
            class_rows: palette.class_rows() as u32,
            entropy_row: palette.row(Table::Entropy) as u32,
            see_through: u32::from(self.look.see_through),
            padding: 0,
        }
    }
}

/// Makes the pipelines before the first frame asks for them.
pub fn make_ready(render: &egui_wgpu::RenderState) {
    let made = Renderer::new(&render.device, render.target_format);
    render.renderer.write().callback_resources.insert(made);
}

impl CallbackTrait for Draw {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        screen: &ScreenDescriptor,
        encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        let renderer = resources
            .entry::<Renderer>()
            .or_insert_with(|| Renderer::new(device, self.target));
        renderer.prepare(device, queue, encoder, self, screen.pixels_per_point);
        Vec::new()
    }

    fn paint(
        &self,
        _info: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        let renderer = resources.get::<Renderer>();
        if let Some((renderer, [shown, _])) = renderer.and_then(|own| Some((own, own.targets.as_ref()?))) {
            pass.set_pipeline(&renderer.show_pipeline);
            pass.set_bind_group(0, &shown.bind_group, &[]);
            pass.draw(0..3, 0..1);
        }
    }
}

#[cfg(test)]
mod tests;
