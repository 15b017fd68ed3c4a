//! `.vm` files: the plain text of Fidget and libfive, a clause a line, `_name operation operands`.
//!
//! The last clause is the result, negative inside, over the square or cube from −1 to 1,
//! or a larger one where it does not fit. A file that does not read `var-z` is a figure in the plane.

use crate::elaborate::{NoFiles, Options, elaborate};
use crate::expression::{ExprId, Expressions};
use crate::scene::{Scene, Shape, ShapeId, ShapeKind};
use sdfc_lang::{Diagnostic, FileId, Sources, Span, codes};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::table::Op;
use std::collections::HashMap;

/// The most clauses of a file.
const MAX_CLAUSES: usize = 200_000;
/// How many operations are spent on one size of the shown cube, in longer files on fewer points of it.
const MAX_LOOKED: usize = 10_000_000;
/// The most mistakes that are told of one file.
const MAX_ERRORS: usize = 20;

/// The scene that clauses mean.
pub fn parse_clauses(sources: &Sources, file: FileId) -> (Option<Scene>, Vec<Diagnostic>) {
    // What a scene without any settings has is for the language to say.
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
    let mut reader = Reader {
        file,
        expressions: &mut scene.expressions,
        known: HashMap::new(),
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
    let Reader {
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
    let plane = !reads_z;
    let side = reach(&scene.expressions, value, plane);
    let region = Bounds::centred([side, side, if plane { f64::INFINITY } else { side }]);
    let kind = ShapeKind::Field {
        value,
        slope: None,
        region,
    };
    scene.shapes = vec![Shape {
        kind,
        plane,
        name: String::new(),
        span,
    }];
    scene.root = Some(ShapeId(0));
    scene.plane = plane;
    if plane {
        scene.render.size = [1024, 1024];
    }
    (Some(scene), errors)
}

/// Half the side of the square or cube that is shown: 1, or as many doublings of it as it takes until
/// the shape does not stick out of it at any of the points looked at; 16 at most.
fn reach(expressions: &Expressions, value: ExprId, plane: bool) -> f64 {
    let longest = MAX_LOOKED / (6 * expressions.len().max(1));
    let points = longest.isqrt().clamp(8, 24);
    let sticks_out = |side: f64| {
        let at = |i: usize| side * (2.0 * i as f64 / (points - 1) as f64 - 1.0);
        let levels = if plane { 1 } else { points };
        (0..points).any(|i| {
            (0..levels).any(|j| {
                let (a, b) = (at(i), if plane { 0.0 } else { at(j) });
                [side, -side].into_iter().any(|s| {
                    let faces = [[s, a, b], [a, s, b], [a, b, s]];
                    let faces = if plane { &faces[..2] } else { &faces };
                    faces
                        .iter()
                        .any(|p| crate::bounds::value_at(expressions, value, *p) < 0.0)
                })
            })
        })
    };
    // An endless shape sticks out of every cube and is shown in the first.
    let sides = [1.0, 2.0, 4.0, 8.0, 16.0];
    sides
        .into_iter()
        .find(|&side| !sticks_out(side))
        .unwrap_or(1.0)
}

struct Reader<'a> {
    file: FileId,
    expressions: &'a mut Expressions,
    known: HashMap<&'a str, ExprId>,
    reads_z: bool,
    last: Option<ExprId>,
    errors: Vec<Diagnostic>,
}

impl<'a> Reader<'a> {
    fn span(&self, start: usize, line: &str, word: &str) -> Span {
        // Words are slices of their line.
        let at = start + (word.as_ptr() as usize - line.as_ptr() as usize);
        Span {
            file: self.file,
            start: at as u32,
            end: (at + word.len()) as u32,
        }
    }

    fn line(&mut self, line: &'a str, start: usize) {
        let clause = line.split('#').next().unwrap_or("");
        let words: Vec<&'a str> = clause.split_whitespace().collect();
        let [name, operation, operands @ ..] = words.as_slice() else {
            if let [only] = words.as_slice() {
                let span = self.span(start, line, only);
                let message = "a clause is a name, an operation and its operands";
                self.errors.push(
                    Diagnostic::error(codes::E0505, span, message).primary("nothing follows"),
                );
            }
            return;
        };
        match self.clause(line, start, operation, operands) {
            Ok(value) => {
                self.known.insert(name, value);
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
        let at = |word: &str| self.span(start, line, word);
        let wrong = |word: &str, message: String| {
            Box::new(Diagnostic::error(codes::E0505, at(word), message))
        };
        let arity = match operation {
            "var-x" | "var-y" | "var-z" => 0,
            "const" => 1,
            _ => match known(operation) {
                Some(known) => known.arity(),
                None => {
                    let close = OPERATIONS
                        .iter()
                        .map(|(name, _)| *name)
                        .filter(|name| strsim::damerau_levenshtein(name, operation) <= 2)
                        .min_by_key(|name| strsim::damerau_levenshtein(name, operation));
                    let mut error =
                        wrong(operation, format!("there is no operation `{operation}`"));
                    if let Some(close) = close {
                        *error =
                            error.fix(at(operation), close, format!("did you mean `{close}`?"));
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
            return Err(wrong(operation, message));
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
                        Err(wrong(operands[0], message))
                    }
                };
            }
            _ => {}
        }
        let mut values = Vec::with_capacity(2);
        for operand in operands {
            match self.known.get(operand) {
                Some(&value) => values.push(value),
                None => {
                    let message = format!("no clause before this one is called `{operand}`");
                    return Err(wrong(operand, message));
                }
            }
        }
        let e = &mut *self.expressions;
        Ok(match known(operation).expect("looked up above") {
            Known::Row(op) => e.call(op, &values),
            Known::Reciprocal => {
                let one = e.constant(1.0);
                e.call(Op::Div, &[one, values[0]])
            }
            Known::Compare => {
                let less = e.call(Op::Less, &[values[0], values[1]]);
                let more = e.call(Op::Less, &[values[1], values[0]]);
                e.call(Op::Sub, &[more, less])
            }
        })
    }
}

/// What a word of such files stands for.
#[derive(Clone, Copy)]
enum Known {
    Row(Op),
    Reciprocal,
    Compare,
}

impl Known {
    fn arity(self) -> usize {
        match self {
            Known::Row(op) => op.row().arity(),
            Known::Reciprocal => 1,
            Known::Compare => 2,
        }
    }
}

fn known(operation: &str) -> Option<Known> {
    OPERATIONS
        .iter()
        .find(|(name, _)| *name == operation)
        .map(|&(_, known)| known)
}

/// `min` and `max` are set operations here, which programs fuse.
const OPERATIONS: [(&str, Known); 30] = [
    ("add", Known::Row(Op::Add)),
    ("sub", Known::Row(Op::Sub)),
    ("mul", Known::Row(Op::Mul)),
    ("div", Known::Row(Op::Div)),
    ("min", Known::Row(Op::Union)),
    ("max", Known::Row(Op::Intersection)),
    ("neg", Known::Row(Op::Neg)),
    ("abs", Known::Row(Op::Abs)),
    ("sqrt", Known::Row(Op::Sqrt)),
    ("square", Known::Row(Op::Square)),
    ("recip", Known::Reciprocal),
    ("sin", Known::Row(Op::Sin)),
    ("cos", Known::Row(Op::Cos)),
    ("tan", Known::Row(Op::Tan)),
    ("asin", Known::Row(Op::Asin)),
    ("acos", Known::Row(Op::Acos)),
    ("atan", Known::Row(Op::Atan)),
    ("atan2", Known::Row(Op::Atan2)),
    ("exp", Known::Row(Op::Exp)),
    ("ln", Known::Row(Op::Ln)),
    ("log", Known::Row(Op::Ln)),
    ("pow", Known::Row(Op::Pow)),
    ("mod", Known::Row(Op::Modulo)),
    ("floor", Known::Row(Op::Floor)),
    ("ceil", Known::Row(Op::Ceil)),
    ("round", Known::Row(Op::Round)),
    ("compare", Known::Compare),
    ("and", Known::Row(Op::And)),
    ("or", Known::Row(Op::Or)),
    ("not", Known::Row(Op::Not)),
];
