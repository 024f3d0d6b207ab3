//! What the renderers of the canvas and of the 3D view have in common. Bindings are laid out as the shaders say.

use std::borrow::Cow;
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

/// All of a texture that holds these texels, row-major, in the width and height given; where that is more than a texture
/// may have, the nearest to each of as many as it may.
pub fn texture_of(
    device: &wgpu::Device,
    queue: &wgpu::Queue,
    label: &str,
    format: wgpu::TextureFormat,
    size: [u32; 2],
    texels: &[u8],
) -> wgpu::TextureView {
    let most = device.limits().max_texture_dimension_2d;
    let bytes = format.block_copy_size(None).unwrap_or(1) as usize;
    let (size, texels) = fitted(size, texels, bytes, most);
    let descriptor = texture_descriptor(label, size, format, wgpu::TextureUsages::TEXTURE_BINDING);
    let order = wgpu::util::TextureDataOrder::LayerMajor;
    view(&device.create_texture_with_data(queue, &descriptor, order, &texels))
}

/// Texels of so many bytes each, with at most so many columns and rows: the nearest ones where there were more.
fn fitted(size: [u32; 2], texels: &[u8], bytes: usize, most: u32) -> ([u32; 2], Cow<'_, [u8]>) {
    let fitting = size.map(|side| side.min(most));
    if fitting == size {
        return (size, Cow::Borrowed(texels));
    }
    let [columns, rows] = [0, 1].map(|axis| {
        let (from, to) = (size[axis] as usize, fitting[axis] as usize);
        (0..to).map(move |position| (2 * position + 1) * from / (2 * to))
    });
    let mut kept = Vec::with_capacity(bytes * columns.len() * rows.len());
    for row in rows {
        for column in columns.clone() {
            let texel = bytes * (row * size[0] as usize + column);
            kept.extend_from_slice(&texels[texel..texel + bytes]);
        }
    }
    (fitting, Cow::Owned(kept))
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_more_texels_than_a_texture_may_have_the_nearest_are_kept() {
        let texels: Vec<u8> = (0..24).collect();
        let (size, kept) = fitted([6, 2], &texels, 2, 3);
        assert_eq!(size, [3, 2]);
        assert_eq!(*kept, [2, 3, 6, 7, 10, 11, 14, 15, 18, 19, 22, 23]);
        let (size, kept) = fitted([6, 2], &texels, 2, 6);
        assert_eq!((size, &*kept), ([6, 2], &texels[..]));
    }
}
