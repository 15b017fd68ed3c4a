//! Syntax tree of one file, as written. Names are not resolved.
//!
//! Every node has a [`Span`]. Two rules keep the tree shallow, so that plain recursion over it is safe.
//! First, sequences are flat. A run of operators of one precedence is one [`Chain`], and a run of `.field`
//! and `.method(..)` is one [`Postfix`]. An `else if` ladder is one [`If`]. Second, the parser refuses a
//! tree of more than [`MAX_DEPTH`] levels.
//!
//! Parentheses are kept ([`ExprKind::Paren`]), since the printer reproduces them. A tree is returned only
//! for text without errors, so there is no error node.

mod walk;

use crate::span::{FileId, Span};
use std::fmt;

/// Maximum number of nested expressions in a tree.
pub const MAX_DEPTH: u32 = 200;

/// One source file.
#[derive(Clone, Debug, PartialEq)]
pub struct File {
    /// Id of the file in the sources.
    pub id: FileId,
    /// Items, in source order.
    pub items: Vec<Item>,
    /// Final expression, which is the shape. A file without one is a library.
    pub result: Option<Expr>,
    /// Span of the full text.
    pub span: Span,
    /// Text that the grammar skips: comments and blank lines, by position.
    pub trivia: Trivia,
}

/// Comments and blank lines, kept beside the tree for the printer.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Trivia {
    /// All comments, `///` included, in order of position.
    pub comments: Vec<Comment>,
    /// First byte of each line that contains only white space, in order.
    pub blank_lines: Vec<u32>,
    /// First byte of every line, in order.
    pub lines: Vec<u32>,
}

/// A comment.
#[derive(Clone, Debug, PartialEq)]
pub struct Comment {
    /// Kind of the comment.
    pub kind: CommentKind,
    /// Text with its marks, as written.
    pub text: String,
    /// Set if only white space precedes it on its line.
    pub own_line: bool,
    /// Span, marks included.
    pub span: Span,
}

/// Kind of a comment, by its marks.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CommentKind {
    /// `// …` to the end of the line.
    Line,
    /// `/* … */`.
    Block,
    /// `/// …`, which documents the next item.
    Doc,
}

/// A name where it is defined or used.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub struct Ident {
    /// Text of the name, as written.
    pub name: String,
    /// Span of the name.
    pub span: Span,
}

/// Type annotation such as `vec3`. The parser does not resolve it.
pub type TypeName = Ident;

/// Top-level item of a file.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// Kind of the item.
    pub kind: ItemKind,
    /// Text of the `///` lines above it, without the marks.
    pub docs: Option<String>,
    /// Span from the first token to the closing `;` or `}`.
    pub span: Span,
}

/// Kind of an item.
#[derive(Clone, Debug, PartialEq)]
pub enum ItemKind {
    /// `param name: type = value in a..b by step;`
    Param(ParamDefinition),
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
    /// Expression statement with an effect, `assert(..);` or `print(..);`
    Expr(Expr),
}

/// `param name: type = value in a..b by step;`
#[derive(Clone, Debug, PartialEq)]
pub struct ParamDefinition {
    /// Name of the parameter.
    pub name: Ident,
    /// Type, if written.
    pub annotation: Option<TypeName>,
    /// Default value, which an override replaces.
    pub value: Expr,
    /// Range of allowed values.
    pub range: Option<ParamRange>,
}

/// `in start..end by step` of a parameter.
#[derive(Clone, Debug, PartialEq)]
pub struct ParamRange {
    /// Lowest value.
    pub start: Expr,
    /// Highest value, which is excluded unless `inclusive`.
    pub end: Expr,
    /// Set if written with `..=`.
    pub inclusive: bool,
    /// Step between two values of the slider.
    pub step: Option<Expr>,
    /// Span from the first number to the last.
    pub span: Span,
}

