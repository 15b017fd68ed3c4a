//! Proofs that nothing is left of a body where a cutter grows.
//!
//! Boxes alone are compared first. What they leave is halved, and intervals tell of each half if it lies outside
//! of the grown part, outside of the body, or in another cutter. Values that are zero but for rounding count as
//! outside: faces may touch. What other cutters hold entirely is left out before (`cover`).

use super::copies::{Level, Region};
use super::mapped::{MappedRange, Place, rows_of_frame};
use super::section::Section;
use super::{Cut, Lengthening, ROUNDED, Rows, Step, TOUCHING, composed};
use crate::bounds::inverse;
use crate::scene::{ShapeId, ShapeKind};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// The most boxes that one proof halves.
const MOST_HALVED: usize = 400;
/// The size of the boxes that are halved no more, as a fraction of the region.
const FINEST: f64 = 1.0 / 64.0;

/// A part of a cutter that grows across one of its faces.
pub(super) struct Part {
    /// The part with the face farther out, or the part as it was.
    pub(super) id: ShapeId,
    /// It is as wide beyond its flat faces as in its middle; else it is the grown one.
    pub(super) is_straight: bool,
    /// The distance from the part, in its frame, as far as which it is blended with the body.
    pub(super) reach: f64,
    /// The axis of the region's frame along which the face moves.
    pub(super) axis: usize,
    /// The map from the region's frame to that of the part.
    pub(super) frame: Rows,
    /// Cross sections whose hull holds all that is added: where the face was, and where it may come to stand.
    pub(super) sections: Option<[Section; 2]>,
}

impl Lengthening<'_> {
    /// Reports whether nothing is left in a box by which a part grows.
    pub(super) fn is_free(
        &mut self,
        part: &Part,
        added: &Bounds,
        path: &[Step],
        cut: &Cut,
    ) -> bool {
        let Some(regions) = Region::all(added, &part.frame, path) else {
            return false;
        };
        let is_plane = self.scene.shapes[cut.body.unwrap_or(part.id).0 as usize].plane;
        regions.into_iter().all(|mut region| {
            if is_plane {
                (region.bounds.min[2], region.bounds.max[2]) = (0.0, 0.0);
            }
            self.is_free_within(part, &region, cut)
        })
    }

    fn is_free_within(&mut self, part: &Part, region: &Region, cut: &Cut) -> bool {
        if region.bounds.is_empty() {
            return true;
        }
        let Some(back) = inverse(region.rows.as_flattened()) else {
            return false;
        };
        let around = |region: &Region| region.place(region.bounds).bounds();
        let is_clear = |this: &mut Self, region: &Region| {
            cut.body
                .is_some_and(|body| this.is_clear(body, &back, &around(region)))
        };
        if is_clear(self, region) {
            return true;
        }
        let outer = around(region).mapped(&region.rows);
        if part.reach > 0.0 {
            // Others hold the part, but not what is near to it.
            return self.is_outside(part, region, cut.body, &[]);
        }
        let near: Vec<(ShapeId, Level)> = cut
            .others
            .iter()
            .filter(|other| !other.is_grown && !are_apart(&other.bounds, &outer))
            .filter_map(|other| Some((other.id, region.level(other.depth)?.clone())))
            .collect();
        let mut left = region.clone();
        for (other, level) in &near {
            for (axis, span) in self.covered(part, region, (*other, level)) {
                left.without(axis, span);
            }
        }
        if left.bounds.is_empty() {
            return true;
        }
        left.bounds != region.bounds && is_clear(self, &left)
            || self.is_outside(part, &left, cut.body, &near)
    }

    /// Reports whether boxes prove that nothing of a shape is in a box; `rows` lead from its frame to that of the box.
    fn is_clear(&mut self, id: ShapeId, rows: &Rows, region: &Bounds) -> bool {
        let Some(left) = self.left.checked_sub(1) else {
            return false;
        };
        self.left = left;
        let own = self.bounds(id);
        if own.is_empty() || are_apart(&own.mapped(rows), region) {
            return true;
        }
        match self.kind(id).clone() {
            ShapeKind::Painted { child, .. } => self.is_clear(child, rows, region),
            ShapeKind::Frame { child, matrix, .. } => {
                let rows_of_child = rows_of_frame(self.scene, &matrix);
                rows_of_child
                    .and_then(|rows| inverse(rows.as_flattened()))
                    .is_some_and(|inner| self.is_clear(child, &composed(rows, &inner), region))
            }
            ShapeKind::Combine { op, children, .. } => {
                let mut clear = |child: ShapeId| self.is_clear(child, rows, region);
                match op {
                    Op::Union => children.into_iter().all(clear),
                    Op::Intersection => children.into_iter().any(clear),
                    Op::Subtraction => clear(children[0]),
                    _ => false,
                }
            }
            _ => false,
        }
    }

    /// Reports whether intervals prove that what a part has in a region lies outside of the body or in other cutters.
    fn is_outside(
        &mut self,
        part: &Part,
        region: &Region,
        body: Option<ShapeId>,
        cutters: &[(ShapeId, Level)],
    ) -> bool {
        let (ShapeKind::Primitive { op, .. } | ShapeKind::Distance { op, .. }) = self.kind(part.id)
        else {
            return self.is_outside_by(part, None, region, body, cutters);
        };
        let flats = op.row().meta.flats.iter().map(|flat| flat.axis).collect();
        let middle = part.is_straight.then(|| self.bounds(part.id).centre());
        let middle = middle.map(|middle| (middle, flats));
        self.is_outside_by(part, middle, region, body, cutters)
    }

    /// The same, with the middle of a straight part and the axes of its flat faces.
    fn is_outside_by(
        &mut self,
        part: &Part,
        middle: Option<([f64; 3], Vec<usize>)>,
        region: &Region,
        body: Option<ShapeId>,
        cutters: &[(ShapeId, Level)],
    ) -> bool {
        let scene = &*self.scene;
        let mut uniform = |id| {
            let constant = scene.expressions.as_constant(id);
            constant.map_or(Interval::ALL, Interval::point)
        };
        let mut range = MappedRange::new(scene, &mut uniform);
        let of_level = |level: &Level, bounds: &Bounds| match level.is_flat {
            true => Place::Box(Place::half_plane(bounds)),
            false => region.place(*bounds),
        };
        // What touches a face is not looked at.
        let around = region.place(region.bounds).bounds();
        let margin = TOUCHING * largest(&around.mapped(&region.rows)).max(largest(&around));
        let mut inner = region.bounds.grown(-margin);
        if region.is_ring {
            (inner.min[2], inner.max[2]) = (region.bounds.min[2], region.bounds.max[2]);
        }
        for axis in 0..3 {
            if inner.min[axis] > inner.max[axis] {
                (inner.min[axis], inner.max[axis]) =
                    (region.bounds.min[axis], region.bounds.max[axis]);
            }
        }
        let whole = longest(region, &inner).1;
        let mut open = vec![inner];
        let mut proved = true;
        for _ in 0..MOST_HALVED {
            let Some(bounds) = open.pop() else { break };
            let (axis, side) = longest(region, &bounds);
            let place = region.place(bounds);
            let touching =
                ROUNDED * largest(&place.bounds().mapped(&region.rows)).max(largest(&bounds));
            let value = body.map_or(Interval::point(f64::NEG_INFINITY), |body| {
                range.over(body, &region.rows, &place)
            });
            if value.lo >= -touching {
                continue;
            }
            let mut own = Interval::point(-1.0);
            if let Some(level) = region.to_part() {
                own = match (&middle, of_level(level, &bounds)) {
                    (Some((middle, flats)), Place::Box(inner)) => {
                        let mut profile = inner.mapped(&level.rows);
                        for &axis in flats {
                            (profile.min[axis], profile.max[axis]) = (middle[axis], middle[axis]);
                        }
                        range.range.over(part.id, &profile)
                    }
                    (_, place) => range.over(part.id, &level.rows, &place),
                };
                if own.lo >= part.reach - touching {
                    continue;
                }
            }
            let mut may_be_cut = false;
            let is_cut = cutters.iter().any(|(other, level)| {
                let value = range.over(*other, &level.rows, &of_level(level, &bounds));
                may_be_cut |= value.lo < 0.0;
                value.hi <= touching
            });
            if is_cut {
                continue;
            }
            let is_solid = value.hi < 0.0 && own.hi < 0.0 && !may_be_cut;
            if is_solid || side <= whole * FINEST || range.range.operations >= self.operations {
                proved = false;
                break;
            }
            let middle = (bounds.min[axis] + bounds.max[axis]) / 2.0;
            let (mut low, mut high) = (bounds, bounds);
            (low.max[axis], high.min[axis]) = (middle, middle);
            open.extend([low, high]);
        }
        self.operations = self.operations.saturating_sub(range.range.operations);
        proved && open.is_empty()
    }
}

