//! The cells of a picture as the interpreter takes them: made on the processor, all of them or the
//! first for a device to go on with, and as words. What an edit does not reach is kept from the
//! picture before ([`crate::cells::again`]).

use crate::cells::{self, CHILDREN, Cells, Cut, Left, Packed};
use crate::engine::cut::{First, Space};
use crate::engine::cutter::Filled;
use crate::frame::Picture;
use sdfc_shaders::interpreter::cut::Way;
use sdfc_shaders::interpreter::tape::{Registers, constant};
use sdfc_shaders::layout;
use sdfc_vm::program::Program;
use sdfc_vm::tape::Tape;
use std::collections::HashMap;
use std::sync::Arc;

/// All of a picture that its cells depend on.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct MadeFor {
    space: Space,
    materials: bool,
    on_device: bool,
}

impl MadeFor {
    /// `None` where there is nothing to be seen.
    pub(super) fn of(picture: &Picture, on_device: bool) -> Option<Self> {
        Some(Self {
            space: Space::of(picture)?,
            materials: picture.features.materials,
            on_device,
        })
    }
}

/// What of a program's cells is left to be cut on the device.
pub(super) struct Part {
    /// Whether it is the program of surfaces.
    pub(super) surface: bool,
    pub(super) way: Way,
    pub(super) cut: layout::Cut,
    left: Vec<Left>,
}

/// The cells of the last picture, and what they were made for.
#[derive(Default)]
pub(super) struct Kept {
    last: Option<Last>,
}

/// What is kept of a picture.
struct Last {
    made_for: MadeFor,
    made: [Option<Made>; 2],
    registers: Registers,
    /// The entries of what was left to be cut of both programs.
    entries: [Entries; 2],
}

/// Entries of nodes, and the numbers of their cells, by a level and a place among the cells of that level.
type Entries = HashMap<(u32, [u32; 3]), (u32, u32)>;

/// The cells of a program.
struct Made {
    program: Arc<Program>,
    tape: Arc<Tape>,
    cells: Arc<Cells>,
    /// How many of them are not those of the picture before.
    fresh: usize,
    /// Which instructions an edit changed, if that is all it did.
    changed: Option<Vec<bool>>,
}

/// Cells as words, and what a device goes on with.
pub(super) struct Work {
    pub(super) packed: Packed,
    pub(super) parts: Vec<Part>,
    /// Which instructions of both programs an edit changed, where what the device cut before is looked at
    /// again; without, all is cut anew.
    pub(super) changed: Option<Vec<bool>>,
}

impl Kept {
    /// The cells of a picture, as words, and what of each program is left to be cut on the device; behind
    /// what `filled` says is there already, if an edit left that of use.
    pub(super) fn packed(
        &mut self,
        programs: &[Option<Arc<Program>>; 2],
        tapes: &[Option<Arc<Tape>>; 2],
        made_for: &MadeFor,
        registers: Registers,
        mut filled: Option<Filled>,
    ) -> Option<Work> {
        let last = self
            .last
            .take()
            .filter(|last| last.made_for.does_for(made_for));
        let (made_for, [last_distance, last_surface], entries) = match last {
            Some(last) => {
                filled = filled.filter(|_| last.registers == registers);
                (last.made_for, last.made, last.entries)
            }
            None => (made_for.clone(), [None, None], Default::default()),
        };
        let space = &made_for.space;
        let [Some(program), surface] = programs else {
            return None;
        };
        let [Some(tape), surface_tape] = tapes else {
            return None;
        };
        let surface_pair = surface.as_ref().zip(surface_tape.as_ref());
        let made = [
            Some(made_for.make(program, tape, space.distance(), last_distance)),
            surface_pair
                .filter(|_| made_for.materials)
                .map(|(program, tape)| made_for.make(program, tape, space.surface(), last_surface)),
        ];
        let pack = |behind, changed| {
            let mut work = Work {
                packed: Packed::new(&space.distance(), registers, behind),
                parts: Vec::new(),
                changed,
            };
            for cells in made.iter().flatten() {
                work.add(cells, space, program);
            }
            if made[1].is_none() {
                let base = program.code.len() as u32;
                work.packed.add_whole_surface(surface_tape.as_deref(), base);
            }
            work
        };
        let edit = filled.zip(all_changed(programs, &made));
        let behind = edit.and_then(|(filled, changed)| {
            let work = pack(filled.used, Some(changed));
            filled.holds(&work.packed).then_some(work)
        });
        let mut work = behind.unwrap_or_else(|| pack([0; 2], None));
        let entries = work.connect(&entries);
        self.last = Some(Last {
            made_for,
            made,
            registers,
            entries,
        });
        Some(work)
    }
}

