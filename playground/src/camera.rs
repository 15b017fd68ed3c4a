//! A camera controlled by the mouse. It orbits around its look-at point, pans, zooms to the point under the
//! cursor, fits a box into the picture, and looks along the axes.
//!
//! The camera only changes a [`View`]; without motion it returns the given view unchanged. It orbits like
//! a turntable: horizontally around a fixed axis, vertically at most to the poles, so it never flips. The
//! axis is the scene's up direction if the given view is not tilted sideways, else the view's own up
//! direction. A 2-D shape is always viewed face on; its camera only pans and zooms.
//!
//! Points of the picture are in normalised device coordinates, from (-1, -1) in the lower left corner to
//! (1, 1) in the upper right corner. `aspect` is width divided by height. Angles are in radians.

mod text;

use glam::DVec3;
use sdfc_runtime::render::{Axes, ResolvedLens, View};
use sdfc_runtime::settings::{self, ViewSide};
use sdfc_vm::bounds::Bounds;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// A point of the picture in normalised device coordinates.
pub type Ndc = [f64; 2];

/// Returns azimuth and elevation of the camera at a side, relative to the front.
fn angles(side: ViewSide) -> [f64; 2] {
    match side {
        ViewSide::Front => [0.0, 0.0],
        ViewSide::Back => [PI, 0.0],
        ViewSide::Left => [-FRAC_PI_2, 0.0],
        ViewSide::Right => [FRAC_PI_2, 0.0],
        ViewSide::Top => [0.0, FRAC_PI_2],
        ViewSide::Bottom => [0.0, -FRAC_PI_2],
        ViewSide::Corner => [FRAC_PI_4, 0.5_f64.sqrt().atan()],
    }
}

/// A movable camera; see [the module](self).
#[derive(Clone, Debug, PartialEq)]
pub struct OrbitCamera {
    view: View,
    /// Axis of the turntable: unit length, perpendicular to the view's right.
    axis: DVec3,
    /// The scene's up direction.
    world_up: DVec3,
    /// Field of view restored when switching back from parallel rays.
    fov: f64,
    is_2d: bool,
}

/// Default field of view of the language.
const DEFAULT_FOV: f64 = 35.0 * PI / 180.0;
/// Minimum distance to the look-at point, as a fraction of its largest coordinate. Engines compute with
/// seven digits.
const MIN_RELATIVE_DISTANCE: f64 = 1e-5;
/// Range of the distance to the look-at point, or of the height of an orthographic picture.
const DISTANCE_RANGE: [f64; 2] = [1e-9, 1e12];
/// Range of the zoom factor of one event.
const ZOOM_FACTOR_RANGE: [f64; 2] = [1e-3, 1e3];

impl OrbitCamera {
    /// Creates a camera from a view. `z_up` states that z points up in the scene, `is_2d` that the scene
    /// is a 2-D shape.
    pub fn new(view: View, z_up: bool, is_2d: bool) -> Self {
        let world_up = if z_up { DVec3::Z } else { DVec3::Y };
        let mut camera = Self {
            view,
            axis: world_up,
            world_up,
            fov: DEFAULT_FOV,
            is_2d,
        };
        camera.set_view(view);
        camera
    }

    /// Sets the view.
    pub fn set_view(&mut self, view: View) {
        self.view = view;
        if let ResolvedLens::Perspective(fov) = view.lens {
            self.fov = fov;
        }
        let basis = Basis::from_view(&view);
        let right_lean = basis.right.dot(self.world_up);
        self.axis = if right_lean.abs() > 1e-9 {
            DVec3::from(view.up).normalize_or(basis.up)
        } else if basis.up.dot(self.world_up) < -1e-9 {
            -self.world_up
        } else {
            self.world_up
        };
        if basis.right.dot(self.axis).abs() > 1e-9 {
            // An up direction along the line of sight does not determine the roll.
            self.axis = basis.up;
        }
    }

    /// Returns the view.
    pub fn view(&self) -> View {
        self.view
    }

    /// Returns the distance from the camera to its look-at point.
    pub fn distance(&self) -> f64 {
        self.view.target_distance()
    }

    /// Reports whether the rays are parallel.
    pub fn is_orthographic(&self) -> bool {
        matches!(self.view.lens, ResolvedLens::Orthographic(_))
    }

