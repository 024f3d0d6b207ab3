//! Short messages at the bottom of the canvas: the one place where errors are shown.

use std::time::{Duration, Instant};

/// How serious a message is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// Something worth knowing.
    Info,
    /// Something failed.
    Error,
}

/// A message.
#[derive(Clone, Debug)]
pub struct Message {
    /// What it is dismissed by.
    pub id: u64,
    /// How serious it is.
    pub level: Level,
    /// A sentence.
    pub text: String,
    about: Option<About>,
    until: Option<Instant>,
}

/// What something that failed is about: it stays no longer than that holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum About {
    /// The work is not on the disk.
    Saving,
    /// The scene that is open.
    Scene,
}

/// The messages shown, oldest first.
#[derive(Debug, Default)]
pub struct Messages {
    /// The messages shown, oldest first.
    pub shown: Vec<Message>,
    last: u64,
}

/// How many messages are shown at once.
const MOST: usize = 4;

impl Messages {
    /// Shows something worth knowing for a while.
    pub fn info(&mut self, text: impl Into<String>) {
        self.add(Level::Info, text.into(), None, Some(Duration::from_secs(8)));
    }

    /// Shows what is said of a capture or a project, a part of a sentence on the command line, as a sentence.
    pub fn warning(&mut self, text: &str) {
        let mut letters = text.chars();
        let first = letters.next().map(char::to_uppercase);
        self.info(first.into_iter().flatten().chain(letters).collect::<String>());
    }

    /// Shows what failed until it is dismissed.
    pub fn error(&mut self, text: impl Into<String>) {
        self.add(Level::Error, text.into(), None, None);
    }

    /// Shows what failed until it is dismissed or [no longer holds](Self::withdraw).
    pub fn error_about(&mut self, about: About, text: impl Into<String>) {
        self.add(Level::Error, text.into(), Some(about), None);
    }

    /// Removes what failed about something that is as it should be again, or gone.
    pub fn withdraw(&mut self, about: About) {
        self.shown.retain(|message| message.about != Some(about));
    }

    /// Removes a message.
    pub fn dismiss(&mut self, id: u64) {
        self.shown.retain(|message| message.id != id);
    }

    /// Removes messages whose time is over; returns how long the next one lasts.
    pub fn expire(&mut self, now: Instant) -> Option<Duration> {
        self.shown
            .retain(|message| message.until.is_none_or(|until| until > now));
        let next = self.shown.iter().filter_map(|message| message.until).min()?;
        Some(next.saturating_duration_since(now))
    }

    fn add(&mut self, level: Level, text: String, about: Option<About>, lasting: Option<Duration>) {
        self.shown.retain(|message| message.text != text);
        self.last += 1;
        self.shown.push(Message {
            id: self.last,
            level,
            text,
            about,
            until: lasting.map(|lasting| Instant::now() + lasting),
        });
        if self.shown.len() > MOST {
            // What failed stays as long as something else can go.
            let info = self.shown[..MOST]
                .iter()
                .position(|message| message.level == Level::Info);
            self.shown.remove(info.unwrap_or(0));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_warning_is_shown_as_a_sentence() {
        let mut messages = Messages::default();
        messages.warning("frames were left out");
        assert_eq!(messages.shown[0].text, "Frames were left out");
    }

    #[test]
    fn the_same_message_is_shown_once_and_old_ones_make_room_errors_last() {
        let mut messages = Messages::default();
        let shows = |messages: &Messages, texts: [&str; 4]| {
            let shown = messages.shown.iter().map(|message| &message.text);
            assert!(shown.eq(texts), "{messages:?}");
        };
        for text in ["a", "b", "a", "c", "d", "e"] {
            messages.error(text);
        }
        shows(&messages, ["a", "c", "d", "e"]);
        for text in ["f", "g"] {
            messages.info(text);
        }
        shows(&messages, ["c", "d", "e", "g"]);
        messages.error_about(About::Saving, "h");
        shows(&messages, ["c", "d", "e", "h"]);
        messages.withdraw(About::Scene);
        shows(&messages, ["c", "d", "e", "h"]);
        messages.withdraw(About::Saving);
        assert_eq!(messages.shown.len(), 3);
    }
}
