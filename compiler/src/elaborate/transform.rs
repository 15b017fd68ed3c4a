//! Moving, turning, copying and bending shapes.
//!
//! Scenes whose z axis points up are written in z-up coordinates throughout. The table's bodies
//! stand along y; where an axis of their own matters, the shape gets a frame that turns it upright.

use super::Elaborator;
use super::bound::Bound;
use super::evaluate::Outcome;
use super::numbers::{Form, parts};
use super::value::{Number, Quantity, Value};
use crate::expression::{ExprId, Stage};
use crate::lower::channel_numbers;
use crate::scene::{MaterialId, ShapeId, ShapeKind};
use crate::symbolic::{Symbolic, simplified, with_graph};
use sdfc_lang::{Diagnostic, Span, codes};
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
    pub(crate) fn lying(&mut self, child: ShapeId, span: Span) -> ShapeId {
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
        if !is_even && let Some(id) = self.scaled_ball(bound.shape(0), ids, bound.span) {
            return Ok(Value::Shape(id));
        }
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

    /// A ball or an ellipsoid stretched along the axes: an ellipsoid, whose value stays a distance. A colour that
    /// is the same everywhere stays on it.
    fn scaled_ball(&mut self, child: ShapeId, by: [ExprId; 3], span: Span) -> Option<ShapeId> {
        let kind = self.shapes[child.0 as usize].kind.clone();
        let radii = match &kind {
            ShapeKind::Painted { child, material } => {
                let (child, material) = (*child, *material);
                if !self.is_the_same_everywhere(material) {
                    return None;
                }
                let child = self.scaled_ball(child, by, span)?;
                return Some(self.add(ShapeKind::Painted { child, material }, false, span));
            }
            ShapeKind::Primitive { op, parameters } => match (op, &parameters[..]) {
                (Op::Sphere, [r]) => [*r; 3],
                (Op::Ellipsoid, [x, y, z]) => [*x, *y, *z],
                _ => return None,
            },
            _ => return None,
        };
        let radii: [ExprId; 3] = std::array::from_fn(|axis| {
            let by = simplified(&mut self.graph, Op::Abs, &[by[axis]]);
            simplified(&mut self.graph, Op::Mul, &[radii[axis], by])
        });
        let op = Op::Ellipsoid;
        let parameters = self.prepared(op, &radii);
        Some(self.add(ShapeKind::Primitive { op, parameters }, false, span))
    }

    /// Tells if no number of a material depends on the point.
    fn is_the_same_everywhere(&self, material: MaterialId) -> bool {
        let material = &self.materials[material.0 as usize];
        let numbers = channel_numbers(material);
        let all = numbers.iter().chain(&material.bump);
        all.into_iter()
            .all(|&id| self.graph.stage(id) <= Stage::Uniform)
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