/// The longest side of a region, and its length; that of a full turn is the diameter.
fn longest(region: &Region, bounds: &Bounds) -> (usize, f64) {
    let length = |axis: usize| {
        let side = bounds.max[axis] - bounds.min[axis];
        match region.is_ring && axis == 2 {
            true => side * bounds.max[0] / std::f64::consts::PI,
            false => side,
        }
    };
    let sides = (0..3).map(|axis| (axis, length(axis)));
    sides.fold((0, f64::NEG_INFINITY), |best, next| {
        if next.1 > best.1 { next } else { best }
    })
}

/// The largest of a box's finite coordinates.
pub(super) fn largest(bounds: &Bounds) -> f64 {
    let ends = bounds.min.into_iter().chain(bounds.max);
    let finite = ends.filter(|end| end.is_finite());
    finite.fold(0.0, |most: f64, end| most.max(end.abs()))
}

/// The overlap of two boxes along an axis that counts as none.
fn slack(a: &Bounds, b: &Bounds, axis: usize) -> f64 {
    let ends = [a.min[axis], a.max[axis], b.min[axis], b.max[axis]];
    let finite = ends.into_iter().filter(|end| end.is_finite());
    TOUCHING * finite.fold(0.0, |most: f64, end| most.max(end.abs()))
}

/// Reports whether two boxes have no more than faces in common.
fn are_apart(a: &Bounds, b: &Bounds) -> bool {
    (0..3).any(|axis| {
        let slack = slack(a, b, axis);
        a.min[axis] + slack >= b.max[axis] || a.max[axis] - slack <= b.min[axis]
    })
}
