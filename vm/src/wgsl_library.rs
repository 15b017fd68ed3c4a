//! The set of WGSL functions that a scene's functions call, collected while they are written: recorded
//! operations, elementary functions, blends, and functions for surfaces. The text contains only functions
//! that are called.

use crate::apply::{record_gradient, record_interval, record_value};
use crate::blend::BlendKernel;
use crate::dual::Dual;
use crate::guard::influence_margin_sq;
use crate::local_normal::local_normal;
use crate::material_weights::{MIXED_SURFACE_WGSL, record_first_value};
use crate::prelude;
use crate::record::{
    BOX_POINT, DUAL_POINT, RecordedFunction, RecordedInterval, Scalar, Vec3, record,
};
use crate::table::Op;
use crate::vector::V3;
use crate::wgsl_interval;
use std::collections::{BTreeSet, HashSet};

/// The set of WGSL functions in use, shared by the functions of a scene.
#[derive(Clone, Debug, Default)]
pub struct WgslLibrary {
    calls: BTreeSet<&'static str>,
    values: HashSet<Op>,
    gradients: HashSet<Op>,
    intervals: HashSet<Op>,
    points: bool,
    boxes: bool,
    mapped: bool,
    mapped_gradient: bool,
    moved_interval: bool,
    mapped_interval: bool,
    local_normal: bool,
    mixed_surface: bool,
    guard: bool,
    blends: BTreeSet<BlendKernel>,
    blend_gradients: BTreeSet<BlendKernel>,
    blend_intervals: BTreeSet<BlendKernel>,
}

impl WgslLibrary {
    /// Returns the text of all functions called so far, operations in the order of the table, and the
    /// functions of the prelude that they call. [`WgslLibrary::text_with_prelude`] includes those
    /// too.
    pub fn text(&self) -> (String, Vec<&'static str>) {
        let mut calls = self.calls.clone();
        let mut bodies = String::new();
        let sorted = |ops: &HashSet<Op>| -> Vec<Op> {
            let mut ops: Vec<Op> = ops.iter().copied().collect();
            ops.sort_unstable();
            ops
        };
        let recorded = sorted(&self.values)
            .into_iter()
            .map(record_value)
            .chain(sorted(&self.gradients).into_iter().map(record_gradient))
            .chain(sorted(&self.intervals).into_iter().map(record_interval))
            .chain(self.blends.iter().map(|&kernel| record_blend(kernel)))
            .chain(
                self.blend_gradients
                    .iter()
                    .map(|&kernel| record_blend_gradient(kernel)),
            )
            .chain(
                self.blend_intervals
                    .iter()
                    .map(|&kernel| record_blend_interval(kernel)),
            );
        let others = [
            self.mixed_surface.then(record_first_value),
            self.guard.then(record_guard),
            self.moved_interval.then(record_moved_interval),
            self.mapped_interval.then(record_mapped_interval),
            self.local_normal.then(record_local_normal),
        ];
        for function in recorded.chain(others.into_iter().flatten()) {
            calls.extend(function.calls);
            bodies.push_str(&function.text);
            bodies.push('\n');
        }
        let mut text = String::new();
        for (used, structure) in [(self.points, DUAL_POINT), (self.boxes, BOX_POINT)] {
            if used {
                text.push_str(structure);
                text.push('\n');
            }
        }
        if self.mixed_surface {
            text.push_str(MIXED_SURFACE_WGSL);
        }
        if self.mapped {
            text.push_str(MAPPED);
        }
        if self.mapped_gradient {
            text.push_str(MAPPED_GRADIENT);
        }
        (text + &bodies, calls.into_iter().collect())
    }
    /// Returns the text after the functions of the prelude: complete except for the struct
    /// `Surface`.
    pub fn text_with_prelude(&self) -> String {
        let (text, calls) = self.text();
        let mut text_with_calls = String::new();
        for function in prelude::functions(calls) {
            text_with_calls.push_str(&function.text);
            text_with_calls.push('\n');
        }
        text_with_calls + &text
    }
    /// Marks an operation's plain function as called.
    pub fn use_value(&mut self, op: Op) {
        self.values.insert(op);
    }
    /// Marks an operation's function with gradients as called.
    pub fn use_gradient(&mut self, op: Op) {
        self.gradients.insert(op);
        self.points = true;
    }
    /// Marks an operation's function on intervals as called.
    pub fn use_interval(&mut self, op: Op) {
        self.intervals.insert(op);
        self.boxes = true;
    }
    /// Marks a kernel's blend as called.
    pub fn use_blend(&mut self, kernel: BlendKernel) {
        self.blends.insert(kernel);
    }
    /// Marks a kernel's blend with gradients as called.
    pub fn use_blend_gradient(&mut self, kernel: BlendKernel) {
        self.blend_gradients.insert(kernel);
    }
    /// Marks a kernel's blend of intervals as called.
    pub fn use_blend_interval(&mut self, kernel: BlendKernel) {
        self.blend_intervals.insert(kernel);
    }
    /// Marks the affine map of a point as called.
    pub fn use_mapped(&mut self) {
        self.mapped = true;
    }
    /// Marks the affine map of a point with gradients as called.
    pub fn use_mapped_gradient(&mut self) {
        self.mapped_gradient = true;
        self.points = true;
    }
    /// Marks the shift of a box of points as called.
    pub fn use_moved_interval(&mut self) {
        self.moved_interval = true;
        self.boxes = true;
    }
    /// Marks the affine map of a box of points as called.
    pub fn use_mapped_interval(&mut self) {
        self.mapped_interval = true;
        self.boxes = true;
    }
    /// Marks the normal in a point's frame as called.
    pub fn use_local_normal(&mut self) {
        self.local_normal = true;
    }
    /// Marks the mixing of surfaces as called.
    pub fn use_mixed_surface(&mut self) {
        self.mixed_surface = true;
    }
    /// Marks the test of guards as called.
    pub fn use_guard(&mut self) {
        self.guard = true;
    }
    /// Marks the declaration of points with gradients as used.
    pub fn use_points(&mut self) {
        self.points = true;
    }
    /// Marks the declaration of boxes of points as used.
    pub fn use_boxes(&mut self) {
        self.boxes = true;
    }
}

