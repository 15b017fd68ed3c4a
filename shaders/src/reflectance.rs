//! How a surface sends light on: Lambert's diffuse share, and a GGX microfacet highlight with
//! Smith's shadowing and Schlick's Fresnel term (B. Walter and others, *Microfacet Models for
//! Refraction through Rough Surfaces*, 2007; C. Schlick, 1994).

use sdfc_vm::real::{Real, Vector3, lit};

/// The cosine of the angle between two directions of length one.
#[inline(always)]
pub fn cosine<R: Real>(a: R::Vec3, b: R::Vec3) -> R {
    a.dot(b)
}

/// What a dielectric reflects straight on: an index of refraction of 1.5.
const DIELECTRIC: f64 = 0.04;

/// The share that is mirrored straight on, per colour.
#[inline(always)]
pub fn mirrored<R: Real>(albedo: R::Vec3, metallic: R) -> R::Vec3 {
    R::Vec3::splat(lit(DIELECTRIC)).mix(albedo, metallic)
}

/// The share that is mirrored when the light comes at an angle with this cosine.
#[inline(always)]
pub fn fresnel<R: Real>(straight: R::Vec3, cosine: R) -> R::Vec3 {
    let m = (lit::<R>(1.0) - cosine).saturate().named("m");
    let m2 = (m * m).named("m2");
    straight + (R::Vec3::splat(lit(1.0)) - straight) * (m2 * m2 * m)
}

/// The light that goes on towards the viewer per light that arrives straight on, times the cosine
/// of its angle. `to_eye` and `to_light` have length one; `diffuse` is [`diffuse`] there.
#[inline(always)]
pub fn reflected<R: Real>(
    normal: R::Vec3,
    to_eye: R::Vec3,
    to_light: R::Vec3,
    albedo: R::Vec3,
    diffuse: R::Vec3,
    roughness: R,
    metallic: R,
) -> R::Vec3 {
    let one = lit::<R>(1.0);
    let nl = normal.dot(to_light).saturate().named("nl");
    let nv = normal.dot(to_eye).max(lit(1e-3)).named("nv");
    let half = (to_light + to_eye).normalize().named("half_way");
    let nh = normal.dot(half).saturate().named("nh");
    let vh = to_eye.dot(half).saturate().named("vh");
    // A perfect mirror would show a light without size nowhere.
    let rough = roughness.clamp(lit(0.03), one).named("rough");
    let alpha = rough * rough;
    let alpha2 = (alpha * alpha).named("alpha2");
    let spread = (nh * nh * (alpha2 - one) + one).named("spread");
    let distribution = alpha2 / (spread * spread * lit(std::f64::consts::PI)).max(lit(1e-12));
    let masked = |c: R| (alpha2 + (one - alpha2) * c * c).sqrt();
    // Smith's shadowing of both directions, already divided by 4 · nl · nv.
    let shadowing = lit::<R>(0.5) / (nl * masked(nv) + nv * masked(nl)).max(lit(1e-6));
    let mirror = fresnel::<R>(mirrored::<R>(albedo, metallic), vh);
    let diffuse = diffuse * lit::<R>(std::f64::consts::FRAC_1_PI);
    (diffuse + mirror * (distribution * shadowing)) * nl
}

/// The share of the sky's light that is mirrored towards the viewer, over all directions: a fit in
/// the roughness (after B. Karis, *Physically Based Shading on Mobile*, 2014). `cosine` is not
/// negative.
#[inline(always)]
pub fn mirrored_sky<R: Real>(straight: R::Vec3, roughness: R, cosine: R) -> R::Vec3 {
    let nv = cosine.named("nv");
    let r = (lit::<R>(1.0) - roughness).named("r");
    let grazing = (nv * lit(-9.28)).exp2();
    let a = ((r * r).min(grazing) * r + roughness * lit(-0.0275) + lit(0.0425)).named("a");
    let scale = lit::<R>(-1.04) * a + roughness * lit(-0.572) + lit(1.04);
    let bias = lit::<R>(1.04) * a + roughness * lit(0.022) + lit(-0.04);
    (straight * scale + R::Vec3::splat(bias)).max(R::Vec3::splat(lit(0.0)))
}

/// The direction in which a mirror sends on what comes along `direction`.
#[inline(always)]
pub fn mirror<R: Real>(direction: R::Vec3, normal: R::Vec3) -> R::Vec3 {
    direction - normal * (direction.dot(normal) * lit(2.0))
}

/// What a surface sends on diffusely: what it does not mirror, in its colour. How much it mirrors
/// over all directions depends on its roughness, so that no light is sent on twice.
#[inline(always)]
pub fn diffuse<R: Real>(
    normal: R::Vec3,
    to_eye: R::Vec3,
    albedo: R::Vec3,
    roughness: R,
    metallic: R,
) -> R::Vec3 {
    let share = mirrored_sky::<R>(
        mirrored::<R>(albedo, metallic),
        roughness,
        normal.dot(to_eye).saturate(),
    );
    (R::Vec3::splat(lit(1.0)) - share) * albedo * (lit::<R>(1.0) - metallic)
}

/// What a surface sends on of the sky's light: `around` is the mean over the hemisphere it faces,
/// `ahead` what a mirror there would show; `open` is the share that nothing hides.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a surface, an eye and a sky")]
pub fn ambient<R: Real>(
    normal: R::Vec3,
    to_eye: R::Vec3,
    albedo: R::Vec3,
    diffuse: R::Vec3,
    roughness: R,
    metallic: R,
    around: R::Vec3,
    ahead: R::Vec3,
    open: R,
) -> R::Vec3 {
    let nv = normal.dot(to_eye).saturate();
    let share = mirrored_sky::<R>(mirrored::<R>(albedo, metallic), roughness, nv);
    // A rough surface mirrors so wide a part of the sky that little but its mean is left.
    let seen = ahead.mix(around, roughness * roughness);
    (diffuse * around + share * seen) * open
}

/// The light of a near lamp at a place away from it: less with the square of the distance.
#[inline(always)]
pub fn attenuation<R: Real>(distance: R) -> R {
    lit::<R>(1.0) / (distance * distance).max(lit(1e-6))
}
