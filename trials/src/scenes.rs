//! Scenes in several ways of saying the same.
