//! Gradients that do not lead to the surface beside which they were taken.
//!
//! A raw field was divided by a bound, often a large one. Just outside a floor its value may be smaller than
//! the floor's, though its surface is far away. Its gradient is then wrong; just inside the floor the gradient
//! is right. Beside a discontinuity the gradient is that of the discontinuous term on both sides. Finite
//! differences then give the normal.

use super::{finite_differences, points_near_hit, set_lane, store_normals, tap_distance};
use crate::cpu::ray_tasks::repeat_first;
use crate::cpu::tile::Tile;
use crate::cpu::{Evaluator, F32x64, LANES, Points};
use sdfc_shaders::features::Normals;
use sdfc_shaders::layout::FrameUniforms;
use sdfc_shaders::normals::AT_DISCONTINUITIES;
use sdfc_shaders::{marching, normals};
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

/// A pixel whose gradient is doubtful.
#[derive(Clone, Copy, Debug)]
pub(super) struct DoubtfulNormal {
    item: u32,
    /// Value of the field just outside.
    value: f32,
    /// Length of the gradient there.
    slope: f32,
}

impl DoubtfulNormal {
    /// Returns the pixel if the gradient and the value in a lane are doubtful.
    fn from_lane(item: u32, gradients: &[F32x64; 4], lane: usize, rounding: f32) -> Option<Self> {
        let [x, y, z, value] = gradients.each_ref().map(|column| column.0[lane]);
        let slope = V3::new(x, y, z).length();
        let is_doubtful = normals::is_doubtful(value, slope, rounding) > 0.0;
        is_doubtful.then_some(Self { item, value, slope })
    }
}

/// Returns the rounding of the field where a pixel's ray ended.
fn rounding(frame: &FrameUniforms, tile: &Tile, item: u32) -> f32 {
    marching::rounding_at(tile.rays[item as usize].t, frame.rounding)
}

/// Lists the pixels whose gradients are doubtful.
pub(super) fn list_doubtful(
    frame: &FrameUniforms,
    items: &[u32],
    gradients: &[F32x64; 4],
    tile: &Tile,
    doubtful: &mut Vec<DoubtfulNormal>,
) {
    for (lane, &item) in items.iter().enumerate() {
        doubtful.extend(DoubtfulNormal::from_lane(
            item,
            gradients,
            lane,
            rounding(frame, tile, item),
        ));
    }
}

/// Recomputes doubtful normals, just inside or by finite differences; returns the number of evaluations.
pub(super) fn recompute(
    frame: &FrameUniforms,
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
    doubtful: &[DoubtfulNormal],
) -> u64 {
    if doubtful.is_empty() {
        return 0;
    }
    let discontinuities = retry_inside(frame, tile, evaluator, doubtful);
    use_finite_differences(frame, tile, evaluator, &discontinuities);
    (doubtful.len() + discontinuities.len() * normals::taps(AT_DISCONTINUITIES).len()) as u64
}

/// Takes gradients just inside; returns the pixels beside which the field has a discontinuity.
fn retry_inside(
    frame: &FrameUniforms,
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
    doubtful: &[DoubtfulNormal],
) -> Vec<u32> {
    let mut discontinuities = Vec::new();
    let (mut pixels, mut points) = (Points::default(), Points::default());
    let mut gradients = [F32x64::default(); 4];
    for chunk in doubtful.chunks(LANES) {
        for (lane, entry) in chunk.iter().enumerate() {
            let [x, y] = tile.pixels[entry.item as usize];
            set_lane(
                &mut pixels,
                lane,
                V3::new(x, y, tile.rays[entry.item as usize].t),
            );
        }
        points_near_hit(frame, &pixels, -1.0, &mut points);
        repeat_first(&mut points, chunk.len());
        evaluator.gradients(&points, chunk.len(), &mut gradients);
        let mut resolved = Vec::with_capacity(chunk.len());
        for (lane, entry) in chunk.iter().enumerate() {
            if DoubtfulNormal::from_lane(
                entry.item,
                &gradients,
                lane,
                rounding(frame, tile, entry.item),
            )
            .is_none()
            {
                for column in &mut gradients {
                    column.0[resolved.len()] = column.0[lane];
                }
                resolved.push(entry.item);
            } else {
                let distance = tap_distance(frame, Normals::Exact, tile, entry.item);
                if normals::is_discontinuous(entry.value, entry.slope, distance) > 0.0 {
                    discontinuities.push(entry.item);
                }
            }
        }
        store_normals(frame, &resolved, Normals::Exact, &mut gradients, tile);
    }
    discontinuities
}

/// Takes finite differences across discontinuities.
fn use_finite_differences(
    frame: &FrameUniforms,
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
    discontinuities: &[u32],
) {
    let (mut points, mut tap_distances) = (Points::default(), F32x64::default());
    for items in discontinuities.chunks(LANES) {
        for (lane, &item) in items.iter().enumerate() {
            tap_distances.0[lane] = tap_distance(frame, Normals::Exact, tile, item);
            set_lane(&mut points, lane, tile.points[item as usize]);
        }
        repeat_first(&mut points, items.len());
        let mut gradients = finite_differences(
            AT_DISCONTINUITIES,
            &points,
            &tap_distances,
            items.len(),
            evaluator,
        );
        store_normals(frame, items, AT_DISCONTINUITIES, &mut gradients, tile);
    }
}
