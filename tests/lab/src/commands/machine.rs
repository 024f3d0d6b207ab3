//! What the figures were measured on, when and with what.

use std::fs;

use inplace_core::export::total_memory;

use crate::commands::cores;

/// Name of the processor, where the system tells.
pub(super) fn processor() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let line = text.lines().find_map(|line| line.strip_prefix("model name"));
    line.and_then(|line| line.split_once(':')).map_or_else(
        || std::env::consts::ARCH.to_owned(),
        |(_, name)| name.trim().to_owned(),
    )
}

/// Program, machine and date, in a sentence.
pub(super) fn conditions() -> String {
    let memory = total_memory().map_or_else(String::new, |bytes| {
        format!(", {:.0} GB of memory", bytes as f64 / 1e9)
    });
    format!(
        "Version {}, commit {}; {}, {} cores{memory}, {}; {}.",
        env!("CARGO_PKG_VERSION"),
        env!("INPLACE_COMMIT"),
        processor(),
        cores(),
        std::env::consts::OS,
        jiff::Timestamp::now().strftime("%F")
    )
}
