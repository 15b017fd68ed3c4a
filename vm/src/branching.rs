//! Intervals that evaluate both sides of a discontinuity.
//!
//! On a box that contains a cell boundary of a repetition, the floor of a coordinate is one of two integers.
//! An [`Interval`] can only represent the range between them, and results computed from that range are
//! useless, however small the box is. A [`BranchInterval`] is an interval whose floors and selections are
//! *decided*, one alternative after another. [`eval_all_branches`] runs a computation once per combination of
//! decisions and returns the hull of all results.
//!
//! Equal decisions must have equal results: the eight neighbours of a cell use the same floor. So every
//! number has an identity, a hash of its expression over coordinates and constants. Equal identities mean
//! equal expressions (except for collisions of 64 bits), and therefore equal results. At most
//! [`MAX_OPEN_BRANCHES`] decisions are enumerated. Further ones use hulls, as intervals do. Every result is
//! a valid bound in any case.

use crate::interval::{Interval, Tristate};
use crate::real::{Real, lit};
use crate::vector::{V2, V3};
use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Maximum number of enumerated decisions; [`eval_all_branches`] runs at most `2^MAX_OPEN_BRANCHES` times.
pub const MAX_OPEN_BRANCHES: usize = 8;

/// An interval with the identity of its expression.
#[derive(Clone, Copy, Debug)]
pub struct BranchInterval {
    /// The range of the value.
    pub range: Interval,
    identity: u64,
}

/// The three-valued result of a comparison, with its identity.
#[derive(Clone, Copy, Debug)]
pub struct BranchCondition {
    known: Tristate,
    identity: u64,
}

impl BranchCondition {
    /// Returns the condition with this result, if there is one.
    fn decided(self, answer: Option<bool>) -> Self {
        let known = answer.map_or(self.known, |holds| Tristate {
            can_be_true: holds,
            can_be_false: !holds,
        });
        Self { known, ..self }
    }
}

/// The decisions of the current run.
struct Decisions {
    /// The decisions made so far, by identity.
    made: Vec<(u64, bool)>,
    /// Maximum number of decisions.
    limit: usize,
    /// Number of undecided branches that used a hull.
    undecided: u64,
}

thread_local! {
    static DECISIONS: RefCell<Decisions> = const {
        RefCell::new(Decisions { made: Vec::new(), limit: 0, undecided: 0 })
    };
}

/// Returns the decision of a branch with two alternatives; `None` if it must use a hull.
fn decide(identity: u64) -> Option<bool> {
    DECISIONS.with_borrow_mut(|decisions| {
        let known = decisions.made.iter().find(|given| given.0 == identity);
        if let Some(&(_, answer)) = known {
            return Some(answer);
        }
        if decisions.made.len() >= decisions.limit {
            decisions.undecided += 1;
            return None;
        }
        decisions.made.push((identity, false));
        Some(false)
    })
}

/// Reports whether branches are decided rather than replaced by hulls.
fn is_branching() -> bool {
    DECISIONS.with_borrow(|decisions| decisions.limit > 0)
}

fn count_undecided() {
    DECISIONS.with_borrow_mut(|decisions| decisions.undecided += 1);
}

/// Runs a computation once, with hulls in place of all decisions, as [`Interval`] does. The second result
/// is true if no floor, selection or angle was undecided. On this box, the computation is then a continuous
/// function with the derivatives of its formula.
pub fn eval_hull(run: impl FnOnce() -> BranchInterval) -> (Interval, bool) {
    DECISIONS.with_borrow_mut(|decisions| {
        decisions.made.clear();
        decisions.limit = 0;
        decisions.undecided = 0;
    });
    let range = run().range;
    (
        range,
        DECISIONS.with_borrow(|decisions| decisions.undecided == 0),
    )
}

