//! A box and half spaces that together enclose an endless solid, by which rays end.

use crate::analysis::bounds::{ShapeBounds, composed, inverse};
use crate::analysis::shape_range::ShapeRange;
use crate::expression::ExprId;
use crate::scene::{SceneRef, ShapeId, ShapeKind};
use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::row::{BoundsRule, SetOperation};
use sdfc_vm::settings::{Enclosure, MAX_HALF_SPACES};
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Margin of a half space, as a fraction of the distance of its plane from the origin.
const MARGIN_FRACTION: f64 = 1e-5;
/// Least depth that is tried for the solid part of a half space, as a fraction of the distance of its plane.
const MIN_SOLID_DEPTH: f64 = 1e-3;
/// Number of depths that are tried, each twice the one before.
const MAX_DOUBLINGS: u32 = 32;
/// Maximum number of shapes that are looked at.
const MAX_VISITS: usize = 4096;

/// Returns an enclosure of a solid at the current values, or `None` if none is known. `unions` holds the unions that fields
/// are equivalent to.
///
/// Outside of it, each operand of the unions is proved to be positive, and a blend of them, too.
pub(crate) fn enclosure(
    scene: SceneRef<'_>,
    boxes: &mut ShapeBounds,
    root: ShapeId,
    unions: &HashMap<ShapeId, ShapeId>,
) -> Option<Enclosure> {
    let mut parts = vec![EnclosedPart::root(root)];
    let mut found = FoundRegions::default();
    let mut visits = 0;
    while let Some(part) = parts.pop() {
        visits += 1;
        if visits > MAX_VISITS || found.count() > MAX_HALF_SPACES {
            return None;
        }
        match &scene.shapes[part.id.0 as usize].kind {
            ShapeKind::Painted { child, .. } => parts.push(part.with_child(*child)),
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } if op.row().facts.set == Some(SetOperation::Union) => {
                let [near, far] = union_levels(scene, boxes, *op, parameters, children)?;
                parts.extend(children.iter().map(|&child| {
                    let is_finite = boxes.get(scene, child).is_finite();
                    part.with_child(child)
                        .blended(if is_finite { near } else { far })
                }));
            }
            // The signs are the same, but not all values.
            ShapeKind::Field { .. } if part.level == 0.0 && unions.contains_key(&part.id) => {
                parts.push(part.with_child(unions[&part.id]));
            }
            ShapeKind::Combine { op, children, .. }
                if matches!(op.row().facts.bounds, BoundsRule::FirstOperand) =>
            {
                parts.push(part.with_child(children[0]).cut());
            }
            ShapeKind::Distance {
                op: Op::Offset,
                child,
                parameters,
            } => {
                let by = boxes.number(scene, parameters[0]);
                parts.push(part.with_child(*child).offset(by));
            }
            ShapeKind::Frame {
                child,
                matrix,
                scale,
            } if !boxes.get(scene, part.id).is_finite() => {
                let matrix = rows(scene, boxes, matrix);
                let scale = boxes.number(scene, *scale);
                parts.push(part.with_child(*child).framed(&matrix, scale)?);
            }
            _ => found.add(scene, boxes, &part)?,
        }
    }
    let exact_half_spaces = found.exact.len();
    let solid_half_spaces = exact_half_spaces + found.solid.len();
    let half_spaces = [found.exact, found.solid, found.others].concat();
    (1..=MAX_HALF_SPACES)
        .contains(&half_spaces.len())
        .then_some(Enclosure {
            bounds: found.bounds,
            half_spaces,
            exact_half_spaces,
            solid_half_spaces,
            solid_depth: found.solid_depth,
        })
}

/// Affine map: rows of three factors and a shift.
type MatrixRows = [[f64; 4]; 3];

/// A shape, and a level that it does not exceed in its part of the solid.
#[derive(Clone, Debug)]
struct EnclosedPart {
    id: ShapeId,
    /// Upper bound of its values there, in its own units.
    level: f64,
    /// Share of the level that is due to blends.
    blend_level: f64,
    /// Set if something is cut from the shape.
    is_cut: bool,
    /// Map from points of the scene to those of the shape, if it is in frames.
    to_inner: Option<MatrixRows>,
}

impl EnclosedPart {
    fn root(id: ShapeId) -> Self {
        Self {
            id,
            level: 0.0,
            blend_level: 0.0,
            is_cut: false,
            to_inner: None,
        }
    }

    fn with_child(&self, id: ShapeId) -> Self {
        Self { id, ..self.clone() }
    }

    fn cut(self) -> Self {
        let is_cut = true;
        Self { is_cut, ..self }
    }

    fn offset(self, by: f64) -> Self {
        let level = self.level + by;
        Self { level, ..self }
    }

