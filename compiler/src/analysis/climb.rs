//! Points of a solid, found by descent along its gradient and by climbing along its surface.
//!
//! Intervals bound the extent of a solid from outside, but very loosely for folded and twisted fields. Points
//! bound it from inside. They prove nothing about the parts that they miss: they place cameras, but do not
//! limit steps.

use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::Dual;
use sdfc_vm::lanes::{LANES, Points, with_identity_jacobian};
use sdfc_vm::program::Program;
use sdfc_vm::tape::Tape;
use sdfc_vm::tape::evaluator::TapeEvaluator;

/// Number of directions from the centre of the box in which descents start.
const START_DIRECTIONS: u32 = 144;
/// Ratio of the distances of successive shells of starts; the largest is the box's half diagonal.
const SHELL_RATIO: f64 = 1.0 / 6.0;
/// Number of shells.
const SHELL_COUNT: i32 = 6;
/// Maximum number of steps of a descent.
const MAX_DESCENT_STEPS: usize = 40;
/// Step at which a descent ends, in half diagonals of the box.
const MIN_STEP: f64 = 1e-6;
/// Minimum step as a fraction of the largest coordinate, since the field is evaluated in `f32`.
const MIN_STEP_FRACTION: f64 = 4e-7;
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
    field: LaneField<'a>,
    /// Points outside this box are discarded.
    bounds: Bounds,
    half: f64,
    points: Vec<DVec3>,
    /// Half diagonal of the points' bounding box.
    pub(crate) size: f64,
}

/// A point that climbs in a direction.
struct Climber {
    /// Index of the direction.
    number: usize,
    point: DVec3,
    stride: f64,
}

impl<'a> SurfaceClimb<'a> {
    /// Descends from all directions and from the given points; `None` if no point is found.
    pub(crate) fn new(program: &'a Program, bounds: &Bounds, starts: &[[f64; 3]]) -> Option<Self> {
        let mut climb = Self {
            field: LaneField::new(program),
            bounds: bounds.grown(bounds.half_diagonal() * BOX_TOLERANCE),
            half: bounds.half_diagonal(),
            points: Vec::new(),
            size: 0.0,
        };
        let centre = DVec3::from(bounds.centre());
        let around = (0..START_DIRECTIONS).map(|start| {
            let direction = DVec3::from(fibonacci_direction(start, START_DIRECTIONS));
            let distance = climb.half * SHELL_RATIO.powi(start as i32 % SHELL_COUNT);
            centre + direction * distance
        });
        let given = starts.iter().map(|&point| DVec3::from(point));
        let starts = around.chain(given).collect();
        climb.points = climb.descend_within(starts).into_iter().flatten().collect();
        let points = climb.points.iter();
        let hull = points.fold(Bounds::EMPTY, |hull, &p| hull.including(p.into()));
        climb.size = hull.half_diagonal();
        (!climb.points.is_empty()).then_some(climb)
    }

    /// Returns for each direction the largest `direction · p` of the points found, and of points climbed to from
    /// them.
    pub(crate) fn extents<const N: usize>(&mut self, directions: [[f64; 3]; N]) -> [f64; N] {
        let directions = directions.map(DVec3::from);
        let outward = self.farthest_outward(&directions);
        let mut climbers = Vec::new();
        for (number, direction) in directions.iter().enumerate() {
            let mut starts = self.points.clone();
            starts.extend(outward[number]);
            starts.sort_by(|a, b| direction.dot(*b).total_cmp(&direction.dot(*a)));
            starts.truncate(MAX_CLIMB_STARTS);
            climbers.extend(starts.into_iter().map(|point| Climber {
                number,
                point,
                stride: self.size / 4.0,
            }));
        }
        for _ in 0..MAX_CLIMB_STEPS {
            let targets = climbers
                .iter()
                .map(|climber| climber.point + directions[climber.number] * climber.stride);
            let targets = targets.collect();
            for (climber, next) in climbers.iter_mut().zip(self.descend_within(targets)) {
                let direction = directions[climber.number];
                match next {
                    Some(next) if direction.dot(next) > direction.dot(climber.point) => {
                        climber.point = next;
                    }
                    _ => climber.stride /= 2.0,
                }
            }
        }
        let mut extents = [f64::NEG_INFINITY; N];
        for climber in climbers {
            let extent = &mut extents[climber.number];
            *extent = extent.max(directions[climber.number].dot(climber.point));
        }
        extents
    }

