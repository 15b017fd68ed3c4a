//! The finite part of a solid: its shapes without unbounded operands.
//!
//! Finite operands are found below transforms as at the root. A complement is first moved below the operation
//! in its operand. A field that is a minimum or a maximum is treated as that set operation.

use super::extremes::Extremes;
use crate::analysis::bounds::ShapeBounds;
use crate::analysis::extent::extent;
use crate::analysis::visible_bounds::sampled_bounds;
use crate::scene::{Scene, SceneRef, Shape, ShapeId, ShapeKind, children, children_mut};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Computes the finite part of shapes; new shapes are added to the scene.
pub(super) struct FiniteFinder<'a> {
    scene: &'a mut Scene,
    bounds_cache: &'a mut ShapeBounds,
    results: HashMap<ShapeId, Option<ShapeId>>,
    /// Unions that fields are equivalent to, by field.
    unions: HashMap<ShapeId, ShapeId>,
    /// Number of operands of fields whose extent may still be searched.
    remaining_operands: usize,
}

/// Maximum number of operands of minima and maxima in fields whose extent is searched.
const MAX_FIELD_OPERANDS: usize = 64;

impl<'a> FiniteFinder<'a> {
    pub(super) fn new(scene: &'a mut Scene, bounds_cache: &'a mut ShapeBounds) -> Self {
        Self {
            scene,
            bounds_cache,
            results: HashMap::new(),
            unions: HashMap::new(),
            remaining_operands: MAX_FIELD_OPERANDS,
        }
    }

    /// Returns the unions that fields are equivalent to, by field.
    pub(super) fn into_unions(self) -> HashMap<ShapeId, ShapeId> {
        self.unions
    }

    /// Returns the shape without its unbounded operands; `None` if nothing is left.
    ///
    /// Recursion over nested shapes, whose depth the elaborator bounds.
    pub(super) fn finite_part(&mut self, id: ShapeId) -> Option<ShapeId> {
        if let Some(&result) = self.results.get(&id) {
            return result;
        }
        let part = self.compute_finite_part(id);
        self.results.insert(id, part);
        part
    }

    fn compute_finite_part(&mut self, id: ShapeId) -> Option<ShapeId> {
        if self.bounds(id).is_empty() {
            return None;
        }
        if self.is_bounded(id) {
            return Some(id);
        }
        match self.shape(id).kind.clone() {
            ShapeKind::Combine { op, children, .. } => self.finite_combination(id, op, &children),
            ShapeKind::Field { value, region, .. } => {
                let extremes = Extremes::find(&mut self.scene.expressions, value);
                match extremes.filter(|found| found.values.len() <= self.remaining_operands) {
                    Some(extremes) => {
                        self.remaining_operands -= extremes.values.len();
                        let combination = self.combine_fields(id, &extremes, &region);
                        if extremes.is_minimum {
                            self.unions.insert(id, combination);
                        }
                        self.finite_part(combination)
                    }
                    None => self.bounded_shape(id),
                }
            }
            ShapeKind::Distance {
                op: Op::Complement,
                child,
                ..
            } => {
                let id = self.complement(id, child)?;
                self.finite_part(id)
            }
            // A warp of an unbounded shape may be bounded.
            ShapeKind::Warp { child, .. } => {
                let child = self.finite_part(child).unwrap_or(child);
                let id = self.with_operands(id, vec![child]);
                self.bounded_shape(id)
            }
            ShapeKind::Frame { child, .. }
            | ShapeKind::Repeat { child, .. }
            | ShapeKind::Polar { child, .. }
            | ShapeKind::Domain { child, .. }
            | ShapeKind::Distance { child, .. }
            | ShapeKind::Displace { child, .. }
            | ShapeKind::Painted { child, .. } => {
                let child = self.finite_part(child)?;
                let id = self.with_operands(id, vec![child]);
                self.bounded_shape(id)
            }
            ShapeKind::Primitive { .. } | ShapeKind::Polygon { .. } | ShapeKind::Nothing => None,
        }
    }

