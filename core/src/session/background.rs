//! Work about the newest labels on threads of its own: a click must not wait for it, and newer labels cancel it.

use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use crossbeam_channel::{Receiver, TryRecvError, bounded};

/// Work that is under way. It is cancelled when this is dropped.
#[derive(Debug)]
pub(super) struct Background<T> {
    /// Generation of the labels that it is about.
    generation: u64,
    cancelled: Arc<AtomicBool>,
    pub(super) answer: Receiver<Option<T>>,
}

impl<T: Send + 'static> Background<T> {
    /// Starts work on so many threads about labels of this generation; it ends early, with `None`, once it is told that
    /// it is cancelled.
    pub(super) fn start(
        name: &'static str,
        threads: usize,
        generation: u64,
        work: impl FnOnce(&AtomicBool) -> Option<T> + Send + 'static,
    ) -> Self {
        let cancelled = Arc::new(AtomicBool::new(false));
        let stop = Arc::clone(&cancelled);
        Self {
            generation,
            cancelled,
            answer: in_background(name, threads, move || work(&stop)),
        }
    }

    /// Takes an answer that has become ready, with the generation of its labels; work that panicked has `None` for one.
    pub(super) fn take_ready(running: &mut Option<Self>) -> Option<(u64, Option<T>)> {
        let answer = match running.as_ref()?.answer.try_recv() {
            Ok(answer) => answer,
            Err(TryRecvError::Empty) => return None,
            Err(TryRecvError::Disconnected) => None,
        };
        let ended = running.take()?;
        Some((ended.generation, answer))
    }
}

impl<T> Drop for Background<T> {
    fn drop(&mut self) {
        self.cancelled.store(true, Ordering::Relaxed);
    }
}

/// Does work on threads of its own, since the session's are busy training. The receiver is disconnected when the work
/// panics, or when the threads cannot be started.
pub(super) fn in_background<T: Send + 'static>(
    name: &'static str,
    threads: usize,
    work: impl FnOnce() -> T + Send + 'static,
) -> Receiver<T> {
    let (sender, receiver) = bounded(1);
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(threads)
        .thread_name(move |_| name.to_owned())
        // The receiver tells: without a handler, rayon would end the program.
        .panic_handler(|_| {})
        .build();
    if let Ok(pool) = pool {
        pool.spawn(move || {
            // The receiver is gone when the session has ended.
            let _ = sender.send(work());
        });
    }
    receiver
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_that_panics_ends_without_an_answer_and_leaves_the_program_running() {
        let work = in_background::<()>("inplace-test", 2, || panic!("on purpose"));
        assert!(work.recv().is_err());
        let mut running = Some(Background::<()>::start("inplace-test", 1, 7, |_| {
            panic!("on purpose")
        }));
        let ended = loop {
            if let Some(ended) = Background::take_ready(&mut running) {
                break ended;
            }
            std::thread::yield_now();
        };
        assert_eq!(ended, (7, None));
        assert!(running.is_none());
    }
}
