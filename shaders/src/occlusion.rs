//! How much of the sky a surface sees, from what the field says of its surroundings.
//!
//! A tap asks the field at some distance from the surface. Were the surface a plane with nothing
//! on it, the field there would be the height above it; what is missing is hidden.

use sdfc_vm::real::{Real, Vector3, lit};

/// The angle between two directions of a spiral that spreads them evenly.
const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653_3;

/// The distance of a tap along the normal: `index` counts from 0 to 4, and taps are closer
/// together near the surface.
#[inline(always)]
pub fn five_distance<R: Real>(index: R, reach: R) -> R {
    let share = (index + lit(1.0)) * lit(0.2);
    reach * share * share
}

/// What five taps along the normal hide at most, as a share of the sky: they see a wall beside them
/// as if it stood in front, though it hides no more than half.
pub const FIVE_MOST: f32 = 0.6;

/// What the taps along the normal weigh: the near ones most.
#[inline(always)]
pub fn five_weight<R: Real>(index: R) -> R {
    lit::<R>(1.0) / (index + lit(1.0))
}

/// The direction of a tap over the hemisphere around `normal`; together they are spread as the
/// light of an even sky counts. `place` is the pixel and the pass, which turn all directions
/// by an angle of their own.
#[inline(always)]
pub fn many_direction<R: Real>(normal: R::Vec3, index: R, count: R, place: R::Vec3) -> R::Vec3 {
    let up = many_cosine(index, count).named("up");
    let out = (lit::<R>(1.0) - up * up).max(lit(0.0)).sqrt().named("out");
    let own = own_hash::<R>(place).x() * lit(std::f64::consts::PI);
    let turn = (index * lit(GOLDEN_ANGLE) + own).named("turn");
    let (tangent, bitangent) = frame_around::<R>(normal);
    tangent * (out * turn.cos()) + bitangent * (out * turn.sin()) + normal * up
}

/// The distance of a tap over the hemisphere. Distances follow an order that has nothing to do with
/// the angles (the powers of 0.7548… spread evenly together with most others), or one side would
/// have all the far taps.
#[inline(always)]
pub fn many_distance<R: Real>(index: R, place: R::Vec3, reach: R) -> R {
    let order =
        ((index + lit(0.5)) * lit(0.754_877_666_246_693) + own_hash::<R>(place).y()).fract();
    let share = (order * lit(0.9) + lit(0.1)).named("share");
    reach * share * share
}

/// Numbers of a pixel's own, in [-1, 1).
#[inline(always)]
fn own_hash<R: Real>(place: R::Vec3) -> R::Vec3 {
    R::lattice(place, lit(7.0)).named("hash")
}

/// The cosine between the normal and a tap's direction: its squares are spread evenly.
#[inline(always)]
pub fn many_cosine<R: Real>(index: R, count: R) -> R {
    (lit::<R>(1.0) - (index + lit(0.5)) / count)
        .max(lit(0.0))
        .sqrt()
}

/// What a tap sees hidden, from 0 to its weight: `height` is what the field would be above a
/// plane, `distance` how far the tap is from the point. A field that is half as large counts as
/// open, since what is beside a tap hides little, and many fields are bounds that fall short.
#[inline(always)]
pub fn hidden<R: Real>(field: R, height: R, distance: R, weight: R) -> R {
    (height - field * lit::<R>(2.0)).clamp(lit(0.0), height) / distance.max(lit(1e-20)) * weight
}

/// 1 if a field at a tap, taken for a distance, would hide something, else 0: a claim that has to be checked. `slope`
/// is the length of the field's gradient at the surface, which the field is measured by here.
#[inline(always)]
pub fn claims<R: Real>(field: R, height: R, slope: R) -> R {
    let near = (field * lit::<R>(2.0)).less(height * slope);
    R::select(R::and(lit::<R>(0.0).less(field), near), lit(1.0), lit(0.0))
}

/// The largest distance of a surface from a tap that hides something.
#[inline(always)]
pub fn limit<R: Real>(height: R) -> R {
    height * lit(0.5)
}

/// What is seen of the sky: `hidden` is the sum over all taps, `weight` what it is at most.
#[inline(always)]
pub fn open<R: Real>(hidden: R, weight: R) -> R {
    (lit::<R>(1.0) - hidden / weight.max(lit(1e-20))).saturate()
}

/// Two directions at right angles to a normal and to each other (T. Duff and others, *Building an
/// Orthonormal Basis, Revisited*, 2017).
#[inline(always)]
pub fn frame_around<R: Real>(n: R::Vec3) -> (R::Vec3, R::Vec3) {
    let side = n.z().side().named("side");
    let a = (lit::<R>(-1.0) / (side + n.z())).named("a");
    let b = (n.x() * n.y() * a).named("b");
    (
        R::Vec3::new(
            lit::<R>(1.0) + side * n.x() * n.x() * a,
            side * b,
            -(side * n.x()),
        ),
        R::Vec3::new(b, side + n.y() * n.y() * a, -n.y()),
    )
}
