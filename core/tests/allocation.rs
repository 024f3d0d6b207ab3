//! What a training step allocates once it is under way: large blocks cost page faults at every step.
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};

use inplace_core::field::kernels::Dispatch;
use inplace_core::field::{Backend, Preset, Recipe, Trainer};
use inplace_core::scene::Scene;
use inplace_core::scene::demo::Shot;

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

/// A small demo room.
fn room(depth: bool) -> Scene {
    let shot = Shot::new(8, [32, 24]);
    let mut scene = shot.scene(&|_, _| {});
    if !depth {
        scene.frames.iter_mut().for_each(|frame| frame.set_depth(None));
    }
    scene
}

#[test]
fn a_step_under_way_allocates_hardly_anything_large() {
    for depth in [true, false] {
        let path = Backend::Fused(Dispatch::detect());
        let mut trainer = Trainer::on(
            path,
            Arc::new(room(depth)),
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
