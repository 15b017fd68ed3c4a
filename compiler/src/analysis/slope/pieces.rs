//! Safe steps on fields with discontinuities. Where a floor, a remainder or a choice changes, the value
//! changes by a finite amount however little the point moves.
//!
//! Such a field consists of pieces that are smooth. A path to a change of sign stays in the piece of
//! its point, or leaves it. Inside the piece, the value divided by the piece's slope is a safe
//! distance. A path through a discontinuity is at least as long as the distance to it. If the
//! neighbouring piece has the same sign, the path must also cover a second distance. That is the one
//! that the neighbour's own value allows, or the one to the next discontinuity there. So the value
//! beyond the nearest surface of every discontinuity is evaluated, and steps end at the next surface.
//! They may be longer where the value has the same sign in every piece, by more than the step.

use super::discontinuities::{
    Discontinuity, JumpSurface, SlopeScope, discontinuities, has_discontinuities, one_sided,
};
use super::envelope::envelope;
use super::local_bound::{LocalBound, bound_without_global};
use super::region_bounds::RegionBounds;
use super::{Budget, SlopeSearch, sample_points, slope_bound};
use crate::analysis::box_eval::HeldBranches;
use crate::analysis::param_ranges::ParamRanges;
use crate::expression::{ExprId, Expression, Expressions};
use crate::scene::NO_SURFACE_DISTANCE;
use crate::uniforms::{postorder, rewrite_number};
use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Maximum number of discontinuities beyond which the value is evaluated: each costs as much as the
/// field.
const MAX_PIECES: usize = 6;
/// Maximum number of expressions in the neighbouring pieces of a point together.
const MAX_PIECE_EXPRESSIONS: usize = 4_000;
/// Maximum number of expressions in a step by bounds around a point, beyond those of the value itself.
const MAX_LOCAL_EXPRESSIONS: usize = 256;
/// Minimum number of points of a discontinuity that must be sampled to conclude that nothing changes
/// there.
const MIN_CONCLUSIVE_SAMPLES: usize = 16;
/// Maximum number of operations for sampling one discontinuity, and the minimum number of points
/// whatever they cost.
const MAX_SAMPLING_OPERATIONS: usize = 200_000;
const MIN_SAMPLE_POINTS: usize = 64;
/// Maximum number of iterations of a point towards a surface, and the distance at which it counts as on
/// it, relative to the coordinates.
const MAX_NEWTON_STEPS: usize = 12;
const SURFACE_TOLERANCE: f64 = 1e-9;
/// Distance to both sides of a surface at which values are sampled, relative to the coordinates.
const SIDE_OFFSET: f64 = 1e-7;
/// Difference of values that counts as rounding, as a fraction of them.
const ROUNDING_FRACTION: f64 = 1e-6;

/// Returns a slope bound of a number that is continuous where its operations are not: the slope of its
/// pieces. Continuity is tested at sample points in a part of the region. `None` where it is
/// discontinuous, or without a bound.
pub(crate) fn continuous(
    expressions: &Expressions,
    number: ExprId,
    [region, sampled_region]: [&Bounds; 2],
    size: f64,
    ranges: &ParamRanges,
    budget: &mut Budget,
) -> Option<f64> {
    let mut expressions = expressions.clone();
    let mut region_bounds = RegionBounds::new(region, size, ranges, budget);
    let number = one_sided(&mut expressions, number, &region_bounds);
    let held = HeldBranches::OwnPiece;
    let bound = match region_bounds.slope(&expressions, &[number], held) {
        Some(bound) => bound,
        None => bound_without_global(&mut expressions, number, held, &mut region_bounds)?
            .everywhere_slope(&expressions)?,
    };
    let slope = LocalBound::everywhere(&mut expressions, bound);
    let found_jumps = discontinuities(
        &mut expressions,
        number,
        SlopeScope::PerPoint,
        &mut region_bounds,
    )?;
    let mut writer = StepBuilder {
        expressions: &mut expressions,
        number,
        slope,
    };
    let mut changes_value =
        |jump: &Discontinuity| writer.changes_value(jump, &[], sampled_region, ranges);
    (!found_jumps.iter().any(&mut changes_value)).then_some(bound)
}

