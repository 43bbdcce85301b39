//! All points that are missing, on several threads.

use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::mpsc::sync_channel;

use super::{Place, Point};

/// Measures the `missing` points on up to `threads` threads (at least one), and gives each to `take` as it is done, in any
/// order. `measure` gives none where a person stopped its run. Ends early when `stop` is set, with the points under way, or
/// with the first error.
pub fn work<E: Send>(
    missing: &[Place],
    threads: usize,
    stop: &AtomicBool,
    measure: impl Fn(Place) -> Result<Option<Point>, E> + Sync,
    mut take: impl FnMut(Place, Point) -> Result<(), E>,
) -> Result<(), E> {
    let (next, failed) = (AtomicUsize::new(0), AtomicBool::new(false));
    let stopped = || stop.load(Ordering::Relaxed) || failed.load(Ordering::Relaxed);
    let following = || {
        missing
            .get(next.fetch_add(1, Ordering::Relaxed))
            .copied()
            .filter(|_| !stopped())
    };
    std::thread::scope(|scope| {
        let threads = threads.clamp(1, missing.len().max(1));
        let (tell, told) = sync_channel(threads);
        for _ in 0..threads {
            let (tell, following, measure) = (tell.clone(), &following, &measure);
            scope.spawn(move || {
                while let Some(place) = following() {
                    let measured = measure(place).map(|point| point.map(|point| (place, point)));
                    if tell.send(measured).is_err() {
                        return;
                    }
                }
            });
        }
        drop(tell);
        let mut result = Ok(());
        // Points that end after an error count all the same: they are measured.
        for measured in told {
            let taken = measured
                .and_then(|point| point.map_or(Ok(()), |(place, point)| take(place, point)));
            failed.fetch_or(taken.is_err(), Ordering::Relaxed);
            result = result.and(taken);
        }
        result
    })
}
