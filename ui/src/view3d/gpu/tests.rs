use egui_kittest::wgpu::{create_render_state, default_wgpu_setup};
use egui_wgpu::RenderState;

use super::super::cpu::raster;
use super::super::shot::tests::{BACKGROUND, CLASS, floor_from};
use super::*;

/// Side of the pictures: their rows are as long as a copy into a buffer asks for.
const SIDE: u32 = 64;

/// A floor, seen from straight above or straight below.
fn draw(above: bool, budget: usize, moving: bool) -> Draw {
    Draw {
        shot: floor_from(above, SIDE),
        moving,
        budget,
        target: wgpu::TextureFormat::Rgba8Unorm,
        drawn: Arc::default(),
        ctx: egui::Context::default(),
    }
}

struct Stand {
    device: wgpu::Device,
    queue: wgpu::Queue,
    renderer: Renderer,
}

impl Stand {
    fn new() -> Self {
        let options = egui_wgpu::RendererOptions::PREDICTABLE;
        let RenderState { device, queue, .. } = create_render_state(default_wgpu_setup(), options);
        Self {
            renderer: Renderer::new(&device, wgpu::TextureFormat::Rgba8Unorm),
            device,
            queue,
        }
    }

    /// The picture shown after one more frame of the window, RGB by rows.
    fn frame(&mut self, draw: &Draw) -> Vec<[u8; 3]> {
        let mut encoder = self
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        self.renderer
            .prepare(&self.device, &self.queue, &mut encoder, draw, 1.0);
        let buffer = self.device.create_buffer(&wgpu::BufferDescriptor {
            label: None,
            size: u64::from(4 * SIDE * SIDE),
            usage: wgpu::BufferUsages::COPY_DST | wgpu::BufferUsages::MAP_READ,
            mapped_at_creation: false,
        });
        let [shown, _] = self.renderer.targets.as_ref().unwrap();
        encoder.copy_texture_to_buffer(
            shown.color.as_image_copy(),
            wgpu::TexelCopyBufferInfo {
                buffer: &buffer,
                layout: wgpu::TexelCopyBufferLayout {
                    offset: 0,
                    bytes_per_row: Some(4 * SIDE),
                    rows_per_image: None,
                },
            },
            shown.color.size(),
        );
        self.queue.submit([encoder.finish()]);
        buffer.map_async(wgpu::MapMode::Read, .., |mapped| mapped.unwrap());
        self.device.poll(wgpu::PollType::wait_indefinitely()).unwrap();
        let bytes = buffer.get_mapped_range(..).unwrap();
        bytes
            .chunks_exact(4)
            .map(|texel| [texel[0], texel[1], texel[2]])
            .collect()
    }
}

fn covered(picture: &[[u8; 3]]) -> usize {
    picture.iter().filter(|&&texel| texel != BACKGROUND).count()
}

#[test]
fn splats_cover_their_surface_in_the_colour_of_their_class_and_not_from_behind() {
    let mut stand = Stand::new();
    let above = stand.frame(&draw(true, usize::MAX, false));
    let middle = above[(SIDE / 2 * SIDE + SIDE / 2) as usize];
    for (channel, expected) in middle.into_iter().zip(CLASS) {
        assert!(channel.abs_diff(expected) <= 4, "{middle:?}");
    }
    assert_eq!(above[0], BACKGROUND);
    // The square in its ball, with the rest of the view around it.
    let share = covered(&above) as f32 / (SIDE * SIDE) as f32;
    assert!((0.3..0.7).contains(&share), "{share}");
    assert_eq!(covered(&stand.frame(&draw(false, usize::MAX, false))), 0);
}

#[test]
fn the_processor_draws_the_same() {
    for above in [true, false] {
        let draw = draw(above, usize::MAX, false);
        let by_gpu = Stand::new().frame(&draw);
        let own = raster(&draw.shot, [SIDE, SIDE], draw.shot.splats(), 1.0);
        let own = own.pixels.iter().map(|pixel| pixel.to_array());
        let differ = own.zip(&by_gpu).filter(|([r, g, b, _], other)| {
            [*r, *g, *b]
                .into_iter()
                .zip(**other)
                .any(|(a, b)| a.abs_diff(b) > 3)
        });
        let differ = differ.count();
        assert!(differ < by_gpu.len() / 50, "{differ}");
    }
}

#[test]
fn a_picture_drawn_over_several_frames_is_the_one_drawn_at_once() {
    let (mut stand, mut other) = (Stand::new(), Stand::new());
    let whole = draw(true, usize::MAX, false);
    let at_once = stand.frame(&whole);
    // The same splats, so that the picture that was begun goes on.
    let part = |moving| Draw {
        shot: whole.shot.clone(),
        ..draw(true, 500, moving)
    };
    let moving = part(true);
    let coarse = other.frame(&moving);
    assert_eq!(moving.drawn.load(Ordering::Relaxed), 500);
    // Fewer splats are larger, so that they still cover the surface.
    assert!(covered(&coarse) as f32 > 0.9 * covered(&at_once) as f32);
    let resting = part(false);
    for _ in 0..3 {
        assert_eq!(other.frame(&resting), coarse);
        assert_eq!(resting.drawn.load(Ordering::Relaxed), 500);
    }
    assert_eq!(other.frame(&resting), at_once);
    // Nothing is left to do.
    assert_eq!(other.frame(&resting), at_once);
    assert_eq!(resting.drawn.load(Ordering::Relaxed), 0);
}
