//! Texts that nobody would write: nothing panics, nothing hangs, everything is said.
