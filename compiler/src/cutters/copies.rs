//! The places at which a box of a cutter's part stands in the body's frame.

use super::{Rows, SAME, Step, TOUCHING, composed};
use crate::bounds::inverse;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::BoundsRule;
use sdfc_vm::table::Op;
use std::f64::consts::TAU;

/// The most places that are told apart; of more the box around all of them is taken.
const MOST_PLACES: usize = 64;

/// A box in some frame.
#[derive(Clone)]
pub(super) struct Region {
    pub(super) bounds: Bounds,
    /// The map from that frame to the body's.
    pub(super) rows: Rows,
    /// The frame is that of the part.
    pub(super) is_own: bool,
}

impl Region {
    /// All places of a box in the frame of a part from which a path leads to the body; none if one of its steps
    /// has no rule.
    pub(super) fn all(added: &Bounds, path: &[Step]) -> Option<Vec<Self>> {
        let mut regions = vec![Self {
            bounds: *added,
            rows: SAME,
            is_own: true,
        }];
        for step in path.iter().rev() {
            match step {
                Step::Map(map) => {
                    for region in &mut regions {
                        region.rows = composed(map, &region.rows);
                    }
                }
                Step::Copies { op, numbers } => match turns(*op, numbers) {
                    Some(turns) if regions.len() * turns.len() <= MOST_PLACES => {
                        let each = turns.iter().flat_map(|turn| {
                            regions.iter().map(move |region| Self {
                                bounds: region.bounds,
                                rows: composed(turn, &region.rows),
                                is_own: region.is_own,
                            })
                        });
                        regions = each.collect();
                    }
                    _ => {
                        let BoundsRule::Map(rule) = op.row().meta.bounds else {
                            return None;
                        };
                        for region in &mut regions {
                            region.become_box(|bounds| rule(numbers, bounds));
                        }
                    }
                },
                Step::Within(within) => {
                    for region in &mut regions {
                        match inverse(region.rows.as_flattened()) {
                            // A box that is turned by right angles stays one.
                            Some(back) if is_straight(&region.rows) => {
                                region.bounds = region.bounds.common(&within.mapped(&back));
                            }
                            _ => region.become_box(|bounds| bounds.common(within)),
                        }
                    }
                }
            }
        }
        Some(regions)
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

    /// Takes the box in the frame where the rows lead to, changed.
    fn become_box(&mut self, change: impl Fn(&Bounds) -> Bounds) {
        self.bounds = change(&self.bounds.mapped(&self.rows));
        self.rows = SAME;
        self.is_own = false;
    }
}

/// The maps to each copy of a ring, if there are few.
fn turns(op: Op, numbers: &[f64]) -> Option<Vec<Rows>> {
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

/// Tells if a map takes axes to axes.
fn is_straight(rows: &Rows) -> bool {
    rows.iter()
        .all(|row| row[..3].iter().filter(|v| v.abs() > 1e-9).count() == 1)
}
