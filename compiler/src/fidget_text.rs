//! `.vm` files: the plain text of Fidget and libfive, with one clause per line: `_name operation
//! operands`.
//!
//! The last clause is the result, negative inside. A file that does not read `var-z` is a 2-D shape. The part of space
//! that is shown follows from the values (`region.rs`).

mod region;
mod write;

use crate::analysis::definedness::outside_where_undefined;
use crate::analysis::param_ranges::ParamRanges;
use crate::elaborate::{NoFiles, Options, elaborate};
use crate::expression::{ExprId, Expressions};
use crate::scene::{Scene, SceneRef, Shape, ShapeId, ShapeKind};
use region::shown_region;
use sdfc_lang::{Diagnostic, FileId, Sources, Span, codes};
use sdfc_vm::table::Op;
use std::collections::HashMap;
pub(crate) use write::fidget_text;

/// Maximum number of clauses of a file.
const MAX_CLAUSES: usize = 200_000;
/// Maximum number of errors reported for one file.
const MAX_ERRORS: usize = 20;

/// Parses the text of Fidget to a scene.
pub fn parse_fidget_text(sources: &Sources, file: FileId) -> (Option<Scene>, Vec<Diagnostic>) {
    // The language defines the default settings of a scene.
    let mut template = Sources::new();
    let sphere = template.add("template", "sphere(1)".to_owned());
    let options = Options {
        overrides: Vec::new(),
        time: 0.0,
        loader: &NoFiles,
    };
    let (Some(mut scene), _) = elaborate(&mut template, sphere, &options) else {
        unreachable!("the template is a scene");
    };
    let text = sources.text(file);
    let mut reader = ClauseReader {
        file,
        expressions: &mut scene.expressions,
        values: HashMap::new(),
        reads_z: false,
        last: None,
        errors: Vec::new(),
    };
    let mut start = 0;
    for (count, line) in text.split_inclusive('\n').enumerate() {
        if reader.errors.len() >= MAX_ERRORS {
            break;
        }
        let span = Span {
            file,
            start: start as u32,
            end: (start + line.trim_end().len()) as u32,
        };
        if count >= MAX_CLAUSES {
            let message = format!("the file has more than the {MAX_CLAUSES} clauses that are read");
            reader
                .errors
                .push(Diagnostic::error(codes::E0505, span, message));
            break;
        }
        reader.line(line, start);
        start += line.len();
    }
    let ClauseReader {
        reads_z,
        last,
        mut errors,
        ..
    } = reader;
    let span = Span {
        file,
        start: 0,
        end: text.len() as u32,
    };
    let Some(value) = last.filter(|_| errors.is_empty()) else {
        if errors.is_empty() {
            errors.push(Diagnostic::error(
                codes::E0505,
                span,
                "the file has no clauses",
            ));
        }
        return (None, errors);
    };
    let ranges = ParamRanges::for_scene(SceneRef::from(&scene));
    let value = outside_where_undefined(&mut scene.expressions, value, &ranges);
    let is_2d = !reads_z;
    let region = shown_region(&scene.expressions, value, is_2d);
    let kind = ShapeKind::Field {
        value,
        slope: None,
        region,
    };
    scene.shapes = vec![Shape {
        kind,
        is_2d,
        name: String::new(),
        span,
    }];
    scene.root = Some(ShapeId(0));
    scene.is_2d = is_2d;
    if is_2d {
        scene.render.size = [1024, 1024];
    }
    (Some(scene), errors)
}

struct ClauseReader<'a> {
    file: FileId,
    expressions: &'a mut Expressions,
    values: HashMap<&'a str, ExprId>,
    reads_z: bool,
    last: Option<ExprId>,
    errors: Vec<Diagnostic>,
}

impl<'a> ClauseReader<'a> {
    fn span(&self, start: usize, line: &str, word: &str) -> Span {
        // Words are slices of their line.
        let start_of_word = start + (word.as_ptr() as usize - line.as_ptr() as usize);
        Span {
            file: self.file,
            start: start_of_word as u32,
            end: (start_of_word + word.len()) as u32,
        }
    }

