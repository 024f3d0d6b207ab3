//! The frame drawn by a wgpu paint callback; textures are uploaded only when their content changes.

use std::borrow::Cow;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use bytemuck::{Pod, Zeroable};
use egui_wgpu::{CallbackResources, CallbackTrait, ScreenDescriptor};
use inplace_core::session::FrameMap;

use super::content::Content;
use super::cpu::{Look, OUTLINE_STRENGTH};
use super::palette::{Layer, PALETTE_COLUMNS};
use super::view::Placement;

/// When the newest map reached the renderer: (label generation, frame, time).
pub type UploadClock = Arc<Mutex<Option<(u64, usize, Instant)>>>;

/// Notes that a map of this generation and frame is with the renderer now.
pub(super) fn note_upload(clock: &UploadClock, generation: u64, frame: usize) {
    *clock.lock().unwrap_or_else(PoisonError::into_inner) = Some((generation, frame, Instant::now()));
}

/// One frame to draw.
pub(super) struct Draw {
    pub(super) content: Content,
    pub(super) placement: Placement,
    pub(super) look: Look,
    pub(super) target: wgpu::TextureFormat,
    pub(super) clock: UploadClock,
}

#[repr(C)]
#[derive(Clone, Copy, Pod, Zeroable)]
struct Uniforms {
    image: [f32; 4],
    color_size: [f32; 2],
    map_size: [f32; 2],
    opacity: f32,
    entropy_scale: f32,
    layer: u32,
    entropy_row: u32,
    outline_strength: f32,
    linear_target: u32,
    padding: [u32; 2],
}

/// What stays with the renderer between frames.
struct Resources {
    pipeline: wgpu::RenderPipeline,
    layout: wgpu::BindGroupLayout,
    uniforms: wgpu::Buffer,
    sampler: wgpu::Sampler,
    color: Plane,
    labels: Plane,
    entropy: Plane,
    palette: Plane,
    bind_group: Option<wgpu::BindGroup>,
}

/// A texture and the serial number of what it holds.
struct Plane {
    name: &'static str,
    format: wgpu::TextureFormat,
    texture: Option<wgpu::Texture>,
    serial: Option<u64>,
}

impl Plane {
    fn new(name: &'static str, format: wgpu::TextureFormat) -> Self {
        Self {
            name,
            format,
            texture: None,
            serial: None,
        }
    }

    /// Makes the texture hold `texels` (row-major); returns whether the texture itself is new.
    fn hold(
        &mut self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        serial: u64,
        [width, height]: [u32; 2],
        texels: impl FnOnce() -> Vec<u8>,
    ) -> bool {
        if self.serial == Some(serial) {
            return false;
        }
        let size = wgpu::Extent3d {
            width: width.max(1),
            height: height.max(1),
            depth_or_array_layers: 1,
        };
        let same_size = self
            .texture
            .as_ref()
            .is_some_and(|texture| texture.size() == size);
        if !same_size {
            self.texture = Some(device.create_texture(&wgpu::TextureDescriptor {
                label: Some(self.name),
                size,
                mip_level_count: 1,
                sample_count: 1,
                dimension: wgpu::TextureDimension::D2,
                format: self.format,
                usage: wgpu::TextureUsages::TEXTURE_BINDING | wgpu::TextureUsages::COPY_DST,
                view_formats: &[],
            }));
        }
        self.serial = Some(serial);
        let texels = texels();
        let row = self.format.block_copy_size(None).unwrap_or(4) * size.width;
        if let Some(texture) = &self.texture
            && texels.len() == row as usize * size.height as usize
        {
            queue.write_texture(
                wgpu::TexelCopyTextureInfo {
                    texture,
                    mip_level: 0,
                    origin: wgpu::Origin3d::ZERO,
                    aspect: wgpu::TextureAspect::All,
                },
                &texels,
                wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(row),
                    rows_per_image: Some(size.height),
                },
                size,
            );
        }
        !same_size
    }

    fn view(&self) -> Option<wgpu::TextureView> {
        let texture = self.texture.as_ref()?;
        Some(texture.create_view(&wgpu::TextureViewDescriptor::default()))
    }
}

