//! Safe steps: a value as it is written, turned into one that changes no faster than the point moves.
//!
//! The sign stays, and so does the surface. A value is divided by a Lipschitz bound. Where the shape ends,
//! the bound need hold near it only, and farther out the distance to its box takes over. Where a shape has
//! no end and its bound grows with the region, bounds within three cubes are used side by side.

use super::{At, Lowering};
use crate::bounds::World;
use crate::elaborate::short;
use crate::graph::{Node, NodeId, Number};
use crate::scene::ShapeId;
use crate::seen::farthest;
use crate::slope::{Refuted, is_endless, margin, near};
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::{Op, prepare};

/// A bound of one but for rounding is one.
const TIDY: f64 = 1.0 + 1e-9;
/// A distance longer than any way of a ray, and short enough to be scaled.
const FAR_AWAY: f32 = 1e9;
/// A flatter shape has no surface that `f32` could find.
const MIN_SLOPE: f64 = 1e-18;
/// A closer bound is used where it is less by this factor.
const WORTH_WHILE: f64 = 1.25;
/// The half sides of the cubes in which an endless shape's slope is bounded, in sizes of the scene.
const CUBES: [f64; 3] = [4.0, 32.0, 256.0];
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
        let unit = self.size * at.unit;
        let cubes = CUBES.map(|cube| cube * unit);
        let reach = farthest(bounds.min.into_iter().chain(bounds.max));
        let is_large = reach.is_some_and(|reach| reach > cubes[0]);
        if bounds.is_finite() && !is_large {
            let margin = margin(&bounds);
            let near = self.known_slope(id, &near(&bounds));
            if near * WORTH_WHILE > everywhere {
                return self.divided(node, everywhere, at);
            }
            let divided = self.divided(node, near, at);
            let corners = bounds.min.into_iter().chain(bounds.max);
            let numbers: Vec<f64> = corners.chain([margin]).collect();
            return self.row(Op::Bounded, at, divided, &numbers);
        }
        let first = self.known_slope(id, &Bounds::centred([cubes[0]; 3]));
        if first * WORTH_WHILE > everywhere {
            return self.divided(node, everywhere, at);
        }
        let is_guessed = self.unbounded.contains(&id);
        let mut slope = |half: f64| {
            let region = Bounds::centred([half; 3]);
            let found = match is_guessed {
                true => self.known_slope(id, &region),
                false => self.outer_slope(id, &region),
            };
            found.max(first).min(everywhere)
        };
        let [second, third, beyond] = [cubes[1], cubes[2], REACH * unit].map(&mut slope);
        if first * WORTH_WHILE > beyond {
            return self.divided(node, beyond, at);
        }
        let finite = |slope: f64| slope.min(f64::from(f32::MAX));
        let slopes = [first, second, third, beyond].map(finite);
        let numbers: Vec<f64> = cubes.into_iter().chain(slopes).collect();
        self.row(Op::FieldShells, at, node, &numbers)
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
        let shape = &self.scene.shapes[id.0 as usize];
        if self.unbounded.insert(id) {
            self.diagnostics.push(
                Diagnostic::warning(
                    codes::W0501,
                    shape.span,
                    "the slope of this field cannot be bounded",
                )
                .primary("it may rise arbitrarily fast, so rays may step over it")
                .help(
                    "state a bound, `field(…, lipschitz: 2)`, say where the shape ends, \
                     `field(…, within: 4)`, or keep away from poles with `max`",
                ),
            );
        }
        let world = World::from(&*self.scene);
        self.slopes
            .guess(world, self.boxes, id, region)
            .max(MIN_SLOPE)
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

/// Reports whether a bound is one but for rounding.
fn is_tidy(slope: f64) -> bool {
    (1.0 / TIDY..=TIDY).contains(&slope)
}
