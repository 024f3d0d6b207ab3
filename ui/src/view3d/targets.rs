//! A picture that splats are drawn into, and what it shows.

use super::shot::Picture;
use crate::gpu::{bind, texture_descriptor, view};

/// Of a picture's colours.
pub const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Of a picture's depths.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// A colour texture with depth.
pub struct Target {
    /// In physical pixels.
    pub size: [u32; 2],
    /// What is being drawn or was drawn into it.
    pub picture: Option<Picture>,
    /// How many splats have been drawn.
    pub drawn: usize,
    /// Binds the colours to show them.
    pub bind_group: wgpu::BindGroup,
    /// Its colours.
    pub color: wgpu::Texture,
    depth: wgpu::Texture,
}

impl Target {
    /// An empty picture.
    pub fn new(
        device: &wgpu::Device,
        size: [u32; 2],
        show_pipeline: &wgpu::RenderPipeline,
        place_uniforms: &wgpu::Buffer,
    ) -> Self {
        let texture = |format, usage| {
            let usage = usage | wgpu::TextureUsages::RENDER_ATTACHMENT;
            device.create_texture(&texture_descriptor("splats", size, format, usage))
        };
        let read = wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_SRC;
        let color = texture(COLOR_FORMAT, read);
        let shown = wgpu::BindingResource::TextureView(&view(&color));
        let bound = [place_uniforms.as_entire_binding(), shown];
        let bind_group = bind(device, show_pipeline, 2.., bound);
        Self {
            size,
            picture: None,
            drawn: 0,
            bind_group,
            depth: texture(DEPTH_FORMAT, wgpu::TextureUsages::empty()),
            color,
        }
    }

    /// Whether all splats of a picture are in it.
    pub fn holds(&self, picture: &Picture, splats: usize) -> bool {
        self.picture.as_ref() == Some(picture) && self.drawn >= splats
    }

    /// Begins to draw, onto the background while nothing has been drawn.
    pub fn pass<'a>(
        &self,
        encoder: &'a mut wgpu::CommandEncoder,
        background: egui::Color32,
    ) -> wgpu::RenderPass<'a> {
        let (color, depth) = (view(&self.color), view(&self.depth));
        let [r, g, b, _] = background.to_array().map(|v| f64::from(v) / 255.0);
        let begins = self.drawn == 0;
        encoder.begin_render_pass(&wgpu::RenderPassDescriptor {
            label: Some("splats"),
            color_attachments: &[Some(wgpu::RenderPassColorAttachment {
                view: &color,
                depth_slice: None,
                resolve_target: None,
                ops: wgpu::Operations {
                    load: if begins {
                        wgpu::LoadOp::Clear(wgpu::Color { r, g, b, a: 1.0 })
                    } else {
                        wgpu::LoadOp::Load
                    },
                    store: wgpu::StoreOp::Store,
                },
            })],
            depth_stencil_attachment: Some(wgpu::RenderPassDepthStencilAttachment {
                view: &depth,
                depth_ops: Some(wgpu::Operations {
                    load: if begins {
                        // Infinitely far.
                        wgpu::LoadOp::Clear(0.0)
                    } else {
                        wgpu::LoadOp::Load
                    },
                    store: wgpu::StoreOp::Store,
                }),
                stencil_ops: None,
            }),
            timestamp_writes: None,
            occlusion_query_set: None,
            multiview_mask: None,
        })
    }
}
