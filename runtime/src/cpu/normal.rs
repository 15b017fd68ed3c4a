//! The stages `normal` and `surface`: normals and materials of surfaces.

mod doubtful;

use super::packet::NO_LEAF;
use super::ray_tasks::{repeat_first, store_point};
use super::tile::Tile;
use super::{Evaluator, F32x64, FieldQuantity, LANES, Points};
use crate::render::ray::{camera_ray, vector};
use doubtful::DoubtfulNormal;
use glam::Vec3;
use sdfc_shaders::features::Normals;
use sdfc_shaders::layout::{FrameUniforms, Surface};
use sdfc_shaders::marching::{self, FROM_INSIDE};
use sdfc_shaders::{camera, normals};
use sdfc_vm::multiversion;
use sdfc_vm::real::Vector3;
use sdfc_vm::surface::{SURFACE_NUMBERS, SurfaceBlock};
use sdfc_vm::vector::V3;

/// Computes the normals of the shown pixels; returns the number of evaluations.
pub(super) fn find_normals(
    frame: &FrameUniforms,
    method: Normals,
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
) -> u64 {
    if method == Normals::Exact {
        find_outside_points(frame, tile);
    }
    let mut doubts = Vec::new();
    if method == Normals::Exact && !tile.hit_leaves.is_empty() {
        find_by_leaf(frame, tile, evaluator, &mut doubts);
        return tile.shown.len() as u64 + doubtful::recompute(frame, tile, evaluator, &doubts);
    }
    let taps = normals::taps(method);
    let (mut points, mut tap_distances) = (Points::default(), F32x64::default());
    let mut gradients = [F32x64::default(); 4];
    let shown = std::mem::take(&mut tile.shown);
    let has_regions = evaluator.preferred_blocks(FieldQuantity::Distances) == 1;
    if has_regions {
        // Largest distance of any tap from its point.
        let tap_distances = shown
            .iter()
            .map(|&item| tap_distance(frame, method, tile, item));
        let margin = 2.0 * tap_distances.fold(0.0, f32::max);
        evaluator.prune_for_regions(FieldQuantity::Distances, &tile.boxes_around(&shown, margin));
    }
    for (region, items) in shown.chunks(LANES).enumerate() {
        evaluator.select_region(has_regions.then_some(region));
        for (lane, &item) in items.iter().enumerate() {
            tap_distances.0[lane] = tap_distance(frame, method, tile, item);
            let point = match method {
                Normals::Exact => tile.outside_points[item as usize],
                _ => tile.points[item as usize],
            };
            set_lane(&mut points, lane, point);
        }
        repeat_first(&mut points, items.len());
        if method == Normals::Exact {
            evaluator.gradients(&points, items.len(), &mut gradients);
        } else {
            gradients = finite_differences(method, &points, &tap_distances, items.len(), evaluator);
        }
        if method == Normals::Exact {
            doubtful::list_doubtful(frame, items, &gradients, tile, &mut doubts);
        }
        store_normals(frame, items, method, &mut gradients, tile);
    }
    tile.shown = shown;
    evaluator.select_region(None);
    let recomputed = doubtful::recompute(frame, tile, evaluator, &doubts);
    (tile.shown.len() * taps.len().max(1)) as u64 + recomputed
}

/// Returns finite differences between taps around the first `count` points, in place of gradients.
fn finite_differences(
    method: Normals,
    points: &Points,
    tap_distances: &F32x64,
    count: usize,
    evaluator: &mut dyn Evaluator,
) -> [F32x64; 4] {
    let (mut tap_points, mut values) = (Points::default(), F32x64::default());
    let mut gradients = [F32x64::default(); 4];
    for &(offset, weight) in normals::taps(method) {
        shift(points, offset, tap_distances, &mut tap_points);
        evaluator.distances(&tap_points, count, &mut values);
        for axis in 0..3 {
            for lane in 0..LANES {
                gradients[axis].0[lane] += weight[axis] * values.0[lane];
            }
        }
    }
    gradients
}

/// Returns the distance of a pixel's taps from its point.
fn tap_distance(frame: &FrameUniforms, method: Normals, tile: &Tile, item: u32) -> f32 {
    let (p, t) = (tile.points[item as usize], tile.rays[item as usize].t);
    let half = camera::half_pixel(t, frame.half_pixel_size, frame.half_pixel_growth);
    normals::tap_distance::<f32>(p, half, normals::tap_spread(method))
}

