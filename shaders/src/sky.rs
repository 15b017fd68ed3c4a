//! The light of the sky, and fog.

use sdfc_vm::real::{Real, Vector3, lit};

/// Sine of the angle below the horizon up to which the ground is hazy.
const MAX_HAZE_SINE: f64 = 0.35;

/// Returns the colour of the sky in a direction of length one. Below the horizon it fades into that of the
/// ground, over a range that grows with `blur`. That is 0 for camera rays, and the roughness for mirrored
/// rays.
#[inline(always)]
pub fn sky_color<R: Real>(
    direction: R::Vec3,
    up: R::Vec3,
    top: R::Vec3,
    horizon: R::Vec3,
    ground: R::Vec3,
    blur: R,
) -> R::Vec3 {
    let height = direction.dot(up).named("height");
    let above = height.max(lit(0.0)).sqrt();
    let upper = horizon.mix(top, above);
    let edge = (blur + lit(MAX_HAZE_SINE)).named("edge");
    upper.mix(ground, (-height).smoothstep(lit(0.0), edge))
}

/// Returns the light of the whole sky on a surface: the mean colour over the hemisphere that the surface
/// faces.
#[inline(always)]
pub fn mean_sky_color<R: Real>(
    normal: R::Vec3,
    up: R::Vec3,
    top: R::Vec3,
    horizon: R::Vec3,
    ground: R::Vec3,
) -> R::Vec3 {
    let upper = horizon.mix(top, lit(0.6));
    ground.mix(upper, normal.dot(up) * lit(0.5) + lit(0.5))
}

/// Returns the fraction of the light from the distance `t` that fog hides.
#[inline(always)]
pub fn fog_opacity<R: Real>(t: R, density: R) -> R {
    lit::<R>(1.0) - (-(t * density)).exp()
}
