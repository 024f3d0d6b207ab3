//! A record of what happened in the window, for bug reports, studies and scripts: a line of JSON for each event.
//!
//! The events are found by comparing the model after each frame of the window with that of before, so that nothing
//! else has to know of the record. `docs/formats.md` describes them.

use std::fs::File;
use std::io::{LineWriter, Write};
use std::path::PathBuf;
use std::time::Instant;

use crossbeam_channel::{Sender, unbounded};
use inplace_core::guide::Suggestion;
use inplace_core::labels::Stroke;
use inplace_model::Model;
use inplace_model::exporting::ExportProgress;
use inplace_model::suggestions::Mode;
use inplace_model::versioned::Version;
use inplace_model::workspace::Workspace;
use serde_json::{Value, json};

/// The record; another thread writes it.
#[derive(Debug)]
pub struct Trace {
    lines: Sender<Value>,
    started: Instant,
    seen: Seen,
}

/// What was told last.
#[derive(Debug, Default, PartialEq)]
struct Seen {
    typing: bool,
    exported: Option<String>,
    project: Option<String>,
    scene: Option<u64>,
    labels: Option<u64>,
    classes: Option<Version>,
    maps: Option<u64>,
    list: Option<u64>,
    place: Whereabouts,
    compared: Option<String>,
    /// Places of the audit, and how many of them are judged.
    audit: Option<(usize, usize)>,
}

/// Where the person is among the suggestions.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
enum Whereabouts {
    #[default]
    Away,
    Looking,
    /// The place with this index of the list of this version.
    At(usize, u64),
}

impl Trace {
    /// Starts a record in this file, which is replaced.
    pub fn new(path: PathBuf) -> Self {
        let (lines, received) = unbounded::<Value>();
        let write = move || -> std::io::Result<()> {
            let mut file = LineWriter::new(File::create(&path)?);
            for line in received {
                writeln!(file, "{line}")?;
            }
            file.flush()
        };
        let failed = |error: std::io::Error| {
            eprintln!("inplace: the trace cannot be written ({error}); give a file in a folder that can be");
        };
        let thread = std::thread::Builder::new().name("inplace-trace".to_owned());
        // Without the thread there is no record, and nothing else is lost.
        if let Err(error) = thread.spawn(move || write().unwrap_or_else(failed)) {
            failed(error);
        }
        Self {
            lines,
            started: Instant::now(),
            seen: Seen::default(),
        }
    }

