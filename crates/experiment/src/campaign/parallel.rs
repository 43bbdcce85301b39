//! Measures points on several threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::{Sender, channel};

use super::grid::GridPoint;
use super::point::PointResult;

/// Hands out the points and stops after an error.
struct Queue<'a> {
    points: &'a [GridPoint],
    next: AtomicUsize,
    failed: AtomicBool,
    stop: &'a AtomicBool,
}

impl Queue<'_> {
    fn next(&self) -> Option<GridPoint> {
        let is_over = self.stop.load(Ordering::Relaxed) || self.failed.load(Ordering::Relaxed);
        let index = self.next.fetch_add(1, Ordering::Relaxed);
        self.points.get(index).copied().filter(|_| !is_over)
    }
}

type Measured<E> = Result<Option<(GridPoint, PointResult)>, E>;

/// Measures `points` on up to `threads` threads (at least one) and gives each result to `take` when it is done, in any
/// order. `measure` returns `None` for a run that was stopped. Ends early when `stop` is set, after the points in progress,
/// or with the first error.
pub(super) fn measure_in_parallel<E: Send>(
    points: &[GridPoint],
    threads: usize,
    stop: &AtomicBool,
    measure: impl Fn(GridPoint) -> Result<Option<PointResult>, E> + Sync,
    mut take: impl FnMut(GridPoint, PointResult) -> Result<(), E>,
) -> Result<(), E> {
    let queue = Queue {
        points,
        next: AtomicUsize::new(0),
        failed: AtomicBool::new(false),
        stop,
    };
    std::thread::scope(|scope| {
        let (sender, results) = channel();
        for _ in 0..threads.clamp(1, points.len().max(1)) {
            let (sender, queue, measure) = (sender.clone(), &queue, &measure);
            scope.spawn(move || measure_until_empty(queue, measure, &sender));
        }
        drop(sender);
        let mut outcome = Ok(());
        // Results that arrive after an error are kept as well.
        for result in results {
            let taken = take_result(result, &mut take);
            queue.failed.fetch_or(taken.is_err(), Ordering::Relaxed);
            outcome = outcome.and(taken);
        }
        outcome
    })
}

fn take_result<E>(
    result: Measured<E>,
    take: &mut impl FnMut(GridPoint, PointResult) -> Result<(), E>,
) -> Result<(), E> {
    match result? {
        Some((point, result)) => take(point, result),
        None => Ok(()),
    }
}

fn measure_until_empty<E>(
    queue: &Queue<'_>,
    measure: &impl Fn(GridPoint) -> Result<Option<PointResult>, E>,
    results: &Sender<Measured<E>>,
) {
    while let Some(point) = queue.next() {
        let measured = measure(point).map(|result| result.map(|result| (point, result)));
        if results.send(measured).is_err() {
            return;
        }
    }
}
