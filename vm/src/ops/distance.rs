//! Changes of a distance after its shape is evaluated.

use crate::real::Real;

/// The surface moved outwards by `by`.
#[inline(always)]
pub fn offset<R: Real>(d: R, by: R) -> R {
    d - by
}
