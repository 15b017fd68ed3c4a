//! Translation, rotation, scaling, reflection and shear of shapes.
//!
//! Scenes with z up use z-up coordinates throughout. The bodies of the table have y up; where their
//! axis matters, the shape gets a frame that maps y to the up axis.

use crate::elaborate::Elaborator;
use crate::elaborate::argument_conversion::BoundArgs;
use crate::elaborate::numbers::{Form, components};
use crate::elaborate::value::{EvalResult, Quantity, ScalarValue, Value};
use crate::expression::{ExprId, Stage};
use crate::scene::{ShapeId, ShapeKind};
use crate::symbolic::{Symbolic, with_expressions};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::ops::affine::{self, Affine};
use sdfc_vm::real::{Real, lit};

/// Ratio of the largest to the smallest factor from which on a warning is given. At ten times this, a tenth of a torus is
/// missing.
const MAX_FACTOR_RATIO: f64 = 1e3;

impl<'a> Elaborator<'a> {
    /// Adds a frame to a shape; an empty shape and an identity need none.
    pub(crate) fn add_frame(
        &mut self,
        child: ShapeId,
        span: Span,
        matrix: impl FnOnce() -> (Affine<Symbolic>, Symbolic),
    ) -> ShapeId {
        if self.is_nothing(child) {
            return child;
        }
        let (matrix, scale) = with_expressions(&mut self.expressions, || {
            let (matrix, scale) = matrix();
            (matrix.map(|number| number.0), scale.0)
        });
        let is_identity = self.expressions.as_constant(scale) == Some(1.0)
            && matrix.iter().enumerate().all(|(index, &id)| {
                let expected = if index / 4 == index % 4 { 1.0 } else { 0.0 };
                self.expressions.as_constant(id) == Some(expected)
            });
        if is_identity {
            return child;
        }
        let is_2d = self.shapes[child.0 as usize].is_2d;
        self.add(
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            },
            is_2d,
            span,
        )
    }

    /// Maps a shape along y to the up axis of the scene.
    pub(crate) fn rotated_to_scene_up(&mut self, child: ShapeId, span: Span) -> ShapeId {
        if !self.z_up {
            return child;
        }
        self.add_frame(child, span, || (scene_up_to_y_up(), lit(1.0)))
    }

    /// Maps a shape from the scene's space to one with y up.
    pub(crate) fn rotated_to_y_up(&mut self, child: ShapeId, span: Span) -> ShapeId {
        if !self.z_up {
            return child;
        }
        self.add_frame(child, span, || {
            let (o, i) = (lit(0.0), lit(1.0));
            ([i, o, o, o, o, o, -i, o, o, i, o, o], lit(1.0))
        })
    }

    /// Returns the index of the up axis: 2 in a z-up scene, otherwise 1.
    pub(crate) fn up(&self) -> usize {
        if self.z_up { 2 } else { 1 }
    }

    /// Evaluates `translate(shape, by)`.
    pub(crate) fn translate(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let offset = bound.vector(1).map(Symbolic);
        let id = self.add_frame(bound.shape(0), bound.span, || {
            (affine::translate(offset), lit(1.0))
        });
        Ok(Value::Shape(id))
    }

    /// Evaluates `scale(shape, by)`. Where no other shape has the scaled form, distances are scaled by the smallest
    /// factor, so uneven factors give a bound.
    pub(crate) fn scale(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let (child, factors) = (bound.shape(0), bound.vector(1));
        if let Some(scaled) = self.with_unequal_scale(child, factors) {
            return Ok(Value::Shape(scaled));
        }
        self.warn_of_stretch(child, factors, bound.span_at(1));
        let scaled = self.scaled_along_axes(child, factors, bound.span);
        Ok(Value::Shape(scaled))
    }

    /// Warns of factors of which one is so small beside another that distances times the smallest one are lost in rounding.
    fn warn_of_stretch(&mut self, child: ShapeId, factors: [ExprId; 3], span: Span) {
        let is_2d = self.shapes[child.0 as usize].is_2d;
        let lengths = factors.map(|factor| self.current_value(factor).abs());
        let lengths = &lengths[..if is_2d { 2 } else { 3 }];
        let smallest = lengths.iter().copied().fold(f64::INFINITY, f64::min);
        let largest = lengths.iter().copied().fold(0.0, f64::max);
        if smallest == 0.0 || largest < MAX_FACTOR_RATIO * smallest {
            return;
        }
        let message = "this shape is stretched so far that it may have holes";
        let diagnostic = Diagnostic::warning(codes::W0406, span, message)
            .primary("distances are multiplied by the smallest factor, and are lost to rounding where the shape is thin")
            .help("write the shape at its size: boxes, cylinders, cones, ellipsoids and polygons of any proportions are exact");
        self.report(diagnostic);
    }

    /// Adds a frame that scales a shape along the axes.
    pub(super) fn scaled_along_axes(
        &mut self,
        child: ShapeId,
        factors: [ExprId; 3],
        span: Span,
    ) -> ShapeId {
        let is_even = factors[0] == factors[1];
        let is_2d = self.shapes[child.0 as usize].is_2d;
        let is_even = is_even && (is_2d || factors[1] == factors[2]);
        self.add_frame(child, span, || {
            let [x, y, z] = factors.map(Symbolic);
            let min_factor = if is_even {
                x.abs()
            } else if is_2d {
                x.abs().min(y.abs())
            } else {
                x.abs().min(y.abs()).min(z.abs())
            };
            let (o, one) = (lit::<Symbolic>(0.0), lit::<Symbolic>(1.0));
            let [x, y, z] = [one / x, one / y, one / z];
            ([x, o, o, o, o, y, o, o, o, o, z, o], min_factor)
        })
    }

    /// Evaluates `rotate(shape, angle, axis)` or `rotate(shape, [about x, about y, about z])`.
    pub(crate) fn rotate(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let span = bound.span_at(1);
        let child = bound.shape(0);
        let Some((form, numbers)) = components(bound.value(1)) else {
            return Ok(self.report_wrong(bound.value(1), "`rotate` needs an angle", span));
        };
        for number in &numbers[..form.len()] {
            // A zero in a vector of angles needs no unit.
            let is_zero = self.expressions.as_constant(number.id) == Some(0.0);
            if form != Form::Scalar && is_zero {
                continue;
            }
            if self
                .angle(bound.name, *number, span, bound.name_span)
                .is_none()
            {
                return Ok(Value::Poison);
            }
        }
        let is_2d = self.shapes[child.0 as usize].is_2d;
        let [a, b, c, _] = numbers.map(|number| number.id);
        let rotated = match form {
            Form::Scalar => {
                if is_2d && bound.is_given(2) {
                    let message = "a 2D shape turns in its plane and has no axis";
                    let diagnostic = Diagnostic::error(codes::E0304, bound.span_at(2), message);
                    self.report(diagnostic.help("`extrude` it first"));
                    return Ok(Value::Poison);
                }
                match bound.is_given(2) {
                    true => self.add_rotation(child, a, bound.vector(2), bound.span),
                    false => self.rotated_about_up(child, a, bound.span),
                }
            }
            Form::Vector(3) if !is_2d => {
                let mut rotated = child;
                for (axis_index, angle) in [a, b, c].into_iter().enumerate() {
                    let axis = self.axis(axis_index);
                    rotated = self.add_rotation(rotated, angle, axis, bound.span);
                }
                rotated
            }
            Form::Vector(_) | Form::Color => {
                let message = "`rotate` needs an angle and an axis, or three angles";
                return Ok(self.report_wrong(bound.value(1), message, span));
            }
        };
        Ok(Value::Shape(rotated))
    }

    /// Checks that a number is an angle that does not depend on the point.
    pub(crate) fn angle(
        &mut self,
        name: &str,
        number: ScalarValue,
        span: Span,
        name_span: Span,
    ) -> Option<ExprId> {
        match number.quantity {
            Quantity::Angle => {}
            Quantity::Plain | Quantity::Time => {
                let signature = if name == "rotate" {
                    "angle: angle, axis: vec3; or three angles in `[ ]`"
                } else {
                    ""
                };
                let diagnostic = self.missing_unit(name, span).label(name_span, signature);
                self.report(diagnostic);
                return None;
            }
            Quantity::Length(_) => {
                let got = number.quantity.noun();
                let message = format!("`{name}` needs an angle, and this is {got}");
                self.report(Diagnostic::error(codes::E0303, span, message).label(name_span, ""));
                return None;
            }
        }
        let stage = self.expressions.stage(number.id);
        if stage > Stage::Uniform {
            self.report_too_late("an angle", stage, span);
            return None;
        }
        Some(number.id)
    }

    /// Rotates a shape about the up axis, or a 2-D shape in its plane.
    pub(super) fn rotated_about_up(
        &mut self,
        child: ShapeId,
        angle: ExprId,
        span: Span,
    ) -> ShapeId {
        let is_2d = self.shapes[child.0 as usize].is_2d;
        let axis = self.axis(if is_2d { 2 } else { self.up() });
        self.add_rotation(child, angle, axis, span)
    }

    /// Returns the direction of a coordinate axis.
    fn axis(&mut self, axis_index: usize) -> [ExprId; 3] {
        [0, 1, 2].map(|i| {
            self.expressions
                .constant(if i == axis_index { 1.0 } else { 0.0 })
        })
    }

    /// Rotates a shape about an axis of length 1.
    fn add_rotation(
        &mut self,
        child: ShapeId,
        angle: ExprId,
        axis: [ExprId; 3],
        span: Span,
    ) -> ShapeId {
        let constants = axis.map(|id| self.expressions.as_constant(id));
        let axis_index = (0..3).find(|&i| {
            (0..3).all(|j| {
                constants[j].is_some_and(|v| if i == j { v.abs() == 1.0 } else { v == 0.0 })
            })
        });
        // About a coordinate axis, quarter turns are exact and most factors are zero.
        if let Some(axis_index) = axis_index {
            let negative = constants[axis_index] == Some(-1.0);
            let constant_angle = self.expressions.as_constant(angle);
            return self.add_frame(child, span, || {
                let (c, s) = match constant_angle {
                    Some(angle) => {
                        let (s, c) = exact_sine_cosine(angle);
                        (lit(c), lit(s))
                    }
                    None => (Symbolic(angle).cos(), Symbolic(angle).sin()),
                };
                (
                    inverse_axis_rotation(axis_index, c, if negative { -s } else { s }),
                    lit(1.0),
                )
            });
        }
        let axis = axis.map(Symbolic);
        self.add_frame(child, span, || {
            (affine::rotate(axis, Symbolic(angle)), lit(1.0))
        })
    }

    /// Evaluates `rotate_quaternion(shape, [x, y, z, w])`, which normalizes the quaternion.
    pub(crate) fn rotate_quaternion(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let span = bound.span_at(1);
        let Some((Form::Vector(4), numbers)) = components(bound.value(1)) else {
            return Ok(self.report_wrong(bound.value(1), "a quaternion is four numbers", span));
        };
        let ids = numbers.map(|number| number.id);
        let what = "the quaternion";
        for id in ids {
            let stage = self.expressions.stage(id);
            if stage > Stage::Uniform {
                self.report_too_late(what, stage, span);
                return Ok(Value::Poison);
            }
        }
        let Some(unit) = self.unit_vector(what, &ids, span) else {
            return Ok(Value::Poison);
        };
        let quaternion = [unit[0], unit[1], unit[2], unit[3]].map(Symbolic);
        let id = self.add_frame(bound.shape(0), bound.span, || {
            (affine::rotate_quaternion(quaternion), lit(1.0))
        });
        Ok(Value::Shape(id))
    }

    /// Evaluates `reflect(shape, normal, at)`: the mirror image.
    pub(crate) fn reflect(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let (normal, offset) = (bound.vector(1).map(Symbolic), Symbolic(bound.number(2)));
        let id = self.add_frame(bound.shape(0), bound.span, || {
            (affine::reflect(normal, offset), lit(1.0))
        });
        Ok(Value::Shape(id))
    }

    /// Evaluates `shear(shape, xy, xz, yz)`. Distances are divided by a bound of the matrix's norm.
    pub(crate) fn shear(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let [xy, xz, yz] = [1, 2, 3].map(|index| Symbolic(bound.number(index)));
        let id = self.add_frame(bound.shape(0), bound.span, || {
            let matrix = affine::shear(xy, xz, yz);
            // The inner distance is at most the norm of the matrix times the outer one. The norm is
            // at most the root of the sum of squares.
            let linear = [0, 1, 2, 4, 5, 6, 8, 9, 10].map(|index| matrix[index]);
            let sum = linear
                .iter()
                .fold(lit::<Symbolic>(0.0), |sum, v| sum + v.square());
            (matrix, lit::<Symbolic>(1.0) / sum.sqrt())
        });
        Ok(Value::Shape(id))
    }
}

/// Returns the map from z-up space to the space of a body along y.
fn scene_up_to_y_up() -> Affine<Symbolic> {
    let (o, i) = (lit(0.0), lit(1.0));
    [i, o, o, o, o, o, i, o, o, -i, o, o]
}

/// Returns the inverse of the rotation about a coordinate axis, from its cosine and sine.
fn inverse_axis_rotation(axis: usize, c: Symbolic, s: Symbolic) -> Affine<Symbolic> {
    let (o, i) = (lit(0.0), lit(1.0));
    match axis {
        0 => [i, o, o, o, o, c, s, o, o, -s, c, o],
        1 => [c, o, -s, o, o, i, o, o, s, o, c, o],
        _ => [c, s, o, o, -s, c, o, o, o, o, i, o],
    }
}

/// Returns the sine and cosine of an angle in radians, exact for quarter turns.
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
