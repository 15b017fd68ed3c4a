//! The camera that follows the mouse: it orbits around what it looks at, pans, zooms to the point
//! under the cursor, fits a box into the picture, and looks along the axes.
//!
//! A [`View`] is all that it changes, and as long as nothing moves it the view is the very one that
//! was given. It turns like a turntable: to the side around an axis that stays, up and down by no
//! more than straight from above and below, so nothing ever flips over. Where the given view does not
//! lean to a side, the axis is the scene's upward direction, else the view's own. A plane figure is
//! always seen face on; its camera pans and zooms only.
//!
//! Places in the picture go from (-1, -1) in its lower left corner to (1, 1) in its upper right one;
//! `aspect` is the picture's width divided by its height; angles are in radians.

mod text;

use sdfc_runtime::frame::{Axes, Lens, View};
use sdfc_runtime::settings;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI};

/// A place in the picture.
pub type Place = [f64; 2];

/// From where a scene is seen by a view key.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// From the front: +z, or -y where z points up.
    Front,
    /// From behind.
    Back,
    /// From -x.
    Left,
    /// From +x.
    Right,
    /// From above; the front is at the picture's lower edge.
    Top,
    /// From below; the front is at the picture's upper edge.
    Bottom,
    /// From above, in front and the right at once: the three axes look equally long.
    Isometric,
}

impl Side {
    /// How far around the upward axis, and how far up, the camera is from the front.
    fn angles(self) -> [f64; 2] {
        match self {
            Self::Front => [0.0, 0.0],
            Self::Back => [PI, 0.0],
            Self::Left => [-FRAC_PI_2, 0.0],
            Self::Right => [FRAC_PI_2, 0.0],
            Self::Top => [0.0, FRAC_PI_2],
            Self::Bottom => [0.0, -FRAC_PI_2],
            Self::Isometric => [FRAC_PI_4, 0.5_f64.sqrt().atan()],
        }
    }
}

/// A camera that can be moved; see [the module](self).
#[derive(Clone, Debug, PartialEq)]
pub struct Camera {
    view: View,
    /// The axis of the turntable: of length one, and at a right angle to the view's right.
    axis: V3<f64>,
    /// The scene's upward direction.
    upright: V3<f64>,
    /// The field of view to go back to from parallel rays.
    fov: f64,
    plane: bool,
}

/// The field of view of a camera that never had one, as in the language.
const FIELD_OF_VIEW: f64 = 35.0 * PI / 180.0;
/// How small the way to what is looked at may become, as a share of the largest coordinate there:
/// engines compute with seven digits.
const NEAREST: f64 = 1e-5;
/// The smallest and the largest way or height at all.
const WAYS: [f64; 2] = [1e-9, 1e12];
/// How much the picture may grow or shrink at once.
const ZOOMS: [f64; 2] = [1e-3, 1e3];

impl Camera {
    /// A camera with this view; whether the scene says that z points up, and whether it is a plane
    /// figure.
    pub fn new(view: View, z_up: bool, plane: bool) -> Self {
        let upright = if z_up {
            V3::of(0.0, 0.0, 1.0)
        } else {
            V3::of(0.0, 1.0, 0.0)
        };
        let mut camera = Self {
            view,
            axis: upright,
            upright,
            fov: FIELD_OF_VIEW,
            plane,
        };
        camera.show(view);
        camera
    }

    /// Goes to another view.
    pub fn show(&mut self, view: View) {
        self.view = view;
        if let Lens::Perspective(fov) = view.lens {
            self.fov = fov;
        }
        let basis = Basis::of(&view);
        let lean = basis.right.dot(self.upright);
        self.axis = if lean.abs() > 1e-9 {
            unit(vector(view.up)).unwrap_or(basis.up)
        } else if basis.up.dot(self.upright) < -1e-9 {
            -self.upright
        } else {
            self.upright
        };
        if basis.right.dot(self.axis).abs() > 1e-9 {
            // An upward direction along the view says nothing.
            self.axis = basis.up;
        }
    }

    /// The view.
    pub fn view(&self) -> View {
        self.view
    }

    /// How far the camera is from what it looks at.
    pub fn distance(&self) -> f64 {
        (vector(self.view.look) - vector(self.view.from)).length()
    }

