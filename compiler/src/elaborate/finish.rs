//! From the state of an evaluation to a scene: what nothing uses is left out, what was not said
//! gets its default.

use super::Elaborator;
use crate::scene::children;
use crate::scene::{Material, MaterialId, Scene, ShapeId, ShapeKind};
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::table::Op;

/// The most shapes within each other.
const MAX_SHAPE_DEPTH: u32 = 500;

impl<'a> Elaborator<'a> {
    /// The scene with its diagnostics; no scene if there are errors.
    pub(crate) fn finish(mut self, is_done: bool) -> (Option<Scene>, Vec<Diagnostic>) {
        if !is_done || self.reports.has_errors() {
            return (None, self.reports.into_vec());
        }
        self.look_closer();
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
        self.keep_reachable();
        let plane = self.root.is_some_and(|id| self.shapes[id.0 as usize].plane);
        let scene = Scene {
            expressions: self.graph,
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
            plane,
            z_up: self.z_up,
            printed: self.printed,
        };
        (Some(scene), self.reports.into_vec())
    }

    /// Where shapes are marked `only`, they are the scene; ghosts stand beside it, pale.
    fn look_closer(&mut self) {
        let Some(mut root) = self.root else { return };
        let span = self.shapes[root.0 as usize].span;
        let plane = self.shapes[root.0 as usize].plane;
        let fits = |e: &Self, id: &ShapeId| e.shapes[id.0 as usize].plane == plane;
        let only: Vec<ShapeId> = self
            .only
            .iter()
            .copied()
            .filter(|id| fits(self, id))
            .collect();
        if !only.is_empty()
            && let Some(shown) = self.combined(Op::Union, Vec::new(), only, span)
        {
            root = shown;
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
                let plane = self.shapes[child.0 as usize].plane;
                shapes.push(self.add(ShapeKind::Painted { child, material }, plane, span));
            }
            if let Some(both) = self.combined(Op::Union, Vec::new(), shapes, span) {
                root = both;
            }
        }
        self.root = Some(root);
    }

    /// What comes after goes through shapes by recursion.
    fn check_depth(&mut self) {
        let mut depths: Vec<u32> = Vec::with_capacity(self.shapes.len());
        for shape in &self.shapes {
            let inner = children(&shape.kind)
                .iter()
                .map(|id| depths[id.0 as usize])
                .max();
            depths.push(inner.map_or(1, |depth| depth + 1));
        }
        if let Some(at) = depths.iter().position(|depth| *depth > MAX_SHAPE_DEPTH) {
            let message = format!("shapes are nested more than {MAX_SHAPE_DEPTH} deep");
            let help = "join many shapes by `union(list)`, which nests them once";
            let span = self.shapes[at].span;
            self.report(Diagnostic::error(codes::E0413, span, message).help(help));
        }
    }

    /// Leaves out the shapes and materials that neither the root nor a part uses.
    fn keep_reachable(&mut self) {
        let mut is_used = vec![false; self.shapes.len()];
        let ends = self.root.iter().chain(self.parts.iter().map(|(_, id)| id));
        for id in ends {
            is_used[id.0 as usize] = true;
        }
        let mut material_used = vec![false; self.materials.len()];
        material_used[0] = true;
        // Operands stand before what uses them: one pass from the end is enough.
        for at in (0..self.shapes.len()).rev() {
            if !is_used[at] {
                continue;
            }
            for child in children(&self.shapes[at].kind) {
                is_used[child.0 as usize] = true;
            }
            if let ShapeKind::Painted { material, .. } = self.shapes[at].kind {
                material_used[material.0 as usize] = true;
            }
        }
        // A material with a name is kept: it is there to be looked at in the scene's listing.
        for (used, material) in material_used.iter_mut().zip(&self.materials) {
            *used |= !material.name.is_empty();
        }
        let shape_at = positions(&is_used);
        let material_at = positions(&material_used);
        let shape = |id: &mut ShapeId| *id = ShapeId(shape_at[id.0 as usize]);
        let mut kept = Vec::with_capacity(self.shapes.len());
        for (at, mut entry) in std::mem::take(&mut self.shapes).into_iter().enumerate() {
            if !is_used[at] {
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
            kept.push(entry);
        }
        self.shapes = kept;
        let mut at = 0;
        self.materials.retain(|_| {
            at += 1;
            material_used[at - 1]
        });
        self.root.iter_mut().for_each(shape);
        self.parts.iter_mut().for_each(|(_, id)| shape(id));
    }
}

/// Where each entry stands once the unused ones are gone.
fn positions(used: &[bool]) -> Vec<u32> {
    let mut next = 0;
    used.iter()
        .map(|used| {
            let at = next;
            next += u32::from(*used);
            at
        })
        .collect()
}
