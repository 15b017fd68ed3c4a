//! The functions of the language: every row of the table that has a word in it, and those that are
//! not one row: transforms, set operations, fields, numbers and lists.

use super::Elaborator;
use super::arguments::{Formal, Invocation, Kind, left, needed};
use super::bound::Bound;
use super::csg::SetOperation;
use super::evaluate::Outcome;
use super::math::{MATH, MathRow};
use super::value::Value;
use sdfc_vm::row::{ArgumentKind as A, Category};
use sdfc_vm::table::{Op, ROWS};
use std::collections::HashMap;
use std::sync::LazyLock;

/// A function whose arguments are bound to parameters first.
pub(crate) type RunFixed = for<'a> fn(&mut Elaborator<'a>, Bound<'a>) -> Outcome<'a>;
/// A function that looks at its arguments itself.
type RunFree = for<'a> fn(&mut Elaborator<'a>, Invocation<'a>) -> Outcome<'a>;

/// A function of the language.
#[derive(Debug)]
pub(crate) enum Function {
    /// With parameters.
    Fixed {
        /// What it takes.
        formals: &'static [Formal],
        /// What it does.
        run: RunFixed,
    },
    /// With arguments of its own kind.
    Free {
        /// What it does.
        run: RunFree,
    },
    /// Rows of the table: the first that fits takes the call.
    Rows(Vec<Variant>),
}

/// A row of the table as a function.
#[derive(Debug)]
pub(crate) struct Variant {
    /// The row.
    pub(crate) op: Op,
    /// What it takes.
    pub(crate) formals: Vec<Formal>,
}

const SHAPE: Formal = needed("shape", Kind::Shape);
const SOLID: Formal = needed("shape", Kind::Solid);
const FIGURE: Formal = needed("shape", Kind::Figure);
const LIST: Formal = needed("list", Kind::List);
const FUNCTION: Formal = needed("f", Kind::Function);
const SEED: Formal = left("seed", Kind::Row(A::Number), &[0.0]);

