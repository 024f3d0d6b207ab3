//! Numbers for people.

/// How unsure something is, as a share of `most`: the entropy of an even guess among all classes, in nats.
pub fn unsure(entropy: f32, most: f32) -> String {
    format!("{} unsure", share(entropy / most))
}

/// A share as a percentage: never 100% when something is missing, never 0% when there is something.
pub fn share(share: f32) -> String {
    let percent = 100.0 * share.clamp(0.0, 1.0);
    if percent > 0.0 && percent < 1.0 {
        "below 1%".to_owned()
    } else if percent > 99.0 && percent < 100.0 {
        "above 99%".to_owned()
    } else {
        format!("{percent:.0}%")
    }
}

/// A share as a percentage with a digit behind the point: never 100% when something is missing.
pub fn percent(share: f64) -> String {
    format!("{:.1}%", (1000.0 * share).floor() / 10.0)
}

/// A probability.
pub fn probability(probability: f32) -> String {
    // 100% is kept for what is certain.
    if probability < 1.0 {
        format!("{:.0}%", (100.0 * probability).min(99.0))
    } else {
        "100%".to_owned()
    }
}

/// A length.
pub fn metres(length: f32) -> String {
    if length < 99.95 {
        format!("{length:.2} m")
    } else {
        format!("{length:.0} m")
    }
}

/// A span of time.
pub fn duration(seconds: f64) -> String {
    let seconds = seconds.max(0.0) as u64;
    match (seconds / 3600, seconds / 60 % 60, seconds % 60) {
        (0, 0, seconds) => format!("{seconds} s"),
        (0, minutes, seconds) => format!("{minutes} min {seconds:02} s"),
        (hours, minutes, _) => format!("{hours} h {minutes:02} min"),
    }
}

/// An image quality.
pub fn decibels(psnr: f64) -> String {
    format!("{psnr:.1} dB")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shares_and_times_are_honest_words() {
        assert_eq!(share(0.004), "below 1%");
        assert_eq!(share(0.123), "12%");
        assert_eq!(share(0.9999), "above 99%");
        assert_eq!((share(0.0), share(1.0)), ("0%".to_owned(), "100%".to_owned()));
        assert_eq!(
            (percent(0.99999), percent(1.0)),
            ("99.9%".to_owned(), "100.0%".to_owned())
        );
        assert_eq!(percent(0.9344), "93.4%");
        assert_eq!(unsure(0.25, 1.0), "25% unsure");
        assert_eq!(duration(59.9), "59 s");
        assert_eq!(duration(61.0), "1 min 01 s");
        assert_eq!(duration(7325.0), "2 h 02 min");
    }
}