    fn finite_combination(&mut self, id: ShapeId, op: Op, children: &[ShapeId]) -> Option<ShapeId> {
        let set = match op {
            // Unbounded operands of `xor` are left out like those of a union.
            Op::Xor => Some(SetOperation::Union),
            _ => op.row().facts.set,
        };
        match set {
            Some(SetOperation::Union) => {
                let open_spaces = children.iter().filter_map(|&child| self.open_space(child));
                let open_spaces: Vec<_> = open_spaces.collect();
                let find = |&child: &ShapeId| {
                    let visible = self.visible_bounds(child, &open_spaces);
                    let is_buried = visible.is_empty() && self.open_space(child).is_none();
                    let part = self.clipped_to(child, &visible);
                    part.or_else(|| self.finite_part(child).filter(|_| !is_buried))
                };
                let parts: Vec<_> = children.iter().filter_map(find).collect();
                self.join_parts(id, parts)
            }
            // A cutter does not make a bounded body unbounded.
            Some(SetOperation::Subtraction) => {
                let body = self.finite_part(children[0])?;
                let id = self.with_operand(id, 0, body);
                let bounds = self.bounds(body);
                self.bounded_shape(id)
                    .or_else(|| Some(self.clipped_copy(id, &bounds)))
            }
            // The finite part of an operand, intersected with the others, is bounded.
            Some(SetOperation::Intersection) => {
                let mut parts = Vec::new();
                for (index, &child) in children.iter().enumerate() {
                    if let Some(part) = self.finite_part(child) {
                        let combined = self.with_operand(id, index, part);
                        let bounds = self.bounds(part);
                        let bounded_shape = self.bounded_shape(combined);
                        parts.push(
                            bounded_shape.unwrap_or_else(|| self.clipped_copy(combined, &bounds)),
                        );
                    }
                }
                if parts.is_empty() {
                    return self.bounded_shape(id);
                }
                let union = ShapeKind::Combine {
                    op: Op::Union,
                    children: Vec::new(),
                    parameters: Vec::new(),
                };
                let union = self.add_like(id, union);
                self.join_parts(union, parts)
            }
            None => {
                let parts = children.iter().map(|&child| self.finite_part(child));
                let parts: Option<Vec<_>> = parts.collect();
                let id = self.with_operands(id, parts?);
                self.bounded_shape(id)
            }
        }
    }

    /// Returns the space outside a half-space across an axis; `None` for other shapes.
    fn open_space(&mut self, id: ShapeId) -> Option<Bounds> {
        let mut inner = id;
        loop {
            match self.shape(inner).kind {
                ShapeKind::Painted { child, .. } | ShapeKind::Frame { child, .. } => inner = child,
                ShapeKind::Primitive { op: Op::Plane, .. } => break,
                _ => return None,
            }
        }
        let solid = self.bounds(id);
        let mut space = Bounds::ALL_SPACE;
        for axis in 0..3 {
            if solid.max[axis].is_finite() {
                space.min[axis] = solid.max[axis];
            }
            if solid.min[axis].is_finite() {
                space.max[axis] = solid.min[axis];
            }
        }
        Some(space)
    }

    /// Returns the box of a shape, clipped to the space outside of half-spaces.
    fn visible_bounds(&mut self, id: ShapeId, open_spaces: &[Bounds]) -> Bounds {
        let bounds = self.bounds(id);
        open_spaces
            .iter()
            .fold(bounds, |visible, space| visible.intersection(space))
    }

    /// Clips the shape to `visible`, if that is bounded and smaller than the shape's box.
    fn clipped_to(&mut self, id: ShapeId, visible: &Bounds) -> Option<ShapeId> {
        let is_clipped = *visible != self.bounds(id) && visible.is_finite() && !visible.is_empty();
        let is_clipped = is_clipped && self.open_space(id).is_none();
        is_clipped.then(|| self.clipped_copy(id, visible))
    }

    /// Returns the combination with other operands, or its only operand; `None` without operands.
    fn join_parts(&mut self, id: ShapeId, parts: Vec<ShapeId>) -> Option<ShapeId> {
        match *parts {
            [] => None,
            [only] => Some(only),
            _ => {
                let boxes = parts.iter().map(|&part| self.bounds(part));
                let boxes: Vec<_> = boxes.collect();
                let hull = boxes.iter().fold(Bounds::EMPTY, |hull, b| hull.hull(b));
                let id = self.with_operands(id, parts);
                self.bounded_shape(id)
                    .or_else(|| Some(self.clipped_copy(id, &hull)))
            }
        }
    }

    /// Returns the shape with a bounded box: its own, or one around points that sampling finds.
    fn bounded_shape(&mut self, id: ShapeId) -> Option<ShapeId> {
        if self.is_bounded(id) {
            return Some(id);
        }
        let bounds = self.bounds(id);
        let bounds = sampled_bounds(self.scene, id, &bounds)?;
        Some(self.clipped_copy(id, &bounds))
    }

    /// Returns a copy of a shape with its box clipped.
    fn clipped_copy(&mut self, id: ShapeId, bounds: &Bounds) -> ShapeId {
        let kind = self.shape(id).kind.clone();
        let copy = self.add_like(id, kind);
        let bounds = self.bounds(copy).intersection(bounds);
        self.bounds_cache
            .set(SceneRef::from(&*self.scene), copy, bounds);
        copy
    }

