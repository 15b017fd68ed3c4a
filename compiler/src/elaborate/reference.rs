//! Reference of the built-in functions, for `sdfc ops`: parameters and description. Functions that
//! are operations of the table take their description from there.

use super::arguments::signature;
use super::builtins::math::MATH;
use super::vocabulary::{self, BuiltinFunction};

/// A built-in function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FunctionDoc {
    /// Name.
    pub name: &'static str,
    /// Parameters; a function with variants has one line for each.
    pub signatures: Vec<String>,
    /// Description.
    pub doc: String,
}

/// All built-in functions, sorted by name.
pub fn reference() -> Vec<FunctionDoc> {
    vocabulary::names().filter_map(entry).collect()
}

fn entry(name: &str) -> Option<FunctionDoc> {
    let name = vocabulary::static_name(name)?;
    let described = DESCRIPTIONS.iter().find(|(n, ..)| *n == name);
    let doc = described.map(|(.., doc)| (*doc).to_owned());
    Some(match vocabulary::get(name)? {
        BuiltinFunction::Rows(variants) => FunctionDoc {
            name,
            signatures: variants.iter().map(|v| signature(&v.params)).collect(),
            doc: variants
                .first()
                .map_or_else(String::new, |v| v.op.row().doc.trim().to_owned()),
        },
        BuiltinFunction::Fixed { params, .. } => FunctionDoc {
            name,
            signatures: vec![signature(params)],
            doc: doc.unwrap_or_default(),
        },
        BuiltinFunction::Free { .. } => {
            let row = MATH.iter().find(|row| row.name() == name);
            let (arguments, row_doc) = match row {
                Some(row) => (row.arguments(), row.doc().to_owned()),
                None => (
                    described.map_or("", |(_, arguments, _)| arguments),
                    String::new(),
                ),
            };
            FunctionDoc {
                name,
                signatures: vec![arguments.to_owned()],
                doc: doc.unwrap_or(row_doc),
            }
        }
    })
}

