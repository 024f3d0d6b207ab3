//! The frame drawn by a wgpu paint callback; textures are uploaded only when their content changes.

use std::borrow::Cow;
use std::sync::{Arc, Mutex, PoisonError};
use std::time::Instant;

use bytemuck::{Pod, Zeroable};
use egui_wgpu::{CallbackResources, CallbackTrait, ScreenDescriptor};
use inplace_model::layer::Look;
use inplace_model::palette::PALETTE_COLUMNS;
use inplace_model::versioned::{Version, Versioned};

use super::content::Content;
use super::cpu::{DIMMED_BLACK, DIMMED_SHARE, HATCHING, outline, strength};
use super::plane::Reading;
use super::view::Placement;
use crate::gpu::{bind, is_older, pipeline, texture_of, uniform_buffer};

/// What has reached the renderer.
#[derive(Clone, Copy, Debug, Default)]
pub struct Uploads {
    /// Whether any image has.
    pub image: bool,
    /// The newest map, and when: (label generation, frame, time).
    pub map: Option<(u64, usize, Instant)>,
}

/// What has reached the renderer, also where that works on another thread.
pub type UploadClock = Arc<Mutex<Uploads>>;

/// Notes that an image is with the renderer now.
pub(super) fn note_image(clock: &UploadClock) {
    clock.lock().unwrap_or_else(PoisonError::into_inner).image = true;
}

/// Notes that a map of this generation and frame is with the renderer now.
pub(super) fn note_map(clock: &UploadClock, generation: u64, frame: usize) {
    let map = Some((generation, frame, Instant::now()));
    clock.lock().unwrap_or_else(PoisonError::into_inner).map = map;
}

/// Of images and of the palette.
const RGBA: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;

/// Parts of the canvas that show a layer each.
pub(super) const SIDES: usize = 2;

/// One frame to draw, on one side of the canvas.
pub(super) struct Draw {
    /// Below [`SIDES`].
    pub(super) side: usize,
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
    strength: f32,
    scale: f32,
    outline_strength: f32,
    hatching: f32,
    reading: u32,
    table_row: u32,
    class_rows: u32,
    hole: u32,
    stripe: u32,
    greyed: u32,
    dimmed: [f32; 2],
    linear_target: u32,
    padding: [u32; 3],
}

/// What stays with the renderer between frames.
struct Resources {
    pipeline: wgpu::RenderPipeline,
    sampler: wgpu::Sampler,
    sides: [Side; SIDES],
    /// The newest map that arrived here.
    map: Option<Version>,
}

/// A texture with the version of what it holds.
type Texture = Versioned<wgpu::TextureView>;

/// What one side of the canvas shows.
struct Side {
    uniforms: wgpu::Buffer,
    image: Option<Texture>,
    over: Option<Texture>,
    palette: Option<Texture>,
    bind_group: Option<wgpu::BindGroup>,
}

impl Resources {
    fn new(device: &wgpu::Device, target: wgpu::TextureFormat) -> Self {
        let module = device.create_shader_module(wgpu::include_wgsl!("canvas.wgsl"));
        let functions = ["vertex", "fragment"];
        let topology = wgpu::PrimitiveTopology::TriangleList;
        let pipeline = pipeline(device, &module, functions, &[], topology, None, target);
        let sampler = device.create_sampler(&wgpu::SamplerDescriptor {
            label: Some("canvas"),
            mag_filter: wgpu::FilterMode::Linear,
            min_filter: wgpu::FilterMode::Linear,
            ..Default::default()
        });
        Self {
            pipeline,
            sampler,
            sides: std::array::from_fn(|_| Side::new(device)),
            map: None,
        }
    }

    fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, draw: &Draw) {
        let content = &draw.content;
        let side = &mut self.sides[draw.side];
        side.upload(device, queue, content);
        if side.image.is_some() {
            note_image(&draw.clock);
        }
        if side.bind_group.is_none()
            && let (Some(image), Some(over), Some(palette)) = (&side.image, &side.over, &side.palette)
        {
            let resources = [
                side.uniforms.as_entire_binding(),
                wgpu::BindingResource::TextureView(image),
                wgpu::BindingResource::Sampler(&self.sampler),
                wgpu::BindingResource::TextureView(over),
                wgpu::BindingResource::TextureView(palette),
            ];
            side.bind_group = Some(bind(device, &self.pipeline, 0.., resources));
        }
        if let Some(map) = &content.map
            && self.map != Some(map.version())
        {
            self.map = Some(map.version());
            note_map(&draw.clock, map.generation, map.frame);
        }
    }
}

