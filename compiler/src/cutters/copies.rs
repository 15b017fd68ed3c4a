//! The places at which a box of a cutter's part stands in the body's frame, and rings of boxes in turned planes.

use super::mapped::Place;
use super::{Rows, SAME, Step, TOUCHING, composed};
use crate::bounds::inverse;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::BoundsRule;
use sdfc_vm::table::Op;
use std::f64::consts::{PI, TAU};

/// The most places that are told apart; of more the box around all of them is taken.
const MOST_PLACES: usize = 64;

/// A box or a piece of a ring in some frame.
#[derive(Clone)]
pub(super) struct Region {
    /// The box; of a ring, its radii, heights and angles around the y axis.
    pub(super) bounds: Bounds,
    pub(super) is_ring: bool,
    /// The map from its frame to the body's.
    pub(super) rows: Rows,
    /// The maps to the frames on the way from the body to the part, by their number of steps; absent where copies
    /// lost them.
    levels: Vec<Option<Level>>,
}

/// A map from a region's frame to that of something on the way to the part.
#[derive(Clone)]
pub(super) struct Level {
    pub(super) rows: Rows,
    /// It maps the half plane of a ring.
    pub(super) is_flat: bool,
}

impl Region {
    /// All places of a box from which a path leads to the body, `frame` to the part; none if one of its steps has no
    /// rule.
    pub(super) fn all(added: &Bounds, frame: &Rows, path: &[Step]) -> Option<Vec<Self>> {
        let mut levels = vec![None; path.len() + 1];
        levels[path.len()] = Some(Level {
            rows: *frame,
            is_flat: false,
        });
        let mut regions = vec![Self {
            bounds: *added,
            is_ring: false,
            rows: *frame,
            levels,
        }];
        for (depth, step) in path.iter().enumerate().rev() {
            match step {
                Step::Map(map) => {
                    for region in &mut regions {
                        region.rows = composed(map, &region.rows);
                    }
                }
                Step::Copies { op, numbers } => match turns(*op, numbers) {
                    Some(turns) if regions.len() * turns.len() <= MOST_PLACES => {
                        if *op == Op::Mirror {
                            regions.retain_mut(|region| region.is_mirrored(numbers));
                        }
                        regions = copied(&regions, &turns);
                    }
                    _ => {
                        let BoundsRule::Map(rule) = op.row().meta.bounds else {
                            return None;
                        };
                        for region in &mut regions {
                            region.become_box();
                            region.bounds = rule(numbers, &region.bounds);
                            region.levels.fill(None);
                        }
                    }
                },
                Step::Revolve(offset) => {
                    for region in &mut regions {
                        region.become_ring(*offset);
                    }
                }
                Step::Within(within) => {
                    for region in &mut regions {
                        region.clip(within);
                    }
                }
            }
            for region in &mut regions {
                region.levels[depth] = Some(Level {
                    rows: region.rows,
                    is_flat: false,
                });
            }
        }
        Some(regions)
    }

    /// The set of points that it stands for.
    pub(super) fn place(&self, bounds: Bounds) -> Place {
        match self.is_ring {
            true => Place::Ring(bounds),
            false => Place::Box(bounds),
        }
    }

    /// The map to the frame at a number of steps from the body.
    pub(super) fn level(&self, depth: usize) -> Option<&Level> {
        self.levels[depth].as_ref()
    }

    /// The map to the frame of the part.
    pub(super) fn to_part(&self) -> Option<&Level> {
        self.levels.last()?.as_ref()
    }

    /// Leaves out what lies between two ends along an axis, if that is on one side of the box.
    pub(super) fn without(&mut self, axis: usize, [low, high]: [f64; 2]) {
        let (min, max) = (self.bounds.min[axis], self.bounds.max[axis]);
        let touching = TOUCHING * min.abs().max(max.abs());
        if low <= min + touching && high > min {
            self.bounds.min[axis] = if high >= max - touching {
                f64::INFINITY
            } else {
                high
            };
        } else if high >= max - touching && low < max {
            self.bounds.max[axis] = low;
        }
    }

    /// Leaves out what lies behind a mirror's planes, across `axes`. Tells if more than a face is left.
    fn is_mirrored(&mut self, axes: &[f64]) -> bool {
        let bounds = self.place(self.bounds).bounds().mapped(&self.rows);
        let mut shown = Bounds::EVERYTHING;
        let mut is_shown = true;
        for axis in (0..3).filter(|&axis| axes[axis] != 0.0) {
            shown.min[axis] = 0.0;
            is_shown &= bounds.max[axis] > TOUCHING * bounds.min[axis].abs();
        }
        self.clip(&shown);
        is_shown
    }

