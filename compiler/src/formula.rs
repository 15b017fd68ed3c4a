//! Values of shapes and of numbers at any place, written out as numbers of the scene: plain, or with their gradients.
//!
//! All of this runs while the graph of numbers is lent to [`Symbolic`]: what is read from the graph is copied
//! before.

use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::scene::{NO_EDGE, NOWHERE, Shape, ShapeId, ShapeKind, children, grid_cells, neighbour};
use crate::symbolic::Symbolic;
use crate::uniforms::operands_first;
use sdfc_vm::apply::{Applied, apply_numbers};
use sdfc_vm::dual::Dual;
use sdfc_vm::real::{Real, Vector3, lit};
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// The error about noise in a field whose gradient is wanted twice.
const TWICE: &str = "the slope of noise has no gradient: this was made into a distance before";

/// A number that is written out.
pub(crate) trait Written: Real {
    /// A number that is the same at all points.
    fn of(number: Symbolic) -> Self;

    /// The value that a row gives.
    fn row(
        op: Op,
        p: Self::Vec3,
        values: &[Self],
        parameters: &[Self],
    ) -> Result<Self, &'static str>;
}

/// A row stays one operation.
impl Written for Symbolic {
    fn of(number: Symbolic) -> Self {
        number
    }
    fn row(
        op: Op,
        p: Self::Vec3,
        values: &[Self],
        parameters: &[Self],
    ) -> Result<Self, &'static str> {
        Ok(Self::applied(op, p, values, parameters))
    }
}

/// The gradient of a row is that of its body.
impl Written for Dual<Symbolic> {
    fn of(number: Symbolic) -> Self {
        Self::fixed(number)
    }
    fn row(
        op: Op,
        p: Self::Vec3,
        values: &[Self],
        parameters: &[Self],
    ) -> Result<Self, &'static str> {
        if op == Op::NoiseSlope {
            return Err(TWICE);
        }
        let mut operands = [lit(0.0); 3];
        operands[..values.len()].copy_from_slice(values);
        match apply_numbers(op, p, operands, parameters) {
            Applied::Value(value) => Ok(value),
            Applied::Point(_) => unreachable!("`{}` gives a point", op.row().name),
        }
    }
}

/// The definitions of the numbers that a shape is made of.
#[derive(Default)]
pub(crate) struct Formula {
    /// The steps that compute each number, operands first. Numbers that are the same at all points are left out.
    numbers: HashMap<ExprId, Vec<(ExprId, Expression)>>,
}

impl Formula {
    /// Copies the definition of a number.
    pub(crate) fn read(&mut self, graph: &Expressions, id: ExprId) {
        let order = operands_first(graph, id, |id| graph.stage(id) <= Stage::Uniform);
        let steps = order.into_iter().map(|id| (id, graph.get(id).clone()));
        self.numbers.entry(id).or_insert_with(|| steps.collect());
    }

    /// Copies the definitions of all written numbers of a shape.
    pub(crate) fn read_shape(&mut self, graph: &Expressions, shapes: &[Shape], id: ShapeId) {
        let kind = &shapes[id.0 as usize].kind;
        for &number in numbers(kind) {
            self.read(graph, number);
        }
        for &child in children(kind) {
            self.read_shape(graph, shapes, child);
        }
    }

    /// The steps of a number that was read.
    pub(crate) fn steps_of(&self, id: ExprId) -> &[(ExprId, Expression)] {
        &self.numbers[&id]
    }

