//! Steps on fields that jump: where a floor, a remainder or a choice changes, the value does, however little the point
//! moves.
//!
//! Such a field is made of pieces that are smooth. A way to a change of sign stays in the piece of its point, or leaves
//! it. In it, the value divided by the piece's slope is safe. A way through a jump is at least as long as that to the
//! jump, and as the neighbouring piece's own value says, where that has the same sign, or the way to the next jump there.
//! So the nearest place of every jump is looked at with the value that the field has beyond, and steps end where the
//! next one is, unless the value has the same sign in whatever piece, by more than the step.

use super::ends::ends;
use super::held::Throughout;
use super::jumps::{Jump, Known, Place, found, has_jumps, sided};
use super::local::{Local, unbounded};
use super::{Budget, Ranges, Search, bound, points};
use crate::boxes::Held;
use crate::expression::{ExprId, Expression, Expressions};
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
/// The most numbers that a step by bounds around a point may take, beyond those of the value itself.
const MAX_LOCAL: usize = 256;
/// The least number of places at which a jump must be tried to say that nothing changes there.
const LEAST_TRIED: usize = 16;
/// The operations that trying a jump may take, and the points that are tried whatever it takes.
const MAX_TRIED: usize = 200_000;
const LEAST_TRIED_POINTS: usize = 64;
/// The most moves of a point to the place of a jump, and the distance from which on it is there.
const MOVES: usize = 12;
const CLOSE: f64 = 1e-9;
/// The distance to both sides of a place at which values are looked at, in sizes of the numbers there.
const BESIDE: f64 = 1e-7;
/// The difference of values that counts as rounding, as a fraction of them.
const ROUNDED: f64 = 1e-6;

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
    let mut throughout = Throughout {
        region,
        ranges,
        budget,
    };
    let number = sided(&mut expressions, number, &throughout);
    let bound = throughout.slope(&expressions, &[number], Held::Own)?;
    let slope = Local::everywhere(&mut expressions, bound);
    let jumps = found(&mut expressions, number, Known::Locally, &mut throughout)?;
    let mut writer = Writer {
        expressions: &mut expressions,
        number,
        slope,
    };
    let mut is_seen = |jump: &Jump| writer.is_seen(jump, &[], tried, ranges);
    (!jumps.iter().any(&mut is_seen)).then_some(bound)
}

/// A number that jumps, as a step: its sign, and a distance in which it does not change that. The bounds of
/// slopes hold in the region, and jumps are tried in a part of it. `None` where it does not jump, or its pieces have no
/// bound.
pub(crate) fn step(
    expressions: &mut Expressions,
    number: ExprId,
    known: Known,
    [region, tried]: [&Bounds; 2],
    ranges: &Ranges,
    budget: &mut Budget,
) -> Option<ExprId> {
    let mut throughout = Throughout {
        region,
        ranges,
        budget,
    };
    let number = sided(expressions, number, &throughout);
    // A number without jumps is known to have no bound.
    let bound = match has_jumps(expressions, number) {
        true => throughout.slope(expressions, &[number], Held::Beside),
        false => None,
    };
    let slope = match (bound, known) {
        (Some(slope), _) => Local::everywhere(expressions, slope.max(1.0 / NOWHERE)),
        (None, Known::Throughout) => return None,
        (None, Known::Locally) => unbounded(expressions, number, Held::Beside, &mut throughout)?,
    };
    if !are_numbers(expressions, &slope, tried, ranges) {
        return None;
    }
    let jumps = found(expressions, number, known, &mut throughout)?;
    let are_constant = slope.is_constant(expressions)
        && jumps.iter().all(|jump| jump.slope.is_constant(expressions));
    let mut writer = Writer {
        expressions,
        number,
        slope,
    };
    // Bounds around a point hold up to the next jump, whatever changes there.
    let jumps = match are_constant {
        true => writer.all_seen(jumps, tried, ranges),
        false => jumps,
    };
    if jumps.is_empty() && writer.constant_slope().is_some() {
        return None;
    }
    let ways = ways_to_ends(writer.expressions, number, region, ranges, budget);
    let step = writer.step(&jumps, &ways);
    let [own, all] = [number, step].map(|id| operands_first(expressions, id, |_| false).len());
    let is_short = are_constant || all <= own + MAX_LOCAL;
    is_short.then_some(step)
}

