//! Warnings of seams: gaps and walls inside solids whose parts touch.
//!
//! The minimum of the values of two touching parts is zero where they meet, deep inside the solid. An inset,
//! a shell or the fillet of a cutter takes such values for the distance to the surface, and cuts along the
//! seam. Most such parts are extended before ([`crate::cutter_extension`]). The remaining seams are searched for by
//! sampling. From a point of the solid, the gradient leads to the surface, or to a seam behind which the
//! solid continues.

use crate::analysis::bounds::ShapeBounds;
use crate::analysis::slope::ShapeSlopes;
use crate::graph::Purpose;
use crate::lower::lower;
use crate::scene::{Scene, SceneRef, ShapeId, ShapeKind, children};
use crate::schedule::schedule;
use crate::uniforms::Uniforms;
use glam::DVec3;
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::evaluate::{evaluate_f64, gradient};
use sdfc_vm::program::Program;
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::HashSet;

/// Maximum number of shapes that are searched per scene.
const MAX_SHAPES: usize = 64;
/// Maximum number of sample points per shape.
const MAX_POINTS: usize = 2048;
/// Maximum number of instructions that are run for the points of a shape.
const MAX_INSTRUCTIONS: usize = 400_000;
/// Sampled positions on the line from a point to a seam and beyond, as fractions of the distance to the seam.
const LINE_SAMPLES: [f64; 9] = [0.5, 0.8, 0.9, 0.97, 1.0, 1.03, 1.1, 1.2, 1.5];
/// Number of golden section steps towards the largest value on the line.
const GOLDEN_SECTION_STEPS: u32 = 24;
/// Golden section, (√5 − 1) / 2.
const GOLDEN_SECTION: f64 = 0.618_033_988_749_894_9;
/// Largest gap that counts as none, in half diagonals of the shape's box.
const MAX_GAP: f64 = 1e-6;
/// Minimum depth behind a seam, at the same distance as the point, as a fraction of the depth of the point.
const MIN_DEPTH_BEHIND: f64 = 0.5;
/// Maximum depth at a seam, as a fraction of the depth of the point. The depth is the negative value.
const MAX_DEPTH_AT_SEAM: f64 = 0.05;

/// Visible effect of values inside a solid.
enum InnerEffect {
    /// Values above the negative of this width have an effect.
    Band(f64),
    /// Values have an effect where the combination is empty, but its operands are solid.
    Emptied,
}

/// Search for seams in a scene.
pub(crate) struct SeamSearch<'a> {
    pub(crate) scene: &'a mut Scene,
    pub(crate) bounds_cache: &'a mut ShapeBounds,
    /// Bounds at the current values of the parameters.
    pub(crate) current_bounds: &'a mut ShapeBounds,
    pub(crate) slopes: &'a mut ShapeSlopes,
    /// Current values of the parameters, and the time.
    pub(crate) params: &'a [f64],
    pub(crate) time: f64,
}

