//! The record that the window writes, and what a hand does while it reads it.

use std::fs;
use std::path::Path;

use serde_json::Value;

use crate::Window;

/// Name of the record in the window's home; the arguments that ask for it are `--trace` and this.
pub const TRACE: &str = "trace.jsonl";

/// What the record says so far: a line for each event.
#[derive(Debug)]
pub struct Trace(Vec<Value>);

impl Trace {
    /// The newest event of a kind.
    pub fn last(&self, event: &str) -> Option<&Value> {
        self.0.iter().rev().find(|line| line["event"] == event)
    }

    /// How many events of a kind there are.
    pub fn count(&self, event: &str) -> usize {
        self.0.iter().filter(|line| line["event"] == event).count()
    }

    /// How many strokes there are.
    pub fn strokes(&self) -> u64 {
        let labels = self.last("labels");
        labels.and_then(|line| line["strokes"].as_u64()).unwrap_or(0)
    }

    /// The classes of the list, in its order: id and name.
    pub fn classes(&self) -> Vec<(u64, String)> {
        let listed = self.last("classes").and_then(|line| line["classes"].as_array());
        let class = |class: &Value| Some((class["id"].as_u64()?, class["name"].as_str()?.to_owned()));
        listed.into_iter().flatten().filter_map(class).collect()
    }
}

impl Window {
    /// What the window's record says so far.
    pub fn trace(&self) -> Trace {
        let text = fs::read_to_string(self.home.path().join(TRACE)).unwrap_or_default();
        let whole = text.split_inclusive('\n').filter(|line| line.ends_with('\n'));
        let lines = whole.map(|line| serde_json::from_str(line).expect("lines are JSON"));
        Trace(lines.collect())
    }

    /// Waits until something holds of the record.
    #[track_caller]
    pub fn until_told<T>(&self, what: &str, mut answer: impl FnMut(&Trace) -> Option<T>) -> T {
        self.until(what, |window| answer(&window.trace()))
    }

    /// Waits until the maps of all frames follow the labels.
    #[track_caller]
    pub fn follow(&self) {
        self.until_told("the maps of all frames follow", |trace| {
            (trace.last("maps")?["generation"] == trace.last("labels")?["generation"]).then_some(())
        });
    }

    /// Opens a text field, types into it and confirms.
    #[track_caller]
    pub fn fill(&self, open: impl FnOnce(&Self), text: &str) {
        let has_field =
            |is_there: bool| move |trace: &Trace| (trace.last("typing")?["field"] == is_there).then_some(());
        open(self);
        self.until_told("a field has the keyboard", has_field(true));
        self.screen.key("ctrl+a");
        self.screen.type_text(text);
        self.screen.key("Return");
        self.until_told("the field is left", has_field(false));
    }

    /// Exports through the dialog into a folder that is not there yet.
    #[track_caller]
    pub fn export(&self, folder: &Path) {
        let path = folder.to_str().expect("the home has a plain name");
        self.fill(|window| window.screen.key("ctrl+e"), path);
        self.until_told("the files are written", |trace| {
            (trace.last("exported")?["folder"] == path).then_some(())
        });
    }
}
