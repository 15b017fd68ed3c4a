//! The rays of a picture, from its settings in `f64`: what rounding the camera to `f32` does to a
//! picture is an error of the engine that does it.

use crate::frame::{Axes, Lens, RenderSettings};
use sdfc_shaders::camera;
use sdfc_vm::vector::{V2, V3};

/// A ray: the points `origin + t · direction`, for these very numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Where it starts.
    pub origin: [f64; 3],
    /// Which way it goes, as a vector of length one but for rounding.
    pub direction: [f64; 3],
}

impl Ray {
    /// The point at `t`.
    pub fn at(&self, t: f64) -> [f64; 3] {
        std::array::from_fn(|axis| self.origin[axis] + t * self.direction[axis])
    }
}

/// The camera of a picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    axes: Axes,
    size: [u32; 2],
    footprint: f64,
    growth: f64,
}

impl Camera {
    /// The one that these settings describe.
    pub fn of(settings: &RenderSettings) -> Self {
        let height = f64::from(settings.size[1].max(1));
        let across = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt() / height;
        let axes = Axes::of(settings);
        let (footprint, growth) = match settings.view.lens {
            Lens::Perspective(_) => (0.0, across(axes.forward_up)),
            Lens::Orthographic(_) => (across(axes.origin_up), 0.0),
        };
        Self {
            axes,
            size: settings.size,
            footprint,
            growth,
        }
    }

    /// The ray of a pixel, counted from the upper left; `offset` is where in the pixel it goes, from
    /// (-½, -½) to (½, ½), its centre being (0, 0).
    pub fn ray(&self, [x, y]: [f64; 2], offset: [f64; 2]) -> Ray {
        let pair = |[x, y]: [f64; 2]| V2 { x, y };
        let vector = |[x, y, z]: [f64; 3]| V3::of(x, y, z);
        let size = self.size.map(|side| f64::from(side.max(1)));
        let place = camera::place_in_view::<f64>(pair([x, y]), pair(offset), pair(size));
        let a = &self.axes;
        let origin = camera::across::<f64>(
            place,
            vector(a.origin),
            vector(a.origin_right),
            vector(a.origin_up),
        );
        let way = camera::across::<f64>(
            place,
            vector(a.forward),
            vector(a.forward_right),
            vector(a.forward_up),
        );
        let way = camera::unit::<f64>(way);
        Ray {
            origin: [origin.x, origin.y, origin.z],
            direction: [way.x, way.y, way.z],
        }
    }

    /// How much longer a ray is than that in the middle of the picture, up to the same plane across
    /// the view.
    pub fn slant(&self, ray: &Ray) -> f64 {
        let along = (0..3).map(|axis| ray.direction[axis] * self.axes.forward[axis]);
        1.0 / along.sum::<f64>()
    }

    /// Half of a pixel's height at `t` along its ray.
    pub fn half_pixel(&self, t: f64) -> f64 {
        camera::half_pixel::<f64>(t, self.footprint, self.growth)
    }
}