    /// Whether its rays are parallel.
    pub fn is_orthographic(&self) -> bool {
        matches!(self.view.lens, Lens::Orthographic(_))
    }

    /// Whether it shows a plane figure, and only pans and zooms.
    pub fn is_plane(&self) -> bool {
        self.plane
    }

    /// What is seen at a place of the picture, so far along its ray; without a way, or an endless
    /// one, on the plane of what the camera looks at.
    pub fn point_under(&self, place: Place, depth: Option<f64>, aspect: f64) -> [f64; 3] {
        let axes = Axes::of_view(&self.view, aspect);
        let across =
            |middle, right, up| vector(middle) + vector(right) * place[0] + vector(up) * place[1];
        let start = across(axes.origin, axes.origin_right, axes.origin_up);
        let way = across(axes.forward, axes.forward_right, axes.forward_up);
        let times = match depth.filter(|depth| depth.is_finite()) {
            Some(depth) => depth / way.length(),
            None => self.distance(),
        };
        array(start + way * times)
    }

    /// Where a point is seen, perhaps beyond the edges of the picture; none for one behind the camera.
    pub fn place_of(&self, point: [f64; 3], aspect: f64) -> Option<Place> {
        let basis = Basis::of(&self.view);
        let way = vector(point) - vector(self.view.from);
        let half = match self.view.lens {
            Lens::Perspective(fov) => -way.dot(basis.back) * (fov / 2.0).tan(),
            Lens::Orthographic(height) => height / 2.0,
        };
        (half > 0.0).then(|| {
            [
                way.dot(basis.right) / (half * aspect),
                way.dot(basis.up) / half,
            ]
        })
    }

    /// Moves around what it looks at: so far to its right, and so far up.
    pub fn orbit(&mut self, right: f64, up: f64) {
        let basis = Basis::of(&self.view);
        let elevation = basis.back.dot(self.axis).atan2(basis.up.dot(self.axis));
        if right.is_finite() && up.is_finite() {
            self.stand(turned(basis.right, self.axis, right), elevation + up);
        }
    }

    /// Looks from a side, at the same point and from as far away as before.
    pub fn face(&mut self, side: Side) {
        self.axis = self.upright;
        let [around, elevation] = side.angles();
        let right = turned(V3::of(1.0, 0.0, 0.0), self.axis, around);
        self.stand(right, elevation);
    }

    /// Goes where the right is this direction, level with the turntable, and the camera is so high above what it looks at.
    fn stand(&mut self, right: V3<f64>, elevation: f64) {
        if self.plane {
            return;
        }
        let (sine, cosine) = elevation.clamp(-FRAC_PI_2, FRAC_PI_2).sin_cos();
        let behind = right.cross(self.axis);
        let back = behind * cosine + self.axis * sine;
        let look = vector(self.view.look);
        self.view.from = array(look + back * self.distance());
        self.view.up = array(self.axis * cosine - behind * sine);
    }

    /// Moves across the view so that what was seen at one place comes to lie `by` beside it. That is
    /// true of `held`, and of all that is as far away: without it, of what the camera looks at.
    pub fn pan(&mut self, by: Place, held: Option<[f64; 3]>, aspect: f64) {
        let basis = Basis::of(&self.view);
        let half = match self.view.lens {
            Lens::Perspective(fov) => {
                let ahead = |p| (vector(self.view.from) - vector(p)).dot(basis.back);
                let way = held.map(ahead).filter(|way| *way > 0.0);
                way.unwrap_or(self.distance()) * (fov / 2.0).tan()
            }
            Lens::Orthographic(height) => height / 2.0,
        };
        self.shift(basis.right * (-by[0] * half * aspect) - basis.up * (by[1] * half));
    }

