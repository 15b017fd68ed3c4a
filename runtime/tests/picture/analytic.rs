//! Fields given by a formula, for renders without a compiler.

use sdfc_runtime::cells::Cells;
use sdfc_runtime::cpu::{Evaluator, F32x64, FieldFacts, LANES, Points, RenderField, SurfaceBlock};
use sdfc_runtime::render::{RenderJob, Surface};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::real::{Real, Vector3};
use sdfc_vm::vector::V3;

/// A distance given by a formula, with its surfaces.
pub(crate) trait Formula: Sync {
    /// The distance.
    fn distance<R: Real>(&self, p: R::Vec3) -> R;
    /// The surface, unless it is the same everywhere.
    fn surface(&self, _p: [f32; 3], _normal: [f32; 3]) -> Option<Surface> {
        None
    }
    /// Reports whether the length of the gradient is unknown.
    fn is_raw(&self) -> bool {
        false
    }
    /// The box around the solid.
    fn bounds(&self) -> Bounds {
        Bounds::ALL_SPACE
    }
}

/// A formula as a field.
pub(crate) struct Analytic<F>(pub(crate) F);

struct FormulaEvaluator<'a, F>(&'a F);

impl<F: Formula> RenderField for Analytic<F> {
    fn facts(&self) -> FieldFacts {
        let uniform = self.0.surface([0.0; 3], [0.0, 1.0, 0.0]).is_none();
        FieldFacts {
            is_raw: self.0.is_raw(),
            has_estimated_slopes: false,
            max_slope: 1.0,
            has_loose_slopes: false,
            bounds: self.0.bounds(),
            material: uniform.then_some(CLAY),
        }
    }
    fn evaluator<'a>(&'a self, _: &RenderJob, _: Option<&'a Cells>) -> Box<dyn Evaluator + 'a> {
        Box::new(FormulaEvaluator(&self.0))
    }
}

/// The material of formulas without surfaces.
pub(crate) const CLAY: Surface = Surface {
    albedo: [0.7, 0.6, 0.5],
    roughness: 0.6,
    emission: [0.0; 3],
    metallic: 0.0,
    bump: [0.0; 3],
    id: 1.0,
};

fn lane_point(points: &Points, lane: usize) -> V3<f32> {
    V3::new(points[0].0[lane], points[1].0[lane], points[2].0[lane])
}

impl<F: Formula> Evaluator for FormulaEvaluator<'_, F> {
    fn distances(&mut self, points: &Points, _: usize, out: &mut F32x64) {
        for lane in 0..LANES {
            out.0[lane] = self.0.distance::<f32>(lane_point(points, lane));
        }
    }
    fn gradients(&mut self, points: &Points, count: usize, out: &mut [F32x64; 4]) {
        for lane in 0..count {
            let p = lane_point(points, lane);
            let unit = |x, y, z| V3::new(x, y, z);
            let seeded = DualVec3 {
                value: p,
                gradients: [
                    unit(1.0, 0.0, 0.0),
                    unit(0.0, 1.0, 0.0),
                    unit(0.0, 0.0, 1.0),
                ],
            };
            let d = self.0.distance::<Dual<f32>>(seeded);
            let [x, y, z] = d.gradient.to_array();
            for (column, v) in out.iter_mut().zip([x, y, z, d.value]) {
                column.0[lane] = v;
            }
        }
    }
    fn surfaces(
        &mut self,
        points: &Points,
        normals: &Points,
        count: usize,
        out: &mut SurfaceBlock,
    ) {
        for lane in 0..count {
            let (p, n) = (lane_point(points, lane), lane_point(normals, lane));
            let s = self.0.surface(p.to_array(), n.to_array()).unwrap_or(CLAY);
            let numbers = [
                s.albedo[0],
                s.albedo[1],
                s.albedo[2],
                s.roughness,
                s.emission[0],
                s.emission[1],
                s.emission[2],
                s.metallic,
                s.bump[0],
                s.bump[1],
                s.bump[2],
                s.id,
            ];
            for (column, v) in out.iter_mut().zip(numbers) {
                column.0[lane] = v;
            }
        }
    }
}

/// A sphere.
pub(crate) struct Sphere {
    /// The centre.
    pub(crate) centre: [f64; 3],
    /// The radius.
    pub(crate) radius: f64,
}

impl Formula for Sphere {
    fn distance<R: Real>(&self, p: R::Vec3) -> R {
        (p - constant::<R>(self.centre)).length() - R::constant(self.radius)
    }
}

/// A vector of constants.
pub(crate) fn constant<R: Real>([x, y, z]: [f64; 3]) -> R::Vec3 {
    R::Vec3::new(R::constant(x), R::constant(y), R::constant(z))
}
