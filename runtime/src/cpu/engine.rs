//! The CPU engine: programs on batches of 64 points, on all cores.

use super::cell_trial::{GRADIENT_RANGE_WORK, RANGE_WORK, STEP_WORK, layout_for_job};
use super::{
    AabbLanes, CellLayout, CellTrial, Evaluator, F32x64, FieldQuantity, GradientRangeLanes, LANES,
    Points, RangeLanes, RenderField, SurfaceBlock, morton, normal, plane_quadtree,
};
use crate::cells::policy::{self, PacketCells};
use crate::cells::split_rule::ScreenSpaceLeafLimit;
use crate::cells::{
    self, Aabb, CellInfo, CellSpec, CellSplit, Cells, MAX_BLOCKS, MortonKey, OnDemandCells, trial,
};
use crate::engine::{Engine, EngineError, EngineKind, FieldSample, SceneInput};
use crate::render::plane::plane_of;
use crate::render::{
    CellMode, CellStats, FieldFacts, Geometry, Image, Mode, PixelPlane, RenderJob, RenderProgress,
    RenderSettings, Samples, Surface, prepare,
};
use crate::settings::{default_material, field_facts};
use rayon::prelude::*;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::FloatInterval;
use sdfc_vm::lanes::{with_identity_jacobian, with_identity_jacobian_of_boxes};
use sdfc_vm::program::{Module, Program};
use sdfc_vm::surface::{SURFACE_NUMBERS, SurfaceHook};
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::trace::Tracer;
use sdfc_vm::tape::{Clause, Tape};
use std::sync::{Arc, Mutex, PoisonError};

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
    /// Decides whether cells are profitable, where that needs a trial.
    cell_trial: CellTrial,
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
        let (cell_trial, cached_cells) = match previous {
            Some(previous) if previous.distance.code == module.distance.code => {
                (previous.cell_trial, previous.cached_cells)
            }
            Some(previous) => (CellTrial::default(), previous.cached_cells),
            None => Default::default(),
        };
        Self {
            cell_trial,
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
        let cells = scene.cells(&job, layout_for_job(scene, &job));
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
        Ok(plane.map(|plane| plane_quadtree::sample(&scene.distance, &scene.tape, &plane, band)))
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
                    || scene.evaluator_with(None),
                    |evaluator, chunk| evaluator.sample_chunk(chunk),
                )
                .collect();
            return Ok(batches.concat());
        }
        let order = morton::morton_order(points);
        let pruning_evaluator = || CpuEvaluator {
            is_pruning: true,
            ..scene.evaluator_with(None)
        };
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
    fn packet_cells(&self, job: &RenderJob) -> PacketCells {
        PacketCells::for_job(job, &self.tape)
    }
    fn cell_trial(&self) -> Option<&CellTrial> {
        Some(&self.cell_trial)
    }
    fn is_pruning_profitable(&self, job: &RenderJob) -> bool {
        let Some((region, pixels)) = policy::raw_field_cells(&job.uniforms) else {
            return false;
        };
        let spec = CellSpec {
            region,
            split: CellSplit::Volume,
            band: 0.0,
            rule: &pixels,
        };
        let program = &*self.distance;
        trial::should_build_cells(program, &self.tape, &spec, &pixels)
            && self
                .cells(job, CellLayout::Fine)
                .is_some_and(|cells| trial::should_use_cells(program, &cells))
    }
    fn cells(&self, job: &RenderJob, layout: CellLayout) -> Option<Arc<Cells>> {
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
        let spec = CellSpec {
            region,
            split: CellSplit::Volume,
            band: 0.0,
            rule: &pixels,
        };
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
    fn sample_plane(&self, job: &RenderJob, plane: &PixelPlane, band: f32) -> Option<Vec<f32>> {
        let is_pruned = match job.cells {
            CellMode::Never => false,
            CellMode::Auto => self.tape.clauses.len() >= MIN_PLANE_PRUNE_CLAUSES,
            CellMode::Always | CellMode::Cpu | CellMode::Gpu => true,
        };
        is_pruned.then(|| plane_quadtree::sample(&self.distance, &self.tape, plane, band))
    }
    fn evaluator<'a>(
        &'a self,
        job: &RenderJob,
        cells: Option<&'a Cells>,
    ) -> Box<dyn Evaluator + 'a> {
        Box::new(CpuEvaluator {
            is_pruning: job.cells != CellMode::Never,
            ..self.evaluator_with(cells)
        })
    }
}

