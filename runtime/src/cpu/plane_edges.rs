//! Edges of 2-D shapes: how much of a pixel is covered.
//!
//! The edge is where the field changes its sign. Where the field is nearly a plane, its values at the pixel and at
//! the neighbours tell how much is covered. Elsewhere signs are counted. See [`sdfc_shaders::views`].

use super::{F32x64, LANES};
use crate::render::{ExactValues, PixelPlane};
use rayon::prelude::*;
use sdfc_shaders::views;
use sdfc_vm::vector::V2;

/// Number of points of a sample's square at which signs are counted.
const COUNTS: usize = views::COUNTS as usize;
/// Number of pixels whose points are evaluated at once.
const PIXELS: usize = LANES / COUNTS;

/// Ratio of a field's change per pixel to its largest change between neighbours, at most: √2, and rounding.
const MAX_CHANGE_RATIO: f32 = 1.5;

/// A picture of a plane, row after row.
#[derive(Clone, Debug)]
pub struct PlanePicture {
    /// The field at each pixel.
    pub values: Vec<f32>,
    /// The fraction of each pixel's square that is covered, but in the border; nothing where it is not needed.
    pub covered: Vec<f32>,
    /// Number of values in a row.
    pub width: usize,
    /// Number of pixels around the picture: 1 where coverage is computed, else 0.
    pub border: usize,
}

impl PlanePicture {
    /// Computes the coverage that `exact` asks for. `evaluate` returns the field at a position in the plane.
    pub(crate) fn new(
        values: Vec<f32>,
        plane: &PixelPlane,
        exact: ExactValues,
        evaluate: impl Fn(f32, f32) -> f32 + Sync,
    ) -> Self {
        let [width, height] = plane.size;
        let mut picture = Self {
            covered: Vec::new(),
            values,
            width,
            border: usize::from(exact.edges.is_some()),
        };
        let Some(samples) = exact.edges else {
            return picture;
        };
        picture.covered = vec![0.0; width * height];
        let values = PlaneValues {
            values: &picture.values,
            width,
        };
        let rows = picture.covered.par_chunks_mut(width).enumerate();
        rows.skip(1).take(height - 2).for_each(|(y, row)| {
            let pixels = y * width + 1..(y + 1) * width - 1;
            cover(values, pixels, samples, &mut row[1..], |positions| {
                let mut fields = F32x64::default();
                for (field, &[x, y]) in fields.0.iter_mut().zip(positions) {
                    *field = evaluate(x, y);
                }
                fields
            });
        });
        picture
    }
}

/// The field at the pixels of a picture, row after row.
#[derive(Clone, Copy)]
pub(super) struct PlaneValues<'a> {
    /// Values, in rows of `width`.
    pub(super) values: &'a [f32],
    /// Number of values in a row.
    pub(super) width: usize,
}

impl PlaneValues<'_> {
    /// Returns the fraction of a sample's square that is covered, or `None` if its neighbours do not tell.
    fn known_coverage(&self, k: usize, samples: f32) -> Option<f32> {
        let row = |middle: usize| -> [f32; 3] {
            let values = &self.values[middle - 1..middle + 2];
            [values[0], values[1], values[2]]
        };
        let [upper_left, above, upper_right] = row(k - self.width);
        let [left, field, right] = row(k);
        let [lower_left, below, lower_right] = row(k + self.width);
        let change = views::steepest_change::<f32>(
            V2 {
                x: views::change_per_pixel(left, field, right),
                y: views::change_per_pixel(above, field, below),
            },
            field,
            upper_left,
            upper_right,
            lower_left,
            lower_right,
        );
        let pixels = views::pixels_to_edge::<f32>(field, change);
        let is_uneven = views::is_uneven_edge(
            field,
            left,
            right,
            above,
            below,
            upper_left,
            upper_right,
            lower_left,
            lower_right,
            change,
            pixels,
        );
        (is_uneven < 0.5).then(|| views::coverage(pixels, samples))
    }

    /// Reports whether a pixel and its neighbours have values of one sign, and the edge is far.
    fn is_far_from_edge(&self, k: usize) -> bool {
        let field = self.values[k];
        let is_inside = field < 0.0;
        let (mut differ, mut largest) = (false, 0.0_f32);
        for row in [k - self.width, k, k + self.width] {
            for &neighbour in &self.values[row - 1..row + 2] {
                differ |= (neighbour < 0.0) != is_inside;
                largest = largest.max((neighbour - field).abs());
            }
        }
        // A change along both axes is at most √2 times the larger one.
        !differ && field.abs() > MAX_CHANGE_RATIO * views::NEAR_EDGE as f32 * largest
    }
}

/// Computes the fractions of samples' squares that are covered. `pixels` are indices of values with neighbours.
/// `evaluate` returns the field at up to 64 positions in the picture of values, in pixels.
pub(super) fn cover(
    picture: PlaneValues<'_>,
    pixels: impl Iterator<Item = usize>,
    samples: u32,
    covered: &mut [f32],
    mut evaluate: impl FnMut(&[[f32; 2]]) -> F32x64,
) {
    let samples = samples as f32;
    let mut uneven: Vec<(usize, usize)> = Vec::new();
    for (i, k) in pixels.enumerate() {
        let is_inside = picture.values[k] < 0.0;
        covered[i] = if picture.is_far_from_edge(k) {
            f32::from(u8::from(is_inside))
        } else if let Some(known) = picture.known_coverage(k, samples) {
            known
        } else {
            uneven.push((i, k));
            continue;
        };
    }
    let offsets: [V2<f32>; COUNTS] =
        std::array::from_fn(|count| views::count_offset::<f32>(count as f32, samples));
    let mut positions = [[0.0; 2]; LANES];
    for uneven in uneven.chunks(PIXELS) {
        for (&(_, k), positions) in uneven.iter().zip(positions.chunks_mut(COUNTS)) {
            let (x, y) = ((k % picture.width) as f32, (k / picture.width) as f32);
            for (position, offset) in positions.iter_mut().zip(&offsets) {
                *position = [x + offset.x, y + offset.y];
            }
        }
        let fields = evaluate(&positions[..uneven.len() * COUNTS]);
        for (&(i, _), fields) in uneven.iter().zip(fields.0.chunks(COUNTS)) {
            let inside = fields.iter().filter(|&&field| field < 0.0).count();
            covered[i] = inside as f32 / COUNTS as f32;
        }
    }
}
