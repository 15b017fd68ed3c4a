//! Slack for the rounding of interval gradients, which are not rounded outwards.

/// Relative slack of a slope, which covers far more than its rounding.
const SLOPE_SLACK: f32 = 1.001;
/// Slack of the components of a gradient, relative to the slope.
const COMPONENT_SLACK: f32 = 1e-3;
/// Minimum slope: divisions by it must not overflow.
const MIN_SLOPE: f32 = 1e-20;

/// Returns the slope bound and the bounds of a gradient's components, with slack. They are infinite or NaN
/// where the gradient has no bound.
#[inline(always)]
pub(crate) fn with_slack(gradient: [[f32; 2]; 3]) -> (f32, [[f32; 2]; 3]) {
    let square = |[low, high]: [f32; 2]| {
        let max_abs = low.abs().max(high.abs());
        max_abs * max_abs
    };
    let [x, y, z] = gradient.map(square);
    let slope = (x + y + z).sqrt() * SLOPE_SLACK;
    let slack = slope * COMPONENT_SLACK;
    (
        slope,
        gradient.map(|[low, high]| [low - slack, high + slack]),
    )
}

/// Returns a slope bound that is at most that of the whole program, and large enough to divide by.
#[inline(always)]
pub(crate) fn clamped_slope(slope: f32, max_slope: f32) -> f32 {
    slope.clamp(MIN_SLOPE, max_slope)
}
