//! `sdfc ops`: the reference of shapes, operators and functions, generated from the table and the vocabulary.

use crate::failure::Failure;
use crate::output;
use sdfc_compiler::elaborate::{self, FunctionDoc};
use sdfc_vm::row::{Argument, ArgumentKind, BoundsRule, Category, Exactness, SlopeRule};
use sdfc_vm::table::{ROWS, Row};
use serde_json::json;
use std::fmt::Write;

/// Print the reference of shapes, operators and functions.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// A name in a scene or in a listing; without one, all are listed.
    name: Option<String>,
    /// Print the reference as JSON.
    #[arg(long)]
    json: bool,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let rows: Vec<&Row> = match &arguments.name {
        Some(name) => named(name)?,
        None => ROWS
            .iter()
            .filter(|row| row.facts.category != Category::Internal)
            .collect(),
    };
    let functions: Vec<FunctionDoc> = functions()
        .filter(|function| match &arguments.name {
            Some(name) => function.name == name,
            None => true,
        })
        .collect();
    if arguments.json {
        let rows = rows.iter().map(|row| as_json(row));
        let functions = functions.iter().map(function_as_json);
        return output::print_json(&rows.chain(functions).collect::<Vec<_>>());
    }
    output::print(match arguments.name {
        Some(_) => {
            let rows = rows.iter().map(|row| page(row));
            let functions = functions.iter().map(function_page);
            rows.chain(functions).collect::<Vec<_>>().join("\n")
        }
        None => list(&rows, &functions),
    })
}

/// Returns the functions of the language that are no operations of the table.
fn functions() -> impl Iterator<Item = FunctionDoc> {
    let is_row = |name: &str| ROWS.iter().any(|row| word(row) == Some(name));
    let functions = elaborate::function_docs().into_iter();
    functions.filter(move |function| !is_row(function.name))
}

/// Returns all rows of a word of the language, or the row of a name in a listing. A function has none.
fn named(name: &str) -> Result<Vec<&'static Row>, Failure> {
    let mut rows: Vec<_> = ROWS.iter().filter(|row| word(row) == Some(name)).collect();
    if rows.is_empty() {
        rows.extend(ROWS.iter().filter(|row| row.name == name));
    }
    let functions: Vec<&str> = functions().map(|function| function.name).collect();
    if !rows.is_empty() || functions.contains(&name) {
        return Ok(rows);
    }
    let names = ROWS
        .iter()
        .flat_map(|row| word(row).into_iter().chain([row.name]))
        .chain(functions);
    let nearest = names
        .map(|known_name| (strsim::damerau_levenshtein(known_name, name), known_name))
        .min_by_key(|(distance, _)| *distance)
        .filter(|(distance, known_name)| *distance <= 1 + known_name.len() / 3);
    let hint = match nearest {
        Some((_, known_name)) => format!("did you mean `{known_name}`?"),
        None => "`sdfc ops` lists all of them".to_owned(),
    };
    Err(Failure::Input(format!(
        "there is no operation `{name}`: {hint}"
    )))
}

/// Lists all rows by category, and all functions, a line each: the call in a scene, and the first sentence of its
/// description.
fn list(rows: &[&Row], functions: &[FunctionDoc]) -> String {
    let mut text = String::new();
    for category in CATEGORIES {
        let rows = rows.iter().filter(|row| row.facts.category == category);
        let calls: Vec<_> = rows.map(|row| (call(row), row.doc)).collect();
        list_calls(&mut text, heading(category), &calls);
    }
    let calls = functions.iter().flat_map(|function| {
        let calls = function_calls(function).into_iter();
        calls.map(|call| (call, function.doc.as_str()))
    });
    list_calls(&mut text, FUNCTIONS_HEADING, &calls.collect::<Vec<_>>());
    text.push_str(
        "With `up: z` in the scene, solids stand on z instead of y, and turn around it.\n",
    );
    text.push_str("`sdfc ops NAME` describes one of them in full\n");
    text
}

