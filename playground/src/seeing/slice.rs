//! A slice: the field on a movable plane, drawn into the picture of the scene.
//!
//! Colours are those of the mode `distance` ([`views::distance_color`]): cool inside, warm outside,
//! a line at every round distance, a bold one where the field is zero. Lines are as wide as there
//! where the plane faces the eye, and just as wide where it does not: what counts as a pixel is how
//! much the field changes from one pixel to the next, which follows from its gradient and from where
//! the neighbouring rays meet the plane.
//!
//! Only distances and gradients are drawn: an engine that has the module loaded without its program of
//! surfaces (`surface: None`) answers sooner.

use super::Asked;
use super::ink::{self, Color, draw_back, hex, lay, mixed};
use super::rays::{Ray, Rays, double, single, vector};
use sdfc_runtime::engine::Sample;
use sdfc_runtime::frame::{FieldFacts, Frame, Lens, Mode, RenderSettings, prepare};
use sdfc_shaders::views;
use sdfc_vm::bounds::Bounds;
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

/// A plane that the field is shown on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Slice {
    /// A point of the plane: the middle of what is shown.
    pub point: [f64; 3],
    /// The direction that the plane faces; its length does not matter, zero counts as up.
    pub normal: [f64; 3],
    /// Half the side of the square that is shown, in scene units; `None` shows all that is seen.
    pub reach: Option<f64>,
    /// What becomes of surfaces between the eye and the plane.
    pub front: Front,
}

/// What becomes of surfaces between the eye and a slice.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Front {
    /// They hide it.
    #[default]
    Hides,
    /// They are seen through: so the field inside of solids is seen, too.
    Ghost,
}

/// How much of a surface before the plane is left, where it is seen through.
const GHOST: f32 = 0.2;
/// How much of a slice hides what is behind it.
const OPACITY: f32 = 0.94;
/// A surface that is nearer than the plane by no more than this share of the way lies in it: rounding
/// alone would decide which of the two is before the other.
const TOUCHING: f64 = 1e-5;
/// Where a plane lies along a surface, the field is the same on all of it, and a line would be a patch:
/// lines fade from the second to the first of these shares of the field's slope that lie in the plane.
const FLAT: [f64; 2] = [0.02, 0.1];
/// Where the field is not a number.
const NOT_A_NUMBER: Color = hex(0xd0006f);

impl Slice {
    /// The plane across an axis (0 for x, 1, 2) at this coordinate, somewhat larger than what a scene's
    /// bounds hold; where these have no end, about as large as what the camera sees around the point
    /// that it looks at.
    pub fn across(axis: usize, at: f64, bounds: &Bounds, settings: &RenderSettings) -> Self {
        let axis = axis.min(2);
        let view = &settings.view;
        let seen = match view.lens {
            Lens::Perspective(fov) => {
                let way = vector(view.look) - vector(view.from);
                way.length() * (fov.clamp(1e-6, 3.1) / 2.0).tan()
            }
            Lens::Orthographic(tall) => tall / 2.0,
        };
        // The middle and half the length of a side.
        let side = |i: usize| {
            let [low, high] = [bounds.min[i], bounds.max[i]];
            let is_known = low.is_finite() && high.is_finite() && low <= high;
            if is_known {
                ((low + high) / 2.0, (high - low) / 2.0)
            } else {
                (view.look[i], seen)
            }
        };
        let mut point = [0, 1, 2].map(|i| side(i).0);
        point[axis] = at;
        let mut normal = [0.0; 3];
        normal[axis] = 1.0;
        let sides = (0..3).filter(|&i| i != axis).map(|i| side(i).1);
        let widest = sides.fold(0.0, f64::max);
        Self {
            point,
            normal,
            reach: (widest > 0.0).then_some(1.25 * widest),
            front: Front::default(),
        }
    }

    /// The direction that the plane faces, of length one.
    fn facing(&self) -> V3<f64> {
        let normal = vector(self.normal);
        let length = normal.length();
        if length > 0.0 && length.is_finite() {
            normal * (1.0 / length)
        } else {
            V3::of(0.0, 1.0, 0.0)
        }
    }

    /// How far along a ray the plane is, if it is ahead.
    pub fn meet(&self, ray: &Ray) -> Option<f64> {
        let facing = self.facing();
        let t = (vector(self.point) - ray.origin).dot(facing) / ray.direction.dot(facing);
        (t > 0.0 && t.is_finite()).then_some(t)
    }

    /// Where the plane is seen in a picture. A plane figure is seen on its own plane.
    pub fn cut(&self, frame: &Frame, settings: &RenderSettings) -> Cut {
        let figure = Self {
            point: [0.0; 3],
            normal: [0.0, 0.0, 1.0],
            reach: None,
            front: Front::Ghost,
        };
        let slice = if settings.plane { figure } else { *self };
        let rays = Rays::of(settings);
        let mut cut = Cut {
            asked: Asked::default(),
            places: Vec::new(),
            spacing: spacing(settings),
        };
        let square = Square::of(&slice);
        for pixel in 0..rays.pixels() {
            let ray = rays.of_pixel(pixel);
            let depth = frame.depth.get(pixel).copied().unwrap_or(f32::INFINITY);
            let Some(t) = slice.meet(&ray).filter(|&t| t < settings.far) else {
                continue;
            };
            let is_hidden = f64::from(depth) < t * (1.0 - TOUCHING) && !settings.plane;
            if is_hidden && slice.front == Front::Hides {
                continue;
            }
            let point = ray.at(t);
            let [column, row] = [pixel % rays.width(), pixel / rays.width()];
            let step = |x: f64, y: f64| {
                let ray = rays.through([column as f64 + x, row as f64 + y]);
                slice.meet(&ray).map(|t| ray.at(t) - point)
            };
            // At the plane's horizon there is no neighbour; then the other side has one.
            let right = step(1.0, 0.0).or_else(|| step(-1.0, 0.0));
            let below = step(0.0, 1.0).or_else(|| step(0.0, -1.0));
            let (Some(right), Some(below)) = (right, below) else {
                continue;
            };
            let (covered, rim) = square.covers(point, [right, below]);
            if covered <= 0.0 {
                continue;
            }
            cut.asked.pixels.push(pixel as u32);
            cut.asked.points.push(single(point));
            cut.places.push(Place {
                right,
                below,
                covered,
                rim,
                is_hidden,
            });
        }
        cut
    }
}

