//! Results as comma-separated values.

use serde::Serialize;
use serde_json::{Result, Value};

/// A row for each item under a header; cells that need it are quoted (RFC 4180).
///
/// The columns are JSON keys of the items, with spaces between them; `:4` behind a key rounds its numbers to so many
/// decimals. What is null, and so what is not a number, is left empty; lists are joined by ` | `.
///
/// # Errors
/// Items that JSON cannot hold.
pub fn csv(items: &[impl Serialize], columns: &str) -> Result<String> {
    let decimals = |column: &str| column.split_once(':')?.1.parse().ok();
    let names = || {
        let columns = columns.split_whitespace();
        columns.map(|column| column.split(':').next().unwrap_or(column))
    };
    let mut text = names().collect::<Vec<_>>().join(",") + "\n";
    for item in items {
        let row = serde_json::to_value(item)?;
        let values = names().map(|name| &row[name]);
        let cells = values.zip(columns.split_whitespace().map(decimals));
        let cells: Vec<String> = cells.map(|(value, count)| quoted(cell(value, count))).collect();
        text += &cells.join(",");
        text.push('\n');
    }
    Ok(text)
}

/// A value as text, with so many decimals; nothing where it is null.
pub fn cell(value: &Value, decimals: Option<usize>) -> String {
    match (value, value.as_f64(), decimals) {
        (Value::Null, ..) => String::new(),
        (Value::String(text), ..) => text.clone(),
        (Value::Array(items), ..) => {
            let cells: Vec<String> = items.iter().map(|item| cell(item, decimals)).collect();
            cells.join(" | ")
        }
        (_, Some(number), Some(decimals)) => format!("{number:.decimals$}"),
        // Without the ".0" that whole numbers have in JSON.
        (_, Some(number), None) if value.is_f64() => number.to_string(),
        _ => value.to_string(),
    }
}

fn quoted(cell: String) -> String {
    if cell.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", cell.replace('"', "\"\""))
    } else {
        cell
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_are_rounded_joined_and_quoted() {
        let row = serde_json::json!({
            "scene": "a, \"b\"", "seed": 3, "factor": 2.0, "miou": 0.5, "psnr": null, "met": true, "told": ["x", "y"],
        });
        assert_eq!(
            csv(&[row], "scene seed factor miou:4 psnr:2 met told").unwrap(),
            "scene,seed,factor,miou,psnr,met,told\n\"a, \"\"b\"\"\",3,2,0.5000,,true,x | y\n"
        );
    }
}
