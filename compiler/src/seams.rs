//! A warning of seams: gaps and walls inside of solids whose parts touch.
//!
//! The smaller of the values of two parts that touch is zero where they meet, deep inside the solid. An inset, a
//! shell or the fillet of a cutter takes such values for the distance to the surface, and cuts along the seam. Most
//! such parts are made longer before ([`crate::cutters`]). What is left is found by trying points: from a point of
//! the solid the gradient leads to the surface, or to a seam, behind which the solid goes on.

use crate::bounds::{Boxes, World};
use crate::lower::{Purpose, lower};
use crate::scene::{Scene, ShapeId, ShapeKind, children};
use crate::schedule::schedule;
use crate::slope::ShapeSlopes;
use crate::uniforms::Uniforms;
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::evaluate::{evaluate_f64, gradient};
use sdfc_vm::program::Program;
use sdfc_vm::row::SetOperation;
use sdfc_vm::table::Op;
use sdfc_vm::vector::V3;
use std::collections::HashSet;

/// The largest number of shapes that are tried in a scene.
const MOST_SHAPES: usize = 64;
/// The largest number of points that are tried in a shape.
const MOST_POINTS: usize = 2048;
/// The largest number of instructions that are run for the points of a shape.
const MOST_INSTRUCTIONS: usize = 400_000;
/// The places on the way from a point to a seam and beyond that are looked at, in units of that way.
const ALONG: [f64; 9] = [0.5, 0.8, 0.9, 0.97, 1.0, 1.03, 1.1, 1.2, 1.5];
/// The number of times that the part of a line that may hold the largest value is divided.
const DIVISIONS: u32 = 24;
/// The golden section.
const SECTION: f64 = 0.618_033_988_749_894_9;
/// The largest gap that counts as none, in units of the size of the shape's box.
const GAP: f64 = 1e-6;
/// The smallest share of the point's own value that the solid has as far behind a seam.
const BEHIND: f64 = 0.5;
/// The largest share of the point's own value that is left at a seam.
const ZERO: f64 = 0.05;

/// Values inside of a shape that show, and how.
enum Shown {
    /// Those above minus a number show.
    Band(f64),
    /// They show where the shape that is made of them is empty, but its operands are solid.
    Emptied,
}

/// A search for seams in a scene.
pub(crate) struct Seams<'a> {
    pub(crate) scene: &'a mut Scene,
    pub(crate) boxes: &'a mut Boxes,
    /// Boxes at the present values of the parameters.
    pub(crate) present: &'a mut Boxes,
    pub(crate) slopes: &'a mut ShapeSlopes,
    /// The present values of the parameters, and the time.
    pub(crate) params: &'a [f64],
    pub(crate) time: f64,
}

