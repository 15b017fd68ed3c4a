//! Mistakes with what is introduced: names that are missing or reserved, the keywords of other
//! languages, items where they cannot stand.

use super::{Context, Mistake, Repair, SOME_NAME, shortened};
use crate::codes;
use crate::diagnostic::Diagnostic;
use crate::token::Token;

/// Words with which other languages introduce a name.
const LIKE_LET: [&str; 12] = [
    "const", "var", "val", "def", "local", "auto", "mut", "float", "int", "vec2", "vec3", "set",
];
/// Words with which other languages introduce a function.
const LIKE_FN: [&str; 6] = ["function", "func", "def", "module", "fun", "sub"];
/// Words with which other languages begin a loop or a choice.
const LIKE_FOR: [&str; 7] = [
    "while", "loop", "repeat", "foreach", "do", "switch", "match",
];

/// `const x = 1;`, `function f(x) { … }`, `return x;`, `while (c) { … }`
pub(super) fn other_language(context: &Context<'_, '_>) -> Option<Mistake> {
    // The word may be one or two before the place where the grammar noticed.
    for back in [-1, -2] {
        let Some(Token::Name(word)) = context.token(back) else {
            continue;
        };
        let Some(at) = context.index(back) else {
            continue;
        };
        if !context.begins_statement(at) {
            continue;
        }
        let is_followed_by_name = matches!(context.token(back + 1), Some(Token::Name(_)));
        let after_that = context.token(back + 2);
        let span = context.span(back);
        if LIKE_LET.contains(&word)
            && is_followed_by_name
            && matches!(after_that, Some(Token::Assign | Token::Colon))
        {
            return Some(Mistake {
                diagnostic: Diagnostic::error(
                    codes::E0126,
                    span,
                    format!("a name is introduced by `let`, not by `{word}`"),
                )
                .fix(span, "let", "write `let`"),
                at,
                repair: Repair::Replace(Token::Let),
            });
        }
        if LIKE_FN.contains(&word) && is_followed_by_name && after_that == Some(Token::OpenParen) {
            return Some(Mistake {
                diagnostic: Diagnostic::error(
                    codes::E0126,
                    span,
                    format!("a function is introduced by `fn`, not by `{word}`"),
                )
                .fix(span, "fn", "write `fn`"),
                at,
                repair: Repair::Replace(Token::Fn),
            });
        }
        if word == "return" {
            return Some(Mistake {
                diagnostic: Diagnostic::error(codes::E0126, span, "there is no `return`")
                    .help("the last expression of a block, without `;`, is its value"),
                at,
                repair: Repair::LeaveOut,
            });
        }
    }
    let first = context.statement_start(context.at);
    match (context.token(0), context.words.get(first).map(|w| w.1)) {
        (Some(Token::OpenBrace), Some(Token::Name(word))) if LIKE_FOR.contains(&word) => {
            Some(Mistake {
                diagnostic: Diagnostic::error(
                    codes::E0126,
                    context.span_of(first),
                    format!("there is no `{word}`"),
                )
                .help("write `for i in 0..n { … }`, `fold(..)` or `if … { … } else { … }`"),
                at: context.at,
                repair: Repair::LeaveOut,
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
                at: context.at,
                repair: Repair::LeaveOut,
            })
        }
        _ => None,
    }
}

/// `x = 1;`
pub(super) fn missing_let(context: &Context<'_, '_>) -> Option<Mistake> {
    let is_assignment = matches!(
        context.token(0)?,
        Token::Assign | Token::ColonAssign | Token::Colon
    );
    let at = context.index(-1)?;
    let Token::Name(name) = context.words[at].1 else {
        return None;
    };
    (is_assignment && context.begins_statement(at)).then(|| {
        let span = context.span(-1);
        Mistake {
            diagnostic: Diagnostic::error(codes::E0126, span, "a name is introduced by `let`").fix(
                span.at_start(),
                "let ",
                format!("write `let {}`", shortened(name)),
            ),
            at,
            repair: Repair::Insert(Token::Let),
        }
    })
}

