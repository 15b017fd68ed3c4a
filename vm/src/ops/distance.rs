//! Changes of a distance after its shape is evaluated.

use crate::ops::shapes::cuboid;
use crate::real::{Real, Vector3, lit};

/// Whatever is not in the shape.
#[inline(always)]
pub fn complement<R: Real>(d: R) -> R {
    -d
}

/// The surface moved outwards by `by`.
#[inline(always)]
pub fn offset<R: Real>(d: R, by: R) -> R {
    d - by
}

/// The surface as a wall that reaches `half` to both sides.
#[inline(always)]
pub fn shell<R: Real>(d: R, half: R) -> R {
    d.abs() - half
}

/// The distance in a space that is `factor` times as large.
#[inline(always)]
pub fn scale_distance<R: Real>(d: R, factor: R) -> R {
    d * factor
}

/// A raw field, divided by the bound of its slope.
#[inline(always)]
pub fn field_distance<R: Real>(v: R, inverse_slope: R) -> R {
    v * inverse_slope
}

/// The least logarithm of a power: a smaller one is zero in `f32`.
const LEAST_LOGARITHM: f64 = -69.0;

/// A raw field whose slope is at most one over `inverse` in a cube around the origin of the half `side`, and grows no
/// faster than a power of the way from the origin, as far as the largest coordinate tells it. In the cube a step of the
/// value times `inverse` is safe as far as it stays inside. Anywhere, so is one of the value times `beyond` over that
/// power, up to a `share` of the way. The longer one counts. It is no steeper than one, and has the field's sign.
#[inline(always)]
pub fn field_growth<R: Real>(
    v: R,
    p: R::Vec3,
    side: R,
    exponent: R,
    share: R,
    inverse: R,
    beyond: R,
) -> R {
    let far = p.abs().max_component().named("far");
    let inside = (side - far).max(lit(0.0)).named("inside");
    let way = far.max(side).max(lit(1e-30)).named("way");
    let logarithm = (side / way).ln() * exponent;
    let shrunk = logarithm.max(lit(LEAST_LOGARITHM)).exp().named("shrunk");
    let near = (v * inverse).abs().min(inside).named("near");
    let grown = (v * beyond * shrunk).abs().min(way * share).named("grown");
    let step = near.max(grown).named("step");
    signed::<R>(v, step)
}

/// A raw field that jumps, as a distance in which its sign does not change, found from its pieces, with that sign.
#[inline(always)]
pub fn piecewise<R: Real>(v: R, step: R) -> R {
    signed::<R>(v, step)
}

/// A step with the sign of a value; what is no number stays none.
#[inline(always)]
fn signed<R: Real>(v: R, step: R) -> R {
    let signed = R::select(v.less(lit(0.0)), -step, step);
    R::select(is_number(v), signed, v)
}

/// Tells a number from what is none, which minima and maxima drop. Intervals always hold numbers.
#[inline(always)]
fn is_number<R: Real>(v: R) -> R::Bool {
    lit::<R>(-1.0).less(v.abs())
}

/// What the elongated shape lacks inside the gap: there the point maps to the middle for all
/// positions, and the distance to the gap's own sides takes over. Where the middle is outside the
/// shape, so is the gap.
#[inline(always)]
pub fn elongate_correct<R: Real>(d: R, p: R::Vec3, half: R::Vec3) -> R {
    let depth = lit::<R>(0.0).min((p.abs() - half).max_component());
    d + R::select(d.less(lit(0.0)), depth, lit(0.0))
}

