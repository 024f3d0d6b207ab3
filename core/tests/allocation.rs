//! What a training step allocates once it is under way: large blocks cost page faults at every step.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use glam::{Affine3A, Vec3};
use inplace_core::field::kernels::Dispatch;
use inplace_core::field::{Backend, Preset, Recipe, Trainer};
use inplace_core::scene::{Camera, ColorImage, DepthMap, Frame, FramePixels, Scene, SceneSource};

/// Blocks of more bytes count: more than candle's tensors of seven numbers for each of at most 4096 rays.
const LARGE: usize = 128 * 1024;

static LARGE_BYTES: AtomicUsize = AtomicUsize::new(0);

struct Counting;

// SAFETY: everything is passed on to the system's allocator as it came, also by what is made of these two.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        if layout.size() > LARGE {
            LARGE_BYTES.fetch_add(layout.size(), Ordering::Relaxed);
        }
        // SAFETY: as above.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A bright and a dark half of a wall two metres away, seen from places side by side.
fn wall(depth: bool) -> Scene {
    let (width, height) = (32, 24);
    let camera = Camera::with_horizontal_fov(width, height, 90.0);
    let frames = (0..8).map(|number| {
        let rgb = (0..3 * width * height).map(|k| if k / 3 % width < width / 2 { 40 } else { 220 });
        Frame {
            stem: format!("rgb_{number}"),
            path: PathBuf::new(),
            camera,
            camera_to_world: Affine3A::from_translation(Vec3::new(0.05 * number as f32, 0.0, 0.0)),
            pixels: FramePixels::new(
                ColorImage::new(width, height, rgb.collect()).unwrap(),
                depth.then(|| DepthMap::from_z_depths(&camera, vec![2.0; camera.pixels()])),
            ),
            points: Vec::new(),
            lens: None,
        }
    });
    Scene::new(SceneSource::Demo, "test", frames.collect())
}

#[test]
fn a_step_under_way_allocates_hardly_anything_large() {
    for depth in [true, false] {
        let path = Backend::Fused(Dispatch::detect());
        let mut trainer = Trainer::on(
            &path,
            Arc::new(wall(depth)),
            (Preset::Fast, 1.0),
            Recipe::default(),
            1,
        )
        .unwrap();
        for _ in 0..40 {
            trainer.step().unwrap();
        }
        LARGE_BYTES.store(0, Ordering::Relaxed);
        let steps = 20;
        for _ in 0..steps {
            trainer.step().unwrap();
        }
        let per_step = LARGE_BYTES.load(Ordering::Relaxed) / steps;
        assert!(per_step < LARGE, "depth {depth}: {per_step} bytes a step");
    }
}
