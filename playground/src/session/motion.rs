//! Motion of the time and of the camera.

use super::refinement::REST_DELAY;
use super::{CameraEvent, Session, TimeEvent, pixel};
use crate::camera::Ndc;
use crate::timeline::Timeline;
use std::time::Duration;

/// The surface point under a point of the picture. Successive pans and zooms at the same point reuse it,
/// because the displayed pictures lag behind the camera.
#[derive(Clone, Copy, Debug)]
pub(super) struct Anchor {
    ndc: Ndc,
    /// Surface point in scene coordinates; `None` for the sky.
    point: Option<[f64; 3]>,
}

impl Session {
    /// Records a manual or animated motion and marks the picture as outdated.
    pub(super) fn on_motion(&mut self, now: Duration) {
        self.invalidate_view();
        self.last_motion = Some(now);
    }

    /// Returns the time at which the current motion counts as ended; `None` at rest.
    pub(super) fn rests_at(&self, now: Duration) -> Option<Duration> {
        self.last_motion
            .map(|time| time + REST_DELAY)
            .filter(|&time| time > now)
    }

    /// Returns the animation time in seconds.
    pub(super) fn time(&self) -> f64 {
        self.timeline.as_ref().map_or(0.0, Timeline::time)
    }

    /// Reports whether the animation is advancing. It does not advance while nothing can be drawn.
    pub(super) fn is_playing(&self) -> bool {
        self.drawable().is_some() && self.timeline.as_ref().is_some_and(Timeline::is_playing)
    }

    /// Advances the animation once the previous frame has been drawn.
    pub(super) fn advance(&mut self, now: Duration) {
        if !self.is_playing() {
            self.last_tick = None;
            return;
        }
        if self.in_flight.is_some() {
            return;
        }
        let elapsed = self
            .last_tick
            .map_or(Duration::ZERO, |time| now.saturating_sub(time));
        self.last_tick = Some(now);
        let has_changed = self
            .timeline
            .as_mut()
            .is_some_and(|timeline| timeline.advance(elapsed));
        if has_changed {
            self.on_motion(now);
        }
    }

    pub(super) fn move_time(&mut self, event: TimeEvent, now: Duration) {
        let Some(timeline) = &mut self.timeline else {
            return;
        };
        let previous_time = timeline.time();
        match event {
            TimeEvent::Toggle => {
                timeline.toggle();
                self.last_tick = Some(now);
            }
            TimeEvent::Scrub(time) => timeline.scrub(time),
            TimeEvent::Step(frames) => timeline.step(frames),
            TimeEvent::Repeat(repeats) => timeline.set_repeats(repeats),
            TimeEvent::Speed(speed) => timeline.set_speed(speed),
        }
        if timeline.time() != previous_time {
            self.on_motion(now);
        }
    }

    fn aspect(&self) -> f64 {
        f64::from(self.size[0]) / f64::from(self.size[1])
    }

    /// Returns the surface point that the displayed picture shows at a point in normalised device
    /// coordinates.
    fn point_at(&self, ndc: Ndc) -> Option<[f64; 3]> {
        let picture = &self.displayed.as_ref()?.picture;
        let image = &picture.image;
        let [column, row] = pixel(ndc, [image.width, image.height])?;
        let depth = *image.depth.get(row * image.width + column)?;
        if !depth.is_finite() {
            return None;
        }
        let mut displayed_camera = self.camera.clone()?;
        displayed_camera.set_view(picture.settings.view);
        Some(displayed_camera.point_under(ndc, Some(f64::from(depth)), self.aspect()))
    }

    /// Returns the anchored surface point, or the displayed one if the anchor is elsewhere.
    fn anchor_at(&self, ndc: Ndc) -> Option<[f64; 3]> {
        match self.anchor {
            Some(held) if held.ndc == ndc => held.point,
            _ => self.point_at(ndc),
        }
    }

    pub(super) fn move_camera(&mut self, event: CameraEvent, now: Duration) {
        if let CameraEvent::Scene(name) = event {
            self.camera_name = name;
            self.camera = None;
            self.is_camera_moved = false;
            self.anchor = None;
            self.invalidate_view();
            return;
        }
        let aspect = self.aspect();
        let point = match &event {
            CameraEvent::Pan(ndc, _) | CameraEvent::Zoom(_, ndc) => self.anchor_at(*ndc),
            CameraEvent::Focus(ndc) => self.point_at(*ndc),
            _ => None,
        };
        let bounds = self.bounds().copied();
        let (Some(camera), Some(bounds)) = (&mut self.camera, bounds) else {
            return;
        };
        self.anchor = None;
        match event {
            CameraEvent::Orbit([right, up]) => camera.orbit(right, up),
            CameraEvent::Pan(from, to) => {
                camera.pan([to[0] - from[0], to[1] - from[1]], point, aspect);
                self.anchor = Some(Anchor { ndc: to, point });
            }
            CameraEvent::Zoom(factor, ndc) => {
                let fixed_point = point.unwrap_or_else(|| camera.point_under(ndc, None, aspect));
                camera.zoom(factor, fixed_point);
                self.anchor = Some(Anchor { ndc, point });
            }
            CameraEvent::Fit => camera.fit(&bounds, aspect),
            CameraEvent::Focus(_) => {
                if let Some(point) = point {
                    camera.focus(point);
                }
            }
            CameraEvent::Face(side) => camera.view_from(side),
            CameraEvent::ToggleLens => camera.toggle_lens(&bounds),
            CameraEvent::Scene(_) => {}
        }
        self.is_camera_moved = true;
        self.on_motion(now);
    }
}
