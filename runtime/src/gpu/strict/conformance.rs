//! Whether a device rounds as strict kernels promise: sums, products, quotients and square roots to
//! the nearest float, ties to even, and nothing fused, reordered or simplified. Vulkan asks for that
//! of the first two only (a quotient may be 2.5 units in the last place off), so it is tried on
//! [`COUNT`] triples of numbers before a device is used. That is evidence, not proof: what a driver
//! does to another kernel is compared by `sdfc verify --strict`.
//!
//! All numbers and results are normal: a device may flush denormal ones to zero, and SwiftShader does.

use std::fmt::Write;

use super::super::{Access, Binding, Extent, Gpu, GpuError, KernelSource, Usage};

/// How many triples are tried.
const COUNT: usize = 4096;

const TEXT: &str = include_str!("conformance.wgsl");

/// What the kernel computes, in the order of its answers.
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

/// The same in Rust.
fn answers([a, b, c]: [f32; 3]) -> [f32; 16] {
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

/// Numbers of all signs and of magnitudes from 2⁻²⁰ to 2²⁰, always the same ones.
fn questions() -> Vec<[f32; 4]> {
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
    (0..COUNT)
        .map(|_| [number(), number(), number(), 0.0])
        .collect()
}

/// Fails with [`GpuError::Inexact`] if the device rounds otherwise.
pub(in super::super) fn check(gpu: &Gpu) -> Result<(), GpuError> {
    let slots = [Access::StorageRead, Access::StorageReadWrite];
    let bindings: Vec<Binding> = (0..)
        .zip(slots)
        .map(|(slot, access)| Binding { slot, access })
        .collect();
    let kernel = gpu.kernel(&KernelSource {
        label: "conformance",
        wgsl: TEXT,
        entry: "main",
        bindings: &bindings,
    })?;
    let questions = questions();
    let asked = gpu.buffer_with("asked", Usage::Storage, &questions)?;
    let size = size_of::<[f32; 16]>() * COUNT;
    let answered = gpu.buffer("answered", Usage::Storage, size as u64)?;
    let call = gpu.bind(&kernel, &[(0, &asked), (1, &answered)])?;
    let mut batch = gpu.batch();
    batch.dispatch(&call, Extent::Line(COUNT as u64))?;
    batch.submit_and_wait()?;
    let answered: Vec<[f32; 16]> = gpu.read(&answered)?;
    match verdict(&questions, &answered) {
        None => Ok(()),
        Some(found) => Err(GpuError::Inexact {
            name: gpu.info().name.clone(),
            found,
        }),
    }
}

/// What is not as it is in Rust: each such expression with its first example.
fn verdict(questions: &[[f32; 4]], answered: &[[f32; 16]]) -> Option<String> {
    let mut found = String::new();
    for (at, expression) in EXPRESSIONS.iter().enumerate() {
        let differs = |(&[a, b, c, _], got): (&[f32; 4], &[f32; 16])| {
            let right = answers([a, b, c])[at];
            // Both zeros are zero.
            (got[at] != right).then_some(([a, b, c], got[at], right))
        };
        let pairs = || questions.iter().zip(answered);
        if let Some(([a, b, c], got, right)) = pairs().find_map(differs) {
            let count = pairs().filter_map(differs).count();
            let between = if found.is_empty() { "" } else { "; " };
            let _ = write!(
                found,
                "{between}{expression} is {got:?} instead of {right:?} for a = {a:?}, b = {b:?}, \
                 c = {c:?}, and wrong {count} times of {COUNT}"
            );
        }
    }
    (!found.is_empty()).then_some(found)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_question_has_a_denormal_answer() {
        for [a, b, c, _] in questions() {
            for (expression, answer) in EXPRESSIONS.iter().zip(answers([a, b, c])) {
                assert!(
                    answer == 0.0 || answer.is_normal(),
                    "{expression} of {a}, {b}, {c} is {answer:e}"
                );
            }
        }
    }

    /// What devices do to such expressions must show in the answers.
    #[test]
    fn the_usual_rewritings_are_seen() {
        let questions = questions();
        let seen = |at: usize, rewritten: fn([f32; 3]) -> f32| {
            let given: Vec<[f32; 16]> = questions
                .iter()
                .map(|&[a, b, c, _]| {
                    let mut answers = answers([a, b, c]);
                    answers[at] = rewritten([a, b, c]);
                    answers
                })
                .collect();
            verdict(&questions, &given).is_some_and(|found| found.starts_with(EXPRESSIONS[at]))
        };
        assert!(seen(3, |[a, b, _]| a * (1.0 / b)));
        assert!(seen(4, |[a, ..]| a.abs() * (1.0 / a.abs().sqrt())));
        assert!(seen(7, |[a, b, c]| a.mul_add(b, c)));
        assert!(seen(8, |_| 0.0));
        assert!(seen(9, |[_, _, c]| c * (0.1 * 0.3) + (c + (0.1 + 0.2))));
        assert!(seen(10, |[a, ..]| a * (1.0 / 3.0)));
        assert!(seen(11, |[a, ..]| a.abs()));
        assert!(seen(12, |[a, b, c]| (a + b) * c));
        assert!(seen(14, |[a, ..]| (1.0 / a).next_up()));
        assert!(seen(15, |[a, ..]| (1.0 / f64::from(a.abs()).sqrt()) as f32));
        let exact: Vec<[f32; 16]> = questions
            .iter()
            .map(|&[a, b, c, _]| answers([a, b, c]))
            .collect();
        assert_eq!(verdict(&questions, &exact), None);
    }
}
