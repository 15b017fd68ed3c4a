//! The code of every message, and the page behind `sdfc explain CODE`.
//!
//! A row is a code, a title and a page of a few sentences with an example; it makes a constant of the
//! code's name and a row of the table, so neither can be forgotten. To add a code, add a row in order.
//! `E` rows are errors, `W` rows warnings; the first two digits say which stage finds it: 00 files,
//! 01 syntax, 02 names, 03 types and units, 04 evaluation, 05 limits of the program.

use serde::Serialize;
use std::fmt;

/// A message's code, `E0101`: a row of this table.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
pub struct Code(&'static str);

impl Code {
    /// The code as it is written.
    pub fn as_str(self) -> &'static str {
        self.0
    }
}

impl fmt::Display for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0)
    }
}

impl fmt::Debug for Code {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.0)
    }
}

/// A row of the table.
#[derive(Clone, Copy, Debug)]
pub struct CodeRow {
    /// The code.
    pub code: Code,
    /// What it is about, in a few words.
    pub title: &'static str,
    /// A few sentences and an example.
    pub page: &'static str,
}

macro_rules! codes {
    ($($name:ident $title:literal $page:literal;)*) => {
        $(#[doc = $title] pub const $name: Code = Code(stringify!($name));)*

        /// Every code, in order.
        pub const CODES: &[CodeRow] = &[
            $(CodeRow { code: $name, title: $title, page: $page },)*
        ];
    };
}

/// The page of a code, if there is such a code; case does not matter.
pub fn explain(code: &str) -> Option<&'static str> {
    row(code).map(|row| row.page)
}

/// The row of a code, if there is such a code; case does not matter.
pub fn row(code: &str) -> Option<&'static CodeRow> {
    CODES
        .iter()
        .find(|row| row.code.as_str().eq_ignore_ascii_case(code))
}

codes! {
E0001 "a source file that is too large" "\
A source file may have 1 MiB. A scene of that size is made by a program; let it write several
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

E0501 "a limit of the program" "\
Programs have limits that keep them safe on every device: 60,000 instructions, 64 values on the
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

W0501 "a slope that cannot be bounded" "\
A ray is safe on a field because the field changes no faster than the ray moves, after division by a
bound on its slope. Near a pole (a division by something that reaches zero, a root at zero) there is
no bound, and rays may step over the surface.

    field(fn(p) => 1 / p.x - 1)
    field(fn(p) => 1 / max(p.x, 0.1) - 1)
    field(fn(p) => 1 / p.x - 1, lipschitz: 4)";
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
