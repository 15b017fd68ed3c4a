//! sdfc.
fn main() {}
