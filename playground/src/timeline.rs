//! The time of a scene that moves: played, paused, scrubbed, faster or slower, and at its end over
//! again or not.
//!
//! It knows no clock: whoever has one says how much time has passed. While it stands still it wants
//! no frames.

use sdfc_vm::settings::Animation;
use std::time::Duration;

/// The slowest and the fastest speed.
pub const SPEEDS: [f64; 2] = [1.0 / 64.0, 64.0];

/// The time of an animation, in seconds from its start.
#[derive(Clone, Debug, PartialEq)]
pub struct Timeline {
    animation: Animation,
    time: f64,
    speed: f64,
    plays: bool,
    repeats: bool,
}

impl Timeline {
    /// The start of an animation, paused.
    pub fn new(animation: Animation) -> Self {
        Self {
            animation,
            time: 0.0,
            speed: 1.0,
            plays: false,
            repeats: animation.repeats,
        }
    }

    /// Goes on with what the animation has become after an edit: the time stays as far as it can, and
    /// so does what was chosen by hand.
    pub fn change(&mut self, animation: Animation) {
        if animation.repeats != self.animation.repeats {
            self.repeats = animation.repeats;
        }
        self.animation = animation;
        self.scrub(self.time);
    }

    /// The present time in seconds.
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Its length in seconds.
    pub fn duration(&self) -> f64 {
        self.animation.duration
    }

    /// The number of the frame that a film of it shows now, from 0.
    pub fn frame(&self) -> u64 {
        // A time that stands for a frame's start may be a rounding short of it.
        (self.time * self.animation.fps + 1e-6).floor() as u64
    }

    /// How many frames a film of it has, at least one.
    pub fn frames(&self) -> u64 {
        ((self.animation.duration * self.animation.fps).round() as u64).max(1)
    }

    /// Whether time passes: then it wants frames.
    pub fn is_playing(&self) -> bool {
        self.plays
    }

    /// Lets time pass; from the end, it starts again.
    pub fn play(&mut self) {
        if !self.repeats && self.time >= self.animation.duration {
            self.time = 0.0;
        }
        self.plays = true;
    }

    /// Lets it stand still.
    pub fn pause(&mut self) {
        self.plays = false;
    }

    /// Plays or pauses.
    pub fn toggle(&mut self) {
        if self.plays {
            self.pause();
        } else {
            self.play();
        }
    }

    /// Goes to a time; what is before the start or after the end becomes these.
    pub fn scrub(&mut self, time: f64) {
        if time.is_finite() {
            self.time = time.max(0.0).min(self.animation.duration);
        }
    }

    /// Pauses, and goes so many frames on (or back), to where a frame starts; around the ends where
    /// it repeats.
    pub fn step(&mut self, frames: i64) {
        self.pause();
        let count = i64::try_from(self.frames()).unwrap_or(i64::MAX);
        let now = i64::try_from(self.frame()).unwrap_or(i64::MAX);
        let wanted = now.saturating_add(frames);
        let frame = if self.repeats {
            wanted.rem_euclid(count)
        } else {
            wanted.clamp(0, count)
        };
        self.scrub(frame as f64 / self.animation.fps);
    }

    /// Whether it starts again at its end.
    pub fn repeats(&self) -> bool {
        self.repeats
    }

    /// Whether it is to start again at its end.
    pub fn set_repeats(&mut self, repeats: bool) {
        self.repeats = repeats;
    }

    /// How many seconds of it pass in one.
    pub fn speed(&self) -> f64 {
        self.speed
    }

    /// Sets how many seconds of it pass in one, within [`SPEEDS`].
    pub fn set_speed(&mut self, speed: f64) {
        if speed.is_finite() {
            self.speed = speed.clamp(SPEEDS[0], SPEEDS[1]);
        }
    }

    /// Lets so much time pass, if it plays, and says whether its time is another now. At the end it
    /// starts again or stops.
    pub fn advance(&mut self, elapsed: Duration) -> bool {
        if !self.plays {
            return false;
        }
        let (before, end) = (self.time, self.animation.duration);
        let mut time = before + elapsed.as_secs_f64() * self.speed;
        if time >= end {
            if self.repeats {
                time %= end;
            } else {
                time = end;
                self.plays = false;
            }
        }
        self.time = time;
        self.time != before
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
