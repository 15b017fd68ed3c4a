//! Normalized fields: a value divided by the length of its gradient.
//!
//! The quotient is the distance to first order: it is exact at the surface, where its slope is 1,
//! whatever factor the field has. The gradient is exact: the bodies of the table run on duals of
//! [`Symbolic`] numbers ([`crate::formula`]).
//!
//! The operands of a choice are normalized one by one: those of a union, a repetition, or a `max`
//! in a field. Thus the result has no discontinuities between operands. A shape whose value is a
//! distance is unchanged.

mod quotient;

use crate::elaborate::Elaborator;
use crate::elaborate::argument_conversion::BoundArgs;
use crate::elaborate::value::{EvalResult, Value};
use crate::expression::ExprId;
use crate::formula::Formula;
use crate::scene::{MaterialId, ShapeId, ShapeKind, children};
use crate::symbolic::{Symbolic, simplified, with_expressions};
use quotient::{DistanceLimits, normalize, point_with_gradient, quotient};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::{Category, Exactness};
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Tolerance of the test for similarity maps: the entries of `M Mᵀ scale²` equal the identity up to
/// this.
const SIMILARITY_TOLERANCE: f64 = 1e-6;

/// State shared by all shapes of a call.
struct FunctionCall {
    span: Span,
    /// Maximum distance, in units of the frame around the shape.
    reach: Option<ExprId>,
    /// Results so far, for shapes that occur more than once.
    normalized: HashMap<(ShapeId, Option<ExprId>), ShapeId>,
    /// Cached results of `is_distance`.
    distances: HashMap<ShapeId, bool>,
}

impl<'a> Elaborator<'a> {
    /// Evaluates `normalized(shape, reach)` or `distance(shape, reach)`: the shape with an approximate distance as
    /// its value.
    pub(crate) fn normalized(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let reach = bound.is_given(1).then(|| bound.number(1));
        if let Some(reach) = reach
            && self
                .check_above("`reach`", reach, true, bound.span_at(1))
                .is_none()
        {
            return Ok(Value::Poison);
        }
        let mut call = FunctionCall {
            span: bound.span,
            reach,
            normalized: HashMap::new(),
            distances: HashMap::new(),
        };
        match self.normalize_shape(bound.shape(0), &mut call) {
            Ok(id) => Ok(Value::Shape(id)),
            Err(diagnostic) => {
                self.report(*diagnostic);
                Ok(Value::Poison)
            }
        }
    }

    /// Returns a shape with the same surface whose value is a distance to first order. Recursion
    /// over nested shapes, whose depth the elaborator bounds.
    fn normalize_shape(
        &mut self,
        id: ShapeId,
        call: &mut FunctionCall,
    ) -> Result<ShapeId, Box<Diagnostic>> {
        if self.is_distance(id, &mut call.distances) {
            return Ok(id);
        }
        let key = (id, call.reach);
        if let Some(&done) = call.normalized.get(&key) {
            return Ok(done);
        }
        let shape = self.shapes[id.0 as usize].clone();
        let mut kind = shape.kind;
        let result = match &kind {
            ShapeKind::Field { value, region, .. } => {
                let (value, region) = (*value, *region);
                self.normalize_field(value, region, shape.is_2d, call)?
            }
            _ if self.preserves_distance(&kind) => {
                let outer = call.reach;
                if let (ShapeKind::Frame { scale, .. }, Some(reach)) = (&kind, outer) {
                    call.reach = Some(simplified(&mut self.expressions, Op::Div, &[reach, *scale]));
                }
                let operands = children(&kind).to_vec();
                let operands: Result<Vec<ShapeId>, _> = operands
                    .into_iter()
                    .map(|child| self.normalize_shape(child, call))
                    .collect();
                call.reach = outer;
                operands.map(|operands| {
                    for (slot, child) in crate::scene::children_mut(&mut kind)
                        .iter_mut()
                        .zip(operands)
                    {
                        *slot = child;
                    }
                    self.add(kind, shape.is_2d, call.span)
                })?
            }
            _ => self.normalize_as_field(id, call)?,
        };
        self.shapes[result.0 as usize].name = shape.name;
        call.normalized.insert(key, result);
        Ok(result)
    }

    /// Reports whether the slope of a shape's value is 1 almost everywhere.
    fn is_distance(&self, id: ShapeId, cache: &mut HashMap<ShapeId, bool>) -> bool {
        if let Some(&cache) = cache.get(&id) {
            return cache;
        }
        let kind = &self.shapes[id.0 as usize].kind;
        let is_kind_distance = match kind {
            ShapeKind::Primitive { op, .. } => {
                let exactness = op.row().facts.exactness;
                matches!(exactness, Exactness::Exact | Exactness::ExactOutside)
            }
            ShapeKind::Distance { op, .. } => {
                let facts = &op.row().facts;
                let is_solid = facts.category == Category::Dimension;
                matches!(op, Op::Offset | Op::Shell)
                    || is_solid && facts.exactness == Exactness::Exact
                    || self.preserves_distance(kind)
            }
            ShapeKind::Domain { op, .. } => {
                matches!(op, Op::Revolve) || self.preserves_distance(kind)
            }
            ShapeKind::Polygon { .. } | ShapeKind::Nothing => true,
            kind => self.preserves_distance(kind),
        };
        let mut operand_is_distance = |&child: &ShapeId| self.is_distance(child, cache);
        let is_distance = is_kind_distance && children(kind).iter().all(&mut operand_is_distance);
        cache.insert(id, is_distance);
        is_distance
    }

