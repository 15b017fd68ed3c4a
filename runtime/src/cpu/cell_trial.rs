//! The cells that rays march through where only a trial tells which are profitable.
//!
//! Bounds for segments of rays may be profitable although pruning in cells is not ([`crate::cells::trial`]).
//! Some packets of the picture are marched without cells, in one cell that is not split, and in cells. Work is
//! counted ([`super::work`]), not timed, so the choice is the same in every run. It is made with the first picture that is large
//! enough, and kept as long as edits do not change the instructions.

use super::RenderField;
use super::leaf_bins::PACKET_SIDE;
use super::tile::Tile;
use super::tile_stages::CellTraversal;
use crate::render::RenderJob;
use crate::work_stealing::parallel_map_with;

/// Minimum work without cells for which layouts are tried: building them takes as much.
const MIN_WORK: f64 = 3e7;
/// Work of the intersection of a packet with a leaf.
const TEST_WORK: u64 = 120;
/// Work of entering a leaf with a packet, besides the field.
const ENTRY_WORK: u64 = 300;
/// Work of splitting a cell, for each clause of its tape: its range and gradient in the children, and their tapes.
const SPLIT_WORK: u64 = 280;
/// Maximum number of packets per axis of the picture in a trial.
const PACKETS_PER_AXIS: u32 = 6;
/// Largest work with a whole cell, relative to that without cells, for which fine cells are tried.
const MAX_WHOLE_WORK: f64 = 1.0;
/// Largest work with cells, relative to that without, for which they are used: the estimate is rough.
const MAX_WORK: f64 = 0.7;

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
    let work = |layout| march_work(field, job, layout, &corners);
    let without = work(CellLayout::None);
    if without < MIN_WORK {
        return CellLayout::None;
    }
    let whole = work(CellLayout::Whole);
    if whole > without * MAX_WHOLE_WORK {
        return CellLayout::None;
    }
    let fine = work(CellLayout::Fine);
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
    let axis = |length: u32| {
        let packets = length.div_ceil(PACKET_SIDE);
        let count = packets.min(PACKETS_PER_AXIS);
        (0..count).map(move |i| (2 * i + 1) * packets / (2 * count) * PACKET_SIDE)
    };
    axis(job.size[1])
        .flat_map(|y| axis(job.size[0]).map(move |x| [x, y]))
        .collect()
}

/// Estimates the work of marching all rays of a picture by that of some packets.
fn march_work(
    field: &dyn RenderField,
    job: &RenderJob,
    layout: CellLayout,
    corners: &[[u32; 2]],
) -> f64 {
    let traversal = CellTraversal::new(field, job, layout);
    let cells = traversal.as_ref().map(|traversal| &*traversal.cells);
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
