//! Actions of the grammar rules, which build the nodes of the tree.
//!
//! An [`AstBuilder`] records the file and the nesting depth of the parser. The grammar accepts some
//! mistakes so that their messages are better: an `if` without `else`, a block without a value, `a < b <
//! c`. They are reported here and replaced by placeholders. A tree with errors is never returned.

use crate::ast::*;
use crate::codes;
use crate::diagnostic::{Diagnostic, MAX_SHOWN_DIAGNOSTICS};
use crate::literal;
use crate::span::{FileId, Span};

/// Result of a top-level rule.
pub(crate) enum TopLevel {
    Item(Box<Item>),
    Result(Box<Expr>),
}

/// Error that stops the parser where the text is nested too deeply.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct NestingError {
    pub(crate) offset: u32,
}

/// Binary operator as written.
pub(crate) struct BinaryOperator {
    op: BinaryOp,
    span: Span,
    blend: Option<Args>,
}

/// State of the parser's actions.
pub(crate) struct AstBuilder {
    file: FileId,
    depth: u32,
    pub(crate) errors: Vec<Diagnostic>,
}

impl AstBuilder {
    pub(crate) fn new(file: FileId) -> Self {
        Self {
            file,
            depth: 0,
            errors: Vec::new(),
        }
    }

    pub(crate) fn span(&self, start: u32, end: u32) -> Span {
        Span::new(self.file, start, end)
    }

    /// Adds an error, up to twice the number of shown diagnostics.
    fn report(&mut self, error: Diagnostic) {
        if self.errors.len() < 2 * MAX_SHOWN_DIAGNOSTICS {
            self.errors.push(error);
        }
    }

    /// Opens a level of nesting.
    pub(crate) fn enter(&mut self, offset: u32) -> Result<(), NestingError> {
        self.depth += 1;
        match self.depth > MAX_DEPTH {
            true => Err(NestingError { offset }),
            false => Ok(()),
        }
    }

    fn leave(&mut self) {
        self.depth -= 1;
    }

    // Items.

    pub(crate) fn item(&self, start: u32, kind: ItemKind, end: u32) -> Box<Item> {
        Box::new(Item {
            kind,
            docs: None,
            span: self.span(start, end),
        })
    }

    pub(crate) fn import(&self, start: u32, path: &str, end: u32, alias: Ident) -> Import {
        Import {
            path: literal::parse_text(path).0,
            path_span: self.span(start, end),
            alias,
        }
    }

    pub(crate) fn param_range(&mut self, values: Expr, step: Option<Expr>) -> Box<ParamRange> {
        let end = step.as_ref().map_or(values.span, |step| step.span);
        let span = values.span.to(end);
        let range = match values.kind {
            ExprKind::Range(range) => *range,
            _ => {
                self.report(
                    Diagnostic::error(
                        codes::E0124,
                        values.span,
                        "a parameter's values are a range",
                    )
                    .primary("not a range")
                    .help("write `in 0.0..1.0`, or `in 1..=6` for whole numbers up to and with 6"),
                );
                RangeExpr {
                    start: values.clone(),
                    end: values,
                    inclusive: true,
                }
            }
        };
        Box::new(ParamRange {
            start: range.start,
            end: range.end,
            inclusive: range.inclusive,
            step,
            span,
        })
    }

    // Bodies.

    pub(crate) fn plain_body(&self, result: Expr) -> Body {
        Body {
            braced: false,
            statements: Vec::new(),
            span: result.span,
            result,
        }
    }

    pub(crate) fn braces(
        &mut self,
        start: u32,
        statements: Vec<Statement>,
        result: Option<Expr>,
        end: u32,
    ) -> Body {
        self.leave();
        let span = self.span(start, end);
        let result = result.unwrap_or_else(|| {
            self.report(missing_value(&statements, span));
            self.placeholder(span.at_end())
        });
        Body {
            braced: true,
            statements,
            result,
            span,
        }
    }

    // Expressions.

    pub(crate) fn expr(&self, start: u32, kind: ExprKind, end: u32) -> Expr {
        Expr {
            kind,
            span: self.span(start, end),
        }
    }

