//! Saving, recovering, exporting, importing.

use egui::accesskit::Role;
use egui::{Key, Modifiers};
use egui_kittest::kittest::Queryable;
use inplace_model::Command;
use inplace_model::dialogs::Dialog;
use inplace_ui::Target;

use crate::stand::*;

#[test]
fn work_that_was_never_saved_is_recovered_and_a_saved_project_opens_again_with_strokes_and_maps() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("room.inplace");
    let mut window = Window::with_demo(folder.path());
    window.label("wall");
    window.close();
    let mut window = Window::with_demo(folder.path());
    assert_eq!(window.strokes(), 1);
    window.sees("Your earlier work on this scene was recovered: 1 stroke on 1 frame.");
    window.publish(0, 1);
    window.save_as(&file);
    assert!(!folder.path().join("autosave.inplace").exists());
    window.close();
    let window = Window::opened(folder.path(), Target::Path(file));
    window.sees("wall, 1 stroke");
    assert_eq!(window.frame().map().unwrap().map.labels()[0], 1);
}

#[test]
fn the_file_without_a_name_goes_as_soon_as_a_name_can_be_had() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    window.label("wall");
    for name in ["no/such/folder.inplace", "room.inplace"] {
        // Both before anything is answered.
        let save = Command::SaveTo(folder.path().join(name));
        window.harness.state_mut().update(save);
    }
    window.until("the project is saved", |app| {
        app.model().project.as_ref().is_some_and(|project| project.named)
    });
    assert!(!folder.path().join("autosave.inplace").exists());
}

#[test]
fn an_export_says_where_its_files_are_and_what_was_chosen_is_kept_for_the_next_time() {
    let folder = tempfile::tempdir().unwrap();
    let out = folder.path().join("out");
    let mut window = Window::with_demo(folder.path());
    window.add_class("wall");
    window.worker().publish_all(1, 1);
    window.press(Modifiers::COMMAND, Key::E);
    let field = window
        .harness
        .get_by_role_and_label(Role::TextInput, "Export folder");
    assert!(field.is_focused(), "it can be typed into at once");
    window.pick("Class numbers", "NYU-40");
    window.replace_text("Export folder", out.to_str().unwrap());
    window.until_exported();
    window.sees(&format!("Exported {FRAMES} frames"));
    window.sees(out.to_str().unwrap());
    let files = [
        "labels/rgb_0.png",
        "entropy/rgb_4.png",
        "classes.json",
        "strokes.json",
    ];
    for file in files {
        assert!(out.join(file).is_file(), "{file} is missing");
    }
    let classes = std::fs::read_to_string(out.join("classes.json")).unwrap();
    assert!(classes.contains("174"), "the colour of NYU-40's wall: {classes}");
    window.press(Modifiers::COMMAND, Key::E);
    let state = window.model();
    let Some(Dialog::Export(choice)) = &state.dialog else {
        panic!("{:?}", state.dialog);
    };
    assert_eq!(choice.ids.map(|palette| palette.name), Some("NYU-40"));
    assert_eq!(choice.folder(), out);
}

/// What the window was told in the last frame.
fn told(window: &Window, command: &egui::ViewportCommand) -> bool {
    let outputs = window.harness.output().viewport_output.values();
    outputs
        .flat_map(|output| &output.commands)
        .any(|told| told == command)
}

#[test]
fn an_export_is_started_once_and_can_be_cancelled_and_a_window_that_is_closed_meanwhile_waits_for_it() {
    use egui::ViewportCommand::{CancelClose, Close};
    let folder = tempfile::tempdir().unwrap();
    let (out, other) = (folder.path().join("out"), folder.path().join("other"));
    let mut window = Window::with_demo(folder.path());
    window.add_class("wall");
    // It waits for maps that never come.
    window.export(&out);
    assert!(window.is_exporting());
    window.sees("Getting the newest maps");
    window.export(&other);
    window.sees("An export is under way: wait for its end, or cancel it.");
    window.click("Cancel export");
    window.until("the export has ended", |app| app.model().export.is_none());
    let nothing = "The export was cancelled; nothing was written to";
    window.sees(&format!("{nothing} {}.", out.display()));
    assert!(!out.exists() && !other.exists());
    // The next one is not cancelled.
    window.worker().publish_all(1, 1);
    window.export(&other);
    window.until_exported();
    assert!(other.join("classes.json").is_file());
    // The maps do not follow this.
    window.add_class("floor");
    window.export(&out);
    let close = |window: &mut Window| {
        let root = egui::ViewportId::ROOT;
        let viewport = window.harness.input_mut().viewports.entry(root);
        viewport.or_default().events.push(egui::ViewportEvent::Close);
        window.harness.step();
        let answers = [CancelClose, Close].map(|command| told(window, &command));
        let viewport = window.harness.input_mut().viewports.entry(root);
        viewport.or_default().events.clear();
        window.harness.run_steps(2);
        answers
    };
    assert_eq!(close(&mut window), [true, false]);
    assert!(window.is_exporting());
    window.sees("The window closes when the export has ended; close it again to cancel the export.");
    assert_eq!(close(&mut window), [true, true]);
    assert!(!window.is_exporting());
    assert_eq!(close(&mut window), [false, false]);
}

#[test]
fn label_images_are_imported_undone_removed_and_kept_in_the_project() {
    let folder = tempfile::tempdir().unwrap();
    let images = folder.path().join("predictions");
    std::fs::create_dir(&images).unwrap();
    let imported = |window: &Window| window.labels().imported.clone();
    {
        let mut window = Window::with_demo(folder.path());
        window.click_through(&["File", "Import labels..."]);
        window.replace_text("Folder of label images", images.to_str().unwrap());
        window.until_told();
        assert!(imported(&window).is_none());

        let image = image::GrayImage::from_pixel(WIDTH, HEIGHT, image::Luma([7]));
        image.save(images.join("rgb_1.png")).unwrap();
        window.worker().received();
        window.click_through(&["File", "Import labels..."]);
        window.sees("They may be wrong: your strokes correct them on what they are connected with.");
        window.focus("Trust in the imported pixels");
        (0..10).for_each(|_| window.key(Key::ArrowRight));
        window.sees("Every labelled pixel is right, as your strokes are.");
        window.type_into("Folder of label images", images.to_str().unwrap());
        window.until_window("the images are imported", |window| imported(window).is_some());
        window.sees("class 7, 0 strokes");
        window.click("Actions for class 7");
        window.sees("Delete with its labels");
        window.key(Key::Escape);
        assert!(window.worker().told_labels().unwrap().0.imported.is_some());
        window.press(Modifiers::COMMAND, Key::Z);
        assert!(imported(&window).is_none());
        assert!(window.workspace().document.classes().is_empty());
        window.press(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z);
        window.click_through(&["File", "Remove imported labels"]);
        assert!(imported(&window).is_none());
        window.press(Modifiers::COMMAND, Key::Z);
        assert!(imported(&window).is_some());
        window.close();
    }
    let window = Window::with_demo(folder.path());
    let images = imported(&window).unwrap();
    assert_eq!((images.maps.len(), images.maps[0].frame), (1, 1));
    assert!(images.trust.is_right());
    window.sees("Your earlier work on this scene was recovered: 0 strokes and imported labels.");
}
