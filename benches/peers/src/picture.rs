//! What is compared of two pictures: where there is something, how deep it lies, and which way it
//! faces.

/// A picture, row by row from the upper left.
#[derive(Clone, Debug)]
pub(crate) enum Picture {
    /// Of a figure in the plane: whether a pixel is inside.
    Plane(Vec<bool>),
    /// Of a solid.
    Solid(Vec<Seen>),
}

/// A pixel of a solid's picture.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Seen {
    /// The voxel where the surface is, counted from 1 at the back; 0 where there is none.
    pub(crate) voxel: u32,
    /// The surface's direction in the view's axes, of any length.
    pub(crate) normal: [f32; 3],
}

/// In how many pixels two pictures differ.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Difference {
    /// There is something in one of them only.
    pub(crate) coverage: usize,
    /// The depths are more than one voxel apart.
    pub(crate) depth: usize,
    /// The depths agree and the normals are more than [`NORMAL_DEGREES`] apart: mostly edges,
    /// where one side looks at the surface and the other up to a voxel below it.
    pub(crate) normal: usize,
}

/// How far apart normals may be.
const NORMAL_DEGREES: f32 = 10.0;

impl Difference {
    /// In how many pixels the shapes differ.
    pub(crate) fn pixels(&self) -> usize {
        self.coverage + self.depth
    }

    /// Between two pictures; none where they are not of one kind and size.
    pub(crate) fn between(a: &Picture, b: &Picture) -> Option<Self> {
        match (a, b) {
            (Picture::Plane(a), Picture::Plane(b)) if a.len() == b.len() => Some(Self {
                coverage: a.iter().zip(b).filter(|(a, b)| a != b).count(),
                ..Self::default()
            }),
            (Picture::Solid(a), Picture::Solid(b)) if a.len() == b.len() => {
                let mut all = Self::default();
                for (a, b) in a.iter().zip(b) {
                    if (a.voxel == 0) != (b.voxel == 0) {
                        all.coverage += 1;
                    } else if a.voxel.abs_diff(b.voxel) > 1 {
                        all.depth += 1;
                    } else if a.voxel != 0 && !are_near(a.normal, b.normal) {
                        all.normal += 1;
                    }
                }
                Some(all)
            }
            _ => None,
        }
    }
}

fn are_near(a: [f32; 3], b: [f32; 3]) -> bool {
    let dot = |a: [f32; 3], b: [f32; 3]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f32>();
    let lengths = (dot(a, a) * dot(b, b)).sqrt();
    dot(a, b) >= lengths * NORMAL_DEGREES.to_radians().cos()
}

impl Picture {
    /// The share of pixels where there is something.
    pub(crate) fn covered(&self) -> f64 {
        let (covered, all) = match self {
            Self::Plane(pixels) => (
                pixels.iter().filter(|inside| **inside).count(),
                pixels.len(),
            ),
            Self::Solid(pixels) => (pixels.iter().filter(|p| p.voxel != 0).count(), pixels.len()),
        };
        covered as f64 / all.max(1) as f64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_pixel_counts_once() {
        let seen = |voxel, normal| Seen { voxel, normal };
        let (up, side) = ([0.0, 2.0, 0.0], [1.0, 0.0, 0.0]);
        let a = [
            seen(0, up),
            seen(5, up),
            seen(5, up),
            seen(5, up),
            seen(5, up),
        ];
        let b = [
            seen(3, up),
            seen(7, side),
            seen(6, side),
            seen(4, up),
            seen(5, up),
        ];
        let difference = Difference::between(&Picture::Solid(a.into()), &Picture::Solid(b.into()));
        let wanted = Difference {
            coverage: 1,
            depth: 1,
            normal: 1,
        };
        assert_eq!(difference, Some(wanted));
        assert_eq!(wanted.pixels(), 2);
    }
}
