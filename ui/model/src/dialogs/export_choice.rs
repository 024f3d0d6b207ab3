//! What is exported, and where to.

use std::path::PathBuf;

use inplace_core::export::{Format, IdMap, Options};
use inplace_core::labels::ClassPalette;

/// What is exported, and where to, as chosen so far.
#[derive(Clone, Debug, PartialEq)]
pub struct ExportChoice {
    /// The folder typed so far.
    pub path: String,
    /// The kind of data set.
    pub format: Format,
    /// The data set whose class numbers are taken, by name.
    pub ids: Option<&'static ClassPalette>,
    /// Pixels whose class is less probable become void, per cent.
    pub least_percent: Option<u8>,
}

impl Default for ExportChoice {
    fn default() -> Self {
        Self::new()
    }
}

impl ExportChoice {
    /// Everything as in the project; the path is filled in when it is shown.
    pub const fn new() -> Self {
        Self {
            path: String::new(),
            format: Format::Png,
            ids: None,
            least_percent: None,
        }
    }

    /// The folder.
    pub fn folder(&self) -> PathBuf {
        PathBuf::from(self.path.trim())
    }

    /// What is exported of each map.
    pub fn options(&self) -> Options {
        Options {
            least_probability: self.least_percent.map(|percent| f32::from(percent) / 100.0),
            ids: self.ids.map(IdMap::of),
        }
    }
}
