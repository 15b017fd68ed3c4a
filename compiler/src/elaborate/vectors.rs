//! The functions of vectors and colours, written out in operations on numbers.

use super::Elaborator;
use super::arguments::Invocation;
use super::evaluate::Outcome;
use super::numbers::{Form, assembled, parts};
use super::value::{Number, Quantity, Value, Vector};
use crate::expression::ExprId;
use sdfc_lang::{Diagnostic, codes};
use sdfc_vm::table::Op;

impl<'a> Elaborator<'a> {
    /// The vectors that a function of vectors is given.
    fn vectors(
        &mut self,
        call: &Invocation<'a>,
        number: usize,
    ) -> Option<(Form, Vec<[Number; 4]>)> {
        if self.wrong_count(call, number..=number) {
            return None;
        }
        let (form, all) = self.common_form(call)?;
        if form == Form::Scalar {
            let message = format!("`{}` is of vectors", call.name);
            let place = call.given.first().map_or(call.span, |given| given.span);
            self.report(Diagnostic::error(codes::E0301, place, message));
            return None;
        }
        Some((form, all))
    }

    fn sum_of_products(&mut self, len: usize, a: &[Number; 4], b: &[Number; 4]) -> Number {
        let mut sum = None;
        for i in 0..len {
            let product = self.op(Op::Mul, &[a[i].id, b[i].id]);
            sum = Some(match sum {
                Some(sum) => self.op(Op::Add, &[sum, product]),
                None => product,
            });
        }
        let quantity = a[0].quantity.product(b[0].quantity);
        Number::of(sum.unwrap_or_else(|| self.graph.constant(0.0)), quantity)
    }

    /// `dot(a, b)`
    pub(crate) fn dot(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        let Some((form, all)) = self.vectors(&call, 2) else {
            return Ok(Value::Poison);
        };
        Ok(Value::Number(self.sum_of_products(
            form.len(),
            &all[0],
            &all[1],
        )))
    }

    fn norm(&mut self, len: usize, v: &[Number; 4]) -> Number {
        let square = self.sum_of_products(len, v, v);
        Number::of(self.op(Op::Sqrt, &[square.id]), v[0].quantity)
    }

    /// `length(v)`
    pub(crate) fn length(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        let Some((form, all)) = self.vectors(&call, 1) else {
            return Ok(Value::Poison);
        };
        Ok(Value::Number(self.norm(form.len(), &all[0])))
    }

    /// `distance(a, b)`
    pub(crate) fn distance(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        let Some((form, all)) = self.vectors(&call, 2) else {
            return Ok(Value::Poison);
        };
        let mut between = all[0];
        for i in 0..form.len() {
            between[i].id = self.op(Op::Sub, &[all[0][i].id, all[1][i].id]);
        }
        Ok(Value::Number(self.norm(form.len(), &between)))
    }

    /// `normalize(v)`
    pub(crate) fn normalize(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        let Some((form, all)) = self.vectors(&call, 1) else {
            return Ok(Value::Poison);
        };
        let norm = self.norm(form.len(), &all[0]);
        if self.graph.as_constant(norm.id) == Some(0.0) {
            let message = "the zero vector has no direction";
            self.report(Diagnostic::error(codes::E0405, call.span, message));
            return Ok(Value::Poison);
        }
        let unit: Vec<Number> = all[0][..form.len()]
            .iter()
            .map(|part| Number::plain(self.op(Op::Div, &[part.id, norm.id])))
            .collect();
        Ok(assembled(form, &unit))
    }

    /// `cross(a, b)`
    pub(crate) fn cross(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        let Some((form, all)) = self.vectors(&call, 2) else {
            return Ok(Value::Poison);
        };
        if form != Form::Vector(3) {
            let message = "`cross` is of two vec3";
            self.report(Diagnostic::error(codes::E0311, call.span, message));
            return Ok(Value::Poison);
        }
        let (a, b) = (&all[0], &all[1]);
        let quantity = a[0].quantity.product(b[0].quantity);
        let parts = [(1, 2), (2, 0), (0, 1)].map(|(i, j)| {
            let left = self.op(Op::Mul, &[a[i].id, b[j].id]);
            let right = self.op(Op::Mul, &[a[j].id, b[i].id]);
            Number::of(self.op(Op::Sub, &[left, right]), quantity)
        });
        Ok(Value::Vector(Vector::three(parts)))
    }

