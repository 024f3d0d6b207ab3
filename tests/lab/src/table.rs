//! Results as comma-separated values.

use std::path::Path;

use inplace_core::export::{self, ExportError};

/// Rows of text under a header.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Table {
    text: String,
}

/// A column: its name, and its cell in the row of an item.
pub type Column<'a, T> = (&'a str, &'a dyn Fn(&T) -> String);

impl Table {
    /// A row for each item; cells that need it are quoted (RFC 4180).
    pub fn of<T>(items: &[T], columns: &[Column<'_, T>]) -> Self {
        let names: Vec<&str> = columns.iter().map(|(name, _)| *name).collect();
        let mut text = names.join(",") + "\n";
        for item in items {
            let cells: Vec<String> = columns.iter().map(|(_, cell)| quoted(&cell(item))).collect();
            text += &cells.join(",");
            text.push('\n');
        }
        Self { text }
    }

    /// The whole table.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// Writes the table, under a temporary name first.
    ///
    /// # Errors
    /// [`ExportError::Unwritable`].
    pub fn write(&self, path: &Path) -> Result<(), ExportError> {
        export::write(path, self.text.as_bytes())
    }
}

/// A cell with so many decimals, empty where nothing is known.
pub fn known(value: Option<f64>, decimals: usize) -> String {
    value.map_or_else(String::new, |value| format!("{value:.decimals$}"))
}

fn quoted(cell: &str) -> String {
    if cell.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell.to_owned()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_with_commas_and_quotes_are_quoted() {
        let columns: [Column<'_, f64>; 2] = [
            ("scene", &|_| "a, \"b\"".to_owned()),
            ("miou", &|miou| miou.to_string()),
        ];
        let table = Table::of(&[0.5], &columns);
        assert_eq!(table.as_str(), "scene,miou\n\"a, \"\"b\"\"\",0.5\n");
    }
}
