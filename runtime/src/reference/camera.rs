//! The rays of a picture, computed from its settings in `f64`. The rounding of the camera to `f32` is an
//! error of the engine that does it.

use crate::render::{Axes, RenderSettings, ResolvedLens};
use glam::DVec3;
use sdfc_shaders::camera;
use sdfc_vm::settings::Enclosure;
use sdfc_vm::vector::{V2, V3};

/// A ray: the points `origin + t · direction`, for exactly these numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ReferenceRay {
    /// Start of the ray.
    pub origin: [f64; 3],
    /// Direction, of unit length but for rounding.
    pub direction: [f64; 3],
}

impl ReferenceRay {
    /// Returns the point at `t`.
    pub fn at(&self, t: f64) -> [f64; 3] {
        (DVec3::from(self.origin) + t * DVec3::from(self.direction)).into()
    }
}

/// The camera of a picture.
#[derive(Clone, Debug, PartialEq)]
pub struct ReferenceCamera {
    axes: Axes,
    far: f64,
    extended_far: f64,
    enclosure: Option<Enclosure>,
    size: [u32; 2],
    half_pixel_size: f64,
    growth: f64,
}

impl ReferenceCamera {
    /// Creates the camera that these settings describe.
    pub fn new(settings: &RenderSettings) -> Self {
        let height = f64::from(settings.size[1].max(1));
        let across = |v: [f64; 3]| DVec3::from(v).length() / height;
        let axes = Axes::from_settings(settings);
        let (half_pixel_size, growth) = match settings.view.lens {
            ResolvedLens::Perspective(_) => (0.0, across(axes.forward_up)),
            ResolvedLens::Orthographic(_) => (across(axes.origin_up), 0.0),
        };
        Self {
            axes,
            far: settings.far,
            extended_far: settings.extended_far,
            enclosure: settings.enclosure.clone(),
            size: settings.size,
            half_pixel_size,
            growth,
        }
    }

    /// Returns the ray of a pixel, counted from the upper left. `offset` is the ray's position in the pixel,
    /// from (-½, -½) to (½, ½). At (0, 0) it is that of a single sample, [`camera::SAMPLE_SHIFT`] beside the
    /// centre.
    pub fn ray(&self, [x, y]: [f64; 2], offset: [f64; 2]) -> ReferenceRay {
        let pair = |[x, y]: [f64; 2]| V2 { x, y };
        let vector = |[x, y, z]: [f64; 3]| V3::new(x, y, z);
        let size = self.size.map(|side| f64::from(side.max(1)));
        let view_position = camera::view_position::<f64>(pair([x, y]), pair(offset), pair(size));
        let a = &self.axes;
        let origin = camera::interpolate_view::<f64>(
            view_position,
            vector(a.origin),
            vector(a.origin_right),
            vector(a.origin_up),
        );
        let direction = camera::interpolate_view::<f64>(
            view_position,
            vector(a.forward),
            vector(a.forward_right),
            vector(a.forward_up),
        );
        let direction = camera::unit::<f64>(direction);
        ReferenceRay {
            origin: [origin.x, origin.y, origin.z],
            direction: [direction.x, direction.y, direction.z],
        }
    }

    /// Returns the maximum length of a ray. One that falls towards a half space reaches it.
    pub fn far(&self, ray: &ReferenceRay) -> f64 {
        let vector = |[x, y, z]: [f64; 3]| V3::new(x, y, z);
        let Some(enclosure) = &self.enclosure else {
            return self.far;
        };
        let half_spaces = enclosure.half_spaces.iter().enumerate();
        let exits = half_spaces.map(|(number, &[x, y, z, offset])| {
            camera::half_space_exit::<f64>(
                vector(ray.origin),
                vector(ray.direction),
                V3::new(x, y, z),
                offset,
                match number < enclosure.solid_half_spaces {
                    true => enclosure.solid_depth,
                    false => camera::NEVER,
                },
                self.far,
                self.extended_far,
            )
        });
        exits.fold(self.far, f64::max)
    }

    /// Returns the ratio of a ray's length to that of the central ray, up to the same plane across the view.
    pub fn slant(&self, ray: &ReferenceRay) -> f64 {
        1.0 / DVec3::from(ray.direction).dot(self.axes.forward.into())
    }

    /// Returns half of a pixel's height at `t` along its ray.
    pub fn half_pixel(&self, t: f64) -> f64 {
        camera::half_pixel::<f64>(t, self.half_pixel_size, self.growth)
    }
}
