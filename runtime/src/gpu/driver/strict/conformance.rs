//! Test that a device rounds as strict kernels require. Sums, products, quotients and square roots go to the
//! nearest float, ties to even. Nothing is fused, reordered or simplified. Vulkan requires that of the first
//! two only (a quotient may be 2.5 units in the last place off). Therefore [`TRIPLE_COUNT`] triples of
//! numbers are tested before a device is used. That is evidence, not proof; `sdfc verify --strict` compares
//! other kernels.
//!
//! All numbers and results are normal: a device may flush denormal numbers to zero, and SwiftShader does.

use std::fmt::Write;

use super::super::{
    BindingAccess, BufferBinding, BufferUsage, Extent, Gpu, GpuError, KernelSource,
};

/// Number of tested triples.
const TRIPLE_COUNT: usize = 4096;

const TEXT: &str = include_str!("conformance.wgsl");

/// The expressions of the kernel, in the order of its results.
const EXPRESSIONS: [&str; 16] = [
    "a + b",
    "a - b",
    "a * b",
    "a / b",
    "sqrt(|a|)",
    "floor(a)",
    "f32(i32(c))",
    "a * b + c",
    "the rounding error of a + b",
    "(c * 0.1) * 0.3 + (c + 0.1) + 0.2",
    "a / 3",
    "sqrt(|a|) * sqrt(|a|)",
    "a * c + b * c",
    "min(a, b) - max(b, c)",
    "1 / a",
    "1 / sqrt(|a|)",
];

/// Returns the results in Rust.
fn expected_results([a, b, c]: [f32; 3]) -> [f32; 16] {
    let sum = a + b;
    let part = sum - a;
    let root = a.abs().sqrt();
    [
        sum,
        a - b,
        a * b,
        a / b,
        root,
        a.floor(),
        c as i32 as f32,
        a * b + c,
        (a - (sum - part)) + (b - part),
        (c * 0.1) * 0.3 + (c + 0.1) + 0.2,
        a / 3.0,
        root * root,
        a * c + b * c,
        a.min(b) - b.max(c),
        1.0 / a,
        1.0 / root,
    ]
}

/// Returns numbers of both signs and of magnitudes from 2⁻²⁰ to 2²¹; always the same ones.
fn test_triples() -> Vec<[f32; 4]> {
    let mut state = 1_u32;
    let mut number = || {
        // A linear congruence (D. E. Knuth, *Seminumerical Algorithms*, 3.3.4, table 1, line 16).
        let mut random = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            state >> 8
        };
        let mantissa = 1.0 + random() as f32 / (1 << 24) as f32;
        let power = (random() % 41) as i32 - 20;
        let sign = if random() % 2 == 0 { 1.0 } else { -1.0 };
        sign * mantissa * (power as f32).exp2()
    };
    (0..TRIPLE_COUNT)
        .map(|_| [number(), number(), number(), 0.0])
        .collect()
}

/// Fails with [`GpuError::Inexact`] if the device rounds differently.
pub(in super::super) fn check(gpu: &Gpu) -> Result<(), GpuError> {
    let bindings =
        BufferBinding::numbered(&[BindingAccess::StorageRead, BindingAccess::StorageReadWrite]);
    let kernel = gpu.kernel(&KernelSource {
        label: "conformance",
        wgsl: TEXT,
        entry: "main",
        bindings: &bindings,
        as_written: true,
    })?;
    let triples = test_triples();
    let input_buffer = gpu.buffer_with("operands", BufferUsage::Storage, &triples)?;
    let size = size_of::<[f32; 16]>() * TRIPLE_COUNT;
    let output_buffer = gpu.buffer("answered", BufferUsage::Storage, size as u64)?;
    let call = gpu.bind(&kernel, &[(0, &input_buffer), (1, &output_buffer)])?;
    let mut batch = gpu.batch();
    batch.dispatch(&call, Extent::Line(TRIPLE_COUNT as u64))?;
    batch.submit_and_wait()?;
    let results: Vec<[f32; 16]> = gpu.read(&output_buffer)?;
    match find_mismatches(&triples, &results) {
        None => Ok(()),
        Some(mismatches) => Err(GpuError::Inexact {
            name: gpu.info().name.clone(),
            found: mismatches,
        }),
    }
}

