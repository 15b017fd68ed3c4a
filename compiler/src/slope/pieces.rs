//! Steps on fields that jump: where a floor, a remainder or a choice changes, the value does, however little the point
//! moves.
//!
//! Such a field is made of pieces that are smooth. A way to a change of sign stays in the piece of its point, or leaves
//! it. In it, the value divided by the piece's slope is safe. A way through a jump is at least as long as that to the
//! jump, and as the neighbouring piece's own value says, where that has the same sign, or the way to the next jump there.
//! So the nearest place of every jump is looked at with the value that the field has beyond, and steps end where the
//! next one is, unless the value has the same sign in whatever piece, by more than the step.

use super::ends::ends;
use super::{
    Budget, ENDLESS, MAX_BOXES, Ranges, STEEPEST, Search, bound, is_loose, points, searched,
};
use crate::boxes::Held;
use crate::expression::{ExprId, Expression, Expressions, Stage};
use crate::scene::NOWHERE;
use crate::uniforms::{operands_first, rewritten};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// The most jumps of which what lies beyond is looked at: each costs as much as the field.
const MAX_PIECES: usize = 6;
/// The most numbers that the pieces beside a point may take together.
const MAX_NUMBERS: usize = 4_000;
/// The least number of places at which a jump must be tried to say that nothing changes there.
const LEAST_TRIED: usize = 16;
/// The operations that trying a jump may take, and the points that are tried whatever it takes.
const MAX_TRIED: usize = 200_000;
const LEAST_TRIED_POINTS: usize = 64;
/// The most moves of a point to the place of a jump, and the distance from which on it is there.
const MOVES: usize = 12;
const CLOSE: f64 = 1e-9;
/// The difference of values that counts as rounding, as a fraction of them.
const ROUNDED: f64 = 1e-6;

/// A place where operations of a field jump.
struct Jump {
    /// The number that is whole there, or zero.
    number: ExprId,
    /// It is one whole number of many.
    is_whole: bool,
    /// The operations.
    operations: Vec<ExprId>,
    /// The bound of the number's slope.
    slope: f64,
}

/// A bound of the slope of a number that does not change where its operations jump, as far as points that are tried
/// in a part of the region show: it is as steep as its pieces. `None` where it jumps, or there is no bound.
pub(crate) fn continuous(
    expressions: &Expressions,
    number: ExprId,
    [region, tried]: [&Bounds; 2],
    ranges: &Ranges,
    budget: &mut Budget,
) -> Option<f64> {
    let mut expressions = expressions.clone();
    let number = sided(&mut expressions, number);
    let slope = held_slope(&expressions, number, Held::Own, region, ranges, budget)?;
    let jumps = found(&mut expressions, number, region, ranges, budget)?;
    let mut writer = Writer {
        expressions: &mut expressions,
        number,
        slope,
    };
    let mut is_seen = |jump: &Jump| writer.is_seen(jump, &[], tried, ranges);
    (!jumps.iter().any(&mut is_seen)).then_some(slope)
}

/// A number that jumps, as a step: its sign, and a distance in which it does not change that. The bounds of
/// slopes hold in the region, and jumps are tried in a part of it. `None` where it does not jump, or its pieces have no
/// bound.
pub(crate) fn step(
    expressions: &mut Expressions,
    number: ExprId,
    [region, tried]: [&Bounds; 2],
    ranges: &Ranges,
    budget: &mut Budget,
) -> Option<ExprId> {
    let number = sided(expressions, number);
    let slope = held_slope(expressions, number, Held::Beside, region, ranges, budget)?;
    let jumps = found(expressions, number, region, ranges, budget)?;
    let mut writer = Writer {
        expressions,
        number,
        slope,
    };
    let jumps = writer.all_seen(jumps, tried, ranges);
    if jumps.is_empty() {
        return None;
    }
    let ways = ways_to_ends(writer.expressions, number, region, ranges, budget);
    Some(writer.step(&jumps, &ways))
}

