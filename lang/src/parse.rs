//! Pipeline of the crate: converts text to a tree.
//!
//! The stages are tokens, matching brackets, then one item after the other. An item with a mistake is
//! reported, repaired (for example by an inserted `;`) and parsed again. Later mistakes are thus detected
//! independently. The work is bounded by the number of messages and by the number of tokens that are parsed
//! again.

use crate::ast::{File, Item, Trivia};
use crate::ast_builder::{AstBuilder, NestingError, TopLevel};
use crate::brackets::{self, BalancedTokens, settings_brace};
use crate::codes;
use crate::diagnostic::{Diagnostic, MAX_SHOWN_DIAGNOSTICS};
use crate::grammar::TopLevelParser;
use crate::lex::{Lexed, SpannedToken, lex};
use crate::lints;
use crate::mistakes::{self, ErrorContext, Mistake, Repair};
use crate::span::{FileId, Sources, Span};
use crate::token::Token;
use lalrpop_util::ParseError;

/// Maximum size of a source file, in bytes.
pub const MAX_SOURCE_BYTES: usize = 19 << 19;

/// Parses a file.
///
/// Returns a tree if and only if no diagnostic is an error. The diagnostics are unordered.
pub fn parse(sources: &Sources, file: FileId) -> (Option<File>, Vec<Diagnostic>) {
    let text = sources.text(file);
    if text.len() > MAX_SOURCE_BYTES {
        return (None, vec![too_large(file, text.len())]);
    }
    let Lexed {
        tokens,
        trivia,
        errors: mut diagnostics,
    } = lex(file, text);
    let BalancedTokens { tokens, errors } = match brackets::balance(file, text, tokens) {
        Ok(balanced) => balanced,
        Err(NestingError { offset }) => {
            diagnostics.push(brackets::too_deep(Span::new(file, offset, offset)));
            return (None, diagnostics);
        }
    };
    // An unterminated string or comment hides the brackets after it.
    let unterminated: Vec<_> = diagnostics
        .iter()
        .filter(|error| matches!(error.code, codes::E0103 | codes::E0104))
        .map(|error| error.span.start)
        .collect();
    diagnostics.extend(errors.into_iter().filter(|error| {
        let opener = error.labels.first().map_or(error.span, |label| label.span);
        let is_open_to_end = opener == error.span;
        let contains =
            |index: &u32| opener.start < *index && (is_open_to_end || *index < error.span.start);
        error.code != codes::E0110 || !unterminated.iter().any(contains)
    }));

    let mut parser = Parser {
        file,
        text,
        budget: 8 * tokens.len() + 10_000,
        tokens,
        reported_spans: diagnostics.iter().map(|error| error.span).collect(),
        diagnostics,
    };
    let mut tree = parser.file(trivia);
    let mut diagnostics = parser.diagnostics;
    if diagnostics.is_empty() {
        attach_docs(&mut tree);
        diagnostics.extend(lints::check(&tree));
    }
    let is_valid = !diagnostics.iter().any(Diagnostic::is_error);
    (is_valid.then_some(tree), diagnostics)
}

fn too_large(file: FileId, bytes: usize) -> Diagnostic {
    let message =
        format!("this file is too large: it has {bytes} bytes, and {MAX_SOURCE_BYTES} are allowed");
    Diagnostic::error(codes::E0001, Span::new(file, 0, 0), message)
        .help("split it and `import` the pieces, or write a `for` instead of repetition")
}

