//! Safe steps: a value as it is written, turned into one that changes no faster than the point moves.
//!
//! The sign stays, and so does the surface. A value is divided by a Lipschitz bound. Where the shape ends,
//! the bound need hold near it only, and farther out the distance to its box takes over. Where a shape has
//! no end and its bound grows with the region, that is a power of the way from the origin.

use super::{At, Lowering};
use crate::bounds::World;
use crate::elaborate::short;
use crate::expression::ExprId;
use crate::formula::numbers;
use crate::graph::{Node, NodeId, Number};
use crate::scene::{ShapeId, ShapeKind, children};
use crate::seen::farthest;
use crate::shape_range::ShapeRange;
use crate::slope::{Capped, Known, Ranges, Refuted, STEEPEST, has_jumps, is_endless, margin, near};
use crate::written::written;
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::{Op, prepare};
use std::collections::HashSet;

/// A bound of one but for rounding is one.
const TIDY: f64 = 1.0 + 1e-9;
/// A distance longer than any way of a ray, and short enough to be scaled.
const FAR_AWAY: f32 = 1e9;
/// A flatter shape has no surface that `f32` could find.
const MIN_SLOPE: f64 = 1e-18;
/// A closer bound is used where it is less by this factor.
const WORTH_WHILE: f64 = 1.25;
/// The half side of the cube that a shape with an end must reach out of to be taken for an endless one, in sizes of the
/// scene.
const LARGE: f64 = 4.0;
/// The exponents that a slope's growth may have: halves, up to so many.
const MOST_EXPONENTS: u32 = 48;
/// The distance up to which the exponent gives the longest steps, in sizes of the scene.
const CHOSEN_FOR: f64 = 8.0;
/// The distance to which a shape is drawn beyond the region that others leave it, in half diagonals of that.
const BEYOND: f64 = 0.01;
/// The half side of the cube that holds all that rays reach, in sizes of the scene.
const REACH: f64 = 1e6;

