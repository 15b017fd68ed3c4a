//! Placement of automatic cameras, and the defaults that follow from the bounds: length of rays and radius of
//! occlusion.
//!
//! Bounds may be infinite (a ground plane, repetition) or empty. The framed box then has about the size of
//! the finite part and lies around its finite sides. A sphere on an infinite ground is framed like the sphere
//! alone.

use super::plane_scale::square_with_edges;
use super::space_scale::scale_of_features;
use crate::render::{ResolvedLens, View};
use glam::DVec3;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::outline::Outline;
use sdfc_vm::program::Program;
use sdfc_vm::settings::{EndlessPart, Extents};

/// The box that an image shows.
pub(super) struct FramingTarget {
    /// The shown box: finite and not a point.
    pub(super) shown: Bounds,
    /// The true bounds.
    bounds: Bounds,
    /// About half the size of the subject, from which default lengths follow.
    size: f64,
    /// Length of the shown box along infinite sides.
    scale: f64,
    /// Set if the bounds have no finite side, so that the size is a guess.
    is_guessed: bool,
}

/// Ratio of the height of an image to that of the 2-D shape it frames.
const PLANE_MARGIN: f64 = 1.08;
/// Fraction of the image's width or height that an outline fills.
const FILLED_FRACTION: f64 = 0.85;
/// Minimum distance of a camera from the framed outline, in sizes of the outline.
const MIN_DISTANCE_IN_SIZES: f64 = 0.1;
/// Maximum elevation of a camera over the horizon, in radians.
const MAX_ELEVATION: f64 = 1.5;
/// Side of the shown box if the bounds have no size.
const DEFAULT_SIDE: f64 = 2.0;
/// Minimum side that follows from the distance of a single finite side from the origin. Searches for bounds leave
/// about 1e-11.
const MIN_GUESSED_SIDE: f64 = 1e-6;
/// Half the size of such a scene, as a fraction of the distance from the camera to its target.
const SIZE_PER_DISTANCE: f64 = 0.3;
/// Minimum length of rays in an infinite scene, in distances of the camera from its target.
const UNBOUNDED_FAR_DISTANCES: f64 = 200.0;
/// Minimum half height of the image at the ends of such rays, in the same unit. A floor's horizon is then equally many
/// pixels too low through every long lens.
const UNBOUNDED_FAR_HALF_HEIGHTS: f64 = 63.0;
/// Length of parallel rays in an infinite scene, in distances of the camera from its target.
const PARALLEL_FAR_DISTANCES: f64 = 4.0;
/// Length in addition to it, in heights of the image. Things far away are as large in it as near ones.
const PARALLEL_FAR_HEIGHTS: f64 = 64.0;

impl FramingTarget {
    pub(super) fn from_bounds(bounds: &Bounds) -> Self {
        let sides = (0..3).filter_map(|i| {
            let side = bounds.max[i] - bounds.min[i];
            (side.is_finite() && side > 0.0).then_some(side)
        });
        let largest_side = sides.fold(0.0, f64::max);
        let corners = bounds.min.iter().chain(&bounds.max);
        let farthest = corners
            .filter(|v| v.is_finite())
            .fold(0.0_f64, |max, v| max.max(v.abs()));
        let scale = match (largest_side, 2.0 * farthest) {
            (side, _) if side > 0.0 => side,
            (_, side) if side > MIN_GUESSED_SIDE => side,
            _ => DEFAULT_SIDE,
        };
        Self {
            is_guessed: largest_side == 0.0,
            ..Self::at_scale(bounds, scale)
        }
    }

