//! Extends cutters where that leaves the solid unchanged.
//!
//! `a - b` is the maximum of a's value and the negative of b's. Where a flat face of `b` ends in a face of
//! `a`, or slightly beyond it, both values are small although no surface is near. Then offsets and shells
//! close the hole, light shows an edge that does not exist, and rays take short steps. So a flat face of a
//! cutter is moved outwards by up to the size of the body. The extension must be proved to remove nothing.
//! Bounding boxes prove that nothing of the body lies in it, or intervals that other cutters remove it
//! anyway. The solid stays the same set of points; its field is closer to the distance.
//!
//! Walls that are straight at the face keep their profile (`straight`), also within rounded shapes (`rounded`).
//! Sloping walls are prolonged (`sloping` for solids, `polygon` for polygons, `regular` for those with equal
//! sides). A face that depends on live parameters is moved if the body's outermost face depends on them in the
//! same way (`live`). Sides that enclose the body are removed (`covered_sides`).
//!
//! Parts of the body that no cutter touches leave the subtraction first (`separate_parts`).
//!
//! A shape that was tried in vain stays in the scene, unused: caches hold facts by the places of shapes.

mod convex;
mod copies;
mod cover;
mod covered_sides;
mod exclusive;
mod free_space;
mod half_spaces;
mod linear;
mod live;
mod live_polygon;
mod mapped;
mod polygon;
mod regions;
mod regular;
mod rounded;
mod section;
mod separate_parts;
mod sloping;
mod straight;
mod union_operands;

use crate::analysis::bounds::{ShapeBounds, inverse};
use crate::analysis::param_ranges::ParamRanges;
use crate::expression::{ExprId, Expression};
use crate::field_factors::uses_below;
use crate::scene::{Scene, SceneRef, ShapeId, ShapeKind, children_mut};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::real::Vector3;
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::{HashMap, HashSet};
use union_operands::has_one_material;

/// Extensions of a face as fractions of the body's size, tried from the largest.
const EXTENSION_FRACTIONS: [f64; 4] = [1.0, 0.25, 0.0625, 0.015625];
/// Overlap of two boxes that counts as none, relative to their coordinates: rounding error of sums in `f64`.
const TOUCH_TOLERANCE: f64 = 1e-9;
/// Value that counts as zero, relative to the coordinates: operations round their parameters to `f32`.
const F32_TOLERANCE: f64 = 4.0 * f32::EPSILON as f64;
/// Maximum number of bounding boxes that are tested per scene.
const MAX_BOX_TESTS: usize = 2_000_000;
/// Maximum number of interval operations per scene.
const MAX_INTERVAL_OPERATIONS: usize = 6_000_000;

/// Rows of an affine map of points: three factors and a shift.
type AffineRows = [[f64; 4]; 3];

const IDENTITY: AffineRows = [
    [1.0, 0.0, 0.0, 0.0],
    [0.0, 1.0, 0.0, 0.0],
    [0.0, 0.0, 1.0, 0.0],
];

/// Extends the cutters of a shape. Returns the same shape if nothing changes, else a new one after all
/// others.
pub fn extend_cutters(scene: &mut Scene, root: ShapeId) -> ShapeId {
    extend_cutters_with_bounds(scene, &mut ShapeBounds::for_all_params(), root)
}

/// Extends the cutters of a shape, with a cache of bounds.
pub(crate) fn extend_cutters_with_bounds(
    scene: &mut Scene,
    bounds_cache: &mut ShapeBounds,
    root: ShapeId,
) -> ShapeId {
    let is_live_node = |node: &Expression| matches!(node, Expression::Param(..) | Expression::Time);
    let is_live = scene
        .expressions
        .since(0)
        .any(|(_, node, _)| is_live_node(node));
    let mut extension = CutterExtension {
        bounds_cache,
        extended: HashMap::new(),
        remaining_box_tests: MAX_BOX_TESTS,
        value_units: HashMap::new(),
        remaining_interval_operations: MAX_INTERVAL_OPERATIONS,
        current_bounds: ShapeBounds::at_time_and_values(0.0, HashMap::new()),
        ranges: ParamRanges::for_scene(SceneRef::from(&*scene)),
        is_live,
        uses: uses_below(scene, root),
        scene,
    };
    extension.extend_in(root)
}

