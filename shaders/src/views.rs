//! False colours of debug views: steps, distances, directions, materials, edges.

use sdfc_vm::real::{Real, Vector2, Vector3, lit};

/// Returns a colour literal.
#[inline(always)]
fn rgb<R: Real>(r: f64, g: f64, b: f64) -> R::Vec3 {
    R::Vec3::new(lit(r), lit(g), lit(b))
}

/// Returns a heat map: 0 is black, then blue, red, yellow, and 1 is white.
#[inline(always)]
pub fn heat<R: Real>(fraction: R) -> R::Vec3 {
    let x = (fraction.saturate() * lit(4.0)).named("x");
    let blue = rgb::<R>(0.0, 0.0, 0.0).mix(rgb::<R>(0.12, 0.15, 0.6), x.saturate());
    let red = blue.mix(rgb::<R>(0.8, 0.1, 0.25), (x - lit(1.0)).saturate());
    let yellow = red.mix(rgb::<R>(1.0, 0.8, 0.1), (x - lit(2.0)).saturate());
    yellow.mix(rgb::<R>(1.0, 1.0, 1.0), (x - lit(3.0)).saturate())
}

/// Returns a direction as a colour: each component from −1 to 1 becomes a channel from 0 to 1.
#[inline(always)]
pub fn direction_color<R: Real>(direction: R::Vec3) -> R::Vec3 {
    direction * lit::<R>(0.5) + R::Vec3::splat(lit(0.5))
}

/// Returns a depth as a grey: `range` holds the depths of white and of black.
#[inline(always)]
pub fn depth_color<R: Real>(t: R, range: R::Vec2) -> R::Vec3 {
    let fraction = (range.y() - t) / (range.y() - range.x()).max(lit(1e-20));
    // Never black: that is for rays that hit nothing.
    R::Vec3::splat(fraction.saturate() * lit(0.95) + lit(0.05))
}

/// Returns a colour for an integer: successive numbers differ widely in hue.
#[inline(always)]
pub fn id_color<R: Real>(id: R) -> R::Vec3 {
    let hash = R::lattice(R::Vec3::new(id, lit(0.0), lit(0.0)), lit(3.0)).named("hash");
    let hue = (id * lit(0.618_033_988_749_895) + lit(0.55))
        .fract()
        .named("hue");
    let channel = |shift: f64| {
        let wave = ((hue + lit(shift)).fract() * lit(6.0) - lit(3.0)).abs() - lit(1.0);
        wave.saturate()
    };
    let pure = R::Vec3::new(channel(0.0), channel(2.0 / 3.0), channel(1.0 / 3.0));
    R::Vec3::splat(lit(1.0)).mix(pure, lit(0.65)) * (lit::<R>(0.85) + hash.x() * lit(0.12))
}

/// Returns the field as colours: cool inside, warm outside, darker bands at multiples of `spacing`, a dark
/// line at zero. `pixel_size` is the size of a pixel in the scene.
#[inline(always)]
pub fn distance_color<R: Real>(field: R, spacing: R, pixel_size: R) -> R::Vec3 {
    let magnitude = field.abs().named("magnitude");
    let side_color = R::Vec3::select(
        field.less(lit(0.0)),
        rgb::<R>(0.35, 0.62, 0.85),
        rgb::<R>(0.95, 0.72, 0.42),
    );
    // Fades with the distance from the surface, so that near and far differ.
    let nearness = (magnitude / spacing * lit(-0.12)).exp();
    let tinted = rgb::<R>(0.93, 0.93, 0.92).mix(side_color, nearness * lit(0.75) + lit(0.25));
    // A triangle wave has its corners on the lines; the distance to these is measured in pixels.
    let spacings = magnitude / spacing;
    let to_line = ((spacings + lit(0.5)).fract() - lit(0.5)).abs() * spacing / pixel_size;
    let line = lit::<R>(1.0) - to_line.smoothstep(lit(0.4), lit(1.4));
    // Lines closer than three pixels are not drawn.
    let line_fade = (spacing / pixel_size).smoothstep(lit(3.0), lit(6.0));
    let with_lines = tinted * (lit::<R>(1.0) - line * line_fade * lit(0.28));
    let border = lit::<R>(1.0) - (magnitude / pixel_size).smoothstep(lit(0.8), lit(1.8));
    with_lines.mix(rgb::<R>(0.08, 0.09, 0.12), border)
}

