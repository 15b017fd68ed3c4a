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
files and `import` them, or a loop instead of its result:

    for i in 0..1000 { sphere(0.1).translate(i, 0, 0) }";

E0101 "something else was expected" "\
The text does not follow the grammar at this place. The message says what was found and what kind
of thing may stand there.

    let r = ;          // an expression is missing
    let r = 2;";

W0101 "`-` mixed with `|` or `&`" "\
`-` binds tighter than `&`, and `&` tighter than `|`, so `a | b - c` is `a | (b - c)`: the hole is
cut from `b` only. Parentheses say which was meant.

    (a | b) - c        // cut from both
    a | (b - c)        // cut from b";
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
