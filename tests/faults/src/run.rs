//! Builds the tests once and runs them for each fault.

use crate::entries::{Fault, Tests};
use std::collections::BTreeMap;
use std::fs::File;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use std::{env, fs};

/// Maximum duration of tests with a fault, beyond ten times what they take without.
const MAX_EXTRA_DURATION: Duration = Duration::from_secs(60);

/// The outcome of a fault.
#[derive(Debug, PartialEq)]
pub enum Outcome {
    /// A test failed, or its binary ended otherwise than it should.
    Noticed(String),
    /// All tests passed.
    Survived,
}

/// The test binaries of a checkout.
pub struct Binaries {
    root: PathBuf,
    paths: BTreeMap<String, PathBuf>,
    /// The time that tests take without a fault.
    times: Vec<(Tests, Duration)>,
}

impl Binaries {
    /// Builds the tests of all crates that faults are planted in.
    pub fn build(root: &Path) -> Result<Self, String> {
        let packages = [
            "sdfc",
            "sdfc-vm",
            "sdfc-compiler",
            "sdfc-shaders",
            "sdfc-runtime",
            "sdfc-trials",
        ];
        let mut cargo = Command::new(env::var_os("CARGO").unwrap_or("cargo".into()));
        cargo
            .args(["test", "--no-run", "--locked"])
            .current_dir(root);
        for package in packages {
            cargo.args(["-p", package]);
        }
        let output = cargo.output().map_err(|error| format!("cargo: {error}"))?;
        let text = String::from_utf8_lossy(&output.stderr);
        if !output.status.success() {
            return Err(text.into_owned());
        }
        let mut paths = BTreeMap::new();
        // `Executable tests/suite/main.rs (target/debug/deps/suite-0123456789abcdef)`
        for line in text
            .lines()
            .filter(|line| line.trim_start().starts_with("Executable"))
        {
            let path = line
                .rsplit_once('(')
                .map_or("", |(_, path)| path.trim_end_matches(')'));
            let path = root.join(path);
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            if let Some((name, _)) = name.rsplit_once('-') {
                paths.insert(name.to_owned(), path.clone());
            }
        }
        Ok(Self {
            root: root.to_owned(),
            paths,
            times: Vec::new(),
        })
    }

    /// Demands that tests pass without a fault, and measures them.
    pub fn measure(&mut self, tests: &Tests) -> Result<(), String> {
        if self.times.iter().any(|(known, _)| known == tests) {
            return Ok(());
        }
        let start = Instant::now();
        match self.run(tests, 0, Duration::from_secs(3600))? {
            Some(failure) => Err(format!(
                "{} {} without a fault: {failure}",
                tests.binary,
                tests.filters.join(" ")
            )),
            None => {
                self.times.push((tests.clone(), start.elapsed()));
                Ok(())
            }
        }
    }

    /// Runs a fault's tests until one notices it.
    pub fn try_fault(&self, fault: &Fault) -> Result<Outcome, String> {
        for tests in &fault.tests {
            let known = self.times.iter().find(|(known, _)| known == tests);
            let limit = known.map_or(Duration::ZERO, |&(_, time)| time * 10) + MAX_EXTRA_DURATION;
            if let Some(failure) = self.run(tests, fault.number(), limit)? {
                return Ok(Outcome::Noticed(failure));
            }
        }
        Ok(Outcome::Survived)
    }

    /// The first test that fails with a fault, if any does.
    fn run(&self, tests: &Tests, number: u32, limit: Duration) -> Result<Option<String>, String> {
        let path = self.paths.get(&tests.binary);
        let path = path.ok_or(format!("there is no test binary {}", tests.binary))?;
        let log = self.root.join("target/fault-log");
        fs::create_dir_all(self.root.join("target")).map_err(|error| error.to_string())?;
        let file = File::create(&log).map_err(|error| error.to_string())?;
        let mut child = Command::new(path)
            .args(&tests.filters)
            .envs(tests.variables.iter().cloned())
            .current_dir(&self.root)
            .env("SDFC_FAULT", number.to_string())
            .env("INSTA_UPDATE", "no")
            .env("INSTA_WORKSPACE_ROOT", &self.root)
            .stdout(file)
            .stderr(Stdio::null())
            .spawn()
            .map_err(|error| format!("{}: {error}", path.display()))?;
        let start = Instant::now();
        let status = loop {
            if let Some(status) = child.try_wait().map_err(|error| error.to_string())? {
                break status;
            }
            // The other tests of the binary have nothing to add.
            let text = fs::read_to_string(&log).unwrap_or_default();
            let failed = failed(&text);
            if failed.is_some() || start.elapsed() > limit {
                let _ = child.kill();
                let _ = child.wait();
                let late = format!("{} does not end", tests.binary);
                return Ok(Some(
                    failed.map_or(late, |name| format!("{} {name}", tests.binary)),
                ));
            }
            sleep(Duration::from_millis(20));
        };
        let text = fs::read_to_string(&log).unwrap_or_default();
        if status.success() {
            // A filter that fits nothing tests nothing.
            return match text.contains("running 0 tests") {
                true => Err(format!(
                    "{} {}: no such tests",
                    tests.binary,
                    tests.filters.join(" ")
                )),
                false => Ok(None),
            };
        }
        let failed = failed(&text).map(|name| format!("{} {name}", tests.binary));
        Ok(Some(
            failed.unwrap_or(format!("{} ends with {status}", tests.binary)),
        ))
    }
}

/// The first failed test that a log tells of.
fn failed(log: &str) -> Option<&str> {
    log.lines().find_map(|line| {
        let name = line.strip_prefix("test ")?;
        name.strip_suffix(" ... FAILED")
    })
}
