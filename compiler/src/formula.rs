//! Values of shapes and of numbers at any point, expanded to numbers of the scene: plain, or with their
//! gradients.
//!
//! The expressions are lent to [`Symbolic`] during the expansion, so definitions are copied from them
//! before.

use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::scene::{
    NO_EDGE, NO_SURFACE_DISTANCE, Shape, ShapeId, ShapeKind, children, grid_cells, neighbour,
};
use crate::symbolic::Symbolic;
use crate::uniforms::postorder;
use sdfc_vm::apply::{OpResult, apply_numbers};
use sdfc_vm::dual::Dual;
use sdfc_vm::real::{Real, Vector3, lit};
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Error about noise in a field whose gradient is requested twice.
const SECOND_GRADIENT_ERROR: &str =
    "the slope of noise has no gradient: this was made into a distance before";

/// Number that is expanded.
pub(crate) trait FormulaNumber: Real {
    /// Returns a number that is the same at all points.
    fn from_number(number: Symbolic) -> Self;

    /// Returns the value of an operation.
    fn row(
        op: Op,
        p: Self::Vec3,
        values: &[Self],
        parameters: &[Self],
    ) -> Result<Self, &'static str>;
}

/// An operation stays one operation.
impl FormulaNumber for Symbolic {
    fn from_number(number: Symbolic) -> Self {
        number
    }
    fn row(
        op: Op,
        p: Self::Vec3,
        values: &[Self],
        parameters: &[Self],
    ) -> Result<Self, &'static str> {
        Ok(Self::apply_op(op, p, values, parameters))
    }
}

/// The gradient of an operation is that of its body.
impl FormulaNumber for Dual<Symbolic> {
    fn from_number(number: Symbolic) -> Self {
        Self::fixed(number)
    }
    fn row(
        op: Op,
        p: Self::Vec3,
        values: &[Self],
        parameters: &[Self],
    ) -> Result<Self, &'static str> {
        if op == Op::NoiseSlope {
            return Err(SECOND_GRADIENT_ERROR);
        }
        let mut operands = [lit(0.0); 3];
        operands[..values.len()].copy_from_slice(values);
        match apply_numbers(op, p, operands, parameters) {
            OpResult::Value(value) => Ok(value),
            OpResult::Point(_) => unreachable!("`{}` gives a point", op.row().name),
        }
    }
}

/// Definitions of the numbers that a shape is written with.
#[derive(Default)]
pub(crate) struct Formula {
    /// Steps that compute each number, operands first. Uniform numbers are left out.
    numbers: HashMap<ExprId, Vec<(ExprId, Expression)>>,
}

impl Formula {
    /// Copies the definition of a number.
    pub(crate) fn read(&mut self, expressions: &Expressions, id: ExprId) {
        let order = postorder(expressions, id, |id| {
            expressions.stage(id) <= Stage::Uniform
        });
        let steps = order
            .into_iter()
            .map(|id| (id, expressions.get(id).clone()));
        self.numbers.entry(id).or_insert_with(|| steps.collect());
    }

    /// Copies the definitions of all written numbers of a shape.
    pub(crate) fn read_shape(&mut self, expressions: &Expressions, shapes: &[Shape], id: ShapeId) {
        let kind = &shapes[id.0 as usize].kind;
        for &number in numbers(kind) {
            self.read(expressions, number);
        }
        for &child in children(kind) {
            self.read_shape(expressions, shapes, child);
        }
    }

    /// Returns the steps of a number that was read.
    pub(crate) fn steps_of(&self, id: ExprId) -> &[(ExprId, Expression)] {
        &self.numbers[&id]
    }