    /// Tells what has changed; `typing` = a text field has the keyboard.
    pub fn observe(&mut self, model: &Model, typing: bool) {
        // In JSON a path has to be text.
        let told = |path: &PathBuf| path.display().to_string();
        let exported = match &model.export {
            Some(ExportProgress::Finished(folder, ..)) => Some(told(folder)),
            _ => None,
        };
        let workspace = model.workspace();
        let suggestions = workspace.map(Workspace::suggestions);
        let comparison = workspace.and_then(|workspace| workspace.comparison.as_ref());
        let audit = workspace.and_then(|workspace| workspace.auditing.audit.as_ref());
        let now = Seen {
            typing,
            exported,
            project: model.project.as_ref().map(|project| told(&project.path)),
            scene: workspace.map(|workspace| workspace.serial),
            labels: workspace.map(|workspace| workspace.document.generation()),
            classes: workspace.map(|workspace| workspace.document.palette().version()),
            maps: workspace.and_then(|workspace| workspace.followed),
            list: suggestions.map(|suggestions| suggestions.version),
            place: suggestions.map_or(Whereabouts::Away, |suggestions| match suggestions.mode {
                Mode::Away => Whereabouts::Away,
                Mode::Looking(_) => Whereabouts::Looking,
                Mode::At(index) => Whereabouts::At(index, suggestions.version),
            }),
            compared: comparison.map(|comparison| comparison.other.name.clone()),
            audit: audit.map(|audit| {
                let judged = audit.places.iter().filter(|place| place.verdict.is_some());
                (audit.places.len(), judged.count())
            }),
        };
        if now == self.seen {
            return;
        }
        let before = std::mem::replace(&mut self.seen, now);
        let other_scene = before.scene != self.seen.scene;
        if before.typing != self.seen.typing {
            self.tell("typing", json!({ "field": typing }));
        }
        if other_scene && workspace.is_none() {
            self.tell("closed", json!({}));
        }
        if let Some(workspace) = workspace {
            if other_scene {
                self.tell("opened", opened(workspace));
            }
            if before.project != self.seen.project {
                self.tell("project", json!({ "file": self.seen.project }));
            }
            if other_scene || before.classes != self.seen.classes {
                let classes = workspace.document.classes();
                self.tell("classes", json!({ "classes": classes }));
            }
            // Before the labels: who reads of an answer shall know that its place is no longer at hand.
            if before.place != self.seen.place {
                self.tell("place", place(workspace, self.seen.place));
            }
            if other_scene || before.labels != self.seen.labels {
                self.tell("labels", labels(workspace));
            }
            if self.seen.maps.is_some() && before.maps != self.seen.maps {
                self.tell("maps", json!({ "generation": self.seen.maps }));
            }
            if other_scene || before.list != self.seen.list {
                let generation = workspace.suggestions().generation;
                let listed = workspace.suggestions().listed.iter();
                let list: Vec<Value> = listed.map(|place| suggestion(workspace, place)).collect();
                let line = json!({ "generation": generation, "suggestions": list });
                self.tell("suggestions", line);
            }
        }
        if before.compared != self.seen.compared {
            self.tell("compared", json!({ "with": self.seen.compared }));
        }
        if let Some((places, judged)) = self.seen.audit
            && before.audit != self.seen.audit
        {
            self.tell("audit", json!({ "places": places, "judged": judged }));
        }
        if before.exported != self.seen.exported
            && let Some(folder) = &self.seen.exported
        {
            self.tell("exported", json!({ "folder": folder }));
        }
    }

    fn tell(&self, event: &str, mut line: Value) {
        line["event"] = json!(event);
        line["seconds"] = json!(self.started.elapsed().as_secs_f64());
        // The thread is gone where the file could not be written, which it has said.
        let _ = self.lines.send(line);
    }
}

fn opened(workspace: &Workspace) -> Value {
    let scene = &workspace.scene;
    let frames = scene.frames.iter().map(|frame| &frame.stem).collect::<Vec<_>>();
    json!({ "scene": scene.name(), "frames": frames })
}

fn stem(workspace: &Workspace, frame: usize) -> &str {
    workspace.scene.frames.get(frame).map_or("", |frame| &frame.stem)
}

fn labels(workspace: &Workspace) -> Value {
    let document = &workspace.document;
    let newest = document.labels().strokes.last_key_value();
    let newest = newest.map(|(id, stroke)| {
        let Stroke {
            frame,
            class,
            radius,
            lines,
            object,
        } = stroke.as_ref();
        json!({
            "id": id,
            "frame": stem(workspace, *frame),
            "class": class,
            "object": object,
            "radius": radius,
            "lines": lines,
        })
    });
    json!({
        "generation": document.generation(),
        "strokes": document.labels().strokes.len(),
        "newest": newest,
    })
}

fn suggestion(workspace: &Workspace, suggestion: &Suggestion) -> Value {
    let classes = suggestion.classes.iter();
    let classes = classes.map(|likely| json!({ "id": likely.class, "probability": likely.probability }));
    json!({
        "frame": stem(workspace, suggestion.frame),
        "pixel": suggestion.pixel,
        "share": suggestion.share,
        "classes": classes.collect::<Vec<_>>(),
    })
}

fn place(workspace: &Workspace, place: Whereabouts) -> Value {
    match place {
        Whereabouts::Away => json!({ "mode": "away" }),
        Whereabouts::Looking => json!({ "mode": "looking" }),
        Whereabouts::At(index, _) => {
            let at = workspace.suggestions().listed.get(index);
            json!({
                "mode": "at",
                "number": index + 1,
                "suggestion": at.map(|at| suggestion(workspace, at)),
            })
        }
    }
}
