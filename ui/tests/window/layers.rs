//! Layers, their legends, the comparison and the readout under the pointer.

use std::time::{Duration, Instant};

use egui::{Key, PointerButton};
use inplace_core::scene::{SceneSource, write_replica};
use inplace_model::Command;
use inplace_model::layer::Layer;
use inplace_ui::Target;
use inplace_ui::app::App;
use inplace_ui::canvas::FrameView;

use crate::stand::*;

#[test]
fn legend_and_readout_say_what_is_shown_and_layers_change_by_menu_and_by_key() {
    let mut window = Window::with_classes(&["wall", "floor"]);
    window.sees("Labels: No labels to show yet");
    window.publish(0, 2);
    window.until("the classes are counted", |app| {
        let visible = app.canvas().frame().and_then(FrameView::visible);
        visible.is_some_and(|classes| classes == [(2, WIDTH * HEIGHT)])
    });
    window.sees("Labels: floor");
    window.sees("Point at the image to read its pixels");
    window.hover(window.canvas(0.0, 0.0));
    // The map of the stand-in has 500 steps of entropy everywhere, and no probabilities.
    let pixel = format!("{}, {}", WIDTH / 2, HEIGHT / 2);
    window.sees(&format!("{pixel}; floor; 7% unsure"));
    window.harness.event(egui::Event::PointerGone);
    window.harness.run_steps(3);
    window.sees("Point at the image to read its pixels");
    window.click_through(&["Layer", Layer::Depth.name()]);
    assert_eq!(window.model().settings.layer, Layer::Depth);
    let from_depth = Layer::present(false).skip_while(|&layer| layer != Layer::Depth);
    for next in from_depth.skip(1).chain([Layer::Color, Layer::Labels]) {
        window.key(Key::Q);
        assert_eq!(window.model().settings.layer, next);
    }
    window.until_window("the legend is back", |window| window.shows("Labels: floor"));
    window.click_through(&["View", "Legend"]);
    window.misses("Labels: floor");
}

#[test]
fn the_layer_of_objects_shows_every_thing_and_the_strip_names_it() {
    let mut window = Window::with_classes(&["chair"]);
    window.act(Command::ChooseLayer(Layer::Objects));
    window.sees("Objects: No labels to show yet");
    window.click_canvas(0.0, 0.0);
    window.spread();
    window.until_window("the objects are found", |window| window.shows("Objects: chair 1"));
    window.hover(window.canvas(0.0, 0.0));
    window.sees_part("100% chair 1;");
    let palette = window.workspace().document.palette();
    let content = window.frame().content(Layer::Objects, palette).unwrap();
    // After the only class.
    assert!(content.over.unwrap().texels.values().contains(&2));
    let [r, g, b] = window.workspace().document.classes()[0].color;
    assert_eq!(content.palette.class(2), [r, g, b, 255], "as its class");
    // On another frame before its map is there.
    window.key(Key::D);
    window.sees("Objects: No labels to show yet");
    window.misses("Objects: chair 1");
}

#[test]
fn two_layers_are_compared_and_their_border_follows_the_drag() {
    let mut window = Window::demo();
    window.key(Key::W);
    assert!(window.model().settings.compare);
    window.add_class("wall");
    window.click_through(&["Layer on the left", Layer::Entropy.name()]);
    let settings = &window.model().settings;
    assert_eq!(
        (settings.other_layer, settings.layer),
        (Layer::Entropy, Layer::Labels)
    );
    let from = window.rect("Border between the layers").center();
    let to = from + egui::vec2(-100.0, 0.0);
    window.drag(PointerButton::Primary, &[from, from + egui::vec2(-30.0, 5.0), to]);
    let at = window.rect("Border between the layers").center();
    assert!((at.x - to.x).abs() < 1.0, "{at} for {to}");
    assert_eq!(window.strokes(), 0);
    // Beside the handle both sides are drawn on.
    for side in [-60.0, 60.0] {
        window.drag(PointerButton::Primary, &[at + egui::vec2(side, 0.0)]);
    }
    assert_eq!(window.strokes(), 2);
    let before = window.model().settings.split;
    window.focus("Border between the layers");
    window.key(Key::ArrowRight);
    assert!(window.model().settings.split > before + 0.01);
    assert_eq!(window.frame_index(), 0);
    window.click("Compare two layers (W)");
    window.misses("Border between the layers");
}

#[test]
fn the_field_is_rendered_only_while_it_is_shown_and_once_for_a_frame() {
    let mut window = Window::demo();
    let of_frame = |window: &Window, frame: usize| window.workspace().scene.frames[frame].viewpoint();
    let of_first = of_frame(&window, 0);
    assert!(window.worker().asked_views().is_empty());
    window.click_through(&["Layer", Layer::Rendered.name()]);
    assert_eq!(window.worker().asked_views(), [of_first]);
    window.sees("Field colour: The view is being rendered");
    window.worker().events.send(rendered(of_first, 300)).unwrap();
    window.until("the view is shown", |app| {
        app.canvas().frame().is_some_and(|frame| frame.view().is_some())
    });
    window.sees("Field colour: Field colour, after 300 training steps");
    assert_eq!(window.frame().depth_at([9, 9]), Some((2.0, false)));
    window.click_through(&["Layer", Layer::RenderedLabels.name()]);
    window.sees("Field labels: The field is learning the labels");
    window.click_through(&["Layer", Layer::RenderedDepth.name()]);
    window.sees("Field depth: Field depth, after 300 training steps");
    window.key(Key::D);
    assert!(window.frame().view().is_none());
    assert_eq!(window.worker().asked_views(), [of_frame(&window, 1)]);
    // One that comes late is of another frame.
    window.tell(rendered(of_first, 400));
    assert!(window.frame().view().is_none());
}

