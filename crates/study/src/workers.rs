//! Counting of all draws, on all threads.

use std::ops::Range;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{SyncSender, sync_channel};

use super::counter::Counter;
use super::{Block, Plan, Results, StudyError, StudyFile};

/// Computes the draws that are missing in `results`, on up to `threads` threads, and stores each completed block in the file.
/// `progress` is called with the number of draws of each block. Ends early when `stop` is set.
pub fn complete(
    results: &mut Results,
    mut file: Option<&mut StudyFile>,
    threads: usize,
    stop: &AtomicBool,
    mut progress: impl FnMut(u64),
) -> Result<(), StudyError> {
    let plan = results.plan.clone();
    let queue = Queue {
        plan: &plan,
        ranges: results.missing(),
        next: AtomicUsize::new(0),
        stop,
        failed: AtomicBool::new(false),
    };
    queue.count(threads, |block| {
        if let Some(file) = file.as_mut() {
            file.append(&block)?;
        }
        progress(block.cnmp_pairs.len() as u64);
        results.add(block);
        Ok(())
    })?;
    file.map_or(Ok(()), |file| file.sync())
}

/// Ranges of draws, each for the next thread that is idle.
struct Queue<'a> {
    plan: &'a Plan,
    ranges: Vec<Range<u64>>,
    /// Index of the next range.
    next: AtomicUsize,
    stop: &'a AtomicBool,
    /// Whether a completed block could not be stored.
    failed: AtomicBool,
}

impl Queue<'_> {
    /// Counts the CNMP pairs of all draws on up to `threads` threads (at least one), and passes each block to `store` as it
    /// is completed, in any order. Ends early when `stop` is set, without the unfinished blocks, or with the first error of
    /// `store`.
    fn count(
        &self,
        threads: usize,
        store: impl FnMut(Block) -> Result<(), StudyError>,
    ) -> Result<(), StudyError> {
        std::thread::scope(|scope| {
            let threads = threads.clamp(1, self.ranges.len().max(1));
            let (done, blocks) = sync_channel(2 * threads);
            for _ in 0..threads {
                let done = done.clone();
                scope.spawn(move || self.work(&done));
            }
            drop(done);
            let stored = blocks.iter().try_for_each(store);
            self.failed.store(stored.is_err(), Ordering::Relaxed);
            // A thread that still has a block to send finds the channel closed, and ends.
            drop(blocks);
            stored
        })
    }

    fn work(&self, done: &SyncSender<Block>) {
        let mut counter = self.plan.counter();
        while let Some(range) = self.ranges.get(self.next.fetch_add(1, Ordering::Relaxed)) {
            let Some(block) = self.block(&mut counter, range) else {
                return;
            };
            if done.send(block).is_err() {
                return;
            }
        }
    }

    /// The block of a range; `None` when stopped.
    fn block(&self, counter: &mut Counter, range: &Range<u64>) -> Option<Block> {
        let mut block = Block::new(range.start);
        for (_, drawn) in range.clone().zip(self.plan.from_draw(range.start)) {
            if self.stop.load(Ordering::Relaxed) || self.failed.load(Ordering::Relaxed) {
                return None;
            }
            block.push(counter.count(&drawn.values), self.plan.damped);
        }
        Some(block)
    }
}
