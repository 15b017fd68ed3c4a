//! First roots of rays by closed forms in `f64`. Each solid is the set where certain polynomials in `t` are
//! negative; their roots are isolated between those of their derivatives, by sign.

use glam::DVec3;
use sdfc_runtime::reference::ReferenceRay;

type Point = [f64; 3];

/// A solid with known intersections with rays.
pub(crate) trait Solid {
    /// Reports whether a point is inside.
    fn inside(&self, p: Point) -> bool;
    /// Ray parameters at which a ray may enter or leave, in order.
    fn crossings(&self, ray: &ReferenceRay) -> Vec<f64>;
    /// The outward normal near a point of the surface.
    fn outward(&self, p: Point) -> Point;

    /// The first parameter up to `far` at which a ray enters, or leaves if it starts inside.
    fn first(&self, ray: &ReferenceRay, far: f64) -> Option<f64> {
        let inside = self.inside(ray.origin);
        let mut crossings: Vec<f64> = self.crossings(ray);
        crossings.retain(|&t| t > 0.0);
        crossings.sort_by(f64::total_cmp);
        let ends = crossings.iter().skip(1).copied().chain([f64::INFINITY]);
        let changes = |(&t, next): (&f64, f64)| {
            let beyond = if next.is_finite() {
                t + (next - t) / 2.0
            } else {
                t + 1.0
            };
            (self.inside(ray.at(beyond)) != inside && t <= far).then_some(t)
        };
        crossings.iter().zip(ends).find_map(changes)
    }

    /// The outward normal where a ray hits the surface, and the sine of the angle between both.
    fn normal(&self, ray: &ReferenceRay, t: f64) -> [Point; 2] {
        let n = self.outward(ray.at(t));
        let n = n.map(|v| v / dot(n, n).sqrt());
        [n, [dot(n, ray.direction).abs(); 3]]
    }
}

fn dot(a: Point, b: Point) -> f64 {
    DVec3::from(a).dot(b.into())
}

/// The value of a polynomial; the coefficients begin with the constant.
fn value(polynomial: &[f64], t: f64) -> f64 {
    polynomial.iter().rev().fold(0.0, |sum, c| sum * t + c)
}

/// The sign changes of a polynomial in an interval. Between neighbouring roots of its derivative it is
/// monotone, and bisection finds the root to the last place.
fn sign_changes(polynomial: &[f64], [low, high]: [f64; 2]) -> Vec<f64> {
    if polynomial.len() < 2 {
        return vec![];
    }
    let slope = polynomial.iter().enumerate().skip(1);
    let slope: Vec<f64> = slope.map(|(power, c)| power as f64 * c).collect();
    let mut ends = vec![low];
    ends.extend(sign_changes(&slope, [low, high]));
    ends.push(high);
    let mut roots = Vec::new();
    for pair in ends.windows(2) {
        let (mut a, mut b) = (pair[0], pair[1]);
        let rising = value(polynomial, b) > 0.0;
        if (value(polynomial, a) > 0.0) == rising {
            continue;
        }
        loop {
            let middle = a + (b - a) / 2.0;
            if middle <= a || middle >= b {
                break;
            }
            if (value(polynomial, middle) > 0.0) == rising {
                b = middle;
            } else {
                a = middle;
            }
        }
        roots.push(a);
    }
    roots
}

/// The parameter of the point of a ray nearest to the origin, and the ray from that point. Polynomials around
/// it have smaller rounding errors than around a distant camera.
fn recentred(ray: &ReferenceRay) -> (f64, ReferenceRay) {
    let t = -dot(ray.origin, ray.direction) / dot(ray.direction, ray.direction);
    let recentred_ray = ReferenceRay {
        origin: ray.at(t),
        direction: ray.direction,
    };
    (t, recentred_ray)
}

/// The parameters at which a polynomial along a recentred ray changes its sign.
fn along(ray: &ReferenceRay, polynomial: impl Fn(&ReferenceRay) -> Vec<f64>) -> Vec<f64> {
    let (shift, recentred_ray) = recentred(ray);
    let roots = sign_changes(&polynomial(&recentred_ray), [-1e5, 1e5]);
    roots.into_iter().map(|t| t + shift).collect()
}

/// `Σ wᵢ (oᵢ + t dᵢ)²` along a ray.
fn square(ray: &ReferenceRay, weights: Point) -> [f64; 3] {
    let (o, d) = (ray.origin, ray.direction);
    let weighted = |a: Point| -> Point { std::array::from_fn(|i| a[i] * weights[i]) };
    [
        dot(weighted(o), o),
        2.0 * dot(weighted(o), d),
        dot(weighted(d), d),
    ]
}

/// The parameters at which a coordinate has one of two values.
fn faces(ray: &ReferenceRay, axis: usize, positions: [f64; 2]) -> Vec<f64> {
    let (o, d) = (ray.origin[axis], ray.direction[axis]);
    positions
        .iter()
        .filter(|_| d != 0.0)
        .map(|v| (v - o) / d)
        .collect()
}

fn round(ray: &ReferenceRay, weights: Point, r: f64) -> Vec<f64> {
    along(ray, |ray| {
        let [c, b, a] = square(ray, weights);
        vec![c - r * r, b, a]
    })
}

pub(crate) struct Sphere {
    pub(crate) r: f64,
}
impl Solid for Sphere {
    fn inside(&self, p: Point) -> bool {
        dot(p, p) < self.r * self.r
    }
    fn crossings(&self, ray: &ReferenceRay) -> Vec<f64> {
        round(ray, [1.0; 3], self.r)
    }
    fn outward(&self, p: Point) -> Point {
        p
    }
}