    fn line(&mut self, line: &'a str, start: usize) {
        let clause = line.split('#').next().unwrap_or("");
        let words: Vec<&'a str> = clause.split_whitespace().collect();
        let [name, operation, operands @ ..] = words.as_slice() else {
            if let [single_word] = words.as_slice() {
                let span = self.span(start, line, single_word);
                let message = "a clause is a name, an operation and its operands";
                self.errors.push(
                    Diagnostic::error(codes::E0505, span, message).primary("nothing follows"),
                );
            }
            return;
        };
        match self.clause(line, start, operation, operands) {
            Ok(value) => {
                self.values.insert(name, value);
                self.last = Some(value);
            }
            Err(error) => self.errors.push(*error),
        }
    }

    fn clause(
        &mut self,
        line: &str,
        start: usize,
        operation: &str,
        operands: &[&'a str],
    ) -> Result<ExprId, Box<Diagnostic>> {
        let word_span = |word: &str| self.span(start, line, word);
        let clause_error = |word: &str, message: String| {
            Box::new(Diagnostic::error(codes::E0505, word_span(word), message))
        };
        let arity = match operation {
            "var-x" | "var-y" | "var-z" => 0,
            "const" => 1,
            _ => match find_operation(operation) {
                Some(op) => op.arity(),
                None => {
                    let similar = OPERATIONS
                        .iter()
                        .map(|(name, _)| *name)
                        .filter(|name| strsim::damerau_levenshtein(name, operation) <= 2)
                        .min_by_key(|name| strsim::damerau_levenshtein(name, operation));
                    let mut error =
                        clause_error(operation, format!("there is no operation `{operation}`"));
                    if let Some(similar) = similar {
                        *error = error.fix(
                            word_span(operation),
                            similar,
                            format!("did you mean `{similar}`?"),
                        );
                    }
                    return Err(error);
                }
            },
        };
        if operands.len() != arity {
            let message = format!(
                "`{operation}` takes {}, and {} given",
                counted(arity, "operand"),
                match operands.len() {
                    1 => "1 is".to_owned(),
                    count => format!("{count} are"),
                }
            );
            return Err(clause_error(operation, message));
        }
        match operation {
            "var-x" => return Ok(self.expressions.coordinate(0)),
            "var-y" => return Ok(self.expressions.coordinate(1)),
            "var-z" => {
                self.reads_z = true;
                return Ok(self.expressions.coordinate(2));
            }
            "const" => {
                let value = operands[0].parse::<f64>().ok().filter(|v| v.is_finite());
                let value = value.filter(|v| v.abs() <= f64::from(f32::MAX));
                return match value {
                    Some(value) => Ok(self.expressions.constant(value)),
                    None => {
                        let message = format!("`{}` is not a finite number", operands[0]);
                        Err(clause_error(operands[0], message))
                    }
                };
            }
            _ => {}
        }
        let mut values = Vec::with_capacity(2);
        for operand in operands {
            match self.values.get(operand) {
                Some(&value) => values.push(value),
                None => {
                    let message = format!("no clause before this one is called `{operand}`");
                    return Err(clause_error(operand, message));
                }
            }
        }
        let operation = find_operation(operation).expect("looked up above");
        Ok(operation.apply(self.expressions, &values))
    }
}

/// Returns a count with its noun.
fn counted(count: usize, noun: &str) -> String {
    match count {
        1 => format!("1 {noun}"),
        count => format!("{count} {noun}s"),
    }
}

/// Returns 1 where the number is not zero, 0 elsewhere.
fn is_not_zero(expressions: &mut Expressions, value: ExprId) -> ExprId {
    let zero = expressions.constant(0.0);
    let size = expressions.call(Op::Abs, &[value]);
    expressions.call(Op::Less, &[zero, size])
}

/// Meaning of an operation's name.
#[derive(Clone, Copy)]
enum ClauseOp {
    Row(Op),
    Reciprocal,
    /// A power, of a negative base for integer exponents only.
    Power,
    /// The nearest integer, halves away from zero.
    Round,
    /// The signs −1, 0 and 1 of a difference.
    Compare,
    /// The least remainder that is not negative.
    Remainder,
    /// The second operand if both are not zero, else zero.
    And,
    /// The first operand that is not zero, else zero.
    Or,
    /// 1 for zero, else 0.
    Not,
}

impl ClauseOp {
    /// Adds the operation to a graph.
    fn apply(self, e: &mut Expressions, values: &[ExprId]) -> ExprId {
        match self {
            Self::Row(op) => e.call_where_defined(op, values),
            Self::Power => {
                let Some(exponent) = e.product_exponent(values[1]) else {
                    return e.power(values[0], values[1]);
                };
                let one = e.constant(1.0);
                let multiplied = |product, _| e.call(Op::Mul, &[product, values[0]]);
                let product = (0..exponent.unsigned_abs()).fold(one, multiplied);
                match exponent < 0 {
                    true => e.call_where_defined(Op::Div, &[one, product]),
                    false => product,
                }
            }
            Self::Round => {
                let zero = e.constant(0.0);
                let half = e.constant(0.5);
                let size = e.call(Op::Abs, &[values[0]]);
                let raised = e.call(Op::Add, &[size, half]);
                let rounded = e.call(Op::Floor, &[raised]);
                let negated = e.call(Op::Neg, &[rounded]);
                let is_negative = e.call(Op::Less, &[values[0], zero]);
                e.call(Op::Select, &[is_negative, negated, rounded])
            }
            Self::Reciprocal => {
                let one = e.constant(1.0);
                e.call_where_defined(Op::Div, &[one, values[0]])
            }
            Self::Compare => {
                let less = e.call(Op::Less, &[values[0], values[1]]);
                let more = e.call(Op::Less, &[values[1], values[0]]);
                e.call(Op::Sub, &[more, less])
            }
            Self::Remainder => {
                let divisor = e.call(Op::Abs, &[values[1]]);
                e.call_where_defined(Op::Modulo, &[values[0], divisor])
            }
            Self::And => {
                let is_true = is_not_zero(e, values[0]);
                let zero = e.constant(0.0);
                e.call(Op::Select, &[is_true, values[1], zero])
            }
            Self::Or => {
                let is_true = is_not_zero(e, values[0]);
                e.call(Op::Select, &[is_true, values[0], values[1]])
            }
            Self::Not => {
                let is_true = is_not_zero(e, values[0]);
                e.call(Op::Not, &[is_true])
            }
        }
    }

