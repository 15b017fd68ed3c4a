//! Progress of long work, on stderr. Work shorter than a blink writes nothing. On a terminal one line
//! changes; elsewhere, on request, each tenth writes a line.

use crate::terminal::Terminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Duration of work up to which no progress is shown.
const MAX_SILENT_DURATION: Duration = Duration::from_millis(300);
/// Minimum time between two changes of the line on a terminal.
const MIN_REFRESH_INTERVAL: Duration = Duration::from_millis(100);
/// Width of the bar, in characters.
const BAR_WIDTH: usize = 30;

/// Progress of one piece of work; its line is cleared at the end.
pub(crate) struct Progress<'a> {
    terminal: &'a Terminal,
    label: String,
    form: ProgressForm,
    started: Instant,
    shown: Mutex<LastShown>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum ProgressForm {
    Silent,
    Bar,
    Lines,
}

/// The last shown progress, and its time.
#[derive(Default)]
struct LastShown {
    at: Option<Instant>,
    tenths: u32,
}

impl<'a> Progress<'a> {
    /// Begins the progress of work with this label. It is shown on a terminal, and elsewhere if
    /// `is_requested`.
    pub(crate) fn new(terminal: &'a Terminal, label: String, is_requested: bool) -> Self {
        let form = match (terminal.is_interactive(), is_requested) {
            (true, _) => ProgressForm::Bar,
            (false, true) => ProgressForm::Lines,
            (false, false) => ProgressForm::Silent,
        };
        Self {
            terminal,
            label,
            form,
            started: Instant::now(),
            shown: Mutex::default(),
        }
    }

    /// Shows the finished fraction of the work; callable from any thread.
    pub(crate) fn update(&self, fraction: f32) {
        if self.form == ProgressForm::Silent || self.started.elapsed() < MAX_SILENT_DURATION {
            return;
        }
        let fraction = fraction.clamp(0.0, 1.0);
        // While another thread writes, the update is dropped.
        let Ok(mut shown) = self.shown.try_lock() else {
            return;
        };
        match self.form {
            ProgressForm::Silent => {}
            ProgressForm::Bar => {
                if shown
                    .at
                    .is_some_and(|at| at.elapsed() < MIN_REFRESH_INTERVAL)
                {
                    return;
                }
                let full = (fraction * BAR_WIDTH as f32) as usize;
                let (full, empty) = ("█".repeat(full), "░".repeat(BAR_WIDTH - full));
                let percent = fraction * 100.0;
                self.terminal
                    .write(&format!("\r{} {full}{empty} {percent:3.0} %", self.label));
            }
            ProgressForm::Lines => {
                let tenths = (fraction * 10.0) as u32;
                if tenths <= shown.tenths {
                    return;
                }
                shown.tenths = tenths;
                self.terminal
                    .write(&format!("{}: {} %\n", self.label, tenths * 10));
            }
        }
        shown.at = Some(Instant::now());
    }
}

impl Drop for Progress<'_> {
    fn drop(&mut self) {
        let shown = self.shown.get_mut().is_ok_and(|shown| shown.at.is_some());
        if shown && self.form == ProgressForm::Bar {
            self.terminal.write("\r\x1b[K");
        }
    }
}
