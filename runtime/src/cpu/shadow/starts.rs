//! The starts of rays towards a light, computed 64 at a time.

use super::super::LANES;
use super::super::ray_tasks::{lane_vector, lanes, set_lane_vector};
use super::super::tile::Tile;
use crate::render::ray::vector;
use sdfc_shaders::layout::{FrameUniforms, LightRecord};
use sdfc_shaders::marching::FROM_INSIDE;
use sdfc_shaders::{camera, marching, normals, reflectance, shadow};
use sdfc_vm::multiversion;
use sdfc_vm::real::{Real, Vector3};
use sdfc_vm::vector::V3;

lanes! {
    /// Starts at 64 surfaces.
    StartLanes {
        x, y, z, normal_x, normal_y, normal_z, distance,
        start_x, start_y, start_z, direction_x, direction_y, direction_z,
        cosine, start_t, exit_t, light_t, min_step, rounding,
    }
}

/// Start of a ray towards a light.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct ShadowRayStart {
    /// Index of the pixel in the tile.
    pub(super) item: u32,
    /// Set if the surface faces the light.
    pub(super) is_facing: bool,
    pub(super) origin: V3<f32>,
    pub(super) direction: V3<f32>,
    /// Distance along the ray of its first sample.
    pub(super) start_t: f32,
    pub(super) exit_t: f32,
    pub(super) light_t: f32,
    pub(super) min_step: f32,
    /// Rounding error of the field at the surface.
    pub(super) rounding: f32,
    /// −1 where the surface is seen from inside, else 1.
    pub(super) side: f32,
}

/// Light as the starts of its rays depend on it.
#[derive(Clone, Copy)]
pub(super) struct ShadowCaster<'a> {
    pub(super) light: &'a LightRecord,
    /// Size of the light, or 0 without penumbras.
    pub(super) size: f32,
    /// 1 for sharp shadows, else 0.
    pub(super) is_sharp: f32,
}

multiversion! {
    /// Returns the starts at all shown pixels.
    pub(super) fn ray_starts(
        frame: &FrameUniforms,
        caster: ShadowCaster<'_>,
        tile: &Tile,
    ) -> Vec<ShadowRayStart> = ray_starts_body;
}

#[inline(always)]
fn ray_starts_body(
    frame: &FrameUniforms,
    caster: ShadowCaster<'_>,
    tile: &Tile,
) -> Vec<ShadowRayStart> {
    let mut starts = Vec::with_capacity(tile.shown.len());
    let mut block = StartLanes::default();
    for items in tile.shown.chunks(LANES) {
        for (lane, &item) in items.iter().enumerate() {
            let i = item as usize;
            set_lane_vector!(block, lane, x, y, z, tile.points[i]);
            let normal = vector(tile.normals[i]);
            set_lane_vector!(block, lane, normal_x, normal_y, normal_z, normal);
            block.distance.0[lane] = tile.rays[i].t;
        }
        for lane in 0..LANES {
            find_start(frame, caster, &mut block, lane);
        }
        for (lane, &item) in items.iter().enumerate() {
            let is_inside = tile.rays[item as usize].status & FROM_INSIDE != 0;
            starts.push(ShadowRayStart {
                item,
                is_facing: block.cosine.0[lane] > 0.0,
                origin: lane_vector!(block, lane, start_x, start_y, start_z),
                direction: lane_vector!(block, lane, direction_x, direction_y, direction_z),
                start_t: block.start_t.0[lane],
                exit_t: block.exit_t.0[lane],
                light_t: block.light_t.0[lane],
                min_step: block.min_step.0[lane],
                rounding: block.rounding.0[lane],
                side: if is_inside { -1.0 } else { 1.0 },
            });
        }
    }
    starts
}

/// Computes the start in a lane from the surface there.
#[inline(always)]
fn find_start(
    frame: &FrameUniforms,
    caster: ShadowCaster<'_>,
    block: &mut StartLanes,
    lane: usize,
) {
    let ShadowCaster {
        light,
        size,
        is_sharp,
    } = caster;
    let p = lane_vector!(block, lane, x, y, z);
    let normal = lane_vector!(block, lane, normal_x, normal_y, normal_z);
    let distance = block.distance.0[lane];
    let light_position = vector(light.position);
    let to_light = camera::unit::<f32>(light_position - p * light.is_positional);
    block.cosine.0[lane] = reflectance::cosine::<f32>(normal, to_light);
    let half = camera::half_pixel(distance, frame.half_pixel_size, frame.half_pixel_growth);
    let rounding = marching::rounding_at(distance, frame.rounding);
    let lift = normals::lift::<f32>(p, half, rounding, is_sharp);
    let min_step = shadow::min_step::<f32>(half, lift);
    let start = camera::point_along::<f32>(p, normal, lift);
    // The direction is taken from the start of the ray, so that the ray ends at the light and not beside it.
    let to_light_from_start = light_position - start * light.is_positional;
    let direction = camera::unit::<f32>(to_light_from_start);
    let length = to_light_from_start.length();
    let is_near = (light.is_positional > 0.0) & (length < frame.light_far);
    let light_t = if is_near { length } else { frame.light_far };
    set_lane_vector!(block, lane, start_x, start_y, start_z, start);
    set_lane_vector!(
        block,
        lane,
        direction_x,
        direction_y,
        direction_z,
        direction
    );
    block.start_t.0[lane] = shadow::start_t::<f32>(min_step, is_sharp);
    block.exit_t.0[lane] = ray_end(frame, start, direction, light_t, size);
    block.light_t.0[lane] = light_t;
    block.min_step.0[lane] = min_step;
    block.rounding.0[lane] = rounding;
}

/// Returns the end of a ray to a light of the `size` at `light_t`. Beyond it, no solid is as near as the light is wide.
#[inline(always)]
pub(super) fn ray_end(
    frame: &FrameUniforms,
    origin: V3<f32>,
    direction: V3<f32>,
    light_t: f32,
    size: f32,
) -> f32 {
    let box_end = |low, high| {
        shadow::exit_t::<f32>(origin, direction, vector(low), vector(high), light_t, size)
    };
    let end = box_end(frame.bounds_min, frame.bounds_max);
    if frame.half_space_count == 0 {
        return end;
    }
    let half_spaces = &frame.half_spaces[..frame.half_space_count as usize];
    let last = half_spaces.iter().fold(
        box_end(frame.box_min, frame.box_max),
        |last, &[x, y, z, offset]| {
            let normal = V3::new(x, y, z);
            let exit =
                shadow::half_space_exit_t::<f32>(origin, direction, normal, offset, light_t, size);
            Real::max(last, exit)
        },
    );
    Real::min(end, last)
}