    /// The steps of a number at a place, as far as they are wanted.
    pub(crate) fn steps<R: Written>(
        &self,
        id: ExprId,
        p: R::Vec3,
        wanted: impl Fn(ExprId) -> bool,
    ) -> Result<HashMap<ExprId, R>, &'static str> {
        let mut done: HashMap<ExprId, R> = HashMap::new();
        for (id, step) in self.numbers[&id].iter().filter(|(id, _)| wanted(*id)) {
            let of = |id: &ExprId| {
                let uniform = || R::of(Symbolic(*id));
                done.get(id).copied().unwrap_or_else(uniform)
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
                        Some([x, y, z]) => R::Vec3::new(of(x), of(y), of(z)),
                        None => p,
                    };
                    let values: Vec<R> = values.iter().map(of).collect();
                    let parameters: Vec<R> = parameters.iter().map(of).collect();
                    R::row(*op, p, &values, &parameters)?
                }
                _ => of(id),
            };
            done.insert(*id, value);
        }
        Ok(done)
    }

    /// A number at a place.
    fn number<R: Written>(&self, id: ExprId, p: R::Vec3) -> Result<R, &'static str> {
        let steps = self.steps(id, p, |_| true)?;
        let uniform = || R::of(Symbolic(id));
        Ok(steps.get(&id).copied().unwrap_or_else(uniform))
    }

    /// The value of a shape at a place. Recursion over shapes within shapes, whose depth the elaborator bounds.
    pub(crate) fn shape<R: Written>(
        &self,
        shapes: &[Shape],
        id: ShapeId,
        p: R::Vec3,
    ) -> Result<R, &'static str> {
        Ok(match &shapes[id.0 as usize].kind {
            ShapeKind::Nothing => lit(NOWHERE),
            ShapeKind::Painted { child, .. } => self.shape(shapes, *child, p)?,
            ShapeKind::Primitive { op, parameters } => R::row(*op, p, &[], &fixed(parameters))?,
            ShapeKind::Field { value, .. } => self.number(*value, p)?,
            ShapeKind::Polygon { points } => {
                let next = points.iter().cycle().skip(1);
                points
                    .iter()
                    .zip(next)
                    .try_fold(lit(NO_EDGE), |value, (a, b)| {
                        let corners = fixed(&[a[0], a[1], b[0], b[1]]);
                        R::row(Op::PolygonEdge, p, &[value], &corners)
                    })?
            }
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } => {
                let parameters = fixed(parameters);
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
                let m = fixed::<R>(matrix);
                let row = |r: usize| {
                    m[4 * r] * p.x() + m[4 * r + 1] * p.y() + m[4 * r + 2] * p.z() + m[4 * r + 3]
                };
                let inner = R::Vec3::new(row(0), row(1), row(2));
                self.shape::<R>(shapes, *child, inner)? * R::of(Symbolic(*scale))
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
            } => self.shape(shapes, *child, place_of::<R>(*op, p, &fixed(parameters)))?,
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
                R::row(*op, p, &[value], &fixed(parameters))?
            }
            ShapeKind::Displace { child, amount } => {
                self.shape::<R>(shapes, *child, p)? + self.number::<R>(*amount, p)?
            }
        })
    }

    /// The least value of the copies in these cells.
    fn copies<R: Written>(
        &self,
        shapes: &[Shape],
        neighbour: Op,
        child: ShapeId,
        parameters: &[ExprId],
        p: R::Vec3,
        cells: Vec<Vec<f64>>,
    ) -> Result<R, &'static str> {
        let mut least: Option<R> = None;
        for cell in cells {
            let mut parameters = fixed(parameters);
            parameters.extend(cell.into_iter().map(lit::<R>));
            let copy = self.shape(shapes, child, place_of(neighbour, p, &parameters))?;
            least = Some(least.map_or(copy, |least| least.min(copy)));
        }
        Ok(least.unwrap_or(lit(NOWHERE)))
    }
}

/// The numbers of the point that a shape of a kind is written with.
pub(crate) fn numbers(kind: &ShapeKind) -> &[ExprId] {
    match kind {
        ShapeKind::Field { value, .. } => std::slice::from_ref(value),
        ShapeKind::Displace { amount, .. } => std::slice::from_ref(amount),
        ShapeKind::Warp { point, .. } => point,
        _ => &[],
    }
}

/// Numbers that are the same at all points.
fn fixed<R: Written>(numbers: &[ExprId]) -> Vec<R> {
    numbers.iter().map(|&id| R::of(Symbolic(id))).collect()
}

/// The point that a row of points gives.
fn place_of<R: Written>(op: Op, p: R::Vec3, parameters: &[R]) -> R::Vec3 {
    match apply_numbers(op, p, [lit(0.0); 3], parameters) {
        Applied::Point(point) => point,
        Applied::Value(_) => unreachable!("`{}` gives a value", op.row().name),
    }
}
