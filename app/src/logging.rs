//! The log: a file for bug reports, and on stderr what nobody would be told otherwise.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use inplace_core::TOLD;
use inplace_core::project::log_path;
use tracing::level_filters::LevelFilter;
use tracing_subscriber::filter::Targets;
use tracing_subscriber::fmt::layer;
use tracing_subscriber::prelude::*;

/// Size at which the rolling log is put aside, in bytes.
const MOST_BYTES: u64 = 1 << 20;

/// Starts the log, into this file or else into the rolling one. A log that cannot be written stops nothing: a sentence on
/// stderr says so.
pub fn start(file: Option<&Path>, has_window: bool) {
    let asked_for = from_environment();
    let opened = match file {
        // Empty at first, and of any size.
        Some(path) => File::create(path).and_then(|_| LogFile::rolling(path.to_path_buf(), u64::MAX)),
        None => LogFile::rolling(log_path(), MOST_BYTES),
    };
    let opened = opened
        .map_err(|error| say(file.unwrap_or(&log_path()), &error))
        .ok();
    let of_file = asked_for.clone().unwrap_or_else(|| {
        let own = ["inplace", "inplace_core", "inplace_ui"].map(|name| (name, LevelFilter::INFO));
        Targets::new().with_default(LevelFilter::WARN).with_targets(own)
    });
    let of_stderr = asked_for.unwrap_or_else(|| {
        let level = if has_window {
            LevelFilter::OFF
        } else {
            LevelFilter::WARN
        };
        Targets::new()
            .with_default(level)
            .with_target(TOLD, LevelFilter::OFF)
    });
    let file_layer = opened.map(|file| layer().with_writer(Mutex::new(file)).with_filter(of_file));
    let stderr_layer = layer().with_writer(io::stderr).with_filter(of_stderr);
    let log = tracing_subscriber::registry().with(file_layer).with(stderr_layer);
    if let Err(error) = log.try_init() {
        eprintln!("inplace: no log is kept: {error}");
    }
    let print = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        tracing::error!(target: TOLD, "{panic}");
        print(panic);
    }));
    tracing::info!(
        version = env!("CARGO_PKG_VERSION"),
        arguments = ?std::env::args_os().skip(1).collect::<Vec<_>>(),
        "started"
    );
}

/// What `RUST_LOG` asks for; `None` where it is not set or says nothing that is understood.
fn from_environment() -> Option<Targets> {
    let text = std::env::var("RUST_LOG").ok().filter(|text| !text.is_empty())?;
    let parsed = text.parse();
    parsed
        .map_err(|error| eprintln!("inplace: RUST_LOG: {error}; give a level, or TARGET=LEVEL,..."))
        .ok()
}

fn say(path: &Path, error: &io::Error) {
    eprintln!("inplace: {}: the log cannot be written: {error}", path.display());
}

/// A log file; a rolling one is put aside as `NAME.1` when it gets too large, in place of the one put aside before.
struct LogFile {
    path: PathBuf,
    /// `None` once it could not be written.
    file: Option<File>,
    length: u64,
    most: u64,
}

impl LogFile {
    /// Goes on in the file at a path, whose folder is made where it is missing.
    fn rolling(path: PathBuf, most: u64) -> io::Result<Self> {
        if let Some(folder) = path.parent() {
            fs::create_dir_all(folder)?;
        }
        let file = File::options().create(true).append(true).open(&path)?;
        Ok(Self {
            length: file.metadata()?.len(),
            file: Some(file),
            path,
            most,
        })
    }

    fn append(&mut self, line: &[u8]) -> io::Result<()> {
        let length = line.len() as u64;
        if self.length > 0 && self.length.saturating_add(length) > self.most {
            let mut aside = self.path.clone().into_os_string();
            aside.push(".1");
            fs::rename(&self.path, aside)?;
            *self = Self::rolling(self.path.clone(), self.most)?;
        }
        if let Some(file) = &mut self.file {
            file.write_all(line)?;
            self.length += length;
        }
        Ok(())
    }
}

impl Write for LogFile {
    /// Writes a line. The first that cannot be written is said on stderr, and is the last that is tried.
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        if self.file.is_some()
            && let Err(error) = self.append(line)
        {
            self.file = None;
            say(&self.path, &error);
        }
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_rolling_log_and_the_one_before_stay_within_their_bound_and_keep_the_last_lines() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("inner/inplace.log");
        for start in [0, 50] {
            let mut log = LogFile::rolling(path.clone(), 100).unwrap();
            for number in start..start + 50 {
                writeln!(log, "line {number:04}").unwrap();
            }
        }
        let [aside, newest] = ["inplace.log.1", "inplace.log"].map(|name| {
            let text = fs::read_to_string(path.with_file_name(name)).unwrap();
            assert!(text.len() <= 100, "{name}: {}", text.len());
            text
        });
        let text = aside + &newest;
        assert!(text.ends_with("line 0098\nline 0099\n"), "{text}");
        assert_eq!(fs::read_dir(folder.path().join("inner")).unwrap().count(), 2);
    }

    #[test]
    fn a_log_that_cannot_be_written_any_more_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("inplace.log");
        let mut log = LogFile::rolling(path.clone(), 10).unwrap();
        log.write_all(b"123456789\n").unwrap();
        fs::create_dir(folder.path().join("inplace.log.1")).unwrap();
        for _ in 0..2 {
            log.write_all(b"more\n").unwrap();
        }
        assert!(log.file.is_none());
        assert_eq!(fs::read(&path).unwrap(), b"123456789\n");
    }
}