impl Side {
    fn new(device: &wgpu::Device) -> Self {
        Self {
            uniforms: uniform_buffer::<Uniforms>(device, "canvas"),
            image: None,
            over: None,
            palette: None,
            bind_group: None,
        }
    }

    /// Makes the textures hold what is shown; the bind group goes when one of them is new.
    fn upload(&mut self, device: &wgpu::Device, queue: &wgpu::Queue, content: &Content) {
        let texture = |name, format, size, texels: &[u8], version| {
            let texture = texture_of(device, queue, name, format, size, texels);
            Some(Versioned::with(texture, version))
        };
        if let Some(picture) = &content.picture
            && is_older(&self.image, picture.version)
        {
            let size = [picture.color.width(), picture.color.height()];
            self.image = texture("canvas image", RGBA, size, &picture.rgba, picture.version);
            self.bind_group = None;
        }
        let palette = &content.palette;
        if is_older(&self.palette, palette.version()) {
            let size = [PALETTE_COLUMNS as u32, palette.rows() as u32];
            let texels = palette.texels();
            self.palette = texture("canvas palette", RGBA, size, &texels, palette.version());
            self.bind_group = None;
        }
        let over = content.over.as_ref();
        if over.map_or(self.over.is_none(), |over| is_older(&self.over, over.version)) {
            // There has to be a texture, whatever is in it.
            let values = over.map_or_else(|| Cow::Owned(vec![0]), |over| over.texels.values());
            let (size, version) = over.map_or(([1, 1], Version::new()), |over| (over.size, over.version));
            let format = wgpu::TextureFormat::R16Uint;
            let texels = bytemuck::cast_slice(&values);
            self.over = texture("canvas plane", format, size, texels, version);
            self.bind_group = None;
        }
    }
}

impl Draw {
    fn uniforms(&self, pixels_per_point: f32) -> Uniforms {
        let rect = self.placement.rect();
        let (over, palette) = (self.content.over.as_ref(), &self.content.palette);
        let strength = strength(&self.look);
        let mut uniforms = Uniforms {
            image: [rect.left(), rect.top(), rect.width(), rect.height()].map(|v| v * pixels_per_point),
            strength,
            outline_strength: outline(&self.look),
            hatching: HATCHING * strength,
            class_rows: palette.class_rows() as u32,
            hole: u32::MAX,
            stripe: over.map_or(1, |over| over.stripe()),
            greyed: u32::from(over.is_some_and(|over| over.greyed)),
            dimmed: [DIMMED_BLACK / 255.0, DIMMED_SHARE],
            linear_target: u32::from(self.target.is_srgb()),
            ..Uniforms::zeroed()
        };
        match over.map(|over| over.reading) {
            None => {}
            Some(Reading::Classes) => uniforms.reading = 1,
            Some(Reading::Values { table, scale, hole }) => {
                uniforms.reading = 2;
                uniforms.table_row = palette.row(table) as u32;
                uniforms.scale = scale;
                uniforms.hole = hole.map_or(u32::MAX, u32::from);
            }
        }
        uniforms
    }
}

/// Makes the pipelines before the first frame asks for them.
pub fn make_ready(render: &egui_wgpu::RenderState) {
    let made = Resources::new(&render.device, render.target_format);
    render.renderer.write().callback_resources.insert(made);
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
        let side = &resources.sides[self.side];
        queue.write_buffer(&side.uniforms, 0, bytemuck::bytes_of(&uniforms));
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
        let Some(bind_group) = &resources.sides[self.side].bind_group else {
            return;
        };
        pass.set_pipeline(&resources.pipeline);
        pass.set_bind_group(0, bind_group, &[]);
        pass.draw(0..3, 0..1);
    }
}
