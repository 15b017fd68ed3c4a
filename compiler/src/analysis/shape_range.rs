//! Range of a shape's values in a box, by interval arithmetic on the shapes themselves.
//!
//! Values are those of the scene as written. Bounds hold for all values of the uniform numbers that are
//! supplied as ranges.

use crate::analysis::box_eval::{BoxNumber, UniformInput};
use crate::expression::ExprId;
use crate::scene::{
    NO_EDGE, NO_SURFACE_DISTANCE, SceneRef, ShapeId, ShapeKind, grid_cells, neighbour,
};
use sdfc_vm::apply::{OpResult, apply, pack_parameters};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::real::Real;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::HashMap;

/// Point somewhere in a box.
type IntervalPoint = V3<Interval>;

/// Evaluates the shapes of a scene over boxes.
pub(crate) struct ShapeRange<'s, 'u> {
    scene: SceneRef<'s>,
    /// Returns the range of a uniform number.
    uniform: &'u mut dyn FnMut(ExprId) -> Interval,
    numbers: HashMap<ExprId, BoxNumber<Interval>>,
    uniforms: HashMap<ExprId, Interval>,
    /// Number of operations that were run.
    pub(crate) operations: usize,
}

impl<'s, 'u> ShapeRange<'s, 'u> {
    pub(crate) fn new(scene: SceneRef<'s>, uniform: &'u mut dyn FnMut(ExprId) -> Interval) -> Self {
        Self {
            scene,
            uniform,
            numbers: HashMap::new(),
            uniforms: HashMap::new(),
            operations: 0,
        }
    }

    /// Returns the range of a shape in a box of its frame.
    pub(crate) fn range_in_box(&mut self, id: ShapeId, bounds: &Bounds) -> Interval {
        let [x, y, z] = [0, 1, 2].map(|axis| Interval {
            lo: bounds.min[axis],
            hi: bounds.max[axis],
        });
        self.range_at(id, V3::new(x, y, z))
    }

    /// Bounds a shape's values over a box of points. It recurses over nested shapes, whose depth the elaborator
    /// bounds.
    fn range_at(&mut self, id: ShapeId, p: IntervalPoint) -> Interval {
        self.operations += 1;
        let scene = self.scene;
        match &scene.shapes[id.0 as usize].kind {
            ShapeKind::Nothing => Interval::point(NO_SURFACE_DISTANCE),
            ShapeKind::Painted { child, .. } => self.range_at(*child, p),
            ShapeKind::Primitive { op, parameters } => self.apply(*op, p, &[], parameters),
            ShapeKind::Field { value, .. } => self.number(*value, p),
            ShapeKind::Polygon { points } => {
                let mut value = Interval::point(NO_EDGE);
                for (i, a) in points.iter().enumerate() {
                    let b = points[(i + 1) % points.len()];
                    let corners = [a[0], a[1], b[0], b[1]];
                    value = self.apply(Op::PolygonEdge, p, &[value], &corners);
                }
                let distance = self.distance_to_box_of(points, p);
                if distance > 0.0 {
                    // Over unbounded boxes the edges alone bound nothing.
                    value.lo = value.lo.max(distance);
                }
                value
            }
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } => {
                let mut value = self.range_at(children[0], p);
                for &child in &children[1..] {
                    let next = self.range_at(child, p);
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
                let inner = V3::new(row(0), row(1), row(2));
                let value = self.range_at(*child, inner);
                value * self.uniform(*scale)
            }
            ShapeKind::Repeat {
                op,
                child,
                parameters,
                others,
            } => {
                let copies = grid_cells(others).map(|cell| {
                    let q = self.copy_point(neighbour(*op), p, parameters, &cell);
                    self.range_at(*child, q)
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
                    let q = self.copy_point(neighbour(*op), p, parameters, &[sector]);
                    self.range_at(*child, q)
                });
                copies.reduce(Interval::min).unwrap_or(Interval::ALL)
            }
            ShapeKind::Domain {
                op,
                child,
                parameters,
            } => {
                let q = self.mapped_point(*op, p, parameters);
                self.range_at(*child, q)
            }
            ShapeKind::Warp { child, point } => {
                let [x, y, z] = point.map(|number| self.number(number, p));
                self.range_at(*child, V3::new(x, y, z))
            }
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => {
                let value = self.range_at(*child, p);
                self.apply(*op, p, &[value], parameters)
            }
            ShapeKind::Displace { child, amount } => {
                let value = self.range_at(*child, p);
                value + self.number(*amount, p)
            }
        }
    }

