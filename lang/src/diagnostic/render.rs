//! Diagnostics as text for a terminal: source lines with underlines, then notes, help, and each fix as a
//! patch.
//!
//! `annotate-snippets` draws them from the relevant lines instead of the full file. Twenty messages about a
//! large file therefore cost no more than about a small one.

use super::{Diagnostic, Diagnostics, Fix, Severity};
use crate::span::{FileId, Sources, Span};
use annotate_snippets::{Annotation, AnnotationKind, Group, Level, Patch, Renderer, Snippet};
use std::ops::Range;

/// Use of colours in the text.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Style {
    /// Plain text.
    Plain,
    /// ANSI colours.
    Coloured,
}

impl Diagnostic {
    /// Renders the message with its source lines. The result ends with a newline.
    pub fn render(&self, sources: &Sources, style: Style) -> String {
        let mut files = vec![self.span.file];
        for label in &self.labels {
            if !files.contains(&label.span.file) {
                files.push(label.span.file);
            }
        }
        let mut main = level(self.severity)
            .primary_title(self.message.as_str())
            .id(self.code.as_str())
            .elements(files.iter().map(|file| self.snippet(*file, sources)));
        for note in &self.notes {
            main = main.element(Level::NOTE.message(note.as_str()));
        }
        for help in &self.help {
            main = main.element(Level::HELP.message(help.as_str()));
        }
        let mut report = vec![main];
        report.extend(self.fixes.iter().map(|fix| patch(fix, sources)));

        let renderer = match style {
            Style::Plain => Renderer::plain(),
            Style::Coloured => Renderer::styled(),
        };
        let mut text = renderer.render(&report);
        text.push('\n');
        text
    }

    fn snippet<'a>(&'a self, file: FileId, sources: &'a Sources) -> Snippet<'a, Annotation<'a>> {
        let is_in_file = |span: &Span| span.file == file;
        let spans = std::iter::once(&self.span).chain(self.labels.iter().map(|label| &label.span));
        let window = SourceWindow::new(
            spans.filter(|span| is_in_file(span)).copied(),
            file,
            sources,
        );
        let mut snippet = window.snippet();
        if is_in_file(&self.span) {
            let annotation = AnnotationKind::Primary.span(window.range(self.span));
            snippet = snippet.annotation(match self.label.is_empty() {
                true => annotation,
                false => annotation.label(self.label.as_str()),
            });
        }
        let labels = self.labels.iter().filter(|label| is_in_file(&label.span));
        snippet.annotations(labels.map(|label| {
            let annotation = AnnotationKind::Context.span(window.range(label.span));
            match label.text.is_empty() {
                true => annotation,
                false => annotation.label(label.text.as_str()),
            }
        }))
    }
}

impl Diagnostics {
    /// Renders the diagnostics to show, separated by blank lines, and the number of omitted ones.
    pub fn render(&self, sources: &Sources, style: Style) -> String {
        let (shown, left_out) = self.shown();
        let mut text = shown
            .iter()
            .map(|diagnostic| diagnostic.render(sources, style))
            .collect::<Vec<_>>()
            .join("\n");
        if left_out > 0 {
            text.push_str(&format!("\n… and {left_out} more\n"));
        }
        text
    }
}

fn level(severity: Severity) -> Level<'static> {
    match severity {
        Severity::Error => Level::ERROR,
        Severity::Warning => Level::WARNING,
        Severity::Note => Level::NOTE,
    }
}

/// Renders a fix as changed lines, or only its message if a line is too long to be readable.
fn patch<'a>(fix: &'a Fix, sources: &'a Sources) -> Group<'a> {
    const MAX_PATCH_LINE_BYTES: usize = 400;
    let title = Level::HELP.secondary_title(fix.message.as_str());
    let Some(first_edit) = fix.edits.first() else {
        return Group::with_title(title);
    };
    let spans = fix.edits.iter().map(|edit| edit.span);
    let window = SourceWindow::new(spans, first_edit.span.file, sources);
    if window
        .text()
        .lines()
        .any(|line| line.len() > MAX_PATCH_LINE_BYTES)
    {
        return Group::with_title(title);
    }
    let patches = fix
        .edits
        .iter()
        .map(|edit| Patch::new(window.range(edit.span), edit.replacement.as_str()));
    title.element(window.snippet().patches(patches))
}

/// Full lines of a file that contain all given spans.
struct SourceWindow<'a> {
    sources: &'a Sources,
    file: FileId,
    first_line: usize,
    bytes: Range<usize>,
}

impl<'a> SourceWindow<'a> {
    fn new(spans: impl Iterator<Item = Span>, file: FileId, sources: &'a Sources) -> Self {
        let covered = spans.reduce(Span::to).unwrap_or(Span::new(file, 0, 0));
        let covered = sources.range(covered);
        let first_line = sources.line_index(file, covered.start as u32);
        let last_line = sources.line_index(file, covered.end as u32);
        let start = sources.line_start(file, first_line) as usize;
        let end = sources.line_start(file, last_line + 1) as usize;
        Self {
            sources,
            file,
            first_line,
            bytes: start..end,
        }
    }

    fn text(&self) -> &'a str {
        &self.sources.text(self.file)[self.bytes.clone()]
    }

    fn range(&self, span: Span) -> Range<usize> {
        let range = self.sources.range(span);
        range.start - self.bytes.start..range.end - self.bytes.start
    }

    fn snippet<T: Clone>(&self) -> Snippet<'a, T> {
        Snippet::source(self.text())
            .line_start(self.first_line + 1)
            .path(self.sources.name(self.file))
    }
}
