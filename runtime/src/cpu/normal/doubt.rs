//! Gradients that do not lead to the surface beside which they were taken.
//!
//! Just outside of a floor, a field that was divided by a large bound may be the least value, though its surface is
//! far away; just inside it is not. Beside a jump the gradient is that of what jumps, and differences tell the side.

use super::{differences, keep, points_beside, set, tap_distance};
use crate::cpu::lanes::repeat_first;
use crate::cpu::tile::Tile;
use crate::cpu::{Column, Evaluator, LANES, Points};
use sdfc_shaders::features::Normals;
use sdfc_shaders::layout::Frame;
use sdfc_shaders::normals::ACROSS_JUMPS;
use sdfc_shaders::{marching, normals};
use sdfc_vm::real::Vector3;
use sdfc_vm::vector::V3;

/// A pixel whose gradient is in doubt.
#[derive(Clone, Copy, Debug)]
pub(super) struct Doubt {
    item: u32,
    /// The field just outside.
    value: f32,
    /// The length of the gradient there.
    slope: f32,
}

impl Doubt {
    /// The doubt about the gradient and value in a lane, if there is one.
    fn of(item: u32, gradients: &[Column; 4], lane: usize, rounding: f32) -> Option<Self> {
        let [x, y, z, value] = gradients.each_ref().map(|column| column.0[lane]);
        let slope = V3::of(x, y, z).length();
        let is_doubtful = normals::is_doubtful(value, slope, rounding) > 0.0;
        is_doubtful.then_some(Self { item, value, slope })
    }
}

/// The rounding of the field where a pixel's ray ended.
fn rounding(frame: &Frame, tile: &Tile, item: u32) -> f32 {
    marching::rounding_at(tile.rays[item as usize].t, frame.rounding)
}

/// Lists the pixels whose gradients are in doubt.
pub(super) fn list(
    frame: &Frame,
    items: &[u32],
    gradients: &[Column; 4],
    tile: &Tile,
    doubts: &mut Vec<Doubt>,
) {
    for (lane, &item) in items.iter().enumerate() {
        doubts.extend(Doubt::of(
            item,
            gradients,
            lane,
            rounding(frame, tile, item),
        ));
    }
}

/// Finds the normals of pixels in doubt anew, just inside or by differences; gives the number of evaluations.
pub(super) fn look_again(
    frame: &Frame,
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
    doubts: &[Doubt],
) -> u64 {
    if doubts.is_empty() {
        return 0;
    }
    let jumps = look_inside(frame, tile, evaluator, doubts);
    take_differences(frame, tile, evaluator, &jumps);
    (doubts.len() + jumps.len() * normals::taps(ACROSS_JUMPS).len()) as u64
}

/// Takes gradients just inside; gives the pixels beside which the field jumps.
fn look_inside(
    frame: &Frame,
    tile: &mut Tile,
    evaluator: &mut dyn Evaluator,
    doubts: &[Doubt],
) -> Vec<u32> {
    let mut jumps = Vec::new();
    let (mut pixels, mut points) = (Points::default(), Points::default());
    let mut gradients = [Column::default(); 4];
    for chunk in doubts.chunks(LANES) {
        for (lane, doubt) in chunk.iter().enumerate() {
            let [x, y] = tile.pixels[doubt.item as usize];
            set(
                &mut pixels,
                lane,
                V3::of(x, y, tile.rays[doubt.item as usize].t),
            );
        }
        points_beside(frame, &pixels, -1.0, &mut points);
        repeat_first(&mut points, chunk.len());
        evaluator.gradients(&points, chunk.len(), &mut gradients);
        let mut settled = Vec::with_capacity(chunk.len());
        for (lane, doubt) in chunk.iter().enumerate() {
            if Doubt::of(
                doubt.item,
                &gradients,
                lane,
                rounding(frame, tile, doubt.item),
            )
            .is_none()
            {
                for column in &mut gradients {
                    column.0[settled.len()] = column.0[lane];
                }
                settled.push(doubt.item);
            } else {
                let apart = tap_distance(frame, Normals::Exact, tile, doubt.item);
                if normals::jumps(doubt.value, doubt.slope, apart) > 0.0 {
                    jumps.push(doubt.item);
                }
            }
        }
        keep(frame, &settled, Normals::Exact, &mut gradients, tile);
    }
    jumps
}

/// Takes differences across jumps.
fn take_differences(frame: &Frame, tile: &mut Tile, evaluator: &mut dyn Evaluator, jumps: &[u32]) {
    let (mut points, mut apart) = (Points::default(), Column::default());
    for items in jumps.chunks(LANES) {
        for (lane, &item) in items.iter().enumerate() {
            apart.0[lane] = tap_distance(frame, Normals::Exact, tile, item);
            set(&mut points, lane, tile.points[item as usize]);
        }
        repeat_first(&mut points, items.len());
        let mut gradients = differences(ACROSS_JUMPS, &points, &apart, items.len(), evaluator);
        keep(frame, items, ACROSS_JUMPS, &mut gradients, tile);
    }
}
