//! Messages to the user: one type for the terminal, JSON, an editor and the playground.
//!
//! A [`Diagnostic`] is built where the mistake is detected and rendered by the front end:
//!
//! ```
//! use sdfc_lang::{codes, Diagnostic, Sources, Span, Style};
//!
//! let mut sources = Sources::new();
//! let file = sources.add("a.sdf", "sphere(r = 1)");
//! let equals = Span::new(file, 8, 11);
//! let diagnostic = Diagnostic::error(codes::E0117, Span::new(file, 9, 10), "named arguments use `:`")
//!     .primary("not an assignment")
//!     .label(Span::new(file, 6, 7), "in this call")
//!     .fix(equals, ": ", "write `r: 1`");
//! assert!(diagnostic.render(&sources, Style::Plain).contains("a.sdf:1:10"));
//! ```
//!
//! [`Diagnostics`] is the collection that a stage fills. It sorts, removes duplicates and shows a bounded
//! number. Messages are lower case without a full stop: the problem, the given value, the allowed values.
//! The codes are the rows of [`crate::codes`].

mod json;
mod render;

use crate::codes::DiagnosticCode;
use crate::span::Span;
use serde::Serialize;

pub use json::{JsonDiagnostic, JsonEdit, JsonFix, JsonLabel, JsonPosition};
pub use render::Style;

/// Maximum number of diagnostics rendered in one run.
pub const MAX_SHOWN_DIAGNOSTICS: usize = 20;

/// Severity of a diagnostic.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// The input produces no result.
    Error,
    /// There is a result, which may not be the intended one.
    Warning,
    /// Information only.
    Note,
}

/// One message to the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Code of the table row that explains it.
    pub code: DiagnosticCode,
    /// Severity; an error leaves no result.
    pub severity: Severity,
    /// Primary span.
    pub span: Span,
    /// Headline, shown after the code.
    pub message: String,
    /// Text at `span`, which may be empty.
    pub label: String,
    /// Other relevant spans, in this file or another.
    pub labels: Vec<Label>,
    /// Lines of background below the source.
    pub notes: Vec<String>,
    /// Lines of advice below the source.
    pub help: Vec<String>,
    /// Changes that would correct the text.
    pub fixes: Vec<Fix>,
}

/// A span with a text.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// Part of the text that the label marks.
    pub span: Span,
    /// Text, which may be empty.
    pub text: String,
}

/// A change that would correct the text. All its edits belong together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fix {
    /// Description of the change.
    pub message: String,
    /// Edits, which do not overlap.
    pub edits: Vec<Edit>,
}

/// One replacement. An empty span inserts, and an empty replacement deletes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edit {
    /// Span that is replaced.
    pub span: Span,
    /// Text after the replacement.
    pub replacement: String,
}

impl Diagnostic {
    /// Creates an error at a span.
    pub fn error(code: DiagnosticCode, span: Span, message: impl Into<String>) -> Self {
        Self::new(Severity::Error, code, span, message)
    }

    /// Creates a warning at a span.
    pub fn warning(code: DiagnosticCode, span: Span, message: impl Into<String>) -> Self {
        Self::new(Severity::Warning, code, span, message)
    }

    fn new(
        severity: Severity,
        code: DiagnosticCode,
        span: Span,
        message: impl Into<String>,
    ) -> Self {
        Self {
            code,
            severity,
            span,
            message: shortened(message.into()),
            label: String::new(),
            labels: Vec::new(),
            notes: Vec::new(),
            help: Vec::new(),
            fixes: Vec::new(),
        }
    }

    /// Sets the text at the primary span.
    pub fn primary(mut self, text: impl Into<String>) -> Self {
        self.label = shortened(text.into());
        self
    }

    /// Adds a label at another span.
    pub fn label(mut self, span: Span, text: impl Into<String>) -> Self {
        self.labels.push(Label {
            span,
            text: text.into(),
        });
        self
    }

    /// Adds a line of background.
    pub fn note(mut self, text: impl Into<String>) -> Self {
        self.notes.push(text.into());
        self
    }

    /// Adds a line of advice.
    pub fn help(mut self, text: impl Into<String>) -> Self {
        self.help.push(shortened(text.into()));
        self
    }

    /// Adds a correction that replaces `span`.
    pub fn fix(
        self,
        span: Span,
        replacement: impl Into<String>,
        message: impl Into<String>,
    ) -> Self {
        self.fix_all([(span, replacement.into())], message)
    }

    /// Adds a correction of several edits that belong together.
    pub fn fix_all(
        mut self,
        edits: impl IntoIterator<Item = (Span, String)>,
        message: impl Into<String>,
    ) -> Self {
        let edits = edits
            .into_iter()
            .map(|(span, replacement)| Edit { span, replacement })
            .collect();
        self.fixes.push(Fix {
            message: message.into(),
            edits,
        });
        self
    }