/// Safe ways to a change of sign by the least and by the greatest that a number may be; they are below zero where these
/// tell none.
fn ways_to_ends(
    expressions: &mut Expressions,
    number: ExprId,
    region: &Bounds,
    ranges: &Ranges,
    budget: &mut Budget,
) -> Vec<ExprId> {
    let Some([lo, hi]) = ends(expressions, number) else {
        return Vec::new();
    };
    let below = expressions.call(Op::Neg, &[hi]);
    let mut ways = Vec::new();
    for end in [lo, below] {
        let count = operands_first(expressions, end, |_| false).len();
        let slope = match count <= MAX_NUMBERS {
            true => bound(expressions, &[end], region, ranges, budget),
            false => None,
        };
        if let Some(slope) = slope.filter(|slope| *slope > 0.0) {
            let factor = expressions.constant(1.0 / slope);
            ways.push(expressions.call(Op::Mul, &[end, factor]));
        }
    }
    ways
}

/// Reports whether a number has operations that jump.
pub(crate) fn has_jumps(expressions: &Expressions, number: ExprId) -> bool {
    let order = operands_first(expressions, number, |_| false);
    order.into_iter().any(|id| jumps(expressions, id))
}

/// Reports whether an operation jumps where its operand does not.
fn jumps(expressions: &Expressions, id: ExprId) -> bool {
    let Expression::Apply { op, .. } = expressions.get(id) else {
        return false;
    };
    let is_one = matches!(
        op,
        Op::Floor
            | Op::Ceil
            | Op::Round
            | Op::Trunc
            | Op::Fract
            | Op::Modulo
            | Op::Less
            | Op::Step
            | Op::Sign
    );
    is_one && expressions.stage(id) > Stage::Uniform
}

/// A number that jumps by floors, fractions, remainders and comparisons alone: in the place of a jump, these have the
/// value of one side.
fn sided(expressions: &mut Expressions, number: ExprId) -> ExprId {
    rewritten(
        expressions,
        number,
        |expressions, id, written, values| match (jumps(expressions, id), expressions.get(id)) {
            (true, &Expression::Apply { op, .. }) => {
                sided_operation(expressions, op, values).unwrap_or(written)
            }
            _ => written,
        },
    )
}

/// An operation by those that are left, with the same value everywhere.
fn sided_operation(e: &mut Expressions, op: Op, values: &[ExprId]) -> Option<ExprId> {
    let [zero, half, one] = [0.0, 0.5, 1.0].map(|value| e.constant(value));
    let ceil = |e: &mut Expressions, a: ExprId| {
        let opposite = match e.get(a) {
            Expression::Apply {
                op: Op::Neg,
                values,
                ..
            } => values[0],
            _ => e.call(Op::Neg, &[a]),
        };
        let floor = e.call(Op::Floor, &[opposite]);
        e.call(Op::Neg, &[floor])
    };
    Some(match (op, values) {
        (Op::Sign, &[a]) => {
            let is_above = e.call(Op::Less, &[zero, a]);
            let is_below = e.call(Op::Less, &[a, zero]);
            e.call(Op::Sub, &[is_above, is_below])
        }
        (Op::Step, &[edge, a]) => {
            let is_below = e.call(Op::Less, &[a, edge]);
            e.call(Op::Sub, &[one, is_below])
        }
        (Op::Ceil, &[a]) => ceil(e, a),
        (Op::Round, &[a]) => {
            let more = e.call(Op::Add, &[a, half]);
            e.call(Op::Floor, &[more])
        }
        (Op::Trunc, &[a]) => {
            let is_below = e.call(Op::Less, &[a, zero]);
            let (ceil, floor) = (ceil(e, a), e.call(Op::Floor, &[a]));
            e.call(Op::Select, &[is_below, ceil, floor])
        }
        _ => return None,
    })
}

