//! What the renderers of the canvas and of the 3D view have in common. Bindings are laid out as the shaders say.

use std::ops::RangeFrom;

use inplace_model::versioned::{Version, Versioned};
use wgpu::util::DeviceExt;

/// Whether what is held was not made of this.
pub fn is_older<T>(held: &Option<Versioned<T>>, version: Version) -> bool {
    held.as_ref().is_none_or(|held| held.version() != version)
}

/// A pipeline of these vertex and fragment functions that draws opaque colours into textures of this format.
pub fn pipeline(
    device: &wgpu::Device,
    module: &wgpu::ShaderModule,
    [vertex, fragment]: [&str; 2],
    buffers: &[Option<wgpu::VertexBufferLayout<'_>>],
    topology: wgpu::PrimitiveTopology,
    depth_stencil: Option<wgpu::DepthStencilState>,
    format: wgpu::TextureFormat,
) -> wgpu::RenderPipeline {
    device.create_render_pipeline(&wgpu::RenderPipelineDescriptor {
        label: Some(fragment),
        layout: None,
        vertex: wgpu::VertexState {
            module,
            entry_point: Some(vertex),
            buffers,
            compilation_options: wgpu::PipelineCompilationOptions::default(),
        },
        primitive: wgpu::PrimitiveState {
            topology,
            ..Default::default()
        },
        depth_stencil,
        multisample: wgpu::MultisampleState::default(),
        fragment: Some(wgpu::FragmentState {
            module,
            entry_point: Some(fragment),
            targets: &[Some(wgpu::ColorTargetState {
                format,
                blend: None,
                write_mask: wgpu::ColorWrites::ALL,
            })],
            compilation_options: wgpu::PipelineCompilationOptions::default(),
        }),
        multiview_mask: None,
        cache: None,
    })
}

/// A buffer that holds the uniforms of a shader.
pub fn uniform_buffer<Uniforms>(device: &wgpu::Device, label: &str) -> wgpu::Buffer {
    device.create_buffer(&wgpu::BufferDescriptor {
        label: Some(label),
        size: size_of::<Uniforms>() as u64,
        usage: wgpu::BufferUsages::UNIFORM | wgpu::BufferUsages::COPY_DST,
        mapped_at_creation: false,
    })
}

/// A texture of this width and height.
pub fn texture_descriptor(
    label: &str,
    [width, height]: [u32; 2],
    format: wgpu::TextureFormat,
    usage: wgpu::TextureUsages,
) -> wgpu::TextureDescriptor<'_> {
    wgpu::TextureDescriptor {
        label: Some(label),
        size: wgpu::Extent3d {
            width,
            height,
            depth_or_array_layers: 1,
        },
        mip_level_count: 1,
        sample_count: 1,
        dimension: wgpu::TextureDimension::D2,
        format,
        usage,
        view_formats: &[],
    }
}

/// All of a texture that holds these texels, row-major, in the width and height given.
pub fn texture_of(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    label: &str,
    format: wgpu::TextureFormat,
    size: [u32; 2],
    texels: &[u8],
) -> wgpu::TextureView {
    let descriptor = texture_descriptor(label, size, format, wgpu::TextureUsages::TEXTURE_BINDING);
    let order = wgpu::util::TextureDataOrder::LayerMajor;
    view(&device.create_texture_with_data(queue, &descriptor, order, texels))
}

/// All of a texture.
pub fn view(texture: &wgpu::Texture) -> wgpu::TextureView {
    texture.create_view(&wgpu::TextureViewDescriptor::default())
}

/// Binds all that a pipeline's shaders use, at these numbers.
pub fn bind<'a>(
    device: &wgpu::Device,
    pipeline: &wgpu::RenderPipeline,
    numbers: RangeFrom<u32>,
    resources: impl IntoIterator<Item = wgpu::BindingResource<'a>>,
) -> wgpu::BindGroup {
    let bound = numbers.zip(resources);
    let entries: Vec<_> = bound
        .map(|(binding, resource)| wgpu::BindGroupEntry { binding, resource })
        .collect();
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: None,
        layout: &pipeline.get_bind_group_layout(0),
        entries: &entries,
    })
}
