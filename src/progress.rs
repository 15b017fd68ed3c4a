//! How far long work has come, on stderr: nothing for what takes less than a blink, one changing
//! line on a terminal, and elsewhere, where it was asked for, a line for each tenth.

use crate::terminal::Terminal;
use std::sync::Mutex;
use std::time::{Duration, Instant};

/// Work that takes less is not commented on.
const PATIENCE: Duration = Duration::from_millis(300);
/// The shortest time between two changes of a terminal's line.
const TICK: Duration = Duration::from_millis(100);
/// How many characters the bar has.
const WIDTH: usize = 30;

/// The progress of one piece of work; its line is cleared at the end.
pub(crate) struct Progress<'a> {
    terminal: &'a Terminal,
    what: String,
    form: Form,
    started: Instant,
    shown: Mutex<Shown>,
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum Form {
    Silent,
    Bar,
    Lines,
}

/// What was last shown, and when.
#[derive(Default)]
struct Shown {
    at: Option<Instant>,
    tenths: u32,
}

impl<'a> Progress<'a> {
    /// The work `what` begins. It is shown on a terminal, and elsewhere if it `must`.
    pub(crate) fn new(terminal: &'a Terminal, what: String, must: bool) -> Self {
        let form = match (terminal.is_interactive(), must) {
            (true, _) => Form::Bar,
            (false, true) => Form::Lines,
            (false, false) => Form::Silent,
        };
        Self {
            terminal,
            what,
            form,
            started: Instant::now(),
            shown: Mutex::default(),
        }
    }

    /// This share of the work is done; any thread may say so.
    pub(crate) fn is_at(&self, share: f32) {
        if self.form == Form::Silent || self.started.elapsed() < PATIENCE {
            return;
        }
        let share = share.clamp(0.0, 1.0);
        // A thread that finds another one writing has nothing to add.
        let Ok(mut shown) = self.shown.try_lock() else {
            return;
        };
        match self.form {
            Form::Silent => {}
            Form::Bar => {
                if shown.at.is_some_and(|at| at.elapsed() < TICK) {
                    return;
                }
                let full = (share * WIDTH as f32) as usize;
                let (full, empty) = ("█".repeat(full), "░".repeat(WIDTH - full));
                let percent = share * 100.0;
                self.terminal
                    .write(&format!("\r{} {full}{empty} {percent:3.0} %", self.what));
            }
            Form::Lines => {
                let tenths = (share * 10.0) as u32;
                if tenths <= shown.tenths {
                    return;
                }
                shown.tenths = tenths;
                self.terminal
                    .write(&format!("{}: {} %\n", self.what, tenths * 10));
            }
        }
        shown.at = Some(Instant::now());
    }
}

impl Drop for Progress<'_> {
    fn drop(&mut self) {
        let shown = self.shown.get_mut().is_ok_and(|shown| shown.at.is_some());
        if shown && self.form == Form::Bar {
            self.terminal.write("\r\x1b[K");
        }
    }
}
