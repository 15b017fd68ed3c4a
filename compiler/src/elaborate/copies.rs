//! Copies of shapes by folding space: mirrors, grids and rings. They cost no more than one copy.

use super::Elaborator;
use super::bound::{Bound, short};
use super::evaluate::Outcome;
use super::symbolic::Symbolic;
use super::value::Value;
use crate::expression::ExprId;
use crate::scene::{ShapeId, ShapeKind};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::ops::affine::{self, Affine};
use sdfc_vm::real::lit;
use sdfc_vm::table::Op;

impl<'a> Elaborator<'a> {
    /// `mirror(shape, axes)`: what lies on the positive side of a plane, on both sides. Along axes
    /// that is a fold of coordinates; any other plane is turned there and back.
    pub(crate) fn mirror(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        let axes = bound.vector(1);
        let what = "the plane of a mirror";
        let at = Symbolic(bound.number(2));
        let constants = axes.map(|id| self.graph.as_constant(id));
        let flags = constants.map(|c| c.is_some_and(|c| c == 0.0 || c == 1.0));
        let is_still = self.graph.as_constant(bound.number(2)) == Some(0.0);
        if constants.iter().all(|c| *c == Some(0.0)) {
            let message = format!("{what} is the zero vector, which has no direction");
            self.report(Diagnostic::error(codes::E0405, bound.span_of(1), message));
            return Ok(Value::Poison);
        }
        if flags.iter().all(|f| *f) && is_still {
            return Ok(Value::Shape(self.folded(child, axes, span)));
        }
        let Some(normal) = self.direction(what, &axes, bound.span_of(1)) else {
            return Ok(Value::Poison);
        };
        let normal = [normal[0], normal[1], normal[2]].map(Symbolic);
        // The reflection that swaps the normal and the x axis is its own inverse.
        let known = normal.map(|n| self.graph.as_constant(n.0));
        let is_x = known == [Some(1.0), Some(0.0), Some(0.0)];
        let swap = move || -> Affine<Symbolic> {
            if is_x {
                return affine::identity();
            }
            let one = lit::<Symbolic>(1.0);
            affine::reflect([normal[0] - one, normal[1], normal[2]], lit(0.0))
        };
        let shift = move |by: Symbolic| {
            let o = lit::<Symbolic>(0.0);
            affine::translate([by, o, o])
        };
        // Into a frame whose x axis is the normal and whose origin lies on the plane.
        let inner = self.framed(child, span, || {
            let back = affine::compose(&swap(), &shift(-at));
            (back, lit(1.0))
        });
        let (one, zero) = (self.graph.constant(1.0), self.graph.constant(0.0));
        let folded = self.folded(inner, [one, zero, zero], span);
        let id = self.framed(folded, span, || {
            (affine::compose(&shift(at), &swap()), lit(1.0))
        });
        Ok(Value::Shape(id))
    }

    fn folded(&mut self, child: ShapeId, axes: [ExprId; 3], span: Span) -> ShapeId {
        if self.is_nothing(child) {
            return child;
        }
        let plane = self.shapes[child.0 as usize].plane;
        let parameters = self.prepared(Op::Mirror, &axes);
        self.add(
            ShapeKind::Domain {
                op: Op::Mirror,
                child,
                parameters,
            },
            plane,
            span,
        )
    }

