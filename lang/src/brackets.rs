//! Balances brackets before the grammar runs.
//!
//! Afterwards every bracket is closed by its own kind, and brackets nest at most [`MAX_DEPTH`] deep. A
//! mismatch is reported where a reader expects it, with a label on the opening bracket. A `;` or a `let`
//! closes all open brackets except braces. An unclosed `(` therefore affects its own statement only.

use crate::ast::MAX_DEPTH;
use crate::ast_builder::NestingError;
use crate::codes;
use crate::diagnostic::{Diagnostic, MAX_SHOWN_DIAGNOSTICS};
use crate::lex::SpannedToken;
use crate::span::{FileId, Span};
use crate::token::Token;

/// Tokens with matching brackets.
pub(crate) struct BalancedTokens<'s> {
    pub(crate) tokens: Vec<SpannedToken<'s>>,
    pub(crate) errors: Vec<Diagnostic>,
}

/// Balances brackets, or returns an error if they nest too deeply.
pub(crate) fn balance<'s>(
    file: FileId,
    text: &str,
    tokens: Vec<SpannedToken<'s>>,
) -> Result<BalancedTokens<'s>, NestingError> {
    let mut balancer = BracketBalancer {
        file,
        text,
        tokens: Vec::with_capacity(tokens.len()),
        open: Vec::new(),
        item_start: 0,
        errors: Vec::new(),
    };
    for index in 0..tokens.len() {
        balancer.process(tokens[index], tokens.get(index + 1).map(|next| next.1))?;
    }
    balancer.finish();
    Ok(BalancedTokens {
        tokens: balancer.tokens,
        errors: balancer.errors,
    })
}

/// Returns the index of the brace of `kind name { … }` in the tokens of an item, if it begins that way.
pub(crate) fn settings_brace<'s>(
    mut item_tokens: impl Iterator<Item = Token<'s>>,
) -> Option<usize> {
    if !matches!(item_tokens.next()?, Token::Name(_)) {
        return None;
    }
    match (item_tokens.next()?, item_tokens.next()) {
        (Token::OpenBrace, _) => Some(1),
        (Token::Name(_), Some(Token::OpenBrace)) => Some(2),
        _ => None,
    }
}

/// Creates the message for text that is nested too deeply.
pub(crate) fn too_deep(span: Span) -> Diagnostic {
    Diagnostic::error(codes::E0109, span, "nested too deeply")
        .primary(format!("more than {MAX_DEPTH} levels"))
        .help("give inner parts a name with `let`")
}

struct OpenedBracket<'s> {
    token: Token<'s>,
    span: Span,
    /// Set for the braces of `camera { … }`, which contain no statements.
    is_settings: bool,
}

struct BracketBalancer<'s, 't> {
    file: FileId,
    text: &'t str,
    tokens: Vec<SpannedToken<'s>>,
    open: Vec<OpenedBracket<'s>>,
    /// Index of the first token of the current top-level item.
    item_start: usize,
    errors: Vec<Diagnostic>,
}

