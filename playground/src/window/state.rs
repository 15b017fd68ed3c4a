//! State of the window itself: open panels and dialogs, text being typed, messages, and the recent frame
//! rate.

use crate::renderer::SlicePlane;
use crate::session::Session;
use eframe::egui::Context;
use sdfc_runtime::engine::EngineKind;
use std::collections::VecDeque;
use std::time::Duration;

/// The open dialog.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) enum Dialog {
    /// No dialog.
    #[default]
    None,
    /// List of all keys.
    Help,
    /// Input field for the path of a file to open.
    Open,
}

/// Number of frames in which an opened input field requests the focus.
const FRAMES_UNTIL_FOCUS: u8 = 2;
/// Display time of a message in seconds.
const MESSAGE_SECONDS: f64 = 4.0;
/// Time in seconds over which the frame rate is measured.
const RATE_WINDOW_SECONDS: f64 = 1.0;

/// See [the module](self).
#[derive(Debug)]
pub(super) struct WindowState {
    pub(super) panels: bool,
    pub(super) dialog: Dialog,
    /// Path in the input field.
    pub(super) path: String,
    /// Number of frames until the opened input field has the focus. The first one only lays it out.
    pub(super) frames_until_focus: u8,
    /// True if the report of warnings is open.
    pub(super) report_open: bool,
    /// Plane of slices, once it was moved.
    pub(super) slice: Option<SlicePlane>,
    /// The other engine of differences, once one was selected.
    pub(super) other: Option<EngineKind>,
    /// Message of the window itself, and its expiry time.
    pub(super) message: Option<(String, f64)>,
    /// Message of the session, and its expiry time.
    pub(super) session_message: Option<(String, f64)>,
    /// Arrival times of pictures, in seconds.
    arrivals: VecDeque<f64>,
    last_number: u64,
}

impl Default for WindowState {
    fn default() -> Self {
        Self {
            panels: true,
            dialog: Dialog::None,
            path: String::new(),
            frames_until_focus: 0,
            report_open: false,
            slice: None,
            other: None,
            message: None,
            session_message: None,
            arrivals: VecDeque::new(),
            last_number: 0,
        }
    }
}

impl WindowState {
    /// Opens the path dialog, initialised with the current file.
    pub(super) fn open_path(&mut self, session: &Session) {
        self.dialog = Dialog::Open;
        self.frames_until_focus = FRAMES_UNTIL_FOCUS;
        if self.path.is_empty() {
            self.path = session.source().path().display().to_string();
        }
    }

    /// Shows a message for [`MESSAGE_SECONDS`].
    pub(super) fn show_message(&mut self, ctx: &Context, text: String) {
        let now = ctx.input(|input| input.time);
        self.message = Some((text, now + MESSAGE_SECONDS));
        ctx.request_repaint();
    }

    /// Returns the current message and whether it is a failure, and whether the session's message has
    /// expired.
    pub(super) fn current_message(
        &mut self,
        ctx: &Context,
        session: &Session,
    ) -> (Option<(String, bool)>, bool) {
        let now = ctx.input(|input| input.time);
        let (text, is_failure, expires_at) = if let Some(message) = session.message() {
            let (text, is_failure) = match message {
                Ok(text) => (text.to_owned(), false),
                Err(text) => (text.to_owned(), true),
            };
            // Failures take longer to read.
            let seconds = if is_failure {
                2.5 * MESSAGE_SECONDS
            } else {
                MESSAGE_SECONDS
            };
            let session_message = self
                .session_message
                .take()
                .filter(|(session_message, _)| *session_message == text);
            let (_, expires_at) = session_message.unwrap_or_default();
            let expires_at = if expires_at > 0.0 {
                expires_at
            } else {
                now + seconds
            };
            self.session_message = Some((text.clone(), expires_at));
            (text, is_failure, expires_at)
        } else {
            self.session_message = None;
            match &self.message {
                Some((text, expires_at)) => (text.clone(), false, *expires_at),
                None => return (None, false),
            }
        };
        if now >= expires_at {
            self.message = None;
            return (None, self.session_message.is_some());
        }
        // Repaint requests must be renewed in every frame.
        ctx.request_repaint_after(Duration::from_secs_f64(expires_at - now));
        (Some((text, is_failure)), false)
    }

    /// Records the arrival of a picture.
    pub(super) fn count(&mut self, number: u64, now: f64) {
        if number != self.last_number {
            self.last_number = number;
            self.arrivals.push_back(now);
        }
        while self
            .arrivals
            .front()
            .is_some_and(|time| *time < now - RATE_WINDOW_SECONDS)
        {
            self.arrivals.pop_front();
        }
    }

    /// Returns the pictures per second, measured from the oldest to the newest of the last
    /// [`RATE_WINDOW_SECONDS`].
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
        let mut state = WindowState::default();
        assert_eq!(state.rate(), None);
        for i in 0..=50_u32 {
            state.count(u64::from(i) + 1, f64::from(i) * 0.1);
            state.count(u64::from(i) + 1, f64::from(i) * 0.1 + 0.05);
        }
        let rate = state.rate().expect("some");
        assert!((rate - 10.0).abs() < 1e-6, "{rate}");
        state.count(51, 100.0);
        assert_eq!(state.rate(), None, "they are long ago");
    }
}
