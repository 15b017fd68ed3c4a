//! Parts of an addition that another cutter holds.
//!
//! The hull of two cross sections lies in a convex cutter that holds their corners. Where another cutter has the
//! profile of the part, whose walls coincide with those of the part, it fills what lies between its own flat faces.

use super::copies::{Level, Region};
use super::mapped::{MappedRange, axial, is_round, rows_of_frame};
use super::room::{Part, largest};
use super::section::{Section, around, moved};
use super::{Lengthening, ROUNDED, Rows, SAME, TOUCHING, composed};
use crate::bounds::inverse;
use crate::scene::{Scene, ShapeId, ShapeKind};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// A span along an axis.
type Span = (usize, [f64; 2]);

impl Lengthening<'_> {
    /// Spans of a region in which another cutter holds all that the part has; `level` leads to that cutter's frame.
    pub(super) fn covered(
        &mut self,
        part: &Part,
        region: &Region,
        (other, level): (ShapeId, &Level),
    ) -> Vec<Span> {
        let mut found = Vec::new();
        if !region.is_ring
            && let Some(to_part) = region.to_part()
            && to_part.rows == SAME
            && let Some(span) = self.filled(other, part, &level.rows)
        {
            found.push((part.axis, span));
        }
        let mut parts = Vec::new();
        convex_parts(self.scene, other, &level.rows, &mut parts);
        for (id, rows) in parts {
            let own = self.bounds(id);
            found.extend(self.held(part, region, level, (id, &rows), &own));
        }
        found
    }

    /// The span in which a convex cutter holds the sections of a part.
    fn held(
        &mut self,
        part: &Part,
        region: &Region,
        level: &Level,
        (id, rows): (ShapeId, &Rows),
        own: &Bounds,
    ) -> Option<Span> {
        let [near, far] = part.sections.as_ref()?;
        let back = inverse(region.to_part()?.rows.as_flattened())?;
        let [near, far] = [near, far].map(|section| Section {
            points: section.points.iter().map(|&p| moved(&back, p)).collect(),
            ..section.clone()
        });
        let is_round_pair = is_round(self.scene, id) && axial(rows).is_some();
        // In the half plane of a ring, only solids around the same axis can be compared.
        if region.is_ring && !level.is_flat && !is_round_pair {
            return None;
        }
        // A turned profile need not be a convex solid.
        let is_turned = matches!(self.kind(id), ShapeKind::Domain { .. });
        if is_turned && !(is_round_pair && (near.is_round || region.is_ring)) {
            return None;
        }
        if near.is_round && region.to_part()?.rows != part.frame {
            return None;
        }
        let axes = if near.is_round { 1..2 } else { 0..3 };
        let (axis, from, to) = axes.into_iter().find_map(|axis| {
            let from = place_along(&near.points, axis)?;
            let to = place_along(&far.points, axis)?;
            let least = TOUCHING * from.abs().max(to.abs());
            ((to - from).abs() > least).then_some((axis, from, to))
        })?;
        let mut span = [region.bounds.min[axis], region.bounds.max[axis]];
        if let Some(outwards) = inverse(rows.as_flattened()) {
            let ends = own.mapped(&outwards);
            span = [span[0].max(ends.min[axis]), span[1].min(ends.max[axis])];
        }
        if span.iter().any(|end| !end.is_finite()) || span[0] >= span[1] {
            return None;
        }
        // Signs are certain a little inside only.
        let margin = TOUCHING * largest(&region.bounds);
        let mut points = Vec::new();
        for end in [span[0] + margin, span[1] - margin] {
            let corners = near.inset_between(&far, (end - from) / (to - from));
            for corner in corners {
                match near.is_round {
                    true if is_round_pair => points.extend([corner, [0.0, corner[1], 0.0]]),
                    true => points.extend(around(corner)),
                    false if near.is_plane && !region.is_ring => {
                        let ends = [region.bounds.min[2] + margin, region.bounds.max[2] - margin];
                        points.extend(ends.map(|z| [corner[0], corner[1], z]));
                    }
                    false => points.push(corner),
                }
            }
        }
        let is_finite = points.iter().flatten().all(|v| v.is_finite());
        let size = points
            .iter()
            .flatten()
            .fold(0.0, |most: f64, v| most.max(v.abs()));
        let scene = &*self.scene;
        let mut uniform = |id| {
            let constant = scene.expressions.as_constant(id);
            constant.map_or(Interval::ALL, Interval::point)
        };
        let mut range = MappedRange::new(scene, &mut uniform);
        let mut is_in = |&p: &[f64; 3]| range.most_at(id, moved(rows, p)) <= ROUNDED * size;
        (is_finite && points.iter().all(&mut is_in)).then_some((axis, span))
    }

    /// The ends, along the part's axis and in its frame, of a shape with the part's profile; `rows` lead from that
    /// frame to the shape's.
    fn filled(&mut self, id: ShapeId, part: &Part, rows: &Rows) -> Option<[f64; 2]> {
        match self.kind(id).clone() {
            ShapeKind::Painted { child, .. } => self.filled(child, part, rows),
            ShapeKind::Frame { child, matrix, .. } => {
                let inner = rows_of_frame(self.scene, &matrix)?;
                self.filled(child, part, &composed(&inner, rows))
            }
            ShapeKind::Combine {
                op: Op::Union,
                children,
                ..
            } => children
                .into_iter()
                .find_map(|child| self.filled(child, part, rows)),
            ShapeKind::Primitive { .. } | ShapeKind::Distance { .. } => {
                let (own, axis) = (self.bounds(id), part.axis);
                let shift = rows[axis][3];
                (is_shift_along(rows, axis, &own) && self.have_one_profile(id, part.id, axis))
                    .then(|| [own.min[axis] - shift, own.max[axis] - shift])
            }
            _ => None,
        }
    }

    /// Reports whether two shapes are the same but for how far they reach along an axis.
    fn have_one_profile(&self, a: ShapeId, b: ShapeId, axis: usize) -> bool {
        let parts = |id: ShapeId| match self.kind(id) {
            ShapeKind::Primitive { op, parameters } => Some((*op, None, parameters)),
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => Some((*op, Some(*child), parameters)),
            _ => None,
        };
        let (Some((op, child, numbers)), Some((other, other_child, others))) = (parts(a), parts(b))
        else {
            return false;
        };
        let mut flats = op.row().meta.flats.iter();
        let Some(flat) = flats.find(|flat| flat.axis == axis) else {
            return false;
        };
        let rest = (0..numbers.len()).filter(|&at| at != flat.half);
        let (Some(numbers), Some(others)) = (self.constants(numbers), self.constants(others))
        else {
            return false;
        };
        let is_one = |at: usize| (numbers[at] - others[at]).abs() <= TOUCHING * numbers[at].abs();
        op == other && child == other_child && rest.into_iter().all(is_one)
    }
}

