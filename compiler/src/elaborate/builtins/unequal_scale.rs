//! Unequal scales along axes of shapes whose scaled form is a shape of the language: a stretched box is a box.
//!
//! Values of such a form are distances. A frame with unequal factors multiplies values by the least of them. Beside a
//! long side, the result is far less than the distance, and it hides nearer surfaces from light.

use crate::elaborate::Elaborator;
use crate::expression::{ExprId, Stage};
use crate::scene::{MaterialId, Shape, ShapeId, ShapeKind};
use crate::symbolic::{Symbolic, simplified, with_expressions};
use glam::DVec3;
use sdfc_lang::Span;
use sdfc_vm::real::{Real, lit};
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Maximum cosine of the angle between two rows of a rotation.
const MAX_ROTATION_ERROR: f64 = 1e-12;

impl<'a> Elaborator<'a> {
    /// Returns a shape scaled along the axes, whose values are distances as far as those of the shape are. `None` if there
    /// is no such form.
    pub(super) fn with_unequal_scale(
        &mut self,
        shape: ShapeId,
        factors: [ExprId; 3],
    ) -> Option<ShapeId> {
        let mut scaler = UnequalScaler {
            elaborator: self,
            results: HashMap::new(),
        };
        let lengths = scaler.lengths(factors);
        let is_2d = scaler.elaborator.shapes[shape.0 as usize].is_2d;
        match are_equal(lengths, is_2d) {
            true => None,
            false => scaler.scaled(shape, factors),
        }
    }

    /// Reports whether no number of a material depends on the point.
    fn is_uniform_material(&self, material: MaterialId) -> bool {
        let material = &self.materials[material.0 as usize];
        let numbers = material.channel_numbers();
        let channels = numbers.iter().chain(&material.bump);
        channels
            .into_iter()
            .all(|&id| self.expressions.stage(id) <= Stage::Uniform)
    }
}

struct UnequalScaler<'e, 'a> {
    elaborator: &'e mut Elaborator<'a>,
    /// Results of `scaled`, by shape and factors.
    results: HashMap<(ShapeId, [ExprId; 3]), Option<ShapeId>>,
}

impl UnequalScaler<'_, '_> {
    /// Scales a shape. It recurses over nested shapes, whose depth the elaborator bounds.
    fn scaled(&mut self, id: ShapeId, factors: [ExprId; 3]) -> Option<ShapeId> {
        if let Some(&result) = self.results.get(&(id, factors)) {
            return result;
        }
        let shape = self.elaborator.shapes[id.0 as usize].clone();
        let lengths = self.lengths(factors);
        let result = match are_equal(lengths, shape.is_2d) {
            true => Some(self.elaborator.scaled_along_axes(id, factors, shape.span)),
            false => self
                .kind(id, &shape, factors, lengths)
                .map(|kind| match kind {
                    ScaledKind::Shape(id) => id,
                    ScaledKind::Kind(kind) => self.elaborator.add(kind, shape.is_2d, shape.span),
                }),
        };
        self.results.insert((id, factors), result);
        result
    }

    /// Scales the definition of a shape. `lengths` are the magnitudes of the factors.
    fn kind(
        &mut self,
        id: ShapeId,
        shape: &Shape,
        factors: [ExprId; 3],
        lengths: [ExprId; 3],
    ) -> Option<ScaledKind> {
        let (mut kind, span) = (shape.kind.clone(), shape.span);
        match &mut kind {
            ShapeKind::Primitive {
                op: Op::Circle,
                parameters,
            } => return Some(ScaledKind::Kind(self.ellipse(parameters[0], lengths, span))),
            ShapeKind::Primitive {
                op: Op::Cylinder,
                parameters,
            } if lengths[0] != lengths[2] => {
                return Some(self.elliptic_cylinder(parameters, lengths, span));
            }
            ShapeKind::Primitive {
                op: Op::Cone | Op::Pyramid | Op::Prism,
                ..
            } if let Some(signs) = self.negative_signs(factors) => {
                let scaled = self.scaled(id, lengths)?;
                return Some(ScaledKind::Shape(
                    self.elaborator.scaled_along_axes(scaled, signs, span),
                ));
            }
            ShapeKind::Primitive { op, parameters } => {
                (*op, *parameters) = self.primitive(*op, parameters, factors, lengths)?;
            }
            ShapeKind::Polygon { points } => {
                for (coordinate, factor) in
                    points.iter_mut().flat_map(|it| it.iter_mut().zip(factors))
                {
                    *coordinate = self.call(Op::Mul, &[*coordinate, factor]);
                }
            }
            ShapeKind::Painted { child, material } => {
                if !self.elaborator.is_uniform_material(*material) {
                    return None;
                }
                *child = self.scaled(*child, factors)?;
            }
            ShapeKind::Combine { op, children, .. } if op.row().facts.uses_only_signs => {
                for child in children {
                    *child = self.scaled(*child, factors)?;
                }
            }
            ShapeKind::Distance {
                op: Op::Complement,
                child,
                ..
            } => *child = self.scaled(*child, factors)?,
            ShapeKind::Distance {
                op: Op::Extrude,
                child,
                parameters,
            } => {
                *child = self.scaled(*child, factors)?;
                parameters[0] = self.call(Op::Mul, &[parameters[0], lengths[2]]);
            }
            ShapeKind::Domain {
                op: Op::Mirror,
                child,
                ..
            } => *child = self.scaled(*child, lengths)?,
            ShapeKind::Domain {
                op: Op::Revolve,
                child,
                parameters,
            } if lengths[0] == lengths[2] => {
                *child = self.scaled(*child, [lengths[0], factors[1], lengths[0]])?;
                parameters[0] = self.call(Op::Mul, &[parameters[0], lengths[0]]);
            }
            ShapeKind::Frame { child, matrix, .. } => {
                return self.frame(*child, *matrix, factors);
            }
            _ => return None,
        }
        Some(ScaledKind::Kind(kind))
    }

