//! What is said about texts with mistakes.