/// `fn f(x) { param y = 1; … }`
pub(super) fn item_in_block(context: &Context<'_, '_>) -> Option<Mistake> {
    let (at, what) = match (context.token(-1), context.token(0)?) {
        (_, Token::Param) => (context.at, "a `param`"),
        (_, Token::Part) => (context.at, "a `part`"),
        (_, Token::Import) => (context.at, "an `import`"),
        (Some(Token::Fn), Token::Name(_)) => (context.at - 1, "a function with a name"),
        _ => return None,
    };
    let inside = context.opener(context.at).is_some();
    (inside && context.begins_statement(at)).then(|| Mistake {
        diagnostic: Diagnostic::error(
            codes::E0125,
            context.span_of(at),
            format!("{what} stands at the top level of a file"),
        )
        .primary("not inside of a block"),
        at: context.at,
        repair: Repair::LeaveOut,
    })
}

/// `let f = fn g(x) => x;`
pub(super) fn named_lambda(context: &Context<'_, '_>) -> Option<Mistake> {
    let found = context.token(-1) == Some(Token::Fn)
        && matches!(context.token(0), Some(Token::Name(_)))
        && context.expects("(");
    found.then(|| {
        let span = context.span(0);
        Mistake {
            diagnostic: Diagnostic::error(
                codes::E0131,
                span,
                "a function inside of an expression has no name",
            )
            .fix(span, "", "leave the name out"),
            at: context.at,
            repair: Repair::Remove,
        }
    })
}

/// `let part = 1;`
pub(super) fn reserved(context: &Context<'_, '_>) -> Option<Mistake> {
    let token = context.token(0)?;
    let is_argument_name = context.token(1) == Some(Token::Colon);
    let wanted = context.expects_name() || is_argument_name && context.expects("name");
    if !token.is_reserved() || !wanted {
        return None;
    }
    let span = context.span(0);
    let word = context.slice(span);
    // A keyword that begins something of its own is not meant as a name.
    if token.starts_item() && context.on_new_line() {
        return None;
    }
    Some(Mistake {
        diagnostic: Diagnostic::error(
            codes::E0116,
            span,
            format!("`{word}` is a reserved word and cannot be a name"),
        )
        .fix(span, format!("{word}_"), "choose another name"),
        at: context.at,
        repair: Repair::Replace(SOME_NAME),
    })
}

/// `let = 1;`
pub(super) fn missing(context: &Context<'_, '_>) -> Option<Mistake> {
    let before = context.token(-1)?;
    let what = match before {
        Token::Let => "`let`",
        Token::Param => "`param`",
        Token::Part => "`part`",
        Token::For => "`for`",
        Token::As => "`as`",
        Token::Dot => "`.`",
        Token::PathSeparator => "`::`",
        _ => return None,
    };
    let expects = context.expects_name() && !matches!(context.token(0), Some(Token::Name(_)));
    expects.then(|| {
        let place = context.end_before(context.at);
        let follows = context.token(0).is_some_and(|token| {
            matches!(
                token,
                Token::Number(_) | Token::Text(_) | Token::Color(_) | Token::OpenParen
            )
        });
        let (span, repair) = match follows {
            true => (context.span(0), Repair::Replace(SOME_NAME)),
            false => (place, Repair::Insert(SOME_NAME)),
        };
        let repair = match (before, context.token(0)) {
            (_, Some(Token::OpenParen)) => Repair::LeaveOut,
            (Token::For, _) => Repair::LeaveOut,
            _ => repair,
        };
        Mistake {
            diagnostic: Diagnostic::error(
                codes::E0115,
                span,
                format!("{what} is followed by a name"),
            )
            .primary(match follows {
                true => format!("{} is no name", context.found()),
                false => "a name is missing here".to_owned(),
            }),
            at: context.at,
            repair,
        }
    })
}

/// `import "x.sdf";`
pub(super) fn import_without(context: &Context<'_, '_>) -> Option<Mistake> {
    let Some(Token::Text(path)) = context.token(-1) else {
        return None;
    };
    let found = context.words[context.start].1 == Token::Import && context.expects("as");
    found.then(|| {
        let place = context.end_before(context.at);
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
            diagnostic: Diagnostic::error(codes::E0127, place, "an import needs a name")
                .primary("`as` and a name belong here")
                .fix(place, format!(" as {name}"), "give it a name"),
            at: context.at,
            repair: Repair::LeaveOut,
        }
    })
}
