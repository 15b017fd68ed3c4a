//! Lipschitz bounds of shapes: how fast a shape's value, as it is written, changes within a region.
//!
//! A bound follows from the rules of the table, operand by operand, and from a search through boxes for
//! what a scene writes itself (fields, displacements, warps). It holds for all points of the region and
//! for all values of the parameters.

use super::held::Throughout;
use super::{
    Budget, Capped, Known, LOOSE, Ranges, bound, capped, has_jumps, pieces, steepest, tried,
};
use crate::bounds::{Boxes, World};
use crate::expression::{ExprId, Expressions};
use crate::range::range_over;
use crate::scene::{ShapeId, ShapeKind};
use sdfc_vm::apply::{Applied, apply, laid_out};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::ops::volumes;
use sdfc_vm::row::Slope;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::HashMap;

/// The Lipschitz bounds of a scene's shapes, each found when it is first wanted.
pub(crate) struct ShapeSlopes {
    ranges: Ranges,
    budget: Budget,
    /// Bounds of shapes that are the same in every region.
    everywhere: HashMap<ShapeId, f64>,
    /// Bounds of written numbers, by the corners of their region.
    searched: HashMap<(Vec<ExprId>, [u64; 6]), Option<f64>>,
    /// Guesses of the same.
    guessed: HashMap<(Vec<ExprId>, [u64; 6]), f64>,
    /// Whether a shape's bound depends on the region.
    varies: Vec<bool>,
    /// Whether numbers are found by trying points instead of bounds.
    is_guessing: bool,
    /// About half the size of what is seen.
    size: f64,
    /// The fields whose stated bound was tried; with where it does not hold, if it does not.
    stated: HashMap<ShapeId, Option<Refuted>>,
    /// The values by which rays march on fields without a bound, by the corners of their region.
    capped: HashMap<(ShapeId, [u64; 6]), Option<Capped>>,
    /// Steps on numbers that jump, by the corners of their region.
    stepped: HashMap<(ExprId, [u64; 6], Known), Option<ExprId>>,
}

/// A place at which a field is steeper than the scene states.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Refuted {
    /// The bound that is stated.
    pub(crate) stated: f64,
    /// The slope there.
    pub(crate) slope: f64,
    /// The place, in the frame of the field.
    pub(crate) place: [f64; 3],
}

/// The least excess over a stated slope that is no rounding, as a factor.
const REFUTES: f64 = 1.0 + 1e-6;
/// The half side of the cube in which an endless field is tried, in sizes of the scene.
const TRIED_CUBE: f64 = 4.0;

/// The corners of a region as keys.
fn corners(region: &Bounds) -> [u64; 6] {
    let [x, y, z] = region.min.map(f64::to_bits);
    let [u, v, w] = region.max.map(f64::to_bits);
    [x, y, z, u, v, w]
}

impl ShapeSlopes {
    pub(crate) fn new(world: World<'_>, size: f64) -> Self {
        Self {
            ranges: Ranges::of(world),
            budget: Budget::default(),
            everywhere: HashMap::new(),
            searched: HashMap::new(),
            guessed: HashMap::new(),
            varies: Vec::new(),
            is_guessing: false,
            size,
            stated: HashMap::new(),
            capped: HashMap::new(),
            stepped: HashMap::new(),
        }
    }

    /// About half the size of what is seen.
    pub(crate) fn size(&self) -> f64 {
        self.size
    }

    /// A bound of the shape's slope within a region, in the frame of the shape; infinite where none is
    /// known. Recursion over shapes within shapes, whose depth the elaborator bounds.
    pub(crate) fn within(
        &mut self,
        world: World<'_>,
        boxes: &mut Boxes,
        id: ShapeId,
        region: &Bounds,
    ) -> f64 {
        if !self.varies(world, id)
            && let Some(&known) = self.everywhere.get(&id)
        {
            return known;
        }
        let found = self.find(world, boxes, id, region);
        let found = if found >= 0.0 { found } else { f64::INFINITY };
        if !self.varies(world, id) {
            self.everywhere.insert(id, found);
        }
        found
    }

