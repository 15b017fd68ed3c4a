//! Places that an addition to the project needs, each demanded by name.

use super::sources;
use crate::corpus::name;
use crate::shapes::shape_rows;
use sdfc_compiler::passes::PASSES;
use sdfc_vm::table::{Op, Row};
use std::fs;
use std::path::Path;

/// File with the independent definitions of shapes.
const DEFINITIONS: &str = "vm/tests/operations/definitions.rs";

/// Reports whether a text names an operation.
fn names_op(text: &str, op: Op) -> bool {
    let path = format!("Op::{op:?}");
    text.match_indices(&path).any(|(start, _)| {
        let next = text[start + path.len()..].chars().next();
        next.is_none_or(|c| !c.is_alphanumeric() && c != '_')
    })
}

/// Returns the places that a shape lacks. Its scenes follow from its row ([`crate::shapes`]).
fn missing_places(row: &Row, definitions: &str) -> Vec<String> {
    let place = |is_there: bool, place: &str| {
        let missing = format!("`{}` has no {place}", row.name);
        (!is_there).then_some(missing)
    };
    let facts = "in its row of vm/src/table.rs";
    [
        place(
            row.doc.trim().ends_with('.'),
            &format!("sentence of documentation {facts}"),
        ),
        place(row.facts.language.is_some(), &format!("`language` {facts}")),
        place(!row.facts.source.is_empty(), &format!("`source` {facts}")),
        place(
            names_op(definitions, row.op),
            &format!("inside in `contains` of {DEFINITIONS}"),
        ),
    ]
    .into_iter()
    .flatten()
    .collect()
}

#[test]
fn every_shape_has_all_its_places() {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(DEFINITIONS);
    let definitions = fs::read_to_string(path).expect("the definitions can be read");
    let missing: Vec<String> = shape_rows()
        .flat_map(|row| missing_places(row, &definitions))
        .collect();
    assert!(missing.is_empty(), "{}", missing.join("\n"));
}

#[test]
fn a_shape_without_places_is_reported_with_each_of_them() {
    let row = Row {
        doc: "\n",
        facts: sdfc_vm::row::OpFacts {
            language: None,
            source: "",
            ..Op::Sphere.row().facts
        },
        ..*Op::Sphere.row()
    };
    let missing = missing_places(&row, "Op::SphereOfAnotherName");
    let all = ["documentation", "language", "source", "inside"];
    assert_eq!(missing.len(), all.len(), "{missing:?}");
    for (message, place) in missing.iter().zip(all) {
        assert!(message.contains(place), "{message}");
    }
}

#[test]
fn every_pass_has_a_module_of_its_name() {
    let modules: Vec<String> = sources("compiler/src/passes")
        .iter()
        .map(|source| name(&source.path))
        .collect();
    for pass in PASSES {
        assert!(
            modules.iter().any(|module| module == pass.name),
            "compiler/src/passes/{}.rs is missing",
            pass.name
        );
    }
}
