//! Splits subtractions whose body has parts that some cutters do not touch.
//!
//! `(plate | tower) - hole` is `(plate - hole) | tower` if the hole does not touch the tower. Then a flush end of the hole
//! is extended through the space of the tower. Of distances, the field stays a distance. Values of raw fields would change,
//! so such a subtraction stays as written where more than their signs counts.

use super::free_space::GrowingPart;
use super::union_operands::has_one_material;
use super::{CutContext, CutterExtension, IDENTITY};
use crate::distribute::is_space_map;
use crate::scene::{Scene, ShapeId, ShapeKind, children, children_mut};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::Op;

/// Maximum number of pairs of a part and a cutter that are tried for one subtraction.
const MAX_PAIRS: usize = 10_000;

/// Parts of a body, and the cutters that may touch one of them.
#[derive(Clone)]
struct Group {
    /// Indices in the union.
    parts: Vec<usize>,
    /// Indices in the subtraction.
    cutters: Vec<usize>,
}

impl Group {
    fn absorb(&mut self, other: Self) {
        self.parts.extend(other.parts);
        self.cutters.extend(other.cutters);
        for indices in [&mut self.parts, &mut self.cutters] {
            indices.sort_unstable();
            indices.dedup();
        }
    }
}

impl CutterExtension<'_> {
    /// Returns the union of subtractions that is the same solid, with their cutters extended. `None` if all parts of the
    /// body stay together.
    pub(super) fn separated(&mut self, id: ShapeId, operands: &[ShapeId]) -> Option<ShapeKind> {
        let has_values = self.uses.contains(&(id, false));
        if has_values
            && operands
                .iter()
                .any(|&id| has_written_values(self.scene, id))
        {
            return None;
        }
        let (&body, cutters) = operands.split_first()?;
        let parts = self.union_parts(body)?;
        if parts.len() * cutters.len() > MAX_PAIRS {
            return None;
        }
        let mut groups = Vec::new();
        for (index, &part) in parts.iter().enumerate() {
            let touching = (0..cutters.len()).filter(|&cutter| self.touches(part, cutters[cutter]));
            let cutters = touching.collect();
            add(
                &mut groups,
                Group {
                    parts: vec![index],
                    cutters,
                },
                |a, b| a.cutters.iter().any(|cutter| b.cutters.contains(cutter)),
            );
        }
        if !has_one_material(self.scene, vec![body]) {
            self.keep_order(&mut groups, &parts);
        }
        if groups.len() < 2 {
            return None;
        }
        let children = groups
            .into_iter()
            .map(|group| self.cut_group(id, body, &group, &parts, cutters))
            .collect();
        Some(ShapeKind::Combine {
            op: Op::Union,
            children,
            parameters: Vec::new(),
        })
    }

    /// Returns the parts of a union, also below materials and frames.
    fn union_parts(&mut self, id: ShapeId) -> Option<Vec<ShapeId>> {
        match self.kind(id).clone() {
            ShapeKind::Combine {
                op: Op::Union,
                children,
                ..
            } => {
                let parts = children
                    .into_iter()
                    .map(|child| self.union_parts(child).unwrap_or_else(|| vec![child]));
                Some(parts.collect::<Vec<_>>().concat())
            }
            kind @ (ShapeKind::Painted { child, .. } | ShapeKind::Frame { child, .. }) => {
                let parts = self.union_parts(child)?;
                let wrapped = parts.into_iter().map(|part| {
                    let mut kind = kind.clone();
                    for child in children_mut(&mut kind) {
                        *child = part;
                    }
                    self.scene.derived(id, kind)
                });
                Some(wrapped.collect())
            }
            _ => None,
        }
    }

    /// Reports whether a cutter may remove something of a part of the body.
    fn touches(&mut self, part: ShapeId, cutter: ShapeId) -> bool {
        let common = self.bounds(part).intersection(&self.bounds(cutter));
        let growing = GrowingPart {
            id: cutter,
            is_straight: false,
            blend_radius: 0.0,
            axis: 0,
            placement: IDENTITY,
            sections: None,
        };
        let cut = CutContext {
            body: Some(part),
            size: f64::NAN,
            current_size: f64::NAN,
            blend_radius: 0.0,
            clips: Vec::new(),
            other_cutters: Vec::new(),
            has_one_material: true,
        };
        !common.is_empty() && !self.is_free(&growing, &common, &[], &cut)
    }

    /// Joins groups where the order of parts that may touch would change: the first one shows its material.
    fn keep_order(&mut self, groups: &mut Vec<Group>, parts: &[ShapeId]) {
        let boxes: Vec<Bounds> = parts.iter().map(|&part| self.bounds(part)).collect();
        let are_apart = |&a: &usize, &b: &usize| boxes[a].intersection(&boxes[b]).is_empty();
        loop {
            let is_moved = |[first, second]: [usize; 2]| {
                let [first, second] = [&groups[first].parts, &groups[second].parts];
                let mut pairs = first
                    .iter()
                    .flat_map(|a| second.iter().map(move |b| (a, b)));
                pairs.any(|(a, b)| b < a && !are_apart(a, b))
            };
            let pairs =
                (0..groups.len()).flat_map(|second| (0..second).map(move |it| [it, second]));
            let Some([first, second]) = { pairs }.find(|&pair| is_moved(pair)) else {
                return;
            };
            let group = groups.remove(second);
            groups[first].absorb(group);
        }
    }

    /// Returns a group of parts without what its cutters remove.
    fn cut_group(
        &mut self,
        id: ShapeId,
        body: ShapeId,
        group: &Group,
        parts: &[ShapeId],
        cutters: &[ShapeId],
    ) -> ShapeId {
        let parts: Vec<ShapeId> = group.parts.iter().map(|&part| parts[part]).collect();
        let solid = match parts[..] {
            [part] => part,
            _ => {
                let kind = ShapeKind::Combine {
                    op: Op::Union,
                    children: parts,
                    parameters: Vec::new(),
                };
                self.scene.derived(body, kind)
            }
        };
        let mut cutters: Vec<ShapeId> = group.cutters.iter().map(|&it| cutters[it]).collect();
        if cutters.is_empty() {
            return solid;
        }
        self.extend_cutters_of(solid, &mut cutters, 0.0);
        let kind = ShapeKind::Combine {
            op: Op::Subtraction,
            children: [vec![solid], cutters].concat(),
            parameters: Vec::new(),
        };
        self.scene.derived(id, kind)
    }
}

/// Adds a group, joined with all others to which it belongs. Groups stay in the order of their first parts.
fn add(groups: &mut Vec<Group>, mut group: Group, belongs: impl Fn(&Group, &Group) -> bool) {
    let (joined, mut others): (Vec<Group>, Vec<Group>) =
        groups.drain(..).partition(|other| belongs(other, &group));
    for other in joined {
        group.absorb(other);
    }
    others.push(group);
    others.sort_by_key(|group| group.parts[0]);
    *groups = others;
}

/// Reports whether values of a shape may not be distances. Recursion over nested shapes, whose depth the elaborator
/// bounds.
fn has_written_values(scene: &Scene, id: ShapeId) -> bool {
    let kind = &scene.shapes[id.0 as usize].kind;
    let is_written = matches!(kind, ShapeKind::Field { .. }) || is_space_map(kind);
    let mut operands = children(kind).iter();
    is_written || operands.any(|&child| has_written_values(scene, child))
}