    /// `vec2(..)`, `vec3(..)`, `vec4(..)`: from numbers and vectors, or one number for all.
    pub(crate) fn vector(&mut self, len: usize, call: Invocation<'a>) -> Outcome<'a> {
        if self.wrong_count(&call, 1..=len) {
            return Ok(Value::Poison);
        }
        let mut numbers = Vec::with_capacity(4);
        for given in &call.given {
            match parts(&given.value) {
                Some((Form::Scalar, [one, ..])) if call.given.len() == 1 => {
                    numbers.extend(std::iter::repeat_n(one, len));
                }
                Some((form, all)) => numbers.extend_from_slice(&all[..form.len()]),
                None => {
                    let wanted = format!("`{}` is made of numbers", call.name);
                    return Ok(self.wrong(&given.value, &wanted, given.span));
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

    /// `reflect(v, n)` of vectors: `v - 2 * dot(v, n) * n`.
    pub(crate) fn reflected(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        let Some((form, all)) = self.vectors(&call, 2) else {
            return Ok(Value::Poison);
        };
        let along = self.sum_of_products(form.len(), &all[0], &all[1]);
        let two = self.graph.constant(2.0);
        let twice = self.op(Op::Mul, &[two, along.id]);
        let mut result = all[0];
        for (part, normal) in result.iter_mut().zip(all[1]) {
            let by = self.op(Op::Mul, &[twice, normal.id]);
            part.id = self.op(Op::Sub, &[part.id, by]);
        }
        Ok(assembled(form, &result))
    }

    /// `rgb(r, g, b)`: a colour from linear numbers.
    pub(crate) fn rgb(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        match self.vector(3, call)? {
            Value::Vector(vector) => {
                let parts = vector.parts();
                Ok(Value::Color([parts[0].id, parts[1].id, parts[2].id]))
            }
            other => Ok(other),
        }
    }

    /// `hsv(hue, saturation, value)`: a colour of the screen by its hue, an angle or a share of a turn.
    pub(crate) fn hsv(&mut self, call: Invocation<'a>) -> Outcome<'a> {
        if self.wrong_count(&call, 3..=3) {
            return Ok(Value::Poison);
        }
        let Some((Form::Scalar, all)) = self.common_form(&call) else {
            return Ok(Value::Poison);
        };
        let (mut hue, saturation, value) = (all[0][0], all[1][0].id, all[2][0].id);
        if hue.quantity == Quantity::Angle {
            let turn = self.graph.constant(std::f64::consts::TAU);
            hue.id = self.op(Op::Div, &[hue.id, turn]);
        }
        // Each channel is a trapezium of the hue, a third of a turn apart.
        let channels = [0.0, 2.0 / 3.0, 1.0 / 3.0].map(|shift| {
            let mut c = |v: f64| self.graph.constant(v);
            let (shift, one, three, six, zero) = (c(shift), c(1.0), c(3.0), c(6.0), c(0.0));
            let turned = self.op(Op::Add, &[hue.id, shift]);
            let share = self.op(Op::Fract, &[turned]);
            let scaled = self.op(Op::Mul, &[share, six]);
            let off = self.op(Op::Sub, &[scaled, three]);
            let wide = self.op(Op::Abs, &[off]);
            let raised = self.op(Op::Sub, &[wide, one]);
            let pure = self.op(Op::Clamp, &[raised, zero, one]);
            let mixed = self.op(Op::Mix, &[one, pure, saturation]);
            let screen = self.op(Op::Mul, &[value, mixed]);
            self.decoded(screen)
        });
        Ok(Value::Color(channels))
    }

    /// The light of an sRGB value.
    fn decoded(&mut self, screen: ExprId) -> ExprId {
        if let Some(value) = self.graph.as_constant(screen) {
            return self.graph.constant(super::numbers::linear(value));
        }
        let mut c = |v: f64| self.graph.constant(v);
        let (edge, slope, shift, scale, gamma) = (c(0.04045), c(12.92), c(0.055), c(1.055), c(2.4));
        let low = self.op(Op::Div, &[screen, slope]);
        let shifted = self.op(Op::Add, &[screen, shift]);
        let scaled = self.op(Op::Div, &[shifted, scale]);
        let high = self.op(Op::Pow, &[scaled, gamma]);
        let is_low = self.op(Op::Less, &[screen, edge]);
        self.op(Op::Select, &[is_low, low, high])
    }
}
