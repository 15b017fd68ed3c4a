//! Mistakes in definitions: missing or reserved names, keywords of other languages, and items in wrong
//! positions.

use super::{ErrorContext, Mistake, PLACEHOLDER_NAME, Repair, shorten};
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::token::Token;

/// Words that define a name in other languages.
const FOREIGN_LET_WORDS: [&str; 12] = [
    "const", "var", "val", "def", "local", "auto", "mut", "float", "int", "vec2", "vec3", "set",
];
/// Words that define a function in other languages.
const FOREIGN_FN_WORDS: [&str; 6] = ["function", "func", "def", "module", "fun", "sub"];
/// Words that begin a loop or a branch in other languages.
const FOREIGN_CONTROL_WORDS: [&str; 7] = [
    "while", "loop", "repeat", "foreach", "do", "switch", "match",
];

/// Explains statements in the words of other languages: `const x = 1;`, `function f(x) { … }`, `return x;`,
/// `while (c) { … }`.
pub(super) fn other_language(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    // The word may be one or two tokens before the position of the error.
    for offset in [-1, -2] {
        let Some(Token::Name(word)) = context.token_at(offset) else {
            continue;
        };
        let Some(index) = context.relative_index(offset) else {
            continue;
        };
        let span = context.span(offset);
        if let Some(mistake) = mutable_name(context, offset, index) {
            return Some(mistake);
        }
        if !context.starts_statement(index) {
            continue;
        }
        let is_followed_by_name = matches!(context.token_at(offset + 1), Some(Token::Name(_)));
        let second_next = context.token_at(offset + 2);
        if FOREIGN_LET_WORDS.contains(&word)
            && is_followed_by_name
            && matches!(second_next, Some(Token::Assign | Token::Colon))
        {
            return Some(Mistake {
                diagnostic: Diagnostic::error(
                    codes::E0126,
                    span,
                    format!("a name is introduced by `let`, not by `{word}`"),
                )
                .fix(span, "let", "write `let`"),
                index,
                repair: Repair::Replace(Token::Let),
            });
        }
        if FOREIGN_FN_WORDS.contains(&word)
            && is_followed_by_name
            && second_next == Some(Token::OpenParen)
        {
            return Some(Mistake {
                diagnostic: Diagnostic::error(
                    codes::E0126,
                    span,
                    format!("a function is introduced by `fn`, not by `{word}`"),
                )
                .fix(span, "fn", "write `fn`"),
                index,
                repair: Repair::Replace(Token::Fn),
            });
        }
        if word == "return" {
            return Some(Mistake {
                diagnostic: Diagnostic::error(codes::E0126, span, "there is no `return`")
                    .help("the last expression of a block, without `;`, is its value"),
                index,
                repair: Repair::RemoveStatement,
            });
        }
    }
    let start = context.statement_start(context.index);
    match (context.token_at(0), context.tokens.get(start).map(|w| w.1)) {
        (Some(Token::OpenBrace), Some(Token::Name(word)))
            if FOREIGN_CONTROL_WORDS.contains(&word) =>
        {
            Some(Mistake {
                diagnostic: Diagnostic::error(
                    codes::E0126,
                    context.token_span(start),
                    format!("there is no `{word}`"),
                )
                .help("write `for i in 0..n { … }`, `fold(..)` or `if … { … } else { … }`"),
                index: context.index,
                repair: Repair::RemoveStatement,
            })
        }
        (Some(Token::Name(word @ ("elif" | "elsif" | "elseif"))), _) => {
            let span = context.span(0);
            Some(Mistake {
                diagnostic: Diagnostic::error(
                    codes::E0126,
                    span,
                    format!("`{word}` is written `else if`"),
                )
                .fix(span, "else if", "write `else if`"),
                index: context.index,
                repair: Repair::RemoveStatement,
            })
        }
        _ => None,
    }
}

/// Explains a definition without `let`: `x = 1;`.
pub(super) fn missing_let(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let is_assignment = matches!(
        context.token_at(0)?,
        Token::Assign | Token::ColonAssign | Token::Colon
    );
    let index = context.relative_index(-1)?;
    let Token::Name(name) = context.tokens[index].1 else {
        return None;
    };
    (is_assignment && context.starts_statement(index)).then(|| {
        let span = context.span(-1);
        Mistake {
            diagnostic: Diagnostic::error(codes::E0126, span, "a name is introduced by `let`").fix(
                span.at_start(),
                "let ",
                format!("write `let {}`", shorten(name)),
            ),
            index,
            repair: Repair::Insert(Token::Let),
        }
    })
}

/// Explains an item of the top level that stands in a block: `fn f(x) { param y = 1; … }`.
pub(super) fn item_in_block(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let (index, subject) = match (context.token_at(-1), context.token_at(0)?) {
        (_, Token::Param) => (context.index, "a `param`"),
        (_, Token::Part) => (context.index, "a `part`"),
        (_, Token::Import) => (context.index, "an `import`"),
        (Some(Token::Fn), Token::Name(_)) => (context.index - 1, "a function with a name"),
        _ => return None,
    };
    let inside = context.opener(context.index).is_some();
    (inside && context.starts_statement(index)).then(|| Mistake {
        diagnostic: Diagnostic::error(
            codes::E0125,
            context.token_span(index),
            format!("{subject} stands at the top level of a file"),
        )
        .primary("not inside of a block"),
        index: context.index,
        repair: Repair::RemoveStatement,
    })
}