struct Parser<'s> {
    file: FileId,
    text: &'s str,
    tokens: Vec<SpannedToken<'s>>,
    /// Number of tokens that may still be parsed.
    budget: usize,
    /// Spans of errors from the stages before the grammar.
    reported_spans: Vec<Span>,
    diagnostics: Vec<Diagnostic>,
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
        let mut index = 0;
        while index < self.tokens.len() {
            let (top_level, end) = self.top_level(index);
            match top_level {
                Some(TopLevel::Item(item)) => file.items.push(*item),
                Some(TopLevel::Result(result)) => file.result = Some(*result),
                None => {}
            }
            index = end;
            if self.budget == 0 || self.diagnostics.len() > 2 * MAX_SHOWN_DIAGNOSTICS {
                break;
            }
        }
        file
    }

    /// Parses the item that starts at a token. Also returns the index after the item.
    fn top_level(&mut self, start: usize) -> (Option<TopLevel>, usize) {
        self.split_leading_sign(start);
        let mut last_mistake: Option<u32> = None;
        let mut is_complete = true;
        loop {
            let end = item_end(&self.tokens, start);
            if end == start {
                return (None, start);
            }
            self.budget = self.budget.saturating_sub(end - start);
            let mut builder = AstBuilder::new(self.file);
            let tokens = self.tokens[start..end].iter().copied();
            let mistake = match TopLevelParser::new().parse(&mut builder, tokens) {
                Ok(top) => {
                    // The removed part may have contained the value that seems to be missing.
                    let errors = builder.errors.into_iter();
                    self.diagnostics
                        .extend(errors.filter(|e| is_complete || e.code != codes::E0121));
                    return (Some(top), end);
                }
                Err(ParseError::User { error }) => {
                    let offset = Span::new(self.file, error.offset, error.offset);
                    self.diagnostics.push(brackets::too_deep(offset));
                    return (None, end);
                }
                Err(error) => self.explain(error, start, end),
            };
            let diagnostic_start = mistake.diagnostic.span.start;
            let token_index = mistake.index;
            let offset = self
                .tokens
                .get(token_index)
                .map_or(self.text.len() as u32, |w| w.0);
            let is_new = last_mistake != Some(offset);
            if is_new && !self.is_follow_up(start, token_index, diagnostic_start) {
                self.diagnostics.push(mistake.diagnostic);
            }
            let repair = match is_new {
                true => mistake.repair,
                // The repair did not help: remove the statement.
                false => Repair::RemoveStatement,
            };
            last_mistake = Some(offset);
            is_complete &= repair != Repair::RemoveStatement;
            if self.budget == 0 || self.diagnostics.len() > 2 * MAX_SHOWN_DIAGNOSTICS {
                return (None, end);
            }
            self.apply_repair(start, token_index, end, repair);
        }
    }

    /// Splits a sign before a list at the start of an item, after the brace of the previous item.
    fn split_leading_sign(&mut self, index: usize) {
        if let (start, Token::SubBlend, end) = self.tokens[index] {
            self.tokens[index] = (start, Token::Minus, start + 1);
            self.tokens
                .insert(index + 1, (start + 1, Token::OpenBracket, end));
        }
    }

    fn explain(
        &self,
        error: ParseError<u32, Token<'s>, NestingError>,
        start: usize,
        end: usize,
    ) -> Mistake {
        let (index, expected) = match error {
            ParseError::UnrecognizedToken {
                token: (offset, token, after),
                expected,
            } => {
                let tokens = &self.tokens[start..end];
                let first = tokens.partition_point(|word| word.0 < offset);
                let is_match = |word: &SpannedToken<'s>| *word == (offset, token, after);
                let steps = tokens[first..].iter().position(is_match).unwrap_or(0);
                (start + first + steps, expected)
            }
            ParseError::UnrecognizedEof { expected, .. } => (end, expected),
            ParseError::InvalidToken { .. }
            | ParseError::ExtraToken { .. }
            | ParseError::User { .. } => (end, Vec::new()),
        };
        mistakes::identify(&ErrorContext {
            file: self.file,
            text: self.text,
            tokens: &self.tokens,
            start,
            index,
            end,
            expected,
        })
    }

    /// Reports whether a mistake follows from a reported or inserted token before it.
    fn is_follow_up(&self, start: usize, token_index: usize, offset: u32) -> bool {
        let is_inserted = |index: usize| {
            let in_range = index >= start && index < self.tokens.len();
            in_range && self.tokens[index].0 == self.tokens[index].2
        };
        let previous = token_index.checked_sub(1);
        let touches = |span: &Span| {
            let on_word = previous.is_some_and(|index| {
                let (start, _, end) = self.tokens[index];
                start < span.end.max(span.start + 1) && span.start < end
            });
            on_word || span.start == offset && !span.is_empty()
        };
        let is_in_comment = token_index == self.tokens.len()
            && self
                .diagnostics
                .iter()
                .any(|diagnostic| diagnostic.code == codes::E0104);
        is_in_comment
            || is_inserted(token_index)
            || previous.is_some_and(is_inserted)
            || self.reported_spans.iter().any(touches)
    }

    fn apply_repair(&mut self, start: usize, index: usize, end: usize, repair: Repair) {
        match repair {
            Repair::Insert(token) => {
                let offset = match index.checked_sub(1) {
                    Some(previous) => self.tokens[previous].2,
                    None => 0,
                };
                self.tokens.insert(index, (offset, token, offset));
            }
            Repair::NameArguments => {
                for index in mistakes::named_arguments(&self.tokens[..end], index) {
                    self.tokens[index].1 = Token::Colon;
                }
            }
            Repair::Replace(token) if index < self.tokens.len() => self.tokens[index].1 = token,
            Repair::Remove if index < self.tokens.len() => {
                self.tokens.remove(index);
            }
            Repair::Replace(_) | Repair::Remove | Repair::RemoveStatement => {
                self.remove_statement(start, index.min(end - 1), end);
            }
        }
    }

    /// Removes the statement, setting or item that contains a token.
    fn remove_statement(&mut self, start: usize, target: usize, end: usize) {
        let Some(brace) = innermost_brace(&self.tokens, start, target) else {
            let item = start..next_item(&self.tokens, target + 1, end);
            self.tokens.drain(item);
            return;
        };
        let item = self.tokens[start..].iter().map(|word| word.1);
        let is_settings = settings_brace(item) == Some(brace - start);
        let separator = match is_settings {
            true => Token::Comma,
            false => Token::Semicolon,
        };
        // Find the piece between separators that contains the token.
        let mut piece_start = brace + 1;
        let mut depth = 0;
        let mut index = piece_start;
        while index < end {
            let token = self.tokens[index].1;
            if token.closer().is_some() {
                depth += 1;
            } else if token.is_closer() {
                if depth == 0 {
                    break;
                }
                depth -= 1;
            } else if depth == 0 && token == separator {
                if index >= target {
                    break;
                }
                piece_start = index + 1;
            } else if depth == 0 && index > target && token == Token::Let {
                break;
            }
            index += 1;
        }
        match self.tokens.get(index).map(|word| word.1) {
            Some(token) if token == separator => {
                self.tokens.drain(piece_start..=index);
            }
            Some(Token::CloseBrace) if !is_settings => {
                // The piece was the block's value, so a placeholder replaces it.
                let offset = self.tokens[index].0;
                let value = (offset, Token::False, offset);
                self.tokens.splice(piece_start..index, [value]);
            }
            _ => {
                self.tokens.drain(piece_start..index);
            }
        }
    }
}

