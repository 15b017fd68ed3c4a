//! The CPU engine: programs on batches of 64 points, all cores.

use super::{Engine, EngineError, EngineKind, Loaded, Sample};
use crate::cpu::{self, Column, Evaluator, Field, LANES, Points, SurfaceBlock};
use crate::frame::{FieldFacts, Frame, RenderSettings, Surface, prepare};
use crate::settings::{facts, unpainted};
use rayon::prelude::*;
use sdfc_vm::batch::Machine;
use sdfc_vm::dual::Dual;
use sdfc_vm::program::{Module, Program};
use sdfc_vm::surface::{NUMBERS, Surfaces};

/// Runs the loaded scene's programs on the cores of this machine.
#[derive(Default)]
pub(super) struct CpuEngine {
    scene: Option<Scene>,
}

/// What of a module is run.
struct Scene {
    distance: Program,
    surface: Option<Program>,
    facts: FieldFacts,
    unpainted: Surface,
}

impl Scene {
    fn of(module: &Module, outputs: &[f64]) -> Self {
        Self {
            distance: module.distance.clone(),
            surface: module.surface.clone(),
            facts: facts(module, outputs),
            unpainted: unpainted(module, outputs),
        }
    }
}

impl CpuEngine {
    fn scene(&self) -> Result<&Scene, EngineError> {
        self.scene.as_ref().ok_or(EngineError::NothingLoaded)
    }
}

impl Engine for CpuEngine {
    fn kind(&self) -> EngineKind {
        EngineKind::Cpu
    }

    fn device(&self) -> String {
        match rayon::current_num_threads() {
            1 => format!("1 thread, {}", instruction_set()),
            threads => format!("{threads} threads, {}", instruction_set()),
        }
    }

    fn load(&mut self, scene: &Loaded<'_>) -> Result<(), EngineError> {
        self.scene = Some(Scene::of(scene.module, scene.outputs));
        Ok(())
    }

    fn update(&mut self, module: &Module, outputs: &[f64]) -> Result<(), EngineError> {
        let scene = self.scene()?;
        let same = scene.distance.code == module.distance.code
            && scene.surface.as_ref().map(|p| &p.code) == module.surface.as_ref().map(|p| &p.code);
        if !same {
            return Err(EngineError::AnotherScene);
        }
        self.scene = Some(Scene::of(module, outputs));
        Ok(())
    }

    fn render(
        &mut self,
        settings: &RenderSettings,
        progress: &(dyn Fn(f32) + Sync),
    ) -> Result<Frame, EngineError> {
        let scene = self.scene()?;
        let picture = prepare(settings, &scene.facts);
        Ok(cpu::render(scene, &picture, progress))
    }

    fn query(&mut self, points: &[[f32; 3]]) -> Result<Vec<Sample>, EngineError> {
        let scene = self.scene()?;
        let batches: Vec<Vec<Sample>> = points
            .par_chunks(LANES)
            .map_init(
                || scene.machines(),
                |machines, chunk| machines.samples(chunk),
            )
            .collect();
        Ok(batches.concat())
    }
}

impl Field for Scene {
    fn facts(&self) -> FieldFacts {
        self.facts
    }
    fn evaluator(&self) -> Box<dyn Evaluator + '_> {
        Box::new(self.machines())
    }
}

impl Scene {
    fn machines(&self) -> Machines<'_> {
        Machines {
            scene: self,
            distance: None,
            gradient: None,
            surface: None,
        }
    }
}

/// The memory of one thread; each part is made when it is first needed.
struct Machines<'a> {
    scene: &'a Scene,
    distance: Option<Machine<f32>>,
    gradient: Option<Machine<Dual<f32>>>,
    surface: Option<Machine<Dual<f32>, Surfaces>>,
}

