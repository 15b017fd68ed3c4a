//! `sdfc explain`: the documentation of a message's code.

use crate::failure::Failure;
use crate::output;
use sdfc_lang::codes::{self, CODES};

/// Explain the code of a message, such as E0312.
#[derive(Debug, clap::Args)]
pub(crate) struct Arguments {
    /// The code; without one, all codes are listed.
    code: Option<String>,
}

pub(crate) fn run(arguments: &Arguments) -> Result<(), Failure> {
    let Some(code) = &arguments.code else {
        let lines = CODES
            .iter()
            .map(|row| format!("{}  {}\n", row.code, row.title));
        return output::print(lines.collect::<String>());
    };
    match codes::row(code) {
        Some(row) => output::print(format!("{}: {}\n\n{}\n", row.code, row.title, row.page)),
        None => Err(Failure::Input(format!(
            "there is no code `{code}`: `sdfc explain` lists all of them"
        ))),
    }
}
