//! The thread that connects an emulated probe to a line.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::{EmulatedProbe, Line};

/// Longest wait for bytes of the host.
const WAIT_MAX_NS: u64 = 1_000_000;
/// Largest number of measurements that are taken one by one after the thread was suspended. The remaining ones are taken
/// together, at one position.
const CATCH_UP_MAX: usize = 1000;

/// An emulated probe that is shared: the thread runs it, another thread injects faults.
pub type SharedProbe = Arc<Mutex<EmulatedProbe>>;

/// A running emulated probe. Dropping it ends the thread and closes the line; the reader of the terminal sees a hang-up.
pub struct ProbeTask {
    stop: Arc<AtomicBool>,
    counts: Arc<LineCounts>,
    thread: Option<JoinHandle<()>>,
}

/// Counts of a line.
#[derive(Debug, Default)]
pub struct LineCounts {
    /// Bytes received from the host.
    pub received: AtomicU64,
    /// Bytes sent by the probe.
    pub sent: AtomicU64,
    /// Measurements taken.
    pub measurements: AtomicU64,
    /// Whether the line is lost.
    pub is_lost: AtomicBool,
}

impl ProbeTask {
    /// Starts `probe` on `line`. `now_ns` is the clock. `measure_m` returns the position of the stage, in metres of the
    /// probe, at the time of a measurement. `prepare` runs first in the thread, for example to set its priority.
    pub fn start(
        line: Line,
        probe: SharedProbe,
        now_ns: impl Fn() -> u64 + Send + 'static,
        measure_m: impl FnMut(u64) -> f64 + Send + 'static,
        prepare: impl FnOnce() + Send + 'static,
    ) -> io::Result<ProbeTask> {
        let stop = Arc::<AtomicBool>::default();
        let counts = Arc::<LineCounts>::default();
        let worker = Worker {
            line,
            probe,
            now_ns,
            measure_m,
            counts: Arc::clone(&counts),
            stop: Arc::clone(&stop),
        };
        let run = move || {
            prepare();
            worker.run();
        };
        let thread = thread::Builder::new()
            .name("probe-emulator".into())
            .spawn(run)?;
        Ok(ProbeTask {
            stop,
            counts,
            thread: Some(thread),
        })
    }

    /// The counts of the line.
    pub fn counts(&self) -> &Arc<LineCounts> {
        &self.counts
    }
}

impl Drop for ProbeTask {
    fn drop(&mut self) {
        self.stop.store(true, Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // a panic was reported by the thread itself
        }
    }
}

struct Worker<N, M> {
    line: Line,
    probe: SharedProbe,
    now_ns: N,
    measure_m: M,
    counts: Arc<LineCounts>,
    stop: Arc<AtomicBool>,
}

impl<N: Fn() -> u64, M: FnMut(u64) -> f64> Worker<N, M> {
    fn run(mut self) {
        while !self.stop.load(Relaxed) && self.step().is_ok() {}
        self.counts.is_lost.store(true, Relaxed);
    }

    /// Takes and sends what is due, then waits for a request.
    fn step(&mut self) -> io::Result<()> {
        self.measure();
        let sent = self.line.deliver((self.now_ns)())?;
        self.counts.sent.fetch_add(sent, Relaxed);
        let wait = self.wait();
        let mut buffer = [0; 256];
        let count = self.line.read(&mut buffer, wait)?;
        if count > 0 {
            self.counts.received.fetch_add(count as u64, Relaxed);
            self.answer(&buffer[..count]);
        }
        Ok(())
    }

    /// Takes the measurements that are due, each at the position of its own time.
    fn measure(&mut self) {
        let now_ns = (self.now_ns)();
        let mut probe = lock(&self.probe);
        for number in 0..=CATCH_UP_MAX {
            let due_ns = probe.due_ns().unwrap_or(now_ns);
            if due_ns > now_ns {
                break;
            }
            let time_ns = if number < CATCH_UP_MAX {
                due_ns
            } else {
                now_ns
            };
            let bytes = probe.poll(time_ns, (self.measure_m)(time_ns));
            self.line.transmit(bytes, 0, time_ns);
            self.counts.measurements.fetch_add(1, Relaxed);
        }
    }

    fn answer(&mut self, request: &[u8]) {
        self.measure();
        let now_ns = (self.now_ns)();
        let position_m = (self.measure_m)(now_ns);
        let answer = lock(&self.probe).handle(request, now_ns, position_m);
        self.line.transmit(answer, request.len(), now_ns);
    }

    fn wait(&self) -> Duration {
        let now_ns = (self.now_ns)();
        let measurement_ns = lock(&self.probe).due_ns();
        let times_ns = [measurement_ns, self.line.due_ns()];
        let due_ns = times_ns.into_iter().flatten().min().unwrap_or(now_ns);
        Duration::from_nanos(due_ns.saturating_sub(now_ns).min(WAIT_MAX_NS))
    }
}

fn lock(probe: &SharedProbe) -> MutexGuard<'_, EmulatedProbe> {
    probe.lock().unwrap_or_else(PoisonError::into_inner)
}
