//! Intervals that look at both sides of a jump.
//!
//! On a box that a seam of a repetition runs through, the floor of a coordinate is known to be one
//! of two numbers, but an [`Interval`] can only say that it lies between them, and what is computed
//! from that tells nothing, however small the box is. A [`Branching`] is an interval whose floors
//! and selections are *taken*, one way after the other: [`explore`] runs a computation once for
//! each way and gives the hull of all results.
//!
//! What is asked twice must be answered alike: the eight neighbours of a cell ask for the same
//! floor. So every number carries an identity, a hash of how it was computed from coordinates and
//! constants. Equal identities mean equal formulas (but for collisions of 64 bits), and therefore
//! equal answers. Where more than [`MOST`] questions are open, the rest are answered by hulls, as
//! intervals do; every result holds, whatever was answered how.

use crate::interval::{Interval, Known};
use crate::real::{Real, lit};
use crate::vector::{V2, V3};
use std::cell::RefCell;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// How many questions are answered both ways at once; [`explore`] runs at most `2^MOST` times.
pub const MOST: usize = 8;

/// An interval with the identity of its formula.
#[derive(Clone, Copy, Debug)]
pub struct Branching {
    /// What it lies between.
    pub range: Interval,
    identity: u64,
}

/// What is known of a comparison, with its identity.
#[derive(Clone, Copy, Debug)]
pub struct Condition {
    known: Known,
    identity: u64,
}

impl Condition {
    /// The same, of which the answer is known, if it is.
    fn answered(self, answer: Option<bool>) -> Self {
        let known = answer.map_or(self.known, |holds| Known {
            may: holds,
            may_not: !holds,
        });
        Self { known, ..self }
    }
}

/// The answers of the present run.
struct Answers {
    /// Questions that were answered, by identity.
    given: Vec<(u64, bool)>,
    /// How many may be.
    most: usize,
    /// How often a hull stood for an answer.
    hulls: u64,
}

thread_local! {
    static ANSWERS: RefCell<Answers> = const {
        RefCell::new(Answers { given: Vec::new(), most: 0, hulls: 0 })
    };
}

/// The answer to a question with two answers; `None` if it has to be a hull.
fn answer(identity: u64) -> Option<bool> {
    ANSWERS.with_borrow_mut(|answers| {
        let known = answers.given.iter().find(|given| given.0 == identity);
        if let Some(&(_, answer)) = known {
            return Some(answer);
        }
        if answers.given.len() >= answers.most {
            answers.hulls += 1;
            return None;
        }
        answers.given.push((identity, false));
        Some(false)
    })
}

/// Whether questions are answered, rather than left to hulls.
fn is_exploring() -> bool {
    ANSWERS.with_borrow(|answers| answers.most > 0)
}

fn count_hull() {
    ANSWERS.with_borrow_mut(|answers| answers.hulls += 1);
}

/// Runs a computation once, with hulls in place of all answers: what [`Interval`] gives. The second
/// result says whether it is *whole*: no floor, selection or angle in it was open, so that on this
/// box it is a continuous function with the derivatives of its formula.
pub fn hulled(run: impl FnOnce() -> Branching) -> (Interval, bool) {
    ANSWERS.with_borrow_mut(|answers| {
        answers.given.clear();
        answers.most = 0;
        answers.hulls = 0;
    });
    let range = run().range;
    (range, ANSWERS.with_borrow(|answers| answers.hulls == 0))
}

/// Runs a computation for all answers; gives the hull of its results, or of some of them if they
/// hold zero already.
pub fn explore(mut run: impl FnMut() -> Branching) -> Interval {
    ANSWERS.with_borrow_mut(|answers| {
        answers.given.clear();
        answers.most = MOST;
    });
    let mut all: Option<Interval> = None;
    loop {
        let range = run().range;
        let hull = all.map_or(range, |all| all.hull(range));
        if hull.contains(0.0) || !next_answers() {
            return hull;
        }
        all = Some(hull);
    }
}

/// Turns the last answer that was given one way to the other; whether there was one.
fn next_answers() -> bool {
    ANSWERS.with_borrow_mut(|answers| {
        while let Some((identity, answer)) = answers.given.pop() {
            if !answer {
                answers.given.push((identity, true));
                return true;
            }
        }
        false
    })
}

