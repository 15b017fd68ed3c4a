//! Regular polygons and prisms, of which a side ends flush. They become polygons, whose edges can be moved.

use super::{CutContext, CutterExtension, PathStep};
use crate::analysis::bounds::inverse;
use crate::scene::{ShapeId, ShapeKind};
use glam::DVec2;
use sdfc_vm::table::Op;
use std::f64::consts::TAU;

/// The map from the frame of a prism, along y, to that of an extrusion, along z.
const PRISM_TO_EXTRUSION: [f64; 12] = [1.0, 0.0, 0.0, 0.0, 0.0, 0.0, -1.0, 0.0, 0.0, 1.0, 0.0, 0.0];

impl CutterExtension<'_> {
    /// Moves sides of a regular polygon or prism outwards; `None` if none can be moved.
    pub(super) fn extend_regular_sides(
        &mut self,
        id: ShapeId,
        path: &[PathStep],
        cut: &CutContext,
    ) -> Option<ShapeId> {
        let ShapeKind::Primitive { op, parameters } = self.kind(id).clone() else {
            return None;
        };
        let corners = regular_corners(op, &self.constants(&parameters)?)?;
        let profile = self.add_polygon(id, &corners);
        self.scene.shapes[profile.0 as usize].is_2d = true;
        match parameters.last() {
            Some(&half) if op == Op::Prism => {
                let rows = inverse(&PRISM_TO_EXTRUSION)?;
                let height = self.bounds(id).max[1];
                let mut path = [path, &[PathStep::Map(rows)]].concat();
                path.push(PathStep::along_z(-height, height));
                let extended = self.extend_polygon_edges(profile, &path, cut);
                path.pop();
                (extended != profile).then(|| {
                    let solid = self.scene.derived(
                        id,
                        ShapeKind::Distance {
                            op: Op::Extrude,
                            child: extended,
                            parameters: vec![half],
                        },
                    );
                    let child = self.extend_flat_faces(solid, &path, cut);
                    let mut number = |v: f64| self.scene.expressions.constant(v);
                    let (matrix, scale) = (PRISM_TO_EXTRUSION.map(&mut number), number(1.0));
                    let kind = ShapeKind::Frame {
                        child,
                        matrix,
                        scale,
                    };
                    self.scene.derived(id, kind)
                })
            }
            _ => {
                let extended = self.extend_polygon_edges(profile, path, cut);
                (extended != profile).then_some(extended)
            }
        }
    }
}

/// Returns the corners of a regular polygon, or of the profile of a regular prism.
fn regular_corners(op: Op, numbers: &[f64]) -> Option<Vec<DVec2>> {
    let &[sector, _, apothem, side, ..] = numbers else {
        return None;
    };
    let count = (TAU / sector).round();
    let radius = apothem.hypot(side);
    let corner = |index: u32| {
        let (sin, cos) = (f64::from(index) * TAU / count).sin_cos();
        match op {
            Op::Prism => DVec2::new(radius * cos, radius * sin),
            _ => DVec2::new(radius * sin, radius * cos),
        }
    };
    let is_regular = matches!(op, Op::Prism | Op::Ngon) && count <= f64::from(MAX_SIDES);
    is_regular.then(|| (0..count as u32).map(corner).collect())
}

/// Maximum number of sides of a regular polygon that becomes a polygon.
const MAX_SIDES: u32 = 64;
