//! The engine `reference`: it proves where rays end ([`crate::reference`]); the stages of the CPU engine then
//! light and colour the result.
//!
//! Depths and normals are the true values rounded to `f32`. Where nothing could be proved they are estimates,
//! counted in [`Stats::undecided`](crate::render::Stats). Shadows, occlusion and materials are computed in
//! `f32`, as on the CPU. Queried distances and gradients are computed in `f64`.

use super::{Outcome, RayEnd, ReferenceCamera, ReferenceField, ReferenceTracer, TraceOptions};
use crate::cpu::engine::{CpuEngine, CpuScene, cpu_device};
use crate::cpu::{
    self, Evaluator, F32x64, FieldFacts, FieldQuantity, PlanePicture, Points, RenderField,
    SurfaceBlock,
};
use crate::engine::{Engine, EngineError, EngineKind, FieldSample, SceneInput};
use crate::render::{
    ExactValues, Image, PixelPlane, RenderJob, RenderProgress, RenderSettings, Samples, prepare,
};
use rayon::prelude::*;
use sdfc_shaders::layout;
use sdfc_shaders::marching::{FROM_INSIDE, SHOWN, Status, UNDECIDED};
use sdfc_vm::program::Module;

/// Proves where the rays of the loaded scene end.
#[derive(Default)]
pub(crate) struct ReferenceEngine {
    shading: CpuEngine,
    field: Option<ReferenceField>,
}

impl ReferenceEngine {
    fn field(&self) -> Result<&ReferenceField, EngineError> {
        self.field.as_ref().ok_or(EngineError::NothingLoaded)
    }
}

impl Engine for ReferenceEngine {
    fn kind(&self) -> EngineKind {
        EngineKind::Reference
    }

    fn device(&self) -> String {
        cpu_device("f64 intervals")
    }

    fn load(&mut self, scene: &SceneInput<'_>) -> Result<(), EngineError> {
        self.shading.load(scene)?;
        self.field = Some(ReferenceField::from_module(scene.module));
        Ok(())
    }

    fn update(&mut self, module: &Module, uniform_values: &[f64]) -> Result<(), EngineError> {
        self.shading.update(module, uniform_values)?;
        self.field = Some(ReferenceField::from_module(module));
        Ok(())
    }

    fn render_samples(
        &mut self,
        settings: &RenderSettings,
        samples: Samples<'_>,
        progress: &dyn RenderProgress,
    ) -> Result<Image, EngineError> {
        let proved_scene = ProvedScene {
            shading: self.shading.scene()?,
            field: self.field()?,
            camera: ReferenceCamera::new(settings),
        };
        let job = prepare(settings, &proved_scene.facts());
        cpu::render_samples(&proved_scene, &job, samples, progress).ok_or(EngineError::Stopped)
    }

    fn benefits_from_guards(&self) -> bool {
        false
    }

    fn query(&mut self, points: &[[f32; 3]]) -> Result<Vec<FieldSample>, EngineError> {
        let surfaces = self.shading.query(points)?;
        let field = self.field()?;
        let exact = |(sample, point): (FieldSample, &[f32; 3])| {
            let point = point.map(f64::from);
            let gradient = field.gradient(point).map(|v| v as f32);
            FieldSample::new(field.distance(point) as f32, gradient, sample.surface)
        };
        Ok(surfaces.into_par_iter().zip(points).map(exact).collect())
    }
}

/// A scene in an image: its ray ends are proved, all else comes from the CPU engine.
struct ProvedScene<'a> {
    shading: &'a CpuScene,
    field: &'a ReferenceField,
    camera: ReferenceCamera,
}

impl RenderField for ProvedScene<'_> {
    fn facts(&self) -> FieldFacts {
        self.shading.facts()
    }
    fn sample_plane(
        &self,
        _: &RenderJob,
        plane: &PixelPlane,
        exact: ExactValues,
    ) -> Option<PlanePicture> {
        let points = plane.points();
        let distance = |p: &[f32; 3]| self.field.distance(p.map(f64::from)) as f32;
        let values = points.par_iter().map(distance).collect();
        Some(PlanePicture::new(values, plane, exact, |x, y| {
            distance(&std::array::from_fn(|axis| plane.coordinate(axis, x, y)))
        }))
    }
    fn evaluator<'a>(
        &'a self,
        job: &RenderJob,
        _: Option<&'a crate::cells::Cells>,
    ) -> Box<dyn Evaluator + 'a> {
        Box::new(ProvingEvaluator {
            shading: self.shading.evaluator(job, None),
            tracer: ReferenceTracer::new(self.field, &TraceOptions::default()),
            camera: &self.camera,
        })
    }
}

/// Proves the ends of rays and delegates all other evaluations to the CPU engine.
struct ProvingEvaluator<'a> {
    shading: Box<dyn Evaluator + 'a>,
    tracer: ReferenceTracer<'a>,
    camera: &'a ReferenceCamera,
}

impl Evaluator for ProvingEvaluator<'_> {
    fn known_hits(
        &mut self,
        frame: &layout::FrameUniforms,
        pixels: &[[f32; 2]],
        rays: &mut [layout::RayState],
        normals: &mut [[f32; 3]],
    ) -> Option<u64> {
        let started = self.tracer.evaluations();
        for (pixel, (ray_record, normal)) in pixels.iter().zip(rays.iter_mut().zip(normals)) {
            let evaluations_before = self.tracer.evaluations();
            let ray = self
                .camera
                .ray(pixel.map(f64::from), frame.offset.map(f64::from));
            let half_pixel = |t| self.camera.half_pixel(t);
            let end = self.tracer.ray(&ray, self.camera.far(&ray), half_pixel);
            *normal = self.tracer.shown_normal(&ray, &end).map(|v| v as f32);
            let start = f64::from(frame.approach) * self.camera.slant(&ray);
            *ray_record =
                to_layout_ray(&end, start, self.tracer.evaluations() - evaluations_before);
        }
        Some(self.tracer.evaluations() - started)
    }
    fn distances(&mut self, points: &Points, count: usize, out: &mut F32x64) {
        self.shading.distances(points, count, out);
    }
    fn gradients(&mut self, points: &Points, count: usize, out: &mut [F32x64; 4]) {
        self.shading.gradients(points, count, out);
    }
    fn prune_for_regions(&mut self, quantity: FieldQuantity, regions: &[crate::cells::Aabb]) {
        self.shading.prune_for_regions(quantity, regions);
    }
    fn select_region(&mut self, region: Option<usize>) {
        self.shading.select_region(region);
    }
    fn surfaces(
        &mut self,
        points: &Points,
        normals: &Points,
        count: usize,
        out: &mut SurfaceBlock,
    ) {
        self.shading.surfaces(points, normals, count, out);
    }
}

/// Converts the end of a ray to the record that the stages use. `start` is the distance from the camera at
/// which the stages start the ray.
fn to_layout_ray(end: &RayEnd, start: f64, evaluations: u64) -> layout::RayState {
    let undecided = matches!(end.outcome, Outcome::Undecided { .. });
    let status = match end.depth {
        Some(_) if end.inside => Status::Hit as u32 | FROM_INSIDE | SHOWN,
        Some(_) => Status::Hit as u32 | SHOWN,
        None => Status::Miss as u32,
    };
    layout::RayState {
        t: end.depth.map_or(0.0, |depth| depth - start) as f32,
        status: if undecided {
            status | UNDECIDED
        } else {
            status
        },
        steps: evaluations.min(u32::MAX.into()) as u32,
        ..layout::RayState::default()
    }
}
