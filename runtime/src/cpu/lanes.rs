//! Streaming: any number of walks through the field, 64 at a time.
//!
//! A walk is a ray that asks the field at one point after another. Walks in lanes advance together;
//! a lane whose walk has ended takes the next item, so all lanes are busy until items run out. The
//! loops over lanes are compiled once per instruction set, as those of `sdfc_vm::lanes` are.
//!
//! An *aside* is a loop that a few walks run for a while, such as the check of a claim. Walks in an aside wait in
//! blocks of their own until there are enough of them, so that the others do not run its loop for nothing.

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
    /// A column that is not zero where a walk is in an aside, if there are asides.
    #[inline(always)]
    fn asides(block: &Self::Block) -> Option<&Column> {
        let _ = block;
        None
    }
    /// The places where walks in an aside ask the field next.
    #[inline(always)]
    fn points_aside(&self, block: &Self::Block, points: &mut Points) {
        self.points(block, points);
    }
    /// Takes what the field says there; sets `ended` where a walk has.
    #[inline(always)]
    fn advance_aside(&self, block: &mut Self::Block, values: &Column, ended: &mut [bool; LANES]) {
        self.advance(block, values, ended);
    }
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

/// Asides are run once a quarter of the lanes that are run together are in one.
const ASIDE: usize = 4;

#[inline(always)]
fn run<W: Walk>(walk: &mut W, evaluator: &mut dyn Evaluator, items: &[u32]) -> u64 {
    let most = evaluator
        .blocks(Asked::Distances)
        .min(items.len().div_ceil(LANES));
    let (room, enough) = (most * LANES, (most * LANES / ASIDE).max(LANES));
    let mut running = Pool::<W::Block>::default();
    let mut aside = Pool::<W::Block>::default();
    let mut answers = Answers::default();
    let mut waiting = items.iter().copied();
    let mut evaluations = 0;
    loop {
        while running.count() < room {
            let Some(item) = waiting.next() else { break };
            running.begin(walk, item);
        }
        let is_aside = aside.count() >= enough || running.count() == 0;
        let (pool, other) = if is_aside {
            (&mut aside, &mut running)
        } else {
            (&mut running, &mut aside)
        };
        if pool.count() == 0 {
            return evaluations;
        }
        evaluations += pool.count() as u64;
        answers.reserve(pool.count().div_ceil(LANES));
        if is_aside {
            pool.step::<W, true>(walk, evaluator, most, &mut answers);
        } else {
            pool.step::<W, false>(walk, evaluator, most, &mut answers);
        }
        // Those that come back from an aside may be more than there is room for.
        let mut next = waiting.by_ref().take(if is_aside { 0 } else { usize::MAX });
        pool.sort_out(walk, other, (is_aside, room), &answers.ended, &mut next);
    }
}

/// Walks in lanes, block after block without a gap.
struct Pool<B> {
    blocks: Vec<B>,
    items: Vec<u32>,
}

/// The points at which the field is asked, its values there, and the walks that ended with them.
#[derive(Default)]
struct Answers {
    points: Vec<Points>,
    values: Vec<Column>,
    ended: Vec<[bool; LANES]>,
}

