//! The syntax tree of one file: what was written, with nothing looked up.
//!
//! Every node has a [`Span`]. Two things keep the tree shallow, so that plain recursion over it is
//! safe: a run of operators of one precedence is one flat [`Chain`], a run of `.field` and
//! `.method(..)` is one flat [`Postfix`], an `else if` ladder is one flat [`If`]; and the parser
//! refuses a tree of more than [`MAX_DEPTH`] levels. Parentheses are kept ([`ExprKind::Paren`]),
//! since the printer puts back what the author wrote. A tree is handed out only for text without
//! errors, so there is no node for a mistake.

mod walk;

use crate::span::{FileId, Span};
use std::fmt;

/// The most levels of expressions within expressions that a tree can have.
pub const MAX_DEPTH: u32 = 200;

/// One source file.
#[derive(Clone, Debug, PartialEq)]
pub struct File {
    /// Which file of the sources this is.
    pub id: FileId,
    /// The items, in the order in which they stand.
    pub items: Vec<Item>,
    /// The final expression, which is the shape; without one the file is a library.
    pub result: Option<Expr>,
    /// The whole text.
    pub span: Span,
    /// What the grammar skips: comments and blank lines, by position.
    pub trivia: Trivia,
}

/// Comments and blank lines, kept beside the tree for the printer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trivia {
    /// Every comment, `///` among them, in order of position.
    pub comments: Vec<Comment>,
    /// The first byte of each line that holds nothing but white space, in order.
    pub blank_lines: Vec<u32>,
    /// The first byte of every line, in order.
    pub lines: Vec<u32>,
}

/// A comment.
#[derive(Clone, Debug, PartialEq)]
pub struct Comment {
    /// How it is marked.
    pub kind: CommentKind,
    /// The text with its marks, as written.
    pub text: String,
    /// Whether nothing but white space stands before it on its line.
    pub own_line: bool,
    /// Where it stands, marks included.
    pub span: Span,
}

/// How a comment is marked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommentKind {
    /// `// …` to the end of the line.
    Line,
    /// `/* … */`.
    Block,
    /// `/// …`, which documents the next item.
    Doc,
}

/// A name where it is introduced or used.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Ident {
    /// The name itself.
    pub name: String,
    /// Where it stands.
    pub span: Span,
}

/// A type annotation, `vec3`; which names are types is not known here.
pub type TypeName = Ident;

/// One of the statements that a file consists of.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// What it is.
    pub kind: ItemKind,
    /// The text of the `///` lines above it, without the marks.
    pub docs: Option<String>,
    /// From the first token to the closing `;` or `}`.
    pub span: Span,
}

/// The kinds of items.
#[derive(Clone, Debug, PartialEq)]
pub enum ItemKind {
    /// `param name: type = value in a..b by step;`
    Param(Param),
    /// `let name: type = value;`
    Let(Let),
    /// `fn name(a: T, b = 1) -> T = expr;` or with a block.
    Fn(Function),
    /// `part name = value;`
    Part(Part),
    /// `import "path" as name;`
    Import(Import),
    /// `kind name { field: value, … }`
    Block(Block),
    /// An expression for its effect, `assert(..);` or `print(..);`
    Expr(Expr),
}

/// `param name: type = value in a..b by step;`
#[derive(Clone, Debug, PartialEq)]
pub struct Param {
    /// The parameter's name.
    pub name: Ident,
    /// Its type, if it was written.
    pub annotation: Option<TypeName>,
    /// Its value unless another is given.
    pub value: Expr,
    /// The values that it may take.
    pub range: Option<ParamRange>,
}

/// `in start..end by step` of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamRange {
    /// The lowest value.
    pub start: Expr,
    /// The highest value.
    pub end: Expr,
    /// Whether it was written `..=`.
    pub inclusive: bool,
    /// The distance between two values of the slider.
    pub step: Option<Expr>,
    /// From the first number to the last.
    pub span: Span,
}

/// `let name: type = value;`
#[derive(Clone, Debug, PartialEq)]
pub struct Let {
    /// The name that is introduced.
    pub name: Ident,
    /// Its type, if it was written.
    pub annotation: Option<TypeName>,
    /// What it stands for.
    pub value: Expr,
}

/// `fn name(params) -> type body`
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    /// The function's name.
    pub name: Ident,
    /// What it takes.
    pub params: Vec<FnParam>,
    /// What it gives, if it was written.
    pub result: Option<TypeName>,
    /// What it does.
    pub body: Body,
}

