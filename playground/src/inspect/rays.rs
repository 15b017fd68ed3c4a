//! Rays through pixels, computed in `f64` with the axes that engines use.

use glam::DVec3;
use sdfc_runtime::reference::ReferenceCamera;
use sdfc_runtime::render::RenderSettings;

/// Rays of a picture: those of the first sample of each pixel, to which the channels of its image belong.
#[derive(Clone, Debug, PartialEq)]
pub struct PictureRays {
    camera: ReferenceCamera,
    size: [u32; 2],
    /// Offset of the first sample from the pixel centre, in pixels.
    offset: f64,
}

/// A ray with origin and direction.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct InspectedRay {
    /// Origin: the camera, or a point of the plane that parallel rays start on.
    pub origin: DVec3,
    /// Direction of length one.
    pub direction: DVec3,
}

impl InspectedRay {
    /// Returns the point at distance `t`.
    pub fn at(&self, t: f64) -> DVec3 {
        self.origin + self.direction * t
    }
}

impl PictureRays {
    /// Creates the rays of a picture with these settings.
    pub fn new(settings: &RenderSettings) -> Self {
        let size = settings.size.map(|n| n.max(1));
        Self {
            camera: ReferenceCamera::new(settings),
            size,
            offset: 0.5 / f64::from(settings.aa.max(1)) - 0.5,
        }
    }

    /// Returns the number of pixels of the picture.
    pub fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// Returns the number of pixels of a row.
    pub fn width(&self) -> usize {
        self.size[0] as usize
    }

    /// Returns the ray of a pixel, given its index.
    pub fn for_pixel(&self, pixel: usize) -> InspectedRay {
        let [column, row] = [pixel % self.width(), pixel / self.width()];
        self.through([column as f64, row as f64])
    }

    /// Returns the ray through a position in the picture, in pixels from the upper left one. The first
    /// samples of pixels have integer positions.
    pub fn through(&self, [column, row]: [f64; 2]) -> InspectedRay {
        let ray = self.camera.ray([column, row], [self.offset; 2]);
        InspectedRay {
            origin: ray.origin.into(),
            direction: ray.direction.into(),
        }
    }
}

/// Returns the distance along a ray to the plane z = 0 of a 2-D shape, if it is ahead.
pub(super) fn distance_to_figure_plane(ray: &InspectedRay) -> Option<f64> {
    let t = -ray.origin.z / ray.direction.z;
    (t > 0.0 && t.is_finite()).then_some(t)
}
