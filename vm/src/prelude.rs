//! The WGSL functions that recorded bodies call. They are our own elementary functions, recorded from
//! [`crate::elementary`], the arithmetic of intervals, recorded from [`crate::wgsl_interval`], and the few
//! intrinsics that require integers.

pub(crate) mod names;

pub use names::{NAMES, is_prelude};

use crate::dual::Dual;
use crate::elementary;
use crate::ellipsoid::ellipsoid;
use crate::real::{Real, Vector2, Vector3};
use crate::record::{
    Bool, RecordedFunction, RecordedInterval, Scalar, Signature, Vec2, Vec3, record,
};
use crate::wgsl_interval::{self, WgslInterval, WgslTristate};
use std::collections::BTreeSet;

/// Returns the texts of these functions and of all that they call, in the order of [`NAMES`].
pub fn functions(names: impl IntoIterator<Item = &'static str>) -> Vec<RecordedFunction> {
    let mut needed: BTreeSet<&'static str> = BTreeSet::new();
    let mut pending: Vec<&'static str> = names.into_iter().collect();
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

fn function(name: &'static str) -> RecordedFunction {
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
        "interval_add" => binary(name, wgsl_interval::add),
        "interval_sub" => binary(name, wgsl_interval::sub),
        "interval_mul" => binary(name, wgsl_interval::mul),
        "interval_div" => binary(name, wgsl_interval::div),
        "interval_scale" => record(name, |s| {
            let a: RecordedInterval = s.parameter("a");
            RecordedInterval::from_ends(wgsl_interval::scale(a.ends(), s.parameter("factor")))
        }),
        "interval_abs" => unary(name, wgsl_interval::abs),
        "interval_square" => unary(name, wgsl_interval::square),
        "interval_sqrt" => unary(name, wgsl_interval::sqrt),
        "interval_length2" => record(name, |s| {
            RecordedInterval::from_ends(wgsl_interval::length(intervals(s, ["x", "y"])))
        }),
        "interval_length3" => record(name, |s| {
            RecordedInterval::from_ends(wgsl_interval::length(intervals(s, ["x", "y", "z"])))
        }),
        "interval_fract" => unary(name, wgsl_interval::fract),
        "interval_sine" => unary(name, wgsl_interval::sin),
        "interval_cosine" => unary(name, wgsl_interval::cos),
        "interval_arctangent" => record(name, |s| {
            let [y, x] = intervals(s, ["y", "x"]);
            RecordedInterval::from_ends(wgsl_interval::atan2(y, x))
        }),
        "interval_exponential" => unary(name, wgsl_interval::exp2),
        "interval_logarithm" => unary(name, wgsl_interval::log2),
        "interval_noise" => record(name, |s| {
            let p = intervals(s, ["x", "y", "z"]);
            RecordedInterval::from_ends(wgsl_interval::noise(p, s.parameter("seed")))
        }),
        "interval_ellipsoid" => record(name, |s| {
            let p = intervals(s, ["x", "y", "z"]);
            RecordedInterval::from_ends(wgsl_interval::ellipsoid(p, s.parameter::<Vec3>("r")))
        }),
        "interval_select" => record(name, |s| {
            let [may, may_not]: [Bool; 2] = ["may", "may_not"].map(|name| s.parameter(name));
            let [then, otherwise] = intervals(s, ["then", "otherwise"]);
            RecordedInterval::from_ends(wgsl_interval::select(
                WgslTristate {
                    can_be_true: may,
                    can_be_false: may_not,
                },
                then,
                otherwise,
            ))
        }),
        _ => RecordedFunction {
            name: name.to_owned(),
            text: intrinsic(name).to_owned(),
            calls: vec![],
        },
    }
}

/// Reads the next parameters, intervals with these names.
fn intervals<const N: usize>(s: &mut Signature, names: [&str; N]) -> [WgslInterval<Scalar>; N] {
    names.map(|name| s.parameter::<RecordedInterval>(name).ends())
}

/// Records a function of one interval.
fn unary(name: &str, f: fn(WgslInterval<Scalar>) -> WgslInterval<Scalar>) -> RecordedFunction {
    record(name, |s| {
        let [a] = intervals(s, ["a"]);
        RecordedInterval::from_ends(f(a))
    })
}

/// Records a function of two intervals.
fn binary(
    name: &str,
    f: fn(WgslInterval<Scalar>, WgslInterval<Scalar>) -> WgslInterval<Scalar>,
) -> RecordedFunction {
    record(name, |s| {
        let [a, b] = intervals(s, ["a", "b"]);
        RecordedInterval::from_ends(f(a, b))
    })
}

/// Returns the text of a function that cannot be recorded; `Real for f32` is its Rust equivalent.
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
