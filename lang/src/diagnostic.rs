//! What is told to the user: one type for the terminal, JSON, an editor and the playground.
//!
//! A [`Diagnostic`] is built where the mistake is found and rendered at the edge:
//!
//! ```
//! use sdfc_lang::{codes, Diagnostic, Sources, Span, Style};
//!
//! let mut sources = Sources::new();
//! let file = sources.add("a.sdf", "sphere(r = 1)");
//! let equals = Span::new(file, 8, 11);
//! let found = Diagnostic::error(codes::E0117, Span::new(file, 9, 10), "named arguments use `:`")
//!     .primary("not an assignment")
//!     .label(Span::new(file, 6, 7), "in this call")
//!     .fix(equals, ": ", "write `r: 1`");
//! assert!(found.render(&sources, Style::Plain).contains("a.sdf:1:10"));
//! ```
//!
//! [`Diagnostics`] is the collection that a stage fills: it sorts, drops repetitions and shows a
//! bounded number. Messages are lower case without a full stop: what is wrong, what was given, what
//! is allowed. The codes are the rows of [`crate::codes`].

mod json;
mod render;

use crate::codes::Code;
use crate::span::Span;
use serde::Serialize;

pub use json::{JsonDiagnostic, JsonEdit, JsonFix, JsonLabel, JsonPlace};
pub use render::Style;

/// The most diagnostics that are rendered in one run.
pub const MAX_SHOWN: usize = 20;

/// How bad it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Severity {
    /// Nothing is made from this input.
    Error,
    /// Something is made, and it may not be what was meant.
    Warning,
    /// Worth knowing.
    Note,
}

/// One thing that is told to the user.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Diagnostic {
    /// Which row of the table of codes explains it.
    pub code: Code,
    /// How bad it is.
    pub severity: Severity,
    /// The place that it is about.
    pub span: Span,
    /// The headline.
    pub message: String,
    /// What is written at `span`; may be empty.
    pub label: String,
    /// Other places that matter, in this file or another.
    pub labels: Vec<Label>,
    /// Lines of background below the source.
    pub notes: Vec<String>,
    /// Lines of advice below the source.
    pub help: Vec<String>,
    /// Changes that would mend it.
    pub fixes: Vec<Fix>,
}

/// A place and what is said about it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Label {
    /// The place.
    pub span: Span,
    /// What is said; may be empty.
    pub text: String,
}

/// A change to the text that would mend the mistake; all its edits belong together.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fix {
    /// What the change does.
    pub message: String,
    /// The edits, none of which overlap.
    pub edits: Vec<Edit>,
}

/// One replacement; an empty span inserts, an empty replacement deletes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Edit {
    /// What is replaced.
    pub span: Span,
    /// What stands there afterwards.
    pub replacement: String,
}

impl Diagnostic {
    /// An error at a place.
    pub fn error(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self::new(Severity::Error, code, span, message)
    }

    /// A warning at a place.
    pub fn warning(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self::new(Severity::Warning, code, span, message)
    }

    /// A note at a place.
    pub fn note_at(code: Code, span: Span, message: impl Into<String>) -> Self {
        Self::new(Severity::Note, code, span, message)
    }

    fn new(severity: Severity, code: Code, span: Span, message: impl Into<String>) -> Self {
        Self {
            code,
            severity,
            span,
            message: message.into(),
            label: String::new(),
            labels: Vec::new(),
            notes: Vec::new(),
            help: Vec::new(),
            fixes: Vec::new(),
        }
    }

    /// Says something at the place itself.
    pub fn primary(mut self, text: impl Into<String>) -> Self {
        self.label = text.into();
        self
    }

