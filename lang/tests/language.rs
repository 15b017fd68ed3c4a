//! The public interface of the language: text to trees, canonical text and messages.

#[path = "language/errors.rs"]
mod errors;
#[path = "language/hostile.rs"]
mod hostile;
#[path = "language/printing.rs"]
mod printing;
#[path = "language/scenes.rs"]
mod scenes;

use sdfc_lang::{Diagnostics, Sources, Style, ast::File, parse};

/// Parses a text, and returns the tree and the rendered messages.
fn parse_and_render(text: &str) -> (Option<File>, String) {
    let mut sources = Sources::new();
    let file = sources.add("scene.sdf", text);
    let (tree, diagnostics) = parse(&sources, file);
    let diagnostics: Diagnostics = diagnostics.into_iter().collect();
    (tree, diagnostics.render(&sources, Style::Plain))
}

/// Parses a text without errors.
fn parse_valid(text: &str) -> File {
    let (tree, messages) = parse_and_render(text);
    tree.unwrap_or_else(|| panic!("{messages}\n{text}"))
}

/// Xorshift generator of pseudorandom numbers, identical in every run.
struct XorShift(u64);

impl XorShift {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end.max(1) as u64) as usize
    }
}
