//! Fields of scenes, and the points of boxes at which claims are most likely to fail.

use crate::corpus::{compiled, name, on_large_stack, scenes};
use crate::strangers;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::cells::{Aabb, CellSpec, CellSplit, Cells, SplitRule, build};
use sdfc_trials::random::Random;
use sdfc_vm::lanes::{F32x64, LANES, Points};
use sdfc_vm::program::Program;
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::tape::{Clause, Tape};
use std::path::{Path, PathBuf};

/// Side of the split box of unbounded scenes.
const ENDLESS_SIDE: f32 = 24.0;
/// Number of levels of cells, with 64 children each.
pub(super) const LEVELS: i32 = 3;
/// One in this number of scenes of strangers is used.
const STRANGERS_STRIDE: usize = 6;

/// A field and its box of cells.
pub(super) struct Field {
    pub(super) name: String,
    pub(super) program: Program,
    pub(super) tape: Tape,
    pub(super) region: Aabb,
}

impl Field {
    /// Creates the field of a program within a scene's bounds.
    pub(super) fn new(name: String, program: Program, low: [f64; 3], high: [f64; 3]) -> Self {
        // Only a part of unbounded scenes is split.
        let sides: [[f32; 2]; 3] = std::array::from_fn(|axis| {
            let (low, high) = (low[axis] as f32, high[axis] as f32);
            match (low.is_finite(), high.is_finite()) {
                (true, true) => [low, high],
                (true, false) => [low, low + ENDLESS_SIDE],
                (false, true) => [high - ENDLESS_SIDE, high],
                (false, false) => [-ENDLESS_SIDE / 2.0, ENDLESS_SIDE / 2.0],
            }
        });
        let (low, high) = (sides.map(|[low, _]| low), sides.map(|[_, high]| high));
        let side = (0..3).fold(0.0, |side, axis| f32::max(side, high[axis] - low[axis]));
        // A cube, as in engines, with a margin around the surface.
        let half = if side > 0.0 { side * 0.55 } else { 1.0 };
        let middle: [f32; 3] = std::array::from_fn(|axis| (low[axis] + high[axis]) * 0.5);
        Self {
            tape: Tape::new(&program),
            name,
            program,
            region: Aabb {
                low: middle.map(|v| v - half),
                high: middle.map(|v| v + half),
            },
        }
    }

    /// Loads the field of a scene file.
    fn from_file(path: &Path) -> Self {
        let mut compiled = on_large_stack(|| compiled(path, PassOptions::default()));
        compiled.module.update(0.0);
        let bounds = compiled.module.settings.bounds;
        Self::new(name(path), compiled.module.distance, bounds.min, bounds.max)
    }

    /// Returns the cells of the field: those that may contain a surface, or all if `band` is infinite.
    pub(super) fn cells(&self, band: f32) -> Cells {
        let side = self.region.longest_side() * 4.0_f32.powi(1 - LEVELS) * 1.5;
        build(
            &self.program,
            &self.tape,
            &CellSpec {
                max_slope: 1.0,
                max_split_clauses: u64::MAX,
                region: self.region,
                split: CellSplit::Volume,
                band,
                margin: 0.0,
                rule: &DownToSide(side),
            },
        )
    }

    /// Creates an evaluator for its tape.
    pub(super) fn machine(&self) -> TapeEvaluator<f32> {
        TapeEvaluator::new(self.tape.values, self.tape.points)
    }

    /// Returns the values of a tape at points.
    pub(super) fn values(
        &self,
        machine: &mut TapeEvaluator<f32>,
        tape: &[Clause],
        points: &Points,
    ) -> F32x64 {
        *machine.inputs_mut() = *points;
        *machine.run(&self.program, tape, LANES)
    }
}

/// Splits cells down to a side length.
struct DownToSide(f32);

impl SplitRule for DownToSide {
    fn should_split(&self, region: &Aabb, _: usize, _: f32) -> bool {
        region.longest_side() > self.0
    }
}

