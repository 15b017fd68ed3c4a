//! Functions of vectors and colours, expressed as operations on numbers.

use crate::elaborate::Elaborator;
use crate::elaborate::arguments::Invocation;
use crate::elaborate::numbers::{Form, assemble_value, components};
use crate::elaborate::value::{EvalResult, Quantity, ScalarValue, Value, Vector};
use crate::expression::ExprId;
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::table::Op;

impl<'a> Elaborator<'a> {
    /// Returns the arguments of a function of vectors; reports other values and a wrong count.
    fn vector_args(
        &mut self,
        call: &Invocation<'a>,
        count: usize,
    ) -> Option<(Form, Vec<[ScalarValue; 4]>)> {
        if self.has_wrong_arg_count(call, count..=count) {
            return None;
        }
        let (form, args) = self.common_form(call)?;
        // A number stands for a vector of equal components in arithmetic, but not here.
        if let Some(scalar) = call.args.iter().find(|arg| arg.value.as_number().is_some()) {
            let message = format!("`{}` takes vectors, and this is a number", call.name);
            let diagnostic = Diagnostic::error(codes::E0301, scalar.span, message);
            self.report(match form {
                Form::Vector(len) => {
                    let text = self.sources.slice(scalar.span);
                    let vector = format!("vec{len}({text})");
                    let help = format!("write `{vector}`, if all components are equal");
                    diagnostic.fix(scalar.span, vector, help)
                }
                Form::Scalar | Form::Color => diagnostic,
            });
            return None;
        }
        Some((form, args))
    }

    fn dot_product(
        &mut self,
        len: usize,
        a: &[ScalarValue; 4],
        b: &[ScalarValue; 4],
    ) -> ScalarValue {
        let mut sum = None;
        for i in 0..len {
            let product = self.op(Op::Mul, &[a[i].id, b[i].id]);
            sum = Some(match sum {
                Some(sum) => self.op(Op::Add, &[sum, product]),
                None => product,
            });
        }
        let quantity = a[0].quantity.product(b[0].quantity);
        ScalarValue::new(
            sum.unwrap_or_else(|| self.expressions.constant(0.0)),
            quantity,
        )
    }

    /// Evaluates `dot(a, b)`: the sum of the products of components.
    pub(crate) fn dot(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        let Some((form, args)) = self.vector_args(&call, 2) else {
            return Ok(Value::Poison);
        };
        Ok(Value::Number(self.dot_product(
            form.len(),
            &args[0],
            &args[1],
        )))
    }

    fn norm(&mut self, len: usize, v: &[ScalarValue; 4]) -> ScalarValue {
        let square = self.dot_product(len, v, v);
        ScalarValue::new(self.op(Op::Sqrt, &[square.id]), v[0].quantity)
    }

    /// Evaluates `length(v)`: the Euclidean norm.
    pub(crate) fn length(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        let Some((form, args)) = self.vector_args(&call, 1) else {
            return Ok(Value::Poison);
        };
        Ok(Value::Number(self.norm(form.len(), &args[0])))
    }

    /// Evaluates `distance(a, b)`: the length of the difference.
    pub(crate) fn distance(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        let Some((form, args)) = self.vector_args(&call, 2) else {
            return Ok(Value::Poison);
        };
        let mut difference = args[0];
        for i in 0..form.len() {
            difference[i].id = self.op(Op::Sub, &[args[0][i].id, args[1][i].id]);
        }
        Ok(Value::Number(self.norm(form.len(), &difference)))
    }

    /// Evaluates `normalize(v)`: the unit vector; a constant zero vector is an error.
    pub(crate) fn normalize(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        let Some((form, args)) = self.vector_args(&call, 1) else {
            return Ok(Value::Poison);
        };
        let norm = self.norm(form.len(), &args[0]);
        if self.expressions.as_constant(norm.id) == Some(0.0) {
            let message = "the zero vector has no direction";
            self.report(Diagnostic::error(codes::E0405, call.span, message));
            return Ok(Value::Poison);
        }
        let unit: Vec<ScalarValue> = args[0][..form.len()]
            .iter()
            .map(|component| ScalarValue::plain(self.op(Op::Div, &[component.id, norm.id])))
            .collect();
        Ok(assemble_value(form, &unit))
    }

