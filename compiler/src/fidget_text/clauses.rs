//! Clauses: the lines of a `.vm` file, as numbers of a scene.

use super::truth::{TruthReader, larger};
use crate::elaborate::nearest;
use crate::expression::{ExprId, Expressions};
use rustc_hash::FxHashMap;
use sdfc_lang::{Diagnostic, FileId, Sources, Span, codes};
use sdfc_vm::table::Op;

/// Maximum number of clauses of a file.
pub(super) const MAX_CLAUSES: usize = 200_000;
/// Maximum number of errors reported for one file.
const MAX_ERRORS: usize = 20;

/// The field of a file.
pub(crate) struct FidgetField {
    /// The value of the last clause, which may be undefined somewhere.
    pub(crate) value: ExprId,
    /// The last clause.
    pub(crate) span: Span,
    /// Set if no clause reads `var-z`.
    pub(crate) is_2d: bool,
}

/// Adds the clauses of a file to a graph.
///
/// # Errors
///
/// Returns the errors of the text.
pub(crate) fn read_clauses(
    sources: &Sources,
    file: FileId,
    expressions: &mut Expressions,
) -> Result<FidgetField, Vec<Diagnostic>> {
    let text = sources.text(file);
    let mut reader = ClauseReader {
        file,
        expressions,
        values: FxHashMap::default(),
        truths: TruthReader::default(),
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
    if !errors.is_empty() {
        return Err(errors);
    }
    match last {
        Some((value, span)) => Ok(FidgetField {
            value,
            span,
            is_2d: !reads_z,
        }),
        None => {
            let span = Span::new(file, 0, text.len() as u32);
            let message = "the file has no clauses";
            errors.push(Diagnostic::error(codes::E0505, span, message));
            Err(errors)
        }
    }
}

struct ClauseReader<'a> {
    file: FileId,
    expressions: &'a mut Expressions,
    values: FxHashMap<&'a str, ExprId>,
    truths: TruthReader,
    reads_z: bool,
    last: Option<(ExprId, Span)>,
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
        // Some editors put a mark of the byte order before the text.
        let clause = line.trim_start_matches('\u{feff}');
        let clause = clause.split('#').next().unwrap_or("");
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
                let end = start + line.trim_end().len();
                self.last = Some((value, Span::new(self.file, start as u32, end as u32)));
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
                    let similar = nearest(operation, OPERATIONS.iter().map(|(name, _)| *name));
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
            let takes = ["no operands", "1 operand", "2 operands"][arity];
            let message = format!("`{operation}` takes {takes}, not {}", operands.len());
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
        Ok(operation.apply(self.expressions, &mut self.truths, &values))
    }
}

/// Meaning of an operation's name.
#[derive(Clone, Copy)]
enum ClauseOp {
    Row(Op),
    Reciprocal,
    /// A power, of a negative base for integer exponents only.
    Power,
    /// The signs −1, 0 and 1 of a difference.
    Compare,
    /// The least remainder that is not negative.
    Remainder,
    /// The maximum.
    Larger,
    /// The second operand if both are not zero, else zero.
    And,
    /// The first operand that is not zero, else zero.
    Or,
    /// 1 for zero, else 0.
    Not,
}

impl ClauseOp {
    /// Adds the operation to a graph.
    fn apply(self, e: &mut Expressions, truths: &mut TruthReader, values: &[ExprId]) -> ExprId {
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
            Self::And => truths.and(e, values[0], values[1]),
            Self::Or => truths.or(e, values[0], values[1]),
            Self::Not => truths.not(e, values[0]),
            Self::Larger => larger(e, values[0], values[1]),
        }
    }

    fn arity(self) -> usize {
        match self {
            ClauseOp::Row(op) => op.row().arity(),
            ClauseOp::Reciprocal | ClauseOp::Not => 1,
            ClauseOp::Power
            | ClauseOp::Compare
            | ClauseOp::Remainder
            | ClauseOp::Larger
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
    ("max", ClauseOp::Larger),
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
    ("round", ClauseOp::Row(Op::Round)),
    ("compare", ClauseOp::Compare),
    ("and", ClauseOp::And),
    ("or", ClauseOp::Or),
    ("not", ClauseOp::Not),
];