impl CpuScene {
    /// Returns the counts of the cells of the last image.
    fn cell_stats(&self, job: &RenderJob) -> CellStats {
        let has_cells = match PacketCells::for_job(job, &self.tape) {
            PacketCells::Never => false,
            PacketCells::Trial => !self.cell_trial.has_rejected_cells(),
            PacketCells::Always => true,
        };
        if job.shows_plane() || !has_cells {
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
    fn evaluator_with<'a>(&'a self, cells: Option<&'a Cells>) -> CpuEvaluator<'a> {
        let on_demand = |tape: &Tape, cells: &Cells| {
            let is_long = tape.clauses.len() >= MIN_ON_DEMAND_CLAUSES;
            is_long.then(|| OnDemandCells::new(tape, *cells.region()))
        };
        let surface = self.surface.as_ref().map(|(_, tape)| tape);
        CpuEvaluator {
            scene: self,
            is_pruning: false,
            cells,
            on_demand: cells.and_then(|cells| on_demand(&self.tape, cells)),
            surface_on_demand: surface
                .zip(cells)
                .and_then(|(tape, cells)| on_demand(tape, cells)),
            distance: None,
            range: None,
            gradient_range: None,
            gradient: None,
            surface: None,
            distance_tapes: PrunedTapes::default(),
            surface_tapes: PrunedTapes::default(),
            work: 0,
            selected_region: None,
        }
    }
}

/// The evaluators of one thread, each created on first use.
struct CpuEvaluator<'a> {
    scene: &'a CpuScene,
    /// Set if tapes are pruned for announced boxes.
    is_pruning: bool,
    cells: Option<&'a Cells>,
    /// On-demand cells for unordered points, where looking them up is profitable.
    on_demand: Option<OnDemandCells>,
    /// On-demand cells for surfaces.
    surface_on_demand: Option<OnDemandCells>,
    distance: Option<TapeEvaluator<f32>>,
    range: Option<TapeEvaluator<FloatInterval>>,
    gradient_range: Option<TapeEvaluator<Dual<FloatInterval>>>,
    gradient: Option<TapeEvaluator<Dual<f32>>>,
    surface: Option<TapeEvaluator<Dual<f32>, SurfaceHook>>,
    distance_tapes: PrunedTapes,
    surface_tapes: PrunedTapes,
    /// Work of evaluations for marches, in units of the trial of cells.
    work: u64,
    /// Index of the announced box that contains all points.
    selected_region: Option<usize>,
}

/// Tapes pruned for announced boxes.
#[derive(Default)]
struct PrunedTapes {
    /// Created on first use.
    tracer: Option<Tracer>,
    pruner: Pruner,
    clauses: Vec<Clause>,
    /// The range of each box's clauses.
    ranges: Vec<(usize, usize)>,
}

/// Minimum number of clauses of a program that is pruned for boxes. Tracing a shorter one takes about as long
/// as running it.
const MIN_PRUNE_CLAUSES: usize = 8;

impl PrunedTapes {
    /// Prunes a tape for boxes.
    fn prune(&mut self, program: &Program, tape: &Tape, regions: &[Aabb]) {
        self.clear();
        if tape.clauses.len() < MIN_PRUNE_CLAUSES {
            return;
        }
        let tracer = self.tracer.get_or_insert_with(|| Tracer::new(tape));
        self.pruner.reserve(tape.values, tape.points);
        for regions in regions.chunks(LANES) {
            let boxes = tracer.boxes();
            for (lane, region) in regions.iter().enumerate() {
                region
                    .with_margin(CellSplit::Volume)
                    .write_lane(boxes, lane);
            }
            tracer.run(program, &tape.clauses, regions.len());
            for lane in 0..regions.len() {
                let start = self.clauses.len();
                let choice = |clause| tracer.trace().choice(clause, lane);
                self.pruner.prune(&tape.clauses, choice, &mut self.clauses);
                self.ranges.push((start, self.clauses.len()));
            }
        }
    }