/// The place of points along an axis, if they have one.
fn place_along(points: &[[f64; 3]], axis: usize) -> Option<f64> {
    let first = points.first()?[axis];
    let size = points
        .iter()
        .flatten()
        .fold(0.0, |most: f64, v| most.max(v.abs()));
    let is_there = |p: &[f64; 3]| (p[axis] - first).abs() <= TOUCHING * size;
    points.iter().all(is_there).then_some(first)
}

/// Collects the convex solids and turned convex profiles of a union, with the maps to their frames. Recursion over
/// shapes within shapes, whose depth the elaborator bounds.
fn convex_parts(scene: &Scene, id: ShapeId, rows: &Rows, parts: &mut Vec<(ShapeId, Rows)>) {
    match &scene.shapes[id.0 as usize].kind {
        ShapeKind::Painted { child, .. } => convex_parts(scene, *child, rows, parts),
        ShapeKind::Frame { child, matrix, .. } => {
            if let Some(inner) = rows_of_frame(scene, matrix) {
                convex_parts(scene, *child, &composed(&inner, rows), parts);
            }
        }
        ShapeKind::Combine {
            op: Op::Union,
            children,
            ..
        } => {
            for &child in children {
                convex_parts(scene, child, rows, parts);
            }
        }
        ShapeKind::Domain {
            op: Op::Revolve,
            child,
            ..
        } if is_convex(scene, *child) => parts.push((id, *rows)),
        _ if is_convex(scene, id) => parts.push((id, *rows)),
        _ => {}
    }
}

/// Reports whether a shape is convex. Recursion as above.
fn is_convex(scene: &Scene, id: ShapeId) -> bool {
    match &scene.shapes[id.0 as usize].kind {
        ShapeKind::Painted { child, .. }
        | ShapeKind::Frame { child, .. }
        | ShapeKind::Distance {
            op: Op::Extrude | Op::RoundedExtrude,
            child,
            ..
        } => is_convex(scene, *child),
        ShapeKind::Combine {
            op: Op::Intersection,
            children,
            ..
        } => children.iter().all(|&child| is_convex(scene, child)),
        ShapeKind::Polygon { .. } => {
            super::section::corners(scene, id).is_some_and(|corners| turns_one_way(&corners))
        }
        ShapeKind::Primitive { op, .. } => is_convex_row(*op),
        _ => false,
    }
}

/// Reports whether the solids of a row are convex.
pub(super) fn is_convex_row(op: Op) -> bool {
    matches!(
        op,
        Op::Sphere
            | Op::Cuboid
            | Op::RoundedCuboid
            | Op::Capsule
            | Op::CapsuleBetween
            | Op::Cylinder
            | Op::RoundedCylinder
            | Op::CylinderBetween
            | Op::Cone
            | Op::RoundedCone
            | Op::RoundCone
            | Op::Ellipsoid
            | Op::Plane
            | Op::Slab
            | Op::Prism
            | Op::Octahedron
            | Op::Tetrahedron
            | Op::Pyramid
            | Op::Circle
            | Op::Rect
            | Op::RoundedRect
            | Op::Segment
            | Op::Ngon
    )
}

/// Reports whether a polygon turns one way at all corners, once around.
fn turns_one_way(corners: &[[f64; 2]]) -> bool {
    let count = corners.len();
    let edge = |at: usize| {
        let ([ax, ay], [bx, by]) = (corners[at % count], corners[(at + 1) % count]);
        [bx - ax, by - ay]
    };
    let turn = |at: usize| {
        let ([ax, ay], [bx, by]) = (edge(at), edge(at + 1));
        (ax * by - ay * bx).atan2(ax * bx + ay * by)
    };
    let turns: Vec<f64> = (0..count).map(turn).collect();
    let sum: f64 = turns.iter().sum();
    let is_once = (sum.abs() - std::f64::consts::TAU).abs() < 1e-6;
    is_once && turns.iter().all(|turn| turn * sum >= -TOUCHING)
}

/// Reports whether rows of a map shift points along an axis and leave them as they are otherwise.
fn is_shift_along(rows: &Rows, axis: usize, own: &Bounds) -> bool {
    let size = largest(own);
    (0..3).all(|row| {
        (0..4).all(|column| {
            let (value, unit) = (rows[row][column], SAME[row][column]);
            match column {
                3 => row == axis || value.abs() <= TOUCHING * size,
                _ => (value - unit).abs() <= TOUCHING,
            }
        })
    })
}