    /// Makes what it looks at smaller (a factor above 1) or larger, while a point stays where it is
    /// seen.
    pub fn zoom(&mut self, factor: f64, fixed: [f64; 3]) {
        if !factor.is_finite() || fixed.iter().any(|v| !v.is_finite()) {
            return;
        }
        let fixed = vector(fixed);
        let size = match self.view.lens {
            Lens::Perspective(_) => self.distance(),
            Lens::Orthographic(height) => height,
        };
        if size <= 0.0 {
            return;
        }
        let farthest = self.view.look.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
        let nearest = WAYS[0].max(NEAREST * farthest).min(size);
        let wanted = size * factor.clamp(ZOOMS[0], ZOOMS[1]);
        let wanted = wanted.max(nearest).min(WAYS[1].max(size));
        let factor = wanted / size;
        match self.view.lens {
            Lens::Perspective(_) => {
                // All is scaled around the point: from there nothing looks changed.
                let scaled = |p| array(fixed + (vector(p) - fixed) * factor);
                self.view.from = scaled(self.view.from);
                self.view.look = scaled(self.view.look);
            }
            Lens::Orthographic(_) => {
                self.view.lens = Lens::Orthographic(wanted);
                let back = Basis::of(&self.view).back;
                let beside = fixed - vector(self.view.look);
                self.shift((beside - back * beside.dot(back)) * (1.0 - factor));
            }
        }
    }

    /// Looks at another point, in the same direction and from as far away as before.
    pub fn focus(&mut self, point: [f64; 3]) {
        let by = vector(point) - vector(self.view.look);
        self.shift(if self.plane {
            V3::of(by.x, by.y, 0.0)
        } else {
            by
        });
    }

    /// Shows all of a box; of an endless one, what is finite.
    pub fn fit(&mut self, bounds: &Bounds, aspect: f64) {
        self.view = settings::fit(self.view, bounds, aspect, self.plane);
    }

    /// Changes between perspective and parallel rays; what the camera looks at keeps its size. With
    /// parallel rays it stands clear of the scene's bounds, where these are finite: what is behind it
    /// would not be seen.
    pub fn toggle_lens(&mut self, bounds: &Bounds) {
        if self.plane {
            return;
        }
        let (look, back) = (vector(self.view.look), Basis::of(&self.view).back);
        let (lens, way) = match self.view.lens {
            Lens::Perspective(fov) => {
                let way = self.distance();
                let clear = if bounds.is_finite() {
                    (look - vector(bounds.centre())).length() + 1.01 * bounds.half_diagonal()
                } else {
                    0.0
                };
                let height = 2.0 * way * (fov / 2.0).tan();
                (Lens::Orthographic(height), way.max(clear))
            }
            Lens::Orthographic(height) => {
                let way = height / (2.0 * (self.fov / 2.0).tan());
                (Lens::Perspective(self.fov), way)
            }
        };
        self.view.from = array(look + back * way);
        self.view.lens = lens;
    }

    fn shift(&mut self, by: V3<f64>) {
        let [from, look] = [self.view.from, self.view.look].map(|p| array(vector(p) + by));
        if from.iter().chain(&look).all(|v| v.is_finite()) {
            (self.view.from, self.view.look) = (from, look);
        }
    }
}

/// The directions of a view, at right angles and of length one.
#[derive(Clone, Copy, Debug)]
struct Basis {
    right: V3<f64>,
    up: V3<f64>,
    back: V3<f64>,
}

impl Basis {
    /// Those that engines use for this view.
    fn of(view: &View) -> Self {
        let axes = Axes::of_view(view, 1.0);
        let back = -vector(axes.forward);
        // Of the two, one is zero: rays start or spread to the right.
        let right = vector(axes.origin_right) + vector(axes.forward_right);
        let right = unit(right).unwrap_or(V3::of(1.0, 0.0, 0.0));
        Self {
            right,
            up: back.cross(right),
            back,
        }
    }
}

/// A direction at a right angle to an axis, turned around it.
fn turned(direction: V3<f64>, axis: V3<f64>, angle: f64) -> V3<f64> {
    direction * angle.cos() + axis.cross(direction) * angle.sin()
}

fn vector([x, y, z]: [f64; 3]) -> V3<f64> {
    V3::of(x, y, z)
}
fn array(v: V3<f64>) -> [f64; 3] {
    [v.x, v.y, v.z]
}
/// The direction; none for a vector of no length.
fn unit(v: V3<f64>) -> Option<V3<f64>> {
    let length = v.length();
    (length > 0.0 && length.is_finite()).then(|| v * (1.0 / length))
}

#[cfg(test)]
mod tests;
