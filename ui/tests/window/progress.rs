//! How far the labelling has come, and the frames one is after.

use egui::Key;
use egui_kittest::kittest::Queryable;
use inplace_core::guide::Suggestion;
use inplace_core::guide::audit::Verdict;
use inplace_core::labels::StrokeId;
use inplace_core::session::{self, Event, Status, StrokeCheck};
use inplace_model::Command;
use inplace_model::frames::{FrameFilter, FrameOrder};
use inplace_model::model::Side;

use crate::stand::*;

/// Three clicks of the first class, one of the second.
const CLICKS: [(usize, &str, [f32; 2]); 4] = [
    (0, "wall", [-90.0, -60.0]),
    (0, "wall", [30.0, -45.0]),
    (3, "wall", [-70.0, 20.0]),
    (3, "door", [60.0, 20.0]),
];

/// The worker's answer: this entropy for every pixel of the frames, and what it thinks of the strokes.
fn answer(window: &mut Window, entropy: [u16; FRAMES], contradicted: &[(u64, u16)]) {
    let worker = window.worker();
    let generation = window.generation();
    for (frame, entropy) in entropy.into_iter().enumerate() {
        worker.publish_with(frame, generation, 1, entropy);
    }
    // The only door cannot be checked.
    let strokes = window.labels().strokes.iter().filter(|(_, own)| own.class == 1);
    let checked = strokes.map(|(&stroke, own)| {
        let other = contradicted.iter().find(|(id, _)| *id == stroke.0);
        StrokeCheck {
            stroke,
            class: other.map_or(own.class, |&(_, class)| class),
            contradicting: if other.is_some() { 1.0 } else { 0.0 },
        }
    });
    let checks = Event::StrokeChecks {
        generation,
        checks: checked.collect(),
        accuracy: Some(0.5),
    };
    worker.events.send(checks).unwrap();
    window.until("the frames are summed up", move |app| {
        let overview = &app.model().workspace().unwrap().overview;
        let all = entropy.iter().enumerate().all(|(frame, &entropy)| {
            let summary = overview.frames.facts(frame).summary;
            let mean = summary.map(|summary| summary.mean_entropy);
            mean.is_some_and(|mean| (mean - f32::from(entropy) / 10_000.0).abs() < 1e-4)
        });
        all && overview.accuracy.is_some()
    });
}

#[test]
fn the_progress_says_what_is_missing_and_leads_to_contradicted_strokes() {
    let mut window = Window::demo().labelled(&CLICKS);
    let mut received = window.worker().received().into_iter();
    assert!(received.any(|command| matches!(command, session::Command::CheckStrokes)));
    window.key(Key::T);
    window.sees("Not yet: the labels have not spread over the frames so far.");
    answer(&mut window, [1000; FRAMES], &[(3, 2)]);
    let overview = &window.workspace().overview;
    let contradicted: Vec<StrokeId> = overview.contradicted.keys().copied().collect();
    assert_eq!(contradicted, [StrokeId(3)]);
    assert_eq!(overview.evidence.checked, 3);
    window.sees_part("look whether the 1 of 3 strokes that the others contradict");
    window.sees("2 of 5 frames");
    window.sees("2 of 3 checked");
    window.act(Command::GoToFrame(1));
    window.click("wall at rgb_3: the others say door");
    assert_eq!(window.frame_index(), 3);
    window.act(Command::MergeClass(1, 2));
    assert!(window.workspace().overview.contradicted.is_empty());
    window.act(Command::Undo);

    answer(&mut window, [1000, 1000, 8000, 1000, 1000], &[]);
    window.sees("Nearly: 20% of the pixels are unclear, most in rgb_2.");
    answer(&mut window, [1000; FRAMES], &[]);
    window.sees("Yes: 100% of the pixels are clear, and all 3 strokes that could be checked agree.");
    let shares = [0.04, 0.03, 0.02, 0.02, 0.01, 0.5].into_iter();
    let places = shares.map(|share| Suggestion {
        share,
        ..suggestion(0)
    });
    window.suggest(window.generation(), places.collect());
    window.sees("The next 5 labels would settle about 12% of the scene.");
    window.click("Label next");
    assert_eq!(window.model().side, Side::LabelNext);
    window.misses("Good enough to export?");
}

#[test]
fn the_log_survives_reopening_the_project() {
    let folder = tempfile::tempdir().unwrap();
    {
        let mut window = Window::with_demo(folder.path()).labelled(&CLICKS);
        let status = Status {
            mean_entropy: Some(0.2),
            held_out_psnr: Some(22.0),
            ..Status::default()
        };
        window.tell(Event::Status(status));
        window.key(Key::T);
        window.sees("Charts over");
        // The window is low, so the training is a line until it is unfolded.
        window.sees("29% unsure, 22.0 dB");
        window.click("Show the training in full");
        // In a chart, and among the figures of the training below it.
        assert_eq!(window.harness.get_all_by_label("29% unsure").count(), 2);
        window.click("Fold the training");
        assert_eq!(window.harness.get_all_by_label("29% unsure").count(), 1);
        window.click("strokes");
        window.close();
    }
    let window = Window::with_demo(folder.path());
    let samples = window.workspace().overview.log.samples.to_vec();
    assert_eq!(samples.len(), 1);
    assert_eq!((samples[0].strokes, samples[0].entropy), (4, Some(0.2)));
}

