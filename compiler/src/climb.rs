//! Points of a solid, found by going down its field and along its surface.
//!
//! Intervals bound the reach of a solid from outside, but of folded and twisted fields far too widely. Points
//! bound it from inside. They prove nothing of what they do not find: cameras are placed by them, steps are not.

use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::{evaluate_f64, gradient};
use sdfc_vm::program::Program;
use sdfc_vm::vector::V3;

type Point = [f64; 3];

/// The points from which the field is gone down, around the middle of the box.
const STARTS: u32 = 144;
/// Their distances, as powers of this share of the box's half diagonal.
const CLOSER: f64 = 1.0 / 6.0;
/// The number of distances.
const SHELLS: i32 = 6;
/// The most steps down.
const STEPS: usize = 40;
/// A step that counts as none, as a share of the box's half diagonal.
const ARRIVED: f64 = 1e-7;
/// The length by which points may be outside of the box, in half diagonals of it.
const EDGE: f64 = 1e-6;
/// The points from which a direction is followed.
const CLIMBERS: usize = 6;
/// The most steps along the surface.
const CLIMBS: usize = 14;
/// The points that are asked on the way out from the middle of the box.
const POINTS_OUTWARD: u32 = 96;

/// Points of a solid within a box.
pub(crate) struct Climb<'a> {
    program: &'a Program,
    /// Points beyond this box do not count.
    bounds: Bounds,
    half: f64,
    points: Vec<Point>,
    /// The half diagonal of what was found.
    pub(crate) size: f64,
}

impl<'a> Climb<'a> {
    /// Goes down the field from all around and from the given points; none where nothing is found.
    pub(crate) fn new(program: &'a Program, bounds: &Bounds, starts: &[Point]) -> Option<Self> {
        let mut climb = Self {
            program,
            bounds: bounds.grown(bounds.half_diagonal() * EDGE),
            half: bounds.half_diagonal(),
            points: Vec::new(),
            size: 0.0,
        };
        let centre = bounds.centre();
        for start in 0..STARTS {
            let direction = around(start, STARTS);
            let far = climb.half * CLOSER.powi(start as i32 % SHELLS);
            let at = [0, 1, 2].map(|axis| centre[axis] + direction[axis] * far);
            let found = climb.down(at);
            climb.points.extend(found);
        }
        for &at in starts {
            let found = climb.down(at);
            climb.points.extend(found);
        }
        let found = climb.points.iter();
        let hull = found.fold(Bounds::EMPTY, |hull, &p| hull.including(p));
        climb.size = hull.half_diagonal();
        (!climb.points.is_empty()).then_some(climb)
    }

    /// The largest `direction · p` of the points that were found, and of those on the way from them.
    pub(crate) fn reach(&self, direction: Point) -> f64 {
        let along = |p: &Point| (0..3).map(|axis| direction[axis] * p[axis]).sum::<f64>();
        let mut best: Vec<Point> = self.points.clone();
        best.extend(self.outward(direction));
        best.sort_by(|a, b| along(b).total_cmp(&along(a)));
        best.truncate(CLIMBERS);
        let climbed = best.into_iter().map(|start| {
            let (mut at, mut stride) = (start, self.size / 4.0);
            for _ in 0..CLIMBS {
                let next = [0, 1, 2].map(|axis| at[axis] + direction[axis] * stride);
                match self.down(next) {
                    Some(next) if along(&next) > along(&at) => at = next,
                    _ => stride /= 2.0,
                }
            }
            along(&at)
        });
        climbed.fold(f64::NEG_INFINITY, f64::max)
    }

    /// The farthest point of the solid on the way from the middle of the box.
    ///
    /// Solids that are turned around an axis often end in a knob on it, which climbs from beside it miss.
    fn outward(&self, direction: Point) -> Option<Point> {
        let centre = self.bounds.centre();
        let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        let step = self.half / (length * f64::from(POINTS_OUTWARD));
        let points = (1..=POINTS_OUTWARD).rev().map(|number| {
            let far = step * f64::from(number);
            [0, 1, 2].map(|axis| centre[axis] + direction[axis] * far)
        });
        points
            .filter(|&p| self.is_within(p))
            .find(|&p| evaluate_f64(self.program, p) <= 0.0)
    }

    /// The place in the box where the field falls to zero, from a point on.
    fn down(&self, at: Point) -> Option<Point> {
        self.descend(at).filter(|&found| self.is_within(found))
    }

    fn is_within(&self, p: Point) -> bool {
        let Bounds { min, max } = self.bounds;
        (0..3).all(|axis| (min[axis]..=max[axis]).contains(&p[axis]))
    }

    fn descend(&self, mut at: Point) -> Option<Point> {
        for _ in 0..STEPS {
            let here = gradient::<f64>(self.program, V3::of(at[0], at[1], at[2]));
            let V3 { x, y, z } = here.gradient;
            let square = x * x + y * y + z * z;
            if here.value <= 0.0 {
                return Some(at);
            }
            let way = here.value / square;
            if !way.is_finite() {
                return None;
            }
            for (at, slope) in at.iter_mut().zip([x, y, z]) {
                *at -= way * slope;
            }
            if way * square.sqrt() < self.half * ARRIVED {
                return Some(at);
            }
        }
        None
    }
}

/// One of so many directions that are spread evenly, those of every few of them, too.
pub(crate) fn around(number: u32, count: u32) -> Point {
    let height = 1.0 - (2.0 * f64::from(number) + 1.0) / f64::from(count);
    let turn = f64::from(number) * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let across = (1.0 - height * height).sqrt();
    [across * turn.cos(), height, across * turn.sin()]
}
