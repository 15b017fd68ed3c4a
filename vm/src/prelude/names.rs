//! The names of the functions of the prelude.

/// The functions of the prelude, each after those that it calls.
pub const NAMES: [&str; 35] = [
    "length2",
    "length3",
    "power_of_two",
    "exponent_of",
    "mantissa_of",
    "exponential",
    "logarithm",
    "sine",
    "cosine",
    "arctangent",
    "lattice",
    "lattice_edge",
    "noise",
    "noise_gradient",
    "ellipsoid",
    "ellipsoid_gradient",
    "interval_add",
    "interval_sub",
    "interval_mul",
    "interval_scale",
    "interval_div",
    "interval_abs",
    "interval_square",
    "interval_sqrt",
    "interval_length2",
    "interval_length3",
    "interval_fract",
    "interval_sine",
    "interval_cosine",
    "interval_arctangent",
    "interval_exponential",
    "interval_logarithm",
    "interval_noise",
    "interval_ellipsoid",
    "interval_select",
];

/// Reports whether `name` is a function of the prelude rather than a WGSL builtin.
pub fn is_prelude(name: &str) -> bool {
    NAMES.contains(&name)
}
