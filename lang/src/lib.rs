//! The `.sdf` language: text to a syntax tree, and everything that is said to the user on the way.
//!
//! The crate knows no shape's name. What it gives is a tree ([`ast`]) whose every node has a
//! [`Span`], [`Diagnostic`]s with codes, labels and fixes, and the canonical text of a tree.

pub mod ast;
pub mod codes;
pub mod diagnostic;
mod span;

pub use codes::{Code, explain};
pub use diagnostic::{Diagnostic, Diagnostics, Edit, Fix, Label, Severity, Style};
pub use span::{FileId, LineCol, Sources, Span};

mod brackets;
mod lex;
mod literal;
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
