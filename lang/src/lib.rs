//! The `.sdf` language: text to a syntax tree, and everything that is said to the user on the way.
//!
//! [`parse`] is the pipeline: words, matching brackets, grammar, lints. What it gives is a tree
//! ([`ast`]) whose every node has a [`Span`], or [`Diagnostic`]s with codes, labels and fixes. The
//! crate knows no shape's name and looks nothing up.

pub mod ast;
mod brackets;
pub mod codes;
pub mod diagnostic;
mod dump;
mod lex;
mod lints;
mod literal;
mod mistakes;
mod parse;
mod print;
mod span;
mod token;
mod tree;

#[allow(
    clippy::all,
    missing_docs,
    unreachable_pub,
    unused,
    clippy::allow_attributes_without_reason,
    reason = "lalrpop writes this module"
)]
mod grammar {
    include!(concat!(env!("OUT_DIR"), "/grammar.rs"));
}

pub use codes::{Code, explain};
pub use diagnostic::{Diagnostic, Diagnostics, Edit, Fix, Label, Severity, Style};
pub use dump::dump;
pub use parse::{MAX_SOURCE_BYTES, parse};
pub use print::print;
pub use span::{FileId, LineCol, Sources, Span};
