//! Vocabulary of built-in functions. Some are operations of the table, which have a name in the language.
//! Others are not a single operation: transforms, set operations, fields, numbers, lists.

use super::Elaborator;
use super::argument_conversion::TypedBuiltinFn;
use super::arguments::{ExpectedKind, Invocation, ParamSpec, optional, required};
use super::blend_spec::SetOperator;
use super::builtins::math::{MATH, MathRow};
use super::shapes::shape_value;
use super::value::{EvalResult, Value};
use sdfc_vm::row::{ArgumentKind as A, Category};
use sdfc_vm::table::{Op, ROWS};
use std::collections::HashMap;
use std::sync::LazyLock;
/// Implementation of a function that evaluates its arguments itself.
type UntypedBuiltinFn = for<'a> fn(&mut Elaborator<'a>, Invocation<'a>) -> EvalResult<'a>;

/// A built-in function.
#[derive(Debug)]
pub(crate) enum BuiltinFunction {
    /// A function with fixed parameters.
    Typed {
        /// Parameters, in the order of a call without names.
        params: &'static [ParamSpec],
        /// Function that is called with converted arguments.
        run: TypedBuiltinFn,
    },
    /// A function that checks its arguments itself.
    Untyped {
        /// Function that is called with unconverted arguments.
        run: UntypedBuiltinFn,
    },
    /// Operations of the table: the first variant that fits takes the call.
    Rows(Vec<Variant>),
}

/// An operation of the table as a function.
#[derive(Debug)]
pub(crate) struct Variant {
    /// Operation of the table that a call creates.
    pub(crate) op: Op,
    /// Parameters of a call that selects this row.
    pub(crate) params: Vec<ParamSpec>,
}

const SHAPE: ParamSpec = required("shape", ExpectedKind::Shape);
const SHAPE_3D: ParamSpec = required("shape", ExpectedKind::Shape3);
const SHAPE_2D: ParamSpec = required("shape", ExpectedKind::Shape2);
const LIST: ParamSpec = required("list", ExpectedKind::List);
const FUNCTION: ParamSpec = required("f", ExpectedKind::Function);
const SEED: ParamSpec = optional("seed", ExpectedKind::Row(A::Number), &[0.0]);