/// Reports whether a bound around each point is a number of `f32` at those that are tried.
fn are_numbers(expressions: &Expressions, local: &Local, region: &Bounds, ranges: &Ranges) -> bool {
    let numbers: Vec<ExprId> = [Some(local.slope), local.growth, local.radius]
        .into_iter()
        .flatten()
        .filter(|&id| expressions.as_constant(id).is_none())
        .collect();
    let mut search = Search::new(expressions, &numbers, ranges);
    let is_number = |dual: Dual<f64>| dual.value.abs() < f64::from(f32::MAX);
    numbers.is_empty() || points(region).all(|point| search.duals_at(point).all(is_number))
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

/// The nearest of a jump's places near a point, the direction across it, and how far off it may be.
fn moved_to(
    search: &mut Search,
    mut point: [f64; 3],
    place: Place,
) -> Option<([f64; 3], [f64; 3], f64)> {
    let mut goal = None;
    for _ in 0..MOVES {
        let dual = search.duals_at(point).next()?;
        let Dual { value, gradient } = dual;
        let goal = *goal.get_or_insert(if place == Place::Whole {
            value.round()
        } else {
            0.0
        });
        let size = length(dual);
        let share = (goal - value) / (size * size);
        if !share.is_finite() {
            return None;
        }
        let off = share.abs() * size;
        if off <= CLOSE * reach_of(point) {
            let across = [gradient.x, gradient.y, gradient.z].map(|part| part / size);
            return Some((point, across, off));
        }
        let step = [gradient.x, gradient.y, gradient.z].map(|part| part * share);
        point = std::array::from_fn(|axis| point[axis] + step[axis]);
    }
    None
}

/// The length of a number's gradient.
fn length(Dual { gradient, .. }: Dual<f64>) -> f64 {
    (gradient.x.powi(2) + gradient.y.powi(2) + gradient.z.powi(2)).sqrt()
}

/// The size of the numbers around a point.
fn reach_of(point: [f64; 3]) -> f64 {
    point.iter().fold(1.0, |most: f64, v| most.max(v.abs()))
}

/// Writes the step of a number.
struct Writer<'a> {
    expressions: &'a mut Expressions,
    number: ExprId,
    /// The bound of its pieces' slope.
    slope: Local,
}

