//! What has to be done outside of the model.

use std::path::PathBuf;
use std::time::Duration;

use inplace_core::session::{self, Session, SessionOptions};

use crate::dialogs::Purpose;
use crate::jobs::Job;
use crate::preferences::RecentPlace;
use crate::project_session::ProjectSession;
use crate::workspace::source::FrameSource;

/// Something to do outside of the model. The window carries effects out in order, right after the update that
/// returned them.
pub enum Effect {
    /// Starts a session for what is being opened; the answer is `Input::SessionStarted`.
    StartSession(Box<SessionOptions>),
    /// Asks the session's worker to do something.
    Session(session::Command),
    /// Ends a project session.
    CloseProject(Box<ProjectSession>, Option<Session>),
    /// Runs a job on a thread.
    Start(Job),
    /// Asks for a path with the system's dialog.
    Browse(Purpose),
    /// Shows a folder in the file manager.
    ShowFolder(PathBuf),
    /// Takes a picture of what is open, for the list of what was opened lately.
    TakePicture(RecentPlace, FrameSource),
    /// Removes the picture of something that was opened lately.
    ForgetPicture(RecentPlace),
    /// Takes the keyboard from the control that has it.
    GiveUpFocus,
    /// Closes the window.
    CloseWindow,
    /// The window was to be closed, and stays open.
    KeepWindowOpen,
    /// Draws the window again after a while.
    WakeIn(Duration),
    /// A click led to labels of this generation, on this frame.
    Labelled {
        /// Generation of the labels.
        generation: u64,
        /// Index of the frame.
        frame: usize,
    },
}