/// Computes the points just outside the shown pixels' surfaces, at which exact gradients are taken.
fn find_outside_points(frame: &FrameUniforms, tile: &mut Tile) {
    let mut pixels = Points::default();
    let mut outside = Points::default();
    for items in tile.shown.chunks(LANES) {
        for (lane, &item) in items.iter().enumerate() {
            let [x, y] = tile.pixels[item as usize];
            set_lane(&mut pixels, lane, V3::new(x, y, tile.rays[item as usize].t));
        }
        points_near_hit(frame, &pixels, 1.0, &mut outside);
        for (lane, &item) in items.iter().enumerate() {
            let p = [0, 1, 2].map(|axis| outside[axis].0[lane]);
            tile.outside_points[item as usize] = vector(p);
        }
    }
}

/// Computes exact normals with the tapes of the leaves in which rays ended. Pixels with the same tape are
/// evaluated together.
fn find_by_leaf(
    frame: &FrameUniforms,
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
    doubts: &mut Vec<DoubtfulNormal>,
) {
    let leaf_of = |&item: &u32| {
        let leaf = tile.hit_leaves[item as usize];
        let is_in_leaf = leaf != NO_LEAF
            && evaluator.cell_contains(leaf, tile.outside_points[item as usize].to_array());
        let tape = is_in_leaf.then(|| evaluator.tape_id(leaf));
        (tape, leaf, item)
    };
    let mut items: Vec<(Option<u64>, u32, u32)> = tile.shown.iter().map(leaf_of).collect();
    items.sort_by_key(|&(tape, ..)| tape);
    let mut points = Points::default();
    let mut gradients = [F32x64::default(); 4];
    let mut tape_items = [0; LANES];
    for same_tape in items.chunk_by(|a, b| a.0 == b.0) {
        for group in same_tape.chunks(LANES) {
            let (tape, leaf, _) = group[0];
            for (lane, &(.., item)) in group.iter().enumerate() {
                tape_items[lane] = item;
                set_lane(&mut points, lane, tile.outside_points[item as usize]);
            }
            repeat_first(&mut points, group.len());
            if tape.is_none() {
                evaluator.gradients(&points, group.len(), &mut gradients);
            } else {
                evaluator.gradients_in_cell(leaf, &points, group.len(), &mut gradients);
            }
            let items = &tape_items[..group.len()];
            doubtful::list_doubtful(frame, items, &gradients, tile, doubts);
            store_normals(frame, items, Normals::Exact, &mut gradients, tile);
        }
    }
}

/// Stores the normals of pixels with these gradients, and the lengths of exact gradients.
fn store_normals(
    frame: &FrameUniforms,
    items: &[u32],
    method: Normals,
    gradients: &mut [F32x64; 4],
    tile: &mut Tile,
) {
    if method == Normals::Exact && !tile.slopes.is_empty() {
        for (lane, &item) in items.iter().enumerate() {
            let [x, y, z, _] = &*gradients;
            let gradient = V3::new(x.0[lane], y.0[lane], z.0[lane]);
            tile.slopes[item as usize] = gradient.length();
        }
    }
    let mut pixels = Points::default();
    for (lane, &item) in items.iter().enumerate() {
        pixels[0].0[lane] = tile.pixels[item as usize][0];
        pixels[1].0[lane] = tile.pixels[item as usize][1];
        let inside = tile.rays[item as usize].status & FROM_INSIDE != 0;
        pixels[2].0[lane] = if inside { -1.0 } else { 1.0 };
    }
    face_rays(frame, &pixels, gradients);
    for (lane, &item) in items.iter().enumerate() {
        tile.normals[item as usize] = std::array::from_fn(|axis| gradients[axis].0[lane]);
    }
}

