//! The stages `normal` and `surface`: which way surfaces face and what they are made of.

use super::lanes::repeat_first;
use super::march::vector;
use super::tile::{Tile, camera_ray};
use super::{Asked, Column, Evaluator, LANES, Points};
use crate::cells::Region;
use sdfc_shaders::features::Normals;
use sdfc_shaders::layout::{Frame, Surface};
use sdfc_shaders::marching::FROM_INSIDE;
use sdfc_shaders::{camera, normals};
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
    let taps = normals::taps(method);
    let (mut points, mut near) = (Points::default(), Points::default());
    let (mut apart, mut values) = (Column::default(), Column::default());
    let mut gradients = [Column::default(); 4];
    let mut pixels = Points::default();
    // How far from its point any tap is.
    let mut reach = 0.0;
    for &item in &tile.shown {
        let p = tile.points[item as usize];
        let t = tile.rays[item as usize].t;
        let half = camera::half_pixel(t, frame.footprint, frame.footprint_growth);
        let apart = normals::tap_distance::<f32>(p, half, normals::spread(method));
        reach = f32::max(reach, 2.0 * apart);
    }
    evaluator.announce(Asked::Distances, &tile.regions(reach));
    for (region, items) in tile.shown.chunks(LANES).enumerate() {
        evaluator.focus(Some(region));
        for (lane, &item) in items.iter().enumerate() {
            let p = tile.points[item as usize];
            let t = tile.rays[item as usize].t;
            let half = camera::half_pixel(t, frame.footprint, frame.footprint_growth);
            apart.0[lane] = normals::tap_distance::<f32>(p, half, normals::spread(method));
            set(&mut points, lane, p);
        }
        repeat_first(&mut points, items.len());
        if method == Normals::Exact {
            evaluator.gradients(&points, items.len(), &mut gradients);
        } else {
            gradients = [Column::default(); 4];
            for &(offset, weight) in taps {
                shift(&points, offset, &apart, &mut near);
                evaluator.distances(&near, items.len(), &mut values);
                for axis in 0..3 {
                    for lane in 0..LANES {
                        gradients[axis].0[lane] += weight[axis] * values.0[lane];
                    }
                }
            }
        }
        for (lane, &item) in items.iter().enumerate() {
            pixels[0].0[lane] = tile.pixels[item as usize][0];
            pixels[1].0[lane] = tile.pixels[item as usize][1];
            let inside = tile.rays[item as usize].status & FROM_INSIDE != 0;
            pixels[2].0[lane] = if inside { -1.0 } else { 1.0 };
        }
        face(frame, &pixels, &mut gradients);
        for (lane, &item) in items.iter().enumerate() {
            tile.normals[item as usize] = std::array::from_fn(|axis| gradients[axis].0[lane]);
        }
    }
    evaluator.focus(None);
    (tile.shown.len() * taps.len().max(1)) as u64
}

/// Asks what the shown pixels' surfaces are made of.
pub(super) fn surfaces(tile: &mut Tile, evaluator: &mut dyn Evaluator) -> u64 {
    let (mut points, mut facing) = (Points::default(), Points::default());
    let mut block: Box<SurfaceBlock> = Box::default();
    evaluator.announce(Asked::Surfaces, &tile.regions(0.0));
    for (region, items) in tile.shown.chunks(LANES).enumerate() {
        evaluator.focus(Some(region));
        for (lane, &item) in items.iter().enumerate() {
            set(&mut points, lane, tile.points[item as usize]);
            set(&mut facing, lane, vector(tile.normals[item as usize]));
        }
        repeat_first(&mut points, items.len());
        repeat_first(&mut facing, items.len());
        evaluator.surfaces(&points, &facing, items.len(), &mut block);
        for (lane, &item) in items.iter().enumerate() {
            tile.surfaces[item as usize] = surface_of(&block, lane);
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
    for lane in 0..LANES {
        let direction = camera_ray(frame, [pixels[0].0[lane], pixels[1].0[lane]]).direction;
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