struct CutterExtension<'s> {
    scene: &'s mut Scene,
    bounds_cache: &'s mut ShapeBounds,
    /// Results of `extend_in`.
    extended: HashMap<ShapeId, ShapeId>,
    /// Number of bounding boxes that may still be tested.
    remaining_box_tests: usize,
    /// Number of interval operations that may still be run.
    remaining_interval_operations: usize,
    /// Bounds at the current values of the parameters.
    current_bounds: ShapeBounds,
    /// Ranges of the parameters.
    ranges: ParamRanges,
    /// All shapes, each with whether its sign alone counts.
    uses: HashSet<(ShapeId, bool)>,
    /// True if a number of the scene depends on a live parameter or the time.
    is_live: bool,
    /// Results of `value_unit`.
    value_units: HashMap<ShapeId, f64>,
}

/// A step from a part of a cutter outwards.
#[derive(Clone)]
enum PathStep {
    /// An affine map of points.
    Map(AffineRows),
    /// Copies by an operation, or a map that varies with the point.
    Copies { op: Op, numbers: Vec<f64> },
    /// Revolution of the plane about the y axis, after a shift along x.
    Revolve(f64),
    /// Intersection with a box.
    Clip(Bounds),
}

impl PathStep {
    /// Returns the intersection with a slab along z.
    fn along_z(low: f64, high: f64) -> Self {
        let mut clip = Bounds::ALL_SPACE;
        (clip.min[2], clip.max[2]) = (low, high);
        Self::Clip(clip)
    }
}

/// The body that is cut, its size, and its other cutters.
struct CutContext {
    /// `None` where the solid must stay the same everywhere.
    body: Option<ShapeId>,
    size: f64,
    /// The size at the current values of the parameters.
    current_size: f64,
    /// Width of the blend between the cutters and the body; infinite if it is not constant.
    blend_radius: f64,
    other_cutters: Vec<OtherCutter>,
    /// Set if all cutters have one material. Otherwise a cutter that is extended into another would show its own there.
    has_one_material: bool,
    /// The other operands of the intersections that the extended part belongs to, with the number of steps from the body to
    /// their frame. Outside of one, an extension removes nothing.
    clips: Vec<(ShapeId, usize)>,
}

/// A cutter other than the one that is extended.
#[derive(Clone, Copy)]
struct OtherCutter {
    id: ShapeId,
    /// Number of steps from the body to its frame.
    depth: usize,
    /// Its box in the body's frame; all of space if the path there is not purely affine.
    bounds: Bounds,
    /// True if the part that is extended belongs to it.
    is_extended: bool,
}

