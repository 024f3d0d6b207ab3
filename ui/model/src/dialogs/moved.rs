//! Where the scene of a project is now.

use std::path::PathBuf;

/// The question where the scene of a project is now, with the answer so far.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct MovedScene {
    /// The project file.
    pub project: PathBuf,
    /// Where it is not.
    pub missing: PathBuf,
    /// The folder typed so far.
    pub path: String,
    /// What was wrong with the last answer.
    pub problem: Option<String>,
}

impl MovedScene {
    /// The scene is not at `missing`; `problem` says what was wrong with that as an answer.
    pub fn new(project: PathBuf, missing: PathBuf, problem: Option<String>) -> Self {
        let path = match &problem {
            Some(_) => missing.display().to_string(),
            None => String::new(),
        };
        Self {
            project,
            missing,
            path,
            problem,
        }
    }
}
