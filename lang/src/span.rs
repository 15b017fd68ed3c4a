//! Source positions: files, byte ranges in them, and lines and columns for users.
//!
//! A [`Span`] is a half-open byte range in one file of a [`Sources`]. Spans are small and `Copy`, so every
//! node of the tree has one. The [`Sources`] that created the [`FileId`] resolves names, texts, lines and
//! columns. No query panics: a range past the end, or inside a character, is clamped.

use serde::Serialize;
use std::ops::Range;

/// Id of a file in a [`Sources`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize)]
pub struct FileId(pub u32);

/// Half-open range of bytes in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize)]
pub struct Span {
    /// File of the range.
    pub file: FileId,
    /// Offset of the first byte, from 0.
    pub start: u32,
    /// Offset of the byte after the last one.
    pub end: u32,
}

impl Span {
    /// Creates the span `start..end` of `file`.
    pub fn new(file: FileId, start: u32, end: u32) -> Self {
        Self {
            file,
            start,
            end: end.max(start),
        }
    }

    /// Returns the smallest span that covers both. Both are in the same file.
    pub fn to(self, other: Span) -> Span {
        debug_assert_eq!(self.file, other.file, "a span lies in one file");
        Span {
            file: self.file,
            start: self.start.min(other.start),
            end: self.end.max(other.end),
        }
    }

    /// Returns the empty span at the start of this one.
    pub fn at_start(self) -> Span {
        Span {
            end: self.start,
            ..self
        }
    }

    /// Returns the empty span at the end of this one.
    pub fn at_end(self) -> Span {
        Span {
            start: self.end,
            ..self
        }
    }

    /// Reports whether `other` is within this span.
    pub fn contains(self, other: Span) -> bool {
        self.file == other.file && self.start <= other.start && other.end <= self.end
    }

    /// Returns the number of bytes.
    pub fn len(self) -> u32 {
        self.end - self.start
    }

    /// Reports whether the span is empty: a position between two characters.
    pub fn is_empty(self) -> bool {
        self.start == self.end
    }
}

/// Position for users. Both numbers count from one, and columns count characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct LineCol {
    /// Line, from one.
    pub line: u32,
    /// Character in the line, from one.
    pub column: u32,
}

/// Source files of one compilation.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    files: Vec<LoadedSource>,
}

#[derive(Clone, Debug)]
struct LoadedSource {
    name: String,
    text: String,
    /// First byte of each line.
    lines: Vec<u32>,
}

impl Sources {
    /// Creates an empty set of files.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a file under the name that messages use.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> FileId {
        let id = FileId(u32::try_from(self.files.len()).unwrap_or(u32::MAX));
        let text = text.into();
        let newlines = text.bytes().enumerate().filter(|(_, b)| *b == b'\n');
        let lines = std::iter::once(0)
            .chain(newlines.map(|(offset, _)| offset as u32 + 1))
            .collect();
        self.files.push(LoadedSource {
            name: name.into(),
            text,
            lines,
        });
        id
    }

    /// Returns the number of files.
    pub fn len(&self) -> usize {
        self.files.len()
    }

    /// Reports whether there is no file.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// Returns all files, in the order of their addition.
    pub fn ids(&self) -> impl Iterator<Item = FileId> + use<> {
        (0..self.files.len() as u32).map(FileId)
    }

    /// Returns the name of a file in messages.
    pub fn name(&self, file: FileId) -> &str {
        self.get(file).map_or("", |source| &source.name)
    }

    /// Returns the full text of a file.
    pub fn text(&self, file: FileId) -> &str {
        self.get(file).map_or("", |source| &source.text)
    }

    /// Returns the text that a span covers.
    pub fn slice(&self, span: Span) -> &str {
        &self.text(span.file)[self.range(span)]
    }

    /// Returns the span as a valid index range of the file's text, on character boundaries.
    pub fn range(&self, span: Span) -> Range<usize> {
        let text = self.text(span.file);
        let start = text.floor_char_boundary(span.start as usize);
        let end = text.ceil_char_boundary(span.end as usize).max(start);
        start..end
    }

    /// Returns the line and column of a byte.
    pub fn line_col(&self, file: FileId, offset: u32) -> LineCol {
        let line = self.line_index(file, offset);
        let text = self.text(file);
        let start = self.line_start(file, line) as usize;
        let end = text.floor_char_boundary(offset as usize).max(start);
        LineCol {
            line: line as u32 + 1,
            column: text[start..end].chars().count() as u32 + 1,
        }
    }

    /// Returns the line of a byte, counted from zero.
    pub fn line_index(&self, file: FileId, offset: u32) -> usize {
        self.get(file).map_or(0, |source| {
            source.lines.partition_point(|start| *start <= offset) - 1
        })
    }

    /// Returns the first byte of a line, counted from zero, or the end of the text if there is no such
    /// line.
    pub fn line_start(&self, file: FileId, line: usize) -> u32 {
        let end = self.text(file).len() as u32;
        self.get(file)
            .and_then(|source| source.lines.get(line).copied())
            .unwrap_or(end)
    }

    fn get(&self, file: FileId) -> Option<&LoadedSource> {
        self.files.get(file.0 as usize)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_and_columns_count_characters_from_one() {
        let mut sources = Sources::new();
        let file = sources.add("a.sdf", "let ä = 1;\n\nb");
        let position = |offset| {
            let line_col = sources.line_col(file, offset);
            (line_col.line, line_col.column)
        };
        assert_eq!(position(0), (1, 1));
        assert_eq!(position(7), (1, 7), "the two bytes of `ä` are one column");
        assert_eq!(position(12), (2, 1));
        assert_eq!(position(13), (3, 1));
        assert_eq!(position(14), (3, 2));
        assert_eq!(position(999), (3, 2), "past the end is the end");
    }

    #[test]
    fn a_span_that_fits_no_text_is_clamped() {
        let mut sources = Sources::new();
        let file = sources.add("a.sdf", "ä");
        assert_eq!(sources.slice(Span::new(file, 1, 1)), "ä");
        assert_eq!(sources.slice(Span::new(file, 7, 900)), "");
        assert_eq!(sources.slice(Span::new(FileId(5), 0, 4)), "");
    }
}