/// Functions that are not a single operation of the table: name, arguments if the vocabulary does
/// not list them, and description.
const DESCRIPTIONS: &[(&str, &str, &str)] = &[
    ("translate", "", "The shape moved by a vector."),
    (
        "rotate",
        "",
        "The shape turned about an axis through the origin, counterclockwise when looked at from the \
         axis' tip; without an axis, about the one that points up. Three angles `[a, b, c]` turn \
         about x, then y, then z. A 2D shape turns in its plane.",
    ),
    (
        "rotate_quaternion",
        "",
        "The shape turned by a quaternion `[x, y, z, w]` of any length.",
    ),
    (
        "scale",
        "",
        "The shape scaled by a factor, or by one for each axis.",
    ),
    (
        "shear",
        "",
        "The shape sheared: x moves by `xy` per unit of y and by `xz` per unit of z, y by \
      `yz` per unit of z.",
    ),
    (
        "mirror",
        "",
        "What lies on the positive side of a plane, on both sides of it: `mirror(X)`, several axes \
         at once `mirror([1, 0, 1])`, or any normal, `at` along it from the origin. What lies on the \
         other side is not seen; `reflect` moves a whole shape there.",
    ),
    (
        "reflect",
        "shape: shape, normal: direction, at?: length",
        "The mirror image of the shape in the plane with this \
      normal, `at` along it from the origin. Of two vectors, the first reflected by the second.",
    ),
    (
        "repeat",
        "",
        "Copies of the shape every `spacing` along each axis (none where it is 0): without end, or \
         `count` of them, centred. The shape must fit into a cell.",
    ),
    (
        "polar",
        "",
        "`n` copies of the shape about the axis that points up, or in the plane for a 2D shape. The \
         first stands where the shape stands.",
    ),
    (
        "elongate",
        "",
        "The shape cut through its middle and pulled apart by a length along each axis.",
    ),
    (
        "twist",
        "",
        "The shape turned about the axis that points up, by an angle per unit of height.",
    ),
    (
        "bend",
        "",
        "The shape curled upwards, by an angle per unit along x.",
    ),
    (
        "revolve",
        "",
        "The 2D shape turned about the axis that points up, its y along it; `offset` moves it away \
         from the axis first, `angle` ends the turn, symmetric about x.",
    ),
    ("section", "", "The 2D shape that a solid shows in a plane."),
    (
        "slice",
        "",
        "What lies beyond a plane through the origin, or `at` along its normal: the side \
      that the normal points to.",
    ),
    (
        "morph",
        "",
        "A shape between two: the first at `t` = 0, the other at 1.",
    ),
    (
        "normalized",
        "",
        "The same surface with a distance for its value: the value divided by the length of its gradient, which \
         is right at the surface and nearly so beside it. Offsets, shells and blends then act as on shapes. \
         Operands of unions, of `min` and of `max` are normalized each by itself. `reach` is the largest \
         distance, for fields whose gradient vanishes somewhere.",
    ),
    (
        "complement",
        "",
        "Whatever is not in the shape; also written `!shape`.",
    ),
    (
        "field",
        "",
        "The solid where a function of the point is negative, or a 2D shape if the function is \
         written `fn(p: vec2)`. `lipschitz` states how fast it rises at most, `within` cuts it to a \
         box of this size.",
    ),
    (
        "heightfield",
        "",
        "Everything below a height, a function of the point on the ground (a vec2), within a \
         rectangle; down to `base`.",
    ),
    (
        "displace",
        "",
        "The surface moved outwards by a function of the point.",
    ),
    (
        "warp",
        "",
        "The shape seen through a change of space: at a point it is what it was at the \
      function of that point.",
    ),
    (
        "polygon",
        "",
        "The inside of a closed line through points of the plane.",
    ),
    ("nothing", "", "No shape at all; it changes no union."),
    ("material", "", "The shape in a material."),
    (
        "color",
        "",
        "The shape in a color, or in a function of the point and the normal that gives one.",
    ),
    ("only", "", "Draws only this shape, and others so marked."),
    (
        "ghost",
        "",
        "Takes the shape out of all operations and draws it pale, where it stands.",
    ),
    ("hide", "", "Takes the shape away."),
    (
        "noise",
        "",
        "Gradient noise at a point: smooth, about 1 per unit of length, between -1 and 1.",
    ),
    (
        "fbm",
        "",
        "Noise at several scales, each with `gain` times the amplitude and `lacunarity` times \
      the frequency of the one before; the first has the amplitude 0.5.",
    ),
    ("ridge", "", "The same of ridges, 1 - 2 * |noise|."),
    ("len", "", "How many elements a list has."),
    (
        "map",
        "",
        "The list of what a function gives for each element.",
    ),
    ("filter", "", "The elements for which a function is true."),
    ("fold", "", "`f(f(start, first), second)` and so on."),
    ("sum", "", "The sum of a list's elements."),
    ("at", "", "An element of a list, counted from 0."),
    ("reverse", "", "The list from its end."),
    (
        "random",
        "",
        "A number from 0 to 1 that is always the same for the same `i` and `seed`.",
    ),
    (
        "union",
        "shapes.., smooth?: length, kernel?: word, chamfer?: length, fillet?: length, stairs?: length, n?: count",
        "Whatever is in any of the shapes, or of a list of them; also written `a | b`, with a blend `a |[0.2] b`.",
    ),
    (
        "intersect",
        "shapes.., with the blends of union",
        "Whatever is in all of the shapes; also written `a & b`.",
    ),
    (
        "subtract",
        "shape, shapes.., with the blends of union",
        "The first shape without the others; also written `a - b`.",
    ),
    (
        "xor",
        "shapes..",
        "Whatever is in an odd number of the shapes.",
    ),
    (
        "min",
        "values..",
        "The smallest of several values, or of a list or a vector.",
    ),
    (
        "max",
        "values..",
        "The largest of several values, or of a list or a vector.",
    ),
    (
        "pow",
        "a, b",
        "a to the power of b; small whole powers hold for negative numbers too.",
    ),
    ("dot", "a, b", "The inner product of two vectors."),
    ("cross", "a, b", "The vector product of two vec3."),
    ("length", "v", "The length of a vector."),
    (
        "distance",
        "a, b",
        "The length of the difference of two vectors. Of a shape, `distance(shape)` is `normalized(shape)`.",
    ),
    (
        "normalize",
        "v",
        "The vector of length one in the same direction.",
    ),
    ("saturate", "x", "Kept within 0 and 1."),
    ("radians", "x", "A number of degrees as an angle."),
    ("degrees", "angle", "An angle as a number of degrees."),
    ("fma", "a, b, c", "a * b + c"),
    ("asinh", "x", "The inverse hyperbolic sine."),
    ("acosh", "x", "The inverse hyperbolic cosine."),
    ("atanh", "x", "The inverse hyperbolic tangent."),
    (
        "vec2",
        "numbers and vectors..",
        "Two numbers; one number stands for both.",
    ),
    (
        "vec3",
        "numbers and vectors..",
        "Three numbers; one number stands for all.",
    ),
    (
        "vec4",
        "numbers and vectors..",
        "Four numbers; one number stands for all.",
    ),
    ("rgb", "r, g, b", "A color from linear red, green and blue."),
    (
        "hsv",
        "hue, saturation, value",
        "A color of the screen by its hue, an angle or a share of a turn.",
    ),
    (
        "list",
        "values..",
        "A list of the values, or of a range's or a vector's.",
    ),
    ("concat", "lists..", "One list after the other."),
    ("str", "values..", "The values as one text."),
    (
        "print",
        "values..",
        "Tells the values to whoever builds the scene; `x.print()` goes on with x.",
    ),
    (
        "assert",
        "condition, message?",
        "Ends with the message if the condition does not hold, now or \
      whenever a param changes.",
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_function_is_described_once() {
        for entry in reference() {
            assert!(!entry.doc.is_empty(), "{} has no description", entry.name);
            assert!(
                !entry.signatures.is_empty(),
                "{} has no signature",
                entry.name
            );
        }
        for (index, (name, ..)) in DESCRIPTIONS.iter().enumerate() {
            assert!(vocabulary::get(name).is_some(), "{name} is no function");
            assert!(
                DESCRIPTIONS[index + 1..]
                    .iter()
                    .all(|(other, ..)| other != name),
                "{name}"
            );
        }
    }
}