    /// Evaluates `cross(a, b)` of two vec3.
    pub(crate) fn cross(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        let Some((form, args)) = self.vector_args(&call, 2) else {
            return Ok(Value::Poison);
        };
        if form != Form::Vector(3) {
            let message = "`cross` takes two vec3";
            self.report(Diagnostic::error(codes::E0311, call.span, message));
            return Ok(Value::Poison);
        }
        let (a, b) = (&args[0], &args[1]);
        let quantity = a[0].quantity.product(b[0].quantity);
        let parts = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
            let left = self.op(Op::Mul, &[a[i].id, b[j].id]);
            let right = self.op(Op::Mul, &[a[j].id, b[i].id]);
            ScalarValue::new(self.op(Op::Sub, &[left, right]), quantity)
        });
        Ok(Value::Vector(Vector::from_array(parts)))
    }

    /// Evaluates `vec2(..)`, `vec3(..)` or `vec4(..)`: from numbers and vectors, or one number for all components.
    pub(crate) fn vector(&mut self, len: usize, call: Invocation<'a>) -> EvalResult<'a> {
        if self.has_wrong_arg_count(&call, 1..=len) {
            return Ok(Value::Poison);
        }
        let mut numbers = Vec::with_capacity(4);
        for arg in &call.args {
            match components(&arg.value) {
                Some((Form::Scalar, [number, ..])) if call.args.len() == 1 => {
                    numbers.extend(std::iter::repeat_n(number, len));
                }
                Some((form, components)) => numbers.extend_from_slice(&components[..form.len()]),
                None => {
                    let message = format!("`{}` is made of numbers", call.name);
                    return Ok(self.report_wrong(&arg.value, &message, arg.span));
                }
            }
        }
        if numbers.len() != len {
            let message = format!(
                "`{}` is made of {len} numbers, and {} are given",
                call.name,
                numbers.len()
            );
            self.report(Diagnostic::error(codes::E0311, call.span, message));
            return Ok(Value::Poison);
        }
        Ok(Vector::from_slice(&numbers).map_or(Value::Poison, Value::Vector))
    }

    /// Evaluates `reflect(v, n)` of vectors: `v - 2 * dot(v, n) * n`.
    pub(crate) fn reflect_vector(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        let Some((form, args)) = self.vector_args(&call, 2) else {
            return Ok(Value::Poison);
        };
        let projection = self.dot_product(form.len(), &args[0], &args[1]);
        let constant_two = self.expressions.constant(2.0);
        let twice = self.op(Op::Mul, &[constant_two, projection.id]);
        let mut result = args[0];
        for (component, normal) in result.iter_mut().zip(args[1]) {
            let shift = self.op(Op::Mul, &[twice, normal.id]);
            component.id = self.op(Op::Sub, &[component.id, shift]);
        }
        Ok(assemble_value(form, &result))
    }

    /// Evaluates `rgb(r, g, b)`: a colour from linear numbers.
    pub(crate) fn rgb(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        match self.vector(3, call)? {
            Value::Vector(vector) => {
                let components = vector.components();
                Ok(Value::Color([
                    components[0].id,
                    components[1].id,
                    components[2].id,
                ]))
            }
            other => Ok(other),
        }
    }

    /// Evaluates `hsv(hue, saturation, value)`: an sRGB colour; the hue is an angle or a fraction of a turn.
    pub(crate) fn hsv(&mut self, call: Invocation<'a>) -> EvalResult<'a> {
        if self.has_wrong_arg_count(&call, 3..=3) {
            return Ok(Value::Poison);
        }
        let Some((Form::Scalar, args)) = self.common_form(&call) else {
            return Ok(Value::Poison);
        };
        let (mut hue, saturation, value) = (args[0][0], args[1][0].id, args[2][0].id);
        if hue.quantity == Quantity::Angle {
            let turn = self.expressions.constant(std::f64::consts::TAU);
            hue.id = self.op(Op::Div, &[hue.id, turn]);
        }
        // Each channel is a trapezoid function of the hue, offset by a third of a turn.
        let channels = [0.0, 2.0 / 3.0, 1.0 / 3.0].map(|shift| {
            let mut c = |v: f64| self.expressions.constant(v);
            let (shift, one, three, six, zero) = (c(shift), c(1.0), c(3.0), c(6.0), c(0.0));
            let shifted_hue = self.op(Op::Add, &[hue.id, shift]);
            let fraction = self.op(Op::Fract, &[shifted_hue]);
            let scaled = self.op(Op::Mul, &[fraction, six]);
            let centred = self.op(Op::Sub, &[scaled, three]);
            let distance = self.op(Op::Abs, &[centred]);
            let ramp = self.op(Op::Sub, &[distance, one]);
            let pure = self.op(Op::Clamp, &[ramp, zero, one]);
            let mixed = self.op(Op::Mix, &[one, pure, saturation]);
            let screen = self.op(Op::Mul, &[value, mixed]);
            self.decode_srgb(screen)
        });
        Ok(Value::Color(channels))
    }

    /// Decodes an sRGB value to linear light.
    fn decode_srgb(&mut self, screen: ExprId) -> ExprId {
        if let Some(value) = self.expressions.as_constant(screen) {
            return self
                .expressions
                .constant(crate::elaborate::numbers::linear(value));
        }
        let mut c = |v: f64| self.expressions.constant(v);
        let (edge, slope, shift, scale, gamma) = (c(0.04045), c(12.92), c(0.055), c(1.055), c(2.4));
        let low = self.op(Op::Div, &[screen, slope]);
        let shifted = self.op(Op::Add, &[screen, shift]);
        let scaled = self.op(Op::Div, &[shifted, scale]);
        let high = self.op(Op::Pow, &[scaled, gamma]);
        let is_low = self.op(Op::Less, &[screen, edge]);
        self.op(Op::Select, &[is_low, low, high])
    }
}