    fn clear(&mut self) {
        self.clauses.clear();
        self.ranges.clear();
    }

    fn get(&self, region: Option<usize>) -> Option<&[Clause]> {
        let &(start, end) = self.ranges.get(region?)?;
        Some(&self.clauses[start..end])
    }
}

/// Minimum number of clauses of a 2-D shape that is pruned for squares of the image. With 2 to 4 clauses
/// pruning gains nothing, with 8 it takes nine tenths of the time, with 18 six tenths.
const MIN_PLANE_PRUNE_CLAUSES: usize = 8;
/// Minimum number of clauses for looking up each point's cell. For 64 unordered points, the lookup takes
/// about two thirds of the time of a program of this length. Measured savings decide whether lookups continue
/// ([`OnDemandCells::are_cheaper_than_full_tape`]).
const MIN_ON_DEMAND_CLAUSES: usize = 32;

/// Gathers the points of these keys into consecutive lanes.
fn gather(points: &[Points], keys: &[MortonKey], to: &mut Points) {
    for (lane_index, key) in keys.iter().enumerate() {
        let (block, lane) = key.block_and_lane();
        for (from, to) in points[block].iter().zip(to.iter_mut()) {
            to.0[lane_index] = from.0[lane];
        }
    }
}

/// Returns the cost of a clause for a number of points: groups of four, and the fixed cost of three groups.
fn chunks(count: usize) -> u64 {
    2 * count.div_ceil(8) as u64 + 3
}

/// Returns the work of a step of `count` rays in a stream, which fills all lanes as long as there are rays.
fn streamed_work(tape: &[Clause], count: usize) -> u64 {
    step_work(tape, LANES) * count as u64 / LANES as u64
}

/// Returns the work of a step of `count` rays.
fn step_work(tape: &[Clause], count: usize) -> u64 {
    (STEP_WORK + tape.len() as u64) * chunks(count)
}

impl Evaluator for CpuEvaluator<'_> {
    fn work(&self) -> u64 {
        self.work
    }

    fn distances(&mut self, points: &Points, count: usize, out: &mut F32x64) {
        if self.on_demand.is_some() && self.distance_tapes.get(self.selected_region).is_none() {
            let (points, out) = (std::slice::from_ref(points), std::slice::from_mut(out));
            return self.distances_many(points, count, out);
        }
        let (program, tape) = (&self.scene.distance, &self.scene.tape);
        let tape_evaluator = self
            .distance
            .get_or_insert_with(|| TapeEvaluator::new(tape.values, tape.points));
        let clauses = self
            .distance_tapes
            .get(self.selected_region)
            .unwrap_or(&tape.clauses);
        self.work += streamed_work(clauses, count);
        tape_evaluator.inputs_mut().clone_from(points);
        out.clone_from(tape_evaluator.run(program, clauses, count));
    }

    fn preferred_blocks(&self, quantity: FieldQuantity) -> usize {
        let on_demand = match quantity {
            FieldQuantity::Distances => &self.on_demand,
            FieldQuantity::Surfaces => &self.surface_on_demand,
        };
        if on_demand.is_some() { MAX_BLOCKS } else { 1 }
    }