    /// Returns a circle scaled along the axes: the middle section of an ellipsoid, whose third radius is the larger one.
    /// The nearest point of that ellipsoid lies in the plane of the section.
    fn ellipse(&mut self, radius: ExprId, lengths: [ExprId; 3], span: Span) -> ShapeKind {
        let [a, b, _] = lengths.map(|length| self.call(Op::Mul, &[radius, length]));
        let largest = self.call(Op::Max, &[a, b]);
        let op = Op::Ellipsoid;
        let parameters = self.elaborator.prepare_parameters(op, &[a, b, largest]);
        let ellipsoid = ShapeKind::Primitive { op, parameters };
        ShapeKind::Domain {
            op: Op::Slice,
            child: self.elaborator.add(ellipsoid, false, span),
            parameters: Vec::new(),
        }
    }

    /// Returns a cylinder scaled across its axis by unequal factors: an extruded ellipse.
    fn elliptic_cylinder(
        &mut self,
        parameters: &[ExprId],
        [x, y, z]: [ExprId; 3],
        span: Span,
    ) -> ScaledKind {
        let ellipse = self.ellipse(parameters[0], [x, z, y], span);
        let extruded = ShapeKind::Distance {
            op: Op::Extrude,
            child: self.elaborator.add(ellipse, true, span),
            parameters: vec![self.call(Op::Mul, &[parameters[1], y])],
        };
        let extruded = self.elaborator.add(extruded, false, span);
        // Exchanges y, the axis of cylinders, and z, that of extrusions.
        let matrix = || {
            let (o, i) = (lit::<Symbolic>(0.0), lit::<Symbolic>(1.0));
            ([i, o, o, o, o, o, i, o, o, i, o, o], lit(1.0))
        };
        ScaledKind::Shape(self.elaborator.add_frame(extruded, span, matrix))
    }

    /// Scales a shape in a frame that maps axes to axes, or turns it in a plane whose factors are equal. The frame is moved
    /// above the scale.
    fn frame(
        &mut self,
        child: ShapeId,
        matrix: [ExprId; 12],
        factors: [ExprId; 3],
    ) -> Option<ScaledKind> {
        let mut rows = [DVec3::ZERO; 3];
        let (mut inner, mut outer) = (factors, matrix);
        for (row, numbers) in rows.iter_mut().enumerate() {
            let mut factor = None;
            for column in 0..3 {
                let number = self.constant(matrix[4 * row + column])?;
                numbers[column] = number;
                if number != 0.0 && *factor.get_or_insert(factors[column]) != factors[column] {
                    return None;
                }
            }
            let magnitude = numbers.length();
            let divisor = self.elaborator.expressions.constant(magnitude);
            inner[row] = self.call(Op::Div, &[factor?, divisor]);
            *numbers /= magnitude;
            for column in 0..3 {
                outer[4 * row + column] = self.elaborator.expressions.constant(numbers[column]);
            }
            outer[4 * row + 3] = self.call(Op::Mul, &[matrix[4 * row + 3], inner[row]]);
        }
        let [x, y, z] = rows;
        let are_orthogonal = |a: DVec3, b: DVec3| a.dot(b).abs() < MAX_ROTATION_ERROR;
        if !(are_orthogonal(x, y) && are_orthogonal(y, z) && are_orthogonal(z, x)) {
            return None;
        }
        let span = self.elaborator.shapes[child.0 as usize].span;
        let child = self.scaled(child, inner)?;
        let placed = self
            .elaborator
            .add_frame(child, span, || (outer.map(Symbolic), lit(1.0)));
        Some(ScaledKind::Shape(placed))
    }

