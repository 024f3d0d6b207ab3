//! The window from the outside: a screen, a pointer and a keyboard, and the files that come of it.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, reason = "a test ends where it fails")]

use std::fs;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use image::RgbImage;
use inplace_core::labels::{LabelSet, Pixel, Stroke};
use inplace_core::project::Project;
use inplace_tests::{PATIENCE, Running, Small, Window, changed, class_ids, inplace, one_line, skip, until};

/// A part of the frame in view, whatever the panels around it: left, top, right, bottom.
const MIDDLE: [u32; 4] = [480, 260, 760, 480];
/// Two places in it, far from each other.
const PLACES: [[u32; 2]; 2] = [[620, 240], [620, 500]];

/// What a hand does in the window, and what came of it on the disk.
trait ByHand {
    fn labels(&self) -> Option<LabelSet>;
    fn until_kept(&self, classes: usize, strokes: usize) -> LabelSet;
    fn until_changed(&self, what: &str, before: &RgbImage, share: f64) -> RgbImage;
    fn answer(&self, open: &RgbImage, text: &str);
    fn choose_field(&self, place: [u32; 2]);
    fn export(&self, folder: &Path) -> bool;
}

impl ByHand for Window {
    /// The labels on the disk, read from a copy because the program has the file open.
    fn labels(&self) -> Option<LabelSet> {
        let copy = self.home.path().join("copy.inplace");
        fs::copy(self.autosave()?, &copy).ok()?;
        // A copy made in the middle of a commit may not open.
        let (_, contents) = Project::open(&copy).ok()?;
        Some(contents.history.labels().clone())
    }

    /// Waits until the disk holds so many classes and strokes.
    #[track_caller]
    fn until_kept(&self, classes: usize, strokes: usize) -> LabelSet {
        self.until(
            &format!("{classes} classes and {strokes} strokes are kept"),
            |window| {
                window
                    .labels()
                    .filter(|labels| labels.classes.len() == classes && labels.strokes.len() == strokes)
            },
        )
    }

    /// Waits until the picture of the scene has clearly changed; returns it.
    #[track_caller]
    fn until_changed(&self, what: &str, before: &RgbImage, share: f64) -> RgbImage {
        self.until(what, |window| {
            let now = window.screen.picture();
            (changed(before, &now, MIDDLE) > share).then_some(now)
        })
    }

    /// Types into a dialog's field, which has the keyboard, and confirms. The dialog darkens the window.
    fn answer(&self, open: &RgbImage, text: &str) {
        self.until_changed("a dialog covers the window", open, 0.5);
        self.screen.key("ctrl+a");
        self.screen.type_text(text);
        self.screen.key("Return");
    }

    /// Clicks into a text field and waits for its caret: what is typed before that is not for the field.
    ///
    /// Clicks again after a while, as a hand would: for a tenth of a second after a dialog was confirmed,
    /// clicks are still the dialog's.
    fn choose_field(&self, [x, y]: [u32; 2]) {
        let mut clicked: Option<Instant> = None;
        self.until("the field has a caret", |window| {
            if clicked.is_none_or(|at| at.elapsed() > Duration::from_secs(2)) {
                window.screen.click([x, y]);
                clicked = Some(Instant::now());
            }
            let picture = window.screen.picture();
            has_caret(&picture, [14, y - 14, 34, y + 14]).then_some(())
        });
    }