    /// A number to go by where a shape's slope has no bound in a region: twice as steep as nine tenths of the
    /// points are at which its written numbers are tried.
    pub(crate) fn guess(
        &mut self,
        world: World<'_>,
        boxes: &mut Boxes,
        id: ShapeId,
        region: &Bounds,
    ) -> f64 {
        self.is_guessing = true;
        let guess = self.find(world, boxes, id, region);
        self.is_guessing = false;
        if guess.is_finite() { guess } else { 1.0 }
    }

    /// The values by which rays march on a field whose slope has no bound in a region; see [`capped`].
    pub(crate) fn capped(
        &mut self,
        world: World<'_>,
        id: ShapeId,
        region: &Bounds,
    ) -> Option<Capped> {
        let ShapeKind::Field { value, .. } = world.shapes[id.0 as usize].kind else {
            return None;
        };
        let (graph, ranges) = (world.expressions, &self.ranges);
        *self
            .capped
            .entry((id, corners(region)))
            .or_insert_with(|| capped(graph, value, region, ranges))
    }

    /// Reports whether a bound of a number's slope in a region is far above its usual slope there: no ray could march by it.
    pub(crate) fn is_far_from_usual(
        &mut self,
        expressions: &Expressions,
        number: ExprId,
        bound: f64,
        region: &Bounds,
    ) -> bool {
        let throughout = Throughout {
            region,
            ranges: &self.ranges,
            budget: &mut self.budget,
        };
        let usual = throughout.usual(expressions, number);
        usual.is_some_and(|usual| bound > usual * LOOSE)
    }

    /// A written number that jumps, as a step that is safe in a region; see [`pieces`]. A number whose slope has a bound
    /// there does not jump.
    pub(crate) fn stepped(
        &mut self,
        expressions: &mut Expressions,
        number: ExprId,
        region: &Bounds,
        known: Known,
    ) -> Option<ExprId> {
        if known == Known::Throughout && !has_jumps(expressions, number) {
            return None;
        }
        let key = (number, corners(region), known);
        if let Some(&step) = self.stepped.get(&key) {
            return step;
        }
        let seen = self.seen(region);
        let step = match self.proved(expressions, &[number], region) {
            Some(_) => None,
            None => {
                let (ranges, budget) = (&self.ranges, &mut self.budget);
                pieces::step(expressions, number, known, [region, &seen], ranges, budget)
            }
        };
        self.stepped.insert(key, step);
        step
    }

    /// Whether a shape's bound depends on the region.
    pub(crate) fn varies(&mut self, world: World<'_>, id: ShapeId) -> bool {
        while self.varies.len() <= id.0 as usize {
            let kind = &world.shapes[self.varies.len()].kind;
            let own = match kind {
                ShapeKind::Field { .. } | ShapeKind::Warp { .. } | ShapeKind::Displace { .. } => {
                    true
                }
                ShapeKind::Domain { op, .. } => matches!(op, Op::Twist | Op::Bend),
                _ => false,
            };
            let varies = own
                || crate::scene::children(kind)
                    .iter()
                    .any(|child| self.varies[child.0 as usize]);
            self.varies.push(varies);
        }
        self.varies[id.0 as usize]
    }

