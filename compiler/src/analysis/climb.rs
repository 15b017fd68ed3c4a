//! Points of a solid, found by descent along its gradient and by climbing along its surface.
//!
//! Intervals bound the extent of a solid from outside, but very loosely for folded and twisted fields. Points
//! bound it from inside. They prove nothing about the parts that they miss: they place cameras, but do not
//! limit steps.

use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::evaluate::{evaluate_f64, gradient};
use sdfc_vm::program::Program;
use sdfc_vm::vector::V3;

/// Number of directions from the centre of the box in which descents start.
const START_DIRECTIONS: u32 = 144;
/// Ratio of the distances of successive shells of starts; the largest is the box's half diagonal.
const SHELL_RATIO: f64 = 1.0 / 6.0;
/// Number of shells.
const SHELL_COUNT: i32 = 6;
/// Maximum number of steps of a descent.
const MAX_DESCENT_STEPS: usize = 40;
/// Step at which a descent ends, in half diagonals of the box.
const MIN_STEP: f64 = 1e-7;
/// Distance by which points may be outside the box, in its half diagonals.
const BOX_TOLERANCE: f64 = 1e-6;
/// Number of points from which a direction is climbed.
const MAX_CLIMB_STARTS: usize = 6;
/// Maximum number of steps along the surface.
const MAX_CLIMB_STEPS: usize = 14;
/// Number of sample points on a ray from the centre of the box.
const OUTWARD_SAMPLES: u32 = 96;

/// Points of a solid within a box.
pub(crate) struct SurfaceClimb<'a> {
    program: &'a Program,
    /// Points outside this box are discarded.
    bounds: Bounds,
    half: f64,
    points: Vec<DVec3>,
    /// Half diagonal of the points' bounding box.
    pub(crate) size: f64,
}

impl<'a> SurfaceClimb<'a> {
    /// Descends from all directions and from the given points; `None` if no point is found.
    pub(crate) fn new(program: &'a Program, bounds: &Bounds, starts: &[[f64; 3]]) -> Option<Self> {
        let mut climb = Self {
            program,
            bounds: bounds.grown(bounds.half_diagonal() * BOX_TOLERANCE),
            half: bounds.half_diagonal(),
            points: Vec::new(),
            size: 0.0,
        };
        let centre = DVec3::from(bounds.centre());
        for start in 0..START_DIRECTIONS {
            let direction = DVec3::from(fibonacci_direction(start, START_DIRECTIONS));
            let distance = climb.half * SHELL_RATIO.powi(start as i32 % SHELL_COUNT);
            let points = climb.descend_within(centre + direction * distance);
            climb.points.extend(points);
        }
        for &point in starts {
            let points = climb.descend_within(point.into());
            climb.points.extend(points);
        }
        let points = climb.points.iter();
        let hull = points.fold(Bounds::EMPTY, |hull, &p| hull.including(p.into()));
        climb.size = hull.half_diagonal();
        (!climb.points.is_empty()).then_some(climb)
    }

    /// Returns the largest `direction · p` of the points found, and of points climbed to from them.
    pub(crate) fn extent(&self, direction: [f64; 3]) -> f64 {
        let direction = DVec3::from(direction);
        let projection = |p: &DVec3| direction.dot(*p);
        let mut starts = self.points.clone();
        starts.extend(self.farthest_outward(direction));
        starts.sort_by(|a, b| projection(b).total_cmp(&projection(a)));
        starts.truncate(MAX_CLIMB_STARTS);
        let extents = starts.into_iter().map(|start| {
            let (mut point, mut stride) = (start, self.size / 4.0);
            for _ in 0..MAX_CLIMB_STEPS {
                match self.descend_within(point + direction * stride) {
                    Some(next) if projection(&next) > projection(&point) => point = next,
                    _ => stride /= 2.0,
                }
            }
            projection(&point)
        });
        extents.fold(f64::NEG_INFINITY, f64::max)
    }

    /// Returns the farthest sample point of the solid on a ray from the centre of the box.
    ///
    /// Solids of revolution often end in a knob on the axis, which climbs from beside it miss.
    fn farthest_outward(&self, direction: DVec3) -> Option<DVec3> {
        let centre = DVec3::from(self.bounds.centre());
        let step = self.half / (direction.length() * f64::from(OUTWARD_SAMPLES));
        let points = (1..=OUTWARD_SAMPLES).rev().map(|number| {
            let distance = step * f64::from(number);
            centre + direction * distance
        });
        points
            .filter(|&p| self.is_within(p))
            .find(|&p| evaluate_f64(self.program, p.into()) <= 0.0)
    }

    /// Descends from a point to the surface; `None` if the end is outside the box.
    fn descend_within(&self, point: DVec3) -> Option<DVec3> {
        self.descend(point).filter(|&end| self.is_within(end))
    }

    fn is_within(&self, p: DVec3) -> bool {
        let Bounds { min, max } = self.bounds;
        (0..3).all(|axis| (min[axis]..=max[axis]).contains(&p[axis]))
    }

    fn descend(&self, mut point: DVec3) -> Option<DVec3> {
        for _ in 0..MAX_DESCENT_STEPS {
            let sample = gradient::<f64>(self.program, V3::new(point.x, point.y, point.z));
            let V3 { x, y, z } = sample.gradient;
            let slope = DVec3::new(x, y, z);
            let square = slope.length_squared();
            if sample.value <= 0.0 {
                return Some(point);
            }
            let step = sample.value / square;
            if !step.is_finite() {
                return None;
            }
            point -= step * slope;
            if step * square.sqrt() < self.half * MIN_STEP {
                return Some(point);
            }
        }
        None
    }
}

/// Returns direction `number` of `count` directions of a Fibonacci lattice. Regular subsets are evenly spread,
/// too.
pub(crate) fn fibonacci_direction(number: u32, count: u32) -> [f64; 3] {
    let height = 1.0 - (2.0 * f64::from(number) + 1.0) / f64::from(count);
    let turn = f64::from(number) * std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    let across = (1.0 - height * height).sqrt();
    [across * turn.cos(), height, across * turn.sin()]
}
