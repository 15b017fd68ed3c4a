//! Extent of a written field: a box outside of which interval arithmetic proves the field positive.
//!
//! First each side moves in from infinity, as far as one evaluation over the half-space beyond it
//! proves. The sides that stay infinite are searched within a large cube. Boxes that may hold a value
//! of at most zero are halved. A finite solid then shows as boxes that do not touch the cube's sides. Sides that are infinite
//! even so follow from the operations (`contraction`).

use crate::analysis::box_eval::{AxisDependence, BoxNumber, UniformInput};
use crate::analysis::contraction::contracted_to_negative;
use crate::expression::{ExprId, Expression, Expressions};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// Half side of the cube in which solids are searched, in units.
const SEARCH_HALF_SIDE: f64 = 1e4;
/// Largest distance from the origin to which a side moves without a cube, in units.
const MAX_SIDE: f64 = 1e9;
/// Maximum number of operations for one field.
pub(super) const MAX_OPERATIONS: usize = 600_000;
/// Maximum number of boxes, at one time, that may hold a value of at most zero.
const MAX_BOXES: usize = 1024;
/// Boxes are halved until they are at most this fraction of their hull.
const MIN_BOX_FRACTION: f64 = 1.0 / 48.0;
/// A hull that is smaller than this fraction of the searched box holds a point at most, where a value touches zero.
const MIN_HULL_FRACTION: f64 = 1e-15;
/// A solid that extends beyond this fraction of the cube counts as infinite.
const MAX_FINITE_FRACTION: f64 = 0.25;

/// Returns a box outside of which a number of the point is positive, for all `uniform` numbers within
/// their ranges. Sides beyond the searched cube are infinite.
pub(crate) fn extent(
    expressions: &Expressions,
    id: ExprId,
    uniform: &mut dyn FnMut(ExprId) -> Interval,
) -> Bounds {
    // The number of evaluations follows from the operations, and the box from both.
    let id = without_constant_factor(expressions, id);
    let mut number =
        BoxNumber::<Interval>::new(expressions, id, &mut |id| UniformInput::Known(uniform(id)));
    let unused = number
        .axis_dependence()
        .map(|along| along == AxisDependence::Independent);
    let evaluations = MAX_OPERATIONS / number.cost();
    search_extent(
        unused,
        evaluations,
        &mut |bounds| number.eval(bounds, &[]),
        &mut |bounds| contracted_to_negative(expressions, id, bounds, MAX_OPERATIONS, uniform),
    )
}

/// Returns a number without positive constant factors, which do not change its sign.
fn without_constant_factor(expressions: &Expressions, mut id: ExprId) -> ExprId {
    let is_positive = |id| expressions.as_constant(id).is_some_and(|value| value > 0.0);
    while let Expression::Apply { op, values, .. } = expressions.get(id) {
        id = match (op, values.as_slice()) {
            (Op::Mul, &[factor, other]) if is_positive(factor) => other,
            (Op::Mul | Op::Div, &[other, factor]) if is_positive(factor) => other,
            _ => break,
        };
    }
    id
}

/// Returns the part of a finite box outside of which a value is positive, by at most `evaluations`
/// evaluations.
pub(crate) fn narrow_bounds(
    bounds: &Bounds,
    evaluations: usize,
    over: &mut dyn FnMut(&Bounds) -> Interval,
) -> Bounds {
    let mut search = ExtentSearch {
        value_range: over,
        unused: std::array::from_fn(|axis| !(bounds.max[axis] - bounds.min[axis]).is_finite()),
        remaining_evaluations: evaluations,
    };
    let all_sides = (0..3).flat_map(|axis| [(axis, false), (axis, true)]);
    let searched_sides: Vec<(usize, bool)> = all_sides
        .filter(|&(axis, _)| !search.unused[axis])
        .collect();
    let boxes = search.subdivided(vec![*bounds], &[]);
    let hull = hull_of(&boxes);
    let mut result = *bounds;
    for (axis, _) in searched_sides {
        result.min[axis] = hull.min[axis];
        result.max[axis] = hull.max[axis];
    }
    result
}

