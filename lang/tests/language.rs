//! The language from outside: text in, trees, text and messages out.

#[path = "language/errors.rs"]
mod errors;
#[path = "language/hostile.rs"]
mod hostile;
#[path = "language/printing.rs"]
mod printing;
#[path = "language/scenes.rs"]
mod scenes;

use sdfc_lang::{Diagnostics, Sources, Style, ast::File, parse};

/// The tree of a text, and what is said about the text.
fn read(text: &str) -> (Option<File>, String) {
    let mut sources = Sources::new();
    let file = sources.add("scene.sdf", text);
    let (tree, found) = parse(&sources, file);
    let found: Diagnostics = found.into_iter().collect();
    (tree, found.render(&sources, Style::Plain))
}

/// The tree of a text without errors.
fn tree(text: &str) -> File {
    let (tree, said) = read(text);
    tree.unwrap_or_else(|| panic!("{said}\n{text}"))
}

/// A small generator of numbers that look random; the same ones in every run.
struct Random(u64);

impl Random {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end.max(1) as u64) as usize
    }
}
