//! Comparison of two pictures by coverage, depth and direction of the surface.

/// A picture, row by row from the upper left.
#[derive(Clone, Debug)]
pub(crate) enum ComparedImage {
    /// Picture of a 2-D shape: `true` for pixels inside.
    Plane(Vec<bool>),
    /// Picture of a solid.
    Solid(Vec<SurfacePixel>),
}

/// A pixel of a solid's picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct SurfacePixel {
    /// Voxel of the surface, counted from 1 at the back, or 0 without a surface.
    pub(crate) voxel: u32,
    /// Normal of the surface in the view's axes, of any length.
    pub(crate) normal: [f32; 3],
}

/// Numbers of pixels that differ between two pictures.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct PixelDifference {
    /// Only one of them shows a surface.
    pub(crate) coverage: usize,
    /// The depths differ by more than one voxel.
    pub(crate) depth: usize,
    /// The depths agree and the normals differ by more than [`MAX_NORMAL_ANGLE_DEGREES`]. These are mostly
    /// edges, where one renderer samples the surface and the other up to a voxel below it.
    pub(crate) normal: usize,
}

/// Largest angle between normals that count as equal.
const MAX_NORMAL_ANGLE_DEGREES: f32 = 10.0;

impl PixelDifference {
    /// Returns the number of pixels in which the shapes differ.
    pub(crate) fn pixels(&self) -> usize {
        self.coverage + self.depth
    }

    /// Compares two pictures, or returns `None` if their kinds or sizes differ.
    pub(crate) fn between(a: &ComparedImage, b: &ComparedImage) -> Option<Self> {
        match (a, b) {
            (ComparedImage::Plane(a), ComparedImage::Plane(b)) if a.len() == b.len() => Some(Self {
                coverage: a.iter().zip(b).filter(|(a, b)| a != b).count(),
                ..Self::default()
            }),
            (ComparedImage::Solid(a), ComparedImage::Solid(b)) if a.len() == b.len() => {
                let mut total = Self::default();
                for (a, b) in a.iter().zip(b) {
                    if (a.voxel == 0) != (b.voxel == 0) {
                        total.coverage += 1;
                    } else if a.voxel.abs_diff(b.voxel) > 1 {
                        total.depth += 1;
                    } else if a.voxel != 0 && !are_normals_close(a.normal, b.normal) {
                        total.normal += 1;
                    }
                }
                Some(total)
            }
            _ => None,
        }
    }
}

fn are_normals_close(a: [f32; 3], b: [f32; 3]) -> bool {
    let dot = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
    let lengths = (dot(a, a) * dot(b, b)).sqrt();
    dot(a, b) >= lengths * MAX_NORMAL_ANGLE_DEGREES.to_radians().cos()
}

impl ComparedImage {
    /// Returns the fraction of pixels with a surface.
    pub(crate) fn covered(&self) -> f64 {
        let (covered, total) = match self {
            Self::Plane(pixels) => (
                pixels.iter().filter(|inside| **inside).count(),
                pixels.len(),
            ),
            Self::Solid(pixels) => (pixels.iter().filter(|p| p.voxel != 0).count(), pixels.len()),
        };
        covered as f64 / total.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_counts_once() {
        let pixel = |voxel, normal| SurfacePixel { voxel, normal };
        let (up, side) = ([0.0, 2.0, 0.0], [1.0, 0.0, 0.0]);
        let a = [
            pixel(0, up),
            pixel(5, up),
            pixel(5, up),
            pixel(5, up),
            pixel(5, up),
        ];
        let b = [
            pixel(3, up),
            pixel(7, side),
            pixel(6, side),
            pixel(4, up),
            pixel(5, up),
        ];
        let difference = PixelDifference::between(&ComparedImage::Solid(a.into()), &ComparedImage::Solid(b.into()));
        let expected = PixelDifference {
            coverage: 1,
            depth: 1,
            normal: 1,
        };
        assert_eq!(difference, Some(expected));
        assert_eq!(expected.pixels(), 2);
    }
}
