//! Functions of the point: raw fields, terrain, displacement, warps, and noise.

use super::Elaborator;
use super::bound::Bound;
use super::evaluate::{Halt, Outcome};
use super::numbers::{Form, parts};
use super::stage::Demand;
use super::value::{Number, Quantity, Value, Vector};
use crate::expression::{ExprId, Stage};
use crate::extent::extent;
use crate::scene::ShapeKind;
use sdfc_lang::{Diagnostic, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::interval::Interval;
use sdfc_vm::table::Op;

/// The most octaves of noise.
const MAX_OCTAVES: f64 = 16.0;

impl<'a> Elaborator<'a> {
    /// The coordinates of the point that a function of the point is given.
    fn coordinates(&mut self) -> [Number; 3] {
        [0, 1, 2].map(|axis| Number::of(self.graph.coordinate(axis), Quantity::Plain))
    }

    /// `field(f, lipschitz, within)`
    pub(crate) fn field_shape(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let function = bound.value(0).clone();
        let [x, y, z] = self.coordinates();
        let flat = takes_vec2(&function);
        let point = if flat {
            Vector::from_slice(&[x, y])
        } else {
            Some(Vector::three([x, y, z]))
        };
        let Some(value) = self.field_number(&function, point, bound.span_of(0))? else {
            return Ok(Value::Poison);
        };
        let slope = bound.given(1).then(|| bound.number(1));
        if let Some(slope) = slope
            && self
                .check_above("`lipschitz` of `field`", slope, true, bound.span_of(1))
                .is_none()
        {
            return Ok(Value::Poison);
        }
        let extent = self.extent_of(value);
        if !bound.given(2) {
            let region = extent;
            let kind = ShapeKind::Field {
                value,
                slope,
                region,
            };
            return Ok(Value::Shape(self.add(kind, flat, bound.span)));
        }
        // What is asked for only within a box ends there.
        let size = bound.vector(2);
        let region = Bounds::centred(size.map(|id| self.present(id) / 2.0)).common(&extent);
        let field = self.add(
            ShapeKind::Field {
                value,
                slope,
                region,
            },
            flat,
            bound.span,
        );
        let op = if flat { Op::Rect } else { Op::Cuboid };
        let size = if flat { &size[..2] } else { &size[..] };
        let parameters = self.prepared(op, size);
        let limit = self.add(ShapeKind::Primitive { op, parameters }, flat, bound.span);
        let both = self.combined(Op::Intersection, Vec::new(), vec![field, limit], bound.span);
        super::shapes::shape_value(both)
    }

    /// Where a written field is not proved positive; all of space for one that follows a parameter, whose
    /// extent is looked for when the parameters are known.
    fn extent_of(&mut self, value: ExprId) -> Bounds {
        if self.follows_params(value) {
            return Bounds::EVERYTHING;
        }
        let graph = &self.graph;
        extent(graph, value, &mut |id| {
            Interval::point(graph.as_constant(id).unwrap_or(f64::NAN))
        })
    }

    /// The number that a function of the point gives.
    fn field_number(
        &mut self,
        function: &Value<'a>,
        point: Option<Vector>,
        span: Span,
    ) -> Result<Option<ExprId>, Halt> {
        let Some(point) = point else { return Ok(None) };
        let value = self.at_point(function, [Value::Vector(point)], span)?;
        match value {
            Value::Number(number) if number.quantity != Quantity::Angle => Ok(Some(number.id)),
            Value::Poison => Ok(None),
            Value::Shape(_) => {
                let message = "this function gives a shape, and a number is wanted";
                self.report(Diagnostic::error(codes::E0301, span, message));
                Ok(None)
            }
            other => {
                self.wrong(
                    &other,
                    "this function of the point must give a number",
                    span,
                );
                Ok(None)
            }
        }
    }

    /// `heightfield(f, over, base)`: everything below a height, within a rectangle.
    pub(crate) fn heightfield(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let span = bound.span;
        let [x, y, z] = self.coordinates();
        let up = self.up();
        let across = if self.z_up { [x, y] } else { [x, z] };
        let function = bound.value(0).clone();
        let point = Vector::from_slice(&across);
        let Some(height) = self.field_number(&function, point, bound.span_of(0))? else {
            return Ok(Value::Poison);
        };
        let size = &bound.arguments[1].numbers;
        let half = [size[0], size[1]].map(|id| self.present(id) / 2.0);
        let mut over = Bounds::centred([half[0], f64::INFINITY, half[1]]);
        if self.z_up {
            over = Bounds::centred([half[0], half[1], f64::INFINITY]);
        }
        let heights = self.range_of(height, &over);
        let widest = half[0].max(half[1]) * 2.0;
        let (low, high) = match heights.lo.is_finite() && heights.hi.is_finite() {
            true => (heights.lo, heights.hi),
            false => (-widest, widest),
        };
        let base = match bound.given(2) {
            true => self.present(bound.number(2)),
            false => low - widest * 0.02,
        };
        if base >= high {
            let message = format!(
                "the base of the terrain is {}, above all of its heights",
                super::bound::short(base)
            );
            self.report(Diagnostic::error(codes::E0401, bound.span_of(2), message));
            return Ok(Value::Poison);
        }
        let mut region = over;
        region.min[up] = base;
        region.max[up] = high;
        let upwards = [x, y, z][up].id;
        let value = self.op(Op::Sub, &[upwards, height]);
        let kind = ShapeKind::Field {
            value,
            slope: None,
            region,
        };
        let ground = self.add(kind, false, span);
        let sizes = [0, 1, 2].map(|i| self.graph.constant(region.max[i] - region.min[i]));
        let parameters = self.prepared(Op::Cuboid, &sizes);
        let op = Op::Cuboid;
        let block = self.add(ShapeKind::Primitive { op, parameters }, false, span);
        let block = self.moved(block, region.centre(), span);
        let both = self.combined(Op::Intersection, Vec::new(), vec![ground, block], span);
        super::shapes::shape_value(both)
    }

    /// `displace(shape, f)`
    pub(crate) fn displace(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let child = bound.shape(0);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let plane = self.shapes[child.0 as usize].plane;
        let point = self.local_point(plane);
        let function = bound.value(1).clone();
        let Some(amount) = self.field_number(&function, point, bound.span_of(1))? else {
            return Ok(Value::Poison);
        };
        let amount = self.op(Op::Neg, &[amount]);
        Ok(Value::Shape(self.add(
            ShapeKind::Displace { child, amount },
            plane,
            bound.span,
        )))
    }

    fn local_point(&mut self, plane: bool) -> Option<Vector> {
        let [x, y, z] = self.coordinates();
        if plane {
            Vector::from_slice(&[x, y])
        } else {
            Some(Vector::three([x, y, z]))
        }
    }

    /// `warp(shape, f)`
    pub(crate) fn warp(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let child = bound.shape(0);
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let plane = self.shapes[child.0 as usize].plane;
        let span = bound.span_of(1);
        let Some(point) = self.local_point(plane) else {
            return Ok(Value::Poison);
        };
        let value = self.at_point(&bound.value(1).clone(), [Value::Vector(point)], span)?;
        if value.is_poison() {
            return Ok(Value::Poison);
        }
        let width = if plane { 2 } else { 3 };
        let point = match parts(&value) {
            Some((Form::Vector(len), numbers)) if len == width => {
                let z = if plane {
                    self.graph.coordinate(2)
                } else {
                    numbers[2].id
                };
                [numbers[0].id, numbers[1].id, z]
            }
            _ => {
                let wanted = format!("the function of a warp must give a vec{width}");
                return Ok(self.wrong(&value, &wanted, span));
            }
        };
        Ok(Value::Shape(self.add(
            ShapeKind::Warp { child, point },
            plane,
            bound.span,
        )))
    }

    /// `noise(p, seed)`
    pub(crate) fn noise(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let Some(point) = self.noise_point(&bound) else {
            return Ok(Value::Poison);
        };
        let seed = bound.number(1);
        let id = self.graph.apply(Op::Noise, Some(point), &[], &[seed]);
        Ok(Value::Number(Number::plain(id)))
    }

    fn noise_point(&mut self, bound: &Bound<'a>) -> Option<[ExprId; 3]> {
        let zero = self.graph.constant(0.0);
        match parts(bound.value(0)) {
            Some((Form::Scalar, [x, ..])) => Some([x.id, zero, zero]),
            Some((Form::Vector(2), [x, y, ..])) => Some([x.id, y.id, zero]),
            Some((Form::Vector(3), [x, y, z, _])) => Some([x.id, y.id, z.id]),
            Some(_) | None => {
                self.wrong(bound.value(0), "noise is of a point", bound.span_of(0));
                None
            }
        }
    }

    /// `fbm(p, octaves, seed, gain, lacunarity)` and `ridge(..)`: noise at several scales.
    pub(crate) fn octaves(&mut self, op: Op, bound: Bound<'a>) -> Outcome<'a> {
        let Some(point) = self.noise_point(&bound) else {
            return Ok(Value::Poison);
        };
        let what = "the number of octaves";
        let demand = Demand::new(what, bound.span_of(1));
        let Some(count) = self.demand(bound.number(1), &demand) else {
            return Ok(Value::Poison);
        };
        if !(1.0..=MAX_OCTAVES).contains(&count) || count.fract() != 0.0 {
            let count = super::bound::short(count);
            let message =
                format!("{what} is a whole number from 1 to {MAX_OCTAVES}, and this is {count}");
            self.report(Diagnostic::error(codes::E0401, bound.span_of(1), message));
            return Ok(Value::Poison);
        }
        let (seed, gain, lacunarity) = (bound.number(2), bound.number(3), bound.number(4));
        let mut sum = self.graph.constant(0.0);
        let mut frequency = self.graph.constant(1.0);
        // The amplitudes of the default gain add up to one.
        let mut amplitude = self.graph.constant(0.5);
        for _ in 0..count as u32 {
            let parameters = self.prepared(op, &[frequency, amplitude, seed]);
            sum = self.graph.apply(op, Some(point), &[sum], &parameters);
            frequency = self.op(Op::Mul, &[frequency, lacunarity]);
            amplitude = self.op(Op::Mul, &[amplitude, gain]);
        }
        Ok(Value::Number(Number::plain(sum)))
    }

    /// `polygon(points)`
    pub(crate) fn polygon(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let span = bound.span_of(0);
        let Some(elements) = self.elements_of(&bound, 0) else {
            return Ok(Value::Poison);
        };
        if elements.len() < 3 {
            let corners = super::arguments::count(elements.len(), "corner");
            let message = format!("a polygon has at least 3 corners, and this has {corners}");
            self.report(Diagnostic::error(codes::E0405, span, message));
            return Ok(Value::Poison);
        }
        let mut points = Vec::with_capacity(elements.len());
        for element in elements.iter() {
            let Some((Form::Vector(2), [x, y, ..])) = parts(element) else {
                return Ok(self.wrong(element, "a corner of a polygon is a vec2", span));
            };
            for id in [x.id, y.id] {
                let stage = self.graph.stage(id);
                if stage > Stage::Uniform {
                    self.report_late("a corner of a polygon", stage, span);
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

    /// A material's field: a value, or a function of the point and the normal.
    pub(crate) fn surface_value(&mut self, value: Value<'a>, span: Span) -> Outcome<'a> {
        let params = match &value {
            Value::Function(closure) => closure.params.len(),
            Value::Builtin(_) => 1,
            _ => return Ok(value),
        };
        let point = Vector::three(self.coordinates());
        let normal = [0, 1, 2].map(|axis| Number::plain(self.graph.normal(axis)));
        let given = [Value::Vector(point), Value::Vector(Vector::three(normal))];
        self.at_point(&value, given.into_iter().take(params.clamp(1, 2)), span)
    }

    /// `color(shape, color)`: a colour, or a function of the point and the normal that gives one.
    pub(crate) fn colored(&mut self, mut bound: Bound<'a>) -> Outcome<'a> {
        let span = bound.span_of(1);
        let value = self.surface_value(bound.value(1).clone(), span)?;
        let material = match (self.as_color(&value), &value) {
            (Some(color), _) => self.plain_material(color),
            (None, Value::Material(id)) => *id,
            (None, _) => return Ok(self.wrong(&value, "a color is wanted", span)),
        };
        bound.arguments[1].value = Value::Material(material);
        self.painted(bound)
    }

    /// A shape in a material.
    pub(crate) fn painted(&mut self, bound: Bound<'a>) -> Outcome<'a> {
        let (child, material) = (bound.shape(0), bound.material(1));
        if self.is_nothing(child) {
            return Ok(Value::Shape(child));
        }
        let plane = self.shapes[child.0 as usize].plane;
        let kind = ShapeKind::Painted { child, material };
        Ok(Value::Shape(self.add(kind, plane, bound.span)))
    }
}

/// Whether a function says that it takes a point of the plane.
fn takes_vec2(function: &Value<'_>) -> bool {
    match function {
        Value::Function(closure) => closure.params.first().is_some_and(|param| {
            param
                .annotation
                .as_ref()
                .is_some_and(|annotation| annotation.name == "vec2")
        }),
        _ => false,
    }
}
