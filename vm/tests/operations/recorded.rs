//! The recorded WGSL of every operation: valid, and equal to the snapshot.

use sdfc_vm::apply::{record_gradient, record_interval, record_value};
use sdfc_vm::prelude;
use sdfc_vm::record::{BOX_POINT, DUAL_POINT, RecordedFunction};
use sdfc_vm::table::ROWS;

/// Validates a WGSL text with naga.
fn validate(text: &str) -> Result<(), String> {
    let module = naga::front::wgsl::parse_str(text).map_err(|e| e.emit_to_string(text))?;
    let flags = naga::valid::ValidationFlags::all();
    let capabilities = naga::valid::Capabilities::default();
    naga::valid::Validator::new(flags, capabilities)
        .validate(&module)
        .map_err(|e| e.emit_to_string(text))?;
    Ok(())
}

fn text(functions: &[RecordedFunction]) -> String {
    functions
        .iter()
        .map(|f| f.text.as_str())
        .collect::<Vec<_>>()
        .join("\n")
}

#[test]
fn every_recorded_function_is_valid() {
    for row in ROWS {
        for record in [record_value, record_gradient, record_interval] {
            let function = record(row.op);
            let called = text(&prelude::functions(function.calls.iter().copied()));
            let module = format!("{DUAL_POINT}{BOX_POINT}\n{called}\n{}", function.text);
            if let Err(error) = validate(&module) {
                panic!("{}: {error}\n{}", function.name, function.text);
            }
        }
    }
}

#[test]
fn prelude() {
    let functions = prelude::functions(prelude::NAMES);
    insta::assert_snapshot!(text(&functions));
}

#[test]
fn values() {
    let functions: Vec<RecordedFunction> = ROWS.iter().map(|row| record_value(row.op)).collect();
    insta::assert_snapshot!(text(&functions));
}

#[test]
fn gradients() {
    let functions: Vec<RecordedFunction> = ROWS.iter().map(|row| record_gradient(row.op)).collect();
    insta::assert_snapshot!(text(&functions));
}

#[test]
fn intervals() {
    let functions: Vec<RecordedFunction> = ROWS.iter().map(|row| record_interval(row.op)).collect();
    insta::assert_snapshot!(text(&functions));
}
