//! Distances made of fields: a value divided by the length of its gradient.
//!
//! The quotient is the distance to first order: it is right at the surface, and its slope there is one,
//! whatever factor the field was written with. The gradient is written out by running the bodies of the
//! table on duals of [`Symbolic`] numbers ([`crate::formula`]), so it is exact.
//!
//! Choices are made among distances: of a union, a repetition or a `max` in a field each operand is
//! normalized by itself, so that the result has no jumps where they meet. A shape that is a distance stays
//! as it is.

mod quotient;

use super::Elaborator;
use super::bound::Bound;
use super::evaluate::Outcome;
use super::value::Value;
use crate::expression::ExprId;
use crate::formula::Formula;
use crate::scene::{MaterialId, ShapeId, ShapeKind, children};
use crate::symbolic::{Symbolic, simplified, with_graph};
use quotient::{Limits, here, normalized, quotient};
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::row::{Category, Exactness};
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// A map whose stretch differs by less than this between directions keeps distances.
const EVEN: f64 = 1e-6;

/// The numbers that all shapes of a call share.
struct Call {
    span: Span,
    /// The largest distance, in units of the frame around the shape.
    reach: Option<ExprId>,
    /// The results so far, for shapes that occur more than once.
    done: HashMap<(ShapeId, Option<ExprId>), ShapeId>,
    /// The shapes that were asked for, with whether they are distances.
    distances: HashMap<ShapeId, bool>,
}

impl<'a> Elaborator<'a> {
    /// `normalized(shape, reach)` and `distance(shape, reach)`
    pub(crate) fn normalized(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let reach = bound.given(1).then(|| bound.number(1));
        if let Some(reach) = reach
            && self
                .check_above("`reach`", reach, true, bound.span_of(1))
                .is_none()
        {
            return Ok(Value::Poison);
        }
        let mut call = Call {
            span: bound.span,
            reach,
            done: HashMap::new(),
            distances: HashMap::new(),
        };
        match self.distance_of(bound.shape(0), &mut call) {
            Ok(id) => Ok(Value::Shape(id)),
            Err(diagnostic) => {
                self.report(*diagnostic);
                Ok(Value::Poison)
            }
        }
    }

    /// A shape with the same surface whose value is a distance to first order. Recursion over shapes within
    /// shapes, whose depth the elaborator bounds.
    fn distance_of(&mut self, id: ShapeId, call: &mut Call) -> Result<ShapeId, Box<Diagnostic>> {
        if self.is_distance(id, &mut call.distances) {
            return Ok(id);
        }
        let key = (id, call.reach);
        if let Some(&done) = call.done.get(&key) {
            return Ok(done);
        }
        let shape = self.shapes[id.0 as usize].clone();
        let mut kind = shape.kind;
        let made = match &kind {
            ShapeKind::Field { value, region, .. } => {
                let (value, region) = (*value, *region);
                self.normalized_field(value, region, shape.plane, call)?
            }
            _ if self.hands_on(&kind) => {
                let outer = call.reach;
                if let (ShapeKind::Frame { scale, .. }, Some(reach)) = (&kind, outer) {
                    call.reach = Some(simplified(&mut self.graph, Op::Div, &[reach, *scale]));
                }
                let operands = children(&kind).to_vec();
                let operands: Result<Vec<ShapeId>, _> = operands
                    .into_iter()
                    .map(|child| self.distance_of(child, call))
                    .collect();
                call.reach = outer;
                operands.map(|operands| {
                    for (slot, child) in crate::scene::children_mut(&mut kind)
                        .iter_mut()
                        .zip(operands)
                    {
                        *slot = child;
                    }
                    self.add(kind, shape.plane, call.span)
                })?
            }
            _ => self.normalized_whole(id, call)?,
        };
        self.shapes[made.0 as usize].name = shape.name;
        call.done.insert(key, made);
        Ok(made)
    }

