//! The CPU engine: programs on batches of 64 points, on all cores.

use super::cell_trial;
use super::evaluator::{CpuEvaluator, EvaluatedScene, MIN_ON_DEMAND_CLAUSES, MIN_SORT_POINTS};
use super::{CellLayout, Evaluator, LANES, PlanePicture, RenderField, morton, plane_quadtree};
use crate::cells::policy::{self, PacketCells};
use crate::cells::split_rule::ScreenSpaceLeafLimit;
use crate::cells::{self, Aabb, CellInfo, CellSpec, CellSplit, Cells, trial};
use crate::engine::{Engine, EngineError, EngineKind, FieldSample, SceneInput};
use crate::render::plane::plane_of;
use crate::render::{
    CellMode, CellStats, ExactValues, FieldFacts, Geometry, Image, Mode, PixelPlane, RenderJob,
    RenderProgress, RenderSettings, Samples, Surface, prepare,
};
use crate::settings::{default_material, field_facts};
use rayon::prelude::*;
use sdfc_vm::program::{Module, Program};
use sdfc_vm::tape::Tape;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Runs the loaded scene's programs on the cores of this machine.
#[derive(Default)]
pub(crate) struct CpuEngine {
    scene: Option<CpuScene>,
}

/// The parts of a module that the engine runs.
pub(crate) struct CpuScene {
    distance: Arc<Program>,
    surface: Option<(Program, Tape)>,
    tape: Arc<Tape>,
    facts: FieldFacts,
    default_material: Surface,
    /// The cells of the last image, possibly of the scene before an edit.
    cached_cells: Mutex<Option<CachedCells>>,
    /// Layout of cells where it needs a trial, once it is known.
    trial_layout: OnceLock<CellLayout>,
}

/// The cells of an image, with the program and view that they were built for.
struct CachedCells {
    program: Arc<Program>,
    tape: Arc<Tape>,
    pixels: ScreenSpaceLeafLimit,
    cells: Arc<Cells>,
    /// Number of cells built for that image.
    fresh: u64,
}

impl CpuScene {
    fn new(module: &Module, uniform_values: &[f64], previous: Option<Self>) -> Self {
        let (trial_layout, cached_cells) = match previous {
            Some(previous) if previous.distance.code == module.distance.code => {
                (previous.trial_layout, previous.cached_cells)
            }
            Some(previous) => (OnceLock::new(), previous.cached_cells),
            None => Default::default(),
        };
        Self {
            trial_layout,
            cached_cells,
            distance: Arc::new(module.distance.clone()),
            surface: module.surface.clone().map(|p| {
                let tape = Tape::new(&p);
                (p, tape)
            }),
            tape: Arc::new(Tape::new(&module.distance)),
            facts: field_facts(module, uniform_values),
            default_material: default_material(module, uniform_values),
        }
    }
}

impl CpuEngine {
    pub(crate) fn scene(&self) -> Result<&CpuScene, EngineError> {
        self.scene.as_ref().ok_or(EngineError::NothingLoaded)
    }
}

impl Engine for CpuEngine {
    fn kind(&self) -> EngineKind {
        EngineKind::Cpu
    }

    fn device(&self) -> String {
        cpu_device(instruction_set())
    }

    fn load(&mut self, scene: &SceneInput<'_>) -> Result<(), EngineError> {
        self.scene = Some(CpuScene::new(
            scene.module,
            scene.uniform_values,
            self.scene.take(),
        ));
        Ok(())
    }

    fn update(&mut self, module: &Module, uniform_values: &[f64]) -> Result<(), EngineError> {
        let scene = self.scene()?;
        let same = scene.distance.code == module.distance.code
            && scene.surface.as_ref().map(|(p, _)| &p.code)
                == module.surface.as_ref().map(|p| &p.code);
        if !same {
            return Err(EngineError::SceneMismatch);
        }
        self.scene = Some(CpuScene::new(module, uniform_values, self.scene.take()));
        Ok(())
    }

    fn render_samples(
        &mut self,
        settings: &RenderSettings,
        samples: Samples<'_>,
        progress: &dyn RenderProgress,
    ) -> Result<Image, EngineError> {
        let scene = self.scene()?;
        let job = prepare(settings, &scene.facts);
        let image = super::render_samples(scene, &job, samples, progress);
        let mut image = image.ok_or(EngineError::Stopped)?;
        image.stats.cells = scene.cell_stats(&job);
        Ok(image)
    }