/// Returns a box outside of which the value ranges that `over` computes are positive. `contract` returns the part of a box
/// outside of which they are proved to be positive in another way, for sides that stay infinite otherwise.
pub(crate) fn search_extent(
    unused: [bool; 3],
    evaluations: usize,
    over: &mut dyn FnMut(&Bounds) -> Interval,
    contract: &mut dyn FnMut(&Bounds) -> Bounds,
) -> Bounds {
    let mut search = ExtentSearch {
        value_range: over,
        unused,
        remaining_evaluations: evaluations,
    };
    let mut bounds = Bounds::ALL_SPACE;
    // A side that has moved in makes the boxes for the other sides smaller.
    for _ in 0..2 {
        for axis in (0..3).filter(|&axis| !unused[axis]) {
            for upper in [false, true] {
                search.move_in(&mut bounds, axis, upper);
            }
        }
    }
    let found = search.enclosed(&bounds);
    let is_open = |axis: usize| !unused[axis] && (found.max[axis] - found.min[axis]).is_infinite();
    if found.is_empty() || !(0..3).any(is_open) {
        return found;
    }
    let contracted = contract(&found);
    match contracted.is_finite() && contracted != found {
        true => narrow_bounds(&contracted, evaluations, over),
        false => contracted,
    }
}

struct ExtentSearch<'f> {
    /// Returns the range of the number in a box.
    value_range: &'f mut dyn FnMut(&Bounds) -> Interval,
    /// Axes along which the number does not change.
    unused: [bool; 3],
    /// Number of evaluations that remain.
    remaining_evaluations: usize,
}