    /// Returns the target whose infinite sides have a length.
    fn at_scale(bounds: &Bounds, scale: f64) -> Self {
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
            scale,
            is_guessed: false,
        }
    }

    /// Returns the target at a scale that shows the features of the field, if its bounds have no size.
    pub(super) fn with_features(self, field: &Program) -> Self {
        let scale = self.is_guessed.then(|| {
            let box_at = |scale: f64| Self::at_scale(&self.bounds, scale).shown;
            scale_of_features(field, self.scale, box_at)
        });
        match scale.flatten() {
            Some(scale) => Self {
                is_guessed: true,
                ..Self::at_scale(&self.bounds, scale)
            },
            None => self,
        }
    }

    /// Returns the target with a better size if its bounds are endless. It is that of the subject, or follows
    /// from the distance of the scene's camera. So the thickness of a floor does not count.
    pub(super) fn with_known_size(self, subject: Option<&Outline>, distance: Option<f64>) -> Self {
        if self.bounds.is_finite() || self.bounds.is_empty() {
            return self;
        }
        let subject_size = subject.map(|subject| subject.bounds().half_diagonal());
        let distance_size = distance.map(|distance| distance * SIZE_PER_DISTANCE);
        let size = subject_size.or(distance_size).filter(|&size| size > 0.0);
        Self {
            size: size.unwrap_or(self.size),
            ..self
        }
    }

    /// Returns the target with a shown box in which a 2-D shape has edges, if its bounds have no size.
    pub(super) fn with_edges(&self, field: &Program) -> Self {
        let square = self
            .is_guessed
            .then(|| square_with_edges(field, &self.shown));
        Self {
            shown: square.flatten().unwrap_or(self.shown),
            ..*self
        }
    }

    /// Returns the target with bounds that cover all parameter values.
    pub(super) fn with_bounds(&self, bounds: &Bounds) -> Self {
        Self {
            shown: self.shown,
            bounds: *bounds,
            ..*self
        }
    }

    /// Returns the maximum length of rays: beyond the bounds, if they are finite.
    ///
    /// Rays reach beyond the finite part of an endless solid. Its endless parts are seen to many times their distance
    /// from the camera.
    pub(super) fn far(&self, extents: &Extents, view: &View) -> f64 {
        if self.bounds.is_empty() {
            return 1.0;
        }
        if self.bounds.is_finite() {
            return length_beyond(&self.bounds, view);
        }
        let (distances, lateral) = match view.lens {
            ResolvedLens::Perspective(fov) => {
                let by_lens = UNBOUNDED_FAR_HALF_HEIGHTS / (fov / 2.0).tan();
                (UNBOUNDED_FAR_DISTANCES.max(by_lens), 0.0)
            }
            ResolvedLens::Orthographic(height) => {
                (PARALLEL_FAR_DISTANCES, PARALLEL_FAR_HEIGHTS * height)
            }
        };
        let nearest = |part: &EndlessPart| least_distance(part, view.from.into());
        let lengths = [view.target_distance(), self.size];
        let lengths = lengths
            .into_iter()
            .chain(extents.endless.iter().map(nearest));
        let endless = distances * lengths.fold(0.0, f64::max) + lateral;
        let finite = extents.finite.map(|bounds| length_beyond(&bounds, view));
        finite.map_or(endless, |finite| endless.max(finite))
    }

    /// Returns the radius of occlusion in units of length: about the size of a crevice.
    pub(super) fn occlusion_reach(&self) -> f64 {
        0.15 * self.size
    }
}

/// Returns the length of rays that end beyond a finite box.
fn length_beyond(bounds: &Bounds, view: &View) -> f64 {
    let distance = DVec3::from(view.from).distance(bounds.centre().into());
    let radius = bounds.half_diagonal();
    // Rays of a wide orthographic view start beside the camera.
    let lateral = match view.lens {
        ResolvedLens::Perspective(_) => 0.0,
        ResolvedLens::Orthographic(height) => 4.0 * height,
    };
    1.01 * (distance + radius + lateral) + 1e-3 * radius
}

/// Returns the distance of a point from an endless part, as far as it is known.
fn least_distance(part: &EndlessPart, point: DVec3) -> f64 {
    let Bounds { min, max } = part.bounds;
    let from_box = point.distance(point.clamp(min.into(), max.into()));
    let from_plane = part.plane.map_or(0.0, |[x, y, z, offset]| {
        point.dot(DVec3::new(x, y, z)) + offset
    });
    from_box.max(from_plane)
}

/// Returns the view of a 2-D shape, centred in the image.
pub(super) fn plane_view(target: &FramingTarget, aspect: f64) -> View {
    let [x, y, _] = target.shown.centre();
    let side = |i: usize| target.shown.max[i] - target.shown.min[i];
    let height = side(1).max(side(0) / aspect) * PLANE_MARGIN;
    View::plane([x, y], if height > 0.0 { height } else { 1.0 })
}

/// Moves a view along and across its direction so that the whole outline is centred in the image.
///
/// The planes through two opposite edges of the image, left and right or top and bottom, touch the outline
/// except for the margin.
pub(super) fn framed_view(view: &View, outline: &Outline, aspect: f64) -> View {
    let ViewAxes { right, up, back } = ViewAxes::from_view(view);
    let support = |v: DVec3| outline.support(v.into());
    let (front, rear) = (support(back), -support(-back));
    let size = outline.bounds().half_diagonal();
    // Along one axis of the image: the centre of the view and the distance of the camera.
    let along = |axis: DVec3, tangent: f64| {
        let [plus, minus] = [axis, -axis].map(|side| support(side + back * tangent));
        let distance = (plus + minus) / (2.0 * tangent);
        ((plus - minus) / 2.0, distance)
    };
    let (x, y, distance, lens) = match view.lens {
        ResolvedLens::Perspective(fov) => {
            let tangent = (fov / 2.0).tan() * FILLED_FRACTION;
            let (x, distance_x) = along(right, tangent * aspect);
            let (y, distance_y) = along(up, tangent);
            let distance = distance_x
                .max(distance_y)
                .max(front + size * MIN_DISTANCE_IN_SIZES);
            (x, y, distance, view.lens)
        }
        ResolvedLens::Orthographic(_) => {
            let [width, height] = [right, up].map(|axis| support(axis) + support(-axis));
            let [x, y] = [right, up].map(|axis| (support(axis) - support(-axis)) / 2.0);
            let height = height.max(width / aspect) / FILLED_FRACTION;
            let height = if height > 0.0 { height } else { 1.0 };
            (x, y, front + 2.0 * size, ResolvedLens::Orthographic(height))
        }
    };
    // Added to zero, no coordinate is a negative zero.
    let middle = DVec3::ZERO + right * x + up * y;
    View {
        from: (middle + back * distance).into(),
        look: (middle + back * ((front + rear) / 2.0)).into(),
        up: view.up,
        lens,
    }
}

