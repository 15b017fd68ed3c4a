//! Construction of shapes: from operations of the table and from lists, with names, materials and
//! limits.

use super::Elaborator;
use super::bound_args::BoundArgs;
use super::evaluate::EvalResult;
use super::value::Value;
use crate::expression::ExprId;
use crate::scene::children;
use crate::scene::{Material, MaterialId, Shape, ShapeId, ShapeKind};
use crate::symbolic::{Symbolic, with_graph};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::row::{ArgumentKind, Category};
use sdfc_vm::table::{Op, prepare};

/// Maximum number of shapes of a scene.
pub(crate) const MAX_SHAPES: usize = 400_000;
/// Maximum number of shapes that one shape represents, counted with multiplicity: the union of a
/// shape with a copy of itself doubles the count.
const MAX_OCCURRENCES: u32 = 1_000_000;

impl<'a> Elaborator<'a> {
    /// Adds a shape.
    pub(crate) fn add(&mut self, kind: ShapeKind, plane: bool, span: Span) -> ShapeId {
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
            plane,
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
        with_graph(&mut self.graph, || {
            let arguments: Vec<Symbolic> = arguments.iter().map(|&id| Symbolic(id)).collect();
            prepare::<Symbolic>(op, &arguments)
                .into_iter()
                .map(|number| number.0)
                .collect()
        })
    }

    /// Evaluates a call of an operation of the table: a shape, or a modification of one.
    pub(crate) fn row(&mut self, op: Op, bound: &BoundArgs<'a>) -> Value<'a> {
        let row = op.row();
        let is_shape = matches!(row.meta.category, Category::Shape3 | Category::Shape2);
        let first = usize::from(!is_shape);
        let arguments = &bound.arguments[first..];
        if self.has_equal_ends(op, arguments.iter().map(|a| a.numbers.as_slice())) {
            let message = format!("`from` and `to` of `{}` are the same point", bound.name);
            let help = "a line from a point to itself has no direction; use `sphere`";
            self.report(Diagnostic::error(codes::E0405, bound.span, message).help(help));
            return Value::Poison;
        }
        let numbers: Vec<ExprId> = arguments
            .iter()
            .flat_map(|a| a.numbers.iter().copied())
            .collect();
        let parameters = self.prepare_parameters(op, &numbers);
        let id = match row.meta.category {
            Category::Shape3 => {
                let id = self.add(ShapeKind::Primitive { op, parameters }, false, bound.span);
                if has_axis(op) {
                    self.rotated_to_scene_up(id, bound.span)
                } else {
                    id
                }
            }
            Category::Shape2 => self.add(ShapeKind::Primitive { op, parameters }, true, bound.span),
            Category::Domain => {
                let child = bound.shape(0);
                let plane = self.shapes[child.0 as usize].plane;
                self.add(
                    ShapeKind::Domain {
                        op,
                        child,
                        parameters,
                    },
                    plane,
                    bound.span,
                )
            }
            Category::Dimension | Category::Distance => {
                let child = bound.shape(0);
                let plane =
                    self.shapes[child.0 as usize].plane && row.meta.category == Category::Distance;
                self.add(
                    ShapeKind::Distance {
                        op,
                        child,
                        parameters,
                    },
                    plane,
                    bound.span,
                )
            }
            Category::Combine | Category::Math | Category::Internal => {
                unreachable!("`{}` is no word of the language", row.name)
            }
        };
        Value::Shape(id)
    }

    /// Reports whether the end points `from` and `to` are equal.
    fn has_equal_ends<'n>(&self, op: Op, arguments: impl Iterator<Item = &'n [ExprId]>) -> bool {
        let Some(language) = &op.row().meta.language else {
            return false;
        };
        let mut ends = language
            .arguments
            .iter()
            .zip(arguments)
            .filter(|(argument, _)| matches!(argument.name, "from" | "to"))
            .map(|(_, numbers)| numbers);
        match (ends.next(), ends.next()) {
            (Some(from), Some(to)) => from == to,
            _ => false,
        }
    }

    /// Reports whether a value is a shape, or a list of shapes.
    pub(crate) fn is_shape(&self, value: &Value<'a>) -> bool {
        match value {
            Value::Shape(_) => true,
            Value::List(list) => list.first().is_none_or(|first| self.is_shape(first)),
            _ => false,
        }
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
                let message = format!("a shape is wanted, and this is {}", self.describe(other));
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
                let message = format!("a list of shapes is wanted, and this is {what}");
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

    /// A material of one colour.
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

    /// Describes a value for messages.
    pub(crate) fn describe(&self, value: &Value<'_>) -> String {
        match value {
            Value::Poison | Value::Nothing => "nothing".to_owned(),
            Value::Number(number) => number.quantity.noun().to_owned(),
            Value::Bool(_) => "a bool".to_owned(),
            Value::Text(_) => "a text".to_owned(),
            Value::Vector(vector) => format!("a vec{}", vector.len()),
            Value::Color(_) => "a color".to_owned(),
            Value::List(list) if !list.is_empty() && self.is_shape_list(list) => {
                "a list of shapes".to_owned()
            }
            Value::List(list) => format!("a list of {}", list.len()),
            Value::Range(_) => "a range".to_owned(),
            Value::Shape(id) if self.shapes[id.0 as usize].plane => "a 2D shape".to_owned(),
            Value::Shape(_) => "a 3D shape".to_owned(),
            Value::Material(_) => "a material".to_owned(),
            Value::Record(record) => format!("the record `{}`", record.name),
            Value::Function(_) | Value::Builtin(_) => "a function".to_owned(),
            Value::Word(word) => format!("the word `{word}`"),
        }
    }

    fn is_shape_list(&self, list: &[Value<'_>]) -> bool {
        match list.first() {
            Some(Value::Shape(_)) => true,
            Some(Value::List(list)) => self.is_shape_list(list),
            _ => false,
        }
    }
}

/// Reports whether a solid of the table has an axis of its own, which is aligned with the up axis.
/// Solids with vector arguments take their directions from these.
fn has_axis(op: Op) -> bool {
    let is_round = matches!(op, Op::Sphere | Op::Octahedron | Op::Gyroid);
    let is_vector = |kind: ArgumentKind| kind.width() == 3;
    let has_direction_arguments = op
        .row()
        .meta
        .language
        .is_some_and(|language| language.arguments.iter().any(|a| is_vector(a.kind)));
    !is_round && !has_direction_arguments
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

/// The value of a shape, or poison if there is none.
pub(crate) fn shape_value<'a>(shape: Option<ShapeId>) -> EvalResult<'a> {
    Ok(shape.map_or(Value::Poison, Value::Shape))
}
