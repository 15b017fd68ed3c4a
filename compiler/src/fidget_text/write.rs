//! Scene → the text of Fidget: the field of a scene as clauses.
//!
//! Operations that the text does not have are expanded to those of their bodies. Live parameters are constants with
//! their current values. Materials, lights and cameras have no place in the text.

use super::clauses::MAX_CLAUSES;
use crate::analysis::bounds::UniformValues;
use crate::formula::{Formula, FormulaNumber};
use crate::scene::{Scene, ShapeId};
use crate::symbolic::Symbolic;
use sdfc_vm::apply::{OpResult, apply_numbers};
use sdfc_vm::real::{Real, lit};
use sdfc_vm::table::Op;
use sdfc_vm::vector::{V2, V3};
use std::cell::RefCell;
use std::collections::HashMap;
use std::f64::consts::LN_2;
use std::fmt::Write;
use std::ops::{Add, Div, Mul, Neg, Sub};

/// Error about random numbers, which the text has no operations for.
const RANDOM_ERROR: &str = "a `.vm` file has no noise and no random numbers";

/// Returns a shape of a scene as clauses, the last of which is the field.
///
/// # Errors
///
/// Returns the reason for which the shape has no clauses.
pub(crate) fn fidget_text(scene: &Scene, root: ShapeId, time: f64) -> Result<String, String> {
    let mut formula = Formula::default();
    formula.read_shape(&scene.expressions, &scene.shapes, root);
    let mut uniform_values = UniformValues::default();
    let uniforms = scene.expressions.since(0).map(|(id, ..)| {
        let value = uniform_values.value(&scene.expressions, &scene.params, time, id);
        (id.index(), value)
    });
    let writer = ClauseWriter {
        uniforms: uniforms.collect(),
        ..ClauseWriter::default()
    };
    WRITER.replace(writer);
    // The third coordinate is the first clause, so that the result is the last one.
    let [z, x, y] = [2, 0, 1].map(|axis| add(WrittenClause::Coordinate(axis)));
    let result = formula.shape::<ClauseNumber>(&scene.shapes, root, V3::new(x, y, z));
    let writer = WRITER.take();
    let result = result?;
    match writer.error {
        Some(error) => Err(error.to_owned()),
        None if scene.shapes[root.0 as usize].is_2d => writer.text(&[result]),
        // A file without the third coordinate is a 2-D shape.
        None => writer.text(&[z, result]),
    }
}

thread_local! {
    static WRITER: RefCell<ClauseWriter> = RefCell::default();
}