    fn arity(self) -> usize {
        match self {
            ClauseOp::Row(op) => op.row().arity(),
            ClauseOp::Reciprocal | ClauseOp::Round | ClauseOp::Not => 1,
            ClauseOp::Power
            | ClauseOp::Compare
            | ClauseOp::Remainder
            | ClauseOp::And
            | ClauseOp::Or => 2,
        }
    }
}

fn find_operation(operation: &str) -> Option<ClauseOp> {
    OPERATIONS
        .iter()
        .find(|(name, _)| *name == operation)
        .map(|&(_, op)| op)
}

/// `min` and `max` are set operations here, which programs fuse.
const OPERATIONS: [(&str, ClauseOp); 30] = [
    ("add", ClauseOp::Row(Op::Add)),
    ("sub", ClauseOp::Row(Op::Sub)),
    ("mul", ClauseOp::Row(Op::Mul)),
    ("div", ClauseOp::Row(Op::Div)),
    ("min", ClauseOp::Row(Op::Union)),
    ("max", ClauseOp::Row(Op::Intersection)),
    ("neg", ClauseOp::Row(Op::Neg)),
    ("abs", ClauseOp::Row(Op::Abs)),
    ("sqrt", ClauseOp::Row(Op::Sqrt)),
    ("square", ClauseOp::Row(Op::Square)),
    ("recip", ClauseOp::Reciprocal),
    ("sin", ClauseOp::Row(Op::Sin)),
    ("cos", ClauseOp::Row(Op::Cos)),
    ("tan", ClauseOp::Row(Op::Tan)),
    ("asin", ClauseOp::Row(Op::Asin)),
    ("acos", ClauseOp::Row(Op::Acos)),
    ("atan", ClauseOp::Row(Op::Atan)),
    ("atan2", ClauseOp::Row(Op::Atan2)),
    ("exp", ClauseOp::Row(Op::Exp)),
    ("ln", ClauseOp::Row(Op::Ln)),
    ("log", ClauseOp::Row(Op::Ln)),
    ("pow", ClauseOp::Power),
    ("mod", ClauseOp::Remainder),
    ("floor", ClauseOp::Row(Op::Floor)),
    ("ceil", ClauseOp::Row(Op::Ceil)),
    ("round", ClauseOp::Round),
    ("compare", ClauseOp::Compare),
    ("and", ClauseOp::And),
    ("or", ClauseOp::Or),
    ("not", ClauseOp::Not),
];

#[cfg(test)]
mod tests {
    use super::region::field;
    use super::*;
    use sdfc_vm::bounds::Bounds;

