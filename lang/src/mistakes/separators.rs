//! Missing and extra `;`, `,` and `:`.

use super::{ErrorContext, Mistake, Repair};
use crate::brackets::settings_brace;
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::token::Token;

/// Explains a `;` after an item that ends with `}`: `camera { … };`.
pub(super) fn extra_semicolon(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let is_lone = context.token_at(0) == Some(Token::Semicolon) && context.index == context.start;
    is_lone.then(|| {
        let span = context.span(0);
        Mistake {
            diagnostic: Diagnostic::error(codes::E0114, span, "this `;` ends nothing")
                .help("items that end with `}` have no `;`")
                .fix(span, "", "remove it"),
            index: context.index,
            repair: Repair::Remove,
        }
    })
}

/// Explains `;` between settings: `camera { a: 1; b: 2 }`.
pub(super) fn semicolon_between_settings(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let applies = context.token_at(0) == Some(Token::Semicolon) && context.is_in_settings();
    applies.then(|| {
        let span = context.span(0);
        Mistake {
            diagnostic: Diagnostic::error(codes::E0114, span, "settings are separated by `,`").fix(
                span,
                ",",
                "write `,`",
            ),
            index: context.index,
            repair: Repair::Replace(Token::Comma),
        }
    })
}

/// Explains two consecutive expressions at the end of a file, which most likely are two shapes.
pub(super) fn missing_operator(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let following = context.tokens[context.index..].iter().map(|word| word.1);
    let starts_block = settings_brace(following).is_some();
    let first_token = context.tokens[context.start].1;
    let is_value = first_token.starts_operand() && first_token != Token::Fn;
    let applies = context.is_on_new_line()
        && context.expects_operator()
        && context.token_at(0)?.starts_operand()
        && context.opener(context.index).is_none()
        && is_value
        && !starts_block;
    applies.then(|| {
        let gap = context.gap_before(context.index);
        Mistake {
            diagnostic: Diagnostic::error(
                codes::E0101,
                gap,
                "an operator is missing between two expressions",
            )
            .primary("after this one")
            .label(context.span(0), "and before this one")
            .fix(gap, " |", "`|` is the union of two shapes"),
            index: context.index,
            repair: Repair::Insert(Token::Or),
        }
    })
}

/// Explains a statement without `;`, at its end.
pub(super) fn missing_semicolon(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let token = context.token_at(0);
    let ends_here = match token {
        None => true,
        Some(Token::CloseBrace) => true,
        Some(token) => context.is_on_new_line() || token.starts_item(),
    };
    if !ends_here || !context.expects(";") {
        return None;
    }
    let gap = context.gap_before(context.index);
    let mut diagnostic =
        Diagnostic::error(codes::E0112, gap, "missing `;`").primary("a `;` belongs here");
    let first_token = context.tokens[context.statement_start(context.index)].1;
    let is_value = first_token.starts_operand() && first_token != Token::Fn;
    if is_value && context.opener(context.index).is_none() {
        diagnostic = diagnostic.note("only the last expression of a file has no `;`");
    }
    Some(Mistake {
        diagnostic: diagnostic.fix(gap, ";", "write `;`"),
        index: context.index,
        repair: Repair::Insert(Token::Semicolon),
    })
}

/// Explains a setting without `:`: `camera { from [0, 1, 5] }`.
pub(super) fn missing_colon(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let after_name = matches!(context.token_at(-1), Some(Token::Name(_)));
    let before_value =
        context.token_at(0)?.starts_operand() || context.token_at(0)? == Token::Minus;
    let applies = context.expects(":") && context.is_in_settings() && after_name && before_value;
    applies.then(|| {
        let gap = context.gap_before(context.index);
        Mistake {
            diagnostic: Diagnostic::error(codes::E0129, gap, "missing `:`")
                .primary("between the setting's name and its value")
                .fix(gap, ":", "write `:`"),
            index: context.index,
            repair: Repair::Insert(Token::Colon),
        }
    })
}

/// Explains a missing comma: `box(1 2)`, `[1 2]`, `camera { a: 1 b: 2 }`.
pub(super) fn missing_comma(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let separates = match context.tokens[context.opener(context.index)?].1 {
        Token::OpenBrace => context.is_in_settings(),
        _ => context.expects(","),
    };
    let applies = separates
        && (context.expects(",") || context.expects_operator())
        && context.token_at(0)?.starts_operand();
    applies.then(|| {
        let gap = context.gap_before(context.index);
        Mistake {
            diagnostic: Diagnostic::error(codes::E0113, gap, "missing `,`")
                .primary(format!("before {}", context.found_text()))
                .fix(gap, ",", "write `,`"),
            index: context.index,
            repair: Repair::Insert(Token::Comma),
        }
    })
}
