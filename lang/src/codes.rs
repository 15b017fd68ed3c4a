//! Codes of all messages, with the pages of `sdfc explain CODE`. The messages are written where they are
//! reported.
//!
//! A row consists of a code, a title and a page of a few sentences with an example. It defines a constant
//! named like the code and a row of the table, so neither can be forgotten. New rows are added in order.
//!
//! `E` rows are errors, `W` rows warnings. The first two digits group them by subject:
//! - 00 files,
//! - 01 syntax,
//! - 02 names and imports,
//! - 03 types and units,
//! - 04 values,
//! - 05 the whole scene and its program.

use serde::Serialize;
use std::fmt;

/// Code of a message such as `E0101`, which is a row of this table.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct DiagnosticCode(&'static str);

impl DiagnosticCode {
    /// Returns the code as written.
    pub fn as_str(self) -> &'static str {
        self.0
    }
}

impl fmt::Display for DiagnosticCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0)
    }
}

impl fmt::Debug for DiagnosticCode {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0)
    }
}

/// Row of the table.
#[derive(Clone, Copy, Debug)]
pub struct CodeRow {
    /// Code in messages, such as `E0101`.
    pub code: DiagnosticCode,
    /// Subject, in a few words.
    pub title: &'static str,
    /// A few sentences with an example.
    pub page: &'static str,
}

macro_rules! codes {
    ($($name:ident $title:literal $page:literal;)*) => {
        $(#[doc = $title] pub const $name: DiagnosticCode = DiagnosticCode(stringify!($name));)*

        /// All codes, in order.
        pub const CODES: &[CodeRow] = &[
            $(CodeRow { code: $name, title: $title, page: $page },)*
        ];
    };
}

/// Returns the page of a code, or `None`. Case does not matter.
pub fn explain(code: &str) -> Option<&'static str> {
    row(code).map(|row| row.page)
}

/// Returns the row of a code, or `None`. Case does not matter.
pub fn row(code: &str) -> Option<&'static CodeRow> {
    CODES
        .iter()
        .find(|row| row.code.as_str().eq_ignore_ascii_case(code))
}

