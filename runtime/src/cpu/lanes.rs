//! Streaming: any number of walks through the field, 64 at a time.
//!
//! A walk is a ray that asks the field at one point after another. Walks in lanes advance together;
//! a lane whose walk has ended takes the next item, so all lanes are busy until items run out. The
//! loops over lanes are compiled once per instruction set, as those of `sdfc_vm::lanes` are.

use super::{Column, Evaluator, LANES, Points};

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
        }
    };
}
pub(super) use lanes;

/// Declares `fn $name(…)` as the body `$body` compiled for the widest instruction set that the
/// machine has; the body is `#[inline(always)]`.
macro_rules! widest {
    ($(#[$doc:meta])* fn $name:ident $(<$($generic:ident: $bound:path),+>)? (
        $($argument:ident: $ty:ty),* $(,)?
    ) $(-> $result:ty)? = $body:path;) => {
        $(#[$doc])*
        pub(super) fn $name $(<$($generic: $bound),+>)? ($($argument: $ty),*) $(-> $result)? {
            // `unsafe` is what calling a function with other target features than its caller
            // costs. Measured on a picture of a plane with occlusion, where all the work is here:
            // 1.9 s with SSE2, 0.97 s with AVX2, 0.71 s with AVX-512.
            #[cfg(target_arch = "x86_64")]
            {
                #[target_feature(enable = "avx512f,avx512dq,avx512vl,avx512bw")]
                fn avx512 $(<$($generic: $bound),+>)? ($($argument: $ty),*) $(-> $result)? {
                    $body($($argument),*)
                }
                #[target_feature(enable = "avx2")]
                fn avx2 $(<$($generic: $bound),+>)? ($($argument: $ty),*) $(-> $result)? {
                    $body($($argument),*)
                }
                if is_x86_feature_detected!("avx512f")
                    && is_x86_feature_detected!("avx512dq")
                    && is_x86_feature_detected!("avx512vl")
                    && is_x86_feature_detected!("avx512bw")
                {
                    // SAFETY: the features were just detected.
                    return unsafe { avx512($($argument),*) };
                }
                if is_x86_feature_detected!("avx2") {
                    // SAFETY: the feature was just detected.
                    return unsafe { avx2($($argument),*) };
                }
            }
            $body($($argument),*)
        }
    };
}
pub(super) use widest;

widest! {
    /// Walks through the field for every item; gives the number of evaluations.
    fn stream<W: Walk>(walk: &mut W, evaluator: &mut dyn Evaluator, items: &[u32]) -> u64 = run;
}

#[inline(always)]
fn run<W: Walk>(walk: &mut W, evaluator: &mut dyn Evaluator, items: &[u32]) -> u64 {
    let mut block = W::Block::default();
    let mut running = [0_u32; LANES];
    let mut waiting = items.iter().copied();
    let (mut points, mut values) = (Points::default(), Column::default());
    let mut ended = [false; LANES];
    let (mut count, mut evaluations) = (0, 0);
    loop {
        while count < LANES {
            let Some(item) = waiting.next() else { break };
            if walk.begin(item, &mut block, count) {
                running[count] = item;
                count += 1;
            }
        }
        if count == 0 {
            return evaluations;
        }
        walk.points(&block, &mut points);
        repeat_first(&mut points, count);
        evaluator.distances(&points, count, &mut values);
        evaluations += count as u64;
        walk.advance(&mut block, &values, &mut ended);
        let mut lane = 0;
        while lane < count {
            if !ended[lane] {
                lane += 1;
                continue;
            }
            walk.end(running[lane], &block, lane);
            match waiting
                .by_ref()
                .find(|&item| walk.begin(item, &mut block, lane))
            {
                Some(item) => {
                    running[lane] = item;
                    lane += 1;
                }
                None => {
                    count -= 1;
                    block.move_lane(count, lane);
                    running[lane] = running[count];
                    ended[lane] = ended[count];
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

/// Whether a value is not a number, by its bits: the same test as in the kernels.
#[inline(always)]
pub(super) fn is_nan(x: f32) -> bool {
    x.to_bits() & 0x7fff_ffff > 0x7f80_0000
}
