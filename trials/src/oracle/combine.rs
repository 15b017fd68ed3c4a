//! Set operations on two values, with the edge profile that each row describes.

use super::point::{Point, norm, norm2, subtract};
use sdfc_vm::table::Op;
use std::f64::consts::{FRAC_1_SQRT_2, SQRT_2};

/// Profile of the edge between two shapes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum EdgeProfile {
    /// Sharp edge.
    Hard,
    /// Parabola of this width.
    Quadratic(f64),
    /// Cubic of this width.
    Cubic(f64),
    /// Quarter circle of this width.
    Circular(f64),
    /// Exponential of this thickness.
    Exponential(f64),
    /// Flat chamfer of this size.
    Chamfer(f64),
    /// Fillet of this radius.
    Round(f64),
    /// Stairs of this size, and half the size of a step.
    Stairs(f64, f64),
    /// Parabola whose thickness grows with the distance from a point.
    Distance {
        /// Point from which the distance counts.
        focus: Point,
        /// Thickness at the focus.
        thickness: f64,
        /// Growth of the thickness per unit of length.
        growth: f64,
        /// Upper limit of the thickness.
        max_thickness: f64,
    },
}

/// Set operation on two shapes, or an interpolation between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum SetOp {
    /// All points in either operand.
    Union(EdgeProfile),
    /// All points in both operands.
    Intersection(EdgeProfile),
    /// First operand without the second.
    Subtraction(EdgeProfile),
    /// All points in exactly one operand.
    Xor,
    /// Linear interpolation by this fraction, from the first operand to the second.
    Morph(f64),
}

/// Returns the set operation of a row with these parameters, or `None` for other rows.
pub(super) fn set_op(op: Op, k: &[f64]) -> Option<SetOp> {
    Some(match op {
        Op::Union => SetOp::Union(EdgeProfile::Hard),
        Op::Intersection => SetOp::Intersection(EdgeProfile::Hard),
        Op::Subtraction => SetOp::Subtraction(EdgeProfile::Hard),
        Op::Xor => SetOp::Xor,
        Op::SmoothUnion => SetOp::Union(EdgeProfile::Quadratic(k[0])),
        Op::SmoothIntersection => SetOp::Intersection(EdgeProfile::Quadratic(k[0])),
        Op::SmoothSubtraction => SetOp::Subtraction(EdgeProfile::Quadratic(k[0])),
        Op::CubicUnion => SetOp::Union(EdgeProfile::Cubic(k[0])),
        Op::CubicIntersection => SetOp::Intersection(EdgeProfile::Cubic(k[0])),
        Op::CubicSubtraction => SetOp::Subtraction(EdgeProfile::Cubic(k[0])),
        Op::CircularUnion => SetOp::Union(EdgeProfile::Circular(k[0])),
        Op::CircularIntersection => SetOp::Intersection(EdgeProfile::Circular(k[0])),
        Op::CircularSubtraction => SetOp::Subtraction(EdgeProfile::Circular(k[0])),
        Op::ExponentialUnion => SetOp::Union(EdgeProfile::Exponential(k[0])),
        Op::ExponentialIntersection => SetOp::Intersection(EdgeProfile::Exponential(k[0])),
        Op::ExponentialSubtraction => SetOp::Subtraction(EdgeProfile::Exponential(k[0])),
        Op::ChamferUnion => SetOp::Union(EdgeProfile::Chamfer(k[0])),
        Op::ChamferIntersection => SetOp::Intersection(EdgeProfile::Chamfer(k[0])),
        Op::ChamferSubtraction => SetOp::Subtraction(EdgeProfile::Chamfer(k[0])),
        Op::RoundUnion => SetOp::Union(EdgeProfile::Round(k[0])),
        Op::RoundIntersection => SetOp::Intersection(EdgeProfile::Round(k[0])),
        Op::RoundSubtraction => SetOp::Subtraction(EdgeProfile::Round(k[0])),
        Op::StairsUnion => SetOp::Union(EdgeProfile::Stairs(k[0], k[1])),
        Op::StairsIntersection => SetOp::Intersection(EdgeProfile::Stairs(k[0], k[1])),
        Op::StairsSubtraction => SetOp::Subtraction(EdgeProfile::Stairs(k[0], k[1])),
        Op::DistanceUnion => SetOp::Union(EdgeProfile::Distance {
            focus: [k[0], k[1], k[2]],
            thickness: k[3],
            growth: k[4],
            max_thickness: k[5],
        }),
        Op::Morph => SetOp::Morph(k[0]),
        _ => return None,
    })
}