impl CutterExtension<'_> {
    /// Extends all cutters in a shape. Recursion over nested shapes, whose depth the elaborator bounds; the
    /// same holds for the functions below.
    fn extend_in(&mut self, id: ShapeId) -> ShapeId {
        if let Some(&extended) = self.extended.get(&id) {
            return extended;
        }
        let mut kind = self.kind(id).clone();
        for child in children_mut(&mut kind) {
            *child = self.extend_in(*child);
        }
        let rewritten = match &kind {
            ShapeKind::Combine {
                op: Op::Subtraction,
                children,
                ..
            } => self.separated(id, children),
            ShapeKind::Combine {
                op: Op::Xor,
                children,
                ..
            } => self.as_subtraction(id, children),
            _ => None,
        };
        if let Some(rewritten) = rewritten {
            let result = self.scene.derived(id, rewritten);
            self.extended.insert(id, result);
            return result;
        }
        match &mut kind {
            ShapeKind::Combine {
                op,
                children,
                parameters,
            } if op.row().facts.set == Some(SetOperation::Subtraction) => {
                let blend_radius = match (*op, parameters.first()) {
                    (Op::Subtraction, _) => Some(0.0),
                    // The exponential blend has infinite support.
                    (Op::ExponentialSubtraction, _) | (_, None) => None,
                    (_, Some(&width)) => self.scene.expressions.as_constant(width),
                };
                let (body, cutters) = children.split_at_mut(1);
                self.extend_cutters_of(body[0], cutters, blend_radius.unwrap_or(f64::INFINITY));
            }
            ShapeKind::Combine {
                op: Op::Intersection,
                children,
                ..
            } => self.extend_complements(id, children),
            _ => {}
        }
        self.extend_inner_operands(&mut kind);
        let result = self.with_kind(id, kind);
        self.extended.insert(id, result);
        result
    }

    /// Extends the cutters of a body. `blend_radius` is the width of the blend, infinite if it is not constant.
    fn extend_cutters_of(&mut self, body: ShapeId, cutters: &mut [ShapeId], blend_radius: f64) {
        let previous = self.previous_cutters(body);
        let shapes: Vec<ShapeId> = [body].into_iter().chain(cutters.iter().copied()).collect();
        let all_cutters = [&shapes[1..], &previous].concat();
        let mut cut = CutContext {
            body: Some(body),
            size: size_of(&shapes, |id| self.bounds(id)),
            current_size: size_of(&shapes, |id| {
                self.current_bounds.get(SceneRef::from(&*self.scene), id)
            }),
            blend_radius,
            other_cutters: Vec::new(),
            has_one_material: has_one_material(self.scene, all_cutters),
            clips: Vec::new(),
        };
        if blend_radius.is_finite() {
            self.extend_each(cutters, &mut Vec::new(), &mut cut, &previous);
        }
        if self.is_live || blend_radius == f64::INFINITY {
            for cutter in cutters {
                *cutter = self.extend_live_cutter(*cutter, &mut Vec::new(), &cut);
            }
        }
    }

    /// Extends complements in an intersection: each cuts the intersection of the other operands.
    fn extend_complements(&mut self, id: ShapeId, children: &mut [ShapeId]) {
        let complement_operand = |this: &Self, child: ShapeId| match this.kind(child) {
            ShapeKind::Distance {
                op: Op::Complement,
                child,
                ..
            } => Some(*child),
            _ => None,
        };
        let (cutters, bodies): (Vec<usize>, Vec<usize>) = (0..children.len())
            .partition(|&index| complement_operand(self, children[index]).is_some());
        let mut inner_cutters: Vec<ShapeId> = cutters
            .iter()
            .filter_map(|&index| complement_operand(self, children[index]))
            .collect();
        let bodies: Vec<ShapeId> = bodies.into_iter().map(|index| children[index]).collect();
        let body = match (bodies.as_slice(), inner_cutters.is_empty()) {
            (_, true) | ([], _) => return,
            ([body], _) => *body,
            _ => {
                let mut kind = self.kind(id).clone();
                if let ShapeKind::Combine { children, .. } = &mut kind {
                    *children = bodies;
                }
                self.scene.derived(id, kind)
            }
        };
        self.extend_cutters_of(body, &mut inner_cutters, 0.0);
        for (index, cutter) in cutters.into_iter().zip(inner_cutters) {
            let mut kind = self.kind(children[index]).clone();
            for child in children_mut(&mut kind) {
                *child = cutter;
            }
            children[index] = self.with_kind(children[index], kind);
        }
    }

    fn kind(&self, id: ShapeId) -> &ShapeKind {
        &self.scene.shapes[id.0 as usize].kind
    }

    /// Replaces the kind of a shape. Returns the same shape if its operands are unchanged.
    fn with_kind(&mut self, id: ShapeId, mut kind: ShapeKind) -> ShapeId {
        let mut original = self.kind(id).clone();
        if children_mut(&mut original) == children_mut(&mut kind) {
            return id;
        }
        self.scene.derived(id, kind)
    }

    /// Returns the cutters of earlier subtractions from the same body, the outermost subtraction first.
    fn previous_cutters(&self, mut body: ShapeId) -> Vec<ShapeId> {
        let mut cutters = Vec::new();
        loop {
            match self.kind(body) {
                ShapeKind::Painted { child, .. } => body = *child,
                ShapeKind::Combine {
                    op: Op::Subtraction,
                    children,
                    ..
                } => {
                    cutters.extend(&children[1..]);
                    body = children[0];
                }
                _ => return cutters,
            }
        }
    }

    /// Extends each of several cutters, given the others and those in `additional`.
    fn extend_each(
        &mut self,
        cutters: &mut [ShapeId],
        path: &mut Vec<PathStep>,
        cut: &mut CutContext,
        additional: &[ShapeId],
    ) {
        let rows = path_rows(path);
        let first = cut.other_cutters.len();
        for &id in cutters.iter().chain(additional) {
            let bounds = match &rows {
                Some(rows) => self.bounds(id).mapped(rows),
                None => Bounds::ALL_SPACE,
            };
            cut.other_cutters.push(OtherCutter {
                id,
                depth: path.len(),
                bounds,
                is_extended: false,
            });
        }
        for (index, cutter) in cutters.iter_mut().enumerate() {
            cut.other_cutters[first + index].is_extended = true;
            *cutter = self.extend_cutter(*cutter, path, cut);
            cut.other_cutters[first + index].is_extended = false;
        }
        cut.other_cutters.truncate(first);
    }

    /// Extends the parts of a cutter; `path` leads from it to the body, the last step first.
    fn extend_cutter(
        &mut self,
        id: ShapeId,
        path: &mut Vec<PathStep>,
        cut: &mut CutContext,
    ) -> ShapeId {
        let mut kind = self.kind(id).clone();
        let step = match &mut kind {
            // A blend extends beyond what bounds a part of such cutters.
            ShapeKind::Combine {
                op: Op::Intersection | Op::Subtraction,
                ..
            }
            | ShapeKind::Domain { .. }
                if cut.blend_radius > 0.0 =>
            {
                return id;
            }
            ShapeKind::Distance { .. } if cut.blend_radius > 0.0 => {
                return self.extend_flat_faces(id, path, cut);
            }
            ShapeKind::Combine {
                op: Op::Union,
                children,
                ..
            } => {
                self.extend_each(children, path, cut, &[]);
                return self.with_kind(id, kind);
            }
            ShapeKind::Combine {
                op: Op::Intersection,
                children,
                ..
            } => {
                return self.extend_intersection(id, children.clone(), path, cut);
            }
            ShapeKind::Combine {
                op: Op::Subtraction,
                children,
                ..
            } => {
                if self.covers_body(children[0], path, cut) {
                    return self.complement_of(id, children[1..].to_vec());
                }
                children[0] = self.extend_cutter(children[0], path, cut);
                return self.with_kind(id, kind);
            }
            ShapeKind::Primitive { .. } if cut.blend_radius > 0.0 => {
                return self.extend_flat_faces(id, path, cut);
            }
            ShapeKind::Primitive { .. } => return self.extend_primitive(id, path, cut),
            ShapeKind::Polygon { .. } if cut.blend_radius > 0.0 => return id,
            ShapeKind::Polygon { .. } => return self.extend_polygon_edges(id, path, cut),
            ShapeKind::Painted { .. } => None,
            ShapeKind::Frame { matrix, .. } => match self.constants(matrix) {
                Some(matrix) => match inverse(&matrix) {
                    Some(rows) => Some(PathStep::Map(rows)),
                    None => return id,
                },
                None => return id,
            },
            ShapeKind::Repeat { op, parameters, .. }
            | ShapeKind::Polar { op, parameters, .. }
            | ShapeKind::Domain {
                op: op @ (Op::Mirror | Op::Twist | Op::Elongate),
                parameters,
                ..
            } => {
                let Some(numbers) = self.constants(parameters) else {
                    return id;
                };
                Some(PathStep::Copies { op: *op, numbers })
            }
            ShapeKind::Domain {
                op: Op::Revolve | Op::RevolvePart,
                parameters,
                ..
            } => match self.scene.expressions.as_constant(parameters[0]) {
                Some(offset) => Some(PathStep::Revolve(offset)),
                None => return id,
            },
            // The part that the ends of a revolution cut off is not excluded. The correction of an elongated shape follows the
            // point alone.
            ShapeKind::Distance {
                op: Op::RevolveClose | Op::ElongateCorrect,
                ..
            } => None,
            ShapeKind::Distance {
                op: Op::Extrude | Op::RoundedExtrude,
                ..
            } => {
                if let Some(slab) = self.as_slab(id, path, cut) {
                    return slab;
                }
                let bounds = self.bounds(id);
                Some(PathStep::along_z(bounds.min[2], bounds.max[2]))
            }
            _ => return id,
        };
        let steps = path.len();
        path.extend(step);
        for child in children_mut(&mut kind) {
            *child = self.extend_cutter(*child, path, cut);
        }
        path.truncate(steps);
        let id = self.with_kind(id, kind);
        match self.kind(id) {
            ShapeKind::Distance { .. } => self.extend_flat_faces(id, path, cut),
            ShapeKind::Repeat { .. } | ShapeKind::Polar { .. } => self.extend_copies(id, path, cut),
            _ => id,
        }
    }

    /// Extends the operands of an intersection, and removes those that enclose the body.
    fn extend_intersection(
        &mut self,
        id: ShapeId,
        children: Vec<ShapeId>,
        path: &mut Vec<PathStep>,
        cut: &mut CutContext,
    ) -> ShapeId {
        let mut children = self.without_covering_operands(&children, path, cut);
        if let &[child] = children.as_slice() {
            return self.extend_cutter(child, path, cut);
        }
        // One after the other: an extension of one operand is clipped by the others as extended so far.
        for index in 0..children.len() {
            let others = (0..children.len()).filter(|&other| other != index);
            let others: Vec<ShapeId> = others.map(|other| children[other]).collect();
            children[index] = self.widen_half_space(children[index], &others, path, cut);
            let clip = others
                .iter()
                .map(|&other| self.bounds(other))
                .fold(Bounds::ALL_SPACE, |common, bounds| {
                    common.intersection(&bounds)
                });
            let clips = cut.clips.len();
            cut.clips
                .extend(others.iter().map(|&other| (other, path.len())));
            path.push(PathStep::Clip(clip));
            children[index] = self.extend_cutter(children[index], path, cut);
            path.pop();
            cut.clips.truncate(clips);
        }
        let kind = ShapeKind::Combine {
            op: Op::Intersection,
            children,
            parameters: Vec::new(),
        };
        self.with_kind(id, kind)
    }

    /// Extends a solid or a 2-D shape of the table.
    fn extend_primitive(&mut self, id: ShapeId, path: &[PathStep], cut: &CutContext) -> ShapeId {
        if let Some(slab) = self.as_slab(id, path, cut) {
            return slab;
        }
        if let Some(extended) = self.extend_regular_sides(id, path, cut) {
            return extended;
        }
        let id = self.extend_flat_faces(id, path, cut);
        let id = self.extend_sloped_faces(id, path, cut);
        self.extend_rounded_faces(id, path, cut)
    }

    fn constants(&self, ids: &[ExprId]) -> Option<Vec<f64>> {
        let expressions = &self.scene.expressions;
        ids.iter().map(|&id| expressions.as_constant(id)).collect()
    }

    fn bounds(&mut self, id: ShapeId) -> Bounds {
        self.bounds_cache.get(SceneRef::from(&*self.scene), id)
    }
}

