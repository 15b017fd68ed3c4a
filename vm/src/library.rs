//! The WGSL that a scene's functions call, collected as they are written: recorded operations,
//! elementary functions, blends, and what goes with surfaces. Only what is called is in the text.

use crate::apply::{record_gradient, record_value};
use crate::dual::Dual;
use crate::guard::beyond;
use crate::kernel::Kernel;
use crate::prelude;
use crate::record::{DUAL_POINT, Function, Scalar, Vec3, record};
use crate::table::Op;
use std::collections::{BTreeSet, HashSet};

/// WGSL text that more text is put after: what the functions of a scene share.
#[derive(Clone, Debug, Default)]
pub struct Library {
    calls: BTreeSet<&'static str>,
    values: HashSet<Op>,
    gradients: HashSet<Op>,
    points: bool,
    mapped: bool,
    mapped_gradient: bool,
    local_normal: bool,
    mixed_surface: bool,
    guard: bool,
    kernels: BTreeSet<Kernel>,
    kernel_gradients: BTreeSet<Kernel>,
}

impl Library {
    /// The text of all functions called so far, operations in the order of the table, and the
    /// elementary functions that they call in turn; [`Library::whole`] has those too.
    pub fn text(&self) -> (String, Vec<&'static str>) {
        let mut calls = self.calls.clone();
        if self.local_normal {
            calls.insert("length3");
        }
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
            .chain(self.kernels.iter().map(|&kernel| record_blend(kernel)))
            .chain(
                self.kernel_gradients
                    .iter()
                    .map(|&kernel| record_blend_gradient(kernel)),
            );
        for function in recorded.chain(self.guard.then(record_guard)) {
            calls.extend(function.calls);
            bodies.push_str(&function.text);
            bodies.push('\n');
        }
        let mut text = String::new();
        if self.points {
            text.push_str(DUAL_POINT);
            text.push('\n');
        }
        if self.local_normal {
            text.push_str(LOCAL_NORMAL);
        }
        if self.mixed_surface {
            text.push_str(MIXED_SURFACE);
        }
        if self.mapped {
            text.push_str(MAPPED);
        }
        if self.mapped_gradient {
            text.push_str(MAPPED_GRADIENT);
        }
        (text + &bodies, calls.into_iter().collect())
    }
    /// The text with the elementary functions in front: complete but for the struct `Surface`.
    pub fn whole(&self) -> String {
        let (text, calls) = self.text();
        let mut whole = String::new();
        for function in prelude::functions(calls) {
            whole.push_str(&function.text);
            whole.push('\n');
        }
        whole + &text
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
    /// Marks a kernel's blend as called.
    pub fn use_blend(&mut self, kernel: Kernel) {
        self.kernels.insert(kernel);
    }
    /// Marks a kernel's blend with gradients as called.
    pub fn use_blend_gradient(&mut self, kernel: Kernel) {
        self.kernel_gradients.insert(kernel);
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
}

/// The name of [`beyond`] in WGSL.
pub const GUARD_NAME: &str = "beyond";

fn record_guard() -> Function {
    record(GUARD_NAME, |s| {
        let p: Vec3 = s.parameter("p");
        let top: Scalar = s.parameter("top");
        let centre: Vec3 = s.parameter("centre");
        let reach: Scalar = s.parameter("reach");
        let half: Vec3 = s.parameter("half");
        let factor: Scalar = s.parameter("factor");
        beyond::<Scalar>(p, top, centre, reach, half, factor)
    })
}

/// The name of a kernel's blend in WGSL.
pub fn blend_name(kernel: Kernel) -> String {
    format!("blend_{}", kernel.name())
}

fn record_blend(kernel: Kernel) -> Function {
    record(&blend_name(kernel), |s| {
        let [a, b, sign, sign_b, width, coefficient]: [Scalar; 6] =
            ["a", "b", "sign", "sign_b", "width", "coefficient"].map(|name| s.parameter(name));
        kernel.blend(a, b, sign, sign_b, width, coefficient)
    })
}

fn record_blend_gradient(kernel: Kernel) -> Function {
    record(&format!("{}_gradient", blend_name(kernel)), |s| {
        let [a, b]: [Dual<Scalar>; 2] = ["a", "b"].map(|name| s.parameter(name));
        let [sign, sign_b, width, coefficient] =
            ["sign", "sign_b", "width", "coefficient"].map(|name| s.fixed(name));
        kernel.blend(a, b, sign, sign_b, width, coefficient)
    })
}

const LOCAL_NORMAL: &str = "fn local_normal(dx: vec3f, dy: vec3f, dz: vec3f, n: vec3f) -> vec3f {
    let x = dx.x * n.x + dx.y * n.y + dx.z * n.z;
    let y = dy.x * n.x + dy.y * n.y + dy.z * n.z;
    let z = dz.x * n.x + dz.y * n.y + dz.z * n.z;
    let v = vec3f(x, y, z);
    return v * (1.0 / max(length3(v), 1e-30));
}

";

/// `weights` is a blend's value with the derivatives by its two operands in x and y.
const MIXED_SURFACE: &str = "fn mixed_surface(a: Surface, b: Surface, weights: vec4f) -> Surface {
    let t = abs(weights.y) / max(abs(weights.x) + abs(weights.y), 1e-20);
    return Surface(
        a.albedo + (b.albedo - a.albedo) * t,
        a.roughness + (b.roughness - a.roughness) * t,
        a.emission + (b.emission - a.emission) * t,
        a.metallic + (b.metallic - a.metallic) * t,
        a.bump + (b.bump - a.bump) * t,
        select(a.id, b.id, t > 0.5),
    );
}

";

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
