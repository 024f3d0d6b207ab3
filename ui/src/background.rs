//! A thread beside the UI thread that is asked and answers: the UI thread never waits for it.

use std::time::Duration;

use crossbeam_channel::{Receiver, Sender, unbounded};

/// Has the window drawn once for something that is new. A request without any delay would have it drawn twice, which is meant
/// for what a person does; while the scene is learnt there is something new all the time.
pub fn wake(ctx: &egui::Context) {
    ctx.request_repaint_after(Duration::from_nanos(1));
}

/// The window's end of the thread. The thread ends with it, at the latest when it has its next answer.
#[derive(Debug)]
pub struct Background<Question, Answer> {
    questions: Sender<Question>,
    answers: Receiver<Answer>,
}

impl<Question: Send + 'static, Answer: Send + 'static> Background<Question, Answer> {
    /// Starts `work` on a thread with this name; every answer wakes the window. Where no thread can be started, no
    /// question is ever answered.
    pub fn new(
        ctx: egui::Context,
        name: &str,
        work: impl FnOnce(&Desk<Question, Answer>) -> Result<(), Gone> + Send + 'static,
    ) -> Self {
        let (questions, inbox) = unbounded();
        let (outbox, answers) = unbounded();
        let desk = Desk {
            questions: inbox,
            answers: outbox,
            ctx,
        };
        // All that these threads make is to be looked at: without one no label is lost.
        let thread = std::thread::Builder::new().name(format!("inplace-{name}"));
        if let Err(error) = thread.spawn(move || work(&desk)) {
            tracing::error!(name, %error, "no thread could be started, the window shows nothing of this");
        }
        Self { questions, answers }
    }

    /// Asks.
    pub fn ask(&self, question: Question) {
        // Without the thread there is nobody to ask.
        let _ = self.questions.send(question);
    }

    /// The next answer, if there is one.
    pub fn next(&self) -> Option<Answer> {
        self.answers.try_recv().ok()
    }

    /// The newest of the answers that have come, if any has; those before it are dropped.
    pub fn newest(&self) -> Option<Answer> {
        self.answers.try_iter().last()
    }
}

/// The thread's end.
#[derive(Debug)]
pub struct Desk<Question, Answer> {
    questions: Receiver<Question>,
    answers: Sender<Answer>,
    ctx: egui::Context,
}

/// The window asks and listens no more.
#[derive(Debug)]
pub struct Gone;

impl<Question, Answer> Desk<Question, Answer> {
    /// Waits for the next question.
    ///
    /// # Errors
    /// [`Gone`] when there will be none.
    pub fn next(&self) -> Result<Question, Gone> {
        self.questions.recv().map_err(|_| Gone)
    }

    /// Waits for a question; of several that came, the newest, and the others are dropped.
    ///
    /// # Errors
    /// [`Gone`] when there will be none.
    pub fn newest(&self) -> Result<Question, Gone> {
        let first = self.next()?;
        Ok(self.waiting().last().unwrap_or(first))
    }

    /// The questions that wait, the first first.
    pub fn waiting(&self) -> impl Iterator<Item = Question> {
        self.questions.try_iter()
    }

    /// Whether a question waits.
    pub fn is_asked(&self) -> bool {
        !self.questions.is_empty()
    }

    /// Answers, and wakes the window.
    ///
    /// # Errors
    /// [`Gone`] when nobody listens.
    pub fn tell(&self, answer: Answer) -> Result<(), Gone> {
        self.answers.send(answer).map_err(|_| Gone)?;
        wake(&self.ctx);
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::time::Duration;

    const WAIT: Duration = Duration::from_secs(20);

    #[test]
    fn of_several_questions_the_newest_is_answered_and_the_thread_ends_with_the_window() {
        let (go, may_go) = unbounded::<()>();
        let (ended, end) = unbounded();
        let background = Background::new(egui::Context::default(), "test", move |desk| {
            let _ = may_go.recv();
            let work = || -> Result<(), Gone> {
                loop {
                    desk.tell(desk.newest()?)?;
                }
            };
            let _ = ended.send(work());
            Ok(())
        });
        for question in [1, 2, 3] {
            background.ask(question);
        }
        drop(go);
        assert_eq!(background.answers.recv_timeout(WAIT), Ok(3));
        assert!(background.next().is_none() && background.newest().is_none());
        drop(background);
        assert!(matches!(end.recv_timeout(WAIT), Ok(Err(Gone))));
    }

    #[test]
    fn of_several_answers_the_newest_is_taken_and_the_window_is_woken() {
        let ctx = egui::Context::default();
        let (woken, wakes) = unbounded();
        ctx.set_request_repaint_callback(move |_| {
            let _ = woken.send(());
        });
        let background = Background::new(ctx, "test", |desk| {
            loop {
                desk.tell(desk.next()?)?;
            }
        });
        for question in [1, 2, 3] {
            background.ask(question);
        }
        wakes.recv_timeout(WAIT).unwrap();
        let start = std::time::Instant::now();
        while background.answers.len() < 3 {
            assert!(start.elapsed() < WAIT, "not all was answered");
            std::thread::sleep(Duration::from_millis(1));
        }
        assert_eq!((background.newest(), background.next()), (Some(3), None));
    }
}
