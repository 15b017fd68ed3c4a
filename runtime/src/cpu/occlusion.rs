//! The stage `occlusion`: the fraction of the sky that surfaces see.
//!
//! The field is first sampled at a few taps around each surface. A value that makes a nearby surface possible
//! becomes an occluder candidate. Candidates are checked after all taps ([`candidate_check`]): the checks of
//! many pixels then fill the lanes together.

mod candidate_check;

use super::ray_tasks::{any_nonzero, is_nan, lane_vector, lanes, repeat_first, set_lane_vector};
use super::tile::Tile;
use super::{Evaluator, F32x64, FieldQuantity, LANES, Points};
use crate::render::ray::vector;
use candidate_check::OccluderCandidate;
use sdfc_shaders::features::{Features, Occlusion};
use sdfc_shaders::layout::FrameUniforms;
use sdfc_shaders::marching::FROM_INSIDE;
use sdfc_shaders::{camera, occlusion};
use sdfc_vm::multiversion;
use sdfc_vm::vector::V3;

lanes! {
    /// Surfaces around which the field is sampled.
    SurfaceLanes {
        x, y, z, normal_x, normal_y, normal_z, pixel_x, pixel_y, hidden, side, open_margin, slope,
    }
}

/// The taps around surfaces.
struct Taps<'a> {
    frame: &'a FrameUniforms,
    count: f32,
}

/// A tap and its position relative to its surface.
#[derive(Clone, Copy)]
struct OcclusionTap {
    point: V3<f32>,
    /// Distance to the surface point.
    distance: f32,
    /// Height above the tangent plane of the surface.
    height: f32,
    weight: f32,
}

/// Computes the fraction of the sky that the shown pixels see; returns the number of evaluations.
pub(super) fn find_occlusion(
    frame: &FrameUniforms,
    features: &Features,
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
) -> u64 {
    if features.occlusion == Occlusion::Off {
        return 0;
    }
    let taps = Taps {
        frame,
        count: features.occlusion.taps() as f32,
    };
    let shown = std::mem::take(&mut tile.shown);
    let blocks = evaluator.preferred_blocks(FieldQuantity::Distances);
    let in_blocks = blocks > 1;
    if !in_blocks {
        let regions = tile.boxes_around(&shown, frame.occlusion_reach);
        evaluator.prune_for_regions(FieldQuantity::Distances, &regions);
    }
    let is_hemisphere = matches!(features.occlusion, Occlusion::Multi(_));
    let mut candidates = Vec::new();
    for (region, items) in shown.chunks(LANES * blocks).enumerate() {
        evaluator.select_region((!in_blocks).then_some(region));
        if is_hemisphere {
            sample_hemisphere(&taps, items, tile, evaluator, &mut candidates);
        } else {
            sample_along_normal(&taps, items, tile, evaluator, &mut candidates);
        }
    }
    evaluator.select_region(None);
    let checks =
        candidate_check::check_candidates(&candidates, &mut tile.sky_visibility, evaluator);
    for &item in &shown {
        let hidden = tile.sky_visibility[item as usize];
        tile.sky_visibility[item as usize] =
            occlusion::open_fraction(hidden, frame.occlusion_weight);
    }
    let samples = shown.len() as u64 * u64::from(features.occlusion.taps());
    tile.shown = shown;
    samples + checks
}

multiversion! {
    /// Samples taps over the hemisphere.
    fn sample_hemisphere(
        taps: &Taps<'_>,
        items: &[u32],
        tile: &mut Tile,
        evaluator: &mut dyn Evaluator,
        candidates: &mut Vec<OccluderCandidate>,
    ) = sample::<true>;
}

multiversion! {
    /// Samples taps along the normal.
    fn sample_along_normal(
        taps: &Taps<'_>,
        items: &[u32],
        tile: &mut Tile,
        evaluator: &mut dyn Evaluator,
        candidates: &mut Vec<OccluderCandidate>,
    ) = sample::<false>;
}