    fn placeholder(&self, span: Span) -> Expr {
        Expr {
            kind: ExprKind::Bool(false),
            span,
        }
    }

    pub(crate) fn number(&self, word: &str) -> ExprKind {
        ExprKind::Number(literal::parse_number(word).unwrap_or(Number {
            value: NumberValue::Int(0),
            unit: Unit::None,
        }))
    }

    pub(crate) fn color(&self, word: &str) -> ExprKind {
        ExprKind::Color(literal::parse_color(word).unwrap_or_default())
    }

    pub(crate) fn text(&self, word: &str) -> ExprKind {
        ExprKind::Text(literal::parse_text(word).0)
    }

    pub(crate) fn name(&self, start: u32, name: &str, end: u32) -> Ident {
        Ident {
            name: name.to_owned(),
            span: self.span(start, end),
        }
    }

    pub(crate) fn path(&self, path: Path) -> Expr {
        Expr {
            span: path.span,
            kind: ExprKind::Path(path),
        }
    }

    pub(crate) fn list(&mut self, start: u32, items: Vec<Expr>, end: u32) -> Expr {
        self.leave();
        self.expr(start, ExprKind::List(items), end)
    }

    pub(crate) fn paren(&mut self, start: u32, inner: Expr, end: u32) -> Expr {
        self.leave();
        self.expr(start, ExprKind::Paren(Box::new(inner)), end)
    }

    pub(crate) fn args(&mut self, start: u32, args: Vec<Arg>, end: u32) -> Args {
        self.leave();
        let mut named: Option<Span> = None;
        for arg in &args {
            match (&arg.name, named) {
                (Some(_), None) => named = Some(arg.span),
                (None, Some(named)) => {
                    self.report(
                        Diagnostic::error(
                            codes::E0118,
                            arg.span,
                            "arguments without a name come first",
                        )
                        .primary("this one has no name")
                        .label(named, "and this one has"),
                    );
                    break;
                }
                (Some(_), Some(_)) | (None, None) => {}
            }
        }
        Args {
            args,
            span: self.span(start, end),
        }
    }

    pub(crate) fn call(&self, start: u32, callee: Path, args: Args, end: u32) -> Expr {
        let call = Call {
            callee,
            args: args.args,
            args_span: args.span,
        };
        self.expr(start, ExprKind::Call(Box::new(call)), end)
    }

    pub(crate) fn suffix(
        &self,
        base: Expr,
        dot: u32,
        name: Ident,
        args: Option<Args>,
        end: u32,
    ) -> Expr {
        let suffix = Suffix {
            name,
            args,
            span: self.span(dot, end),
        };
        let span = base.span.to(suffix.span);
        let mut postfix = match base.kind {
            ExprKind::Postfix(postfix) => postfix,
            _ => Box::new(Postfix {
                base,
                suffixes: Vec::new(),
            }),
        };
        postfix.suffixes.push(suffix);
        Expr {
            kind: ExprKind::Postfix(postfix),
            span,
        }
    }

    pub(crate) fn unary(&mut self, start: u32, op: UnaryOp, operand: Expr) -> Expr {
        self.leave();
        let op_span = self.span(start, start + 1);
        let span = op_span.to(operand.span);
        let unary = Unary {
            op,
            op_span,
            operand,
        };
        Expr {
            kind: ExprKind::Unary(Box::new(unary)),
            span,
        }
    }

    pub(crate) fn operator(&self, start: u32, op: BinaryOp, end: u32) -> BinaryOperator {
        BinaryOperator {
            op,
            span: self.span(start, end),
            blend: None,
        }
    }

    pub(crate) fn blended(
        &mut self,
        start: u32,
        op: BinaryOp,
        args: Vec<Arg>,
        end: u32,
    ) -> BinaryOperator {
        let blend = self.args(start, args, end);
        let span = self.span(start, start + 1);
        if blend.args.is_empty() {
            let symbol = op.symbol();
            self.report(
                Diagnostic::error(codes::E0128, blend.span, "this blend is empty")
                    .primary("a radius is missing")
                    .help(format!("write `{symbol}[0.2]`, or `{symbol}` alone")),
            );
        }
        BinaryOperator {
            op,
            span,
            blend: Some(blend),
        }
    }

