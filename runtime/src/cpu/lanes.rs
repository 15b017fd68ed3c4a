//! Streaming: any number of walks through the field, 64 at a time.
//!
//! A walk is a ray that asks the field at one point after another. Walks in lanes advance together;
//! a lane whose walk has ended takes the next item, so all lanes are busy until items run out. The
//! loops over lanes are compiled once per instruction set, as those of `sdfc_vm::lanes` are.

use super::{Asked, Column, Evaluator, LANES, Points};
use sdfc_vm::widest;

/// A kind of walk. Its methods that loop over lanes are `#[inline(always)]`, so that they become
/// part of each version of [`stream`].
pub(super) trait Walk {
    /// What 64 walks remember.
    type Block: Lanes;
    /// Puts an item's walk into a lane, or ends it right away: then the lane stays free.
    fn begin(&mut self, item: u32, block: &mut Self::Block, lane: usize) -> bool;
    /// Where the walks ask the field next.
    fn points(&self, block: &Self::Block, points: &mut Points);
    /// Takes what the field says there; sets `ended` where a walk has.
    fn advance(&self, block: &mut Self::Block, values: &Column, ended: &mut [bool; LANES]);
    /// Keeps the result of a walk that has ended.
    fn end(&mut self, item: u32, block: &Self::Block, lane: usize);
}

/// The memory of 64 walks.
pub(super) trait Lanes: Default {
    /// Copies one lane's memory to another.
    fn move_lane(&mut self, from: usize, to: usize);
    /// Copies the memory of another block's lane.
    fn take_lane(&mut self, to: usize, other: &Self, from: usize);
}

/// Declares the memory of 64 walks: a column for each name.
macro_rules! lanes {
    ($(#[$doc:meta])* $name:ident { $($field:ident),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Default)]
        pub(super) struct $name {
            $($field: $crate::cpu::Column,)+
        }
        impl $crate::cpu::lanes::Lanes for $name {
            fn move_lane(&mut self, from: usize, to: usize) {
                $(self.$field.0[to] = self.$field.0[from];)+
            }
            fn take_lane(&mut self, to: usize, other: &Self, from: usize) {
                $(self.$field.0[to] = other.$field.0[from];)+
            }
        }
    };
}
pub(super) use lanes;

widest! {
    /// Walks through the field for every item; gives the number of evaluations.
    pub(super) fn stream<W: Walk>(walk: &mut W, evaluator: &mut dyn Evaluator, items: &[u32]) -> u64 = run;
}

#[inline(always)]
fn run<W: Walk>(walk: &mut W, evaluator: &mut dyn Evaluator, items: &[u32]) -> u64 {
    let most = evaluator
        .blocks(Asked::Distances)
        .min(items.len().div_ceil(LANES));
    let mut blocks: Vec<W::Block> = (0..most).map(|_| W::Block::default()).collect();
    let mut points = vec![Points::default(); most];
    let mut values = vec![Column::default(); most];
    let mut ended = vec![[false; LANES]; most];
    let mut running = vec![0_u32; most * LANES];
    let mut waiting = items.iter().copied();
    let (mut count, mut evaluations) = (0, 0);
    loop {
        while count < most * LANES {
            let Some(item) = waiting.next() else { break };
            if walk.begin(item, &mut blocks[count / LANES], count % LANES) {
                running[count] = item;
                count += 1;
            }
        }
        if count == 0 {
            return evaluations;
        }
        let used = count.div_ceil(LANES);
        for (block, points) in blocks[..used].iter().zip(&mut points) {
            walk.points(block, points);
        }
        repeat_first(&mut points[used - 1], count - (used - 1) * LANES);
        evaluator.distances_many(&points[..used], count, &mut values[..used]);
        evaluations += count as u64;
        for (block, (values, ended)) in blocks
            .iter_mut()
            .zip(values.iter().zip(&mut ended))
            .take(used)
        {
            walk.advance(block, values, ended);
        }
        let mut lane = 0;
        while lane < count {
            let (block, at) = (lane / LANES, lane % LANES);
            if !ended[block][at] {
                lane += 1;
                continue;
            }
            walk.end(running[lane], &blocks[block], at);
            match waiting
                .by_ref()
                .find(|&item| walk.begin(item, &mut blocks[block], at))
            {
                Some(item) => {
                    running[lane] = item;
                    lane += 1;
                }
                None => {
                    count -= 1;
                    let (last, from) = (count / LANES, count % LANES);
                    if last == block {
                        blocks[block].move_lane(from, at);
                    } else {
                        let (first, rest) = blocks.split_at_mut(last);
                        first[block].take_lane(at, &rest[0], from);
                    }
                    running[lane] = running[count];
                    ended[block][at] = ended[last][from];
                }
            }
        }
    }
}

/// Fills the lanes from `count` on with the first point.
pub(super) fn repeat_first(points: &mut Points, count: usize) {
    for column in points {
        let first = column.0[0];
        column.0[count..].fill(first);
    }
}

/// Tells if any lane of a column is not zero.
#[inline(always)]
pub(super) fn any(column: &Column) -> bool {
    column.0.iter().fold(0, |bits, v| bits | v.to_bits()) != 0
}

/// Whether a value is not a number, by its bits: the same test as in the kernels.
#[inline(always)]
pub(super) fn is_nan(x: f32) -> bool {
    x.to_bits() & 0x7fff_ffff > 0x7f80_0000
}