#[test]
fn frames_are_found_by_number_name_and_filter_and_a_and_d_go_through_those_shown() {
    let mut window = Window::demo().labelled(&CLICKS);
    for (text, frame) in [("rgb_1", 1), ("4", 3), ("RGB_2", 2)] {
        window.type_into("Go to frame", text);
        assert_eq!(window.frame_index(), frame, "{text}");
    }
    window.type_into("Go to frame", "hall");
    window.sees("No frame has this number, or a name with \"hall\" in it.");
    assert_eq!(window.frame_index(), 2);
    window.act(Command::GoToFrame(3));
    answer(&mut window, [1000, 7000, 1000, 1000, 8000], &[(3, 2)]);
    let frame = |window: &Window, stem: &str| {
        let name = format!("Frame {stem}:");
        window.harness.query_by_label_contains(&name).is_some()
    };
    for name in ["All 5", "Unlabelled 3", "Uncertain 2", "Disagreeing 1"] {
        window.sees(name);
    }
    window.click("Unlabelled 3");
    assert!(frame(&window, "rgb_1") && !frame(&window, "rgb_0") && !frame(&window, "rgb_3"));
    assert_eq!(window.frame_index(), 3);
    window.key(Key::D);
    assert_eq!(window.frame_index(), 4);
    window.key(Key::D);
    assert_eq!(window.frame_index(), 4);
    for expected in [2, 1, 1] {
        window.key(Key::A);
        assert_eq!(window.frame_index(), expected);
    }
    window.act(Command::FilterFrames(FrameFilter::Uncertain));
    window.act(Command::OrderFrames(FrameOrder::Uncertainty));
    assert_eq!(window.workspace().overview.frames.shown, [4, 1]);
    // From one that is surer than both and not shown.
    window.act(Command::GoToFrame(2));
    for (key, expected) in [(Key::A, 1), (Key::A, 4), (Key::D, 1)] {
        window.key(key);
        assert_eq!(window.frame_index(), expected);
    }
    window.act(Command::FilterFrames(FrameFilter::Disagreeing));
    window.sees_part("Frame rgb_3: 2 strokes, 1 contradicted");
    answer(&mut window, [1000; FRAMES], &[]);
    window.sees("No frame is disagreeing: nothing contradicts your strokes.");
    window.key(Key::D);
    assert_eq!(window.frame_index(), 1);
}

#[test]
fn frames_are_marked_as_checked_and_an_audit_is_judged_by_keys_and_both_are_kept() {
    let folder = tempfile::tempdir().unwrap();
    {
        let mut window = Window::with_demo(folder.path()).labelled(&CLICKS);
        answer(&mut window, [1000; FRAMES], &[]);
        window.act(Command::GoToFrame(2));
        let generation = window.generation();
        window.key(Key::M);
        // The maps stay as they are.
        assert_eq!(window.generation(), generation);
        window.sees_part("Frame rgb_2: no strokes, checked, ");
        window.sees("Unchecked 4");
        window.key(Key::T);
        window.sees("1 of 5 checked");
        window.act(Command::GoToFrame(0));
        window.act(Command::Undo);
        assert_eq!((window.labels().checked.len(), window.frame_index()), (0, 2));
        window.act(Command::Redo);

        window.act(Command::DrawAudit(5));
        window.until("places are drawn", |app| {
            let workspace = app.model().workspace();
            workspace.is_some_and(|workspace| workspace.auditing.at == Some(0))
        });
        window.sees_part("Place 1 of 300: is this wall?");
        for key in [Key::Y, Key::N, Key::X] {
            window.key(key);
        }
        window.sees_part("Place 4 of 300");
        window.sees("3 of 300 places judged");
        window.key(Key::Escape);
        assert_eq!(window.workspace().auditing.at, None);
        let wrong = window.workspace().audited_place(1).unwrap();
        window.act(Command::GoToFrame((wrong.0 + 1) % FRAMES));
        window.click(&format!("not wall at rgb_{}", wrong.0));
        assert_eq!(
            (window.frame_index(), window.workspace().auditing.at),
            (wrong.0, Some(1))
        );
        window.close();
    }
    let window = Window::with_demo(folder.path());
    let audit = window.workspace().auditing.audit.as_ref().unwrap();
    let verdicts = audit.places.iter().filter_map(|place| place.verdict);
    let said = [Verdict::Right, Verdict::Wrong, Verdict::Skipped];
    assert_eq!(verdicts.collect::<Vec<_>>(), said);
    assert!(window.labels().checked.contains(&2));
}