/// Line of the text: a number, or an operation on earlier lines.
#[derive(Clone, Copy, Debug)]
enum WrittenClause {
    Constant(f64),
    Coordinate(u8),
    Unary(&'static str, ClauseNumber),
    Binary(&'static str, ClauseNumber, ClauseNumber),
}

impl WrittenClause {
    fn operands(&self) -> [Option<ClauseNumber>; 2] {
        match *self {
            Self::Constant(_) | Self::Coordinate(_) => [None; 2],
            Self::Unary(_, a) => [Some(a), None],
            Self::Binary(_, a, b) => [Some(a), Some(b)],
        }
    }

    /// Returns a key that equal clauses share.
    fn key(&self) -> (&'static str, u64, u64) {
        match *self {
            Self::Constant(value) => ("const", value.to_bits(), 0),
            Self::Coordinate(axis) => ("var", u64::from(axis), 0),
            Self::Unary(name, a) => (name, u64::from(a.0), 0),
            Self::Binary(name, a, b) => (name, u64::from(a.0), u64::from(b.0)),
        }
    }
}

/// Clauses in order, each once.
#[derive(Default)]
struct ClauseWriter {
    clauses: Vec<WrittenClause>,
    numbers: HashMap<(&'static str, u64, u64), ClauseNumber>,
    /// Values of the numbers that are the same at all points.
    uniforms: HashMap<usize, f64>,
    error: Option<&'static str>,
}

impl ClauseWriter {
    fn constant(&self, number: ClauseNumber) -> Option<f64> {
        match self.clauses[number.0 as usize] {
            WrittenClause::Constant(value) => Some(value),
            _ => None,
        }
    }

    /// Returns the number of a clause: an equal one, an operand that it leaves as it is, or a new one.
    fn add(&mut self, clause: WrittenClause) -> ClauseNumber {
        let clause = match clause {
            WrittenClause::Unary(name, a) => match self.constant(a) {
                Some(a) => WrittenClause::Constant(unary_value(name, a)),
                None => clause,
            },
            WrittenClause::Binary(name, a, b) => match (name, self.constant(a), self.constant(b)) {
                (_, Some(a), Some(b)) => WrittenClause::Constant(binary_value(name, a, b)),
                ("add", Some(0.0), _) | ("mul", Some(1.0), _) | ("mul", _, Some(0.0)) => return b,
                ("add" | "sub", _, Some(0.0)) | ("mul" | "div", _, Some(1.0)) => return a,
                ("mul", Some(0.0), _) => return a,
                ("sub", Some(0.0), _) => WrittenClause::Unary("neg", b),
                ("mul", ..) if a == b => WrittenClause::Unary("square", a),
                _ => clause,
            },
            WrittenClause::Constant(_) | WrittenClause::Coordinate(_) => clause,
        };
        let next = ClauseNumber(self.clauses.len() as u32);
        let number = *self.numbers.entry(clause.key()).or_insert(next);
        if number == next {
            self.clauses.push(clause);
        }
        number
    }

    /// Returns the text of the clauses that these numbers need. The last of them is the result.
    fn text(&self, numbers: &[ClauseNumber]) -> Result<String, String> {
        let mut is_needed = vec![false; self.clauses.len()];
        for number in numbers {
            is_needed[number.0 as usize] = true;
        }
        for (index, clause) in self.clauses.iter().enumerate().rev() {
            if is_needed[index] {
                for operand in clause.operands().into_iter().flatten() {
                    is_needed[operand.0 as usize] = true;
                }
            }
        }
        let count = is_needed.iter().filter(|needed| **needed).count();
        if count > MAX_CLAUSES {
            return Err(format!(
                "it takes {count} clauses, and at most {MAX_CLAUSES} are read"
            ));
        }
        let has_value = |clause: &WrittenClause| !matches!(clause, WrittenClause::Constant(v) if !v.is_finite());
        let mut needed = self
            .clauses
            .iter()
            .zip(&is_needed)
            .filter(|(_, needed)| **needed);
        if !needed.all(|(clause, _)| has_value(clause)) {
            return Err("a constant of it is infinite or no number".to_owned());
        }
        let mut text = String::from("# Generated by sdfc. The last clause is negative inside.\n");
        let mut names = vec![0; self.clauses.len()];
        let needed = (0..self.clauses.len()).filter(|&index| is_needed[index]);
        for (name, index) in needed.enumerate() {
            names[index] = name;
            let operand = |number: ClauseNumber| names[number.0 as usize];
            let _ = match self.clauses[index] {
                WrittenClause::Constant(value) => writeln!(text, "_{name} const {value:?}"),
                WrittenClause::Coordinate(axis) => {
                    writeln!(text, "_{name} var-{}", ["x", "y", "z"][usize::from(axis)])
                }
                WrittenClause::Unary(operation, a) => {
                    writeln!(text, "_{name} {operation} _{}", operand(a))
                }
                WrittenClause::Binary(operation, a, b) => {
                    writeln!(text, "_{name} {operation} _{} _{}", operand(a), operand(b))
                }
            };
        }
        Ok(text)
    }
}

/// Returns the value of an operation on a constant.
fn unary_value(operation: &str, a: f64) -> f64 {
    match operation {
        "neg" => -a,
        "abs" => a.abs(),
        "square" => a * a,
        "sqrt" => a.sqrt(),
        "floor" => a.floor(),
        "sin" => a.sin(),
        "cos" => a.cos(),
        "exp" => a.exp(),
        "ln" => a.ln(),
        "not" => f64::from(u8::from(a == 0.0)),
        _ => unreachable!("`{operation}` is not written"),
    }
}

/// Returns the value of an operation on two constants.
fn binary_value(operation: &str, a: f64, b: f64) -> f64 {
    match operation {
        "add" => a + b,
        "sub" => a - b,
        "mul" => a * b,
        "div" => a / b,
        "min" => a.min(b),
        "max" => a.max(b),
        "atan2" => a.atan2(b),
        "compare" => a
            .partial_cmp(&b)
            .map_or(f64::NAN, |order| f64::from(order as i8)),
        "and" if a == 0.0 => a,
        "and" => b,
        "or" if a == 0.0 => b,
        "or" => a,
        _ => unreachable!("`{operation}` is not written"),
    }
}

fn add(clause: WrittenClause) -> ClauseNumber {
    WRITER.with_borrow_mut(|writer| writer.add(clause))
}

/// Number that is written as a clause.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct ClauseNumber(u32);

impl ClauseNumber {
    fn unary(self, operation: &'static str) -> Self {
        add(WrittenClause::Unary(operation, self))
    }
    fn binary(self, operation: &'static str, other: Self) -> Self {
        add(WrittenClause::Binary(operation, self, other))
    }
    /// Reports random numbers, which have no clauses.
    fn random() -> Self {
        WRITER.with_borrow_mut(|writer| writer.error = Some(RANDOM_ERROR));
        lit(0.0)
    }
}

macro_rules! operators {
    ($($trait:ident $method:ident $operation:literal)*) => {$(
        impl $trait for ClauseNumber {
            type Output = Self;
            fn $method(self, other: Self) -> Self {
                self.binary($operation, other)
            }
        }
    )*};
}
operators! { Add add "add" Sub sub "sub" Mul mul "mul" Div div "div" }

impl Neg for ClauseNumber {
    type Output = Self;
    fn neg(self) -> Self {
        self.unary("neg")
    }
}

/// Conditions are the numbers 1 and 0.
impl Real for ClauseNumber {
    type Bool = Self;
    type Vec2 = V2<Self>;
    type Vec3 = V3<Self>;

    fn constant(value: f64) -> Self {
        let limit = f64::from(f32::MAX);
        add(WrittenClause::Constant(value.clamp(-limit, limit)))
    }
    fn abs(self) -> Self {
        self.unary("abs")
    }
    fn sqrt(self) -> Self {
        self.unary("sqrt")
    }
    fn floor(self) -> Self {
        self.unary("floor")
    }
    fn min(self, other: Self) -> Self {
        self.binary("min", other)
    }
    fn max(self, other: Self) -> Self {
        self.binary("max", other)
    }
    fn sin(self) -> Self {
        self.unary("sin")
    }
    fn cos(self) -> Self {
        self.unary("cos")
    }
    fn atan2(self, x: Self) -> Self {
        self.binary("atan2", x)
    }
    fn exp(self) -> Self {
        self.unary("exp")
    }
    fn ln(self) -> Self {
        self.unary("ln")
    }
    fn exp2(self) -> Self {
        (self * lit(LN_2)).exp()
    }
    fn log2(self) -> Self {
        self.ln() * lit(1.0 / LN_2)
    }
    fn power_of_two(self) -> Self {
        self.exp2()
    }
    fn exponent(self) -> Self {
        self.log2().floor()
    }
    fn mantissa(self) -> Self {
        self / self.exponent().exp2()
    }
    fn square(self) -> Self {
        self.unary("square")
    }
    fn lattice(_cell: V3<Self>, _seed: Self) -> V3<Self> {
        let number = Self::random();
        V3::new(number, number, number)
    }
    fn noise_corner_gradient(_cell: V3<Self>, _seed: Self) -> V3<Self> {
        let number = Self::random();
        V3::new(number, number, number)
    }
    fn less(self, other: Self) -> Self {
        other.binary("compare", self).max(lit(0.0))
    }
    fn and(a: Self, b: Self) -> Self {
        a.binary("and", b)
    }
    fn or(a: Self, b: Self) -> Self {
        a.binary("or", b)
    }
    fn not(a: Self) -> Self {
        a.unary("not")
    }
    fn select(condition: Self, then: Self, otherwise: Self) -> Self {
        let first = condition.binary("and", then);
        first.binary("or", condition.unary("not").binary("and", otherwise))
    }
}

/// An operation is expanded to its body.
impl FormulaNumber for ClauseNumber {
    fn from_number(number: Symbolic) -> Self {
        let value = WRITER.with_borrow(|writer| writer.uniforms.get(&number.0.index()).copied());
        lit(value.unwrap_or(f64::NAN))
    }
    fn row(
        op: Op,
        p: V3<Self>,
        values: &[Self],
        parameters: &[Self],
    ) -> Result<Self, &'static str> {
        let mut operands = [lit(0.0); 3];
        operands[..values.len()].copy_from_slice(values);
        match apply_numbers(op, p, operands, parameters) {
            OpResult::Value(value) => Ok(value),
            OpResult::Point(_) => unreachable!("`{}` gives a point", op.row().name),
        }
    }
}