    /// Returns the value of the last clause of a text at a point.
    fn value(text: &str, point: [f64; 3]) -> f64 {
        let mut sources = Sources::new();
        let file = sources.add("part.vm", text);
        let (scene, diagnostics) = parse_fidget_text(&sources, file);
        let scene = scene.unwrap_or_else(|| panic!("{text}: {diagnostics:?}"));
        let ShapeKind::Field { value, .. } = scene.shapes[0].kind else {
            panic!("{text}: no field");
        };
        let (min, max) = (point, point);
        let range = field(&scene.expressions, value).eval(&Bounds { min, max }, &[]);
        (range.lo + range.hi) / 2.0
    }

    /// Returns the region in which a text is shown.
    fn region(text: &str) -> Bounds {
        let mut sources = Sources::new();
        let file = sources.add("part.vm", text);
        let (scene, diagnostics) = parse_fidget_text(&sources, file);
        let scene = scene.unwrap_or_else(|| panic!("{text}: {diagnostics:?}"));
        let ShapeKind::Field { region, .. } = scene.shapes[0].kind else {
            panic!("{text}: no field");
        };
        region
    }

    #[test]
    fn regions_contain_what_is_finite() {
        let squares = "x var-x\ny var-y\nz var-z\na square x\nb square y\nc square z\n";
        let disc = |r: f64| format!("{squares}p add a b\nq sqrt p\nr const {r}\nd sub q r\n");
        let ball = |r: f64, at: f64| {
            format!(
                "{squares}t const {at}\nm sub x t\nn square m\no add n b\np add o c\nq sqrt p\nr const {r}\nd sub q r\n"
            )
        };
        for (text, min, max) in [
            (ball(0.5, 0.0), [-1.0; 3], [1.0; 3]),
            (ball(3.0, 0.0), [-3.0; 3], [3.0; 3]),
            (ball(0.5, 300.0), [299.5, -0.5, -0.5], [300.5, 0.5, 0.5]),
            (ball(50.0, -20.0), [-70.0, -50.0, -50.0], [30.0, 50.0, 50.0]),
            // Infinite along z.
            (disc(3.0), [-3.0; 3], [3.0; 3]),
        ] {
            let bounds = region(&text);
            for axis in 0..3 {
                let [low, high] = [bounds.min[axis], bounds.max[axis]];
                let slack = 0.1 * (max[axis] - min[axis]);
                assert!((low - min[axis]).abs() <= slack, "{text}: {bounds:?}");
                assert!((high - max[axis]).abs() <= slack, "{text}: {bounds:?}");
                assert!(low <= min[axis] && max[axis] <= high, "{text}: {bounds:?}");
            }
        }
        let plane =
            region("x var-x\ny var-y\na square x\nb square y\nc add a b\nd const 9\ne sub c d\n");
        assert!(plane.min[2] == f64::NEG_INFINITY && plane.max[0] < 3.3);
    }

