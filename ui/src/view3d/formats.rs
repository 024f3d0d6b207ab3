//! Texture formats and bindings that the pipelines of the splats and their pictures share.

/// Of a picture's colours.
pub const COLOR_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Rgba8Unorm;
/// Of a picture's depths.
pub const DEPTH_FORMAT: wgpu::TextureFormat = wgpu::TextureFormat::Depth32Float;

/// Binds uniforms and a texture to a layout of the pipelines.
pub fn bind(
    device: &wgpu::Device,
    layout: &wgpu::BindGroupLayout,
    first: u32,
    uniforms: &wgpu::Buffer,
    texture: &wgpu::TextureView,
) -> wgpu::BindGroup {
    device.create_bind_group(&wgpu::BindGroupDescriptor {
        label: Some("splats"),
        layout,
        entries: &[
            wgpu::BindGroupEntry {
                binding: first,
                resource: uniforms.as_entire_binding(),
            },
            wgpu::BindGroupEntry {
                binding: first + 1,
                resource: wgpu::BindingResource::TextureView(texture),
            },
        ],
    })
}