    /// Returns the least distance of a box from the bounding box of polygon corners.
    fn distance_to_box_of(&mut self, points: &[[ExprId; 2]], p: IntervalPoint) -> f64 {
        let mut gap = |axis: usize, coordinate: Interval| {
            let corners = points.iter().map(|point| self.uniform(point[axis]));
            let side = corners
                .reduce(|a, b| Interval {
                    lo: a.lo.min(b.lo),
                    hi: a.hi.max(b.hi),
                })
                .unwrap_or(Interval::ALL);
            (side.lo - coordinate.hi)
                .max(coordinate.lo - side.hi)
                .max(0.0)
        };
        gap(0, p.x).hypot(gap(1, p.y)) * (1.0 - 4.0 * f64::EPSILON)
    }

    /// Returns the point in the frame of another copy of a repetition.
    fn copy_point(
        &mut self,
        op: Op,
        p: IntervalPoint,
        parameters: &[ExprId],
        cell: &[f64],
    ) -> IntervalPoint {
        let numbers: Vec<Interval> = parameters.iter().map(|&id| self.uniform(id)).collect();
        let Some(mut numbers) = constants(&numbers) else {
            return V3::new(Interval::ALL, Interval::ALL, Interval::ALL);
        };
        numbers.extend(cell);
        map_point(op, p, &numbers)
    }

    fn mapped_point(&mut self, op: Op, p: IntervalPoint, parameters: &[ExprId]) -> IntervalPoint {
        let numbers: Vec<Interval> = parameters.iter().map(|&id| self.uniform(id)).collect();
        match constants(&numbers) {
            Some(numbers) => map_point(op, p, &numbers),
            None => V3::new(Interval::ALL, Interval::ALL, Interval::ALL),
        }
    }

    /// Returns the result of an operation; unbounded where one of its parameters is a range.
    fn apply(
        &mut self,
        op: Op,
        p: IntervalPoint,
        values: &[Interval],
        parameters: &[ExprId],
    ) -> Interval {
        self.operations += 1;
        let numbers: Vec<Interval> = parameters.iter().map(|&id| self.uniform(id)).collect();
        let Some(numbers) = constants(&numbers) else {
            return Interval::ALL;
        };
        let mut operands = [Interval::point(0.0); 3];
        operands[..values.len()].copy_from_slice(values);
        match apply(op, p, operands, &pack_parameters(op, &numbers)) {
            OpResult::Value(value) => value,
            OpResult::Point(_) => Interval::ALL,
        }
    }

    /// Returns the range of a number that depends on no point.
    fn uniform(&mut self, id: ExprId) -> Interval {
        if let Some(constant) = self.scene.expressions.as_constant(id) {
            return Interval::point(constant);
        }
        let uniform = &mut self.uniform;
        *self.uniforms.entry(id).or_insert_with(|| uniform(id))
    }

    /// Returns the range of a number of the point.
    fn number(&mut self, id: ExprId, p: IntervalPoint) -> Interval {
        let (scene, uniform) = (self.scene, &mut self.uniform);
        let number = self.numbers.entry(id).or_insert_with(|| {
            BoxNumber::new(scene.expressions, id, &mut |id| {
                UniformInput::Known(uniform(id))
            })
        });
        self.operations += number.cost();
        let bounds = Bounds {
            min: [p.x.lo, p.y.lo, p.z.lo],
            max: [p.x.hi, p.y.hi, p.z.hi],
        };
        number.eval(&bounds, &[])
    }
}

/// Returns the numbers, if each range is a single number.
fn constants(ranges: &[Interval]) -> Option<Vec<f64>> {
    let constant = |range: &Interval| (range.lo == range.hi).then_some(range.lo);
    ranges.iter().map(constant).collect()
}

/// Returns the point that an operation maps a point to.
fn map_point(op: Op, p: IntervalPoint, numbers: &[f64]) -> IntervalPoint {
    match apply(
        op,
        p,
        [Interval::point(0.0); 3],
        &pack_parameters(op, numbers),
    ) {
        OpResult::Point(point) => point,
        OpResult::Value(_) => V3::new(Interval::ALL, Interval::ALL, Interval::ALL),
    }
}
