//! The stages `normal` and `surface`: which way surfaces face and what they are made of.

mod doubt;

use super::lanes::repeat_first;
use super::march::vector;
use super::packet::NO_LEAF;
use super::tile::{Tile, camera_ray};
use super::{Asked, Column, Evaluator, LANES, Points};
use crate::cells::Region;
use doubt::Doubt;
use sdfc_shaders::features::Normals;
use sdfc_shaders::layout::{Frame, Surface};
use sdfc_shaders::marching::{self, FROM_INSIDE};
use sdfc_shaders::{camera, normals};
use sdfc_vm::real::Vector3;
use sdfc_vm::surface::{NUMBERS, SurfaceBlock};
use sdfc_vm::vector::V3;
use sdfc_vm::widest;

/// Finds the normals of the shown pixels; gives the number of evaluations.
pub(super) fn find(
    frame: &Frame,
    method: Normals,
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
) -> u64 {
    if method == Normals::Exact {
        step_outside(frame, tile);
    }
    let mut doubts = Vec::new();
    if method == Normals::Exact && !tile.leaves.is_empty() {
        by_leaf(frame, tile, evaluator, &mut doubts);
        return tile.shown.len() as u64 + doubt::look_again(frame, tile, evaluator, &doubts);
    }
    let taps = normals::taps(method);
    let (mut points, mut apart) = (Points::default(), Column::default());
    let mut gradients = [Column::default(); 4];
    let shown = std::mem::take(&mut tile.shown);
    let announced = evaluator.blocks(Asked::Distances) == 1;
    if announced {
        // How far from its point any tap is.
        let apart = shown
            .iter()
            .map(|&item| tap_distance(frame, method, tile, item));
        let reach = 2.0 * apart.fold(0.0, f32::max);
        evaluator.announce(Asked::Distances, &tile.regions_of(&shown, reach));
    }
    for (region, items) in shown.chunks(LANES).enumerate() {
        evaluator.focus(announced.then_some(region));
        for (lane, &item) in items.iter().enumerate() {
            apart.0[lane] = tap_distance(frame, method, tile, item);
            let at = match method {
                Normals::Exact => tile.outside[item as usize],
                _ => tile.points[item as usize],
            };
            set(&mut points, lane, at);
        }
        repeat_first(&mut points, items.len());
        if method == Normals::Exact {
            evaluator.gradients(&points, items.len(), &mut gradients);
        } else {
            gradients = differences(method, &points, &apart, items.len(), evaluator);
        }
        if method == Normals::Exact {
            doubt::list(frame, items, &gradients, tile, &mut doubts);
        }
        keep(frame, items, method, &mut gradients, tile);
    }
    tile.shown = shown;
    evaluator.focus(None);
    let again = doubt::look_again(frame, tile, evaluator, &doubts);
    (tile.shown.len() * taps.len().max(1)) as u64 + again
}

/// The differences between taps beside so many points, in the place of gradients.
fn differences(
    method: Normals,
    points: &Points,
    apart: &Column,
    count: usize,
    evaluator: &mut dyn Evaluator,
) -> [Column; 4] {
    let (mut near, mut values) = (Points::default(), Column::default());
    let mut gradients = [Column::default(); 4];
    for &(offset, weight) in normals::taps(method) {
        shift(points, offset, apart, &mut near);
        evaluator.distances(&near, count, &mut values);
        for axis in 0..3 {
            for lane in 0..LANES {
                gradients[axis].0[lane] += weight[axis] * values.0[lane];
            }
        }
    }
    gradients
}

/// The distance of a pixel's taps from its point.
fn tap_distance(frame: &Frame, method: Normals, tile: &Tile, item: u32) -> f32 {
    let (p, t) = (tile.points[item as usize], tile.rays[item as usize].t);
    let half = camera::half_pixel(t, frame.footprint, frame.footprint_growth);
    normals::tap_distance::<f32>(p, half, normals::spread(method))
}

