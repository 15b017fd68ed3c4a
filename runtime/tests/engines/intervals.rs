//! Bounds over boxes, as devices compute them to cut cells: every operation of the table, every blend
//! and every frame, on random boxes. What is found holds what the same device gives at points of the
//! box, what the processor gives there in `f32`, and what the formula is for real numbers.

use crate::scenes::gpu;
use sdfc_runtime::gpu::{Access, Binding, Extent, Gpu, KernelSource, Usage};
use sdfc_trials::random::Random;
use sdfc_vm::apply::{Applied, Apply, apply, laid_out, wgsl_name};
use sdfc_vm::interval::FloatInterval;
use sdfc_vm::kernel::Kernel;
use sdfc_vm::library::{Library, blend_name};
use sdfc_vm::outward::KNOWN;
use sdfc_vm::real::Real;
use sdfc_vm::row::{Input, Output, ParameterType};
use sdfc_vm::table::{Op, ROWS};
use sdfc_vm::vector::V3;

/// Boxes, and points of each.
const BOXES: usize = 256;
const POINTS: usize = 8;
/// Numbers of a point: its coordinates and three operands.
const NUMBERS: usize = 6;

/// A number from 0 up to, but not, 1.
fn unit(random: &mut Random) -> f32 {
    (random.bits() >> 40) as f32 / (1 << 24) as f32
}

/// A number between two, often one of them.
fn within(random: &mut Random, [low, high]: [f32; 2]) -> f32 {
    let at = match random.below(8) {
        0 => low,
        1 => high,
        _ => low + (high - low) * unit(random),
    };
    at.clamp(low, high)
}

/// A box of points and operands, and points of it.
struct Sample {
    ends: [[f32; 2]; NUMBERS],
    points: [[f32; NUMBERS]; POINTS],
}

/// Boxes of all sizes about the origin; `far` ones may reach as far as numbers do.
fn samples(seed: u64, far: bool) -> Vec<Sample> {
    let mut random = Random::new(seed);
    let sample = |_| {
        let size = [1e-4, 0.01, 0.1, 1.0][(unit(&mut random) * 4.0) as usize];
        let ends = std::array::from_fn(|_| {
            if far && unit(&mut random) < 0.5 {
                let mut end = || {
                    let magnitude = 10_f32.powf(unit(&mut random) * 60.0 - 30.0);
                    magnitude * if unit(&mut random) < 0.5 { 1.0 } else { -1.0 }
                };
                let (a, b) = (end(), end());
                return [a.min(b), a.max(b)];
            }
            // Often about zero and other numbers where something jumps.
            let near = if unit(&mut random) < 0.25 { size } else { 1.0 };
            let middle = (unit(&mut random) * 3.0 - 1.5) * near;
            let half = size * unit(&mut random);
            [middle - half, middle + half]
        });
        let points = std::array::from_fn(|_| ends.map(|ends| within(&mut random, ends)));
        Sample { ends, points }
    };
    (0..BOXES).map(sample).collect()
}

/// What is tried: how its functions are called, and what the processor makes of it.
struct Case {
    name: String,
    library: Library,
    /// With gaps, as a program holds them.
    constants: Vec<f32>,
    /// The expressions of a box `p` with the operands `a`, `b`, `c`, and of a point with them.
    interval: String,
    value: String,
    gives_point: bool,
}

/// What three numbers a case gives at a point; of a value the first counts.
fn on_processor<R>(op: Op, constants: &[f32], at: [R; NUMBERS]) -> [R; 3]
where
    R: Apply + Real<Vec3 = V3<R>>,
{
    let [x, y, z, a, b, c] = at;
    match apply::<R>(op, V3 { x, y, z }, [a, b, c], constants) {
        Applied::Value(v) => [v, v, v],
        Applied::Point(V3 { x, y, z }) => [x, y, z],
    }
}