/// Largest change of a field between two pixels; sums of larger ones may overflow.
const MAX_CHANGE: f64 = 1e37;
/// Difference of two successive changes of a field, in parts of a change, from which on the field is no plane.
const MAX_BEND: f64 = 0.25;
/// Distance to the edge of a flat field, in pixels.
const NO_EDGE: f64 = 1e9;
/// Distance in pixels within which an edge is expected between a pixel and its neighbours. A part thinner than a pixel
/// may be nearer than it seems. Where creases meet, a field changes less per pixel than its slope.
pub const NEAR_EDGE: f64 = 1.0;
/// Number of points along a side of a sample's square at which signs are counted.
const COUNTS_PER_SIDE: u32 = 4;
/// Number of points of a sample's square at which signs are counted.
pub const COUNTS: u32 = COUNTS_PER_SIDE * COUNTS_PER_SIDE;

/// Returns the change from one value to another, within finite limits.
#[inline(always)]
fn limited_change<R: Real>(from: R, to: R) -> R {
    (to - from).clamp(lit(-MAX_CHANGE), lit(MAX_CHANGE))
}

/// Returns the change of a field per pixel along an axis of the picture. `before` and `after` are its values at the
/// neighbours.
///
/// Of the changes on both sides, the larger one counts: the other may cross a crease.
#[inline(always)]
pub fn change_per_pixel<R: Real>(before: R, field: R, after: R) -> R {
    let back = limited_change(before, field).named("back");
    let ahead = limited_change(field, after).named("ahead");
    R::select(ahead.abs().less(back.abs()), back, ahead)
}

/// Returns the change of a field per pixel, or that along a diagonal if it is much larger. Where two thin parts cross,
/// the field may be the same at all four neighbours. The neighbour on that diagonal lies away from the edge.
#[inline(always)]
pub fn steepest_change<R: Real>(
    change: R::Vec2,
    field: R,
    upper_left: R,
    upper_right: R,
    lower_left: R,
    lower_right: R,
) -> R::Vec2 {
    let zero = lit::<R>(0.0);
    let is_inside = field.less(zero);
    // How much farther from zero the field is.
    let rise = |neighbour: R| {
        let change = R::select(is_inside, field - neighbour, neighbour - field);
        change.clamp(zero, lit(MAX_CHANGE))
    };
    let sign = R::select(is_inside, lit(-0.5), lit(0.5)).named("sign");
    let mut best = lit::<R>(0.0);
    let mut steepest = R::Vec2::new(zero, zero);
    for (neighbour, x, y) in [
        (upper_left, -1.0, -1.0),
        (upper_right, 1.0, -1.0),
        (lower_left, -1.0, 1.0),
        (lower_right, 1.0, 1.0),
    ] {
        let rise = rise(neighbour).named("rise");
        let is_better = best.less(rise);
        let along = (rise * sign).named("along");
        steepest = R::Vec2::new(
            R::select(is_better, along * lit(x), steepest.x()),
            R::select(is_better, along * lit(y), steepest.y()),
        );
        best = best.max(rise).named("best");
    }
    // The length of a change of equal parts along both axes.
    let length = (best * lit(std::f64::consts::FRAC_1_SQRT_2)).named("length");
    let largest = change.x().abs().max(change.y().abs());
    let is_steeper = (largest * lit(2.0)).less(length);
    R::Vec2::new(
        R::select(is_steeper, steepest.x(), change.x()),
        R::select(is_steeper, steepest.y(), change.y()),
    )
}

/// Returns the distance from a pixel's middle to the edge of a 2-D shape, in pixels and negative inside. It is the
/// field divided by its change per pixel. So a factor of the field moves no edge.
#[inline(always)]
pub fn pixels_to_edge<R: Real>(field: R, change: R::Vec2) -> R {
    let largest = change.x().abs().max(change.y().abs()).named("largest");
    let scale = largest.at_least(lit(1e-30)).named("scale");
    let (x, y) = (change.x() / scale, change.y() / scale);
    let steepness = (scale * (x * x + y * y).sqrt()).named("steepness");
    let by_sign = R::select(field.less(lit(0.0)), lit(-NO_EDGE), lit(NO_EDGE));
    R::select(lit::<R>(0.0).less(steepness), field / steepness, by_sign)
}

/// Returns the fraction of a sample's square that a 2-D shape covers, from the distance of the edge in pixels. A
/// pixel has `samples` squares.
#[inline(always)]
pub fn coverage<R: Real>(pixels: R, samples: R) -> R {
    (lit::<R>(0.5) - pixels * samples.sqrt()).saturate()
}

/// Returns how much a field bends at the middle one of three values.
#[inline(always)]
fn bend<R: Real>(before: R, field: R, after: R) -> R {
    (limited_change(field, after) - limited_change(before, field)).abs()
}

