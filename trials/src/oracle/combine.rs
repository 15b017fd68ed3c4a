//! Combinations of two values, by the shape of the edge that each row describes.

use super::point::{Point, minus, norm, norm2};
use sdfc_vm::table::Op;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// The edge between two shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Edge {
    /// An edge as it is.
    Hard,
    /// A parabola of this width.
    Quadratic(f64),
    /// A cubic of this width.
    Cubic(f64),
    /// A quarter circle of this width.
    Circular(f64),
    /// An exponential of this thickness.
    Exponential(f64),
    /// A flat piece of this size.
    Chamfer(f64),
    /// A fillet of this radius.
    Round(f64),
    /// Stairs of this size, and half of what each takes.
    Stairs(f64, f64),
    /// A parabola whose thickness grows with the distance from a point.
    Distance {
        /// The point.
        focus: Point,
        /// The thickness there.
        thickness: f64,
        /// The growth per unit of length.
        growth: f64,
        /// The largest thickness.
        most: f64,
    },
}

/// A set operation on two shapes, or a shape between both.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Set {
    /// All points of either.
    Union(Edge),
    /// All points of both.
    Intersection(Edge),
    /// The first without the second.
    Subtraction(Edge),
    /// All points of exactly one.
    Xor,
    /// A shape between both, this share of the way to the second.
    Morph(f64),
}

/// The combination of a row with these numbers, if it is one.
pub(super) fn set(op: Op, k: &[f64]) -> Option<Set> {
    Some(match op {
        Op::Union => Set::Union(Edge::Hard),
        Op::Intersection => Set::Intersection(Edge::Hard),
        Op::Subtraction => Set::Subtraction(Edge::Hard),
        Op::Xor => Set::Xor,
        Op::SmoothUnion => Set::Union(Edge::Quadratic(k[0])),
        Op::SmoothIntersection => Set::Intersection(Edge::Quadratic(k[0])),
        Op::SmoothSubtraction => Set::Subtraction(Edge::Quadratic(k[0])),
        Op::CubicUnion => Set::Union(Edge::Cubic(k[0])),
        Op::CubicIntersection => Set::Intersection(Edge::Cubic(k[0])),
        Op::CubicSubtraction => Set::Subtraction(Edge::Cubic(k[0])),
        Op::CircularUnion => Set::Union(Edge::Circular(k[0])),
        Op::CircularIntersection => Set::Intersection(Edge::Circular(k[0])),
        Op::CircularSubtraction => Set::Subtraction(Edge::Circular(k[0])),
        Op::ExponentialUnion => Set::Union(Edge::Exponential(k[0])),
        Op::ExponentialIntersection => Set::Intersection(Edge::Exponential(k[0])),
        Op::ExponentialSubtraction => Set::Subtraction(Edge::Exponential(k[0])),
        Op::ChamferUnion => Set::Union(Edge::Chamfer(k[0])),
        Op::ChamferIntersection => Set::Intersection(Edge::Chamfer(k[0])),
        Op::ChamferSubtraction => Set::Subtraction(Edge::Chamfer(k[0])),
        Op::RoundUnion => Set::Union(Edge::Round(k[0])),
        Op::RoundIntersection => Set::Intersection(Edge::Round(k[0])),
        Op::RoundSubtraction => Set::Subtraction(Edge::Round(k[0])),
        Op::StairsUnion => Set::Union(Edge::Stairs(k[0], k[1])),
        Op::StairsIntersection => Set::Intersection(Edge::Stairs(k[0], k[1])),
        Op::StairsSubtraction => Set::Subtraction(Edge::Stairs(k[0], k[1])),
        Op::DistanceUnion => Set::Union(Edge::Distance {
            focus: [k[0], k[1], k[2]],
            thickness: k[3],
            growth: k[4],
            most: k[5],
        }),
        Op::Morph => Set::Morph(k[0]),
        _ => return None,
    })
}

impl Set {
    /// The value of two at a point.
    pub(super) fn value(self, a: f64, b: f64, p: Point) -> f64 {
        match self {
            Self::Union(edge) => edge.lowest(a, b, p),
            Self::Intersection(edge) => -edge.lowest(-a, -b, p),
            Self::Subtraction(edge) => -edge.lowest(-a, b, p),
            Self::Xor => a.min(b).max(-a.max(b)),
            Self::Morph(share) => a * (1.0 - share) + b * share,
        }
    }

    /// The edge between the operands.
    pub(super) fn edge(self) -> Edge {
        match self {
            Self::Union(edge) | Self::Intersection(edge) | Self::Subtraction(edge) => edge,
            Self::Xor | Self::Morph(_) => Edge::Hard,
        }
    }

    /// The steepest slope of the value, from those of the operands.
    pub(super) fn steepness(self, a: f64, b: f64) -> f64 {
        let most = a.max(b);
        match self.edge() {
            Edge::Chamfer(_) => most.max((a + b) * FRAC_1_SQRT_2),
            Edge::Round(_) => most * SQRT_2,
            Edge::Distance { growth, .. } => most + growth.abs(),
            _ => most,
        }
    }
}

impl Edge {
    /// The value of a union.
    fn lowest(self, a: f64, b: f64, p: Point) -> f64 {
        let hard = a.min(b);
        let apart = (a - b).abs();
        match self {
            Self::Hard => hard,
            Self::Quadratic(width) => hard - parabola(width / 4.0, apart),
            Self::Cubic(width) => {
                let share = (1.0 - apart / width).max(0.0);
                let bulge = width / 6.0 * share * share * share;
                hard - if width > 0.0 { bulge } else { 0.0 }
            }
            // The circle of the radius `width` that touches both axes of the operands' values.
            Self::Circular(width) if apart < width => {
                hard - width + 0.5 * (apart + (2.0 * width * width - apart * apart).sqrt())
            }
            Self::Circular(_) => hard,
            Self::Exponential(thickness) if thickness > 0.0 => {
                hard - thickness * (1.0 + (-apart / thickness).exp2()).log2()
            }
            Self::Exponential(_) => hard,
            Self::Chamfer(size) => hard.min((a + b - size) * FRAC_1_SQRT_2),
            // The quarter circle around the point from which both surfaces are `r` away.
            Self::Round(r) => hard.max(r) - norm2((r - a).max(0.0), (r - b).max(0.0)),
            Self::Stairs(size, half_step) => {
                let step = 2.0 * half_step;
                let up = b - size;
                let across = up - a + half_step;
                let within = across - step * (across / step).floor();
                hard.min(0.5 * (up + a + (within - half_step).abs()))
            }
            Self::Distance {
                focus,
                thickness,
                growth,
                most,
            } => {
                let away = norm(minus(p, focus));
                hard - parabola((thickness + growth * away).min(most), apart)
            }
        }
    }

    /// The most by which the value of a union of two is below the smaller of both.
    pub(super) fn depth(self) -> f64 {
        match self {
            Self::Hard => 0.0,
            Self::Quadratic(width) => width / 4.0,
            Self::Cubic(width) => width / 6.0,
            Self::Circular(width) => width * (1.0 - FRAC_1_SQRT_2),
            Self::Exponential(thickness) => thickness,
            Self::Chamfer(size) | Self::Round(size) | Self::Stairs(size, _) => size,
            Self::Distance { most, .. } => most,
        }
        .max(0.0)
    }
}

/// A parabola that is `thickness` high in the middle, and ends where operands differ by four times
/// as much.
fn parabola(thickness: f64, apart: f64) -> f64 {
    if thickness <= 0.0 {
        return 0.0;
    }
    let share = (1.0 - apart / (4.0 * thickness)).max(0.0);
    thickness * share * share
}
