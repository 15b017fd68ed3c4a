//! Diagnostics as data, for editors and scripts.
//!
//! Positions have a line and a column (from one, in characters) and a byte offset in the file.

use super::{Diagnostic, Diagnostics, Severity};
use crate::span::{Sources, Span};
use serde::Serialize;

/// A diagnostic with resolved positions.
#[derive(Clone, Debug, Serialize)]
pub struct JsonDiagnostic {
    /// Code, such as `E0101`.
    pub code: &'static str,
    /// `error`, `warning` or `note`.
    pub severity: Severity,
    /// Headline, shown after the code.
    pub message: String,
    /// Primary span with its text.
    pub primary: JsonLabel,
    /// Other relevant spans.
    pub labels: Vec<JsonLabel>,
    /// Lines of background.
    pub notes: Vec<String>,
    /// Lines of advice.
    pub help: Vec<String>,
    /// Changes that would correct the text.
    pub fixes: Vec<JsonFix>,
}

/// A span with a text.
#[derive(Clone, Debug, Serialize)]
pub struct JsonLabel {
    /// Name of the file.
    pub file: String,
    /// Position of the first character.
    pub start: JsonPosition,
    /// Position after the last character.
    pub end: JsonPosition,
    /// Text, which may be empty.
    pub text: String,
}

/// A position in a file.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct JsonPosition {
    /// Line, from one.
    pub line: u32,
    /// Character in the line, from one.
    pub column: u32,
    /// Byte in the file, from zero.
    pub offset: u32,
}

/// A change that would correct the text.
#[derive(Clone, Debug, Serialize)]
pub struct JsonFix {
    /// Description of the change.
    pub message: String,
    /// Edits, which belong together.
    pub edits: Vec<JsonEdit>,
}

/// One replacement.
#[derive(Clone, Debug, Serialize)]
pub struct JsonEdit {
    /// Name of the file.
    pub file: String,
    /// First replaced character.
    pub start: JsonPosition,
    /// Position after the last replaced character.
    pub end: JsonPosition,
    /// Text after the replacement.
    pub replacement: String,
}

impl Diagnostic {
    /// Converts the diagnostic to serializable data.
    pub fn to_json(&self, sources: &Sources) -> JsonDiagnostic {
        JsonDiagnostic {
            code: self.code.as_str(),
            severity: self.severity,
            message: self.message.clone(),
            primary: json_label(self.span, &self.label, sources),
            labels: self
                .labels
                .iter()
                .map(|other| json_label(other.span, &other.text, sources))
                .collect(),
            notes: self.notes.clone(),
            help: self.help.clone(),
            fixes: self
                .fixes
                .iter()
                .map(|fix| JsonFix {
                    message: fix.message.clone(),
                    edits: fix
                        .edits
                        .iter()
                        .map(|edit| JsonEdit {
                            file: sources.name(edit.span.file).to_owned(),
                            start: json_position(edit.span.at_start(), sources),
                            end: json_position(edit.span.at_end(), sources),
                            replacement: edit.replacement.clone(),
                        })
                        .collect(),
                })
                .collect(),
        }
    }
}

impl Diagnostics {
    /// Converts all diagnostics, by position, to data that serializes to an array.
    pub fn to_json(&self, sources: &Sources) -> Vec<JsonDiagnostic> {
        self.sorted()
            .into_iter()
            .map(|diagnostic| diagnostic.to_json(sources))
            .collect()
    }
}

fn json_label(span: Span, text: &str, sources: &Sources) -> JsonLabel {
    JsonLabel {
        file: sources.name(span.file).to_owned(),
        start: json_position(span.at_start(), sources),
        end: json_position(span.at_end(), sources),
        text: text.to_owned(),
    }
}

fn json_position(empty: Span, sources: &Sources) -> JsonPosition {
    let position = sources.line_col(empty.file, empty.start);
    JsonPosition {
        line: position.line,
        column: position.column,
        offset: empty.start,
    }
}