    fn blended(self, growth: f64) -> Self {
        let blend_level = self.blend_level + growth;
        Self {
            blend_level,
            ..self.offset(growth)
        }
    }

    /// Returns the part in a frame of the child; `None` if its scale is not positive.
    fn framed(self, matrix: &MatrixRows, scale: f64) -> Option<Self> {
        let to_inner = self
            .to_inner
            .map_or(*matrix, |outer| composed(matrix, &outer));
        (scale > 0.0).then_some(Self {
            level: self.level / scale,
            blend_level: self.blend_level / scale,
            to_inner: Some(to_inner),
            ..self
        })
    }

    /// Returns a box of the scene around a box of the shape.
    fn outer_box(&self, bounds: &Bounds) -> Option<Bounds> {
        match &self.to_inner {
            None => Some(*bounds),
            Some(to_inner) => Some(bounds.mapped(&inverse(to_inner.as_flattened())?)),
        }
    }
}

/// Returns a linear function of mapped points as one of points: three factors and a shift.
fn before_map([x, y, z, shift]: [f64; 4], rows: &MatrixRows) -> [f64; 4] {
    std::array::from_fn(|i| {
        let sum = x * rows[0][i] + y * rows[1][i] + z * rows[2][i];
        sum + if i == 3 { shift } else { 0.0 }
    })
}

/// Returns the rows of a frame at the current values.
fn rows(scene: SceneRef<'_>, boxes: &mut ShapeBounds, matrix: &[ExprId; 12]) -> MatrixRows {
    let row = |row: usize| [0, 1, 2, 3].map(|column| matrix[4 * row + column]);
    [0, 1, 2].map(|i| row(i).map(|n| boxes.number(scene, n)))
}

/// Regions found so far.
struct FoundRegions {
    bounds: Bounds,
    exact: Vec<[f64; 4]>,
    solid: Vec<[f64; 4]>,
    others: Vec<[f64; 4]>,
    solid_depth: f64,
}

impl Default for FoundRegions {
    fn default() -> Self {
        Self {
            bounds: Bounds::EMPTY,
            exact: Vec::new(),
            solid: Vec::new(),
            others: Vec::new(),
            solid_depth: 0.0,
        }
    }
}

impl FoundRegions {
    /// Returns the number of half spaces.
    fn count(&self) -> usize {
        self.exact.len() + self.solid.len() + self.others.len()
    }

    /// Adds a part; `None` if it is neither finite, nor a column, nor within a half space.
    fn add(
        &mut self,
        scene: SceneRef<'_>,
        boxes: &mut ShapeBounds,
        part: &EnclosedPart,
    ) -> Option<()> {
        let bounds = part.outer_box(&boxes.sublevel_bounds(scene, part.id, part.level))?;
        let hull = self.bounds.hull(&bounds);
        if bounds.is_finite() || is_column(&bounds) && is_column(&hull) {
            self.bounds = hull;
        } else if !bounds.is_empty() {
            let (half_space, value_slope) = half_space(scene, boxes, part, &bounds)?;
            match solid_depth(scene, boxes, part, (&half_space, value_slope)) {
                Some(depth) => {
                    self.solid_depth = self.solid_depth.max(depth);
                    match part.blend_level == 0.0 && is_half_space(scene, part.id) {
                        true => self.exact.push(half_space),
                        false => self.solid.push(half_space),
                    }
                }
                None => self.others.push(half_space),
            }
        }
        Some(())
    }
}

/// Reports whether a box ends on both sides along two axes.
fn is_column(bounds: &Bounds) -> bool {
    let ends = |&axis: &usize| bounds.min[axis].is_finite() && bounds.max[axis].is_finite();
    (0..3).filter(ends).count() == 2
}

/// Returns levels for the operands of a union: for finite ones, and for endless ones. Where each operand is above its
/// level, the union is above zero.
///
/// A single endless operand keeps its own surface where all others are farther away than a blend reaches.
fn union_levels(
    scene: SceneRef<'_>,
    boxes: &mut ShapeBounds,
    op: Op,
    parameters: &[ExprId],
    children: &[ShapeId],
) -> Option<[f64; 2]> {
    let numbers: Vec<f64> = parameters
        .iter()
        .map(|&id| boxes.number(scene, id))
        .collect();
    let facts = &op.row().facts;
    let growth = facts.hull_growth(&numbers, children.len())?;
    let mut is_endless = |id: ShapeId| {
        let bounds = boxes.get(scene, id);
        !bounds.is_finite() && !bounds.is_empty()
    };
    let endless = children.iter().filter(|&&id| is_endless(id)).count();
    let width = numbers.first().copied().unwrap_or(0.0);
    let reach = facts.blend.map(|blend| blend.kernel.support(width));
    match reach {
        Some(reach) if endless == 1 && reach.is_finite() => Some([growth + reach, 0.0]),
        _ => Some([growth, growth]),
    }
}

