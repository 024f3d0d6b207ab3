//! Pictures of the window, drawn as on a screen: what a change of the looks changes is seen in review.
//!
//! After a wanted change: `UPDATE_SNAPSHOTS=1 cargo test -p inplace-ui --test window pictures`.

use std::pin::pin;
use std::task::{Context, Poll, Waker};
use std::time::{Duration, Instant};

use eframe::App as _;
use egui::Key;
use egui_kittest::SnapshotOptions;
use image::RgbaImage;
use inplace_model::Command;
use inplace_model::preferences::{PreferenceChange, Theme};

use crate::stand::*;

/// A picture that stays the same for so long is complete.
const REST: Duration = Duration::from_secs(1);
/// How long it may take to get there.
const PATIENCE: Duration = Duration::from_secs(20);

/// Whether there is a Vulkan driver, such as lavapipe; where tests of the window may not be skipped, there has to be.
fn can_draw() -> bool {
    let instance = wgpu::Instance::default();
    let found = match pin!(instance.enumerate_adapters(wgpu::Backends::VULKAN))
        .poll(&mut Context::from_waker(Waker::noop()))
    {
        Poll::Ready(adapters) => !adapters.is_empty(),
        Poll::Pending => false,
    };
    assert!(
        found || std::env::var_os("INPLACE_REQUIRE_DISPLAY_TEST").is_none(),
        "the window cannot be drawn: a Vulkan driver is missing"
    );
    if !found {
        println!("skipped: a Vulkan driver is missing here");
    }
    found
}

/// Compares the window with its picture.
fn compare(window: &mut Window, name: &str) {
    window.key(Key::Escape);
    // What other threads make arrives, and what moves comes to rest.
    let start = Instant::now();
    let mut before = None;
    let picture = loop {
        window.harness.run_steps(4);
        let now = window.harness.render().unwrap();
        if before.as_ref() == Some(&now) || start.elapsed() > PATIENCE {
            break on_cleared_window(window, now);
        }
        before = Some(now);
        std::thread::sleep(REST);
    };
    // Renderers round differently along slanted edges and in shadows.
    let alike = SnapshotOptions::new().threshold(1.5).max_failed_pixels(100_usize);
    egui_kittest::image_snapshot_options(&picture, name, &alike);
}

/// The picture on the colour that the window is cleared to; tests draw on nothing.
fn on_cleared_window(window: &Window, mut picture: RgbaImage) -> RgbaImage {
    let visuals = window.harness.ctx.global_style().visuals.clone();
    let cleared = window.harness.state().clear_color(&visuals);
    for pixel in picture.pixels_mut() {
        let missing = 255.0 - f32::from(pixel.0[3]);
        for (channel, cleared) in pixel.0.iter_mut().zip(cleared) {
            *channel += (missing * cleared).round() as u8;
        }
    }
    picture
}

#[test]
fn the_start_page_looks_as_it_should() {
    if can_draw() {
        let folder = tempfile::tempdir().unwrap();
        compare(&mut Window::new(folder.path(), None), "start");
    }
}

#[test]
fn a_labelled_scene_looks_as_it_should_in_the_dark_and_in_the_light() {
    if can_draw() {
        let folder = tempfile::tempdir().unwrap();
        let long = "a class with a name that is far too long for the list";
        let clicks = [(0, "wall", [-60.0, -40.0]), (0, long, [-60.0, -60.0])];
        let mut window = Window::with_demo(folder.path()).labelled(&clicks);
        let generation = window.generation();
        for frame in 0..FRAMES {
            window.worker().publish(frame, generation, 1 + (frame % 2) as u16);
        }
        window.until_window("the maps are shown", |window| {
            let shown = window.frame().map();
            let is_new = shown.is_some_and(|shown| shown.map.generation == generation);
            is_new && window.workspace().map_version(FRAMES - 1) > 0
        });
        compare(&mut window, "labelled");
        window.act(Command::Prefer(PreferenceChange::Theme(Theme::Light)));
        compare(&mut window, "labelled-light");
    }
}