    /// Reports whether it is an error.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

/// Maximum number of characters of a message, and those that remain of a longer one's start and end.
const MAX_MESSAGE_CHARS: usize = 1200;
const MESSAGE_START_CHARS: usize = 300;
const MESSAGE_END_CHARS: usize = 100;

/// Returns a message without its middle, if a long name makes it unreadable.
fn shortened(message: String) -> String {
    // Bytes are counted first, since most messages are short.
    if message.len() <= MAX_MESSAGE_CHARS || message.chars().count() <= MAX_MESSAGE_CHARS {
        return message;
    }
    let start: String = message.chars().take(MESSAGE_START_CHARS).collect();
    let end = message.char_indices().rev().nth(MESSAGE_END_CHARS - 1);
    let end = end.map_or("", |(index, _)| &message[index..]);
    format!("{start}…{end}")
}

/// Diagnostics of a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostics {
    diagnostics: Vec<Diagnostic>,
}

impl Diagnostics {
    /// Creates an empty collection.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a diagnostic.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        self.diagnostics.push(diagnostic);
    }

    /// Reports whether any of them is an error.
    pub fn has_errors(&self) -> bool {
        self.diagnostics.iter().any(Diagnostic::is_error)
    }

    /// Reports whether there is no diagnostic.
    pub fn is_empty(&self) -> bool {
        self.diagnostics.is_empty()
    }

    /// Returns the number of added diagnostics, duplicates included.
    pub fn len(&self) -> usize {
        self.diagnostics.len()
    }

    /// Returns all diagnostics in the order of their addition.
    pub fn iter(&self) -> impl Iterator<Item = &Diagnostic> {
        self.diagnostics.iter()
    }

    /// Returns all diagnostics by position, without duplicates.
    ///
    /// Of several with the same code at the same span, the first added one is kept.
    pub fn sorted(&self) -> Vec<&Diagnostic> {
        let mut sorted: Vec<_> = self.diagnostics.iter().collect();
        let key = |d: &&Diagnostic| (d.span.file, d.span.start, d.severity, d.span.end, d.code);
        sorted.sort_by_key(key);
        sorted.dedup_by_key(|d| key(d));
        sorted
    }

    /// Returns the diagnostics to show, by position, and the number of omitted ones.
    ///
    /// Errors take precedence over warnings.
    pub fn shown(&self) -> (Vec<&Diagnostic>, usize) {
        let sorted = self.sorted();
        let total = sorted.len();
        let errors = sorted.iter().filter(|d| d.is_error()).count();
        let mut room_for_errors = MAX_SHOWN_DIAGNOSTICS;
        let mut room_for_others = MAX_SHOWN_DIAGNOSTICS.saturating_sub(errors);
        let shown: Vec<_> = sorted
            .into_iter()
            .filter(|d| {
                let room = match d.is_error() {
                    true => &mut room_for_errors,
                    false => &mut room_for_others,
                };
                let fits = *room > 0;
                *room = room.saturating_sub(1);
                fits
            })
            .collect();
        let left_out = total - shown.len();
        (shown, left_out)
    }
}

impl Extend<Diagnostic> for Diagnostics {
    fn extend<T: IntoIterator<Item = Diagnostic>>(&mut self, diagnostics: T) {
        self.diagnostics.extend(diagnostics);
    }
}

impl FromIterator<Diagnostic> for Diagnostics {
    fn from_iter<T: IntoIterator<Item = Diagnostic>>(diagnostics: T) -> Self {
        Self {
            diagnostics: diagnostics.into_iter().collect(),
        }
    }
}

impl IntoIterator for Diagnostics {
    type Item = Diagnostic;
    type IntoIter = std::vec::IntoIter<Diagnostic>;

    fn into_iter(self) -> Self::IntoIter {
        self.diagnostics.into_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codes;
    use crate::span::{FileId, Sources};

    fn error_at(start: u32) -> Diagnostic {
        Diagnostic::error(codes::E0101, Span::new(FileId(0), start, start), "wrong")
    }

    #[test]
    fn long_names_are_cut_out_of_messages() {
        let name = "é".repeat(1_000_000);
        let span = Span::new(FileId(0), 0, 0);
        let message = format!("there is no name `{name}` here");
        let message = Diagnostic::error(codes::E0201, span, message).message;
        assert_eq!(message.chars().count(), 401);
        assert!(message.starts_with("there is no name `éé") && message.ends_with("é` here"));
    }

    #[test]
    fn diagnostics_are_sorted_and_reported_once() {
        let diagnostics: Diagnostics = [error_at(5), error_at(2), error_at(5)]
            .into_iter()
            .collect();
        let starts: Vec<_> = diagnostics.sorted().iter().map(|d| d.span.start).collect();
        assert_eq!(starts, [2, 5]);
    }

    #[test]
    fn warnings_make_room_for_errors() {
        let mut diagnostics = Diagnostics::new();
        for start in 0..30 {
            let span = Span::new(FileId(0), start, start);
            diagnostics.push(Diagnostic::warning(codes::W0101, span, "hm"));
        }
        diagnostics.extend((100..105).map(error_at));
        let (shown, left_out) = diagnostics.shown();
        assert_eq!(shown.len(), MAX_SHOWN_DIAGNOSTICS);
        assert_eq!(left_out, 15);
        assert_eq!(shown.iter().filter(|d| d.is_error()).count(), 5);
        assert!(shown.is_sorted_by_key(|d| d.span.start));

        let mut sources = Sources::new();
        sources.add("a.sdf", "");
        let text = diagnostics.render(&sources, Style::Plain);
        assert!(text.ends_with("… and 15 more\n"), "{text}");
    }
}
