//! Values of shapes with their gradients, written out as numbers of the scene.
//!
//! All of this runs while the graph of numbers is lent to [`Symbolic`]: what is read from the graph is copied
//! before.

use super::super::symbolic::Symbolic;
use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::scene::{NO_EDGE, NOWHERE, Shape, ShapeId, ShapeKind, grid_cells, neighbour};
use crate::uniforms::operands_first;
use sdfc_vm::apply::{Applied, apply_numbers};
use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::real::{Real, Vector3, lit};
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::{HashMap, HashSet};

/// A number with its gradient.
type Sloped = Dual<Symbolic>;
/// A point with the gradients of its coordinates.
type Place = DualVec3<Symbolic>;

/// The factor on value and gradient that keeps the squares of steep gradients far away, as of polynomials, within
/// `f32`.
const SMALL: f64 = 1e-8;
/// The error about noise in a field whose gradient is wanted twice.
const TWICE: &str = "the slope of noise has no gradient: this was made into a distance before";

/// The definitions of the numbers that a shape is made of.
#[derive(Default)]
pub(super) struct Formula {
    /// The steps that compute each number, operands first. Numbers that are the same at all points are left out.
    numbers: HashMap<ExprId, Vec<(ExprId, Expression)>>,
}

/// The point itself.
pub(super) fn here() -> Place {
    let axis = |axis: u8| Symbolic::coordinate(axis);
    Place::seed(V3::of(axis(0), axis(1), axis(2)))
}

/// The largest distances that are meant, outside and inside.
#[derive(Clone, Copy)]
pub(super) struct Limits {
    pub(super) outside: Option<Symbolic>,
    pub(super) inside: Option<Symbolic>,
}

/// A value divided by the length of its gradient, within limits.
pub(super) fn quotient(value: Sloped, limits: Limits) -> Symbolic {
    let small = Symbolic::constant(SMALL);
    let distance = value.value * small / (value.gradient * small).length();
    let distance = match limits.outside {
        Some(most) => distance.min(most),
        None => distance,
    };
    match limits.inside {
        Some(most) => distance.max(-most),
        None => distance,
    }
}

impl Formula {
    /// Copies the definition of a number.
    pub(super) fn read(&mut self, graph: &Expressions, id: ExprId) {
        let order = operands_first(graph, id, |id| graph.stage(id) <= Stage::Uniform);
        let steps = order.into_iter().map(|id| (id, graph.get(id).clone()));
        self.numbers.entry(id).or_insert_with(|| steps.collect());
    }

