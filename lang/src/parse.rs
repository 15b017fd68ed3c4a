//! Text to tree: the crate's pipeline.
//!
//! Words, matching brackets, then one item after the other. An item with a mistake is reported,
//! mended as the report suggests (a `;` put in, a statement left out) and parsed again, so that the
//! next mistake is found as if the first had not been made. The work is bounded: by the number of
//! messages and by the number of words that are read again.

use crate::ast::{File, Item, Trivia};
use crate::brackets::{self, Balanced, settings_brace};
use crate::codes;
use crate::diagnostic::{Diagnostic, MAX_SHOWN};
use crate::grammar::TopParser;
use crate::lex::{Lexed, Word, lex};
use crate::lints;
use crate::mistakes::{self, Context, Mistake, Repair};
use crate::span::{FileId, Sources, Span};
use crate::token::Token;
use crate::tree::{Builder, TooDeep, Top};
use lalrpop_util::ParseError;

/// The most bytes that a source file may have.
pub const MAX_SOURCE_BYTES: usize = 19 << 19;

/// Parses a file. There is a tree if and only if none of the diagnostics is an error; the
/// diagnostics are in no particular order.
pub fn parse(sources: &Sources, file: FileId) -> (Option<File>, Vec<Diagnostic>) {
    let text = sources.text(file);
    if text.len() > MAX_SOURCE_BYTES {
        return (None, vec![too_large(file, text.len())]);
    }
    let Lexed {
        words,
        trivia,
        errors: mut found,
    } = lex(file, text);
    let Balanced { words, errors } = match brackets::balance(file, text, words) {
        Ok(balanced) => balanced,
        Err(TooDeep { at }) => {
            found.push(brackets::too_deep(Span::new(file, at, at)));
            return (None, found);
        }
    };
    // A string or comment without an end swallows the brackets behind it.
    let swallowers: Vec<_> = found
        .iter()
        .filter(|error| matches!(error.code, codes::E0103 | codes::E0104))
        .map(|error| error.span.start)
        .collect();
    found.extend(errors.into_iter().filter(|error| {
        let opener = error.labels.first().map_or(error.span, |label| label.span);
        let to_the_end = opener == error.span;
        let inside = |at: &u32| opener.start < *at && (to_the_end || *at < error.span.start);
        error.code != codes::E0110 || !swallowers.iter().any(inside)
    }));

    let mut parser = Parser {
        file,
        text,
        budget: 8 * words.len() + 10_000,
        words,
        already_wrong: found.iter().map(|error| error.span).collect(),
        found,
    };
    let mut tree = parser.file(trivia);
    let mut found = parser.found;
    if found.is_empty() {
        attach_docs(&mut tree);
        found.extend(lints::check(&tree));
    }
    let is_good = !found.iter().any(Diagnostic::is_error);
    (is_good.then_some(tree), found)
}

fn too_large(file: FileId, bytes: usize) -> Diagnostic {
    let message =
        format!("this file is too large: it has {bytes} bytes, and {MAX_SOURCE_BYTES} are allowed");
    Diagnostic::error(codes::E0001, Span::new(file, 0, 0), message)
        .help("split it and `import` the pieces, or let a `for` make what repeats")
}

struct Parser<'s> {
    file: FileId,
    text: &'s str,
    words: Vec<Word<'s>>,
    /// How many more words may be read.
    budget: usize,
    /// Where something was reported before the grammar was asked.
    already_wrong: Vec<Span>,
    found: Vec<Diagnostic>,
}

impl<'s> Parser<'s> {
    fn file(&mut self, trivia: Trivia) -> File {
        let mut file = File {
            id: self.file,
            items: Vec::new(),
            result: None,
            span: Span::new(self.file, 0, self.text.len() as u32),
            trivia,
        };
        let mut at = 0;
        while at < self.words.len() {
            let (top, end) = self.top(at);
            match top {
                Some(Top::Item(item)) => file.items.push(*item),
                Some(Top::Result(result)) => file.result = Some(*result),
                None => {}
            }
            at = end;
            if self.budget == 0 || self.found.len() > 2 * MAX_SHOWN {
                break;
            }
        }
        file
    }

