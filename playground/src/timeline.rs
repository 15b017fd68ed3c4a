//! The time of an animated scene: play, pause, scrub, speed and repetition.
//!
//! The timeline has no clock: the caller passes the elapsed time. While paused it requires no frames.

use sdfc_vm::settings::Animation;
use std::time::Duration;

/// Minimum and maximum playback speed.
pub const SPEED_RANGE: [f64; 2] = [1.0 / 64.0, 64.0];

/// State of an animation's playback; times are in seconds from its start.
#[derive(Clone, Debug, PartialEq)]
pub struct Timeline {
    animation: Animation,
    time: f64,
    speed: f64,
    is_playing: bool,
    repeats: bool,
}

impl Timeline {
    /// Creates a paused timeline at the start of an animation.
    pub fn new(animation: Animation) -> Self {
        Self {
            animation,
            time: 0.0,
            speed: 1.0,
            is_playing: false,
            repeats: animation.repeats,
        }
    }

    /// Replaces the animation after an edit. The time is clamped to the new duration, and manual settings
    /// are kept.
    pub fn change(&mut self, animation: Animation) {
        if animation.repeats != self.animation.repeats {
            self.repeats = animation.repeats;
        }
        self.animation = animation;
        self.scrub(self.time);
    }

    /// Returns the current time in seconds.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Returns the duration in seconds.
    pub fn duration(&self) -> f64 {
        self.animation.duration
    }

    /// Returns the index of the current frame, from 0.
    pub fn frame(&self) -> u64 {
        // The time of a frame's start may be rounded down.
        (self.time * self.animation.fps + 1e-6).floor() as u64
    }

    /// Returns the number of frames, at least one.
    pub fn frames(&self) -> u64 {
        ((self.animation.duration * self.animation.fps).round() as u64).max(1)
    }

    /// Reports whether the animation is playing.
    pub fn is_playing(&self) -> bool {
        self.is_playing
    }

    /// Starts playback; at the end it restarts from the beginning.
    pub fn play(&mut self) {
        if !self.repeats && self.time >= self.animation.duration {
            self.time = 0.0;
        }
        self.is_playing = true;
    }

    /// Pauses playback.
    pub fn pause(&mut self) {
        self.is_playing = false;
    }

    /// Plays or pauses.
    pub fn toggle(&mut self) {
        if self.is_playing {
            self.pause();
        } else {
            self.play();
        }
    }

    /// Sets the time, clamped to the duration.
    pub fn scrub(&mut self, time: f64) {
        if time.is_finite() {
            self.time = time.max(0.0).min(self.animation.duration);
        }
    }

    /// Pauses and moves by a number of frames to the start of a frame. If the animation repeats, the
    /// frame index wraps around.
    pub fn step(&mut self, frames: i64) {
        self.pause();
        let count = i64::try_from(self.frames()).unwrap_or(i64::MAX);
        let now = i64::try_from(self.frame()).unwrap_or(i64::MAX);
        let target = now.saturating_add(frames);
        let frame = if self.repeats {
            target.rem_euclid(count)
        } else {
            target.clamp(0, count)
        };
        self.scrub(frame as f64 / self.animation.fps);
    }

    /// Reports whether the animation repeats at its end.
    pub fn repeats(&self) -> bool {
        self.repeats
    }

    /// Sets whether the animation repeats at its end.
    pub fn set_repeats(&mut self, repeats: bool) {
        self.repeats = repeats;
    }

    /// Returns the playback speed, relative to real time.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Sets the playback speed, clamped to [`SPEED_RANGE`].
    pub fn set_speed(&mut self, speed: f64) {
        if speed.is_finite() {
            self.speed = speed.clamp(SPEED_RANGE[0], SPEED_RANGE[1]);
        }
    }