/// One parameter of a function or lambda: `name: type = default`
#[derive(Clone, Debug, PartialEq)]
pub struct FnParam {
    /// The parameter's name.
    pub name: Ident,
    /// Its type, if it was written.
    pub annotation: Option<TypeName>,
    /// Its value where the call gives none.
    pub default: Option<Expr>,
    /// From the name to the end of the default.
    pub span: Span,
}

/// `part name = value;`
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// The output's name.
    pub name: Ident,
    /// The shape.
    pub value: Expr,
}

/// `import "path" as alias;`
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// The path as written, escapes resolved.
    pub path: String,
    /// Where the path stands, quotes included.
    pub path_span: Span,
    /// The name before the `::`.
    pub alias: Ident,
}

/// `kind name { field: value, … }`
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// `camera`, `light`, …: an ordinary identifier, not looked up.
    pub kind: Ident,
    /// Its own name, if it has one.
    pub name: Option<Ident>,
    /// The settings, in order.
    pub fields: Vec<Field>,
}

/// `name: value` in a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// What is set.
    pub name: Ident,
    /// To what.
    pub value: Expr,
    /// From the name to the end of the value.
    pub span: Span,
}

/// What a function, a loop or a branch evaluates to: some statements, then a value.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Whether it was written with braces; without them there are no statements.
    pub braced: bool,
    /// What comes before the value.
    pub statements: Vec<Statement>,
    /// The value.
    pub result: Expr,
    /// The whole body, braces included.
    pub span: Span,
}

/// A statement in a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Statement {
    /// What it is.
    pub kind: StatementKind,
    /// Up to and with the `;`.
    pub span: Span,
}

/// The kinds of statements.
#[derive(Clone, Debug, PartialEq)]
pub enum StatementKind {
    /// `let name: type = value;`
    Let(Let),
    /// An expression for its effect, `assert(..);`
    Expr(Expr),
}

/// An expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Expr {
    /// What it is.
    pub kind: ExprKind,
    /// Where it stands.
    pub span: Span,
}

/// The kinds of expressions.
#[derive(Clone, Debug, PartialEq)]
pub enum ExprKind {
    /// `3`, `0.5mm`, `90deg`
    Number(Number),
    /// `#3aa6ff`: red, green, blue and opacity as written, in sRGB.
    Color([u8; 4]),
    /// `"text"`, escapes resolved.
    Text(String),
    /// `true` or `false`.
    Bool(bool),
    /// `name` or `library::name`.
    Path(Path),
    /// `[a, b, c]`: a list, or a vector where one is wanted.
    List(Vec<Expr>),
    /// `(expr)`.
    Paren(Box<Expr>),
    /// `name(args)`.
    Call(Box<Call>),
    /// `expr.field.method(args)…`
    Postfix(Box<Postfix>),
    /// `-expr` or `!expr`.
    Unary(Box<Unary>),
    /// `a | b |[0.2] c …`: operators of one precedence, applied from left to right.
    Chain(Box<Chain>),
    /// `start..end` or `start..=end`.
    Range(Box<RangeExpr>),
    /// `if c { a } else if d { b } else { c }`.
    If(Box<If>),
    /// `for i in range { body }`: a list.
    For(Box<For>),
    /// `blend(0.2) { body }`: the blend of every plain CSG operator written inside.
    BlendScope(Box<BlendScope>),
    /// `fn(p) => expr`.
    Lambda(Box<Lambda>),
}

/// A number and its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Number {
    /// How much, as written: not converted.
    pub value: NumberValue,
    /// Of what.
    pub unit: Unit,
}

/// A number, which remembers whether it was written as an integer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NumberValue {
    /// Written without a dot or an exponent.
    Int(i64),
    /// Written with a dot or an exponent; always finite.
    Float(f64),
}

impl NumberValue {
    /// The number as a float.
    pub fn to_f64(self) -> f64 {
        match self {
            NumberValue::Int(value) => value as f64,
            NumberValue::Float(value) => value,
        }
    }
}

/// The unit of a number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Unit {
    /// A bare number.
    None,
    /// Degrees.
    Deg,
    /// Whole turns.
    Turn,
    /// Radians.
    Rad,
    /// Millimetres.
    Mm,
    /// Centimetres.
    Cm,
    /// Metres.
    M,
    /// Inches.
    In,
    /// Seconds.
    S,
    /// Milliseconds.
    Ms,
}