impl Evaluator for Machines<'_> {
    fn distances(&mut self, points: &Points, _: usize, out: &mut Column) {
        let program = &self.scene.distance;
        let machine = self
            .distance
            .get_or_insert_with(|| Machine::new(&program.needs()));
        out.clone_from(machine.run(program, points));
    }

    fn gradients(&mut self, points: &Points, _: usize, out: &mut [Column; 4]) {
        let program = &self.scene.distance;
        let machine = self
            .gradient
            .get_or_insert_with(|| Machine::new(&program.needs()));
        out.clone_from(machine.run(program, points));
    }

    fn surfaces(&mut self, points: &Points, normals: &Points, _: usize, out: &mut SurfaceBlock) {
        let unpainted = numbers(&self.scene.unpainted);
        let Some(program) = &self.scene.surface else {
            *out = unpainted.map(|number| Column([number; LANES]));
            return;
        };
        let machine = self.surface.get_or_insert_with(|| {
            let mut machine: Machine<Dual<f32>, Surfaces> = Machine::new(&program.needs());
            machine.attachment().unpainted = unpainted;
            machine
        });
        machine.attachment().normals.clone_from(normals);
        machine.run(program, points);
        out.clone_from(&machine.attachment().top);
    }
}

impl Machines<'_> {
    /// At most 64 points.
    fn samples(&mut self, chunk: &[[f32; 3]]) -> Vec<Sample> {
        let mut points = Points::default();
        for lane in 0..LANES {
            // Lanes that are left over repeat the last point.
            let point = chunk
                .get(lane)
                .or(chunk.last())
                .copied()
                .unwrap_or_default();
            for (column, coordinate) in points.iter_mut().zip(point) {
                column.0[lane] = coordinate;
            }
        }
        let count = chunk.len();
        let mut distances = Column::default();
        let mut gradients = <[Column; 4]>::default();
        let mut surfaces = SurfaceBlock::default();
        self.distances(&points, count, &mut distances);
        self.gradients(&points, count, &mut gradients);
        let mut normals = Points::default();
        for lane in 0..LANES {
            let normal = super::query::direction(gradient_at(&gradients, lane));
            for (column, coordinate) in normals.iter_mut().zip(normal) {
                column.0[lane] = coordinate;
            }
        }
        self.surfaces(&points, &normals, count, &mut surfaces);
        let sample = |lane: usize| Sample {
            distance: distances.0[lane],
            gradient: gradient_at(&gradients, lane),
            surface: surface_at(&surfaces, lane),
        };
        (0..count).map(sample).collect()
    }
}

fn gradient_at(gradients: &[Column; 4], lane: usize) -> [f32; 3] {
    std::array::from_fn(|axis| gradients[axis].0[lane])
}

fn surface_at(block: &SurfaceBlock, lane: usize) -> Surface {
    let n = |number: usize| block[number].0[lane];
    Surface {
        albedo: [n(0), n(1), n(2)],
        roughness: n(3),
        emission: [n(4), n(5), n(6)],
        metallic: n(7),
        bump: [n(8), n(9), n(10)],
        id: n(11),
    }
}

/// A surface in the order of [`SurfaceBlock`].
fn numbers(surface: &Surface) -> [f32; NUMBERS] {
    let ([r, g, b], [er, eg, eb], [x, y, z]) = (surface.albedo, surface.emission, surface.bump);
    [
        r,
        g,
        b,
        surface.roughness,
        er,
        eg,
        eb,
        surface.metallic,
        x,
        y,
        z,
        surface.id,
    ]
}

/// The instructions that [`Machine::run`] chooses.
fn instruction_set() -> &'static str {
    #[cfg(target_arch = "x86_64")]
    {
        if is_x86_feature_detected!("avx512f")
            && is_x86_feature_detected!("avx512dq")
            && is_x86_feature_detected!("avx512vl")
            && is_x86_feature_detected!("avx512bw")
        {
            return "AVX-512";
        }
        if is_x86_feature_detected!("avx2") {
            return "AVX2";
        }
    }
    "baseline instructions"
}