    /// Tells if the slope of a shape's value is one almost everywhere.
    fn is_distance(&self, id: ShapeId, known: &mut HashMap<ShapeId, bool>) -> bool {
        if let Some(&known) = known.get(&id) {
            return known;
        }
        let kind = &self.shapes[id.0 as usize].kind;
        let own = match kind {
            ShapeKind::Primitive { op, .. } => {
                let exactness = op.row().meta.exactness;
                matches!(exactness, Exactness::Exact | Exactness::ExactOutside)
            }
            ShapeKind::Distance { op, .. } => {
                let meta = &op.row().meta;
                let is_solid = meta.category == Category::Dimension;
                matches!(op, Op::Offset | Op::Shell)
                    || is_solid && meta.exactness == Exactness::Exact
                    || self.hands_on(kind)
            }
            ShapeKind::Domain { op, .. } => matches!(op, Op::Revolve) || self.hands_on(kind),
            ShapeKind::Polygon { .. } | ShapeKind::Nothing => true,
            kind => self.hands_on(kind),
        };
        let mut of_operand = |&child: &ShapeId| self.is_distance(child, known);
        let is_distance = own && children(kind).iter().all(&mut of_operand);
        known.insert(id, is_distance);
        is_distance
    }

    /// Tells if a shape is a distance once its operands are.
    fn hands_on(&self, kind: &ShapeKind) -> bool {
        match kind {
            ShapeKind::Combine { op, .. } => {
                matches!(op, Op::Union | Op::Intersection | Op::Subtraction)
            }
            ShapeKind::Frame { matrix, scale, .. } => self.is_even(matrix, *scale),
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

    /// Tells if a frame stretches all directions by one over its scale, as far as constants show.
    fn is_even(&self, matrix: &[ExprId; 12], scale: ExprId) -> bool {
        let number = |id: ExprId| self.graph.as_constant(id);
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
                let wanted = if a == b { 1.0 } else { 0.0 };
                (product - wanted).abs() < EVEN
            })
        })
    }

    /// A written field divided by its slope.
    fn normalized_field(
        &mut self,
        value: ExprId,
        region: Bounds,
        plane: bool,
        call: &Call,
    ) -> Result<ShapeId, Box<Diagnostic>> {
        let mut formula = Formula::default();
        formula.read(&self.graph, value);
        let limits = self.limits(&region, call);
        let made = with_graph(&mut self.graph, || normalized(&formula, value, limits));
        let value = made.map_err(|message| refused(message, call.span))?.0;
        let kind = ShapeKind::Field {
            value,
            slope: None,
            region,
        };
        Ok(self.add(kind, plane, call.span))
    }

    /// The largest distances of a field that is solid within a box: inside, none exceeds half of its diagonal.
    fn limits(&mut self, solid: &Bounds, call: &Call) -> Limits {
        let reach = call.reach.map(Symbolic);
        let deepest = solid.half_diagonal();
        let inside =
            (deepest.is_finite() && deepest > 0.0).then(|| Symbolic(self.graph.constant(deepest)));
        Limits {
            outside: reach,
            inside: reach.or(inside),
        }
    }

    /// A shape whose operands act on values, such as a blend or a warp, as one field.
    fn normalized_whole(&mut self, id: ShapeId, call: &Call) -> Result<ShapeId, Box<Diagnostic>> {
        let paint = self.only_paint(id, call.span)?;
        let plane = self.shapes[id.0 as usize].plane;
        let region = self.bounds_of(id);
        let mut formula = Formula::default();
        formula.read_shape(&self.graph, &self.shapes, id);
        let limits = self.limits(&region, call);
        let shapes = &self.shapes;
        let made = with_graph(&mut self.graph, || {
            let value = formula.shape(shapes, id, here())?;
            Ok(quotient(value, limits))
        });
        let value = made.map_err(|message| refused(message, call.span))?.0;
        let kind = ShapeKind::Field {
            value,
            slope: None,
            region,
        };
        let field = self.add(kind, plane, call.span);
        Ok(match paint {
            Some(material) => {
                let child = field;
                self.add(ShapeKind::Painted { child, material }, plane, call.span)
            }
            None => field,
        })
    }

    /// The material that all of a shape has, if it has one.
    fn only_paint(&self, id: ShapeId, span: Span) -> Result<Option<MaterialId>, Box<Diagnostic>> {
        let shape = &self.shapes[id.0 as usize];
        if let ShapeKind::Painted { material, .. } = shape.kind {
            return Ok(Some(material));
        }
        let mut paints = Vec::new();
        for &child in children(&shape.kind) {
            let paint = self.only_paint(child, span)?;
            if !paints.contains(&paint) {
                paints.push(paint);
            }
        }
        match paints[..] {
            [] => Ok(None),
            [paint] => Ok(paint),
            _ => {
                let message = "a distance is made of what has one material, and this has several";
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

/// An error about a field that cannot be differentiated.
fn refused(message: &'static str, span: Span) -> Box<Diagnostic> {
    Box::new(Diagnostic::error(codes::E0405, span, message))
}
