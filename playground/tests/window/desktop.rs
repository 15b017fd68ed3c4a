//! A desktop that nobody sees: Xvfb with one window in it, whose pixels are read and whose mouse and
//! keyboard are moved.
//!
//! Xvfb keeps its screen in a file, so a picture of it is a read; `xdotool` moves the mouse and the
//! keys. Nothing here waits for a fixed time: whatever is expected is waited for, up to a limit that
//! is only reached when it does not come.

use crate::screen::Screen;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// How long anything is waited for.
const LIMIT: Duration = Duration::from_secs(60);
/// How often one looks.
const LOOK: Duration = Duration::from_millis(40);
/// The size of the screen, and of the window.
pub(crate) const SIZE: [usize; 2] = [800, 520];

/// A running desktop.
pub(crate) struct Desktop {
    server: Child,
    display: String,
    folder: TempDir,
}

impl Desktop {
    /// Starts one, on a display number that is free.
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
                    "Xvfb cannot be started: {error}; install xvfb and xdotool, or say with \
                     SDFC_SKIP_WINDOW why the window is not tried"
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

    /// What the screen shows now.
    pub(crate) fn screen(&self) -> Screen {
        let bytes = fs::read(self.folder.path().join("Xvfb_screen0")).expect("the screen");
        Screen::of(&bytes)
    }

    /// Sets a command onto this desktop.
    fn on_it(&self, command: &mut Command) {
        command.env("DISPLAY", &self.display);
        command.env_remove("WAYLAND_DISPLAY");
        command.env_remove("WAYLAND_SOCKET");
    }

    /// Does what `xdotool` calls by these words.
    pub(crate) fn tool(&self, words: &[&str]) {
        let mut command = Command::new("xdotool");
        self.on_it(command.args(words));
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

    /// Moves the mouse somewhere with a button held, in steps, as a hand does.
    pub(crate) fn drag(&self, button: &str, from: [i32; 2], to: [i32; 2]) {
        let at = |[x, y]: [i32; 2]| [x.to_string(), y.to_string()];
        let [x, y] = at(from);
        self.tool(&["mousemove", "--sync", &x, &y, "mousedown", button]);
        const STEPS: i32 = 8;
        for step in 1..=STEPS {
            let [x, y] = at([0, 1].map(|i| from[i] + (to[i] - from[i]) * step / STEPS));
            self.tool(&["mousemove", &x, &y, "sleep", "0.03"]);
        }
        self.tool(&["mouseup", button]);
        self.park();
    }

    /// Moves the mouse to where it hides nothing: onto the line of menus, beside them.
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

/// The window, in a process of its own.
pub(crate) struct Window<'d> {
    pub(crate) desktop: &'d Desktop,
    process: Child,
}

impl<'d> Window<'d> {
    /// Opens it on a scene, over all of the screen. The process is this program again, told by its
    /// environment to be the window.
    pub(crate) fn open(desktop: &'d Desktop, scene: &Path) -> Self {
        let mut command = Command::new(std::env::current_exe().expect("this program"));
        command
            .args(["--exact", crate::PROCESS, "--ignored", "--nocapture"])
            .env(crate::SCENE, scene)
            .current_dir(scene.parent().expect("a folder"))
            .stdout(Stdio::null());
        desktop.on_it(&mut command);
        if std::env::var_os("XDG_RUNTIME_DIR").is_none() {
            // Drivers complain where there is none.
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

    /// Waits until the screen is so, and gives it.
    pub(crate) fn until(&self, what: &str, holds: impl Fn(&Screen) -> bool) -> Screen {
        let started = Instant::now();
        loop {
            let screen = self.desktop.screen();
            if holds(&screen) {
                return screen;
            }
            if started.elapsed() > LIMIT {
                let kept = kept(&screen, what);
                panic!("never seen: {what}; the screen is in {}", kept.display());
            }
            sleep(LOOK);
        }
    }

    /// Waits until it does nothing: its threads use no time of the processor.
    pub(crate) fn rest(&self) -> Screen {
        let started = Instant::now();
        let mut before = self.ticks();
        loop {
            sleep(Duration::from_millis(1200));
            let now = self.ticks();
            if now == before {
                return self.desktop.screen();
            }
            assert!(started.elapsed() < LIMIT, "it never comes to rest");
            before = now;
        }
    }

    /// The time of the processor that it used so far, in hundredths of a second.
    fn ticks(&self) -> u64 {
        let stat = fs::read_to_string(self.file("stat")).expect("its state");
        // The name, in parentheses, may hold blanks.
        let (_, rest) = stat.rsplit_once(')').expect("its name");
        let fields: Vec<&str> = rest.split_whitespace().collect();
        [11, 12]
            .iter()
            .map(|&at: &usize| fields[at].parse::<u64>().expect("a number"))
            .sum()
    }

    /// Its resident memory in kilobytes.
    pub(crate) fn memory(&self) -> u64 {
        let status = fs::read_to_string(self.file("status")).expect("its state");
        let line = status.lines().find_map(|line| line.strip_prefix("VmRSS:"));
        let number = line.and_then(|line| line.split_whitespace().next());
        number.and_then(|n| n.parse().ok()).expect("a number")
    }

    /// How many files it has open.
    pub(crate) fn handles(&self) -> usize {
        fs::read_dir(self.file("fd")).expect("its files").count()
    }

    fn file(&self, name: &str) -> PathBuf {
        PathBuf::from(format!("/proc/{}/{name}", self.process.id()))
    }

    /// Waits until it has closed by itself, and says whether that went well.
    pub(crate) fn closes(mut self) -> bool {
        let started = Instant::now();
        loop {
            if let Some(status) = self.process.try_wait().expect("its state") {
                return status.success();
            }
            assert!(started.elapsed() < LIMIT, "it does not close");
            sleep(LOOK);
        }
    }
}

impl Drop for Window<'_> {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Keeps a screen for whoever looks at what failed.
fn kept(screen: &Screen, what: &str) -> PathBuf {
    let name: String = what
        .chars()
        .map(|c| if c.is_alphanumeric() { c } else { '-' })
        .collect();
    let path = std::env::temp_dir().join(format!("sdfc-window-{name}.png"));
    let bytes = sdfc_playground::picture::png(SIZE, &screen.rgba()).expect("a picture");
    fs::write(&path, bytes).expect("a file");
    path
}