impl Seams<'_> {
    /// Warnings of seams in all shapes that a shape is made of.
    pub(crate) fn warnings(&mut self, root: ShapeId) -> Vec<Diagnostic> {
        let mut found = Vec::new();
        let mut seen = HashSet::from([root]);
        let mut open = vec![root];
        let mut left = MOST_SHAPES;
        while let (Some(id), true) = (open.pop(), left > 0) {
            let kind = self.scene.shapes[id.0 as usize].kind.clone();
            open.extend(children(&kind).iter().filter(|&&child| seen.insert(child)));
            if let Some((child, shown)) = self.shown(&kind)
                && may_have_seams(self.scene, child)
            {
                left -= 1;
                let span = self.scene.shapes[id.0 as usize].span;
                found.extend(self.seam(id, child, &shown).map(|place| (span, place)));
            }
        }
        found.sort_by_key(|(span, _)| (span.start, span.end));
        found.dedup_by_key(|(span, _)| *span);
        let warnings = found.into_iter().map(|(span, [x, y, z])| {
            let round = |v: f64| (v * 1e3).round() / 1e3 + 0.0;
            let place = format!("[{}, {}, {}]", round(x), round(y), round(z));
            Diagnostic::warning(
                codes::W0405,
                span,
                "parts touch, and this cuts along their seam",
            )
            .primary(format!(
                "a seam near {place}, in coordinates of these parts"
            ))
            .help("let parts overlap by twice the width of the inset, wall or fillet, or draw them as one shape")
        });
        warnings.collect()
    }

    /// The operand whose values inside show, if any do.
    fn shown(&mut self, kind: &ShapeKind) -> Option<(ShapeId, Shown)> {
        let world = World::from(&*self.scene);
        match kind {
            ShapeKind::Distance {
                op,
                child,
                parameters,
            } => {
                let number = |at: usize| parameters.get(at).copied();
                let width = match op {
                    Op::Offset => -self.present.number(world, number(0)?),
                    Op::Shell => self.present.number(world, number(0)?),
                    Op::RoundedExtrude => self.present.number(world, number(1)?),
                    _ => return None,
                };
                (width > 0.0).then_some((*child, Shown::Band(width)))
            }
            ShapeKind::Combine { op, children, .. } => {
                let set = op.row().meta.set;
                let is_blend = !matches!(op, Op::Intersection | Op::Subtraction)
                    && matches!(
                        set,
                        Some(SetOperation::Intersection | SetOperation::Subtraction)
                    );
                is_blend.then_some((children[0], Shown::Emptied))
            }
            _ => None,
        }
    }

    /// A place near a seam of a shape where what is made of it shows the seam.
    fn seam(&mut self, made: ShapeId, id: ShapeId, shown: &Shown) -> Option<[f64; 3]> {
        let mut bounds = self.present.of(World::from(&*self.scene), id);
        if self.scene.shapes[id.0 as usize].plane {
            (bounds.min[2], bounds.max[2]) = (0.0, 0.0);
        }
        if !bounds.is_finite() || bounds.is_empty() {
            return None;
        }
        let shape = self.program(id);
        let others = match shown {
            Shown::Band(_) => Vec::new(),
            Shown::Emptied => {
                let kind = self.scene.shapes[made.0 as usize].kind.clone();
                let others = children(&kind)[1..].iter().map(|&id| self.program(id));
                let others: Vec<_> = others.collect();
                others.into_iter().chain([self.program(made)]).collect()
            }
        };
        let is_subtraction = matches!(&self.scene.shapes[made.0 as usize].kind,
            ShapeKind::Combine { op, .. } if op.row().meta.set == Some(SetOperation::Subtraction));
        let cost: usize = others.iter().map(|program| program.code.len()).sum();
        let count = (MOST_INSTRUCTIONS / (shape.code.len() + cost).max(1)).min(MOST_POINTS);
        let side = if is_subtraction { -1.0 } else { 1.0 };
        let gap = bounds.half_diagonal() * GAP;
        (1..=count as u32)
            .map(|number| bounds.spread(number))
            .find(|&point| {
                let value = evaluate_f64(&shape, point);
                let shows = match (shown, others.split_last()) {
                    (Shown::Band(width), _) => -width < value && value < 0.0,
                    (Shown::Emptied, Some((made, others))) => {
                        let is_in = |program| evaluate_f64(program, point) * side < 0.0;
                        value < 0.0 && others.iter().all(is_in) && evaluate_f64(made, point) > 0.0
                    }
                    (Shown::Emptied, None) => false,
                };
                shows && leads_to_seam(&shape, point, gap)
            })
    }

    /// The program of a shape alone, at the present values of the parameters.
    fn program(&mut self, id: ShapeId) -> Program {
        let mut uniforms = Uniforms::new(self.scene.params.iter().map(|param| param.value.len()));
        let purpose = Purpose::Distance;
        let (graph, _) = lower(
            self.scene,
            id,
            purpose,
            self.slopes,
            &mut uniforms,
            self.boxes,
        );
        let mut program = schedule(&graph);
        let outputs = uniforms.finish().run(self.params, self.time);
        let narrow: Vec<f32> = outputs.iter().map(|&v| v as f32).collect();
        program.patch(&narrow);
        program
    }
}

/// Reports whether parts of a shape may touch each other. Recursion over shapes within shapes, whose depth the
/// elaborator bounds.
fn may_have_seams(scene: &Scene, id: ShapeId) -> bool {
    let kind = &scene.shapes[id.0 as usize].kind;
    let joins = match kind {
        ShapeKind::Combine { op, .. } => op.row().meta.set == Some(SetOperation::Union),
        ShapeKind::Domain { .. } | ShapeKind::Repeat { .. } | ShapeKind::Polar { .. } => true,
        _ => false,
    };
    joins
        || children(kind)
            .iter()
            .any(|&child| may_have_seams(scene, child))
}

/// Reports whether the way from a point of the solid along the gradient leads to where the value is zero, or less
/// by no more than a gap, and on into the solid.
fn leads_to_seam(program: &Program, point: [f64; 3], gap: f64) -> bool {
    let here = gradient::<f64>(program, V3::of(point[0], point[1], point[2]));
    let (value, slope) = (here.value, here.gradient);
    let square = slope.x * slope.x + slope.y * slope.y + slope.z * slope.z;
    // What is no number leads nowhere.
    let is_known = square > 1e-12 && value < -8.0 * gap;
    if !is_known {
        return false;
    }
    let step = [slope.x, slope.y, slope.z].map(|v| -v * value / square);
    let at =
        |share: f64| evaluate_f64(program, std::array::from_fn(|i| point[i] + step[i] * share));
    // Values rise to a seam as to a surface, and fall as fast behind it.
    let values = ALONG.map(at);
    let goes_on = at(2.0) < value * BEHIND;
    if !goes_on || !values.iter().all(|&v| v <= gap) {
        return false;
    }
    let highest = (1..ALONG.len() - 1).max_by(|&a, &b| values[a].total_cmp(&values[b]));
    let Some(highest) = highest else { return false };
    let (mut low, mut high) = (ALONG[highest - 1], ALONG[highest + 1]);
    for _ in 0..DIVISIONS {
        let width = (high - low) * SECTION;
        let (left, right) = (at(high - width), at(low + width));
        if left.max(right) > gap {
            return false;
        }
        if left < right {
            low = high - width;
        } else {
            high = low + width;
        }
    }
    at((low + high) / 2.0) > value * ZERO
}