/// A bound of a number's slope with its jumps held.
fn held_slope(
    expressions: &Expressions,
    number: ExprId,
    held: Held,
    region: &Bounds,
    ranges: &Ranges,
    budget: &mut Budget,
) -> Option<f64> {
    let search = Search::new(expressions, &[number], ranges).holding(held);
    let (bound, search) = searched(search, region, budget, [MAX_BOXES, ENDLESS]);
    let is_bound = bound < STEEPEST && !is_loose(bound, search, region);
    is_bound.then_some(bound)
}

/// The jumps of a number. What jumps only where something else does is none of them.
fn found(
    expressions: &mut Expressions,
    number: ExprId,
    region: &Bounds,
    ranges: &Ranges,
    budget: &mut Budget,
) -> Option<Vec<Jump>> {
    let mut found: Vec<Jump> = Vec::new();
    for id in operands_first(expressions, number, |_| false) {
        if !jumps(expressions, id) {
            continue;
        }
        let Expression::Apply { op, values, .. } = expressions.get(id).clone() else {
            continue;
        };
        let (number, is_whole) = match (op, values.as_slice()) {
            (Op::Less, &[a, b]) => (expressions.call(Op::Sub, &[a, b]), false),
            (Op::Modulo, &[a, b]) => (expressions.call(Op::Div, &[a, b]), true),
            (_, &[a]) => (a, true),
            _ => return None,
        };
        let known = found
            .iter_mut()
            .find(|jump| jump.number == number && jump.is_whole == is_whole);
        if let Some(jump) = known {
            jump.operations.push(id);
            continue;
        }
        let slope = held_slope(expressions, number, Held::Own, region, ranges, budget)?;
        if slope > 0.0 {
            found.push(Jump {
                number,
                is_whole,
                operations: vec![id],
                slope,
            });
        }
    }
    Some(found)
}

/// The place where a number is whole, or zero, near a point, and how far off that may be.
fn moved_to(place: &mut Search, mut point: [f64; 3], is_whole: bool) -> Option<([f64; 3], f64)> {
    let mut goal = None;
    for _ in 0..MOVES {
        let Dual { value, gradient } = place.duals_at(point).next()?;
        let goal = *goal.get_or_insert(if is_whole { value.round() } else { 0.0 });
        let square = gradient.x.powi(2) + gradient.y.powi(2) + gradient.z.powi(2);
        let share = (goal - value) / square;
        if !share.is_finite() {
            return None;
        }
        let off = share.abs() * square.sqrt();
        let reach = point.iter().fold(1.0, |most: f64, v| most.max(v.abs()));
        if off <= CLOSE * reach {
            return Some((point, off));
        }
        let step = [gradient.x, gradient.y, gradient.z].map(|part| part * share);
        point = std::array::from_fn(|axis| point[axis] + step[axis]);
    }
    None
}

/// Writes the step of a number.
struct Writer<'a> {
    expressions: &'a mut Expressions,
    number: ExprId,
    /// The bound of its pieces' slope.
    slope: f64,
}

/// A jump's nearest place.
struct Nearest<'a> {
    jump: &'a Jump,
    /// The distance of it, and that of the next one.
    near: ExprId,
    far: Option<ExprId>,
    /// The difference of the whole number beyond.
    shift: Option<ExprId>,
}

