//! Weights of the materials in a blend, hard or smooth.
//!
//! The weight of an operand is the fraction of the result's slope that comes from it. That is the blend's
//! derivative by that operand over the sum of both. A hard union therefore takes the nearer shape's material,
//! and a smooth one has a transition as wide as the shape's. Faces coincide within the *tie distance*, which
//! rounding does not exceed; there the first operand is visible.

use crate::apply::{OpResult, apply};
use crate::blend::BlendKernel;
use crate::dual::{Dual, DualVec3};
use crate::lanes::{F32x64, LANES, LaneNumber};
use crate::multiversion;
use crate::real::{Real, Vector3, lit};
use crate::record::{RecordedFunction, Scalar, record};
use crate::row::SetOperation;
use crate::table::Op;
use crate::vector::V3;

/// The largest difference between distances of coincident faces, per unit of the point's largest
/// coordinate.
pub const MAX_TIE_PER_COORDINATE: f64 = 6e-6;

/// Largest difference between the values of coincident faces by rounding alone, as a fraction of the larger one.
/// Away from the surface, where a field is nearly constant, distances do not tell.
pub(crate) const MAX_TIE_PER_VALUE: f64 = 4e-6;

/// Returns the WGSL line that computes the largest difference between distances of coincident faces at a
/// point.
pub fn tie_wgsl(point: &str) -> String {
    format!(
        "let tie = max(max(abs({point}.x), abs({point}.y)), abs({point}.z)) * {MAX_TIE_PER_COORDINATE};"
    )
}

/// Returns the factors by which an operation combines its operands as a union does: of the tie distance, and of the
/// second operand. The first is −1 for intersections and subtractions, and 0 for what is no set operation.
pub fn tie_signs(op: Op) -> [f64; 2] {
    match op.row().facts.set {
        Some(SetOperation::Union) => [1.0, 1.0],
        Some(SetOperation::Intersection) => [-1.0, 1.0],
        Some(SetOperation::Subtraction) => [-1.0, -1.0],
        None => [0.0, 1.0],
    }
}

/// Returns the value of the first operand that decides which of two operands is visible. Both come with their
/// gradients, the second one multiplied by its sign.
///
/// Two faces coincide if they look to the same side and differ by less than the tie distance `tie`. Distances to faces
/// are values divided by slopes, so that points need not be on the surface. They also coincide if their values are the
/// same but for rounding. Of coincident faces the first one is visible: its value becomes the second one's, less a tie.
#[inline(always)]
fn first_value<R: Real>(
    first_gradient: R::Vec3,
    first: R,
    second_gradient: R::Vec3,
    second: R,
    tie: R,
) -> R {
    let slope = |gradient: R::Vec3| gradient.abs().max_component();
    let first_slope = slope(first_gradient).named("first_slope");
    let second_slope = slope(second_gradient).named("second_slope");
    // Not `dot`, whose sum has no order in WGSL.
    let products = first_gradient * second_gradient;
    let alignment = products.x() + products.y() + products.z();
    let gap = (first * second_slope - second * first_slope).abs();
    let looks_alike = lit::<R>(0.0).less(alignment);
    let is_near = gap.less(tie.abs() * first_slope * second_slope);
    let rounding = first.abs().max(second.abs()) * lit(MAX_TIE_PER_VALUE);
    let is_same_value = (first - second).abs().less(rounding);
    let coincide = R::or(R::and(looks_alike, is_near), is_same_value);
    let signed_rounding = R::select(lit::<R>(0.0).less(tie), rounding, -rounding);
    R::select(
        coincide,
        second - tie * second_slope - signed_rounding,
        first,
    )
}

/// Records [`first_value`].
pub(crate) fn record_first_value() -> RecordedFunction {
    record("first_value", |s| {
        first_value::<Scalar>(
            s.parameter("first_gradient"),
            s.parameter("first"),
            s.parameter("second_gradient"),
            s.parameter("second"),
            s.parameter("tie"),
        )
    })
}