/// Returns the distance of a view's camera from the near side of the outline, at least 0.
pub(super) fn distance_to(view: &View, outline: &Outline) -> f64 {
    let back = ViewAxes::from_view(view).back;
    (back.dot(view.from.into()) - outline.support(back.into())).max(0.0)
}

/// Rotates a view about its target: by `turn` about the up axis, and by `raise` in elevation, in radians.
pub(super) fn rotated_view(view: &View, turn: f64, raise: f64) -> View {
    let up = unit(view.up.into()).unwrap_or(DVec3::Y);
    let back = ViewAxes::from_view(view).back;
    let height = back.dot(up);
    let Some(ahead) = unit(back - up * height) else {
        return *view;
    };
    let across = up.cross(ahead);
    let elevation = (height.asin() + raise).clamp(-MAX_ELEVATION, MAX_ELEVATION);
    // Added to zero, no component is a negative zero.
    let ahead = DVec3::ZERO + ahead * turn.cos() + across * turn.sin();
    let back = DVec3::ZERO + ahead * elevation.cos() + up * elevation.sin();
    View {
        from: (DVec3::from(view.look) + back).into(),
        ..*view
    }
}

/// Returns the point at this distance ahead of a view's camera.
pub(super) fn point_ahead(view: &View, distance: f64) -> [f64; 3] {
    (DVec3::from(view.from) - ViewAxes::from_view(view).back * distance).into()
}

/// The axes of an image: to the right, to the upper edge, and towards the camera.
pub(crate) struct ViewAxes {
    pub(crate) right: DVec3,
    pub(crate) up: DVec3,
    pub(crate) back: DVec3,
}

impl ViewAxes {
    pub(crate) fn from_view(view: &View) -> Self {
        let back = unit(DVec3::from(view.from) - DVec3::from(view.look)).unwrap_or(DVec3::Z);
        // Any perpendicular direction is valid if `up` is parallel to the view.
        let right = unit(DVec3::from(view.up).cross(back))
            .or(unit(DVec3::NEG_Z.cross(back)))
            .unwrap_or(DVec3::X);
        let up = back.cross(right);
        Self { right, up, back }
    }
}