    /// Reports whether a shape's value is a distance if the values of its operands are.
    fn preserves_distance(&self, kind: &ShapeKind) -> bool {
        match kind {
            ShapeKind::Combine { op, .. } => {
                matches!(op, Op::Union | Op::Intersection | Op::Subtraction)
            }
            ShapeKind::Frame { matrix, scale, .. } => self.is_similarity(matrix, *scale),
            ShapeKind::Domain { op, .. } => matches!(op, Op::Mirror),
            ShapeKind::Distance { op, .. } => *op == Op::Complement,
            ShapeKind::Repeat { .. } | ShapeKind::Polar { .. } | ShapeKind::Painted { .. } => true,
            ShapeKind::Primitive { .. }
            | ShapeKind::Field { .. }
            | ShapeKind::Polygon { .. }
            | ShapeKind::Warp { .. }
            | ShapeKind::Displace { .. }
            | ShapeKind::Nothing => false,
        }
    }

    /// Reports whether a frame is a similarity with factor 1 / `scale`, as far as constants prove
    /// it.
    fn is_similarity(&self, matrix: &[ExprId; 12], scale: ExprId) -> bool {
        let number = |id: ExprId| self.expressions.as_constant(id);
        let Some(scale) = number(scale) else {
            return false;
        };
        let rows: Option<Vec<[f64; 3]>> = (0..3)
            .map(|row| {
                let entry = |column: usize| number(matrix[4 * row + column]).map(|v| v * scale);
                Some([entry(0)?, entry(1)?, entry(2)?])
            })
            .collect();
        let Some(rows) = rows else { return false };
        (0..3).all(|a| {
            (0..3).all(|b| {
                let product: f64 = (0..3).map(|i| rows[a][i] * rows[b][i]).sum();
                let expected = if a == b { 1.0 } else { 0.0 };
                (product - expected).abs() < SIMILARITY_TOLERANCE
            })
        })
    }

    /// Divides a written field by its slope.
    fn normalize_field(
        &mut self,
        value: ExprId,
        region: Bounds,
        is_2d: bool,
        call: &FunctionCall,
    ) -> Result<ShapeId, Box<Diagnostic>> {
        let mut formula = Formula::default();
        formula.read(&self.expressions, value);
        let limits = self.distance_limits(&region, call);
        let result = with_expressions(&mut self.expressions, || normalize(&formula, value, limits));
        let value = result
            .map_err(|message| unsupported_diagnostic(message, call.span))?
            .0;
        let kind = ShapeKind::Field {
            value,
            slope: None,
            region,
        };
        Ok(self.add(kind, is_2d, call.span))
    }

    /// Returns the distance limits of a field that is solid within a box: inside, at most half of the diagonal.
    fn distance_limits(&mut self, solid: &Bounds, call: &FunctionCall) -> DistanceLimits {
        let reach = call.reach.map(Symbolic);
        let max_depth = solid.half_diagonal();
        let inside = (max_depth.is_finite() && max_depth > 0.0)
            .then(|| Symbolic(self.expressions.constant(max_depth)));
        DistanceLimits {
            outside: reach,
            inside: reach.or(inside),
        }
    }

    /// Normalizes a shape whose operands act on values, such as a blend or a warp, as one field.
    fn normalize_as_field(
        &mut self,
        id: ShapeId,
        call: &FunctionCall,
    ) -> Result<ShapeId, Box<Diagnostic>> {
        let material = self.single_material(id, call.span)?;
        let is_2d = self.shapes[id.0 as usize].is_2d;
        let region = self.bounds_of(id);
        let mut formula = Formula::default();
        formula.read_shape(&self.expressions, &self.shapes, id);
        let limits = self.distance_limits(&region, call);
        let shapes = &self.shapes;
        let result = with_expressions(&mut self.expressions, || {
            let value = formula.shape(shapes, id, point_with_gradient())?;
            Ok(quotient(value, limits))
        });
        let value = result
            .map_err(|message| unsupported_diagnostic(message, call.span))?
            .0;
        let kind = ShapeKind::Field {
            value,
            slope: None,
            region,
        };
        let field = self.add(kind, is_2d, call.span);
        Ok(match material {
            Some(material) => {
                let child = field;
                self.add(ShapeKind::Painted { child, material }, is_2d, call.span)
            }
            None => field,
        })
    }

    /// Returns the common material of a shape and its children, if there is one; several are an error.
    fn single_material(
        &self,
        id: ShapeId,
        span: Span,
    ) -> Result<Option<MaterialId>, Box<Diagnostic>> {
        let shape = &self.shapes[id.0 as usize];
        if let ShapeKind::Painted { material, .. } = shape.kind {
            return Ok(Some(material));
        }
        let mut materials = Vec::new();
        for &child in children(&shape.kind) {
            let material = self.single_material(child, span)?;
            if !materials.contains(&material) {
                materials.push(material);
            }
        }
        match materials[..] {
            [] => Ok(None),
            [material] => Ok(material),
            _ => {
                let message = "a shape with several materials cannot be normalized";
                let help =
                    "normalize the shapes before they are blended: `a.normalized() |[0.2] b`";
                let diagnostic = Diagnostic::error(codes::E0405, span, message)
                    .label(shape.span, "materials blend here")
                    .help(help);
                Err(Box::new(diagnostic))
            }
        }
    }
}

/// Describes a field that cannot be differentiated.
fn unsupported_diagnostic(message: &'static str, span: Span) -> Box<Diagnostic> {
    Box::new(Diagnostic::error(codes::E0405, span, message))
}