/// Finds the points just outside of the shown pixels' surfaces, at which exact gradients are taken.
fn step_outside(frame: &Frame, tile: &mut Tile) {
    let mut pixels = Points::default();
    let mut outside = Points::default();
    for items in tile.shown.chunks(LANES) {
        for (lane, &item) in items.iter().enumerate() {
            let [x, y] = tile.pixels[item as usize];
            set(&mut pixels, lane, V3::of(x, y, tile.rays[item as usize].t));
        }
        points_beside(frame, &pixels, 1.0, &mut outside);
        for (lane, &item) in items.iter().enumerate() {
            let p = [0, 1, 2].map(|axis| outside[axis].0[lane]);
            tile.outside[item as usize] = vector(p);
        }
    }
}

/// Finds exact normals by the tapes of the leaves in which rays ended: those whose tape is the same are
/// done together.
fn by_leaf(frame: &Frame, tile: &mut Tile, evaluator: &mut dyn Evaluator, doubts: &mut Vec<Doubt>) {
    let leaf_of = |&item: &u32| {
        let leaf = tile.leaves[item as usize];
        let held = leaf != NO_LEAF && evaluator.holds(leaf, tile.outside[item as usize].to_array());
        let tape = held.then(|| evaluator.tape_of(leaf));
        (tape, leaf, item)
    };
    let mut items: Vec<(Option<u64>, u32, u32)> = tile.shown.iter().map(leaf_of).collect();
    items.sort_by_key(|&(tape, ..)| tape);
    let mut points = Points::default();
    let mut gradients = [Column::default(); 4];
    let mut together = [0; LANES];
    for alike in items.chunk_by(|a, b| a.0 == b.0) {
        for group in alike.chunks(LANES) {
            let (tape, leaf, _) = group[0];
            for (lane, &(.., item)) in group.iter().enumerate() {
                together[lane] = item;
                set(&mut points, lane, tile.outside[item as usize]);
            }
            repeat_first(&mut points, group.len());
            if tape.is_none() {
                evaluator.gradients(&points, group.len(), &mut gradients);
            } else {
                evaluator.gradients_in(leaf, &points, group.len(), &mut gradients);
            }
            let items = &together[..group.len()];
            doubt::list(frame, items, &gradients, tile, doubts);
            keep(frame, items, Normals::Exact, &mut gradients, tile);
        }
    }
}

/// Keeps the normals of pixels with these gradients, and the lengths of those that are exact.
fn keep(
    frame: &Frame,
    items: &[u32],
    method: Normals,
    gradients: &mut [Column; 4],
    tile: &mut Tile,
) {
    if method == Normals::Exact && !tile.slopes.is_empty() {
        for (lane, &item) in items.iter().enumerate() {
            let [x, y, z, _] = &*gradients;
            let gradient = V3::of(x.0[lane], y.0[lane], z.0[lane]);
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
    face(frame, &pixels, gradients);
    for (lane, &item) in items.iter().enumerate() {
        tile.normals[item as usize] = std::array::from_fn(|axis| gradients[axis].0[lane]);
    }
}

/// Asks what the shown pixels' surfaces are made of.
pub(super) fn surfaces(frame: &Frame, tile: &mut Tile, evaluator: &mut dyn Evaluator) -> u64 {
    let blocks = evaluator.blocks(Asked::Surfaces);
    let mut points = vec![Points::default(); blocks];
    let mut facing = vec![Points::default(); blocks];
    let mut found = vec![SurfaceBlock::default(); blocks];
    if blocks == 1 {
        evaluator.announce(Asked::Surfaces, &tile.regions_of(&tile.shown, 0.0));
    }
    for (region, items) in tile.shown.chunks(blocks * LANES).enumerate() {
        evaluator.focus((blocks == 1).then_some(region));
        let mut used = 0;
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
                let rounding = marching::rounding_at(ray.t, frame.rounding);
                let below = normals::inside(rounding) * side;
                let p = tile.points[item as usize];
                set(points, lane, camera::along::<f32>(p, normal, -below));
                set(facing, lane, normal);
            }
            repeat_first(points, items.len());
            repeat_first(facing, items.len());
            used += 1;
        }
        evaluator.surfaces_many(
            &points[..used],
            &facing[..used],
            items.len(),
            &mut found[..used],
        );
        for (place, &item) in items.iter().enumerate() {
            tile.surfaces[item as usize] = surface_of(&found[place / LANES], place % LANES);
        }
    }
    evaluator.focus(None);
    tile.shown.len() as u64
}

