//! The seeds of fuzzing, with all that it ever found, and a fixed number of changes to each: what holds of every file
//! holds of these.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a test ends where it fails"
)]

use std::alloc::{GlobalAlloc, Layout, System};
use std::fs;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

use inplace_tests::{Fuzzed, files_below, number};
use rand::{Rng, SeedableRng, rngs::SmallRng};

/// Changes to each seed, unless `INPLACE_SEED_CHANGES` says how many.
const CHANGES: u64 = 48;
/// Seeds of more bytes are changed less often, as they take longer.
const LARGE: usize = 4096;
/// Most bytes in memory at once while a file is parsed.
const MOST_MEMORY: usize = 256 << 20;
/// Longest time for a file: seconds where a loaded machine takes milliseconds.
const LONGEST: Duration = Duration::from_secs(5);

static NOW: AtomicUsize = AtomicUsize::new(0);
static MOST: AtomicUsize = AtomicUsize::new(0);

/// The system's allocator, which counts the bytes that are in use.
struct Counting;

fn grown(by: usize) {
    let now = NOW.fetch_add(by, Ordering::Relaxed) + by;
    MOST.fetch_max(now, Ordering::Relaxed);
}

// SAFETY: everything is passed on to the system's allocator as it came, also by what is made of these two.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        grown(layout.size());
        // SAFETY: as above.
        unsafe { System.alloc(layout) }
    }

    unsafe fn dealloc(&self, pointer: *mut u8, layout: Layout) {
        NOW.fetch_sub(layout.size(), Ordering::Relaxed);
        // SAFETY: as above.
        unsafe { System.dealloc(pointer, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// A number below a bound; 0 where there is none.
fn below(bound: usize, random: &mut SmallRng) -> usize {
    random.random_range(0..bound.max(1))
}

fn seeds_of(name: &str) -> Vec<(Vec<u8>, PathBuf)> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../fuzz/seeds")
        .join(name);
    let mut paths = files_below(&folder);
    paths.sort();
    let with_bytes = |path: PathBuf| (fs::read(&path).unwrap(), path);
    paths.into_iter().map(with_bytes).collect()
}

/// Bytes with some bits flipped, cut short, with a part twice, or with a part of another seed.
fn changed(bytes: &[u8], other: &[u8], random: &mut SmallRng) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..=below(3, random) {
        let length = bytes.len();
        let from = below(length, random);
        let to = length.min(from + 1 + below(24, random));
        match below(6, random) {
            0 | 1 if length > 0 => bytes[from] ^= 1 << below(8, random),
            2 if length > 0 => {
                let odd = [0, 0xff, 0x7f, 0x80, b'-', b'9', b'.', b'e'];
                bytes[from] = odd[below(odd.len(), random)];
            }
            3 => bytes.truncate(from),
            4 => {
                let part = bytes[from..to].to_vec();
                bytes.splice(from..from, part);
            }
            _ => {
                let start = below(other.len(), random);
                let end = other.len().min(start + 1 + below(64, random));
                bytes.splice(from..to, other[start..end].iter().copied());
            }
        }
    }
    bytes
}

/// What is wrong with how a parser takes these bytes, if anything: it must be as it should, soon and in little memory.
fn problem(fuzzed: &Fuzzed, bytes: &[u8]) -> Option<String> {
    let before = NOW.load(Ordering::Relaxed);
    MOST.store(before, Ordering::Relaxed);
    let start = Instant::now();
    let outcome = catch_unwind(AssertUnwindSafe(|| fuzzed.check(bytes)));
    let took = start.elapsed();
    let memory = MOST.load(Ordering::Relaxed).saturating_sub(before);
    if outcome.is_err() {
        Some("panics".to_owned())
    } else if took > LONGEST {
        Some(format!("takes {took:?}"))
    } else {
        (memory > MOST_MEMORY).then(|| format!("takes {memory} bytes"))
    }
}

// One test, as the memory of all is counted together.
#[test]
fn no_seed_and_no_change_to_one_breaks_a_parser() {
    let changes = number("INPLACE_SEED_CHANGES", CHANGES);
    let mut problems = Vec::new();
    for name in Fuzzed::names() {
        let fuzzed = Fuzzed::new(name);
        let seeds = seeds_of(name);
        assert!(!seeds.is_empty(), "{name} has seeds");
        let start = Instant::now();
        for (number, (bytes, path)) in seeds.iter().enumerate() {
            let file = path.file_name().unwrap().to_string_lossy();
            let mut check = |what: &str, bytes: &[u8]| {
                if let Some(problem) = problem(&fuzzed, bytes) {
                    let name = format!("{name}-{file}{what}");
                    fs::write(std::env::temp_dir().join(&name), bytes).unwrap();
                    problems.push(format!("{name} in the temporary folder {problem}"));
                }
            };
            check("", bytes);
            let random = &mut SmallRng::seed_from_u64(number as u64);
            let changes = if bytes.len() > LARGE { changes / 4 } else { changes };
            for change in 0..changes {
                let (other, _) = &seeds[below(seeds.len(), random)];
                check(&format!("-{change}"), &changed(bytes, other, random));
            }
        }
        println!("{name}: {} seeds, {:.1?}", seeds.len(), start.elapsed());
    }
    assert!(problems.is_empty(), "{problems:#?}");
}