    /// Advances the time while playing and reports whether it changed. At the end the animation repeats
    /// or stops.
    pub fn advance(&mut self, elapsed: Duration) -> bool {
        if !self.is_playing {
            return false;
        }
        let (previous, end) = (self.time, self.animation.duration);
        let mut time = previous + elapsed.as_secs_f64() * self.speed;
        if time >= end {
            if self.repeats {
                time %= end;
            } else {
                time = end;
                self.is_playing = false;
            }
        }
        self.time = time;
        self.time != previous
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn timeline(repeats: bool) -> Timeline {
        Timeline::new(Animation {
            duration: 4.0,
            fps: 30.0,
            repeats,
        })
    }

    fn seconds(s: f64) -> Duration {
        Duration::from_secs_f64(s)
    }

    #[test]
    fn time_stands_still_until_it_plays_and_after_a_pause() {
        let mut t = timeline(true);
        assert!(!t.advance(seconds(1.0)) && !t.is_playing());
        assert_eq!(t.time(), 0.0);
        t.play();
        assert!(t.advance(seconds(1.5)));
        assert_eq!(t.time(), 1.5);
        t.toggle();
        assert!(!t.advance(seconds(1.0)) && !t.is_playing());
        assert_eq!(t.time(), 1.5);
        t.toggle();
        assert!(t.is_playing() && !t.advance(Duration::ZERO));
    }

    #[test]
    fn at_its_end_it_starts_again_or_stops() {
        let mut t = timeline(true);
        t.play();
        t.advance(seconds(9.0));
        assert!((t.time() - 1.0).abs() < 1e-12 && t.is_playing());
        t.advance(seconds(3.0));
        assert_eq!(t.time(), 0.0, "the end is the start");

        let mut t = timeline(false);
        t.play();
        assert!(t.advance(seconds(9.0)));
        assert_eq!(t.time(), 4.0);
        assert!(!t.is_playing() && !t.advance(seconds(1.0)));
        t.play();
        assert_eq!(t.time(), 0.0, "from the end it starts again");

        t.set_repeats(true);
        t.advance(seconds(5.0));
        assert!((t.time() - 1.0).abs() < 1e-12 && t.repeats());
    }

    #[test]
    fn speed_is_a_factor_within_bounds() {
        let mut t = timeline(true);
        t.play();
        t.set_speed(0.25);
        t.advance(seconds(2.0));
        assert_eq!(t.time(), 0.5);
        for (given, taken) in [(1e9, 64.0), (-3.0, 1.0 / 64.0), (f64::NAN, 1.0 / 64.0)] {
            t.set_speed(given);
            assert_eq!(t.speed(), taken, "{given}");
        }
    }

    #[test]
    fn scrubbing_stays_within_the_animation() {
        let mut t = timeline(false);
        for (to, time) in [(2.5, 2.5), (-1.0, 0.0), (7.0, 4.0), (f64::NAN, 4.0)] {
            t.scrub(to);
            assert_eq!(t.time(), time, "{to}");
        }
    }

    #[test]
    fn frames_are_stepped_to_where_they_start() {
        let mut t = timeline(true);
        assert_eq!(t.frames(), 120);
        t.play();
        t.scrub(1.01);
        assert_eq!(t.frame(), 30);
        t.step(1);
        assert_eq!(t.frame(), 31);
        assert!((t.time() - 31.0 / 30.0).abs() < 1e-12 && !t.is_playing());
        t.step(-32);
        assert_eq!(t.frame(), 119, "before the first comes the last");
        // Every frame is reached by single steps, without one being shown twice: 1 / 49 * 49 is less
        // than 1.
        let mut t = Timeline::new(Animation {
            duration: 2.0,
            fps: 49.0,
            repeats: true,
        });
        for frame in 1..t.frames() {
            t.step(1);
            assert_eq!(t.frame(), frame);
        }
        let mut t = timeline(false);
        t.step(-5);
        assert_eq!(t.time(), 0.0);
        t.step(i64::MAX);
        assert_eq!(t.time(), 4.0);
    }

    #[test]
    fn an_edit_keeps_the_time_and_what_was_chosen() {
        let mut t = timeline(true);
        t.play();
        t.set_speed(2.0);
        t.set_repeats(false);
        t.scrub(3.0);
        let longer = Animation {
            duration: 8.0,
            fps: 10.0,
            repeats: true,
        };
        t.change(longer);
        assert_eq!((t.time(), t.speed(), t.duration()), (3.0, 2.0, 8.0));
        assert!(
            t.is_playing() && !t.repeats(),
            "the text says the same as before"
        );
        t.change(Animation {
            duration: 2.0,
            repeats: false,
            ..longer
        });
        assert_eq!(t.time(), 2.0);
        t.change(longer);
        assert!(t.repeats(), "the text says another thing than before");
    }
}