/// Builds a step from a number with discontinuities: its sign, and a distance within which it does not
/// change that. Slope bounds hold in the region, and discontinuities are sampled in a part of it.
/// `None` where it is continuous, or its pieces have no bound.
pub(crate) fn step(
    expressions: &mut Expressions,
    number: ExprId,
    scope: SlopeScope,
    [region, sampled_region]: [&Bounds; 2],
    size: f64,
    ranges: &ParamRanges,
    budget: &mut Budget,
) -> Option<ExprId> {
    let mut region_bounds = RegionBounds::new(region, size, ranges, budget);
    let number = one_sided(expressions, number, &region_bounds);
    // A number without discontinuities is known to have no bound.
    let bound = match has_discontinuities(expressions, number) {
        true => region_bounds.slope(expressions, &[number], HeldBranches::WithNeighbours),
        false => None,
    };
    let slope = match (bound, scope) {
        (Some(slope), _) => {
            LocalBound::everywhere(expressions, slope.max(1.0 / NO_SURFACE_DISTANCE))
        }
        (None, SlopeScope::Region) => return None,
        (None, SlopeScope::PerPoint) => bound_without_global(
            expressions,
            number,
            HeldBranches::WithNeighbours,
            &mut region_bounds,
        )?,
    };
    if !are_finite_at_samples(expressions, &slope, sampled_region, ranges) {
        return None;
    }
    let found_jumps = discontinuities(expressions, number, scope, &mut region_bounds)?;
    let are_constant = slope.constant_slope(expressions).is_some()
        && found_jumps
            .iter()
            .all(|jump| jump.slope.constant_slope(expressions).is_some());
    let mut writer = StepBuilder {
        expressions,
        number,
        slope,
    };
    // Bounds around a point hold up to the next discontinuity, whatever changes there.
    let found_jumps = match are_constant {
        true => writer.visible_discontinuities(found_jumps, sampled_region, ranges),
        false => found_jumps,
    };
    if found_jumps.is_empty() && writer.slope.constant_slope(writer.expressions).is_some() {
        return None;
    }
    let end_distances = distances_by_bounds(writer.expressions, number, region, ranges, budget);
    let step = writer.step(&found_jumps, &end_distances);
    let [number_size, step_size] =
        [number, step].map(|id| postorder(expressions, id, |_| false).len());
    let is_short = are_constant || step_size <= number_size + MAX_LOCAL_EXPRESSIONS;
    is_short.then_some(step)
}

/// Reports whether a bound around each point is an `f32` number at the sample points.
fn are_finite_at_samples(
    expressions: &Expressions,
    bound: &LocalBound,
    region: &Bounds,
    ranges: &ParamRanges,
) -> bool {
    let parts = [
        Some(bound.slope),
        bound.curvature,
        bound.growth,
        bound.radius,
    ];
    let numbers: Vec<ExprId> = parts
        .into_iter()
        .flatten()
        .filter(|&id| expressions.as_constant(id).is_none())
        .collect();
    let mut search = SlopeSearch::new(expressions, &numbers, ranges);
    let is_number = |dual: Dual<f64>| dual.value.abs() < f64::from(f32::MAX);
    numbers.is_empty() || sample_points(region).all(|point| search.duals_at(point).all(is_number))
}

/// Returns safe distances to a change of sign by the lower and by the upper bound of a number. They are
/// negative where the bounds prove no distance.
fn distances_by_bounds(
    expressions: &mut Expressions,
    number: ExprId,
    region: &Bounds,
    ranges: &ParamRanges,
    budget: &mut Budget,
) -> Vec<ExprId> {
    let Some([lo, hi]) = envelope(expressions, number) else {
        return Vec::new();
    };
    let negated = expressions.call(Op::Neg, &[hi]);
    let mut distances = Vec::new();
    for end in [lo, negated] {
        let count = postorder(expressions, end, |_| false).len();
        let slope = match count <= MAX_PIECE_EXPRESSIONS {
            true => slope_bound(expressions, &[end], region, None, ranges, budget),
            false => None,
        };
        if let Some(slope) = slope.map(|found| found.bound).filter(|slope| *slope > 0.0) {
            let factor = expressions.constant(1.0 / slope);
            distances.push(expressions.call(Op::Mul, &[end, factor]));
        }
    }
    distances
}

