//! The cells that rays march through where only a trial tells which are profitable.
//!
//! Bounds for segments of rays may be profitable although pruning in cells is not ([`crate::cells::trial`]), and cells
//! where they prune less. Some packets of the picture are marched without cells, in one cell that is not split, and in
//! cells. Work is counted ([`super::work`]), not timed, so the choice is the same in every run. It is made with the first
//! picture, and kept as long as edits do not change the instructions.

use super::RenderField;
use super::leaf_bins::PACKET_SIDE;
use super::tile::Tile;
use super::tile_stages::CellTraversal;
use crate::render::RenderJob;
use crate::work_stealing::parallel_map_with;

/// Minimum work without cells for which layouts are tried: some ten milliseconds.
const MIN_WORK: f64 = 2e7;
/// Work of the intersection of a packet with a leaf.
const TEST_WORK: u64 = 120;
/// Work of entering a leaf with a packet, besides the field.
const ENTRY_WORK: u64 = 300;
/// Work of splitting a cell, for each clause of its tape: its range and gradient in the children, and their tapes.
const SPLIT_WORK: u64 = 280;
/// Maximum number of packets per axis of the picture in a trial, and fraction of all packets.
const PACKETS_PER_AXIS: u32 = 6;
const MAX_PACKET_FRACTION: f32 = 0.05;
/// Minimum of that number.
const MIN_PACKETS_PER_AXIS: u32 = 3;
/// Largest work with cells, relative to that without, for which they are used: the estimate is rough.
const MAX_WORK: f64 = 0.75;

/// Layout of the cells of a picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum CellLayout {
    /// No cells.
    None,
    /// One cell that is not split: rays get bounds for their segments alone.
    Whole,
    /// Cells of the size that suits the picture.
    Fine,
}

/// Returns the layout with the least work for the rays of a picture.
pub(super) fn choose(field: &dyn RenderField, job: &RenderJob) -> CellLayout {
    let corners = packet_corners(job);
    let work = |layout, max_work: f64| march_work(field, job, layout, max_work, &corners);
    let without = work(CellLayout::None, f64::INFINITY);
    if without < MIN_WORK {
        return CellLayout::None;
    }
    let whole = work(CellLayout::Whole, f64::INFINITY);
    // Cells whose building alone takes more are not worth finishing.
    let max_work = whole.min(without * MAX_WORK);
    let fine = work(CellLayout::Fine, max_work);
    if whole.min(fine) > without * MAX_WORK {
        CellLayout::None
    } else if whole < fine {
        CellLayout::Whole
    } else {
        CellLayout::Fine
    }
}

/// Returns the corners of packets that are spread over the picture.
fn packet_corners(job: &RenderJob) -> Vec<[u32; 2]> {
    let all = job.size.map(|length| length.div_ceil(PACKET_SIDE) as f32);
    let packets_per_axis = (all[0] * all[1] * MAX_PACKET_FRACTION).sqrt() as u32;
    let packets_per_axis = packets_per_axis.clamp(MIN_PACKETS_PER_AXIS, PACKETS_PER_AXIS);
    let axis = |length: u32| {
        let packets = length.div_ceil(PACKET_SIDE);
        let count = packets.min(packets_per_axis);
        (0..count).map(move |i| (2 * i + 1) * packets / (2 * count) * PACKET_SIDE)
    };
    axis(job.size[1])
        .flat_map(|y| axis(job.size[0]).map(move |x| [x, y]))
        .collect()
}

/// Estimates the work of marching all rays of a picture by that of some packets. It is infinite where building the cells
/// alone takes more than `max_work`.
fn march_work(
    field: &dyn RenderField,
    job: &RenderJob,
    layout: CellLayout,
    max_work: f64,
    corners: &[[u32; 2]],
) -> f64 {
    let max_split_clauses = (max_work / SPLIT_WORK as f64) as u64;
    let traversal = CellTraversal::new(field, job, layout, max_split_clauses);
    let cells = traversal.as_ref().map(|traversal| &*traversal.cells);
    if cells.is_some_and(|cells| cells.over_budget_count() > 0) {
        return f64::INFINITY;
    }
    let frame = job.pass_uniforms(0);
    let packets = parallel_map_with(
        corners.len(),
        || (Tile::default(), field.evaluator(job, cells)),
        |(tile, evaluator), number| {
            tile.reset_to_packet(corners[number], job);
            tile.marcher.visits = [0; 2];
            let before = evaluator.work();
            tile.march(&frame, traversal.as_ref(), &mut **evaluator);
            let [tested, entered] = tile.marcher.visits;
            let visits_work = tested * TEST_WORK + entered * ENTRY_WORK;
            (evaluator.work() - before + visits_work, tile.rays.len())
        },
    );
    let (mut work, mut rays) = (0, 0);
    for (packet_work, packet_rays) in packets {
        work += packet_work;
        rays += packet_rays;
    }
    let all_rays = job.size.map(f64::from).iter().product::<f64>() * f64::from(frame.samples);
    let build_work = cells.map_or(0, |cells| cells.split_clauses() * SPLIT_WORK);
    work as f64 * all_rays / rays.max(1) as f64 + build_work as f64
}
