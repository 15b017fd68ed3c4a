//! `.vm` files: the plain text of Fidget and libfive, with one clause per line: `_name operation
//! operands`.
//!
//! The last clause is the result, negative inside. It fills the square or cube from −1 to 1, or a
//! larger one where it does not fit. A file that does not read `var-z` is a 2-D shape.

use crate::elaborate::{NoFiles, Options, elaborate};
use crate::expression::{ExprId, Expressions};
use crate::scene::{Scene, Shape, ShapeId, ShapeKind};
use sdfc_lang::{Diagnostic, FileId, Sources, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// Maximum number of clauses of a file.
const MAX_CLAUSES: usize = 200_000;
/// Maximum number of operations for one size of the cube; longer files are sampled at fewer points.
const MAX_SAMPLING_OPERATIONS: usize = 10_000_000;
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
    let is_2d = !reads_z;
    let side = cube_half_side(&scene.expressions, value, is_2d);
    let region = Bounds::centred([side, side, if is_2d { f64::INFINITY } else { side }]);
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

/// Returns half the side of the displayed square or cube, at most 16. It is 1, doubled until the shape does
/// not extend beyond it at any sample point.
fn cube_half_side(expressions: &Expressions, value: ExprId, is_2d: bool) -> f64 {
    let max_faces_points = MAX_SAMPLING_OPERATIONS / (6 * expressions.len().max(1));
    let points = max_faces_points.isqrt().clamp(8, 24);
    let extends_beyond = |side: f64| {
        let coordinate = |i: usize| side * (2.0 * i as f64 / (points - 1) as f64 - 1.0);
        let levels = if is_2d { 1 } else { points };
        (0..points).any(|i| {
            (0..levels).any(|j| {
                let (a, b) = (coordinate(i), if is_2d { 0.0 } else { coordinate(j) });
                [side, -side].into_iter().any(|s| {
                    let faces = [[s, a, b], [a, s, b], [a, b, s]];
                    let faces = if is_2d { &faces[..2] } else { &faces };
                    faces
                        .iter()
                        .any(|p| crate::analysis::bounds::value_at(expressions, value, *p) < 0.0)
                })
            })
        })
    };
    // An infinite shape extends beyond every cube, and the first one is used.
    let sides = [1.0, 2.0, 4.0, 8.0, 16.0];
    sides
        .into_iter()
        .find(|&side| !extends_beyond(side))
        .unwrap_or(1.0)
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
                "`{operation}` takes {arity} operands, and {} are given",
                operands.len()
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
        let e = &mut *self.expressions;
        Ok(match find_operation(operation).expect("looked up above") {
            ClauseOp::Row(op) => e.call(op, &values),
            ClauseOp::Reciprocal => {
                let one = e.constant(1.0);
                e.call(Op::Div, &[one, values[0]])
            }
            ClauseOp::Compare => {
                let less = e.call(Op::Less, &[values[0], values[1]]);
                let more = e.call(Op::Less, &[values[1], values[0]]);
                e.call(Op::Sub, &[more, less])
            }
        })
    }
}

/// Meaning of an operation's name.
#[derive(Clone, Copy)]
enum ClauseOp {
    Row(Op),
    Reciprocal,
    Compare,
}

impl ClauseOp {
    fn arity(self) -> usize {
        match self {
            ClauseOp::Row(op) => op.row().arity(),
            ClauseOp::Reciprocal => 1,
            ClauseOp::Compare => 2,
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
    ("pow", ClauseOp::Row(Op::Pow)),
    ("mod", ClauseOp::Row(Op::Modulo)),
    ("floor", ClauseOp::Row(Op::Floor)),
    ("ceil", ClauseOp::Row(Op::Ceil)),
    ("round", ClauseOp::Row(Op::Round)),
    ("compare", ClauseOp::Compare),
    ("and", ClauseOp::Row(Op::And)),
    ("or", ClauseOp::Row(Op::Or)),
    ("not", ClauseOp::Row(Op::Not)),
];
