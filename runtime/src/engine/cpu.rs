//! The CPU engine: programs on batches of 64 points, all cores.

use super::{Engine, EngineError, EngineKind, Loaded, Sample, cut, order};
use crate::cells::{self, Cells, Cut, Lazy, Region, Split};
use crate::cpu::figure::{self, Plane};
use crate::cpu::{
    self, Asked, Boxes, Column, Evaluator, Field, Geometry, LANES, Points, Range, SurfaceBlock,
};
use crate::frame::{
    CellStats, CellUse, FieldFacts, Frame, Mode, Picture, RenderSettings, Surface, prepare,
};
use crate::settings::{facts, unpainted};
use rayon::prelude::*;
use sdfc_vm::dual::Dual;
use sdfc_vm::interval::FloatInterval;
use sdfc_vm::lanes::seeded;
use sdfc_vm::program::{Module, Program};
use sdfc_vm::surface::{NUMBERS, Surfaces};
use sdfc_vm::tape::choose::Chooser;
use sdfc_vm::tape::machine::Machine;
use sdfc_vm::tape::prune::Pruner;
use sdfc_vm::tape::{Clause, Tape};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Runs the loaded scene's programs on the cores of this machine.
#[derive(Default)]
pub(super) struct CpuEngine {
    scene: Option<Scene>,
}

/// What of a module is run.
struct Scene {
    distance: Arc<Program>,
    surface: Option<(Program, Tape)>,
    tape: Arc<Tape>,
    facts: FieldFacts,
    unpainted: Surface,
    /// The cells of the last picture, perhaps of the scene as it was before an edit.
    last: Mutex<Option<Last>>,
    surface_cells: OnceLock<Arc<Cells>>,
}

/// The cells of a picture, and what they were made for.
struct Last {
    program: Arc<Program>,
    tape: Arc<Tape>,
    pixels: cut::Pixels,
    cells: Arc<Cells>,
}

impl Scene {
    fn of(module: &Module, outputs: &[f64], before: Option<Self>) -> Self {
        let last = before.map(|before| before.last);
        Self {
            last: last.unwrap_or_default(),
            surface_cells: OnceLock::new(),
            distance: Arc::new(module.distance.clone()),
            surface: module.surface.clone().map(|p| {
                let tape = Tape::of(&p);
                (p, tape)
            }),
            tape: Arc::new(Tape::of(&module.distance)),
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
        self.scene = Some(Scene::of(scene.module, scene.outputs, self.scene.take()));
        Ok(())
    }

    fn update(&mut self, module: &Module, outputs: &[f64]) -> Result<(), EngineError> {
        let scene = self.scene()?;
        let same = scene.distance.code == module.distance.code
            && scene.surface.as_ref().map(|(p, _)| &p.code)
                == module.surface.as_ref().map(|p| &p.code);
        if !same {
            return Err(EngineError::AnotherScene);
        }
        self.scene = Some(Scene::of(module, outputs, self.scene.take()));
        Ok(())
    }

    fn render(
        &mut self,
        settings: &RenderSettings,
        progress: &(dyn Fn(f32) + Sync),
    ) -> Result<Frame, EngineError> {
        let scene = self.scene()?;
        let picture = prepare(settings, &scene.facts);
        let mut frame = cpu::render(scene, &picture, progress);
        frame.stats.cells = scene.cells_made(&picture);
        Ok(frame)
    }

    fn figure(
        &mut self,
        settings: &RenderSettings,
        band: f32,
    ) -> Result<Option<Vec<f32>>, EngineError> {
        let scene = self.scene()?;
        let plane = super::plane(settings);
        Ok(plane.map(|plane| figure::sample(&scene.distance, &scene.tape, &plane, band)))
    }

    fn geometry(&mut self, settings: &RenderSettings) -> Result<Geometry, EngineError> {
        let scene = self.scene()?;
        let settings = RenderSettings {
            mode: Mode::Normal,
            aa: 1,
            ..settings.clone()
        };
        Ok(cpu::geometry(scene, &prepare(&settings, &scene.facts)))
    }

    fn query(&mut self, points: &[[f32; 3]]) -> Result<Vec<Sample>, EngineError> {
        let scene = self.scene()?;
        if points.len() < MANY || scene.tape.clauses.len() < LONG {
            let batches: Vec<Vec<Sample>> = points
                .par_chunks(LANES)
                .map_init(|| scene.asker(None), |asker, chunk| asker.samples(chunk))
                .collect();
            return Ok(batches.concat());
        }
        let order = order::by_place(points);
        let pruning = || Asker {
            pruned: true,
            ..scene.asker(None)
        };
        let batches: Vec<Vec<Sample>> = order
            .par_chunks(LANES * LANES)
            .map_init(pruning, |asker, numbers| {
                let near: Vec<[f32; 3]> = numbers.iter().map(|&n| points[n as usize]).collect();
                asker.samples_nearby(&near)
            })
            .collect();
        let mut samples = vec![Sample::default(); points.len()];
        for (sample, number) in batches.into_iter().flatten().zip(order) {
            samples[number as usize] = sample;
        }
        Ok(samples)
    }
}

impl Field for Scene {
    fn facts(&self) -> FieldFacts {
        self.facts
    }
    fn cells(&self, picture: &Picture) -> Option<Arc<Cells>> {
        if !cut::wanted(picture, &self.distance, &self.tape) {
            return None;
        }
        let region = cut::region(&picture.uniforms)?;
        self.cut_surfaces(picture, region);
        let pixels = match self.tape.slopes.known() {
            true => cut::Pixels::of(&picture.uniforms),
            false => cut::Pixels::of_raw(&picture.uniforms),
        };
        let cut = Cut {
            region,
            split: Split::Cube,
            band: 0.0,
            refine: &pixels,
        };
        let new = (&*self.distance, &*self.tape);
        let mut last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let kept = last.take().filter(|last| last.pixels == pixels);
        let kept =
            kept.and_then(|last| cells::again(&last.cells, (&last.program, &last.tape), new, &cut));
        let cells = kept.unwrap_or_else(|| Arc::new(cells::build(new.0, new.1, &cut)));
        *last = Some(Last {
            program: self.distance.clone(),
            tape: self.tape.clone(),
            pixels,
            cells: cells.clone(),
        });
        Some(cells)
    }
    fn figure(&self, picture: &Picture, plane: &Plane, band: f32) -> Option<Vec<f32>> {
        let wanted = match picture.cells {
            CellUse::Never => false,
            CellUse::Auto => self.tape.clauses.len() >= LONG,
            CellUse::Always | CellUse::Processor | CellUse::Device => true,
        };
        wanted.then(|| figure::sample(&self.distance, &self.tape, plane, band))
    }
    fn evaluator<'a>(
        &'a self,
        picture: &Picture,
        cells: Option<&'a Cells>,
    ) -> Box<dyn Evaluator + 'a> {
        Box::new(Asker {
            pruned: picture.cells != CellUse::Never,
            surface_cells: cells.and(self.surface_cells.get()).cloned(),
            ..self.asker(cells)
        })
    }
}

