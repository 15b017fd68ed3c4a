//! Slice overlay: the field on a movable plane, drawn into the picture of the scene.
//!
//! Colours are those of the mode `distance` ([`views::distance_color`]): cool inside, warm outside, a
//! line at every round distance, and a bold line at zero. The line width on screen does not depend on the
//! angle of the plane. It is scaled by the change of the field between adjacent pixels. That follows from
//! the gradient and from the intersections of adjacent rays with the plane.
//!
//! Only distances and gradients are used. An engine that has the module loaded without its surface
//! program (`surface: None`) answers faster.

use super::QueryPoints;
use super::ink::{self, Color, blend_over, hex, mix, mute};
use super::rays::{InspectedRay, PictureRays};
use glam::{DVec3, Vec3};
use sdfc_runtime::engine::FieldSample;
use sdfc_runtime::render::{FieldFacts, Image, Mode, RenderSettings, ResolvedLens, View, prepare};
use sdfc_shaders::views;
use sdfc_vm::bounds::Bounds;

/// A plane on which the field is shown.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slice {
    /// Centre of the shown square, a point of the plane.
    pub point: [f64; 3],
    /// Normal of the plane, of any length; zero counts as up.
    pub normal: [f64; 3],
    /// Half the side of the shown square in scene units; `None` shows the whole visible plane.
    pub half_side: Option<f64>,
    /// Treatment of surfaces between the camera and the plane.
    pub front: FrontSurfaces,
}

/// Treatment of surfaces between the camera and a slice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum FrontSurfaces {
    /// They hide the slice.
    #[default]
    Opaque,
    /// They are translucent, so the field inside solids is visible too.
    Ghost,
}

/// Opacity of translucent surfaces in front of the plane.
const GHOST_OPACITY: f32 = 0.2;
/// Opacity of the slice.
const SLICE_OPACITY: f32 = 0.94;
/// Surfaces in front of the plane by at most this fraction of the distance count as lying in it, because
/// rounding decides their order.
const COPLANAR_TOLERANCE: f64 = 1e-5;
/// On a plane that runs along a surface the field is constant, and a line would become a patch. Lines
/// fade out as the in-plane fraction of the gradient falls from the second value to the first.
const LINE_FADE_RANGE: [f64; 2] = [0.02, 0.1];
/// Colour of points at which the field is not a number.
const NAN_COLOR: Color = hex(0xd0006f);

impl Slice {
    /// Creates the plane across an axis (0 for x, 1 for y, 2 for z) at a coordinate, somewhat larger than
    /// the scene's bounds. Where these are infinite, its size is that of the camera's view around the
    /// look-at point.
    pub fn across(
        axis: usize,
        coordinate: f64,
        bounds: &Bounds,
        settings: &RenderSettings,
    ) -> Self {
        let axis = axis.min(2);
        let view = &settings.view;
        let visible_half = match view.lens {
            ResolvedLens::Perspective(fov) => {
                view.target_distance() * (fov.clamp(1e-6, 3.1) / 2.0).tan()
            }
            ResolvedLens::Orthographic(height) => height / 2.0,
        };
        // Centre and half the length of a side.
        let centre_and_half = |i: usize| {
            let [low, high] = [bounds.min[i], bounds.max[i]];
            let is_bounded = low.is_finite() && high.is_finite() && low <= high;
            if is_bounded {
                ((low + high) / 2.0, (high - low) / 2.0)
            } else {
                (view.look[i], visible_half)
            }
        };
        let mut point = [0, 1, 2].map(|i| centre_and_half(i).0);
        point[axis] = coordinate;
        let mut normal = [0.0; 3];
        normal[axis] = 1.0;
        let sides = (0..3).filter(|&i| i != axis).map(|i| centre_and_half(i).1);
        let max_half_side = sides.fold(0.0, f64::max);
        Self {
            point,
            normal,
            half_side: (max_half_side > 0.0).then_some(1.25 * max_half_side),
            front: FrontSurfaces::default(),
        }
    }

    /// Creates the plane of the mode `distance`: through the look-at point, across the view.
    pub fn across_view(view: &View) -> Self {
        let [from, look] = [view.from, view.look].map(DVec3::from);
        Self {
            point: view.look,
            normal: (look - from).into(),
            half_side: None,
            front: FrontSurfaces::Ghost,
        }
    }