    /// Returns for each direction the farthest sample point of the solid on a ray from the centre of the box.
    ///
    /// Solids of revolution often end in a knob on the axis, which climbs from beside it miss.
    fn farthest_outward(&mut self, directions: &[DVec3]) -> Vec<Option<DVec3>> {
        let centre = DVec3::from(self.bounds.centre());
        let on_ray = |direction: &DVec3| {
            let step = self.half / (direction.length() * f64::from(OUTWARD_SAMPLES));
            let direction = *direction;
            (1..=OUTWARD_SAMPLES)
                .rev()
                .map(move |number| centre + direction * (step * f64::from(number)))
        };
        let points: Vec<DVec3> = directions.iter().flat_map(on_ray).collect();
        let values = self.field.gradients(&points);
        let samples: Vec<(DVec3, f64)> = points
            .into_iter()
            .zip(values.into_iter().map(|sample| sample.value))
            .collect();
        let rays = samples.chunks(OUTWARD_SAMPLES as usize);
        rays.map(|ray| {
            let mut inside = ray.iter().filter(|(_, value)| *value <= 0.0);
            inside.find(|(p, _)| self.is_within(*p)).map(|(p, _)| *p)
        })
        .collect()
    }

    fn is_within(&self, p: DVec3) -> bool {
        let Bounds { min, max } = self.bounds;
        (0..3).all(|axis| (min[axis]..=max[axis]).contains(&p[axis]))
    }

    /// Descends from points to the surface; `None` where the end is outside the box.
    fn descend_within(&mut self, mut points: Vec<DVec3>) -> Vec<Option<DVec3>> {
        let mut ends = vec![None; points.len()];
        let mut active: Vec<usize> = (0..points.len()).collect();
        for _ in 0..MAX_DESCENT_STEPS {
            if active.is_empty() {
                break;
            }
            let positions: Vec<DVec3> = active.iter().map(|&index| points[index]).collect();
            let mut remaining = Vec::with_capacity(active.len());
            for (index, sample) in active.into_iter().zip(self.field.gradients(&positions)) {
                let point = &mut points[index];
                if sample.value <= 0.0 {
                    ends[index] = Some(*point);
                    continue;
                }
                let square = sample.gradient.length_squared();
                let step = sample.value / square;
                if !step.is_finite() {
                    continue;
                }
                *point -= step * sample.gradient;
                let min_step =
                    (self.half * MIN_STEP).max(point.abs().max_element() * MIN_STEP_FRACTION);
                match step * square.sqrt() < min_step {
                    true => ends[index] = Some(*point),
                    false => remaining.push(index),
                }
            }
            active = remaining;
        }
        let is_within = |end: &DVec3| self.is_within(*end);
        ends.into_iter().map(|end| end.filter(is_within)).collect()
    }
}

/// The field and its gradient at a point.
struct FieldGradient {
    value: f64,
    gradient: DVec3,
}

/// A field that is evaluated at 64 points at once.
struct LaneField<'a> {
    program: &'a Program,
    tape: Tape,
    evaluator: TapeEvaluator<Dual<f32>>,
}

impl<'a> LaneField<'a> {
    fn new(program: &'a Program) -> Self {
        let tape = Tape::new(program);
        Self {
            program,
            evaluator: TapeEvaluator::new(tape.values, tape.points),
            tape,
        }
    }

    fn gradients(&mut self, points: &[DVec3]) -> Vec<FieldGradient> {
        let mut samples = Vec::with_capacity(points.len());
        for points in points.chunks(LANES) {
            let mut columns = Points::default();
            for (lane, point) in points.iter().enumerate() {
                for (column, coordinate) in columns.iter_mut().zip(point.to_array()) {
                    column.0[lane] = coordinate as f32;
                }
            }
            *self.evaluator.inputs_mut() = with_identity_jacobian(&columns);
            let block = self
                .evaluator
                .run(self.program, &self.tape.clauses, points.len());
            samples.extend((0..points.len()).map(|lane| {
                let [x, y, z, value] = [0, 1, 2, 3].map(|column| f64::from(block[column].0[lane]));
                FieldGradient {
                    value,
                    gradient: DVec3::new(x, y, z),
                }
            }));
        }
        samples
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