/// Returns the unit vector; `None` for a vector without a direction.
fn unit(v: DVec3) -> Option<DVec3> {
    let length = v.length();
    (length > 1e-9 && length.is_finite()).then(|| v / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Projects a point to the image, from -1 to 1 along both sides.
    fn project(view: &View, p: [f64; 3], aspect: f64) -> [f64; 2] {
        let from = DVec3::from(view.from);
        let forward = unit(DVec3::from(view.look) - from).expect("a direction");
        let right = unit(forward.cross(view.up.into())).expect("across");
        let up = right.cross(forward);
        let v = DVec3::from(p) - from;
        let half = match view.lens {
            ResolvedLens::Perspective(fov) => v.dot(forward) * (fov / 2.0).tan(),
            ResolvedLens::Orthographic(height) => height / 2.0,
        };
        [v.dot(right) / (half * aspect), v.dot(up) / half]
    }

    #[test]
    fn an_automatic_camera_has_all_corners_in_the_picture_and_touches_its_edge() {
        let boxes = [
            Bounds::centred([1.0; 3]),
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
            ResolvedLens::Perspective(0.6),
            ResolvedLens::Perspective(2.0),
            ResolvedLens::Orthographic(1.0),
        ];
        for bounds in boxes {
            for lens in lenses {
                for aspect in [0.5, 1.0, 16.0 / 9.0] {
                    let camera_view = View {
                        from: [3.0, 4.0, 5.0],
                        look: [0.0; 3],
                        up: [0.0, 1.0, 0.0],
                        lens,
                    };
                    let view = framed_view(&camera_view, &Outline::from_bounds(&bounds), aspect);
                    let mut edge = 0.0_f64;
                    for corner in bounds.corners() {
                        let [x, y] = project(&view, corner, aspect);
                        edge = edge.max(x.abs()).max(y.abs());
                    }
                    assert!(
                        (0.6..=0.9).contains(&edge),
                        "{bounds:?} {lens:?} {aspect}: {edge}"
                    );
                    let far = FramingTarget::from_bounds(&bounds).far(&Extents::default(), &view);
                    let is_before_far =
                        |c: [f64; 3]| DVec3::from(c).distance(view.from.into()) < far;
                    assert!(bounds.corners().into_iter().all(is_before_far));
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
        let shown = FramingTarget::from_bounds(&ground).shown;
        assert_eq!(
            shown,
            Bounds {
                min: [-2.0, -2.0, -2.0],
                max: [2.0, 2.0, 2.0]
            }
        );
        let camera_view = View {
            from: [3.0, 4.0, 5.0],
            look: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            lens: ResolvedLens::Perspective(0.6),
        };
        for bounds in [Bounds::ALL_SPACE, Bounds::EMPTY, Bounds::centred([0.0; 3])] {
            let target = FramingTarget::from_bounds(&bounds);
            let view = framed_view(&camera_view, &Outline::from_bounds(&target.shown), 1.5);
            assert!(view.from.iter().all(|v| v.is_finite()), "{bounds:?}");
            assert!(
                target.far(&Extents::default(), &view) > 0.0
                    && target.far(&Extents::default(), &view).is_finite()
            );
            assert!(target.occlusion_reach() > 0.0);
        }
    }

    #[test]
    fn occlusion_reaches_equally_far_above_floors_of_any_thickness() {
        let above = |bottom: f64| {
            let (far, top) = (f64::INFINITY, 0.6);
            let floor = Bounds {
                min: [-far, bottom, -far],
                max: [far, top, far],
            };
            FramingTarget::from_bounds(&floor)
                .with_known_size(None, Some(5.0))
                .occlusion_reach()
        };
        assert_eq!(above(-100.0), above(-1.0));
        assert_eq!(above(f64::NEG_INFINITY), above(-1.0));
    }

    #[test]
    fn rays_reach_far_parts_of_an_endless_solid() {
        let view = View {
            from: [0.0, 1.0, 5.0],
            look: [0.0; 3],
            up: [0.0, 1.0, 0.0],
            lens: ResolvedLens::Perspective(0.6),
        };
        let tower = Bounds {
            min: [-100.0, 0.0, -9100.0],
            max: [100.0, 300.0, -8900.0],
        };
        let floor = Bounds {
            min: [f64::NEG_INFINITY; 3],
            max: [f64::INFINITY, -5000.0, f64::INFINITY],
        };
        let target = FramingTarget::from_bounds(&Bounds::ALL_SPACE);
        let part = |bounds, plane| EndlessPart { bounds, plane };
        let everywhere = part(Bounds::ALL_SPACE, None);
        let extents = Extents {
            finite: Some(tower),
            finite_parts: vec![tower],
            enclosure: None,
            endless: vec![everywhere.clone()],
        };
        assert!((9100.0..10_000.0).contains(&target.far(&extents, &view)));
        let slanted = part(Bounds::ALL_SPACE, Some([0.6, 0.8, 0.0, 2000.0]));
        for (endless, distance) in [
            (vec![everywhere.clone(), part(floor, None)], 5001.0),
            (vec![everywhere, slanted], 2000.8),
        ] {
            let extents = Extents {
                endless,
                ..Extents::default()
            };
            assert_eq!(
                target.far(&extents, &view),
                distance * UNBOUNDED_FAR_DISTANCES.max(UNBOUNDED_FAR_HALF_HEIGHTS / 0.3_f64.tan())
            );
        }
    }

    #[test]
    fn a_floor_ends_near_its_horizon_through_every_lens() {
        let ground = Bounds {
            min: [f64::NEG_INFINITY; 3],
            max: [f64::INFINITY, 1.0, f64::INFINITY],
        };
        for degrees in [0.5_f64, 2.0, 10.0, 35.0, 90.0] {
            let fov = degrees.to_radians();
            let (height, distance) = (1.5, 5.0);
            let view = View {
                from: [0.0, height, distance],
                look: [0.0, height, 0.0],
                up: [0.0, 1.0, 0.0],
                lens: ResolvedLens::Perspective(fov),
            };
            let far = FramingTarget::from_bounds(&ground).far(&Extents::default(), &view);
            let half_heights_below_horizon = (height / far).atan() / (fov / 2.0);
            assert!(
                half_heights_below_horizon < 0.006,
                "{degrees}: {half_heights_below_horizon}"
            );
        }
    }
}
