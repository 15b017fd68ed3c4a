//! The cells of an image for the interpreter, encoded as words. They are built on the CPU: all of them, or
//! the first levels if a device continues. Cells that an edit does not affect are kept from the image before
//! ([`crate::cells`]).

use crate::cells::policy::CellRegion;
use crate::cells::{self, CHILDREN, CellSpec, Cells, DeferredCell, GpuCells};
use crate::gpu::cell_builder::BufferFill;
use crate::render::RenderJob;
use sdfc_shaders::interpreter::split_cells::PruneMethod;
use sdfc_shaders::interpreter::tape::{KernelRegisters, constant_word};
use sdfc_shaders::layout;
use sdfc_vm::program::Program;
use sdfc_vm::tape::Tape;
use std::collections::HashMap;
use std::sync::Arc;

/// All properties of a render that its cells depend on.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct CacheKey {
    region: CellRegion,
    materials: bool,
    on_device: bool,
}

impl CacheKey {
    /// Returns the key of a render; `None` if nothing is visible.
    pub(super) fn for_job(job: &RenderJob, on_device: bool) -> Option<Self> {
        Some(Self {
            region: CellRegion::for_job(job)?,
            materials: job.features.materials,
            on_device,
        })
    }
}

/// The cells of one program that are left to be split on the device.
pub(super) struct DeferredSplit {
    /// Set if this is the surface program.
    pub(super) is_surface: bool,
    pub(super) method: PruneMethod,
    pub(super) params: layout::SplitParams,
    deferred: Vec<DeferredCell>,
}

/// The cells of the last image, with the key that they were built for.
#[derive(Default)]
pub(super) struct CellCache {
    last: Option<CachedFrame>,
}

/// The cached data of an image.
struct CachedFrame {
    key: CacheKey,
    programs: [Option<ProgramCells>; 2],
    registers: KernelRegisters,
    /// The entries of the deferred cells of both programs.
    entries: [Entries; 2],
}

/// Node entries and cell numbers, by level and coordinates within the level.
type Entries = HashMap<(u32, [u32; 3]), (u32, u32)>;

/// The cells of a program.
struct ProgramCells {
    program: Arc<Program>,
    tape: Arc<Tape>,
    cells: Arc<Cells>,
    /// Number of cells built for this image, not kept from the one before.
    fresh: usize,
    /// The instructions that an edit changed; `None` unless only constants changed.
    changed: Option<Vec<bool>>,
}

/// Encoded cells, and the deferred ones that a device continues with.
pub(super) struct CellUpload {
    pub(super) packed: GpuCells,
    pub(super) parts: Vec<DeferredSplit>,
    /// The instructions of both programs that an edit changed, if the device revisits the cells it split
    /// before. `None` if all cells are split anew.
    pub(super) changed: Option<Vec<bool>>,
}

impl CellCache {
    /// Returns the encoded cells of an image and the cells of each program that the device has to split.
    /// After an edit they are appended to the existing ones (`fill`) if these are still of use.
    pub(super) fn upload_for(
        &mut self,
        programs: &[Option<Arc<Program>>; 2],
        tapes: &[Option<Arc<Tape>>; 2],
        key: &CacheKey,
        registers: KernelRegisters,
        mut fill: Option<BufferFill>,
    ) -> Option<CellUpload> {
        let last = self.last.take().filter(|last| last.key.covers(key));
        let (key, [last_distance, last_surface], entries) = match last {
            Some(last) => {
                fill = fill.filter(|_| last.registers == registers);
                (last.key, last.programs, last.entries)
            }
            None => (key.clone(), [None, None], Default::default()),
        };
        let region = &key.region;
        let [Some(program), surface] = programs else {
            return None;
        };
        let [Some(tape), surface_tape] = tapes else {
            return None;
        };
        let surface_pair = surface.as_ref().zip(surface_tape.as_ref());
        let program_cells = [
            Some(key.build_cells(program, tape, region.distance(), last_distance)),
            surface_pair
                .filter(|_| key.materials)
                .map(|(program, tape)| {
                    key.build_cells(program, tape, region.surface(), last_surface)
                }),
        ];
        let pack = |base_offsets, changed| {
            let mut upload = CellUpload {
                packed: GpuCells::new(&region.distance(), registers, base_offsets),
                parts: Vec::new(),
                changed,
            };
            for cells in program_cells.iter().flatten() {
                upload.add(cells, region, program);
            }
            if program_cells[1].is_none() {
                let base = program.code.len() as u32;
                upload
                    .packed
                    .add_single_surface_tape(surface_tape.as_deref(), base);
            }
            upload
        };
        let edit = fill.zip(changed_instructions(programs, &program_cells));
        let incremental = edit.and_then(|(fill, changed)| {
            let upload = pack(fill.used, Some(changed));
            fill.has_room_for(&upload.packed).then_some(upload)
        });
        let mut upload = incremental.unwrap_or_else(|| pack([0; 2], None));
        let entries = upload.link_previous_entries(&entries);
        self.last = Some(CachedFrame {
            key,
            programs: program_cells,
            registers,
            entries,
        });
        Some(upload)
    }
}