impl ExtentSearch<'_> {
    /// Returns the range of the number in a box.
    fn over(&mut self, bounds: &Bounds) -> Interval {
        self.remaining_evaluations = self.remaining_evaluations.saturating_sub(1);
        let mut bounds = *bounds;
        for axis in (0..3).filter(|&axis| self.unused[axis]) {
            (bounds.min[axis], bounds.max[axis]) = (0.0, 0.0);
        }
        (self.value_range)(&bounds)
    }

    /// Moves a side in, as far as the number is proved positive in all space beyond it.
    fn move_in(&mut self, bounds: &mut Bounds, axis: usize, upper: bool) {
        let half_space_beyond = |boundary: f64| {
            let mut half_space = *bounds;
            if upper {
                half_space.min[axis] = boundary;
            } else {
                half_space.max[axis] = -boundary;
            }
            half_space
        };
        // Moving outwards, the result changes only once, from not proved to proved.
        let coordinate =
            |fraction: f64| fraction.signum() * ((fraction.abs() * MAX_SIDE.ln_1p()).exp_m1());
        if self.remaining_evaluations == 0 || !is_positive(self.over(&half_space_beyond(MAX_SIDE)))
        {
            return;
        }
        let (mut not_proved, mut proved) = (-1.0, 1.0);
        for _ in 0..BISECTION_COUNT {
            let middle = (not_proved + proved) / 2.0;
            let half_space = half_space_beyond(coordinate(middle));
            if half_space.is_empty() || is_positive(self.over(&half_space)) {
                proved = middle;
            } else {
                not_proved = middle;
            }
        }
        let side = coordinate(proved);
        if upper {
            bounds.max[axis] = bounds.max[axis].min(side);
        } else {
            bounds.min[axis] = bounds.min[axis].max(-side);
        }
    }

    /// Returns the box with its infinite sides moved in to the part of a cube that is not proved
    /// positive.
    fn enclosed(&mut self, bounds: &Bounds) -> Bounds {
        let open_sides: Vec<(usize, bool)> = (0..3)
            .filter(|&axis| !self.unused[axis])
            .flat_map(|axis| [(axis, false), (axis, true)])
            .filter(|&(axis, upper)| {
                let side = if upper {
                    bounds.max[axis]
                } else {
                    bounds.min[axis]
                };
                side.is_infinite()
            })
            .collect();
        let cube = bounds.intersection(&Bounds::centred([SEARCH_HALF_SIDE; 3]));
        if open_sides.is_empty() || cube.is_empty() {
            return *bounds;
        }
        let boxes = self.subdivided(vec![cube], &open_sides);
        if boxes.is_empty() {
            // Positive everywhere: the solid is empty.
            return Bounds::EMPTY;
        }
        self.with_closed_sides(bounds, &boxes, &open_sides)
    }

    /// Returns the box with those open sides closed that no box touches. Where boxes touch another
    /// side, the space beyond the cube on that side must be proved to end at the same coordinate.
    fn with_closed_sides(
        &mut self,
        bounds: &Bounds,
        boxes: &[Bounds],
        open_sides: &[(usize, bool)],
    ) -> Bounds {
        let hull = hull_of(boxes);
        let is_touched =
            |&side: &(usize, bool)| boxes.iter().any(|b| extends_to(b, side, 1.0 - 1e-12));
        let (touched, untouched): (Vec<_>, Vec<_>) =
            open_sides.iter().copied().partition(is_touched);
        let mut closed = *bounds;
        for side in untouched {
            let end = match side {
                (axis, true) => hull.max[axis],
                (axis, false) => hull.min[axis],
            };
            let holds = touched.iter().all(|&(other, upper)| {
                let cube_side = if upper {
                    SEARCH_HALF_SIDE
                } else {
                    -SEARCH_HALF_SIDE
                };
                let outside = beyond(&beyond(bounds, side, end), (other, upper), cube_side);
                is_positive(self.over(&outside))
            });
            match side {
                (axis, true) if holds => closed.max[axis] = end,
                (axis, false) if holds => closed.min[axis] = end,
                _ => {}
            }
        }
        closed
    }

    /// Halves these boxes and keeps those that may hold a value of at most zero. Stops at the finest
    /// size, at a limit, or once a solid is found far out on all `open_sides`, if there are any.
    fn subdivided(&mut self, mut boxes: Vec<Bounds>, open_sides: &[(usize, bool)]) -> Vec<Bounds> {
        let mut is_infinite = vec![false; open_sides.len()];
        let min_size = self.longest_side(&hull_of(&boxes)).1 * MIN_HULL_FRACTION;
        loop {
            let hull = hull_of(&boxes);
            let size = self.longest_side(&hull).1;
            if size < min_size {
                return Vec::new();
            }
            // Only boxes at a side of the hull can move that side.
            let is_coarse = |search: &Self, b: &Bounds| {
                search.longest_side(b).1 > size * MIN_BOX_FRACTION && search.is_at_hull(b, &hull)
            };
            let coarse = boxes.iter().filter(|b| is_coarse(self, b)).count();
            let has_room =
                boxes.len() + coarse <= MAX_BOXES && self.remaining_evaluations > 4 * coarse;
            let all_infinite =
                !open_sides.is_empty() && is_infinite.iter().all(|&is_infinite| is_infinite);
            if coarse == 0 || !has_room || all_infinite {
                return boxes;
            }
            let mut next = Vec::with_capacity(boxes.len() + coarse);
            for b in &boxes {
                if !is_coarse(self, b) {
                    next.push(*b);
                    continue;
                }
                for half in halves(b, self.longest_side(b).0) {
                    if !is_positive(self.over(&half)) {
                        next.push(half);
                    }
                }
            }
            for (side, is_infinite) in open_sides.iter().zip(&mut is_infinite) {
                let outermost = next
                    .iter()
                    .find(|b| extends_to(b, *side, MAX_FINITE_FRACTION));
                *is_infinite = *is_infinite
                    || outermost.is_some_and(|b| self.number_at(face_centre(b, *side)) <= 0.0);
            }
            boxes = next;
        }
    }

    /// Reports whether a box touches a side of the hull.
    fn is_at_hull(&self, b: &Bounds, hull: &Bounds) -> bool {
        (0..3)
            .filter(|&axis| !self.unused[axis])
            .any(|axis| b.min[axis] <= hull.min[axis] || b.max[axis] >= hull.max[axis])
    }

    /// Returns the value at a point.
    fn number_at(&mut self, p: [f64; 3]) -> f64 {
        self.over(&Bounds { min: p, max: p }).hi
    }

    /// Returns the axis of a box's longest side, and its length.
    fn longest_side(&self, b: &Bounds) -> (usize, f64) {
        (0..3)
            .filter(|&axis| !self.unused[axis])
            .map(|axis| (axis, b.max[axis] - b.min[axis]))
            .fold(
                (0, 0.0),
                |best, next| if next.1 > best.1 { next } else { best },
            )
    }
}

