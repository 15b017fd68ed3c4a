//! What is asked of a field: bounds over a piece of a ray, the slope there, and plain numbers.

use super::camera::Ray;
use sdfc_vm::branching::{self, Branching};
use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::evaluate;
use sdfc_vm::interval::Interval;
use sdfc_vm::program::{Module, Program};
use sdfc_vm::tape::Tape;
use sdfc_vm::tape::parts::{Part, Parts};
use sdfc_vm::tape::single::{Registers, run};
use sdfc_vm::vector::V3;

/// The distance of a scene, with the constants of its present parameters.
#[derive(Clone, Debug)]
pub struct Field {
    program: Program,
    tape: Tape,
    raw: bool,
}

impl Field {
    /// That of a module, as [`Module::update`] left it.
    pub fn of(module: &Module) -> Self {
        Self {
            raw: module.distance.is_raw(),
            tape: Tape::of(&module.distance),
            program: module.distance.clone(),
        }
    }

    /// Whether the length of its gradient is not known to be about one.
    pub(super) fn is_raw(&self) -> bool {
        self.raw
    }

    /// The distance at a point.
    pub fn distance(&self, point: [f64; 3]) -> f64 {
        evaluate::evaluate_f64(&self.program, point)
    }

    /// How the distance changes along the axes at a point.
    pub fn gradient(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let gradient = evaluate::gradient::<f64>(&self.program, V3::of(x, y, z)).gradient;
        [gradient.x, gradient.y, gradient.z]
    }
}

/// Asks a field, with the memory that takes; each thread has its own.
pub(super) struct Asker<'a> {
    field: &'a Field,
    values: Registers<Branching>,
    slopes: Registers<Dual<Interval>>,
    parts: Parts,
    /// How often the field was evaluated.
    pub(super) evaluations: u64,
}

impl<'a> Asker<'a> {
    pub(super) fn new(field: &'a Field) -> Self {
        let Tape { values, points, .. } = field.tape;
        let zero = Interval::point(0.0);
        let origin = V3::of(zero, zero, zero);
        Self {
            field,
            values: Registers::new(values, points, Branching::point([zero; 3])),
            slopes: Registers::new(values, points, DualVec3::fixed(origin)),
            parts: Parts::of(&field.tape),
            evaluations: 0,
        }
    }

    pub(super) fn field(&self) -> &'a Field {
        self.field
    }

    /// The whole program.
    pub(super) fn whole(&self) -> Part {
        self.parts.whole()
    }

    /// Forgets all programs that were pruned later than this one.
    pub(super) fn forget_after(&mut self, part: &Part) {
        self.parts.forget_from(part.end);
    }

    /// What the field lies between on a piece of a ray whose program is `part`, and whether it is
    /// whole: continuous there, with the slopes of its formula.
    pub(super) fn between(&mut self, ray: &Ray, t: Interval, part: &Part) -> (Interval, bool) {
        let (point, program) = (Branching::point(place(ray, t)), &self.field.program);
        let (values, parts) = (&mut self.values, &mut self.parts);
        self.evaluations += 1;
        branching::hulled(|| parts.over(program, part, values, point, |value| value.range))
    }

    /// The program of the piece of a ray that was asked last ([`Self::between`]).
    pub(super) fn prune(&mut self, part: &Part) -> Part {
        self.parts.prune(part)
    }

    /// The same bounds where jumps lie between the two places, from what is on both of their sides.
    pub(super) fn explored(&mut self, ray: &Ray, t: Interval, part: &Part) -> Interval {
        let (point, program) = (Branching::point(place(ray, t)), &self.field.program);
        let (values, evaluations) = (&mut self.values, &mut self.evaluations);
        let tape = self.parts.tape(part);
        branching::explore(|| {
            *evaluations += 1;
            run(program, tape, values, point, |_, _, _, _| {})
        })
    }

    /// The value at a place.
    pub(super) fn value(&mut self, ray: &Ray, t: f64, part: &Part) -> Interval {
        self.explored(ray, Interval::point(t), part)
    }

    /// Bounds of how the field changes along a piece of a ray on which it is whole.
    pub(super) fn slope(&mut self, ray: &Ray, t: Interval, part: &Part) -> Interval {
        let [x, y, z] = place(ray, t);
        let point = DualVec3::seed(V3::of(x, y, z));
        let (program, tape) = (&self.field.program, self.parts.tape(part));
        self.evaluations += 1;
        let gradient = run(program, tape, &mut self.slopes, point, |_, _, _, _| {}).gradient;
        let [dx, dy, dz] = ray.direction.map(Interval::point);
        gradient.x * dx + gradient.y * dy + gradient.z * dz
    }
}

/// The box that a ray's points between two places lie in.
fn place(ray: &Ray, t: Interval) -> [Interval; 3] {
    std::array::from_fn(|axis| {
        Interval::point(ray.origin[axis]) + t * Interval::point(ray.direction[axis])
    })
}
