//! The engine `reference`: rays end where it is proved that they do ([`crate::reference`]), and the
//! stages of the CPU engine light and colour what is there.
//!
//! Depths and normals are those of the truth, rounded to `f32`; where nothing could be proved they
//! are a guess, and counted in [`Stats::undecided`](crate::frame::Stats). Shadows, occlusion and
//! materials are computed in `f32`, as on the CPU. Distances and gradients that it is asked for are
//! computed in `f64`.

use super::cpu::{CpuEngine, Scene};
use super::{Engine, EngineError, EngineKind, Loaded, Sample};
use crate::cpu::{
    self, Asked, Column, Evaluator, Field, FieldFacts, Points, SurfaceBlock, figure::Plane,
};
use crate::frame::{Frame, Picture, Progress, RenderSettings, Samples, prepare};
use crate::reference::{self, Camera, Ended, Options, Outcome, Tracer};
use rayon::prelude::*;
use sdfc_shaders::layout;
use sdfc_shaders::marching::{FROM_INSIDE, SHOWN, Status, UNDECIDED};
use sdfc_vm::program::Module;

/// Proves where the rays of the loaded scene end.
#[derive(Default)]
pub(super) struct ReferenceEngine {
    shading: CpuEngine,
    field: Option<reference::Field>,
}

impl ReferenceEngine {
    fn field(&self) -> Result<&reference::Field, EngineError> {
        self.field.as_ref().ok_or(EngineError::NothingLoaded)
    }
}

impl Engine for ReferenceEngine {
    fn kind(&self) -> EngineKind {
        EngineKind::Reference
    }

    fn device(&self) -> String {
        match rayon::current_num_threads() {
            1 => "1 thread, f64 intervals".to_owned(),
            threads => format!("{threads} threads, f64 intervals"),
        }
    }

    fn load(&mut self, scene: &Loaded<'_>) -> Result<(), EngineError> {
        self.shading.load(scene)?;
        self.field = Some(reference::Field::of(scene.module));
        Ok(())
    }

    fn update(&mut self, module: &Module, outputs: &[f64]) -> Result<(), EngineError> {
        self.shading.update(module, outputs)?;
        self.field = Some(reference::Field::of(module));
        Ok(())
    }

    fn render_samples(
        &mut self,
        settings: &RenderSettings,
        samples: Samples<'_>,
        progress: &dyn Progress,
    ) -> Result<Frame, EngineError> {
        let proved = Proved {
            shading: self.shading.scene()?,
            field: self.field()?,
            camera: Camera::of(settings),
            far: settings.far,
        };
        let picture = prepare(settings, &proved.facts());
        cpu::render_samples(&proved, &picture, samples, progress).ok_or(EngineError::Stopped)
    }

    fn heeds_guards(&self) -> bool {
        false
    }

    fn query(&mut self, points: &[[f32; 3]]) -> Result<Vec<Sample>, EngineError> {
        let surfaces = self.shading.query(points)?;
        let field = self.field()?;
        let exact = |(sample, point): (Sample, &[f32; 3])| {
            let point = point.map(f64::from);
            Sample {
                distance: field.distance(point) as f32,
                gradient: field.gradient(point).map(|v| v as f32),
                ..sample
            }
        };
        Ok(surfaces.into_par_iter().zip(points).map(exact).collect())
    }
}

/// A scene in a picture: its ends proved, and all else from the CPU engine.
struct Proved<'a> {
    shading: &'a Scene,
    field: &'a reference::Field,
    camera: Camera,
    far: f64,
}

impl Field for Proved<'_> {
    fn facts(&self) -> FieldFacts {
        self.shading.facts()
    }
    fn figure(&self, _: &Picture, plane: &Plane, _: f32) -> Option<Vec<f32>> {
        let points = plane.points();
        let distance = |p: &[f32; 3]| self.field.distance(p.map(f64::from)) as f32;
        Some(points.par_iter().map(distance).collect())
    }
    fn evaluator<'a>(
        &'a self,
        picture: &Picture,
        _: Option<&'a crate::cells::Cells>,
    ) -> Box<dyn Evaluator + 'a> {
        Box::new(Prover {
            shading: self.shading.evaluator(picture, None),
            tracer: Tracer::new(self.field, &Options::default()),
            camera: self.camera,
            far: self.far,
        })
    }
}

/// What proves the ends of rays, and asks the CPU engine for all else.
struct Prover<'a> {
    shading: Box<dyn Evaluator + 'a>,
    tracer: Tracer<'a>,
    camera: Camera,
    far: f64,
}

impl Evaluator for Prover<'_> {
    fn ends(
        &mut self,
        frame: &layout::Frame,
        pixels: &[[f32; 2]],
        rays: &mut [layout::Ray],
        normals: &mut [[f32; 3]],
    ) -> Option<u64> {
        let started = self.tracer.evaluations();
        for (pixel, (to, normal)) in pixels.iter().zip(rays.iter_mut().zip(normals)) {
            let before = self.tracer.evaluations();
            let ray = self
                .camera
                .ray(pixel.map(f64::from), frame.offset.map(f64::from));
            let half_pixel = |t| self.camera.half_pixel(t);
            let ended = self.tracer.ray(&ray, self.far, half_pixel);
            *normal = self.tracer.shown_normal(&ray, &ended).map(|v| v as f32);
            let start = f64::from(frame.approach) * self.camera.slant(&ray);
            *to = record(&ended, start, self.tracer.evaluations() - before);
        }
        Some(self.tracer.evaluations() - started)
    }
    fn distances(&mut self, points: &Points, count: usize, out: &mut Column) {
        self.shading.distances(points, count, out);
    }
    fn gradients(&mut self, points: &Points, count: usize, out: &mut [Column; 4]) {
        self.shading.gradients(points, count, out);
    }
    fn announce(&mut self, program: Asked, regions: &[crate::cells::Region]) {
        self.shading.announce(program, regions);
    }
    fn focus(&mut self, region: Option<usize>) {
        self.shading.focus(region);
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

/// How a ray ended, as the stages keep it; `start` is how far from the eye they let it start.
fn record(ended: &Ended, start: f64, evaluations: u64) -> layout::Ray {
    let undecided = matches!(ended.outcome, Outcome::Undecided { .. });
    let status = match ended.depth {
        Some(_) if ended.inside => Status::Hit as u32 | FROM_INSIDE | SHOWN,
        Some(_) => Status::Hit as u32 | SHOWN,
        None => Status::Miss as u32,
    };
    layout::Ray {
        t: ended.depth.map_or(0.0, |depth| depth - start) as f32,
        status: if undecided {
            status | UNDECIDED
        } else {
            status
        },
        steps: evaluations.min(u32::MAX.into()) as u32,
        ..layout::Ray::default()
    }
}