/// Evaluates the materials of the shown pixels' surfaces; returns the number of evaluations.
pub(super) fn find_surfaces(
    frame: &FrameUniforms,
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
) -> u64 {
    let blocks = evaluator.preferred_blocks(FieldQuantity::Surfaces);
    let mut points = vec![Points::default(); blocks];
    let mut facing = vec![Points::default(); blocks];
    let mut surface_blocks = vec![SurfaceBlock::default(); blocks];
    if blocks == 1 {
        evaluator.prune_for_regions(
            FieldQuantity::Surfaces,
            &tile.boxes_around(&tile.shown, 0.0),
        );
    }
    for (region, items) in tile.shown.chunks(blocks * LANES).enumerate() {
        evaluator.select_region((blocks == 1).then_some(region));
        let mut used_blocks = 0;
        for (items, (points, facing)) in items.chunks(LANES).zip(points.iter_mut().zip(&mut facing))
        {
            for (lane, &item) in items.iter().enumerate() {
                let (ray, normal) = (
                    &tile.rays[item as usize],
                    vector(tile.normals[item as usize]),
                );
                let side = if ray.status & FROM_INSIDE != 0 {
                    -1.0
                } else {
                    1.0
                };
                let p = tile.points[item as usize];
                let along = marching::rounding_at(ray.t, frame.rounding);
                let rounding = marching::rounding_near::<f32>(p, along, frame.least_rounding);
                let depth = normals::inside_depth(rounding) * side;
                set_lane(points, lane, camera::point_along::<f32>(p, normal, -depth));
                set_lane(facing, lane, normal);
            }
            repeat_first(points, items.len());
            repeat_first(facing, items.len());
            used_blocks += 1;
        }
        evaluator.surfaces_many(
            &points[..used_blocks],
            &facing[..used_blocks],
            items.len(),
            &mut surface_blocks[..used_blocks],
        );
        for (index, &item) in items.iter().enumerate() {
            tile.surfaces[item as usize] =
                surface_in_lane(&surface_blocks[index / LANES], index % LANES);
        }
    }
    evaluator.select_region(None);
    tile.shown.len() as u64
}

/// Returns the surface in a lane.
pub(super) fn surface_in_lane(block: &SurfaceBlock, lane: usize) -> Surface {
    let n: [f32; SURFACE_NUMBERS] = std::array::from_fn(|i| block[i].0[lane]);
    Surface {
        albedo: [n[0], n[1], n[2]],
        roughness: n[3],
        emission: [n[4], n[5], n[6]],
        metallic: n[7],
        bump: [n[8], n[9], n[10]],
        id: n[11],
    }
}

/// Returns the unit direction of a gradient; up if the gradient has none. Mirrors the function of this name in
/// `gpu/query.wgsl`.
pub(super) fn direction(gradient: [f32; 3]) -> [f32; 3] {
    let largest = gradient.iter().fold(0.0_f32, |max, v| max.max(v.abs()));
    if !(largest > 1e-30 && largest < 1e30) {
        return [0.0, 1.0, 0.0];
    }
    let v = Vec3::from(gradient) * (1.0 / largest);
    (v * (1.0 / v.length())).into()
}

/// Writes a point to a lane.
pub(super) fn set_lane(points: &mut Points, lane: usize, p: V3<f32>) {
    store_point(points, lane, p);
}

multiversion! {
    /// Turns gradients into normals that face the rays through pixels. The third number of a pixel is the
    /// side on which its ray started.
    fn face_rays(frame: &FrameUniforms, pixels: &Points, gradients: &mut [F32x64; 4]) = face_rays_body;
}

#[inline(always)]
fn face_rays_body(frame: &FrameUniforms, pixels: &Points, gradients: &mut [F32x64; 4]) {
    let frame = *frame;
    for lane in 0..LANES {
        let direction = camera_ray(&frame, [pixels[0].0[lane], pixels[1].0[lane]]).direction;
        let gradient = V3::new(
            gradients[0].0[lane],
            gradients[1].0[lane],
            gradients[2].0[lane],
        );
        let normal = normals::facing::<f32>(gradient, direction, pixels[2].0[lane]);
        store_point(gradients, lane, normal);
    }
}

multiversion! {
    /// Computes the points that rays through pixels reach just before they end, or just after where `side` is
    /// −1. The third number of a pixel is the length of its ray.
    fn points_near_hit(frame: &FrameUniforms, pixels: &Points, side: f32, beside: &mut Points) = points_near_hit_body;
}

#[inline(always)]
fn points_near_hit_body(frame: &FrameUniforms, pixels: &Points, side: f32, beside: &mut Points) {
    let frame = *frame;
    for lane in 0..LANES {
        let t = pixels[2].0[lane];
        let ray = camera_ray(&frame, [pixels[0].0[lane], pixels[1].0[lane]]);
        let distance = normals::outside_distance(marching::rounding_at(t, frame.rounding)) * side;
        let p = camera::point_along::<f32>(ray.origin, ray.direction, t - distance);
        store_point(beside, lane, p);
    }
}

multiversion! {
    /// Moves points along `offset`, each by its own distance.
    fn shift(from: &Points, offset: [f32; 3], distances: &F32x64, to: &mut Points) = shift_body;
}

#[inline(always)]
fn shift_body(from: &Points, offset: [f32; 3], distances: &F32x64, to: &mut Points) {
    for axis in 0..3 {
        for lane in 0..LANES {
            to[axis].0[lane] = from[axis].0[lane] + offset[axis] * distances.0[lane];
        }
    }
}