#[test]
fn a_frame_never_has_the_overlay_of_another_one_or_an_older_one() {
    let mut window = Window::demo();
    window.worker().publish(0, 3, 1);
    window.harness.run_steps(3);
    assert!(window.frame().map().is_some());
    window.key(Key::D);
    assert!(window.frame().map().is_none());
    let palette = window.workspace().document.palette();
    let content = window.frame().content(Layer::Labels, palette);
    assert!(content.unwrap().over.is_none());
    window.key(Key::A);
    assert_eq!(window.frame().map().unwrap().map.frame, 0);
    window.worker().publish(0, 5, 2);
    window.worker().publish(0, 4, 1);
    window.harness.run_steps(3);
    assert_eq!(window.frame().map().unwrap().map.labels()[0], 2);
    // Of the same labels, as when votes or a prior arrive.
    window.worker().publish(0, 5, 3);
    window.harness.run_steps(3);
    assert_eq!(window.frame().map().unwrap().map.labels()[0], 3);
}

#[test]
fn strokes_are_marked_where_they_are_undisputed() {
    let mut window = Window::demo();
    window.add_class("wall");
    window.click_through(&["Layer", Layer::Disagreement.name()]);
    window.publish(0, 1);
    window.sees("Disagreement: Nothing is labelled in this frame: no strokes, no imported image");
    window.click_canvas(0.0, 0.0);
    window.until("the strokes are judged", |app| {
        let (Some(open), Some(frame)) = (app.model().workspace(), app.canvas().frame()) else {
            return false;
        };
        let content = frame.content(Layer::Disagreement, open.document.palette());
        let over = content.and_then(|content| content.over);
        over.is_some_and(|over| over.greyed && over.texels.values().contains(&1))
    });
    window.sees(
        "Disagreement: Your stroke, and the others say otherwise, Labelled, and undisputed, \
         Not labelled by hand or import",
    );
}

#[test]
fn a_frame_whose_image_vanished_says_so_in_a_sentence_until_it_is_there_again() {
    let root = tempfile::tempdir().unwrap();
    let folder = root.path().join("room");
    write_replica(&scene(SceneSource::Demo), &folder, None).unwrap();
    let image = folder.join(format!("rgb/rgb_{VANISHING}.png"));
    let bytes = std::fs::read(&image).unwrap();
    let mut window = Window::opened(root.path(), Target::Scene(SceneSource::Folder(folder)));
    let unreadable = |app: &App| app.canvas().frame()?.unreadable().map(str::to_owned);
    let has_image = |app: &App| {
        let palette = app.model().workspace().unwrap().document.palette();
        let content = app.canvas().frame().unwrap().content(Layer::Color, palette);
        content.is_some_and(|content| content.picture.is_some())
    };
    window.until("the first image is shown", has_image);
    assert_eq!(unreadable(window.harness.state()), None);

    window.act(Command::GoToFrame(VANISHING));
    window.until("the image is missed", |app| unreadable(app).is_some());
    let sentence = unreadable(window.harness.state()).unwrap();
    for part in ["can no longer be read", "put the capture back"] {
        assert!(sentence.contains(part), "{part} is not in: {sentence}");
    }
    assert!(sentence.contains(&image.display().to_string()), "{sentence}");
    window.sees(&sentence);

    std::fs::write(&image, bytes).unwrap();
    window.act(Command::GoToFrame(0));
    window.act(Command::GoToFrame(VANISHING));
    window.until("the image is back", has_image);
    assert_eq!(unreadable(window.harness.state()), None);
    window.misses(&sentence);
}

#[test]
fn a_window_that_has_nothing_to_tell_is_not_drawn_again() {
    let mut window = Window::demo();
    window.add_class("wall");
    window.worker().publish_all(window.generation(), 1);
    window.focus("New class");
    let asks_for_another = |window: &Window| {
        let mut outputs = window.harness.output().viewport_output.values();
        outputs.any(|output| output.repaint_delay < Duration::MAX)
    };
    // Notes and the like are gone after a while, and threads have told what they had to; the cursor of the field stays.
    let end = Instant::now() + Duration::from_secs(20);
    let mut quiet = 0;
    while quiet < 10 {
        assert!(Instant::now() < end, "{:?}", window.harness.ctx.repaint_causes());
        std::thread::sleep(Duration::from_millis(20));
        window.harness.step();
        quiet = if asks_for_another(&window) { 0 } else { quiet + 1 };
    }
}