    /// Returns the unit normal of the plane.
    fn facing(&self) -> DVec3 {
        DVec3::from(self.normal).normalize_or(DVec3::Y)
    }

    /// Returns the distance along a ray to the plane, if it is ahead.
    pub fn intersect(&self, ray: &InspectedRay) -> Option<f64> {
        let facing = self.facing();
        let t = (DVec3::from(self.point) - ray.origin).dot(facing) / ray.direction.dot(facing);
        (t > 0.0 && t.is_finite()).then_some(t)
    }

    /// Returns the part of the plane that is visible in a picture. For a 2-D shape it is the plane of the
    /// shape.
    pub fn visible_part(&self, image: &Image, settings: &RenderSettings) -> VisibleSlice {
        let figure = Self {
            point: [0.0; 3],
            normal: [0.0, 0.0, 1.0],
            half_side: None,
            front: FrontSurfaces::Ghost,
        };
        let slice = if settings.is_2d { figure } else { *self };
        let rays = PictureRays::new(settings);
        let mut visible = VisibleSlice {
            query_points: QueryPoints::default(),
            slice_pixels: Vec::new(),
            spacing: spacing(settings),
        };
        let square = ShownSquare::new(&slice);
        for pixel in 0..rays.pixels() {
            let ray = rays.for_pixel(pixel);
            let depth = image.depth.get(pixel).copied().unwrap_or(f32::INFINITY);
            let Some(t) = slice.intersect(&ray).filter(|&t| t < settings.far) else {
                continue;
            };
            let is_hidden = f64::from(depth) < t * (1.0 - COPLANAR_TOLERANCE) && !settings.is_2d;
            if is_hidden && slice.front == FrontSurfaces::Opaque {
                continue;
            }
            let point = ray.at(t);
            let [column, row] = [pixel % rays.width(), pixel / rays.width()];
            let offset_to_neighbour = |x: f64, y: f64| {
                let ray = rays.through([column as f64 + x, row as f64 + y]);
                slice.intersect(&ray).map(|t| ray.at(t) - point)
            };
            // At the horizon of the plane one neighbour is missing; the opposite one is used instead.
            let right = offset_to_neighbour(1.0, 0.0).or_else(|| offset_to_neighbour(-1.0, 0.0));
            let below = offset_to_neighbour(0.0, 1.0).or_else(|| offset_to_neighbour(0.0, -1.0));
            let (Some(right), Some(below)) = (right, below) else {
                continue;
            };
            let (covered, rim) = square.covers(point, [right, below]);
            if covered <= 0.0 {
                continue;
            }
            visible.query_points.pixels.push(pixel as u32);
            visible.query_points.points.push(point.as_vec3().into());
            visible.slice_pixels.push(SlicePixel {
                right,
                below,
                covered,
                rim,
                is_hidden,
            });
        }
        visible
    }
}

/// Returns the distance between two lines of a slice: the same round number as in the mode `distance`.
fn spacing(settings: &RenderSettings) -> f32 {
    let settings = RenderSettings {
        mode: Mode::Distance,
        ..settings.clone()
    };
    let no_facts = FieldFacts {
        is_raw: false,
        has_estimated_slopes: false,
        max_slope: 1.0,
        has_loose_slopes: false,
        bounds: Bounds::ALL_SPACE,
        material: None,
    };
    prepare(&settings, &no_facts).uniforms.spacing
}

/// The shown part of a plane.
struct ShownSquare {
    centre: DVec3,
    axes: [DVec3; 2],
    half_side: Option<f64>,
}

impl ShownSquare {
    fn new(slice: &Slice) -> Self {
        let n = slice.facing();
        // The square follows the two scene axes that are most parallel to the plane.
        let in_plane = |axis: DVec3| {
            let projected = axis - n * axis.dot(n);
            projected * (1.0 / projected.length().max(1e-30))
        };
        let first = in_plane(DVec3::AXES[n.abs().min_position()]);
        Self {
            centre: slice.point.into(),
            axes: [first, n.cross(first)],
            half_side: slice.half_side,
        }
    }