/// Returns 1 where the values of a pixel and of its neighbours do not tell how much of it is covered, else 0.
///
/// Either the sign changes and the field is no plane, as at corners, at jumps and where parts of different slopes
/// meet. Or the edge seems near and no sign changes: the part is thinner than a pixel, or the field only touches zero.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "the neighbours of a pixel")]
pub fn is_uneven_edge<R: Real>(
    field: R,
    left: R,
    right: R,
    above: R,
    below: R,
    upper_left: R,
    upper_right: R,
    lower_left: R,
    lower_right: R,
    change: R::Vec2,
    pixels: R,
) -> R {
    let zero = lit::<R>(0.0);
    let lowest_beside = left.min(right).min(above.min(below));
    let highest_beside = left.max(right).max(above.max(below));
    let lowest_corner = upper_left.min(upper_right).min(lower_left.min(lower_right));
    let highest_corner = upper_left.max(upper_right).max(lower_left.max(lower_right));
    let lowest = lowest_beside.min(lowest_corner).min(field).named("lowest");
    let highest = highest_beside
        .max(highest_corner)
        .max(field)
        .named("highest");
    let changes = R::and(lowest.less(zero), R::not(highest.less(zero)));

    let along_axes = bend(left, field, right).max(bend(above, field, below));
    let diagonal = bend(upper_left, field, lower_right).max(bend(upper_right, field, lower_left));
    // Along a diagonal, the square of the step is twice as large.
    let largest_bend = along_axes.max(diagonal * lit(0.5)).named("largest_bend");
    let largest_change = change.x().abs().max(change.y().abs());
    let bends = (largest_change * lit(MAX_BEND)).less(largest_bend);

    let is_near = pixels.abs().less(lit(NEAR_EDGE));
    let is_uneven = R::or(R::and(changes, bends), R::and(R::not(changes), is_near));
    R::select(is_uneven, lit(1.0), zero)
}

/// Returns the offset of a point at which the sign is counted, from a pixel's middle and in pixels. The points are
/// a grid of four by four, sheared such that all rows and columns differ.
#[inline(always)]
pub fn count_offset<R: Real>(index: R, samples: R) -> R::Vec2 {
    let side = f64::from(COUNTS_PER_SIDE);
    let column = (index * lit(1.0 / side)).floor().named("column");
    let row = (index - column * lit(side)).named("row");
    let first = lit::<R>(0.5 / side);
    let x = column + row * lit(1.0 / side) + first;
    let y = row + (lit::<R>(side - 1.0) - column) * lit(1.0 / side) + first;
    let size = (samples.sqrt() * lit(side)).named("size");
    let middle = lit::<R>(0.5 * side);
    R::Vec2::new((x - middle) / size, (y - middle) / size)
}

/// Returns the strength of the edge between two neighbouring samples of surfaces, from 0 to 1.
///
/// It is the largest of a step in depth, a bend, and a change of material. The step is measured along the
/// normal of either sample and in pixels, so that slanted surfaces are no edges. `same_coverage` is 0 where
/// exactly one of the samples is a surface, else 1.
#[inline(always)]
#[expect(clippy::too_many_arguments, reason = "two samples, side by side")]
pub fn edge_between<R: Real>(
    p: R::Vec3,
    normal: R::Vec3,
    id: R,
    p_other: R::Vec3,
    normal_other: R::Vec3,
    id_other: R,
    half_pixel: R,
    same_coverage: R,
) -> R {
    let between = (p_other - p).named("between");
    let height = between
        .dot(normal)
        .abs()
        .min(between.dot(normal_other).abs());
    let step = (height / half_pixel).smoothstep(lit(4.0), lit(10.0));
    let bend = (lit::<R>(1.0) - normal.dot(normal_other)).smoothstep(lit(0.08), lit(0.25));
    let material = (id - id_other).abs().saturate();
    lit::<R>(1.0).mix(step.max(bend).max(material), same_coverage)
}

/// Returns the colour of a sample by its edge strength: dark lines on a light surface.
#[inline(always)]
pub fn edge_color<R: Real>(edge: R, paper: R::Vec3) -> R::Vec3 {
    paper.mix(rgb::<R>(0.02, 0.02, 0.03), edge.saturate())
}

/// Returns the background of the lines: nearly white, slightly darker where the surface turns away.
#[inline(always)]
pub fn paper_color<R: Real>(normal: R::Vec3, direction: R::Vec3) -> R::Vec3 {
    rgb::<R>(0.86, 0.86, 0.84) * (lit::<R>(0.7) - normal.dot(direction) * lit(0.3))
}
