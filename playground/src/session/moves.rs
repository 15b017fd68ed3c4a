//! What moves by itself or by hand: time and the camera.

use super::{CameraEvent, Session, TimeEvent, pixel};
use crate::camera::Place;
use crate::timeline::Timeline;
use std::time::Duration;

impl Session {
    /// The time of the animation.
    pub(super) fn time(&self) -> f64 {
        self.timeline.as_ref().map_or(0.0, Timeline::time)
    }

    pub(super) fn plays(&self) -> bool {
        self.timeline.as_ref().is_some_and(Timeline::is_playing)
    }

    /// Lets the animation go on, once the picture of its last moment is there.
    pub(super) fn advance(&mut self, now: Duration) {
        if !self.plays() {
            self.clock = None;
            return;
        }
        if !self.flights.is_empty() {
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

    /// How far the ray goes that is seen at a place.
    fn depth(&self, place: Place) -> Option<f64> {
        let frame = &self.shown.as_ref()?.picture.frame;
        let at = pixel(place, [frame.width, frame.height])?;
        let depth = frame.depth.get(at[1] * frame.width + at[0])?;
        depth.is_finite().then_some(f64::from(*depth))
    }

    pub(super) fn move_camera(&mut self, event: CameraEvent, now: Duration) {
        if let CameraEvent::Scene(name) = event {
            self.camera_name = name;
            self.camera = None;
            self.own_view = false;
            self.wishes(now);
            return;
        }
        let aspect = self.aspect();
        let place = match &event {
            CameraEvent::Pan(place, _)
            | CameraEvent::Zoom(_, place)
            | CameraEvent::Focus(place) => *place,
            _ => [0.0; 2],
        };
        let depth = self.depth(place);
        let bounds = self.scene.as_ref().map(|scene| {
            let settings = &scene.opened.compiled.module.settings;
            *settings.space()
        });
        let (Some(camera), Some(bounds)) = (&mut self.camera, bounds) else {
            return;
        };
        match event {
            CameraEvent::Orbit([right, up]) => camera.orbit(right, up),
            CameraEvent::Pan(from, to) => {
                let held = depth.map(|depth| camera.point_under(from, Some(depth), aspect));
                camera.pan([to[0] - from[0], to[1] - from[1]], held, aspect);
            }
            CameraEvent::Zoom(factor, place) => camera.zoom(factor, place, depth, aspect),
            CameraEvent::Fit => camera.fit(&bounds, aspect),
            CameraEvent::Focus(place) => {
                if let Some(depth) = depth {
                    camera.focus(camera.point_under(place, Some(depth), aspect));
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
