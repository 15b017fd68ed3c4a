//! Where things stand in the source: files, byte ranges in them, and lines and columns for people.
//!
//! A [`Span`] is a half-open byte range in one file of a [`Sources`]. Spans are small and `Copy`, so
//! that every node of the tree can carry one; everything readable (name, text, line, column) is asked
//! of the [`Sources`] that gave out the [`FileId`]. No question about a span can panic: a range past
//! the end, or inside a character, is clamped.

use serde::Serialize;
use std::ops::Range;

/// A file of a [`Sources`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize)]
pub struct FileId(pub u32);

/// A half-open range of bytes in a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Default, Serialize)]
pub struct Span {
    /// The file that the range lies in.
    pub file: FileId,
    /// The first byte.
    pub start: u32,
    /// The byte after the last.
    pub end: u32,
}

impl Span {
    /// The bytes `start..end` of `file`.
    pub fn new(file: FileId, start: u32, end: u32) -> Self {
        Self {
            file,
            start,
            end: end.max(start),
        }
    }

    /// The smallest span that covers both; both lie in the same file.
    pub fn to(self, other: Span) -> Span {
        debug_assert_eq!(self.file, other.file, "a span lies in one file");
        Span {
            file: self.file,
            start: self.start.min(other.start),
            end: self.end.max(other.end),
        }
    }

    /// The empty span where this one starts.
    pub fn at_start(self) -> Span {
        Span {
            end: self.start,
            ..self
        }
    }

    /// The empty span where this one ends.
    pub fn at_end(self) -> Span {
        Span {
            start: self.end,
            ..self
        }
    }

    /// Whether `other` lies within this span.
    pub fn contains(self, other: Span) -> bool {
        self.file == other.file && self.start <= other.start && other.end <= self.end
    }

    /// The number of bytes.
    pub fn len(self) -> u32 {
        self.end - self.start
    }

    /// Whether the span covers no byte: a place between two characters.
    pub fn is_empty(self) -> bool {
        self.start == self.end
    }
}

/// A place for people: both numbers count from one, columns count characters.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct LineCol {
    /// The line, from one.
    pub line: u32,
    /// The character in the line, from one.
    pub column: u32,
}

/// The files of one compilation.
#[derive(Clone, Debug, Default)]
pub struct Sources {
    files: Vec<Source>,
}

#[derive(Clone, Debug)]
struct Source {
    name: String,
    text: String,
    /// The byte at which each line starts.
    lines: Vec<u32>,
}

impl Sources {
    /// No files yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Adds a file under the name that messages call it by.
    pub fn add(&mut self, name: impl Into<String>, text: impl Into<String>) -> FileId {
        let id = FileId(u32::try_from(self.files.len()).unwrap_or(u32::MAX));
        let text = text.into();
        let newlines = text.bytes().enumerate().filter(|(_, b)| *b == b'\n');
        let lines = std::iter::once(0)
            .chain(newlines.map(|(at, _)| at as u32 + 1))
            .collect();
        self.files.push(Source {
            name: name.into(),
            text,
            lines,
        });
        id
    }

    /// The number of files.
    pub fn len(&self) -> usize {
        self.files.len()
    }

    /// Whether there is no file.
    pub fn is_empty(&self) -> bool {
        self.files.is_empty()
    }

    /// Every file, in the order in which they were added.
    pub fn ids(&self) -> impl Iterator<Item = FileId> + use<> {
        (0..self.files.len() as u32).map(FileId)
    }

    /// The name that messages call the file by.
    pub fn name(&self, file: FileId) -> &str {
        self.get(file).map_or("", |source| &source.name)
    }

    /// The whole text of a file.
    pub fn text(&self, file: FileId) -> &str {
        self.get(file).map_or("", |source| &source.text)
    }

    /// The text that a span covers.
    pub fn slice(&self, span: Span) -> &str {
        &self.text(span.file)[self.range(span)]
    }

    /// The span as a range that may index the file's text: inside it, and on character boundaries.
    pub fn range(&self, span: Span) -> Range<usize> {
        let text = self.text(span.file);
        let start = text.floor_char_boundary(span.start as usize);
        let end = text.ceil_char_boundary(span.end as usize).max(start);
        start..end
    }

    /// The line and column of a byte.
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

    /// The line that a byte lies in, counted from zero.
    pub fn line_index(&self, file: FileId, offset: u32) -> usize {
        self.get(file).map_or(0, |source| {
            source.lines.partition_point(|start| *start <= offset) - 1
        })
    }

    /// The first byte of a line counted from zero; the end of the text for a line that is not there.
    pub fn line_start(&self, file: FileId, line: usize) -> u32 {
        let end = self.text(file).len() as u32;
        self.get(file)
            .and_then(|source| source.lines.get(line).copied())
            .unwrap_or(end)
    }

    fn get(&self, file: FileId) -> Option<&Source> {
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
        let at = |offset| {
            let place = sources.line_col(file, offset);
            (place.line, place.column)
        };
        assert_eq!(at(0), (1, 1));
        assert_eq!(at(7), (1, 7), "the two bytes of `ä` are one column");
        assert_eq!(at(12), (2, 1));
        assert_eq!(at(13), (3, 1));
        assert_eq!(at(14), (3, 2));
        assert_eq!(at(999), (3, 2), "past the end is the end");
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
