//! Bounds over boxes, as devices compute them to split cells: every operation of the table, every blend and
//! every frame, on random boxes. The bounds contain the values at points of the box. These are the values of
//! the same device, those of the CPU in `f32`, and those of the formula in real numbers.

use crate::scenes::gpu;
use sdfc_runtime::gpu::{BindingAccess, BufferBinding, BufferUsage, Extent, Gpu, KernelSource};
use sdfc_trials::random::Random;
use sdfc_vm::apply::{Apply, OpResult, apply, pack_parameters, wgsl_name};
use sdfc_vm::blend::BlendKernel;
use sdfc_vm::interval::FloatInterval;
use sdfc_vm::real::Real;
use sdfc_vm::row::{Input, Output, ParameterType};
use sdfc_vm::table::{Op, ROWS};
use sdfc_vm::vector::V3;
use sdfc_vm::wgsl_interval::MAX_BOUNDED;
use sdfc_vm::wgsl_library::{WgslLibrary, blend_name};

/// Number of boxes, and of points in each.
const BOXES: usize = 256;
const POINTS: usize = 8;
/// Numbers per point: its coordinates and three operands.
const NUMBERS: usize = 6;

/// A number between two others, often one of them.
fn within(random: &mut Random, [low, high]: [f32; 2]) -> f32 {
    let fraction = match random.below(8) {
        0 => low,
        1 => high,
        _ => low + (high - low) * random.unit_f32(),
    };
    fraction.clamp(low, high)
}

/// A box of coordinates and operands, and points inside.
struct BoxSample {
    ends: [[f32; 2]; NUMBERS],
    points: [[f32; NUMBERS]; POINTS],
}

/// Boxes of all sizes near the origin; the ends of `far` ones may have any magnitude.
fn samples(seed: u64, far: bool) -> Vec<BoxSample> {
    let mut random = Random::new(seed);
    let sample = |_| {
        let size = [1e-4, 0.01, 0.1, 1.0][(random.unit_f32() * 4.0) as usize];
        let ends = std::array::from_fn(|_| {
            if far && random.unit_f32() < 0.5 {
                let mut end = || {
                    let magnitude = 10_f32.powf(random.unit_f32() * 60.0 - 30.0);
                    magnitude * if random.unit_f32() < 0.5 { 1.0 } else { -1.0 }
                };
                let (a, b) = (end(), end());
                return [a.min(b), a.max(b)];
            }
            // Often near zero and other values with discontinuities.
            let scale = if random.unit_f32() < 0.25 { size } else { 1.0 };
            let middle = (random.unit_f32() * 3.0 - 1.5) * scale;
            let half = size * random.unit_f32();
            [middle - half, middle + half]
        });
        let points = std::array::from_fn(|_| ends.map(|ends| within(&mut random, ends)));
        BoxSample { ends, points }
    };
    (0..BOXES).map(sample).collect()
}

/// A function under test: the calls to it, and its implementation on the CPU.
struct Case {
    name: String,
    library: WgslLibrary,
    /// With gaps, as in a program's pool.
    constants: Vec<f32>,
    /// The expressions for a box `p` with the operands `a`, `b`, `c`, and for a point with them.
    interval: String,
    value: String,
    gives_point: bool,
}

/// The three result numbers of a case at a point. A value repeats its single number.
fn apply_on_cpu<R>(op: Op, constants: &[f32], inputs: [R; NUMBERS]) -> [R; 3]
where
    R: Apply + Real<Vec3 = V3<R>>,
{
    let [x, y, z, a, b, c] = inputs;
    match apply::<R>(op, V3 { x, y, z }, [a, b, c], constants) {
        OpResult::Value(v) => [v, v, v],
        OpResult::Point(V3 { x, y, z }) => [x, y, z],
    }
}

impl Case {
    fn for_operation(op: Op) -> Self {
        let row = op.row();
        let mut library = WgslLibrary::default();
        library.use_value(op);
        library.use_interval(op);
        // Different numbers of about one half, valid for most parameters.
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
            constants: pack_parameters(op, &numbers),
            interval: format!("{function}_interval({list})"),
            value: format!("{function}({list})"),
            gives_point: row.output == Output::Point,
        }
    }

    fn for_blend(kernel: BlendKernel, sign: f32, sign_b: f32) -> Self {
        let mut library = WgslLibrary::default();
        library.use_blend(kernel);
        library.use_blend_interval(kernel);
        library.use_boxes();
        let width = 0.3;
        let coefficient = match kernel {
            BlendKernel::Hard => 0.0,
            BlendKernel::Quadratic => 0.25 / width,
            BlendKernel::Cubic => 1.0 / (6.0 * width * width),
            BlendKernel::Circular | BlendKernel::Exponential => 1.0 / width,
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

    fn for_frame(mapped: bool) -> Self {
        let mut library = WgslLibrary::default();
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
            self.library.text_with_prelude(),
            one = 6 + 3 * POINTS,
        )
    }

    /// The device's results for these boxes: ends, and numbers at the points.
    fn run(&self, gpu: &Gpu, samples: &[BoxSample]) -> Vec<f32> {
        let access = [
            BindingAccess::StorageRead,
            BindingAccess::StorageRead,
            BindingAccess::StorageRead,
            BindingAccess::StorageReadWrite,
        ];
        let bindings: Vec<BufferBinding> = (0..)
            .zip(access)
            .map(|(slot, access)| BufferBinding { slot, access })
            .collect();
        let kernel = gpu
            .kernel(&KernelSource {
                label: &self.name,
                wgsl: &self.kernel(),
                entry: "main",
                bindings: &bindings,
                as_written: false,
            })
            .unwrap_or_else(|error| panic!("{error}\n{}", self.kernel()));
        let ends: Vec<[f32; 2]> = samples.iter().flat_map(|sample| sample.ends).collect();
        let points: Vec<f32> = samples
            .iter()
            .flat_map(|sample| sample.points.as_flattened().iter().copied())
            .collect();
        let mut constants = self.constants.clone();
        constants.resize(constants.len().max(12), 0.0);
        let with = |label, data: &[f32]| {
            gpu.buffer_with(label, BufferUsage::Storage, data)
                .expect("room")
        };
        let input_buffer = with("given", ends.as_flattened());
        let points = with("points", &points);
        let constants = with("constants", &constants);
        let size = 4 * (6 + 3 * POINTS) * samples.len();
        let output = gpu
            .buffer("found", BufferUsage::Storage, size as u64)
            .expect("room");
        let slots = [
            (0, &input_buffer),
            (1, &points),
            (2, &constants),
            (3, &output),
        ];
        let call = gpu.bind(&kernel, &slots).expect("it fits");
        let mut batch = gpu.batch();
        batch
            .dispatch(&call, Extent::Line(samples.len() as u64))
            .expect("in size");
        batch.submit_and_wait().expect("it runs");
        gpu.read(&output).expect("it is read")
    }
}