    /// Evaluates the steps of a number at a point, as far as `is_required`.
    pub(crate) fn steps<R: FormulaNumber>(
        &self,
        id: ExprId,
        p: R::Vec3,
        is_required: impl Fn(ExprId) -> bool,
    ) -> Result<HashMap<ExprId, R>, &'static str> {
        let mut results: HashMap<ExprId, R> = HashMap::new();
        for (id, step) in self.numbers[&id].iter().filter(|(id, _)| is_required(*id)) {
            let operand = |id: &ExprId| {
                let uniform = || R::from_number(Symbolic(*id));
                results.get(id).copied().unwrap_or_else(uniform)
            };
            let value = match step {
                Expression::Coordinate(axis) => [p.x(), p.y(), p.z()][usize::from(*axis)],
                Expression::Apply {
                    op,
                    point,
                    values,
                    parameters,
                } => {
                    let p = match point {
                        Some([x, y, z]) => R::Vec3::new(operand(x), operand(y), operand(z)),
                        None => p,
                    };
                    let values: Vec<R> = values.iter().map(operand).collect();
                    let parameters: Vec<R> = parameters.iter().map(operand).collect();
                    R::row(*op, p, &values, &parameters)?
                }
                _ => operand(id),
            };
            results.insert(*id, value);
        }
        Ok(results)
    }

    /// Evaluates a number at a point.
    fn number<R: FormulaNumber>(&self, id: ExprId, p: R::Vec3) -> Result<R, &'static str> {
        let steps = self.steps(id, p, |_| true)?;
        let uniform = || R::from_number(Symbolic(id));
        Ok(steps.get(&id).copied().unwrap_or_else(uniform))
    }

    /// Evaluates a shape at a point. Recursion over nested shapes, whose depth the elaborator bounds.
    pub(crate) fn shape<R: FormulaNumber>(
        &self,
        shapes: &[Shape],
        id: ShapeId,
        p: R::Vec3,
    ) -> Result<R, &'static str> {
        Ok(match &shapes[id.0 as usize].kind {
            ShapeKind::Nothing => lit(NO_SURFACE_DISTANCE),
            ShapeKind::Painted { child, .. } => self.shape(shapes, *child, p)?,
            ShapeKind::Primitive { op, parameters } => {
                R::row(*op, p, &[], &uniform_numbers(parameters))?
            }
            ShapeKind::Field { value, .. } => self.number(*value, p)?,
            ShapeKind::Polygon { points } => {
                let next = points.iter().cycle().skip(1);
                points
                    .iter()
                    .zip(next)
                    .try_fold(lit(NO_EDGE), |value, (a, b)| {
                        let corners = uniform_numbers(&[a[0], a[1], b[0], b[1]]);
                        R::row(Op::PolygonEdge, p, &[value], &corners)
                    })?
            }
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } => {
                let parameters = uniform_numbers(parameters);
                let mut value = self.shape(shapes, children[0], p)?;
                for &child in &children[1..] {
                    let next = self.shape(shapes, child, p)?;
                    value = R::row(*op, p, &[value, next], &parameters)?;
                }
                value
            }
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } => {
                let m = uniform_numbers::<R>(matrix);
                let row = |r: usize| {
                    m[4 * r] * p.x() + m[4 * r + 1] * p.y() + m[4 * r + 2] * p.z() + m[4 * r + 3]
                };
                let inner = R::Vec3::new(row(0), row(1), row(2));
                self.shape::<R>(shapes, *child, inner)? * R::from_number(Symbolic(*scale))
            }
            ShapeKind::Repeat {
                op,
                child,
                parameters,
                others,
            } => {
                let cells = grid_cells(others).map(Vec::from).collect();
                self.copies(shapes, neighbour(*op), *child, parameters, p, cells)?
            }
            ShapeKind::Polar {
                op,
                child,
                parameters,
                others,
            } => {
                let sectors = others.cells().map(|sector| vec![sector]).collect();
                self.copies(shapes, neighbour(*op), *child, parameters, p, sectors)?
            }
            ShapeKind::Domain {
                op,
                child,
                parameters,
            } => self.shape(
                shapes,
                *child,
                mapped_point::<R>(*op, p, &uniform_numbers(parameters)),
            )?,
            ShapeKind::Warp { child, point } => {
                let [x, y, z] = point.map(|number| self.number(number, p));
                self.shape(shapes, *child, R::Vec3::new(x?, y?, z?))?
            }
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => {
                let value = self.shape(shapes, *child, p)?;
                R::row(*op, p, &[value], &uniform_numbers(parameters))?
            }
            ShapeKind::Displace { child, amount } => {
                self.shape::<R>(shapes, *child, p)? + self.number::<R>(*amount, p)?
            }
        })
    }

    /// Returns the minimum over the copies in these cells.
    fn copies<R: FormulaNumber>(
        &self,
        shapes: &[Shape],
        neighbour: Op,
        child: ShapeId,
        parameters: &[ExprId],
        p: R::Vec3,
        cells: Vec<Vec<f64>>,
    ) -> Result<R, &'static str> {
        let mut minimum: Option<R> = None;
        for cell in cells {
            let mut parameters = uniform_numbers(parameters);
            parameters.extend(cell.into_iter().map(lit::<R>));
            let copy = self.shape(shapes, child, mapped_point(neighbour, p, &parameters))?;
            minimum = Some(minimum.map_or(copy, |minimum| minimum.min(copy)));
        }
        Ok(minimum.unwrap_or(lit(NO_SURFACE_DISTANCE)))
    }
}

/// Returns the numbers of the point that a shape is written with.
pub(crate) fn numbers(kind: &ShapeKind) -> &[ExprId] {
    match kind {
        ShapeKind::Field { value, .. } => std::slice::from_ref(value),
        ShapeKind::Displace { amount, .. } => std::slice::from_ref(amount),
        ShapeKind::Warp { point, .. } => point,
        _ => &[],
    }
}

/// Returns numbers that are the same at all points.
fn uniform_numbers<R: FormulaNumber>(numbers: &[ExprId]) -> Vec<R> {
    numbers
        .iter()
        .map(|&id| R::from_number(Symbolic(id)))
        .collect()
}

/// Returns the point that an operation maps a point to.
fn mapped_point<R: FormulaNumber>(op: Op, p: R::Vec3, parameters: &[R]) -> R::Vec3 {
    match apply_numbers(op, p, [lit(0.0); 3], parameters) {
        OpResult::Point(point) => point,
        OpResult::Value(_) => unreachable!("`{}` gives a value", op.row().name),
    }
}