    /// Parses the item that starts at a word; gives the word after it, too.
    fn top(&mut self, start: usize) -> (Option<Top>, usize) {
        self.split_leading_sign(start);
        let mut last_mistake: Option<u32> = None;
        let mut is_whole = true;
        loop {
            let end = item_end(&self.words, start);
            if end == start {
                return (None, start);
            }
            self.budget = self.budget.saturating_sub(end - start);
            let mut builder = Builder::new(self.file);
            let words = self.words[start..end].iter().copied();
            let mistake = match TopParser::new().parse(&mut builder, words) {
                Ok(top) => {
                    // What was left out may have been the value that seems to be missing.
                    let errors = builder.errors.into_iter();
                    self.found
                        .extend(errors.filter(|e| is_whole || e.code != codes::E0121));
                    return (Some(top), end);
                }
                Err(ParseError::User { error }) => {
                    let place = Span::new(self.file, error.at, error.at);
                    self.found.push(brackets::too_deep(place));
                    return (None, end);
                }
                Err(error) => self.explain(error, start, end),
            };
            let offset = mistake.diagnostic.span.start;
            let word = mistake.at;
            let place = self.words.get(word).map_or(self.text.len() as u32, |w| w.0);
            let is_new = last_mistake != Some(place);
            if is_new && !self.follows_a_report(start, word, offset) {
                self.found.push(mistake.diagnostic);
            }
            let repair = match is_new {
                true => mistake.repair,
                // The mend did not help: give up on the statement.
                false => Repair::LeaveOut,
            };
            last_mistake = Some(place);
            is_whole &= repair != Repair::LeaveOut;
            if self.budget == 0 || self.found.len() > 2 * MAX_SHOWN {
                return (None, end);
            }
            self.mend(start, word, end, repair);
        }
    }

    /// A sign before a list at the start of an item, after the brace of the item before it.
    fn split_leading_sign(&mut self, at: usize) {
        if let (start, Token::SubBlend, end) = self.words[at] {
            self.words[at] = (start, Token::Minus, start + 1);
            self.words
                .insert(at + 1, (start + 1, Token::OpenBracket, end));
        }
    }

    fn explain(
        &self,
        error: ParseError<u32, Token<'s>, TooDeep>,
        start: usize,
        end: usize,
    ) -> Mistake {
        let (at, expected) = match error {
            ParseError::UnrecognizedToken {
                token: (offset, token, after),
                expected,
            } => {
                let words = &self.words[start..end];
                let from = words.partition_point(|word| word.0 < offset);
                let is_it = |word: &Word<'s>| *word == (offset, token, after);
                let step = words[from..].iter().position(is_it).unwrap_or(0);
                (start + from + step, expected)
            }
            ParseError::UnrecognizedEof { expected, .. } => (end, expected),
            ParseError::InvalidToken { .. }
            | ParseError::ExtraToken { .. }
            | ParseError::User { .. } => (end, Vec::new()),
        };
        mistakes::explain(&Context {
            file: self.file,
            text: self.text,
            words: &self.words,
            start,
            at,
            end,
            expected,
        })
    }

    /// Whether the word before the mistake was reported or put in, so that this is but its echo.
    fn follows_a_report(&self, start: usize, word: usize, offset: u32) -> bool {
        let is_put_in = |at: usize| {
            let inside = at >= start && at < self.words.len();
            inside && self.words[at].0 == self.words[at].2
        };
        let before = word.checked_sub(1);
        let touches = |span: &Span| {
            let on_word = before.is_some_and(|at| {
                let (start, _, end) = self.words[at];
                start < span.end.max(span.start + 1) && span.start < end
            });
            on_word || span.start == offset && !span.is_empty()
        };
        let swallowed =
            word == self.words.len() && self.found.iter().any(|found| found.code == codes::E0104);
        swallowed
            || is_put_in(word)
            || before.is_some_and(is_put_in)
            || self.already_wrong.iter().any(touches)
    }

    fn mend(&mut self, start: usize, at: usize, end: usize, repair: Repair) {
        match repair {
            Repair::Insert(token) => {
                let place = match at.checked_sub(1) {
                    Some(before) => self.words[before].2,
                    None => 0,
                };
                self.words.insert(at, (place, token, place));
            }
            Repair::Replace(token) if at < self.words.len() => self.words[at].1 = token,
            Repair::Remove if at < self.words.len() => {
                self.words.remove(at);
            }
            Repair::Replace(_) | Repair::Remove | Repair::LeaveOut => {
                self.leave_out(start, at.min(end - 1), end);
            }
        }
    }