impl Unit {
    /// Every unit that can be written.
    pub const ALL: [Unit; 9] = [
        Unit::Deg,
        Unit::Turn,
        Unit::Rad,
        Unit::Mm,
        Unit::Cm,
        Unit::M,
        Unit::In,
        Unit::S,
        Unit::Ms,
    ];

    /// How the unit is written; empty for a bare number.
    pub fn suffix(self) -> &'static str {
        match self {
            Unit::None => "",
            Unit::Deg => "deg",
            Unit::Turn => "turn",
            Unit::Rad => "rad",
            Unit::Mm => "mm",
            Unit::Cm => "cm",
            Unit::M => "m",
            Unit::In => "in",
            Unit::S => "s",
            Unit::Ms => "ms",
        }
    }
}

/// `name` or `library::name`; never empty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Path {
    /// The names between the `::`.
    pub segments: Vec<Ident>,
    /// From the first to the last.
    pub span: Span,
}

impl Path {
    /// The name, if the path is nothing but one.
    pub fn as_ident(&self) -> Option<&Ident> {
        match self.segments.as_slice() {
            [only] => Some(only),
            _ => None,
        }
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (at, segment) in self.segments.iter().enumerate() {
            f.write_str(if at == 0 { "" } else { "::" })?;
            f.write_str(&segment.name)?;
        }
        Ok(())
    }
}

/// One argument of a call or a blend: `value` or `name: value`.
#[derive(Clone, Debug, PartialEq)]
pub struct Arg {
    /// The parameter's name, if it was written.
    pub name: Option<Ident>,
    /// What is given.
    pub value: Expr,
    /// Name and value.
    pub span: Span,
}

/// `name(args)`
#[derive(Clone, Debug, PartialEq)]
pub struct Call {
    /// What is called.
    pub callee: Path,
    /// Positional arguments, then named ones.
    pub args: Vec<Arg>,
    /// From `(` to `)`.
    pub args_span: Span,
}

/// `base.suffix.suffix…`, applied from left to right; there is at least one suffix.
#[derive(Clone, Debug, PartialEq)]
pub struct Postfix {
    /// What the first suffix is applied to.
    pub base: Expr,
    /// The suffixes, in order. What is before the n-th spans from `base` to the end of the one before.
    pub suffixes: Vec<Suffix>,
}

/// `.field` or `.method(args)`
#[derive(Clone, Debug, PartialEq)]
pub struct Suffix {
    /// The name after the dot.
    pub name: Ident,
    /// The arguments of a method; none for a field or swizzle.
    pub args: Option<Args>,
    /// From the dot to the end.
    pub span: Span,
}

/// Arguments with their brackets.
#[derive(Clone, Debug, PartialEq)]
pub struct Args {
    /// Positional arguments, then named ones.
    pub args: Vec<Arg>,
    /// From the opening to the closing bracket.
    pub span: Span,
}

/// `-expr` or `!expr`
#[derive(Clone, Debug, PartialEq)]
pub struct Unary {
    /// Which of them.
    pub op: UnaryOp,
    /// Where the operator stands.
    pub op_span: Span,
    /// What it is applied to.
    pub operand: Expr,
}

/// The operators before an expression.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum UnaryOp {
    /// `-`
    Neg,
    /// `!`
    Not,
}

impl UnaryOp {
    /// How the operator is written.
    pub fn symbol(self) -> &'static str {
        match self {
            UnaryOp::Neg => "-",
            UnaryOp::Not => "!",
        }
    }
}

/// `first op operand op operand …`, applied from left to right. All operators have one precedence;
/// a comparison has exactly one link.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// The leftmost operand.
    pub first: Expr,
    /// What is applied to it, in order; never empty. What is before the n-th spans from `first` to
    /// the end of the operand before.
    pub rest: Vec<Link>,
}

/// `op operand` or `op[blend] operand` of a chain.
#[derive(Clone, Debug, PartialEq)]
pub struct Link {
    /// The operator.
    pub op: BinaryOp,
    /// Where it stands, without its blend.
    pub op_span: Span,
    /// `[0.2]`, `[chamfer, 0.4]`, `[stairs, 0.4, n: 4]` right after the operator; only with `|`, `&`
    /// and `-`. The span starts at the operator.
    pub blend: Option<Args>,
    /// The right operand.
    pub operand: Expr,
}