    /// Reports whether the camera shows a 2-D shape, so that it only pans and zooms.
    pub fn is_2d(&self) -> bool {
        self.is_2d
    }

    /// Returns the point at a depth along the ray through a point of the picture. Without a finite depth,
    /// the point lies in the plane of the look-at point.
    pub fn point_under(&self, ndc: Ndc, depth: Option<f64>, aspect: f64) -> [f64; 3] {
        let axes = Axes::from_view(&self.view, aspect);
        let interpolate = |[middle, right, up]: [DVec3; 3]| middle + right * ndc[0] + up * ndc[1];
        let start = [axes.origin, axes.origin_right, axes.origin_up];
        let start = interpolate(start.map(DVec3::from));
        let direction = [axes.forward, axes.forward_right, axes.forward_up];
        let direction = interpolate(direction.map(DVec3::from));
        let ray_scale = match depth.filter(|depth| depth.is_finite()) {
            Some(depth) => depth / direction.length(),
            None => self.distance(),
        };
        (start + direction * ray_scale).into()
    }

    /// Projects a point into the picture; the result may lie outside its edges. Returns `None` for points
    /// behind the camera.
    pub fn project(&self, point: [f64; 3], aspect: f64) -> Option<Ndc> {
        let basis = Basis::from_view(&self.view);
        let direction = DVec3::from(point) - DVec3::from(self.view.from);
        let half_height = match self.view.lens {
            ResolvedLens::Perspective(fov) => -direction.dot(basis.back) * (fov / 2.0).tan(),
            ResolvedLens::Orthographic(height) => height / 2.0,
        };
        (half_height > 0.0).then(|| {
            [
                direction.dot(basis.right) / (half_height * aspect),
                direction.dot(basis.up) / half_height,
            ]
        })
    }

    /// Orbits around the look-at point by two angles: to the right, and up.
    pub fn orbit(&mut self, right: f64, up: f64) {
        let basis = Basis::from_view(&self.view);
        let elevation = basis.back.dot(self.axis).atan2(basis.up.dot(self.axis));
        if right.is_finite() && up.is_finite() {
            self.set_orbit(rotated(basis.right, self.axis, right), elevation + up);
        }
    }

    /// Views the scene from a side, keeping the look-at point and the distance.
    pub fn view_from(&mut self, side: ViewSide) {
        self.axis = self.world_up;
        let [around, elevation] = angles(side);
        let right = rotated(DVec3::X, self.axis, around);
        self.set_orbit(right, elevation);
    }

    /// Moves the camera to a right direction, perpendicular to the turntable axis, and an elevation.
    fn set_orbit(&mut self, right: DVec3, elevation: f64) {
        if self.is_2d {
            return;
        }
        let (sine, cosine) = elevation.clamp(-FRAC_PI_2, FRAC_PI_2).sin_cos();
        let horizontal_back = right.cross(self.axis);
        let back = horizontal_back * cosine + self.axis * sine;
        let look = DVec3::from(self.view.look);
        self.view.from = (look + back * self.distance()).into();
        self.view.up = (self.axis * cosine - horizontal_back * sine).into();
    }

    /// Moves the camera parallel to the picture so that the surface point `anchor`, and everything at its
    /// depth, moves by `delta` in the picture. Without an anchor the depth of the look-at point is used.
    pub fn pan(&mut self, delta: Ndc, anchor: Option<[f64; 3]>, aspect: f64) {
        let basis = Basis::from_view(&self.view);
        let half_height = match self.view.lens {
            ResolvedLens::Perspective(fov) => {
                let from = DVec3::from(self.view.from);
                let depth_of = |p: [f64; 3]| (from - DVec3::from(p)).dot(basis.back);
                let depth = anchor.map(depth_of).filter(|depth| *depth > 0.0);
                depth.unwrap_or(self.distance()) * (fov / 2.0).tan()
            }
            ResolvedLens::Orthographic(height) => height / 2.0,
        };
        self.translate(
            basis.right * (-delta[0] * half_height * aspect) - basis.up * (delta[1] * half_height),
        );
    }

