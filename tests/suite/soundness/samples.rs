//! Fields of scenes, and points of boxes at which what is claimed of them would fail first.

use crate::corpus::{compiled, name, on_large_stack, scenes};
use crate::strangers;
use sdfc_compiler::passes::PassOptions;
use sdfc_runtime::cells::{Cells, Cut, Refine, Region, Split, build};
use sdfc_trials::random::Random;
use sdfc_vm::lanes::{Column, LANES, Points};
use sdfc_vm::program::Program;
use sdfc_vm::tape::machine::Machine;
use sdfc_vm::tape::{Clause, Tape};
use std::path::{Path, PathBuf};

/// The side of the box that is cut where a scene has no end.
const ENDLESS_SIDE: f32 = 24.0;
/// The number of levels of cells, of 64 children each.
pub(super) const LEVELS: i32 = 3;
/// One of this many scenes of strangers is taken.
const STRANGERS_STEP: usize = 6;

/// A field and the box in which it is cut into cells.
pub(super) struct Field {
    pub(super) name: String,
    pub(super) program: Program,
    pub(super) tape: Tape,
    pub(super) region: Region,
}

impl Field {
    /// The field of a program within a scene's bounds.
    pub(super) fn new(name: String, program: Program, low: [f64; 3], high: [f64; 3]) -> Self {
        // Of what has no end, a part is cut.
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
        // A cube, as engines make it, with room for what is near the surface.
        let half = if side > 0.0 { side * 0.55 } else { 1.0 };
        let middle: [f32; 3] = std::array::from_fn(|axis| (low[axis] + high[axis]) * 0.5);
        Self {
            tape: Tape::of(&program),
            name,
            program,
            region: Region {
                low: middle.map(|v| v - half),
                high: middle.map(|v| v + half),
            },
        }
    }

    /// The field of a scene's file.
    fn of_file(path: &Path) -> Self {
        let mut compiled = on_large_stack(|| compiled(path, PassOptions::default()));
        compiled.module.update(0.0);
        let bounds = compiled.module.settings.bounds;
        Self::new(name(path), compiled.module.distance, bounds.min, bounds.max)
    }

    /// The cells of the field: those that may hold a surface, or all where `band` is infinite.
    pub(super) fn cells(&self, band: f32) -> Cells {
        let side = self.region.side() * 4.0_f32.powi(1 - LEVELS) * 1.5;
        build(
            &self.program,
            &self.tape,
            &Cut {
                region: self.region,
                split: Split::Cube,
                band,
                refine: &Down(side),
            },
        )
    }

    /// A machine for its tape.
    pub(super) fn machine(&self) -> Machine<f32> {
        Machine::new(self.tape.values, self.tape.points)
    }

    /// The values by a tape at points.
    pub(super) fn values(
        &self,
        machine: &mut Machine<f32>,
        tape: &[Clause],
        points: &Points,
    ) -> Column {
        *machine.seed() = *points;
        *machine.run(&self.program, tape, LANES)
    }
}

/// Cuts down to a side.
struct Down(f32);

impl Refine for Down {
    fn cut(&self, region: &Region, _: usize, _: f32) -> bool {
        region.side() > self.0
    }
}

/// The fields of all scenes of the repository, and of a sample of what strangers wrote.
pub(super) fn all() -> impl Iterator<Item = Field> {
    let ours = ["tests/scenes", "examples", "tests/hard"]
        .into_iter()
        .flat_map(scenes);
    let theirs = strangers::folders().into_iter();
    let theirs = theirs.flat_map(|folder| scenes(&folder.to_string_lossy()));
    let step = if is_long() { 1 } else { STRANGERS_STEP };
    let paths: Vec<PathBuf> = ours.chain(theirs.step_by(step)).collect();
    paths.into_iter().map(|path| Field::of_file(&path))
}

/// Reports whether the long form is run.
pub(super) fn is_long() -> bool {
    std::env::var_os("SDFC_LONG").is_some_and(|long| long != "0")
}

/// 64 points of a box: its corners, points on its edges and faces, and points inside.
pub(super) fn points_of(region: &Region, random: &mut Random) -> Points {
    let mut points = Points::default();
    for lane in 0..LANES {
        // Of three axes, so many are at one of their ends.
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

/// The point in a lane.
pub(super) fn point_at(points: &Points, lane: usize) -> [f32; 3] {
    [0, 1, 2].map(|axis| points[axis].0[lane])
}

/// Puts a point into a lane.
pub(super) fn put(points: &mut Points, lane: usize, p: [f32; 3]) {
    for (column, v) in points.iter_mut().zip(p) {
        column.0[lane] = v;
    }
}

/// Points on both sides of zeros of a field, which the lines between points with values of unlike signs cross:
/// outside in even lanes, inside in odd ones. `None` where all values have one sign.
pub(super) fn zeros(
    field: &Field,
    machine: &mut Machine<f32>,
    points: &Points,
    values: &Column,
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
        put(&mut ends, lane, point_at(points, random.pick(&outside)));
        put(&mut ends, lane + 1, point_at(points, random.pick(&inside)));
    }
    for _ in 0..HALVINGS {
        let mut middles = ends;
        for lane in (0..LANES).step_by(2) {
            let (a, b) = (point_at(&ends, lane), point_at(&ends, lane + 1));
            let middle: [f32; 3] = std::array::from_fn(|axis| a[axis] + (b[axis] - a[axis]) * 0.5);
            put(&mut middles, lane, middle);
        }
        let values = field.values(machine, &field.tape.clauses, &middles);
        for lane in (0..LANES).step_by(2) {
            let side = usize::from(values.0[lane] < 0.0);
            put(&mut ends, lane + side, point_at(&middles, lane));
        }
    }
    Some(ends)
}

/// Halvings of a line between points of unlike signs.
const HALVINGS: usize = 26;