    /// Takes the box around it in the frame where the rows lead to.
    fn become_box(&mut self) {
        let back = inverse(self.rows.as_flattened()).filter(|_| !self.is_ring);
        match back {
            Some(back) => {
                for level in self.levels.iter_mut().flatten() {
                    level.rows = composed(&level.rows, &back);
                }
            }
            None => self.levels.fill(None),
        }
        self.bounds = self.place(self.bounds).bounds().mapped(&self.rows);
        self.rows = SAME;
        self.is_ring = false;
    }

    /// Takes the ring that a figure's box makes when it is turned around the y axis, moved along x before.
    fn become_ring(&mut self, offset: f64) {
        self.become_box();
        let mut shift = SAME;
        shift[0][3] = -offset;
        for level in self.levels.iter_mut().flatten() {
            level.rows = composed(&level.rows, &shift);
            level.is_flat = true;
        }
        self.bounds.min[0] = (self.bounds.min[0] + offset).max(0.0);
        self.bounds.max[0] += offset;
        // Behind the axis, a figure leaves nothing.
        if self.bounds.max[0] <= TOUCHING * self.bounds.min[1].abs().max(self.bounds.max[1].abs()) {
            self.bounds.max[0] = f64::NEG_INFINITY;
        }
        (self.bounds.min[2], self.bounds.max[2]) = (-PI, PI);
        self.is_ring = true;
    }

    /// Leaves out what lies beyond a box in the frame where the rows lead to, or some of it.
    fn clip(&mut self, within: &Bounds) {
        if self.is_ring {
            return;
        }
        let is_limited = |axis: usize| within.min[axis].is_finite() || within.max[axis].is_finite();
        let limited: Vec<usize> = (0..3).filter(|&axis| is_limited(axis)).collect();
        let along = |axis: usize| column_along(&self.rows, axis);
        if !limited.iter().all(|&axis| along(axis).is_some()) {
            self.become_box();
            self.bounds = self.bounds.common(within);
            return;
        }
        for axis in limited {
            let Some(column) = column_along(&self.rows, axis) else {
                continue;
            };
            let (factor, shift) = (self.rows[axis][column], self.rows[axis][3]);
            let ends = [within.min[axis], within.max[axis]].map(|end| (end - shift) / factor);
            let (min, max) = (&mut self.bounds.min[column], &mut self.bounds.max[column]);
            *min = min.max(ends[0].min(ends[1]));
            *max = max.min(ends[0].max(ends[1]));
        }
    }
}

/// Regions at the ends of maps.
fn copied(regions: &[Region], maps: &[Rows]) -> Vec<Region> {
    let each = maps.iter().flat_map(|map| {
        regions.iter().map(move |region| Region {
            rows: composed(map, &region.rows),
            ..region.clone()
        })
    });
    each.collect()
}

/// The maps to both sides of the planes of a mirror across `axes`.
fn reflections(axes: &[f64]) -> Vec<Rows> {
    let mut maps = vec![SAME];
    for axis in (0..3).filter(|&axis| axes[axis] != 0.0) {
        let images = maps.clone().into_iter().map(|mut map| {
            map[axis][axis] = -1.0;
            map
        });
        maps.extend(images.collect::<Vec<_>>());
    }
    maps
}

/// The maps to each copy of a ring, if there are few, or of a mirror.
fn turns(op: Op, numbers: &[f64]) -> Option<Vec<Rows>> {
    if op == Op::Mirror {
        return Some(reflections(numbers));
    }
    let across = match op {
        Op::Polar => 2,
        Op::PolarPlane => 1,
        _ => return None,
    };
    let count = (TAU / numbers[0]).round();
    if !(1.0..=MOST_PLACES as f64).contains(&count) {
        return None;
    }
    let turn = |sector: u32| {
        let (sin, cos) = (TAU * f64::from(sector) / count).sin_cos();
        let mut rows = SAME;
        (rows[0][0], rows[0][across]) = (cos, -sin);
        (rows[across][0], rows[across][across]) = (sin, cos);
        rows
    };
    Some((0..count as u32).map(turn).collect())
}

/// The inner axis that a map takes to an outer one, if it takes no other one along.
fn column_along(rows: &Rows, axis: usize) -> Option<usize> {
    let is_factor = |value: f64| value.abs() > 1e-9;
    let mut columns = (0..3).filter(|&column| is_factor(rows[axis][column]));
    let column = columns.next()?;
    let is_alone = (0..3).all(|row| row == axis || !is_factor(rows[row][column]));
    (columns.next().is_none() && is_alone).then_some(column)
}
