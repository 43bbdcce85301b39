//! Carries bytes between a line and a pretend probe, in a thread of its own.

use std::io;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::{EmulatedProbe, Line};

/// Longest time between two looks at what is due.
const LOOK_NS: u64 = 1_000_000;
/// Measurements made one by one if the thread was kept away; more are made at once, of one position.
const MOST_MEASUREMENTS: usize = 1000;

/// A pretend probe that several may hold: one carries its bytes, another asks it for faults.
pub type SharedProbe = Arc<Mutex<Box<dyn EmulatedProbe>>>;

/// A pretend probe at work. Dropping it ends the thread and closes the line: a reader of the terminal sees it hang up.
pub struct ProbeTask {
    stop: Arc<AtomicBool>,
    carried: Arc<LineCounts>,
    thread: Option<JoinHandle<()>>,
}

/// What has gone over a line.
#[derive(Debug, Default)]
pub struct LineCounts {
    /// Bytes of the host.
    pub received: AtomicU64,
    /// Bytes of the probe.
    pub sent: AtomicU64,
    /// Measurements made.
    pub measurements: AtomicU64,
    /// The line is lost.
    pub is_lost: AtomicBool,
}

impl ProbeTask {
    /// Starts `probe` on `line`. `now_ns` is the clock; `measure_m` tells the stage's position, in metres of the probe, at a
    /// time at which a measurement falls due; `prepare` runs first in the thread, to give it a priority or a processor.
    pub fn start(
        line: Line,
        probe: SharedProbe,
        now_ns: impl Fn() -> u64 + Send + 'static,
        measure_m: impl FnMut(u64) -> f64 + Send + 'static,
        prepare: impl FnOnce() + Send + 'static,
    ) -> io::Result<ProbeTask> {
        let (stop, carried) = (Arc::<AtomicBool>::default(), Arc::<LineCounts>::default());
        let mut carrier = Carrier {
            line,
            probe,
            now_ns,
            measure_m,
            carried: Arc::clone(&carried),
        };
        let stopped = Arc::clone(&stop);
        let work = move || {
            prepare();
            while !stopped.load(Relaxed) && carrier.turn().is_ok() {}
            carrier.carried.is_lost.store(true, Relaxed);
        };
        let thread = Some(
            thread::Builder::new()
                .name("probe-device".into())
                .spawn(work)?,
        );
        Ok(ProbeTask {
            stop,
            carried,
            thread,
        })
    }

    /// The counts.
    pub fn carried(&self) -> &Arc<LineCounts> {
        &self.carried
    }
}

impl Drop for ProbeTask {
    fn drop(&mut self) {
        self.stop.store(true, Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // a panic was reported by its own thread
        }
    }
}

struct Carrier<N, M> {
    line: Line,
    probe: SharedProbe,
    now_ns: N,
    measure_m: M,
    carried: Arc<LineCounts>,
}

impl<N: Fn() -> u64, M: FnMut(u64) -> f64> Carrier<N, M> {
    /// Measures and sends what is due, then listens until something is.
    fn turn(&mut self) -> io::Result<()> {
        self.measure();
        let sent = self.line.deliver((self.now_ns)())?;
        self.carried.sent.fetch_add(sent, Relaxed);
        let (mut bytes, wait) = ([0; 256], self.wait());
        let count = self.line.read(&mut bytes, wait)?;
        if count > 0 {
            self.carried.received.fetch_add(count as u64, Relaxed);
            self.answer(&bytes[..count]); // read never says more than fits
        }
        Ok(())
    }

    /// Each measurement is made of the position at its own time.
    fn measure(&mut self) {
        let now_ns = (self.now_ns)();
        let mut probe = lock(&self.probe);
        for turn in 0..=MOST_MEASUREMENTS {
            let due_ns = probe.due_ns().unwrap_or(now_ns);
            if due_ns > now_ns {
                break;
            }
            let at_ns = if turn < MOST_MEASUREMENTS {
                due_ns
            } else {
                now_ns
            };
            let bytes = probe.poll(at_ns, (self.measure_m)(at_ns));
            self.line.give(bytes, 0, at_ns);
            self.carried.measurements.fetch_add(1, Relaxed);
        }
    }

    fn answer(&mut self, request: &[u8]) {
        self.measure();
        let now_ns = (self.now_ns)();
        let mut probe = lock(&self.probe);
        let position_m = (self.measure_m)(now_ns);
        let answer = probe.handle(request, now_ns, position_m);
        self.line.give(answer, request.len(), now_ns);
    }

    fn wait(&self) -> Duration {
        let now_ns = (self.now_ns)();
        let due_ns = [lock(&self.probe).due_ns(), self.line.due_ns()]
            .into_iter()
            .flatten()
            .min();
        Duration::from_nanos(due_ns.unwrap_or(now_ns).saturating_sub(now_ns).min(LOOK_NS))
    }
}

fn lock(probe: &SharedProbe) -> MutexGuard<'_, Box<dyn EmulatedProbe>> {
    probe.lock().unwrap_or_else(PoisonError::into_inner)
}
