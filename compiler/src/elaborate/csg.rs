//! Set operations on shapes, and their blends.
//!
//! `a | b | c` is one union of three; a list among its operands adds its elements. An operand that
//! is no shape at all is left out where that changes nothing.

use super::Elaborator;
use super::arguments::{Given, Invocation};
use super::blend::{Blend, BlendKind};
use super::diagnose::{nearest, suggest};
use super::evaluate::{Here, Outcome};
use super::value::Value;
use crate::expression::ExprId;
use crate::scene::{ShapeId, ShapeKind};
use sdfc_lang::ast::{BinaryOp, Chain, Link};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::Op;

/// Which set operation.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum SetOperation {
    /// `|`
    Union,
    /// `&`
    Intersection,
    /// `-`
    Subtraction,
}

/// Operands gathered for one combination.
struct Gathered {
    row: Op,
    parameters: Vec<ExprId>,
    shapes: Vec<ShapeId>,
}

impl<'a> Elaborator<'a> {
    /// A chain of `|` or `&`.
    pub(crate) fn csg_chain(
        &mut self,
        here: &Here<'a>,
        chain: &'a Chain,
        span: Span,
    ) -> Outcome<'a> {
        let first = self.eval(here, &chain.first)?;
        self.csg_links(here, first, chain.first.span, &chain.rest, span)
    }

    /// The operators of a chain, from left to right, on shapes.
    pub(crate) fn csg_links(
        &mut self,
        here: &Here<'a>,
        first: Value<'a>,
        first_span: Span,
        links: &'a [Link],
        span: Span,
    ) -> Outcome<'a> {
        let mut operands = Vec::with_capacity(links.len());
        let mut fits = self.set_operand(&first, first_span, &links[0]);
        for link in links {
            let value = self.eval(here, &link.operand)?;
            if link.op == BinaryOp::Add {
                let spans = (first_span, link.op_span, link.operand.span);
                return Ok(self.binary(link.op, first, value, spans));
            }
            let blend = match &link.blend {
                Some(args) => self.blend(here, args, Some(link.op_span))?,
                None => here.blend.as_deref().cloned(),
            };
            fits &= self.set_operand(&value, link.operand.span, link);
            fits &= link.blend.is_none() || blend.is_some();
            operands.push((link, value, blend));
        }
        if !fits {
            return Ok(Value::Poison);
        }
        let mut gathered: Option<Gathered> = None;
        let mut before = first_span;
        let mut shapes = Vec::new();
        let hard_union = links[0].op == BinaryOp::Or && operands[0].2.is_none();
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
                BinaryOp::Or => SetOperation::Union,
                BinaryOp::And => SetOperation::Intersection,
                _ => SetOperation::Subtraction,
            };
            let Some((row, parameters)) = self.set_row(operation, blend.as_ref()) else {
                return Ok(Value::Poison);
            };
            let mut group = match gathered.take() {
                Some(group) if group.row == row && group.parameters == parameters => group,
                Some(group) => {
                    let whole = self.combined(group.row, group.parameters, group.shapes, before);
                    let Some(whole) = whole else {
                        return Ok(Value::Poison);
                    };
                    Gathered {
                        row,
                        parameters,
                        shapes: vec![whole],
                    }
                }
                None => Gathered {
                    row,
                    parameters,
                    shapes: std::mem::take(&mut shapes),
                },
            };
            let operand = link.operand.span;
            // Cutting away a union is cutting away each of its shapes; so is adding one.
            if matches!(row, Op::Union | Op::Subtraction) {
                if self
                    .collect_shapes(&value, operand, &mut group.shapes)
                    .is_none()
                {
                    return Ok(Value::Poison);
                }
            } else {
                match self.shape(&value, operand) {
                    Some(shape) => group.shapes.push(shape),
                    None => return Ok(Value::Poison),
                }
            }
            if let Some(blend) = &blend {
                self.warn_of_large_blend(blend, &group.shapes, [first_span, operand]);
            }
            before = before.to(operand);
            gathered = Some(group);
        }
        let Some(Gathered {
            row,
            parameters,
            shapes,
        }) = gathered
        else {
            return Ok(Value::Poison);
        };
        super::shapes::shape_value(self.combined(row, parameters, shapes, span))
    }

    fn set_operand(&mut self, value: &Value<'a>, span: Span, link: &Link) -> bool {
        if value.is_poison() {
            return false;
        }
        if self.is_shape(value) {
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
        } else {
            diagnostic = super::shapes::help_with_function(diagnostic, value);
        }
        self.report(diagnostic);
        false
    }

    /// Combines shapes from left to right by a row; shapes that are nothing drop out.
    pub(crate) fn combined(
        &mut self,
        row: Op,
        parameters: Vec<ExprId>,
        shapes: Vec<ShapeId>,
        span: Span,
    ) -> Option<ShapeId> {
        let is_intersection = matches!(
            row,
            Op::Intersection
                | Op::SmoothIntersection
                | Op::CubicIntersection
                | Op::CircularIntersection
                | Op::ExponentialIntersection
                | Op::ChamferIntersection
                | Op::RoundIntersection
                | Op::StairsIntersection
        );
        let is_union = matches!(
            row,
            Op::Union
                | Op::SmoothUnion
                | Op::CubicUnion
                | Op::CircularUnion
                | Op::ExponentialUnion
                | Op::ChamferUnion
                | Op::RoundUnion
                | Op::StairsUnion
                | Op::DistanceUnion
                | Op::Xor
        );
        let first_is_nothing = shapes.first().is_none_or(|&id| self.is_nothing(id));
        let any_is_nothing = shapes.iter().any(|&id| self.is_nothing(id));
        let mut children = shapes;
        if is_intersection && any_is_nothing || !is_union && first_is_nothing {
            children.clear();
        }
        children.retain(|&id| !self.is_nothing(id));
        match children.as_slice() {
            [] => return Some(self.add(ShapeKind::Nothing, false, span)),
            [only] => return Some(*only),
            _ => {}
        }
        let plane = self.shapes[children[0].0 as usize].plane;
        let other = children
            .iter()
            .find(|id| self.shapes[id.0 as usize].plane != plane);
        if let Some(&other) = other {
            let dimension = |plane: bool| if plane { "2D" } else { "3D" };
            let (a, b) = (
                &self.shapes[children[0].0 as usize],
                &self.shapes[other.0 as usize],
            );
            let message = format!(
                "a {} and a {} shape cannot be combined",
                dimension(a.plane),
                dimension(b.plane)
            );
            let mut diagnostic = Diagnostic::error(codes::E0304, span, message)
                .help("`extrude` and `revolve` make a 3D shape of a 2D one");
            for shape in [a, b] {
                if shape.span.file == span.file {
                    let text = format!("this is {}", dimension(shape.plane));
                    diagnostic = diagnostic.label(shape.span, text);
                }
            }
            self.report(diagnostic);
            return None;
        }
        self.warn_of_unseen(row, &children, span);
        Some(self.add(
            ShapeKind::Combine {
                op: row,
                children,
                parameters,
            },
            plane,
            span,
        ))
    }

    /// Warns of cuts that take nothing away and of intersections that are empty, where the boxes of
    /// shapes that stand still show it.
    fn warn_of_unseen(&mut self, row: Op, children: &[ShapeId], span: Span) {
        if !matches!(row, Op::Subtraction | Op::Intersection) {
            return;
        }
        if !children.iter().all(|&id| self.is_constant_shape(id)) {
            return;
        }
        let boxes: Vec<Bounds> = children.iter().map(|&id| self.bounds_of(id)).collect();
        let (message, what) = match row {
            Op::Subtraction => {
                let misses = |other: &Bounds| boxes[0].common(other).is_empty();
                if !boxes[1..].iter().all(misses) {
                    return;
                }
                ("this cuts nothing away", "the shapes do not touch")
            }
            _ => {
                let common = boxes.iter().fold(Bounds::EVERYTHING, |c, b| c.common(b));
                if !common.is_empty() {
                    return;
                }
                ("this intersection is empty", "the shapes do not touch")
            }
        };
        self.report(Diagnostic::warning(codes::W0402, span, message).primary(what));
    }

    /// `!shape`
    pub(crate) fn complement(&mut self, value: &Value<'a>, operand: Span, span: Span) -> Value<'a> {
        let Some(child) = self.shape(value, operand) else {
            return Value::Poison;
        };
        let plane = self.shapes[child.0 as usize].plane;
        if self.is_nothing(child) {
            let message = "everything is no shape that can be drawn";
            self.report(Diagnostic::error(codes::E0405, span, message));
            return Value::Poison;
        }
        // A complement has no end, but what it is made of may have one.
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
        Value::Shape(self.add(kind, plane, span))
    }

    /// `union(..)`, `intersect(..)`, `subtract(..)` with shapes, lists and a blend by name.
    pub(crate) fn set_function(
        &mut self,
        operation: SetOperation,
        call: Invocation<'a>,
    ) -> Outcome<'a> {
        let mut blend: Option<(BlendKind, &Given<'a>)> = None;
        let mut kernel = None;
        let mut steps = None;
        let mut operands = Vec::new();
        let known = ["smooth", "kernel", "chamfer", "fillet", "stairs", "n"];
        for given in &call.given {
            match given.name.map(|name| name.name.as_str()) {
                None => operands.push(given),
                Some("smooth") => blend = Some((BlendKind::Quadratic, given)),
                Some("chamfer") => blend = Some((BlendKind::Chamfer, given)),
                Some("fillet") => blend = Some((BlendKind::Fillet, given)),
                Some("stairs") => blend = Some((BlendKind::Stairs, given)),
                Some("kernel") => kernel = Some(given),
                Some("n") => steps = Some(given),
                Some(name) => {
                    let span = given.name.map_or(given.span, |name| name.span);
                    let message = format!("`{}` has no argument `{name}`", call.name);
                    let diagnostic = Diagnostic::error(codes::E0203, span, message);
                    self.report(suggest(diagnostic, span, nearest(name, known)));
                    return Ok(Value::Poison);
                }
            }
        }
        let blend = match (blend, kernel) {
            (Some((kind, given)), kernel) => {
                let kind = match kernel {
                    Some(kernel) => match self.kernel(kernel) {
                        Some(kind) => kind,
                        None => return Ok(Value::Poison),
                    },
                    None => kind,
                };
                let Some(amount) = self.blend_amount(&given.value, given.span) else {
                    return Ok(Value::Poison);
                };
                let steps = match steps {
                    Some(given) => self.stair_count(&given.value, given.span),
                    None => None,
                };
                Some(Blend {
                    kind,
                    amount,
                    steps,
                    span: given.span,
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
        for (at, given) in operands.iter().enumerate() {
            // A list is its union, unless it holds all that is combined.
            let is_spliced = match operation {
                _ if operands.len() == 1 => true,
                SetOperation::Union => true,
                SetOperation::Subtraction => at > 0 && blend.is_none(),
                SetOperation::Intersection => false,
            };
            let gathered = match is_spliced {
                true => self.collect_shapes(&given.value, given.span, &mut shapes),
                false => self
                    .shape(&given.value, given.span)
                    .map(|shape| shapes.push(shape)),
            };
            if gathered.is_none() {
                return Ok(Value::Poison);
            }
        }
        let Some((row, parameters)) = self.set_row(operation, blend.as_ref()) else {
            return Ok(Value::Poison);
        };
        if let Some(blend) = &blend {
            self.warn_of_large_blend(blend, &shapes, [call.span, call.span]);
        }
        super::shapes::shape_value(self.combined(row, parameters, shapes, call.span))
    }

    /// `xor(a, b, ..)`: what is in an odd number of them.
    pub(crate) fn exclusive(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        if self.wrong_count(&call, 1..=usize::MAX) {
            return Ok(Value::Poison);
        }
        let mut shapes = Vec::new();
        for given in &call.given {
            if self
                .collect_shapes(&given.value, given.span, &mut shapes)
                .is_none()
            {
                return Ok(Value::Poison);
            }
        }
        super::shapes::shape_value(self.combined(Op::Xor, Vec::new(), shapes, call.span))
    }
}