    fn cells_at(
        &mut self,
        settings: &RenderSettings,
        points: &[[f32; 3]],
    ) -> Result<Option<Vec<Option<CellInfo>>>, EngineError> {
        let scene = self.scene()?;
        // Uses the cells of the last image if its settings were the same; otherwise cells are built here.
        let job = prepare(settings, &scene.facts);
        if job.shows_plane() {
            return Ok(None);
        }
        let cells = scene.cells(&job, scene.cell_layout(&job), u64::MAX);
        Ok(cells.map(|cells| points.par_iter().map(|&p| cells.info_at(p)).collect()))
    }

    fn benefits_from_guards(&self) -> bool {
        false
    }

    fn sample_plane(
        &mut self,
        settings: &RenderSettings,
        band: f32,
    ) -> Result<Option<Vec<f32>>, EngineError> {
        let scene = self.scene()?;
        let plane = plane_of(settings);
        let exact = ExactValues { band, edges: None };
        Ok(plane.map(|plane| plane_quadtree::sample(&scene.distance, &scene.tape, &plane, exact)))
    }

    fn geometry(&mut self, settings: &RenderSettings) -> Result<Geometry, EngineError> {
        let scene = self.scene()?;
        let settings = RenderSettings {
            mode: Mode::Normal,
            aa: 1,
            ..settings.clone()
        };
        Ok(super::geometry(scene, &prepare(&settings, &scene.facts)))
    }

    fn query(&mut self, points: &[[f32; 3]]) -> Result<Vec<FieldSample>, EngineError> {
        let scene = self.scene()?;
        if points.len() < MIN_SORT_POINTS || scene.tape.clauses.len() < MIN_ON_DEMAND_CLAUSES {
            let batches: Vec<Vec<FieldSample>> = points
                .par_chunks(LANES)
                .map_init(
                    || scene.evaluator_with(None, false),
                    |evaluator, chunk| evaluator.sample_chunk(chunk),
                )
                .collect();
            return Ok(batches.concat());
        }
        let order = morton::morton_order(points);
        let pruning_evaluator = || scene.evaluator_with(None, true);
        let batches: Vec<Vec<FieldSample>> = order
            .par_chunks(LANES * LANES)
            .map_init(pruning_evaluator, |evaluator, indices| {
                let sorted_points: Vec<[f32; 3]> = indices
                    .iter()
                    .map(|&index| points[index as usize])
                    .collect();
                evaluator.sample_batch_sorted(&sorted_points)
            })
            .collect();
        let mut samples = vec![FieldSample::default(); points.len()];
        for (sample, index) in batches.into_iter().flatten().zip(order) {
            samples[index as usize] = sample;
        }
        Ok(samples)
    }
}

impl RenderField for CpuScene {
    fn facts(&self) -> FieldFacts {
        self.facts
    }
    fn cell_layout(&self, job: &RenderJob) -> CellLayout {
        match PacketCells::for_job(job, &self.tape, &self.facts) {
            PacketCells::Never => CellLayout::None,
            PacketCells::Whole => CellLayout::Whole,
            PacketCells::Trial => *self.trial_layout.get_or_init(|| self.try_layouts(job)),
            PacketCells::Always => CellLayout::Fine,
        }
    }
    fn cells(
        &self,
        job: &RenderJob,
        layout: CellLayout,
        max_split_clauses: u64,
    ) -> Option<Arc<Cells>> {
        let frame = &job.uniforms;
        let (region, pixels) = match self.tape.lipschitz.is_bounded() {
            true => (
                policy::scene_cube(frame)?,
                ScreenSpaceLeafLimit::from_uniforms(frame),
            ),
            false => policy::raw_field_cells(frame)?,
        };
        let pixels = match layout {
            CellLayout::None => return None,
            CellLayout::Whole => ScreenSpaceLeafLimit::WHOLE,
            CellLayout::Fine => pixels,
        };
        let spec = self.spec(region, &pixels, max_split_clauses);
        let new_program = (&*self.distance, &*self.tape);
        let mut cached_cells = self
            .cached_cells
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        let reusable = cached_cells.take().filter(|last| last.pixels == pixels);
        let previous_cells = reusable.as_ref().map(|last| Arc::as_ptr(&last.cells));
        let reusable = reusable.and_then(|last| {
            cells::rebuild_after_edit(&last.cells, (&last.program, &last.tape), new_program, &spec)
        });
        let is_unchanged =
            reusable.as_ref().map(Arc::as_ptr) == previous_cells && previous_cells.is_some();
        let cells =
            reusable.unwrap_or_else(|| Arc::new(cells::build(new_program.0, new_program.1, &spec)));
        *cached_cells = Some(CachedCells {
            fresh: if is_unchanged {
                0
            } else {
                cells.rebuilt_count() as u64
            },
            program: self.distance.clone(),
            tape: self.tape.clone(),
            pixels,
            cells: cells.clone(),
        });
        Some(cells)
    }
    fn sample_plane(
        &self,
        job: &RenderJob,
        plane: &PixelPlane,
        exact: ExactValues,
    ) -> Option<PlanePicture> {
        let is_pruned = match job.cells {
            CellMode::Never => false,
            CellMode::Auto => self.tape.clauses.len() >= MIN_PLANE_PRUNE_CLAUSES,
            CellMode::Always | CellMode::Cpu | CellMode::Gpu => true,
        };
        is_pruned.then(|| plane_quadtree::picture(&self.distance, &self.tape, plane, exact))
    }
    fn evaluator<'a>(
        &'a self,
        job: &RenderJob,
        cells: Option<&'a Cells>,
    ) -> Box<dyn Evaluator + 'a> {
        Box::new(self.evaluator_with(cells, job.cells != CellMode::Never))
    }
}

