//! The finite part of a solid: its shapes without the operands that have no end.
//!
//! Finite operands are found below transforms as at the root. A complement is first moved below the operation that
//! it stands before, and a field that is written as a minimum or a maximum is taken for that set operation.

use super::extremes::Extremes;
use crate::bounds::{Boxes, World};
use crate::extent::extent;
use crate::scene::{Scene, Shape, ShapeId, ShapeKind, children, children_mut};
use crate::seen::found;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Finds the finite part of shapes; new shapes are added to the scene.
pub(super) struct Finder<'a> {
    scene: &'a mut Scene,
    boxes: &'a mut Boxes,
    known: HashMap<ShapeId, Option<ShapeId>>,
}

impl<'a> Finder<'a> {
    pub(super) fn new(scene: &'a mut Scene, boxes: &'a mut Boxes) -> Self {
        Self {
            scene,
            boxes,
            known: HashMap::new(),
        }
    }

    /// The shape without its endless operands; none where nothing is left.
    ///
    /// Recursion over shapes within shapes, whose depth the elaborator bounds.
    pub(super) fn find(&mut self, id: ShapeId) -> Option<ShapeId> {
        if let Some(&known) = self.known.get(&id) {
            return known;
        }
        let part = self.search(id);
        self.known.insert(id, part);
        part
    }

    fn search(&mut self, id: ShapeId) -> Option<ShapeId> {
        if self.bounds(id).is_empty() {
            return None;
        }
        if self.has_end(id) {
            return Some(id);
        }
        match self.shape(id).kind.clone() {
            ShapeKind::Combine { op, children, .. } => self.combination(id, op, &children),
            ShapeKind::Field { value, region, .. } => {
                match Extremes::of(&mut self.scene.expressions, value) {
                    Some(extremes) => {
                        let id = self.combined_fields(id, &extremes, &region);
                        self.find(id)
                    }
                    None => self.ended(id),
                }
            }
            ShapeKind::Distance {
                op: Op::Complement,
                child,
                ..
            } => {
                let id = self.complement(id, child)?;
                self.find(id)
            }
            // Points that a map moves may end where the shape has no end.
            ShapeKind::Warp { child, .. } => {
                let child = self.find(child).unwrap_or(child);
                let id = self.with(id, vec![child]);
                self.ended(id)
            }
            ShapeKind::Frame { child, .. }
            | ShapeKind::Repeat { child, .. }
            | ShapeKind::Polar { child, .. }
            | ShapeKind::Domain { child, .. }
            | ShapeKind::Distance { child, .. }
            | ShapeKind::Displace { child, .. }
            | ShapeKind::Painted { child, .. } => {
                let child = self.find(child)?;
                let id = self.with(id, vec![child]);
                self.ended(id)
            }
            ShapeKind::Primitive { .. } | ShapeKind::Polygon { .. } | ShapeKind::Nothing => None,
        }
    }

    fn combination(&mut self, id: ShapeId, op: Op, children: &[ShapeId]) -> Option<ShapeId> {
        let set = match op {
            // Endless operands change what they cross, but leave an end.
            Op::Xor => Some(SetOperation::Union),
            _ => op.row().meta.set,
        };
        match set {
            Some(SetOperation::Union) => {
                let floors = children.iter().filter_map(|&child| self.floor(child));
                let floors: Vec<_> = floors.collect();
                let find = |&child: &ShapeId| {
                    let seen = self.seen(child, &floors);
                    let is_buried = seen.is_empty() && self.floor(child).is_none();
                    let part = self.outside(child, &seen);
                    part.or_else(|| self.find(child).filter(|_| !is_buried))
                };
                let parts: Vec<_> = children.iter().filter_map(find).collect();
                self.joined(id, parts)
            }
            // A cutter has no end of its own.
            Some(SetOperation::Subtraction) => {
                let body = self.find(children[0])?;
                let id = self.with_one(id, 0, body);
                let within = self.bounds(body);
                self.ended(id).or_else(|| Some(self.within(id, &within)))
            }
            // What is finite of an operand ends within the others.
            Some(SetOperation::Intersection) => {
                let mut parts = Vec::new();
                for (place, &child) in children.iter().enumerate() {
                    if let Some(part) = self.find(child) {
                        let both = self.with_one(id, place, part);
                        let within = self.bounds(part);
                        let ended = self.ended(both);
                        parts.push(ended.unwrap_or_else(|| self.within(both, &within)));
                    }
                }
                if parts.is_empty() {
                    return self.ended(id);
                }
                let union = ShapeKind::Combine {
                    op: Op::Union,
                    children: Vec::new(),
                    parameters: Vec::new(),
                };
                let union = self.made(id, union);
                self.joined(union, parts)
            }
            None => {
                let parts = children.iter().map(|&child| self.find(child));
                let parts: Option<Vec<_>> = parts.collect();
                let id = self.with(id, parts?);
                self.ended(id)
            }
        }
    }

    /// The space that a half-space across an axis leaves open; none of another shape.
    fn floor(&mut self, id: ShapeId) -> Option<Bounds> {
        let mut inner = id;
        loop {
            match self.shape(inner).kind {
                ShapeKind::Painted { child, .. } | ShapeKind::Frame { child, .. } => inner = child,
                ShapeKind::Primitive { op: Op::Plane, .. } => break,
                _ => return None,
            }
        }
        let solid = self.bounds(id);
        let mut open = Bounds::EVERYTHING;
        for axis in 0..3 {
            if solid.max[axis].is_finite() {
                open.min[axis] = solid.max[axis];
            }
            if solid.min[axis].is_finite() {
                open.max[axis] = solid.min[axis];
            }
        }
        Some(open)
    }

