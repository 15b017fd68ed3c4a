//! Construction of shapes, combinations and materials, with limits.

use super::Elaborator;
use super::value::{EvalResult, Value};
use crate::expression::ExprId;
use crate::scene::children;
use crate::scene::{Material, MaterialId, Shape, ShapeId, ShapeKind};
use crate::symbolic::{Symbolic, with_expressions};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::{Op, prepare};

/// Maximum number of shapes of a scene.
pub(crate) const MAX_SHAPES: usize = 400_000;
/// Maximum number of shapes that one shape represents, counted with multiplicity: the union of a
/// shape with a copy of itself doubles the count.
const MAX_OCCURRENCES: u32 = 1_000_000;

impl<'a> Elaborator<'a> {
    /// Adds a shape.
    pub(crate) fn add(&mut self, kind: ShapeKind, is_2d: bool, span: Span) -> ShapeId {
        if self.point_function_depth > 0 {
            let message = "a shape cannot be made inside a function of the point";
            let help = "make it outside; `displace` and `warp` change a shape's field";
            self.report(Diagnostic::error(codes::E0309, span, message).help(help));
        }
        if self.shapes.len() == MAX_SHAPES {
            self.report_too_many(span);
        }
        let occurrences = children(&kind)
            .iter()
            .map(|child| self.occurrences[child.0 as usize])
            .fold(1, u32::saturating_add);
        if occurrences > MAX_OCCURRENCES && !self.reports.is_full() {
            let message = format!(
                "this stands for more than {MAX_OCCURRENCES} shapes, each counted as often as it occurs"
            );
            let help = "`repeat`, `polar` and `mirror` make copies that cost nothing";
            self.report(Diagnostic::error(codes::E0414, span, message).help(help));
            self.reports.mark_full();
        }
        self.occurrences.push(occurrences);
        let id = ShapeId(self.shapes.len() as u32);
        self.shapes.push(Shape {
            kind,
            is_2d,
            name: String::new(),
            span,
        });
        id
    }

    fn report_too_many(&mut self, span: Span) {
        let message = format!("the scene has more than {MAX_SHAPES} shapes");
        let help = "`repeat`, `polar` and `mirror` make copies that cost nothing";
        self.report(Diagnostic::error(codes::E0414, span, message).help(help));
        self.reports.mark_full();
    }

    /// Converts the arguments of an operation to its parameters.
    pub(crate) fn prepare_parameters(&mut self, op: Op, arguments: &[ExprId]) -> Vec<ExprId> {
        with_expressions(&mut self.expressions, || {
            let arguments: Vec<Symbolic> = arguments.iter().map(|&id| Symbolic(id)).collect();
            prepare::<Symbolic>(op, &arguments)
                .into_iter()
                .map(|number| number.0)
                .collect()
        })
    }

    /// Reports whether a shape is empty.
    pub(crate) fn is_nothing(&self, id: ShapeId) -> bool {
        matches!(self.shapes[id.0 as usize].kind, ShapeKind::Nothing)
    }

    /// Converts a value to a shape; a list of shapes becomes their union. Reports anything else.
    pub(crate) fn shape(&mut self, value: &Value<'a>, span: Span) -> Option<ShapeId> {
        match value {
            Value::Shape(id) => Some(*id),
            Value::List(_) => {
                let mut shapes = Vec::new();
                self.collect_shapes(value, span, &mut shapes)?;
                self.combine(Op::Union, Vec::new(), shapes, span)
            }
            Value::Poison => None,
            other => {
                let message = format!("a shape is required, and this is {}", self.describe(other));
                let mut diagnostic = Diagnostic::error(codes::E0301, span, message);
                diagnostic = help_with_function(diagnostic, other);
                self.report(diagnostic);
                None
            }
        }
    }

    /// Collects all shapes of a list and of nested lists.
    pub(crate) fn collect_shapes(
        &mut self,
        value: &Value<'a>,
        span: Span,
        shapes: &mut Vec<ShapeId>,
    ) -> Option<()> {
        match value {
            Value::List(list) => {
                for element in list.iter() {
                    self.collect_shapes(element, span, shapes)?;
                }
            }
            Value::Vector(_) | Value::Number(_) => {
                let what = self.describe(value);
                let message = format!("a list of shapes is required, and this is {what}");
                self.report(Diagnostic::error(codes::E0301, span, message));
                return None;
            }
            other => shapes.push(self.shape(other, span)?),
        }
        // A list may contain the same list many times.
        if shapes.len() > MAX_SHAPES {
            self.report_too_many(span);
            return None;
        }
        Some(())
    }

    /// Adds a material of one colour, with all other fields of the default material.
    pub(crate) fn plain_material(&mut self, albedo: [ExprId; 3]) -> MaterialId {
        let default = self.materials[0].clone();
        self.material(Material {
            name: String::new(),
            albedo,
            ..default
        })
    }

    /// Adds a material; one that is equal in all fields is shared.
    pub(crate) fn material(&mut self, material: Material) -> MaterialId {
        let key = (
            material.albedo,
            material.emission,
            [
                Some(material.roughness),
                Some(material.metallic),
                material.bump,
            ],
            material.name.clone(),
        );
        if let Some(&id) = self.material_ids.get(&key) {
            return id;
        }
        let id = MaterialId(self.materials.len() as u32);
        self.materials.push(material);
        self.material_ids.insert(key, id);
        id
    }