    fn find(&mut self, world: World<'_>, boxes: &mut Boxes, id: ShapeId, region: &Bounds) -> f64 {
        match &world.shapes[id.0 as usize].kind {
            ShapeKind::Primitive { op, parameters } => {
                self.by_rule(world, *op, parameters, [0.0; 0])
            }
            ShapeKind::Polygon { .. } => 1.0,
            ShapeKind::Nothing => 0.0,
            ShapeKind::Field { value, slope, .. } => {
                let found = self.written(world, &[*value], region);
                let Some(slope) = slope else { return found };
                match self.refuted(world, boxes, id, *value, *slope) {
                    Some(refuted) if self.is_guessing => found.max(refuted.slope),
                    Some(_) => found,
                    // Either of two bounds holds.
                    None if self.is_stated_for(world, boxes, id, region) => {
                        found.min(self.range(world, *slope).hi)
                    }
                    None => found,
                }
            }
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } => {
                let first = self.within(world, boxes, children[0], region);
                children[1..].iter().fold(first, |sum, &child| {
                    let next = self.within(world, boxes, child, region);
                    self.by_rule(world, *op, parameters, [sum, next])
                })
            }
            // The scale makes up for what the matrix stretches; see `ShapeKind::Frame`.
            ShapeKind::Frame { child, matrix, .. } => {
                let inner = self.framed(world, matrix, region);
                self.within(world, boxes, *child, &inner)
            }
            ShapeKind::Repeat { child, .. } => {
                let inner = boxes.cell_of(world, id).common(region);
                let inner = if inner.is_empty() { *region } else { inner };
                self.within(world, boxes, *child, &inner)
            }
            ShapeKind::Polar { child, .. } => {
                let inner = turned(region, world.shapes[id.0 as usize].plane);
                self.within(world, boxes, *child, &inner)
            }
            ShapeKind::Domain {
                op,
                child,
                parameters,
            } => {
                let (stretch, inner) = self.mapped(world, *op, parameters, region);
                stretch * self.within(world, boxes, *child, &inner)
            }
            ShapeKind::Warp { child, point } => {
                let stretch = self.written(world, point, region);
                let mut inner = *region;
                for (axis, &number) in point.iter().enumerate() {
                    let range = range_over(world.expressions, number, region, &self.ranges);
                    (inner.min[axis], inner.max[axis]) = (range.lo, range.hi);
                }
                stretch * self.within(world, boxes, *child, &inner)
            }
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => {
                let inner = self.within(world, boxes, *child, region);
                self.by_rule(world, *op, parameters, [inner])
            }
            ShapeKind::Displace { child, amount } => {
                let amount = self.written(world, &[*amount], region);
                amount + self.within(world, boxes, *child, region)
            }
            ShapeKind::Painted { child, .. } => self.within(world, boxes, *child, region),
        }
    }

    /// The place of a field that is steeper than the scene states, as far as points that are tried show.
    fn refuted(
        &mut self,
        world: World<'_>,
        boxes: &mut Boxes,
        id: ShapeId,
        value: ExprId,
        slope: ExprId,
    ) -> Option<Refuted> {
        if let Some(known) = self.stated.get(&id) {
            return *known;
        }
        let stated = self.range(world, slope).hi;
        let region = self.seen(&near(&boxes.of(world, id)));
        let refuted = steepest(world.expressions, &[value], &region, &self.ranges)
            .filter(|(slope, _)| *slope > stated * REFUTES)
            .map(|(slope, place)| Refuted {
                stated,
                slope,
                place,
            });
        self.stated.insert(id, refuted);
        refuted
    }

    /// The part of a region in which points are tried.
    fn seen(&self, region: &Bounds) -> Bounds {
        match region.is_finite() {
            true => *region,
            false => region.common(&Bounds::centred([self.size * TRIED_CUBE; 3])),
        }
    }

    /// Tells if a stated bound may be used in a region of a field's frame.
    ///
    /// A field that ends may rise ever faster farther out, where nobody thought of its bound: there the bound
    /// is not used. Of an endless field it is taken to hold everywhere.
    fn is_stated_for(
        &self,
        world: World<'_>,
        boxes: &mut Boxes,
        id: ShapeId,
        region: &Bounds,
    ) -> bool {
        let bounds = boxes.of(world, id);
        if !bounds.is_finite() {
            return true;
        }
        let around = bounds.grown(bounds.half_diagonal());
        (0..3).all(|axis| {
            around.min[axis] <= region.min[axis] && region.max[axis] <= around.max[axis]
        })
    }

    /// The fields whose stated bounds do not hold, in order.
    pub(crate) fn all_refuted(&self) -> Vec<(ShapeId, Refuted)> {
        let refuted = self
            .stated
            .iter()
            .filter_map(|(&id, refuted)| Some((id, (*refuted)?)));
        let mut refuted: Vec<_> = refuted.collect();
        refuted.sort_by_key(|(id, _)| *id);
        refuted
    }

    /// The bound that a row's rule gives for operands with these bounds, for all values of its parameters.
    fn by_rule<const N: usize>(
        &mut self,
        world: World<'_>,
        op: Op,
        parameters: &[ExprId],
        operands: [f64; N],
    ) -> f64 {
        let largest = operands.iter().copied().fold(0.0, f64::max);
        let ends = || self.ends(world, parameters);
        match op.row().meta.slope {
            Slope::Constant(slope) => slope,
            Slope::Of(slope) => greatest(&ends(), slope),
            Slope::Largest(factor) => largest * factor,
            Slope::LargestOrOne | Slope::Step => largest.max(1.0),
            Slope::Sum => operands.iter().sum(),
            Slope::Norm => operands.iter().map(|v| v * v).sum::<f64>().sqrt(),
            Slope::Plus(more) => largest + greatest(&ends(), more),
            Slope::Times(factor) => largest * greatest(&ends(), factor),
            Slope::Stretch(_) | Slope::Unknown => f64::INFINITY,
        }
    }

    /// How much a row that moves points stretches a region, and where its points come to lie.
    fn mapped(
        &mut self,
        world: World<'_>,
        op: Op,
        parameters: &[ExprId],
        region: &Bounds,
    ) -> (f64, Bounds) {
        let Slope::Stretch(stretch) = op.row().meta.slope else {
            return (f64::INFINITY, Bounds::EVERYTHING);
        };
        let most = greatest(&self.ends(world, parameters), |numbers| {
            stretch(numbers, region)
        });
        let inner = match op {
            Op::Twist => volumes::polar(&[], region),
            Op::Bend => volumes::polar_plane(&[], region),
            _ => self.image(world, op, parameters, region),
        };
        (most.max(1.0), inner)
    }

    /// The box that a row maps a region into, by interval arithmetic.
    fn image(
        &mut self,
        world: World<'_>,
        op: Op,
        parameters: &[ExprId],
        region: &Bounds,
    ) -> Bounds {
        let numbers: Vec<Interval> = parameters.iter().map(|&id| self.range(world, id)).collect();
        if numbers.iter().any(|range| range.lo != range.hi) {
            return Bounds::EVERYTHING;
        }
        let numbers: Vec<f64> = numbers.iter().map(|range| range.lo).collect();
        let [x, y, z] = [0, 1, 2].map(|axis| Interval {
            lo: region.min[axis],
            hi: region.max[axis],
        });
        let none = [Interval::point(0.0); 3];
        match apply(op, V3::of(x, y, z), none, &laid_out(op, &numbers)) {
            Applied::Point(p) => Bounds {
                min: [p.x.lo, p.y.lo, p.z.lo],
                max: [p.x.hi, p.y.hi, p.z.hi],
            },
            Applied::Value(_) => Bounds::EVERYTHING,
        }
    }

    /// A region as a frame of its own sees it.
    fn framed(&mut self, world: World<'_>, matrix: &[ExprId; 12], region: &Bounds) -> Bounds {
        let rows = matrix.map(|id| self.range(world, id));
        if rows.iter().all(|range| range.lo == range.hi) {
            let rows = rows.map(|range| range.lo);
            return region.mapped(&std::array::from_fn(|row| {
                std::array::from_fn(|column| rows[4 * row + column])
            }));
        }
        let side = |axis: usize| Interval {
            lo: region.min[axis],
            hi: region.max[axis],
        };
        let place = |row: usize| {
            let of = |axis: usize| match rows[4 * row + axis] {
                Interval { lo: 0.0, hi: 0.0 } => Interval::point(0.0),
                factor => factor * side(axis),
            };
            of(0) + of(1) + of(2) + rows[4 * row + 3]
        };
        let places = [0, 1, 2].map(place);
        Bounds {
            min: places.map(|range| range.lo),
            max: places.map(|range| range.hi),
        }
    }

    /// A bound of the slope of numbers of point stage, or a guess; infinite where none is known.
    fn written(&mut self, world: World<'_>, numbers: &[ExprId], region: &Bounds) -> f64 {
        if let Some(bound) = self.proved(world.expressions, numbers, region) {
            return bound;
        }
        if !self.is_guessing {
            return f64::INFINITY;
        }
        let key = (numbers.to_vec(), corners(region));
        let (graph, ranges) = (world.expressions, &self.ranges);
        let guess = self.guessed.entry(key);
        *guess.or_insert_with(|| tried(graph, numbers, region, ranges).max(MIN_SLOPE))
    }

    /// A bound of the slope of numbers of point stage, searched once for each region.
    fn proved(
        &mut self,
        expressions: &Expressions,
        numbers: &[ExprId],
        region: &Bounds,
    ) -> Option<f64> {
        let key = (numbers.to_vec(), corners(region));
        if let Some(&known) = self.searched.get(&key) {
            return known;
        }
        let seen = self.seen(region);
        let (ranges, budget) = (&self.ranges, &mut self.budget);
        let found = bound(expressions, numbers, region, ranges, budget);
        let found = found.or_else(|| match numbers {
            &[number] if has_jumps(expressions, number) => {
                pieces::continuous(expressions, number, [region, &seen], ranges, budget)
            }
            _ => None,
        });
        let found = found.map(|slope| slope.max(MIN_SLOPE));
        self.searched.insert(key, found);
        found
    }

    /// All values that a number which no point changes may have.
    fn range(&self, world: World<'_>, id: ExprId) -> Interval {
        self.ranges.of_number(world.expressions, id)
    }

    /// The least and the greatest of each parameter: rules grow with their magnitudes, so the ends decide.
    fn ends(&self, world: World<'_>, parameters: &[ExprId]) -> [Vec<f64>; 2] {
        let ranges: Vec<_> = parameters.iter().map(|&id| self.range(world, id)).collect();
        [
            ranges.iter().map(|range| range.lo).collect(),
            ranges.iter().map(|range| range.hi).collect(),
        ]
    }
}

