//! Trials: what nobody would write, made in great numbers, and what must hold of all of it.
//!
//! A generator makes an input from a seed, and is the same on every machine: [`programs`] makes
//! programs that are valid, [`scenes`] scenes whose variants must have equal values, [`damage`]
//! spoils texts and files. A check of [`checks`] takes an input and panics where a promise is broken.
//! [`campaign`] runs a check on many seeds. The tests of this crate run a share of each; the targets
//! in `fuzz/` run the same checks on what libFuzzer makes.
//!
//! An [`oracle`] tells the surface that a ray through a scene really meets. It shares the language
//! with the engines and nothing else.

pub mod campaign;
pub mod checks;
pub mod damage;
pub mod oracle;
pub mod programs;
pub mod random;
pub mod scenes;
pub mod seeds;
pub mod shapes;