/// A jump's nearest place.
struct Nearest<'a> {
    jump: &'a Jump,
    /// The distance of it, and that of the next one.
    near: ExprId,
    far: Option<ExprId>,
    /// The difference of the operations beyond; that of choices is to what they are not.
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
        let mut numbers = vec![number];
        if let Place::Turn(x) = jump.place {
            numbers.push(self.piece(x, places));
        }
        let mut place = Search::new(self.expressions, &numbers, ranges);
        let mut sides = Search::new(self.expressions, &[here, beyond], ranges);
        let cost = 2 * place.cost() + 3 * sides.cost();
        let most = (MAX_TRIED / cost).max(LEAST_TRIED_POINTS);
        let steep = self.constant_slope();
        let mut tried = 0;
        for point in points(region).take(most) {
            let mut is_tried = false;
            let Some((point, direction, off)) = moved_to(&mut place, point, jump.place) else {
                continue;
            };
            let is_inside = (0..3).all(|i| region.min[i] <= point[i] && point[i] <= region.max[i]);
            // Where the second number is above zero, an angle turns on.
            let turns_on = place
                .duals_at(point)
                .nth(1)
                .is_some_and(|other| other.value >= 0.0);
            if !is_inside || turns_on {
                tried += 1;
                continue;
            }
            // What has a value of its own in the very place is seen beside it.
            let beside = direction.map(|along| along * BESIDE * reach_of(point));
            for side in [1.0, -1.0] {
                let at = std::array::from_fn(|axis| point[axis] + side * beside[axis]);
                let duals: Vec<Dual<f64>> = sides.duals_at(at).collect();
                let &[here, beyond] = duals.as_slice() else {
                    continue;
                };
                let slope = steep.unwrap_or_else(|| length(here).max(length(beyond)));
                let (here, beyond) = (here.value, beyond.value);
                let off = off + BESIDE * reach_of(point);
                let rounding = ROUNDED * (1.0 + here.abs().max(beyond.abs()));
                if (here - beyond).abs() > 4.0 * slope * off + rounding {
                    return true;
                }
                is_tried |= here.is_finite() && beyond.is_finite();
            }
            tried += usize::from(is_tried);
        }
        tried < LEAST_TRIED
    }

    /// The step; `ends` are ways by what the number is in all of its pieces.
    fn step(&mut self, jumps: &[Jump], ends: &[ExprId]) -> ExprId {
        let mut nearest: Vec<Nearest> = jumps.iter().map(|jump| self.nearest(jump)).collect();
        let count = operands_first(self.expressions, self.number, |_| false).len();
        let has_pieces = jumps.len() <= MAX_PIECES && count * jumps.len() <= MAX_NUMBERS;
        if has_pieces {
            nearest = nearest
                .iter()
                .map(|place| self.chosen(place, &nearest))
                .collect();
        }
        let is_below = self.is_below(self.number);
        let mut step = self.way(self.number, &[]);
        for (at, place) in nearest.iter().enumerate() {
            let mut beyond = place.near;
            if has_pieces {
                let piece = self.piece(self.number, &[place]);
                let mut way = self.way(piece, &[place]);
                for other in (0..jumps.len()).filter(|other| *other != at) {
                    let near = self.piece(nearest[other].near, &[place]);
                    let own = self.piece(place.near, &[&nearest[other]]);
                    let is_apart = (near, own) == (nearest[other].near, place.near);
                    let near = match is_apart && jumps.len() == 2 {
                        // Both may be passed at once, and what lies beyond the corner counts.
                        true => self.beyond_corner(place, &nearest[other], is_below),
                        false => near,
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
        let way = self.way(piece, &[first, second]);
        self.beyond(piece, is_below, [near, way])
    }

    /// The distance of a jump's nearest place.
    fn near(&mut self, jump: &Jump) -> ExprId {
        let size = match jump.place {
            Place::Zero => self.call(Op::Abs, &[jump.number]),
            Place::Turn(x) => {
                let zero = self.expressions.constant(0.0);
                let ahead = self.call(Op::Max, &[x, zero]);
                let [y, x] = [jump.number, ahead].map(|v| self.call(Op::Mul, &[v, v]));
                let square = self.call(Op::Add, &[y, x]);
                self.call(Op::Sqrt, &[square])
            }
            Place::Whole => {
                let one = self.expressions.constant(1.0);
                let share = self.call(Op::Fract, &[jump.number]);
                let rest = self.call(Op::Sub, &[one, share]);
                self.call(Op::Min, &[share, rest])
            }
        };
        self.within(size, jump.slope)
    }

    /// A distance within which a number changes by no more than a size.
    fn within(&mut self, size: ExprId, local: Local) -> ExprId {
        if let Some(slope) = self.expressions.as_constant(local.slope)
            && local.growth.is_none()
        {
            return self.divided(size, slope);
        }
        let mut slope = local.slope;
        if let Some(growth) = local.growth {
            let more = self.call(Op::Mul, &[growth, size]);
            slope = self.call(Op::Add, &[slope, more]);
        }
        let distance = self.call(Op::Div, &[size, slope]);
        match local.radius {
            Some(radius) => self.call(Op::Min, &[distance, radius]),
            None => distance,
        }
    }

    /// The same place; where all of its operations are in what a choice leaves out, it is no nearer than the choice's
    /// own place.
    fn chosen<'a>(&mut self, place: &Nearest<'a>, all: &[Nearest]) -> Nearest<'a> {
        let mut chosen = Nearest { ..*place };
        for id in operands_first(self.expressions, self.number, |_| false) {
            let Expression::Apply { op, values, .. } = self.expressions.get(id).clone() else {
                continue;
            };
            let (Op::Select, &[condition, first, second]) = (op, values.as_slice()) else {
                continue;
            };
            let is_choice = |other: &&Nearest| other.jump.operations.contains(&condition);
            let Some(choice) = all.iter().find(is_choice) else {
                continue;
            };
            for (is_first, other) in [(true, second), (false, first)] {
                if !self.is_only_in(place.jump, id, [condition, other]) {
                    continue;
                }
                let choice = [condition, choice.near];
                chosen.near = self.farther(chosen.near, choice, is_first);
                let far = chosen.far.map(|far| self.farther(far, choice, is_first));
                chosen.far = far;
            }
        }
        chosen
    }

    /// A distance, or that of a choice's own place where the choice leaves out its first operand, or its second one.
    fn farther(&mut self, near: ExprId, choice: [ExprId; 2], is_first: bool) -> ExprId {
        let [condition, place] = choice;
        let out = self.call(Op::Max, &[near, place]);
        let [first, second] = if is_first { [near, out] } else { [out, near] };
        self.call(Op::Select, &[condition, first, second])
    }

    /// Reports whether the number has none of a jump's operations but by an operand of a choice, of which the others are
    /// given.
    fn is_only_in(&self, jump: &Jump, choice: ExprId, others: [ExprId; 2]) -> bool {
        let is_in = |id: &ExprId| jump.operations.contains(id);
        [self.number, others[0], others[1]].into_iter().all(|from| {
            let order = operands_first(self.expressions, from, |id| id == choice);
            !order.iter().any(is_in)
        })
    }

    /// The nearest place of a jump.
    fn nearest<'a>(&mut self, jump: &'a Jump) -> Nearest<'a> {
        let near = self.near(jump);
        let Place::Whole = jump.place else {
            return Nearest {
                jump,
                near,
                far: None,
                shift: self.turn(jump),
            };
        };
        let [half, one, two] = [0.5, 1.0, 2.0].map(|value| self.expressions.constant(value));
        let share = self.call(Op::Fract, &[jump.number]);
        let rest = self.call(Op::Sub, &[one, share]);
        let far = self.call(Op::Max, &[share, rest]);
        let is_above = self.call(Op::Less, &[half, share]);
        let twice = self.call(Op::Mul, &[is_above, two]);
        Nearest {
            jump,
            near,
            far: Some(self.within(far, jump.slope)),
            shift: Some(self.call(Op::Sub, &[twice, one])),
        }
    }

    /// The difference of an angle beyond the place where angles begin again.
    fn turn(&mut self, jump: &Jump) -> Option<ExprId> {
        let Place::Turn(_) = jump.place else {
            return None;
        };
        let turns = [std::f64::consts::TAU, -std::f64::consts::TAU];
        let [more, less] = turns.map(|turn| self.expressions.constant(turn));
        let is_below = self.is_below(jump.number);
        Some(self.call(Op::Select, &[is_below, more, less]))
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

    /// The way to a change of sign that a value tells, where operations are as beyond some places.
    fn way(&mut self, piece: ExprId, places: &[&Nearest]) -> ExprId {
        let size = self.call(Op::Abs, &[piece]);
        let own = self.slope;
        let mut beyond = |id: ExprId| self.piece(id, places);
        let local = Local {
            slope: beyond(own.slope),
            growth: own.growth.map(&mut beyond),
            radius: own.radius.map(&mut beyond),
        };
        self.within(size, local)
    }

    /// The bound of the slope of all pieces, where it is one number.
    fn constant_slope(&self) -> Option<f64> {
        match self.slope.growth {
            Some(_) => None,
            None => self.expressions.as_constant(self.slope.slope),
        }
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
