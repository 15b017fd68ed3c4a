//! What is printed: lines of JSON, a table for people, or one for Markdown.

use serde::Serialize;
use std::io::Write;

/// A form of printing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// An object per line.
    Json,
    /// A table with aligned columns.
    Text,
    /// A table in Markdown, with a title.
    Markdown,
}

/// A column of a table.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Column {
    name: &'static str,
    is_number: bool,
}

impl Column {
    /// A column of words.
    pub(crate) fn left(name: &'static str) -> Self {
        Self {
            name,
            is_number: false,
        }
    }

    /// A column of numbers.
    pub(crate) fn right(name: &'static str) -> Self {
        Self {
            name,
            is_number: true,
        }
    }
}

/// A table that is printed row by row, so that a long run can be watched.
pub(crate) struct Table {
    title: &'static str,
    columns: Vec<Column>,
    form: Form,
}

impl Table {
    /// An empty table.
    pub(crate) fn new(title: &'static str, columns: &[Column], form: Form) -> Self {
        Self {
            title,
            columns: columns.to_vec(),
            form,
        }
    }

    /// Prints what stands above the rows.
    pub(crate) fn begin(&self) -> Result<(), String> {
        let names = self.columns.iter().map(|column| column.name.to_owned());
        let names: Vec<String> = names.collect();
        match self.form {
            Form::Json => Ok(()),
            Form::Text => print(&format!("{}\n{}\n", self.title, self.aligned(&names))),
            Form::Markdown => {
                let rule = self.columns.iter().map(|column| match column.is_number {
                    true => "---:".to_owned(),
                    false => "---".to_owned(),
                });
                let rule: Vec<String> = rule.collect();
                let head = format!("\n### {}\n\n{}\n", self.title, marked(&names));
                print(&format!("{head}{}\n", marked(&rule)))
            }
        }
    }

    /// Prints a row: what it is as data, and its cells.
    pub(crate) fn row(&self, data: &impl Serialize, cells: &[String]) -> Result<(), String> {
        let line = match self.form {
            Form::Json => serde_json::to_string(data).map_err(|error| error.to_string())?,
            Form::Text => self.aligned(cells),
            Form::Markdown => marked(cells),
        };
        print(&format!("{line}\n"))
    }

    /// Prints what stands below the rows.
    pub(crate) fn end(&self) -> Result<(), String> {
        match self.form {
            Form::Json | Form::Markdown => Ok(()),
            Form::Text => print("\n"),
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

fn marked(cells: &[String]) -> String {
    format!("| {} |", cells.join(" | "))
}

/// Prints to standard output at once.
pub(crate) fn print(text: &str) -> Result<(), String> {
    let mut out = std::io::stdout().lock();
    let written = out.write_all(text.as_bytes()).and_then(|()| out.flush());
    written.map_err(|error| format!("standard output cannot be written: {error}"))
}

/// Says on standard error why something is missing.
pub(crate) fn note(text: &str) {
    let _ = writeln!(std::io::stderr(), "note: {}", text.trim_end());
}