impl Part {
    /// What there is to be done.
    pub(super) fn jobs(&self) -> Vec<layout::Job> {
        self.left.iter().map(|left| left.job).collect()
    }
}

impl Work {
    /// Adds the cells of a program: of the distance first, which this one is, then of surfaces.
    fn add(&mut self, made: &Made, space: &Space, distance: &Arc<Program>) {
        let tape = &made.tape;
        let surface = !Arc::ptr_eq(&made.program, distance);
        let (left, band, [empty, full]) = if surface {
            // Instructions of surfaces lie behind those of the distance.
            let base = distance.code.len() as u32;
            let left = self.packed.add_surface(tape, &made.cells, base, made.fresh);
            let whole = self.packed.grid.surface_whole;
            (left, space.surface().band, [whole; 2])
        } else {
            let left = self.packed.add_distance(tape, &made.cells, made.fresh);
            (left, space.distance().band, [false, true].map(constant))
        };
        if left.is_empty() {
            return;
        }
        self.parts.push(Part {
            surface,
            way: Way::of(tape),
            cut: layout::Cut {
                empty,
                full,
                ..space.on_device(tape, band)
            },
            left,
        });
    }

    /// Lets what is left to be cut know where it was before an edit, if this is one; gives where it is now.
    fn connect(&mut self, before: &[Entries; 2]) -> [Entries; 2] {
        let mut entries = [Entries::new(), Entries::new()];
        for part in &mut self.parts {
            let number = usize::from(part.surface);
            for Left { cell, job } in &mut part.left {
                let place = (job.level, [job.x, job.y, job.z]);
                entries[number].insert(place, (job.entry, *cell));
                let Some(&(entry, cell_before)) = before[number].get(&place) else {
                    continue;
                };
                if self.changed.is_some() {
                    job.before = entry;
                    if cell_before == *cell {
                        job.length = 0;
                    }
                }
            }
        }
        entries
    }
}

/// Which instructions of both programs an edit changed; `None` where it did more, or there are no cells
/// from before it.
fn all_changed(
    programs: &[Option<Arc<Program>>; 2],
    made: &[Option<Made>; 2],
) -> Option<Vec<bool>> {
    let mut all = Vec::new();
    for (program, made) in programs.iter().zip(made) {
        match (program, made) {
            (_, Some(made)) => all.extend(made.changed.as_ref()?),
            (Some(program), None) => all.resize(all.len() + program.code.len(), false),
            (None, None) => {}
        }
    }
    Some(all)
}

impl Filled {
    /// Whether there is room for what was packed to go behind, and as much again for what a device makes
    /// of it.
    fn holds(&self, packed: &Packed) -> bool {
        let more = [packed.nodes.len() / CHILDREN, packed.tapes.len()];
        let pairs = self.used.iter().zip(more).zip(self.room);
        let mut ends = pairs.map(|((used, more), room)| (*used as usize + 2 * more, room as usize));
        ends.all(|(end, room)| end <= room)
    }
}

impl MadeFor {
    /// Whether cells made for it do for another.
    fn does_for(&self, other: &Self) -> bool {
        self.materials == other.materials
            && self.on_device == other.on_device
            && self.space.does_for(&other.space)
    }

    /// The cells of a program.
    fn make(
        &self,
        program: &Arc<Program>,
        tape: &Arc<Tape>,
        cut: Cut<'_>,
        last: Option<Made>,
    ) -> Made {
        let first = First(&self.space);
        let refine = if self.on_device { &first } else { cut.refine };
        let cut = Cut { refine, ..cut };
        let again = last.and_then(|last| {
            let old = (&*last.program, &*last.tape);
            let cells = cells::again(&last.cells, old, (program, tape), &cut)?;
            let same = Arc::ptr_eq(&cells, &last.cells);
            let fresh = if same { 0 } else { cells.made() };
            Some((cells, fresh, cells::changed(&last.program, program)))
        });
        let (cells, fresh, changed) = again.unwrap_or_else(|| {
            let cells = Arc::new(cells::build(program, tape, &cut));
            let fresh = cells.made();
            (cells, fresh, None)
        });
        Made {
            program: program.clone(),
            tape: tape.clone(),
            cells,
            fresh,
            changed,
        }
    }
}