/// `let name: type = value;`
#[derive(Clone, Debug, PartialEq)]
pub struct Let {
    /// Name that is defined.
    pub name: Ident,
    /// Type, if written.
    pub annotation: Option<TypeName>,
    /// Value of the name.
    pub value: Expr,
}

/// `fn name(params) -> type body`
#[derive(Clone, Debug, PartialEq)]
pub struct Function {
    /// Name of the function.
    pub name: Ident,
    /// Parameters, in the order of positional arguments.
    pub params: Vec<FnParam>,
    /// Span of the parameters with their brackets.
    pub params_span: Span,
    /// Result type, if written.
    pub result: Option<TypeName>,
    /// Body, whose value is the result of a call.
    pub body: Body,
}

/// Parameter of a function or lambda: `name: type = default`
#[derive(Clone, Debug, PartialEq)]
pub struct FnParam {
    /// Name of the parameter.
    pub name: Ident,
    /// Type, if written.
    pub annotation: Option<TypeName>,
    /// Value if the call passes none.
    pub default: Option<Expr>,
    /// Span from the name to the end of the default.
    pub span: Span,
}

/// `part name = value;`
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Name of the output.
    pub name: Ident,
    /// Expression of the shape.
    pub value: Expr,
}

/// `import "path" as alias;`
#[derive(Clone, Debug, PartialEq)]
pub struct Import {
    /// Path as written, with escapes resolved.
    pub path: String,
    /// Span of the path, quotes included.
    pub path_span: Span,
    /// Name before the `::`.
    pub alias: Ident,
}

/// `kind name { field: value, … }`
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// `camera`, `light`, …: an ordinary identifier, not resolved.
    pub kind: Ident,
    /// Name of the block, if it has one.
    pub name: Option<Ident>,
    /// Settings, in source order.
    pub fields: Vec<Field>,
}

/// `name: value` in a block.
#[derive(Clone, Debug, PartialEq)]
pub struct Field {
    /// Name of the setting.
    pub name: Ident,
    /// Value of the setting.
    pub value: Expr,
    /// Span from the name to the end of the value.
    pub span: Span,
}

/// Body of a function, a loop or a branch: statements, then a value.
#[derive(Clone, Debug, PartialEq)]
pub struct Body {
    /// Set if written with braces. Without them there are no statements.
    pub braced: bool,
    /// Statements before the value.
    pub statements: Vec<Statement>,
    /// Value of the body, after its statements.
    pub result: Expr,
    /// Span of the body, braces included.
    pub span: Span,
}

/// Statement in a body.
#[derive(Clone, Debug, PartialEq)]
pub struct Statement {
    /// Kind of the statement.
    pub kind: StatementKind,
    /// Span up to the `;`, included.
    pub span: Span,
}

/// Kind of a statement.
#[derive(Clone, Debug, PartialEq)]
pub enum StatementKind {
    /// `let name: type = value;`
    Let(Let),
    /// Expression statement with an effect, `assert(..);`
    Expr(Expr),
}

/// An expression.
#[derive(Clone, Debug, PartialEq)]
pub struct Expr {
    /// Kind of the expression.
    pub kind: ExprKind,
    /// Span of the expression.
    pub span: Span,
}

/// Kind of an expression.
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
    /// `[a, b, c]`: a list, or a vector where one is required.
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
    /// `blend(0.2) { body }`: the blend of every CSG operator inside without a blend of its own.
    BlendScope(Box<BlendScope>),
    /// `fn(p) => expr`.
    Lambda(Box<Lambda>),
}

/// A number with its unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Number {
    /// Value as written, not converted.
    pub value: NumberValue,
    /// Unit as written; [`Unit::None`] for a bare number.
    pub unit: Unit,
}

/// A number that records whether it was written as an integer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum NumberValue {
    /// Written without a dot or an exponent.
    Int(i64),
    /// Written with a dot or an exponent; always finite.
    Float(f64),
}

impl NumberValue {
    /// Returns the number as a float.
    pub fn to_f64(self) -> f64 {
        match self {
            NumberValue::Int(value) => value as f64,
            NumberValue::Float(value) => value,
        }
    }
}