    /// Says something at another place.
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
        self.help.push(text.into());
        self
    }

    /// Adds a change that would mend it: `span` replaced.
    pub fn fix(
        self,
        span: Span,
        replacement: impl Into<String>,
        message: impl Into<String>,
    ) -> Self {
        self.fix_all([(span, replacement.into())], message)
    }

    /// Adds a change of several edits that belong together.
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

    /// Whether it is an error.
    pub fn is_error(&self) -> bool {
        self.severity == Severity::Error
    }
}

/// The diagnostics of a run.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Diagnostics {
    found: Vec<Diagnostic>,
}

impl Diagnostics {
    /// Nothing found yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds one.
    pub fn push(&mut self, diagnostic: Diagnostic) {
        self.found.push(diagnostic);
    }

    /// Whether any of them is an error.
    pub fn has_errors(&self) -> bool {
        self.found.iter().any(Diagnostic::is_error)
    }

    /// Whether nothing was found.
    pub fn is_empty(&self) -> bool {
        self.found.is_empty()
    }

    /// How many were added, repetitions included.
    pub fn len(&self) -> usize {
        self.found.len()
    }

    /// All of them in the order in which they were added.
    pub fn iter(&self) -> impl Iterator<Item = &Diagnostic> {
        self.found.iter()
    }

    /// All of them by position, without repetitions: of two with the same code at the same place,
    /// the first that was added stays.
    pub fn sorted(&self) -> Vec<&Diagnostic> {
        let mut sorted: Vec<_> = self.found.iter().collect();
        let key = |d: &&Diagnostic| (d.span.file, d.span.start, d.severity, d.span.end, d.code);
        sorted.sort_by_key(key);
        sorted.dedup_by_key(|d| key(d));
        sorted
    }

    /// The ones to show, by position, and how many are left out. Errors are never left out for the
    /// sake of warnings.
    pub fn shown(&self) -> (Vec<&Diagnostic>, usize) {
        let sorted = self.sorted();
        let total = sorted.len();
        let errors = sorted.iter().filter(|d| d.is_error()).count();
        let mut room_for_errors = MAX_SHOWN;
        let mut room_for_others = MAX_SHOWN.saturating_sub(errors);
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
    fn extend<T: IntoIterator<Item = Diagnostic>>(&mut self, found: T) {
        self.found.extend(found);
    }
}

impl FromIterator<Diagnostic> for Diagnostics {
    fn from_iter<T: IntoIterator<Item = Diagnostic>>(found: T) -> Self {
        Self {
            found: found.into_iter().collect(),
        }
    }
}

impl IntoIterator for Diagnostics {
    type Item = Diagnostic;
    type IntoIter = std::vec::IntoIter<Diagnostic>;

    fn into_iter(self) -> Self::IntoIter {
        self.found.into_iter()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::codes;
    use crate::span::{FileId, Sources};

    fn at(start: u32) -> Diagnostic {
        Diagnostic::error(codes::E0101, Span::new(FileId(0), start, start), "wrong")
    }

    #[test]
    fn they_are_sorted_and_said_once() {
        let found: Diagnostics = [at(5), at(2), at(5)].into_iter().collect();
        let starts: Vec<_> = found.sorted().iter().map(|d| d.span.start).collect();
        assert_eq!(starts, [2, 5]);
    }

    #[test]
    fn warnings_make_room_for_errors() {
        let mut found = Diagnostics::new();
        for start in 0..30 {
            let span = Span::new(FileId(0), start, start);
            found.push(Diagnostic::warning(codes::W0101, span, "hm"));
        }
        found.extend((100..105).map(at));
        let (shown, left_out) = found.shown();
        assert_eq!(shown.len(), MAX_SHOWN);
        assert_eq!(left_out, 15);
        assert_eq!(shown.iter().filter(|d| d.is_error()).count(), 5);
        assert!(shown.is_sorted_by_key(|d| d.span.start));

        let mut sources = Sources::new();
        sources.add("a.sdf", "");
        let text = found.render(&sources, Style::Plain);
        assert!(text.ends_with("… and 15 more\n"), "{text}");
    }
}
