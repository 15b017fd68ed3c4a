//! The CPU engine: programs on batches of 64 points, all cores.

use super::cut::ByPackets;
use super::worth::Worth;
use super::{Engine, EngineError, EngineKind, Loaded, Sample, cut, order};
use crate::cells::{self, BLOCKS, Cells, Cut, Key, Lazy, Part, Region, Split};
use crate::cpu::figure::{self, Plane};
use crate::cpu::{
    self, Asked, Boxes, Column, Evaluator, Field, Geometry, LANES, Points, Range, SurfaceBlock,
};
use crate::frame::{
    CellStats, CellUse, FieldFacts, Frame, Mode, Picture, Progress, RenderSettings, Samples,
    Surface, prepare,
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
use std::sync::{Arc, Mutex, PoisonError};

/// Runs the loaded scene's programs on the cores of this machine.
#[derive(Default)]
pub(super) struct CpuEngine {
    scene: Option<Scene>,
}

/// What of a module is run.
pub(super) struct Scene {
    distance: Arc<Program>,
    surface: Option<(Program, Tape)>,
    tape: Arc<Tape>,
    facts: FieldFacts,
    unpainted: Surface,
    /// The cells of the last picture, perhaps of the scene as it was before an edit.
    last: Mutex<Option<Last>>,
    /// Whether cells are worth it, where that has to be tried.
    worth: Worth,
}

/// The cells of a picture, and what they were made for.
struct Last {
    program: Arc<Program>,
    tape: Arc<Tape>,
    pixels: cut::Pixels,
    cells: Arc<Cells>,
    /// How many of them were made for that picture.
    fresh: u64,
}

impl Scene {
    fn of(module: &Module, outputs: &[f64], before: Option<Self>) -> Self {
        let (worth, last) = match before {
            Some(before) if before.distance.code == module.distance.code => {
                (before.worth, before.last)
            }
            Some(before) => (Worth::default(), before.last),
            None => Default::default(),
        };
        Self {
            worth,
            last,
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
    pub(super) fn scene(&self) -> Result<&Scene, EngineError> {
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

    fn render_samples(
        &mut self,
        settings: &RenderSettings,
        samples: Samples<'_>,
        progress: &dyn Progress,
    ) -> Result<Frame, EngineError> {
        let scene = self.scene()?;
        let picture = prepare(settings, &scene.facts);
        let frame = cpu::render_samples(scene, &picture, samples, progress);
        let mut frame = frame.ok_or(EngineError::Stopped)?;
        frame.stats.cells = scene.cells_made(&picture);
        Ok(frame)
    }

    fn cells_at(
        &mut self,
        settings: &RenderSettings,
        points: &[[f32; 3]],
    ) -> Result<Option<Vec<Option<Part>>>, EngineError> {
        let scene = self.scene()?;
        // The cells of the last picture, if it was of these settings, else they are cut here.
        let picture = prepare(settings, &scene.facts);
        if picture.shows_plane() {
            return Ok(None);
        }
        let cells = scene.cells(&picture);
        Ok(cells.map(|cells| points.par_iter().map(|&p| cells.part_at(p)).collect()))
    }

    fn heeds_guards(&self) -> bool {
        false
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
        let by_packets = ByPackets::of(picture, &self.tape);
        if by_packets == ByPackets::No {
            return None;
        }
        let tried = by_packets == ByPackets::Tried;
        let frame = &picture.uniforms;
        let (region, pixels) = match self.tape.slopes.known() {
            true => (cut::region(frame)?, cut::Pixels::of(frame)),
            false => cut::raw(frame)?,
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
        if tried && !self.worth.is_possible(new.0, new.1, &cut, &pixels) {
            return None;
        }
        let before = kept.as_ref().map(|last| Arc::as_ptr(&last.cells));
        let kept =
            kept.and_then(|last| cells::again(&last.cells, (&last.program, &last.tape), new, &cut));
        let same = kept.as_ref().map(Arc::as_ptr) == before && before.is_some();
        let cells = kept.unwrap_or_else(|| Arc::new(cells::build(new.0, new.1, &cut)));
        if tried && !self.worth.of(new.0, &cells) {
            return None;
        }
        *last = Some(Last {
            fresh: if same { 0 } else { cells.made() as u64 },
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
            CellUse::Auto => self.tape.clauses.len() >= FIGURE,
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
            ..self.asker(cells)
        })
    }
}

impl Scene {
    /// What came of cutting space for the picture that was drawn last.
    fn cells_made(&self, picture: &Picture) -> CellStats {
        if picture.shows_plane() || ByPackets::of(picture, &self.tape) == ByPackets::No {
            return CellStats::default();
        }
        let last = self.last.lock().unwrap_or_else(PoisonError::into_inner);
        last.as_ref()
            .map_or(CellStats::default(), |last| CellStats {
                fresh: last.fresh,
                ..last.cells.counts()
            })
    }
}

impl Scene {
    fn asker<'a>(&'a self, cells: Option<&'a Cells>) -> Asker<'a> {
        let lazy = |tape: &Tape, cells: &Cells| {
            let long = tape.clauses.len() >= LONG;
            long.then(|| Lazy::new(tape, *cells.region()))
        };
        let surface = self.surface.as_ref().map(|(_, tape)| tape);
        Asker {
            scene: self,
            pruned: false,
            cells,
            lazy: cells.and_then(|cells| lazy(&self.tape, cells)),
            surface_lazy: surface
                .zip(cells)
                .and_then(|(tape, cells)| lazy(tape, cells)),
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
    /// Cells for points that come in no order, where looking them up pays.
    lazy: Option<Lazy>,
    /// The same for surfaces.
    surface_lazy: Option<Lazy>,
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
}

/// Programs of fewer clauses are run as they are: choosing takes about as long.
const SHORT: usize = 8;

impl RegionTapes {
    /// Prunes a tape for boxes.
    fn prune(&mut self, program: &Program, tape: &Tape, regions: &[Region]) {
        self.clear();
        if tape.clauses.len() < SHORT {
            return;
        }
        let chooser = self.chooser.get_or_insert_with(|| Chooser::new(tape));
        self.pruner.reserve(tape.values, tape.points);
        for regions in regions.chunks(LANES) {
            let boxes = chooser.boxes();
            for (lane, region) in regions.iter().enumerate() {
                region.with_margin(Split::Cube).put(boxes, lane);
            }
            chooser.run(program, &tape.clauses, regions.len());
            for lane in 0..regions.len() {
                let start = self.clauses.len();
                let choice = |place| chooser.decided().choice(place, lane);
                self.pruner.prune(&tape.clauses, choice, &mut self.clauses);
                self.places.push((start, self.clauses.len()));
            }
        }
    }

    fn clear(&mut self) {
        self.clauses.clear();
        self.places.clear();
    }

    fn get(&self, region: Option<usize>) -> Option<&[Clause]> {
        let &(start, end) = self.places.get(region?)?;
        Some(&self.clauses[start..end])
    }
}

/// Figures of so many clauses are pruned for squares of the picture. With 2 to 4 that takes as long as without,
/// with 8 nine tenths of the time, with 18 six tenths.
const FIGURE: usize = 8;
/// Programs of so many clauses may be worth looking up each point's cell: for 64 points in no order, that takes
/// about two thirds of the time that they do. What is saved tells whether it goes on ([`Lazy::pays`]).
const LONG: usize = 32;

/// The points of these keys, side by side.
fn gather(points: &[Points], keys: &[Key], to: &mut Points) {
    for (place, key) in keys.iter().enumerate() {
        let (block, lane) = key.lane();
        for (from, to) in points[block].iter().zip(to.iter_mut()) {
            to.0[place] = from.0[lane];
        }
    }
}

impl Evaluator for Asker<'_> {
    fn distances(&mut self, points: &Points, count: usize, out: &mut Column) {
        if self.lazy.is_some() && self.distance_tapes.get(self.focus).is_none() {
            let (points, out) = (std::slice::from_ref(points), std::slice::from_mut(out));
            return self.distances_many(points, count, out);
        }
        let (program, tape) = (&self.scene.distance, &self.scene.tape);
        let machine = self
            .distance
            .get_or_insert_with(|| Machine::new(tape.values, tape.points));
        let clauses = self.distance_tapes.get(self.focus).unwrap_or(&tape.clauses);
        machine.seed().clone_from(points);
        out.clone_from(machine.run(program, clauses, count));
    }

    fn blocks(&self, asked: Asked) -> usize {
        let lazy = match asked {
            Asked::Distances => &self.lazy,
            Asked::Surfaces => &self.surface_lazy,
        };
        if lazy.is_some() { BLOCKS } else { 1 }
    }

    fn distances_many(&mut self, points: &[Points], count: usize, out: &mut [Column]) {
        let (program, tape) = (&self.scene.distance, &self.scene.tape);
        let Some(lazy) = &mut self.lazy else {
            for (block, (points, out)) in points.iter().zip(out).enumerate() {
                self.distances(points, (count - block * LANES).min(LANES), out);
            }
            return;
        };
        let machine = self
            .distance
            .get_or_insert_with(|| Machine::new(tape.values, tape.points));
        lazy.each(program, points, count, |keys, clauses| {
            gather(points, keys, machine.seed());
            let values = machine.run(program, clauses, keys.len());
            for (value, key) in values.0.iter().zip(keys) {
                let (block, lane) = key.lane();
                out[block].0[lane] = *value;
            }
        });
        // The values are the same without.
        if !lazy.pays() {
            self.lazy = None;
        }
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
                let points = std::slice::from_ref(points);
                lazy.each(program, points, count, |keys, clauses| {
                    gather(points, keys, &mut own);
                    *machine.seed() = seeded(&own);
                    let values = machine.run(program, clauses, keys.len());
                    for (values, out) in values.iter().zip(out.iter_mut()) {
                        for (value, key) in values.0.iter().zip(keys) {
                            out.0[key.lane().1] = *value;
                        }
                    }
                });
            }
        }
        self.gradient = Some(machine);
    }

    fn holds(&self, cell: u32, point: [f32; 3]) -> bool {
        self.cells
            .is_some_and(|cells| cells.cell(cell).region.holds(point))
    }

    fn tape_of(&self, cell: u32) -> u64 {
        self.cells.map_or(0, |cells| cells.tape_key(cell))
    }

    fn gradients_in(&mut self, cell: u32, points: &Points, count: usize, out: &mut [Column; 4]) {
        let Some(cells) = self.cells else {
            return self.gradients(points, count, out);
        };
        let whole = &self.scene.tape;
        let machine = self
            .gradient
            .get_or_insert_with(|| Machine::new(whole.values, whole.points));
        *machine.seed() = seeded(points);
        out.clone_from(machine.run(&self.scene.distance, cells.tape(cell), count));
    }

    fn announce(&mut self, asked: Asked, regions: &[Region]) {
        self.focus = None;
        if !self.pruned {
            return;
        }
        match asked {
            Asked::Distances => {
                let (program, tape) = (&self.scene.distance, &self.scene.tape);
                self.distance_tapes.prune(program, tape, regions);
            }
            Asked::Surfaces => {
                if let Some((program, tape)) = &self.scene.surface {
                    self.surface_tapes.prune(program, tape, regions);
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
        let unpainted = &self.scene.unpainted;
        let Some((program, tape)) = &self.scene.surface else {
            *out = numbers(unpainted).map(|number| Column([number; LANES]));
            return;
        };
        let machine = surface_machine(&mut self.surface, tape, unpainted);
        machine.attachment().place(points, normals);
        *machine.seed() = seeded(points);
        let clauses = self.surface_tapes.get(self.focus).unwrap_or(&tape.clauses);
        machine.run(program, clauses, count);
        out.clone_from(machine.attachment().surface());
    }

    fn surfaces_many(
        &mut self,
        points: &[Points],
        normals: &[Points],
        count: usize,
        out: &mut [SurfaceBlock],
    ) {
        let (Some(lazy), Some((program, tape))) = (&mut self.surface_lazy, &self.scene.surface)
        else {
            for (block, (points, out)) in points.iter().zip(out).enumerate() {
                let count = (count - block * LANES).min(LANES);
                self.surfaces(points, &normals[block], count, out);
            }
            return;
        };
        let machine = surface_machine(&mut self.surface, tape, &self.scene.unpainted);
        let (mut own, mut facing) = (Points::default(), Points::default());
        lazy.each(program, points, count, |keys, clauses| {
            gather(points, keys, &mut own);
            gather(normals, keys, &mut facing);
            *machine.seed() = seeded(&own);
            machine.attachment().place(&own, &facing);
            machine.run(program, clauses, keys.len());
            let surface = machine.attachment().surface();
            for (number, values) in surface.iter().enumerate() {
                for (value, key) in values.0.iter().zip(keys) {
                    let (block, lane) = key.lane();
                    out[block][number].0[lane] = *value;
                }
            }
        });
        if !lazy.pays() {
            self.surface_lazy = None;
        }
    }
}

/// The machine for surfaces, made when it is first needed.
fn surface_machine<'a>(
    kept: &'a mut Option<Machine<Dual<f32>, Surfaces>>,
    tape: &Tape,
    unpainted: &Surface,
) -> &'a mut Machine<Dual<f32>, Surfaces> {
    kept.get_or_insert_with(|| {
        let mut machine: Machine<Dual<f32>, Surfaces> = Machine::new(tape.values, tape.points);
        machine.attachment().unpainted = numbers(unpainted);
        machine
    })
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