/// Reports whether an interval contains a number. Unbounded ends contain any number; NaN is always accepted.
fn holds([low, high]: [f32; 2], value: f64) -> bool {
    let (low, high) = (f64::from(low), f64::from(high));
    value.is_nan() || (low < -MAX_BOUNDED || low <= value) && (high > MAX_BOUNDED || value <= high)
}

/// Checks a case. Returns the number of boxes with known bounds.
fn check(
    case: &Case,
    gpu: &Gpu,
    (seed, far): (u64, bool),
    op: Option<Op>,
    failures: &mut Vec<String>,
) -> usize {
    let samples = samples(seed, far);
    let output = case.run(gpu, &samples);
    let mut bounded = 0;
    for (sample, output) in samples.iter().zip(output.chunks_exact(6 + 3 * POINTS)) {
        let (ends, values) = output.split_at(6);
        let ends: Vec<[f32; 2]> = ends.as_chunks::<2>().0.to_vec();
        let is_known = |[low, high]: &[f32; 2]| high - low < 1e17;
        bounded += usize::from(ends.iter().all(is_known));
        for (point, device_value) in sample.points.iter().zip(values.as_chunks::<3>().0) {
            let mut values = vec![("the device", device_value.map(f64::from))];
            if let Some(op) = op {
                let single = apply_on_cpu::<f32>(op, &case.constants, *point);
                let double = apply_on_cpu::<f64>(op, &case.constants, point.map(f64::from));
                values.push(("f32", single.map(f64::from)));
                // The logarithm of a number that is not positive is that of the type's smallest number.
                if !(matches!(op, Op::Ln | Op::Log2) && point[3] <= 0.0) {
                    values.push(("f64", double));
                }
            }
            for (source, value) in values {
                let mut pairs = ends.iter().zip(value);
                if pairs.any(|(ends, value)| !holds(*ends, value)) {
                    failures.push(format!(
                        "{}: {source} gives {value:?} at {point:?}, not in {ends:?}, of {:?}",
                        case.name, sample.ends
                    ));
                }
            }
        }
        if let (Some(op), false) = (op, far) {
            // At most as wide as on the CPU, except for rounding.
            let inputs = sample.ends.map(|[lo, hi]| FloatInterval { lo, hi });
            let cpu_ranges = apply_on_cpu::<FloatInterval>(op, &case.constants, inputs);
            for (&[low, high], other) in ends.iter().zip(cpu_ranges) {
                let max_width =
                    (other.hi - other.lo) * 1.01 + 1e-4 * (1.0 + low.abs().max(high.abs()));
                if high - low > max_width && other.hi - other.lo < 1e6 {
                    failures.push(format!(
                        "{}: [{low:e}, {high:e}] is wider than {other:?}, of {:?}",
                        case.name, sample.ends
                    ));
                }
            }
        }
    }
    bounded
}

/// Reports the first failures of each case.
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
        let case = Case::for_operation(row.op);
        let seed = 1 + row.op as u64;
        let bounded = check(&case, &gpu, (seed, false), Some(row.op), &mut failures);
        if bounded * 2 < BOXES {
            failures.push(format!(
                "{}: known in {bounded} of {BOXES} boxes",
                case.name
            ));
        }
        check(&case, &gpu, (seed, true), Some(row.op), &mut failures);
    }
    assert!(failures.is_empty(), "{}", report(&failures));
}

#[test]
fn blends_and_frames_stay_within_their_bounds() {
    let Some(gpu) = gpu() else { return };
    let mut cases = vec![Case::for_frame(false), Case::for_frame(true)];
    for kernel in BlendKernel::ALL {
        for (sign, sign_b) in [(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0)] {
            cases.push(Case::for_blend(kernel, sign, sign_b));
        }
    }
    let mut failures = Vec::new();
    for (case, seed) in cases.iter().zip(1000..) {
        let bounded = check(case, &gpu, (seed, false), None, &mut failures);
        assert_eq!(bounded, BOXES, "{}", case.name);
        check(case, &gpu, (seed, true), None, &mut failures);
    }
    assert!(failures.is_empty(), "{}", report(&failures));
}