pub(crate) struct Plane {
    pub(crate) normal: Point,
    pub(crate) at: f64,
}
impl Solid for Plane {
    fn inside(&self, p: Point) -> bool {
        dot(p, self.normal) < self.at
    }
    fn crossings(&self, ray: &ReferenceRay) -> Vec<f64> {
        let speed = dot(ray.direction, self.normal);
        vec![(self.at - dot(ray.origin, self.normal)) / speed]
    }
    fn outward(&self, _: Point) -> Point {
        self.normal
    }
}

pub(crate) struct Cuboid {
    pub(crate) half: Point,
}
impl Solid for Cuboid {
    fn inside(&self, p: Point) -> bool {
        (0..3).all(|i| p[i].abs() < self.half[i])
    }
    fn crossings(&self, ray: &ReferenceRay) -> Vec<f64> {
        let pair = |axis: usize| faces(ray, axis, [-self.half[axis], self.half[axis]]);
        (0..3).flat_map(pair).collect()
    }
    fn outward(&self, p: Point) -> Point {
        let beyond = |i: &usize| p[*i].abs() - self.half[*i];
        let axis = (0..3).max_by(|a, b| beyond(a).total_cmp(&beyond(b)));
        let axis = axis.unwrap_or(0);
        let mut n = [0.0; 3];
        n[axis] = p[axis].signum();
        n
    }
}

pub(crate) struct Capsule {
    pub(crate) half: f64,
    pub(crate) r: f64,
}
impl Solid for Capsule {
    fn inside(&self, p: Point) -> bool {
        let n = self.outward(p);
        dot(n, n) < self.r * self.r
    }
    fn crossings(&self, ray: &ReferenceRay) -> Vec<f64> {
        let mut crossings = round(ray, [1.0, 0.0, 1.0], self.r);
        for y in [-self.half, self.half] {
            let [ox, oy, oz] = ray.origin;
            let moved = ReferenceRay {
                origin: [ox, oy - y, oz],
                direction: ray.direction,
            };
            crossings.extend(round(&moved, [1.0; 3], self.r));
        }
        crossings
    }
    fn outward(&self, [x, y, z]: Point) -> Point {
        [x, y - y.clamp(-self.half, self.half), z]
    }
}

pub(crate) struct Cylinder {
    pub(crate) r: f64,
    pub(crate) half: f64,
}
impl Solid for Cylinder {
    fn inside(&self, [x, y, z]: Point) -> bool {
        x * x + z * z < self.r * self.r && y.abs() < self.half
    }
    fn crossings(&self, ray: &ReferenceRay) -> Vec<f64> {
        let mut crossings = round(ray, [1.0, 0.0, 1.0], self.r);
        crossings.extend(faces(ray, 1, [-self.half, self.half]));
        crossings
    }
    fn outward(&self, [x, y, z]: Point) -> Point {
        if x.hypot(z) - self.r > y.abs() - self.half {
            [x, 0.0, z]
        } else {
            [0.0, y.signum(), 0.0]
        }
    }
}

/// Points whose distance from the y axis is less than `ratio` times their depth.
pub(crate) struct Cone {
    pub(crate) ratio: f64,
}
impl Solid for Cone {
    fn inside(&self, [x, y, z]: Point) -> bool {
        x.hypot(z) < -y * self.ratio
    }
    fn crossings(&self, ray: &ReferenceRay) -> Vec<f64> {
        let ratio = self.ratio;
        along(ray, |ray| square(ray, [1.0, -ratio * ratio, 1.0]).to_vec())
    }
    fn outward(&self, [x, _, z]: Point) -> Point {
        [x, x.hypot(z) * self.ratio, z]
    }
}

pub(crate) struct Torus {
    pub(crate) ring: f64,
    pub(crate) tube: f64,
}
impl Solid for Torus {
    fn inside(&self, [x, y, z]: Point) -> bool {
        (x.hypot(z) - self.ring).hypot(y) < self.tube
    }
    fn crossings(&self, ray: &ReferenceRay) -> Vec<f64> {
        let (r2, t2) = (self.ring * self.ring, self.tube * self.tube);
        // (|p|² + R² − r²)² − 4 R² (x² + z²)
        along(ray, |ray| {
            let [c, b, a] = square(ray, [1.0; 3]);
            let c = c + r2 - t2;
            let [f, e, d] = square(ray, [1.0, 0.0, 1.0]).map(|v| 4.0 * r2 * v);
            vec![
                c * c - f,
                2.0 * b * c - e,
                2.0 * a * c + b * b - d,
                2.0 * a * b,
                a * a,
            ]
        })
    }
    fn outward(&self, [x, y, z]: Point) -> Point {
        let around = x.hypot(z);
        let factor = (around - self.ring) / around;
        [x * factor, y, z * factor]
    }
}

/// Boxes at all points of a grid in the xz plane.
pub(crate) struct City {
    pub(crate) half: Point,
    pub(crate) spacing: f64,
}
impl City {
    fn folded(&self, [x, y, z]: Point) -> Point {
        let fold = |v: f64| v - self.spacing * (v / self.spacing + 0.5).floor();
        [fold(x), y, fold(z)]
    }
}
impl Solid for City {
    fn inside(&self, p: Point) -> bool {
        Cuboid { half: self.half }.inside(self.folded(p))
    }
    fn crossings(&self, ray: &ReferenceRay) -> Vec<f64> {
        let mut crossings = faces(ray, 1, [-self.half[1], self.half[1]]);
        for cell in -40..=40 {
            let middle = f64::from(cell) * self.spacing;
            for axis in [0, 2] {
                let half = self.half[axis];
                crossings.extend(faces(ray, axis, [middle - half, middle + half]));
            }
        }
        crossings
    }
    fn outward(&self, p: Point) -> Point {
        Cuboid { half: self.half }.outward(self.folded(p))
    }
}