/// Programs of surfaces with so many clauses get cells: each 64 points then begin with a short tape.
const MANY_CLAUSES: usize = 256;

impl Scene {
    /// What came of cutting space for the picture that was drawn last.
    fn cells_made(&self, picture: &Picture) -> CellStats {
        if picture.shows_plane() || !cut::wanted(picture, &self.distance, &self.tape) {
            return CellStats::default();
        }
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        let surfaces = self.surface_cells.get();
        let all = last.iter().map(|last| &last.cells).chain(surfaces);
        all.fold(CellStats::default(), |sum, cells| sum.and(cells.counts()))
    }

    /// Makes the cells of the program of surfaces, once for a scene.
    fn cut_surfaces(&self, picture: &Picture, region: Region) {
        let Some((program, tape)) = &self.surface else {
            return;
        };
        if tape.clauses.len() < MANY_CLAUSES || !picture.features.materials {
            return;
        }
        self.surface_cells.get_or_init(|| {
            let cut = Cut {
                region,
                split: Split::Cube,
                band: 0.0,
                refine: &cut::Coarse::of(&picture.uniforms),
            };
            Arc::new(cells::build(program, tape, &cut))
        });
    }
}

impl Scene {
    fn asker<'a>(&'a self, cells: Option<&'a Cells>) -> Asker<'a> {
        let long = self.tape.clauses.len() >= LONG;
        Asker {
            scene: self,
            pruned: false,
            cells,
            surface_cells: None,
            lazy: cells
                .filter(|_| long)
                .map(|cells| Lazy::new(&self.tape, *cells.region())),
            distance: None,
            range: None,
            gradient: None,
            surface: None,
            distance_tapes: RegionTapes::default(),
            surface_tapes: RegionTapes::default(),
            focus: None,
        }
    }
}

/// The memory of one thread; each part is made when it is first needed.
struct Asker<'a> {
    scene: &'a Scene,
    /// Whether tapes are pruned for the boxes that are announced.
    pruned: bool,
    cells: Option<&'a Cells>,
    /// Those of the program of surfaces, where it is long.
    surface_cells: Option<Arc<Cells>>,
    /// Cells for points that come in no order, where looking them up pays.
    lazy: Option<Lazy>,
    distance: Option<Machine<f32>>,
    range: Option<Machine<FloatInterval>>,
    gradient: Option<Machine<Dual<f32>>>,
    surface: Option<Machine<Dual<f32>, Surfaces>>,
    distance_tapes: RegionTapes,
    surface_tapes: RegionTapes,
    /// Which of the announced boxes all points lie in.
    focus: Option<usize>,
}

