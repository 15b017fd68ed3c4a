//! Reference of the built-in functions, for `sdfc ops`: parameters and description. Functions that
//! are operations of the table take their description from there.

use super::arguments::signature;
use super::builtins::math::MATH;
use super::vocabulary::{self, BuiltinFunction};

/// A built-in function.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct FunctionDoc {
    /// Name in the scene language.
    pub name: &'static str,
    /// Parameters; a function with variants has one line for each.
    pub signatures: Vec<String>,
    /// Description in a few sentences.
    pub doc: String,
}

/// Returns all built-in functions, sorted by name.
pub fn function_docs() -> Vec<FunctionDoc> {
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
        BuiltinFunction::Typed { params, .. } => FunctionDoc {
            name,
            signatures: vec![signature(params)],
            doc: doc.unwrap_or_default(),
        },
        BuiltinFunction::Untyped { .. } => {
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
        "The shape rotated about an axis through the origin. The rotation is counterclockwise, seen from \
         the tip of the axis. Without an axis, it is about the axis that points up. Three angles `[a, b, \
         c]` rotate about x, then y, then z. A 2-D shape rotates in its plane.",
    ),
    (
        "rotate_quaternion",
        "",
        "The shape rotated by a quaternion `[x, y, z, w]` of any length.",
    ),
    (
        "scale",
        "",
        "The shape scaled by a factor, or by one factor for each axis. Under unequal factors, values are \
         exact distances if the result is another shape, such as a box. Otherwise they are those of the \
         shape times the smallest factor: offsets and blends act on these.",
    ),
    (
        "shear",
        "",
        "The shape sheared: x moves by `xy` per unit of y and by `xz` per unit of z, y by `yz` per unit \
         of z.",
    ),
    (
        "mirror",
        "",
        "The part of the shape on the positive side of a plane, and its mirror image. The plane is given \
         by one axis `mirror(X)`, by several axes `mirror([1, 0, 1])`, or by any normal. `at` is its \
         distance from the origin, along the normal. The part on the other side is not shown; `reflect` \
         moves a whole shape there.",
    ),
    (
        "reflect",
        "shape: shape, normal: direction, at?: length",
        "The mirror image of the shape in the plane with this normal. `at` is the distance of the plane \
         from the origin, along the normal. For two vectors, the first one reflected by the second.",
    ),
    (
        "repeat",
        "",
        "Copies of the shape, `spacing` apart along each axis (none where it is 0). They are infinitely \
         many, or `count`, centred at the origin. The shape is at most eight \
         times as long as its cell.",
    ),
    (
        "polar",
        "",
        "`n` copies of the shape about the axis that points up, or in the plane for a 2-D shape. The \
         first copy is the shape itself.",
    ),
    (
        "elongate",
        "",
        "The shape, cut through its middle, with its parts moved apart by a length along each axis.",
    ),
    (
        "twist",
        "",
        "The shape rotated about the axis that points up, by an angle per unit of height.",
    ),
    (
        "bend",
        "",
        "The shape bent upwards, by an angle per unit along x.",
    ),
    (
        "revolve",
        "",
        "The 2-D shape revolved around the axis that points up, with its y along that axis. `offset` \
         moves it away from the axis first. `angle` limits the revolution, symmetric about x.",
    ),
    ("section", "", "The 2-D section of a solid in a plane."),
    (
        "slice",
        "",
        "The part of a solid beyond a plane: on the side that the normal points to. `at` is the distance \
         of the plane from the origin, along the normal.",
    ),
    (
        "morph",
        "",
        "The interpolation between two shapes: the first at `t` = 0, the second at 1.",
    ),
    (
        "normalized",
        "",
        "The same surface with a distance as its value: the value divided by the length of its gradient. \
         It is exact at the surface and approximate near it. Offsets, shells and blends then act as they \
         do on shapes. Operands of unions, of `min` and of `max` are normalized separately. `reach` \
         limits the distance, for fields whose gradient is zero somewhere.",
    ),
    (
        "complement",
        "",
        "All points outside of the shape; also written `!shape`.",
    ),
    (
        "field",
        "",
        "The solid where a function of the point is negative, or a 2-D shape if the function is written \
         `fn(p: vec2)`. `lipschitz` states a bound on its slope, for a field of which none is \
         found. `within` cuts it to a box of this \
         size. Points where the function is not defined, as the root of a negative number, are outside. Set \
         operations and transforms depend on its sign alone. Offsets, blends, morphs and displacements use its values.",
    ),
    (
        "heightfield",
        "",
        "The solid below a height, within a rectangle and down to `base`. The height is a function of the \
         point on the ground (a vec2). By default, the base lies below the lowest height by a fiftieth of the \
         longer side.",
    ),
    (
        "displace",
        "",
        "The shape with its surface moved outwards by a function of the point.",
    ),
    (
        "warp",
        "",
        "The shape in a distorted space: its value at a point is that of the shape at the function of the \
         point.",
    ),
    (
        "polygon",
        "",
        "The inside of a closed polygon through points of the plane.",
    ),
    (
        "nothing",
        "",
        "An empty shape; a union with it changes nothing.",
    ),
    ("material", "", "The shape with a material."),
    (
        "color",
        "",
        "The shape with a color, or with a color that is a function of the point and the normal.",
    ),
    (
        "only",
        "",
        "Draws only this shape and other shapes with this mark.",
    ),
    (
        "ghost",
        "",
        "The shape, removed from all operations and drawn in a pale material.",
    ),
    ("hide", "", "The shape, removed from the scene."),
    (
        "noise",
        "",
        "Gradient noise at a point, on a lattice of the spacing 1. It is smooth and between -1 and 1.",
    ),
    (
        "fbm",
        "",
        "The sum of noise at several scales. Each octave has `gain` times the amplitude and `lacunarity` \
         times the frequency of the previous one. The amplitude of the first is 0.5.",
    ),
    (
        "ridge",
        "",
        "The sum of ridges, 1 - 2 * |noise|, at several scales, as in `fbm`.",
    ),
    ("len", "", "The number of elements of a list."),
    (
        "map",
        "",
        "The list of a function's results for each element.",
    ),
    ("filter", "", "The elements for which a function is true."),
    ("fold", "", "`f(f(start, first), second)` and so on."),
    ("sum", "", "The sum of a list's elements."),
    ("at", "", "An element of a list, counted from 0."),
    ("reverse", "", "The list in reverse order."),
    (
        "random",
        "",
        "A pseudo-random number from 0 to 1 that depends on `i` and `seed` alone.",
    ),
    (
        "union",
        "shapes.., smooth?: length, kernel?: word, chamfer?: length, fillet?: length, stairs?: length, n?: count",
        "The points in any of the shapes, or in any shape of a list; also written `a | b`, with a blend \
         `a |[0.2] b`.",
    ),
    (
        "intersect",
        "shapes.., with the blends of union",
        "The points in all of the shapes; also written `a & b`.",
    ),
    (
        "subtract",
        "shape, shapes.., with the blends of union",
        "The first shape without the others; also written `a - b`.",
    ),
    (
        "xor",
        "shapes..",
        "The points in an odd number of the shapes.",
    ),
    (
        "min",
        "values..",
        "The smallest of several values, or of the elements of a list or a vector.",
    ),
    (
        "max",
        "values..",
        "The largest of several values, or of the elements of a list or a vector.",
    ),
    (
        "pow",
        "a, b",
        "a to the power of b. Integer exponents also apply to negative numbers.",
    ),
    ("dot", "a, b", "The inner product of two vectors."),
    ("cross", "a, b", "The vector product of two vec3."),
    ("length", "v", "The length of a vector."),
    (
        "distance",
        "a, b",
        "The distance between two points. For a shape, `distance(shape)` is `normalized(shape)`.",
    ),
    (
        "normalize",
        "v",
        "The vector of length one in the same direction.",
    ),
    ("saturate", "x", "x clamped to 0 and 1."),
    ("radians", "x", "A number of degrees as an angle."),
    ("degrees", "angle", "An angle as a number of degrees."),
    ("fma", "a, b, c", "a * b + c"),
    ("asinh", "x", "The inverse hyperbolic sine."),
    ("acosh", "x", "The inverse hyperbolic cosine."),
    ("atanh", "x", "The inverse hyperbolic tangent."),
    (
        "vec2",
        "numbers and vectors..",
        "A vector of two numbers; a single number is used for both.",
    ),
    (
        "vec3",
        "numbers and vectors..",
        "A vector of three numbers; a single number is used for all.",
    ),
    (
        "vec4",
        "numbers and vectors..",
        "A vector of four numbers; a single number is used for all.",
    ),
    ("rgb", "r, g, b", "A color from linear red, green and blue."),
    (
        "hsv",
        "hue, saturation, value",
        "An sRGB color by its hue, which is an angle or a fraction of a turn.",
    ),
    (
        "list",
        "values..",
        "A list of the values, of the numbers of a range, or of the components of a vector.",
    ),
    (
        "concat",
        "lists..",
        "The elements of several lists in one list.",
    ),
    ("str", "values..", "The values as one text."),
    (
        "print",
        "values..",
        "Reports the values in the build's output; `x.print()` has the value x.",
    ),
    (
        "assert",
        "condition, message?",
        "Fails with the message if the condition is false, now or after a change of a parameter.",
    ),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_function_is_described_once() {
        for entry in function_docs() {
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