/// Functions with fixed parameters that are not a single operation.
const TYPED_FUNCTIONS: &[(&str, &[ParamSpec], TypedBuiltinFn)] = &[
    (
        "translate",
        &[SHAPE, required("by", ExpectedKind::Row(A::Vec3))],
        |e, b| e.translate(b),
    ),
    (
        "rotate",
        &[
            SHAPE,
            required("angle", ExpectedKind::Any),
            optional("axis", ExpectedKind::Row(A::Direction), &[]),
        ],
        |e, b| e.rotate(b),
    ),
    (
        "rotate_quaternion",
        &[SHAPE_3D, required("q", ExpectedKind::Any)],
        |e, b| e.rotate_quaternion(b),
    ),
    (
        "scale",
        &[SHAPE, required("by", ExpectedKind::Factors)],
        |e, b| e.scale(b),
    ),
    (
        "shear",
        &[
            SHAPE_3D,
            optional("xy", ExpectedKind::Row(A::Number), &[0.0]),
            optional("xz", ExpectedKind::Row(A::Number), &[0.0]),
            optional("yz", ExpectedKind::Row(A::Number), &[0.0]),
        ],
        |e, b| e.shear(b),
    ),
    (
        "mirror",
        &[
            SHAPE,
            required("axes", ExpectedKind::Row(A::Vec3)),
            optional("at", ExpectedKind::Row(A::Offset), &[0.0]),
        ],
        |e, b| e.mirror(b),
    ),
    (
        "repeat",
        &[
            SHAPE,
            required("spacing", ExpectedKind::Row(A::Lengths3)),
            optional("count", ExpectedKind::Row(A::Counts3), &[]),
        ],
        |e, b| e.repeat(b),
    ),
    (
        "polar",
        &[
            SHAPE,
            required("n", ExpectedKind::Row(A::Count)),
            optional("phase", ExpectedKind::Row(A::Angle), &[]),
        ],
        |e, b| e.polar(b),
    ),
    (
        "elongate",
        &[SHAPE, required("by", ExpectedKind::Row(A::Lengths3))],
        |e, b| e.elongate(b),
    ),
    (
        "twist",
        &[SHAPE_3D, required("rate", ExpectedKind::Row(A::Angle))],
        |e, b| e.twist_or_bend(Op::Twist, b),
    ),
    (
        "bend",
        &[SHAPE_3D, required("rate", ExpectedKind::Row(A::Angle))],
        |e, b| e.twist_or_bend(Op::Bend, b),
    ),
    (
        "revolve",
        &[
            SHAPE_2D,
            optional("offset", ExpectedKind::Row(A::Offset), &[0.0]),
            optional("angle", ExpectedKind::Row(A::Angle), &[]),
        ],
        |e, b| e.revolve(b),
    ),
    (
        "section",
        &[
            SHAPE_3D,
            required("normal", ExpectedKind::Row(A::Direction)),
            optional("at", ExpectedKind::Row(A::Offset), &[0.0]),
        ],
        |e, b| e.section(b),
    ),
    (
        "slice",
        &[
            SHAPE_3D,
            required("normal", ExpectedKind::Row(A::Direction)),
            optional("at", ExpectedKind::Row(A::Offset), &[0.0]),
        ],
        |e, b| e.slice(b),
    ),
    (
        "morph",
        &[
            SHAPE,
            required("other", ExpectedKind::Shape),
            required("t", ExpectedKind::Row(A::Number)),
        ],
        |e, b| {
            let parameters = e.prepare_parameters(Op::Morph, &[b.number(2)]);
            let shapes = vec![b.shape(0), b.shape(1)];
            shape_value(e.combine(Op::Morph, parameters, shapes, b.span))
        },
    ),
    ("normalized", NORMALIZED, |e, b| e.normalized(b)),
    ("complement", &[SHAPE], |e, b| {
        Ok(e.complement(&b.value(0).clone(), b.span_at(0), b.span))
    }),
    (
        "field",
        &[
            FUNCTION,
            optional("lipschitz", ExpectedKind::Row(A::Number), &[]),
            optional("within", ExpectedKind::Row(A::Size3), &[]),
        ],
        |e, b| e.field_shape(b),
    ),
    (
        "heightfield",
        &[
            FUNCTION,
            required("over", ExpectedKind::Row(A::Size2)),
            optional("base", ExpectedKind::Row(A::Offset), &[]),
        ],
        |e, b| e.heightfield(b),
    ),
    ("displace", &[SHAPE, FUNCTION], |e, b| e.displace(b)),
    ("warp", &[SHAPE, FUNCTION], |e, b| e.warp(b)),
    (
        "polygon",
        &[required("points", ExpectedKind::List)],
        |e, b| e.polygon(b),
    ),
    ("nothing", &[], |e, b| {
        let kind = crate::scene::ShapeKind::Nothing;
        Ok(Value::Shape(e.add(kind, false, b.span)))
    }),
    (
        "material",
        &[SHAPE, required("material", ExpectedKind::Material)],
        |e, b| e.painted(b),
    ),
    (
        "color",
        &[SHAPE, required("color", ExpectedKind::Any)],
        |e, b| e.colored(b),
    ),
    ("only", &[SHAPE], |e, b| {
        e.only.push(b.shape(0));
        Ok(b.value(0).clone())
    }),
    ("ghost", &[SHAPE], |e, b| {
        e.ghosts.push(b.shape(0));
        Ok(Value::Shape(e.add(
            crate::scene::ShapeKind::Nothing,
            false,
            b.span,
        )))
    }),
    ("hide", &[SHAPE], |e, b| {
        Ok(Value::Shape(e.add(
            crate::scene::ShapeKind::Nothing,
            false,
            b.span,
        )))
    }),
    (
        "noise",
        &[required("p", ExpectedKind::Any), SEED],
        |e, b| e.noise(b),
    ),
    ("fbm", OCTAVES, |e, b| e.fractal_noise(Op::NoiseOctave, b)),
    ("ridge", OCTAVES, |e, b| e.fractal_noise(Op::RidgeOctave, b)),
    ("len", &[required("list", ExpectedKind::Any)], |e, b| {
        e.len(b)
    }),
    ("map", &[LIST, FUNCTION], |e, b| e.map(b)),
    ("filter", &[LIST, FUNCTION], |e, b| e.filter(b)),
    (
        "fold",
        &[LIST, required("start", ExpectedKind::Any), FUNCTION],
        |e, b| e.fold(b),
    ),
    ("sum", &[LIST], |e, b| e.sum(b)),
    (
        "at",
        &[LIST, required("index", ExpectedKind::Row(A::Number))],
        |e, b| e.element_at(b),
    ),
    ("reverse", &[LIST], |e, b| e.reverse(b)),
    (
        "random",
        &[required("i", ExpectedKind::Row(A::Number)), SEED],
        |e, b| e.random(b),
    ),
];