/// The identity of what is computed in this way from these.
#[inline(always)]
fn made(how: u64, from: [u64; 3]) -> u64 {
    let mut hash = how.wrapping_mul(0x9e37_79b9_7f4a_7c15);
    for part in from {
        hash = (hash.rotate_left(23) ^ part).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        hash ^= hash >> 29;
    }
    hash
}

/// Numbers for the ways of computing.
mod how {
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

impl Branching {
    /// A point whose coordinates lie in these intervals.
    pub fn point(axes: [Interval; 3]) -> V3<Self> {
        let [x, y, z] = [0, 1, 2].map(|axis| Self {
            range: axes[axis],
            identity: made(how::COORDINATE, [axis as u64, 0, 0]),
        });
        V3::of(x, y, z)
    }
    #[inline(always)]
    fn of(range: Interval, how: u64, from: [u64; 3]) -> Self {
        Self {
            range,
            identity: made(how, from),
        }
    }
    #[inline(always)]
    fn one(self, range: Interval, how: u64) -> Self {
        Self::of(range, how, [self.identity, 0, 0])
    }
    #[inline(always)]
    fn two(self, other: Self, range: Interval, how: u64) -> Self {
        Self::of(range, how, [self.identity, other.identity, 0])
    }
    /// The parts of a vector that was computed from a point and a number.
    fn parts(v: V3<Interval>, how: u64, p: V3<Self>, seed: Self) -> V3<Self> {
        let place = made(how, [p.x.identity, p.y.identity, p.z.identity]);
        let part = |range, axis| Self::of(range, how::AXIS, [place, seed.identity, axis]);
        V3::of(part(v.x, 0), part(v.y, 1), part(v.z, 2))
    }
    fn ranges(p: V3<Self>) -> V3<Interval> {
        V3::of(p.x.range, p.y.range, p.z.range)
    }
}

impl Add for Branching {
    type Output = Self;
    #[inline(always)]
    fn add(self, other: Self) -> Self {
        self.two(other, self.range + other.range, how::ADD)
    }
}
impl Sub for Branching {
    type Output = Self;
    #[inline(always)]
    fn sub(self, other: Self) -> Self {
        self.two(other, self.range - other.range, how::SUB)
    }
}
impl Mul for Branching {
    type Output = Self;
    #[inline(always)]
    fn mul(self, other: Self) -> Self {
        self.two(other, self.range * other.range, how::MUL)
    }
}
impl Div for Branching {
    type Output = Self;
    #[inline(always)]
    fn div(self, other: Self) -> Self {
        self.two(other, self.range / other.range, how::DIV)
    }
}
impl Neg for Branching {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        self.one(-self.range, how::NEG)
    }
}

impl Real for Branching {
    type Bool = Condition;
    type Vec2 = V2<Self>;
    type Vec3 = V3<Self>;

