//! Work that threads share over and over: each begins with a share of its own, the same as long as the work
//! is, and so finds in its cache what it left there.

use rayon::prelude::*;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Calls `act` with each item and what it needs besides, one of it for each share. Shares are of about the
/// same `load`; who has done with its own takes the last items of others. `act` may use other threads itself,
/// and waits then while its thread does another share.
pub(super) fn for_each_in_shares<T: Send, S>(
    items: &mut [T],
    load: impl Fn(&T) -> usize,
    scratch: impl Fn() -> S + Sync,
    act: impl Fn(&mut S, &mut T) + Sync,
) {
    let count = rayon::current_num_threads().min(items.len());
    let all: usize = items.iter().map(&load).sum();
    let (mut shares, mut rest, mut before) = (Vec::with_capacity(count), items, 0);
    for share in 1..count {
        let length = rest.iter().take_while(|item| {
            let fits = before * count < all * share;
            before += if fits { load(item) } else { 0 };
            fits
        });
        let (own, after) = rest.split_at_mut(length.count());
        shares.push(Mutex::new(own.iter_mut()));
        rest = after;
    }
    shares.push(Mutex::new(rest.iter_mut()));
    (0..count).into_par_iter().with_max_len(1).for_each(|_| {
        let (own, mut kept) = (rayon::current_thread_index().unwrap_or(0), None);
        let share = |other: usize| &shares[(own + other) % count];
        loop {
            let next = lock(share(0)).next();
            let next = next.or_else(|| (1..count).find_map(|other| lock(share(other)).next_back()));
            let Some(item) = next else { break };
            act(kept.get_or_insert_with(&scratch), item);
        }
    });
}

fn lock<T>(of: &Mutex<T>) -> MutexGuard<'_, T> {
    of.lock().unwrap_or_else(PoisonError::into_inner)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::atomic::{AtomicUsize, Ordering};
    use std::time::{Duration, Instant};

    /// Each item gets its turn once, whatever it weighs and on however many threads.
    #[test]
    fn every_item_has_one_turn() {
        for threads in [1, 2, 3, 8] {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().expect("a pool");
            for loads in [&[][..], &[0, 0], &[5], &[0, 3, 0, 70, 1, 0, 2, 0], &[1; 100]] {
                let mut items: Vec<_> = loads.iter().map(|load| (*load, 0)).collect();
                pool.install(|| for_each_in_shares(&mut items, |item| item.0, || (), |(), item| item.1 += 1));
                assert!(items.iter().all(|item| item.1 == 1), "{threads} threads: {items:?}");
            }
        }
    }

    /// Shares within shares: all are done, whoever waits for whom.
    #[test]
    fn shares_may_be_shared() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(3).build().expect("a pool");
        let mut items = vec![vec![0; 50]; 7];
        let act = |(): &mut (), inner: &mut Vec<i32>| for_each_in_shares(inner, |_| 1, || (), |(), item| *item += 1);
        pool.install(|| for_each_in_shares(&mut items, Vec::len, || (), act));
        assert!(items.iter().flatten().all(|item| *item == 1));
    }

    /// While a thread is busy with the first item of its share another takes over the rest.
    #[test]
    fn shares_are_taken_over() {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(2).build().expect("a pool");
        let (done, deadline) = (AtomicUsize::new(0), Instant::now() + Duration::from_secs(60));
        let mut items: Vec<usize> = (0..8).collect();
        pool.install(|| {
            for_each_in_shares(
                &mut items,
                |_| 1,
                || (),
                |(), item| {
                    while *item == 0 && done.load(Ordering::Relaxed) < 7 && Instant::now() < deadline {
                        std::thread::yield_now();
                    }
                    *item = done.fetch_add(1, Ordering::Relaxed);
                },
            );
        });
        assert_eq!(items[0], 7, "{items:?}");
    }
}
