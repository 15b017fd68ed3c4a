//! Messages on stderr: diagnostics, errors, warnings and notes, in colour where that helps. Nothing here
//! fails: if stderr is closed, nobody can be notified.

use sdfc_lang::{Diagnostics, Sources, Style};
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// When messages are coloured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum ColorChoice {
    /// On a terminal, unless `NO_COLOR` is set.
    #[default]
    Auto,
    /// Also into files and pipes.
    Always,
    /// Never.
    Never,
}

/// Standard error.
#[derive(Debug)]
pub(crate) struct Terminal {
    coloured: bool,
    interactive: bool,
    /// True once any message was written.
    has_output: AtomicBool,
}

impl Terminal {
    /// Returns standard error, coloured or not.
    pub(crate) fn new(choice: ColorChoice) -> Self {
        let interactive = std::io::stderr().is_terminal();
        let plain = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
        let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        let coloured = match choice {
            ColorChoice::Auto => interactive && !dumb && !plain("NO_COLOR"),
            ColorChoice::Always => true,
            ColorChoice::Never => false,
        };
        Self {
            coloured,
            interactive,
            has_output: AtomicBool::new(false),
        }
    }

    /// Reports whether it is a terminal.
    pub(crate) fn is_interactive(&self) -> bool {
        self.interactive
    }

    /// Writes text unchanged.
    pub(crate) fn write(&self, text: &str) {
        self.has_output.store(true, Ordering::Relaxed);
        let mut stderr = std::io::stderr().lock();
        let _ = stderr
            .write_all(text.as_bytes())
            .and_then(|()| stderr.flush());
    }

    /// Writes an error.
    pub(crate) fn error(&self, message: &str) {
        self.headline("error", "\x1b[1;31m", message);
    }

    /// Writes a warning.
    pub(crate) fn warning(&self, message: &str) {
        self.headline("warning", "\x1b[1;33m", message);
    }

    /// Writes a note.
    pub(crate) fn note(&self, message: &str) {
        self.headline("note", "\x1b[1;32m", message);
    }

    fn headline(&self, kind: &str, colour: &str, message: &str) {
        if self.coloured {
            self.write(&format!("{colour}{kind}\x1b[0m\x1b[1m: {message}\x1b[0m\n"));
        } else {
            self.write(&format!("{kind}: {message}\n"));
        }
    }

    /// Writes the compiler's diagnostics of a scene, separated from earlier messages.
    pub(crate) fn diagnostics(&self, diagnostics: &Diagnostics, sources: &Sources) {
        if !diagnostics.is_empty() {
            let style = if self.coloured {
                Style::Coloured
            } else {
                Style::Plain
            };
            if self.has_output.load(Ordering::Relaxed) {
                self.write("\n");
            }
            self.write(&diagnostics.render(sources, style));
        }
    }
}