    #[inline(always)]
    fn constant(value: f64) -> Self {
        Self::of(
            Interval::point(value),
            how::CONSTANT,
            [value.to_bits(), 0, 0],
        )
    }
    #[inline(always)]
    fn abs(self) -> Self {
        self.one(self.range.abs(), how::ABS)
    }
    #[inline(always)]
    fn sqrt(self) -> Self {
        self.one(self.range.sqrt(), how::SQRT)
    }
    #[inline(always)]
    fn square(self) -> Self {
        self.one(self.range.square(), how::SQUARE)
    }
    fn floor(self) -> Self {
        let both = self.range.floor();
        let floor = self.one(both, how::FLOOR);
        if both.lo == both.hi {
            return floor;
        }
        if both.hi - both.lo != 1.0 {
            count_hull();
            return floor;
        }
        match answer(floor.identity) {
            None => floor,
            Some(upper) => Self {
                range: Interval::point(if upper { both.hi } else { both.lo }),
                ..floor
            },
        }
    }
    #[inline(always)]
    fn min(self, other: Self) -> Self {
        self.two(other, self.range.min(other.range), how::MIN)
    }
    #[inline(always)]
    fn max(self, other: Self) -> Self {
        self.two(other, self.range.max(other.range), how::MAX)
    }
    #[inline(always)]
    fn sin(self) -> Self {
        self.one(self.range.sin(), how::SIN)
    }
    #[inline(always)]
    fn cos(self) -> Self {
        self.one(self.range.cos(), how::COS)
    }
    fn atan2(self, x: Self) -> Self {
        let angle = |y: Interval| self.two(x, y.atan2(x.range), how::ATAN2);
        let y = self.range;
        if x.range.lo > 0.0 || y.lo > 0.0 || y.hi < 0.0 {
            return angle(y);
        }
        // The angle jumps on the negative x axis, and nothing is known of its slope at the origin.
        if x.range.hi >= 0.0 {
            count_hull();
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
        match answer(angle(y).identity) {
            None => angle(y),
            Some(true) => angle(below),
            Some(false) => angle(above),
        }
    }
    #[inline(always)]
    fn exp2(self) -> Self {
        self.one(self.range.exp2(), how::EXP2)
    }
    #[inline(always)]
    fn log2(self) -> Self {
        self.one(self.range.log2(), how::LOG2)
    }
    #[inline(always)]
    fn power_of_two(self) -> Self {
        self.one(self.range.power_of_two(), how::POWER_OF_TWO)
    }
    fn exponent(self) -> Self {
        let range = self.range.exponent();
        if range.lo != range.hi {
            count_hull();
        }
        self.one(range, how::EXPONENT)
    }
    fn mantissa(self) -> Self {
        count_hull();
        self.one(self.range.mantissa(), how::MANTISSA)
    }
    fn lattice(cell: V3<Self>, seed: Self) -> V3<Self> {
        let random = Interval::lattice(Self::ranges(cell), seed.range);
        if random.x.lo != random.x.hi {
            count_hull();
        }
        Self::parts(random, how::LATTICE, cell, seed)
    }
    fn lattice_edge(cell: V3<Self>, seed: Self) -> V3<Self> {
        let random = Interval::lattice_edge(Self::ranges(cell), seed.range);
        if random.x.lo != random.x.hi {
            count_hull();
        }
        Self::parts(random, how::LATTICE_EDGE, cell, seed)
    }
    fn ellipsoid_gradient(p: V3<Self>, r: V3<Self>) -> (Self, V3<Self>) {
        let (value, gradient) = Interval::ellipsoid_gradient(Self::ranges(p), Self::ranges(r));
        let gradient = Self::parts(gradient, how::ELLIPSOID, p, r.x);
        let place = made(how::ELLIPSOID, [r.x.identity, r.y.identity, r.z.identity]);
        let value = Self::of(value, how::ELLIPSOID, [gradient.x.identity, place, 0]);
        (value, gradient)
    }
    fn noise_slope(p: V3<Self>, seed: Self) -> V3<Self> {
        Self::noise_gradient(p, seed).1
    }
    fn noise_gradient(p: V3<Self>, seed: Self) -> (Self, V3<Self>) {
        // Noise and its gradient are continuous: there is nothing to ask.
        let (value, gradient) = Interval::noise_gradient(Self::ranges(p), seed.range);
        let gradient = Self::parts(gradient, how::NOISE, p, seed);
        let value = Self::of(value, how::NOISE, [gradient.x.identity, 0, 0]);
        (value, gradient)
    }
    #[inline(always)]
    fn unit_component(self) -> Self {
        self.clamp(lit(-1.0), lit(1.0))
    }
    fn less(self, other: Self) -> Condition {
        let condition = Condition {
            known: self.range.less(other.range),
            identity: made(how::LESS, [self.identity, other.identity, 0]),
        };
        // Answered here and not where it selects, so that all that is made of it agrees: a point is
        // never above and below the corner between two edges.
        let open = condition.known.may && condition.known.may_not;
        match open && is_exploring() {
            true => condition.answered(answer(condition.identity)),
            false => condition,
        }
    }
    #[inline(always)]
    fn and(a: Condition, b: Condition) -> Condition {
        Condition {
            known: Interval::and(a.known, b.known),
            identity: made(how::AND, [a.identity, b.identity, 0]),
        }
    }
    #[inline(always)]
    fn or(a: Condition, b: Condition) -> Condition {
        Condition {
            known: Interval::or(a.known, b.known),
            identity: made(how::OR, [a.identity, b.identity, 0]),
        }
    }
    #[inline(always)]
    fn not(a: Condition) -> Condition {
        Condition {
            known: Interval::not(a.known),
            identity: made(how::NOT, [a.identity, 0, 0]),
        }
    }
    fn select(condition: Condition, then: Self, otherwise: Self) -> Self {
        let Known { may, may_not } = condition.known;
        if !may_not {
            return then;
        }
        if !may {
            return otherwise;
        }
        count_hull();
        Self::of(
            then.range.hull(otherwise.range),
            how::SELECT,
            [condition.identity, then.identity, otherwise.identity],
        )
    }
}
