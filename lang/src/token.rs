//! Tokens of the language.
//!
//! Logos generates the lexer from the patterns. [`crate::lex`] runs it, separates comments and validates
//! literals. The grammar thus receives valid tokens only.
//!
//! `|[`, `&[` and `-[` are single tokens, written without a space: the blend of an operator. A character
//! outside of any token becomes [`Token::Unknown`]. Constructs of other languages (`^`, `**`, `?`,
//! `'text'`) have tokens too, so that messages can offer a correction.

use logos::{Lexer, Logos};

/// A token, with its text where that varies.
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
    /// Digits, optionally followed by letters that should be a unit.
    #[regex(r"([0-9][0-9_]*(\.[0-9][0-9_]*)?|\.[0-9][0-9_]*)([eE][+-]?[0-9][0-9_]*)?([A-Za-z][A-Za-z0-9_]*)?")]
    Number(&'s str),
    #[regex(r"#[0-9A-Za-z_]*")]
    Color(&'s str),
    /// A string with its quotes, without the closing one if the line ends first.
    #[token("\"", string_literal)]
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
    /// `/* … */`, without its end if the file ends first.
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
    /// Any other text. Logos reports it as an error, which [`crate::lex`] converts to this token.
    Unknown(&'s str),
}

fn string_literal<'s>(lexer: &mut Lexer<'s, Token<'s>>) -> &'s str {
    let remaining = lexer.remainder().as_bytes();
    let mut length = 0;
    while length < remaining.len() {
        match remaining[length] {
            b'\n' => break,
            b'"' => {
                length += 1;
                break;
            }
            b'\\' if remaining.get(length + 1).is_some_and(|next| *next != b'\n') => length += 2,
            _ => length += 1,
        }
    }
    // A backslash may have skipped the first byte of a longer character.
    let length = lexer.remainder().ceil_char_boundary(length);
    lexer.bump(length);
    lexer.slice()
}

fn line_comment<'s>(lexer: &mut Lexer<'s, Token<'s>>) -> &'s str {
    let remaining = lexer.remainder();
    // A carriage return alone ends a line, too.
    lexer.bump(remaining.find(['\n', '\r']).unwrap_or(remaining.len()));
    lexer.slice().trim_end()
}

fn block_comment<'s>(lexer: &mut Lexer<'s, Token<'s>>) -> &'s str {
    let remaining = lexer.remainder();
    lexer.bump(remaining.find("*/").map_or(remaining.len(), |end| end + 2));
    lexer.slice()
}

impl<'s> Token<'s> {
    /// Reserved words, which cannot be names.
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

    /// Reports whether the token is a reserved word.
    pub(crate) fn is_reserved(self) -> bool {
        Token::RESERVED.contains(&self)
    }

    /// Returns the closing bracket, if the token is an opening one.
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

    /// Reports whether the token is a closing bracket.
    pub(crate) fn is_closer(self) -> bool {
        matches!(
            self,
            Token::CloseParen | Token::CloseBracket | Token::CloseBrace
        )
    }

    /// Reports whether an expression can end with the token.
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

    /// Reports whether an expression can start with the token, apart from signs.
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

    /// Reports whether the token always begins an item or a statement.
    pub(crate) fn starts_item(self) -> bool {
        matches!(
            self,
            Token::Let | Token::Param | Token::Part | Token::Import
        )
    }
}
