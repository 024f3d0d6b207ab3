//! Every control has a name for screen readers, in every state of the window.

use std::collections::BTreeSet;

use egui::Key;
use egui::accesskit::{Action as Request, Role};
use egui_kittest::kittest::{NodeT, Queryable};
use inplace_model::Command;
use inplace_model::dialogs::{AddClasses, ClassUse, Dialog};
use inplace_model::layer::Layer;

use crate::stand::*;
use crate::suggestions::place;

/// The controls without a name, each in words.
fn nameless(window: &Window) -> BTreeSet<String> {
    let root = window.harness.root();
    let mut found = BTreeSet::new();
    let mut controls = 0;
    for node in root.children_recursive() {
        let node = node.accesskit_node();
        let answers = |request| node.data().supports_action(request);
        // Scroll bars have no names anywhere: they say how far their contents are scrolled.
        let unnamed = node.is_hidden() || node.role() == Role::ScrollBar;
        if unnamed || !(answers(Request::Focus) || answers(Request::Click)) {
            continue;
        }
        controls += 1;
        let has = |text: Option<String>| text.is_some_and(|text| !text.trim().is_empty());
        // What is typed into a field is not what the field is for.
        let may_be_its_value = !matches!(node.role(), Role::TextInput | Role::MultilineTextInput);
        let named = has(node.label()) || may_be_its_value && has(node.value());
        if !named {
            found.insert(format!("{:?} at {:?}", node.role(), node.raw_bounds()));
        }
    }
    assert!(controls > 5, "the window has {controls} controls");
    found
}

fn assert_named(window: &mut Window, state: &str) {
    window.harness.run_steps(3);
    let found = nameless(window);
    assert!(found.is_empty(), "without a name, {state}: {found:#?}");
}

#[test]
fn every_control_of_the_start_page_of_an_open_scene_and_of_its_dialogs_has_a_name() {
    let folder = tempfile::tempdir().unwrap();
    let mut window = Window::with_demo(folder.path());
    assert_named(&mut window, "in a scene without labels");
    window.close();
    assert_named(&mut Window::new(folder.path(), None), "on the start page");
    let clicks = [(0, "wall", [-40.0, 0.0]), (0, "floor", [40.0, 0.0])];
    let mut window = Window::with_demo(folder.path()).labelled(&clicks);
    let generation = window.generation();
    window.worker().publish_all(generation, 1);
    window.suggest(
        generation,
        [0, 1].map(|frame| place(frame, [20, 20], &[1])).into(),
    );
    window.until("the suggestions are listed", |app| {
        let workspace = app.model().workspace();
        workspace.is_some_and(|workspace| workspace.suggestions().listed.len() == 2)
    });
    assert_named(&mut window, "in a scene with labels");
    window.act(Command::NextSuggestion);
    assert_named(&mut window, "at a suggestion");
    let stroke = *window.labels().strokes.keys().next().unwrap();
    window.act(Command::GoToStroke(stroke));
    assert_named(&mut window, "with a stroke selected");
    window.key(Key::T);
    assert_named(&mut window, "with the progress shown");
    window.key(Key::W);
    assert_named(&mut window, "with two layers compared");
    for layer in Layer::ALL {
        window.act(Command::ChooseLayer(layer));
        assert_named(&mut window, layer.name());
    }
    window.key(Key::V);
    assert_named(&mut window, "in the 3D view");
    for dialog in [
        Dialog::open(),
        Dialog::SaveAs(String::new()),
        Dialog::ReplaceFile("there.inplace".into()),
        Dialog::export(),
        Dialog::import(),
        Dialog::Compare(String::new()),
        Dialog::SaveClasses(String::new()),
        Dialog::AddClasses(Box::new(AddClasses::new(0, Vec::new()))),
        Dialog::Settings(None),
        Dialog::Help,
    ] {
        let state = format!("in {dialog:?}");
        window.act(Command::Show(Some(dialog)));
        assert!(window.model().dialog.is_some(), "{state}");
        assert_named(&mut window, &state);
        window.act(Command::Show(None));
    }
    window.act(Command::FindClass(ClassUse::Choose));
    assert_named(&mut window, "in the class finder");
    window.act(Command::Show(None));
    window.harness.get_by_label("File").click();
    assert_named(&mut window, "in the File menu");
}