/// Returns the nearest point of a discontinuity to a point, the direction across it, and the remaining
/// distance.
fn nearest_surface_point(
    search: &mut SlopeSearch,
    mut point: DVec3,
    surface: JumpSurface,
) -> Option<(DVec3, DVec3, f64)> {
    let mut goal = None;
    for _ in 0..MAX_NEWTON_STEPS {
        let dual = search.duals_at(point.into()).next()?;
        let (value, gradient) = (dual.value, gradient(dual));
        let goal = *goal.get_or_insert(if surface == JumpSurface::Integers {
            value.round()
        } else {
            0.0
        });
        let size = gradient.length();
        let step_factor = (goal - value) / (size * size);
        if !step_factor.is_finite() {
            return None;
        }
        let distance = step_factor.abs() * size;
        if distance <= SURFACE_TOLERANCE * coordinate_scale(point) {
            return Some((point, gradient / size, distance));
        }
        point += gradient * step_factor;
    }
    None
}

/// Returns the gradient of a number.
fn gradient(Dual { gradient, .. }: Dual<f64>) -> DVec3 {
    DVec3::new(gradient.x, gradient.y, gradient.z)
}

/// Returns the magnitude of the coordinates of a point.
fn coordinate_scale(point: DVec3) -> f64 {
    point
        .to_array()
        .iter()
        .fold(1.0, |largest: f64, v| largest.max(v.abs()))
}

/// Builds the step of a number.
struct StepBuilder<'a> {
    expressions: &'a mut Expressions,
    number: ExprId,
    /// Bound of its pieces' slope.
    slope: LocalBound,
}

/// Nearest surface of a discontinuity.
struct NearestSurface<'a> {
    jump: &'a Discontinuity,
    /// Distance to it, and to the next one.
    distance: ExprId,
    next_distance: Option<ExprId>,
    /// Difference of the operations' values beyond it; `None` for choices, which are negated.
    shift: Option<ExprId>,
}