    /// Shrinks (a factor above 1) or enlarges the picture, while a point keeps its position in it.
    pub fn zoom(&mut self, factor: f64, fixed: [f64; 3]) {
        if !factor.is_finite() || fixed.iter().any(|v| !v.is_finite()) {
            return;
        }
        let fixed = DVec3::from(fixed);
        let size = match self.view.lens {
            ResolvedLens::Perspective(_) => self.distance(),
            ResolvedLens::Orthographic(height) => height,
        };
        if size <= 0.0 {
            return;
        }
        let max_coordinate = self.view.look.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let min_size = DISTANCE_RANGE[0]
            .max(MIN_RELATIVE_DISTANCE * max_coordinate)
            .min(size);
        let new_size = size * factor.clamp(ZOOM_FACTOR_RANGE[0], ZOOM_FACTOR_RANGE[1]);
        let new_size = new_size.max(min_size).min(DISTANCE_RANGE[1].max(size));
        let factor = new_size / size;
        match self.view.lens {
            ResolvedLens::Perspective(_) => {
                // Camera and look-at point are scaled around the fixed point, so its projection does not
                // change.
                let scale_point =
                    |p: [f64; 3]| (fixed + (DVec3::from(p) - fixed) * factor).to_array();
                self.view.from = scale_point(self.view.from);
                self.view.look = scale_point(self.view.look);
            }
            ResolvedLens::Orthographic(_) => {
                self.view.lens = ResolvedLens::Orthographic(new_size);
                let back = Basis::from_view(&self.view).back;
                let offset = fixed - DVec3::from(self.view.look);
                self.translate((offset - back * offset.dot(back)) * (1.0 - factor));
            }
        }
    }

    /// Looks at another point, with the same direction and distance.
    pub fn focus(&mut self, point: [f64; 3]) {
        let mut delta = DVec3::from(point) - DVec3::from(self.view.look);
        if self.is_2d {
            delta.z = 0.0;
        }
        self.translate(delta);
    }

    /// Fits a bounding box into the picture; infinite extents are ignored.
    pub fn fit(&mut self, bounds: &Bounds, aspect: f64) {
        self.view = settings::fit(self.view, bounds, aspect, self.is_2d);
    }

    /// Switches between perspective and parallel rays. The look-at point keeps its size. With parallel
    /// rays the camera moves outside the scene's bounds, if finite, because geometry behind it would not
    /// be rendered.
    pub fn toggle_lens(&mut self, bounds: &Bounds) {
        if self.is_2d {
            return;
        }
        let look = DVec3::from(self.view.look);
        let back = Basis::from_view(&self.view).back;
        let (lens, distance) = match self.view.lens {
            ResolvedLens::Perspective(fov) => {
                let distance = self.distance();
                let min_distance = if bounds.is_finite() {
                    look.distance(bounds.centre().into()) + 1.01 * bounds.half_diagonal()
                } else {
                    0.0
                };
                let height = 2.0 * distance * (fov / 2.0).tan();
                (
                    ResolvedLens::Orthographic(height),
                    distance.max(min_distance),
                )
            }
            ResolvedLens::Orthographic(height) => {
                let distance = height / (2.0 * (self.fov / 2.0).tan());
                (ResolvedLens::Perspective(self.fov), distance)
            }
        };
        self.view.from = (look + back * distance).into();
        self.view.lens = lens;
    }

    fn translate(&mut self, delta: DVec3) {
        let [from, look] = [self.view.from, self.view.look].map(|p| DVec3::from(p) + delta);
        if from.is_finite() && look.is_finite() {
            (self.view.from, self.view.look) = (from.into(), look.into());
        }
    }
}

/// Orthonormal basis of a view.
#[derive(Clone, Copy, Debug)]
struct Basis {
    right: DVec3,
    up: DVec3,
    back: DVec3,
}

impl Basis {
    /// Returns the basis that engines use for a view.
    fn from_view(view: &View) -> Self {
        let axes = Axes::from_view(view, 1.0);
        let back = -DVec3::from(axes.forward);
        // One of the two is zero: rays differ either in origin or in direction.
        let right = DVec3::from(axes.origin_right) + DVec3::from(axes.forward_right);
        let right = right.normalize_or(DVec3::X);
        Self {
            right,
            up: back.cross(right),
            back,
        }
    }
}

/// Rotates a direction around a perpendicular axis.
fn rotated(direction: DVec3, axis: DVec3, angle: f64) -> DVec3 {
    direction * angle.cos() + axis.cross(direction) * angle.sin()
}

#[cfg(test)]
mod tests;
