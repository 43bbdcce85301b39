//! All draws, on all threads.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};

use super::counter::Counter;
use super::{Block, Plan};

/// Counts the CNMP pairs of the draws in `ranges` on up to `threads` threads (at least one), and gives each block to `take` as
/// it is done, in any order. Ends early when `stop` is set, without the blocks under way, or with the first error of `take`.
pub fn count<E>(
    plan: &Plan,
    ranges: &[Range<u64>],
    threads: usize,
    stop: &AtomicBool,
    mut take: impl FnMut(Block) -> Result<(), E>,
) -> Result<(), E> {
    let (next, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    let stopped = || stop.load(Ordering::Relaxed) || failed.load(Ordering::Relaxed);
    std::thread::scope(|scope| {
        let threads = threads.clamp(1, ranges.len().max(1));
        let (done, blocks) = sync_channel(2 * threads);
        for _ in 0..threads {
            let (done, next) = (done.clone(), &next);
            scope.spawn(move || work(plan, ranges, next, &stopped, &done));
        }
        drop(done);
        let taken = blocks.iter().try_for_each(&mut take);
        failed.store(taken.is_err(), Ordering::Relaxed);
        // Whoever still has a block to give finds nobody to take it, and ends.
        drop(blocks);
        taken
    })
}

fn work(
    plan: &Plan,
    ranges: &[Range<u64>],
    next: &AtomicUsize,
    stopped: &impl Fn() -> bool,
    done: &SyncSender<Block>,
) {
    let mut counter = Counter::new(plan);
    while let Some(range) = ranges.get(next.fetch_add(1, Ordering::Relaxed)) {
        let Some(block) = block(plan, &mut counter, range, stopped) else {
            return;
        };
        if done.send(block).is_err() {
            return;
        }
    }
}

/// The block of a range; none when stopped on the way.
fn block(
    plan: &Plan,
    counter: &mut Counter,
    range: &Range<u64>,
    stopped: &impl Fn() -> bool,
) -> Option<Block> {
    let mut block = Block::new(range.start);
    for (_, drawn) in range.clone().zip(plan.from_draw(range.start)) {
        if stopped() {
            return None;
        }
        block.push(counter.count(&drawn.values), plan.damped);
    }
    Some(block)
}
