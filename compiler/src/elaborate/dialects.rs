//! Words of other dialects: OpenSCAD, shading languages and game engines.

use sdfc_lang::missing_operation;

/// Equivalent of another dialect's word, if there is one, and a text that explains it.
type Advice = (Option<&'static str>, &'static str);

/// Returns the equivalent of another dialect's name, if there is one, and a text that explains it.
pub(crate) fn dialect_advice(name: &str) -> Option<Advice> {
    let replacement = |name: &'static str, text: &'static str| Some((Some(name), text));
    let advice = |text: &'static str| Some((None, text));
    match name {
        "cube" | "cuboid" | "sdBox" => replacement("box", "a box is called `box` here"),
        "square" | "rectangle" | "sdBox2d" => {
            replacement("rect", "a rectangle is called `rect` here")
        }
        "ball" | "sdSphere" => replacement("sphere", "a ball is called `sphere` here"),
        "disc" | "disk" | "sdCircle" => replacement("circle", "a disk is called `circle` here"),
        "sdTorus" | "donut" => replacement("torus", "a ring is called `torus` here"),
        "sdCapsule" | "pill" => replacement("capsule", "it is called `capsule` here"),
        "move" | "moved" | "at" | "opTranslate" | "shift" => {
            replacement("translate", "moving is called `translate` here")
        }
        "turn" | "rotated" | "opRotate" => replacement("rotate", "turning is called `rotate` here"),
        "rotateX" | "rotate_x" => advice("write `.rotate(angle, X)`"),
        "rotateY" | "rotate_y" => advice("write `.rotate(angle, Y)`"),
        "rotateZ" | "rotate_z" => advice("write `.rotate(angle, Z)`"),
        "opScale" | "resize" => replacement("scale", "it is called `scale` here"),
        "linear_extrude" | "opExtrusion" => replacement("extrude", "it is called `extrude` here"),
        "rotate_extrude" | "lathe" | "opRevolution" => {
            replacement("revolve", "it is called `revolve` here")
        }
        "opTwist" => replacement("twist", "it is called `twist` here"),
        "opCheapBend" => replacement("bend", "it is called `bend` here"),
        "opOnion" | "onion" | "hollow" => replacement("shell", "it is called `shell` here"),
        "opRound" | "inflate" => replacement("offset", "it is called `offset` here"),
        "opRepetition" | "opRep" | "tile" => replacement("repeat", "it is called `repeat` here"),
        "opElongate" => replacement("elongate", "it is called `elongate` here"),
        "opDisplace" => replacement("displace", "it is called `displace` here"),
        "difference" | "opSubtraction" | "cut" => replacement(
            "subtract",
            "it is called `subtract` here, or written `a - b`",
        ),
        "intersection" | "opIntersection" => replacement(
            "intersect",
            "it is called `intersect` here, or written `a & b`",
        ),
        "opUnion" | "group" => {
            replacement("union", "it is called `union` here, or written `a | b`")
        }
        "smin" | "smooth_union" | "opSmoothUnion" | "smoothUnion" => {
            advice("a smooth union is written `union(a, b, smooth: 0.2)`, or `a |[0.2] b`")
        }
        "smax" | "smooth_intersection" | "opSmoothIntersection" => {
            advice("a smooth intersection is written `a &[0.2] b`")
        }
        "smooth_subtraction" | "opSmoothSubtraction" => {
            advice("a smooth difference is written `a -[0.2] b`")
        }
        "fillet" | "rounded" | "roundover" => advice(
            "a shape rounds its own edges, `box(1, round: 0.1)`; a fillet between two shapes is `a |[fillet, 0.1] b`",
        ),
        "chamfer" | "bevel" => advice(
            "the edge between two shapes is chamfered by `a |[chamfer, 0.1] b`, `a -[chamfer, 0.1] b` or \
             `a &[chamfer, 0.1] b`",
        ),
        "line" | "sdSegment" | "sdLine" => {
            advice("a line has a thickness here: `capsule(from, to, r)`")
        }
        "paint" | "colour" | "colored" | "tint" => {
            replacement("color", "it is called `color` here")
        }
        "texture" => advice(
            "there are no pictures on surfaces: `shape.color(#c03020)`, or a color that is computed",
        ),
        "red" | "green" | "blue" | "white" | "black" | "gray" | "grey" | "yellow" | "orange"
        | "purple" | "brown" | "pink" | "cyan" | "magenta" | "gold" | "silver" => {
            advice("colors are numbers: `#c03020`, or `rgb(0.8, 0.2, 0.1)`")
        }
        "scatter" | "taper" | "text" | "image" | "path" | "bezier" | "polyline" | "mesh"
        | "helix" | "columns" | "pipe" | "engrave" | "groove" | "tongue" | "everything"
        | "tube" | "ellipse" | "trapezoid" | "parallelogram" | "arc" | "ring" | "pie"
        | "horseshoe" | "moon" | "egg" | "heart" | "cross" | "solid_angle" | "cut_sphere"
        | "death_star" | "vesica" | "quad" | "superellipsoid" | "dodecahedron" | "icosahedron"
        | "rhombus" | "stairs" => advice("it is planned, and not part of the language yet"),
        "None" | "null" | "nil" => advice("an empty shape is `nothing()`"),
        _ => missing_operation(name)
            .map(|text| (None, text))
            .or_else(|| number_advice(name)),
    }
}

