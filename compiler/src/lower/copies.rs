//! Copies by folding space: the union of the copies that may be the nearest one to a point.

use super::{LocalPoint, Lowering, ValueUse};
use crate::expression::ExprId;
use crate::graph::{GraphNumber, NodeId};
use crate::scene::{ShapeId, ShapeKind, neighbour};
use sdfc_vm::table::Op;
use std::f64::consts::TAU;

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
                let cells = others.map(|others| others.cells().collect::<Vec<_>>());
                let mut copies = Vec::new();
                for &z in &cells[2] {
                    for &y in &cells[1] {
                        for &x in &cells[0] {
                            let point = self.cell(op, &numbers, [x, y, z], local_point);
                            copies.push(self.shape(child, local_point.moved_to(point), value_use));
                        }
                    }
                }
                self.union(copies, local_point)
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

    /// Returns the point in the cell at this offset from its own.
    fn cell(
        &mut self,
        op: Op,
        numbers: &[GraphNumber],
        offset: [f64; 3],
        local_point: LocalPoint,
    ) -> NodeId {
        if offset == [0.0; 3] {
            return self.apply(op, local_point, Vec::new(), numbers.to_vec());
        }
        let offset = offset.map(|cell| GraphNumber::Constant(cell as f32));
        let parameters = numbers.iter().copied().chain(offset).collect();
        self.apply(neighbour(op), local_point, Vec::new(), parameters)
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
}