/// The operators between two expressions.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum BinaryOp {
    /// `*`
    Mul,
    /// `/`
    Div,
    /// `%`
    Rem,
    /// `+`
    Add,
    /// `-`: of numbers, or the difference of shapes.
    Sub,
    /// `&`: the intersection of shapes.
    And,
    /// `|`: the union of shapes.
    Or,
    /// `==`
    Equal,
    /// `!=`
    NotEqual,
    /// `<`
    Less,
    /// `<=`
    LessEqual,
    /// `>`
    Greater,
    /// `>=`
    GreaterEqual,
    /// `&&`
    Both,
    /// `||`
    Either,
}

/// How tightly an operator binds; a greater one binds tighter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Precedence {
    /// `..` and `..=`
    Range,
    /// `||`
    Either,
    /// `&&`
    Both,
    /// `== != < <= > >=`
    Compare,
    /// `|`
    Union,
    /// `&`
    Intersection,
    /// `+ -`
    Sum,
    /// `* / %`
    Product,
    /// `-` and `!` before an expression
    Prefix,
    /// `.field`, calls, literals
    Tight,
}

impl BinaryOp {
    /// How the operator is written.
    pub fn symbol(self) -> &'static str {
        match self {
            BinaryOp::Mul => "*",
            BinaryOp::Div => "/",
            BinaryOp::Rem => "%",
            BinaryOp::Add => "+",
            BinaryOp::Sub => "-",
            BinaryOp::And => "&",
            BinaryOp::Or => "|",
            BinaryOp::Equal => "==",
            BinaryOp::NotEqual => "!=",
            BinaryOp::Less => "<",
            BinaryOp::LessEqual => "<=",
            BinaryOp::Greater => ">",
            BinaryOp::GreaterEqual => ">=",
            BinaryOp::Both => "&&",
            BinaryOp::Either => "||",
        }
    }

    /// How tightly the operator binds.
    pub fn precedence(self) -> Precedence {
        match self {
            BinaryOp::Mul | BinaryOp::Div | BinaryOp::Rem => Precedence::Product,
            BinaryOp::Add | BinaryOp::Sub => Precedence::Sum,
            BinaryOp::And => Precedence::Intersection,
            BinaryOp::Or => Precedence::Union,
            BinaryOp::Equal
            | BinaryOp::NotEqual
            | BinaryOp::Less
            | BinaryOp::LessEqual
            | BinaryOp::Greater
            | BinaryOp::GreaterEqual => Precedence::Compare,
            BinaryOp::Both => Precedence::Both,
            BinaryOp::Either => Precedence::Either,
        }
    }
}

/// `start..end` or `start..=end`
#[derive(Clone, Debug, PartialEq)]
pub struct RangeExpr {
    /// The first value.
    pub start: Expr,
    /// The last value, or the one after it.
    pub end: Expr,
    /// Whether it was written `..=`.
    pub inclusive: bool,
}

/// How the dots of a range are written.
pub(crate) fn range_symbol(inclusive: bool) -> &'static str {
    match inclusive {
        true => "..=",
        false => "..",
    }
}

/// `if c { a } else if d { b } else { c }`
#[derive(Clone, Debug, PartialEq)]
pub struct If {
    /// The conditions with what they lead to, in order; never empty.
    pub arms: Vec<IfArm>,
    /// Where no condition holds.
    pub otherwise: Body,
}

/// `if condition { body }`
#[derive(Clone, Debug, PartialEq)]
pub struct IfArm {
    /// What must hold.
    pub condition: Expr,
    /// The value if it does.
    pub body: Body,
}

/// `for name in range { body }`
#[derive(Clone, Debug, PartialEq)]
pub struct For {
    /// What the current value is called.
    pub name: Ident,
    /// What is gone through.
    pub range: Expr,
    /// The list's element for each value.
    pub body: Body,
}

/// `blend(args) { body }`
#[derive(Clone, Debug, PartialEq)]
pub struct BlendScope {
    /// The blend, as after an operator.
    pub blend: Args,
    /// Where it holds.
    pub body: Body,
}

/// `fn(params) => body`
#[derive(Clone, Debug, PartialEq)]
pub struct Lambda {
    /// What it takes.
    pub params: Vec<FnParam>,
    /// What it gives.
    pub body: Body,
}
