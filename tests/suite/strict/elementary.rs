//! Our elementary functions, with 2²⁰ arguments each. With strict arithmetic the bits are equal on CPU
//! and GPU. Otherwise errors are at most as documented, plus what a driver may add.

use sdfc_runtime::gpu::{
    AdapterPreference, Arithmetic, BindingAccess, BufferBinding, BufferUsage, Extent, Gpu,
    KernelSource,
};
use sdfc_trials::random::Random;
use sdfc_trials::skip::is_gpu_skipped;
use sdfc_vm::elementary::{arctangent, cosine, exponential, logarithm, sine};
use sdfc_vm::prelude;

/// Number of arguments of each function.
const ARGUMENT_COUNT: usize = 1 << 20;

/// A function and its arguments.
struct Case {
    /// Name in WGSL.
    name: &'static str,
    /// Call in WGSL, with the arguments in `v`.
    call: &'static str,
    rust: fn([f32; 2]) -> f32,
    truth: fn([f64; 2]) -> f64,
    /// Computes the arguments from two numbers in [0, 1).
    arguments: fn([f32; 2]) -> [f32; 2],
    /// Maximum error relative to the exact value, or absolute below 1.
    error: f64,
}

const CASES: [Case; 6] = [
    Case {
        name: "sine",
        call: "sine(v.x)",
        rust: |[x, _]| sine(x),
        truth: |[x, _]| x.sin(),
        arguments: |[a, _]| [200.0 * a - 100.0, 0.0],
        error: 2e-7,
    },
    Case {
        name: "cosine",
        call: "cosine(v.x)",
        rust: |[x, _]| cosine(x),
        truth: |[x, _]| x.cos(),
        arguments: |[a, _]| [200.0 * a - 100.0, 0.0],
        error: 2e-7,
    },
    Case {
        name: "sine",
        call: "sine(v.x)",
        rust: |[x, _]| sine(x),
        truth: |[x, _]| x.sin(),
        // Small arguments expose the relative error.
        arguments: |[a, b]| [(a - 0.5) * (-60.0 * b).exp2(), 0.0],
        error: 2e-7,
    },
    Case {
        name: "exponential",
        call: "exponential(v.x)",
        rust: |[x, _]| exponential(x),
        truth: |[x, _]| x.exp2(),
        arguments: |[a, _]| [252.0 * a - 125.0, 0.0],
        error: 4e-7,
    },
    Case {
        name: "logarithm",
        call: "logarithm(v.x)",
        rust: |[x, _]| logarithm(x),
        truth: |[x, _]| x.log2(),
        // Arguments start at twice the smallest normal number; smaller ones are clamped.
        arguments: |[a, b]| [(1.0 + a) * (252.0 * b - 125.0).floor().exp2(), 0.0],
        error: 6e-7,
    },
    Case {
        name: "arctangent",
        call: "arctangent(v.x, v.y)",
        rust: |[y, x]| arctangent(y, x),
        truth: |[y, x]| y.atan2(x),
        arguments: |[a, b]| [2.0 * a - 1.0, 2.0 * b - 1.0],
        error: 4e-7,
    },
];

/// Evaluates a function on a device for all arguments.
fn on_device(gpu: &Gpu, case: &Case, arguments: &[[f32; 2]]) -> Vec<f32> {
    let mut text = String::from(
        "@group(0) @binding(0) var<storage, read> arguments: array<vec2f>;
         @group(0) @binding(1) var<storage, read_write> results: array<f32>;\n",
    );
    for function in prelude::functions([case.name]) {
        text.push_str(&function.text);
    }
    text.push_str(&format!(
        "@compute @workgroup_size(64)
         fn main(@builtin(global_invocation_id) id: vec3u, @builtin(num_workgroups) groups: vec3u) {{
             let i = id.y * (groups.x * 64u) + id.x;
             if i >= arrayLength(&arguments) {{ return; }}
             let v = arguments[i];
             results[i] = {};
         }}\n",
        case.call
    ));
    let bindings =
        BufferBinding::numbered(&[BindingAccess::StorageRead, BindingAccess::StorageReadWrite]);
    let kernel = gpu.kernel(&KernelSource {
        label: case.name,
        wgsl: &text,
        entry: "main",
        bindings: &bindings,
        as_written: false,
    });
    let kernel = kernel.unwrap_or_else(|error| panic!("{error}"));
    let run = || {
        let from = gpu.buffer_with("arguments", BufferUsage::Storage, arguments)?;
        let to = gpu.buffer("results", BufferUsage::Storage, 4 * arguments.len() as u64)?;
        let mut batch = gpu.batch();
        let call = gpu.bind(&kernel, &[(0, &from), (1, &to)])?;
        batch.dispatch(&call, Extent::Line(arguments.len() as u64))?;
        batch.submit_and_wait()?;
        gpu.read(&to)
    };
    run().unwrap_or_else(|error| panic!("{}: {error}", case.name))
}

#[test]
fn elementary_functions_have_the_same_bits_everywhere() {
    if is_gpu_skipped() {
        return;
    }
    let all = [
        Arithmetic::Strict,
        Arithmetic::Portable,
        Arithmetic::Default,
    ];
    let [strict, portable, default] = all.map(|arithmetic| {
        Gpu::open_with(AdapterPreference::Any, arithmetic).unwrap_or_else(|error| panic!("{error}"))
    });
    for case in &CASES {
        let mut random = Random::for_case(case.name);
        let arguments: Vec<[f32; 2]> = (0..ARGUMENT_COUNT)
            .map(|_| (case.arguments)([random.unit_f32(), random.unit_f32()]))
            .collect();
        let rust: Vec<f32> = arguments.iter().map(|&v| (case.rust)(v)).collect();
        let differing = |results: &[f32]| {
            let pairs = rust.iter().zip(results);
            pairs.filter(|(a, b)| a.to_bits() != b.to_bits()).count()
        };
        let error = |results: &[f32]| {
            let errors = arguments.iter().zip(results).map(|(&v, &got)| {
                let truth = (case.truth)(v.map(f64::from));
                (f64::from(got) - truth).abs() / truth.abs().max(1.0)
            });
            errors.fold(
                0.0_f64,
                |most, e| if e > most || e.is_nan() { e } else { most },
            )
        };
        let exact = on_device(&strict, case, &arguments);
        let hidden = on_device(&portable, case, &arguments);
        let loose = on_device(&default, case, &arguments);
        let found = format!(
            "{}: {} of {ARGUMENT_COUNT} differ, {} in the portable form, {} without strict arithmetic; largest \
             errors {:.2e} and {:.2e}",
            case.name,
            differing(&exact),
            differing(&hidden),
            differing(&loose),
            error(&exact),
            error(&loose)
        );
        eprintln!("{found}");
        assert_eq!(differing(&exact), 0, "{found}");
        assert_eq!(differing(&hidden), 0, "{found}");
        assert!(error(&exact) <= case.error, "{found}");
        assert!(error(&loose) <= 2.0 * case.error, "{found}");
    }
}