/// Returns a half space outside of which a part's value exceeds its level: below a plane of the shape, or beside its box.
/// Returns the slope of the value towards the plane, too.
fn half_space(
    scene: SceneRef<'_>,
    boxes: &mut ShapeBounds,
    part: &EnclosedPart,
    bounds: &Bounds,
) -> Option<([f64; 4], f64)> {
    let (normal, offset) = match lower_plane(scene, boxes, part.id) {
        Some([x, y, z, offset]) => {
            let plane = [x, y, z, offset - part.level];
            let map = part.to_inner.as_ref();
            let [x, y, z, offset] = map.map_or(plane, |rows| before_map(plane, rows));
            (DVec3::new(x, y, z), offset)
        }
        None => {
            let axes = [DVec3::X, DVec3::Y, DVec3::Z];
            let upper = (0..3).map(|axis| (axes[axis], -bounds.max[axis]));
            let lower = (0..3).map(|axis| (-axes[axis], bounds.min[axis]));
            upper.chain(lower).find(|(_, offset)| offset.is_finite())?
        }
    };
    let length = normal.length();
    let offset = offset / length;
    let [x, y, z] = (normal / length).to_array();
    let plane = [x, y, z, offset - offset.abs() * MARGIN_FRACTION];
    let is_finite = plane.iter().all(|v| v.is_finite());
    is_finite.then_some((plane, length))
}

/// Returns the depth below the plane of a part's half space from which on it is solid, if intervals prove one.
fn solid_depth(
    scene: SceneRef<'_>,
    boxes: &mut ShapeBounds,
    part: &EnclosedPart,
    (half_space, value_slope): (&[f64; 4], f64),
) -> Option<f64> {
    let margin = half_space[3].abs() * 2.0 * MARGIN_FRACTION;
    if part.is_cut {
        return None;
    }
    if is_half_space(scene, part.id) {
        return Some(part.blend_level / value_slope + margin);
    }
    let axis = (0..3).find(|&axis| half_space[axis].abs() == 1.0)?;
    if part.to_inner.is_some() {
        return None;
    }
    let mut uniform = |id: ExprId| Interval::point(boxes.number(scene, id));
    let mut range = ShapeRange::new(scene, &mut uniform);
    let level = part.level - part.blend_level;
    let depths = (0..MAX_DOUBLINGS)
        .map(|k| (half_space[3].abs() + 1.0) * MIN_SOLID_DEPTH * f64::exp2(f64::from(k)));
    depths.map(|depth| depth + margin).find(|depth| {
        let mut region = Bounds::ALL_SPACE;
        match half_space[axis] > 0.0 {
            true => region.max[axis] = -half_space[3] - depth,
            false => region.min[axis] = half_space[3] + depth,
        }
        range.range_in_box(part.id, &region).hi < level
    })
}

/// Reports whether a shape is a half space in frames.
fn is_half_space(scene: SceneRef<'_>, id: ShapeId) -> bool {
    match &scene.shapes[id.0 as usize].kind {
        ShapeKind::Primitive { op: Op::Plane, .. } => true,
        ShapeKind::Painted { child, .. } | ShapeKind::Frame { child, .. } => {
            is_half_space(scene, *child)
        }
        _ => false,
    }
}

/// Returns a linear function that a shape's value is at least: of a half space, in frames and cut by others. Recursion
/// over nested shapes, whose depth the elaborator bounds.
fn lower_plane(scene: SceneRef<'_>, boxes: &mut ShapeBounds, id: ShapeId) -> Option<[f64; 4]> {
    match &scene.shapes[id.0 as usize].kind {
        ShapeKind::Primitive {
            op: Op::Plane,
            parameters,
        } => {
            let [x, y, z, at] = *parameters.as_slice() else {
                return None;
            };
            let [x, y, z, at] = [x, y, z, at].map(|n| boxes.number(scene, n));
            Some([x, y, z, -at])
        }
        ShapeKind::Painted { child, .. } => lower_plane(scene, boxes, *child),
        ShapeKind::Frame {
            child,
            matrix,
            scale,
        } => {
            let plane = lower_plane(scene, boxes, *child)?;
            let scale = boxes.number(scene, *scale);
            let plane = before_map(plane, &rows(scene, boxes, matrix));
            Some(plane.map(|v| v * scale))
        }
        ShapeKind::Combine { op, children, .. } => match op.row().facts.bounds {
            BoundsRule::Intersection => children
                .iter()
                .find_map(|&child| lower_plane(scene, boxes, child)),
            BoundsRule::FirstOperand => lower_plane(scene, boxes, *children.first()?),
            _ => None,
        },
        _ => None,
    }
}
