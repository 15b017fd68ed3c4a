//! The playground.

pub mod seeing;
