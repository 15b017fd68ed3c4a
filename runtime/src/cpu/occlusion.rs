//! The stage `occlusion`: the part of the sky that surfaces see.
//!
//! The field is sampled at a few taps around each surface first. Where a value claims that something is near, that is
//! checked after all taps ([`check`]): the checks of many pixels then fill the lanes together.

mod check;

use super::lanes::{any, is_nan, lanes, repeat_first};
use super::march::vector;
use super::tile::Tile;
use super::{Asked, Column, Evaluator, LANES, Points};
use check::Claim;
use sdfc_shaders::features::{Features, Occlusion};
use sdfc_shaders::layout::Frame;
use sdfc_shaders::marching::{self, FROM_INSIDE};
use sdfc_shaders::{camera, occlusion};
use sdfc_vm::vector::V3;
use sdfc_vm::widest;

lanes! {
    /// Surfaces around which the field is sampled.
    SurfaceLanes {
        x, y, z, normal_x, normal_y, normal_z, place_x, place_y, hidden, side, unsure, slope,
    }
}

/// The taps around surfaces.
struct Taps<'a> {
    frame: &'a Frame,
    count: f32,
}

/// The place of a tap relative to its surface.
#[derive(Clone, Copy)]
struct Tap {
    at: V3<f32>,
    /// The distance to the surface.
    distance: f32,
    /// The height above a plane through the surface.
    height: f32,
    weight: f32,
}

/// Finds what the shown pixels see of the sky; gives the number of evaluations.
pub(super) fn look_around(
    frame: &Frame,
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
    let blocks = evaluator.blocks(Asked::Distances);
    let together = blocks > 1;
    if !together {
        let regions = tile.regions_of(&shown, frame.occlusion_reach);
        evaluator.announce(Asked::Distances, &regions);
    }
    let is_many = matches!(features.occlusion, Occlusion::Multi(_));
    let mut claims = Vec::new();
    for (region, items) in shown.chunks(LANES * blocks).enumerate() {
        evaluator.focus((!together).then_some(region));
        if is_many {
            sample_many(&taps, items, tile, evaluator, &mut claims);
        } else {
            sample_five(&taps, items, tile, evaluator, &mut claims);
        }
    }
    evaluator.focus(None);
    let checks = check::all(&claims, &mut tile.open, evaluator);
    for &item in &shown {
        let hidden = tile.open[item as usize];
        tile.open[item as usize] = occlusion::open(hidden, frame.occlusion_weight);
    }
    let samples = shown.len() as u64 * u64::from(features.occlusion.taps());
    tile.shown = shown;
    samples + checks
}

widest! {
    /// Samples taps over the hemisphere.
    fn sample_many(
        taps: &Taps<'_>,
        items: &[u32],
        tile: &mut Tile,
        evaluator: &mut dyn Evaluator,
        claims: &mut Vec<Claim>,
    ) = sample::<true>;
}

widest! {
    /// Samples taps along the normal.
    fn sample_five(
        taps: &Taps<'_>,
        items: &[u32],
        tile: &mut Tile,
        evaluator: &mut dyn Evaluator,
        claims: &mut Vec<Claim>,
    ) = sample::<false>;
}

/// Samples all taps of pixels. What is hidden for certain is left in `open`, and what is claimed is listed.
#[inline(always)]
fn sample<const MANY: bool>(
    taps: &Taps<'_>,
    items: &[u32],
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
    claims: &mut Vec<Claim>,
) {
    let mut blocks: Vec<SurfaceLanes> = items
        .chunks(LANES)
        .map(|items| taps.surfaces(items, tile))
        .collect();
    let mut points = vec![Points::default(); blocks.len()];
    let mut values = vec![Column::default(); blocks.len()];
    let last = items.len() - (blocks.len() - 1) * LANES;
    let mut index = 0.0;
    while index < taps.count {
        for (block, points) in blocks.iter().zip(&mut points) {
            for i in 0..LANES {
                let V3 { x, y, z } = taps.tap::<MANY>(block, i, index).at;
                points[0].0[i] = x;
                points[1].0[i] = y;
                points[2].0[i] = z;
            }
        }
        repeat_first(&mut points[blocks.len() - 1], last);
        evaluator.distances_many(&points, items.len(), &mut values);
        for ((block, values), items) in blocks.iter_mut().zip(&values).zip(items.chunks(LANES)) {
            let claimed = taps.hide::<MANY>(block, index, values);
            if any(&claimed) {
                for (i, &item) in items.iter().enumerate() {
                    if claimed.0[i] > 0.0 {
                        let tap = taps.tap::<MANY>(block, i, index);
                        let [side, unsure] = [block.side.0[i], block.unsure.0[i]];
                        claims.push(Claim::new(item, tap, values.0[i] * side, side, unsure));
                    }
                }
            }
        }
        index += 1.0;
    }
    for (block, items) in blocks.iter().zip(items.chunks(LANES)) {
        for (i, &item) in items.iter().enumerate() {
            tile.open[item as usize] = block.hidden.0[i];
        }
    }
}

