//! Limits of fields: those that bound no slope are removed, so that light sees the field beyond them.

use crate::scene;
use sdfc_compiler::compile::{Options, compile};
use sdfc_vm::evaluate::evaluate_f64;

/// Bodies of functions that limit the distance to a ball of radius 0.8.
const LIMITED: &[&str] = &[
    "min(length(p) - 0.8, 0.02)",
    "clamp(length(p) - 0.8, -0.1, 0.1)",
    "smoothstep(0.7, 0.9, length(p)) - 0.5",
    "saturate(length(p) - 0.7) - 0.1",
    "0.34 - 0.2 * min(2.5 - length(p), 2)",
    "max(min(1000, length(p) - 0.8), -0.01)",
];

#[test]
fn limits_that_bound_no_slope_are_removed() {
    let value = |body: &str, x: f64| {
        let text = format!("field(fn(p) => {body})");
        let (compiled, diagnostics) = compile(scene(&text), &Options::default());
        let module = compiled.unwrap_or_else(|| panic!("{body}: {diagnostics:?}"));
        evaluate_f64(&module.module.distance, [x, 0.0, 0.0])
    };
    for body in LIMITED {
        // Factors are removed, too, so values are relative to that at another point.
        let ratio = value(body, 1.8) / value(body, 1.3);
        assert!((ratio - 2.0).abs() < 1e-5, "{body}: {ratio}");
    }
}
