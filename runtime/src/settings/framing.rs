//! Where a camera goes that the scene leaves to us, and what else follows from the bounds: how far
//! rays go and how far occlusion reaches.
//!
//! Bounds may be infinite (a ground plane, repetition) or empty. What is framed is then a box of
//! about the size of what is finite, around the finite sides: a ball on an endless ground is seen
//! as the ball would be.

use crate::frame::{Lens, View};
use sdfc_vm::bounds::Bounds;
use sdfc_vm::outline::Outline;

/// The box that a picture is about.
pub(super) struct Target {
    /// It is finite and has some size.
    pub(super) shown: Bounds,
    /// The true bounds.
    bounds: Bounds,
    /// About half the size of what the picture is about, from which default lengths follow.
    size: f64,
    /// The bounds tell no size.
    is_guessed: bool,
}

/// The factor by which a picture is larger than a figure that it frames.
const MARGIN: f64 = 1.08;
/// The share of the picture's width or height that an outline fills.
const FILLED: f64 = 0.85;
/// The least distance of a camera from what it frames, in sizes of that.
const LEAST_WAY: f64 = 0.1;
/// The largest angle over the horizon that a camera is raised to.
const MOST_RAISED: f64 = 1.5;
/// The side of the box that is shown of a scene whose bounds tell no size.
const GUESSED_SIDE: f64 = 2.0;
/// Half the size of such a scene, in distances of its camera from what it looks at.
const SIZE_PER_WAY: f64 = 0.3;
/// How far rays go in an endless scene, in distances of the camera from what it looks at.
const ENDLESS_WAYS: f64 = 200.0;

impl Target {
    pub(super) fn of(bounds: &Bounds) -> Self {
        let sides = (0..3).filter_map(|i| {
            let side = bounds.max[i] - bounds.min[i];
            (side.is_finite() && side > 0.0).then_some(side)
        });
        let largest_side = sides.fold(0.0, f64::max);
        let corners = bounds.min.iter().chain(&bounds.max);
        let farthest = corners
            .filter(|v| v.is_finite())
            .fold(0.0_f64, |most, v| most.max(v.abs()));
        let known = [largest_side, 2.0 * farthest];
        let known = known.into_iter().find(|&s| s > 0.0);
        let scale = known.unwrap_or(GUESSED_SIDE);
        let mut shown = *bounds;
        for i in 0..3 {
            let (low, high) = (bounds.min[i], bounds.max[i]);
            (shown.min[i], shown.max[i]) = match (low.is_finite(), high.is_finite()) {
                (true, true) if low <= high => (low, high),
                (true, false) => (low, low + scale),
                (false, true) => (high - scale, high),
                _ => (-scale / 2.0, scale / 2.0),
            };
        }
        if shown.half_diagonal() == 0.0 {
            shown = shown.grown(1.0);
        }
        Self {
            size: shown.half_diagonal(),
            shown,
            bounds: *bounds,
            is_guessed: largest_side == 0.0,
        }
    }

    /// The same target with another size where its bounds tell none: that of the subject, or one that follows from the
    /// distance of the scene's camera.
    pub(super) fn sized(self, subject: Option<&Outline>, way: Option<f64>) -> Self {
        if !self.is_guessed {
            return self;
        }
        let of_subject = subject.map(|subject| subject.bounds().half_diagonal());
        let of_way = way.map(|way| way * SIZE_PER_WAY);
        let known = of_subject.or(of_way).filter(|&size| size > 0.0);
        Self {
            size: known.unwrap_or(self.size),
            ..self
        }
    }

    /// The same target in a scene that may come to fill this box.
    pub(super) fn lasting(&self, reach: &Bounds) -> Self {
        Self {
            shown: self.shown,
            bounds: *reach,
            ..*self
        }
    }

    /// How far rays go: past everything, where there is an end.
    pub(super) fn far(&self, view: &View) -> f64 {
        let place = Vector(view.from);
        if self.bounds.is_empty() {
            return 1.0;
        }
        if self.bounds.is_finite() {
            let centre = Vector(self.bounds.centre());
            let reach = self.bounds.half_diagonal();
            // Rays of a wide orthographic view start beside the camera.
            let beside = match view.lens {
                Lens::Perspective(_) => 0.0,
                Lens::Orthographic(height) => 4.0 * height,
            };
            return 1.01 * (place.minus(centre).length() + reach + beside) + 1e-3 * reach;
        }
        let way = place.minus(Vector(view.look)).length();
        ENDLESS_WAYS * way.max(self.size)
    }