impl Answers {
    fn reserve(&mut self, blocks: usize) {
        if self.points.len() < blocks {
            self.points.resize_with(blocks, Points::default);
            self.values.resize_with(blocks, Column::default);
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

    /// The block and the lane of a place.
    #[inline(always)]
    fn lane(place: usize) -> (usize, usize) {
        (place / LANES, place % LANES)
    }

    /// The first free lane.
    #[inline(always)]
    fn free(&mut self) -> (&mut B, usize) {
        let (block, lane) = Self::lane(self.items.len());
        if block == self.blocks.len() {
            self.blocks.push(B::default());
        }
        (&mut self.blocks[block], lane)
    }

    /// Begins an item's walk in a lane of its own, unless it ends right away.
    #[inline(always)]
    fn begin<W: Walk<Block = B>>(&mut self, walk: &mut W, item: u32) {
        let (block, lane) = self.free();
        if walk.begin(item, block, lane) {
            self.items.push(item);
        }
    }

    /// Takes a walk from another pool.
    #[inline(always)]
    fn take(&mut self, item: u32, from: &B, lane: usize) {
        let (block, to) = self.free();
        block.take_lane(to, from, lane);
        self.items.push(item);
    }

    /// Takes a walk out; the last one takes its place.
    #[inline(always)]
    fn remove(&mut self, place: usize) {
        let last = self.items.len() - 1;
        let ((block, to), (other, from)) = (Self::lane(place), Self::lane(last));
        if block == other {
            self.blocks[block].move_lane(from, to);
        } else {
            let (first, rest) = self.blocks.split_at_mut(other);
            first[block].take_lane(to, &rest[0], from);
        }
        self.items.swap_remove(place);
    }

    /// Takes one evaluation in all walks, of at most so many blocks together.
    #[inline(always)]
    fn step<W: Walk<Block = B>, const ASIDE: bool>(
        &mut self,
        walk: &W,
        evaluator: &mut dyn Evaluator,
        most: usize,
        answers: &mut Answers,
    ) {
        let count = self.count();
        let used = count.div_ceil(LANES);
        let Answers {
            points,
            values,
            ended,
        } = answers;
        for (block, points) in self.blocks[..used].iter().zip(points.iter_mut()) {
            if ASIDE {
                walk.points_aside(block, points);
            } else {
                walk.points(block, points);
            }
        }
        repeat_first(&mut points[used - 1], count - (used - 1) * LANES);
        let together = points[..used]
            .chunks(most)
            .zip(values[..used].chunks_mut(most));
        for (number, (points, values)) in together.enumerate() {
            let count = (count - number * most * LANES).min(most * LANES);
            evaluator.distances_many(points, count, values);
        }
        let answers = values.iter().zip(ended.iter_mut());
        for (block, (values, ended)) in self.blocks[..used].iter_mut().zip(answers) {
            if ASIDE {
                walk.advance_aside(block, values, ended);
            } else {
                walk.advance(block, values, ended);
            }
        }
    }

    /// Takes out the walks that have ended, and hands over to the `other` pool those that belong there. The `next`
    /// items take their places, as long as there is room.
    #[inline(always)]
    fn sort_out<W: Walk<Block = B>>(
        &mut self,
        walk: &mut W,
        other: &mut Self,
        (is_aside, room): (bool, usize),
        ended: &[[bool; LANES]],
        next: &mut impl Iterator<Item = u32>,
    ) {
        // From the last one on, so that what takes a place has been looked at.
        for block in (0..self.count().div_ceil(LANES)).rev() {
            let aside = W::asides(&self.blocks[block]);
            let mut over = ending(&ended[block], aside, is_aside);
            over &= u64::MAX >> (LANES - (self.count() - block * LANES).min(LANES));
            while over != 0 {
                let lane = LANES - 1 - over.leading_zeros() as usize;
                over &= !(1 << lane);
                let (place, item) = (block * LANES + lane, self.items[block * LANES + lane]);
                if ended[block][lane] {
                    walk.end(item, &self.blocks[block], lane);
                } else {
                    other.take(item, &self.blocks[block], lane);
                }
                let block = &mut self.blocks[block];
                let mut begins = || next.find(|&item| walk.begin(item, block, lane));
                match if self.items.len() <= room {
                    begins()
                } else {
                    None
                } {
                    Some(item) => self.items[place] = item,
                    None => self.remove(place),
                }
            }
        }
    }
}

/// The lanes whose walks have ended or belong to the other pool, as bits.
#[inline(always)]
fn ending(ended: &[bool; LANES], aside: Option<&Column>, is_aside: bool) -> u64 {
    let mut over = *ended;
    if let Some(column) = aside {
        for (over, v) in over.iter_mut().zip(&column.0) {
            *over |= (v.to_bits() != 0) != is_aside;
        }
    }
    let bits = over.iter().enumerate();
    bits.fold(0, |bits, (lane, &over)| bits | u64::from(over) << lane)
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
