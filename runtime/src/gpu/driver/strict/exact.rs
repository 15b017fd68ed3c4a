//! The float operations that a strict kernel may use: those with one correct result. The sine of a number or
//! a remainder may have any value near the truth. So may functions that combine several operations, whose
//! order and fusing a device chooses (`dot`, `mix`, `length`). They are refused in both forms of strict
//! kernels.

use naga::valid::{FunctionInfo, ModuleInfo};
use naga::{
    BinaryOperator, Expression, Function, Handle, MathFunction, Module, ScalarKind, TypeInner,
};

/// Functions with one correct result.
const EXACT_FUNCTIONS: [MathFunction; 6] = [
    MathFunction::Abs,
    MathFunction::Min,
    MathFunction::Max,
    MathFunction::Floor,
    MathFunction::Sqrt,
    MathFunction::Transpose,
];

/// Fails for operations whose bits differ between devices.
pub(in super::super) fn check(module: &Module, info: &ModuleInfo) -> Result<(), String> {
    let functions = module.functions.iter();
    let functions = functions.map(|(handle, function)| (function, &info[handle]));
    let entries = module.entry_points.iter().enumerate();
    let entries = entries.map(|(index, entry)| (&entry.function, info.get_entry_point(index)));
    let inexact = functions
        .chain(entries)
        .find_map(|(function, info)| find_inexact(module, function, info));
    match inexact {
        None => Ok(()),
        Some(operation) => Err(format!(
            "{operation} of floats may have other bits on every device, so strict kernels do without"
        )),
    }
}

/// Describes the first inexact operation of a function; `None` if all are exact.
fn find_inexact(module: &Module, function: &Function, info: &FunctionInfo) -> Option<String> {
    let inner = |handle: Handle<Expression>| info[handle].ty.inner_with(&module.types);
    let is_float = |handle| {
        let scalar = inner(handle).scalar();
        scalar.is_some_and(|scalar| scalar.kind == ScalarKind::Float)
    };
    function
        .expressions
        .iter()
        .find_map(|(handle, expression)| match expression {
            Expression::Math { fun, arg, .. } => {
                let floats = is_float(handle) || is_float(*arg);
                (floats && !EXACT_FUNCTIONS.contains(fun)).then(|| format!("`{fun:?}`"))
            }
            Expression::Binary { op, left, right } => {
                let is_matrix = |&&handle: &&Handle<Expression>| {
                    matches!(inner(handle), TypeInner::Matrix { .. })
                };
                let matrices = [left, right].iter().any(is_matrix);
                let remainder = *op == BinaryOperator::Modulo && is_float(handle);
                (matrices || remainder).then(|| format!("`{op:?}`"))
            }
            _ => None,
        })
}

#[cfg(test)]
mod tests {
    use super::*;
    use naga::valid::{Capabilities, ValidationFlags, Validator};

    fn checked(expression: &str) -> Result<(), String> {
        let text = format!(
            "@group(0) @binding(0) var<storage, read_write> v: array<vec4f>;
             @compute @workgroup_size(1)
             fn main() {{ let a = v[0]; let b = v[1]; v[2] = {expression}; }}"
        );
        let module = naga::front::wgsl::parse_str(&text).expect("it parses");
        let mut validator = Validator::new(ValidationFlags::all(), Capabilities::empty());
        let info = validator.validate(&module).expect("it is valid");
        check(&module, &info)
    }

    #[test]
    fn exact_operations_are_accepted() {
        for expression in [
            "a + b - a * b / b",
            "min(abs(a), max(-b, sqrt(floor(a))))",
            "select(a, b, a < b)",
            "transpose(mat4x4f(a, b, b, a))[2]",
            "vec4f(vec4u(a) % 3u)",
            "vec4f(f32(dot(vec4i(a), vec4i(b))))",
        ] {
            assert_eq!(checked(expression), Ok(()), "{expression}");
        }
    }

    #[test]
    fn inexact_operations_are_refused() {
        for (expression, name) in [
            ("sin(a)", "Sin"),
            ("fma(a, b, a)", "Fma"),
            ("mix(a, b, 0.5)", "Mix"),
            ("vec4f(dot(a, b))", "Dot"),
            ("unpack4x8unorm(u32(a.x))", "Unpack4x8unorm"),
            ("a % b", "Modulo"),
            ("mat4x4f(a, a, b, b) * a", "Multiply"),
        ] {
            let error = checked(expression).expect_err(expression);
            assert!(error.starts_with(&format!("`{name}` of floats")), "{error}");
        }
    }
}
