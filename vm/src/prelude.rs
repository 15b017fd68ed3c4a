//! The WGSL functions that recorded bodies call: our own elementary functions, recorded from
//! [`crate::elementary`], the arithmetic of intervals, recorded from [`crate::outward`], and the handful
//! of intrinsics that only integers can express.

use crate::dual::Dual;
use crate::elementary;
use crate::ellipsoid::ellipsoid;
use crate::outward::{self, Ends, Known};
use crate::real::{Real, Vector2, Vector3};
use crate::record::{Bool, Function, Range, Scalar, Signature, Vec2, Vec3, record};
use std::collections::BTreeSet;

/// Every function of the prelude, each after those that it calls.
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

/// Whether `name` is a function of the prelude rather than a WGSL builtin.
pub fn is_prelude(name: &str) -> bool {
    NAMES.contains(&name)
}

/// The texts of the wanted functions and of all they call, in an order that reads well.
pub fn functions(wanted: impl IntoIterator<Item = &'static str>) -> Vec<Function> {
    let mut needed: BTreeSet<&'static str> = BTreeSet::new();
    let mut pending: Vec<&'static str> = wanted.into_iter().collect();
    while let Some(name) = pending.pop() {
        if needed.insert(name) {
            pending.extend(function(name).calls);
        }
    }
    NAMES
        .iter()
        .filter(|name| needed.contains(*name))
        .map(|name| function(name))
        .collect()
}

fn function(name: &'static str) -> Function {
    match name {
        "length2" => record(name, |s| {
            let v: Vec2 = s.parameter("v");
            v.dot(v).sqrt()
        }),
        "length3" => record(name, |s| {
            let v: Vec3 = s.parameter("v");
            v.dot(v).sqrt()
        }),
        "exponential" => record(name, |s| {
            elementary::exponential::<Scalar>(s.parameter("x"))
        }),
        "logarithm" => record(name, |s| elementary::logarithm::<Scalar>(s.parameter("x"))),
        "sine" => record(name, |s| elementary::sine::<Scalar>(s.parameter("x"))),
        "cosine" => record(name, |s| elementary::cosine::<Scalar>(s.parameter("x"))),
        "arctangent" => record(name, |s| {
            elementary::arctangent::<Scalar>(s.parameter("y"), s.parameter("x"))
        }),
        "noise" => record(name, |s| {
            elementary::perlin::<Scalar>(s.parameter("p"), s.parameter("seed")).0
        }),
        "noise_gradient" => record(name, |s| {
            let (value, gradient) =
                elementary::perlin::<Scalar>(s.parameter("p"), s.parameter("seed"));
            Dual { value, gradient }
        }),
        "ellipsoid" => record(name, |s| {
            ellipsoid::<Scalar>(s.parameter("p"), s.parameter("r")).0
        }),
        "ellipsoid_gradient" => record(name, |s| {
            let (value, gradient) = ellipsoid::<Scalar>(s.parameter("p"), s.parameter("r"));
            Dual { value, gradient }
        }),
        "interval_add" => binary(name, outward::add),
        "interval_sub" => binary(name, outward::sub),
        "interval_mul" => binary(name, outward::mul),
        "interval_div" => binary(name, outward::div),
        "interval_scale" => record(name, |s| {
            let a: Range = s.parameter("a");
            Range::of(outward::scale(a.ends(), s.parameter("factor")))
        }),
        "interval_abs" => unary(name, outward::abs),
        "interval_square" => unary(name, outward::square),
        "interval_sqrt" => unary(name, outward::sqrt),
        "interval_length2" => record(name, |s| {
            Range::of(outward::length(intervals(s, ["x", "y"])))
        }),
        "interval_length3" => record(name, |s| {
            Range::of(outward::length(intervals(s, ["x", "y", "z"])))
        }),
        "interval_fract" => unary(name, outward::fract),
        "interval_sine" => unary(name, outward::sin),
        "interval_cosine" => unary(name, outward::cos),
        "interval_arctangent" => record(name, |s| {
            let [y, x] = intervals(s, ["y", "x"]);
            Range::of(outward::atan2(y, x))
        }),
        "interval_exponential" => unary(name, outward::exp2),
        "interval_logarithm" => unary(name, outward::log2),
        "interval_noise" => record(name, |s| {
            let p = intervals(s, ["x", "y", "z"]);
            Range::of(outward::noise(p, s.parameter("seed")))
        }),
        "interval_ellipsoid" => record(name, |s| {
            let p = intervals(s, ["x", "y", "z"]);
            Range::of(outward::ellipsoid(p, s.parameter::<Vec3>("r")))
        }),
        "interval_select" => record(name, |s| {
            let [may, may_not]: [Bool; 2] = ["may", "may_not"].map(|name| s.parameter(name));
            let [then, otherwise] = intervals(s, ["then", "otherwise"]);
            Range::of(outward::select(Known { may, may_not }, then, otherwise))
        }),
        _ => Function {
            name: name.to_owned(),
            text: intrinsic(name).to_owned(),
            calls: vec![],
        },
    }
}

