//! Solids with sloping walls at a flat face: cones and pyramids, and cylinders along any axis.
//!
//! A face moves along the axis while the walls are prolonged, so the face becomes larger or smaller.
//! Converging walls end in a tip.

use super::free_space::GrowingPart;
use super::section::{Section, transform_point};
use super::{AffineRows, CutContext, CutterExtension, IDENTITY, PathStep, scale};
use crate::scene::{ShapeId, ShapeKind};
use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::{Op, prepare};

/// A solid with flat faces across its axis, which is the y axis of its own frame.
#[derive(Clone)]
struct SlopedSolid {
    op: Op,
    /// Radii of the lower and the upper face; half sides for a pyramid.
    radii: [f64; 2],
    /// Heights of both faces.
    heights: [f64; 2],
    /// The map from its own frame to that of the part.
    placement: AffineRows,
}

impl SlopedSolid {
    /// Returns the solid of an operation with these parameters, if its faces can be moved.
    fn new(op: Op, numbers: &[f64]) -> Option<Self> {
        let (radii, half, placement) = match (op, numbers) {
            (Op::Cone, &[bottom, top, half, ..]) => ([bottom, top], half, IDENTITY),
            (Op::Pyramid, &[base, half, ..]) => ([base, 0.0], half, IDENTITY),
            (Op::CylinderBetween, &[x, y, z, r, along_x, along_y, along_z, half]) => {
                let placement =
                    placement_along(DVec3::new(along_x, along_y, along_z), DVec3::new(x, y, z));
                ([r, r], half, placement)
            }
            _ => return None,
        };
        let is_valid = radii.iter().all(|end| end.is_finite()) && half > 0.0 && half.is_finite();
        is_valid.then_some(Self {
            op,
            radii,
            heights: [-half, half],
            placement,
        })
    }

    /// Moves a face outwards by a length, but at most to the tip.
    fn extended(&self, upper: usize, distance: f64) -> Self {
        let (face, other) = (self.radii[upper], self.radii[1 - upper]);
        let rate = (face - other) / (self.heights[1] - self.heights[0]);
        let mut new = self.clone();
        let tip = face / -rate;
        let (distance, end) = match rate < 0.0 && distance >= tip {
            true => (tip, 0.0),
            false => (distance, face + rate * distance),
        };
        new.radii[upper] = end;
        new.heights[upper] += if upper == 1 { distance } else { -distance };
        new
    }

    /// Returns the bounding box, in its own frame, between two heights.
    fn between(&self, a: f64, b: f64) -> Bounds {
        let r = self.radii[0].max(self.radii[1]);
        Bounds {
            min: [-r, a.min(b), -r],
            max: [r, a.max(b), r],
        }
    }

    /// Returns the lower or upper face, by its index, in the frame of the part.
    fn section(&self, upper: usize) -> Section {
        let (r, y) = (self.radii[upper], self.heights[upper]);
        let is_round = self.op != Op::Pyramid;
        let points = match is_round {
            true => vec![DVec3::new(r, y, 0.0)],
            false => [[r, y, r], [r, y, -r], [-r, y, r], [-r, y, -r]]
                .map(DVec3::from)
                .to_vec(),
        };
        Section {
            points: points
                .into_iter()
                .map(|p| transform_point(&self.placement, p))
                .collect(),
            is_round,
            is_2d: false,
        }
    }
}

impl CutterExtension<'_> {
    /// Moves faces of a cone, a pyramid or a cylinder between points outwards where possible.
    pub(super) fn extend_sloped_faces(
        &mut self,
        id: ShapeId,
        path: &[PathStep],
        cut: &CutContext,
    ) -> ShapeId {
        let ShapeKind::Primitive { op, parameters } = self.kind(id) else {
            return id;
        };
        let op = *op;
        let solid = self
            .constants(parameters)
            .and_then(|numbers| SlopedSolid::new(op, &numbers));
        let max_step = cut.size / scale(path);
        let Some(mut solid) = solid.filter(|_| max_step.is_finite() && max_step > 0.0) else {
            return id;
        };
        let mut current = id;
        for upper in [1, 0] {
            // A tip is not a face.
            if solid.radii[upper] == 0.0
                || self.protrudes(current, &solid, upper, max_step, (path, cut))
            {
                continue;
            }
            let mut accepted = None;
            self.largest_fraction(cut, |this, fraction| {
                let new = solid.extended(upper, max_step * fraction);
                let candidate = this.add_solid(id, &new);
                let part = GrowingPart {
                    id: candidate,
                    is_straight: false,
                    blend_radius: 0.0,
                    axis: 1,
                    placement: new.placement,
                    sections: Some([solid.section(upper), new.section(upper)]),
                };
                let added = new.between(solid.heights[upper], new.heights[upper]);
                let is_free = this.is_free(&part, &added, path, cut);
                if is_free {
                    accepted = Some((new, candidate));
                }
                is_free
            });
            if let Some((new, candidate)) = accepted {
                (solid, current) = (new, candidate);
            }
        }
        current
    }

    /// Reports whether a face already protrudes by the full distance.
    fn protrudes(
        &mut self,
        id: ShapeId,
        solid: &SlopedSolid,
        upper: usize,
        max_step: f64,
        (path, cut): (&[PathStep], &CutContext),
    ) -> bool {
        let [low, high] = solid.heights;
        if high - low <= max_step {
            return false;
        }
        let face = solid.heights[upper];
        let inner = if upper == 1 {
            face - max_step
        } else {
            face + max_step
        };
        let part = GrowingPart {
            id,
            is_straight: false,
            blend_radius: 0.0,
            axis: 1,
            placement: solid.placement,
            sections: None,
        };
        self.is_free(&part, &solid.between(inner, face), path, cut)
    }

    /// Adds the shape of a solid, with the name and the span of another shape.
    fn add_solid(&mut self, like: ShapeId, solid: &SlopedSolid) -> ShapeId {
        let [bottom, top] = solid.radii;
        let [low, high] = solid.heights;
        let point_at =
            |y: f64| transform_point(&solid.placement, DVec3::new(0.0, y, 0.0)).to_array();
        let numbers = match solid.op {
            Op::Cone => prepare(Op::Cone, &[bottom, top, high - low]),
            Op::Pyramid => prepare(Op::Pyramid, &[2.0 * bottom, high - low]),
            _ => {
                let end_points = [point_at(low), point_at(high)].concat();
                prepare(Op::CylinderBetween, &[end_points, vec![bottom]].concat())
            }
        };
        let expressions = &mut self.scene.expressions;
        let parameters = numbers
            .into_iter()
            .map(|v| expressions.constant(v))
            .collect();
        let op = solid.op;
        let child = self
            .scene
            .derived(like, ShapeKind::Primitive { op, parameters });
        match op {
            Op::CylinderBetween => child,
            _ => self.translated(like, child, [0.0, (low + high) / 2.0, 0.0]),
        }
    }
}

/// Returns the frame with its origin at a point and the y axis along a direction.
fn placement_along(axis: DVec3, origin: DVec3) -> AffineRows {
    let helper = if axis.x.abs() < 0.5 {
        DVec3::X
    } else {
        DVec3::Z
    };
    let side = axis.cross(helper);
    let side = side / side.length();
    let third = side.cross(axis);
    std::array::from_fn(|i| [side[i], axis[i], third[i], origin[i]])
}
