//! Copies by folding space: the union of those that may be the nearest one of a point.
//!
//! Where a step is enough and a copy leaves a gap to the walls of its cell, the neighbouring copies need not
//! be evaluated: a step may be no longer than the way to their boxes.

use super::{At, Lowering, Wanted};
use crate::bounds::World;
use crate::expression::ExprId;
use crate::graph::{NodeId, Number};
use crate::scene::{Others, ShapeId, ShapeKind, neighbour};
use sdfc_vm::table::Op;
use std::f64::consts::TAU;

/// The gap that a copy must leave to the walls of its cell, as a fraction of the cell, for its neighbours to
/// be told by their boxes: in a smaller one rays would take many short steps along the walls.
const MIN_GAP: f64 = 1.0 / 64.0;

impl Lowering<'_> {
    /// The copies of a repetition.
    pub(super) fn copies(&mut self, id: ShapeId, at: At, wanted: Wanted) -> NodeId {
        match self.scene.shapes[id.0 as usize].kind.clone() {
            ShapeKind::Repeat {
                op,
                child,
                parameters,
                others,
            } => {
                let numbers = self.numbers(&parameters);
                let guarded = match wanted {
                    Wanted::Step => self.guarded(child, &numbers, others),
                    Wanted::Written => None,
                };
                let axes = guarded.map_or([false; 3], |(_, axes)| axes);
                let cells = std::array::from_fn(|axis| {
                    let others = if axes[axis] {
                        Others::default()
                    } else {
                        others[axis]
                    };
                    others.cells().collect::<Vec<_>>()
                });
                let union = self.grid(op, child, &numbers, cells, at, wanted, guarded);
                match guarded {
                    Some((corners, axes)) if op == Op::RepeatLimited => {
                        let parameters = guard_parameters(corners, axes, &numbers, op);
                        let op = Op::RepeatLimitedGuard;
                        self.apply(op, at, vec![union], parameters)
                    }
                    _ => union,
                }
            }
            ShapeKind::Polar {
                op,
                child,
                parameters,
                others,
            } => {
                let numbers = self.numbers(&parameters);
                let sectors: Vec<f64> = others.cells().collect();
                let count = match numbers[0] {
                    Number::Constant(sector) => Some((TAU / f64::from(sector)).round()),
                    Number::Uniform(_) => None,
                };
                let copies: Vec<NodeId> = match count {
                    // Where every sector's copy is evaluated, none has to be found by folding space.
                    Some(count) if sectors.len() as f64 >= count => (0..count as u32)
                        .map(|sector| {
                            let turn = self.turn(op, TAU * f64::from(sector) / count);
                            let inner = if sector == 0 {
                                at
                            } else {
                                self.framed(at, turn)
                            };
                            self.shape(child, inner, wanted)
                        })
                        .collect(),
                    _ => sectors
                        .into_iter()
                        .map(|sector| {
                            let point = self.sector(op, &numbers, sector, at);
                            self.shape(child, at.moved_to(point), wanted)
                        })
                        .collect(),
                };
                self.union(copies, at)
            }
            _ => unreachable!("only repetitions have copies"),
        }
    }

    /// The union of the copies in these cells along each axis.
    #[expect(
        clippy::too_many_arguments,
        reason = "a repetition and how it is wanted"
    )]
    fn grid(
        &mut self,
        op: Op,
        child: ShapeId,
        numbers: &[Number],
        cells: [Vec<f64>; 3],
        at: At,
        wanted: Wanted,
        guarded: Option<([[f64; 3]; 2], [bool; 3])>,
    ) -> NodeId {
        let mut copies = Vec::new();
        for &z in &cells[2] {
            for &y in &cells[1] {
                for &x in &cells[0] {
                    let which = [x, y, z];
                    let point = if which == [0.0; 3] {
                        self.apply(op, at, Vec::new(), numbers.to_vec())
                    } else {
                        let which = which.map(|cell| Number::Constant(cell as f32));
                        let parameters = numbers.iter().copied().chain(which).collect();
                        self.apply(neighbour(op), at, Vec::new(), parameters)
                    };
                    let at_copy = at.moved_to(point);
                    let copy = self.shape(child, at_copy, wanted);
                    // The guard of an endless grid reads the folded point.
                    let copy = match guarded {
                        Some((corners, axes)) if op == Op::Repeat => {
                            let parameters = guard_parameters(corners, axes, numbers, op);
                            self.apply(Op::RepeatGuard, at_copy, vec![copy], parameters)
                        }
                        _ => copy,
                    };
                    copies.push(copy);
                }
            }
        }
        self.union(copies, at)
    }

    /// The map of a point to the frame of a shape that is turned about the axis of a polar repetition.
    fn turn(&mut self, op: Op, angle: f64) -> [ExprId; 12] {
        let (second, other) = match op {
            Op::Polar => (2, 1),
            _ => (1, 2),
        };
        let (sin, cos) = angle.sin_cos();
        let mut rows = [[0.0; 4]; 3];
        rows[0][0] = cos;
        rows[0][second] = sin;
        rows[second][0] = -sin;
        rows[second][second] = cos;
        rows[other][other] = 1.0;
        let rows = rows.as_flattened();
        std::array::from_fn(|i| self.scene.expressions.constant(rows[i]))
    }

    /// The point in a sector so many farther than its own.
    fn sector(&mut self, op: Op, numbers: &[Number], sector: f64, at: At) -> NodeId {
        if sector == 0.0 {
            return self.apply(op, at, Vec::new(), numbers.to_vec());
        }
        let which = Number::Constant(sector as f32);
        let parameters = numbers.iter().copied().chain([which]).collect();
        self.apply(neighbour(op), at, Vec::new(), parameters)
    }

    fn union(&mut self, copies: Vec<NodeId>, at: At) -> NodeId {
        let mut copies = copies.into_iter();
        let first = copies.next().expect("there is the copy of the own cell");
        copies.fold(first, |sum, copy| {
            self.apply(Op::Union, at, vec![sum, copy], Vec::new())
        })
    }

    /// The corners of what a cell holds, and the axes along which its neighbours are told by their boxes.
    fn guarded(
        &mut self,
        child: ShapeId,
        numbers: &[Number],
        others: [Others; 3],
    ) -> Option<([[f64; 3]; 2], [bool; 3])> {
        let bounds = self.boxes.of(World::from(&*self.scene), child);
        if bounds.is_empty() {
            return None;
        }
        let axes: [bool; 3] = std::array::from_fn(|axis| {
            let Number::Constant(spacing) = numbers[axis] else {
                return false;
            };
            let half = f64::from(spacing).abs() / 2.0;
            let gap = (half + bounds.min[axis]).min(half - bounds.max[axis]);
            others[axis] == NEXT && gap >= MIN_GAP * 2.0 * half
        });
        let is_constant = numbers.iter().all(|n| matches!(n, Number::Constant(_)));
        let corners = [bounds.min, bounds.max].map(|corner| corner.map(|v| v.clamp(-1e18, 1e18)));
        (is_constant && axes != [false; 3]).then_some((corners, axes))
    }
}

/// The other copies of a shape that fits its cell.
const NEXT: Others = Others { near: 1, far: 0 };

/// The parameters of a guard: of a repetition's parameters, and what its cells hold.
fn guard_parameters(
    corners: [[f64; 3]; 2],
    axes: [bool; 3],
    numbers: &[Number],
    op: Op,
) -> Vec<Number> {
    let constant = |n: &Number| match n {
        Number::Constant(v) => f64::from(*v),
        Number::Uniform(_) => unreachable!("guards are made of constants"),
    };
    let numbers: Vec<f64> = numbers.iter().map(constant).collect();
    let mut arguments: Vec<f64> = corners.concat();
    arguments.extend(&numbers[..3]);
    let row = match op {
        Op::Repeat => Op::RepeatGuard,
        _ => {
            // The last cell's number is one less than there are cells.
            arguments.extend(numbers[6..9].iter().map(|last| last + 1.0));
            Op::RepeatLimitedGuard
        }
    };
    arguments.extend(axes.map(|axis| f64::from(u8::from(axis))));
    let prepared = sdfc_vm::table::prepare::<f64>(row, &arguments);
    prepared
        .into_iter()
        .map(|v| Number::Constant(v as f32))
        .collect()
}