    /// Exports into a folder; false when a frame had no map yet.
    fn export(&self, folder: &Path) -> bool {
        let open = self.screen.picture();
        self.screen.key("ctrl+e");
        self.answer(&open, &folder.display().to_string());
        let start = Instant::now();
        while start.elapsed() < Duration::from_secs(5) {
            if folder.join("strokes.json").is_file() {
                return true;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        false
    }
}

/// Where the field for a new class is: the first box in the left panel.
fn new_class_field(picture: &RgbImage) -> [u32; 2] {
    const COLUMN: u32 = 150;
    let panel = picture.get_pixel(4, 400);
    let mut run = 0;
    for y in 40..400 {
        let pixel = picture.get_pixel(COLUMN, y);
        run = if pixel == panel || (run > 0 && pixel != picture.get_pixel(COLUMN, y - 1)) {
            0
        } else {
            run + 1
        };
        if run == 14 {
            return [COLUMN, y - 4];
        }
    }
    panic!("there is no field in the left panel");
}

/// Whether there is an upright line in a rectangle (left, top, right, bottom), taller than any letter.
fn has_caret(picture: &RgbImage, [left, top, right, bottom]: [u32; 4]) -> bool {
    (left..right).any(|x| {
        let bright = (top..bottom).filter(|&y| picture.get_pixel(x, y).0[1] > 120);
        bright.count() >= 14
    })
}

fn only_pixel(stroke: &Stroke) -> Pixel {
    stroke.lines[0][0]
}

#[test]
fn a_scene_is_labelled_exported_and_kept_by_hand() {
    let window = match Window::open(|folder| Small::get().write(folder), &[]) {
        Ok(window) => window,
        Err(missing) => return skip(&missing),
    };
    let opened = window.until("the frame is shown", |window| {
        let picture = window.screen.picture();
        let colors = (MIDDLE[0]..MIDDLE[2])
            .step_by(8)
            .flat_map(|x| (MIDDLE[1]..MIDDLE[3]).step_by(8).map(move |y| (x, y)))
            .map(|(x, y)| picture.get_pixel(x, y).0)
            .collect::<std::collections::HashSet<_>>();
        (colors.len() > 30).then_some(picture)
    });

    window.screen.click(PLACES[0]);
    window.answer(&opened, "wall");
    let labels = window.until_kept(1, 1);
    assert_eq!(labels.classes[0].name, "wall");
    let one_class = window.until_changed("the labels are shown", &opened, 0.5);

    window.choose_field(new_class_field(&one_class));
    window.screen.type_text("floor");
    window.screen.key("Return");
    let labels = window.until_kept(2, 1);
    assert_eq!(labels.classes[1].name, "floor");
    window.screen.click(PLACES[1]);
    let labels = window.until_kept(2, 2);
    window.until_changed("the second class is shown", &one_class, 0.1);

    let strokes: Vec<&Stroke> = labels.strokes.values().map(AsRef::as_ref).collect();
    assert_eq!([strokes[0].class, strokes[1].class], [1, 2]);
    let folder = window.home.path().join("labels-by-hand");
    window.until("every exported map shows both clicks", |window| {
        // Maps of the frames that are not in view follow the click after a moment.
        let _ = fs::remove_dir_all(&folder);
        if !window.export(&folder) {
            return None;
        }
        let mut seen = std::collections::BTreeSet::new();
        for frame in &Small::get().scene.frames {
            let path = folder.join("labels").join(format!("{}.png", frame.stem));
            let (width, height, labels) = class_ids(&path);
            assert_eq!((width, height), (frame.camera.width, frame.camera.height));
            seen.extend(labels);
        }
        let holds = strokes.iter().all(|stroke| {
            let stem = &Small::get().scene.frames[stroke.frame].stem;
            let (width, _, labels) = class_ids(&folder.join(format!("labels/{stem}.png")));
            let [x, y] = only_pixel(stroke);
            labels[(y * width + x) as usize] == stroke.class
        });
        (holds && seen.into_iter().eq([1, 2])).then_some(())
    });

    let Window {
        running,
        screen,
        id,
        home,
    } = window;
    screen.close_window(&id);
    let outcome = running.wait(PATIENCE);
    assert_eq!(outcome.code, Some(0), "{outcome:?}");
    let autosaved: Vec<PathBuf> = fs::read_dir(home.path().join("data/inplace/autosave"))
        .unwrap()
        .map(|entry| entry.unwrap().path())
        .collect();
    assert_eq!(autosaved.len(), 1, "{autosaved:?}");
    let (_, contents) = Project::open(&autosaved[0]).unwrap();
    assert_eq!(contents.history.labels(), &labels);
    assert_eq!(contents.maps.len(), Small::get().scene.frames.len());
}

#[test]
fn without_a_display_a_scene_is_refused_in_one_sentence() {
    let root = tempfile::tempdir().unwrap();
    let scene = root.path().join("room");
    Small::get().write(&scene);
    let outcome = Running::to_the_end(inplace().arg(&scene));
    assert_eq!(outcome.code, Some(1), "{outcome:?}");
    let line = one_line(&outcome.stderr);
    assert!(line.starts_with("there is no display"), "{line}");
    assert!(line.contains("DISPLAY"), "{line}");
}

#[test]
fn without_a_display_and_without_a_scene_the_demo_is_labelled() {
    let root = tempfile::tempdir().unwrap();
    let mut running = Running::start(inplace().current_dir(root.path()));
    until("the demo is being labelled", PATIENCE, || {
        assert!(running.ended().is_none(), "{}", running.stderr());
        root.path().join("inplace-demo/labels").is_dir().then_some(())
    });
    let line = running.stderr();
    let line = one_line(&line);
    assert!(
        line.contains("no display") && line.contains("./inplace-demo"),
        "{line}"
    );
}
