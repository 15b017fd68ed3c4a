//! Codes of all messages, with the pages of `sdfc explain CODE`.
//!
//! A row consists of a code, a title and a page of a few sentences with an example. It defines a constant
//! named like the code and a row of the table, so neither can be forgotten. New rows are added in order.
//!
//! `E` rows are errors, `W` rows warnings. The first two digits are the stage that reports it: 00 files, 01
//! syntax, 02 names, 03 types and units, 04 evaluation, 05 limits of the program.

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
    /// Code.
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
A source file may have 9.5 MiB. A scene of that size is made by a program; let it write several
files and `import` them, or a loop instead of its result.

    for i in 0..1000 { sphere(0.1).translate(i, 0, 0) }";

E0101 "something else was expected" "\
The text does not follow the grammar at this place. The message says what was found and what kind
of thing may stand there.

    let r = ;          // an expression is missing
    let r = 2;";

E0102 "a character that means nothing" "\
Outside of strings and comments a scene is written in ASCII: letters, digits, `_` and the
operators. Characters that look alike (`×`, `−`, curly quotes) often come from a word processor.

    let r = 2 × 3;     // a multiplication sign
    let r = 2 * 3;";

E0103 "a string that never ends" "\
A string stands between double quotes on one line. A line break in it is written `\\n`.

    import \"parts.sdf as p;
    import \"parts.sdf\" as p;";

E0104 "a comment that never ends" "\
A comment that was opened with `/*` goes on until the first `*/`; they do not nest.

    /* the base       // swallows the rest of the file
    /* the base */";

E0105 "a number that is too large" "\
Integers have 64 bits, floats are those of double precision.

    let n = 99999999999999999999;
    let n = 1e20;";

E0106 "an unknown unit" "\
Letters right behind a number are its unit: deg, turn and rad for angles, mm, cm, m and in for
lengths, s and ms for time.

    base.rotate(90degrees, X)
    base.rotate(90deg, X)";

