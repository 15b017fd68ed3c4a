//! Assembly of the scene from the state of an evaluation: unused shapes are removed, and missing
//! blocks get their defaults.

use super::Elaborator;
use crate::scene::children;
use crate::scene::{Material, MaterialId, Scene, ShapeId, ShapeKind};
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::table::Op;

/// Maximum nesting depth of shapes.
const MAX_SHAPE_DEPTH: u32 = 500;

impl<'a> Elaborator<'a> {
    /// Returns the scene with its diagnostics; no scene if there are errors.
    pub(crate) fn finish(mut self, is_done: bool) -> (Option<Scene>, Vec<Diagnostic>) {
        if !is_done || self.reports.has_errors() {
            return (None, self.reports.into_vec());
        }
        self.apply_only_and_ghosts();
        self.check_depth();
        if self.reports.has_errors() {
            return (None, self.reports.into_vec());
        }
        let sky = match self.sky.take() {
            Some(sky) => sky,
            None => self.default_sky(),
        };
        let render = match self.render.take() {
            Some(render) => render,
            None => self.default_render(),
        };
        if self.lights.is_empty() {
            self.lights = self.default_lights();
        }
        if self.cameras.is_empty() {
            let camera = self.automatic_camera();
            self.cameras.push(camera);
        }
        self.remove_unreachable();
        let is_2d = self.root.is_some_and(|id| self.shapes[id.0 as usize].is_2d);
        if is_2d {
            for &index in &self.plane_cameras {
                self.cameras[index].auto_framed = false;
            }
        }
        let scene = Scene {
            expressions: self.expressions,
            params: self.params,
            shapes: self.shapes,
            root: self.root,
            parts: self.parts,
            materials: self.materials,
            cameras: self.cameras,
            lights: self.lights,
            sky,
            render,
            animation: self.animation,
            checks: self.checks,
            is_2d,
            z_up: self.z_up,
            unit_mm: self.unit_mm,
            printed: self.printed,
        };
        (Some(scene), self.reports.into_vec())
    }

    /// Replaces the root by the shapes marked `only`, if there are any, and adds ghosts in a pale
    /// material.
    fn apply_only_and_ghosts(&mut self) {
        let Some(mut root) = self.root else { return };
        let span = self.shapes[root.0 as usize].span;
        let is_2d = self.shapes[root.0 as usize].is_2d;
        let fits = |e: &Self, id: &ShapeId| e.shapes[id.0 as usize].is_2d == is_2d;
        let only: Vec<ShapeId> = self
            .only
            .iter()
            .copied()
            .filter(|id| fits(self, id))
            .collect();
        if !only.is_empty()
            && let Some(only_shapes) = self.combine(Op::Union, Vec::new(), only, span)
        {
            root = only_shapes;
        }
        let ghosts: Vec<ShapeId> = self
            .ghosts
            .iter()
            .copied()
            .filter(|id| fits(self, id) || self.is_nothing(root))
            .collect();
        if !ghosts.is_empty() {
            let pale = self.srgb([0xb9, 0xd3, 0xf2, 255]);
            let default = self.materials[0].clone();
            let name = "ghost".to_owned();
            let material = self.material(Material {
                name,
                albedo: pale,
                ..default
            });
            let mut shapes = vec![root];
            for child in ghosts {
                let is_2d = self.shapes[child.0 as usize].is_2d;
                shapes.push(self.add(ShapeKind::Painted { child, material }, is_2d, span));
            }
            if let Some(combined) = self.combine(Op::Union, Vec::new(), shapes, span) {
                root = combined;
            }
        }
        self.root = Some(root);
    }

    /// Limits the depth of shapes, over which later stages recurse.
    fn check_depth(&mut self) {
        let mut depths: Vec<u32> = Vec::with_capacity(self.shapes.len());
        for shape in &self.shapes {
            let child_depth = children(&shape.kind)
                .iter()
                .map(|id| depths[id.0 as usize])
                .max();
            depths.push(child_depth.map_or(1, |depth| depth + 1));
        }
        if let Some(index) = depths.iter().position(|depth| *depth > MAX_SHAPE_DEPTH) {
            let message = format!("shapes are nested more than {MAX_SHAPE_DEPTH} deep");
            let help = "join many shapes by `union(list)`, which nests them once";
            let span = self.shapes[index].span;
            self.report(Diagnostic::error(codes::E0413, span, message).help(help));
        }
    }

    /// Removes the shapes and materials that neither the root nor a part uses.
    fn remove_unreachable(&mut self) {
        let mut is_used = vec![false; self.shapes.len()];
        let roots = self.root.iter().chain(self.parts.iter().map(|(_, id)| id));
        for id in roots {
            is_used[id.0 as usize] = true;
        }
        let mut material_used = vec![false; self.materials.len()];
        material_used[0] = true;
        // Operands precede their users, so one backward pass suffices.
        for index in (0..self.shapes.len()).rev() {
            if !is_used[index] {
                continue;
            }
            for child in children(&self.shapes[index].kind) {
                is_used[child.0 as usize] = true;
            }
            if let ShapeKind::Painted { material, .. } = self.shapes[index].kind {
                material_used[material.0 as usize] = true;
            }
        }
        // Named materials are kept for the listing of the scene.
        for (used, material) in material_used.iter_mut().zip(&self.materials) {
            *used |= !material.name.is_empty();
        }
        let shape_at = positions(&is_used);
        let material_at = positions(&material_used);
        let shape = |id: &mut ShapeId| *id = ShapeId(shape_at[id.0 as usize]);
        let mut remaining = Vec::with_capacity(self.shapes.len());
        for (index, mut entry) in std::mem::take(&mut self.shapes).into_iter().enumerate() {
            if !is_used[index] {
                continue;
            }
            match &mut entry.kind {
                ShapeKind::Primitive { .. }
                | ShapeKind::Field { .. }
                | ShapeKind::Polygon { .. }
                | ShapeKind::Nothing => {}
                ShapeKind::Combine { children, .. } => children.iter_mut().for_each(shape),
                ShapeKind::Painted { child, material } => {
                    shape(child);
                    *material = MaterialId(material_at[material.0 as usize]);
                }
                ShapeKind::Frame { child, .. }
                | ShapeKind::Repeat { child, .. }
                | ShapeKind::Polar { child, .. }
                | ShapeKind::Domain { child, .. }
                | ShapeKind::Warp { child, .. }
                | ShapeKind::Distance { child, .. }
                | ShapeKind::Displace { child, .. } => shape(child),
            }
            remaining.push(entry);
        }
        self.shapes = remaining;
        let mut index = 0;
        self.materials.retain(|_| {
            index += 1;
            material_used[index - 1]
        });
        self.root.iter_mut().for_each(shape);
        self.parts.iter_mut().for_each(|(_, id)| shape(id));
    }
}

/// Returns the index of each entry after the unused entries are removed.
fn positions(used: &[bool]) -> Vec<u32> {
    let mut next = 0;
    used.iter()
        .map(|used| {
            let position = next;
            next += u32::from(*used);
            position
        })
        .collect()
}
