//! The program as a process.

use std::fs::{self, File};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::time::{Duration, Instant};

use tempfile::TempDir;

/// The program's binary.
pub fn program() -> PathBuf {
    built("inplace")
}

/// A binary of the workspace, beside the folder of this test's own executable.
fn built(name: &str) -> PathBuf {
    let own = std::env::current_exe().expect("a test has an executable");
    let profile = own.parent().and_then(Path::parent).expect("it lies in deps/");
    let program = profile.join(format!("{name}{}", std::env::consts::EXE_SUFFIX));
    assert!(
        program.is_file(),
        "{}: the program is missing; run `cargo test` at the workspace root, which builds it",
        program.display()
    );
    program
}

/// A command that runs the program without a display, with backtraces on and a data folder for tests.
pub fn inplace() -> Command {
    without_display(program())
}

/// A command that runs the laboratory in the same way.
pub fn inplace_lab() -> Command {
    without_display(built("inplace-lab"))
}

fn without_display(program: PathBuf) -> Command {
    let mut command = Command::new(program);
    command.env("RUST_BACKTRACE", "1");
    // The log of a test is not the person's.
    command.env("XDG_DATA_HOME", std::env::temp_dir().join("inplace-tests"));
    for display in ["DISPLAY", "WAYLAND_DISPLAY", "WAYLAND_SOCKET"] {
        command.env_remove(display);
    }
    command
}

/// Tells a child process which folder it works in.
pub const FOLDER: &str = "INPLACE_TEST_FOLDER";

/// The ignored test of that name in a process of its own, which works in a folder.
pub fn child(test: &str, folder: &Path) -> Command {
    let mut command = Command::new(std::env::current_exe().expect("a test has an executable"));
    command.args(["--ignored", "--exact", "--nocapture", test]);
    command.env(FOLDER, folder);
    command
}

/// The folder that this child process works in; `None` in the process that runs all tests.
pub fn folder_of_child() -> Option<PathBuf> {
    std::env::var_os(FOLDER).map(PathBuf::from)
}

/// The number in an environment variable.
///
/// # Panics
/// When it is no number.
pub fn number(variable: &str, otherwise: u64) -> u64 {
    std::env::var(variable).map_or(otherwise, |text| text.parse().expect("a whole number"))
}

/// A command that a shell, such as `sh -c`, becomes after a script.
pub fn behind(shell: &[&str], script: &str, inner: &Command) -> Command {
    let mut command = Command::new(shell[0]);
    command.args(&shell[1..]);
    command.arg(format!("{script}; exec \"$0\" \"$@\""));
    command.arg(inner.get_program()).args(inner.get_args());
    for (name, value) in inner.get_envs() {
        match value {
            Some(value) => command.env(name, value),
            None => command.env_remove(name),
        };
    }
    command
}

/// How a process ended.
#[derive(Debug)]
pub struct Outcome {
    /// Exit code; `None` after a signal.
    pub code: Option<i32>,
    /// All that it printed.
    pub stdout: String,
    /// All that it said on stderr but for its progress.
    pub stderr: String,
    /// What it told of its progress, a line each.
    pub progress: Vec<String>,
}

/// A process that does not outlive the test.
#[derive(Debug)]
pub struct Running {
    child: Child,
    output: TempDir,
}

impl Running {
    /// Starts a process; what it prints is kept.
    pub fn start(command: &mut Command) -> Self {
        let output = tempfile::tempdir().expect("a temporary folder");
        let file = |name: &str| File::create(output.path().join(name)).expect("a temporary file");
        let child = command
            .stdin(Stdio::null())
            .stdout(file("stdout"))
            .stderr(file("stderr"))
            .spawn()
            .expect("the process starts");
        Self { child, output }
    }

    /// Runs a process to its end, which must come within two minutes.
    pub fn to_the_end(command: &mut Command) -> Outcome {
        Self::start(command).wait(Duration::from_secs(120))
    }

    /// The number of the process.
    pub fn id(&self) -> u32 {
        self.child.id()
    }

    /// What it printed so far.
    pub fn stdout(&self) -> String {
        self.read("stdout")
    }

    /// What it said on stderr so far.
    pub fn stderr(&self) -> String {
        self.read("stderr")
    }

    fn read(&self, name: &str) -> String {
        let bytes = fs::read(self.output.path().join(name)).unwrap_or_default();
        String::from_utf8_lossy(&bytes).into_owned()
    }

    /// How it ended, if it has.
    pub fn ended(&mut self) -> Option<ExitStatus> {
        self.child.try_wait().expect("the process can be waited for")
    }

    /// Kills it, with a signal that it cannot catch, and waits for its end.
    pub fn kill(&mut self) {
        // It may have ended by itself.
        let _ = self.child.kill();
        let _ = self.child.wait();
    }

    /// Waits for its end, which must come within `limit`.
    pub fn wait(mut self, limit: Duration) -> Outcome {
        let ended = eventually(limit, || self.ended());
        let (stdout, stderr) = (self.stdout(), self.stderr());
        let Some(status) = ended else {
            panic!("still running after {limit:?}; it said: {stdout}{stderr}");
        };
        let told = stderr.split_inclusive('\n');
        let (progress, stderr): (Vec<&str>, Vec<&str>) = told.partition(|line| line.starts_with("... "));
        Outcome {
            code: status.code(),
            stdout,
            stderr: stderr.concat(),
            progress: progress.iter().map(|line| line.trim_end().to_owned()).collect(),
        }
    }
}

impl Drop for Running {
    fn drop(&mut self) {
        self.kill();
    }
}

/// Asks again and again until there is an answer, for as long as `limit`.
#[track_caller]
pub fn until<T>(what: &str, limit: Duration, answer: impl FnMut() -> Option<T>) -> T {
    let Some(answer) = eventually(limit, answer) else {
        panic!("not after {limit:?}: {what}");
    };
    answer
}

/// Asks again and again; `None` when there is no answer after `limit`.
pub(crate) fn eventually<T>(limit: Duration, mut answer: impl FnMut() -> Option<T>) -> Option<T> {
    let start = Instant::now();
    loop {
        let answer = answer();
        if answer.is_some() || start.elapsed() > limit {
            return answer;
        }
        std::thread::sleep(Duration::from_millis(20));
    }
}

/// The only line of what a failed run said, without its prefix; it has no words that no person should see.
pub fn one_line(stderr: &str) -> &str {
    let mut lines = stderr.lines();
    let line = lines.next().unwrap_or_default();
    assert!(lines.next().is_none(), "more than one line: {stderr}");
    for word in ["panicked", "backtrace", "RUST_BACKTRACE", ".rs:"] {
        assert!(!line.contains(word), "\"{word}\" is in: {line}");
    }
    ["inplace: ", "inplace-lab: "]
        .iter()
        .find_map(|name| line.strip_prefix(name))
        .expect("messages start with the program's name")
}
