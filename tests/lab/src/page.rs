//! What a measurement says, as Markdown: written beside its tables and charts, and printed.

use inplace_core::export;
use serde::Serialize;
use serde_json::Value;

use crate::arguments::OutputArguments;
use crate::commands::grouped;
use crate::{Failure, mean, table};

/// Columns whose cells are longer are not filled up with spaces.
const WIDEST: usize = 40;

/// Paragraphs, tables and charts.
#[derive(Debug, Default)]
pub struct Page {
    text: String,
}

impl Page {
    /// Adds a heading of a level, 1 to 6.
    pub fn heading(&mut self, level: usize, title: &str) {
        self.paragraph(&format!("{} {title}", "#".repeat(level)));
    }

    /// Adds a paragraph.
    pub fn paragraph(&mut self, sentences: &str) {
        if !self.text.is_empty() {
            self.text.push('\n');
        }
        self.text += sentences;
        self.text.push('\n');
    }

    /// Adds a list, unless it is empty.
    pub fn list(&mut self, items: &[String]) {
        if !items.is_empty() {
            let lines: Vec<String> = items.iter().map(|item| format!("- {item}")).collect();
            self.paragraph(&lines.join("\n"));
        }
    }

    /// Adds a chart that lies beside the page.
    pub fn chart(&mut self, what: &str, file: &str) {
        self.paragraph(&format!("![{what}]({file})"));
    }

    /// Adds a table, unless it has no rows; ` | ` is between the names of its columns. Columns of numbers are set flush
    /// right.
    pub fn table(&mut self, header: &str, rows: &[Vec<String>]) {
        if rows.is_empty() {
            return;
        }
        let header: Vec<String> = header.split(" | ").map(str::to_owned).collect();
        let column = |at| Column::of(at, &header, rows);
        let columns: Vec<Column> = (0..header.len()).map(column).collect();
        let line = |cells: &[String]| {
            let cells = columns.iter().zip(cells);
            let cells: Vec<String> = cells.map(|(column, cell)| column.filled(cell)).collect();
            format!("| {} |", cells.join(" | "))
        };
        let rule: Vec<String> = columns.iter().map(Column::rule).collect();
        let mut lines = vec![line(&header), format!("|{}|", rule.join("|"))];
        lines.extend(rows.iter().map(|row| line(row)));
        self.paragraph(&lines.join("\n"));
    }

    /// Adds a table of items; ` | ` is between its columns, each of which is a title, `=` and a JSON key, or a key alone;
    /// dots lead into objects. Columns without decimals tell the rows apart. Of all items in a row the others show the mean,
    /// with so many decimals as follow `:`, times a hundred with `%` and with the range with `~`.
    ///
    /// # Errors
    /// Items that JSON cannot hold.
    pub fn means(&mut self, items: &[impl Serialize], columns: &str) -> Result<(), Failure> {
        let items: Vec<Value> = items.iter().map(serde_json::to_value).collect::<Result<_, _>>()?;
        let columns: Vec<Mean> = columns.split(" | ").map(Mean::of).collect();
        let titles: Vec<&str> = columns.iter().map(|column| column.title).collect();
        let told_apart = |item| -> Vec<Option<&Value>> {
            let keys = columns.iter().filter(|column| column.decimals.is_none());
            keys.map(|column| column.value(item)).collect()
        };
        let row = |(_, own): (_, Vec<&Value>)| columns.iter().map(|column| column.cell(&own)).collect();
        let rows: Vec<Vec<String>> = grouped(&items, told_apart).into_iter().map(row).collect();
        self.table(&titles.join(" | "), &rows);
        Ok(())
    }

    /// Adds what another page says, whose charts lie in `folder`.
    pub fn include(&mut self, other: &str, folder: &str) {
        let lines = other.lines().map(|line| match line.strip_prefix("![") {
            Some(chart) => format!("![{}", chart.replacen("](", &format!("]({folder}/"), 1)),
            None => line.to_owned(),
        });
        self.paragraph(lines.collect::<Vec<String>>().join("\n").trim_end());
    }

    /// The whole page.
    pub fn as_str(&self) -> &str {
        &self.text
    }

    /// Writes `NAME.md` and prints it, or the results as JSON.
    ///
    /// # Errors
    /// The file cannot be written.
    pub fn publish(
        &self,
        output: &OutputArguments,
        name: &str,
        results: &impl Serialize,
    ) -> Result<(), Failure> {
        export::write(&output.out.join(format!("{name}.md")), self.text.as_bytes())?;
        if output.json {
            println!("{}", serde_json::to_string_pretty(results)?);
        } else {
            print!("{}", self.text);
        }
        Ok(())
    }
}

/// A cell with so many decimals; a dash where nothing is known.
pub fn known(value: impl Into<Option<f64>>, decimals: usize) -> String {
    let value = value.into().filter(|value| !value.is_nan());
    value.map_or("-".to_owned(), |value| format!("{value:.decimals$}"))
}