impl Lowering<'_> {
    /// A value as it is written, as a safe step to the surface of the shape that it is.
    pub(super) fn step(&mut self, node: NodeId, id: ShapeId, at: At) -> NodeId {
        // Nothing marches on a figure that is the whole scene.
        if self.scene.shapes[id.0 as usize].plane && self.scene.plane {
            return node;
        }
        self.report_hollow(id);
        let jumping = self.jumping(id);
        if let Some(node) = self.piecewise(jumping, &Bounds::EVERYTHING, Known::Throughout, at) {
            return node;
        }
        let everywhere = self.slope(id, &Bounds::EVERYTHING);
        if is_tidy(everywhere) || everywhere < MIN_SLOPE {
            return node;
        }
        let own = self.boxes.of(World::from(&*self.scene), id);
        let mut bounds = own.common(&at.region);
        if bounds.is_finite() && !bounds.is_empty() {
            // Where a region ends with another operand, no surface of both is made.
            let beyond = bounds.half_diagonal() * BEYOND;
            bounds = bounds.grown(beyond).common(&own);
        }
        if bounds.is_empty() {
            // No surface to step over, and no value that could be taken for one.
            return self.graph.add(Node::Constant(Number::Constant(FAR_AWAY)));
        }
        let unit = self.slopes.size() * at.unit;
        let reach = farthest(bounds.min.into_iter().chain(bounds.max));
        let is_large = reach.is_some_and(|reach| reach > LARGE * unit);
        if bounds.is_finite() && !is_large {
            let margin = margin(&bounds);
            if let Some(node) = self.piecewise(jumping, &near(&bounds), Known::Locally, at) {
                return self.bounded(node, &bounds, [margin, full(&bounds)], at);
            }
            let unbounded = self.unbounded_number(id, &near(&bounds));
            if let Some(node) = self.piecewise(unbounded, &near(&bounds), Known::Locally, at) {
                return self.bounded(node, &bounds, [margin, full(&bounds)], at);
            }
            let (node, near) = self.capped(node, id, &near(&bounds), at);
            if near * WORTH_WHILE > everywhere {
                return self.divided(node, everywhere, at);
            }
            let divided = self.divided(node, near, at);
            // By a slope that was guessed, some surface may be nearer than it seems.
            let limit = match self.unbounded.contains(&id) {
                true => margin,
                false => full(&bounds),
            };
            return self.bounded(divided, &bounds, [margin, limit], at);
        }
        if let Some(node) = self.piecewise(jumping, &Bounds::EVERYTHING, Known::Locally, at) {
            return node;
        }
        let unbounded = self.unbounded_number(id, &Bounds::centred([unit; 3]));
        if let Some(node) = self.piecewise(unbounded, &Bounds::EVERYTHING, Known::Locally, at) {
            return node;
        }
        let first = self.known_slope(id, &Bounds::centred([unit; 3]));
        if first * WORTH_WHILE > everywhere {
            return self.divided(node, everywhere, at);
        }
        let growth = self.growth(id, unit, first, everywhere);
        let beyond = growth.last().map_or(first, |cube| cube.outer);
        if first * WORTH_WHILE > beyond {
            return self.divided(node, beyond, at);
        }
        let (factor, exponent) = power(&growth, first);
        self.row(Op::FieldGrowth, at, node, &[unit, first, factor, exponent])
    }

    /// A value that holds near the box of its shape; farther out, the distance to the box.
    fn bounded(
        &mut self,
        node: NodeId,
        bounds: &Bounds,
        [margin, limit]: [f64; 2],
        at: At,
    ) -> NodeId {
        let corners = bounds.min.into_iter().chain(bounds.max);
        let numbers: Vec<f64> = corners.chain([margin, limit]).collect();
        self.row(Op::Bounded, at, node, &numbers)
    }

    /// The value of a shape in which operations jump, as a number.
    fn jumping(&mut self, id: ShapeId) -> Option<ExprId> {
        match self.scene.shapes[id.0 as usize].kind {
            _ if !self.jumps(id) => None,
            ShapeKind::Field { value, .. } => Some(value),
            _ => written(self.scene, id),
        }
    }

    /// The value of a shape whose slope has no bound in a region, or none to march by, as a number.
    fn unbounded_number(&mut self, id: ShapeId, region: &Bounds) -> Option<ExprId> {
        if self.slope(id, region).is_finite() {
            return None;
        }
        let world = World::from(&*self.scene);
        // Nothing marches by numbers beyond all of `f32`.
        if self.slopes.guess(world, self.boxes, id, region) >= STEEPEST {
            return None;
        }
        let capped = self.slopes.capped(world, id, region);
        let number = match self.scene.shapes[id.0 as usize].kind {
            ShapeKind::Field { value, .. } => value,
            _ => written(self.scene, id)?,
        };
        let Some(slope) = capped.and_then(|capped| capped.slope) else {
            return Some(number);
        };
        let expressions = &self.scene.expressions;
        let is_far = self
            .slopes
            .is_far_from_usual(expressions, number, slope, region);
        is_far.then_some(number)
    }

    /// A number that jumps, as a step that is safe in a region: found piece by piece, whatever slope is stated.
    fn piecewise(
        &mut self,
        number: Option<ExprId>,
        region: &Bounds,
        known: Known,
        at: At,
    ) -> Option<NodeId> {
        let expressions = &mut self.scene.expressions;
        let step = self.slopes.stepped(expressions, number?, region, known)?;
        Some(self.field(step, at))
    }

    /// Reports whether operations that jump are in a shape.
    fn jumps(&self, id: ShapeId) -> bool {
        let (mut seen, mut open) = (HashSet::from([id]), vec![id]);
        while let Some(id) = open.pop() {
            let kind = &self.scene.shapes[id.0 as usize].kind;
            let jumps = |&number: &ExprId| has_jumps(&self.scene.expressions, number);
            if numbers(kind).iter().any(jumps) {
                return true;
            }
            open.extend(children(kind).iter().filter(|&&child| seen.insert(child)));
        }
        false
    }

    /// A value and a bound of its slope in a region. Where only poles are in the way of a bound, deep inside or far from
    /// the surface, values there are cut off.
    fn capped(&mut self, node: NodeId, id: ShapeId, region: &Bounds, at: At) -> (NodeId, f64) {
        if self.slope(id, region).is_infinite() {
            let world = World::from(&*self.scene);
            if let Some(Capped { values, slope }) = self.slopes.capped(world, id, region) {
                let mut end = |node: NodeId, op: Op, end: f64| match end.is_finite() {
                    true => {
                        let end = Node::Constant(Number::Constant(end as f32));
                        let end = self.graph.add(end);
                        self.apply(op, at, vec![node, end], Vec::new())
                    }
                    false => node,
                };
                let node = end(node, Op::Max, values.lo);
                let node = end(node, Op::Min, values.hi);
                let slope = slope.map(|slope| slope.max(MIN_SLOPE));
                return (node, slope.unwrap_or_else(|| self.known_slope(id, region)));
            }
        }
        (node, self.known_slope(id, region))
    }

    /// Reports a field that intervals prove to be below zero nowhere: what is zero there is no surface.
    fn report_hollow(&mut self, id: ShapeId) {
        let shape = &self.scene.shapes[id.0 as usize];
        let ShapeKind::Field { region, .. } = shape.kind else {
            return;
        };
        let (span, world) = (shape.span, World::from(&*self.scene));
        if !self.entered.insert(id) {
            return;
        }
        let ranges = Ranges::of(world);
        let mut uniform = |id| ranges.of_number(&self.scene.expressions, id);
        let value = ShapeRange::new(world, &mut uniform).over(id, &region);
        if value.lo >= 0.0 {
            self.diagnostics.push(
                Diagnostic::warning(codes::W0402, span, "this field is below zero nowhere")
                    .primary("so it has no inside, and nothing of it is seen")
                    .help("give a sheet some thickness: subtract that, `abs(d) - 0.01`, or use `.shell(0.01)`"),
            );
        }
    }

    /// The bounds of a shape's slope in cubes around the origin, each twice as large as the one before, as far as rays
    /// reach or the bounds do.
    fn growth(&mut self, id: ShapeId, side: f64, first: f64, everywhere: f64) -> Vec<Cube> {
        let is_guessed = self.unbounded.contains(&id);
        let mut cubes = Vec::new();
        let (mut ratio, mut inner) = (1.0, first);
        while ratio < REACH {
            let region = Bounds::centred([2.0 * ratio * side; 3]);
            let found = match is_guessed {
                true => self.known_slope(id, &region),
                false => self.outer_slope(id, &region),
            };
            let outer = found.max(inner).min(everywhere);
            // Values that rise ever faster need no bound.
            if outer >= STEEPEST {
                break;
            }
            cubes.push(Cube {
                ratio,
                inner,
                outer,
            });
            (ratio, inner) = (2.0 * ratio, outer);
        }
        cubes
    }

    /// A bound of a shape's slope in a region of its frame; infinite where none is known.
    fn slope(&mut self, id: ShapeId, region: &Bounds) -> f64 {
        let world = World::from(&*self.scene);
        self.slopes.within(world, self.boxes, id, region)
    }

    /// The same for a region that begins beyond the scene. A value that rises ever faster out there, as a
    /// polynomial does, needs no bound; of another one whose bound is missed the slope is guessed.
    fn outer_slope(&mut self, id: ShapeId, region: &Bounds) -> f64 {
        let slope = self.slope(id, region);
        if slope.is_finite() {
            return slope;
        }
        let world = World::from(&*self.scene);
        let guess = self.slopes.guess(world, self.boxes, id, region);
        match is_endless(guess) {
            true => f64::INFINITY,
            false => self.known_slope(id, region),
        }
    }

    /// The same, or what stands for it where there is none: that is said once for each shape.
    fn known_slope(&mut self, id: ShapeId, region: &Bounds) -> f64 {
        let slope = self.slope(id, region);
        if slope.is_finite() {
            return slope.max(MIN_SLOPE);
        }
        let world = World::from(&*self.scene);
        let guess = self.slopes.guess(world, self.boxes, id, region);
        if self.unbounded.insert(id) {
            let shape = &self.scene.shapes[id.0 as usize];
            let (may_state_slope, may_state_end) = match &shape.kind {
                ShapeKind::Field { slope, region, .. } => (slope.is_none(), !region.is_finite()),
                _ => (false, false),
            };
            let advice = [
                may_state_slope.then_some("state a bound, `field(…, lipschitz: 2)`"),
                may_state_end.then_some("say where the shape ends, `field(…, within: 4)`"),
                Some("keep away from poles with `max`"),
            ];
            let advice: Vec<&str> = advice.into_iter().flatten().collect();
            self.diagnostics.push(unbounded(shape.span, guess, &advice));
        }
        guess.clamp(MIN_SLOPE, STEEPEST)
    }

    /// Reports the slopes that the scene states and that do not hold.
    pub(super) fn report_refuted(&mut self) {
        for (id, refuted) in self.slopes.all_refuted() {
            let Refuted {
                stated,
                slope,
                place: [x, y, z],
            } = refuted;
            let round = |v: f64| short((v * 1e3).round() / 1e3);
            let (span, slope) = (self.scene.shapes[id.0 as usize].span, round(slope));
            let place = format!("[{}, {}, {}]", round(x), round(y), round(z));
            self.diagnostics.push(
                Diagnostic::warning(
                    codes::W0502,
                    span,
                    format!(
                        "this field is steeper than the {} that is stated",
                        short(stated)
                    ),
                )
                .primary(format!(
                    "its slope is {slope} at {place}, so another bound is used"
                ))
                .help("leave `lipschitz` out: a bound is found where there is one"),
            );
        }
    }

    /// A value divided by a bound of its slope: a flat one becomes larger, so that light takes it for the
    /// distance that it is.
    fn divided(&mut self, node: NodeId, slope: f64, at: At) -> NodeId {
        if is_tidy(slope) {
            return node;
        }
        self.row(Op::FieldDistance, at, node, &[slope])
    }

    /// A value changed by a row with constant arguments.
    pub(super) fn row(&mut self, op: Op, at: At, value: NodeId, arguments: &[f64]) -> NodeId {
        let parameters = prepare::<f64>(op, arguments);
        let parameters = parameters.into_iter().map(|v| Number::Constant(v as f32));
        self.apply(op, at, vec![value], parameters.collect())
    }
}

