//! Operands that are proved to lie in the domain of their operation add nothing to a field.

use crate::scene;
use sdfc_compiler::expression::Expression;
use sdfc_compiler::scene::ShapeKind;
use sdfc_vm::table::Op;

/// Reports whether a field selects a distance without a surface where it is not defined.
fn has_condition(body: &str) -> bool {
    let text = format!("param k = 0.2 in 0..=1;\nfield(fn(p) => {body})");
    let scene = scene(&text);
    let ShapeKind::Field { value, .. } = scene.shapes[0].kind else {
        panic!("{text}: no field");
    };
    let Expression::Apply {
        op: Op::Select,
        values,
        ..
    } = scene.expressions.get(value)
    else {
        return false;
    };
    scene.expressions.as_constant(values[1]) == Some(1e9)
}

#[test]
fn proved_operands_have_no_condition() {
    for body in [
        "length(p) - 1",
        "sqrt(1 + sin(p.x)) + p.y",
        "pow(p.x * p.x * p.x * p.x + pow(p.y, 8), 0.25) - 1",
        "pow(abs(p.x), 2.5) + abs(p.y) - 1",
        "-ln(exp(-8 * p.x) + exp(-8 * p.y)) / 8",
        "acos(p.y / length(p)) / 1rad - 1",
        "asin(-p.z / max(length(p), 0.1)) / 1rad - 0.3",
        "acos(clamp(p.x, -1, 1)) / 1rad - 1",
        "p.x / length(p) + (p.x % 2) / 3",
        "max(k - abs(p.x - p.y), 0) / k + p.z",
        "if p.x > 0 { sqrt(p.x) } else { 0 } + p.y",
        "if p.x <= 0.1 { 0 } else { ln(p.x) } + p.y",
        "if !(p.x < 2 || p.y < 1) { sqrt(p.y - 1) } else { 1 }",
        "if p.x > 1 && sqrt(p.x - 1) > p.y { 1 } else { p.y }",
        "if p.x < 0 || sqrt(p.x) < p.y { 1 } else { p.y }",
        "0.25 * sqrt(dot(p, p) / (4 * dot(p, p))) * ln(dot(p, p))",
    ] {
        assert!(!has_condition(body), "{body}");
    }
}

#[test]
fn operands_beyond_the_domain_have_a_condition() {
    for body in [
        "sqrt(p.x) - 1",
        "pow(p.x, 1.5) - 1",
        "pow(p.x, k) - 1",
        "ln(p.y) * p.z",
        "acos(p.y / length(p.xz)) / 1rad",
        "max(p.x, 0) / max(p.y, 0) - 1",
        "p.x % floor(p.y)",
        "if p.x > -1 { sqrt(p.x) } else { 0 } + p.y",
        "if p.y > 0 { sqrt(p.x) } else { 0 } + p.y",
        "if p.x > 0 || sqrt(p.x) > p.y { 1 } else { p.y }",
        "max(p.y, 1 - sqrt(p.x))",
    ] {
        assert!(has_condition(body), "{body}");
    }
}
