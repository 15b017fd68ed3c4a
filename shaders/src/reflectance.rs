//! Reflection at a surface: Lambert's diffuse term, and a GGX microfacet highlight with Smith's shadowing and
//! Schlick's Fresnel term (B. Walter and others, *Microfacet Models for Refraction through Rough Surfaces*,
//! 2007; C. Schlick, 1994).

use sdfc_vm::real::{Real, Vector3, lit};

/// Returns the cosine of the angle between two directions of length one.
#[inline(always)]
pub fn cosine<R: Real>(a: R::Vec3, b: R::Vec3) -> R {
    a.dot(b)
}

/// Reflectance of a dielectric at normal incidence: an index of refraction of 1.5.
const DIELECTRIC_F0: f64 = 0.04;

/// Returns the specular reflectance at normal incidence (F0), per colour.
#[inline(always)]
pub fn normal_reflectance<R: Real>(albedo: R::Vec3, metallic: R) -> R::Vec3 {
    R::Vec3::splat(lit(DIELECTRIC_F0)).mix(albedo, metallic)
}

/// Returns the specular reflectance for an angle of incidence with this cosine.
#[inline(always)]
pub fn fresnel<R: Real>(f0: R::Vec3, cosine: R) -> R::Vec3 {
    let grazing = (lit::<R>(1.0) - cosine).saturate().named("grazing");
    let grazing_square = (grazing * grazing).named("grazing_square");
    f0 + (R::Vec3::splat(lit(1.0)) - f0) * (grazing_square * grazing_square * grazing)
}

/// Returns the bidirectional reflectance of a surface times the cosine of the angle of incidence. `to_camera` and `to_light` have length one; `diffuse` is the diffuse albedo there.
#[inline(always)]
pub fn reflected<R: Real>(
    normal: R::Vec3,
    to_camera: R::Vec3,
    to_light: R::Vec3,
    albedo: R::Vec3,
    diffuse: R::Vec3,
    roughness: R,
    metallic: R,
) -> R::Vec3 {
    let one = lit::<R>(1.0);
    let nl = normal.dot(to_light).saturate().named("nl");
    let nv = normal.dot(to_camera).max(lit(1e-3)).named("nv");
    let halfway = (to_light + to_camera).normalize().named("halfway");
    let nh = normal.dot(halfway).saturate().named("nh");
    let vh = to_camera.dot(halfway).saturate().named("vh");
    // A light without a size would have no highlight in a perfect mirror.
    let rough = roughness.clamp(lit(0.03), one).named("rough");
    let alpha = rough * rough;
    let alpha2 = (alpha * alpha).named("alpha2");
    let spread = (nh * nh * (alpha2 - one) + one).named("spread");
    let distribution = alpha2 / (spread * spread * lit(std::f64::consts::PI)).max(lit(1e-12));
    let masking = |c: R| (alpha2 + (one - alpha2) * c * c).sqrt();
    // Smith's shadowing of both directions, already divided by 4 · nl · nv.
    let shadowing = lit::<R>(0.5) / (nl * masking(nv) + nv * masking(nl)).max(lit(1e-6));
    let specular = fresnel::<R>(normal_reflectance::<R>(albedo, metallic), vh);
    let diffuse = diffuse * lit::<R>(std::f64::consts::FRAC_1_PI);
    (diffuse + specular * (distribution * shadowing)) * nl
}

/// Returns the fraction of the sky's light that is mirrored towards the camera, over all directions: a fit in
/// the roughness (after B. Karis, *Physically Based Shading on Mobile*, 2014). `cosine` is not negative.
#[inline(always)]
pub fn environment_reflectance<R: Real>(f0: R::Vec3, roughness: R, cosine: R) -> R::Vec3 {
    let nv = cosine.named("nv");
    let smoothness = (lit::<R>(1.0) - roughness).named("smoothness");
    let grazing = (nv * lit(-9.28)).exp2();
    let a = ((smoothness * smoothness).min(grazing) * smoothness
        + roughness * lit(-0.0275)
        + lit(0.0425))
    .named("a");
    let scale = lit::<R>(-1.04) * a + roughness * lit(-0.572) + lit(1.04);
    let bias = lit::<R>(1.04) * a + roughness * lit(0.022) + lit(-0.04);
    (f0 * scale + R::Vec3::splat(bias)).max(R::Vec3::splat(lit(0.0)))
}

/// Returns the direction in which a mirror reflects a ray along `direction`.
#[inline(always)]
pub fn mirror_direction<R: Real>(direction: R::Vec3, normal: R::Vec3) -> R::Vec3 {
    direction - normal * (direction.dot(normal) * lit(2.0))
}

/// Returns the diffuse albedo of a surface: the light that it does not mirror, in its colour. The mirrored
/// fraction over all directions depends on its roughness, so that no light is reflected twice.
#[inline(always)]
pub fn diffuse_albedo<R: Real>(
    normal: R::Vec3,
    to_camera: R::Vec3,
    albedo: R::Vec3,
    roughness: R,
    metallic: R,
) -> R::Vec3 {
    let reflectance = environment_reflectance::<R>(
        normal_reflectance::<R>(albedo, metallic),
        roughness,
        normal.dot(to_camera).saturate(),
    );
    (R::Vec3::splat(lit(1.0)) - reflectance) * albedo * (lit::<R>(1.0) - metallic)
}

/// Returns the light of the sky that a surface reflects. `mean_sky` is the mean over the hemisphere that it
/// faces, `mirrored_sky` the sky in the mirror direction, and `open_fraction` the visible fraction of the
/// sky.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "a surface, a camera and a sky")]
pub fn ambient_light<R: Real>(
    normal: R::Vec3,
    to_camera: R::Vec3,
    albedo: R::Vec3,
    diffuse: R::Vec3,
    roughness: R,
    metallic: R,
    mean_sky: R::Vec3,
    mirrored_sky: R::Vec3,
    open_fraction: R,
) -> R::Vec3 {
    let nv = normal.dot(to_camera).saturate();
    let reflectance =
        environment_reflectance::<R>(normal_reflectance::<R>(albedo, metallic), roughness, nv);
    // A rough surface mirrors so wide a region of the sky that little but its mean remains.
    let specular_sky = mirrored_sky.mix(mean_sky, roughness * roughness);
    (diffuse * mean_sky + reflectance * specular_sky) * open_fraction
}

/// Returns the attenuation of a positional light at a distance: its inverse square.
#[inline(always)]
pub fn attenuation<R: Real>(distance: R) -> R {
    lit::<R>(1.0) / (distance * distance).max(lit(1e-6))
}