/// A distance that can be trusted only near its shape, which lies in the box of the half sizes
/// `half` around `centre`: within `margin` of the box. Farther out, the box's distance takes over.
///
/// The trusted neighbourhood of the box holds all ways from there to the shape. So the value counts in full up to its
/// end, where the value jumps: with a close limit, it would be the same everywhere near a corner, and lead nowhere.
/// No step is longer than `limit`, for values beyond all numbers and slopes that were guessed.
#[inline(always)]
pub fn bounded<R: Real>(
    d: R,
    p: R::Vec3,
    centre: R::Vec3,
    margin: R,
    half: R::Vec3,
    limit: R,
) -> R {
    let beyond = cuboid::<R>(p - centre, half).named("beyond");
    let is_outside = margin.less(beyond);
    let near = d.at_most(limit).at_least(beyond);
    R::select(is_outside, beyond, near).jumping(is_outside)
}

/// A repeated shape's distance, of which only the copy in the point's own cell was evaluated, made safe: at
/// most the distance to the boxes of the neighbouring copies along `axes`. `p` is the point folded into its
/// cell; the copies in the cells above begin at `upper`, those in the cells below end at `lower`.
#[inline(always)]
pub fn repeat_guard<R: Real>(
    d: R,
    p: R::Vec3,
    spacing: R::Vec3,
    lower: R::Vec3,
    upper: R::Vec3,
    axes: R::Vec3,
) -> R {
    let own = [upper - spacing, lower + spacing];
    guarded::<R>(d, p, own, [upper - p, p - lower], axes)
}

/// The same for a limited grid, with the point before it is folded: there are no copies beyond the
/// last cell.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the parameters of a row")]
pub fn repeat_limited_guard<R: Real>(
    d: R,
    p: R::Vec3,
    spacing: R::Vec3,
    inverse: R::Vec3,
    last: R::Vec3,
    lower: R::Vec3,
    upper: R::Vec3,
    axes: R::Vec3,
) -> R {
    let (zero, one) = (R::Vec3::splat(lit(0.0)), R::Vec3::splat(lit(1.0)));
    let q = (p + spacing * last * lit::<R>(0.5)).named("q");
    let cell = (q * inverse + R::Vec3::splat(lit(0.5)))
        .floor()
        .max(zero)
        .min(last)
        .named("cell");
    let folded = (q - spacing * cell).named("folded");
    let far = lit::<R>(FAR);
    let above = upper - folded + (cell - last + one).max(zero) * far;
    let below = folded - lower + (one - cell).max(zero) * far;
    let own = [upper - spacing, lower + spacing];
    guarded::<R>(d, folded, own, [above, below], axes)
}

/// Farther than any copy; its square is finite.
const FAR: f64 = 1e15;

/// The smallest of a distance and those to the boxes that hold the copies next to a cell. Along an
/// axis, a neighbour is as far as the gap to it; across, it is as far as the nearer of it and the
/// cell's own copy, whose box lies between the two corners of `own`.
#[inline(always)]
fn guarded<R: Real>(
    d: R,
    p: R::Vec3,
    own: [R::Vec3; 2],
    [above, below]: [R::Vec3; 2],
    axes: R::Vec3,
) -> R {
    let zero = R::Vec3::splat(lit(0.0));
    let gap = above.min(below).max(zero).named("gap");
    let gap = R::Vec3::new(
        along::<R>(axes.x(), gap.x()),
        along::<R>(axes.y(), gap.y()),
        along::<R>(axes.z(), gap.z()),
    );
    let beside = (own[0] - p).max(p - own[1]).max(zero);
    let across = beside.min(gap).named("across");
    let (x, y, z) = (across.x(), across.y(), across.z());
    d.min(diagonal::<R>(gap.x(), y, z))
        .min(diagonal::<R>(gap.y(), z, x))
        .min(diagonal::<R>(gap.z(), x, y))
}

/// The gap along an axis whose neighbours are not guarded against is as far as any.
#[inline(always)]
fn along<R: Real>(axis: R, gap: R) -> R {
    R::select(lit::<R>(0.5).less(axis), gap, lit(FAR))
}

/// The length of three parts at right angles.
#[inline(always)]
fn diagonal<R: Real>(a: R, b: R, c: R) -> R {
    (a * a + b * b + c * c).sqrt()
}
