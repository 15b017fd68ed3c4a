//! Mistakes in numbers that the lexer accepts as tokens.

use super::{ErrorContext, Mistake, Repair};
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::token::Token;

/// Explains numbers that end with a point: `1.`.
pub(super) fn trailing_dot(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let index = context.relative_index(-1)?;
    let (number, dot) = (context.span(-2), context.span(-1));
    let is_number = matches!(context.token_at(-2), Some(Token::Number(_)));
    let applies = is_number
        && context.tokens[index].1 == Token::Dot
        && number.end == dot.start
        && context.expects_name();
    applies.then(|| {
        let digits = context.slice(number);
        let diagnostic = Diagnostic::error(codes::E0134, dot, "a number does not end with a dot");
        Mistake {
            diagnostic: diagnostic.fix(dot.at_end(), "0", format!("write `{digits}.0`")),
            index,
            repair: Repair::Remove,
        }
    })
}