const NORMALIZED: &[ParamSpec] = &[SHAPE, optional("reach", ExpectedKind::Row(A::Length), &[])];
const REFLECT: &[ParamSpec] = &[
    SHAPE,
    required("normal", ExpectedKind::Row(A::Direction)),
    optional("at", ExpectedKind::Row(A::Offset), &[0.0]),
];
const OCTAVES: &[ParamSpec] = &[
    required("p", ExpectedKind::Any),
    optional("octaves", ExpectedKind::Row(A::Number), &[5.0]),
    SEED,
    optional("gain", ExpectedKind::Row(A::Number), &[0.5]),
    optional("lacunarity", ExpectedKind::Row(A::Number), &[2.0]),
];

/// Functions that check their arguments themselves.
const UNTYPED_FUNCTIONS: &[(&str, UntypedBuiltinFn)] = &[
    ("union", |e, c| e.set_function(SetOperator::Union, c)),
    ("intersect", |e, c| {
        e.set_function(SetOperator::Intersection, c)
    }),
    ("subtract", |e, c| {
        e.set_function(SetOperator::Subtraction, c)
    }),
    ("xor", |e, c| e.exclusive(c)),
    ("min", |e, c| e.min_or_max(Op::Min, c)),
    ("max", |e, c| e.min_or_max(Op::Max, c)),
    ("pow", |e, c| e.power(c)),
    ("dot", |e, c| e.dot(c)),
    ("cross", |e, c| e.cross(c)),
    ("length", |e, c| e.length(c)),
    ("distance", |e, c| {
        match c.args.first().map(|arg| &arg.value) {
            Some(Value::Shape(_)) => e.call_typed(NORMALIZED, |e, b| e.normalized(b), c),
            _ => e.distance(c),
        }
    }),
    ("normalize", |e, c| e.normalize(c)),
    ("saturate", |e, c| e.saturate(c)),
    ("radians", |e, c| e.radians(c)),
    ("degrees", |e, c| e.degrees(c)),
    ("fma", |e, c| e.product_and_sum(c)),
    ("asinh", |e, c| e.inverse_hyperbolic(Op::Sinh, c)),
    ("acosh", |e, c| e.inverse_hyperbolic(Op::Cosh, c)),
    ("atanh", |e, c| e.inverse_hyperbolic(Op::Tanh, c)),
    ("reflect", |e, c| {
        match c.args.first().map(|arg| &arg.value) {
            Some(Value::Vector(_)) => e.reflect_vector(c),
            _ => e.call_typed(REFLECT, |e, b| e.reflect(b), c),
        }
    }),
    ("vec2", |e, c| e.vector(2, c)),
    ("vec3", |e, c| e.vector(3, c)),
    ("vec4", |e, c| e.vector(4, c)),
    ("rgb", |e, c| e.rgb(c)),
    ("hsv", |e, c| e.hsv(c)),
    ("list", |e, c| e.as_list(c)),
    ("concat", |e, c| e.concat(c)),
    ("str", |e, c| e.text(c)),
    ("print", |e, c| e.print(c)),
    ("assert", |e, c| e.assertion(c)),
];