/// Runs a computation for all combinations of decisions and returns the hull of the results. Stops early,
/// with a partial hull, once the hull contains zero.
pub fn eval_all_branches(mut run: impl FnMut() -> BranchInterval) -> Interval {
    DECISIONS.with_borrow_mut(|decisions| {
        decisions.made.clear();
        decisions.limit = MAX_OPEN_BRANCHES;
    });
    let mut hull_so_far: Option<Interval> = None;
    loop {
        let range = run().range;
        let hull = hull_so_far.map_or(range, |all| all.hull(range));
        if hull.contains(0.0) || !next_decisions() {
            return hull;
        }
        hull_so_far = Some(hull);
    }
}

/// Changes the last decision to its other alternative; reports whether there was one left.
fn next_decisions() -> bool {
    DECISIONS.with_borrow_mut(|decisions| {
        while let Some((identity, answer)) = decisions.made.pop() {
            if !answer {
                decisions.made.push((identity, true));
                return true;
            }
        }
        false
    })
}

/// Returns the hash of an expression from the tag of its operation and the identities of its operands.
#[inline(always)]
fn hash_expr(tag: u64, from: [u64; 3]) -> u64 {
    let mut hash = tag.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    for part in from {
        hash = (hash.rotate_left(23) ^ part).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        hash ^= hash >> 29;
    }
    hash
}

/// Tags of operations.
mod op_tag {
    pub(super) const CONSTANT: u64 = 1;
    pub(super) const COORDINATE: u64 = 2;
    pub(super) const ADD: u64 = 3;
    pub(super) const SUB: u64 = 4;
    pub(super) const MUL: u64 = 5;
    pub(super) const DIV: u64 = 6;
    pub(super) const NEG: u64 = 7;
    pub(super) const ABS: u64 = 8;
    pub(super) const SQRT: u64 = 9;
    pub(super) const SQUARE: u64 = 10;
    pub(super) const FLOOR: u64 = 11;
    pub(super) const MIN: u64 = 12;
    pub(super) const MAX: u64 = 13;
    pub(super) const SIN: u64 = 14;
    pub(super) const COS: u64 = 15;
    pub(super) const ATAN2: u64 = 16;
    pub(super) const EXP2: u64 = 17;
    pub(super) const LOG2: u64 = 18;
    pub(super) const POWER_OF_TWO: u64 = 19;
    pub(super) const EXPONENT: u64 = 20;
    pub(super) const MANTISSA: u64 = 21;
    pub(super) const LATTICE: u64 = 22;
    pub(super) const NOISE: u64 = 23;
    pub(super) const LESS: u64 = 24;
    pub(super) const AND: u64 = 25;
    pub(super) const OR: u64 = 26;
    pub(super) const NOT: u64 = 27;
    pub(super) const SELECT: u64 = 28;
    pub(super) const AXIS: u64 = 29;
    pub(super) const LATTICE_EDGE: u64 = 30;
    pub(super) const ELLIPSOID: u64 = 31;
}

impl BranchInterval {
    /// Creates a point whose coordinates lie in these intervals.
    pub fn point(axes: [Interval; 3]) -> V3<Self> {
        let [x, y, z] = [0, 1, 2].map(|axis| Self {
            range: axes[axis],
            identity: hash_expr(op_tag::COORDINATE, [axis as u64, 0, 0]),
        });
        V3::new(x, y, z)
    }
    #[inline(always)]
    fn new(range: Interval, tag: u64, from: [u64; 3]) -> Self {
        Self {
            range,
            identity: hash_expr(tag, from),
        }
    }
    #[inline(always)]
    fn unary(self, range: Interval, tag: u64) -> Self {
        Self::new(range, tag, [self.identity, 0, 0])
    }
    #[inline(always)]
    fn binary(self, other: Self, range: Interval, tag: u64) -> Self {
        Self::new(range, tag, [self.identity, other.identity, 0])
    }
    /// Returns the components of a vector that was computed from a point and a number.
    fn components(v: V3<Interval>, tag: u64, p: V3<Self>, seed: Self) -> V3<Self> {
        let point_hash = hash_expr(tag, [p.x.identity, p.y.identity, p.z.identity]);
        let part = |range, axis| Self::new(range, op_tag::AXIS, [point_hash, seed.identity, axis]);
        V3::new(part(v.x, 0), part(v.y, 1), part(v.z, 2))
    }
    fn ranges(p: V3<Self>) -> V3<Interval> {
        V3::new(p.x.range, p.y.range, p.z.range)
    }
}