impl Case {
    fn of_operation(op: Op) -> Self {
        let row = op.row();
        let mut library = Library::default();
        library.use_value(op);
        library.use_interval(op);
        // Different numbers of about one half, which suit most parameters.
        let numbers: Vec<f64> = (0..row.parameter_width())
            .map(|n| 0.4375 + 0.0625 * n as f64)
            .collect();
        let list = {
            let mut operands = ["a", "b", "c"].into_iter();
            let mut list: Vec<String> = Vec::new();
            for input in row.inputs {
                list.extend(match input {
                    Input::Point => Some("p".to_owned()),
                    Input::Value => operands.next().map(str::to_owned),
                });
            }
            for (parameter, at) in row.parameters.iter().zip(row.offsets()) {
                let number = |n: usize| format!("constants[{}]", at + n);
                list.push(match parameter.ty {
                    ParameterType::Scalar => number(0),
                    ParameterType::Vec2 => format!("vec2f({}, {})", number(0), number(1)),
                    ParameterType::Vec3 => {
                        format!("vec3f({}, {}, {})", number(0), number(1), number(2))
                    }
                });
            }
            list.join(", ")
        };
        let function = wgsl_name(op);
        Self {
            name: row.name.to_owned(),
            library,
            constants: laid_out(op, &numbers),
            interval: format!("{function}_interval({list})"),
            value: format!("{function}({list})"),
            gives_point: row.output == Output::Point,
        }
    }

    fn of_blend(kernel: Kernel, sign: f32, sign_b: f32) -> Self {
        let mut library = Library::default();
        library.use_blend(kernel);
        library.use_blend_interval(kernel);
        library.use_boxes();
        let width = 0.3;
        let coefficient = match kernel {
            Kernel::Hard => 0.0,
            Kernel::Quadratic => 0.25 / width,
            Kernel::Cubic => 1.0 / (6.0 * width * width),
            Kernel::Circular | Kernel::Exponential => 1.0 / width,
        };
        let function = blend_name(kernel);
        let list = "(a, b, constants[0], constants[1], constants[2], constants[3])";
        Self {
            name: format!("{function} {sign} {sign_b}"),
            library,
            constants: vec![sign, sign_b, width, coefficient],
            interval: format!("{function}_interval{list}"),
            value: format!("{function}{list}"),
            gives_point: false,
        }
    }

    fn of_frame(mapped: bool) -> Self {
        let mut library = Library::default();
        library.use_boxes();
        let (interval, value) = if mapped {
            library.use_mapped();
            library.use_mapped_interval();
            (
                "mapped_interval(p, rows[0], rows[1], rows[2], shift)",
                "mapped(p, rows, shift)",
            )
        } else {
            library.use_moved_interval();
            ("moved_interval(p, shift)", "p + shift")
        };
        Self {
            name: interval.to_owned(),
            library,
            constants: (0..12)
                .map(|n| ((n * 7) % 12) as f32 / 4.0 - 1.375)
                .collect(),
            interval: interval.to_owned(),
            value: value.to_owned(),
            gives_point: true,
        }
    }

