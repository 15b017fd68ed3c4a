//! Diagnostics as data, for editors and scripts. Places are given as line and column (from one, in
//! characters) and as the byte in the file.

use super::{Diagnostic, Diagnostics, Severity};
use crate::span::{Sources, Span};
use serde::Serialize;

/// A diagnostic with its places resolved.
#[derive(Clone, Debug, Serialize)]
pub struct JsonDiagnostic {
    /// The code, `E0101`.
    pub code: &'static str,
    /// `error`, `warning` or `note`.
    pub severity: Severity,
    /// The headline.
    pub message: String,
    /// The place, and what is written there.
    pub primary: JsonLabel,
    /// Other places that matter.
    pub labels: Vec<JsonLabel>,
    /// Lines of background.
    pub notes: Vec<String>,
    /// Lines of advice.
    pub help: Vec<String>,
    /// Changes that would mend it.
    pub fixes: Vec<JsonFix>,
}

/// A place and what is said about it.
#[derive(Clone, Debug, Serialize)]
pub struct JsonLabel {
    /// The file's name.
    pub file: String,
    /// The first character.
    pub start: JsonPlace,
    /// The character after the last.
    pub end: JsonPlace,
    /// What is said; may be empty.
    pub text: String,
}

/// A place in a file.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct JsonPlace {
    /// The line, from one.
    pub line: u32,
    /// The character in the line, from one.
    pub column: u32,
    /// The byte in the file, from zero.
    pub offset: u32,
}

/// A change that would mend the mistake.
#[derive(Clone, Debug, Serialize)]
pub struct JsonFix {
    /// What the change does.
    pub message: String,
    /// The edits, all of which belong together.
    pub edits: Vec<JsonEdit>,
}

/// One replacement.
#[derive(Clone, Debug, Serialize)]
pub struct JsonEdit {
    /// The file's name.
    pub file: String,
    /// The first character that is replaced.
    pub start: JsonPlace,
    /// The character after the last one.
    pub end: JsonPlace,
    /// What stands there afterwards.
    pub replacement: String,
}

impl Diagnostic {
    /// The diagnostic as data that serializes.
    pub fn to_json(&self, sources: &Sources) -> JsonDiagnostic {
        JsonDiagnostic {
            code: self.code.as_str(),
            severity: self.severity,
            message: self.message.clone(),
            primary: label(self.span, &self.label, sources),
            labels: self
                .labels
                .iter()
                .map(|other| label(other.span, &other.text, sources))
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
                            start: place(edit.span.at_start(), sources),
                            end: place(edit.span.at_end(), sources),
                            replacement: edit.replacement.clone(),
                        })
                        .collect(),
                })
                .collect(),
        }
    }
}

impl Diagnostics {
    /// All of them by position, as data that serializes to an array.
    pub fn to_json(&self, sources: &Sources) -> Vec<JsonDiagnostic> {
        self.sorted()
            .into_iter()
            .map(|diagnostic| diagnostic.to_json(sources))
            .collect()
    }
}

fn label(span: Span, text: &str, sources: &Sources) -> JsonLabel {
    JsonLabel {
        file: sources.name(span.file).to_owned(),
        start: place(span.at_start(), sources),
        end: place(span.at_end(), sources),
        text: text.to_owned(),
    }
}

fn place(empty: Span, sources: &Sources) -> JsonPlace {
    let at = sources.line_col(empty.file, empty.start);
    JsonPlace {
        line: at.line,
        column: at.column,
        offset: empty.start,
    }
}
