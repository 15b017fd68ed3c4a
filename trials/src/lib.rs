//! Property tests over generated inputs: random programs and scenes, damaged files, and the invariants that
//! must hold for each.
//!
//! A generator creates an input from a seed, identically on every machine. [`programs`] creates valid
//! programs, [`scenes`] scenes with variants of equal values, and [`damage`] damages texts and files. A
//! check of [`checks`] takes an input and panics where an invariant is violated. [`campaign`] runs a check
//! on many seeds. The tests of this crate run a few seeds of each campaign. The targets in `fuzz/` run the
//! same checks on inputs of libFuzzer.
//!
//! An [`oracle`] computes the true hit of a ray with a scene. It shares the language front end with the
//! engines and nothing else.

pub mod campaign;
pub mod checks;
pub mod damage;
pub mod oracle;
pub mod programs;
pub mod random;
pub mod scenes;
pub mod seeds;
pub mod shapes;
pub mod skip;