/// Returns the map from the frame at the start of a path to that at its end. `None` if a step is not an affine
/// map.
fn path_rows(path: &[PathStep]) -> Option<AffineRows> {
    path.iter()
        .rev()
        .try_fold(IDENTITY, |rows, step| match step {
            PathStep::Map(map) => Some(compose(map, &rows)),
            PathStep::Copies { .. } | PathStep::Revolve(_) | PathStep::Clip(_) => None,
        })
}

/// Composes two affine maps: the result applies `inner` first.
fn compose(outer: &AffineRows, inner: &AffineRows) -> AffineRows {
    std::array::from_fn(|row| {
        std::array::from_fn(|column| {
            let shift = if column == 3 { outer[row][3] } else { 0.0 };
            let sum: f64 = (0..3).map(|i| outer[row][i] * inner[i][column]).sum();
            sum + shift
        })
    })
}

/// Returns the longest finite side of a body. If the body has none, it is that of its largest cutter. Cutters
/// follow the body in `shapes`.
fn size_of(shapes: &[ShapeId], mut bounds: impl FnMut(ShapeId) -> Bounds) -> f64 {
    let mut sizes = shapes.iter().map(|&id| size(&bounds(id)));
    match sizes.next() {
        Some(body) if body.is_finite() => body,
        _ => sizes.fold(f64::NEG_INFINITY, f64::max),
    }
}

/// Returns the longest finite side of a box; −∞ if no side is finite.
fn size(bounds: &Bounds) -> f64 {
    let sides = (0..3).map(|axis| bounds.max[axis] - bounds.min[axis]);
    let finite = sides.filter(|side| side.is_finite());
    finite.fold(f64::NEG_INFINITY, f64::max)
}

/// Returns the length in the outer frame of a unit length in the inner frame, as a cube root of the volume ratio.
fn scale(path: &[PathStep]) -> f64 {
    let volume = |step: &PathStep| match step {
        PathStep::Map(rows) => {
            let columns =
                [0, 1, 2].map(|column| V3::new(rows[0][column], rows[1][column], rows[2][column]));
            columns[0].cross(columns[1]).dot(columns[2]).abs()
        }
        PathStep::Copies { .. } | PathStep::Revolve(_) | PathStep::Clip(_) => 1.0,
    };
    path.iter().map(volume).product::<f64>().cbrt()
}
