//! Functions of the point: raw fields, terrain, displacement, warps, and noise.

use crate::analysis::definedness::{outside_where_undefined, undefined_condition};
use crate::analysis::extent::extent;
use crate::analysis::param_ranges::ParamRanges;
use crate::elaborate::Elaborator;
use crate::elaborate::angles;
use crate::elaborate::argument_conversion::BoundArgs;
use crate::elaborate::arguments::count_noun;
use crate::elaborate::constness::Demand;
use crate::elaborate::display::format_short;
use crate::elaborate::numbers::{Form, components};
use crate::elaborate::shapes::shape_value;
use crate::elaborate::value::{Abort, EvalResult, Quantity, ScalarValue, Value, Vector};
use crate::expression::{ExprId, Stage};
use crate::fidget_text::clauses::read_clauses;
use crate::scene::{NO_SURFACE_DISTANCE, ShapeKind};
use sdfc_lang::{Diagnostic, FileId, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// Maximum number of octaves of noise.
const MAX_OCTAVES: f64 = 16.0;

impl<'a> Elaborator<'a> {
    /// Returns the coordinates of the point, as plain numbers.
    fn coordinates(&mut self) -> [ScalarValue; 3] {
        [0, 1, 2].map(|axis| ScalarValue::new(self.expressions.coordinate(axis), Quantity::Plain))
    }

    /// Evaluates `field(f, lipschitz, within)`: the solid where `f` is negative.
    pub(crate) fn field_shape(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let function = bound.value(0).clone();
        let [x, y, z] = self.coordinates();
        let is_2d = function.takes_vec2();
        let point = if is_2d {
            Vector::from_slice(&[x, y])
        } else {
            Some(Vector::from_array([x, y, z]))
        };
        let Some(value) = self.evaluate_field(&function, point, bound.span_at(0))? else {
            return Ok(Value::Poison);
        };
        let value = self.outside_where_undefined(value);
        let slope = bound.is_given(1).then(|| bound.number(1));
        if let Some(slope) = slope
            && self
                .check_above("`lipschitz` of `field`", slope, true, bound.span_at(1))
                .is_none()
        {
            return Ok(Value::Poison);
        }
        let extent = self.field_extent(value);
        if !bound.is_given(2) {
            let region = extent;
            let kind = ShapeKind::Field {
                value,
                slope,
                region,
            };
            return Ok(Value::Shape(self.add(kind, is_2d, bound.span)));
        }
        // A field with `within` is intersected with that box.
        let mut size = bound.vector(2);
        if bound.is_2d {
            // Two numbers were given.
            size[2] = size[0];
        }
        let region =
            Bounds::centred(size.map(|id| self.current_value(id) / 2.0)).intersection(&extent);
        let field = self.add(
            ShapeKind::Field {
                value,
                slope,
                region,
            },
            is_2d,
            bound.span,
        );
        let op = if is_2d { Op::Rect } else { Op::Cuboid };
        let size = if is_2d { &size[..2] } else { &size[..] };
        let parameters = self.prepare_parameters(op, size);
        let limit = self.add(ShapeKind::Primitive { op, parameters }, is_2d, bound.span);
        let intersection =
            self.combine(Op::Intersection, Vec::new(), vec![field, limit], bound.span);
        shape_value(intersection)
    }

    /// Returns the solid of a `.vm` file. `span` is that of its name.
    pub(crate) fn fidget_shape(&mut self, file: FileId, span: Span) -> Value<'a> {
        let field = match read_clauses(self.sources, file, &mut self.expressions) {
            Ok(field) => field,
            Err(errors) => {
                errors.into_iter().for_each(|error| self.report(error));
                return Value::Poison;
            }
        };
        let value = self.outside_where_undefined(field.value);
        let kind = ShapeKind::Field {
            value,
            slope: None,
            region: self.field_extent(value),
        };
        Value::Shape(self.add(kind, field.is_2d, span))
    }

    /// Returns a box outside which a written field is proved positive. For a field that depends on live parameters
    /// it is all of space; its extent is computed once the parameters have values.
    fn field_extent(&mut self, value: ExprId) -> Bounds {
        if self.depends_on_params(value) {
            return Bounds::ALL_SPACE;
        }
        let expressions = &self.expressions;
        extent(expressions, value, &mut |id| {
            Interval::point(expressions.as_constant(id).unwrap_or(f64::NAN))
        })
    }

    /// Returns the value of a field, and a distance without a surface wherever the value is not defined.
    fn outside_where_undefined(&mut self, value: ExprId) -> ExprId {
        let ranges = ParamRanges::for_scene(self.scene_ref());
        outside_where_undefined(&mut self.expressions, value, &ranges)
    }

    /// Evaluates a function of the point to a number.
    fn evaluate_field(
        &mut self,
        function: &Value<'a>,
        point: Option<Vector>,
        span: Span,
    ) -> Result<Option<ExprId>, Abort> {
        let Some(point) = point else { return Ok(None) };
        let value = self.call_at_point(function, [Value::Vector(point)], span)?;
        let argument = span;
        // Of a lambda, the value has a place of its own.
        let span = match function {
            Value::Function(closure) if span.contains(closure.body.result.span) => {
                closure.body.result.span
            }
            _ => span,
        };
        match value {
            Value::Number(number) if number.quantity != Quantity::Angle => Ok(Some(number.id)),
            Value::Poison => Ok(None),
            Value::Shape(_) => {
                let message = "this function gives a shape, and a number is required";
                self.report(Diagnostic::error(codes::E0301, span, message));
                Ok(None)
            }
            Value::Number(angle) => {
                let message = "this function of the point must give a number, and this is an angle";
                let diagnostic = Diagnostic::error(codes::E0301, span, message);
                let text = self.sources.slice(argument);
                let diagnostic = angles::advise(diagnostic, angle.quantity, text, argument);
                self.report(diagnostic);
                Ok(None)
            }
            other => {
                self.report_wrong(
                    &other,
                    "this function of the point must give a number",
                    span,
                );
                Ok(None)
            }
        }
    }

    /// Evaluates `heightfield(f, over, base)`: the points below a height, within a rectangle.
    pub(crate) fn heightfield(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let span = bound.span;
        let [x, y, z] = self.coordinates();
        let up = self.up();
        let ground_axes = if self.z_up { [x, y] } else { [x, z] };
        let function = bound.value(0).clone();
        let point = Vector::from_slice(&ground_axes);
        let Some(height) = self.evaluate_field(&function, point, bound.span_at(0))? else {
            return Ok(Value::Poison);
        };
        let size = &bound.arguments[1].numbers;
        let half_size = [size[0], size[1]].map(|id| self.current_value(id) / 2.0);
        let mut ground_area = Bounds::centred([half_size[0], f64::INFINITY, half_size[1]]);
        if self.z_up {
            ground_area = Bounds::centred([half_size[0], half_size[1], f64::INFINITY]);
        }
        let heights = self.point_range(height, &ground_area);
        let widest = half_size[0].max(half_size[1]) * 2.0;
        let (low, high) = match heights.lo.is_finite() && heights.hi.is_finite() {
            true => (heights.lo, heights.hi),
            false => (-widest, widest),
        };
        let base = match bound.is_given(2) {
            true => self.current_value(bound.number(2)),
            false => low - widest * 0.02,
        };
        if base >= high {
            let message = format!(
                "the base of the terrain is {}, above all of its heights",
                format_short(base)
            );
            self.report(Diagnostic::error(codes::E0401, bound.span_at(2), message));
            return Ok(Value::Poison);
        }
        let mut region = ground_area;
        region.min[up] = base;
        region.max[up] = high;
        let height_axis = [x, y, z][up].id;
        let value = self.op(Op::Sub, &[height_axis, height]);
        let value = self.outside_where_undefined(value);
        let kind = ShapeKind::Field {
            value,
            slope: None,
            region,
        };
        let ground = self.add(kind, false, span);
        let sizes = [0, 1, 2].map(|i| self.expressions.constant(region.max[i] - region.min[i]));
        let parameters = self.prepare_parameters(Op::Cuboid, &sizes);
        let op = Op::Cuboid;
        let block = self.add(ShapeKind::Primitive { op, parameters }, false, span);
        let block = self.add_translation(block, region.centre(), span);
        let intersection = self.combine(Op::Intersection, Vec::new(), vec![ground, block], span);
        shape_value(intersection)
    }

    /// Evaluates `displace(shape, f)`: the shape with its surface moved outwards by `f`.
    pub(crate) fn displace(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let child = bound.shape(0);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let is_2d = self.shapes[child.0 as usize].is_2d;
        let point = self.local_point(is_2d);
        let function = bound.value(1).clone();
        let Some(amount) = self.evaluate_field(&function, point, bound.span_at(1))? else {
            return Ok(Value::Poison);
        };
        let amount = self.op(Op::Neg, &[amount]);
        let amount = self.outside_where_undefined(amount);
        Ok(Value::Shape(self.add(
            ShapeKind::Displace { child, amount },
            is_2d,
            bound.span,
        )))
    }

    fn local_point(&mut self, is_2d: bool) -> Option<Vector> {
        let [x, y, z] = self.coordinates();
        if is_2d {
            Vector::from_slice(&[x, y])
        } else {
            Some(Vector::from_array([x, y, z]))
        }
    }

    /// Evaluates `warp(shape, f)`: a shape whose points are mapped by `f` before it is evaluated.
    pub(crate) fn warp(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let child = bound.shape(0);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let is_2d = self.shapes[child.0 as usize].is_2d;
        let span = bound.span_at(1);
        let Some(point) = self.local_point(is_2d) else {
            return Ok(Value::Poison);
        };
        let value = self.call_at_point(&bound.value(1).clone(), [Value::Vector(point)], span)?;
        if value.is_poison() {
            return Ok(Value::Poison);
        }
        let width = if is_2d { 2 } else { 3 };
        let point = match components(&value) {
            Some((Form::Vector(len), numbers)) if len == width => {
                let z = if is_2d {
                    self.expressions.coordinate(2)
                } else {
                    numbers[2].id
                };
                [numbers[0].id, numbers[1].id, z]
            }
            _ => {
                let message = format!("the function of a warp must give a vec{width}");
                return Ok(self.report_wrong(&value, &message, span));
            }
        };
        let warped = self.add(ShapeKind::Warp { child, point }, is_2d, bound.span);
        let ranges = ParamRanges::for_scene(self.scene_ref());
        let Some(condition) = undefined_condition(&mut self.expressions, &point, &ranges) else {
            return Ok(Value::Shape(warped));
        };
        // Points that the function does not map are cut off.
        let [cut, kept] = [-NO_SURFACE_DISTANCE, NO_SURFACE_DISTANCE]
            .map(|distance| self.expressions.constant(distance));
        let kind = ShapeKind::Field {
            value: self.op(Op::Select, &[condition, cut, kept]),
            slope: None,
            region: Bounds::ALL_SPACE,
        };
        let undefined = self.add(kind, is_2d, bound.span);
        let operands = vec![warped, undefined];
        shape_value(self.combine(Op::Subtraction, Vec::new(), operands, bound.span))
    }

    /// Evaluates `noise(p, seed)`: gradient noise at a number, a vec2 or a vec3.
    pub(crate) fn noise(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let Some(point) = self.noise_point(&bound) else {
            return Ok(Value::Poison);
        };
        let seed = bound.number(1);
        let id = self.expressions.apply(Op::Noise, Some(point), &[], &[seed]);
        Ok(Value::Number(ScalarValue::plain(id)))
    }

    fn noise_point(&mut self, bound: &BoundArgs<'a>) -> Option<[ExprId; 3]> {
        let zero = self.expressions.constant(0.0);
        match components(bound.value(0)) {
            Some((Form::Scalar, [x, ..])) => Some([x.id, zero, zero]),
            Some((Form::Vector(2), [x, y, ..])) => Some([x.id, y.id, zero]),
            Some((Form::Vector(3), [x, y, z, _])) => Some([x.id, y.id, z.id]),
            Some(_) | None => {
                self.report_wrong(bound.value(0), "noise takes a point", bound.span_at(0));
                None
            }
        }
    }

    /// Evaluates `fbm(p, octaves, seed, gain, lacunarity)` or `ridge(..)`: noise at several scales.
    pub(crate) fn fractal_noise(&mut self, op: Op, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let Some(point) = self.noise_point(&bound) else {
            return Ok(Value::Poison);
        };
        let what = "the number of octaves";
        let demand = Demand::new(what, bound.span_at(1));
        let Some(count) = self.demand(bound.number(1), &demand) else {
            return Ok(Value::Poison);
        };
        if !(1.0..=MAX_OCTAVES).contains(&count) || count.fract() != 0.0 {
            let count = format_short(count);
            let message =
                format!("{what} is a whole number from 1 to {MAX_OCTAVES}, and this is {count}");
            self.report(Diagnostic::error(codes::E0401, bound.span_at(1), message));
            return Ok(Value::Poison);
        }
        let (seed, gain, lacunarity) = (bound.number(2), bound.number(3), bound.number(4));
        let mut sum = self.expressions.constant(0.0);
        let mut frequency = self.expressions.constant(1.0);
        // With the default gain, the amplitudes sum to at most 1.
        let mut amplitude = self.expressions.constant(0.5);
        for _ in 0..count as u32 {
            let parameters = self.prepare_parameters(op, &[frequency, amplitude, seed]);
            sum = self.expressions.apply(op, Some(point), &[sum], &parameters);
            frequency = self.op(Op::Mul, &[frequency, lacunarity]);
            amplitude = self.op(Op::Mul, &[amplitude, gain]);
        }
        Ok(Value::Number(ScalarValue::plain(sum)))
    }

    /// Evaluates `polygon(points)`: a 2-D shape of at least three corners.
    pub(crate) fn polygon(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let span = bound.span_at(0);
        let Some(elements) = self.argument_elements(&bound, 0) else {
            return Ok(Value::Poison);
        };
        if elements.len() < 3 {
            let corners = count_noun(elements.len(), "corner");
            let message = format!("a polygon has at least 3 corners, and this has {corners}");
            self.report(Diagnostic::error(codes::E0405, span, message));
            return Ok(Value::Poison);
        }
        let mut points = Vec::with_capacity(elements.len());
        for element in elements.iter() {
            let Some((Form::Vector(2), [x, y, ..])) = components(element) else {
                return Ok(self.report_wrong(element, "a corner of a polygon is a vec2", span));
            };
            for id in [x.id, y.id] {
                let stage = self.expressions.stage(id);
                if stage > Stage::Uniform {
                    self.report_too_late("a corner of a polygon", stage, span);
                    return Ok(Value::Poison);
                }
            }
            points.push([x.id, y.id]);
        }
        points.dedup();
        Ok(Value::Shape(self.add(
            ShapeKind::Polygon { points },
            true,
            bound.span,
        )))
    }

    /// Evaluates a field of a material: a value, or a function of the point and the normal.
    pub(crate) fn surface_value(&mut self, value: Value<'a>, span: Span) -> EvalResult<'a> {
        let params = match &value {
            Value::Function(closure) => closure.params.len(),
            Value::Builtin(_) => 1,
            _ => return Ok(value),
        };
        let point = Vector::from_array(self.coordinates());
        let normal = [0, 1, 2].map(|axis| ScalarValue::plain(self.expressions.normal(axis)));
        let args = [
            Value::Vector(point),
            Value::Vector(Vector::from_array(normal)),
        ];
        self.call_at_point(&value, args.into_iter().take(params.clamp(1, 2)), span)
    }

    /// Evaluates `color(shape, color)`, of a colour or a function of the point and the normal that returns one.
    pub(crate) fn colored(&mut self, mut bound: BoundArgs<'a>) -> EvalResult<'a> {
        let span = bound.span_at(1);
        let value = self.surface_value(bound.value(1).clone(), span)?;
        let material = match (self.as_color(&value), &value) {
            (Some(color), _) => self.plain_material(color),
            (None, Value::Material(id)) => *id,
            (None, _) => return Ok(self.report_wrong(&value, "a color is required", span)),
        };
        bound.arguments[1].value = Value::Material(material);
        self.painted(bound)
    }

    /// Assigns a material to a shape.
    pub(crate) fn painted(&mut self, bound: BoundArgs<'a>) -> EvalResult<'a> {
        let (child, material) = (bound.shape(0), bound.material(1));
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let is_2d = self.shapes[child.0 as usize].is_2d;
        let kind = ShapeKind::Painted { child, material };
        Ok(Value::Shape(self.add(kind, is_2d, bound.span)))
    }
}