    /// Returns the set operation that is equivalent to a field.
    fn combine_fields(&mut self, id: ShapeId, extremes: &Extremes, region: &Bounds) -> ShapeId {
        let values = extremes.values.iter().map(|&value| {
            let scene = SceneRef::from(&*self.scene);
            let mut uniform = |id| Interval::point(self.bounds_cache.number(scene, id));
            let extent = extent(scene.expressions, value, &mut uniform);
            let kind = ShapeKind::Field {
                value,
                slope: None,
                region: region.intersection(&extent),
            };
            let like = self.shape(id).clone();
            self.scene.shapes.push(Shape { kind, ..like });
            ShapeId(self.scene.shapes.len() as u32 - 1)
        });
        let children = values.collect();
        let kind = ShapeKind::Combine {
            op: match extremes.is_minimum {
                true => Op::Union,
                false => Op::Intersection,
            },
            children,
            parameters: Vec::new(),
        };
        self.add_like(id, kind)
    }

    /// Returns the complement of a shape, expressed by complements of its operands; `None` if there is no such
    /// form.
    fn complement(&mut self, id: ShapeId, child: ShapeId) -> Option<ShapeId> {
        use SetOperation::{Intersection, Subtraction, Union};
        let kind = self.shape(child).kind.clone();
        match &kind {
            ShapeKind::Distance {
                op: Op::Complement,
                child,
                ..
            } => Some(*child),
            ShapeKind::Combine { op, children, .. } => {
                let set = op.row().facts.set?;
                let complemented = |(index, &operand): (usize, &ShapeId)| match (set, index) {
                    (Subtraction, 1..) => operand,
                    _ => self.with_operands(id, vec![operand]),
                };
                let operands = children.iter().enumerate().map(complemented).collect();
                let kind = ShapeKind::Combine {
                    op: match set {
                        Union => Op::Intersection,
                        Intersection | Subtraction => Op::Union,
                    },
                    children: operands,
                    parameters: Vec::new(),
                };
                Some(self.add_like(child, kind))
            }
            ShapeKind::Field { value, .. } => {
                let value = self.scene.expressions.call(Op::Neg, &[*value]);
                let kind = ShapeKind::Field {
                    value,
                    slope: None,
                    region: Bounds::ALL_SPACE,
                };
                Some(self.add_like(child, kind))
            }
            ShapeKind::Frame { .. } | ShapeKind::Painted { .. } | ShapeKind::Domain { .. } => {
                let inner = self.with_operands(id, vec![children(&kind)[0]]);
                Some(self.with_operands(child, vec![inner]))
            }
            _ => None,
        }
    }

    fn shape(&self, id: ShapeId) -> &Shape {
        &self.scene.shapes[id.0 as usize]
    }

    pub(super) fn bounds(&mut self, id: ShapeId) -> Bounds {
        self.bounds_cache.get(SceneRef::from(&*self.scene), id)
    }

    /// Reports whether a shape's box is bounded, for a 2-D shape in its plane.
    fn is_bounded(&mut self, id: ShapeId) -> bool {
        let mut bounds = self.bounds(id);
        if self.shape(id).is_2d && !bounds.is_empty() {
            (bounds.min[2], bounds.max[2]) = (0.0, 0.0);
        }
        bounds.is_finite()
    }

    /// Replaces one operand of a shape.
    fn with_operand(&mut self, id: ShapeId, index: usize, operand: ShapeId) -> ShapeId {
        let mut operands = children(&self.shape(id).kind).to_vec();
        operands[index] = operand;
        self.with_operands(id, operands)
    }

    /// Replaces the operands of a shape; returns the shape itself if they are unchanged.
    fn with_operands(&mut self, id: ShapeId, operands: Vec<ShapeId>) -> ShapeId {
        let mut kind = self.shape(id).kind.clone();
        if children(&kind) == operands {
            return id;
        }
        match &mut kind {
            ShapeKind::Combine { children, .. } => *children = operands,
            kind => children_mut(kind).copy_from_slice(&operands),
        }
        self.add_like(id, kind)
    }

    /// Adds a shape of a kind, with the properties of another one.
    fn add_like(&mut self, like: ShapeId, kind: ShapeKind) -> ShapeId {
        let like = self.shape(like).clone();
        self.scene.shapes.push(Shape { kind, ..like });
        ShapeId(self.scene.shapes.len() as u32 - 1)
    }
}
