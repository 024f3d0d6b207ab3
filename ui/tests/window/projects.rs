//! The life of a project: opened lately, moved, open twice, dropped on the window, refused.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use egui::Key;
use egui_kittest::kittest::Queryable;
use inplace_core::scene::SceneSource;
use inplace_model::dialogs::Dialog;
use inplace_ui::Target;
use inplace_ui::app::App;

use crate::stand::*;

fn open_scene(folder: &Path, scene: &Path) -> Window {
    Window::opened(folder, Target::Scene(SceneSource::Folder(scene.to_path_buf())))
}

fn label_and_save(window: &mut Window, project: &Path) {
    window.label("wall");
    window.save_as(project);
}

#[test]
fn a_scene_is_on_the_start_page_with_its_picture_and_opens_again_right_after_it_was_closed() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("kitchen");
    std::fs::create_dir(&scene).unwrap();
    {
        let mut window = open_scene(folder.path(), &scene);
        window.add_class("wall");
        window.click_through(&["File", "Close scene"]);
        window.until("the picture is there", |app| {
            app.panels()
                .pictures
                .found()
                .any(|found| found.there && found.picture.is_some())
        });
        window.click("Open kitchen");
        window.until_open();
        window.worker().publish_all(window.generation(), 1);
        window.click_through(&["File", "Close scene", "Open kitchen"]);
        window.until_open();
        assert_eq!(window.workspace().document.classes().len(), 1);
        window.close();
    }
    std::fs::remove_dir(&scene).unwrap();
    let mut window = Window::new(folder.path(), None);
    window.until("the scene is missed", |app| {
        app.panels().pictures.found().any(|found| !found.there)
    });
    window.sees("kitchen (not found)");
    window.click("Remove kitchen from the list");
    window.misses("kitchen (not found)");
    window.sees("First steps");
    let pictures = folder.path().join("pictures");
    window.until("its picture is gone", |_| {
        std::fs::read_dir(&pictures).unwrap().count() == 0
    });
}

#[test]
fn a_saved_project_takes_the_place_of_its_scene_which_is_asked_for_where_it_has_moved() {
    let folder = tempfile::tempdir().unwrap();
    let [old, new, other] = ["old", "new", "other"].map(|name| folder.path().join(name));
    std::fs::create_dir(&old).unwrap();
    std::fs::create_dir(&other).unwrap();
    let project = folder.path().join("work.inplace");
    {
        let mut window = open_scene(folder.path(), &old);
        label_and_save(&mut window, &project);
        let recents = window.model().preferences.recents.iter();
        let recents: Vec<_> = recents
            .map(|recent| (recent.name.as_str(), recent.strokes))
            .collect();
        assert_eq!(recents, [("work", 1)]);
        window.click_through(&["File", "Open recent"]);
        let role = egui::accesskit::Role::Button;
        window.harness.get_by_role_and_label(role, "work");
        window.close();
    }
    std::fs::rename(&old, &new).unwrap();
    {
        let is_asked = |app: &App| matches!(app.model().dialog, Some(Dialog::Moved(_)));
        let mut window = Window::new(folder.path(), Some(Target::Project(project.clone())));
        window.until("it is asked", is_asked);
        let missing = "work.inplace labels a scene that is no longer at";
        window.sees(&format!("{missing} {}.", old.display()));
        window.type_into("Folder of the scene", other.to_str().unwrap());
        window.until("it is asked again", is_asked);
        let refused =
            "has none of the 5 frames of this project; choose the folder of the scene that was labelled.";
        window.sees(&format!("{}: {refused}", other.display()));
        window.replace_text("Folder of the scene", new.to_str().unwrap());
        window.until_open();
        assert_eq!(window.strokes(), 1);
        window.close();
    }
    let window = Window::opened(folder.path(), Target::Project(project));
    assert_eq!(window.workspace().scene.source, SceneSource::Folder(new));
    assert_eq!(window.strokes(), 1);
}

#[test]
fn what_is_open_in_one_window_is_refused_in_another() {
    let folder = tempfile::tempdir().unwrap();
    let project = folder.path().join("work.inplace");
    let mut first = Window::with_demo(folder.path());
    let refused = |target: Target, words: &str| {
        let mut second = Window::new(folder.path(), Some(target));
        second.until_told();
        assert!(second.model().workspace().is_none());
        second.says(words);
    };
    let demo = Target::Scene(SceneSource::Demo);
    refused(demo, "The demo scene: is open in another window");
    label_and_save(&mut first, &project);
    refused(
        Target::Project(project),
        "work.inplace: is open in another window",
    );
    first.close();
}