    /// Truth is "not zero", and remainders are never negative.
    #[test]
    fn operations_have_the_values_that_fidget_defines() {
        for (operation, x, y, expected) in [
            ("and", 2.0, -1.5, -1.5),
            ("and", -0.5, 3.0, 3.0),
            ("and", 0.0, 3.0, 0.0),
            ("and", 3.0, 0.0, 0.0),
            ("or", 2.0, -1.5, 2.0),
            ("or", -0.5, 3.0, -0.5),
            ("or", 0.0, 3.0, 3.0),
            ("mod", 0.5, -0.7, 0.5),
            ("mod", -0.5, -0.7, 0.2),
            ("mod", -0.5, 0.7, 0.2),
            ("mod", 5.5, 2.0, 1.5),
            ("compare", 1.0, 2.0, -1.0),
            ("compare", 2.0, 2.0, 0.0),
            ("compare", 3.0, 2.0, 1.0),
            ("atan2", 1.0, -1.0, 2.356_194_490_192_345),
            ("pow", 2.0, 3.0, 8.0),
        ] {
            let text = format!("_0 var-x\n_1 var-y\n_2 {operation} _0 _1\n");
            let result = value(&text, [x, y, 0.0]);
            assert!(
                (result - expected).abs() < 1e-12,
                "{operation} {x} {y}: {result}"
            );
        }
        for (exponent, x, expected) in [
            (2, -0.5, 0.25),
            (3, -2.0, -8.0),
            (-1, -4.0, -0.25),
            (0, -4.0, 1.0),
            (20, -1.5, 1.5_f64.powi(20)),
            (17, -1.5, -1.5_f64.powi(17)),
            (-18, -1.5, 1.5_f64.powi(-18)),
        ] {
            let text = format!("_0 var-x\n_1 const {exponent}\n_2 pow _0 _1\n");
            let result = value(&text, [x, 0.0, 0.0]);
            let error = (result - expected).abs() / expected.abs();
            assert!(error < 1e-12, "{x} to the {exponent}: {result}");
        }
        for (operation, x, expected) in [
            ("not", 0.0, 1.0),
            ("not", 0.3, 0.0),
            ("not", -2.0, 0.0),
            ("recip", 4.0, 0.25),
            ("round", 1.4, 1.0),
            ("round", -1.6, -2.0),
            ("round", -2.5, -3.0),
            ("round", 2.5, 3.0),
            ("ceil", -1.6, -1.0),
            ("floor", -1.6, -2.0),
        ] {
            let text = format!("_0 var-x\n_1 {operation} _0\n");
            let result = value(&text, [x, 0.0, 0.0]);
            assert!(
                (result - expected).abs() < 1e-12,
                "{operation} {x}: {result}"
            );
        }
    }

    #[test]
    fn points_without_a_value_are_outside() {
        for (clauses, x, expected) in [
            ("a sqrt x", 4.0, 2.0),
            ("a sqrt x", -4.0, 1e9),
            ("b const -4\na sqrt b", 0.0, 1e9),
            ("b const -4\nc ln b\na sub x c", 0.0, 1e9),
            ("b const 0\na div b b", 0.0, 1e9),
            ("b const 0\na mod x b", 1.0, 1e9),
            ("b const 0.5\na pow x b", -1.0, 1e9),
            ("b const 2\na asin b", 0.0, 1e9),
            ("b asin x\nc neg b\na min x c", 1.5, 1e9),
            // A disjunction that its first operand decides.
            ("b sqrt x\nc const 3\na or c b", -1.0, 3.0),
            ("b sqrt x\nc const 0\na or c b", -1.0, 1e9),
        ] {
            let text = format!("x var-x\n{clauses}\nr add a a\nh const 0.5\nd mul r h\n");
            let result = value(&text, [x, 0.0, 0.0]);
            assert!((result / expected - 1.0).abs() < 1e-12, "{text}: {result}");
        }
    }
}
