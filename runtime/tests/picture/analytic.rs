//! Fields given by a formula, for pictures that need no compiler.

use sdfc_runtime::cells::Cells;
use sdfc_runtime::cpu::{Column, Evaluator, Field, FieldFacts, LANES, Points, SurfaceBlock};
use sdfc_runtime::frame::{Picture, Surface};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::dual::{Dual, DualVec3};
use sdfc_vm::real::{Real, Vector3};
use sdfc_vm::vector::V3;

/// A distance by a formula, and what its surface is made of.
pub(crate) trait Formula: Sync {
    /// The distance.
    fn distance<R: Real>(&self, p: R::Vec3) -> R;
    /// The surface, where it is not the same everywhere.
    fn surface(&self, _p: [f32; 3], _normal: [f32; 3]) -> Option<Surface> {
        None
    }
    /// Tells that the length of the gradient is not known.
    fn is_raw(&self) -> bool {
        false
    }
    /// The box around the solid.
    fn bounds(&self) -> Bounds {
        Bounds::EVERYTHING
    }
}

/// A formula as a field.
pub(crate) struct Analytic<F>(pub(crate) F);

struct Asking<'a, F>(&'a F);

impl<F: Formula> Field for Analytic<F> {
    fn facts(&self) -> FieldFacts {
        let uniform = self.0.surface([0.0; 3], [0.0, 1.0, 0.0]).is_none();
        FieldFacts {
            raw: self.0.is_raw(),
            bounds: self.0.bounds(),
            material: uniform.then_some(CLAY),
        }
    }
    fn evaluator<'a>(&'a self, _: &Picture, _: Option<&'a Cells>) -> Box<dyn Evaluator + 'a> {
        Box::new(Asking(&self.0))
    }
}

/// The material of formulas that have none.
pub(crate) const CLAY: Surface = Surface {
    albedo: [0.7, 0.6, 0.5],
    roughness: 0.6,
    emission: [0.0; 3],
    metallic: 0.0,
    bump: [0.0; 3],
    id: 1.0,
};

fn at(points: &Points, lane: usize) -> V3<f32> {
    V3::of(points[0].0[lane], points[1].0[lane], points[2].0[lane])
}

impl<F: Formula> Evaluator for Asking<'_, F> {
    fn distances(&mut self, points: &Points, _: usize, out: &mut Column) {
        for lane in 0..LANES {
            out.0[lane] = self.0.distance::<f32>(at(points, lane));
        }
    }
    fn gradients(&mut self, points: &Points, count: usize, out: &mut [Column; 4]) {
        for lane in 0..count {
            let p = at(points, lane);
            let unit = |x, y, z| V3::of(x, y, z);
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
            let (p, n) = (at(points, lane), at(normals, lane));
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

/// A ball.
pub(crate) struct Ball {
    /// Its middle.
    pub(crate) centre: [f64; 3],
    /// Its radius.
    pub(crate) radius: f64,
}

impl Formula for Ball {
    fn distance<R: Real>(&self, p: R::Vec3) -> R {
        (p - constant::<R>(self.centre)).length() - R::constant(self.radius)
    }
}

/// A vector of constants.
pub(crate) fn constant<R: Real>([x, y, z]: [f64; 3]) -> R::Vec3 {
    R::Vec3::new(R::constant(x), R::constant(y), R::constant(z))
}
