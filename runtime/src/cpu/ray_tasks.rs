//! Streaming: any number of ray tasks, 64 at a time.
//!
//! A ray task evaluates the field at one point after another. Tasks in lanes advance together; a lane whose
//! task has ended takes the next item, so all lanes are busy until items run out. The loops over lanes are
//! compiled once per instruction set, as those of `sdfc_vm::lanes` are.
//!
//! A *divergent* task is in an inner loop that few tasks run for a while, such as the check of an occluder
//! candidate. Divergent tasks wait in blocks of their own until there are enough of them. So the others do
//! not run that loop in vain. The last tasks of both kinds share the lanes of an evaluation.

use super::{Evaluator, F32x64, FieldQuantity, LANES, Points};
use sdfc_vm::multiversion;
use sdfc_vm::vector::V3;
use std::{hint, iter};

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
    /// Returns a column that is not zero where a task is divergent, if tasks can be.
    #[inline(always)]
    fn divergent_mask(block: &Self::Block) -> Option<&F32x64> {
        let _ = block;
        None
    }
    /// Returns the mask of the lanes whose tasks wait for the others in the block: their values do not count.
    #[inline(always)]
    fn waiting_lanes(&self, block: &Self::Block, is_divergent: bool) -> u64 {
        let _ = (block, is_divergent);
        0
    }
    /// Computes the points of the next evaluation of divergent tasks.
    #[inline(always)]
    fn divergent_points(&self, block: &Self::Block, points: &mut Points) {
        self.points(block, points);
    }
    /// Advances the divergent tasks by the field's values; sets `ended` where a task ends.
    #[inline(always)]
    fn advance_divergent(
        &self,
        block: &mut Self::Block,
        values: &F32x64,
        ended: &mut [bool; LANES],
    ) {
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
        impl $crate::cpu::ray_tasks::Lanes for $name {
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

/// Reads a vector from three columns of a lane.
macro_rules! lane_vector {
    ($block:ident, $lane:expr, $x:ident, $y:ident, $z:ident) => {
        sdfc_vm::vector::V3::new($block.$x.0[$lane], $block.$y.0[$lane], $block.$z.0[$lane])
    };
}

/// Writes a vector to three columns of a lane.
macro_rules! set_lane_vector {
    ($block:ident, $lane:expr, $x:ident, $y:ident, $z:ident, $v:expr) => {
        let v = $v;
        $block.$x.0[$lane] = v.x;
        $block.$y.0[$lane] = v.y;
        $block.$z.0[$lane] = v.z;
    };
}
/// Reads the origin and the direction of the ray in a lane.
macro_rules! lane_ray {
    ($block:ident, $lane:expr) => {
        (
            $crate::cpu::ray_tasks::lane_vector!($block, $lane, origin_x, origin_y, origin_z),
            $crate::cpu::ray_tasks::lane_vector!(
                $block,
                $lane,
                direction_x,
                direction_y,
                direction_z
            ),
        )
    };
}

/// Writes the origin and the direction of the ray in a lane.
macro_rules! set_lane_ray {
    ($block:ident, $lane:expr, $origin:expr, $direction:expr) => {
        $crate::cpu::ray_tasks::set_lane_vector!(
            $block, $lane, origin_x, origin_y, origin_z, $origin
        );
        $crate::cpu::ray_tasks::set_lane_vector!(
            $block,
            $lane,
            direction_x,
            direction_y,
            direction_z,
            $direction
        );
    };
}
pub(super) use {lane_ray, lane_vector, set_lane_ray, set_lane_vector};

/// Writes a point to the first three columns of a lane.
#[inline(always)]
pub(super) fn store_point(columns: &mut [F32x64], lane: usize, p: V3<f32>) {
    columns[0].0[lane] = p.x;
    columns[1].0[lane] = p.y;
    columns[2].0[lane] = p.z;
}

/// A choice between a new value for a place in a column and the old value there.
///
/// It avoids masked stores, into which LLVM turns such a choice. With AVX2 on AMD's processors, a masked store
/// takes ten times as long as a blend and a full store. So the old value is
/// combined by XOR with a zero that the compiler does not know. Thus the compiler cannot tell that it is stored.
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

/// Divergent tasks run once they fill this fraction (one over this number) of the lanes that are evaluated
/// together.
const DIVERGENT_LANE_DIVISOR: usize = 4;

#[inline(always)]
fn run<W: RayTask>(task: &mut W, evaluator: &mut dyn Evaluator, items: &[u32]) -> u64 {
    let max_blocks = evaluator
        .preferred_blocks(FieldQuantity::Distances)
        .min(items.len().div_ceil(LANES));
    let (max_lanes, min_divergent) = (
        max_blocks * LANES,
        (max_blocks * LANES / DIVERGENT_LANE_DIVISOR).max(LANES),
    );
    let mut running = Pool::<W::Block>::default();
    let mut divergent = Pool::<W::Block>::default();
    let mut unstarted = items.iter().copied();
    let mut evaluations = 0;
    loop {
        while running.count() < max_lanes {
            let Some(item) = unstarted.next() else { break };
            running.begin(task, item);
        }
        let (running_count, divergent_count) =
            step_counts(running.count(), divergent.count(), min_divergent, max_lanes);
        let count = running_count + divergent_count;
        if count == 0 {
            return evaluations;
        }
        evaluations += count as u64;
        if running_count > 0 {
            running.compute_points::<W, false>(task, running_count);
            evaluations -= running.waiting::<W>(task, running_count, false);
        }
        if divergent_count > 0 {
            divergent.compute_points::<W, true>(task, divergent_count);
            evaluations -= divergent.waiting::<W>(task, divergent_count, true);
        }
        if running_count == 0 {
            divergent.evaluate(evaluator, count);
        } else {
            running.append_points(running_count, &divergent, divergent_count);
            running.evaluate(evaluator, count);
            divergent.take_values(divergent_count, &running, running_count);
        }
        if running_count > 0 {
            running.advance::<W, false>(task, running_count);
        }
        if divergent_count > 0 {
            divergent.advance::<W, true>(task, divergent_count);
        }
        if running_count > 0 {
            let next = &mut unstarted;
            running.retire_and_refill(
                task,
                &mut divergent,
                (false, max_lanes),
                running_count,
                next,
            );
        }
        if divergent_count > 0 {
            let none = &mut iter::empty();
            divergent.retire_and_refill(
                task,
                &mut running,
                (true, max_lanes),
                divergent_count,
                none,
            );
        }
    }
}

/// Returns the number of running tasks and of divergent ones that advance next, from the first ones on.
/// The others of a pool wait, in blocks of their own.
fn step_counts(
    running: usize,
    divergent: usize,
    min_divergent: usize,
    max_lanes: usize,
) -> (usize, usize) {
    let running_count = running.min(max_lanes);
    let fits = divergent <= max_lanes - running_count;
    if divergent >= min_divergent || !fits && divergent >= running {
        (0, divergent.min(max_lanes))
    } else {
        (running_count, if fits { divergent } else { 0 })
    }
}

/// Tasks in lanes, block after block without a gap.
struct Pool<B> {
    blocks: Vec<B>,
    items: Vec<u32>,
    /// Points of the next evaluation.
    points: Vec<Points>,
    /// Values of the field there.
    values: Vec<F32x64>,
    /// Tasks that end with them.
    ended: Vec<[bool; LANES]>,
}

impl<B> Default for Pool<B> {
    fn default() -> Self {
        Self {
            blocks: Vec::new(),
            items: Vec::new(),
            points: Vec::new(),
            values: Vec::new(),
            ended: Vec::new(),
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

    /// Computes the points of the next evaluation of the first `count` tasks.
    #[inline(always)]
    fn compute_points<W: RayTask<Block = B>, const DIVERGENT: bool>(
        &mut self,
        task: &W,
        count: usize,
    ) {
        let used = count.div_ceil(LANES);
        self.reserve(used);
        for (block, points) in self.blocks[..used].iter().zip(&mut self.points) {
            if DIVERGENT {
                task.divergent_points(block, points);
            } else {
                task.points(block, points);
            }
        }
    }

    /// Returns the number of the first `count` tasks that wait for others.
    #[inline(always)]
    fn waiting<W: RayTask<Block = B>>(&self, task: &W, count: usize, is_divergent: bool) -> u64 {
        let mut waiting = 0;
        for (number, block) in self.blocks[..count.div_ceil(LANES)].iter().enumerate() {
            let used = u64::MAX >> (LANES - (count - number * LANES).min(LANES));
            let lanes = task.waiting_lanes(block, is_divergent) & used;
            waiting += u64::from(lanes.count_ones());
        }
        waiting
    }

    /// Creates buffers for at least this number of blocks.
    fn reserve(&mut self, blocks: usize) {
        if self.points.len() < blocks {
            self.points.resize_with(blocks, Points::default);
            self.values.resize_with(blocks, F32x64::default);
            self.ended.resize(blocks, [false; LANES]);
        }
    }

    /// Copies the first points of another pool to the lanes from `start` on.
    fn append_points(&mut self, start: usize, other: &Self, count: usize) {
        self.reserve((start + count).div_ceil(LANES));
        for index in 0..count {
            let ((block, to), (from_block, from)) = (Self::lane(start + index), Self::lane(index));
            for axis in 0..3 {
                self.points[block][axis].0[to] = other.points[from_block][axis].0[from];
            }
        }
    }

    /// Copies the values in another pool's lanes from `start` on.
    fn take_values(&mut self, count: usize, other: &Self, start: usize) {
        for index in 0..count {
            let ((block, to), (from_block, from)) = (Self::lane(index), Self::lane(start + index));
            self.values[block].0[to] = other.values[from_block].0[from];
        }
    }

    /// Evaluates the first `count` points.
    fn evaluate(&mut self, evaluator: &mut dyn Evaluator, count: usize) {
        let used = count.div_ceil(LANES);
        repeat_first(&mut self.points[used - 1], count - (used - 1) * LANES);
        evaluator.distances_many(&self.points[..used], count, &mut self.values[..used]);
    }

    /// Advances the first `count` tasks by the values.
    #[inline(always)]
    fn advance<W: RayTask<Block = B>, const DIVERGENT: bool>(&mut self, task: &W, count: usize) {
        let buffers = self.values.iter().zip(&mut self.ended);
        for (block, (values, ended)) in self.blocks[..count.div_ceil(LANES)].iter_mut().zip(buffers)
        {
            if DIVERGENT {
                task.advance_divergent(block, values, ended);
            } else {
                task.advance(block, values, ended);
            }
        }
    }

    /// Removes those of the first `advanced` tasks that have ended, and moves to the `other` pool those that
    /// belong there. The `next` items take their lanes, up to `max_lanes`.
    #[inline(always)]
    fn retire_and_refill<W: RayTask<Block = B>>(
        &mut self,
        task: &mut W,
        other: &mut Self,
        (is_divergent, max_lanes): (bool, usize),
        advanced: usize,
        next: &mut impl Iterator<Item = u32>,
    ) {
        // From the last one on, so that a task that moves into a free lane has been tested.
        for block in (0..advanced.div_ceil(LANES)).rev() {
            let divergent = W::divergent_mask(&self.blocks[block]);
            let mut leaving = leaving_lanes(&self.ended[block], divergent, is_divergent);
            leaving &= u64::MAX >> (LANES - (advanced - block * LANES).min(LANES));
            while leaving != 0 {
                let lane = LANES - 1 - leaving.leading_zeros() as usize;
                leaving &= !(1 << lane);
                let (index, item) = (block * LANES + lane, self.items[block * LANES + lane]);
                if self.ended[block][lane] {
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

/// Returns the mask of the lanes whose tasks have ended or belong to the other pool.
#[inline(always)]
fn leaving_lanes(ended: &[bool; LANES], divergent: Option<&F32x64>, is_divergent: bool) -> u64 {
    let mut leaving = *ended;
    if let Some(column) = divergent {
        for (leaving, v) in leaving.iter_mut().zip(&column.0) {
            *leaving |= (v.to_bits() != 0) != is_divergent;
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

#[cfg(test)]
mod tests {
    use super::super::SurfaceBlock;
    use super::*;

    const ITEMS: u32 = 1000;
    const MAX_STEPS: u32 = 60;

    /// Returns a number that looks random, the same for equal arguments.
    fn mix(a: u32, b: u32) -> u32 {
        let mixed = (a.wrapping_mul(0x9e37_79b1) ^ b).wrapping_mul(0x85eb_ca6b);
        mixed ^ mixed >> 15
    }

    fn steps(item: u32) -> u32 {
        1 + mix(item, 7) % MAX_STEPS
    }

    /// Reports whether an item is divergent before this step. No item begins so.
    fn is_divergent(item: u32, step: u32) -> bool {
        step > 0 && mix(item, step / 4).is_multiple_of(3)
    }

    fn field(x: f32, y: f32) -> f32 {
        x + y / 64.0
    }

    lanes! {
        /// Items at their steps, and the sums of the values outside and inside of divergent loops.
        StepLanes { item, step, mask, outside, inside }
    }

    /// A task that adds the field's values at points that name the item and the step.
    struct Sums(Vec<[f32; 2]>);

    impl Sums {
        fn advance_all(block: &mut StepLanes, ended: &mut [bool; LANES]) {
            for (i, ended) in ended.iter_mut().enumerate() {
                block.step.0[i] += 1.0;
                let (item, step) = (block.item.0[i] as u32, block.step.0[i] as u32);
                *ended = step >= steps(item);
                block.mask.0[i] = f32::from(u8::from(is_divergent(item, step)));
            }
        }
    }

    impl RayTask for Sums {
        type Block = StepLanes;

        fn begin(&mut self, item: u32, block: &mut StepLanes, lane: usize) -> bool {
            for column in [
                &mut block.step,
                &mut block.mask,
                &mut block.outside,
                &mut block.inside,
            ] {
                column.0[lane] = 0.0;
            }
            block.item.0[lane] = item as f32;
            item % 10 != 9
        }

        fn points(&self, block: &StepLanes, points: &mut Points) {
            points[0].0 = block.item.0;
            points[1].0 = block.step.0;
        }

        fn advance(&self, block: &mut StepLanes, values: &F32x64, ended: &mut [bool; LANES]) {
            for (sum, value) in block.outside.0.iter_mut().zip(values.0) {
                *sum += value;
            }
            Self::advance_all(block, ended);
        }

        fn divergent_mask(block: &StepLanes) -> Option<&F32x64> {
            Some(&block.mask)
        }

        fn advance_divergent(
            &self,
            block: &mut StepLanes,
            values: &F32x64,
            ended: &mut [bool; LANES],
        ) {
            for (sum, value) in block.inside.0.iter_mut().zip(values.0) {
                *sum += value;
            }
            Self::advance_all(block, ended);
        }

        fn end(&mut self, item: u32, block: &StepLanes, lane: usize) {
            assert!(self.0[item as usize][0].is_nan(), "item {item} ends twice");
            self.0[item as usize] = [block.outside.0[lane], block.inside.0[lane]];
        }
    }

    /// An evaluator of [`field`] that counts its calls.
    struct CountingField {
        blocks: usize,
        calls: u64,
    }

    impl Evaluator for CountingField {
        fn preferred_blocks(&self, _: FieldQuantity) -> usize {
            self.blocks
        }

        fn distances(&mut self, points: &Points, _: usize, out: &mut F32x64) {
            for i in 0..LANES {
                out.0[i] = field(points[0].0[i], points[1].0[i]);
            }
        }

        fn distances_many(&mut self, points: &[Points], count: usize, out: &mut [F32x64]) {
            assert!(count <= self.blocks * LANES, "{count} points in one call");
            self.calls += 1;
            for (points, out) in points.iter().zip(out) {
                self.distances(points, LANES, out);
            }
        }

        fn gradients(&mut self, _: &Points, _: usize, _: &mut [F32x64; 4]) {
            unreachable!("tasks ask for distances only");
        }

        fn surfaces(&mut self, _: &Points, _: &Points, _: usize, _: &mut SurfaceBlock) {
            unreachable!("tasks ask for distances only");
        }
    }

    #[test]
    fn every_task_gets_its_values_and_lanes_are_empty_only_at_the_end() {
        for blocks in [1, 4] {
            let items: Vec<u32> = (0..ITEMS).collect();
            let mut sums = Sums(vec![[f32::NAN; 2]; items.len()]);
            let mut evaluator = CountingField { blocks, calls: 0 };
            let evaluations = run_streamed(&mut sums, &mut evaluator, &items);
            let mut total = 0;
            for item in items {
                if item % 10 == 9 {
                    assert!(sums.0[item as usize][0].is_nan(), "item {item} never began");
                    continue;
                }
                let mut expected = [0.0; 2];
                for step in 0..steps(item) {
                    let sum = &mut expected[usize::from(is_divergent(item, step))];
                    *sum += field(item as f32, step as f32);
                    total += 1;
                }
                assert_eq!(sums.0[item as usize], expected, "item {item}");
            }
            assert_eq!(evaluations, total);
            if blocks == 1 {
                // Empty lanes are at most half of a block while more tasks than a block's are left.
                let max_calls = total / LANES as u64 + 3 * u64::from(MAX_STEPS);
                assert!(evaluator.calls <= max_calls, "{} calls", evaluator.calls);
            }
        }
    }
}
