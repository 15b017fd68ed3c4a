//! Translation, rotation, scaling, shear and reflection. The 3×4 matrices map a point of the world back to
//! the shape, row by row with the shift as the fourth number. They are not rows of the table: the compiler
//! multiplies them together and gives each shape a single one.
//!
//! They are generic, because the numbers may depend on parameters.

use crate::real::{Real, lit};

/// A matrix: three rows of three factors and a shift.
pub type Affine<R> = [R; 12];

/// Returns the identity.
pub fn identity<R: Real>() -> Affine<R> {
    scaled_axes([lit(1.0); 3])
}

/// Translates the shape by `by`.
pub fn translate<R: Real>(by: [R; 3]) -> Affine<R> {
    let mut m = identity();
    for axis in 0..3 {
        m[4 * axis + 3] = -by[axis];
    }
    m
}

/// Rotates the shape about `axis` (of any length except zero) by `angle` radians, counterclockwise as seen
/// from the axis' tip.
pub fn rotate<R: Real>(axis: [R; 3], angle: R) -> Affine<R> {
    let square = axis[0] * axis[0] + axis[1] * axis[1] + axis[2] * axis[2];
    let scale = lit::<R>(1.0) / square.max(lit(1e-30)).sqrt();
    let [x, y, z] = axis.map(|v| v * scale);
    let (c, s) = (angle.cos(), angle.sin());
    let t = lit::<R>(1.0) - c;
    // The inverse of a rotation is its transpose, so the sines have opposite signs.
    linear([
        [t * x * x + c, t * x * y + s * z, t * x * z - s * y],
        [t * x * y - s * z, t * y * y + c, t * y * z + s * x],
        [t * x * z + s * y, t * y * z - s * x, t * z * z + c],
    ])
}

/// Rotates the shape about x, then about y, then about z, by three angles.
pub fn rotate_euler<R: Real>(angles: [R; 3]) -> Affine<R> {
    let (o, i) = (lit(0.0), lit(1.0));
    let x = rotate([i, o, o], angles[0]);
    let y = rotate([o, i, o], angles[1]);
    let z = rotate([o, o, i], angles[2]);
    compose(&compose(&x, &y), &z)
}

/// Rotates the shape by a quaternion (x, y, z, w) of any length except zero.
pub fn rotate_quaternion<R: Real>(q: [R; 4]) -> Affine<R> {
    let square = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    let scale = lit::<R>(1.0) / square.max(lit(1e-30)).sqrt();
    let [x, y, z, w] = q.map(|v| v * scale);
    let (one, two) = (lit::<R>(1.0), lit::<R>(2.0));
    linear([
        [
            one - two * (y * y + z * z),
            two * (x * y + w * z),
            two * (x * z - w * y),
        ],
        [
            two * (x * y - w * z),
            one - two * (x * x + z * z),
            two * (y * z + w * x),
        ],
        [
            two * (x * z + w * y),
            two * (y * z - w * x),
            one - two * (x * x + y * y),
        ],
    ])
}

/// Scales the shape along each axis; factors below 1e-12 in magnitude count as 1e-12. Distances must then
/// be multiplied by the smallest magnitude of the factors ([`least_scale`]).
pub fn scale<R: Real>(factors: [R; 3]) -> Affine<R> {
    scaled_axes(factors.map(|f| lit::<R>(1.0) / (f.sign_nonzero() * f.abs().max(lit(1e-12)))))
}

/// Returns the smallest magnitude of three factors: the lowest factor by which a distance may shrink.
pub fn least_scale<R: Real>(factors: [R; 3]) -> R {
    let [x, y, z] = factors.map(|f| f.abs().max(lit(1e-12)));
    x.min(y).min(z)
}

/// Shears the shape: x moves by `xy` per unit of y and by `xz` per unit of z, y by `yz` per unit of z.
pub fn shear<R: Real>(xy: R, xz: R, yz: R) -> Affine<R> {
    let (o, i) = (lit(0.0), lit(1.0));
    linear([[i, -xy, xy * yz - xz], [o, i, -yz], [o, o, i]])
}

/// Reflects the shape in the plane with the normal `normal` (of any length except zero) at the signed
/// distance `at` from the origin.
pub fn reflect<R: Real>(normal: [R; 3], at: R) -> Affine<R> {
    let square = normal[0] * normal[0] + normal[1] * normal[1] + normal[2] * normal[2];
    let length = square.max(lit(1e-30)).sqrt();
    let n = normal.map(|v| v / length);
    let two = lit::<R>(2.0);
    let mut m = identity();
    for row in 0..3 {
        for column in 0..3 {
            m[4 * row + column] = m[4 * row + column] - two * n[row] * n[column];
        }
        m[4 * row + 3] = two * at * n[row];
    }
    m
}

/// Returns the map of a point through `outer` first and then through `inner`, for a shape placed by `inner`
/// and then by `outer`.
pub fn compose<R: Real>(inner: &Affine<R>, outer: &Affine<R>) -> Affine<R> {
    std::array::from_fn(|index| {
        let (row, column) = (index / 4, index % 4);
        let sum = inner[4 * row] * outer[column]
            + inner[4 * row + 1] * outer[4 + column]
            + inner[4 * row + 2] * outer[8 + column];
        if column == 3 {
            sum + inner[4 * row + 3]
        } else {
            sum
        }
    })
}

fn scaled_axes<R: Real>([x, y, z]: [R; 3]) -> Affine<R> {
    let o = lit(0.0);
    linear([[x, o, o], [o, y, o], [o, o, z]])
}

fn linear<R: Real>(rows: [[R; 3]; 3]) -> Affine<R> {
    let o = lit(0.0);
    let [a, b, c] = rows;
    [
        a[0], a[1], a[2], o, b[0], b[1], b[2], o, c[0], c[1], c[2], o,
    ]
}
