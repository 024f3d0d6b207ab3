//! Fuzzing of the parsers of `inplace_tests::Fuzzed`: every target is the parser that its executable is named after.
#![no_main]

use std::sync::LazyLock;

use inplace_tests::Fuzzed;
use libfuzzer_sys::fuzz_target;

static FUZZED: LazyLock<Fuzzed> = LazyLock::new(|| Fuzzed::new(env!("CARGO_BIN_NAME")));

fuzz_target!(|bytes: &[u8]| FUZZED.check(bytes));
