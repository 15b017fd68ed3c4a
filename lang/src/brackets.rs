//! Makes brackets match before the grammar sees them.
//!
//! After this every bracket is closed by its own kind and brackets nest at most [`MAX_DEPTH`] deep.
//! What does not match is reported where the reader would look for it, with a label on the opener:
//! a `;` or a `let` ends everything but braces, so an unclosed `(` costs its own statement and not
//! the rest of the file.

use crate::ast::MAX_DEPTH;
use crate::codes;
use crate::diagnostic::{Diagnostic, MAX_SHOWN};
use crate::lex::Word;
use crate::span::{FileId, Span};
use crate::token::Token;
use crate::tree::TooDeep;

/// Words whose brackets match.
pub(crate) struct Balanced<'s> {
    pub(crate) words: Vec<Word<'s>>,
    pub(crate) errors: Vec<Diagnostic>,
}

/// Makes brackets match; an error if they nest too deeply.
pub(crate) fn balance<'s>(
    file: FileId,
    text: &str,
    words: Vec<Word<'s>>,
) -> Result<Balanced<'s>, TooDeep> {
    let mut balancer = Balancer {
        file,
        text,
        words: Vec::with_capacity(words.len()),
        open: Vec::new(),
        item: 0,
        errors: Vec::new(),
    };
    for at in 0..words.len() {
        balancer.word(words[at], words.get(at + 1).map(|next| next.1))?;
    }
    balancer.end();
    Ok(Balanced {
        words: balancer.words,
        errors: balancer.errors,
    })
}

/// Where the brace of `kind name { … }` stands among the words of an item that begins like that.
pub(crate) fn settings_brace<'s>(mut item: impl Iterator<Item = Token<'s>>) -> Option<usize> {
    if !matches!(item.next()?, Token::Name(_)) {
        return None;
    }
    match (item.next()?, item.next()) {
        (Token::OpenBrace, _) => Some(1),
        (Token::Name(_), Some(Token::OpenBrace)) => Some(2),
        _ => None,
    }
}

/// The message for text that is nested too deeply.
pub(crate) fn too_deep(span: Span) -> Diagnostic {
    Diagnostic::error(codes::E0109, span, "nested too deeply")
        .primary(format!("more than {MAX_DEPTH} levels"))
        .help("give inner parts a name with `let`")
}

struct Open<'s> {
    token: Token<'s>,
    span: Span,
    /// The braces of `camera { … }`, in which no statement can stand.
    settings: bool,
}

struct Balancer<'s, 't> {
    file: FileId,
    text: &'t str,
    words: Vec<Word<'s>>,
    open: Vec<Open<'s>>,
    /// The first word of the current top-level item.
    item: usize,
    errors: Vec<Diagnostic>,
}

