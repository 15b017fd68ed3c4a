//! The `.sdf` language: parses text to a syntax tree and creates the messages about it.
//!
//! [`parse`] is the pipeline: tokens, matching brackets, grammar, lints. It returns a tree ([`ast`]) whose
//! nodes have [`Span`]s, or [`Diagnostic`]s with codes, labels and fixes. The crate contains no shape names
//! and resolves no names.

pub mod ast;
mod ast_builder;
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

pub use codes::{DiagnosticCode, explain};
pub use diagnostic::{Diagnostic, Diagnostics, Edit, Fix, Label, Severity, Style};
pub use dump::dump;
pub use mistakes::missing_operation;
pub use parse::{MAX_SOURCE_BYTES, parse};
pub use print::print;
pub use span::{FileId, LineCol, Sources, Span};