/// The warning about a field that has no bound of its slope, or none that numbers of `f32` could tell.
fn unbounded(span: Span, guess: f64, advice: &[&str]) -> Diagnostic {
    let warning = Diagnostic::warning(
        codes::W0501,
        span,
        "the slope of this field cannot be bounded",
    );
    if guess < STEEPEST {
        return warning
            .primary("it may rise arbitrarily fast, so rays may step over it")
            .help(one_of(advice));
    }
    warning
        .primary(format!(
            "its slope is about {guess:.0e} at points that were tried, so rays step over it"
        ))
        .help(
            "write the same surface less steep: compare a root or a logarithm, `pow(a, 1/8) - 1` or `ln(a)` \
             for `a - 1`",
        )
}

/// The largest distance that a surface in a box may have from a place near it.
fn full(bounds: &Bounds) -> f64 {
    margin(bounds) + 2.0 * bounds.half_diagonal()
}

/// Words as a list of which one is to be chosen.
fn one_of(words: &[&str]) -> String {
    match words {
        [others @ .., last] if !others.is_empty() => format!("{}, or {last}", others.join(", ")),
        _ => words.concat(),
    }
}

/// A cube around the origin, and that which is twice as large.
#[derive(Clone, Copy, Debug)]
struct Cube {
    /// The cube's size, in that of the first one.
    ratio: f64,
    /// The bound of the slope within it.
    inner: f64,
    /// The same within the larger one.
    outer: f64,
}

/// The factor and the exponent of a power of the way from the origin that bounds the slope beyond the first cube, with
/// steps as long as can be near the scene.
fn power(growth: &[Cube], first: f64) -> (f64, f64) {
    let law = |number: u32| {
        let exponent = 0.5 * f64::from(number);
        let needed = |cube: &Cube| cube.outer / cube.ratio.powf(exponent);
        let factor = growth.iter().map(needed).fold(first, f64::max);
        let near = growth.iter().filter(|cube| cube.ratio <= CHOSEN_FOR);
        let loss = |cube: &Cube| factor * cube.ratio.powf(exponent) / cube.inner;
        (near.map(loss).fold(1.0, f64::max), factor, exponent)
    };
    let laws = (1..=MOST_EXPONENTS).map(law);
    let best = laws.min_by(|a, b| a.0.total_cmp(&b.0));
    best.map_or((first, 1.0), |(_, factor, exponent)| (factor, exponent))
}

/// Reports whether a bound is one but for rounding.
fn is_tidy(slope: f64) -> bool {
    (1.0 / TIDY..=TIDY).contains(&slope)
}