/// Describes each expression that differs from Rust, with its first example.
fn find_mismatches(triples: &[[f32; 4]], results: &[[f32; 16]]) -> Option<String> {
    let mut mismatches = String::new();
    for (index, expression) in EXPRESSIONS.iter().enumerate() {
        let differs = |(&[a, b, c, _], actual): (&[f32; 4], &[f32; 16])| {
            let expected = expected_results([a, b, c])[index];
            // A zero equals a negative zero.
            (actual[index] != expected).then_some(([a, b, c], actual[index], expected))
        };
        let pairs = || triples.iter().zip(results);
        if let Some(([a, b, c], actual, expected)) = pairs().find_map(differs) {
            let count = pairs().filter_map(differs).count();
            let separator = if mismatches.is_empty() { "" } else { "; " };
            let _ = write!(
                mismatches,
                "{separator}{expression} is {actual:?} instead of {expected:?} for a = {a:?}, b = {b:?}, \
                 c = {c:?}, and wrong {count} times of {TRIPLE_COUNT}"
            );
        }
    }
    (!mismatches.is_empty()).then_some(mismatches)
}

#[cfg(test)]
mod tests {
    use super::super::super::{AdapterPreference, DeviceKind};
    use super::*;
    use sdfc_trials::skip::is_gpu_skipped;

    #[test]
    fn no_test_expression_has_a_denormal_result() {
        for [a, b, c, _] in test_triples() {
            for (expression, result) in EXPRESSIONS.iter().zip(expected_results([a, b, c])) {
                assert!(
                    result == 0.0 || result.is_normal(),
                    "{expression} of {a}, {b}, {c} is {result:e}"
                );
            }
        }
    }

    /// Kernels as written are not fused on a device with default arithmetic. Software Vulkan rounds quotients and
    /// roots correctly, too.
    #[test]
    fn kernels_as_written_conform_without_strict_arithmetic() {
        if is_gpu_skipped() {
            return;
        }
        let gpu = Gpu::open(AdapterPreference::Any).expect("there is an adapter");
        if gpu.info().kind == DeviceKind::Software {
            check(&gpu).expect("it conforms");
        }
    }

    /// Typical rewritings by devices must change the results.
    #[test]
    fn the_usual_rewritings_are_seen() {
        let triples = test_triples();
        let is_detected = |index: usize, rewritten: fn([f32; 3]) -> f32| {
            let results: Vec<[f32; 16]> = triples
                .iter()
                .map(|&[a, b, c, _]| {
                    let mut expected = expected_results([a, b, c]);
                    expected[index] = rewritten([a, b, c]);
                    expected
                })
                .collect();
            find_mismatches(&triples, &results)
                .is_some_and(|mismatches| mismatches.starts_with(EXPRESSIONS[index]))
        };
        assert!(is_detected(3, |[a, b, _]| a * (1.0 / b)));
        assert!(is_detected(4, |[a, ..]| a.abs() * (1.0 / a.abs().sqrt())));
        assert!(is_detected(7, |[a, b, c]| a.mul_add(b, c)));
        assert!(is_detected(8, |_| 0.0));
        assert!(is_detected(9, |[_, _, c]| c * (0.1 * 0.3) + (c + (0.1 + 0.2))));
        assert!(is_detected(10, |[a, ..]| a * (1.0 / 3.0)));
        assert!(is_detected(11, |[a, ..]| a.abs()));
        assert!(is_detected(12, |[a, b, c]| (a + b) * c));
        assert!(is_detected(14, |[a, ..]| (1.0 / a).next_up()));
        assert!(is_detected(15, |[a, ..]| (1.0 / f64::from(a.abs()).sqrt()) as f32));
        let exact: Vec<[f32; 16]> = triples
            .iter()
            .map(|&[a, b, c, _]| expected_results([a, b, c]))
            .collect();
        assert_eq!(find_mismatches(&triples, &exact), None);
    }
}