E0107 "a colour that is none" "\
A colour is `#` and hexadecimal digits: three (`#rgb`, each digit doubled), six (`#rrggbb`), or eight
with the opacity last (`#rrggbbaa`).

    sphere(1).color(#12345)
    sphere(1).color(#123456)";

E0108 "an unknown escape" "\
A backslash in a string begins an escape. There are four: `\\n` line break, `\\t` tabulator, `\\\\`
backslash, `\\\"` quote.

    print(\"50\\% done\");
    print(\"50% done\");";

E0109 "nested too deeply" "\
Expressions may stand in each other 200 levels deep; brackets, signs, `if`, `for` and lambdas each
make a level, chains like `a | b | c` and `x.f().g()` do not, however long. Inner parts can be given
a name.

    let inner = f(g(h(1)));
    f(g(inner))";

E0110 "an unclosed bracket" "\
A bracket was opened and not closed before the statement, the enclosing bracket or the file ended.

    let a = sphere(1;
    let a = sphere(1);";

E0111 "a closing bracket that fits nothing" "\
A bracket closes one that was not opened, or one of another kind.

    let v = [1, 2, 3);
    let v = [1, 2, 3];";

E0112 "a missing `;`" "\
Every statement but blocks and functions in braces ends with `;`. Only the last expression of a file
or a block has none: it is the value.

    let r = 2
    sphere(r)

    let r = 2;
    sphere(r)";

E0113 "a missing `,`" "\
Arguments, elements of lists, and the settings of a block are separated by commas.

    box(1 2, 3)
    box(1, 2, 3)";

E0114 "a `;` too many" "\
Blocks and functions in braces end with their brace, and settings are separated by commas.

    camera { from: [0, 1, 5]; fov: 35deg };
    camera { from: [0, 1, 5], fov: 35deg }";

E0115 "a missing name" "\
What is introduced needs a name: letters, digits and `_`, not beginning with a digit.

    let = sphere(1);
    let ball = sphere(1);";

E0116 "a reserved word as a name" "\
These words have a meaning of their own and cannot be names: let fn param part import as if else
for in by blend true false.

    let part = sphere(1);
    let piece = sphere(1);";

E0117 "an argument named with `=`" "\
A named argument and a setting are written with `:`. A `=` stands only where something is
introduced.

    cylinder(r = 1, h = 2)
    cylinder(r: 1, h: 2)";

E0118 "an argument without a name after a named one" "\
Arguments are given by position first and by name after that.

    cylinder(r: 1, 2)
    cylinder(r: 1, h: 2)";

E0119 "an operator that the language does not have" "\
There is no `^` and no `**` (write `pow`, or `xor` for shapes), no `?:` (write `if`), no `++` and no
`+=` (names never change).

    let a = r ^ 2;
    let a = pow(r, 2);

    let a = big ? 2 : 1;
    let a = if big { 2 } else { 1 };";

E0120 "`=` and `==` confused" "\
`=` gives a name its value, `==` compares.

    let a == 1;
    if a = 1 { b } else { c }

    let a = 1;
    if a == 1 { b } else { c }";

E0121 "a block or scene without a value" "\
The last expression of a block is its value, and the last expression of a file is the shape. A `;`
behind it would drop it.

    fn ball(r) { sphere(r); }
    fn ball(r) { sphere(r) }";

E0122 "an `if` without `else`" "\
An `if` is an expression and has a value either way.

    let n = if big { 2 };
    let n = if big { 2 } else { 1 };";

E0123 "a chain of comparisons" "\
A comparison has two sides. Several are joined by `&&`.

    if 0 < x < 1 { a } else { b }
    if 0 < x && x < 1 { a } else { b }";

E0124 "a parameter's values that are no range" "\
The values that a parameter may take are a range: `a..b`, or `a..=b` for whole numbers up to and with
b; `by` says how far apart they are.

    param n = 3 in 6;
    param n = 3 in 1..=6;";

E0125 "an item inside a block" "\
`param`, `part`, `import` and functions with a name stand at the top level of a file. Inside of
blocks there are `let` and lambdas.

    fn f(x) { fn g(y) = y + 1; g(x) }
    fn f(x) { let g = fn(y) => y + 1; g(x) }";

E0126 "a word of another language" "\
Names are introduced by `let`, functions by `fn`; there is no `return`, since the last expression is
the value, and no `while`, since a loop has a known number of rounds.

    const r = 2;
    let r = 2;";

E0127 "an import without a name" "\
What a file exports is reached through a name that the import chooses.

    import \"parts.sdf\";
    import \"parts.sdf\" as parts;";

E0128 "a blend without a radius" "\
The brackets behind an operator say how it blends: a radius, perhaps a kernel before it.

    a |[] b
    a |[0.2] b
    a |[chamfer, 0.2] b";

E0129 "a missing `:`" "\
A setting is a name, a `:` and a value.

    camera { from [0, 1, 5] }
    camera { from: [0, 1, 5] }";

E0130 "an index" "\
Nothing is indexed with brackets. A vector's components are fields, and lists are gone through with
`for`, `map` and `fold`.

    let h = p[1];
    let h = p.y;";

E0131 "a lambda without `fn`" "\
A function without a name begins with `fn`.

    field(p => length(p) - 1)
    field(fn(p) => length(p) - 1)";

E0132 "a list in parentheses" "\
Lists and vectors stand in brackets. Parentheses group, and hold the arguments of a call.

    sphere(1).translate((1, 2, 3))
    sphere(1).translate([1, 2, 3])";

E0201 "an unknown name" "\
No definition, parameter or function of this name stands before this place. Names hold from their
definition on; the functions of the language are listed by `sdfc ops`.

    let base = box(1);
    bse.translate(1, 0, 0)      // did you mean `base`?";

E0203 "an unknown argument" "\
The function has no argument of this name. The message lists those that it has. Round things take a
radius `r` or a diameter `d`.

    cylinder(radius: 1, h: 2)
    cylinder(r: 1, h: 2)";

E0204 "a missing argument" "\
The function, block or blend needs something that was not given.

    cylinder(r: 1)
    cylinder(r: 1, h: 2)";

E0205 "too many arguments" "\
The function takes fewer arguments than were given. An object before a dot counts as the first one:
`x.f(a)` is `f(x, a)`.

    sphere(1, 2)
    sphere(1)";

E0206 "given twice" "\
An argument or a field has two values; which one counts would be a guess.

    sphere(1, r: 2)
    sphere(r: 2)";

E0207 "an unknown block" "\
A word, perhaps a name, and braces make a block: scene, camera, light, material, sky, render, animate
or record.

    lamp key { dir: [1, 2, 1] }
    light key { dir: [1, 2, 1] }";

E0208 "an unknown field" "\
The block has no setting of this name, or one that does not go with another.

    camera { position: [0, 1, 5] }
    camera { from: [0, 1, 5] }";

E0209 "a private name" "\
Names that start with `_` are for the file that defines them, and cannot be reached from files that
import it.

    parts::_helper()";

E0210 "a file that cannot be imported" "\
The path is relative to the file that the `import` stands in, and has its ending; paths that start
with `std/` name the library that comes with the language.

    import \"parts/bolt.sdf\" as bolt;
    import \"std/fasteners\" as fast;";

E0211 "files that import each other" "\
A file cannot import itself, not even by way of others. What both need belongs into a third file.

    // a.sdf
    import \"b.sdf\" as b;
    // b.sdf
    import \"a.sdf\" as a;";

E0212 "an import from outside" "\
A scene reads only files in its own folder and in folders below it, so that a scene from elsewhere
cannot read what it should not.

    import \"../../secret.sdf\" as s;
    import \"parts/bolt.sdf\" as bolt;";

E0213 "a name that is not defined yet" "\
Definitions hold from top to bottom. A function may be called before it is defined, but what its body
reads must stand before the function.

    let a = b + 1;
    let b = 2;";

E0214 "a name that is taken" "\
Parameters, parts, cameras and single blocks are told apart from outside by their names, so there can
be only one of each.

    part lid = box(1);
    part lid = box(2);";

E0215 "an unknown param" "\
The value given from outside is for a parameter that the scene does not declare.

    param goo = 0.3 in 0..1;    // -p goo=0.5";

E0216 "an unknown type" "\
The types are float, int, bool, string, vec2, vec3, vec4, color, angle, length, time, shape2, shape3,
shape, material, list and function.

    fn f(r: double) -> shape3 = sphere(r);
    fn f(r: float) -> shape3 = sphere(r);";

E0301 "a value of the wrong type" "\
Something else is wanted here: a shape, a number, a color. A list of shapes is a shape (their union),
a list of numbers is a vector, and a whole number is a number; nothing else is converted.

    sphere(\"1\")
    sphere(1)";

E0302 "operands that do not go together" "\
The operator does not apply to these two values. Shapes are joined by `|`, intersected by `&` and cut
by `-`; numbers and vectors are calculated with.

    sphere(1) + box(1)
    sphere(1) | box(1)";

E0303 "units that do not go together" "\
Lengths, angles and times are different things: they cannot be added to each other, and a function
that wants one does not take another. A bare number goes with all of them, but is no angle.

    10mm + 30deg
    sphere(r: 90deg)";

E0304 "2D and 3D mixed" "\
Figures in the plane combine with figures, solids with solids. `extrude` and `revolve` make a solid of
a figure, `section` a figure of a solid.

    circle(1) | sphere(1)
    circle(1).extrude(0.1) | sphere(1)";

E0305 "something that cannot be called" "\
Only functions are called, with their arguments in parentheses behind the name; a number, a shape or a
material is used as it is.

    let r = 2;
    r(3)";

E0306 "an unknown field of a value" "\
Vectors have the components x, y, z and w, in any order and number; colors have r, g and b; records
have the fields they were given. Functions are called with parentheses.

    p.xq
    p.xzy
    shape.length()";

E0308 "a number that is needed too early" "\
Some numbers decide what the scene is made of: how often a loop runs, how long a list is, how many
corners a polygon has. They must be known while compiling. A `param` may be one (a change of it then
makes a new program); the `time` and the point may not.

    for i in 0..time { sphere(1) }
    for i in 0..6 { sphere(1).translate(cos(time + i), 0, 0) }";

E0309 "a number that is known too late" "\
The radius of a sphere is one number for the whole sphere: it may follow a `param` or the `time`, but
not the point. A shape whose size depends on the point is a field.

    field(fn(p) => length(p) - (1 + 0.1 * sin(5 * p.x)))
    sphere(1).displace(fn(p) => 0.1 * sin(5 * p.x))";

E0311 "a vector of the wrong length" "\
A vector in space has three numbers and one in the plane has two, given in brackets or one after the
other. A size may also be one number for all sides.

    box(2, 1)
    box(2, 1, 1)
    box([2, 1, 1])";

E0312 "an angle without a unit" "\
A bare number could be degrees or radians. An angle says which: `deg`, `rad` or `turn`. A number
becomes an angle when it is multiplied by one.

    box(1).rotate(90, X)
    box(1).rotate(90deg, X)
    box(1).rotate(n * 1deg, X)";

E0401 "a number that is not allowed" "\
Radii and sizes are larger than zero, counts are whole, factors are not zero. What is wrong, and what
is allowed, is in the message.

    sphere(0)
    sphere(0.1)";

E0402 "a division by zero" "\
The divisor is zero, always. (A divisor that follows a parameter may pass through zero; the result is
then very large.)

    let step = 1 / (n - n);";

E0403 "a number that is not finite" "\
A calculation gave infinity or no number at all, or a shape has a number beyond 1e18, whose square no
device can hold.

    sphere(1e30)";

E0405 "a shape or direction that is degenerate" "\
A direction needs a length, a line two ends, a polygon three corners, a camera something to look at.

    capsule(from: [0, 1, 0], to: [0, 1, 0], r: 0.1)
    capsule(from: [0, 0, 0], to: [0, 1, 0], r: 0.1)";

E0406 "an assertion that fails" "\
The scene says by `assert` what must hold, and it does not.

    assert(width > bolts * 12mm, \"the bolts would overlap\");";

E0407 "a param outside its range" "\
The value of a parameter, in the text or given from outside, is not one that it may take.

    param goo = 1.5 in 0..1;
    param goo = 0.5 in 0..1;";

E0408 "calls without end" "\
Functions call each other more than 256 deep. A recursion needs a condition that ends it.

    fn tower(n) = if n == 0 { nothing() } else { box(1) | tower(n - 1).translate(0, 1, 0) };";

E0409 "too much work" "\
Building the scene took more than five million steps. Repetition that the program does for itself
costs nothing: `repeat`, `polar`, `mirror`.

    sphere(0.1).repeat(1)        // endless copies, one sphere";

E0410 "a list that is too short" "\
Elements are counted from 0, so the last one of a list of three is number 2.

    at([4, 5, 6], 3)
    at([4, 5, 6], 2)";

E0411 "copies that overlap too far" "\
`repeat` evaluates all copies that may be the nearest one of a point: one for a shape that is even in its
cell, two along each axis for another one that fits, more where copies overlap. A shape may be eight times
as long as its cell, and at most 125 copies are evaluated. A shape without end has no copies; cut it to its
cell first.

    gyroid(cell: 1, thickness: 0.1).repeat(4)
    (gyroid(cell: 1, thickness: 0.1) & box(3)).repeat(4)";

E0412 "a loop that is too long" "\
A loop may have 100,000 rounds.

    for i in 0..1000000000 { sphere(1) }
    sphere(1).repeat(3)";

E0413 "shapes nested too deeply" "\
A shape may be made of shapes that are made of shapes, 500 times over. A list does not nest.

    fold(0..1000, sphere(1), fn(a, i) => (a |[0.1] sphere(1)).translate(0, 1, 0))
    union(for i in 0..1000 { sphere(1).translate(0, i, 0) }, smooth: 0.1)";

E0414 "too many shapes" "\
A scene has at most 400,000 shapes, transforms included. `repeat`, `polar` and `mirror` make copies
without making shapes.

    box(1).repeat(2)";

E0415 "no memory to evaluate" "\
Evaluation runs with a stack of its own, and the system did not grant it. Close something, or allow
the process more memory.

    ulimit -v unlimited";

E0501 "a limit of the program" "\
Programs have limits that keep them safe on every device: 250,000 instructions, 64 values on the
stack, 256 values kept, 16 points inside each other. The message has both numbers. A scene passes
them by nesting; a flat `union(list)` is the way to many shapes.

    a - (b - (c - (d - e)))    // deep
    union(list)                // flat, however long";

E0502 "nothing to draw" "\
A file that ends without an expression is a library: it gives functions and parts to others. To be
drawn it ends with a shape, or a part is chosen by name.

    let a = sphere(1);

    let a = sphere(1);
    a";

E0503 "an unknown part" "\
Parts are the outputs that a file names with `part`.

    part gasket = box(1);    // --part gasket";

E0504 "a value that is not allowed" "\
A number that follows parameters or the time has left the range in which the scene means something:
a radius became zero, say. The range of the parameter can keep it out.

    param r = 0.5 in 0..1;        // sphere(r) fails at r = 0
    param r = 0.5 in 0.01..1;";

E0505 "a clause that means nothing" "\
In `.vm` files each line is a clause: a name, an operation, and the names of earlier clauses (or a
number behind `const`).

    _0 var-x
    _1 const 0.5
    _2 sub _0 _1";

W0101 "`-` mixed with `|` or `&`" "\
`-` binds tighter than `&`, and `&` tighter than `|`, so `a | b - c` is `a | (b - c)`: the hole is
cut from `b` only. Parentheses say which was meant.

    (a | b) - c        // cut from both
    a | (b - c)        // cut from b";

W0102 "a value that is not used" "\
An expression with a `;` behind it is thrown away; only `assert` and `print` do something. A shape
that is to be seen belongs into the file's last expression.

    sphere(1);
    box(1)

    sphere(1) | box(1)";

W0201 "a name that is not used" "\
Something is defined and never read. A name that starts with `_` says that this is meant.

    let _old = box(1);
    sphere(1)";

W0401 "a blend larger than a shape" "\
A blend as thick as a shape it joins swallows the shape. The thickness is in scene units; perhaps
another unit was meant.

    sphere(0.1) |[5] box(0.1)
    sphere(0.1) |[0.05] box(0.1)";

W0402 "a shape that is never seen" "\
A shape is cut away where there is nothing to cut, or intersected with one that it does not touch.
Perhaps it is somewhere else than was meant. Or a field is below zero nowhere, as `abs(d)` and `d * d`: a surface is
where the sign changes, so such a sheet needs some thickness, `abs(d) - 0.01`.

    box(1) - sphere(0.2).translate(5, 0, 0)
    box(1) - sphere(0.2).translate(0.5, 0, 0)";

W0404 "a shape behind its mirror" "\
`mirror` shows what lies in front of a plane, on the side that its vector points to, on both sides.
What lies behind the plane is left out.

    sphere(1).translate(-3, 0, 0).mirror(X)
    sphere(1).translate(-3, 0, 0).mirror(-X)";

W0405 "a seam where parts touch" "\
Where two parts touch, the field is zero deep inside the solid. An inset, a shell or the fillet of a cutter takes that
for the surface, and cuts along the seam, or puts a wall there. Parts that overlap by twice the width show no seam; one
shape of the same outline has none at all. Unions that are known to be flush are mended without a word.

    let a = cylinder(r: 1, h: 1) | cone(r1: 1, r2: 0.5, h: 1).translate(0, 1, 0);
    a.shell(0.2)

    let a = polygon([[0, -0.5], [1, -0.5], [1, 0.5], [0.5, 1.5], [0, 1.5]]).revolve();
    a.shell(0.2)";

W0501 "a slope that cannot be bounded" "\
A ray is safe on a field because the field changes no faster than the ray moves, after division by a
bound on its slope. Near a pole (a division by something that reaches zero, a root at zero) there is
no bound, and rays may step over the surface. Where the slope is greater than 1e15 no step can be told from
it. A root or a logarithm of both sides has the same surface.
Fields that jump by `floor`, `%` or `if` are marched piece by piece and need no bound, but where pieces have poles, or
where blends and offsets of them follow live parameters.

    field(fn(p) => 1 / p.x - 1)
    field(fn(p) => 1 / max(p.x, 0.1) - 1)
    field(fn(p) => 1 / p.x - 1, lipschitz: 4)";

W0502 "a stated slope that does not hold" "\
A field was tried at some points, and rises faster at one of them than `lipschitz` says. By that bound rays
would step over surfaces, so it is left aside and one is found instead. Without `lipschitz` that is done
always; state a bound only where none is found.

    field(fn(p) => dot(p, p) - 1, lipschitz: 1)
    field(fn(p) => dot(p, p) - 1)";
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_in_order_and_say_something() {
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
