//! Tests that are skipped for want of a device or a desktop. Only a stated reason skips a test.

use std::fs::OpenOptions;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::{env, thread};

/// Environment variable with the reason why there is no GPU.
const SKIP_GPU: &str = "SDFC_SKIP_GPU";
/// Environment variable with the reason why there is no desktop.
const SKIP_WINDOW: &str = "SDFC_SKIP_WINDOW";
/// Environment variable with the path of a file, to which each skipped test appends its name.
const SKIPPED_FILE: &str = "SDFC_SKIPPED_FILE";

/// Reports whether the calling test is to leave out the GPU, in which case it is printed and listed. Without a stated
/// reason the result is `false`, so that a missing GPU fails the test.
#[must_use]
pub fn is_gpu_skipped() -> bool {
    is_skipped(reason(SKIP_GPU), list().as_deref())
}

/// Reports whether the calling test is to leave out the window, which also requires a GPU. Such a test is printed
/// and listed, as by [`is_gpu_skipped`].
#[must_use]
pub fn is_window_skipped() -> bool {
    let stated = reason(SKIP_WINDOW).or_else(|| reason(SKIP_GPU));
    is_skipped(stated, list().as_deref())
}

/// Returns the reason that a variable states. An empty one is none.
fn reason(variable: &str) -> Option<String> {
    env::var(variable).ok().filter(|reason| !reason.is_empty())
}

/// Returns the path of the list of skipped tests.
fn list() -> Option<PathBuf> {
    env::var_os(SKIPPED_FILE).map(PathBuf::from)
}

/// Reports whether there is a reason. If so, prints it with the test's name, and appends the name to the list.
fn is_skipped(reason: Option<String>, list: Option<&Path>) -> bool {
    let Some(reason) = reason else {
        return false;
    };
    // The test harness names a test's thread after the test.
    let thread = thread::current();
    let test = thread.name().unwrap_or("an unnamed thread");
    eprintln!("skipped: {test}: {reason}");
    if let Some(path) = list {
        let file = OpenOptions::new().append(true).create(true).open(path);
        // One write, since other tests append to the same file.
        let result = file.and_then(|mut file| file.write_all(format!("{test}\n").as_bytes()));
        result.unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    }
    true
}

#[cfg(test)]
mod tests {
    use super::is_skipped;
    use std::{env, fs, process};

    #[test]
    fn skipped_tests_are_listed_by_name() {
        let path = env::temp_dir().join(format!("sdfc-skipped-{}", process::id()));
        assert!(!is_skipped(None, Some(&path)));
        assert!(!path.exists(), "a test without a reason is not listed");
        let reason = || Some("no device".to_owned());
        assert!(is_skipped(reason(), Some(&path)) && is_skipped(reason(), Some(&path)));
        assert!(is_skipped(reason(), None));
        let listed = fs::read_to_string(&path).expect("the list exists");
        fs::remove_file(&path).expect("the list can be removed");
        let name = "skip::tests::skipped_tests_are_listed_by_name\n";
        assert_eq!(listed, name.repeat(2));
    }
}