    /// `repeat(shape, spacing, count)`
    pub(crate) fn repeat(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let spacing = bound.vector(1);
        let steps = spacing.map(|id| self.present(id));
        if steps.iter().all(|step| *step == 0.0) {
            let message = "a repetition needs a spacing along at least one axis";
            self.report(Diagnostic::error(codes::E0401, bound.span_of(1), message));
            return Ok(Value::Poison);
        }
        let is_fixed = self.is_constant_shape(child);
        let bounds = self.bounds_of(child);
        let mut middle = [0.0; 3];
        for axis in 0..3 {
            if steps[axis] == 0.0 {
                continue;
            }
            let size = bounds.max[axis] - bounds.min[axis];
            if !bounds.is_empty() && size > steps[axis] * (1.0 + 1e-9) {
                let letter = ["x", "y", "z"][axis];
                let message = format!(
                    "the shape is {} along {letter}, and its cell only {}: it would be cut",
                    extent(size),
                    short(steps[axis])
                );
                let mut diagnostic = Diagnostic::error(codes::E0411, bound.span_of(1), message);
                if bound.span_of(0).file == span.file {
                    diagnostic = diagnostic.label(bound.span_of(0), "this shape");
                }
                self.report(diagnostic.help("make the spacing larger, or the shape smaller"));
                return Ok(Value::Poison);
            }
            let is_inside =
                bounds.min[axis] >= -steps[axis] / 2.0 && bounds.max[axis] <= steps[axis] / 2.0;
            if is_fixed && !is_inside && bounds.is_finite() {
                middle[axis] = bounds.centre()[axis];
            }
        }
        // A copy that stands off the middle of its cell is brought there, and the whole moved back.
        let centred = self.moved(child, middle.map(|v| -v), span);
        let (low, high) = match is_fixed {
            true => {
                let shifted = |v: [f64; 3]| [0, 1, 2].map(|i| v[i] - middle[i]);
                let constant = |v: f64| self.graph.constant(v.clamp(-1e18, 1e18));
                (shifted(bounds.min).map(constant), shifted(bounds.max))
            }
            // What moves may be anywhere in its cell.
            false => {
                let half = steps.map(|s| s / 2.0);
                (half.map(|h| self.graph.constant(-h)), half)
            }
        };
        let high = high.map(|v| self.graph.constant(v.clamp(-1e18, 1e18)));
        let mut guard: Vec<ExprId> = Vec::new();
        guard.extend(low);
        guard.extend(high);
        guard.extend(spacing);
        let plane = self.shapes[child.0 as usize].plane;
        let repeated = if bound.given(2) {
            let counts = bound.vector(2);
            let arguments: Vec<ExprId> = spacing.into_iter().chain(counts).collect();
            let parameters = self.prepared(Op::RepeatLimited, &arguments);
            let kind = ShapeKind::Domain {
                op: Op::RepeatLimited,
                child: centred,
                parameters,
            };
            let folded = self.add(kind, plane, span);
            guard.extend(counts);
            let parameters = self.prepared(Op::RepeatLimitedGuard, &guard);
            let op = Op::RepeatLimitedGuard;
            self.add(
                ShapeKind::Distance {
                    op,
                    child: folded,
                    parameters,
                },
                plane,
                span,
            )
        } else {
            let parameters = self.prepared(Op::RepeatGuard, &guard);
            let op = Op::RepeatGuard;
            let kind = ShapeKind::Distance {
                op,
                child: centred,
                parameters,
            };
            let guarded = self.add(kind, plane, span);
            let parameters = self.prepared(Op::Repeat, &spacing);
            let op = Op::Repeat;
            self.add(
                ShapeKind::Domain {
                    op,
                    child: guarded,
                    parameters,
                },
                plane,
                span,
            )
        };
        Ok(Value::Shape(self.moved(repeated, middle, span)))
    }

    /// A shape moved by constants.
    pub(crate) fn moved(&mut self, child: ShapeId, by: [f64; 3], span: Span) -> ShapeId {
        self.framed(child, span, || (affine::translate(by.map(lit)), lit(1.0)))
    }

    /// `polar(shape, n)`: copies about the axis that points up, or in the plane for a figure.
    pub(crate) fn polar(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let (child, span) = (bound.shape(0), bound.span);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let plane = self.shapes[child.0 as usize].plane;
        let child = if plane {
            child
        } else {
            self.lying(child, span)
        };
        // The first sector is the one in which the shape stands.
        let phase = match bound.given(2) {
            true => bound.number(2),
            false => {
                let bounds = self.bounds_of(child);
                let centre = bounds.centre();
                let across = if plane { centre[1] } else { centre[2] };
                let direction = if bounds.is_empty() {
                    0.0
                } else {
                    across.atan2(centre[0])
                };
                self.graph.constant(if direction.is_finite() {
                    direction
                } else {
                    0.0
                })
            }
        };
        let rows = match plane {
            true => [Op::PolarPlane, Op::PolarPlaneNeighbour],
            false => [Op::Polar, Op::PolarNeighbour],
        };
        let arguments = [bound.number(1), phase];
        let copies = rows.map(|op| {
            let parameters = self.prepared(op, &arguments);
            self.add(
                ShapeKind::Domain {
                    op,
                    child,
                    parameters,
                },
                plane,
                span,
            )
        });
        let Some(both) = self.combined(Op::Union, Vec::new(), copies.to_vec(), span) else {
            return Ok(Value::Poison);
        };
        Ok(Value::Shape(if plane {
            both
        } else {
            self.upright(both, span)
        }))
    }
}

/// An extent of a shape, which may be endless.
fn extent(size: f64) -> String {
    if size.is_finite() {
        format!("{} long", short(size))
    } else {
        "endless".to_owned()
    }
}