/// Returns the equivalent of another dialect's name of a number, a vector or a color.
fn number_advice(name: &str) -> Option<Advice> {
    let replacement = |name: &'static str, text: &'static str| Some((Some(name), text));
    let advice = |text: &'static str| Some((None, text));
    match name {
        "vec" => advice("write `[x, y, z]`"),
        "float3" => replacement("vec3", "three numbers are a `vec3` here"),
        "float2" => replacement("vec2", "two numbers are a `vec2` here"),
        "mod" | "modulo" | "fmod" => advice("the remainder is written `a % b`"),
        "mat2" | "mat3" | "mat4" => advice(
            "there are no matrices: `shape.rotate(30deg, Y)` turns a shape, and `[dot(a, p), dot(b, p), dot(c, p)]` is \
             the product of the rows `a`, `b`, `c` and `p`",
        ),
        "float" => advice("every number is a float: leave the call out"),
        "int" => replacement("trunc", "the integer part is called `trunc` here"),
        "PI" => replacement("pi", "it is called `pi` here"),
        "TAU" | "two_pi" => replacement("tau", "it is called `tau` here"),
        "t" | "iTime" | "u_time" | "Time" => replacement("time", "the time is called `time` here"),
        "echo" => replacement("print", "it is called `print` here"),
        "lerp3" => replacement("mix", "it is called `mix` here"),
        _ => None,
    }
}

/// Returns the equivalent of another dialect's field in a kind of block, if there is one, and a text that explains it.
pub(crate) fn field_of_dialects(kind: &str, name: &str) -> Option<Advice> {
    let is_dir = matches!(name, "direction" | "dir" | "forward");
    let is_at = matches!(
        name,
        "position" | "pos" | "eye" | "origin" | "location" | "at"
    );
    match (kind, name) {
        ("camera", _) if is_at => Some((Some("from"), "the place of a camera is called `from`")),
        ("camera", "target" | "look_at" | "lookAt" | "lookat" | "center" | "centre" | "to") => {
            Some((Some("look"), "the point that it looks at is called `look`"))
        }
        ("camera", _) if is_dir => Some((
            None,
            "`look` is the point at the centre of the picture: the place of the camera plus the direction",
        )),
        ("camera", "fovy" | "field_of_view" | "angle") => {
            Some((Some("fov"), "the angle of view is called `fov`"))
        }
        ("camera", "ortho" | "orthographic" | "zoom" | "size") => Some((
            None,
            "parallel rays are written `height: 4`, the height of the picture in the scene's units",
        )),
        ("light", _) if is_at => Some((Some("at"), "the place of a light is called `at`")),
        ("light", _) if is_dir => {
            Some((Some("dir"), "the direction towards a light is called `dir`"))
        }
        ("light", "strength" | "power" | "energy" | "brightness") => {
            Some((Some("intensity"), "it is called `intensity` here"))
        }
        ("material", "albedo" | "diffuse" | "base_color" | "baseColor") => {
            Some((Some("color"), "it is called `color` here"))
        }
        ("material", "emissive" | "emit" | "glow") => {
            Some((Some("emission"), "it is called `emission` here"))
        }
        ("material", "metal" | "metalness") => {
            Some((Some("metallic"), "it is called `metallic` here"))
        }
        ("render", "samples" | "antialiasing" | "anti_aliasing") => Some((
            Some("aa"),
            "anti-aliasing is called `aa`: `aa: 2` takes 2 × 2 rays",
        )),
        ("render", "max_steps" | "iterations") => {
            Some((Some("steps"), "it is called `steps` here"))
        }
        ("render", "resolution") => Some((Some("size"), "it is called `size` here")),
        ("render", "max_distance" | "max_dist") => Some((Some("far"), "it is called `far` here")),
        _ => None,
    }
}
