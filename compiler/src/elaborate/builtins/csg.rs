//! Set operations on shapes, and their blends.
//!
//! `a | b | c` is a single union of three shapes. A list among the operands contributes its
//! elements or, as in an intersection, their union. Empty operands are left out where that does not
//! change the result.

use crate::elaborate::Elaborator;
use crate::elaborate::arguments::{Invocation, PassedArg};
use crate::elaborate::blend_spec::{BlendKind, BlendSpec, SetOperator};
use crate::elaborate::diagnose::{nearest, suggest};
use crate::elaborate::shapes::{help_with_function, shape_value};
use crate::elaborate::value::{Env, EvalResult, Value};
use crate::expression::ExprId;
use crate::scene::{ShapeId, ShapeKind};
use sdfc_lang::ast::{BinaryOp, Chain, ChainLink};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::table::Op;

/// Operands collected for one combination.
struct OperandList {
    row: Op,
    parameters: Vec<ExprId>,
    shapes: Vec<ShapeId>,
}

impl<'a> Elaborator<'a> {
    /// Evaluates a chain of `|` or `&`.
    pub(crate) fn csg_chain(
        &mut self,
        env: &Env<'a>,
        chain: &'a Chain,
        span: Span,
    ) -> EvalResult<'a> {
        let first = self.eval(env, &chain.first)?;
        self.csg_links(env, first, chain.first.span, &chain.links, span)
    }

    /// Applies the operators of a chain from left to right.
    pub(crate) fn csg_links(
        &mut self,
        env: &Env<'a>,
        first: Value<'a>,
        first_span: Span,
        links: &'a [ChainLink],
        span: Span,
    ) -> EvalResult<'a> {
        let mut operands = Vec::with_capacity(links.len());
        let mut fits = self.set_operand(&first, first_span, &links[0]);
        for link in links {
            let value = self.eval(env, &link.operand)?;
            if link.op == BinaryOp::Add {
                let spans = (first_span, link.op_span, link.operand.span);
                return Ok(self.binary(link.op, first, value, spans));
            }
            let blend = match &link.blend {
                Some(args) => self.blend(env, args, Some(link.op_span))?,
                None => env.blend.as_deref().cloned(),
            };
            fits &= self.set_operand(&value, link.operand.span, link);
            fits &= link.blend.is_none() || blend.is_some();
            operands.push((link, value, blend));
        }
        if !fits {
            return Ok(Value::Poison);
        }
        let mut pending: Option<OperandList> = None;
        let mut left_span = first_span;
        let mut shapes = Vec::new();
        let hard_union = links[0].op == BinaryOp::Union && operands[0].2.is_none();
        if hard_union {
            if self
                .collect_shapes(&first, first_span, &mut shapes)
                .is_none()
            {
                return Ok(Value::Poison);
            }
        } else {
            match self.shape(&first, first_span) {
                Some(shape) => shapes.push(shape),
                None => return Ok(Value::Poison),
            }
        }
        for (link, value, blend) in operands {
            let operation = match link.op {
                BinaryOp::Union => SetOperator::Union,
                BinaryOp::Intersection => SetOperator::Intersection,
                _ => SetOperator::Subtraction,
            };
            let Some((row, parameters)) = self.set_row(operation, blend.as_ref()) else {
                return Ok(Value::Poison);
            };
            let mut operands_so_far = match pending.take() {
                Some(operands_so_far)
                    if operands_so_far.row == row && operands_so_far.parameters == parameters =>
                {
                    operands_so_far
                }
                Some(operands_so_far) => {
                    let combined = self.combine(
                        operands_so_far.row,
                        operands_so_far.parameters,
                        operands_so_far.shapes,
                        left_span,
                    );
                    let Some(combined) = combined else {
                        return Ok(Value::Poison);
                    };
                    OperandList {
                        row,
                        parameters,
                        shapes: vec![combined],
                    }
                }
                None => OperandList {
                    row,
                    parameters,
                    shapes: std::mem::take(&mut shapes),
                },
            };
            let operand = link.operand.span;
            // For hard unions and subtractions, a list may be replaced by its elements.
            if matches!(row, Op::Union | Op::Subtraction) {
                if self
                    .collect_shapes(&value, operand, &mut operands_so_far.shapes)
                    .is_none()
                {
                    return Ok(Value::Poison);
                }
            } else {
                match self.shape(&value, operand) {
                    Some(shape) => operands_so_far.shapes.push(shape),
                    None => return Ok(Value::Poison),
                }
            }
            if let Some(blend) = &blend {
                self.warn_large_blend(blend, &operands_so_far.shapes, [first_span, operand]);
            }
            left_span = left_span.to(operand);
            pending = Some(operands_so_far);
        }
        let Some(OperandList {
            row,
            parameters,
            shapes,
        }) = pending
        else {
            return Ok(Value::Poison);
        };
        shape_value(self.combine(row, parameters, shapes, span))
    }

    fn set_operand(&mut self, value: &Value<'a>, span: Span, link: &ChainLink) -> bool {
        if value.is_poison() {
            return false;
        }
        if value.is_shape() {
            return true;
        }
        let what = self.describe(value);
        let symbol = link.op.symbol();
        let message = format!("`{symbol}` goes with shapes, and this is {what}");
        let mut diagnostic = Diagnostic::error(codes::E0302, span, message).label(link.op_span, "");
        if matches!(value, Value::Bool(_)) && link.op != BinaryOp::Sub {
            let doubled = symbol.repeat(2);
            let text = format!("with conditions, write `{doubled}`");
            diagnostic = diagnostic.fix(link.op_span, doubled, text);
        } else if matches!(value, Value::Number(_)) && link.op == BinaryOp::Sub {
            diagnostic = diagnostic.help("`.offset(0.2)` adds 0.2 to a shape on all sides");
        } else {
            diagnostic = help_with_function(diagnostic, value);
        }
        self.report(diagnostic);
        false
    }

    /// Evaluates `!shape`: everything outside of it.
    pub(crate) fn complement(&mut self, value: &Value<'a>, operand: Span, span: Span) -> Value<'a> {
        let Some(child) = self.shape(value, operand) else {
            return Value::Poison;
        };
        let is_2d = self.shapes[child.0 as usize].is_2d;
        if self.is_nothing(child) {
            let message = "the complement of an empty shape cannot be drawn";
            self.report(Diagnostic::error(codes::E0405, span, message));
            return Value::Poison;
        }
        // A complement is unbounded, but the complement of a complement may be bounded.
        if let ShapeKind::Distance {
            op: Op::Complement,
            child: inner,
            ..
        } = self.shapes[child.0 as usize].kind
        {
            return Value::Shape(inner);
        }
        let kind = ShapeKind::Distance {
            op: Op::Complement,
            child,
            parameters: Vec::new(),
        };
        Value::Shape(self.add(kind, is_2d, span))
    }

    /// Evaluates `union(..)`, `intersect(..)` or `subtract(..)` with shapes, lists and a named blend.
    pub(crate) fn set_function(
        &mut self,
        operation: SetOperator,
        call: Invocation<'a>,
    ) -> EvalResult<'a> {
        let mut blend: Option<(BlendKind, &PassedArg<'a>)> = None;
        let mut kernel = None;
        let mut steps = None;
        let mut operands = Vec::new();
        let names = ["smooth", "kernel", "chamfer", "fillet", "stairs", "n"];
        for arg in &call.args {
            match arg.name.map(|name| name.name.as_str()) {
                None => operands.push(arg),
                Some("smooth") => blend = Some((BlendKind::Quadratic, arg)),
                Some("chamfer") => blend = Some((BlendKind::Chamfer, arg)),
                Some("fillet") => blend = Some((BlendKind::Fillet, arg)),
                Some("stairs") => blend = Some((BlendKind::Stairs, arg)),
                Some("kernel") => kernel = Some(arg),
                Some("n") => steps = Some(arg),
                Some(name) => {
                    let span = arg.name.map_or(arg.span, |name| name.span);
                    let message = format!("`{}` has no argument `{name}`", call.name);
                    let diagnostic = Diagnostic::error(codes::E0203, span, message);
                    self.report(suggest(diagnostic, span, nearest(name, names)));
                    return Ok(Value::Poison);
                }
            }
        }
        let blend = match (blend, kernel) {
            (Some((kind, arg)), kernel) => {
                let kind = match kernel {
                    Some(kernel) => match self.blend_kernel(kernel) {
                        Some(kind) => kind,
                        None => return Ok(Value::Poison),
                    },
                    None => kind,
                };
                let Some(amount) = self.blend_amount(&arg.value, arg.span) else {
                    return Ok(Value::Poison);
                };
                let steps = match steps {
                    Some(arg) => self.stair_count(&arg.value, arg.span),
                    None => None,
                };
                Some(BlendSpec {
                    kind,
                    amount,
                    steps,
                    span: arg.span,
                })
            }
            (None, Some(kernel)) => {
                let message = "a kernel needs a thickness: `smooth:`";
                self.report(Diagnostic::error(codes::E0204, kernel.span, message));
                return Ok(Value::Poison);
            }
            (None, None) => None,
        };
        let mut shapes = Vec::new();
        for (index, arg) in operands.iter().enumerate() {
            // A list is replaced by its elements where that does not change the result.
            let is_spliced = match operation {
                _ if operands.len() == 1 => true,
                SetOperator::Union => true,
                SetOperator::Subtraction => index > 0 && blend.is_none(),
                SetOperator::Intersection => false,
            };
            let collected = match is_spliced {
                true => self.collect_shapes(&arg.value, arg.span, &mut shapes),
                false => self
                    .shape(&arg.value, arg.span)
                    .map(|shape| shapes.push(shape)),
            };
            if collected.is_none() {
                return Ok(Value::Poison);
            }
        }
        let Some((row, parameters)) = self.set_row(operation, blend.as_ref()) else {
            return Ok(Value::Poison);
        };
        if let Some(blend) = &blend {
            self.warn_large_blend(blend, &shapes, [call.span, call.span]);
        }
        shape_value(self.combine(row, parameters, shapes, call.span))
    }

    /// Evaluates `xor(a, b, ..)`: the points in an odd number of the shapes.
    pub(crate) fn exclusive(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        if self.has_wrong_arg_count(&call, 1..=usize::MAX) {
            return Ok(Value::Poison);
        }
        let mut shapes = Vec::new();
        for arg in &call.args {
            if self
                .collect_shapes(&arg.value, arg.span, &mut shapes)
                .is_none()
            {
                return Ok(Value::Poison);
            }
        }
        shape_value(self.combine(Op::Xor, Vec::new(), shapes, call.span))
    }
}
