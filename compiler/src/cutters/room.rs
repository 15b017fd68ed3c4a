//! Proofs that nothing is left of a body where a cutter grows.
//!
//! Boxes alone are compared first. What they leave is halved, and intervals tell of each half if it lies outside
//! of the grown part, outside of the body, or in another cutter. Values that are zero but for rounding count as
//! outside: faces may touch. Where another cutter has the same profile, whose walls coincide with those of the
//! part, it fills what lies between its own flat faces.

use super::copies::Region;
use super::{Cut, Lengthening, Part, Rows, SAME, Step, TOUCHING, composed};
use crate::bounds::{World, inverse};
use crate::scene::{ShapeId, ShapeKind};
use crate::shape_range::ShapeRange;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// The most boxes that one proof halves.
const MOST_HALVED: usize = 400;
/// The size of the boxes that are halved no more, as a fraction of the region.
const FINEST: f64 = 1.0 / 64.0;

impl Lengthening<'_> {
    /// Tells if nothing is left in a box of a part's frame, by which the part grows.
    pub(super) fn is_free(
        &mut self,
        part: &Part,
        added: &Bounds,
        path: &[Step],
        cut: &Cut,
    ) -> bool {
        let Some(regions) = Region::all(added, path) else {
            return false;
        };
        regions
            .iter()
            .all(|region| self.is_free_within(part, region, cut))
    }

    fn is_free_within(&mut self, part: &Part, region: &Region, cut: &Cut) -> bool {
        if region.bounds.is_empty() {
            return true;
        }
        let Some(back) = inverse(region.rows.as_flattened()) else {
            return false;
        };
        if self.is_clear(cut.body, &back, &region.bounds) {
            return true;
        }
        let outer = region.bounds.mapped(&region.rows);
        let near: Vec<(ShapeId, Rows)> = cut
            .others
            .iter()
            .filter(|other| !are_apart(&other.bounds, &outer))
            .filter_map(|other| {
                let to_other = inverse(other.rows.as_flattened())?;
                Some((other.id, composed(&to_other, &region.rows)))
            })
            .collect();
        let mut left = region.clone();
        if region.is_own {
            for (other, rows) in &near {
                if let Some(span) = self.filled(*other, part, rows) {
                    left.without(part.axis, span);
                }
            }
        }
        if left.bounds.is_empty() {
            return true;
        }
        left.bounds != region.bounds && self.is_clear(cut.body, &back, &left.bounds)
            || self.is_outside(part, &left, cut.body, &near)
    }

    /// Tells if boxes prove that nothing of a shape is in a box; `rows` lead from its frame to that of the box.
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
                let rows_of_child = self.constants(&matrix).and_then(|matrix| inverse(&matrix));
                rows_of_child
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

    /// The ends, along the part's axis and in its frame, of a shape with the part's profile; `rows` lead from that
    /// frame to the shape's.
    fn filled(&mut self, id: ShapeId, part: &Part, rows: &Rows) -> Option<[f64; 2]> {
        match self.kind(id).clone() {
            ShapeKind::Painted { child, .. } => self.filled(child, part, rows),
            ShapeKind::Frame { child, matrix, .. } => {
                let matrix = self.constants(&matrix)?;
                let inner =
                    std::array::from_fn(|row| std::array::from_fn(|at| matrix[4 * row + at]));
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

    /// Tells if two shapes are the same but for how far they reach along an axis.
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

    /// Tells if intervals prove that what a part has in a region lies outside of the body or in other cutters, to
    /// which the rows lead from the region's frame.
    fn is_outside(
        &mut self,
        part: &Part,
        region: &Region,
        body: ShapeId,
        cutters: &[(ShapeId, Rows)],
    ) -> bool {
        let (ShapeKind::Primitive { op, .. } | ShapeKind::Distance { op, .. }) = self.kind(part.id)
        else {
            return false;
        };
        let flats: Vec<usize> = op.row().meta.flats.iter().map(|flat| flat.axis).collect();
        let middle = self.bounds(part.id).centre();
        let scene = &*self.scene;
        let mut uniform = |id| {
            let constant = scene.expressions.as_constant(id);
            constant.map_or(Interval::ALL, Interval::point)
        };
        let mut range = ShapeRange::new(World::from(scene), &mut uniform);
        let whole = longest(&region.bounds).1;
        let mut open = vec![region.bounds];
        let mut proved = true;
        for _ in 0..MOST_HALVED {
            let Some(bounds) = open.pop() else { break };
            let (axis, side) = longest(&bounds);
            let outer = bounds.mapped(&region.rows);
            let touching = TOUCHING * largest(&outer).max(largest(&bounds));
            let body = range.over(body, &outer);
            if body.lo >= -touching {
                continue;
            }
            let mut own = Interval::point(-1.0);
            if region.is_own {
                // A part is as wide beyond its flat faces as in its middle.
                let mut profile = bounds;
                for &axis in &flats {
                    (profile.min[axis], profile.max[axis]) = (middle[axis], middle[axis]);
                }
                own = range.over(part.id, &profile);
                if own.lo >= -touching {
                    continue;
                }
            }
            let mut may_be_cut = false;
            let is_cut = cutters.iter().any(|(other, rows)| {
                let value = range.over(*other, &bounds.mapped(rows));
                may_be_cut |= value.lo < 0.0;
                value.hi <= touching
            });
            if is_cut {
                continue;
            }
            let is_solid = body.hi < 0.0 && own.hi < 0.0 && !may_be_cut;
            if is_solid || side <= whole * FINEST || range.operations >= self.operations {
                proved = false;
                break;
            }
            let middle = (bounds.min[axis] + bounds.max[axis]) / 2.0;
            let (mut low, mut high) = (bounds, bounds);
            (low.max[axis], high.min[axis]) = (middle, middle);
            open.extend([low, high]);
        }
        self.operations = self.operations.saturating_sub(range.operations);
        proved && open.is_empty()
    }
}

/// Tells if rows of a map shift points along an axis and leave them as they are otherwise.
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

/// The longest side of a box, and its length.
fn longest(bounds: &Bounds) -> (usize, f64) {
    let sides = (0..3).map(|axis| (axis, bounds.max[axis] - bounds.min[axis]));
    sides.fold((0, f64::NEG_INFINITY), |best, next| {
        if next.1 > best.1 { next } else { best }
    })
}

/// The largest of a box's finite coordinates.
fn largest(bounds: &Bounds) -> f64 {
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

/// Tells if two boxes have no more than faces in common.
fn are_apart(a: &Bounds, b: &Bounds) -> bool {
    (0..3).any(|axis| {
        let slack = slack(a, b, axis);
        a.min[axis] + slack >= b.max[axis] || a.max[axis] - slack <= b.min[axis]
    })
}