/// Samples all taps of pixels. The sum of certain occlusion is left in the tile's `sky_visibility`, and
/// candidates are listed.
#[inline(always)]
fn sample<const IS_HEMISPHERE: bool>(
    taps: &Taps<'_>,
    items: &[u32],
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
    candidates: &mut Vec<OccluderCandidate>,
) {
    let mut blocks: Vec<SurfaceLanes> = items
        .chunks(LANES)
        .map(|items| taps.surfaces(items, tile))
        .collect();
    let mut points = vec![Points::default(); blocks.len()];
    let mut values = vec![F32x64::default(); blocks.len()];
    let last_count = items.len() - (blocks.len() - 1) * LANES;
    let mut index = 0.0;
    while index < taps.count {
        for (block, points) in blocks.iter().zip(&mut points) {
            for i in 0..LANES {
                let V3 { x, y, z } = taps.tap::<IS_HEMISPHERE>(block, i, index).point;
                points[0].0[i] = x;
                points[1].0[i] = y;
                points[2].0[i] = z;
            }
        }
        repeat_first(&mut points[blocks.len() - 1], last_count);
        evaluator.distances_many(&points, items.len(), &mut values);
        for ((block, values), items) in blocks.iter_mut().zip(&values).zip(items.chunks(LANES)) {
            let is_candidate = taps.add_occlusion::<IS_HEMISPHERE>(block, index, values);
            if any_nonzero(&is_candidate) {
                for (i, &item) in items.iter().enumerate() {
                    if is_candidate.0[i] > 0.0 {
                        let tap = taps.tap::<IS_HEMISPHERE>(block, i, index);
                        let [side, open_margin] = [block.side.0[i], block.open_margin.0[i]];
                        candidates.push(OccluderCandidate::new(
                            item,
                            tap,
                            values.0[i] * side,
                            side,
                            open_margin,
                        ));
                    }
                }
            }
        }
        index += 1.0;
    }
    for (block, items) in blocks.iter().zip(items.chunks(LANES)) {
        for (i, &item) in items.iter().enumerate() {
            tile.sky_visibility[item as usize] = block.hidden.0[i];
        }
    }
}

impl Taps<'_> {
    /// Returns the surfaces of at most 64 pixels.
    fn surfaces(&self, items: &[u32], tile: &Tile) -> SurfaceLanes {
        let mut block = SurfaceLanes::default();
        for (lane, &item) in items.iter().enumerate() {
            let item = item as usize;
            let (p, normal, ray) = (
                tile.points[item],
                vector(tile.normals[item]),
                &tile.rays[item],
            );
            set_lane_vector!(block, lane, x, y, z, p);
            set_lane_vector!(block, lane, normal_x, normal_y, normal_z, normal);
            [block.pixel_x.0[lane], block.pixel_y.0[lane]] = tile.pixels[item];
            block.slope.0[lane] = tile.slopes[item];
            block.open_margin.0[lane] = occlusion::open_margin(ray.t, self.frame.rounding);
            let is_inside = ray.status & FROM_INSIDE != 0;
            block.side.0[lane] = if is_inside { -1.0 } else { 1.0 };
        }
        block
    }

    /// Returns a tap of the surface in a lane.
    #[inline(always)]
    fn tap<const IS_HEMISPHERE: bool>(
        &self,
        block: &SurfaceLanes,
        i: usize,
        index: f32,
    ) -> OcclusionTap {
        let p = lane_vector!(block, i, x, y, z);
        let normal = lane_vector!(block, i, normal_x, normal_y, normal_z);
        let reach = self.frame.occlusion_reach;
        if !IS_HEMISPHERE {
            let distance = occlusion::five_tap_distance(index, reach);
            return OcclusionTap {
                point: camera::point_along::<f32>(p, normal, distance),
                distance,
                height: distance,
                weight: occlusion::five_tap_weight(index),
            };
        }
        let seed = V3::new(
            block.pixel_x.0[i],
            block.pixel_y.0[i],
            self.frame.sample as f32,
        );
        let direction = occlusion::hemisphere_direction::<f32>(normal, index, self.count, seed);
        let distance = occlusion::hemisphere_distance(index, seed, reach);
        OcclusionTap {
            point: camera::point_along::<f32>(p, direction, distance),
            distance,
            height: distance * occlusion::hemisphere_cosine(index, self.count),
            weight: 1.0,
        }
    }

    /// Adds the occlusion at a tap, except for candidates. Their lanes are not zero in the result.
    #[inline(always)]
    fn add_occlusion<const IS_HEMISPHERE: bool>(
        &self,
        block: &mut SurfaceLanes,
        index: f32,
        values: &F32x64,
    ) -> F32x64 {
        let mut candidate_mask = F32x64::default();
        for i in 0..LANES {
            let OcclusionTap {
                distance,
                height,
                weight,
                ..
            } = self.tap::<IS_HEMISPHERE>(block, i, index);
            let field = values.0[i] * block.side.0[i];
            let is_candidate = occlusion::is_candidate(field, height, block.slope.0[i]) > 0.0;
            // A positive value that is no candidate hides nothing.
            let clear_field = if field > 0.0 { height } else { field };
            let hidden = occlusion::hidden_weight(
                clear_field + block.open_margin.0[i],
                height,
                distance,
                weight,
            );
            block.hidden.0[i] += if is_nan(field) | is_candidate {
                0.0
            } else {
                hidden
            };
            candidate_mask.0[i] = if is_candidate { 1.0 } else { 0.0 };
        }
        candidate_mask
    }
}
