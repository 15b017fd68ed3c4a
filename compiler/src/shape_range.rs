//! All values that a shape may have in a box, by interval arithmetic on the shapes themselves.
//!
//! Values are those that the scene writes. Bounds hold for all values of the uniform numbers that are given
//! as ranges.

use crate::bounds::World;
use crate::boxes::{BoxNumber, UniformValue};
use crate::expression::ExprId;
use crate::scene::{NO_EDGE, NOWHERE, ShapeId, ShapeKind, grid_cells, neighbour};
use sdfc_vm::apply::{Applied, apply, laid_out};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Real;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::HashMap;

/// A point somewhere in a box.
type Place = V3<Interval>;

/// Evaluates the shapes of a scene over boxes.
pub(crate) struct ShapeRange<'s, 'u> {
    world: World<'s>,
    /// The range of a number that depends on no point.
    uniform: &'u mut dyn FnMut(ExprId) -> Interval,
    numbers: HashMap<ExprId, BoxNumber<Interval>>,
    uniforms: HashMap<ExprId, Interval>,
    /// The number of operations that were run.
    pub(crate) operations: usize,
}

impl<'s, 'u> ShapeRange<'s, 'u> {
    pub(crate) fn new(world: World<'s>, uniform: &'u mut dyn FnMut(ExprId) -> Interval) -> Self {
        Self {
            world,
            uniform,
            numbers: HashMap::new(),
            uniforms: HashMap::new(),
            operations: 0,
        }
    }

    /// All values of a shape in a box of its frame.
    pub(crate) fn over(&mut self, id: ShapeId, bounds: &Bounds) -> Interval {
        let [x, y, z] = [0, 1, 2].map(|axis| Interval {
            lo: bounds.min[axis],
            hi: bounds.max[axis],
        });
        self.at(id, V3::of(x, y, z))
    }

    /// Recursion over shapes within shapes, whose depth the elaborator bounds.
    fn at(&mut self, id: ShapeId, p: Place) -> Interval {
        self.operations += 1;
        let world = self.world;
        match &world.shapes[id.0 as usize].kind {
            ShapeKind::Nothing => Interval::point(NOWHERE),
            ShapeKind::Painted { child, .. } => self.at(*child, p),
            ShapeKind::Primitive { op, parameters } => self.apply(*op, p, &[], parameters),
            ShapeKind::Field { value, .. } => self.number(*value, p),
            ShapeKind::Polygon { points } => {
                let mut value = Interval::point(NO_EDGE);
                for (i, a) in points.iter().enumerate() {
                    let b = points[(i + 1) % points.len()];
                    let corners = [a[0], a[1], b[0], b[1]];
                    value = self.apply(Op::PolygonEdge, p, &[value], &corners);
                }
                value
            }
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } => {
                let mut value = self.at(children[0], p);
                for &child in &children[1..] {
                    let next = self.at(child, p);
                    value = self.apply(*op, p, &[value, next], parameters);
                }
                value
            }
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } => {
                let rows = matrix.map(|id| self.uniform(id));
                let row = |r: usize| {
                    rows[4 * r] * p.x
                        + rows[4 * r + 1] * p.y
                        + rows[4 * r + 2] * p.z
                        + rows[4 * r + 3]
                };
                let inner = V3::of(row(0), row(1), row(2));
                let value = self.at(*child, inner);
                value * self.uniform(*scale)
            }
            ShapeKind::Repeat {
                op,
                child,
                parameters,
                others,
            } => {
                let copies = grid_cells(others).map(|cell| {
                    let q = self.copy(neighbour(*op), p, parameters, &cell);
                    self.at(*child, q)
                });
                copies.reduce(Interval::min).unwrap_or(Interval::ALL)
            }
            ShapeKind::Polar {
                op,
                child,
                parameters,
                others,
            } => {
                let copies = others.cells().map(|sector| {
                    let q = self.copy(neighbour(*op), p, parameters, &[sector]);
                    self.at(*child, q)
                });
                copies.reduce(Interval::min).unwrap_or(Interval::ALL)
            }
            ShapeKind::Domain {
                op,
                child,
                parameters,
            } => {
                let q = self.point(*op, p, parameters);
                self.at(*child, q)
            }
            ShapeKind::Warp { child, point } => {
                let [x, y, z] = point.map(|number| self.number(number, p));
                self.at(*child, V3::of(x, y, z))
            }
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => {
                let value = self.at(*child, p);
                self.apply(*op, p, &[value], parameters)
            }
            ShapeKind::Displace { child, amount } => {
                let value = self.at(*child, p);
                value + self.number(*amount, p)
            }
        }
    }

    /// The point as another copy of a repetition sees it.
    fn copy(&mut self, op: Op, p: Place, parameters: &[ExprId], which: &[f64]) -> Place {
        let numbers: Vec<Interval> = parameters.iter().map(|&id| self.uniform(id)).collect();
        let Some(mut numbers) = points(&numbers) else {
            return V3::of(Interval::ALL, Interval::ALL, Interval::ALL);
        };
        numbers.extend(which);
        moved(op, p, &numbers)
    }

    fn point(&mut self, op: Op, p: Place, parameters: &[ExprId]) -> Place {
        let numbers: Vec<Interval> = parameters.iter().map(|&id| self.uniform(id)).collect();
        match points(&numbers) {
            Some(numbers) => moved(op, p, &numbers),
            None => V3::of(Interval::ALL, Interval::ALL, Interval::ALL),
        }
    }

    /// What a row gives; anything where one of its parameters is a range.
    fn apply(&mut self, op: Op, p: Place, values: &[Interval], parameters: &[ExprId]) -> Interval {
        self.operations += 1;
        let numbers: Vec<Interval> = parameters.iter().map(|&id| self.uniform(id)).collect();
        let Some(numbers) = points(&numbers) else {
            return Interval::ALL;
        };
        let mut operands = [Interval::point(0.0); 3];
        operands[..values.len()].copy_from_slice(values);
        match apply(op, p, operands, &laid_out(op, &numbers)) {
            Applied::Value(value) => value,
            Applied::Point(_) => Interval::ALL,
        }
    }

    /// A number that depends on no point.
    fn uniform(&mut self, id: ExprId) -> Interval {
        let uniform = &mut self.uniform;
        *self.uniforms.entry(id).or_insert_with(|| uniform(id))
    }

    /// A number of the point.
    fn number(&mut self, id: ExprId, p: Place) -> Interval {
        let (world, uniform) = (self.world, &mut self.uniform);
        let number = self.numbers.entry(id).or_insert_with(|| {
            BoxNumber::new(world.expressions, id, &mut |id| {
                UniformValue::Known(uniform(id))
            })
        });
        self.operations += number.cost();
        let bounds = Bounds {
            min: [p.x.lo, p.y.lo, p.z.lo],
            max: [p.x.hi, p.y.hi, p.z.hi],
        };
        number.over(&bounds, &[])
    }
}

/// The numbers, if each is one.
fn points(ranges: &[Interval]) -> Option<Vec<f64>> {
    let one = |range: &Interval| (range.lo == range.hi).then_some(range.lo);
    ranges.iter().map(one).collect()
}

/// Where a row moves a point.
fn moved(op: Op, p: Place, numbers: &[f64]) -> Place {
    match apply(op, p, [Interval::point(0.0); 3], &laid_out(op, numbers)) {
        Applied::Point(point) => point,
        Applied::Value(_) => V3::of(Interval::ALL, Interval::ALL, Interval::ALL),
    }
}
