//! Tone curves, and the conversion of light to the numbers of a picture file.

use sdfc_vm::real::{Real, Vector3, lit};

/// Returns the luminance of a linear colour (ITU-R BT.709).
#[inline(always)]
pub fn luminance<R: Real>(color: R::Vec3) -> R {
    color.dot(R::Vec3::new(lit(0.2126), lit(0.7152), lit(0.0722)))
}

/// Applies Reinhard's curve to the luminance, which keeps the hue.
#[inline(always)]
pub fn reinhard<R: Real>(color: R::Vec3) -> R::Vec3 {
    color * (lit::<R>(1.0) / (lit::<R>(1.0) + luminance::<R>(color).max(lit(0.0))))
}

/// Applies a filmic curve per channel: dark tones slightly darker, a long shoulder towards white.
///
/// Among quotients of two quadratics it is the one with a slope of 0.6 at 0 and three given values. It maps
/// 0.18 to 0.18, 1 to 0.75 and 16 to 1.
#[inline(always)]
pub fn filmic<R: Real>(color: R::Vec3) -> R::Vec3 {
    let c = color.max(R::Vec3::splat(lit(0.0)));
    R::Vec3::new(
        filmic_curve(c.x()),
        filmic_curve(c.y()),
        filmic_curve(c.z()),
    )
}

#[inline(always)]
fn filmic_curve<R: Real>(x: R) -> R {
    let numerator = x * (x * lit(4.230_823) + lit(0.6));
    let denominator = x * (x * lit(4.185_971_4) + lit(1.255_126)) + lit(1.0);
    (numerator / denominator).min(lit(1.0))
}

/// Applies the transfer curve of sRGB (IEC 61966-2-1): linear near black, then a power.
#[inline(always)]
pub fn encode<R: Real>(color: R::Vec3) -> R::Vec3 {
    R::Vec3::new(
        encode_channel(color.x()),
        encode_channel(color.y()),
        encode_channel(color.z()),
    )
}

#[inline(always)]
fn encode_channel<R: Real>(c: R) -> R {
    let c = c.saturate().named("c");
    R::select(
        c.less(lit(0.003_130_8)),
        c * lit(12.92),
        c.pow(lit(1.0 / 2.4)) * lit(1.055) - lit(0.055),
    )
}

/// Returns a channel from 0 to 1 as an integer from 0 to 255.
#[inline(always)]
pub fn to_byte<R: Real>(channel: R) -> R {
    (channel.saturate() * lit(255.0)).round()
}
