//! Counting of all draws, on all threads.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};

use super::counter::Counter;
use super::{Block, Plan, Results, StudyError, StudyFile};

/// Does the draws that are missing in `results`, on up to `threads` threads, and stores each completed block in the file.
/// `progress` is called with the number of draws of each block. Ends early when `stop` is set.
pub fn complete(
    results: &mut Results,
    mut file: Option<&mut StudyFile>,
    threads: usize,
    stop: &AtomicBool,
    mut progress: impl FnMut(u64),
) -> Result<(), StudyError> {
    let (plan, ranges) = (results.plan.clone(), results.missing());
    count(&plan, &ranges, threads, stop, |block| {
        if let Some(file) = file.as_mut() {
            file.append(&block)?;
        }
        progress(block.cnmp_pairs.len() as u64);
        results.add(block);
        Ok::<(), StudyError>(())
    })?;
    file.map_or(Ok(()), |file| file.sync())
}

/// Counts the CNMP pairs of the draws in `ranges` on up to `threads` threads (at least one), and passes each block to `take` as
/// it is completed, in any order. Ends early when `stop` is set, without the unfinished blocks, or with the first error of `take`.
fn count<E>(
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
        // A thread that still has a block to send finds the channel closed, and ends.
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
    let mut counter = plan.counter();
    while let Some(range) = ranges.get(next.fetch_add(1, Ordering::Relaxed)) {
        let Some(block) = block(plan, &mut counter, range, stopped) else {
            return;
        };
        if done.send(block).is_err() {
            return;
        }
    }
}

/// The block of a range; `None` when stopped.
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