    /// Creates `left op right`, where `left` may be a chain of the same precedence that is extended.
    pub(crate) fn chain(&mut self, left: Expr, operator: BinaryOperator, right: Expr) -> Expr {
        let span = left.span.to(right.span);
        let precedence = operator.op.precedence();
        let mut chain = match left.kind {
            ExprKind::Chain(chain) if chain.links[0].op.precedence() == precedence => chain,
            _ => Box::new(Chain {
                first: left,
                links: Vec::new(),
            }),
        };
        if precedence == Precedence::Compare && chain.links.len() == 1 {
            self.report(
                Diagnostic::error(codes::E0123, operator.span, "a comparison has two sides")
                    .primary("a second comparison")
                    .label(chain.links[0].op_span, "the first one")
                    .help("write `a < b && b < c`"),
            );
        }
        chain.links.push(ChainLink {
            op: operator.op,
            op_span: operator.span,
            blend: operator.blend,
            operand: right,
        });
        Expr {
            kind: ExprKind::Chain(chain),
            span,
        }
    }

    pub(crate) fn range(
        &self,
        start: u32,
        from: Expr,
        inclusive: bool,
        to: Expr,
        end: u32,
    ) -> Expr {
        let range = RangeExpr {
            start: from,
            end: to,
            inclusive,
        };
        self.expr(start, ExprKind::Range(Box::new(range)), end)
    }

    pub(crate) fn branch(
        &mut self,
        start: u32,
        arms: Vec<IfArm>,
        otherwise: Option<Body>,
        end: u32,
    ) -> Expr {
        self.leave();
        let otherwise = otherwise.unwrap_or_else(|| {
            let end_span = self.span(start, end).at_end();
            self.report(
                Diagnostic::error(codes::E0122, end_span, "this `if` has no `else`")
                    .primary("the value of the other case is missing")
                    .label(self.span(start, start + 2), "an `if` is an expression"),
            );
            self.plain_body(self.placeholder(end_span))
        });
        self.expr(
            start,
            ExprKind::If(Box::new(If {
                arms,
                else_body: otherwise,
            })),
            end,
        )
    }

    pub(crate) fn for_each(
        &mut self,
        start: u32,
        name: Ident,
        range: Expr,
        body: Body,
        end: u32,
    ) -> Expr {
        self.leave();
        let each = For { name, range, body };
        self.expr(start, ExprKind::For(Box::new(each)), end)
    }

    pub(crate) fn blend_scope(&self, start: u32, blend: Args, body: Body, end: u32) -> Expr {
        let scope = BlendScope { blend, body };
        self.expr(start, ExprKind::BlendScope(Box::new(scope)), end)
    }

    pub(crate) fn lambda(&mut self, start: u32, params: FnParams, body: Body, end: u32) -> Expr {
        self.leave();
        let lambda = Lambda {
            params: params.list,
            params_span: params.span,
            body,
        };
        self.expr(start, ExprKind::Lambda(Box::new(lambda)), end)
    }
}

/// Parameters of a function with their brackets, while it is parsed.
pub(crate) struct FnParams {
    pub(crate) list: Vec<FnParam>,
    pub(crate) span: Span,
}

fn missing_value(statements: &[Statement], body: Span) -> Diagnostic {
    let close = Span {
        start: body.end - 1,
        ..body
    };
    match statements.last() {
        Some(Statement {
            kind: StatementKind::Expr(value),
            span,
        }) => {
            let semicolon = Span {
                start: span.end.max(span.start + 1) - 1,
                ..*span
            };
            Diagnostic::error(codes::E0121, semicolon, "this block has no value")
                .primary("the `;` drops it")
                .label(value.span, "this would be the value")
                .fix(semicolon, "", "remove the `;`")
        }
        Some(_) | None => Diagnostic::error(codes::E0121, close, "this block has no value")
            .primary("an expression is missing before this `}`")
            .help("the last expression of a block, without `;`, is its value"),
    }
}
