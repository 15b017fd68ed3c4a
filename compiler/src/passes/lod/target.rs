//! View for which detail is simplified, and the report of what that changed.

use sdfc_vm::bounds::Bounds;

/// Camera for which a scene is simplified, and the tolerance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LodTarget {
    /// Position of the camera.
    pub camera_position: [f64; 3],
    /// Footprint of a pixel.
    pub pixel: PixelSize,
    /// Maximum error, in pixels.
    pub tolerance: f64,
}

/// Footprint of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PixelSize {
    /// An angle in radians: the smallest of all pixels of the picture.
    Angle(f64),
    /// A length, equal at all distances.
    Length(f64),
}

impl PixelSize {
    /// Returns the pixel of a perspective picture with this size and vertical field of view. It is that
    /// of a corner, where the projection stretches the most.
    pub fn from_perspective(field_of_view: f64, [width, height]: [u32; 2]) -> Self {
        let [width, height] = [width, height].map(f64::from);
        let up = (field_of_view / 2.0).tan();
        let corner = (up * up) * (1.0 + (width / height).powi(2));
        Self::Angle(2.0 * up / height / (1.0 + corner))
    }

    /// Returns the pixel of a parallel projection that shows this height.
    pub fn from_parallel(shown: f64, [_, height]: [u32; 2]) -> Self {
        Self::Length(shown / f64::from(height))
    }
}

impl LodTarget {
    /// Returns the side of a pixel, in scene units, at a distance from the camera.
    pub fn pixel_size(&self, distance: f64) -> f64 {
        match self.pixel {
            PixelSize::Angle(angle) => distance * angle,
            PixelSize::Length(length) => length,
        }
    }

    /// Returns the distance of a box from the camera.
    pub(super) fn distance(&self, bounds: &Bounds) -> f64 {
        bounds.distance(self.camera_position)
    }
}

/// Result of a pass that may change the value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct LodReport {
    /// Number of replaced nodes.
    pub replaced: usize,
    /// Maximum error, in pixels.
    pub max_error_pixels: f64,
}