impl SeamSearch<'_> {
    /// Returns a warning for each shape below a root that shows a seam, in the order of the text.
    pub(crate) fn warnings(&mut self, root: ShapeId) -> Vec<Diagnostic> {
        let mut seams = Vec::new();
        let mut visited = HashSet::from([root]);
        let mut pending = vec![root];
        let mut remaining = MAX_SHAPES;
        while let (Some(id), true) = (pending.pop(), remaining > 0) {
            let kind = self.scene.shapes[id.0 as usize].kind.clone();
            pending.extend(
                children(&kind)
                    .iter()
                    .filter(|&&child| visited.insert(child)),
            );
            if let Some((child, shown)) = self.inner_effect(&kind)
                && may_have_seams(self.scene, child)
            {
                remaining -= 1;
                let span = self.scene.shapes[id.0 as usize].span;
                seams.extend(self.find_seam(id, child, &shown).map(|point| (span, point)));
            }
        }
        seams.sort_by_key(|(span, _)| (span.start, span.end));
        seams.dedup_by_key(|(span, _)| *span);
        let warnings = seams.into_iter().map(|(span, [x, y, z])| {
            let round = |v: f64| (v * 1e3).round() / 1e3 + 0.0;
            let point = format!("[{}, {}, {}]", round(x), round(y), round(z));
            Diagnostic::warning(
                codes::W0405,
                span,
                "parts touch, and this cuts along their seam",
            )
            .primary(format!(
                "a seam near {point}, in coordinates of these parts"
            ))
            .help("let parts overlap by twice the width of the inset, wall or fillet, or draw them as one shape")
        });
        warnings.collect()
    }

    /// Returns the operand whose inner values have a visible effect, if there is one.
    fn inner_effect(&mut self, kind: &ShapeKind) -> Option<(ShapeId, InnerEffect)> {
        let scene = SceneRef::from(&*self.scene);
        match kind {
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => {
                let number = |index: usize| parameters.get(index).copied();
                let width = match op {
                    Op::Offset => -self.current_bounds.number(scene, number(0)?),
                    Op::Shell => self.current_bounds.number(scene, number(0)?),
                    Op::RoundedExtrude => self.current_bounds.number(scene, number(1)?),
                    _ => return None,
                };
                (width > 0.0).then_some((*child, InnerEffect::Band(width)))
            }
            ShapeKind::Combine { op, children, .. } => {
                let set = op.row().facts.set;
                let is_blend = !matches!(op, Op::Intersection | Op::Subtraction)
                    && matches!(
                        set,
                        Some(SetOperation::Intersection | SetOperation::Subtraction)
                    );
                is_blend.then_some((children[0], InnerEffect::Emptied))
            }
            _ => None,
        }
    }

    /// Returns a point near a seam of a shape, where the seam has a visible effect on the shape `combined`.
    fn find_seam(
        &mut self,
        combined: ShapeId,
        id: ShapeId,
        effect: &InnerEffect,
    ) -> Option<[f64; 3]> {
        let mut bounds = self.current_bounds.get(SceneRef::from(&*self.scene), id);
        if self.scene.shapes[id.0 as usize].is_2d {
            (bounds.min[2], bounds.max[2]) = (0.0, 0.0);
        }
        if !bounds.is_finite() || bounds.is_empty() {
            return None;
        }
        let program = self.program(id);
        let others = match effect {
            InnerEffect::Band(_) => Vec::new(),
            InnerEffect::Emptied => {
                let kind = self.scene.shapes[combined.0 as usize].kind.clone();
                let others = children(&kind)[1..].iter().map(|&id| self.program(id));
                let others: Vec<_> = others.collect();
                others.into_iter().chain([self.program(combined)]).collect()
            }
        };
        let is_subtraction = matches!(&self.scene.shapes[combined.0 as usize].kind,
            ShapeKind::Combine { op, .. } if op.row().facts.set == Some(SetOperation::Subtraction));
        let cost: usize = others.iter().map(|program| program.code.len()).sum();
        let count = (MAX_INSTRUCTIONS / (program.code.len() + cost).max(1)).min(MAX_POINTS);
        let side = if is_subtraction { -1.0 } else { 1.0 };
        let gap = bounds.half_diagonal() * MAX_GAP;
        (1..=count as u32)
            .map(|number| bounds.quasi_random_point(number))
            .find(|&point| {
                let value = evaluate_f64(&program, point);
                let is_effective = match (effect, others.split_last()) {
                    (InnerEffect::Band(width), _) => -width < value && value < 0.0,
                    (InnerEffect::Emptied, Some((combined, others))) => {
                        let is_inside = |program| evaluate_f64(program, point) * side < 0.0;
                        value < 0.0
                            && others.iter().all(is_inside)
                            && evaluate_f64(combined, point) > 0.0
                    }
                    (InnerEffect::Emptied, None) => false,
                };
                is_effective && leads_to_seam(&program, point, gap)
            })
    }

    /// Lowers a single shape to its program, at the current values of the parameters.
    fn program(&mut self, id: ShapeId) -> Program {
        let mut uniforms = Uniforms::new(self.scene.params.iter().map(|param| param.value.len()));
        let purpose = Purpose::Distance;
        let (graph, _) = lower(
            self.scene,
            id,
            purpose,
            self.slopes,
            &mut uniforms,
            self.bounds_cache,
        );
        let mut program = schedule(&graph);
        let uniform_values = uniforms.finish().run(self.params, self.time);
        let values: Vec<f32> = uniform_values.iter().map(|&v| v as f32).collect();
        program.patch(&values);
        program
    }
}

/// Reports whether parts of a shape may touch each other. Recursion over nested shapes, whose depth the
/// elaborator bounds.
fn may_have_seams(scene: &Scene, id: ShapeId) -> bool {
    let kind = &scene.shapes[id.0 as usize].kind;
    let joins_parts = match kind {
        ShapeKind::Combine { op, .. } => op.row().facts.set == Some(SetOperation::Union),
        ShapeKind::Domain { .. } | ShapeKind::Repeat { .. } | ShapeKind::Polar { .. } => true,
        _ => false,
    };
    joins_parts
        || children(kind)
            .iter()
            .any(|&child| may_have_seams(scene, child))
}

/// Reports whether the line from a point of the solid along the gradient leads to a value near zero and
/// then into the solid again. No value on the way exceeds `gap`.
fn leads_to_seam(program: &Program, point: [f64; 3], gap: f64) -> bool {
    let sample = gradient::<f64>(program, V3::new(point[0], point[1], point[2]));
    let (value, V3 { x, y, z }) = (sample.value, sample.gradient);
    let slope = DVec3::new(x, y, z);
    let square = slope.length_squared();
    // A comparison with NaN is false.
    let is_valid = square > 1e-12 && value < -8.0 * gap;
    if !is_valid {
        return false;
    }
    let step = -slope * value / square;
    let point = DVec3::from(point);
    let value_at = |fraction: f64| evaluate_f64(program, (point + step * fraction).into());
    // Values rise to a seam as to a surface, and fall at the same rate behind it.
    let values = LINE_SAMPLES.map(value_at);
    let continues = value_at(2.0) < value * MIN_DEPTH_BEHIND;
    if !continues || !values.iter().all(|&v| v <= gap) {
        return false;
    }
    let highest = (1..LINE_SAMPLES.len() - 1).max_by(|&a, &b| values[a].total_cmp(&values[b]));
    let Some(highest) = highest else { return false };
    let (mut low, mut high) = (LINE_SAMPLES[highest - 1], LINE_SAMPLES[highest + 1]);
    for _ in 0..GOLDEN_SECTION_STEPS {
        let width = (high - low) * GOLDEN_SECTION;
        let (left, right) = (value_at(high - width), value_at(low + width));
        if left.max(right) > gap {
            return false;
        }
        if left < right {
            low = high - width;
        } else {
            high = low + width;
        }
    }
    value_at((low + high) / 2.0) > value * MAX_DEPTH_AT_SEAM
}