/// A file or folder that is dropped.
#[derive(Debug)]
struct Dropped(PathBuf);

impl egui::DroppedFile for Dropped {
    fn path(&self) -> &Path {
        &self.0
    }

    fn bytes(&self) -> Result<Vec<u8>, String> {
        Err("nobody reads what is dropped here".to_owned())
    }
}

#[test]
fn the_window_says_drop_to_open_and_opens_what_is_dropped_in_place_of_what_was_open() {
    let folder = tempfile::tempdir().unwrap();
    let scene = folder.path().join("kitchen");
    std::fs::create_dir(&scene).unwrap();
    // It looks like a scene.
    std::fs::write(scene.join("transforms.json"), "{}").unwrap();
    let mut window = Window::with_demo(folder.path());
    window.misses("Drop to open");
    let hovered = egui::HoveredFile {
        path: Some(scene.clone()),
        ..egui::HoveredFile::default()
    };
    window.harness.input_mut().hovered_files = vec![hovered];
    window.harness.run_steps(3);
    window.sees("Drop to open");
    window.harness.input_mut().hovered_files.clear();
    window.harness.run_steps(2);
    window.misses("Drop to open");
    let dropped = Arc::new(Dropped(scene.clone()));
    window.harness.input_mut().dropped_files = vec![dropped];
    window.harness.step();
    window.until("the scene is open", |app| {
        let source = app.model().workspace().map(|workspace| &workspace.scene.source);
        matches!(source, Some(SceneSource::Folder(folder)) if *folder == scene)
    });
}

/// Makes a project with one stroke, and damages it.
fn write_damaged_project(folder: &Path, project: &Path) {
    let mut window = Window::with_demo(folder);
    label_and_save(&mut window, project);
    window.close();
    let mut bytes = std::fs::read(project).unwrap();
    bytes[..4096].fill(0);
    std::fs::write(project, &bytes).unwrap();
}

#[test]
fn a_damaged_project_opens_from_its_backup_and_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let project = folder.path().join("work.inplace");
    write_damaged_project(folder.path(), &project);
    let window = Window::opened(folder.path(), Target::Project(project.clone()));
    assert_eq!(window.strokes(), 1);
    window.says("is damaged");
    window.says("its backup of");
    let aside = folder.path().join("work-damaged.inplace");
    window.says(&format!("the damaged file is now {}.", aside.display()));
    let kept = window.model().project.as_ref().unwrap();
    assert_eq!((kept.path.as_path(), kept.named), (project.as_path(), true));
    window.sees("saved");
}

#[test]
fn a_project_that_cannot_be_written_is_labelled_in_memory_and_saved_elsewhere() {
    let folder = tempfile::tempdir().unwrap();
    let project = folder.path().join("work.inplace");
    write_damaged_project(folder.path(), &project);
    // All the names that the damaged file could get.
    std::fs::write(folder.path().join("work-damaged.inplace"), "").unwrap();
    for number in 2..1000 {
        std::fs::write(folder.path().join(format!("work-damaged-{number}.inplace")), "").unwrap();
    }
    let mut window = Window::opened(folder.path(), Target::Project(project.clone()));
    window.sees("not saved");
    window.says("Until then your work is in memory only.");
    window.click_canvas(0.2, 0.2);
    assert_eq!(window.strokes(), 2);
    let elsewhere = folder.path().join("elsewhere.inplace");
    window.save_as(&elsewhere);
    window.until_saved();
    window.close();
    let reopened = inplace_core::project::Contents::read(&elsewhere).unwrap();
    assert_eq!(reopened.history.labels().strokes.len(), 2);
}

#[test]
fn a_path_that_cannot_be_opened_is_one_sentence_on_the_start_page_until_escape() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("broken.inplace");
    std::fs::write(&file, "not a project").unwrap();
    let mut window = Window::new(folder.path(), Some(Target::Path(file)));
    window.until_told();
    window.sees("Open a folder...");
    window.sees("Error");
    window.says("broken.inplace");
    window.key(Key::Escape);
    assert_eq!(window.messages(), "");
}