/// The distance around its box in which a shape's own value is used, as a fraction of the box's half diagonal.
const MARGIN: f64 = 0.1;

/// The region around a shape's box in which its own value is used.
pub(crate) fn near(bounds: &Bounds) -> Bounds {
    match bounds.is_finite() {
        true => bounds.grown(margin(bounds)),
        false => *bounds,
    }
}

/// The distance around a shape's box in which its own value is used.
pub(crate) fn margin(bounds: &Bounds) -> f64 {
    bounds.half_diagonal() * MARGIN
}

/// The least slope that a value is divided by.
const MIN_SLOPE: f64 = 1e-30;

/// The greater of a rule's results at both ends of its parameters.
fn greatest(ends: &[Vec<f64>; 2], rule: impl Fn(&[f64]) -> f64) -> f64 {
    ends.iter()
        .map(|numbers| rule(numbers))
        .fold(0.0, |most, slope| {
            // What is not a number is no bound.
            if slope >= 0.0 {
                most.max(slope)
            } else {
                f64::INFINITY
            }
        })
}

/// A region turned by any angle about the axis of copies around it.
fn turned(region: &Bounds, plane: bool) -> Bounds {
    if plane {
        volumes::polar_plane(&[], region)
    } else {
        volumes::polar(&[], region)
    }
}
