//! Output: lines of JSON, a table for people, or a table in Markdown.

use serde::Serialize;
use std::io::Write;

/// Format of the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum OutputFormat {
    /// One object per line.
    Json,
    /// A table with aligned columns.
    Text,
    /// A table in Markdown, with a title.
    Markdown,
}

/// A column of a table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct TableColumn {
    name: &'static str,
    is_number: bool,
}

impl TableColumn {
    /// Creates a column of text.
    pub(crate) fn left(name: &'static str) -> Self {
        Self {
            name,
            is_number: false,
        }
    }

    /// Creates a column of numbers.
    pub(crate) fn right(name: &'static str) -> Self {
        Self {
            name,
            is_number: true,
        }
    }
}

/// A table that is printed row by row, so that the progress of a long run is visible.
pub(crate) struct BenchTable {
    title: &'static str,
    columns: Vec<TableColumn>,
    format: OutputFormat,
}

impl BenchTable {
    /// Creates an empty table.
    pub(crate) fn new(title: &'static str, columns: &[TableColumn], format: OutputFormat) -> Self {
        Self {
            title,
            columns: columns.to_vec(),
            format,
        }
    }

    /// Prints the lines above the rows.
    pub(crate) fn begin(&self) -> Result<(), String> {
        let names = self.columns.iter().map(|column| column.name.to_owned());
        let names: Vec<String> = names.collect();
        match self.format {
            OutputFormat::Json => Ok(()),
            OutputFormat::Text => print(&format!("{}\n{}\n", self.title, self.aligned(&names))),
            OutputFormat::Markdown => {
                let rule_cells = self.columns.iter().map(|column| match column.is_number {
                    true => "---:".to_owned(),
                    false => "---".to_owned(),
                });
                let rule_cells: Vec<String> = rule_cells.collect();
                let head = format!("\n### {}\n\n{}\n", self.title, markdown_row(&names));
                print(&format!("{head}{}\n", markdown_row(&rule_cells)))
            }
        }
    }

    /// Prints a row, given as data and as cells.
    pub(crate) fn row(&self, data: &impl Serialize, cells: &[String]) -> Result<(), String> {
        let line = match self.format {
            OutputFormat::Json => serde_json::to_string(data).map_err(|error| error.to_string())?,
            OutputFormat::Text => self.aligned(cells),
            OutputFormat::Markdown => markdown_row(cells),
        };
        print(&format!("{line}\n"))
    }

    /// Prints the lines below the rows.
    pub(crate) fn end(&self) -> Result<(), String> {
        match self.format {
            OutputFormat::Json | OutputFormat::Markdown => Ok(()),
            OutputFormat::Text => print("\n"),
        }
    }

    fn aligned(&self, cells: &[String]) -> String {
        let cells = self.columns.iter().zip(cells);
        let padded = cells.map(|(column, cell)| {
            let width = column.name.chars().count().max(10);
            match column.is_number {
                true => format!("{cell:>width$}"),
                false => format!("{cell:<width$}"),
            }
        });
        let line: Vec<String> = padded.collect();
        line.join("  ").trim_end().to_owned()
    }
}

fn markdown_row(cells: &[String]) -> String {
    format!("| {} |", cells.join(" | "))
}

/// Prints to standard output and flushes it.
pub(crate) fn print(text: &str) -> Result<(), String> {
    let mut stdout = std::io::stdout().lock();
    let written = stdout.write_all(text.as_bytes()).and_then(|()| stdout.flush());
    written.map_err(|error| format!("standard output cannot be written: {error}"))
}

/// Reports on standard error why a result is missing.
pub(crate) fn note(text: &str) {
    let _ = writeln!(std::io::stderr(), "note: {}", text.trim_end());
}