/// The next parameters, intervals of these names.
fn intervals<const N: usize>(s: &mut Signature, names: [&str; N]) -> [Ends<Scalar>; N] {
    names.map(|name| s.parameter::<Range>(name).ends())
}

/// A function of an interval.
fn unary(name: &str, f: fn(Ends<Scalar>) -> Ends<Scalar>) -> Function {
    record(name, |s| {
        let [a] = intervals(s, ["a"]);
        Range::of(f(a))
    })
}

/// A function of two intervals.
fn binary(name: &str, f: fn(Ends<Scalar>, Ends<Scalar>) -> Ends<Scalar>) -> Function {
    record(name, |s| {
        let [a, b] = intervals(s, ["a", "b"]);
        Range::of(f(a, b))
    })
}

/// What no recorder can express, by hand; the Rust twins are `Real for f32`.
fn intrinsic(name: &str) -> &'static str {
    match name {
        "power_of_two" => {
            "fn power_of_two(n: f32) -> f32 {
    return bitcast<f32>(bitcast<u32>(n + 8388735.0) << 23u);
}
"
        }
        "exponent_of" => {
            "fn exponent_of(x: f32) -> f32 {
    return f32(i32(bitcast<u32>(x) >> 23u) - 127);
}
"
        }
        "mantissa_of" => {
            "fn mantissa_of(x: f32) -> f32 {
    return bitcast<f32>((bitcast<u32>(x) & 0x007fffffu) | 0x3f800000u);
}
"
        }
        "lattice" => {
            "fn lattice(cell: vec3f, seed: f32) -> vec3f {
    let salt = bitcast<u32>(seed + 12582912.0) * 0x9e3779b9u;
    var h = (bitcast<vec3u>(cell + 12582912.0) ^ vec3u(salt)) * 1664525u + 1013904223u;
    h.x += h.y * h.z;
    h.y += h.z * h.x;
    h.z += h.x * h.y;
    h ^= h >> vec3u(16u);
    h.x += h.y * h.z;
    h.y += h.z * h.x;
    h.z += h.x * h.y;
    return vec3f(vec3i(h >> vec3u(8u))) * (1.0 / 8388608.0) - 1.0;
}
"
        }
        "lattice_edge" => {
            "fn lattice_edge(cell: vec3f, seed: f32) -> vec3f {
    let key = bitcast<vec3u>(cell + 12582912.0);
    let salt = bitcast<u32>(seed + 12582912.0) * 0x9e3779b9u;
    var h = (key.x ^ salt) * 0x7feb352du;
    h = ((h ^ (h >> 15u)) + key.y) * 0x846ca68bu;
    h = ((h ^ (h >> 15u)) + key.z) * 0x7feb352du;
    h = (h ^ (h >> 16u)) * 0x846ca68bu;
    let bits = vec3u(h >> 7u, h, h << 1u) & vec3u(0x007fffffu, 0x80000000u, 0x80000000u);
    return bitcast<vec3f>(vec3u(0x3f800000u) | bits);
}
"
        }
        _ => unreachable!("`{name}` is not in the list of intrinsics"),
    }
}