/// All functions, by name.
static FUNCTIONS: LazyLock<HashMap<&'static str, BuiltinFunction>> = LazyLock::new(|| {
    let mut functions: HashMap<&'static str, BuiltinFunction> = HashMap::new();
    for row in ROWS {
        let Some(language) = &row.facts.language else {
            continue;
        };
        let params = language.arguments.iter().map(|argument| ParamSpec {
            name: argument.name,
            kind: ExpectedKind::Row(argument.kind),
            default: argument.default,
        });
        let object = match row.facts.category {
            Category::Shape3 | Category::Shape2 => None,
            Category::Dimension => Some(SHAPE_2D),
            Category::Distance | Category::Domain => Some(SHAPE),
            Category::Combine | Category::Math | Category::Internal => continue,
        };
        let variant = Variant {
            op: row.op,
            params: object.into_iter().chain(params).collect(),
        };
        match functions
            .entry(language.name)
            .or_insert_with(|| BuiltinFunction::Rows(Vec::new()))
        {
            BuiltinFunction::Rows(variants) => variants.push(variant),
            BuiltinFunction::Typed { .. } | BuiltinFunction::Untyped { .. } => {}
        }
    }
    for (name, params, run) in TYPED_FUNCTIONS {
        functions.insert(name, BuiltinFunction::Typed { params, run: *run });
    }
    for (name, run) in UNTYPED_FUNCTIONS {
        functions.insert(name, BuiltinFunction::Untyped { run: *run });
    }
    for row in MATH {
        functions.insert(row.name(), BuiltinFunction::Untyped { run: math });
    }
    functions
});

/// Evaluates a function of numbers, which is looked up by the name of the call.
fn math<'a>(e: &mut Elaborator<'a>, call: Invocation<'a>) -> EvalResult<'a> {
    match MathRow::from_name(call.name) {
        Some(row) => Ok(e.math(row, &call)),
        None => Ok(Value::Poison),
    }
}

/// Returns the built-in function of this name.
pub(crate) fn get(name: &str) -> Option<&'static BuiltinFunction> {
    FUNCTIONS.get(name)
}

/// Returns the static name of the function of this name, if there is one.
pub(crate) fn static_name(name: &str) -> Option<&'static str> {
    FUNCTIONS.get_key_value(name).map(|(name, _)| *name)
}

/// Constants of the language.
pub(crate) const CONSTANTS: [&str; 6] = ["X", "Y", "Z", "pi", "tau", "time"];

/// Returns the names of all functions and constants, sorted.
pub(crate) fn names<'n>() -> impl Iterator<Item = &'n str> {
    let mut names: Vec<&'n str> = FUNCTIONS.keys().copied().chain(CONSTANTS).collect();
    names.sort_unstable();
    names.into_iter()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_word_of_the_table_is_a_function() {
        for row in ROWS {
            if let Some(language) = &row.facts.language {
                assert!(
                    get(language.name).is_some(),
                    "{} is no function",
                    language.name
                );
            }
        }
    }

    #[test]
    fn no_parameter_is_named_twice() {
        for name in names() {
            let lists: Vec<&[ParamSpec]> = match get(name) {
                Some(BuiltinFunction::Typed { params, .. }) => vec![params],
                Some(BuiltinFunction::Rows(variants)) => {
                    variants.iter().map(|v| &v.params[..]).collect()
                }
                Some(BuiltinFunction::Untyped { .. }) | None => continue,
            };
            for params in lists {
                for (index, param) in params.iter().enumerate() {
                    let is_repeated = params[index + 1..]
                        .iter()
                        .any(|other| other.name == param.name);
                    assert!(!is_repeated, "{name}: {}", param.name);
                }
            }
        }
    }
}
