//! Fuzzing of the parsers of `inplace_tests::Fuzzed`, one target for each.

pub use inplace_tests::Fuzzed;
pub use libfuzzer_sys::fuzz_target;

/// The target of the parser that the executable is named after.
#[macro_export]
macro_rules! target {
    () => {
        static FUZZED: std::sync::LazyLock<$crate::Fuzzed> =
            std::sync::LazyLock::new(|| $crate::Fuzzed::new(env!("CARGO_BIN_NAME")));

        $crate::fuzz_target!(|bytes: &[u8]| FUZZED.check(bytes));
    };
}
