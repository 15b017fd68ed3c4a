//! A folder in which the program runs, and its output.

use std::fmt::Write as _;
use std::io::{Read, Write as _};
use std::path::PathBuf;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Timeout of a run; a longer one has hung, and the test fails.
const RUN_TIMEOUT: Duration = Duration::from_secs(120);

/// A temporary folder that exists during the test.
pub(crate) struct Sandbox {
    folder: tempfile::TempDir,
}

/// Result of a run.
#[derive(Debug)]
pub(crate) struct Run {
    command: String,
    pub(crate) code: i32,
    pub(crate) stdout: Vec<u8>,
    pub(crate) stderr: String,
}

impl Sandbox {
    /// Creates an empty folder.
    pub(crate) fn new() -> Self {
        Self {
            folder: tempfile::tempdir().expect("a temporary folder"),
        }
    }

    /// Creates a folder with one scene, `scene.sdf`.
    pub(crate) fn with_scene(text: &str) -> Self {
        let sandbox = Self::new();
        sandbox.write("scene.sdf", text);
        sandbox
    }

    /// Writes a file and creates its folders.
    pub(crate) fn write(&self, name: &str, bytes: impl AsRef<[u8]>) {
        let path = self.path(name);
        let parent = path.parent().expect("a file lies in a folder");
        std::fs::create_dir_all(parent).expect("a folder in the sandbox");
        std::fs::write(path, bytes).expect("a file in the sandbox");
    }

    /// Reads a file.
    pub(crate) fn read(&self, name: &str) -> Vec<u8> {
        std::fs::read(self.path(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    }

    /// Returns the path of a file.
    pub(crate) fn path(&self, name: &str) -> PathBuf {
        self.folder.path().join(name)
    }

    /// Returns the names of all files and folders at the top level, sorted.
    pub(crate) fn files(&self) -> Vec<String> {
        let entries = std::fs::read_dir(self.folder.path()).expect("the sandbox");
        let name = |entry: std::io::Result<std::fs::DirEntry>| {
            entry
                .expect("an entry")
                .file_name()
                .to_string_lossy()
                .into_owned()
        };
        let mut names: Vec<_> = entries.map(name).collect();
        names.sort();
        names
    }

    /// Creates the command that runs the program in the sandbox, with arguments separated by spaces.
    pub(crate) fn command(&self, arguments: &str) -> Command {
        let mut command = Command::new(env!("CARGO_BIN_EXE_sdfc"));
        command
            .args(arguments.split_whitespace())
            .current_dir(self.folder.path())
            .env_remove("NO_COLOR")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped());
        command
    }

    /// Runs the program with these arguments, separated by spaces.
    pub(crate) fn run(&self, arguments: &str) -> Run {
        finished(arguments, self.command(arguments), "")
    }

    /// Runs the program with a text on standard input.
    pub(crate) fn run_on(&self, arguments: &str, input: &str) -> Run {
        finished(arguments, self.command(arguments), input)
    }

    /// Runs the program as on a machine without a GPU.
    pub(crate) fn run_without_gpu(&self, arguments: &str) -> Run {
        let mut command = self.command(arguments);
        command
            .env("VK_DRIVER_FILES", "/dev/null")
            .env("VK_ICD_FILENAMES", "/dev/null");
        finished(arguments, command, "")
    }
}

fn finished(arguments: &str, mut command: Command, input: &str) -> Run {
    command.stdin(Stdio::piped());
    let mut child = command.spawn().expect("the program starts");
    let (mut stdin, stdout, stderr) =
        (child.stdin.take(), child.stdout.take(), child.stderr.take());
    let input = input.to_owned();
    std::thread::spawn(move || {
        // A program that does not read its input closes it.
        let _ = stdin
            .as_mut()
            .map(|stdin| stdin.write_all(input.as_bytes()));
    });
    let stdout = std::thread::spawn(move || all_of(stdout));
    let stderr = std::thread::spawn(move || all_of(stderr));
    let started = Instant::now();
    let status = loop {
        if let Some(status) = child.try_wait().expect("the program can be waited for") {
            break status;
        }
        if started.elapsed() > RUN_TIMEOUT {
            child.kill().expect("the program can be ended");
            panic!("`sdfc {arguments}` did not end");
        }
        std::thread::sleep(Duration::from_millis(5));
    };
    let run = Run {
        command: arguments.to_owned(),
        code: status.code().unwrap_or(-1),
        stdout: stdout.join().expect("standard output"),
        stderr: String::from_utf8(stderr.join().expect("standard error")).expect("text"),
    };
    assert!(
        matches!(run.code, 0..=3),
        "no input ends the program like this:\n{}",
        run.transcript()
    );
    run
}

fn all_of(from: Option<impl Read>) -> Vec<u8> {
    let mut bytes = Vec::new();
    from.expect("a pipe")
        .read_to_end(&mut bytes)
        .expect("the pipe can be read");
    bytes
}

impl Run {
    /// Returns the standard output as text.
    pub(crate) fn text(&self) -> String {
        String::from_utf8_lossy(&self.stdout).into_owned()
    }

    /// Returns the standard output as JSON.
    pub(crate) fn json(&self) -> serde_json::Value {
        serde_json::from_slice(&self.stdout)
            .unwrap_or_else(|error| panic!("{error}:\n{}", self.transcript()))
    }

    /// Asserts that the run succeeded and returns it.
    #[track_caller]
    pub(crate) fn ok(self) -> Self {
        assert_eq!(self.code, 0, "{}", self.transcript());
        self
    }

    /// Returns the command, all output, and the exit code.
    pub(crate) fn transcript(&self) -> String {
        let mut text = format!("$ sdfc {}\n", self.command);
        text.push_str(&self.text());
        if !self.stderr.is_empty() {
            let _ = write!(text, "--- stderr\n{}", self.stderr);
        }
        let _ = writeln!(text, "--- exit code {}", self.code);
        text
    }
}