/// Explains a lambda with a name: `let f = fn g(x) => x;`.
pub(super) fn named_lambda(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let applies = context.token_at(-1) == Some(Token::Fn)
        && matches!(context.token_at(0), Some(Token::Name(_)))
        && context.expects("(");
    applies.then(|| {
        let span = context.span(0);
        Mistake {
            diagnostic: Diagnostic::error(
                codes::E0131,
                span,
                "a function inside of an expression has no name",
            )
            .fix(span, "", "leave the name out"),
            index: context.index,
            repair: Repair::Remove,
        }
    })
}

/// Explains a reserved word in the place of a name: `let part = 1;`.
pub(super) fn reserved(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let token = context.token_at(0)?;
    let is_argument_name = context.token_at(1) == Some(Token::Colon);
    let expects_name = context.expects_name() || is_argument_name && context.expects("name");
    if !token.is_reserved() || !expects_name {
        return None;
    }
    let span = context.span(0);
    let word = context.slice(span);
    // A keyword that begins a new item is not intended as a name.
    if token.starts_item() && context.is_on_new_line() {
        return None;
    }
    Some(Mistake {
        diagnostic: Diagnostic::error(
            codes::E0116,
            span,
            format!("`{word}` is a reserved word and cannot be a name"),
        )
        .fix(span, format!("{word}_"), "choose another name"),
        index: context.index,
        repair: Repair::Replace(PLACEHOLDER_NAME),
    })
}

/// Explains a keyword without the name that it requires: `let = 1;`.
pub(super) fn missing(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let keyword = context.token_at(-1)?;
    let subject = match keyword {
        Token::Let => "`let`",
        Token::Param => "`param`",
        Token::Part => "`part`",
        Token::For => "`for`",
        Token::As => "`as`",
        Token::Dot => "`.`",
        Token::PathSeparator => "`::`",
        _ => return None,
    };
    let expects = context.expects_name() && !matches!(context.token_at(0), Some(Token::Name(_)));
    expects.then(|| {
        let gap = context.gap_before(context.index);
        let follows = context.token_at(0).is_some_and(|token| {
            matches!(
                token,
                Token::Number(_) | Token::Text(_) | Token::Color(_) | Token::OpenParen
            )
        });
        let (span, repair) = match follows {
            true => (context.span(0), Repair::Replace(PLACEHOLDER_NAME)),
            false => (gap, Repair::Insert(PLACEHOLDER_NAME)),
        };
        let repair = match (keyword, context.token_at(0)) {
            (_, Some(Token::OpenParen)) => Repair::RemoveStatement,
            (Token::For, _) => Repair::RemoveStatement,
            _ => repair,
        };
        let diagnostic = Diagnostic::error(
            codes::E0115,
            span,
            format!("{subject} is followed by a name"),
        )
        .primary(match follows {
            true => format!("{} is not a name", context.found_text()),
            false => "a name is missing here".to_owned(),
        });
        Mistake {
            diagnostic: match keyword {
                Token::For => diagnostic.help(
                    "a loop is written `union(for i in 0..6 { sphere(1).translate(i, 0, 0) })`",
                ),
                _ => diagnostic,
            },
            index: context.index,
            repair,
        }
    })
}

/// Explains `let mut x = 1;`.
fn mutable_name(context: &ErrorContext<'_, '_>, offset: isize, index: usize) -> Option<Mistake> {
    let is_after_let = index > 0 && context.tokens[index - 1].1 == Token::Let;
    let is_before_name = matches!(context.token_at(offset + 1), Some(Token::Name(_)));
    let applies = context.token_at(offset) == Some(Token::Name("mut"));
    (applies && is_after_let && is_before_name).then(|| Mistake {
        diagnostic: Diagnostic::error(
            codes::E0126,
            context.span(offset),
            "names do not change, so there is no `mut`",
        )
        .help("introduce another name, or the same one again by `let`"),
        index,
        repair: Repair::RemoveStatement,
    })
}

/// Explains an import without `as` and an alias: `import "x.sdf";`.
pub(super) fn import_without(context: &ErrorContext<'_, '_>) -> Option<Mistake> {
    let Some(Token::Text(path)) = context.token_at(-1) else {
        return None;
    };
    let applies = context.tokens[context.start].1 == Token::Import && context.expects("as");
    applies.then(|| {
        let gap = context.gap_before(context.index);
        let stem = path
            .trim_matches('"')
            .rsplit('/')
            .next()
            .unwrap_or_default();
        let stem: String = stem
            .trim_end_matches(".sdf")
            .chars()
            .map(|c| if c.is_ascii_alphanumeric() { c } else { '_' })
            .collect();
        let is_name = stem.starts_with(|c: char| c.is_ascii_alphabetic());
        let name = if is_name { stem } else { "parts".to_owned() };
        Mistake {
            diagnostic: Diagnostic::error(codes::E0127, gap, "an import needs a name")
                .primary("`as` and a name belong here")
                .fix(gap, format!(" as {name}"), "give it a name"),
            index: context.index,
            repair: Repair::RemoveStatement,
        }
    })
}