/// The functions with parameters that are not one row.
const FIXED: &[(&str, &[Formal], RunFixed)] = &[
    (
        "translate",
        &[SHAPE, needed("by", Kind::Row(A::Vec3))],
        |e, b| e.translate(b),
    ),
    (
        "rotate",
        &[
            SHAPE,
            needed("angle", Kind::Any),
            left("axis", Kind::Row(A::Direction), &[]),
        ],
        |e, b| e.rotate(b),
    ),
    (
        "rotate_quaternion",
        &[SOLID, needed("q", Kind::Any)],
        |e, b| e.rotate_quaternion(b),
    ),
    ("scale", &[SHAPE, needed("by", Kind::Factors)], |e, b| {
        e.scale(b)
    }),
    (
        "shear",
        &[
            SOLID,
            left("xy", Kind::Row(A::Number), &[0.0]),
            left("xz", Kind::Row(A::Number), &[0.0]),
            left("yz", Kind::Row(A::Number), &[0.0]),
        ],
        |e, b| e.shear(b),
    ),
    (
        "mirror",
        &[
            SHAPE,
            needed("axes", Kind::Row(A::Vec3)),
            left("at", Kind::Row(A::Offset), &[0.0]),
        ],
        |e, b| e.mirror(b),
    ),
    (
        "repeat",
        &[
            SHAPE,
            needed("spacing", Kind::Row(A::Lengths3)),
            left("count", Kind::Row(A::Counts3), &[]),
        ],
        |e, b| e.repeat(b),
    ),
    (
        "polar",
        &[
            SHAPE,
            needed("n", Kind::Row(A::Count)),
            left("phase", Kind::Row(A::Angle), &[]),
        ],
        |e, b| e.polar(b),
    ),
    (
        "elongate",
        &[SHAPE, needed("by", Kind::Row(A::Lengths3))],
        |e, b| e.elongate(b),
    ),
    (
        "twist",
        &[SOLID, needed("rate", Kind::Row(A::Angle))],
        |e, b| e.curled(Op::Twist, b),
    ),
    (
        "bend",
        &[SOLID, needed("rate", Kind::Row(A::Angle))],
        |e, b| e.curled(Op::Bend, b),
    ),
    (
        "revolve",
        &[
            FIGURE,
            left("offset", Kind::Row(A::Offset), &[0.0]),
            left("angle", Kind::Row(A::Angle), &[]),
        ],
        |e, b| e.revolve(b),
    ),
    (
        "section",
        &[
            SOLID,
            needed("normal", Kind::Row(A::Direction)),
            left("at", Kind::Row(A::Offset), &[0.0]),
        ],
        |e, b| e.section(b),
    ),
    (
        "slice",
        &[
            SOLID,
            needed("normal", Kind::Row(A::Direction)),
            left("at", Kind::Row(A::Offset), &[0.0]),
        ],
        |e, b| e.slice(b),
    ),
    (
        "morph",
        &[
            SHAPE,
            needed("other", Kind::Shape),
            needed("t", Kind::Row(A::Number)),
        ],
        |e, b| {
            let parameters = e.prepared(Op::Morph, &[b.number(2)]);
            let shapes = vec![b.shape(0), b.shape(1)];
            super::shapes::shape_value(e.combined(Op::Morph, parameters, shapes, b.span))
        },
    ),
    ("normalized", NORMALIZED, |e, b| e.normalized(b)),
    ("complement", &[SHAPE], |e, b| {
        Ok(e.complement(&b.value(0).clone(), b.span_of(0), b.span))
    }),
    (
        "field",
        &[
            FUNCTION,
            left("lipschitz", Kind::Row(A::Number), &[]),
            left("within", Kind::Row(A::Size3), &[]),
        ],
        |e, b| e.field_shape(b),
    ),
    (
        "heightfield",
        &[
            FUNCTION,
            needed("over", Kind::Row(A::Size2)),
            left("base", Kind::Row(A::Offset), &[]),
        ],
        |e, b| e.heightfield(b),
    ),
    ("displace", &[SHAPE, FUNCTION], |e, b| e.displace(b)),
    ("warp", &[SHAPE, FUNCTION], |e, b| e.warp(b)),
    ("polygon", &[needed("points", Kind::List)], |e, b| {
        e.polygon(b)
    }),
    ("nothing", &[], |e, b| {
        let kind = crate::scene::ShapeKind::Nothing;
        Ok(Value::Shape(e.add(kind, false, b.span)))
    }),
    (
        "material",
        &[SHAPE, needed("material", Kind::Material)],
        |e, b| e.painted(b),
    ),
    ("color", &[SHAPE, needed("color", Kind::Any)], |e, b| {
        e.colored(b)
    }),
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
    ("noise", &[needed("p", Kind::Any), SEED], |e, b| e.noise(b)),
    ("fbm", OCTAVES, |e, b| e.octaves(Op::NoiseOctave, b)),
    ("ridge", OCTAVES, |e, b| e.octaves(Op::RidgeOctave, b)),
    ("len", &[needed("list", Kind::Any)], |e, b| e.len(b)),
    ("map", &[LIST, FUNCTION], |e, b| e.map(b)),
    ("filter", &[LIST, FUNCTION], |e, b| e.filter(b)),
    (
        "fold",
        &[LIST, needed("start", Kind::Any), FUNCTION],
        |e, b| e.fold(b),
    ),
    ("sum", &[LIST], |e, b| e.sum(b)),
    (
        "at",
        &[LIST, needed("index", Kind::Row(A::Number))],
        |e, b| e.element_at(b),
    ),
    ("reverse", &[LIST], |e, b| e.reverse(b)),
    (
        "random",
        &[needed("i", Kind::Row(A::Number)), SEED],
        |e, b| e.random(b),
    ),
];

const NORMALIZED: &[Formal] = &[SHAPE, left("reach", Kind::Row(A::Length), &[])];
const REFLECT: &[Formal] = &[
    SHAPE,
    needed("normal", Kind::Row(A::Direction)),
    left("at", Kind::Row(A::Offset), &[0.0]),
];
const OCTAVES: &[Formal] = &[
    needed("p", Kind::Any),
    left("octaves", Kind::Row(A::Number), &[5.0]),
    SEED,
    left("gain", Kind::Row(A::Number), &[0.5]),
    left("lacunarity", Kind::Row(A::Number), &[2.0]),
];