impl Resources {
    fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::ShaderModuleDescriptor {
            label: Some("canvas"),
            source: wgpu::ShaderSource::Wgsl(include_str!("canvas.wgsl").into()),
        });
        let layout = device.create_bind_group_layout(&wgpu::BindGroupLayoutDescriptor {
            label: Some("canvas"),
            entries: &layout_entries(),
        });
        let pipeline_layout = device.create_pipeline_layout(&wgpu::PipelineLayoutDescriptor {
            label: Some("canvas"),
            bind_group_layouts: &[Some(&layout)],
            immediate_size: 0,
        });
        let pipeline = device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
            label: Some("canvas"),
            layout: Some(&pipeline_layout),
            vertex: wgpu::VertexState {
                module: &module,
                entry_point: Some("vertex"),
                buffers: &[],
                compilation_options: wgpu::PipelineCompilationOptions::default(),
            },
            primitive: wgpu::PrimitiveState::default(),
            depth_stencil: None,
            multisample: wgpu::MultisampleState::default(),
            fragment: Some(wgpu::FragmentState {
                module: &module,
                entry_point: Some("fragment"),
                targets: &[Some(wgpu::ColorTargetState {
                    format: target,
                    blend: None,
                    write_mask: wgpu::ColorWrites::ALL,
                })],
                compilation_options: wgpu::PipelineCompilationOptions::default(),
            }),
            multiview_mask: None,
            cache: None,
        });
        let uniforms = device.create_buffer(&wgpu::BufferDescriptor {
            label: Some("canvas"),
            size: size_of::<Uniforms>() as u64,
            usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
            mapped_at_creation: false,
        });
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("canvas"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self {
            pipeline,
            layout,
            uniforms,
            sampler,
            color: Plane::new("canvas colour", wgpu::TextureFormat::Rgba8Unorm),
            labels: Plane::new("canvas labels", wgpu::TextureFormat::R16Uint),
            entropy: Plane::new("canvas entropy", wgpu::TextureFormat::R16Uint),
            palette: Plane::new("canvas palette", wgpu::TextureFormat::Rgba8Unorm),
            bind_group: None,
        }
    }

    fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, draw: &Draw) {
        let content = &draw.content;
        let image = content.image();
        let mut renewed = self.bind_group.is_none();
        renewed |= self.color.hold(
            device,
            queue,
            content.color_serial,
            [image.width(), image.height()],
            || rgba(image.bytes()),
        );
        let palette = &content.palette;
        let palette_size = [PALETTE_COLUMNS as u32, palette.entropy_row() as u32 + 1];
        renewed |= self
            .palette
            .hold(device, queue, content.palette_serial, palette_size, || {
                palette.texels()
            });
        let (serial, size) = content.map.as_ref().map_or((0, [1, 1]), |shown| {
            (shown.serial, [shown.map.width, shown.map.height])
        });
        let fresh = self.labels.serial != Some(serial);
        let plane = |values: fn(&FrameMap) -> Cow<'_, [u16]>| {
            let map = content.map.as_ref();
            map.map_or_else(
                || vec![0; 2],
                |shown| bytemuck::cast_slice(&values(&shown.map)).to_vec(),
            )
        };
        renewed |= self
            .labels
            .hold(device, queue, serial, size, || plane(FrameMap::labels));
        renewed |= self
            .entropy
            .hold(device, queue, serial, size, || plane(FrameMap::entropy));
        if let Some(shown) = content.map.as_ref().filter(|_| fresh) {
            note_upload(&draw.clock, shown.map.generation, shown.map.frame);
        }
        if renewed {
            self.bind_group = self.bind(device);
        }
    }

    fn bind(&self, device: &wgpu::Device) -> Option<wgpu::BindGroup> {
        let color = self.color.view()?;
        let labels = self.labels.view()?;
        let entropy = self.entropy.view()?;
        let palette = self.palette.view()?;
        let resources = [
            self.uniforms.as_entire_binding(),
            wgpu::BindingResource::TextureView(&color),
            wgpu::BindingResource::Sampler(&self.sampler),
            wgpu::BindingResource::TextureView(&labels),
            wgpu::BindingResource::TextureView(&entropy),
            wgpu::BindingResource::TextureView(&palette),
        ];
        let entries: Vec<_> = (0..)
            .zip(resources)
            .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
            .collect();
        Some(device.create_bind_group(&wgpu::BindGroupDescriptor {
            label: Some("canvas"),
            layout: &self.layout,
            entries: &entries,
        }))
    }
}

