//! Pieces of sentences that several parts of the window share.

/// Name of the program.
pub const PROGRAM: &str = "Inplace";

/// A number of things: "1 stroke", "2 strokes".
pub fn counted(count: usize, one: &str, many: &str) -> String {
    format!("{count} {}", if count == 1 { one } else { many })
}