/// Unit of a number.
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
    /// All units with a suffix.
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

    /// Returns the suffix of the unit, which is empty for a bare number.
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

/// `name` or `library::name`, never empty.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Path {
    /// Names between the `::`.
    pub segments: Vec<Ident>,
    /// Span from the first name to the last.
    pub span: Span,
}

impl Path {
    /// Returns the name, if the path is a single one.
    pub fn as_ident(&self) -> Option<&Ident> {
        match self.segments.as_slice() {
            [only] => Some(only),
            _ => None,
        }
    }
}

impl fmt::Display for Path {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (index, segment) in self.segments.iter().enumerate() {
            f.write_str(if index == 0 { "" } else { "::" })?;
            f.write_str(&segment.name)?;
        }
        Ok(())
    }
}

/// Argument of a call or a blend: `value` or `name: value`.
#[derive(Clone, Debug, PartialEq)]
pub struct Arg {
    /// Name of the parameter, if written.
    pub name: Option<Ident>,
    /// Value that is passed.
    pub value: Expr,
    /// Span of name and value.
    pub span: Span,
}

/// `name(args)`
#[derive(Clone, Debug, PartialEq)]
pub struct Call {
    /// Path of the called function.
    pub callee: Path,
    /// Positional arguments, then named ones.
    pub args: Vec<Arg>,
    /// Span from `(` to `)`.
    pub args_span: Span,
}

/// `base.suffix.suffix…`, applied from left to right, with at least one suffix.
#[derive(Clone, Debug, PartialEq)]
pub struct Postfix {
    /// Operand of the first suffix.
    pub base: Expr,
    /// Suffixes, in order. The operand of the n-th one spans from `base` to the end of the previous suffix.
    pub suffixes: Vec<Suffix>,
}

/// `.field` or `.method(args)`
#[derive(Clone, Debug, PartialEq)]
pub struct Suffix {
    /// Name after the dot.
    pub name: Ident,
    /// Arguments of a method, or `None` for a field or swizzle.
    pub args: Option<Args>,
    /// Span from the dot to the end.
    pub span: Span,
}

/// Arguments with their brackets.
#[derive(Clone, Debug, PartialEq)]
pub struct Args {
    /// Positional arguments, then named ones.
    pub args: Vec<Arg>,
    /// Span from the opening to the closing bracket.
    pub span: Span,
}

/// `-expr` or `!expr`
#[derive(Clone, Debug, PartialEq)]
pub struct Unary {
    /// `-` or `!`.
    pub op: UnaryOp,
    /// Span of the operator.
    pub op_span: Span,
    /// Expression after the operator.
    pub operand: Expr,
}

/// Prefix operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum UnaryOp {
    /// `-`
    Neg,
    /// `!`
    Not,
}

impl UnaryOp {
    /// Returns the operator as written.
    pub fn symbol(self) -> &'static str {
        match self {
            UnaryOp::Neg => "-",
            UnaryOp::Not => "!",
        }
    }
}

/// `first op operand op operand …`, applied from left to right.
///
/// All operators have one precedence. A comparison has exactly one link.
#[derive(Clone, Debug, PartialEq)]
pub struct Chain {
    /// Leftmost operand.
    pub first: Expr,
    /// Operators with their right operands, in order, never empty.
    ///
    /// The left operand of the n-th one spans from `first` to the end of the previous operand.
    pub links: Vec<ChainLink>,
}

/// `op operand` or `op[blend] operand` of a chain.
#[derive(Clone, Debug, PartialEq)]
pub struct ChainLink {
    /// Operator; all operators of a chain have one precedence.
    pub op: BinaryOp,
    /// Span of the operator, without its blend.
    pub op_span: Span,
    /// `[0.2]`, `[chamfer, 0.4]` or `[stairs, 0.4, n: 4]` right after `|`, `&` or `-`.
    ///
    /// The span starts at the operator.
    pub blend: Option<Args>,
    /// Right operand.
    pub operand: Expr,
}