    /// How far occlusion reaches: about the size of a crevice.
    pub(super) fn occlusion_reach(&self) -> f64 {
        0.15 * self.size
    }
}

/// The plane figure in the middle of the picture.
pub(super) fn face_on(target: &Target, aspect: f64) -> View {
    let [x, y, _] = target.shown.centre();
    let side = |i: usize| target.shown.max[i] - target.shown.min[i];
    let height = side(1).max(side(0) / aspect) * MARGIN;
    View::plane([x, y], if height > 0.0 { height } else { 1.0 })
}

/// The given view, moved so that the whole outline is in the middle of the picture, in the same direction.
///
/// The planes through the picture's edges touch the outline, but for the margin, on both sides of the picture
/// or above and below.
pub(super) fn framed(given: &View, outline: &Outline, aspect: f64) -> View {
    let Axes { right, up, back } = Axes::of(given);
    let reach = |v: Vector| outline.reach(v.0);
    let (front, rear) = (reach(back), -reach(back.times(-1.0)));
    let size = outline.bounds().half_diagonal();
    // Along one axis of the picture: the middle of the view, and how far from it the camera stands.
    let along = |axis: Vector, tangent: f64| {
        let [plus, minus] = [1.0, -1.0].map(|sign| reach(axis.times(sign).plus(back, tangent)));
        let way = (plus + minus) / (2.0 * tangent);
        ((plus - minus) / 2.0, way)
    };
    let (x, y, way, lens) = match given.lens {
        Lens::Perspective(fov) => {
            let tangent = (fov / 2.0).tan() * FILLED;
            let (x, needs_x) = along(right, tangent * aspect);
            let (y, needs_y) = along(up, tangent);
            let way = needs_x.max(needs_y).max(front + size * LEAST_WAY);
            (x, y, way, given.lens)
        }
        Lens::Orthographic(_) => {
            let [width, height] = [right, up].map(|axis| reach(axis) + reach(axis.times(-1.0)));
            let [x, y] = [right, up].map(|axis| (reach(axis) - reach(axis.times(-1.0))) / 2.0);
            let height = height.max(width / aspect) / FILLED;
            let height = if height > 0.0 { height } else { 1.0 };
            (x, y, front + 2.0 * size, Lens::Orthographic(height))
        }
    };
    let middle = Vector([0.0; 3]).plus(right, x).plus(up, y);
    View {
        from: middle.plus(back, way).0,
        look: middle.plus(back, (front + rear) / 2.0).0,
        up: given.up,
        lens,
    }
}

/// The distance of a view's camera from the side of the outline that it sees.
pub(super) fn way_to(view: &View, outline: &Outline) -> f64 {
    let back = Axes::of(view).back;
    (back.dot(Vector(view.from)) - outline.reach(back.0)).max(0.0)
}

/// A view's direction turned about the axis that points up, and raised, by angles in radians.
pub(super) fn turned(view: &View, turn: f64, raise: f64) -> View {
    let up = Vector(view.up).unit().unwrap_or(Vector([0.0, 1.0, 0.0]));
    let back = Axes::of(view).back;
    let height = back.dot(up);
    let level = back.plus(up, -height);
    let Some(ahead) = level.unit() else {
        return *view;
    };
    let aside = up.cross(ahead);
    let elevation = (height.asin() + raise).clamp(-MOST_RAISED, MOST_RAISED);
    let ahead = Vector([0.0; 3])
        .plus(ahead, turn.cos())
        .plus(aside, turn.sin());
    let back = Vector([0.0; 3])
        .plus(ahead, elevation.cos())
        .plus(up, elevation.sin());
    View {
        from: Vector(view.look).plus(back, 1.0).0,
        ..*view
    }
}

/// A point on the way from a view's camera, so far along its direction.
pub(super) fn ahead(view: &View, way: f64) -> [f64; 3] {
    Vector(view.from).plus(Axes::of(view).back, -way).0
}

/// The directions of a picture: to its right, to its upper edge, and out of it.
struct Axes {
    right: Vector,
    up: Vector,
    back: Vector,
}

impl Axes {
    fn of(view: &View) -> Self {
        let back = Vector(view.from).minus(Vector(view.look)).unit();
        let back = back.unwrap_or(Vector([0.0, 0.0, 1.0]));
        // Any direction across will do where up lies along the view.
        let right = Vector(view.up).cross(back).unit();
        let right = right
            .or(Vector([0.0, 0.0, -1.0]).cross(back).unit())
            .unwrap_or(Vector([1.0, 0.0, 0.0]));
        let up = back.cross(right);
        Self { right, up, back }
    }
}

