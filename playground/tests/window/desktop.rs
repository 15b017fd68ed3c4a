//! A virtual desktop: Xvfb with one window, whose pixels are read and whose mouse and keyboard are
//! simulated.
//!
//! Xvfb keeps its screen in a file, so a screenshot is a file read; `xdotool` simulates input. There are
//! no fixed delays: tests poll for the expected state, up to a timeout.

use crate::screen::Screen;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Timeout of every wait.
const TIMEOUT: Duration = Duration::from_secs(60);
/// Interval between two screenshots while waiting.
const POLL_INTERVAL: Duration = Duration::from_millis(40);
/// Size of the screen and of the window.
pub(crate) const SIZE: [usize; 2] = [800, 520];

/// A running virtual desktop.
pub(crate) struct Desktop {
    server: Child,
    display: String,
    folder: TempDir,
}

impl Desktop {
    /// Starts a desktop on a free display number.
    pub(crate) fn start() -> Self {
        let folder = tempfile::tempdir().expect("a folder");
        let [width, height] = SIZE;
        let mut server = Command::new("Xvfb")
            .args(["-displayfd", "1", "-nolisten", "tcp", "-noreset"])
            .args(["-screen", "0", &format!("{width}x{height}x24"), "-fbdir"])
            .arg(folder.path())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .unwrap_or_else(|error| {
                panic!(
                    "Xvfb cannot be started: {error}; install xvfb and xdotool, or state with \
                     SDFC_SKIP_WINDOW why the window is not tested"
                )
            });
        let mut number = String::new();
        let output = server.stdout.take().expect("its output");
        BufReader::new(output)
            .read_line(&mut number)
            .expect("the number of the display");
        Self {
            server,
            display: format!(":{}", number.trim()),
            folder,
        }
    }

    /// Takes a screenshot.
    pub(crate) fn screen(&self) -> Screen {
        let bytes = fs::read(self.folder.path().join("Xvfb_screen0")).expect("the screen");
        Screen::from_xwd(&bytes)
    }

    /// Configures a command to use this desktop.
    fn use_display(&self, command: &mut Command) {
        command.env("DISPLAY", &self.display);
        command.env_remove("WAYLAND_DISPLAY");
        command.env_remove("WAYLAND_SOCKET");
    }

    /// Runs `xdotool` with these arguments.
    pub(crate) fn tool(&self, words: &[&str]) {
        let mut command = Command::new("xdotool");
        self.use_display(command.args(words));
        let output = command.output().unwrap_or_else(|error| {
            panic!("xdotool cannot be started: {error}; it stands in a package of its name")
        });
        let problem = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "xdotool {words:?}: {problem}");
    }

    /// Presses a key.
    pub(crate) fn key(&self, name: &str) {
        self.tool(&["key", name]);
    }

    /// Drags the mouse in steps, with a button held down.
    pub(crate) fn drag(&self, button: &str, from: [i32; 2], to: [i32; 2]) {
        let index = |[x, y]: [i32; 2]| [x.to_string(), y.to_string()];
        let [x, y] = index(from);
        self.tool(&["mousemove", "--sync", &x, &y, "mousedown", button]);
        const STEPS: i32 = 8;
        for step in 1..=STEPS {
            let [x, y] = index([0, 1].map(|i| from[i] + (to[i] - from[i]) * step / STEPS));
            self.tool(&["mousemove", &x, &y, "sleep", "0.03"]);
        }
        self.tool(&["mouseup", button]);
        self.park();
    }

    /// Moves the mouse to where it covers nothing: next to the menus.
    pub(crate) fn park(&self) {
        self.tool(&["mousemove", "500", "8"]);
    }
}

impl Drop for Desktop {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

/// The window in its own process.
pub(crate) struct Window<'d> {
    pub(crate) desktop: &'d Desktop,
    process: Child,
}

