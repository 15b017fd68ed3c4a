//! What is said on stderr: diagnostics, errors, warnings and notes, in colour where that helps.
//! Nothing here fails: where stderr is closed there is nobody to tell.

use sdfc_lang::{Diagnostics, Sources, Style};
use std::io::{IsTerminal, Write};
use std::sync::atomic::{AtomicBool, Ordering};

/// When messages are coloured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, clap::ValueEnum)]
pub(crate) enum Colour {
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
    /// Whether something has been said.
    spoke: AtomicBool,
}

impl Terminal {
    /// Standard error, coloured or not.
    pub(crate) fn new(colour: Colour) -> Self {
        let interactive = std::io::stderr().is_terminal();
        let plain = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
        let dumb = std::env::var_os("TERM").is_some_and(|term| term == "dumb");
        let coloured = match colour {
            Colour::Auto => interactive && !dumb && !plain("NO_COLOR"),
            Colour::Always => true,
            Colour::Never => false,
        };
        Self {
            coloured,
            interactive,
            spoke: AtomicBool::new(false),
        }
    }

    /// Whether a person looks on.
    pub(crate) fn is_interactive(&self) -> bool {
        self.interactive
    }

    /// Writes text as it is.
    pub(crate) fn write(&self, text: &str) {
        self.spoke.store(true, Ordering::Relaxed);
        let mut stderr = std::io::stderr().lock();
        let _ = stderr
            .write_all(text.as_bytes())
            .and_then(|()| stderr.flush());
    }

    /// What is wrong.
    pub(crate) fn error(&self, message: &str) {
        self.headline("error", "\x1b[1;31m", message);
    }

    /// What may be wrong.
    pub(crate) fn warning(&self, message: &str) {
        self.headline("warning", "\x1b[1;33m", message);
    }

    /// What is worth knowing.
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

    /// What the compiler has to say about a scene, apart from what was said before.
    pub(crate) fn diagnostics(&self, found: &Diagnostics, sources: &Sources) {
        if !found.is_empty() {
            let style = if self.coloured {
                Style::Coloured
            } else {
                Style::Plain
            };
            if self.spoke.load(Ordering::Relaxed) {
                self.write("\n");
            }
            self.write(&found.render(sources, style));
        }
    }
}