/// Number of bisections of a side's coordinate.
const BISECTION_COUNT: u32 = 40;

/// Reports whether all of a range is above zero; false if it holds NaN.
fn is_positive(range: Interval) -> bool {
    range.lo > 0.0
}

/// Reports whether a box extends to a fraction of the cube's half side.
fn extends_to(b: &Bounds, (axis, upper): (usize, bool), fraction: f64) -> bool {
    if upper {
        b.max[axis] >= SEARCH_HALF_SIDE * fraction
    } else {
        b.min[axis] <= -SEARCH_HALF_SIDE * fraction
    }
}

/// Returns the centre of a box's face on a side.
fn face_centre(b: &Bounds, (axis, upper): (usize, bool)) -> [f64; 3] {
    let mut p = b.centre();
    p[axis] = if upper { b.max[axis] } else { b.min[axis] };
    p
}

/// Returns the part of a box that lies beyond a coordinate on one of its axes.
fn beyond(b: &Bounds, (axis, upper): (usize, bool), coordinate: f64) -> Bounds {
    let mut result = *b;
    if upper {
        result.min[axis] = coordinate;
    } else {
        result.max[axis] = coordinate;
    }
    result
}

/// Returns the box around boxes.
fn hull_of(boxes: &[Bounds]) -> Bounds {
    boxes.iter().fold(Bounds::EMPTY, |hull, b| hull.hull(b))
}

/// Returns the two halves of a box across an axis.
fn halves(b: &Bounds, axis: usize) -> [Bounds; 2] {
    let (mut low, mut high) = (*b, *b);
    let middle = b.centre()[axis];
    low.max[axis] = middle;
    high.min[axis] = middle;
    [low, high]
}

#[cfg(test)]
mod tests {
    use super::*;
    use sdfc_vm::table::Op;

    /// Returns the extent of a number that a test builds.
    fn extent_of(build: impl FnOnce(&mut Expressions, [ExprId; 3]) -> ExprId) -> Bounds {
        let mut e = Expressions::default();
        let p = [0, 1, 2].map(|axis| e.coordinate(axis));
        let id = build(&mut e, p);
        extent(&e, id, &mut |id| {
            Interval::point(e.as_constant(id).unwrap_or(f64::NAN))
        })
    }

    fn sum(e: &mut Expressions, terms: &[ExprId]) -> ExprId {
        let others = &terms[1..];
        others
            .iter()
            .fold(terms[0], |sum, &term| e.call(Op::Add, &[sum, term]))
    }

    #[test]
    fn a_power_in_several_products_ends_wherever_it_stands() {
        let found = extent_of(|e, p| {
            let offset = e.constant(0.437);
            let mut terms = p.map(|v| {
                let moved = e.call(Op::Sub, &[v, offset]);
                let square = e.call(Op::Mul, &[moved, moved]);
                let cube = e.call(Op::Mul, &[square, moved]);
                e.call(Op::Mul, &[cube, moved])
            });
            let limit = e.constant(-0.5);
            let most = e.call(Op::Add, &[terms[0], terms[1]]);
            terms[2] = e.call(Op::Add, &[terms[2], limit]);
            sum(e, &[most, terms[2]])
        });
        assert!(found.is_finite(), "{found:?}");
    }