/// The functions that look at their arguments themselves.
const FREE: &[(&str, RunFree)] = &[
    ("union", |e, c| e.set_function(SetOperation::Union, c)),
    ("intersect", |e, c| {
        e.set_function(SetOperation::Intersection, c)
    }),
    ("subtract", |e, c| {
        e.set_function(SetOperation::Subtraction, c)
    }),
    ("xor", |e, c| e.exclusive(c)),
    ("min", |e, c| e.extreme(Op::Min, c)),
    ("max", |e, c| e.extreme(Op::Max, c)),
    ("pow", |e, c| e.power(c)),
    ("dot", |e, c| e.dot(c)),
    ("cross", |e, c| e.cross(c)),
    ("length", |e, c| e.length(c)),
    ("distance", |e, c| {
        match c.given.first().map(|given| &given.value) {
            Some(Value::Shape(_)) => e.call_fixed(NORMALIZED, |e, b| e.normalized(b), c),
            _ => e.distance(c),
        }
    }),
    ("normalize", |e, c| e.normalize(c)),
    ("saturate", |e, c| e.saturate(c)),
    ("radians", |e, c| e.radians(c)),
    ("degrees", |e, c| e.degrees(c)),
    ("fma", |e, c| e.product_and_sum(c)),
    ("asinh", |e, c| e.area(Op::Sinh, c)),
    ("acosh", |e, c| e.area(Op::Cosh, c)),
    ("atanh", |e, c| e.area(Op::Tanh, c)),
    ("reflect", |e, c| {
        match c.given.first().map(|given| &given.value) {
            Some(Value::Vector(_)) => e.reflected(c),
            _ => e.call_fixed(REFLECT, |e, b| e.reflect(b), c),
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
static FUNCTIONS: LazyLock<HashMap<&'static str, Function>> = LazyLock::new(|| {
    let mut functions: HashMap<&'static str, Function> = HashMap::new();
    for row in ROWS {
        let Some(language) = &row.meta.language else {
            continue;
        };
        let formals = language.arguments.iter().map(|argument| Formal {
            name: argument.name,
            kind: Kind::Row(argument.kind),
            default: argument.default,
        });
        let object = match row.meta.category {
            Category::Shape3 | Category::Shape2 => None,
            Category::Dimension => Some(FIGURE),
            Category::Distance | Category::Domain => Some(SHAPE),
            Category::Combine | Category::Math | Category::Internal => continue,
        };
        let variant = Variant {
            op: row.op,
            formals: object.into_iter().chain(formals).collect(),
        };
        match functions
            .entry(language.name)
            .or_insert_with(|| Function::Rows(Vec::new()))
        {
            Function::Rows(variants) => variants.push(variant),
            Function::Fixed { .. } | Function::Free { .. } => {}
        }
    }
    for (name, formals, run) in FIXED {
        functions.insert(name, Function::Fixed { formals, run: *run });
    }
    for (name, run) in FREE {
        functions.insert(name, Function::Free { run: *run });
    }
    for row in MATH {
        functions.insert(row.name(), Function::Free { run: math });
    }
    functions
});

/// A function of numbers, found again by the name it is called by.
fn math<'a>(e: &mut Elaborator<'a>, call: Invocation<'a>) -> Outcome<'a> {
    match MathRow::of(call.name) {
        Some(row) => Ok(e.math(row, &call)),
        None => Ok(Value::Poison),
    }
}

/// The function of this name.
pub(crate) fn get(name: &str) -> Option<&'static Function> {
    FUNCTIONS.get(name)
}

/// The name as it lives in the vocabulary, if there is a function of this name.
pub(crate) fn function(name: &str) -> Option<&'static str> {
    FUNCTIONS.get_key_value(name).map(|(name, _)| *name)
}

/// The constants of the language.
pub(crate) const CONSTANTS: [&str; 6] = ["X", "Y", "Z", "pi", "tau", "time"];

/// The names of all functions and constants, in order.
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
            if let Some(language) = &row.meta.language {
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
            let lists: Vec<&[Formal]> = match get(name) {
                Some(Function::Fixed { formals, .. }) => vec![formals],
                Some(Function::Rows(variants)) => variants.iter().map(|v| &v.formals[..]).collect(),
                Some(Function::Free { .. }) | None => continue,
            };
            for formals in lists {
                for (at, formal) in formals.iter().enumerate() {
                    let again = formals[at + 1..]
                        .iter()
                        .any(|other| other.name == formal.name);
                    assert!(!again, "{name}: {}", formal.name);
                }
            }
        }
    }
}
