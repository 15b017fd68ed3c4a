//! Mistakes with `;`, `,` and `:`, missing and in excess.

use super::{Context, Mistake, Repair};
use crate::brackets::settings_brace;
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::token::Token;

/// `camera { … };`
pub(super) fn unneeded_semicolon(context: &Context<'_, '_>) -> Option<Mistake> {
    let is_lone = context.token(0) == Some(Token::Semicolon) && context.at == context.start;
    is_lone.then(|| {
        let span = context.span(0);
        Mistake {
            diagnostic: Diagnostic::error(codes::E0114, span, "this `;` ends nothing")
                .help("items that end with `}` have no `;`")
                .fix(span, "", "remove it"),
            at: context.at,
            repair: Repair::Remove,
        }
    })
}

/// `camera { a: 1; b: 2 }`
pub(super) fn semicolon_between_settings(context: &Context<'_, '_>) -> Option<Mistake> {
    let found = context.token(0) == Some(Token::Semicolon) && context.in_settings();
    found.then(|| {
        let span = context.span(0);
        Mistake {
            diagnostic: Diagnostic::error(codes::E0114, span, "settings are separated by `,`").fix(
                span,
                ",",
                "write `,`",
            ),
            at: context.at,
            repair: Repair::Replace(Token::Comma),
        }
    })
}

/// Two expressions in a row at the end of a file: most likely two shapes.
pub(super) fn missing_operator(context: &Context<'_, '_>) -> Option<Mistake> {
    let rest = context.words[context.at..].iter().map(|word| word.1);
    let starts_block = settings_brace(rest).is_some();
    let first = context.words[context.start].1;
    let is_value = first.starts_operand() && first != Token::Fn;
    let found = context.on_new_line()
        && context.expects_operator()
        && context.token(0)?.starts_operand()
        && context.opener(context.at).is_none()
        && is_value
        && !starts_block;
    found.then(|| {
        let place = context.end_before(context.at);
        Mistake {
            diagnostic: Diagnostic::error(
                codes::E0101,
                place,
                "an operator is missing between two expressions",
            )
            .primary("after this one")
            .label(context.span(0), "and before this one")
            .fix(place, " |", "`|` is the union of two shapes"),
            at: context.at,
            repair: Repair::Insert(Token::Or),
        }
    })
}

/// A statement that ends without `;`, said where it ends.
pub(super) fn missing_semicolon(context: &Context<'_, '_>) -> Option<Mistake> {
    let token = context.token(0);
    let ends_here = match token {
        None => true,
        Some(Token::CloseBrace) => true,
        Some(token) => context.on_new_line() || token.starts_item(),
    };
    if !ends_here || !context.expects(";") {
        return None;
    }
    let place = context.end_before(context.at);
    let mut diagnostic =
        Diagnostic::error(codes::E0112, place, "missing `;`").primary("a `;` belongs here");
    let first = context.words[context.statement_start(context.at)].1;
    let is_value = first.starts_operand() && first != Token::Fn;
    if is_value && context.opener(context.at).is_none() {
        diagnostic = diagnostic.note("only the last expression of a file has no `;`");
    }
    Some(Mistake {
        diagnostic: diagnostic.fix(place, ";", "write `;`"),
        at: context.at,
        repair: Repair::Insert(Token::Semicolon),
    })
}

/// `camera { from [0, 1, 5] }`
pub(super) fn missing_colon(context: &Context<'_, '_>) -> Option<Mistake> {
    let after_name = matches!(context.token(-1), Some(Token::Name(_)));
    let before_value = context.token(0)?.starts_operand() || context.token(0)? == Token::Minus;
    let found = context.expects(":") && context.in_settings() && after_name && before_value;
    found.then(|| {
        let place = context.end_before(context.at);
        Mistake {
            diagnostic: Diagnostic::error(codes::E0129, place, "missing `:`")
                .primary("between the setting's name and its value")
                .fix(place, ":", "write `:`"),
            at: context.at,
            repair: Repair::Insert(Token::Colon),
        }
    })
}

/// `box(1 2)`, `[1 2]`, `camera { a: 1 b: 2 }`
pub(super) fn missing_comma(context: &Context<'_, '_>) -> Option<Mistake> {
    let separates = match context.words[context.opener(context.at)?].1 {
        Token::OpenBrace => context.in_settings(),
        _ => context.expects(","),
    };
    let found = separates
        && (context.expects(",") || context.expects_operator())
        && context.token(0)?.starts_operand();
    found.then(|| {
        let place = context.end_before(context.at);
        Mistake {
            diagnostic: Diagnostic::error(codes::E0113, place, "missing `,`")
                .primary(format!("before {}", context.found()))
                .fix(place, ",", "write `,`"),
            at: context.at,
            repair: Repair::Insert(Token::Comma),
        }
    })
}
