//! Deliberate faults: plants each in a copy of the checkout and reports which test notices it.
//!
//! `cargo run --manifest-path tests/faults/Cargo.toml [-- NAME…]` tries those whose names contain one of the
//! words, or all. `SDFC_FAULTS_FOLDER` names the folder of the copy.

mod entries;
mod plant;
mod run;

use run::{Binaries, Outcome};
use std::path::PathBuf;
use std::process::ExitCode;
use std::{env, fs};

fn main() -> ExitCode {
    match try_all() {
        Ok(0) => ExitCode::SUCCESS,
        Ok(count) => {
            eprintln!("{count} survived");
            ExitCode::FAILURE
        }
        Err(error) => {
            eprintln!("{error}");
            ExitCode::from(2)
        }
    }
}

/// Tries the chosen faults; gives the number of those that survived.
fn try_all() -> Result<usize, String> {
    let own = PathBuf::from(env!("CARGO_MANIFEST_DIR"));
    let text = fs::read_to_string(own.join("faults.txt")).map_err(|error| error.to_string())?;
    let faults = entries::parse(&text)?;
    let root = own
        .join("../..")
        .canonicalize()
        .map_err(|error| error.to_string())?;
    let folder = env::var_os("SDFC_FAULTS_FOLDER").map(PathBuf::from);
    let folder = folder.unwrap_or_else(|| env::temp_dir().join("sdfc-faults"));
    fs::create_dir_all(&folder).map_err(|error| error.to_string())?;
    plant::plant(&root, &folder, &faults)?;
    println!(
        "{} faults are planted in {}",
        faults.len(),
        folder.display()
    );
    let mut binaries = Binaries::build(&folder)?;
    let words: Vec<String> = env::args().skip(1).collect();
    let is_chosen = |name: &str| words.is_empty() || words.iter().any(|word| name.contains(word));
    let chosen: Vec<_> = faults
        .iter()
        .filter(|fault| is_chosen(&fault.name))
        .collect();
    for tests in chosen.iter().flat_map(|fault| &fault.tests) {
        binaries.measure(tests)?;
    }
    let mut survivors = 0;
    println!("| fault | noticed by |\n|---|---|");
    for fault in chosen {
        let outcome = binaries.try_fault(fault)?;
        survivors += usize::from(!matches!(outcome, Outcome::Noticed(_)));
        let noticed = match outcome {
            Outcome::Noticed(test) => format!("`{test}`"),
            Outcome::Survived => "SURVIVED".to_owned(),
        };
        println!("| {} | {noticed} |", fault.summary);
    }
    Ok(survivors)
}