impl<'s> Balancer<'s, '_> {
    fn word(&mut self, word: Word<'s>, next: Option<Token<'s>>) -> Result<(), TooDeep> {
        let (start, token, end) = word;
        let span = Span::new(self.file, start, end);
        if token.closer().is_some() {
            if self.open.len() as u32 >= MAX_DEPTH {
                return Err(TooDeep { at: start });
            }
            let settings = self.open.is_empty() && {
                let item = self.words[self.item..].iter().map(|word| word.1);
                settings_brace(item.chain([token])) == Some(self.words.len() - self.item)
            };
            self.open.push(Open {
                token,
                span,
                settings,
            });
        } else if token.is_closer() {
            if !self.close(token, span) {
                return Ok(());
            }
        } else if token == Token::Semicolon {
            self.unclosed_until(|open| open.token == Token::OpenBrace, span);
        } else if token.starts_item() {
            let is_home = |open: &Open| open.token == Token::OpenBrace && !open.settings;
            self.next_statement(is_home, span);
        }
        let item_word = match token {
            Token::Param | Token::Part | Token::Import => true,
            Token::Fn => matches!(next, Some(Token::Name(_))),
            _ => false,
        };
        if item_word && self.starts_line(start) {
            self.next_statement(|_| false, span);
        }
        self.words.push(word);
        let ends_item = matches!(token, Token::Semicolon | Token::CloseBrace);
        if self.open.is_empty() && ends_item {
            self.item = self.words.len();
        }
        Ok(())
    }

    /// Nobody reads more messages than these.
    fn report(&mut self, error: Diagnostic) {
        if self.errors.len() < 2 * MAX_SHOWN {
            self.errors.push(error);
        }
    }

    /// Whether nothing stands before the word on its line, not even white space.
    fn starts_line(&self, start: u32) -> bool {
        start == 0 || self.text.as_bytes()[start as usize - 1] == b'\n'
    }

    /// Closes what is open above the nearest bracket that the next statement may stand in, and ends
    /// the statement that this belongs to.
    fn next_statement(&mut self, home: impl Fn(&Open<'s>) -> bool, span: Span) {
        if self.unclosed_until(home, span) {
            let end = self.last_end();
            self.words.push((end, Token::Semicolon, end));
            if self.open.is_empty() {
                self.item = self.words.len();
            }
        }
    }

    /// Reports and closes what is open above the nearest bracket for which `home` holds.
    fn unclosed_until(&mut self, home: impl Fn(&Open<'s>) -> bool, span: Span) -> bool {
        let keep = self.open.iter().rposition(home).map_or(0, |at| at + 1);
        if keep == self.open.len() {
            return false;
        }
        self.report_unclosed(keep, span);
        self.close_down_to(keep);
        true
    }

    /// Takes a closing bracket; false if the word is to be left out.
    fn close(&mut self, token: Token<'s>, span: Span) -> bool {
        let closes = |open: &Open| open.token.closer() == Some(token);
        let Some(innermost) = self.open.last() else {
            self.report(
                Diagnostic::error(
                    codes::E0111,
                    span,
                    format!("this `{}` closes nothing", symbol(token)),
                )
                .fix(span, "", "remove it"),
            );
            return false;
        };
        if closes(innermost) {
            self.open.pop();
            return true;
        }
        match self.open.iter().rposition(closes) {
            Some(at) => {
                self.report_unclosed(at + 1, span);
                self.close_down_to(at + 1);
                self.open.pop();
                true
            }
            None => {
                let closer = innermost.token.closer().unwrap_or(token);
                let opener = symbol(innermost.token);
                let message = format!("this `{opener}` is closed by a `{}`", symbol(token));
                self.report(
                    Diagnostic::error(codes::E0111, span, message)
                        .primary(format!("`{}` is wanted here", symbol(closer)))
                        .label(innermost.span, "opened here")
                        .fix(span, symbol(closer), format!("write `{}`", symbol(closer))),
                );
                self.words.push((span.start, closer, span.end));
                self.open.pop();
                if self.open.is_empty() && closer == Token::CloseBrace {
                    self.item = self.words.len();
                }
                false
            }
        }
    }

    /// One report for everything that is open from `keep` on and ends before `next`.
    fn report_unclosed(&mut self, keep: usize, next: Span) {
        let end = self.last_end();
        let unclosed = &self.open[keep..];
        let Some((innermost, others)) = unclosed.split_last() else {
            return;
        };
        let closers: String = unclosed
            .iter()
            .rev()
            .filter_map(|open| open.token.closer().map(symbol))
            .collect();
        let place = Span::new(self.file, end.min(next.start), end.min(next.start));
        let message = format!("unclosed `{}`", symbol(innermost.token));
        let mut found = Diagnostic::error(codes::E0110, place, message)
            .primary(format!("`{closers}` is missing"))
            .label(innermost.span, "opened here");
        for other in others.iter().rev().take(3) {
            found = found.label(other.span, "and here");
        }
        self.report(found.fix(place, closers.clone(), format!("write `{closers}`")));
    }

    fn close_down_to(&mut self, keep: usize) {
        let end = self.last_end();
        for open in self.open.drain(keep..).rev() {
            if let Some(closer) = open.token.closer() {
                self.words.push((end, closer, end));
            }
        }
    }

    fn last_end(&self) -> u32 {
        self.words.last().map_or(0, |(_, _, end)| *end)
    }

    /// At the end of the file the item with the unclosed bracket is left out: what belongs to it is
    /// anyone's guess.
    fn end(&mut self) {
        if let Some(outermost) = self.open.first() {
            let found = Diagnostic::error(
                codes::E0110,
                outermost.span,
                format!("unclosed `{}`", symbol(outermost.token)),
            )
            .primary("opened here and not closed before the end of the file");
            let found = match self.open.last() {
                Some(innermost) if self.open.len() > 1 => found.label(innermost.span, "and this"),
                _ => found,
            };
            self.report(found);
            self.words.truncate(self.item);
        }
    }
}

/// How a bracket is written.
fn symbol(token: Token<'_>) -> &'static str {
    match token {
        Token::OpenParen => "(",
        Token::CloseParen => ")",
        Token::OpenBracket => "[",
        Token::CloseBracket => "]",
        Token::OpenBrace => "{",
        Token::CloseBrace => "}",
        Token::OrBlend => "|[",
        Token::AndBlend => "&[",
        Token::SubBlend => "-[",
        _ => "",
    }
}
