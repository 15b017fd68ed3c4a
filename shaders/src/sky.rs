//! The light that comes from everywhere, and the air in between.

use sdfc_vm::real::{Real, Vector3, lit};

/// The sine of the angle below the horizon up to which the ground is hazy.
const HAZE: f64 = 0.35;

/// The colour of the sky in a direction of length one. Below the horizon it turns into that of the ground, as
/// softly as haze and `blur` make it: 0 for what the eye sees, the roughness for what a surface mirrors.
#[inline(always)]
pub fn sky<R: Real>(
    direction: R::Vec3,
    up: R::Vec3,
    top: R::Vec3,
    horizon: R::Vec3,
    ground: R::Vec3,
    blur: R,
) -> R::Vec3 {
    let height = direction.dot(up).named("height");
    let above = height.max(lit(0.0)).sqrt();
    let heaven = horizon.mix(top, above);
    let edge = (blur + lit(HAZE)).named("edge");
    heaven.mix(ground, (-height).smoothstep(lit(0.0), edge))
}

/// The light of the whole sky on a surface, as the mean colour over the hemisphere it faces.
#[inline(always)]
pub fn sky_on<R: Real>(
    normal: R::Vec3,
    up: R::Vec3,
    top: R::Vec3,
    horizon: R::Vec3,
    ground: R::Vec3,
) -> R::Vec3 {
    let heaven = horizon.mix(top, lit(0.6));
    ground.mix(heaven, normal.dot(up) * lit(0.5) + lit(0.5))
}

/// How much of what lies at `t` the air hides.
#[inline(always)]
pub fn hidden_by_fog<R: Real>(t: R, density: R) -> R {
    lit::<R>(1.0) - (-(t * density)).exp()
}