/// The box around points.
pub(super) fn around(points: impl Iterator<Item = V3<f32>>) -> Region {
    let nothing = Region {
        low: [f32::INFINITY; 3],
        high: [f32::NEG_INFINITY; 3],
    };
    points.fold(nothing, |mut region, p| {
        for (axis, at) in p.to_array().into_iter().enumerate() {
            region.low[axis] = region.low[axis].min(at);
            region.high[axis] = region.high[axis].max(at);
        }
        region
    })
}

/// The surface in a lane.
pub(super) fn surface_of(block: &SurfaceBlock, lane: usize) -> Surface {
    let n: [f32; NUMBERS] = std::array::from_fn(|i| block[i].0[lane]);
    Surface {
        albedo: [n[0], n[1], n[2]],
        roughness: n[3],
        emission: [n[4], n[5], n[6]],
        metallic: n[7],
        bump: [n[8], n[9], n[10]],
        id: n[11],
    }
}

/// Puts a point into a lane.
pub(super) fn set(points: &mut Points, lane: usize, p: V3<f32>) {
    points[0].0[lane] = p.x;
    points[1].0[lane] = p.y;
    points[2].0[lane] = p.z;
}

widest! {
    /// Gradients become the normals that face the rays through pixels; the third number of those
    /// says on which side the ray started.
    fn face(frame: &Frame, pixels: &Points, gradients: &mut [Column; 4]) = face_body;
}

#[inline(always)]
fn face_body(frame: &Frame, pixels: &Points, gradients: &mut [Column; 4]) {
    let f = *frame;
    for lane in 0..LANES {
        let direction = camera_ray(&f, [pixels[0].0[lane], pixels[1].0[lane]]).direction;
        let gradient = V3::of(
            gradients[0].0[lane],
            gradients[1].0[lane],
            gradients[2].0[lane],
        );
        let normal = normals::facing::<f32>(gradient, direction, pixels[2].0[lane]);
        gradients[0].0[lane] = normal.x;
        gradients[1].0[lane] = normal.y;
        gradients[2].0[lane] = normal.z;
    }
}

widest! {
    /// The points that rays through pixels reach just before they end, or just after where `side` is −1; the third
    /// number of those pixels is how far they came.
    fn points_beside(frame: &Frame, pixels: &Points, side: f32, beside: &mut Points) = points_beside_body;
}

#[inline(always)]
fn points_beside_body(frame: &Frame, pixels: &Points, side: f32, beside: &mut Points) {
    let f = *frame;
    for lane in 0..LANES {
        let t = pixels[2].0[lane];
        let ray = camera_ray(&f, [pixels[0].0[lane], pixels[1].0[lane]]);
        let way = normals::outside(marching::rounding_at(t, f.rounding)) * side;
        let p = camera::along::<f32>(ray.origin, ray.direction, t - way);
        beside[0].0[lane] = p.x;
        beside[1].0[lane] = p.y;
        beside[2].0[lane] = p.z;
    }
}

widest! {
    /// The points moved along `offset`, each by its own distance.
    fn shift(from: &Points, offset: [f32; 3], apart: &Column, to: &mut Points) = shift_body;
}

#[inline(always)]
fn shift_body(from: &Points, offset: [f32; 3], apart: &Column, to: &mut Points) {
    for axis in 0..3 {
        for lane in 0..LANES {
            to[axis].0[lane] = from[axis].0[lane] + offset[axis] * apart.0[lane];
        }
    }
}