/// Returns two duals, seeded with the first and the second unit vector as their gradients. The second operand
/// is multiplied by `sign` to compare it with the first.
#[inline(always)]
fn operand_duals(
    a: [&F32x64; 4],
    b: [&F32x64; 4],
    lane: usize,
    [tie, sign]: [f32; 2],
) -> [Dual<f32>; 2] {
    let gradient =
        |operand: [&F32x64; 4]| V3::new(operand[0].0[lane], operand[1].0[lane], operand[2].0[lane]);
    let (first, second) = (a[3].0[lane], b[3].0[lane]);
    let second_gradient = gradient(b) * sign;
    [
        Dual {
            value: first_value(gradient(a), first, second_gradient, second * sign, tie),
            gradient: V3::new(1.0, 0.0, 0.0),
        },
        Dual {
            value: second,
            gradient: V3::new(0.0, 1.0, 0.0),
        },
    ]
}

/// Returns the second operand's weight, from the derivatives of the result with respect to both.
#[inline(always)]
fn second_weight<R: Real>(by_first: R, by_second: R) -> R {
    let (a, b) = (by_first.abs(), by_second.abs());
    b / (a + b).max(R::constant(1e-20))
}

/// Returns the weight of the second operand of an operation that combines two, in every lane. `q` holds the
/// points.
pub(crate) fn operation_weights(
    op: Op,
    q: &[F32x64; 12],
    [a, b]: [[&F32x64; 4]; 2],
    constants: &[f32],
    tie_distances: &F32x64,
) -> F32x64 {
    let mut weights = F32x64::default();
    let [tie_sign, second_sign] = tie_signs(op).map(|sign| sign as f32);
    for lane in 0..LANES {
        let tie = tie_sign * tie_distances.0[lane];
        let [x, y] = operand_duals(a, b, lane, [tie, second_sign]);
        let values = [x, y, Dual::fixed(0.0)];
        // The point is constant here: only the weights of the operands are needed.
        let p = DualVec3::fixed(Dual::<f32>::load_point(q, lane).value);
        if let OpResult::Value(v) = apply::<Dual<f32>>(op, p, values, constants) {
            weights.0[lane] = second_weight(v.gradient.x, v.gradient.y);
        }
    }
    weights
}

multiversion! {
    /// Computes the weight of the second operand of a blend into the accumulator, in every lane.
    pub(crate) fn blend_weights(
        kernel: BlendKernel, constants: [f32; 4], values: [[&F32x64; 4]; 2], tie_distances: &F32x64,
        weights: &mut F32x64
    ) = blend_weights_body;
}

#[inline(always)]
fn blend_weights_body(
    kernel: BlendKernel,
    constants: [f32; 4],
    [a, b]: [[&F32x64; 4]; 2],
    tie_distances: &F32x64,
    weights: &mut F32x64,
) {
    let [tie_sign, second_sign, ..] = constants;
    let [s, sb, width, coefficient] = constants.map(Dual::fixed);
    macro_rules! each {
        ($kernel:expr) => {
            for lane in 0..LANES {
                let tie = tie_sign * tie_distances.0[lane];
                let [x, y] = operand_duals(a, b, lane, [tie, second_sign]);
                let v = $kernel.blend(x, y, s, sb, width, coefficient);
                weights.0[lane] = second_weight(v.gradient.x, v.gradient.y);
            }
        };
    }
    match kernel {
        BlendKernel::Hard => each!(BlendKernel::Hard),
        BlendKernel::Quadratic => each!(BlendKernel::Quadratic),
        BlendKernel::Cubic => each!(BlendKernel::Cubic),
        BlendKernel::Circular => each!(BlendKernel::Circular),
        BlendKernel::Exponential => each!(BlendKernel::Exponential),
    }
}

/// WGSL of the mixed materials of a blend. `weights` is the blend's value with the derivatives with respect to its two
/// operands in x and y. The second operand of `first_seed` is multiplied by its sign. It calls
/// [`record_first_value`].
pub(crate) const MIXED_SURFACE_WGSL: &str = "fn first_seed(a: vec4f, b: vec4f, tie: f32) -> vec4f {
    return vec4f(1.0, 0.0, 0.0, first_value(a.xyz, a.w, b.xyz, b.w, tie));
}

fn mixed_surface(a: Surface, b: Surface, weights: vec4f) -> Surface {
    let t = abs(weights.y) / max(abs(weights.x) + abs(weights.y), 1e-20);
    return Surface(
        a.albedo + (b.albedo - a.albedo) * t,
        a.roughness + (b.roughness - a.roughness) * t,
        a.emission + (b.emission - a.emission) * t,
        a.metallic + (b.metallic - a.metallic) * t,
        a.bump + (b.bump - a.bump) * t,
        select(a.id, b.id, t > 0.5),
    );
}

";