impl SetOp {
    /// Combines two values at a point.
    pub(super) fn value(self, a: f64, b: f64, p: Point) -> f64 {
        match self {
            Self::Union(profile) => profile.union_value(a, b, p),
            Self::Intersection(profile) => -profile.union_value(-a, -b, p),
            Self::Subtraction(profile) => -profile.union_value(-a, b, p),
            Self::Xor => a.min(b).max(-a.max(b)),
            Self::Morph(fraction) => a * (1.0 - fraction) + b * fraction,
        }
    }

    /// Returns the edge profile between the operands.
    pub(super) fn profile(self) -> EdgeProfile {
        match self {
            Self::Union(profile) | Self::Intersection(profile) | Self::Subtraction(profile) => {
                profile
            }
            Self::Xor | Self::Morph(_) => EdgeProfile::Hard,
        }
    }

    /// Returns the slope bound of the result, given those of the operands.
    pub(super) fn slope_bound(self, a: f64, b: f64) -> f64 {
        let max_thickness = a.max(b);
        match self.profile() {
            EdgeProfile::Chamfer(_) => max_thickness.max((a + b) * FRAC_1_SQRT_2),
            EdgeProfile::Round(_) => max_thickness * SQRT_2,
            EdgeProfile::Distance { growth, .. } => max_thickness + growth.abs(),
            _ => max_thickness,
        }
    }
}

impl EdgeProfile {
    /// Returns the value of a union.
    fn union_value(self, a: f64, b: f64, p: Point) -> f64 {
        let hard = a.min(b);
        let difference = (a - b).abs();
        match self {
            Self::Hard => hard,
            Self::Quadratic(width) => hard - parabola(width / 4.0, difference),
            Self::Cubic(width) => {
                let fraction = (1.0 - difference / width).max(0.0);
                let offset = width / 6.0 * fraction * fraction * fraction;
                hard - if width > 0.0 { offset } else { 0.0 }
            }
            // Circle of radius `width` that touches both axes of the operands' values.
            Self::Circular(width) if difference < width => {
                hard - width
                    + 0.5 * (difference + (2.0 * width * width - difference * difference).sqrt())
            }
            Self::Circular(_) => hard,
            Self::Exponential(thickness) if thickness > 0.0 => {
                hard - thickness * (1.0 + (-difference / thickness).exp2()).log2()
            }
            Self::Exponential(_) => hard,
            Self::Chamfer(size) => hard.min((a + b - size) * FRAC_1_SQRT_2),
            // Quarter circle around the point at distance `r` from both surfaces.
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
                max_thickness,
            } => {
                let distance = norm(subtract(p, focus));
                hard - parabola(
                    (thickness + growth * distance).min(max_thickness),
                    difference,
                )
            }
        }
    }

    /// Returns the largest amount by which a union's value is below the smaller operand.
    pub(super) fn max_offset(self) -> f64 {
        match self {
            Self::Hard => 0.0,
            Self::Quadratic(width) => width / 4.0,
            Self::Cubic(width) => width / 6.0,
            Self::Circular(width) => width * (1.0 - FRAC_1_SQRT_2),
            Self::Exponential(thickness) => thickness,
            Self::Chamfer(size) | Self::Round(size) | Self::Stairs(size, _) => size,
            Self::Distance { max_thickness, .. } => max_thickness,
        }
        .max(0.0)
    }
}

/// Returns the height of a parabola: `thickness` for equal operands, zero from a difference of `4 *
/// thickness` on.
fn parabola(thickness: f64, difference: f64) -> f64 {
    if thickness <= 0.0 {
        return 0.0;
    }
    let fraction = (1.0 - difference / (4.0 * thickness)).max(0.0);
    thickness * fraction * fraction
}
