//! Streaming: any number of ray tasks, 64 at a time.
//!
//! A ray task evaluates the field at one point after another. Tasks in lanes advance together; a lane whose
//! task has ended takes the next item, so all lanes are busy until items run out. The loops over lanes are
//! compiled once per instruction set, as those of `sdfc_vm::lanes` are.
//!
//! An *aside* is a loop that a few tasks run for a while, such as the check of an occluder candidate. Tasks
//! in an aside wait in blocks of their own until there are enough of them. So the others do not run its loop
//! in vain.

use super::{Evaluator, F32x64, LANES, Points, Query};
use sdfc_vm::multiversion;
use std::hint;

/// A kind of ray task. Its methods that loop over lanes are `#[inline(always)]`, so that they become part of
/// each version of [`run_streamed`].
pub(super) trait RayTask {
    /// State of 64 tasks.
    type Block: Lanes;
    /// Starts an item's task in a lane. Returns `false` if the task ends at once: then the lane stays free.
    fn begin(&mut self, item: u32, block: &mut Self::Block, lane: usize) -> bool;
    /// Computes the points of the next evaluation.
    fn points(&self, block: &Self::Block, points: &mut Points);
    /// Advances the tasks by the field's values at these points; sets `ended` where a task ends.
    fn advance(&self, block: &mut Self::Block, values: &F32x64, ended: &mut [bool; LANES]);
    /// Returns a column that is not zero where a task is in an aside, if there are asides.
    #[inline(always)]
    fn aside_mask(block: &Self::Block) -> Option<&F32x64> {
        let _ = block;
        None
    }
    /// Computes the points of the next evaluation of tasks in an aside.
    #[inline(always)]
    fn points_aside(&self, block: &Self::Block, points: &mut Points) {
        self.points(block, points);
    }
    /// Advances the tasks in an aside by the field's values; sets `ended` where a task ends.
    #[inline(always)]
    fn advance_aside(&self, block: &mut Self::Block, values: &F32x64, ended: &mut [bool; LANES]) {
        self.advance(block, values, ended);
    }
    /// Stores the result of a task that has ended.
    fn end(&mut self, item: u32, block: &Self::Block, lane: usize);
}

/// State of 64 tasks.
pub(super) trait Lanes: Default {
    /// Copies one lane's state to another.
    fn move_lane(&mut self, from: usize, to: usize);
    /// Copies the state of another block's lane.
    fn take_lane(&mut self, to: usize, other: &Self, from: usize);
}