    /// The box of what floors leave of a shape.
    fn seen(&mut self, id: ShapeId, floors: &[Bounds]) -> Bounds {
        let bounds = self.bounds(id);
        floors.iter().fold(bounds, |seen, floor| seen.common(floor))
    }

    /// The shape within the box of what is `seen` of it, where that has an end and is not all of it.
    fn outside(&mut self, id: ShapeId, seen: &Bounds) -> Option<ShapeId> {
        let is_part = *seen != self.bounds(id) && seen.is_finite() && !seen.is_empty();
        let is_part = is_part && self.floor(id).is_none();
        is_part.then(|| self.within(id, seen))
    }

    /// A combination with other operands, or its only one.
    fn joined(&mut self, id: ShapeId, parts: Vec<ShapeId>) -> Option<ShapeId> {
        match *parts {
            [] => None,
            [only] => Some(only),
            _ => {
                let boxes = parts.iter().map(|&part| self.bounds(part));
                let boxes: Vec<_> = boxes.collect();
                let hull = boxes.iter().fold(Bounds::EMPTY, |hull, b| hull.hull(b));
                let id = self.with(id, parts);
                self.ended(id).or_else(|| Some(self.within(id, &hull)))
            }
        }
    }

    /// A shape with a finite box: its own, or the one in which points of it are found.
    fn ended(&mut self, id: ShapeId) -> Option<ShapeId> {
        if self.has_end(id) {
            return Some(id);
        }
        let bounds = self.bounds(id);
        let bounds = found(self.scene, id, &bounds)?;
        Some(self.within(id, &bounds))
    }

    /// The same shape, taken to lie within a box.
    fn within(&mut self, id: ShapeId, bounds: &Bounds) -> ShapeId {
        let kind = self.shape(id).kind.clone();
        let copy = self.made(id, kind);
        let bounds = self.bounds(copy).common(bounds);
        self.boxes.set(World::from(&*self.scene), copy, bounds);
        copy
    }

    /// The set operation of fields that a field is written as.
    fn combined_fields(&mut self, id: ShapeId, extremes: &Extremes, region: &Bounds) -> ShapeId {
        let values = extremes.values.iter().map(|&value| {
            let world = World::from(&*self.scene);
            let mut uniform = |id| Interval::point(self.boxes.number(world, id));
            let end = extent(world.expressions, value, &mut uniform);
            let kind = ShapeKind::Field {
                value,
                slope: None,
                region: region.common(&end),
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
        self.made(id, kind)
    }

    /// The complement of a shape, written with complements of its operands; none where there is no such form.
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
                let set = op.row().meta.set?;
                let turned = |(place, &operand): (usize, &ShapeId)| match (set, place) {
                    (Subtraction, 1..) => operand,
                    _ => self.with(id, vec![operand]),
                };
                let operands = children.iter().enumerate().map(turned).collect();
                let kind = ShapeKind::Combine {
                    op: match set {
                        Union => Op::Intersection,
                        Intersection | Subtraction => Op::Union,
                    },
                    children: operands,
                    parameters: Vec::new(),
                };
                Some(self.made(child, kind))
            }
            ShapeKind::Field { value, .. } => {
                let value = self.scene.expressions.call(Op::Neg, &[*value]);
                let kind = ShapeKind::Field {
                    value,
                    slope: None,
                    region: Bounds::EVERYTHING,
                };
                Some(self.made(child, kind))
            }
            ShapeKind::Frame { .. } | ShapeKind::Painted { .. } | ShapeKind::Domain { .. } => {
                let inner = self.with(id, vec![children(&kind)[0]]);
                Some(self.with(child, vec![inner]))
            }
            _ => None,
        }
    }

    fn shape(&self, id: ShapeId) -> &Shape {
        &self.scene.shapes[id.0 as usize]
    }

    pub(super) fn bounds(&mut self, id: ShapeId) -> Bounds {
        self.boxes.of(World::from(&*self.scene), id)
    }

    /// Tells if a shape's box is finite; of a plane figure in its plane.
    fn has_end(&mut self, id: ShapeId) -> bool {
        let mut bounds = self.bounds(id);
        if self.shape(id).plane && !bounds.is_empty() {
            (bounds.min[2], bounds.max[2]) = (0.0, 0.0);
        }
        bounds.is_finite()
    }

    /// The shape with one operand replaced.
    fn with_one(&mut self, id: ShapeId, place: usize, operand: ShapeId) -> ShapeId {
        let mut operands = children(&self.shape(id).kind).to_vec();
        operands[place] = operand;
        self.with(id, operands)
    }

    /// The shape with other operands; itself where they are its own.
    fn with(&mut self, id: ShapeId, operands: Vec<ShapeId>) -> ShapeId {
        let mut kind = self.shape(id).kind.clone();
        if children(&kind) == operands {
            return id;
        }
        match &mut kind {
            ShapeKind::Combine { children, .. } => *children = operands,
            kind => children_mut(kind).copy_from_slice(&operands),
        }
        self.made(id, kind)
    }

    /// A new shape of a kind.
    fn made(&mut self, like: ShapeId, kind: ShapeKind) -> ShapeId {
        let like = self.shape(like).clone();
        self.scene.shapes.push(Shape { kind, ..like });
        ShapeId(self.scene.shapes.len() as u32 - 1)
    }
}
