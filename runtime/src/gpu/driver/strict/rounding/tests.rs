//! Tests of software rounding: on a device of this machine, and in what a rewritten module contains.

use super::super::super::{
    AdapterPreference, Arithmetic, BindingAccess, BufferBinding, BufferUsage, Extent, Gpu,
    KernelSource, Rounding,
};
use super::super::{conformance, rewriter};
use super::*;
use naga::valid::{Capabilities, ValidationFlags, Validator};
use naga::{BinaryOperator, Expression, MathFunction, ScalarKind};
use sdfc_trials::skip::is_gpu_skipped;

/// Number of tested pairs.
const PAIRS: usize = 1 << 16;

/// A kernel that calls the functions.
const CALLS: &str = "
@group(0) @binding(0) var<storage, read> operands: array<vec2f>;
@group(0) @binding(1) var<storage, read_write> results: array<vec2f>;
@compute @workgroup_size(64)
fn main(@builtin(global_invocation_id) id: vec3u) {
    let pair = operands[id.x];
    results[id.x] = vec2f(sdfc_nearest_quotient(pair.x, pair.y), sdfc_nearest_root(pair.x));
}";

/// Returns pairs of arbitrary bits, and of neighbours of round numbers, whose quotients and roots lie nearest to
/// the middle between two floats.
fn pairs() -> Vec<[f32; 2]> {
    let mut state = 7_u64;
    let mut random = || {
        // Constants of the linear congruence MMIX (D. E. Knuth).
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (state >> 32) as u32
    };
    (0..PAIRS)
        .map(|index| {
            let [mut a, mut b] = [f32::from_bits(random()), f32::from_bits(random())];
            if index % 2 == 0 {
                let near_one =
                    |bits: u32| f32::from_bits(0x3f80_0000_u32.wrapping_add(bits % 64) - 32);
                let power = |bits: u32| (((bits % 200) as i32 - 100) as f32).exp2();
                a = near_one(random()) * power(random());
                b = near_one(random()) * power(random());
            }
            [a, b]
        })
        .collect()
}

/// Runs the kernel with a modified text of the functions.
fn results(text: &str) -> Option<Vec<[f32; 2]>> {
    if is_gpu_skipped() {
        return None;
    }
    let gpu = Gpu::open(AdapterPreference::Any).expect("there is an adapter");
    let bindings =
        BufferBinding::numbered(&[BindingAccess::StorageRead, BindingAccess::StorageReadWrite]);
    let kernel = gpu.kernel(&KernelSource {
        label: "rounding",
        wgsl: &format!("{text}{CALLS}"),
        entry: "main",
        bindings: &bindings,
        as_written: false,
    });
    let kernel = kernel.expect("it compiles");
    let operands = gpu.buffer_with("operands", BufferUsage::Storage, &pairs());
    let output = gpu.buffer("results", BufferUsage::Storage, (PAIRS * 8) as u64);
    let (operands, output) = (operands.expect("room"), output.expect("room"));
    let call = gpu.bind(&kernel, &[(0, &operands), (1, &output)]);
    let mut batch = gpu.batch();
    batch
        .dispatch(&call.expect("it fits"), Extent::Line(PAIRS as u64))
        .expect("in size");
    batch.submit_and_wait().expect("it runs");
    Some(gpu.read(&output).expect("it reads"))
}

/// Devices may be a few units off in both directions.
#[test]
fn quotients_and_roots_are_nearest_however_far_off_the_device_is() {
    for factor in ["1.0", "1.0000003", "0.9999997"] {
        let text = TEXT
            .replace("/ f32(divisor)", &format!("* {factor} / f32(divisor)"))
            .replace("u32(sqrt(", &format!("u32({factor} * sqrt("));
        assert_eq!(
            text.matches(factor).count(),
            2 + TEXT.matches(factor).count()
        );
        let Some(results) = results(&text) else {
            return;
        };
        let mut tested = 0;
        for (&[a, b], [quotient, root]) in pairs().iter().zip(results) {
            let expected = [a / b, a.sqrt()];
            for (result, expected) in [quotient, root].into_iter().zip(expected) {
                // Denormal operands and results are left to the device.
                if a.is_normal() && b.is_normal() && expected.is_normal() {
                    tested += 1;
                    assert_eq!(result, expected, "{a:e} and {b:e}, factor {factor}");
                }
            }
        }
        assert!(tested > PAIRS, "{tested}");
    }
}

#[test]
fn a_device_with_software_rounding_conforms() {
    if is_gpu_skipped() {
        return;
    }
    for arithmetic in [Arithmetic::Strict, Arithmetic::Portable] {
        let mut gpu = Gpu::open_with(AdapterPreference::Any, arithmetic).expect("it is strict");
        gpu.rounding = Rounding::Software;
        conformance::check(&gpu).expect("it conforms");
    }
}

#[test]
fn rewritten_modules_have_no_other_quotient_and_no_other_root() {
    let text = with_functions(
        "struct Pair { a: vec3f, b: vec3f }
         @group(0) @binding(0) var<storage, read_write> pairs: array<Pair>;
         fn ratio(a: f32, b: f32) -> f32 { var x = 0.5; x /= a; return x / b; }
         @compute @workgroup_size(1)
         fn main(@builtin(global_invocation_id) id: vec3u) {
             let pair = pairs[id.x / 3u];
             if pair.a.x / 2.0 < sqrt(pair.b.y) {
                 pairs[id.x].a = sqrt(pair.a / pair.b) / ratio(pair.a.x, sqrt(1.0 / pair.b.z));
             }
         }",
    );
    let module = naga::front::wgsl::parse_str(&text).expect("it parses");
    let validate = |module: &Module| {
        Validator::new(ValidationFlags::all(), Capabilities::empty())
            .validate(module)
            .expect("it is valid")
    };
    let count = |module: &Module, rounding: RoundingFunctions| {
        let info = validate(module);
        let functions = module.functions.iter();
        let functions = functions
            .filter(|(handle, _)| !rounding.contains(*handle))
            .map(|(handle, function)| (function, &info[handle]));
        let entry = (&module.entry_points[0].function, info.get_entry_point(0));
        let mut count = 0;
        for (function, info) in functions.chain([entry]) {
            for (handle, expression) in function.expressions.iter() {
                let inner = info[handle].ty.inner_with(&module.types);
                count += usize::from(
                    inner.scalar_kind() == Some(ScalarKind::Float)
                        && matches!(
                            expression,
                            Expression::Binary {
                                op: BinaryOperator::Divide,
                                ..
                            } | Expression::Math {
                                fun: MathFunction::Sqrt,
                                ..
                            }
                        ),
                );
            }
        }
        count
    };
    let rounding = RoundingFunctions::find(&module).expect("they are there");
    assert_eq!(count(&module, rounding), 9);
    for barriers in [false, true] {
        let rewrites = rewriter::Rewrites {
            barriers,
            rounding: Some(rounding),
        };
        let new = rewriter::rewrite(&module, &validate(&module), "main", rewrites);
        assert_eq!(count(&new.expect("it is rewritten"), rounding), 0);
    }
}
