//! Elongation, twists, revolution and sections of shapes, and conversions between 2-D and 3-D.

use crate::elaborate::Elaborator;
use crate::elaborate::argument_conversion::BoundArgs;
use crate::elaborate::shapes::shape_value;
use crate::elaborate::value::{EvalResult, Value};
use crate::expression::ExprId;
use crate::scene::ShapeKind;
use crate::symbolic::Symbolic;
use sdfc_vm::ops::affine;
use sdfc_vm::real::lit;
use sdfc_vm::table::Op;

impl<'a> Elaborator<'a> {
    /// Evaluates `elongate(shape, by)`: a shape that is cut in the middle and stretched along the axes.
    pub(crate) fn elongate(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let is_2d = self.shapes[child.0 as usize].is_2d;
        let lengths = bound.vector(1);
        let parameters = self.prepare_parameters(Op::Elongate, &lengths);
        let kind = ShapeKind::Domain {
            op: Op::Elongate,
            child,
            parameters,
        };
        let stretched = self.add(kind, is_2d, span);
        let parameters = self.prepare_parameters(Op::ElongateCorrect, &lengths);
        let op = Op::ElongateCorrect;
        let kind = ShapeKind::Distance {
            op,
            child: stretched,
            parameters,
        };
        Ok(Value::Shape(self.add(kind, is_2d, span)))
    }

    /// Evaluates `twist(shape, rate)` or `bend(shape, rate)`, about axes that depend on the up axis.
    pub(crate) fn twist_or_bend(&mut self, op: Op, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let span = bound.span;
        let child = bound.shape(0);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let child = self.rotated_to_y_up(child, span);
        let parameters = self.prepare_parameters(op, &[bound.number(1)]);
        let twist_or_bend = self.add(
            ShapeKind::Domain {
                op,
                child,
                parameters,
            },
            false,
            span,
        );
        Ok(Value::Shape(self.rotated_to_scene_up(twist_or_bend, span)))
    }

    /// Evaluates `revolve(shape, offset, angle)`: about the up axis.
    pub(crate) fn revolve(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let offset = bound.number(1);
        let angle = bound.is_given(2).then(|| bound.number(2));
        let is_full = match angle {
            None => true,
            Some(angle) => self
                .expressions
                .as_constant(angle)
                .is_some_and(|a| a >= std::f64::consts::TAU - 1e-9),
        };
        let revolved = match angle {
            Some(angle) if !is_full => {
                let what = "the angle of a revolution";
                if self
                    .check_above(what, angle, true, bound.span_at(2))
                    .is_none()
                {
                    return Ok(Value::Poison);
                }
                let parameters = self.prepare_parameters(Op::RevolvePart, &[offset, angle]);
                let op = Op::RevolvePart;
                let revolved = self.add(
                    ShapeKind::Domain {
                        op,
                        child,
                        parameters,
                    },
                    false,
                    span,
                );
                let parameters = self.prepare_parameters(Op::RevolveClose, &[angle]);
                let op = Op::RevolveClose;
                self.add(
                    ShapeKind::Distance {
                        op,
                        child: revolved,
                        parameters,
                    },
                    false,
                    span,
                )
            }
            _ => {
                let parameters = self.prepare_parameters(Op::Revolve, &[offset]);
                let op = Op::Revolve;
                self.add(
                    ShapeKind::Domain {
                        op,
                        child,
                        parameters,
                    },
                    false,
                    span,
                )
            }
        };
        Ok(Value::Shape(self.rotated_to_scene_up(revolved, span)))
    }

    /// Evaluates `section(solid, normal, at)`: the 2-D shape of a solid in a plane. For a normal along an axis,
    /// its x and y are the other two axes in their order. For any other normal, they lie in the plane.
    pub(crate) fn section(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let normal = bound.vector(1);
        let offset = Symbolic(bound.number(2));
        let constant_normal = normal.map(|id| self.expressions.as_constant(id));
        let is_z = constant_normal == [Some(0.0), Some(0.0), Some(1.0)];
        let normal = normal.map(Symbolic);
        let rotated = self.add_frame(child, span, || {
            let o = lit::<Symbolic>(0.0);
            // Maps from the space of the section to that of the solid: z becomes the normal.
            let to_section = match constant_normal {
                _ if is_z => affine::identity(),
                [Some(1.0), ..] => {
                    let i = lit::<Symbolic>(1.0);
                    [o, o, i, o, i, o, o, o, o, i, o, o]
                }
                [_, Some(1.0), _] => {
                    let i = lit::<Symbolic>(1.0);
                    [i, o, o, o, o, o, i, o, o, i, o, o]
                }
                _ => affine::reflect([normal[0], normal[1], normal[2] - lit(1.0)], o),
            };
            (
                affine::compose(&to_section, &affine::translate([o, o, -offset])),
                lit(1.0),
            )
        });
        let kind = ShapeKind::Domain {
            op: Op::Slice,
            child: rotated,
            parameters: Vec::new(),
        };
        Ok(Value::Shape(self.add(kind, true, span)))
    }

    /// Evaluates `slice(shape, normal, at)`: the part beyond a plane, on the side that the normal points to.
    pub(crate) fn slice(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let mut arguments: Vec<ExprId> = bound.vector(1).to_vec();
        arguments.push(bound.number(2));
        for id in &mut arguments {
            *id = self.op(Op::Neg, &[*id]);
        }
        let parameters = self.prepare_parameters(Op::Plane, &arguments);
        let is_2d = self.shapes[child.0 as usize].is_2d;
        let half_space = self.add(
            ShapeKind::Primitive {
                op: Op::Plane,
                parameters,
            },
            is_2d,
            span,
        );
        let intersection =
            self.combine(Op::Intersection, Vec::new(), vec![child, half_space], span);
        shape_value(intersection)
    }
}
