//! How much memory this process has used.

/// The most memory that this process has held at once (its resident set), in bytes; `None` where the
/// system does not tell.
pub fn peak_memory() -> Option<u64> {
    own("VmHWM:")
}

/// The memory that this process holds now (its resident set), in bytes; `None` where the system does not tell.
pub fn resident_memory() -> Option<u64> {
    own("VmRSS:")
}

/// The memory of the computer, in bytes; `None` where the system does not tell.
pub fn total_memory() -> Option<u64> {
    bytes_of(&std::fs::read_to_string("/proc/meminfo").ok()?, "MemTotal:")
}

fn own(name: &str) -> Option<u64> {
    bytes_of(&std::fs::read_to_string("/proc/self/status").ok()?, name)
}

/// The line `VmHWM:   123 kB` of a Linux process status, where that is the name.
fn bytes_of(status: &str, name: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix(name))?;
    let kibibytes: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    kibibytes.checked_mul(1024)
}
