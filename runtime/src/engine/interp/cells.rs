//! The cells of a picture as the interpreter takes them: made on the processor, all of them or the
//! first for a device to go on with, and as words. What an edit does not reach is kept from the
//! picture before ([`crate::cells::again`]).

use crate::cells::{self, Cells, Cut, Packed};
use crate::engine::cut::{First, Space};
use crate::frame::Picture;
use sdfc_shaders::interpreter::cut::Way;
use sdfc_shaders::interpreter::tape::{Registers, constant};
use sdfc_shaders::layout;
use sdfc_vm::program::Program;
use sdfc_vm::tape::Tape;
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
    pub(super) jobs: Vec<layout::Job>,
}

/// The cells of the last picture, and what they were made for.
#[derive(Default)]
pub(super) struct Kept {
    last: Option<(MadeFor, [Option<Made>; 2])>,
}

/// The cells of a program.
struct Made {
    program: Arc<Program>,
    tape: Arc<Tape>,
    cells: Arc<Cells>,
}

impl Kept {
    /// The cells of a picture, as words, and what of each program is left to be cut on the device.
    pub(super) fn packed(
        &mut self,
        programs: &[Option<Arc<Program>>; 2],
        tapes: &[Option<Arc<Tape>>; 2],
        made_for: &MadeFor,
        registers: Registers,
    ) -> Option<(Packed, Vec<Part>)> {
        let last = self.last.take().filter(|(of, _)| of.does_for(made_for));
        let (made_for, [last_distance, last_surface]) =
            last.unwrap_or_else(|| (made_for.clone(), [None, None]));
        let space = &made_for.space;
        let [Some(program), surface] = programs else {
            return None;
        };
        let [Some(tape), surface_tape] = tapes else {
            return None;
        };
        let mut packed = Packed::new(&space.distance(), registers);
        let mut parts = Vec::new();
        let (distance, fresh) = made_for.make(program, tape, space.distance(), last_distance);
        let jobs = packed.add_distance(tape, &distance.cells, fresh);
        if !jobs.is_empty() {
            let cut = layout::Cut {
                empty: constant(false),
                full: constant(true),
                ..space.on_device(tape, space.distance().band)
            };
            parts.push(Part {
                surface: false,
                way: Way::of(tape),
                cut,
                jobs,
            });
        }
        let mut made = [Some(distance), None];
        // Instructions of surfaces lie behind those of the distance.
        let base = program.code.len() as u32;
        match (surface, surface_tape) {
            (Some(program), Some(tape)) if made_for.materials => {
                let (surface, fresh) = made_for.make(program, tape, space.surface(), last_surface);
                let jobs = packed.add_surface(tape, &surface.cells, base, fresh);
                if !jobs.is_empty() {
                    let whole = packed.grid.surface_whole;
                    let cut = layout::Cut {
                        empty: whole,
                        full: whole,
                        ..space.on_device(tape, space.surface().band)
                    };
                    parts.push(Part {
                        surface: true,
                        way: Way::of(tape),
                        cut,
                        jobs,
                    });
                }
                made[1] = Some(surface);
            }
            _ => packed.add_whole_surface(surface_tape.as_deref(), base),
        }
        self.last = Some((made_for, made));
        Some((packed, parts))
    }
}

impl MadeFor {
    /// Whether cells made for it do for another.
    fn does_for(&self, other: &Self) -> bool {
        self.materials == other.materials
            && self.on_device == other.on_device
            && self.space.does_for(&other.space)
    }

    /// The cells of a program, and how many of them are not those of the picture before.
    fn make(
        &self,
        program: &Arc<Program>,
        tape: &Arc<Tape>,
        cut: Cut<'_>,
        last: Option<Made>,
    ) -> (Made, usize) {
        let first = First(&self.space);
        let refine = if self.on_device { &first } else { cut.refine };
        let cut = Cut { refine, ..cut };
        let again = last.and_then(|last| {
            let old = (&*last.program, &*last.tape);
            let cells = cells::again(&last.cells, old, (program, tape), &cut)?;
            let fresh = if Arc::ptr_eq(&cells, &last.cells) {
                0
            } else {
                cells.made()
            };
            Some((cells, fresh))
        });
        let (cells, fresh) = again.unwrap_or_else(|| {
            let cells = Arc::new(cells::build(program, tape, &cut));
            let fresh = cells.made();
            (cells, fresh)
        });
        let made = Made {
            program: program.clone(),
            tape: tape.clone(),
            cells,
        };
        (made, fresh)
    }
}