/// The distance between two lines of a slice: the same round number as in the mode `distance`.
fn spacing(settings: &RenderSettings) -> f32 {
    let settings = RenderSettings {
        mode: Mode::Distance,
        ..settings.clone()
    };
    let nothing_known = FieldFacts {
        raw: false,
        bounds: Bounds::EVERYTHING,
        material: None,
    };
    prepare(&settings, &nothing_known).uniforms.spacing
}

/// The part of a plane that is shown.
struct Square {
    middle: V3<f64>,
    axes: [V3<f64>; 2],
    reach: Option<f64>,
}

impl Square {
    fn of(slice: &Slice) -> Self {
        let n = slice.facing();
        // Along the two axes of the scene that the plane faces least.
        let along = |axis: V3<f64>| {
            let flat = axis - n * axis.dot(n);
            flat * (1.0 / flat.length().max(1e-30))
        };
        let size = n.abs();
        let [x, y, z] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(vector);
        let first = if size.x <= size.y && size.x <= size.z {
            x
        } else if size.y <= size.z {
            y
        } else {
            z
        };
        let first = along(first);
        Self {
            middle: vector(slice.point),
            axes: [first, n.cross(first)],
            reach: slice.reach,
        }
    }

    /// How much of a pixel it covers, and how much of that is its rim; `steps` lead to the neighbouring
    /// pixels.
    fn covers(&self, point: V3<f64>, steps: [V3<f64>; 2]) -> (f32, f32) {
        let Some(reach) = self.reach else {
            return (1.0, 0.0);
        };
        let from = point - self.middle;
        let inside = self.axes.map(|axis| {
            let change: f64 = steps.iter().map(|step| step.dot(axis).powi(2)).sum();
            (reach - from.dot(axis).abs()) / change.sqrt().max(1e-30)
        });
        let pixels = inside[0].min(inside[1]);
        let covered = (pixels + 0.5).clamp(0.0, 1.0);
        let rim = (2.0 - pixels).clamp(0.0, 1.0);
        (covered as f32, rim as f32)
    }
}

/// Where a slice is seen in a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Cut {
    /// The points that an engine is to be asked about.
    pub asked: Asked,
    places: Vec<Place>,
    /// How far apart the lines are, in scene units.
    pub spacing: f32,
}

/// A pixel of a slice.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Place {
    /// From its point to those of the pixels on its right and below.
    right: V3<f64>,
    below: V3<f64>,
    /// How much of the pixel the slice covers, and how much of that is its rim.
    covered: f32,
    rim: f32,
    /// Whether a surface is before it.
    is_hidden: bool,
}

impl Place {
    /// The colour of the field here.
    fn color(&self, sample: &Sample, spacing: f32) -> Color {
        let (distance, gradient) = (sample.distance, double(sample.gradient));
        // How much the field changes from this pixel to the next ones, and how much it would if it
        // changed along the plane.
        let change = gradient.dot(self.right).hypot(gradient.dot(self.below));
        let pixel = (self.right.length() * self.below.length()).sqrt();
        let most = gradient.length() * pixel;
        let known = distance.is_finite() && most.is_finite();
        if !known {
            return NOT_A_NUMBER;
        }
        let least = (most * FLAT[0]).max(pixel * 1e-6).max(1e-30);
        let lined = views::distance_color::<f32>(distance, spacing, change.max(least) as f32);
        let steepness =
            ((change / most.max(1e-30) - FLAT[0]) / (FLAT[1] - FLAT[0])).clamp(0.0, 1.0);
        if steepness == 1.0 {
            return lined;
        }
        // The middle between two lines has none.
        let middle = ((distance.abs() / spacing).floor() + 0.5) * spacing;
        let is_inside = f64::from(distance) < -pixel * FLAT[0];
        let middle = if is_inside { -middle } else { middle };
        let plain = views::distance_color::<f32>(middle, spacing, spacing * 0.01);
        mixed(plain, lined, steepness as f32)
    }
}

impl Cut {
    /// Draws the field over a picture of the scene, which is drawn back a little. `samples` are what an
    /// engine gave for the points.
    pub fn draw(&self, picture: &mut [u8], samples: &[Sample]) {
        let before = picture.to_vec();
        draw_back(picture, 0.35, 0.3);
        let pixels = self.asked.pixels.iter().map(|&pixel| pixel as usize);
        for ((pixel, place), sample) in pixels.zip(&self.places).zip(samples) {
            let shown = place.color(sample, self.spacing);
            let rimmed = mixed(shown, hex(0x30343c), 0.6 * place.rim);
            // What is seen through is a shade of itself, over all of the slice.
            let ghost = before.as_chunks::<4>().0.get(pixel).copied();
            let ink = match ghost.filter(|_| place.is_hidden) {
                Some(ghost) => mixed(rimmed, ink::color(ghost), GHOST),
                None => rimmed,
            };
            lay(picture, pixel, ink, place.covered * OPACITY);
        }
    }
}