impl Add for BranchInterval {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.binary(other, self.range + other.range, op_tag::ADD)
    }
}
impl Sub for BranchInterval {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.binary(other, self.range - other.range, op_tag::SUB)
    }
}
impl Mul for BranchInterval {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.binary(other, self.range * other.range, op_tag::MUL)
    }
}
impl Div for BranchInterval {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.binary(other, self.range / other.range, op_tag::DIV)
    }
}
impl Neg for BranchInterval {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.unary(-self.range, op_tag::NEG)
    }
}

impl Real for BranchInterval {
    type Bool = BranchCondition;
    type Vec2 = V2<Self>;
    type Vec3 = V3<Self>;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::new(
            Interval::point(value),
            op_tag::CONSTANT,
            [value.to_bits(), 0, 0],
        )
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.unary(self.range.abs(), op_tag::ABS)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.unary(self.range.sqrt(), op_tag::SQRT)
    }
    #[inline(always)]
    fn square(self) -> Self {
        self.unary(self.range.square(), op_tag::SQUARE)
    }
    fn floor(self) -> Self {
        let floors = self.range.floor();
        let floor = self.unary(floors, op_tag::FLOOR);
        if floors.lo == floors.hi {
            return floor;
        }
        if floors.hi - floors.lo != 1.0 {
            count_undecided();
            return floor;
        }
        match decide(floor.identity) {
            None => floor,
            Some(upper) => Self {
                range: Interval::point(if upper { floors.hi } else { floors.lo }),
                ..floor
            },
        }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.binary(other, self.range.min(other.range), op_tag::MIN)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.binary(other, self.range.max(other.range), op_tag::MAX)
    }
    #[inline(always)]
    fn sin(self) -> Self {
        self.unary(self.range.sin(), op_tag::SIN)
    }
    #[inline(always)]
    fn cos(self) -> Self {
        self.unary(self.range.cos(), op_tag::COS)
    }
    fn atan2(self, x: Self) -> Self {
        let angle = |y: Interval| self.binary(x, y.atan2(x.range), op_tag::ATAN2);
        let y = self.range;
        if x.range.lo > 0.0 || y.lo > 0.0 || y.hi < 0.0 {
            return angle(y);
        }
        // The angle is discontinuous on the negative x axis, and its slope is unbounded at the origin.
        if x.range.hi >= 0.0 {
            count_undecided();
            return angle(y);
        }
        let above = Interval {
            lo: f64::MIN_POSITIVE,
            hi: y.hi.max(f64::MIN_POSITIVE),
        };
        let below = Interval {
            lo: y.lo.min(-f64::MIN_POSITIVE),
            hi: -f64::MIN_POSITIVE,
        };
        match decide(angle(y).identity) {
            None => angle(y),
            Some(true) => angle(below),
            Some(false) => angle(above),
        }
    }
    #[inline(always)]
    fn exp2(self) -> Self {
        self.unary(self.range.exp2(), op_tag::EXP2)
    }
    #[inline(always)]
    fn log2(self) -> Self {
        self.unary(self.range.log2(), op_tag::LOG2)
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        self.unary(self.range.power_of_two(), op_tag::POWER_OF_TWO)
    }
    fn exponent(self) -> Self {
        let range = self.range.exponent();
        if range.lo != range.hi {
            count_undecided();
        }
        self.unary(range, op_tag::EXPONENT)
    }
    fn mantissa(self) -> Self {
        count_undecided();
        self.unary(self.range.mantissa(), op_tag::MANTISSA)
    }
    fn lattice(cell: V3<Self>, seed: Self) -> V3<Self> {
        let random = Interval::lattice(Self::ranges(cell), seed.range);
        if random.x.lo != random.x.hi {
            count_undecided();
        }
        Self::components(random, op_tag::LATTICE, cell, seed)
    }
    fn noise_corner_gradient(cell: V3<Self>, seed: Self) -> V3<Self> {
        let random = Interval::noise_corner_gradient(Self::ranges(cell), seed.range);
        if random.x.lo != random.x.hi {
            count_undecided();
        }
        Self::components(random, op_tag::LATTICE_EDGE, cell, seed)
    }
    fn ellipsoid_gradient(p: V3<Self>, r: V3<Self>) -> (Self, V3<Self>) {
        let (value, gradient) = Interval::ellipsoid_gradient(Self::ranges(p), Self::ranges(r));
        let gradient = Self::components(gradient, op_tag::ELLIPSOID, p, r.x);
        let point_hash = hash_expr(
            op_tag::ELLIPSOID,
            [r.x.identity, r.y.identity, r.z.identity],
        );
        let value = Self::new(
            value,
            op_tag::ELLIPSOID,
            [gradient.x.identity, point_hash, 0],
        );
        (value, gradient)
    }
    fn noise_slope(p: V3<Self>, seed: Self) -> V3<Self> {
        Self::noise_gradient(p, seed).1
    }
    fn noise_gradient(p: V3<Self>, seed: Self) -> (Self, V3<Self>) {
        // Noise and its gradient are continuous: there is nothing to decide.
        let (value, gradient) = Interval::noise_gradient(Self::ranges(p), seed.range);
        let gradient = Self::components(gradient, op_tag::NOISE, p, seed);
        let value = Self::new(value, op_tag::NOISE, [gradient.x.identity, 0, 0]);
        (value, gradient)
    }
    #[inline(always)]
    fn unit_component(self) -> Self {
        self.clamp(lit(-1.0), lit(1.0))
    }
    fn less(self, other: Self) -> BranchCondition {
        let condition = BranchCondition {
            known: self.range.less(other.range),
            identity: hash_expr(op_tag::LESS, [self.identity, other.identity, 0]),
        };
        // Decided here and not in `select`, so that all results that depend on it agree. A point is never
        // both above and below the corner between two edges.
        let open = condition.known.can_be_true && condition.known.can_be_false;
        match open && is_branching() {
            true => condition.decided(decide(condition.identity)),
            false => condition,
        }
    }
    #[inline(always)]
    fn and(a: BranchCondition, b: BranchCondition) -> BranchCondition {
        BranchCondition {
            known: Interval::and(a.known, b.known),
            identity: hash_expr(op_tag::AND, [a.identity, b.identity, 0]),
        }
    }
    #[inline(always)]
    fn or(a: BranchCondition, b: BranchCondition) -> BranchCondition {
        BranchCondition {
            known: Interval::or(a.known, b.known),
            identity: hash_expr(op_tag::OR, [a.identity, b.identity, 0]),
        }
    }
    #[inline(always)]
    fn not(a: BranchCondition) -> BranchCondition {
        BranchCondition {
            known: Interval::not(a.known),
            identity: hash_expr(op_tag::NOT, [a.identity, 0, 0]),
        }
    }
    fn select(condition: BranchCondition, then: Self, otherwise: Self) -> Self {
        let Tristate {
            can_be_true: may,
            can_be_false: may_not,
        } = condition.known;
        if !may_not {
            return then;
        }
        if !may {
            return otherwise;
        }
        count_undecided();
        Self::new(
            then.range.hull(otherwise.range),
            op_tag::SELECT,
            [condition.identity, then.identity, otherwise.identity],
        )
    }
}
