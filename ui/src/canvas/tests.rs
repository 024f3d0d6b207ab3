//! The shader against the composite of the CPU.

use std::sync::Arc;

use egui::{Rect, pos2, vec2};
use inplace_core::labels::Class;
use inplace_core::scene::{ColorImage, Scene};
use inplace_core::session::FrameMap;
use inplace_model::layer::{Layer, Look};
use inplace_model::palette::{Palette, Table};
use inplace_model::versioned::Versioned;
use inplace_model::view::View;

use super::content::{Content, Picture, ShownMap};
use super::plane::{DepthPlane, Over};
use super::view::Placement;
use super::{UploadClock, cpu, gpu};

const SIZE: [u32; 2] = [24, 16];

/// A frame of many colours.
fn scene() -> Arc<Scene> {
    let [width, height] = SIZE;
    let rgb = (0..width * height * 3)
        .map(|index| (index * 37 % 251) as u8)
        .collect();
    Arc::new(crate::tests::scene(
        [ColorImage::new(width, height, rgb).unwrap()],
    ))
}

/// What each layer lays over that frame.
fn overs(palette: &Palette) -> Vec<(Layer, Option<Over>)> {
    let pixels = (SIZE[0] * SIZE[1]) as usize;
    // Void, an unknown class, and one with a number above a row of the palette's texture.
    let labels = (0..pixels)
        .map(|index| [0, 1, 2, 3, 300][index / 24 % 5])
        .collect();
    let entropy = (0..pixels).map(|index| (index * 29) as u16).collect();
    let map = Arc::new(FrameMap::new(0, 1, SIZE, labels, entropy).unwrap());
    let shown = ShownMap::new(Versioned::new(map));
    let depths: Vec<f32> = (0..pixels).map(|index| (index % 50) as f32 * 0.1).collect();
    let depth = DepthPlane::new(SIZE, &depths);
    let agreement = (0..pixels).map(|index| (index % 4) as u16).collect();
    vec![
        (Layer::Color, None),
        (Layer::Labels, shown.over(Layer::Labels, palette)),
        (Layer::Entropy, shown.over(Layer::Entropy, palette)),
        (
            Layer::Disagreement,
            Some(Over::marks(SIZE, agreement, Table::Disagreement)),
        ),
        (Layer::Depth, Some(Over::depth(&Versioned::new(depth)))),
    ]
}

#[test]
fn the_shader_shows_every_layer_as_the_composite_of_the_cpu_does() {
    let scene = scene();
    let palette = Palette::new(&[
        Class::new(1, "wall"),
        Class::new(2, "floor"),
        Class::new(300, "lamp"),
    ]);
    let picture = Arc::new(Picture::new(scene.frames[0].color()));
    let size = vec2(SIZE[0] as f32, SIZE[1] as f32);
    // One point for every pixel of the image, beside the margin of a fitted one.
    let canvas = Rect::from_min_size(pos2(0.0, 0.0), size + vec2(32.0, 32.0));
    let placement = Placement::new(View::Whole, canvas, size);
    assert_eq!(placement.zoom, 1.0);
    for (layer, over) in overs(&palette) {
        let look = Look {
            layer,
            opacity: 0.6,
            outlines: false,
        };
        let expected = cpu::composite(
            &scene.frames[0].color(),
            over.as_ref(),
            &palette,
            look,
            (cpu::whole(SIZE), SIZE.map(|side| side as usize)),
        );
        let content = Content {
            picture: Some(Arc::clone(&picture)),
            over,
            map: None,
            palette: Versioned::new(Arc::clone(&palette)),
        };
        let mut harness = egui_kittest::Harness::builder()
            .with_size(canvas.size())
            .with_pixels_per_point(1.0)
            .wgpu()
            .build_ui(move |ui| {
                let draw = gpu::Draw {
                    side: 0,
                    content: content.clone(),
                    placement,
                    look,
                    target: wgpu::TextureFormat::Rgba8Unorm,
                    clock: UploadClock::default(),
                };
                let callback = egui_wgpu::Callback::new_paint_callback(canvas, draw);
                ui.painter().with_clip_rect(canvas).add(callback);
            });
        harness.run_steps(2);
        let rendered = harness.render().unwrap();
        for (index, expected) in expected.pixels.iter().enumerate() {
            let (x, y) = (index as u32 % SIZE[0], index as u32 / SIZE[0]);
            let origin = placement.origin.to_vec2();
            let pixel = rendered.get_pixel(x + origin.x as u32, y + origin.y as u32);
            let difference = (0..3).map(|c| pixel[c].abs_diff(expected[c])).max();
            assert!(
                difference <= Some(1),
                "{layer:?} at {x}, {y}: {pixel:?} for {expected:?}"
            );
        }
    }
}