/// A column of [`Page::means`].
struct Mean<'a> {
    title: &'a str,
    /// A JSON pointer.
    path: String,
    decimals: Option<usize>,
    is_share: bool,
    has_range: bool,
}

impl<'a> Mean<'a> {
    fn of(column: &'a str) -> Self {
        let (title, told) = column.split_once('=').unwrap_or((column, column));
        let (key, form) = told.split_once(':').unwrap_or((told, ""));
        Self {
            title: if title == told { key } else { title },
            path: format!("/{}", key.replace('.', "/")),
            decimals: form.trim_end_matches(['%', '~']).parse().ok(),
            is_share: form.contains('%'),
            has_range: form.contains('~'),
        }
    }

    fn value<'b>(&self, item: &'b Value) -> Option<&'b Value> {
        item.pointer(&self.path).filter(|value| !value.is_null())
    }

    fn cell(&self, items: &[&Value]) -> String {
        let values = || items.iter().filter_map(|item| self.value(item));
        let Some(decimals) = self.decimals else {
            return match values().next() {
                None => "-".to_owned(),
                Some(Value::Bool(is)) => if *is { "yes" } else { "no" }.to_owned(),
                Some(value) => table::cell(value, None),
            };
        };
        let times = if self.is_share { 100.0 } else { 1.0 };
        let numbers: Vec<f64> = values()
            .filter_map(Value::as_f64)
            .map(|value| times * value)
            .collect();
        let cell = known(mean(numbers.iter().copied()), decimals);
        let low = numbers.iter().copied().fold(f64::INFINITY, f64::min);
        let high = numbers.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        match self.has_range && low < high {
            true => format!("{cell} ({low:.decimals$} to {high:.decimals$})"),
            false => cell,
        }
    }
}

/// Whether a cell is of numbers alone, such as `0.74 (0.5 to 0.8)` and `25.6 / 41`, or of nothing.
fn is_number(cell: &str) -> bool {
    let mut words = cell.split([' ', '(', ')', '%']);
    words.all(|word| ["", "-", "/", "to"].contains(&word) || word.parse::<f64>().is_ok())
}

/// How the cells of a column are set.
struct Column {
    width: usize,
    is_number: bool,
}

impl Column {
    fn of(at: usize, header: &[String], rows: &[Vec<String>]) -> Self {
        let cells = || rows.iter().filter_map(|row| row.get(at));
        let width = cells().chain(header.get(at)).map(|cell| cell.chars().count());
        Self {
            width: width.max().filter(|&width| width <= WIDEST).unwrap_or(0).max(2),
            is_number: cells().all(|cell| is_number(cell)),
        }
    }

    fn filled(&self, cell: &str) -> String {
        let width = self.width;
        match self.is_number {
            true => format!("{cell:>width$}"),
            false => format!("{cell:width$}"),
        }
    }

    fn rule(&self) -> String {
        let end = if self.is_number { ":" } else { "-" };
        "-".repeat(self.width + 1) + end
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn columns_of_numbers_are_flush_right() {
        let mut page = Page::default();
        page.paragraph("Of two scenes.");
        let row = |name: &str, value: &str| vec![name.to_owned(), value.to_owned()];
        page.table(
            "frames | mIoU",
            &[row("60 of 8 x 6", "0.5 (0.4 to 0.6)"), row("9 of 8 x 6", "-")],
        );
        assert_eq!(
            page.as_str(),
            "Of two scenes.\n\n\
             | frames      |             mIoU |\n\
             |-------------|-----------------:|\n\
             | 60 of 8 x 6 | 0.5 (0.4 to 0.6) |\n\
             | 9 of 8 x 6  |                - |\n"
        );
        page.table("nothing", &[]);
        assert!(!page.as_str().contains("nothing"));
    }

    #[test]
    fn items_that_are_alike_are_one_row() {
        let item = |seed: u64, miou, psnr: Option<f64>| serde_json::json!({"scene": "demo", "seed": seed, "miou": miou, "field": {"psnr": psnr}});
        let mut page = Page::default();
        let items = [item(0, 0.25, Some(20.0)), item(1, 0.75, None)];
        page.means(&items, "scene | mIoU, %=miou:0%~ | PSNR=field.psnr:1 | lost:0")
            .unwrap();
        let cells: Vec<&str> = page
            .as_str()
            .lines()
            .last()
            .unwrap()
            .split('|')
            .map(str::trim)
            .collect();
        assert_eq!(cells, ["", "demo", "50 (25 to 75)", "20.0", "-", ""]);
    }

    #[test]
    fn charts_of_an_included_page_lie_in_its_folder() {
        let mut page = Page::default();
        page.heading(2, "Time");
        page.include("See.\n\n![By time](time.svg)\n", "benchmarks/pareto");
        assert_eq!(
            page.as_str(),
            "## Time\n\nSee.\n\n![By time](benchmarks/pareto/time.svg)\n"
        );
    }
}