impl Taps<'_> {
    /// The surfaces of at most 64 pixels.
    fn surfaces(&self, items: &[u32], tile: &Tile) -> SurfaceLanes {
        let mut b = SurfaceLanes::default();
        for (lane, &item) in items.iter().enumerate() {
            let item = item as usize;
            let (p, normal, ray) = (
                tile.points[item],
                vector(tile.normals[item]),
                &tile.rays[item],
            );
            b.x.0[lane] = p.x;
            b.y.0[lane] = p.y;
            b.z.0[lane] = p.z;
            b.normal_x.0[lane] = normal.x;
            b.normal_y.0[lane] = normal.y;
            b.normal_z.0[lane] = normal.z;
            [b.place_x.0[lane], b.place_y.0[lane]] = tile.pixels[item];
            b.slope.0[lane] = tile.slopes[item];
            // What rounding may take from the field counts as open.
            b.unsure.0[lane] = marching::rounding_at(ray.t, self.frame.rounding);
            let is_inside = ray.status & FROM_INSIDE != 0;
            b.side.0[lane] = if is_inside { -1.0 } else { 1.0 };
        }
        b
    }

    /// A tap of the surface in a lane.
    #[inline(always)]
    fn tap<const MANY: bool>(&self, b: &SurfaceLanes, i: usize, index: f32) -> Tap {
        let p = V3::of(b.x.0[i], b.y.0[i], b.z.0[i]);
        let normal = V3::of(b.normal_x.0[i], b.normal_y.0[i], b.normal_z.0[i]);
        let reach = self.frame.occlusion_reach;
        if !MANY {
            let distance = occlusion::five_distance(index, reach);
            return Tap {
                at: camera::along::<f32>(p, normal, distance),
                distance,
                height: distance,
                weight: occlusion::five_weight(index),
            };
        }
        let place = V3::of(b.place_x.0[i], b.place_y.0[i], self.frame.sample as f32);
        let direction = occlusion::many_direction::<f32>(normal, index, self.count, place);
        let distance = occlusion::many_distance(index, place, reach);
        Tap {
            at: camera::along::<f32>(p, direction, distance),
            distance,
            height: distance * occlusion::many_cosine(index, self.count),
            weight: 1.0,
        }
    }

    /// Adds what a tap sees hidden, but for claims: those lanes are not zero in the result.
    #[inline(always)]
    fn hide<const MANY: bool>(&self, b: &mut SurfaceLanes, index: f32, values: &Column) -> Column {
        let mut claimed = Column::default();
        for i in 0..LANES {
            let Tap {
                distance,
                height,
                weight,
                ..
            } = self.tap::<MANY>(b, i, index);
            let field = values.0[i] * b.side.0[i];
            let claims = occlusion::claims(field, height, b.slope.0[i]) > 0.0;
            // What claims nothing hides nothing.
            let clear = if field > 0.0 { height } else { field };
            let hidden = occlusion::hidden(clear + b.unsure.0[i], height, distance, weight);
            b.hidden.0[i] += if is_nan(field) | claims { 0.0 } else { hidden };
            claimed.0[i] = if claims { 1.0 } else { 0.0 };
        }
        claimed
    }
}
