//! The words of the language. Logos makes the lexer from the patterns; [`crate::lex`] drives it,
//! takes out comments and checks literals, so that the grammar meets only what it can use.
//!
//! `|[`, `&[` and `-[` are words of their own, written without a space: the blend of an operator. A
//! character that begins no word becomes [`Token::Unknown`], and things that other languages have
//! (`^`, `**`, `?`, `'text'`) have words too, so that they can be answered with a hint.

use logos::{Lexer, Logos};

/// A word, with its text where the text varies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Logos)]
#[logos(skip r"[ \t\r\n\f\u{feff}]+")]
pub(crate) enum Token<'s> {
    #[token("let")]
    Let,
    #[token("fn")]
    Fn,
    #[token("param")]
    Param,
    #[token("part")]
    Part,
    #[token("import")]
    Import,
    #[token("as")]
    As,
    #[token("if")]
    If,
    #[token("else")]
    Else,
    #[token("for")]
    For,
    #[token("in")]
    In,
    #[token("by")]
    By,
    #[token("blend")]
    Blend,
    #[token("true")]
    True,
    #[token("false")]
    False,

    #[regex(r"[A-Za-z_][A-Za-z0-9_]*")]
    Name(&'s str),
    /// Digits, then perhaps letters, which ought to be a unit.
    #[regex(r"([0-9][0-9_]*(\.[0-9][0-9_]*)?|\.[0-9][0-9_]*)([eE][+-]?[0-9][0-9_]*)?([A-Za-z][A-Za-z0-9_]*)?")]
    Number(&'s str),
    #[regex(r"#[0-9A-Za-z_]*")]
    Color(&'s str),
    /// A string with its quotes; without the second one if the line ends first.
    #[token("\"", text)]
    Text(&'s str),

    #[token("(")]
    OpenParen,
    #[token(")")]
    CloseParen,
    #[token("[")]
    OpenBracket,
    #[token("]")]
    CloseBracket,
    #[token("{")]
    OpenBrace,
    #[token("}")]
    CloseBrace,
    #[token("|[")]
    OrBlend,
    #[token("&[")]
    AndBlend,
    #[token("-[")]
    SubBlend,

    #[token(";")]
    Semicolon,
    #[token(",")]
    Comma,
    #[token(":")]
    Colon,
    #[token("::")]
    PathSeparator,
    #[token(".")]
    Dot,
    #[token("..")]
    DotDot,
    #[token("..=")]
    DotDotEqual,
    #[token("=")]
    Assign,
    #[token("->")]
    ThinArrow,
    #[token("=>")]
    FatArrow,
    #[token("+")]
    Plus,
    #[token("-")]
    Minus,
    #[token("*")]
    Star,
    #[token("/")]
    Slash,
    #[token("%")]
    Percent,
    #[token("|")]
    Or,
    #[token("&")]
    And,
    #[token("||")]
    Either,
    #[token("&&")]
    Both,
    #[token("!")]
    Not,
    #[token("==")]
    Equal,
    #[token("!=")]
    NotEqual,
    #[token("<")]
    Less,
    #[token("<=")]
    LessEqual,
    #[token(">")]
    Greater,
    #[token(">=")]
    GreaterEqual,

    /// `//`, `///` and `////` with the rest of the line.
    #[token("//", line_comment)]
    LineComment(&'s str),
    /// `/* … */`; without its end if the file ends first.
    #[token("/*", block_comment)]
    BlockComment(&'s str),

    #[token("^")]
    Caret,
    #[token("**")]
    StarStar,
    #[token("?")]
    Question,
    #[token("===")]
    TripleEqual,
    #[token("!==")]
    NotDoubleEqual,
    #[token("<>")]
    LessGreater,
    #[token("++")]
    PlusPlus,
    #[token("+=")]
    PlusAssign,
    #[token("-=")]
    MinusAssign,
    #[token("*=")]
    StarAssign,
    #[token("/=")]
    SlashAssign,
    #[token(":=")]
    ColonAssign,
    #[regex(r"'[^'\n]*'")]
    SingleQuoted(&'s str),
    /// Anything else. Not made by logos: it reports an error, which [`crate::lex`] turns into this.
    Unknown(&'s str),
}

fn text<'s>(lexer: &mut Lexer<'s, Token<'s>>) -> &'s str {
    let rest = lexer.remainder().as_bytes();
    let mut at = 0;
    while at < rest.len() {
        match rest[at] {
            b'\n' => break,
            b'"' => {
                at += 1;
                break;
            }
            b'\\' if rest.get(at + 1).is_some_and(|next| *next != b'\n') => at += 2,
            _ => at += 1,
        }
    }
    // A backslash may have skipped the first byte of a longer character.
    let at = lexer.remainder().ceil_char_boundary(at);
    lexer.bump(at);
    lexer.slice()
}

fn line_comment<'s>(lexer: &mut Lexer<'s, Token<'s>>) -> &'s str {
    let rest = lexer.remainder();
    lexer.bump(rest.find('\n').unwrap_or(rest.len()));
    lexer.slice().trim_end()
}

fn block_comment<'s>(lexer: &mut Lexer<'s, Token<'s>>) -> &'s str {
    let rest = lexer.remainder();
    lexer.bump(rest.find("*/").map_or(rest.len(), |end| end + 2));
    lexer.slice()
}

impl<'s> Token<'s> {
    /// The words that cannot be names.
    pub(crate) const RESERVED: [Token<'static>; 14] = [
        Token::Let,
        Token::Fn,
        Token::Param,
        Token::Part,
        Token::Import,
        Token::As,
        Token::If,
        Token::Else,
        Token::For,
        Token::In,
        Token::By,
        Token::Blend,
        Token::True,
        Token::False,
    ];

    /// Whether the word is one of the reserved ones.
    pub(crate) fn is_reserved(self) -> bool {
        Token::RESERVED.contains(&self)
    }

    /// The closing bracket, if the word is an opening one.
    pub(crate) fn closer(self) -> Option<Token<'static>> {
        match self {
            Token::OpenParen => Some(Token::CloseParen),
            Token::OpenBrace => Some(Token::CloseBrace),
            Token::OpenBracket | Token::OrBlend | Token::AndBlend | Token::SubBlend => {
                Some(Token::CloseBracket)
            }
            _ => None,
        }
    }

    /// Whether the word is a closing bracket.
    pub(crate) fn is_closer(self) -> bool {
        matches!(
            self,
            Token::CloseParen | Token::CloseBracket | Token::CloseBrace
        )
    }

    /// Whether an expression can end with the word.
    pub(crate) fn ends_operand(self) -> bool {
        self.is_closer()
            || matches!(
                self,
                Token::Name(_)
                    | Token::Number(_)
                    | Token::Color(_)
                    | Token::Text(_)
                    | Token::True
                    | Token::False
            )
    }

    /// Whether an expression can start with the word, signs left aside.
    pub(crate) fn starts_operand(self) -> bool {
        matches!(
            self,
            Token::Name(_)
                | Token::Number(_)
                | Token::Color(_)
                | Token::Text(_)
                | Token::True
                | Token::False
                | Token::OpenParen
                | Token::OpenBracket
                | Token::If
                | Token::For
                | Token::Blend
                | Token::Fn
        )
    }

    /// Whether the word can only begin an item or a statement.
    pub(crate) fn starts_item(self) -> bool {
        matches!(
            self,
            Token::Let | Token::Param | Token::Part | Token::Import
        )
    }
}