/// Lists calls and the first sentences of their descriptions under a heading, if there are any.
fn list_calls(text: &mut String, heading: &str, calls: &[(String, &str)]) {
    if calls.is_empty() {
        return;
    }
    let lengths = calls.iter().map(|(call, _)| call.len());
    let width = lengths.max().unwrap_or(0).min(48);
    let _ = writeln!(text, "{heading}");
    for (call, doc) in calls {
        let _ = writeln!(text, "  {call:width$}  {}", summary(doc.trim()));
    }
    text.push('\n');
}

/// Returns the first clause of a description: up to a semicolon, or to a full stop after a complete word.
fn summary(doc: &str) -> &str {
    let is_initial = |stop: usize| doc[..stop].ends_with(|c: char| c.is_ascii_uppercase());
    let mut stops = doc.match_indices(". ").map(|(start, _)| start);
    let sentence = stops
        .find(|stop| !is_initial(*stop))
        .map_or(doc, |stop| &doc[..stop]);
    let clause = sentence.split("; ").next().unwrap_or(sentence);
    clause.trim_end_matches('.')
}

/// Returns the complete description of a row.
fn page(row: &Row) -> String {
    let facts = &row.facts;
    let mut text = format!("{}\n  {}\n\n", call(row), row.doc.trim());
    for argument in arguments(row) {
        let _ = write!(
            text,
            "  {:10}  {}",
            argument.name,
            describe_kind(argument.kind)
        );
        if let Some(default) = argument.default {
            let _ = write!(text, "; {} if it is not given", numbers(default));
        }
        text.push('\n');
    }
    let mut fact = |name: &str, value: &str| {
        if !value.is_empty() {
            let _ = writeln!(text, "  {name:10}  {value}");
        }
    };
    fact("distance", exactness(facts.exactness));
    fact("slope", &slope(&facts.slope));
    fact("bounds", bounds(&facts.bounds));
    fact("listing", row.name);
    fact("source", facts.source);
    text
}

/// Returns a function as calls in a scene, one for each variant.
fn function_calls(function: &FunctionDoc) -> Vec<String> {
    let signatures = function.signatures.iter();
    signatures
        .map(|signature| format!("{}({signature})", function.name))
        .collect()
}

/// Returns the complete description of a function.
fn function_page(function: &FunctionDoc) -> String {
    format!(
        "{}\n  {}\n",
        function_calls(function).join("\n"),
        function.doc
    )
}

const FUNCTIONS_HEADING: &str = "functions";

const CATEGORIES: [Category; 8] = [
    Category::Shape3,
    Category::Shape2,
    Category::Combine,
    Category::Domain,
    Category::Distance,
    Category::Dimension,
    Category::Math,
    Category::Internal,
];

fn heading(category: Category) -> &'static str {
    match category {
        Category::Shape3 => "solids",
        Category::Shape2 => "2-D shapes",
        Category::Combine => "combinations",
        Category::Domain => "changes of space",
        Category::Distance => "changes of the distance",
        Category::Dimension => "between 2-D shapes and solids",
        Category::Math => "mathematics of fields",
        Category::Internal => "operations that the compiler inserts",
    }
}

/// Returns the word of the language for a row.
fn word(row: &Row) -> Option<&'static str> {
    row.facts.language.map(|language| language.name)
}

fn arguments(row: &Row) -> &'static [Argument] {
    row.facts
        .language
        .map_or(&[], |language| language.arguments)
}

/// Returns the row as a call in a scene; without a word in the language, its name in listings.
fn call(row: &Row) -> String {
    let Some(name) = word(row) else {
        return row.name.to_owned();
    };
    let arguments: Vec<_> = arguments(row)
        .iter()
        .map(|argument| match argument.default {
            Some(default) => format!("{}: {}", argument.name, numbers(default)),
            None => argument.name.to_owned(),
        })
        .collect();
    format!("{name}({})", arguments.join(", "))
}

fn numbers(values: &[f64]) -> String {
    match values {
        [number] => number.to_string(),
        several => {
            format!(
                "[{}]",
                several
                    .iter()
                    .map(f64::to_string)
                    .collect::<Vec<_>>()
                    .join(", ")
            )
        }
    }
}

