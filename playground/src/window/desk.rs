//! What the window remembers for itself: which panels and overlays are open, what is being typed, and
//! how many pictures came lately.

use crate::painter::SliceAt;
use crate::session::Session;
use eframe::egui::Context;
use sdfc_runtime::engine::EngineKind;
use std::collections::VecDeque;
use std::time::Duration;

/// What lies over the picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Overlay {
    /// Nothing.
    #[default]
    None,
    /// All keys.
    Help,
    /// A field for a path to open.
    Open,
}

/// How long something that was said stays.
const SAID: f64 = 4.0;
/// Over how many seconds pictures are counted.
const COUNTED: f64 = 1.0;

/// See [the module](self).
#[derive(Debug)]
pub(super) struct Desk {
    pub(super) panels: bool,
    pub(super) overlay: Overlay,
    /// The path that is being typed.
    pub(super) path: String,
    /// Whether the field of the path was just opened.
    pub(super) path_is_new: bool,
    /// Whether warnings are read.
    pub(super) report_open: bool,
    /// The plane of slices, once it was moved.
    pub(super) slice: Option<SliceAt>,
    /// The other engine of differences, once one was chosen.
    pub(super) other: Option<EngineKind>,
    /// What the window itself said, and until when it stays.
    pub(super) said: Option<(String, f64)>,
    /// What the session said, and until when it stays.
    pub(super) told: Option<(String, f64)>,
    /// When pictures came, in seconds.
    arrivals: VecDeque<f64>,
    last: u64,
}

impl Default for Desk {
    fn default() -> Self {
        Self {
            panels: true,
            overlay: Overlay::None,
            path: String::new(),
            path_is_new: false,
            report_open: false,
            slice: None,
            other: None,
            said: None,
            told: None,
            arrivals: VecDeque::new(),
            last: 0,
        }
    }
}

impl Desk {
    /// Asks for a path, beside the file that is open.
    pub(super) fn open_path(&mut self, session: &Session) {
        self.overlay = Overlay::Open;
        self.path_is_new = true;
        if self.path.is_empty() {
            self.path = session.source().path().display().to_string();
        }
    }

    /// Says something for a while.
    pub(super) fn say(&mut self, ctx: &Context, text: String) {
        let now = ctx.input(|input| input.time);
        self.said = Some((text, now + SAID));
        ctx.request_repaint();
    }

    /// What there is to say now, and whether it is a failure; and whether the session's news has been
    /// there for long enough.
    pub(super) fn saying(
        &mut self,
        ctx: &Context,
        session: &Session,
    ) -> (Option<(String, bool)>, bool) {
        let now = ctx.input(|input| input.time);
        let (text, fails, until) = if let Some(news) = session.said() {
            let (text, fails) = match news {
                Ok(text) => (text.to_owned(), false),
                Err(text) => (text.to_owned(), true),
            };
            // A failure takes longer to read.
            let stays = if fails { 2.5 * SAID } else { SAID };
            let told = self.told.take().filter(|(told, _)| *told == text);
            let (_, until) = told.unwrap_or_default();
            let until = if until > 0.0 { until } else { now + stays };
            self.told = Some((text.clone(), until));
            (text, fails, until)
        } else {
            self.told = None;
            match &self.said {
                Some((text, until)) => (text.clone(), false, *until),
                None => return (None, false),
            }
        };
        if now >= until {
            self.said = None;
            return (None, self.told.is_some());
        }
        // Asked for in every frame: what one asked for does not outlive the next.
        ctx.request_repaint_after(Duration::from_secs_f64(until - now));
        (Some((text, fails)), false)
    }

    /// Counts a picture by its number.
    pub(super) fn count(&mut self, number: u64, now: f64) {
        if number != self.last {
            self.last = number;
            self.arrivals.push_back(now);
        }
        while self.arrivals.front().is_some_and(|at| *at < now - COUNTED) {
            self.arrivals.pop_front();
        }
    }

    /// Pictures per second, from when the oldest of the last second came to the newest.
    pub(super) fn rate(&self) -> Option<f64> {
        let (first, last) = (self.arrivals.front()?, self.arrivals.back()?);
        let count = self.arrivals.len() - 1;
        (count > 0 && last > first).then(|| count as f64 / (last - first))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pictures_are_counted_over_a_second() {
        let mut desk = Desk::default();
        assert_eq!(desk.rate(), None);
        for i in 0..=50_u32 {
            desk.count(u64::from(i) + 1, f64::from(i) * 0.1);
            desk.count(u64::from(i) + 1, f64::from(i) * 0.1 + 0.05);
        }
        let rate = desk.rate().expect("some");
        assert!((rate - 10.0).abs() < 1e-6, "{rate}");
        desk.count(51, 100.0);
        assert_eq!(desk.rate(), None, "they are long ago");
    }
}
