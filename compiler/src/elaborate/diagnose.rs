//! Diagnostics: suggestions for misspelt names and names of other dialects, and a collection
//! without duplicates.

use super::dialects::dialect_advice;
use sdfc_lang::ast::{Arg, Call, ExprKind};
use sdfc_lang::{Diagnostic, DiagnosticCode, Span};
use std::collections::HashSet;

/// Maximum number of errors before elaboration is aborted.
const MAX_ERRORS: usize = 100;

/// Diagnostics of a run: at most one per code and span, since a body may be evaluated many times.
#[derive(Debug, Default)]
pub(crate) struct Reports {
    diagnostics: Vec<Diagnostic>,
    reported: HashSet<(DiagnosticCode, Span)>,
    errors: usize,
}

impl Reports {
    /// Adds a diagnostic, unless one with its code and span exists.
    pub(crate) fn push(&mut self, diagnostic: Diagnostic) {
        if self.reported.insert((diagnostic.code, diagnostic.span)) {
            self.errors += usize::from(diagnostic.is_error());
            self.diagnostics.push(diagnostic);
        }
    }
    /// Omits diagnostics with the code and span of this one, which follow from another.
    pub(crate) fn suppress(&mut self, diagnostic: &Diagnostic) {
        self.reported.insert((diagnostic.code, diagnostic.span));
    }
    /// Reports whether there is an error.
    pub(crate) fn has_errors(&self) -> bool {
        self.errors > 0
    }
    /// Reports whether the maximum number of errors is reached.
    pub(crate) fn is_full(&self) -> bool {
        self.errors >= MAX_ERRORS
    }
    /// Returns the number of errors reported so far, without warnings.
    pub(crate) fn error_count(&self) -> usize {
        self.errors
    }
    /// Marks the collection as full.
    pub(crate) fn mark_full(&mut self) {
        self.errors = self.errors.max(MAX_ERRORS);
    }
    /// Returns all diagnostics, in the order of the reports and without duplicates.
    pub(crate) fn into_vec(self) -> Vec<Diagnostic> {
        self.diagnostics
    }
}

/// Maximum number of characters of a name to which similar ones are searched.
const MAX_SIMILAR_CHARS: usize = 64;

/// Returns the closest name by edit distance, if one is close enough.
pub(crate) fn nearest<'n>(
    written: &str,
    names: impl IntoIterator<Item = &'n str>,
) -> Option<&'n str> {
    // Allows one edit (a letter swapped, missing or extra) in a short name, two in a longer one.
    let max_distance = match written.chars().count() {
        2..=5 => 1,
        6..=MAX_SIMILAR_CHARS => 2,
        _ => return None,
    };
    let lowercase = written.to_lowercase();
    names
        .into_iter()
        .filter(|name| !name.is_empty() && *name != written && name.len() <= 4 * MAX_SIMILAR_CHARS)
        .map(|name| (strsim::osa_distance(&lowercase, &name.to_lowercase()), name))
        .filter(|(distance, _)| *distance <= max_distance)
        .min()
        .map(|(_, name)| name)
}

/// Adds a "did you mean" fix, if there is a suggestion.
pub(crate) fn suggest(diagnostic: Diagnostic, span: Span, name: Option<&str>) -> Diagnostic {
    match name {
        Some(name) => diagnostic.fix(span, name, format!("did you mean `{name}`?")),
        None => diagnostic,
    }
}

/// Returns the edits that write a call of `mod` or `fmod` at a span as the operator `%`.
pub(crate) fn remainder_edits(call: &Call, span: Span) -> Option<Vec<(Span, String)>> {
    let name = call.callee.as_ident()?;
    let [a, b] = call.args.as_slice() else {
        return None;
    };
    let has_names = a.name.is_some() || b.name.is_some();
    if !matches!(name.name.as_str(), "mod" | "modulo" | "fmod") || has_names {
        return None;
    }
    let brackets = |arg: &Arg| match arg.value.kind {
        ExprKind::Chain(_) | ExprKind::Range(_) | ExprKind::Lambda(_) => ("(", ")"),
        _ => ("", ""),
    };
    let ((open_a, close_a), (open_b, close_b)) = (brackets(a), brackets(b));
    let (first, second) = (a.value.span, b.value.span);
    Some(vec![
        (name.span.to(first.at_start()), format!("({open_a}")),
        (
            first.at_end().to(second.at_start()),
            format!("{close_a} % {open_b}"),
        ),
        (second.at_end().to(span.at_end()), format!("{close_b})")),
    ])
}

/// Describes an unknown name, with a suggestion or the equivalent of another dialect's name.
pub(crate) fn unknown_name<'n>(
    code: DiagnosticCode,
    what: &str,
    name: &str,
    span: Span,
    names: impl IntoIterator<Item = &'n str>,
) -> Diagnostic {
    let diagnostic = Diagnostic::error(code, span, format!("there is no {what} `{name}`"));
    let names: Vec<&str> = names.into_iter().collect();
    match (dialect_advice(name), nearest(name, names.iter().copied())) {
        (Some((Some(replacement), text)), _) => diagnostic.fix(span, replacement, text),
        (Some((None, text)), _) => diagnostic.help(text),
        (None, suggestion) => suggest(diagnostic, span, suggestion),
    }
}
