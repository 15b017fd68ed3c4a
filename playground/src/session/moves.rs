//! What moves by itself or by hand: time and the camera.

use super::pace::REST;
use super::{CameraEvent, Session, TimeEvent, pixel};
use crate::camera::Place;
use crate::timeline::Timeline;
use std::time::Duration;

/// What is under a place of the picture. Pans and zooms that follow each other there keep it: the
/// pictures that come meanwhile show where the camera was, not where it is.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    place: Place,
    /// The point of a surface; none in the sky.
    point: Option<[f64; 3]>,
}

impl Session {
    /// Something moves by hand, or plays: what is to be seen is another, and perhaps again soon.
    pub(super) fn moves(&mut self, now: Duration) {
        self.wishes();
        self.moved = Some(now);
    }

    /// When it will have come to rest, if something moves.
    pub(super) fn rests_at(&self, now: Duration) -> Option<Duration> {
        self.moved.map(|at| at + REST).filter(|&at| at > now)
    }

    /// The time of the animation.
    pub(super) fn time(&self) -> f64 {
        self.timeline.as_ref().map_or(0.0, Timeline::time)
    }

    /// Whether time passes: not while there is nothing that could be drawn.
    pub(super) fn plays(&self) -> bool {
        self.drawable().is_some() && self.timeline.as_ref().is_some_and(Timeline::is_playing)
    }

    /// Lets the animation go on, once the picture of its last moment is there.
    pub(super) fn advance(&mut self, now: Duration) {
        if !self.plays() {
            self.clock = None;
            return;
        }
        if self.flight.is_some() {
            return;
        }
        let elapsed = self
            .clock
            .map_or(Duration::ZERO, |at| now.saturating_sub(at));
        self.clock = Some(now);
        let moved = self
            .timeline
            .as_mut()
            .is_some_and(|timeline| timeline.advance(elapsed));
        if moved {
            self.moves(now);
        }
    }

    pub(super) fn move_time(&mut self, event: TimeEvent, now: Duration) {
        let Some(timeline) = &mut self.timeline else {
            return;
        };
        let before = timeline.time();
        match event {
            TimeEvent::Toggle => {
                timeline.toggle();
                self.clock = Some(now);
            }
            TimeEvent::Scrub(time) => timeline.scrub(time),
            TimeEvent::Step(frames) => timeline.step(frames),
            TimeEvent::Repeat(repeats) => timeline.set_repeats(repeats),
            TimeEvent::Speed(speed) => timeline.set_speed(speed),
        }
        if timeline.time() != before {
            self.moves(now);
        }
    }

    fn aspect(&self) -> f64 {
        f64::from(self.size[0]) / f64::from(self.size[1])
    }

    /// The point of a surface that the picture shows at a place.
    fn point_at(&self, place: Place) -> Option<[f64; 3]> {
        let picture = &self.shown.as_ref()?.picture;
        let frame = &picture.frame;
        let [column, row] = pixel(place, [frame.width, frame.height])?;
        let depth = *frame.depth.get(row * frame.width + column)?;
        if !depth.is_finite() {
            return None;
        }
        let mut there = self.camera.clone()?;
        there.show(picture.settings.view);
        Some(there.point_under(place, Some(f64::from(depth)), self.aspect()))
    }

    /// The point that is held under a place.
    fn held_at(&self, place: Place) -> Option<[f64; 3]> {
        match self.held {
            Some(held) if held.place == place => held.point,
            _ => self.point_at(place),
        }
    }

    pub(super) fn move_camera(&mut self, event: CameraEvent, now: Duration) {
        if let CameraEvent::Scene(name) = event {
            self.camera_name = name;
            self.camera = None;
            self.own_view = false;
            self.held = None;
            self.wishes();
            return;
        }
        let aspect = self.aspect();
        let point = match &event {
            CameraEvent::Pan(place, _) | CameraEvent::Zoom(_, place) => self.held_at(*place),
            CameraEvent::Focus(place) => self.point_at(*place),
            _ => None,
        };
        let bounds = self.bounds().copied();
        let (Some(camera), Some(bounds)) = (&mut self.camera, bounds) else {
            return;
        };
        self.held = None;
        match event {
            CameraEvent::Orbit([right, up]) => camera.orbit(right, up),
            CameraEvent::Pan(from, to) => {
                camera.pan([to[0] - from[0], to[1] - from[1]], point, aspect);
                self.held = Some(Held { place: to, point });
            }
            CameraEvent::Zoom(factor, place) => {
                let fixed = point.unwrap_or_else(|| camera.point_under(place, None, aspect));
                camera.zoom(factor, fixed);
                self.held = Some(Held { place, point });
            }
            CameraEvent::Fit => camera.fit(&bounds, aspect),
            CameraEvent::Focus(_) => {
                if let Some(point) = point {
                    camera.focus(point);
                }
            }
            CameraEvent::Face(side) => camera.face(side),
            CameraEvent::ToggleLens => camera.toggle_lens(&bounds),
            CameraEvent::Scene(_) => {}
        }
        self.own_view = true;
        self.moves(now);
    }
}