fn layout_entries() -> [wgpu::BindGroupLayoutEntry; 6] {
    let texture = |sample_type| wgpu::BindingType::Texture {
        sample_type,
        view_dimension: wgpu::TextureViewDimension::D2,
        multisampled: false,
    };
    let uniform = wgpu::BindingType::Buffer {
        ty: wgpu::BufferBindingType::Uniform,
        has_dynamic_offset: false,
        min_binding_size: None,
    };
    let types = [
        uniform,
        texture(wgpu::TextureSampleType::Float { filterable: true }),
        wgpu::BindingType::Sampler(wgpu::SamplerBindingType::Filtering),
        texture(wgpu::TextureSampleType::Uint),
        texture(wgpu::TextureSampleType::Uint),
        texture(wgpu::TextureSampleType::Float { filterable: false }),
    ];
    let mut binding = 0;
    types.map(|ty| {
        let entry = wgpu::BindGroupLayoutEntry {
            binding,
            visibility: wgpu::ShaderStages::FRAGMENT,
            ty,
            count: None,
        };
        binding += 1;
        entry
    })
}

fn rgba(rgb: &[u8]) -> Vec<u8> {
    rgb.chunks_exact(3)
        .flat_map(|pixel| [pixel[0], pixel[1], pixel[2], 255])
        .collect()
}

impl Draw {
    fn uniforms(&self, pixels_per_point: f32) -> Uniforms {
        let rect = self.placement.rect();
        let image = self.content.image();
        let map = self.content.map.as_ref();
        let outlined = self.look.outlines && self.look.opacity > 0.0;
        Uniforms {
            image: [rect.left(), rect.top(), rect.width(), rect.height()].map(|v| v * pixels_per_point),
            color_size: [image.width() as f32, image.height() as f32],
            map_size: map.map_or([0.0; 2], |shown| {
                [shown.map.width as f32, shown.map.height as f32]
            }),
            opacity: self.look.opacity,
            entropy_scale: self.content.palette.entropy_scale(),
            layer: match self.look.layer {
                Layer::Color => 0,
                Layer::Labels => 1,
                Layer::Entropy => 2,
            },
            entropy_row: self.content.palette.entropy_row() as u32,
            outline_strength: if outlined {
                OUTLINE_STRENGTH * self.look.opacity.max(0.5)
            } else {
                0.0
            },
            linear_target: u32::from(self.target.is_srgb()),
            padding: [0; 2],
        }
    }
}

impl CallbackTrait for Draw {
    fn prepare(
        &self,
        device: &wgpu::Device,
        queue: &wgpu::Queue,
        screen: &ScreenDescriptor,
        _encoder: &mut wgpu::CommandEncoder,
        resources: &mut CallbackResources,
    ) -> Vec<wgpu::CommandBuffer> {
        let resources = resources
            .entry::<Resources>()
            .or_insert_with(|| Resources::new(device, self.target));
        resources.upload(device, queue, self);
        let uniforms = self.uniforms(screen.pixels_per_point);
        queue.write_buffer(&resources.uniforms, 0, bytemuck::bytes_of(&uniforms));
        Vec::new()
    }

    fn paint(
        &self,
        _info: egui::PaintCallbackInfo,
        pass: &mut wgpu::RenderPass<'static>,
        resources: &CallbackResources,
    ) {
        let Some(resources) = resources.get::<Resources>() else {
            return;
        };
        let Some(bind_group) = &resources.bind_group else {
            return;
        };
        pass.set_pipeline(&resources.pipeline);
        pass.set_bind_group(0, bind_group, &[]);
        pass.draw(0..3, 0..1);
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn the_uniforms_have_the_shaders_size() {
        assert_eq!(size_of::<super::Uniforms>() % 16, 0);
        assert_eq!(size_of::<super::Uniforms>(), 64);
    }
}