    fn distances_many(&mut self, points: &[Points], count: usize, out: &mut [F32x64]) {
        let (program, tape) = (&self.scene.distance, &self.scene.tape);
        let Some(on_demand) = &mut self.on_demand else {
            for (block, (points, out)) in points.iter().zip(out).enumerate() {
                self.distances(points, (count - block * LANES).min(LANES), out);
            }
            return;
        };
        let tape_evaluator = self
            .distance
            .get_or_insert_with(|| TapeEvaluator::new(tape.values, tape.points));
        on_demand.for_each_batch(program, points, count, |keys, clauses| {
            self.work += streamed_work(clauses, keys.len());
            gather(points, keys, tape_evaluator.inputs_mut());
            let values = tape_evaluator.run(program, clauses, keys.len());
            for (value, key) in values.0.iter().zip(keys) {
                let (block, lane) = key.block_and_lane();
                out[block].0[lane] = *value;
            }
        });
        // Without cells the values are the same.
        if !on_demand.are_cheaper_than_full_tape() {
            self.on_demand = None;
        }
    }

    fn distances_in_cell(&mut self, cell: u32, points: &Points, count: usize, out: &mut F32x64) {
        let Some(cells) = self.cells else {
            return self.distances(points, count, out);
        };
        let tape = cells.tape(cell);
        let full_tape = &self.scene.tape;
        let tape_evaluator = self
            .distance
            .get_or_insert_with(|| TapeEvaluator::new(full_tape.values, full_tape.points));
        self.work += step_work(tape, count);
        tape_evaluator.inputs_mut().clone_from(points);
        out.clone_from(tape_evaluator.run(&self.scene.distance, tape, count));
    }

    fn ranges_in_cell(
        &mut self,
        cell: u32,
        boxes: &AabbLanes,
        count: usize,
        out: &mut RangeLanes,
    ) -> bool {
        let Some(cells) = self.cells else {
            return false;
        };
        let full_tape = &self.scene.tape;
        let tape_evaluator = self
            .range
            .get_or_insert_with(|| TapeEvaluator::new(full_tape.values, full_tape.points));
        let tape = cells.tape(cell);
        self.work += (STEP_WORK + RANGE_WORK * tape.len() as u64) * chunks(count);
        tape_evaluator.inputs_mut().clone_from(boxes);
        out.clone_from(tape_evaluator.run(&self.scene.distance, tape, count));
        true
    }

    fn gradient_ranges_in_cell(
        &mut self,
        cell: u32,
        boxes: &AabbLanes,
        count: usize,
        out: &mut GradientRangeLanes,
    ) -> bool {
        let Some(cells) = self.cells else {
            return false;
        };
        let full_tape = &self.scene.tape;
        let tape_evaluator = self
            .gradient_range
            .get_or_insert_with(|| TapeEvaluator::new(full_tape.values, full_tape.points));
        let tape = cells.tape(cell);
        self.work += (STEP_WORK + GRADIENT_RANGE_WORK * tape.len() as u64) * chunks(count);
        *tape_evaluator.inputs_mut() = with_identity_jacobian_of_boxes(boxes);
        out.clone_from(tape_evaluator.run(&self.scene.distance, tape, count));
        true
    }

    fn is_raw(&self) -> bool {
        !self.scene.tape.lipschitz.is_bounded()
    }

