//! From what a scene says to what a body wants: done once per scene (or per change of a live
//! `param`), in `f64`, never per point.

use crate::real::{Real, lit};

/// The arguments as they are.
pub fn same<R: Real>(a: &[R]) -> Vec<R> {
    a.to_vec()
}

/// A full size to half sizes.
pub fn half_size<R: Real>(a: &[R]) -> Vec<R> {
    a.iter().map(|&size| size * lit(0.5)).collect()
}

/// A full size and the radius of its rounding, which is kept within what fits.
pub fn rounded_size<R: Real>(a: &[R]) -> Vec<R> {
    let half = [a[0] * lit(0.5), a[1] * lit(0.5), a[2] * lit(0.5)];
    let round = a[3].min(half[0]).min(half[1]).min(half[2]);
    vec![half[0], half[1], half[2], round]
}