/// Tapes pruned for the boxes that were announced.
#[derive(Default)]
struct RegionTapes {
    /// Made when it is first needed.
    chooser: Option<Chooser>,
    pruner: Pruner,
    clauses: Vec<Clause>,
    /// Where each box's clauses are.
    places: Vec<(usize, usize)>,
    /// The cells that hold the boxes, and their numbers.
    homes: Vec<(Option<u32>, usize)>,
}

/// Programs of fewer clauses are run as they are: choosing takes about as long.
const SHORT: usize = 8;

impl RegionTapes {
    /// Prunes a tape for boxes, from what cells have left of it where they hold a box.
    fn prune(&mut self, program: &Program, tape: &Tape, cells: Option<&Cells>, regions: &[Region]) {
        self.clauses.clear();
        self.places.clear();
        if tape.clauses.len() < SHORT {
            return;
        }
        let chooser = self.chooser.get_or_insert_with(|| Chooser::new(tape));
        self.pruner.reserve(tape.values, tape.points);
        self.places.resize(regions.len(), (0, 0));
        // Those that begin with the same tape are looked at together.
        self.homes.clear();
        let home = |region| cells.and_then(|cells| cells.home(region));
        self.homes.extend(regions.iter().map(home).zip(0..));
        self.homes.sort_unstable();
        for group in self.homes.chunk_by(|a, b| a.0 == b.0) {
            let tape = match (cells, group[0].0) {
                (Some(cells), Some(home)) => cells.tape(home),
                _ => &tape.clauses,
            };
            for group in group.chunks(LANES) {
                let boxes = chooser.boxes();
                for (lane, &(_, region)) in group.iter().enumerate() {
                    let region: &Region = &regions[region];
                    region.with_margin(Split::Cube).put(boxes, lane);
                }
                chooser.run(program, tape, group.len());
                for (lane, &(_, region)) in group.iter().enumerate() {
                    let start = self.clauses.len();
                    let choice = |place| chooser.decided().choice(place, lane);
                    self.pruner.prune(tape, choice, &mut self.clauses);
                    self.places[region] = (start, self.clauses.len());
                }
            }
        }
    }

    fn get(&self, region: Option<usize>) -> Option<&[Clause]> {
        let &(start, end) = self.places.get(region?)?;
        Some(&self.clauses[start..end])
    }
}

/// Programs of so many clauses are worth looking up each point's cell: for 64 points in no order,
/// that takes about as long as they do.
const LONG: usize = 48;

/// Points that lie in the same cell, and their lanes.
struct Group {
    lanes: [u8; LANES],
    count: usize,
}

/// Hands the points to `each` cell by cell.
fn by_cell(
    program: &Program,
    lazy: &mut Lazy,
    points: &Points,
    count: usize,
    mut each: impl FnMut(&Group, &[Clause]),
) {
    let mut found = [0; LANES];
    lazy.find(program, points, count, &mut found);
    let mut left = u64::MAX >> (LANES - count.clamp(1, LANES));
    while left != 0 {
        let cell = found[left.trailing_zeros() as usize];
        let mut group = Group {
            lanes: [0; LANES],
            count: 0,
        };
        let mut rest = left;
        while rest != 0 {
            let lane = rest.trailing_zeros();
            rest &= rest - 1;
            if found[lane as usize] == cell {
                group.lanes[group.count] = lane as u8;
                group.count += 1;
                left &= !(1 << lane);
            }
        }
        each(&group, lazy.tape(cell));
    }
}

impl Group {
    /// Its points, side by side.
    fn gather(&self, points: &Points, to: &mut Points) {
        for (from, to) in points.iter().zip(to) {
            for (number, &lane) in to.0.iter_mut().zip(&self.lanes[..self.count]) {
                *number = from.0[usize::from(lane)];
            }
        }
    }
    /// Its values, back to their lanes.
    fn scatter(&self, values: &Column, to: &mut Column) {
        for (number, &lane) in values.0.iter().zip(&self.lanes[..self.count]) {
            to.0[usize::from(lane)] = *number;
        }
    }
}