/// Binary operator.
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
    Intersection,
    /// `|`: the union of shapes.
    Union,
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
    LogicalAnd,
    /// `||`
    LogicalOr,
}

/// Precedence of an operator. A greater one binds tighter.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Precedence {
    /// `..` and `..=`
    Range,
    /// `||`
    LogicalOr,
    /// `&&`
    LogicalAnd,
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
    Primary,
}

impl BinaryOp {
    /// Returns the operator as written.
    pub fn symbol(self) -> &'static str {
        match self {
            BinaryOp::Mul => "*",
            BinaryOp::Div => "/",
            BinaryOp::Rem => "%",
            BinaryOp::Add => "+",
            BinaryOp::Sub => "-",
            BinaryOp::Intersection => "&",
            BinaryOp::Union => "|",
            BinaryOp::Equal => "==",
            BinaryOp::NotEqual => "!=",
            BinaryOp::Less => "<",
            BinaryOp::LessEqual => "<=",
            BinaryOp::Greater => ">",
            BinaryOp::GreaterEqual => ">=",
            BinaryOp::LogicalAnd => "&&",
            BinaryOp::LogicalOr => "||",
        }
    }

    /// Returns the precedence of the operator.
    pub fn precedence(self) -> Precedence {
        match self {
            BinaryOp::Mul | BinaryOp::Div | BinaryOp::Rem => Precedence::Product,
            BinaryOp::Add | BinaryOp::Sub => Precedence::Sum,
            BinaryOp::Intersection => Precedence::Intersection,
            BinaryOp::Union => Precedence::Union,
            BinaryOp::Equal
            | BinaryOp::NotEqual
            | BinaryOp::Less
            | BinaryOp::LessEqual
            | BinaryOp::Greater
            | BinaryOp::GreaterEqual => Precedence::Compare,
            BinaryOp::LogicalAnd => Precedence::LogicalAnd,
            BinaryOp::LogicalOr => Precedence::LogicalOr,
        }
    }
}

/// `start..end` or `start..=end`
#[derive(Clone, Debug, PartialEq)]
pub struct RangeExpr {
    /// First value.
    pub start: Expr,
    /// Last value, or the one after it.
    pub end: Expr,
    /// Set if written with `..=`.
    pub inclusive: bool,
}

/// Returns the dots of a range as written.
pub(crate) fn range_symbol(inclusive: bool) -> &'static str {
    match inclusive {
        true => "..=",
        false => "..",
    }
}

/// `if c { a } else if d { b } else { c }`
#[derive(Clone, Debug, PartialEq)]
pub struct If {
    /// Conditions with their bodies, in order, never empty.
    pub arms: Vec<IfArm>,
    /// Body if no condition holds.
    pub else_body: Body,
}

/// `if condition { body }`
#[derive(Clone, Debug, PartialEq)]
pub struct IfArm {
    /// Expression between `if` and the body.
    pub condition: Expr,
    /// Value if the condition holds.
    pub body: Body,
}

/// `for name in range { body }`
#[derive(Clone, Debug, PartialEq)]
pub struct For {
    /// Name of the loop variable.
    pub name: Ident,
    /// Range of the loop.
    pub range: Expr,
    /// Element of the list for each value.
    pub body: Body,
}

/// `blend(args) { body }`
#[derive(Clone, Debug, PartialEq)]
pub struct BlendScope {
    /// Blend, as after an operator.
    pub blend: Args,
    /// Body in which the blend applies.
    pub body: Body,
}

/// `fn(params) => body`
#[derive(Clone, Debug, PartialEq)]
pub struct Lambda {
    /// Parameters, in the order of positional arguments.
    pub params: Vec<FnParam>,
    /// Span of the parameters with their brackets.
    pub params_span: Span,
    /// Body, whose value is the result of a call.
    pub body: Body,
}