impl Writer<'_> {
    /// The jumps at which the number changes, or one of the pieces beyond these does.
    fn all_seen(&mut self, jumps: Vec<Jump>, region: &Bounds, ranges: &Ranges) -> Vec<Jump> {
        let (mut seen, mut others): (Vec<Jump>, Vec<Jump>) = jumps
            .into_iter()
            .partition(|jump| self.is_seen(jump, &[], region, ranges));
        let mut at = 0;
        while at < seen.len() {
            let beyond = self.nearest(&seen[at]);
            let (more, rest) = others
                .into_iter()
                .partition(|jump| self.is_seen(jump, &[&beyond], region, ranges));
            others = rest;
            seen.extend::<Vec<Jump>>(more);
            at += 1;
        }
        seen
    }

    /// Reports whether the number, or a piece of it beyond some places, changes where operations jump, at one of the
    /// points that are tried.
    fn is_seen(
        &mut self,
        jump: &Jump,
        places: &[&Nearest],
        region: &Bounds,
        ranges: &Ranges,
    ) -> bool {
        let nearest = self.nearest(jump);
        let here = self.piece(self.number, places);
        let beyond = self.piece(self.number, &[places, &[&nearest]].concat());
        let number = self.piece(jump.number, places);
        let mut place = Search::new(self.expressions, &[number], ranges);
        let mut sides = Search::new(self.expressions, &[here, beyond], ranges);
        let cost = 2 * place.cost() + sides.cost();
        let most = (MAX_TRIED / cost).max(LEAST_TRIED_POINTS);
        let mut tried = 0;
        for point in points(region).take(most) {
            let Some((point, off)) = moved_to(&mut place, point, jump.is_whole) else {
                continue;
            };
            let is_inside = (0..3).all(|i| region.min[i] <= point[i] && point[i] <= region.max[i]);
            if !is_inside {
                tried += 1;
                continue;
            }
            let values: Vec<f64> = sides.duals_at(point).map(|dual| dual.value).collect();
            let &[here, beyond] = values.as_slice() else {
                continue;
            };
            if !(here.is_finite() && beyond.is_finite()) {
                continue;
            }
            let rounding = ROUNDED * (1.0 + here.abs().max(beyond.abs()));
            if (here - beyond).abs() > 4.0 * self.slope * off + rounding {
                return true;
            }
            tried += 1;
        }
        tried < LEAST_TRIED
    }

    /// The step; `ends` are ways by what the number is in all of its pieces.
    fn step(&mut self, jumps: &[Jump], ends: &[ExprId]) -> ExprId {
        let nearest: Vec<Nearest> = jumps.iter().map(|jump| self.nearest(jump)).collect();
        let count = operands_first(self.expressions, self.number, |_| false).len();
        let has_pieces = jumps.len() <= MAX_PIECES && count * jumps.len() <= MAX_NUMBERS;
        let is_below = self.is_below(self.number);
        let mut step = self.way(self.number);
        for (at, place) in nearest.iter().enumerate() {
            let mut beyond = place.near;
            if has_pieces {
                let piece = self.piece(self.number, &[place]);
                let mut way = self.way(piece);
                for (other, jump) in jumps.iter().enumerate().filter(|(other, _)| *other != at) {
                    let number = self.piece(jump.number, &[place]);
                    let own = self.piece(place.jump.number, &[&nearest[other]]);
                    let is_apart = (number, own) == (jump.number, place.jump.number);
                    let near = match is_apart && jumps.len() == 2 {
                        // Both may be passed at once, and what lies beyond the corner counts.
                        true => self.beyond_corner(place, &nearest[other], is_below),
                        false => self.near(jump, number),
                    };
                    way = self.call(Op::Min, &[way, near]);
                }
                beyond = self.beyond(piece, is_below, [place.near, way]);
            }
            step = self.call(Op::Min, &[step, beyond]);
            if let Some(far) = place.far {
                step = self.call(Op::Min, &[step, far]);
            }
        }
        for &end in ends {
            step = self.call(Op::Max, &[step, end]);
        }
        self.call(Op::Piecewise, &[self.number, step])
    }

    /// A safe way through two jumps whose places do not depend on each other.
    fn beyond_corner(&mut self, first: &Nearest, second: &Nearest, is_below: ExprId) -> ExprId {
        let near = self.call(Op::Max, &[first.near, second.near]);
        let piece = self.piece(self.number, &[first, second]);
        let way = self.way(piece);
        self.beyond(piece, is_below, [near, way])
    }

    /// The distance of the nearest place where a jump's number, as it is written here, is whole or zero.
    fn near(&mut self, jump: &Jump, number: ExprId) -> ExprId {
        let size = match jump.is_whole {
            false => self.call(Op::Abs, &[number]),
            true => {
                let one = self.expressions.constant(1.0);
                let share = self.call(Op::Fract, &[number]);
                let rest = self.call(Op::Sub, &[one, share]);
                self.call(Op::Min, &[share, rest])
            }
        };
        self.divided(size, jump.slope)
    }

    /// The nearest place of a jump.
    fn nearest<'a>(&mut self, jump: &'a Jump) -> Nearest<'a> {
        let near = self.near(jump, jump.number);
        if !jump.is_whole {
            return Nearest {
                jump,
                near,
                far: None,
                shift: None,
            };
        }
        let [half, one, two] = [0.5, 1.0, 2.0].map(|value| self.expressions.constant(value));
        let share = self.call(Op::Fract, &[jump.number]);
        let rest = self.call(Op::Sub, &[one, share]);
        let far = self.call(Op::Max, &[share, rest]);
        let is_above = self.call(Op::Less, &[half, share]);
        let twice = self.call(Op::Mul, &[is_above, two]);
        Nearest {
            jump,
            near,
            far: Some(self.divided(far, jump.slope)),
            shift: Some(self.call(Op::Sub, &[twice, one])),
        }
    }

    /// A safe way into a piece, at least `near` long, and a `way` there that leads to no change of its sign.
    fn beyond(&mut self, piece: ExprId, is_below: ExprId, [near, way]: [ExprId; 2]) -> ExprId {
        let is_other_below = self.is_below(piece);
        let change = self.call(Op::Sub, &[is_below, is_other_below]);
        let changes = self.call(Op::Abs, &[change]);
        let same = self.call(Op::Max, &[near, way]);
        self.call(Op::Select, &[changes, near, same])
    }

    /// A number with other values of the operations that jump at some places.
    fn piece(&mut self, number: ExprId, places: &[&Nearest]) -> ExprId {
        let mut shifts: HashMap<ExprId, Option<ExprId>> = HashMap::new();
        for place in places {
            shifts.extend(place.jump.operations.iter().map(|&id| (id, place.shift)));
        }
        rewritten(self.expressions, number, |e, id, written, values| {
            match (shifts.get(&id), e.get(id)) {
                (Some(&shift), &Expression::Apply { op, .. }) => {
                    shifted(e, written, op, values, shift)
                }
                _ => written,
            }
        })
    }

    /// The way to a change of sign that a piece's value tells.
    fn way(&mut self, piece: ExprId) -> ExprId {
        let size = self.call(Op::Abs, &[piece]);
        self.divided(size, self.slope.max(1.0 / NOWHERE))
    }

    fn is_below(&mut self, id: ExprId) -> ExprId {
        let zero = self.expressions.constant(0.0);
        self.call(Op::Less, &[id, zero])
    }

    fn divided(&mut self, id: ExprId, slope: f64) -> ExprId {
        let factor = self.expressions.constant(1.0 / slope);
        self.call(Op::Mul, &[id, factor])
    }

    fn call(&mut self, op: Op, values: &[ExprId]) -> ExprId {
        self.expressions.call(op, values)
    }
}

/// The result of an operation beyond a jump.
fn shifted(
    expressions: &mut Expressions,
    id: ExprId,
    op: Op,
    values: &[ExprId],
    shift: Option<ExprId>,
) -> ExprId {
    match (op, shift) {
        (Op::Fract, Some(shift)) => expressions.call(Op::Sub, &[id, shift]),
        (Op::Modulo, Some(shift)) => {
            let by = expressions.call(Op::Mul, &[shift, values[1]]);
            expressions.call(Op::Sub, &[id, by])
        }
        (_, Some(shift)) => expressions.call(Op::Add, &[id, shift]),
        (_, None) => {
            let one = expressions.constant(1.0);
            expressions.call(Op::Sub, &[one, id])
        }
    }
}
