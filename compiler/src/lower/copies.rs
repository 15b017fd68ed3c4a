//! Copies by folding space: the union of the copies that may be the nearest one to a point.
//!
//! Sometimes the neighbouring copies need not be evaluated: if a step is enough, and a copy leaves a
//! gap to the walls of its cell. A step may then be at most the distance to the neighbours' boxes.

use super::{LocalPoint, Lowering, ValueUse};
use crate::expression::ExprId;
use crate::graph::{GraphNumber, NodeId};
use crate::scene::{NeighbourCells, SceneRef, ShapeId, ShapeKind, neighbour};
use sdfc_vm::table::Op;
use std::f64::consts::TAU;

/// Minimum gap between a copy and the walls of its cell, as a fraction of the cell. From it on, the
/// neighbours are replaced by their boxes. In a smaller gap rays would take many short steps along the
/// walls.
const MIN_GAP_FRACTION: f64 = 1.0 / 64.0;

impl Lowering<'_> {
    /// Lowers the copies of a repetition.
    pub(super) fn copies(
        &mut self,
        id: ShapeId,
        local_point: LocalPoint,
        value_use: ValueUse,
    ) -> NodeId {
        match self.scene.shapes[id.0 as usize].kind.clone() {
            ShapeKind::Repeat {
                op,
                child,
                parameters,
                others,
            } => {
                let numbers = self.numbers(&parameters);
                let cell_guard = match value_use {
                    ValueUse::Step => self.cell_guard(child, &numbers, others),
                    ValueUse::Written => None,
                };
                let axes = cell_guard.map_or([false; 3], |(_, axes)| axes);
                let cells = std::array::from_fn(|axis| {
                    let others = if axes[axis] {
                        NeighbourCells::default()
                    } else {
                        others[axis]
                    };
                    others.cells().collect::<Vec<_>>()
                });
                let union = self.grid(
                    op,
                    child,
                    &numbers,
                    cells,
                    local_point,
                    value_use,
                    cell_guard,
                );
                match cell_guard {
                    Some((corners, axes)) if op == Op::RepeatLimited => {
                        let parameters = guard_parameters(corners, axes, &numbers, op);
                        let op = Op::RepeatLimitedGuard;
                        self.apply(op, local_point, vec![union], parameters)
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
                    GraphNumber::Constant(sector) => Some((TAU / f64::from(sector)).round()),
                    GraphNumber::Uniform(_) => None,
                };
                let copies: Vec<NodeId> = match count {
                    // If every sector's copy is evaluated, folding space is unnecessary.
                    Some(count) if sectors.len() as f64 >= count => (0..count as u32)
                        .map(|sector| {
                            let turn = self.sector_rotation(op, TAU * f64::from(sector) / count);
                            let inner = if sector == 0 {
                                local_point
                            } else {
                                self.under_transform(local_point, turn)
                            };
                            self.shape(child, inner, value_use)
                        })
                        .collect(),
                    _ => sectors
                        .into_iter()
                        .map(|sector| {
                            let point = self.sector(op, &numbers, sector, local_point);
                            self.shape(child, local_point.moved_to(point), value_use)
                        })
                        .collect(),
                };
                self.union(copies, local_point)
            }
            _ => unreachable!("only repetitions have copies"),
        }
    }

    /// Returns the union of the copies in these cells along each axis.
    #[expect(
        clippy::too_many_arguments,
        reason = "a repetition and how it is wanted"
    )]
    fn grid(
        &mut self,
        op: Op,
        child: ShapeId,
        numbers: &[GraphNumber],
        cells: [Vec<f64>; 3],
        local_point: LocalPoint,
        value_use: ValueUse,
        cell_guard: Option<([[f64; 3]; 2], [bool; 3])>,
    ) -> NodeId {
        let mut copies = Vec::new();
        for &z in &cells[2] {
            for &y in &cells[1] {
                for &x in &cells[0] {
                    let cell_offset = [x, y, z];
                    let point = if cell_offset == [0.0; 3] {
                        self.apply(op, local_point, Vec::new(), numbers.to_vec())
                    } else {
                        let cell_offset =
                            cell_offset.map(|cell| GraphNumber::Constant(cell as f32));
                        let parameters = numbers.iter().copied().chain(cell_offset).collect();
                        self.apply(neighbour(op), local_point, Vec::new(), parameters)
                    };
                    let copy_point = local_point.moved_to(point);
                    let copy = self.shape(child, copy_point, value_use);
                    // The guard of an infinite grid reads the folded point.
                    let copy = match cell_guard {
                        Some((corners, axes)) if op == Op::Repeat => {
                            let parameters = guard_parameters(corners, axes, numbers, op);
                            self.apply(Op::RepeatGuard, copy_point, vec![copy], parameters)
                        }
                        _ => copy,
                    };
                    copies.push(copy);
                }
            }
        }
        self.union(copies, local_point)
    }

    /// Returns the map of a point to the frame of a shape that is rotated about the axis of a polar
    /// repetition.
    fn sector_rotation(&mut self, op: Op, angle: f64) -> [ExprId; 12] {
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

    /// Returns the point in the sector at this offset from its own.
    fn sector(
        &mut self,
        op: Op,
        numbers: &[GraphNumber],
        sector: f64,
        local_point: LocalPoint,
    ) -> NodeId {
        if sector == 0.0 {
            return self.apply(op, local_point, Vec::new(), numbers.to_vec());
        }
        let offset = GraphNumber::Constant(sector as f32);
        let parameters = numbers.iter().copied().chain([offset]).collect();
        self.apply(neighbour(op), local_point, Vec::new(), parameters)
    }

    fn union(&mut self, copies: Vec<NodeId>, local_point: LocalPoint) -> NodeId {
        let mut copies = copies.into_iter();
        let first = copies.next().expect("there is the copy of the own cell");
        copies.fold(first, |sum, copy| {
            self.apply(Op::Union, local_point, vec![sum, copy], Vec::new())
        })
    }

    /// Returns the corners of a cell's content, and the axes along which boxes replace its neighbours.
    fn cell_guard(
        &mut self,
        child: ShapeId,
        numbers: &[GraphNumber],
        others: [NeighbourCells; 3],
    ) -> Option<([[f64; 3]; 2], [bool; 3])> {
        let bounds = self.boxes.get(SceneRef::from(&*self.scene), child);
        if bounds.is_empty() {
            return None;
        }
        let axes: [bool; 3] = std::array::from_fn(|axis| {
            let GraphNumber::Constant(spacing) = numbers[axis] else {
                return false;
            };
            let half = f64::from(spacing).abs() / 2.0;
            let gap = (half + bounds.min[axis]).min(half - bounds.max[axis]);
            others[axis] == NEAREST_NEIGHBOURS && gap >= MIN_GAP_FRACTION * 2.0 * half
        });
        let is_constant = numbers
            .iter()
            .all(|n| matches!(n, GraphNumber::Constant(_)));
        let corners = [bounds.min, bounds.max].map(|corner| corner.map(|v| v.clamp(-1e18, 1e18)));
        (is_constant && axes != [false; 3]).then_some((corners, axes))
    }
}