    /// A number as a distance: what it chooses from is normalized, and then chosen from.
    pub(super) fn normalized(&self, id: ExprId, limits: Limits) -> Result<Symbolic, &'static str> {
        let steps = &self.numbers[&id];
        let mut chosen = HashSet::from([id]);
        let mut needed = HashSet::new();
        for (id, step) in steps.iter().rev() {
            let choices = if chosen.contains(id) {
                choices(step)
            } else {
                &[]
            };
            chosen.extend(choices);
            if choices.is_empty() && chosen.contains(id) {
                needed.insert(*id);
            }
            if needed.contains(id) || !choices.is_empty() {
                let operands = operands(step).filter(|operand| !choices.contains(operand));
                needed.extend(operands);
            }
        }
        let sloped = self.steps(id, here(), |id| needed.contains(&id))?;
        let mut distances: HashMap<ExprId, Symbolic> = HashMap::new();
        for (id, step) in steps.iter().filter(|(id, _)| chosen.contains(id)) {
            let of = |id: &ExprId| {
                let uniform = || quotient(Dual::fixed(Symbolic(*id)), limits);
                distances.get(id).copied().unwrap_or_else(uniform)
            };
            let distance = match step {
                Expression::Apply { op, values, .. } if !choices(step).is_empty() => {
                    let mut operands = [lit::<Symbolic>(0.0); 3];
                    for (slot, value) in operands.iter_mut().zip(values) {
                        *slot = match op {
                            Op::Select if value == &values[0] => Symbolic(*value),
                            _ => of(value),
                        };
                    }
                    match apply_numbers(*op, origin(), operands, &[]) {
                        Applied::Value(value) => value,
                        Applied::Point(_) => unreachable!("a choice gives a value"),
                    }
                }
                _ => quotient(sloped[id], limits),
            };
            distances.insert(*id, distance);
        }
        Ok(distances
            .get(&id)
            .copied()
            .unwrap_or_else(|| quotient(Dual::fixed(Symbolic(id)), limits)))
    }

    /// The steps of a number at a place, with their gradients, as far as they are wanted.
    fn steps(
        &self,
        id: ExprId,
        p: Place,
        wanted: impl Fn(ExprId) -> bool,
    ) -> Result<HashMap<ExprId, Sloped>, &'static str> {
        let mut done: HashMap<ExprId, Sloped> = HashMap::new();
        for (id, step) in self.numbers[&id].iter().filter(|(id, _)| wanted(*id)) {
            let of = |id: &ExprId| {
                let uniform = || Dual::fixed(Symbolic(*id));
                done.get(id).copied().unwrap_or_else(uniform)
            };
            let value = match step {
                Expression::Coordinate(axis) => [p.x(), p.y(), p.z()][usize::from(*axis)],
                Expression::Apply {
                    op: Op::NoiseSlope, ..
                } => return Err(TWICE),
                Expression::Apply {
                    op,
                    point,
                    values,
                    parameters,
                } => {
                    let p = match point {
                        Some([x, y, z]) => Place::new(of(x), of(y), of(z)),
                        None => p,
                    };
                    let mut operands = [lit::<Sloped>(0.0); 3];
                    for (slot, value) in operands.iter_mut().zip(values) {
                        *slot = of(value);
                    }
                    let parameters: Vec<Sloped> = parameters.iter().map(of).collect();
                    value_of(*op, p, operands, &parameters)
                }
                _ => of(id),
            };
            done.insert(*id, value);
        }
        Ok(done)
    }

    /// A number at a place.
    fn number(&self, id: ExprId, p: Place) -> Result<Sloped, &'static str> {
        let steps = self.steps(id, p, |_| true)?;
        let uniform = || Dual::fixed(Symbolic(id));
        Ok(steps.get(&id).copied().unwrap_or_else(uniform))
    }

    /// The value of a shape at a place. Recursion over shapes within shapes, whose depth the elaborator bounds.
    pub(super) fn shape(
        &self,
        shapes: &[Shape],
        id: ShapeId,
        p: Place,
    ) -> Result<Sloped, &'static str> {
        let none = [lit::<Sloped>(0.0); 3];
        Ok(match &shapes[id.0 as usize].kind {
            ShapeKind::Nothing => lit(NOWHERE),
            ShapeKind::Painted { child, .. } => self.shape(shapes, *child, p)?,
            ShapeKind::Primitive { op, parameters } => value_of(*op, p, none, &fixed(parameters)),
            ShapeKind::Field { value, .. } => self.number(*value, p)?,
            ShapeKind::Polygon { points } => {
                let next = points.iter().cycle().skip(1);
                points.iter().zip(next).fold(lit(NO_EDGE), |value, (a, b)| {
                    let corners = fixed(&[a[0], a[1], b[0], b[1]]);
                    value_of(Op::PolygonEdge, p, [value, none[1], none[2]], &corners)
                })
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
                    value = value_of(*op, p, [value, next, none[2]], &parameters);
                }
                value
            }
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } => {
                let m = fixed(matrix);
                let row = |r: usize| {
                    m[4 * r] * p.x() + m[4 * r + 1] * p.y() + m[4 * r + 2] * p.z() + m[4 * r + 3]
                };
                let inner = Place::new(row(0), row(1), row(2));
                self.shape(shapes, *child, inner)? * Dual::fixed(Symbolic(*scale))
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
            } => self.shape(shapes, *child, place_of(*op, p, &fixed(parameters)))?,
            ShapeKind::Warp { child, point } => {
                let [x, y, z] = point.map(|number| self.number(number, p));
                self.shape(shapes, *child, Place::new(x?, y?, z?))?
            }
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => {
                let value = self.shape(shapes, *child, p)?;
                value_of(*op, p, [value, none[1], none[2]], &fixed(parameters))
            }
            ShapeKind::Displace { child, amount } => {
                self.shape(shapes, *child, p)? + self.number(*amount, p)?
            }
        })
    }

    /// The least value of the copies in these cells.
    fn copies(
        &self,
        shapes: &[Shape],
        neighbour: Op,
        child: ShapeId,
        parameters: &[ExprId],
        p: Place,
        cells: Vec<Vec<f64>>,
    ) -> Result<Sloped, &'static str> {
        let mut least: Option<Sloped> = None;
        for cell in cells {
            let mut parameters = fixed(parameters);
            parameters.extend(cell.into_iter().map(lit::<Sloped>));
            let copy = self.shape(shapes, child, place_of(neighbour, p, &parameters))?;
            least = Some(least.map_or(copy, |least| least.min(copy)));
        }
        Ok(least.unwrap_or(lit(NOWHERE)))
    }
}

/// The operands that a number is one of, in magnitude.
fn choices(step: &Expression) -> &[ExprId] {
    match step {
        Expression::Apply { op, values, .. } => match op {
            Op::Min | Op::Max | Op::Neg | Op::Abs => values,
            Op::Select => &values[1..],
            _ => &[],
        },
        _ => &[],
    }
}

/// All that a number is computed from.
fn operands(step: &Expression) -> impl Iterator<Item = ExprId> {
    let (point, values) = match step {
        Expression::Apply { point, values, .. } => (point.as_ref(), &values[..]),
        _ => (None, &[][..]),
    };
    point.into_iter().flatten().chain(values).copied()
}

/// Numbers that are the same at all points.
fn fixed(numbers: &[ExprId]) -> Vec<Sloped> {
    numbers
        .iter()
        .map(|&id| Dual::fixed(Symbolic(id)))
        .collect()
}

/// The point at which rows that read none are run.
fn origin() -> V3<Symbolic> {
    V3::splat(lit(0.0))
}

/// The value that a row gives.
fn value_of(op: Op, p: Place, values: [Sloped; 3], parameters: &[Sloped]) -> Sloped {
    match apply_numbers(op, p, values, parameters) {
        Applied::Value(value) => value,
        Applied::Point(_) => unreachable!("`{}` gives a point", op.row().name),
    }
}

/// The point that a row of points gives.
fn place_of(op: Op, p: Place, parameters: &[Sloped]) -> Place {
    match apply_numbers(op, p, [lit(0.0); 3], parameters) {
        Applied::Point(point) => point,
        Applied::Value(_) => unreachable!("`{}` gives a value", op.row().name),
    }
}