impl DeferredSplit {
    /// Returns the jobs for the device.
    pub(super) fn jobs(&self) -> Vec<layout::CellJob> {
        self.deferred.iter().map(|deferred| deferred.job).collect()
    }
}

impl CellUpload {
    /// Adds the cells of a program; the distance program must come first.
    fn add(&mut self, program_cells: &ProgramCells, region: &CellRegion, distance: &Arc<Program>) {
        let tape = &program_cells.tape;
        let is_surface = !Arc::ptr_eq(&program_cells.program, distance);
        let (deferred, band, [empty, full]) = if is_surface {
            // Surface instructions follow those of the distance.
            let base = distance.code.len() as u32;
            let deferred =
                self.packed
                    .add_surface(tape, &program_cells.cells, base, program_cells.fresh);
            let full_tape = self.packed.grid.surface_full_tape;
            (deferred, region.surface().band, [full_tape; 2])
        } else {
            let deferred =
                self.packed
                    .add_distance(tape, &program_cells.cells, program_cells.fresh);
            (
                deferred,
                region.distance().band,
                [false, true].map(constant_word),
            )
        };
        if deferred.is_empty() {
            return;
        }
        self.parts.push(DeferredSplit {
            is_surface,
            method: PruneMethod::for_tape(tape),
            params: layout::SplitParams {
                empty_word: empty,
                full_word: full,
                ..region.gpu_split_params(tape, band)
            },
            deferred,
        });
    }

    /// Links deferred cells to their entries from before an edit, if this is one. Returns their new entries.
    fn link_previous_entries(&mut self, previous: &[Entries; 2]) -> [Entries; 2] {
        let mut entries = [Entries::new(), Entries::new()];
        for part in &mut self.parts {
            let number = usize::from(part.is_surface);
            for DeferredCell { cell, job } in &mut part.deferred {
                let position = (job.level, [job.x, job.y, job.z]);
                entries[number].insert(position, (job.node_entry, *cell));
                let Some(&(entry, previous_cell)) = previous[number].get(&position) else {
                    continue;
                };
                if self.changed.is_some() {
                    job.old_entry = entry;
                    if previous_cell == *cell {
                        job.length = 0;
                    }
                }
            }
        }
        entries
    }
}

/// Returns the instructions of both programs that an edit changed. `None` if more than constants changed, or if
/// there are no earlier cells.
fn changed_instructions(
    programs: &[Option<Arc<Program>>; 2],
    program_cells: &[Option<ProgramCells>; 2],
) -> Option<Vec<bool>> {
    let mut changed = Vec::new();
    for (program, program_cells) in programs.iter().zip(program_cells) {
        match (program, program_cells) {
            (_, Some(program_cells)) => changed.extend(program_cells.changed.as_ref()?),
            (Some(program), None) => changed.resize(changed.len() + program.code.len(), false),
            (None, None) => {}
        }
    }
    Some(changed)
}

impl BufferFill {
    /// Reports whether these cells can be appended and as much memory again remains for the cells that a
    /// device makes of them.
    fn has_room_for(&self, packed: &GpuCells) -> bool {
        let added = [packed.nodes.len() / CHILDREN, packed.tapes.len()];
        let pairs = self.used.iter().zip(added).zip(self.capacity);
        let mut ends =
            pairs.map(|((used, added), capacity)| (*used as usize + 2 * added, capacity as usize));
        ends.all(|(end, capacity)| end <= capacity)
    }
}

impl CacheKey {
    /// Reports whether cells with this key can be used for another key.
    fn covers(&self, other: &Self) -> bool {
        self.materials == other.materials
            && self.on_device == other.on_device
            && self.region.covers(&other.region)
    }

    /// Builds or updates the cells of a program.
    fn build_cells(
        &self,
        program: &Arc<Program>,
        tape: &Arc<Tape>,
        spec: CellSpec<'_>,
        last: Option<ProgramCells>,
    ) -> ProgramCells {
        let cpu_levels = self.region.cpu_levels();
        let rule = if self.on_device {
            &cpu_levels
        } else {
            spec.rule
        };
        let spec = CellSpec { rule, ..spec };
        let rebuilt = last.and_then(|last| {
            let old_program = (&*last.program, &*last.tape);
            let cells =
                cells::rebuild_after_edit(&last.cells, old_program, (program, tape), &spec)?;
            let is_same = Arc::ptr_eq(&cells, &last.cells);
            let fresh = if is_same { 0 } else { cells.rebuilt_count() };
            Some((
                cells,
                fresh,
                cells::changed_instructions(&last.program, program),
            ))
        });
        let (cells, fresh, changed) = rebuilt.unwrap_or_else(|| {
            let cells = Arc::new(cells::build(program, tape, &spec));
            let fresh = cells.rebuilt_count();
            (cells, fresh, None)
        });
        ProgramCells {
            program: program.clone(),
            tape: tape.clone(),
            cells,
            fresh,
            changed,
        }
    }
}
