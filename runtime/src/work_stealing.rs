//! Work stealing with state per thread.
//!
//! A thread creates its state once, and takes its own items from the front. When they run out, it takes items
//! from the end of the longest queue. So neighbouring items stay on one thread, whose state for one item often
//! helps with the next. Parallel iterators would create the state again for each piece that they split off.

use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::{Mutex, PoisonError};

/// Items not yet taken: from (low half) and to (high half).
struct Queue(AtomicU64);

impl Queue {
    fn new(from: usize, to: usize) -> Self {
        Self(AtomicU64::new(from as u64 | (to as u64) << 32))
    }
    fn bounds(word: u64) -> (u64, u64) {
        (word & u64::from(u32::MAX), word >> 32)
    }
    fn remaining(&self) -> u64 {
        let (from, to) = Self::bounds(self.0.load(Ordering::Relaxed));
        to.saturating_sub(from)
    }
    /// Takes the first item, or the last.
    fn take(&self, first: bool) -> Option<usize> {
        let step = |word| {
            let (from, to) = Self::bounds(word);
            let shorter = if first {
                word + 1
            } else {
                from | (to - 1) << 32
            };
            (from < to).then_some(shorter)
        };
        let before = self
            .0
            .fetch_update(Ordering::Relaxed, Ordering::Relaxed, step);
        let (from, to) = Self::bounds(before.ok()?);
        Some(if first { from } else { to - 1 } as usize)
    }
}

/// Calls `work` on all numbers below `count`, which is less than 2³², with state that each thread creates
/// with `init`. Returns the results in order.
pub(crate) fn parallel_map_with<M, R: Send>(
    count: usize,
    init: impl Fn() -> M + Sync,
    work: impl Fn(&mut M, usize) -> R + Sync,
) -> Vec<R> {
    let threads = rayon::current_num_threads().min(count).max(1);
    let first_item = |thread: usize| thread * count / threads;
    let queues: Vec<Queue> = (0..threads)
        .map(|i| Queue::new(first_item(i), first_item(i + 1)))
        .collect();
    // A worker takes its own items from the front, and then those of the longest queue from the back.
    let next = |worker: usize| {
        queues[worker].take(true).or_else(|| {
            loop {
                let longest = queues.iter().max_by_key(|queue| queue.remaining())?;
                if longest.remaining() == 0 {
                    return None;
                }
                if let Some(item) = longest.take(false) {
                    return Some(item);
                }
            }
        })
    };
    let done = Mutex::new(Vec::with_capacity(count));
    let run_worker = |worker: usize| {
        let mut memory = None;
        let mut results = Vec::new();
        while let Some(item) = next(worker) {
            let memory = memory.get_or_insert_with(&init);
            results.push((item, work(memory, item)));
        }
        done.lock()
            .unwrap_or_else(PoisonError::into_inner)
            .append(&mut results);
    };
    if threads == 1 {
        run_worker(0);
    } else {
        rayon::scope(|scope| {
            for worker in 0..threads {
                let take_part = &run_worker;
                scope.spawn(move |_| take_part(worker));
            }
        });
    }
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_unstable_by_key(|&(item, _)| item);
    done.into_iter().map(|(_, result)| result).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::AtomicUsize;

    #[test]
    fn every_item_is_done_once() {
        for count in [0, 1, 2, 7, 1000] {
            let done: Vec<AtomicUsize> = (0..count).map(|_| AtomicUsize::new(0)).collect();
            let slow = |item: usize| item % 97 == 3;
            let results = parallel_map_with(
                count,
                || 0_usize,
                |taken, item| {
                    // A slow item leaves the rest of its queue to the others.
                    if slow(item) {
                        std::thread::sleep(std::time::Duration::from_millis(2));
                    }
                    done[item].fetch_add(1, Ordering::Relaxed);
                    *taken += 1;
                    item * 3
                },
            );
            assert!(done.iter().all(|n| n.load(Ordering::Relaxed) == 1));
            assert_eq!(results, (0..count).map(|item| item * 3).collect::<Vec<_>>());
        }
    }

    #[test]
    fn items_are_taken_from_both_ends() {
        let queue = Queue::new(3, 6);
        assert_eq!(queue.remaining(), 3);
        assert_eq!(queue.take(true), Some(3));
        assert_eq!(queue.take(false), Some(5));
        assert_eq!(queue.take(false), Some(4));
        assert_eq!([queue.take(true), queue.take(false)], [None; 2]);
        assert_eq!(queue.remaining(), 0);
    }
}