impl Evaluator for Asker<'_> {
    fn distances(&mut self, points: &Points, count: usize, out: &mut Column) {
        let (program, tape) = (&self.scene.distance, &self.scene.tape);
        let mut machine = self
            .distance
            .take()
            .unwrap_or_else(|| Machine::new(tape.values, tape.points));
        match (self.distance_tapes.get(self.focus), &mut self.lazy) {
            (Some(clauses), _) => {
                machine.seed().clone_from(points);
                out.clone_from(machine.run(program, clauses, count));
            }
            (None, None) => {
                machine.seed().clone_from(points);
                out.clone_from(machine.run(program, &tape.clauses, count));
            }
            (None, Some(lazy)) => by_cell(program, lazy, points, count, |group, clauses| {
                group.gather(points, machine.seed());
                group.scatter(machine.run(program, clauses, group.count), out);
            }),
        }
        self.distance = Some(machine);
    }

    fn distances_in(&mut self, cell: u32, points: &Points, count: usize, out: &mut Column) {
        let Some(cells) = self.cells else {
            return self.distances(points, count, out);
        };
        let tape = cells.tape(cell);
        let whole = &self.scene.tape;
        let machine = self
            .distance
            .get_or_insert_with(|| Machine::new(whole.values, whole.points));
        machine.seed().clone_from(points);
        out.clone_from(machine.run(&self.scene.distance, tape, count));
    }

    fn ranges_in(&mut self, cell: u32, boxes: &Boxes, count: usize, out: &mut Range) -> bool {
        let Some(cells) = self.cells else {
            return false;
        };
        let whole = &self.scene.tape;
        let machine = self
            .range
            .get_or_insert_with(|| Machine::new(whole.values, whole.points));
        machine.seed().clone_from(boxes);
        out.clone_from(machine.run(&self.scene.distance, cells.tape(cell), count));
        true
    }

    fn is_raw(&self) -> bool {
        !self.scene.tape.slopes.known()
    }

    fn gradients(&mut self, points: &Points, count: usize, out: &mut [Column; 4]) {
        let (program, tape) = (&self.scene.distance, &self.scene.tape);
        let mut machine = self
            .gradient
            .take()
            .unwrap_or_else(|| Machine::new(tape.values, tape.points));
        match (self.distance_tapes.get(self.focus), &mut self.lazy) {
            (Some(clauses), _) => {
                *machine.seed() = seeded(points);
                out.clone_from(machine.run(program, clauses, count));
            }
            (None, None) => {
                *machine.seed() = seeded(points);
                out.clone_from(machine.run(program, &tape.clauses, count));
            }
            (None, Some(lazy)) => {
                let mut own = Points::default();
                by_cell(program, lazy, points, count, |group, clauses| {
                    group.gather(points, &mut own);
                    *machine.seed() = seeded(&own);
                    let values = machine.run(program, clauses, group.count);
                    for (values, out) in values.iter().zip(out.iter_mut()) {
                        group.scatter(values, out);
                    }
                });
            }
        }
        self.gradient = Some(machine);
    }

    fn announce(&mut self, asked: Asked, regions: &[Region]) {
        self.focus = None;
        if !self.pruned {
            return;
        }
        match asked {
            Asked::Distances => {
                let (program, tape) = (&self.scene.distance, &self.scene.tape);
                self.distance_tapes
                    .prune(program, tape, self.cells, regions);
            }
            Asked::Surfaces => {
                if let Some((program, tape)) = &self.scene.surface {
                    let cells = self.surface_cells.as_deref();
                    self.surface_tapes.prune(program, tape, cells, regions);
                }
            }
        }
    }

    fn focus(&mut self, region: Option<usize>) {
        self.focus = region;
    }

    fn surfaces(
        &mut self,
        points: &Points,
        normals: &Points,
        count: usize,
        out: &mut SurfaceBlock,
    ) {
        let unpainted = numbers(&self.scene.unpainted);
        let Some((program, tape)) = &self.scene.surface else {
            *out = unpainted.map(|number| Column([number; LANES]));
            return;
        };
        let machine = self.surface.get_or_insert_with(|| {
            let mut machine: Machine<Dual<f32>, Surfaces> = Machine::new(tape.values, tape.points);
            machine.attachment().unpainted = unpainted;
            machine
        });
        machine.attachment().normals.clone_from(normals);
        *machine.seed() = seeded(points);
        let clauses = self.surface_tapes.get(self.focus).unwrap_or(&tape.clauses);
        machine.run(program, clauses, count);
        out.clone_from(machine.attachment().surface());
    }
}

/// So many points are worth putting in order.
const MANY: usize = 1024;

impl Asker<'_> {
    /// Points of which each 64 are neighbours.
    fn samples_nearby(&mut self, points: &[[f32; 3]]) -> Vec<Sample> {
        let regions: Vec<Region> = points
            .chunks(LANES)
            .map(|chunk| order::around(chunk.iter()))
            .collect();
        self.announce(Asked::Distances, &regions);
        self.announce(Asked::Surfaces, &regions);
        let mut samples = Vec::with_capacity(points.len());
        for (region, chunk) in points.chunks(LANES).enumerate() {
            let bounded = chunk.iter().all(order::is_somewhere);
            self.focus(bounded.then_some(region));
            samples.extend(self.samples(chunk));
        }
        self.focus(None);
        samples
    }

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