    /// A kernel that writes six ends for each box, and then three numbers for each of its points.
    fn kernel(&self) -> String {
        let (bounds, numbers) = if self.gives_point {
            (
                "let q = BOUNDS;\n    let ends = array(q.x, q.y, q.z);",
                "let v = VALUE;",
            )
        } else {
            (
                "let q = BOUNDS;\n    let ends = array(q, q, q);",
                "let v = vec3f(VALUE);",
            )
        };
        let (bounds, numbers) = (
            bounds.replace("BOUNDS", &self.interval),
            numbers.replace("VALUE", &self.value),
        );
        format!(
            "{}
@group(0) @binding(0) var<storage, read> given: array<vec2f>;
@group(0) @binding(1) var<storage, read> points: array<f32>;
@group(0) @binding(2) var<storage, read> constants: array<f32>;
@group(0) @binding(3) var<storage, read_write> found: array<f32>;

fn shift_of() -> vec3f {{ return vec3f(constants[0], constants[1], constants[2]); }}
fn rows_of() -> mat3x3f {{
    return mat3x3f(
        constants[3], constants[4], constants[5],
        constants[6], constants[7], constants[8],
        constants[9], constants[10], constants[11],
    );
}}

fn bound(at: u32, to: u32) {{
    let shift = shift_of();
    let rows = rows_of();
    let p = BoxPoint(given[at], given[at + 1u], given[at + 2u]);
    let a = given[at + 3u];
    let b = given[at + 4u];
    let c = given[at + 5u];
    {bounds}
    for (var axis = 0u; axis < 3u; axis += 1u) {{
        found[to + 2u * axis] = ends[axis].x;
        found[to + 2u * axis + 1u] = ends[axis].y;
    }}
}}

fn evaluate(at: u32, to: u32) {{
    let shift = shift_of();
    let rows = rows_of();
    let p = vec3f(points[at], points[at + 1u], points[at + 2u]);
    let a = points[at + 3u];
    let b = points[at + 4u];
    let c = points[at + 5u];
    {numbers}
    found[to] = v.x;
    found[to + 1u] = v.y;
    found[to + 2u] = v.z;
}}

@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {{
    let one = id.x * {one}u;
    bound(id.x * {NUMBERS}u, one);
    for (var k = 0u; k < {POINTS}u; k += 1u) {{
        evaluate((id.x * {POINTS}u + k) * {NUMBERS}u, one + 6u + 3u * k);
    }}
}}
",
            self.library.whole(),
            one = 6 + 3 * POINTS,
        )
    }

    /// What the device gives for these boxes: ends, and numbers at the points.
    fn run(&self, gpu: &Gpu, samples: &[Sample]) -> Vec<f32> {
        let access = [
            Access::StorageRead,
            Access::StorageRead,
            Access::StorageRead,
            Access::StorageReadWrite,
        ];
        let bindings: Vec<Binding> = (0..)
            .zip(access)
            .map(|(slot, access)| Binding { slot, access })
            .collect();
        let kernel = gpu
            .kernel(&KernelSource {
                label: &self.name,
                wgsl: &self.kernel(),
                entry: "main",
                bindings: &bindings,
            })
            .unwrap_or_else(|error| panic!("{error}\n{}", self.kernel()));
        let ends: Vec<[f32; 2]> = samples.iter().flat_map(|sample| sample.ends).collect();
        let points: Vec<f32> = samples
            .iter()
            .flat_map(|sample| sample.points.as_flattened().iter().copied())
            .collect();
        let mut constants = self.constants.clone();
        constants.resize(constants.len().max(12), 0.0);
        let with =
            |label, data: &[f32]| gpu.buffer_with(label, Usage::Storage, data).expect("room");
        let given = with("given", ends.as_flattened());
        let points = with("points", &points);
        let constants = with("constants", &constants);
        let size = 4 * (6 + 3 * POINTS) * samples.len();
        let found = gpu
            .buffer("found", Usage::Storage, size as u64)
            .expect("room");
        let slots = [(0, &given), (1, &points), (2, &constants), (3, &found)];
        let call = gpu.bind(&kernel, &slots).expect("it fits");
        let mut batch = gpu.batch();
        batch
            .dispatch(&call, Extent::Line(samples.len() as u64))
            .expect("in size");
        batch.submit_and_wait().expect("it runs");
        gpu.read(&found).expect("it is read")
    }
}

/// Whether an interval, whose far ends may be any number, holds a number, if it is one.
fn holds([low, high]: [f32; 2], value: f64) -> bool {
    let (low, high) = (f64::from(low), f64::from(high));
    value.is_nan() || (low < -KNOWN || low <= value) && (high > KNOWN || value <= high)
}

