//! Evaluation of a field along a ray: bounds over a segment, the slope there, and plain numbers.

use super::camera::ReferenceRay;
use sdfc_vm::branching::{self, BranchInterval};
use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::evaluate;
use sdfc_vm::interval::Interval;
use sdfc_vm::program::{Module, Program};
use sdfc_vm::tape::Tape;
use sdfc_vm::tape::scalar::{Registers, eval};
use sdfc_vm::tape::stack::{TapeSpan, TapeStack};
use sdfc_vm::vector::V3;

/// The distance field of a scene, with the constants of its current parameters.
#[derive(Clone, Debug)]
pub struct ReferenceField {
    program: Program,
    tape: Tape,
    is_raw: bool,
}

impl ReferenceField {
    /// Creates the field of a module, as [`Module::update`] left it.
    pub fn from_module(module: &Module) -> Self {
        Self {
            is_raw: module.distance.has_raw_fields(),
            tape: Tape::new(&module.distance),
            program: module.distance.clone(),
        }
    }

    /// Reports whether the gradient's length may differ from one.
    pub(super) fn is_raw(&self) -> bool {
        self.is_raw
    }

    /// Returns the distance at a point.
    pub fn distance(&self, point: [f64; 3]) -> f64 {
        evaluate::evaluate_f64(&self.program, point)
    }

    /// Returns the gradient at a point.
    pub fn gradient(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let gradient = evaluate::gradient::<f64>(&self.program, V3::new(x, y, z)).gradient;
        [gradient.x, gradient.y, gradient.z]
    }
}

/// Evaluates a field along rays, with its registers; each thread has its own.
pub(super) struct RayFieldEvaluator<'a> {
    field: &'a ReferenceField,
    values: Registers<BranchInterval>,
    slopes: Registers<Dual<Interval>>,
    parts: TapeStack,
    /// Number of evaluations of the field.
    pub(super) evaluations: u64,
}

impl<'a> RayFieldEvaluator<'a> {
    pub(super) fn new(field: &'a ReferenceField) -> Self {
        let Tape { values, points, .. } = field.tape;
        let zero = Interval::point(0.0);
        let origin = V3::new(zero, zero, zero);
        Self {
            field,
            values: Registers::new(values, points, BranchInterval::point([zero; 3])),
            slopes: Registers::new(values, points, DualVec3::fixed(origin)),
            parts: TapeStack::new(&field.tape),
            evaluations: 0,
        }
    }

    pub(super) fn field(&self) -> &'a ReferenceField {
        self.field
    }

    /// Returns the full program.
    pub(super) fn full_program(&self) -> TapeSpan {
        self.parts.root()
    }

    /// Discards all programs that were pruned after this one.
    pub(super) fn discard_after(&mut self, pruned_program: &TapeSpan) {
        self.parts.truncate(pruned_program.end);
    }

    /// Returns the range of the field on a ray segment whose program is `pruned_program`. Also reports
    /// whether the field is continuous there, so that its formula's slopes hold.
    pub(super) fn range(
        &mut self,
        ray: &ReferenceRay,
        t: Interval,
        pruned_program: &TapeSpan,
    ) -> (Interval, bool) {
        let (point, program) = (BranchInterval::point(ray_box(ray, t)), &self.field.program);
        let (values, parts) = (&mut self.values, &mut self.parts);
        self.evaluations += 1;
        branching::eval_hull(|| {
            parts.eval_over(program, pruned_program, values, point, |value| value.range)
        })
    }

    /// Prunes the program for the segment of the last call of [`Self::range`].
    pub(super) fn prune(&mut self, pruned_program: &TapeSpan) -> TapeSpan {
        self.parts.prune(pruned_program)
    }

    /// Returns the range of the field on a segment with discontinuities, as the hull over both sides of each.
    pub(super) fn range_over_branches(
        &mut self,
        ray: &ReferenceRay,
        t: Interval,
        pruned_program: &TapeSpan,
    ) -> Interval {
        let (point, program) = (BranchInterval::point(ray_box(ray, t)), &self.field.program);
        let (values, evaluations) = (&mut self.values, &mut self.evaluations);
        let tape = self.parts.tape(pruned_program);
        branching::eval_all_branches(|| {
            *evaluations += 1;
            eval(program, tape, values, point, |_, _, _, _| {})
        })
    }

    /// Returns the value at `t`.
    pub(super) fn value(
        &mut self,
        ray: &ReferenceRay,
        t: f64,
        pruned_program: &TapeSpan,
    ) -> Interval {
        self.range_over_branches(ray, Interval::point(t), pruned_program)
    }

    /// Returns bounds of the slope along a segment on which the field is continuous.
    pub(super) fn slope(
        &mut self,
        ray: &ReferenceRay,
        t: Interval,
        pruned_program: &TapeSpan,
    ) -> Interval {
        let [x, y, z] = ray_box(ray, t);
        let point = DualVec3::seed(V3::new(x, y, z));
        let (program, tape) = (&self.field.program, self.parts.tape(pruned_program));
        self.evaluations += 1;
        let gradient = eval(program, tape, &mut self.slopes, point, |_, _, _, _| {}).gradient;
        let [dx, dy, dz] = ray.direction.map(Interval::point);
        gradient.x * dx + gradient.y * dy + gradient.z * dz
    }
}

/// Returns the box that contains the ray's points in an interval.
fn ray_box(ray: &ReferenceRay, t: Interval) -> [Interval; 3] {
    std::array::from_fn(|axis| {
        Interval::point(ray.origin[axis]) + t * Interval::point(ray.direction[axis])
    })
}