fn describe_kind(kind: ArgumentKind) -> &'static str {
    match kind {
        ArgumentKind::Radius => "a radius, more than 0 (or a diameter, with `d` for `r`)",
        ArgumentKind::RadiusOrZero => "a radius, 0 or more (or a diameter, with `d` for `r`)",
        ArgumentKind::Length => "a length, more than 0",
        ArgumentKind::LengthOrZero => "a length, 0 or more",
        ArgumentKind::Offset => "a length of either sign",
        ArgumentKind::Size3 => "full sizes along x, y and z, or one for all three",
        ArgumentKind::Size2 => "full sizes along x and y, or one for both",
        ArgumentKind::Radii3 => "radii along x, y and z, or one for all three",
        ArgumentKind::Lengths3 => "lengths along x, y and z, 0 or more, or one for all three",
        ArgumentKind::Counts3 => "whole numbers along x, y and z, or one for all three",
        ArgumentKind::Vec3 => "a point or an offset in space",
        ArgumentKind::Vec2 => "a point or an offset in the plane",
        ArgumentKind::Direction => "a direction",
        ArgumentKind::Angle => "an angle, with its unit",
        ArgumentKind::Number => "a number",
        ArgumentKind::Count => "a whole number, 1 or more",
    }
}

fn exactness(exactness: Exactness) -> &'static str {
    match exactness {
        Exactness::Exact => "exact",
        Exactness::ExactOutside => "exact outside, too small inside",
        Exactness::Bound => "a bound: never too large, sometimes too small",
        Exactness::Unknown => "none: marching relies on the slope bound",
    }
}

fn slope(slope: &SlopeRule) -> String {
    match slope {
        SlopeRule::Constant(bound) => format!("at most {bound}"),
        SlopeRule::FromParams(_) => "follows from the arguments".to_owned(),
        SlopeRule::MaxOfOperands(factor) if *factor == 1.0 => {
            "that of the steepest operand".to_owned()
        }
        SlopeRule::MaxOfOperands(factor) => format!("that of the steepest operand, times {factor}"),
        SlopeRule::MaxOfOperandsOrOne => "that of the steepest operand, at least 1".to_owned(),
        SlopeRule::Step => {
            "none: the value is discontinuous, and a safe step on both sides".to_owned()
        }
        SlopeRule::Sum => "the sum of the operands'".to_owned(),
        SlopeRule::Norm => "the root of the sum of the operands' squares".to_owned(),
        SlopeRule::PlusParams(_) => {
            "the operand's, plus an amount that follows from the arguments".to_owned()
        }
        SlopeRule::ScaledBy(_) => {
            "the operand's, times a factor that follows from the arguments".to_owned()
        }
        SlopeRule::Fold | SlopeRule::PointMap(_) => {
            "the shape's, times the stretch of space".to_owned()
        }
        SlopeRule::Unbounded => "computed by interval arithmetic".to_owned(),
    }
}

fn bounds(rule: &BoundsRule) -> &'static str {
    match rule {
        BoundsRule::Centred(_) | BoundsRule::Shape(_) => "follow from the arguments",
        BoundsRule::Hull => "around all operands",
        BoundsRule::HullGrown(_) => "around all operands, enlarged for the blend",
        BoundsRule::Intersection => "the intersection of the operands' bounds",
        BoundsRule::FirstOperand => "those of the operand",
        BoundsRule::Map(_) => "those of the shape, transformed with it",
        BoundsRule::Infinite => "",
    }
}

fn as_json(row: &Row) -> serde_json::Value {
    let arguments: Vec<_> = arguments(row)
        .iter()
        .map(|argument| {
            json!({
                "name": argument.name,
                "kind": describe_kind(argument.kind),
                "default": argument.default,
            })
        })
        .collect();
    json!({
        "name": row.name,
        "word": word(row),
        "category": heading(row.facts.category),
        "doc": row.doc.trim(),
        "arguments": arguments,
        "exactness": exactness(row.facts.exactness),
        "slope": slope(&row.facts.slope),
        "bounds": bounds(&row.facts.bounds),
        "source": row.facts.source,
    })
}

fn function_as_json(function: &FunctionDoc) -> serde_json::Value {
    json!({
        "name": function.name,
        "word": function.name,
        "category": FUNCTIONS_HEADING,
        "doc": function.doc,
        "signatures": function.signatures,
    })
}