/// Neighbouring copies of a shape that fits its cell.
const NEAREST_NEIGHBOURS: NeighbourCells = NeighbourCells { near: 1, far: 0 };

/// Returns the parameters of a guard, from those of a repetition and the content of its cells.
fn guard_parameters(
    corners: [[f64; 3]; 2],
    axes: [bool; 3],
    numbers: &[GraphNumber],
    op: Op,
) -> Vec<GraphNumber> {
    let constant = |n: &GraphNumber| match n {
        GraphNumber::Constant(v) => f64::from(*v),
        GraphNumber::Uniform(_) => unreachable!("guards are made of constants"),
    };
    let numbers: Vec<f64> = numbers.iter().map(constant).collect();
    let mut arguments: Vec<f64> = corners.concat();
    arguments.extend(&numbers[..3]);
    let row = match op {
        Op::Repeat => Op::RepeatGuard,
        _ => {
            // The last cell's index is one less than the number of cells.
            arguments.extend(numbers[6..9].iter().map(|last| last + 1.0));
            Op::RepeatLimitedGuard
        }
    };
    arguments.extend(axes.map(|axis| f64::from(u8::from(axis))));
    let prepared = sdfc_vm::table::prepare::<f64>(row, &arguments);
    prepared
        .into_iter()
        .map(|v| GraphNumber::Constant(v as f32))
        .collect()
}