    fn gradients(&mut self, points: &Points, count: usize, out: &mut [F32x64; 4]) {
        let (program, tape) = (&self.scene.distance, &self.scene.tape);
        let mut tape_evaluator = self
            .gradient
            .take()
            .unwrap_or_else(|| TapeEvaluator::new(tape.values, tape.points));
        match (
            self.distance_tapes.get(self.selected_region),
            &mut self.on_demand,
        ) {
            (Some(clauses), _) => {
                *tape_evaluator.inputs_mut() = with_identity_jacobian(points);
                out.clone_from(tape_evaluator.run(program, clauses, count));
            }
            (None, None) => {
                *tape_evaluator.inputs_mut() = with_identity_jacobian(points);
                out.clone_from(tape_evaluator.run(program, &tape.clauses, count));
            }
            (None, Some(on_demand)) => {
                let mut lane_points = Points::default();
                let points = std::slice::from_ref(points);
                on_demand.for_each_batch(program, points, count, |keys, clauses| {
                    gather(points, keys, &mut lane_points);
                    *tape_evaluator.inputs_mut() = with_identity_jacobian(&lane_points);
                    let values = tape_evaluator.run(program, clauses, keys.len());
                    for (values, out) in values.iter().zip(out.iter_mut()) {
                        for (value, key) in values.0.iter().zip(keys) {
                            out.0[key.block_and_lane().1] = *value;
                        }
                    }
                });
            }
        }
        self.gradient = Some(tape_evaluator);
    }

    fn cell_contains(&self, cell: u32, point: [f32; 3]) -> bool {
        self.cells
            .is_some_and(|cells| cells.cell(cell).region.contains(point))
    }

    fn tape_id(&self, cell: u32) -> u64 {
        self.cells.map_or(0, |cells| cells.tape_key(cell))
    }

    fn gradients_in_cell(
        &mut self,
        cell: u32,
        points: &Points,
        count: usize,
        out: &mut [F32x64; 4],
    ) {
        let Some(cells) = self.cells else {
            return self.gradients(points, count, out);
        };
        let full_tape = &self.scene.tape;
        let tape_evaluator = self
            .gradient
            .get_or_insert_with(|| TapeEvaluator::new(full_tape.values, full_tape.points));
        *tape_evaluator.inputs_mut() = with_identity_jacobian(points);
        out.clone_from(tape_evaluator.run(&self.scene.distance, cells.tape(cell), count));
    }

    fn prune_for_regions(&mut self, quantity: FieldQuantity, regions: &[Aabb]) {
        self.selected_region = None;
        if !self.is_pruning {
            return;
        }
        match quantity {
            FieldQuantity::Distances => {
                let (program, tape) = (&self.scene.distance, &self.scene.tape);
                self.distance_tapes.prune(program, tape, regions);
            }
            FieldQuantity::Surfaces => {
                if let Some((program, tape)) = &self.scene.surface {
                    self.surface_tapes.prune(program, tape, regions);
                }
            }
        }
    }

    fn select_region(&mut self, region: Option<usize>) {
        self.selected_region = region;
    }

    fn surfaces(
        &mut self,
        points: &Points,
        normals: &Points,
        count: usize,
        out: &mut SurfaceBlock,
    ) {
        let default_material = &self.scene.default_material;
        let Some((program, tape)) = &self.scene.surface else {
            *out = surface_numbers(default_material).map(|number| F32x64([number; LANES]));
            return;
        };
        let tape_evaluator = surface_tape_evaluator(&mut self.surface, tape, default_material);
        tape_evaluator.hook().set_points(points, normals);
        *tape_evaluator.inputs_mut() = with_identity_jacobian(points);
        let clauses = self
            .surface_tapes
            .get(self.selected_region)
            .unwrap_or(&tape.clauses);
        tape_evaluator.run(program, clauses, count);
        out.clone_from(tape_evaluator.hook().surface());
    }