impl<'d> Window<'d> {
    /// Opens the window on a scene, over the whole screen. The process is this test program, selected by
    /// an environment variable to run the window.
    pub(crate) fn open(desktop: &'d Desktop, scene: &Path) -> Self {
        let mut command = Command::new(std::env::current_exe().expect("this program"));
        command
            .args(["--exact", crate::WINDOW_TEST, "--ignored", "--nocapture"])
            .env(crate::SCENE_VARIABLE, scene)
            .current_dir(scene.parent().expect("a folder"))
            .stdout(Stdio::null());
        desktop.use_display(&mut command);
        if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
            // Drivers print warnings without this folder.
            command.env("XDG_RUNTIME_DIR", desktop.folder.path());
        }
        let process = command.spawn().expect("this program");
        let window = Self { desktop, process };
        let [width, height] = SIZE.map(|side| side.to_string());
        window.until("the window is there", |screen| screen.colors() > 1);
        desktop.tool(&[
            "search",
            "--sync",
            "--onlyvisible",
            "--name",
            "sdfc",
            "windowmove",
            "0",
            "0",
            "windowsize",
            &width,
            &height,
            "windowfocus",
        ]);
        desktop.park();
        window
    }

    /// Stops the process, as a long computation would. Input waits until it resumes.
    pub(crate) fn stop(&self) {
        self.signal("-STOP");
    }

    /// Resumes the process.
    pub(crate) fn resume(&self) {
        self.signal("-CONT");
    }

    fn signal(&self, name: &str) {
        let index = self.process.id().to_string();
        let status = Command::new("kill").args([name, &index]).status();
        assert!(status.expect("the command").success(), "kill {name} failed");
    }

    /// Waits until the screen satisfies a condition, and returns it.
    pub(crate) fn until(&self, what: &str, holds: impl Fn(&Screen) -> bool) -> Screen {
        let started = Instant::now();
        loop {
            let screen = self.desktop.screen();
            if holds(&screen) {
                return screen;
            }
            if started.elapsed() > TIMEOUT {
                let path = save_screen(&screen, what);
                panic!("never seen: {what}; the screen is in {}", path.display());
            }
            sleep(POLL_INTERVAL);
        }
    }

    /// Waits until the window is idle: its threads use no CPU time.
    pub(crate) fn wait_until_idle(&self) -> Screen {
        let started = Instant::now();
        let mut previous = self.ticks();
        loop {
            sleep(Duration::from_millis(1200));
            let current = self.ticks();
            if current == previous {
                return self.desktop.screen();
            }
            assert!(started.elapsed() < TIMEOUT, "it never comes to rest");
            previous = current;
        }
    }

    /// Returns the CPU time used so far, in hundredths of a second.
    fn ticks(&self) -> u64 {
        let stat = fs::read_to_string(self.file("stat")).expect("its state");
        // The name in parentheses may contain spaces.
        let (_, rest) = stat.rsplit_once(')').expect("its name");
        let fields: Vec<&str> = rest.split_whitespace().collect();
        [11, 12]
            .iter()
            .map(|&index: &usize| fields[index].parse::<u64>().expect("a number"))
            .sum()
    }

    /// Returns the resident memory in KiB.
    pub(crate) fn memory(&self) -> u64 {
        let status = fs::read_to_string(self.file("status")).expect("its state");
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let number = line.and_then(|line| line.split_whitespace().next());
        number.and_then(|n| n.parse().ok()).expect("a number")
    }

    /// Returns the number of open files.
    pub(crate) fn handles(&self) -> usize {
        fs::read_dir(self.file("fd")).expect("its files").count()
    }

    fn file(&self, name: &str) -> PathBuf {
        PathBuf::from(format!("/proc/{}/{name}", self.process.id()))
    }

    /// Waits until the window has closed and reports whether it exited successfully.
    pub(crate) fn closes(mut self) -> bool {
        let started = Instant::now();
        loop {
            if let Some(status) = self.process.try_wait().expect("its state") {
                return status.success();
            }
            assert!(started.elapsed() < TIMEOUT, "it does not close");
            sleep(POLL_INTERVAL);
        }
    }
}

impl Drop for Window<'_> {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Saves a screenshot for the analysis of a failure.
fn save_screen(screen: &Screen, what: &str) -> PathBuf {
    let name: String = what
        .chars()
        .map(|c| if c.is_alphanumeric() { c } else { '-' })
        .collect();
    let path = std::env::temp_dir().join(format!("sdfc-window-{name}.png"));
    let bytes = sdfc_io::png_encoding::encode_png(SIZE, &screen.rgba()).expect("a picture");
    fs::write(&path, bytes).expect("a file");
    path
}
