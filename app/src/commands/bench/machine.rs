//! What the figures were measured on, when and with what.

use std::fs;

use super::super::cores;

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
    let memory = fs::read_to_string("/proc/meminfo").unwrap_or_default();
    let kilobytes = memory.lines().find_map(|line| {
        line.strip_prefix("MemTotal:")?
            .trim()
            .strip_suffix(" kB")?
            .parse::<f64>()
            .ok()
    });
    let memory = kilobytes.map_or_else(String::new, |kilobytes| {
        format!(", {:.0} GB of memory", kilobytes / 1e6)
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