    /// Returns the signs of factors of which one is known to be negative.
    fn negative_signs(&mut self, factors: [ExprId; 3]) -> Option<[ExprId; 3]> {
        let signs = factors.map(|factor| self.constant(factor).map_or(1.0, f64::signum));
        let has_negative = signs.iter().any(|sign| *sign < 0.0);
        has_negative.then(|| signs.map(|sign| self.elaborator.expressions.constant(sign)))
    }

    /// Returns the row and the parameters of a scaled row.
    fn primitive(
        &mut self,
        op: Op,
        parameters: &[ExprId],
        factors: [ExprId; 3],
        lengths: [ExprId; 3],
    ) -> Option<(Op, Vec<ExprId>)> {
        let is_round = lengths[0] == lengths[2];
        let signs = factors.map(|factor| self.constant(factor).map(f64::signum));
        let numbers: Vec<Symbolic> = parameters.iter().copied().map(Symbolic).collect();
        let factors = factors.map(Symbolic);
        let [x, y, z] = lengths.map(Symbolic);
        let full = |half: Symbolic, factor: Symbolic| half * lit(2.0) * factor;
        let scaled = with_expressions(&mut self.elaborator.expressions, || {
            let (op, arguments) = match (op, numbers.as_slice()) {
                (Op::Sphere, &[r]) => (Op::Ellipsoid, vec![r * x, r * y, r * z]),
                (Op::Ellipsoid, &[a, b, c]) => (op, vec![a * x, b * y, c * z]),
                (Op::Cuboid, &[a, b, c]) => (op, vec![full(a, x), full(b, y), full(c, z)]),
                (Op::Rect, &[a, b]) => (op, vec![full(a, x), full(b, y)]),
                (Op::Cylinder, &[r, half]) if is_round => (op, vec![r * x, full(half, y)]),
                (Op::Cone, &[bottom, top, half, ..]) if is_round && signs[1]? > 0.0 => {
                    (op, vec![bottom * x, top * x, full(half, y)])
                }
                (Op::Pyramid, &[base, half, ..]) if is_round && signs[1]? > 0.0 => {
                    (op, vec![full(base, x), full(half, y)])
                }
                (Op::Prism, &[_, inverse, apothem, side, half]) if is_round && signs[0]? > 0.0 => {
                    let count = inverse * lit(std::f64::consts::TAU);
                    let radius = (apothem * apothem + side * side).sqrt();
                    (op, vec![count, radius * x, full(half, y)])
                }
                (Op::Plane | Op::Slab, &[a, b, c, distance]) => {
                    let normal = [a / factors[0], b / factors[1], c / factors[2]];
                    let [a, b, c] = normal;
                    let length = (a * a + b * b + c * c).sqrt();
                    let distance = match op {
                        Op::Plane => distance / length,
                        _ => distance * lit(2.0) / length,
                    };
                    (op, vec![a / length, b / length, c / length, distance])
                }
                _ => return None,
            };
            Some((op, arguments.into_iter().map(|number| number.0).collect()))
        });
        let (op, arguments): (Op, Vec<ExprId>) = scaled?;
        Some((op, self.elaborator.prepare_parameters(op, &arguments)))
    }

    /// Returns the magnitudes of factors.
    fn lengths(&mut self, factors: [ExprId; 3]) -> [ExprId; 3] {
        factors.map(|factor| self.call(Op::Abs, &[factor]))
    }

    fn constant(&self, id: ExprId) -> Option<f64> {
        self.elaborator.expressions.as_constant(id)
    }

    fn call(&mut self, op: Op, operands: &[ExprId]) -> ExprId {
        simplified(&mut self.elaborator.expressions, op, operands)
    }
}

/// Reports whether a scale by factors of these magnitudes changes all lengths of a shape by the same factor.
fn are_equal([x, y, z]: [ExprId; 3], is_2d: bool) -> bool {
    x == y && (is_2d || y == z)
}

/// Scaled shape: one that exists, or the definition of a new one.
enum ScaledKind {
    Shape(ShapeId),
    Kind(ShapeKind),
}