    /// Combines shapes from left to right by an operation. Empty shapes drop out, unless they make
    /// the result empty.
    pub(crate) fn combine(
        &mut self,
        op: Op,
        parameters: Vec<ExprId>,
        shapes: Vec<ShapeId>,
        span: Span,
    ) -> Option<ShapeId> {
        let is_intersection = matches!(
            op,
            Op::Intersection
                | Op::SmoothIntersection
                | Op::CubicIntersection
                | Op::CircularIntersection
                | Op::ExponentialIntersection
                | Op::ChamferIntersection
                | Op::RoundIntersection
                | Op::StairsIntersection
        );
        let is_union = matches!(
            op,
            Op::Union
                | Op::SmoothUnion
                | Op::CubicUnion
                | Op::CircularUnion
                | Op::ExponentialUnion
                | Op::ChamferUnion
                | Op::RoundUnion
                | Op::StairsUnion
                | Op::DistanceUnion
                | Op::Xor
        );
        let first_is_empty = shapes.first().is_none_or(|&id| self.is_nothing(id));
        let any_is_empty = shapes.iter().any(|&id| self.is_nothing(id));
        let mut children = shapes;
        if is_intersection && any_is_empty || !is_union && first_is_empty {
            children.clear();
        }
        children.retain(|&id| !self.is_nothing(id));
        match children.as_slice() {
            [] => return Some(self.add(ShapeKind::Nothing, false, span)),
            [only] => return Some(*only),
            _ => {}
        }
        let is_2d = self.shapes[children[0].0 as usize].is_2d;
        let other = children
            .iter()
            .find(|id| self.shapes[id.0 as usize].is_2d != is_2d);
        if let Some(&other) = other {
            let dimension = |is_2d: bool| if is_2d { "2D" } else { "3D" };
            let (a, b) = (
                &self.shapes[children[0].0 as usize],
                &self.shapes[other.0 as usize],
            );
            let message = format!(
                "a {} and a {} shape cannot be combined",
                dimension(a.is_2d),
                dimension(b.is_2d)
            );
            let mut diagnostic = Diagnostic::error(codes::E0304, span, message)
                .help("`extrude` and `revolve` make a 3D shape of a 2D one");
            for shape in [a, b] {
                if shape.span.file == span.file {
                    let text = format!("this is {}", dimension(shape.is_2d));
                    diagnostic = diagnostic.label(shape.span, text);
                }
            }
            self.report(diagnostic);
            return None;
        }
        self.warn_ineffective_operand(op, &children, span);
        Some(self.add(
            ShapeKind::Combine {
                op,
                children,
                parameters,
            },
            is_2d,
            span,
        ))
    }

    /// Warns of subtractions without effect and of empty intersections, as far as the bounding
    /// boxes of constant shapes prove it.
    fn warn_ineffective_operand(&mut self, op: Op, children: &[ShapeId], span: Span) {
        if !matches!(op, Op::Subtraction | Op::Intersection) {
            return;
        }
        if !children.iter().all(|&id| self.is_constant_shape(id)) {
            return;
        }
        let boxes: Vec<Bounds> = children.iter().map(|&id| self.bounds_of(id)).collect();
        let mut operands = children.iter().zip(&boxes);
        let is_empty_field = |(id, bounds): (&ShapeId, &Bounds)| {
            let kind = &self.shapes[id.0 as usize].kind;
            matches!(kind, ShapeKind::Field { .. }) && bounds.is_empty()
        };
        if operands.any(is_empty_field) {
            self.report(field_without_inside(span));
            return;
        }
        let (message, label) = match op {
            Op::Subtraction => {
                let misses = |other: &Bounds| boxes[0].intersection(other).is_empty();
                if !boxes[1..].iter().all(misses) {
                    return;
                }
                ("this cuts nothing away", "the shapes do not touch")
            }
            _ => {
                let common = boxes
                    .iter()
                    .fold(Bounds::ALL_SPACE, |c, b| c.intersection(b));
                if !common.is_empty() {
                    return;
                }
                ("this intersection is empty", "the shapes do not touch")
            }
        };
        self.report(Diagnostic::warning(codes::W0402, span, message).primary(label));
    }
}

/// Returns the warning of a field that has no inside: its zeros are no surface.
pub(crate) fn field_without_inside(span: Span) -> Diagnostic {
    Diagnostic::warning(codes::W0402, span, "this field is below zero nowhere")
        .primary("so it has no inside, and is not visible")
        .help("give a sheet a thickness: subtract it, `abs(d) - 0.01`, or use `.shell(0.01)`")
}

/// Adds advice for a function in place of a shape.
pub(crate) fn help_with_function(diagnostic: Diagnostic, value: &Value<'_>) -> Diagnostic {
    match value {
        Value::Function(closure) if closure.name.is_empty() => {
            diagnostic.help("call it, or make a shape of it by `field(fn(p) => ..)`")
        }
        Value::Function(closure) => diagnostic.help(format!("call it: `{}(..)`", closure.name)),
        Value::Builtin(name) => diagnostic.help(format!("call it: `{name}(..)`")),
        _ => diagnostic,
    }
}

/// Returns the value of a shape, or poison if there is none.
pub(crate) fn shape_value<'a>(shape: Option<ShapeId>) -> EvalResult<'a> {
    Ok(shape.map_or(Value::Poison, Value::Shape))
}