impl StepBuilder<'_> {
    /// Returns the discontinuities at which the number changes, or one of the pieces beyond these does.
    fn visible_discontinuities(
        &mut self,
        jumps: Vec<Discontinuity>,
        region: &Bounds,
        ranges: &ParamRanges,
    ) -> Vec<Discontinuity> {
        let (mut visible, mut others): (Vec<Discontinuity>, Vec<Discontinuity>) = jumps
            .into_iter()
            .partition(|jump| self.changes_value(jump, &[], region, ranges));
        let mut index = 0;
        while index < visible.len() {
            let surface = self.nearest_surface(&visible[index]);
            let (newly_seen, others_left) = others
                .into_iter()
                .partition(|jump| self.changes_value(jump, &[&surface], region, ranges));
            others = others_left;
            visible.extend::<Vec<Discontinuity>>(newly_seen);
            index += 1;
        }
        visible
    }

    /// Reports whether the number, or a piece of it beyond some surfaces, changes where operations are
    /// discontinuous, at one of the sample points.
    fn changes_value(
        &mut self,
        jump: &Discontinuity,
        surfaces: &[&NearestSurface],
        region: &Bounds,
        ranges: &ParamRanges,
    ) -> bool {
        let nearest = self.nearest_surface(jump);
        let near_side = self.shifted_number(self.number, surfaces);
        let far_side = self.shifted_number(self.number, &[surfaces, &[&nearest]].concat());
        let number = self.shifted_number(jump.number, surfaces);
        let mut numbers = vec![number];
        if let JumpSurface::BranchCut(x) = jump.surface {
            numbers.push(self.shifted_number(x, surfaces));
        }
        let mut surface_search = SlopeSearch::new(self.expressions, &numbers, ranges);
        let mut sides = SlopeSearch::new(self.expressions, &[near_side, far_side], ranges);
        let cost = 2 * surface_search.cost() + 3 * sides.cost();
        let max_points = (MAX_SAMPLING_OPERATIONS / cost).max(MIN_SAMPLE_POINTS);
        let slope_bound = self.slope.constant_slope(self.expressions);
        let mut sampled = 0;
        for point in sample_points(region).take(max_points) {
            let mut is_sampled = false;
            let Some((point, direction, error)) =
                nearest_surface_point(&mut surface_search, point.into(), jump.surface)
            else {
                continue;
            };
            let is_inside = (0..3).all(|i| region.min[i] <= point[i] && point[i] <= region.max[i]);
            // Where the second number is positive, the angle is continuous.
            let is_continuous = surface_search
                .duals_at(point.into())
                .nth(1)
                .is_some_and(|other| other.value >= 0.0);
            if !is_inside || is_continuous {
                sampled += 1;
                continue;
            }
            // A value that holds on the surface only is not sampled: samples are beside it.
            let offset = direction * SIDE_OFFSET * coordinate_scale(point);
            for side in [1.0, -1.0] {
                let side_point = point + offset * side;
                let duals: Vec<Dual<f64>> = sides.duals_at(side_point.into()).collect();
                let &[near_side, far_side] = duals.as_slice() else {
                    continue;
                };
                let slope = slope_bound.unwrap_or_else(|| {
                    gradient(near_side)
                        .length()
                        .max(gradient(far_side).length())
                });
                let (near_side, far_side) = (near_side.value, far_side.value);
                let error = error + SIDE_OFFSET * coordinate_scale(point);
                let rounding = ROUNDING_FRACTION * (1.0 + near_side.abs().max(far_side.abs()));
                if (near_side - far_side).abs() > 4.0 * slope * error + rounding {
                    return true;
                }
                is_sampled |= near_side.is_finite() && far_side.is_finite();
            }
            sampled += usize::from(is_sampled);
        }
        sampled < MIN_CONCLUSIVE_SAMPLES
    }

    /// Builds the step; `ends` are distances by the bounds of the number over all of its pieces.
    fn step(&mut self, jumps: &[Discontinuity], ends: &[ExprId]) -> ExprId {
        let mut nearest: Vec<NearestSurface> = jumps
            .iter()
            .map(|jump| self.nearest_surface(jump))
            .collect();
        let count = postorder(self.expressions, self.number, |_| false).len();
        let has_pieces = jumps.len() <= MAX_PIECES && count * jumps.len() <= MAX_PIECE_EXPRESSIONS;
        if has_pieces {
            nearest = nearest
                .iter()
                .map(|surface| self.with_choices(surface, &nearest))
                .collect();
        }
        let is_below = self.is_below(self.number);
        let mut step = self.distance_to_zero(self.number, &[]);
        for (index, surface) in nearest.iter().enumerate() {
            let mut surface_distance = surface.distance;
            if has_pieces {
                let piece = self.shifted_number(self.number, &[surface]);
                let mut distance = self.distance_to_zero(piece, &[surface]);
                for other in (0..jumps.len()).filter(|other| *other != index) {
                    let other_distance = self.shifted_number(nearest[other].distance, &[surface]);
                    let own_distance = self.shifted_number(surface.distance, &[&nearest[other]]);
                    let is_independent = (other_distance, own_distance)
                        == (nearest[other].distance, surface.distance);
                    let other_distance = match is_independent && jumps.len() == 2 {
                        // Both may be crossed at once, and the piece beyond the corner counts.
                        true => self.distance_beyond_corner(surface, &nearest[other], is_below),
                        false => other_distance,
                    };
                    distance = self.call(Op::Min, &[distance, other_distance]);
                }
                surface_distance =
                    self.distance_beyond(piece, is_below, [surface.distance, distance]);
            }
            step = self.call(Op::Min, &[step, surface_distance]);
            if let Some(next_distance) = surface.next_distance {
                step = self.call(Op::Min, &[step, next_distance]);
            }
        }
        for &end in ends {
            step = self.call(Op::Max, &[step, end]);
        }
        self.call(Op::Piecewise, &[self.number, step])
    }

    /// Returns a safe distance through two discontinuities whose surfaces do not depend on each other.
    fn distance_beyond_corner(
        &mut self,
        first: &NearestSurface,
        second: &NearestSurface,
        is_below: ExprId,
    ) -> ExprId {
        let corner_distance = self.call(Op::Max, &[first.distance, second.distance]);
        let piece = self.shifted_number(self.number, &[first, second]);
        let distance = self.distance_to_zero(piece, &[first, second]);
        self.distance_beyond(piece, is_below, [corner_distance, distance])
    }

    /// Returns the distance to the nearest surface of a discontinuity.
    fn nearest_distance(&mut self, jump: &Discontinuity) -> ExprId {
        let size = match jump.surface {
            JumpSurface::Zeros => self.call(Op::Abs, &[jump.number]),
            JumpSurface::BranchCut(x) => {
                let zero = self.expressions.constant(0.0);
                let positive_x = self.call(Op::Max, &[x, zero]);
                let [y, x] = [jump.number, positive_x].map(|v| self.call(Op::Mul, &[v, v]));
                let square = self.call(Op::Add, &[y, x]);
                self.call(Op::Sqrt, &[square])
            }
            JumpSurface::Integers => {
                let unit = self.expressions.constant(1.0);
                let fraction = self.call(Op::Fract, &[jump.number]);
                let one_minus_fraction = self.call(Op::Sub, &[unit, fraction]);
                self.call(Op::Min, &[fraction, one_minus_fraction])
            }
        };
        self.safe_distance(size, jump.slope)
    }

    /// Returns a distance within which a number changes by at most `size`.
    fn safe_distance(&mut self, size: ExprId, bound: LocalBound) -> ExprId {
        if let Some(slope) = bound.constant_slope(self.expressions) {
            return self.divide_by_slope(size, slope);
        }
        let distance = bound.distance_for_change(self.expressions, size);
        match bound.radius {
            Some(radius) => self.call(Op::Min, &[distance, radius]),
            None => distance,
        }
    }

    /// Returns the same surface. Where a choice excludes all of its operations, it is at least as far
    /// as the surface of the choice.
    fn with_choices<'a>(
        &mut self,
        surface: &NearestSurface<'a>,
        surfaces: &[NearestSurface],
    ) -> NearestSurface<'a> {
        let mut chosen = NearestSurface { ..*surface };
        for id in postorder(self.expressions, self.number, |_| false) {
            let Expression::Apply { op, values, .. } = self.expressions.get(id).clone() else {
                continue;
            };
            let (Op::Select, &[condition, first, second]) = (op, values.as_slice()) else {
                continue;
            };
            let is_choice = |other: &&NearestSurface| other.jump.operations.contains(&condition);
            let Some(choice) = surfaces.iter().find(is_choice) else {
                continue;
            };
            for (is_first, other) in [(true, second), (false, first)] {
                if !self.is_only_under(surface.jump, id, [condition, other]) {
                    continue;
                }
                let choice = [condition, choice.distance];
                chosen.distance = self.farther_if_excluded(chosen.distance, choice, is_first);
                let next = chosen
                    .next_distance
                    .map(|next| self.farther_if_excluded(next, choice, is_first));
                chosen.next_distance = next;
            }
        }
        chosen
    }

    /// Returns a distance, or the maximum with that of a choice's surface where the choice excludes its
    /// first or second operand.
    fn farther_if_excluded(
        &mut self,
        distance: ExprId,
        choice: [ExprId; 2],
        is_first: bool,
    ) -> ExprId {
        let [condition, choice_distance] = choice;
        let excluded = self.call(Op::Max, &[distance, choice_distance]);
        let [first, second] = if is_first {
            [distance, excluded]
        } else {
            [excluded, distance]
        };
        self.call(Op::Select, &[condition, first, second])
    }

    /// Reports whether all uses of a jump's operations in the number are through one operand of a
    /// choice. `others` are the choice's other operands.
    fn is_only_under(&self, jump: &Discontinuity, choice: ExprId, others: [ExprId; 2]) -> bool {
        let is_in = |id: &ExprId| jump.operations.contains(id);
        [self.number, others[0], others[1]].into_iter().all(|root| {
            let order = postorder(self.expressions, root, |id| id == choice);
            !order.iter().any(is_in)
        })
    }

    /// Returns the nearest surface of a discontinuity.
    fn nearest_surface<'a>(&mut self, jump: &'a Discontinuity) -> NearestSurface<'a> {
        let distance = self.nearest_distance(jump);
        let JumpSurface::Integers = jump.surface else {
            return NearestSurface {
                jump,
                distance,
                next_distance: None,
                shift: self.branch_cut_shift(jump),
            };
        };
        let [half, one, two] = [0.5, 1.0, 2.0].map(|value| self.expressions.constant(value));
        let fraction = self.call(Op::Fract, &[jump.number]);
        let one_minus_fraction = self.call(Op::Sub, &[one, fraction]);
        let next = self.call(Op::Max, &[fraction, one_minus_fraction]);
        let is_above = self.call(Op::Less, &[half, fraction]);
        let twice = self.call(Op::Mul, &[is_above, two]);
        NearestSurface {
            jump,
            distance,
            next_distance: Some(self.safe_distance(next, jump.slope)),
            shift: Some(self.call(Op::Sub, &[twice, one])),
        }
    }

    /// Returns the difference of an angle beyond its branch cut.
    fn branch_cut_shift(&mut self, jump: &Discontinuity) -> Option<ExprId> {
        let JumpSurface::BranchCut(_) = jump.surface else {
            return None;
        };
        let turns = [std::f64::consts::TAU, -std::f64::consts::TAU];
        let [full_turn, negative_turn] = turns.map(|turn| self.expressions.constant(turn));
        let is_below = self.is_below(jump.number);
        Some(self.call(Op::Select, &[is_below, full_turn, negative_turn]))
    }

    /// Returns a safe distance into a piece: at least `distance`, and at least `distance_in_piece` if that
    /// piece has the same sign.
    fn distance_beyond(
        &mut self,
        piece: ExprId,
        is_below: ExprId,
        [distance, distance_in_piece]: [ExprId; 2],
    ) -> ExprId {
        let is_other_below = self.is_below(piece);
        let change = self.call(Op::Sub, &[is_below, is_other_below]);
        let changes = self.call(Op::Abs, &[change]);
        let combined = self.call(Op::Max, &[distance, distance_in_piece]);
        self.call(Op::Select, &[changes, distance, combined])
    }

    /// Returns a number with other values of the operations that are discontinuous at some surfaces.
    fn shifted_number(&mut self, number: ExprId, surfaces: &[&NearestSurface]) -> ExprId {
        let mut shifts: HashMap<ExprId, Option<ExprId>> = HashMap::new();
        for surface in surfaces {
            shifts.extend(
                surface
                    .jump
                    .operations
                    .iter()
                    .map(|&id| (id, surface.shift)),
            );
        }
        rewrite_number(self.expressions, number, |e, id, written, values| {
            match (shifts.get(&id), e.get(id)) {
                (Some(&shift), &Expression::Apply { op, .. }) => {
                    shifted_operation(e, written, op, values, shift)
                }
                _ => written,
            }
        })
    }

    /// Returns the distance to a change of sign by a value, with operations as beyond some surfaces.
    fn distance_to_zero(&mut self, piece: ExprId, surfaces: &[&NearestSurface]) -> ExprId {
        let size = self.call(Op::Abs, &[piece]);
        let bound = self.slope;
        let mut shift = |id: ExprId| self.shifted_number(id, surfaces);
        let shifted_bound = LocalBound {
            slope: shift(bound.slope),
            curvature: bound.curvature.map(&mut shift),
            growth: bound.growth.map(&mut shift),
            radius: bound.radius.map(&mut shift),
        };
        self.safe_distance(size, shifted_bound)
    }

    fn is_below(&mut self, id: ExprId) -> ExprId {
        let zero = self.expressions.constant(0.0);
        self.call(Op::Less, &[id, zero])
    }

    fn divide_by_slope(&mut self, id: ExprId, slope: f64) -> ExprId {
        let factor = self.expressions.constant(1.0 / slope);
        self.call(Op::Mul, &[id, factor])
    }

    fn call(&mut self, op: Op, values: &[ExprId]) -> ExprId {
        self.expressions.call(op, values)
    }
}

/// Returns the result of an operation beyond a discontinuity.
fn shifted_operation(
    expressions: &mut Expressions,
    id: ExprId,
    op: Op,
    values: &[ExprId],
    shift: Option<ExprId>,
) -> ExprId {
    match (op, shift) {
        (Op::Fract, Some(shift)) => expressions.call(Op::Sub, &[id, shift]),
        (Op::Modulo, Some(shift)) => {
            let divisor_shift = expressions.call(Op::Mul, &[shift, values[1]]);
            expressions.call(Op::Sub, &[id, divisor_shift])
        }
        (_, Some(shift)) => expressions.call(Op::Add, &[id, shift]),
        (_, None) => {
            let unit = expressions.constant(1.0);
            expressions.call(Op::Sub, &[unit, id])
        }
    }
}