    /// Returns the covered fraction of a pixel, and the fraction of that covered by the rim. `steps` lead
    /// to the adjacent pixels.
    fn covers(&self, point: DVec3, steps: [DVec3; 2]) -> (f32, f32) {
        let Some(half_side) = self.half_side else {
            return (1.0, 0.0);
        };
        let offset = point - self.centre;
        let axis_pixels = self.axes.map(|axis| {
            let change: f64 = steps.iter().map(|step| step.dot(axis).powi(2)).sum();
            (half_side - offset.dot(axis).abs()) / change.sqrt().max(1e-30)
        });
        let pixels = axis_pixels[0].min(axis_pixels[1]);
        let covered = (pixels + 0.5).clamp(0.0, 1.0);
        let rim = (2.0 - pixels).clamp(0.0, 1.0);
        (covered as f32, rim as f32)
    }
}

/// The visible part of a slice in a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct VisibleSlice {
    /// Points to sample with an engine.
    pub query_points: QueryPoints,
    slice_pixels: Vec<SlicePixel>,
    /// Distance between two lines, in scene units.
    pub spacing: f32,
}

/// A pixel that shows a slice.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SlicePixel {
    /// Offsets from its point to those of the pixels to the right and below.
    right: DVec3,
    below: DVec3,
    /// Covered fraction of the pixel, and the fraction of that covered by the rim.
    covered: f32,
    rim: f32,
    /// True if a surface lies in front of the point.
    is_hidden: bool,
}

impl SlicePixel {
    /// Returns the colour of a field sample.
    fn color(&self, sample: &FieldSample, spacing: f32) -> Color {
        let (distance, gradient) = (sample.distance, Vec3::from(sample.gradient).as_dvec3());
        // The change of the field to the adjacent pixels, and the maximum change if the gradient lay in
        // the plane.
        let change = gradient.dot(self.right).hypot(gradient.dot(self.below));
        let pixel_size = (self.right.length() * self.below.length()).sqrt();
        let max_change = gradient.length() * pixel_size;
        let is_finite_sample = distance.is_finite() && max_change.is_finite();
        if !is_finite_sample {
            return NAN_COLOR;
        }
        let min_change = (max_change * LINE_FADE_RANGE[0])
            .max(pixel_size * 1e-6)
            .max(1e-30);
        let lined = views::distance_color::<f32>(distance, spacing, change.max(min_change) as f32);
        let steepness = ((change / max_change.max(1e-30) - LINE_FADE_RANGE[0])
            / (LINE_FADE_RANGE[1] - LINE_FADE_RANGE[0]))
            .clamp(0.0, 1.0);
        if steepness == 1.0 {
            return lined;
        }
        // There is no line midway between two lines.
        let centre = ((distance.abs() / spacing).floor() + 0.5) * spacing;
        let is_inside = f64::from(distance) < -pixel_size * LINE_FADE_RANGE[0];
        let centre = if is_inside { -centre } else { centre };
        let unlined = views::distance_color::<f32>(centre, spacing, spacing * 0.01);
        mix(unlined, lined, steepness as f32)
    }
}

impl VisibleSlice {
    /// Draws the field alone. `samples` are the engine's results for the points.
    pub fn draw_alone(&self, picture: &mut [u8], samples: &[FieldSample]) {
        let pixels = self.query_points.pixels.iter().map(|&pixel| pixel as usize);
        for ((pixel, slice_pixel), sample) in pixels.zip(&self.slice_pixels).zip(samples) {
            let shown = slice_pixel.color(sample, self.spacing);
            blend_over(picture, pixel, shown, 1.0);
        }
    }

    /// Draws the field over a picture of the scene, which is slightly muted. `samples` are the engine's
    /// results for the points.
    pub fn draw(&self, picture: &mut [u8], samples: &[FieldSample]) {
        let original = picture.to_vec();
        mute(picture, 0.35, 0.3);
        let pixels = self.query_points.pixels.iter().map(|&pixel| pixel as usize);
        for ((pixel, slice_pixel), sample) in pixels.zip(&self.slice_pixels).zip(samples) {
            let shown = slice_pixel.color(sample, self.spacing);
            let rimmed = mix(shown, hex(0x30343c), 0.6 * slice_pixel.rim);
            // Translucent surfaces tint the slice.
            let ghost = original.as_chunks::<4>().0.get(pixel).copied();
            let ink = match ghost.filter(|_| slice_pixel.is_hidden) {
                Some(ghost) => mix(rimmed, ink::color(ghost), GHOST_OPACITY),
                None => rimmed,
            };
            blend_over(picture, pixel, ink, slice_pixel.covered * SLICE_OPACITY);
        }
    }
}
