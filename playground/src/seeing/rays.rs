//! Rays: from pixels to points of the scene, in full precision, as engines send them.

use sdfc_runtime::frame::{Axes, RenderSettings};
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

/// The rays of a picture: those of the first sample of each pixel, whose ends its frame tells.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rays {
    axes: Axes,
    size: [u32; 2],
    /// Where in its pixel the first sample lies, from the middle.
    offset: f64,
}

/// Where a ray starts and which way it goes.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ray {
    /// Its start: the eye, or a point of the plane that parallel rays start on.
    pub origin: V3<f64>,
    /// Its direction, of length one.
    pub direction: V3<f64>,
}

impl Ray {
    /// The point so far along it.
    pub fn at(&self, t: f64) -> V3<f64> {
        self.origin + self.direction * t
    }
}

impl Rays {
    /// The rays of a picture with these settings.
    pub fn of(settings: &RenderSettings) -> Self {
        let size = settings.size.map(|n| n.max(1));
        Self {
            axes: Axes::of(settings),
            size,
            offset: 0.5 / f64::from(settings.aa.max(1)) - 0.5,
        }
    }

    /// How many pixels the picture has.
    pub fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// How many pixels a row has.
    pub fn width(&self) -> usize {
        self.size[0] as usize
    }

    /// The ray of a pixel, by its number.
    pub fn of_pixel(&self, pixel: usize) -> Ray {
        let [column, row] = [pixel % self.width(), pixel / self.width()];
        self.through([column as f64, row as f64])
    }

    /// The ray through a place in the picture, in pixels from the upper left one: its first sample lies
    /// at whole numbers.
    pub fn through(&self, [column, row]: [f64; 2]) -> Ray {
        let [width, height] = self.size.map(f64::from);
        let x = (column + 0.5 + self.offset) / width * 2.0 - 1.0;
        let y = 1.0 - (row + 0.5 + self.offset) / height * 2.0;
        let across = |centre, right, up| vector(centre) + vector(right) * x + vector(up) * y;
        let a = &self.axes;
        let way: V3<f64> = across(a.forward, a.forward_right, a.forward_up);
        Ray {
            origin: across(a.origin, a.origin_right, a.origin_up),
            direction: way * (1.0 / way.length()),
        }
    }
}

/// How far a ray of a plane figure's picture is from the figure's plane, where z is zero.
pub(super) fn to_figure(ray: &Ray) -> Option<f64> {
    let t = -ray.origin.z / ray.direction.z;
    (t > 0.0 && t.is_finite()).then_some(t)
}

/// From an array.
pub(super) fn vector([x, y, z]: [f64; 3]) -> V3<f64> {
    V3::of(x, y, z)
}

/// What engines take.
pub(super) fn single(p: V3<f64>) -> [f32; 3] {
    [p.x as f32, p.y as f32, p.z as f32]
}

/// What engines give.
pub(super) fn double(p: [f32; 3]) -> V3<f64> {
    vector(p.map(f64::from))
}