/// Returns the index after the item that starts at `start`.
fn item_end(tokens: &[SpannedToken<'_>], start: usize) -> usize {
    let item = || tokens[start..].iter().map(|word| word.1);
    let is_named_fn =
        item().next() == Some(Token::Fn) && matches!(item().nth(1), Some(Token::Name(_)));
    let ends_with_brace = (is_named_fn && has_block(item())) || settings_brace(item()).is_some();
    let mut depth = 0;
    for (index, (_, token, _)) in tokens.iter().enumerate().skip(start) {
        if token.closer().is_some() {
            depth += 1;
        } else if token.is_closer() {
            depth -= 1;
            if depth == 0 && ends_with_brace && *token == Token::CloseBrace {
                return index + 1;
            }
        } else if depth == 0 && *token == Token::Semicolon {
            return index + 1;
        }
    }
    tokens.len()
}

/// Reports whether the body of a named function is a block instead of an expression after a `=`.
///
/// Such an expression may also end with a brace, as `if a { b } else { c }` does. The item then ends with a
/// `;`.
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

/// Returns the first index in `from..end` at which an item certainly begins, or `end`.
fn next_item(tokens: &[SpannedToken<'_>], from: usize, end: usize) -> usize {
    let mut depth = 0_i32;
    for index in from..end {
        let token = tokens[index].1;
        if token.closer().is_some() {
            depth += 1;
        } else if token.is_closer() {
            depth -= 1;
        }
        let is_named_fn =
            token == Token::Fn && matches!(tokens.get(index + 1), Some((_, Token::Name(_), _)));
        if depth <= 0 && (token.starts_item() || is_named_fn) {
            return index;
        }
    }
    end
}

/// Returns the innermost `{` in `start..position` that is open at `position`.
fn innermost_brace(tokens: &[SpannedToken<'_>], start: usize, position: usize) -> Option<usize> {
    let mut depth = 0;
    for index in (start..position).rev() {
        let token = tokens[index].1;
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

/// Attaches to each item the `///` lines between it and the previous item.
fn attach_docs(file: &mut File) {
    let mut comments = file.trivia.comments.iter().peekable();
    let mut previous_end = 0;
    for Item { docs, span, .. } in &mut file.items {
        let mut lines = Vec::new();
        while let Some(comment) = comments.next_if(|comment| comment.span.start < span.start) {
            let is_doc = comment.kind == crate::ast::CommentKind::Doc;
            if is_doc && comment.span.start >= previous_end {
                let line = comment.text.trim_start_matches('/');
                lines.push(line.strip_prefix(' ').unwrap_or(line).trim_end());
            }
        }
        previous_end = span.end;
        if !lines.is_empty() {
            *docs = Some(lines.join("\n"));
        }
    }
}