    fn surfaces_many(
        &mut self,
        points: &[Points],
        normals: &[Points],
        count: usize,
        out: &mut [SurfaceBlock],
    ) {
        let (Some(on_demand), Some((program, tape))) =
            (&mut self.surface_on_demand, &self.scene.surface)
        else {
            for (block, (points, out)) in points.iter().zip(out).enumerate() {
                let count = (count - block * LANES).min(LANES);
                self.surfaces(points, &normals[block], count, out);
            }
            return;
        };
        let tape_evaluator =
            surface_tape_evaluator(&mut self.surface, tape, &self.scene.default_material);
        let (mut lane_points, mut lane_normals) = (Points::default(), Points::default());
        on_demand.for_each_batch(program, points, count, |keys, clauses| {
            gather(points, keys, &mut lane_points);
            gather(normals, keys, &mut lane_normals);
            *tape_evaluator.inputs_mut() = with_identity_jacobian(&lane_points);
            tape_evaluator
                .hook()
                .set_points(&lane_points, &lane_normals);
            tape_evaluator.run(program, clauses, keys.len());
            let surface = tape_evaluator.hook().surface();
            for (number, values) in surface.iter().enumerate() {
                for (value, key) in values.0.iter().zip(keys) {
                    let (block, lane) = key.block_and_lane();
                    out[block][number].0[lane] = *value;
                }
            }
        });
        if !on_demand.are_cheaper_than_full_tape() {
            self.surface_on_demand = None;
        }
    }
}

/// Returns the tape evaluator for surfaces, created on first use.
fn surface_tape_evaluator<'a>(
    slot: &'a mut Option<TapeEvaluator<Dual<f32>, SurfaceHook>>,
    tape: &Tape,
    default_material: &Surface,
) -> &'a mut TapeEvaluator<Dual<f32>, SurfaceHook> {
    slot.get_or_insert_with(|| {
        let mut tape_evaluator: TapeEvaluator<Dual<f32>, SurfaceHook> =
            TapeEvaluator::new(tape.values, tape.points);
        tape_evaluator.hook().default_material = surface_numbers(default_material);
        tape_evaluator
    })
}

/// Minimum number of points for which sorting is profitable.
const MIN_SORT_POINTS: usize = 1024;

impl CpuEvaluator<'_> {
    /// Samples points of which each run of 64 are neighbours.
    fn sample_batch_sorted(&mut self, points: &[[f32; 3]]) -> Vec<FieldSample> {
        let regions: Vec<Aabb> = points
            .chunks(LANES)
            .map(|chunk| Aabb::around(chunk.iter().copied()))
            .collect();
        self.prune_for_regions(FieldQuantity::Distances, &regions);
        self.prune_for_regions(FieldQuantity::Surfaces, &regions);
        let mut samples = Vec::with_capacity(points.len());
        for (region, chunk) in points.chunks(LANES).enumerate() {
            let is_bounded = chunk.iter().all(morton::is_finite);
            self.select_region(is_bounded.then_some(region));
            samples.extend(self.sample_chunk(chunk));
        }
        self.select_region(None);
        samples
    }

    /// Samples at most 64 points.
    fn sample_chunk(&mut self, chunk: &[[f32; 3]]) -> Vec<FieldSample> {
        let mut points = Points::default();
        for lane in 0..LANES {
            // Unused lanes repeat the last point.
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
        let mut distances = F32x64::default();
        let mut gradients = <[F32x64; 4]>::default();
        let mut surfaces = SurfaceBlock::default();
        self.distances(&points, count, &mut distances);
        self.gradients(&points, count, &mut gradients);
        let mut normals = Points::default();
        for lane in 0..LANES {
            let normal = normal::direction(gradient_at(&gradients, lane));
            for (column, coordinate) in normals.iter_mut().zip(normal) {
                column.0[lane] = coordinate;
            }
        }
        self.surfaces(&points, &normals, count, &mut surfaces);
        let sample = |lane: usize| FieldSample {
            distance: distances.0[lane],
            gradient: gradient_at(&gradients, lane),
            surface: normal::surface_in_lane(&surfaces, lane),
        };
        (0..count).map(sample).collect()
    }
}

fn gradient_at(gradients: &[F32x64; 4], lane: usize) -> [f32; 3] {
    std::array::from_fn(|axis| gradients[axis].0[lane])
}

/// Returns the components of a surface, in the order of [`SurfaceBlock`].
fn surface_numbers(surface: &Surface) -> [f32; SURFACE_NUMBERS] {
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
