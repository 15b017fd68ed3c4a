//! The suites that look at the whole: what a person types, and what comes out.

mod cli;