codes! {
E0001 "a source file that is too large" "\
A source file has at most 9.5 MiB. A scene of that size is usually generated. Split it into several
files and `import` them, or write a loop instead of its result.

    for i in 0..1000 { sphere(0.1).translate(i, 0, 0) }";

E0101 "something else was expected" "\
The text does not follow the grammar at this place. The message states what was found and what the
grammar allows there.

    let r = ;          // an expression is missing
    let r = 2;";

E0102 "a character outside of the language" "\
Outside of strings and comments, a scene is written in ASCII: letters, digits, `_` and the
operators. Characters that look alike (`×`, `−`, curly quotes) often come from a word processor.

    let r = 2 × 3;     // a multiplication sign
    let r = 2 * 3;";

E0103 "an unclosed string" "\
A string is written between double quotes, on one line. A line break in it is written `\\n`.

    import \"parts.sdf as p;
    import \"parts.sdf\" as p;";

E0104 "an unclosed comment" "\
A comment that begins with `/*` ends at the first `*/`. Comments do not nest.

    /* the base       // swallows the rest of the file
    /* the base */";

E0105 "a number that is too large" "\
Integers have 64 bits. Floats have double precision.

    let n = 99999999999999999999;
    let n = 1e20;";

E0106 "an unknown unit" "\
The letters directly after a number are its unit. Units are deg, turn and rad for angles, mm, cm, m
and in for lengths, s and ms for time.

    base.rotate(90degrees, X)
    base.rotate(90deg, X)";

E0107 "an invalid color" "\
A color is `#` and hexadecimal digits: three (`#rgb`, each digit doubled), six (`#rrggbb`), or eight
with the opacity last (`#rrggbbaa`).

    sphere(1).color(#12345)
    sphere(1).color(#123456)";

E0108 "an unknown escape" "\
A backslash in a string begins an escape. There are four: `\\n` line break, `\\t` tabulator, `\\\\`
backslash, `\\\"` quote.

    print(\"50\\% done\");
    print(\"50% done\");";

E0109 "nested too deeply" "\
Expressions nest at most 200 levels deep. Brackets, signs, `if`, `for` and lambdas each add a level.
Chains like `a | b | c` and `x.f().g()` add none, however long. To reduce the depth, give an inner
part a name.

    let inner = f(g(h(1)));
    f(g(inner))";

E0110 "an unclosed bracket" "\
A bracket was opened and not closed before the end of the statement, of the enclosing bracket, or of
the file.

    let a = sphere(1;
    let a = sphere(1);";

E0111 "a closing bracket without its opening one" "\
A closing bracket has no opening bracket, or one of another kind.

    let v = [1, 2, 3);
    let v = [1, 2, 3];";

E0112 "a missing `;`" "\
Every statement ends with `;`, except blocks and functions in braces. Only the last expression of a
file or a block has no `;`: it is the value.

    let r = 2
    sphere(r)

    let r = 2;
    sphere(r)";

E0113 "a missing `,`" "\
Commas separate arguments, elements of lists, and the settings of a block.

    box(1 2, 3)
    box(1, 2, 3)";

E0114 "an extra `;`" "\
Blocks and functions in braces end with their brace. Commas separate settings.

    camera { from: [0, 1, 5]; fov: 35deg };
    camera { from: [0, 1, 5], fov: 35deg }";

E0115 "a missing name" "\
Every definition needs a name. It consists of letters, digits and `_`, and does not begin with a
digit.

    let = sphere(1);
    let ball = sphere(1);";

E0116 "a reserved word as a name" "\
These words have a meaning in the language and cannot be names: let fn param part import as if else
for in by blend true false.

    let part = sphere(1);
    let piece = sphere(1);";

E0117 "an argument named with `=`" "\
A named argument and a setting are written with `:`. A `=` belongs to definitions only.

    cylinder(r = 1, h = 2)
    cylinder(r: 1, h: 2)";

E0118 "an argument without a name after a named one" "\
Arguments without names come first, named ones after them.

    cylinder(r: 1, 2)
    cylinder(r: 1, h: 2)";

E0119 "an operator that the language does not have" "\
The language has no `^` and no `**` (write `pow`, or `xor` for shapes), and no `?:` (write `if`). It
has no `++` and no `+=`, since the value of a name never changes.

    let a = r ^ 2;
    let a = pow(r, 2);

    let a = big ? 2 : 1;
    let a = if big { 2 } else { 1 };";

E0120 "`=` and `==` confused" "\
`=` gives a name its value. `==` compares two values.

    let a == 1;
    if a = 1 { b } else { c }

    let a = 1;
    if a == 1 { b } else { c }";

E0121 "a block or scene without a value" "\
The last expression of a block is its value, and the last expression of a file is the shape. A `;`
after it would discard the value.

    fn ball(r) { sphere(r); }
    fn ball(r) { sphere(r) }";

E0122 "an `if` without `else`" "\
An `if` is an expression. It needs a value for both cases.

    let n = if big { 2 };
    let n = if big { 2 } else { 1 };";

E0123 "a chain of comparisons" "\
A comparison has two sides. Join several comparisons by `&&`.

    if 0 < x < 1 { a } else { b }
    if 0 < x && x < 1 { a } else { b }";

E0124 "a parameter without a valid range" "\
The values of a parameter form a range: `a..b`, or `a..=b` for whole numbers that include b. `by`
states the step between them.

    param n = 3 in 6;
    param n = 3 in 1..=6;";

E0125 "an item inside a block" "\
`param`, `part`, `import` and named functions are written at the top level of a file. Blocks contain
`let` and lambdas only.

    fn f(x) { fn g(y) = y + 1; g(x) }
    fn f(x) { let g = fn(y) => y + 1; g(x) }";

E0126 "a word of another language" "\
`let` defines names, and `fn` defines functions. There is no `return`, since the last expression is
the value. There is no `while`, since the number of rounds of a loop must be known.

    const r = 2;
    let r = 2;";

E0127 "an import without a name" "\
An import chooses a name. The definitions of the imported file are written after that name.

    import \"parts.sdf\";
    import \"parts.sdf\" as parts;";

E0128 "a blend without a radius" "\
The brackets after an operator state the blend: a radius, with an optional kernel before it.

    a |[] b
    a |[0.2] b
    a |[chamfer, 0.2] b";

E0129 "a missing `:`" "\
A setting consists of a name, a `:` and a value.

    camera { from [0, 1, 5] }
    camera { from: [0, 1, 5] }";

E0130 "an index in brackets" "\
The language has no index in brackets. The components of a vector are fields. `for`, `map` and
`fold` read the elements of a list.

    let h = p[1];
    let h = p.y;";

E0131 "a lambda without `fn` or `=>`" "\
A function without a name is written `fn(…) => …`. Its body is an expression, or a block in braces.

    field(p => length(p) - 1)
    field(fn(p) { length(p) - 1 })

    field(fn(p) => length(p) - 1)
    field(fn(p) => { length(p) - 1 })";

E0132 "a list in parentheses" "\
Lists and vectors are written in brackets. Parentheses group expressions and enclose the arguments
of a call.

    sphere(1).translate((1, 2, 3))
    sphere(1).translate([1, 2, 3])";

E0133 "a transform before its shape" "\
A transform is called on its shape, after a dot, and several shapes are joined by operators. No
block of shapes follows a transform.

    translate([1, 2, 3]) box(1);
    difference() { box(2); sphere(1.2); }

    box(1).translate([1, 2, 3])
    box(2) - sphere(1.2)";

E0134 "a number that ends with a dot" "\
The dot of a number has digits after it. A dot after a number calls a function of that number.

    sphere(1.)
    sphere(1.0)";

E0201 "an unknown name" "\
No definition, parameter or function of this name stands before this place. A name is visible after
its definition. `sdfc ops` lists the functions of the language.

    let base = box(1);
    bse.translate(1, 0, 0)      // did you mean `base`?";

E0203 "an unknown argument" "\
The function has no argument of this name. The message lists its arguments. Round shapes take a
radius `r` or a diameter `d`.

    cylinder(radius: 1, h: 2)
    cylinder(r: 1, h: 2)";

E0204 "a missing argument" "\
The call, block or blend lacks a required value.

    cylinder(r: 1)
    cylinder(r: 1, h: 2)";

E0205 "too many arguments" "\
The call has more arguments than the function. An object before a dot is the first argument:
`x.f(a)` is `f(x, a)`.

    sphere(1, 2)
    sphere(1)";

E0206 "two values for one argument or field" "\
An argument or a field has two values. The compiler does not choose one of them.

    sphere(1, r: 2)
    sphere(r: 2)";

E0207 "an unknown block" "\
A block consists of a word, an optional name, and braces. The words are scene, camera, light,
material, sky, render, animate and record.

    lamp key { dir: [1, 2, 1] }
    light key { dir: [1, 2, 1] }";

E0208 "an unknown field" "\
The block has no setting of this name, or two of its settings exclude each other.

    camera { position: [0, 1, 5] }
    camera { from: [0, 1, 5] }";

E0209 "a private name" "\
Names that begin with `_` are private to their file. Files that import it cannot use them.

    parts::_helper()";

E0210 "a file that cannot be imported" "\
The path is relative to the file that contains the `import`, and includes the extension. Paths that
begin with `std/` name the library of the language.

    import \"parts/bolt.sdf\" as bolt;
    import \"std/fasteners\" as fast;";

E0211 "files that import each other" "\
A file cannot import itself, neither directly nor through other files. Move the definitions that
both need to a third file.

    // a.sdf
    import \"b.sdf\" as b;
    // b.sdf
    import \"a.sdf\" as a;";

E0212 "an import from outside" "\
A scene reads only files in its own folder and in folders below it. Therefore a scene from an
unknown source cannot read private files.

    import \"../../secret.sdf\" as s;
    import \"parts/bolt.sdf\" as bolt;";

E0213 "a name that is not defined yet" "\
A name is visible after its definition. A function may be called before its definition, but the
names that its body reads must be defined before the function.

    let a = b + 1;
    let b = 2;";

E0214 "a name that is taken" "\
Parameters, parts, cameras and single blocks are selected from outside by their names. Therefore
each name may occur only once.

    part lid = box(1);
    part lid = box(2);";

E0215 "an unknown parameter" "\
A value was given for a parameter that the scene does not declare.

    param goo = 0.3 in 0..1;    // -p goo=0.5";

E0216 "an unknown type" "\
The types are float, int, bool, string, vec2, vec3, vec4, color, angle, length, time, shape2,
shape3, shape, material, list and function.

    fn f(r: double) -> shape3 = sphere(r);
    fn f(r: float) -> shape3 = sphere(r);";

E0301 "a value of the wrong type" "\
The value has another type than this place requires, such as a shape, a number or a color. Three
conversions are implicit. A list of shapes is a shape (their union), a list of numbers is a vector,
and a whole number is a number.

    sphere(\"1\")
    sphere(1)";

E0302 "operands that do not go together" "\
The operator does not apply to these two values. `|` unites shapes, `&` intersects them, and `-`
cuts one from the other. Arithmetic applies to numbers and vectors.

    sphere(1) + box(1)
    sphere(1) | box(1)";

E0303 "units that do not go together" "\
Lengths, angles and times cannot be added to each other. A function that takes one of them does not
accept another. A number without a unit combines with all of them, but is not an angle.

    10mm + 30deg
    sphere(r: 90deg)";

E0304 "2D and 3D mixed" "\
2-D shapes combine with 2-D shapes, and solids with solids. `extrude` and `revolve` make a solid of
a 2-D shape. `section` makes a 2-D shape of a solid.

    circle(1) | sphere(1)
    circle(1).extrude(0.1) | sphere(1)";

E0305 "a call of a value that is not a function" "\
Only functions can be called, with their arguments in parentheses after the name. A number, a shape
or a material takes no arguments.

    let r = 2;
    r(3)";

E0306 "an unknown field of a value" "\
Vectors have the components x, y, z and w, in any order and number. Colors have r, g and b. Records
have the fields of their definition. Calls of functions need parentheses.

    p.xq
    p.xzy
    shape.length()";

E0308 "a number that is not known while compiling" "\
Some numbers determine the structure of the scene: the rounds of a loop, the length of a list, the
corners of a polygon. They must be known while compiling. A `param` is allowed, and a change of it
compiles a new program. The `time` and the point are not allowed.

    for i in 0..time { sphere(1) }
    for i in 0..6 { sphere(1).translate(cos(time + i), 0, 0) }";

E0309 "a number that depends on the point" "\
The radius of a sphere is one number for the whole sphere. It may depend on a `param` or on the
`time`, but not on the point. A shape whose size depends on the point is a field.

    field(fn(p) => length(p) - (1 + 0.1 * sin(5 * p.x)))
    sphere(1).displace(fn(p) => 0.1 * sin(5 * p.x))";

E0311 "a vector of the wrong length" "\
A vector has three numbers in space and two in the plane. They are written in brackets or as
separate arguments. A size may also be one number for all sides.

    box(2, 1)
    box(2, 1, 1)
    box([2, 1, 1])";

E0312 "an angle without a unit" "\
A number without a unit could be in degrees or in radians. An angle needs its unit: `deg`, `rad` or
`turn`. A number times an angle is an angle.

    box(1).rotate(90, X)
    box(1).rotate(90deg, X)
    box(1).rotate(n * 1deg, X)";

E0401 "a number that is not allowed" "\
Radii and sizes are greater than zero, counts are whole numbers, and factors are not zero. The
message states the wrong value and the allowed ones.

    sphere(0)
    sphere(0.1)";

E0402 "a division by zero" "\
The divisor is always zero. (A divisor that depends on a parameter may become zero; the result is
then very large.)

    let step = 1 / (n - n);";

E0403 "a number that is not finite" "\
A calculation has an infinite or undefined result, or a shape has a number above 1e18. The limit
keeps squares within the range of `f32`.

    sphere(1e30)";

E0405 "a shape or direction that is degenerate" "\
A direction must not have the length zero. A cylinder needs two different ends, a polygon three corners,
and a camera a target that is not its own position.

    cylinder(from: [0, 1, 0], to: [0, 1, 0], r: 0.1)
    cylinder(from: [0, 0, 0], to: [0, 1, 0], r: 0.1)";

E0406 "an assertion that fails" "\
The scene states a condition by `assert`, and the condition is false.

    assert(width > bolts * 12mm, \"the bolts would overlap\");";

E0407 "a parameter outside of its range" "\
The value of a parameter, in the text or on the command line, is outside of its range.

    param goo = 1.5 in 0..1;
    param goo = 0.5 in 0..1;";

E0408 "endless recursion" "\
Calls of functions nest at most 256 deep. A recursion needs a condition that ends it.

    fn tower(n) = if n == 0 { nothing() } else { box(1) | tower(n - 1).translate(0, 1, 0) };";

E0409 "too much work" "\
The evaluation of the scene took more than five million steps. The operations `repeat`, `polar` and
`mirror` make copies without such steps.

    sphere(0.1).repeat(1)        // endless copies, one sphere";

E0410 "a list that is too short" "\
Elements are counted from 0. The last element of a list of three is number 2.

    at([4, 5, 6], 3)
    at([4, 5, 6], 2)";

E0411 "copies that overlap too far" "\
`repeat` evaluates every copy that may be the nearest one at a point. This is one copy for a shape
that is symmetric in its cell. For another shape that fits into its cell it is two copies along each
axis, and more where copies overlap. A shape is at most eight times as long as its cell, and at most
125 copies are evaluated. An infinite shape has no copies: intersect it with its cell first.

    gyroid(cell: 1, thickness: 0.1).repeat(4)
    (gyroid(cell: 1, thickness: 0.1) & box(3)).repeat(4)";

E0412 "a loop that is too long" "\
A loop has at most 100,000 rounds.

    for i in 0..1000000000 { sphere(1) }
    sphere(1).repeat(3)";

E0413 "shapes nested too deeply" "\
Shapes nest at most 500 levels deep: each transform and each operation adds a level. A list adds no
level per element.

    fold(0..1000, sphere(1), fn(a, i) => (a |[0.1] sphere(1)).translate(0, 1, 0))
    union(for i in 0..1000 { sphere(1).translate(0, i, 0) }, smooth: 0.1)";

E0414 "too many shapes" "\
A scene has at most 400,000 shapes, including transforms. `repeat`, `polar` and `mirror` make copies
without additional shapes.

    box(1).repeat(2)";

E0415 "no memory to evaluate" "\
The evaluation needs a separate stack, and the system refused the memory. Close other programs, or
allow the process more memory.

    ulimit -v unlimited";

E0501 "a limit of the program" "\
Limits keep programs safe on every device: 250,000 instructions, 64 values on the stack, 256 slots,
and 16 nested points. The message states the number and its limit. Deep nesting exceeds the limits
of the stack and of points; a flat `union(list)` of many shapes does not.

    a - (b - (c - (d - e)))    // deep
    union(list)                // flat, however long";

E0502 "nothing to draw" "\
A file without an expression at its end is a library: it provides functions and parts. To draw it,
end it with a shape, or choose a part by its name.

    let a = sphere(1);

    let a = sphere(1);
    a";

E0503 "an unknown part" "\
Parts are the outputs of a file that `part` names.

    part gasket = box(1);    // --part gasket";

E0504 "a value that is not allowed" "\
A number that depends on parameters or on the time has an invalid value: a radius is zero, for
example. Restrict the range of the parameter.

    param r = 0.5 in 0..1;        // sphere(r) fails at r = 0
    param r = 0.5 in 0.01..1;";

E0505 "an invalid clause" "\
In `.vm` files, each line is a clause. It consists of a name, an operation, and the names of earlier
clauses (or a number after `const`).

    _0 var-x
    _1 const 0.5
    _2 sub _0 _1";

W0101 "`-` mixed with `|` or `&`" "\
`-` binds tighter than `&`, and `&` tighter than `|`. So `a | b - c` is `a | (b - c)`: the hole is
cut from `b` only. Write parentheses to state the intended order.

    (a | b) - c        // cut from both
    a | (b - c)        // cut from b";

W0102 "a value that is not used" "\
The value of an expression with a `;` after it is discarded. Only `assert` and `print` have an
effect. A visible shape must be part of the last expression of the file.

    sphere(1);
    box(1)

    sphere(1) | box(1)";

W0201 "a name that is not used" "\
A definition is never read. Begin its name with `_` if this is intended.

    let _old = box(1);
    sphere(1)";

W0401 "a blend larger than a shape" "\
A blend whose thickness exceeds the size of an operand swallows that operand. The thickness is in
scene units; check the unit.

    sphere(0.1) |[5] box(0.1)
    sphere(0.1) |[0.05] box(0.1)";

W0402 "a shape that is never seen" "\
A cutter does not touch the body that it cuts, or an intersection is empty. Check the positions of
the shapes. A field without negative values, such as `abs(d)` or `d * d`, is also never seen, since
a surface is where the sign changes. Such a sheet needs a thickness: `abs(d) - 0.01`.

    box(1) - sphere(0.2).translate(5, 0, 0)
    box(1) - sphere(0.2).translate(0.5, 0, 0)";

W0404 "a shape behind its mirror" "\
`mirror` shows the part of a shape on the side of a plane that its vector points to, and the mirror
image of that part. The part on the other side is not shown.

    sphere(1).translate(-3, 0, 0).mirror(X)
    sphere(1).translate(-3, 0, 0).mirror(-X)";

W0405 "a seam where parts touch" "\
Where two parts touch, the field is zero deep inside the solid. An inset, a shell or the fillet of a
cutter treats these zeros as the surface. It cuts along the seam, or builds a wall there. Parts that
overlap by twice the width have no such seam, and neither has one shape of the same outline. If the
compiler proves that parts are flush, it removes the seam and reports nothing.

    let a = cylinder(r: 1, h: 1) | cone(r1: 1, r2: 0.5, h: 1).translate(0, 1, 0);
    a.shell(0.2)

    let a = polygon([[0, -0.5], [1, -0.5], [1, 0.5], [0.5, 1.5], [0, 1.5]]).revolve();
    a.shell(0.2)";

W0406 "a shape that is stretched too far" "\
Distances of a shape that is scaled by unequal factors are multiplied by the smallest one, unless the
scaled shape is a shape of the language itself. If one factor is a thousandth of another, what is left
is less than the rounding of `f32` where the shape is thin. Its edge may be missing there, or have holes.

    torus(1, 0.3).scale([1, 1e-5, 1])
    (circle(1.3) - circle(0.7)).extrude(1e-5)";

W0501 "a slope that cannot be bounded" "\
Each field is divided by a bound on its slope, so that no step of a ray crosses a surface. Near a
pole (a division by a value that reaches zero, a root at zero) there is no bound, nor is there one in
all of space for an exponential. Rays on a GPU may then step over the surface. The CPU bounds the
slope piece by piece, except beside the pole. A slope above 1e15 counts as unbounded. The root or the
logarithm of both sides of the equation gives the same surface with a smaller slope. Discontinuous
fields (`floor`, `%`, `if`) are marched piece by piece and need no bound. Exceptions are pieces with
poles, and pieces under blends and offsets that depend on live parameters.

    field(fn(p) => length(p) * sqrt(abs(p.x)) - 1)
    field(fn(p) => length(p) * sqrt(max(abs(p.x), 0.01)) - 1)
    field(fn(p) => length(p) * sqrt(abs(p.x)) - 1, lipschitz: 16)";

W0502 "a stated slope that does not hold" "\
At a sampled point, the slope of the field is greater than its `lipschitz` value. With that value,
rays would step over surfaces. Therefore the compiler ignores it and computes a bound itself, as it
does without `lipschitz`. State a bound only for a field without a computed one.

    field(fn(p) => dot(p, p) - 1, lipschitz: 1)
    field(fn(p) => dot(p, p) - 1)";

W0503 "a solid without an end in a `.vm` file" "\
The field of a `.vm` file is negative at the faces of all boxes that were tried, up to 16 units from
the origin. The picture shows the part of the solid in a box. A scene that imports the file has all
of the solid, and can cut any piece of it.

    import \"gyroid.vm\" as gyroid;
    gyroid & box(12)";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_in_order_and_have_text() {
        for letter in ["E", "W"] {
            let codes = CODES.iter().map(|row| row.code.as_str());
            let codes: Vec<_> = codes.filter(|code| code.starts_with(letter)).collect();
            assert!(codes.is_sorted_by(|a, b| a < b), "{codes:?}");
        }
        for row in CODES {
            let code = row.code.as_str();
            assert_eq!(code.len(), 5, "{code}");
            assert!(row.page.len() > 80, "{code} deserves a page");
            assert!(row.page.contains("\n    "), "{code} deserves an example");
            assert!(!row.title.ends_with('.'), "{code}");
        }
    }

    #[test]
    fn a_code_explains_itself_in_any_case() {
        assert!(explain("w0101").is_some_and(|page| page.contains("a | (b - c)")));
        assert_eq!(explain("E9999"), None);
    }
}