/// Returns the fields of all scenes of the repository, and of a sample of the strangers.
pub(super) fn fields() -> impl Iterator<Item = Field> {
    let ours = ["tests/scenes", "examples", "tests/hard"]
        .into_iter()
        .flat_map(scenes);
    let theirs = strangers::folders().into_iter();
    let theirs = theirs.flat_map(|folder| scenes(&folder.to_string_lossy()));
    let step = if is_long() { 1 } else { STRANGERS_STRIDE };
    let paths: Vec<PathBuf> = ours.chain(theirs.step_by(step)).collect();
    paths.into_iter().map(|path| Field::from_file(&path))
}

/// Reports whether the long form is run.
pub(super) fn is_long() -> bool {
    std::env::var_os("SDFC_LONG").is_some_and(|long| long != "0")
}

/// Returns 64 points of a box: its corners, points on its edges and faces, and points inside.
pub(super) fn points_of(region: &Aabb, random: &mut Random) -> Points {
    let mut points = Points::default();
    for lane in 0..LANES {
        // Number of axes on which the point lies at an end.
        let ends = match lane {
            0..8 => 3,
            8..16 => 2,
            16..32 => 1,
            _ => 0,
        };
        let first = random.below(3);
        for turn in 0..3 {
            let axis = (first + turn) % 3;
            let (low, high) = (region.low[axis], region.high[axis]);
            let is_high = if lane < 8 {
                lane >> axis & 1 == 1
            } else {
                random.chance(50)
            };
            let share = random.below(1 << 24) as f32 / (1 << 24) as f32;
            points[axis].0[lane] = match (turn < ends, is_high) {
                (true, true) => high,
                (true, false) => low,
                _ => (low + (high - low) * share).clamp(low, high),
            };
        }
    }
    points
}

/// Returns the point in a lane.
pub(super) fn point_at(points: &Points, lane: usize) -> [f32; 3] {
    [0, 1, 2].map(|axis| points[axis].0[lane])
}

/// Stores a point in a lane.
pub(super) fn set_point(points: &mut Points, lane: usize, p: [f32; 3]) {
    for (column, v) in points.iter_mut().zip(p) {
        column.0[lane] = v;
    }
}

/// Returns points on both sides of zeros of a field: outside in even lanes, inside in odd ones. They lie
/// on lines between points with values of opposite signs. Returns `None` if all values have one sign.
pub(super) fn zeros(
    field: &Field,
    machine: &mut TapeEvaluator<f32>,
    points: &Points,
    values: &F32x64,
    random: &mut Random,
) -> Option<Points> {
    let lanes = |inside: bool| -> Vec<usize> {
        let is_there = |&lane: &usize| (values.0[lane] < 0.0) == inside && !values.0[lane].is_nan();
        (0..LANES).filter(is_there).collect()
    };
    let (outside, inside) = (lanes(false), lanes(true));
    if outside.is_empty() || inside.is_empty() {
        return None;
    }
    let mut ends = Points::default();
    for lane in (0..LANES).step_by(2) {
        set_point(&mut ends, lane, point_at(points, random.pick(&outside)));
        set_point(&mut ends, lane + 1, point_at(points, random.pick(&inside)));
    }
    for _ in 0..BISECTION_STEPS {
        let mut middles = ends;
        for lane in (0..LANES).step_by(2) {
            let (a, b) = (point_at(&ends, lane), point_at(&ends, lane + 1));
            let middle: [f32; 3] = std::array::from_fn(|axis| a[axis] + (b[axis] - a[axis]) * 0.5);
            set_point(&mut middles, lane, middle);
        }
        let values = field.values(machine, &field.tape.clauses, &middles);
        for lane in (0..LANES).step_by(2) {
            let side = usize::from(values.0[lane] < 0.0);
            set_point(&mut ends, lane + side, point_at(&middles, lane));
        }
    }
    Some(ends)
}

/// Number of bisection steps.
const BISECTION_STEPS: usize = 26;
