//! Semantic fields of posed captures: labels spread from a few clicks to every pixel of every frame.
//!
//! The modules, each depending only on those above it, but for the demo scene, which has classes and clicks:
//!
//! - [`scene`]: a posed capture: cameras, frames, formats, the demo room
//! - [`labels`]: what the person said: classes, strokes, undo and redo
//! - [`stereo`]: depth of a capture of colours alone, from several views
//! - [`features`]: what a pretrained network that the person brings sees in the images
//! - [`field`]: density and colour of the scene, learnt from its pixels
//! - [`semantics`]: how labels spread over the scene's surface
//! - [`guide`]: what to label next, and audits of how right the maps are
//! - [`session`]: the background worker that keeps all of this going
//! - [`project`]: the project file
//! - [`export`]: results on disk: label maps, data sets, the labelled surface
//!
//! With the feature `clap`, `arguments` has what several programs take on their command lines.
#![forbid(unsafe_code)]

#[cfg(feature = "clap")]
pub mod arguments;
pub mod export;
pub mod features;
pub mod field;
pub mod guide;
pub mod labels;
mod lanes;
pub mod project;
pub mod scene;
pub mod semantics;
pub mod session;
pub mod stereo;

/// Target of the log's events whose sentence a person is told as well, in the window or by a command: a log beside
/// that leaves them out.
pub const TOLD: &str = "inplace::told";

/// Number of cores; 1 where it cannot be found out.
pub fn cores() -> usize {
    std::thread::available_parallelism().map_or(1, usize::from)
}

/// Drops a value that takes its time about it, on a thread of its own. Where no thread can be started, it is dropped
/// here, and the caller waits.
pub fn drop_on_thread<T: Send + 'static>(name: &str, value: T) {
    let thread = std::thread::Builder::new().name(name.to_owned());
    if let Err(error) = thread.spawn(move || drop(value)) {
        tracing::warn!(name, %error, "no thread could be started, the window has waited");
    }
}
