//! Moving, turning, copying and bending shapes.
//!
//! Scenes whose z axis points up are written in z-up coordinates throughout. The table's bodies
//! stand along y; where an axis of their own matters, the shape gets a frame that turns it upright.

use super::Elaborator;
use super::bound::{Bound, short};
use super::evaluate::Outcome;
use super::numbers::{Form, parts};
use super::symbolic::{Symbolic, with_graph};
use super::value::{Number, Quantity, Value};
use crate::expression::{ExprId, Stage};
use crate::scene::{ShapeId, ShapeKind};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::ops::affine::{self, Affine};
use sdfc_vm::real::{Real, lit};
use sdfc_vm::table::Op;

impl<'a> Elaborator<'a> {
    /// A shape in a frame of its own; nothing and an identity need none.
    pub(crate) fn framed(
        &mut self,
        child: ShapeId,
        span: Span,
        matrix: impl FnOnce() -> (Affine<Symbolic>, Symbolic),
    ) -> ShapeId {
        if self.is_nothing(child) {
            return child;
        }
        let (matrix, scale) = with_graph(&mut self.graph, || {
            let (matrix, scale) = matrix();
            (matrix.map(|number| number.0), scale.0)
        });
        let is_identity = self.graph.as_constant(scale) == Some(1.0)
            && matrix.iter().enumerate().all(|(at, &id)| {
                let wanted = if at / 4 == at % 4 { 1.0 } else { 0.0 };
                self.graph.as_constant(id) == Some(wanted)
            });
        if is_identity {
            return child;
        }
        let plane = self.shapes[child.0 as usize].plane;
        self.add(
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            },
            plane,
            span,
        )
    }

    /// A shape that stands along y, made to stand along the axis that points up.
    pub(crate) fn upright(&mut self, child: ShapeId, span: Span) -> ShapeId {
        if !self.z_up {
            return child;
        }
        self.framed(child, span, || (upright_matrix(), lit(1.0)))
    }

    /// A shape as it is in a space where y points up.
    fn lying(&mut self, child: ShapeId, span: Span) -> ShapeId {
        if !self.z_up {
            return child;
        }
        self.framed(child, span, || {
            let (o, i) = (lit(0.0), lit(1.0));
            ([i, o, o, o, o, o, -i, o, o, i, o, o], lit(1.0))
        })
    }

    /// The axis that points up.
    pub(crate) fn up(&self) -> usize {
        if self.z_up { 2 } else { 1 }
    }

    /// `translate(shape, by)`
    pub(crate) fn translate(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let by = bound.vector(1).map(Symbolic);
        let id = self.framed(bound.shape(0), bound.span, || {
            (affine::translate(by), lit(1.0))
        });
        Ok(Value::Shape(id))
    }

    /// `scale(shape, by)`
    pub(crate) fn scale(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let ids = bound.vector(1);
        let by = ids.map(Symbolic);
        let is_even = if bound.flat {
            ids[0] == ids[1]
        } else {
            ids[0] == ids[1] && ids[1] == ids[2]
        };
        let flat = bound.flat;
        let id = self.framed(bound.shape(0), bound.span, || {
            let [x, y, z] = by;
            let least = if is_even {
                x.abs()
            } else if flat {
                x.abs().min(y.abs())
            } else {
                x.abs().min(y.abs()).min(z.abs())
            };
            let (o, one) = (lit::<Symbolic>(0.0), lit::<Symbolic>(1.0));
            let [x, y, z] = [one / x, one / y, one / z];
            ([x, o, o, o, o, y, o, o, o, o, z, o], least)
        });
        Ok(Value::Shape(id))
    }

    /// `rotate(shape, angle, axis)` or `rotate(shape, [about x, about y, about z])`
    pub(crate) fn rotate(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let span = bound.span_of(1);
        let child = bound.shape(0);
        let Some((form, numbers)) = parts(bound.value(1)) else {
            return Ok(self.wrong(bound.value(1), "`rotate` wants an angle", span));
        };
        for number in &numbers[..form.len()] {
            if self
                .angle(bound.name, *number, span, bound.name_span)
                .is_none()
            {
                return Ok(Value::Poison);
            }
        }
        let flat = self.shapes[child.0 as usize].plane;
        let [a, b, c, _] = numbers.map(|number| number.id);
        let turned = match form {
            Form::Scalar => {
                if flat && bound.given(2) {
                    let message = "a 2D shape turns in its plane and has no axis";
                    let diagnostic = Diagnostic::error(codes::E0304, bound.span_of(2), message);
                    self.report(diagnostic.help("`extrude` it first"));
                    return Ok(Value::Poison);
                }
                let axis = match bound.given(2) {
                    true => bound.vector(2),
                    false => {
                        let along = if flat { 2 } else { self.up() };
                        [0, 1, 2].map(|i| self.graph.constant(if i == along { 1.0 } else { 0.0 }))
                    }
                };
                self.turned(child, a, axis, bound.span)
            }
            Form::Vector(3) if !flat => {
                let axis = |e: &mut Self, along: usize| {
                    [0, 1, 2].map(|i| e.graph.constant(if i == along { 1.0 } else { 0.0 }))
                };
                let mut turned = child;
                for (along, angle) in [a, b, c].into_iter().enumerate() {
                    let axis = axis(self, along);
                    turned = self.turned(turned, angle, axis, bound.span);
                }
                turned
            }
            Form::Vector(_) | Form::Color => {
                let wanted = "`rotate` wants an angle and an axis, or three angles";
                return Ok(self.wrong(bound.value(1), wanted, span));
            }
        };
        Ok(Value::Shape(turned))
    }

    /// Checks that a number is an angle that is known before the point.
    pub(crate) fn angle(
        &mut self,
        name: &str,
        number: Number,
        span: Span,
        name_span: Span,
    ) -> Option<ExprId> {
        match number.quantity {
            Quantity::Angle => {}
            Quantity::Plain | Quantity::Time => {
                let wants = if name == "rotate" {
                    "angle: angle, axis: vec3"
                } else {
                    ""
                };
                let diagnostic = self.no_unit(name, span).label(name_span, wants);
                self.report(diagnostic);
                return None;
            }
            Quantity::Length(_) => {
                let got = number.quantity.noun();
                let message = format!("`{name}` wants an angle, and this is {got}");
                self.report(Diagnostic::error(codes::E0303, span, message).label(name_span, ""));
                return None;
            }
        }
        let stage = self.graph.stage(number.id);
        if stage > Stage::Uniform {
            self.report_late("an angle", stage, span);
            return None;
        }
        Some(number.id)
    }

    /// A shape turned about an axis of length one.
    fn turned(&mut self, child: ShapeId, angle: ExprId, axis: [ExprId; 3], span: Span) -> ShapeId {
        let constants = axis.map(|id| self.graph.as_constant(id));
        let along = (0..3).find(|&i| {
            (0..3).all(|j| {
                constants[j].is_some_and(|v| if i == j { v.abs() == 1.0 } else { v == 0.0 })
            })
        });
        // About an axis of the frame, quarter turns are exact and most factors are zero.
        if let Some(along) = along {
            let negative = constants[along] == Some(-1.0);
            let known = self.graph.as_constant(angle);
            return self.framed(child, span, || {
                let (c, s) = match known {
                    Some(angle) => {
                        let (s, c) = exact_sine_cosine(angle);
                        (lit(c), lit(s))
                    }
                    None => (Symbolic(angle).cos(), Symbolic(angle).sin()),
                };
                (
                    turn_about(along, c, if negative { -s } else { s }),
                    lit(1.0),
                )
            });
        }
        let axis = axis.map(Symbolic);
        self.framed(child, span, || {
            (affine::rotate(axis, Symbolic(angle)), lit(1.0))
        })
    }

    /// `rotate_quaternion(shape, [x, y, z, w])`
    pub(crate) fn rotate_quaternion(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let span = bound.span_of(1);
        let Some((Form::Vector(4), numbers)) = parts(bound.value(1)) else {
            return Ok(self.wrong(bound.value(1), "a quaternion is four numbers", span));
        };
        let ids = numbers.map(|number| number.id);
        let what = "the quaternion";
        for id in ids {
            let stage = self.graph.stage(id);
            if stage > Stage::Uniform {
                self.report_late(what, stage, span);
                return Ok(Value::Poison);
            }
        }
        let Some(unit) = self.direction(what, &ids, span) else {
            return Ok(Value::Poison);
        };
        let quaternion = [unit[0], unit[1], unit[2], unit[3]].map(Symbolic);
        let id = self.framed(bound.shape(0), bound.span, || {
            (affine::rotate_quaternion(quaternion), lit(1.0))
        });
        Ok(Value::Shape(id))
    }

    /// `reflect(shape, normal, at)`: the mirror image.
    pub(crate) fn reflect(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let (normal, at) = (bound.vector(1).map(Symbolic), Symbolic(bound.number(2)));
        let id = self.framed(bound.shape(0), bound.span, || {
            (affine::reflect(normal, at), lit(1.0))
        });
        Ok(Value::Shape(id))
    }

    /// `shear(shape, xy, xz, yz)`
    pub(crate) fn shear(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let [xy, xz, yz] = [1, 2, 3].map(|at| Symbolic(bound.number(at)));
        let id = self.framed(bound.shape(0), bound.span, || {
            let matrix = affine::shear(xy, xz, yz);
            // A distance inside is at most the matrix's norm times one outside; the norm is at most
            // the root of the sum of squares.
            let linear = [0, 1, 2, 4, 5, 6, 8, 9, 10].map(|at| matrix[at]);
            let sum = linear
                .iter()
                .fold(lit::<Symbolic>(0.0), |sum, v| sum + v.square());
            (matrix, lit::<Symbolic>(1.0) / sum.sqrt())
        });
        Ok(Value::Shape(id))
    }

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
        let bounds = self.bounds_of(child);
        let curled = self.add(
            ShapeKind::Domain {
                op,
                child,
                parameters,
            },
            false,
            span,
        );
        let curled = self.kept_near(curled, &bounds, span);
        Ok(Value::Shape(self.upright(curled, span)))
    }

    /// A shape whose distance holds only near it, made safe farther out.
    fn kept_near(&mut self, shape: ShapeId, before: &Bounds, span: Span) -> ShapeId {
        let bounds = self.bounds_of(shape);
        if !bounds.is_finite() || !before.is_finite() || !self.is_constant_shape(shape) {
            return shape;
        }
        let margin = bounds.half_diagonal() * 0.1;
        let numbers = bounds.min.into_iter().chain(bounds.max).chain([margin]);
        let arguments: Vec<ExprId> = numbers.map(|v| self.graph.constant(v)).collect();
        let parameters = self.prepared(Op::Bounded, &arguments);
        let kind = ShapeKind::Distance {
            op: Op::Bounded,
            child: shape,
            parameters,
        };
        self.add(kind, false, span)
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

/// An extent of a shape, which may be endless.
fn extent(size: f64) -> String {
    if size.is_finite() {
        format!("{} long", short(size))
    } else {
        "endless".to_owned()
    }
}

/// From z-up space to the space of a body that stands along y.
fn upright_matrix() -> Affine<Symbolic> {
    let (o, i) = (lit(0.0), lit(1.0));
    [i, o, o, o, o, o, i, o, o, -i, o, o]
}

/// The inverse of a turn about one of the axes, by its cosine and sine.
fn turn_about(axis: usize, c: Symbolic, s: Symbolic) -> Affine<Symbolic> {
    let (o, i) = (lit(0.0), lit(1.0));
    match axis {
        0 => [i, o, o, o, o, c, s, o, o, -s, c, o],
        1 => [c, o, -s, o, o, i, o, o, s, o, c, o],
        _ => [c, s, o, o, -s, c, o, o, o, o, i, o],
    }
}

/// Sine and cosine, exact for quarter turns.
fn exact_sine_cosine(angle: f64) -> (f64, f64) {
    let quarters = angle / std::f64::consts::FRAC_PI_2;
    if (quarters - quarters.round()).abs() > 1e-12 || quarters.abs() > 1e9 {
        return angle.sin_cos();
    }
    match quarters.round().rem_euclid(4.0) as u8 {
        0 => (0.0, 1.0),
        1 => (1.0, 0.0),
        2 => (0.0, -1.0),
        _ => (-1.0, 0.0),
    }
}