/// Declares the state of 64 tasks: a column for each name.
macro_rules! lanes {
    ($(#[$doc:meta])* $name:ident { $($field:ident),+ $(,)? }) => {
        $(#[$doc])*
        #[derive(Default)]
        pub(super) struct $name {
            $($field: $crate::cpu::F32x64,)+
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

/// A choice between a new value for a place in a column and the old value there.
///
/// LLVM stores the result of such a choice by a masked store. With AVX2, AMD's processors take ten times as
/// long for it as for a blend and a full store. An operation with a zero that the compiler does not see
/// makes the old value look like another one.
#[derive(Clone, Copy)]
pub(super) struct ColumnChoice {
    hidden_zero: u32,
}

impl ColumnChoice {
    /// Creates it, once before a loop over lanes.
    #[inline(always)]
    pub(super) fn new() -> Self {
        Self {
            hidden_zero: hint::black_box(0),
        }
    }

    /// Returns `new` if `changes` is set, else `old`.
    #[inline(always)]
    pub(super) fn choose(self, changes: bool, new: f32, old: f32) -> f32 {
        hint::select_unpredictable(changes, new, self.hide(old))
    }

    /// Returns the old value, for a computation that chooses between it and others.
    #[inline(always)]
    pub(super) fn hide(self, old: f32) -> f32 {
        f32::from_bits(old.to_bits() ^ self.hidden_zero)
    }
}

multiversion! {
    /// Runs a ray task for every item; returns the number of evaluations.
    pub(super) fn run_streamed<W: RayTask>(task: &mut W, evaluator: &mut dyn Evaluator, items: &[u32]) -> u64 = run;
}

/// Asides run once their tasks fill this fraction (one over this number) of the lanes that are evaluated
/// together.
const ASIDE_LANE_DIVISOR: usize = 4;

#[inline(always)]
fn run<W: RayTask>(task: &mut W, evaluator: &mut dyn Evaluator, items: &[u32]) -> u64 {
    let max_blocks = evaluator
        .preferred_blocks(Query::Distances)
        .min(items.len().div_ceil(LANES));
    let (max_lanes, min_aside) = (
        max_blocks * LANES,
        (max_blocks * LANES / ASIDE_LANE_DIVISOR).max(LANES),
    );
    let mut running = Pool::<W::Block>::default();
    let mut aside = Pool::<W::Block>::default();
    let mut buffers = EvalBuffers::default();
    let mut unstarted = items.iter().copied();
    let mut evaluations = 0;
    loop {
        while running.count() < max_lanes {
            let Some(item) = unstarted.next() else { break };
            running.begin(task, item);
        }
        let is_aside = aside.count() >= min_aside || running.count() == 0;
        let (pool, other) = if is_aside {
            (&mut aside, &mut running)
        } else {
            (&mut running, &mut aside)
        };
        if pool.count() == 0 {
            return evaluations;
        }
        evaluations += pool.count() as u64;
        buffers.reserve(pool.count().div_ceil(LANES));
        if is_aside {
            pool.step::<W, true>(task, evaluator, max_blocks, &mut buffers);
        } else {
            pool.step::<W, false>(task, evaluator, max_blocks, &mut buffers);
        }
        // Tasks that return from an aside may exceed `max_lanes`.
        let mut next = unstarted
            .by_ref()
            .take(if is_aside { 0 } else { usize::MAX });
        pool.retire_and_refill(
            task,
            other,
            (is_aside, max_lanes),
            &buffers.ended,
            &mut next,
        );
    }
}

/// Tasks in lanes, block after block without a gap.
struct Pool<B> {
    blocks: Vec<B>,
    items: Vec<u32>,
}

/// Points of an evaluation, the field's values there, and the tasks that ended with them.
#[derive(Default)]
struct EvalBuffers {
    points: Vec<Points>,
    values: Vec<F32x64>,
    ended: Vec<[bool; LANES]>,
}

impl EvalBuffers {
    fn reserve(&mut self, blocks: usize) {
        if self.points.len() < blocks {
            self.points.resize_with(blocks, Points::default);
            self.values.resize_with(blocks, F32x64::default);
            self.ended.resize(blocks, [false; LANES]);
        }
    }
}

impl<B> Default for Pool<B> {
    fn default() -> Self {
        Self {
            blocks: Vec::new(),
            items: Vec::new(),
        }
    }
}

impl<B: Lanes> Pool<B> {
    fn count(&self) -> usize {
        self.items.len()
    }

    /// Returns the block and the lane of a task's index.
    #[inline(always)]
    fn lane(index: usize) -> (usize, usize) {
        (index / LANES, index % LANES)
    }

    /// Returns the first free lane.
    #[inline(always)]
    fn next_free_lane(&mut self) -> (&mut B, usize) {
        let (block, lane) = Self::lane(self.items.len());
        if block == self.blocks.len() {
            self.blocks.push(B::default());
        }
        (&mut self.blocks[block], lane)
    }

    /// Starts an item's task in the first free lane, unless it ends at once.
    #[inline(always)]
    fn begin<W: RayTask<Block = B>>(&mut self, task: &mut W, item: u32) {
        let (block, lane) = self.next_free_lane();
        if task.begin(item, block, lane) {
            self.items.push(item);
        }
    }

    /// Copies a task from another pool.
    #[inline(always)]
    fn take_from(&mut self, item: u32, from: &B, lane: usize) {
        let (block, to) = self.next_free_lane();
        block.take_lane(to, from, lane);
        self.items.push(item);
    }

    /// Removes a task; the last one takes its lane.
    #[inline(always)]
    fn remove(&mut self, index: usize) {
        let last = self.items.len() - 1;
        let ((block, to), (other, from)) = (Self::lane(index), Self::lane(last));
        if block == other {
            self.blocks[block].move_lane(from, to);
        } else {
            let (first, after) = self.blocks.split_at_mut(other);
            first[block].take_lane(to, &after[0], from);
        }
        self.items.swap_remove(index);
    }

    /// Advances all tasks by one evaluation, with at most `max_blocks` blocks per call of the evaluator.
    #[inline(always)]
    fn step<W: RayTask<Block = B>, const ASIDE: bool>(
        &mut self,
        task: &W,
        evaluator: &mut dyn Evaluator,
        max_blocks: usize,
        buffers: &mut EvalBuffers,
    ) {
        let count = self.count();
        let used = count.div_ceil(LANES);
        let EvalBuffers {
            points,
            values,
            ended,
        } = buffers;
        for (block, points) in self.blocks[..used].iter().zip(points.iter_mut()) {
            if ASIDE {
                task.points_aside(block, points);
            } else {
                task.points(block, points);
            }
        }
        repeat_first(&mut points[used - 1], count - (used - 1) * LANES);
        let calls = points[..used]
            .chunks(max_blocks)
            .zip(values[..used].chunks_mut(max_blocks));
        for (number, (points, values)) in calls.enumerate() {
            let count = (count - number * max_blocks * LANES).min(max_blocks * LANES);
            evaluator.distances_many(points, count, values);
        }
        let buffers = values.iter().zip(ended.iter_mut());
        for (block, (values, ended)) in self.blocks[..used].iter_mut().zip(buffers) {
            if ASIDE {
                task.advance_aside(block, values, ended);
            } else {
                task.advance(block, values, ended);
            }
        }
    }

    /// Removes the tasks that have ended, and moves to the `other` pool those that belong there. The `next`
    /// items take their lanes, up to `max_lanes`.
    #[inline(always)]
    fn retire_and_refill<W: RayTask<Block = B>>(
        &mut self,
        task: &mut W,
        other: &mut Self,
        (is_aside, max_lanes): (bool, usize),
        ended: &[[bool; LANES]],
        next: &mut impl Iterator<Item = u32>,
    ) {
        // From the last one on, so that a task that moves into a free lane has been tested.
        for block in (0..self.count().div_ceil(LANES)).rev() {
            let aside = W::aside_mask(&self.blocks[block]);
            let mut leaving = leaving_lanes(&ended[block], aside, is_aside);
            leaving &= u64::MAX >> (LANES - (self.count() - block * LANES).min(LANES));
            while leaving != 0 {
                let lane = LANES - 1 - leaving.leading_zeros() as usize;
                leaving &= !(1 << lane);
                let (index, item) = (block * LANES + lane, self.items[block * LANES + lane]);
                if ended[block][lane] {
                    task.end(item, &self.blocks[block], lane);
                } else {
                    other.take_from(item, &self.blocks[block], lane);
                }
                let block = &mut self.blocks[block];
                let mut begins = || next.find(|&item| task.begin(item, block, lane));
                match if self.items.len() <= max_lanes {
                    begins()
                } else {
                    None
                } {
                    Some(item) => self.items[index] = item,
                    None => self.remove(index),
                }
            }
        }
    }
}

/// Mask of the lanes whose tasks have ended or belong to the other pool.
#[inline(always)]
fn leaving_lanes(ended: &[bool; LANES], aside: Option<&F32x64>, is_aside: bool) -> u64 {
    let mut leaving = *ended;
    if let Some(column) = aside {
        for (leaving, v) in leaving.iter_mut().zip(&column.0) {
            *leaving |= (v.to_bits() != 0) != is_aside;
        }
    }
    let bits = leaving.iter().enumerate();
    bits.fold(0, |bits, (lane, &leaving)| {
        bits | u64::from(leaving) << lane
    })
}

/// Fills the lanes from `count` on with the first point.
pub(super) fn repeat_first(points: &mut Points, count: usize) {
    for column in points {
        let first = column.0[0];
        column.0[count..].fill(first);
    }
}

/// Reports whether any lane of a column is not zero.
#[inline(always)]
pub(super) fn any_nonzero(column: &F32x64) -> bool {
    column.0.iter().fold(0, |bits, v| bits | v.to_bits()) != 0
}

/// Reports whether a value is not a number, by its bits: the same test as in the kernels.
#[inline(always)]
pub(super) fn is_nan(x: f32) -> bool {
    x.to_bits() & 0x7fff_ffff > 0x7f80_0000
}
