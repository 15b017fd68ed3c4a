//! Sharing work among cores: each has memory of its own, made once, and takes the next item when it
//! has done one. (Parallel iterators make such memory anew for every piece that they split off.)

use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Mutex, PoisonError};

/// Does `work` on all numbers below `count`, with memory that each thread makes with `start`; gives
/// the results in order.
pub(crate) fn share<M, R: Send>(
    count: usize,
    start: impl Fn() -> M + Sync,
    work: impl Fn(&mut M, usize) -> R + Sync,
) -> Vec<R> {
    let threads = rayon::current_num_threads().min(count);
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::with_capacity(count));
    let take_part = || {
        let mut memory = None;
        let mut own = Vec::new();
        loop {
            let item = next.fetch_add(1, Ordering::Relaxed);
            if item >= count {
                break;
            }
            let memory = memory.get_or_insert_with(&start);
            own.push((item, work(memory, item)));
        }
        done.lock()
            .unwrap_or_else(PoisonError::into_inner)
            .append(&mut own);
    };
    if threads <= 1 {
        take_part();
    } else {
        rayon::scope(|scope| {
            for _ in 0..threads {
                scope.spawn(|_| take_part());
            }
        });
    }
    let mut done = done.into_inner().unwrap_or_else(PoisonError::into_inner);
    done.sort_unstable_by_key(|&(item, _)| item);
    done.into_iter().map(|(_, result)| result).collect()
}