    #[test]
    fn a_sphere_ends_at_its_radius() {
        let found = extent_of(|e, p| {
            let squares = p.map(|c| e.call(Op::Square, &[c]));
            let radius = e.constant(-4.0);
            sum(e, &[squares[0], squares[1], squares[2], radius])
        });
        for axis in 0..3 {
            assert!((found.max[axis] - 2.0).abs() < 0.01, "{found:?}");
            assert!((found.min[axis] + 2.0).abs() < 0.01, "{found:?}");
        }
    }

    #[test]
    fn a_quartic_whose_terms_cancel_ends_too() {
        // x⁴ − 5x² + … + 11.8: one evaluation over a half-space proves nothing.
        let found = extent_of(|e, p| {
            let mut terms = vec![e.constant(11.8)];
            let five = e.constant(-5.0);
            for c in p {
                let square = e.call(Op::Square, &[c]);
                terms.push(e.call(Op::Square, &[square]));
                terms.push(e.call(Op::Mul, &[square, five]));
            }
            sum(e, &terms)
        });
        for axis in 0..3 {
            assert!(found.max[axis] > 2.2 && found.max[axis] < 3.2, "{found:?}");
        }
    }

    #[test]
    fn endless_fields_are_reported_as_endless() {
        let ground = extent_of(|_, p| p[1]);
        assert_eq!(ground.min, [f64::NEG_INFINITY; 3]);
        assert!(ground.max[1].abs() < 1e-3 && ground.max[0].is_infinite());
        let bowl = extent_of(|e, p| {
            let squares = [p[0], p[2]].map(|c| e.call(Op::Square, &[c]));
            let sum = e.call(Op::Add, &squares);
            e.call(Op::Sub, &[p[1], sum])
        });
        assert!(bowl.max.iter().all(|v| v.is_infinite()), "{bowl:?}");
    }

    /// A hill that falls forever grows ever wider, beyond the searched cube.
    #[test]
    fn fields_endless_along_one_axis_grow_along_the_others() {
        let hill = extent_of(|e, p| {
            let [x, _, z] = p.map(|c| e.call(Op::Square, &[c]));
            let factor = e.constant(0.02);
            let squares = e.call(Op::Add, &[x, z]);
            let fall = e.call(Op::Mul, &[squares, factor]);
            e.call(Op::Add, &[p[1], fall])
        });
        assert!(hill.min.iter().all(|v| v.is_infinite()), "{hill:?}");
        assert!(hill.max[0].is_infinite() && hill.max[1] < 0.01 && hill.max[2].is_infinite());
        // A column with a wavy wall is equally wide at any height.
        let column = extent_of(|e, p| {
            let [x, _, z] = p.map(|c| e.call(Op::Square, &[c]));
            let wave = e.call(Op::Sin, &p[1..2]);
            let squares = e.call(Op::Add, &[x, z]);
            let four = e.constant(4.0);
            let wide = e.call(Op::Sub, &[squares, four]);
            e.call(Op::Add, &[wide, wave])
        });
        assert!(column.min[1].is_infinite() && column.max[1].is_infinite());
        assert!(column.max[0] < 2.3 && column.min[2] > -2.3, "{column:?}");
    }

    #[test]
    fn points_where_a_field_touches_zero_have_no_extent() {
        let distance = &mut |b: &Bounds| Interval {
            lo: b.distance([0.3, 0.2, 0.0]),
            hi: f64::INFINITY,
        };
        let narrowed = narrow_bounds(&Bounds::centred([3.0; 3]), 100_000, distance);
        assert!(narrowed.is_empty(), "{narrowed:?}");
    }

    #[test]
    fn positive_fields_have_no_extent() {
        let sheet = extent_of(|e, p| {
            let away = e.call(Op::Abs, &[p[1]]);
            let one = e.constant(1.0);
            e.call(Op::Add, &[away, one])
        });
        assert!(sheet.is_empty(), "{sheet:?}");
    }
}