/// The name of [`influence_margin_sq`] in WGSL.
pub const GUARD_NAME: &str = "beyond";

fn record_guard() -> RecordedFunction {
    record(GUARD_NAME, |s| {
        let p: Vec3 = s.parameter("p");
        let top: Scalar = s.parameter("top");
        let centre: Vec3 = s.parameter("centre");
        let reach: Scalar = s.parameter("reach");
        let half: Vec3 = s.parameter("half");
        let factor: Scalar = s.parameter("factor");
        influence_margin_sq::<Scalar>(p, top, centre, reach, half, factor)
    })
}

/// Returns the name of a kernel's blend in WGSL.
pub fn blend_name(kernel: BlendKernel) -> String {
    format!("blend_{}", kernel.name())
}

fn record_blend(kernel: BlendKernel) -> RecordedFunction {
    record(&blend_name(kernel), |s| {
        let [a, b, sign, sign_b, width, coefficient]: [Scalar; 6] =
            ["a", "b", "sign", "sign_b", "width", "coefficient"].map(|name| s.parameter(name));
        kernel.blend(a, b, sign, sign_b, width, coefficient)
    })
}

fn record_blend_gradient(kernel: BlendKernel) -> RecordedFunction {
    record(&format!("{}_gradient", blend_name(kernel)), |s| {
        let [a, b]: [Dual<Scalar>; 2] = ["a", "b"].map(|name| s.parameter(name));
        let [sign, sign_b, width, coefficient] =
            ["sign", "sign_b", "width", "coefficient"].map(|name| s.fixed(name));
        kernel.blend(a, b, sign, sign_b, width, coefficient)
    })
}

fn record_blend_interval(kernel: BlendKernel) -> RecordedFunction {
    record(&format!("{}_interval", blend_name(kernel)), |s| {
        let [a, b]: [RecordedInterval; 2] = ["a", "b"].map(|name| s.parameter(name));
        let [sign, sign_b, width, coefficient] = ["sign", "sign_b", "width", "coefficient"]
            .map(|name| RecordedInterval::point(s.parameter(name)));
        kernel.blend(a, b, sign, sign_b, width, coefficient)
    })
}

fn record_moved_interval() -> RecordedFunction {
    record("moved_interval", |s| {
        let p: V3<RecordedInterval> = s.parameter("p");
        p + RecordedInterval::points(s.parameter("shift"))
    })
}

fn record_mapped_interval() -> RecordedFunction {
    record("mapped_interval", |s| {
        let V3 { x, y, z }: V3<RecordedInterval> = s.parameter("p");
        let columns: [Vec3; 3] = ["x", "y", "z"].map(|name| s.parameter(name));
        let p = [x, y, z].map(RecordedInterval::ends);
        let [x, y, z] = wgsl_interval::mapped(p, columns, s.parameter("shift"))
            .map(RecordedInterval::from_ends);
        V3::new(x, y, z)
    })
}

fn record_local_normal() -> RecordedFunction {
    record("local_normal", |s| {
        let [x, y, z]: [Vec3; 3] = ["dx", "dy", "dz"].map(|name| s.parameter(name));
        local_normal::<Scalar>(x, y, z, s.parameter("n"))
    })
}

const MAPPED: &str = "fn mapped(p: vec3f, rows: mat3x3f, shift: vec3f) -> vec3f {
    return rows[0] * p.x + rows[1] * p.y + rows[2] * p.z + shift;
}

";

const MAPPED_GRADIENT: &str =
    "fn mapped_gradient(q: DualPoint, rows: mat3x3f, shift: vec3f) -> DualPoint {
    let p = rows[0] * q.p.x + rows[1] * q.p.y + rows[2] * q.p.z + shift;
    let r = transpose(rows);
    return DualPoint(
        p,
        q.dx * r[0].x + q.dy * r[0].y + q.dz * r[0].z,
        q.dx * r[1].x + q.dy * r[1].y + q.dz * r[1].z,
        q.dx * r[2].x + q.dy * r[2].y + q.dz * r[2].z,
    );
}

";
