//! What long work is doing, told on stderr.

use std::convert::Infallible;
use std::io::{IsTerminal, Write};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::JoinHandle;
use std::time::{Duration, Instant};

use crossbeam_channel::{Receiver, RecvTimeoutError, Sender, bounded};

/// On a terminal: how long work lasts before anything is shown, and how often the line is drawn anew.
const AFTER: Duration = Duration::from_secs(1);
const REDRAWN: Duration = Duration::from_millis(250);
/// Time to the first line and between two lines where stderr is no terminal.
const EVERY: Duration = Duration::from_secs(5);
/// Most characters of a line on a terminal, and characters of the bar in it.
const LINE: usize = 79;
const BAR: usize = 20;

/// Tells on stderr what work that lasts is doing and for how long: on a terminal in a line that is replaced, with a bar
/// where it is known how much is done, and gone when this is; elsewhere in a line that starts with `...` every five
/// seconds.
#[derive(Debug)]
pub struct Progress {
    doing: Arc<Mutex<Doing>>,
    /// The thread that tells; it ends when the sender is dropped.
    telling: Option<(Sender<Infallible>, JoinHandle<()>)>,
}

#[derive(Debug, Default)]
struct Doing {
    what: String,
    /// How much is done, 0..=1, where that is known.
    share: Option<f32>,
}

impl Default for Progress {
    fn default() -> Self {
        let doing = Arc::<Mutex<Doing>>::default();
        let (sender, ended) = bounded(0);
        let told = Arc::clone(&doing);
        let thread = std::thread::Builder::new().name("inplace-progress".to_owned());
        // Without a thread nothing is told; the work goes on.
        let thread = thread.spawn(move || tell(&told, &ended)).ok();
        Self {
            doing,
            telling: thread.map(|thread| (sender, thread)),
        }
    }
}

impl Progress {
    /// What is being done now; of how much of it there is, nothing is known.
    pub fn show(&self, what: impl Into<String>) {
        self.set(what.into(), None);
    }

    /// What is being done now, and how much of it is done, 0..=1.
    pub fn show_share(&self, what: impl Into<String>, share: f32) {
        self.set(what.into(), Some(share));
    }

    fn set(&self, what: String, share: Option<f32>) {
        *self.doing.lock().unwrap_or_else(PoisonError::into_inner) = Doing { what, share };
    }
}

impl Drop for Progress {
    fn drop(&mut self) {
        if let Some((sender, thread)) = self.telling.take() {
            drop(sender);
            // A panic there has been told.
            let _ = thread.join();
        }
    }
}

impl Doing {
    /// A line of it after so many seconds; empty before anything was shown.
    fn line(&self, seconds: u64, on_terminal: bool) -> String {
        let what = &self.what;
        let percent = self.share.map(|share| 100.0 * share.clamp(0.0, 1.0));
        let line = match (on_terminal, percent) {
            _ if what.is_empty() => return String::new(),
            (true, Some(percent)) => {
                let done = (percent / 100.0 * BAR as f32) as usize;
                format!("[{:<BAR$}] {percent:.0}% {what}, {seconds} s", "#".repeat(done))
            }
            (true, None) => format!("{what}, {seconds} s"),
            (false, Some(percent)) => return format!("... {what}, {percent:.0}%, {seconds} s"),
            (false, None) => return format!("... {what}, {seconds} s"),
        };
        line.chars().take(LINE).collect()
    }
}

/// Tells until the other side is gone.
fn tell(doing: &Mutex<Doing>, ended: &Receiver<Infallible>) {
    let start = Instant::now();
    let mut stderr = std::io::stderr();
    let on_terminal = stderr.is_terminal();
    let (mut wait, next) = if on_terminal {
        (AFTER, REDRAWN)
    } else {
        (EVERY, EVERY)
    };
    let mut is_shown = false;
    while let Err(RecvTimeoutError::Timeout) = ended.recv_timeout(wait) {
        wait = next;
        let doing = doing.lock().unwrap_or_else(PoisonError::into_inner);
        let line = doing.line(start.elapsed().as_secs(), on_terminal);
        drop(doing);
        // Whoever stopped reading is no reason to stop working. A message goes over the line on a terminal.
        let _ = match on_terminal {
            _ if line.is_empty() => Ok(()),
            true => write!(stderr, "\x1b[K{line}\r"),
            false => writeln!(stderr, "{line}"),
        };
        is_shown |= on_terminal && !line.is_empty();
    }
    if is_shown {
        let _ = write!(stderr, "\x1b[K");
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_says_what_is_done_how_much_of_it_and_for_how_long() {
        let line = |share, on_terminal| {
            let what = "reading frames".to_owned();
            Doing { what, share }.line(7, on_terminal)
        };
        assert_eq!(line(None, false), "... reading frames, 7 s");
        assert_eq!(line(Some(0.25), false), "... reading frames, 25%, 7 s");
        assert_eq!(line(None, true), "reading frames, 7 s");
        let bar = "[#####               ] 25% reading frames, 7 s";
        assert_eq!(line(Some(0.25), true), bar);
        assert!(line(Some(f32::INFINITY), true).starts_with("[####################] 100%"));
        assert_eq!(Doing::default().line(7, false), "");
    }
}