    /// Takes out the statement, setting or item that a word belongs to.
    fn leave_out(&mut self, start: usize, at: usize, end: usize) {
        let Some(brace) = innermost_brace(&self.words, start, at) else {
            let item = start..next_item(&self.words, at + 1, end);
            self.words.drain(item);
            return;
        };
        let item = self.words[start..].iter().map(|word| word.1);
        let is_settings = settings_brace(item) == Some(brace - start);
        let separator = match is_settings {
            true => Token::Comma,
            false => Token::Semicolon,
        };
        // Find the pieces between the separators, and the one that the word lies in.
        let mut from = brace + 1;
        let mut depth = 0;
        let mut index = from;
        while index < end {
            let token = self.words[index].1;
            if token.closer().is_some() {
                depth += 1;
            } else if token.is_closer() {
                if depth == 0 {
                    break;
                }
                depth -= 1;
            } else if depth == 0 && token == separator {
                if index >= at {
                    break;
                }
                from = index + 1;
            } else if depth == 0 && index > at && token == Token::Let {
                break;
            }
            index += 1;
        }
        match self.words.get(index).map(|word| word.1) {
            Some(token) if token == separator => {
                self.words.drain(from..=index);
            }
            Some(Token::CloseBrace) if !is_settings => {
                // It was the block's value; something must take its place.
                let place = self.words[index].0;
                let value = (place, Token::False, place);
                self.words.splice(from..index, [value]);
            }
            _ => {
                self.words.drain(from..index);
            }
        }
    }
}

/// The word after the item that starts at `start`.
fn item_end(words: &[Word<'_>], start: usize) -> usize {
    let item = || words[start..].iter().map(|word| word.1);
    let is_named_fn =
        item().next() == Some(Token::Fn) && matches!(item().nth(1), Some(Token::Name(_)));
    let ends_with_brace = (is_named_fn && has_block(item())) || settings_brace(item()).is_some();
    let mut depth = 0;
    for (at, (_, token, _)) in words.iter().enumerate().skip(start) {
        if token.closer().is_some() {
            depth += 1;
        } else if token.is_closer() {
            depth -= 1;
            if depth == 0 && ends_with_brace && *token == Token::CloseBrace {
                return at + 1;
            }
        } else if depth == 0 && *token == Token::Semicolon {
            return at + 1;
        }
    }
    words.len()
}

/// Whether the body of a named function is a block, and not an expression behind a `=`: that may end
/// in a brace too, as `if a { b } else { c }` does, but its own end is a `;`.
fn has_block<'t>(tokens: impl Iterator<Item = Token<'t>>) -> bool {
    let mut depth = 0;
    for token in tokens {
        match token {
            Token::Assign if depth == 0 => return false,
            Token::OpenBrace if depth == 0 => return true,
            _ if token.closer().is_some() => depth += 1,
            _ if token.is_closer() => depth -= 1,
            _ => {}
        }
    }
    true
}

/// The first word in `from..end` at which an item surely begins, else `end`.
fn next_item(words: &[Word<'_>], from: usize, end: usize) -> usize {
    let mut depth = 0_i32;
    for at in from..end {
        let token = words[at].1;
        if token.closer().is_some() {
            depth += 1;
        } else if token.is_closer() {
            depth -= 1;
        }
        let named_fn =
            token == Token::Fn && matches!(words.get(at + 1), Some((_, Token::Name(_), _)));
        if depth <= 0 && (token.starts_item() || named_fn) {
            return at;
        }
    }
    end
}

/// The innermost `{` in `start..at` that is open at `at`.
fn innermost_brace(words: &[Word<'_>], start: usize, at: usize) -> Option<usize> {
    let mut depth = 0;
    for index in (start..at).rev() {
        let token = words[index].1;
        if token.is_closer() {
            depth += 1;
        } else if token.closer().is_some() {
            if depth == 0 && token == Token::OpenBrace {
                return Some(index);
            }
            depth = (depth - 1).max(0);
        }
    }
    None
}

/// Gives each item the text of the `///` lines that stand between it and the item before it.
fn attach_docs(file: &mut File) {
    let mut comments = file.trivia.comments.iter().peekable();
    let mut from = 0;
    for Item { docs, span, .. } in &mut file.items {
        let mut lines = Vec::new();
        while let Some(comment) = comments.next_if(|comment| comment.span.start < span.start) {
            let is_doc = comment.kind == crate::ast::CommentKind::Doc;
            if is_doc && comment.span.start >= from {
                let line = comment.text.trim_start_matches('/');
                lines.push(line.strip_prefix(' ').unwrap_or(line).trim_end());
            }
        }
        from = span.end;
        if !lines.is_empty() {
            *docs = Some(lines.join("\n"));
        }
    }
}
