//! The rings and counters between a loop and what surrounds it.

use std::sync::Arc;

use rtrb::{Consumer, RingBuffer};

use bench_rt::program::Program;
use bench_rt::publisher::{EVENT_SLOTS, Publisher};
use bench_rt::record::{LoopMessage, REQUESTS_PER_TICK};
use bench_rt::request::RequestSender;
use bench_rt::servo_run::{Connections, Progress};

/// The ends of a loop's [`Connections`] that stay outside the loop.
pub(crate) struct OutsideEnds {
    /// Requests to the loop.
    pub(crate) requests: RequestSender,
    /// The messages of the loop.
    pub(crate) records: Consumer<LoopMessage>,
    /// Programs that ended, to be freed.
    pub(crate) retired: Consumer<Box<dyn Program>>,
    /// Progress of the run.
    pub(crate) progress: Arc<Progress>,
}

/// Both ends of new connections, with room for `record_slots` published records.
pub(crate) fn connect(record_slots: usize) -> (Connections, OutsideEnds) {
    let (published, records) = RingBuffer::new(record_slots + EVENT_SLOTS);
    let (requests, taken) = RequestSender::ring(REQUESTS_PER_TICK);
    let (ended, retired) = RingBuffer::new(REQUESTS_PER_TICK);
    let progress = Arc::new(Progress::default());
    let connections = Connections {
        requests: taken,
        retired: ended,
        publisher: Publisher::new(published),
        progress: Arc::clone(&progress),
    };
    let outside = OutsideEnds {
        requests,
        records,
        retired,
        progress,
    };
    (connections, outside)
}