#[derive(Clone, Copy, Debug)]
struct Vector([f64; 3]);

impl Vector {
    fn minus(self, other: Self) -> Self {
        Self(std::array::from_fn(|i| self.0[i] - other.0[i]))
    }
    fn plus(self, other: Self, times: f64) -> Self {
        Self(std::array::from_fn(|i| self.0[i] + other.0[i] * times))
    }
    fn times(self, factor: f64) -> Self {
        Self(self.0.map(|v| v * factor))
    }
    fn dot(self, other: Self) -> f64 {
        (0..3).map(|i| self.0[i] * other.0[i]).sum()
    }
    fn cross(self, other: Self) -> Self {
        let (a, b) = (self.0, other.0);
        Self(std::array::from_fn(|i| {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            a[j] * b[k] - a[k] * b[j]
        }))
    }
    fn length(self) -> f64 {
        self.dot(self).sqrt()
    }
    /// The direction; none for a vector of no length.
    fn unit(self) -> Option<Self> {
        let length = self.length();
        (length > 1e-9 && length.is_finite()).then(|| Self(self.0.map(|v| v / length)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Where a point lies in the picture, from -1 to 1 along both sides.
    fn place_in_view(view: &View, p: [f64; 3], aspect: f64) -> [f64; 2] {
        let forward = Vector(view.look)
            .minus(Vector(view.from))
            .unit()
            .expect("a direction");
        let right = forward.cross(Vector(view.up)).unit().expect("across");
        let up = right.cross(forward);
        let v = Vector(p).minus(Vector(view.from));
        let half = match view.lens {
            Lens::Perspective(fov) => v.dot(forward) * (fov / 2.0).tan(),
            Lens::Orthographic(height) => height / 2.0,
        };
        [v.dot(right) / (half * aspect), v.dot(up) / half]
    }

    #[test]
    fn an_automatic_camera_has_all_corners_in_the_picture_and_touches_its_edge() {
        let boxes = [
            Bounds::ball(1.0),
            Bounds {
                min: [10.0, 0.0, -3.0],
                max: [12.0, 9.0, -1.0],
            },
            Bounds {
                min: [-1e-4; 3],
                max: [1e-4; 3],
            },
        ];
        let lenses = [
            Lens::Perspective(0.6),
            Lens::Perspective(2.0),
            Lens::Orthographic(1.0),
        ];
        for bounds in boxes {
            for lens in lenses {
                for aspect in [0.5, 1.0, 16.0 / 9.0] {
                    let given = View {
                        from: [3.0, 4.0, 5.0],
                        look: [0.0; 3],
                        up: [0.0, 1.0, 0.0],
                        lens,
                    };
                    let view = framed(&given, &Outline::of_box(&bounds), aspect);
                    let mut edge = 0.0_f64;
                    for corner in bounds.corners() {
                        let [x, y] = place_in_view(&view, corner, aspect);
                        edge = edge.max(x.abs()).max(y.abs());
                    }
                    assert!(
                        (0.6..=0.9).contains(&edge),
                        "{bounds:?} {lens:?} {aspect}: {edge}"
                    );
                    let far = Target::of(&bounds).far(&view);
                    let beyond = |c: &[f64; 3]| Vector(*c).minus(Vector(view.from)).length() < far;
                    assert!(bounds.corners().iter().all(beyond));
                }
            }
        }
    }

    #[test]
    fn endless_bounds_are_framed_at_the_size_of_what_is_finite() {
        let ground = Bounds {
            min: [f64::NEG_INFINITY; 3],
            max: [f64::INFINITY, 2.0, f64::INFINITY],
        };
        let shown = Target::of(&ground).shown;
        assert_eq!(
            shown,
            Bounds {
                min: [-2.0, -2.0, -2.0],
                max: [2.0, 2.0, 2.0]
            }
        );
        let given = View {
            from: [3.0, 4.0, 5.0],
            look: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            lens: Lens::Perspective(0.6),
        };
        for bounds in [Bounds::EVERYTHING, Bounds::EMPTY, Bounds::ball(0.0)] {
            let target = Target::of(&bounds);
            let view = framed(&given, &Outline::of_box(&target.shown), 1.5);
            assert!(view.from.iter().all(|v| v.is_finite()), "{bounds:?}");
            assert!(target.far(&view) > 0.0 && target.far(&view).is_finite());
            assert!(target.occlusion_reach() > 0.0);
        }
    }
}