impl<'s> BracketBalancer<'s, '_> {
    fn process(
        &mut self,
        spanned: SpannedToken<'s>,
        next: Option<Token<'s>>,
    ) -> Result<(), NestingError> {
        let (start, token, end) = spanned;
        let span = Span::new(self.file, start, end);
        if token.closer().is_some() {
            if self.open.len() as u32 >= MAX_DEPTH {
                return Err(NestingError { offset: start });
            }
            let is_settings = self.open.is_empty() && {
                let item_tokens = self.tokens[self.item_start..].iter().map(|word| word.1);
                settings_brace(item_tokens.chain([token]))
                    == Some(self.tokens.len() - self.item_start)
            };
            self.open.push(OpenedBracket {
                token,
                span,
                is_settings,
            });
        } else if token.is_closer() {
            if !self.close(token, span) {
                return Ok(());
            }
        } else if token == Token::Semicolon {
            self.close_unclosed_until(|open| open.token == Token::OpenBrace, span);
        } else if token.starts_item() {
            let may_contain_statement =
                |open: &OpenedBracket| open.token == Token::OpenBrace && !open.is_settings;
            self.next_statement(may_contain_statement, span);
        }
        let is_item_keyword = match token {
            Token::Param | Token::Part | Token::Import => true,
            Token::Fn => matches!(next, Some(Token::Name(_))),
            _ => false,
        };
        if is_item_keyword && self.is_at_line_start(start) {
            self.next_statement(|_| false, span);
        }
        self.tokens.push(spanned);
        let ends_item = matches!(token, Token::Semicolon | Token::CloseBrace);
        if self.open.is_empty() && ends_item {
            self.item_start = self.tokens.len();
        }
        Ok(())
    }

    /// Adds an error, up to twice the number of shown diagnostics.
    fn report(&mut self, error: Diagnostic) {
        if self.errors.len() < 2 * MAX_SHOWN_DIAGNOSTICS {
            self.errors.push(error);
        }
    }

    /// Reports whether the token is the first character of its line.
    fn is_at_line_start(&self, start: u32) -> bool {
        start == 0 || self.text.as_bytes()[start as usize - 1] == b'\n'
    }

    /// Closes the brackets above the nearest one that may contain the next statement, and ends the current
    /// statement.
    fn next_statement(&mut self, is_container: impl Fn(&OpenedBracket<'s>) -> bool, span: Span) {
        if self.close_unclosed_until(is_container, span) {
            let end = self.last_end();
            self.tokens.push((end, Token::Semicolon, end));
            if self.open.is_empty() {
                self.item_start = self.tokens.len();
            }
        }
    }

    /// Reports and closes the brackets above the nearest one that satisfies the predicate. Returns whether
    /// there were any.
    fn close_unclosed_until(
        &mut self,
        is_container: impl Fn(&OpenedBracket<'s>) -> bool,
        span: Span,
    ) -> bool {
        let kept_depth = self
            .open
            .iter()
            .rposition(is_container)
            .map_or(0, |index| index + 1);
        if kept_depth == self.open.len() {
            return false;
        }
        self.report_unclosed(kept_depth, span);
        self.close_down_to(kept_depth);
        true
    }

    /// Processes a closing bracket. Returns `false` if the token is to be dropped.
    fn close(&mut self, token: Token<'s>, span: Span) -> bool {
        let closes = |open: &OpenedBracket| open.token.closer() == Some(token);
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
            Some(index) => {
                self.report_unclosed(index + 1, span);
                self.close_down_to(index + 1);
                self.open.pop();
                true
            }
            None => {
                let closer = innermost.token.closer().unwrap_or(token);
                let opener = symbol(innermost.token);
                let message = format!("this `{opener}` is closed by a `{}`", symbol(token));
                self.report(
                    Diagnostic::error(codes::E0111, span, message)
                        .primary(format!("`{}` belongs here", symbol(closer)))
                        .label(innermost.span, "opened here")
                        .fix(span, symbol(closer), format!("write `{}`", symbol(closer))),
                );
                self.tokens.push((span.start, closer, span.end));
                self.open.pop();
                if self.open.is_empty() && closer == Token::CloseBrace {
                    self.item_start = self.tokens.len();
                }
                false
            }
        }
    }

    /// Reports all brackets from `kept_depth` on in one message, as missing before `next`.
    fn report_unclosed(&mut self, kept_depth: usize, next: Span) {
        let end = self.last_end();
        let unclosed = &self.open[kept_depth..];
        let Some((innermost, others)) = unclosed.split_last() else {
            return;
        };
        let closers: String = unclosed
            .iter()
            .rev()
            .filter_map(|open| open.token.closer().map(symbol))
            .collect();
        let missing_span = Span::new(self.file, end.min(next.start), end.min(next.start));
        let message = format!("unclosed `{}`", symbol(innermost.token));
        let mut diagnostic = Diagnostic::error(codes::E0110, missing_span, message)
            .primary(format!("`{closers}` is missing"))
            .label(innermost.span, "opened here");
        for other in others.iter().rev().take(3) {
            diagnostic = diagnostic.label(other.span, "and here");
        }
        self.report(diagnostic.fix(missing_span, closers.clone(), format!("write `{closers}`")));
    }

    fn close_down_to(&mut self, kept_depth: usize) {
        let end = self.last_end();
        for open in self.open.drain(kept_depth..).rev() {
            if let Some(closer) = open.token.closer() {
                self.tokens.push((end, closer, end));
            }
        }
    }

    fn last_end(&self) -> u32 {
        self.tokens.last().map_or(0, |(_, _, end)| *end)
    }

    /// Reports a bracket that is open at the end of the file.
    ///
    /// The item with this bracket is dropped, since its extent is unknown.
    fn finish(&mut self) {
        if let Some(outermost) = self.open.first() {
            let diagnostic = Diagnostic::error(
                codes::E0110,
                outermost.span,
                format!("unclosed `{}`", symbol(outermost.token)),
            )
            .primary("opened here and not closed before the end of the file");
            let diagnostic = match self.open.last() {
                Some(innermost) if self.open.len() > 1 => {
                    diagnostic.label(innermost.span, "and this")
                }
                _ => diagnostic,
            };
            self.report(diagnostic);
            self.tokens.truncate(self.item_start);
        }
    }
}

/// Returns a bracket as written.
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
