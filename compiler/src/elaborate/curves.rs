//! Stretching, twisting and cutting shapes, and the ways between the plane and space.

use super::Elaborator;
use super::bound::Bound;
use super::evaluate::Outcome;
use super::value::Value;
use crate::expression::ExprId;
use crate::scene::ShapeKind;
use crate::symbolic::Symbolic;
use sdfc_vm::ops::affine;
use sdfc_vm::real::lit;
use sdfc_vm::table::Op;

impl<'a> Elaborator<'a> {
    /// `elongate(shape, by)`
    pub(crate) fn elongate(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let plane = self.shapes[child.0 as usize].plane;
        let by = bound.vector(1);
        let parameters = self.prepared(Op::Elongate, &by);
        let kind = ShapeKind::Domain {
            op: Op::Elongate,
            child,
            parameters,
        };
        let pulled = self.add(kind, plane, span);
        let parameters = self.prepared(Op::ElongateCorrect, &by);
        let op = Op::ElongateCorrect;
        let kind = ShapeKind::Distance {
            op,
            child: pulled,
            parameters,
        };
        Ok(Value::Shape(self.add(kind, plane, span)))
    }

    /// `twist(shape, rate)` and `bend(shape, rate)`, about axes that follow which one points up.
    pub(crate) fn curled(&mut self, op: Op, bound: Bound<'a>) -> Outcome<'a> {
        let span = bound.span;
        let child = bound.shape(0);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let child = self.lying(child, span);
        let parameters = self.prepared(op, &[bound.number(1)]);
        let curled = self.add(
            ShapeKind::Domain {
                op,
                child,
                parameters,
            },
            false,
            span,
        );
        Ok(Value::Shape(self.upright(curled, span)))
    }

    /// `revolve(figure, offset, angle)`: about the axis that points up.
    pub(crate) fn revolve(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let offset = bound.number(1);
        let angle = bound.given(2).then(|| bound.number(2));
        let whole = match angle {
            None => true,
            Some(angle) => self
                .graph
                .as_constant(angle)
                .is_some_and(|a| a >= std::f64::consts::TAU - 1e-9),
        };
        let turned = match angle {
            Some(angle) if !whole => {
                let what = "the angle of a revolution";
                if self
                    .check_above(what, angle, true, bound.span_of(2))
                    .is_none()
                {
                    return Ok(Value::Poison);
                }
                let parameters = self.prepared(Op::RevolvePart, &[offset, angle]);
                let op = Op::RevolvePart;
                let turned = self.add(
                    ShapeKind::Domain {
                        op,
                        child,
                        parameters,
                    },
                    false,
                    span,
                );
                let parameters = self.prepared(Op::RevolveClose, &[angle]);
                let op = Op::RevolveClose;
                self.add(
                    ShapeKind::Distance {
                        op,
                        child: turned,
                        parameters,
                    },
                    false,
                    span,
                )
            }
            _ => {
                let parameters = self.prepared(Op::Revolve, &[offset]);
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
        Ok(Value::Shape(self.upright(turned, span)))
    }

    /// `section(solid, normal, at)`: the figure that a solid shows in a plane. The figure's x and y
    /// are the next two axes after the normal for an axis, and lie in the plane for any normal.
    pub(crate) fn section(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let normal = bound.vector(1);
        let at = Symbolic(bound.number(2));
        let known = normal.map(|id| self.graph.as_constant(id));
        let is_z = known == [Some(0.0), Some(0.0), Some(1.0)];
        let normal = normal.map(Symbolic);
        let turned = self.framed(child, span, || {
            let o = lit::<Symbolic>(0.0);
            // From the figure's space to the solid's: z goes along the normal.
            let onto = match known {
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
                affine::compose(&onto, &affine::translate([o, o, -at])),
                lit(1.0),
            )
        });
        let kind = ShapeKind::Domain {
            op: Op::Slice,
            child: turned,
            parameters: Vec::new(),
        };
        Ok(Value::Shape(self.add(kind, true, span)))
    }

    /// `slice(shape, normal, at)`: what lies beyond a plane, on the side that the normal points to.
    pub(crate) fn slice(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let mut arguments: Vec<ExprId> = bound.vector(1).to_vec();
        arguments.push(bound.number(2));
        for id in &mut arguments {
            *id = self.op(Op::Neg, &[*id]);
        }
        let parameters = self.prepared(Op::Plane, &arguments);
        let plane = self.shapes[child.0 as usize].plane;
        let half = self.add(
            ShapeKind::Primitive {
                op: Op::Plane,
                parameters,
            },
            plane,
            span,
        );
        let both = self.combined(Op::Intersection, Vec::new(), vec![child, half], span);
        super::shapes::shape_value(both)
    }
}