/// Compares a case with what holds of it; gives how often bounds were known.
fn check(
    case: &Case,
    gpu: &Gpu,
    (seed, far): (u64, bool),
    op: Option<Op>,
    failures: &mut Vec<String>,
) -> usize {
    let samples = samples(seed, far);
    let found = case.run(gpu, &samples);
    let mut known = 0;
    for (sample, found) in samples.iter().zip(found.chunks_exact(6 + 3 * POINTS)) {
        let (ends, values) = found.split_at(6);
        let ends: Vec<[f32; 2]> = ends.as_chunks::<2>().0.to_vec();
        let is_known = |[low, high]: &[f32; 2]| high - low < 1e17;
        known += usize::from(ends.iter().all(is_known));
        for (point, of_device) in sample.points.iter().zip(values.as_chunks::<3>().0) {
            let mut values = vec![("the device", of_device.map(f64::from))];
            if let Some(op) = op {
                let single = on_processor::<f32>(op, &case.constants, *point);
                let double = on_processor::<f64>(op, &case.constants, point.map(f64::from));
                values.push(("f32", single.map(f64::from)));
                // The logarithm of what is not positive is that of a type's smallest number.
                if !(matches!(op, Op::Ln | Op::Log2) && point[3] <= 0.0) {
                    values.push(("f64", double));
                }
            }
            for (whose, value) in values {
                let mut each = ends.iter().zip(value);
                if each.any(|(ends, value)| !holds(*ends, value)) {
                    failures.push(format!(
                        "{}: {whose} gives {value:?} at {point:?}, not in {ends:?}, of {:?}",
                        case.name, sample.ends
                    ));
                }
            }
        }
        if let (Some(op), false) = (op, far) {
            // No wider than on the processor, but for rounding.
            let at = sample.ends.map(|[lo, hi]| FloatInterval { lo, hi });
            let of_processor = on_processor::<FloatInterval>(op, &case.constants, at);
            for (&[low, high], other) in ends.iter().zip(of_processor) {
                let most = (other.hi - other.lo) * 1.01 + 1e-4 * (1.0 + low.abs().max(high.abs()));
                if high - low > most && other.hi - other.lo < 1e6 {
                    failures.push(format!(
                        "{}: [{low:e}, {high:e}] is wider than {other:?}, of {:?}",
                        case.name, sample.ends
                    ));
                }
            }
        }
    }
    known
}

/// The first of many failures of each case.
fn report(failures: &[String]) -> String {
    let mut text = String::new();
    let mut last = "";
    for failure in failures {
        let name = failure.split(':').next().unwrap_or_default();
        if name != last {
            text.push_str(failure);
            text.push('\n');
        }
        last = name;
    }
    text
}

#[test]
fn every_operation_stays_within_its_bounds() {
    let Some(gpu) = gpu() else { return };
    let mut failures = Vec::new();
    for row in ROWS {
        let case = Case::of_operation(row.op);
        let seed = 1 + row.op as u64;
        let known = check(&case, &gpu, (seed, false), Some(row.op), &mut failures);
        if known * 2 < BOXES {
            failures.push(format!("{}: known in {known} of {BOXES} boxes", case.name));
        }
        check(&case, &gpu, (seed, true), Some(row.op), &mut failures);
    }
    assert!(failures.is_empty(), "{}", report(&failures));
}

#[test]
fn blends_and_frames_stay_within_their_bounds() {
    let Some(gpu) = gpu() else { return };
    let mut cases = vec![Case::of_frame(false), Case::of_frame(true)];
    for kernel in Kernel::ALL {
        for (sign, sign_b) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            cases.push(Case::of_blend(kernel, sign, sign_b));
        }
    }
    let mut failures = Vec::new();
    for (case, seed) in cases.iter().zip(1000..) {
        let known = check(case, &gpu, (seed, false), None, &mut failures);
        assert_eq!(known, BOXES, "{}", case.name);
        check(case, &gpu, (seed, true), None, &mut failures);
    }
    assert!(failures.is_empty(), "{}", report(&failures));
}
