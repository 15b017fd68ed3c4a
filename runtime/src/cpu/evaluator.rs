//! Evaluation of programs on blocks of 64 points, on the tapes of cells and of boxes.

use super::work::{GRADIENT_RANGE_WORK, RANGE_WORK, step_work, streamed_work, value_work};
use super::{
    AabbLanes, Evaluator, F32x64, FieldQuantity, GradientRangeLanes, LANES, Points, RangeLanes,
    SurfaceBlock, morton, normal,
};
use crate::cells::{Aabb, CellSplit, Cells, MAX_BLOCKS, MortonKey, OnDemandCells};
use crate::engine::FieldSample;
use crate::render::Surface;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::FloatInterval;
use sdfc_vm::lanes::{with_identity_jacobian, with_identity_jacobian_of_boxes};
use sdfc_vm::program::Program;
use sdfc_vm::surface::{SURFACE_NUMBERS, SurfaceHook};
use sdfc_vm::tape::evaluator::TapeEvaluator;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::trace::Tracer;
use sdfc_vm::tape::{Clause, Tape};

/// The evaluators of one thread, each created on first use.
pub(super) struct CpuEvaluator<'a> {
    scene: EvaluatedScene<'a>,
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
    /// Work of evaluations for marches ([`super::work`]).
    work: u64,
    /// Index of the announced box that contains all points.
    selected_region: Option<usize>,
}

/// The programs of a scene.
#[derive(Clone, Copy)]
pub(super) struct EvaluatedScene<'a> {
    pub(super) distance: &'a Program,
    pub(super) tape: &'a Tape,
    pub(super) surface: Option<(&'a Program, &'a Tape)>,
    pub(super) default_material: &'a Surface,
}

impl<'a> CpuEvaluator<'a> {
    /// Creates an evaluator. It prunes tapes for announced boxes if `is_pruning` is true.
    pub(super) fn new(
        scene: EvaluatedScene<'a>,
        cells: Option<&'a Cells>,
        is_pruning: bool,
    ) -> Self {
        let on_demand = |tape: &Tape, cells: &Cells| {
            let is_long = tape.clauses.len() >= MIN_ON_DEMAND_CLAUSES;
            is_long.then(|| OnDemandCells::new(tape, *cells.region()))
        };
        Self {
            scene,
            is_pruning,
            cells,
            on_demand: cells.and_then(|cells| on_demand(scene.tape, cells)),
            surface_on_demand: scene
                .surface
                .zip(cells)
                .and_then(|((_, tape), cells)| on_demand(tape, cells)),
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

impl CpuEvaluator<'_> {
    /// Computes bounds of the distances in boxes on a tape that is valid there.
    fn ranges_on_tape(
        &mut self,
        tape: &[Clause],
        boxes: &AabbLanes,
        count: usize,
        out: &mut RangeLanes,
    ) {
        let full_tape = self.scene.tape;
        let tape_evaluator = self
            .range
            .get_or_insert_with(|| TapeEvaluator::new(full_tape.values, full_tape.points));
        self.work += step_work(tape, count, RANGE_WORK);
        tape_evaluator.inputs_mut().clone_from(boxes);
        out.clone_from(tape_evaluator.run(self.scene.distance, tape, count));
    }
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
                    .with_margin(CellSplit::Volume, 0.0)
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

/// Minimum number of clauses for looking up each point's cell. For 64 unordered points, the lookup takes
/// about two thirds of the time of a program of this length. Measured savings decide whether lookups continue
/// ([`OnDemandCells::are_cheaper_than_full_tape`]).
pub(super) const MIN_ON_DEMAND_CLAUSES: usize = 32;

/// Gathers the points of these keys into consecutive lanes.
fn gather(points: &[Points], keys: &[MortonKey], to: &mut Points) {
    for (lane_index, key) in keys.iter().enumerate() {
        let (block, lane) = key.block_and_lane();
        for (from, to) in points[block].iter().zip(to.iter_mut()) {
            to.0[lane_index] = from.0[lane];
        }
    }
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
        let (program, tape) = (self.scene.distance, self.scene.tape);
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
        let (program, tape) = (self.scene.distance, self.scene.tape);
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
        let full_tape = self.scene.tape;
        let tape_evaluator = self
            .distance
            .get_or_insert_with(|| TapeEvaluator::new(full_tape.values, full_tape.points));
        self.work += value_work(tape, count);
        tape_evaluator.inputs_mut().clone_from(points);
        out.clone_from(tape_evaluator.run(self.scene.distance, tape, count));
    }

    fn ranges(&mut self, boxes: &AabbLanes, count: usize, out: &mut RangeLanes) -> bool {
        // Without cells, rays take the same steps as on devices.
        if !self.is_pruning {
            return false;
        }
        let tape = &self.scene.tape.clauses;
        self.ranges_on_tape(tape, boxes, count, out);
        true
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
        self.ranges_on_tape(cells.tape(cell), boxes, count, out);
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
        let full_tape = self.scene.tape;
        let tape_evaluator = self
            .gradient_range
            .get_or_insert_with(|| TapeEvaluator::new(full_tape.values, full_tape.points));
        let tape = cells.tape(cell);
        self.work += step_work(tape, count, GRADIENT_RANGE_WORK);
        *tape_evaluator.inputs_mut() = with_identity_jacobian_of_boxes(boxes);
        out.clone_from(tape_evaluator.run(self.scene.distance, tape, count));
        true
    }

    fn is_raw(&self) -> bool {
        !self.scene.tape.lipschitz.is_bounded()
    }

    fn gradients(&mut self, points: &Points, count: usize, out: &mut [F32x64; 4]) {
        let (program, tape) = (self.scene.distance, self.scene.tape);
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
        let full_tape = self.scene.tape;
        let tape_evaluator = self
            .gradient
            .get_or_insert_with(|| TapeEvaluator::new(full_tape.values, full_tape.points));
        *tape_evaluator.inputs_mut() = with_identity_jacobian(points);
        out.clone_from(tape_evaluator.run(self.scene.distance, cells.tape(cell), count));
    }

    fn prune_for_regions(&mut self, quantity: FieldQuantity, regions: &[Aabb]) {
        self.selected_region = None;
        if !self.is_pruning {
            return;
        }
        match quantity {
            FieldQuantity::Distances => {
                let (program, tape) = (self.scene.distance, self.scene.tape);
                self.distance_tapes.prune(program, tape, regions);
            }
            FieldQuantity::Surfaces => {
                if let Some((program, tape)) = self.scene.surface {
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
        let default_material = self.scene.default_material;
        let Some((program, tape)) = self.scene.surface else {
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
            (&mut self.surface_on_demand, self.scene.surface)
        else {
            for (block, (points, out)) in points.iter().zip(out).enumerate() {
                let count = (count - block * LANES).min(LANES);
                self.surfaces(points, &normals[block], count, out);
            }
            return;
        };
        let tape_evaluator =
            surface_tape_evaluator(&mut self.surface, tape, self.scene.default_material);
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
pub(super) const MIN_SORT_POINTS: usize = 1024;

impl CpuEvaluator<'_> {
    /// Samples points of which each run of 64 are neighbours.
    pub(super) fn sample_batch_sorted(&mut self, points: &[[f32; 3]]) -> Vec<FieldSample> {
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
    pub(super) fn sample_chunk(&mut self, chunk: &[[f32; 3]]) -> Vec<FieldSample> {
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
        let sample = |lane: usize| {
            FieldSample::new(
                distances.0[lane],
                gradient_at(&gradients, lane),
                normal::surface_in_lane(&surfaces, lane),
            )
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