impl CpuScene {
    /// Returns the counts of the cells of the last image.
    fn cell_stats(&self, job: &RenderJob) -> CellStats {
        if job.shows_plane()
            || PacketCells::for_job(job, &self.tape, &self.facts) == PacketCells::Never
        {
            return CellStats::default();
        }
        let cached_cells = self
            .cached_cells
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        cached_cells
            .as_ref()
            .map_or(CellStats::default(), |last| CellStats {
                fresh: last.fresh,
                ..last.cells.stats()
            })
    }
}

impl CpuScene {
    /// Returns the cells that rays march through, in a region and down to a limit.
    fn spec<'a>(
        &self,
        region: Aabb,
        rule: &'a ScreenSpaceLeafLimit,
        max_split_clauses: u64,
    ) -> CellSpec<'a> {
        CellSpec {
            region,
            split: CellSplit::Volume,
            band: 0.0,
            margin: 0.0,
            rule,
            max_slope: self.facts.found_slope(),
            max_split_clauses,
        }
    }

    /// Returns the layout of cells with the least work for a picture.
    fn try_layouts(&self, job: &RenderJob) -> CellLayout {
        let prunes_well = policy::is_large(job, &self.tape) && self.is_pruning_profitable(job);
        let layout = if prunes_well {
            CellLayout::Fine
        } else {
            cell_trial::choose(self, job)
        };
        if layout == CellLayout::None {
            *self
                .cached_cells
                .lock()
                .unwrap_or_else(PoisonError::into_inner) = None;
        }
        layout
    }

    /// Reports whether the tapes of cells are so much shorter, and their slopes so much less, that cells are
    /// profitable for all rays.
    fn is_pruning_profitable(&self, job: &RenderJob) -> bool {
        let Some((region, pixels)) = policy::raw_field_cells(&job.uniforms) else {
            return false;
        };
        let spec = self.spec(region, &pixels, u64::MAX);
        let program = &*self.distance;
        trial::should_build_cells(program, &self.tape, &spec, &pixels)
            && self
                .cells(job, CellLayout::Fine, u64::MAX)
                .is_some_and(|cells| trial::should_use_cells(program, &cells))
    }

    fn evaluator_with<'a>(
        &'a self,
        cells: Option<&'a Cells>,
        is_pruning: bool,
    ) -> CpuEvaluator<'a> {
        let scene = EvaluatedScene {
            distance: &self.distance,
            tape: &self.tape,
            surface: self.surface.as_ref().map(|(program, tape)| (program, tape)),
            default_material: &self.default_material,
        };
        CpuEvaluator::new(scene, cells, is_pruning)
    }
}

/// Minimum number of clauses of a 2-D shape that is pruned for squares of the image. With 2 to 4 clauses
/// pruning gains nothing, with 8 it takes nine tenths of the time, with 18 six tenths.
const MIN_PLANE_PRUNE_CLAUSES: usize = 8;
/// Returns the name of this machine's threads as a device, with their arithmetic.
pub(crate) fn cpu_device(arithmetic: &str) -> String {
    match rayon::current_num_threads() {
        1 => format!("1 thread, {arithmetic}"),
        threads => format!("{threads} threads, {arithmetic}"),
    }
}

/// Returns the name of the instruction set that the tape evaluator selects.
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
