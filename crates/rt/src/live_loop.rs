//! A loop that lives as long as its rig. It serves runs one after the other:
//!
//! ```text
//!              run (ring)                                    ended run (ring)
//!  supervisor ------------>  thread: run until it is off  ------------------->  supervisor
//!                            between two runs: disarmed
//! ```
//!
//! Between two runs the amplifier is disabled. In real time the loop goes on with its ticks, so that the devices are read; in virtual
//! pace it waits. Each run has its own tick numbers, rings and interlocks; a trip and a reset that has begun outlast the run.

use std::task::Poll;
use std::thread::JoinHandle;

use bench_hal::Rig;
use rtrb::{Consumer, Producer, RingBuffer};

use super::clock::{Clock, Realtime, Virtual};
use super::servo::Servo;
use super::servo_run::ServoRun;
use super::thread::{Pace, Scheduling};
use bench_config::LoopSettings;

/// The thread of the loop ended without an order to do so: it panicked. The amplifier is disabled.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the thread of the loop panicked; report this with the output of the program")]
pub struct LoopPanicked;

/// A loop on its own thread. Dropping it closes the rig.
pub struct LiveLoop {
    runs: Producer<Box<ServoRun>>,
    ended: Consumer<Box<ServoRun>>,
    is_running: bool,
    scheduling: Scheduling,
    thread: Option<JoinHandle<()>>,
}

impl LiveLoop {
    /// Starts the thread, disarmed. `idle` takes the place of a run between the runs.
    ///
    /// # Errors
    /// When the system refuses a thread.
    pub fn open(
        rig: Box<dyn Rig>,
        idle: Box<ServoRun>,
        settings: &LoopSettings,
        pace: Pace,
    ) -> std::io::Result<LiveLoop> {
        let (runs, waiting) = RingBuffer::new(1);
        let (done, ended) = RingBuffer::new(1);
        let (report, reported) = std::sync::mpsc::channel();
        let (period_s, awake_s) = (settings.period_s(), settings.awake_s());
        let settings = settings.clone();
        let builder = std::thread::Builder::new().name("bench-loop".into());
        let thread = builder.spawn(move || {
            let scheduling = pace.schedule(&settings);
            let ends = LoopEnds {
                runs: waiting,
                ended: done,
                scheduling: scheduling.clone(),
            };
            let _ = report.send(scheduling); // without a receiver there is no run
            let servo = Servo::new(rig, idle, period_s);
            match pace {
                Pace::Virtual => ends.serve_virtual(servo, period_s),
                Pace::Realtime => ends.serve_realtime(servo, period_s, awake_s),
            }
        })?;
        let scheduling = reported.recv().map_err(std::io::Error::other)?;
        Ok(LiveLoop {
            runs,
            ended,
            is_running: false,
            scheduling,
            thread: Some(thread),
        })
    }

    /// How the loop is scheduled.
    pub fn scheduling(&self) -> &Scheduling {
        &self.scheduling
    }

    /// Begins a run.
    ///
    /// # Errors
    /// The run itself while another one goes on.
    pub fn begin(&mut self, run: Box<ServoRun>) -> Result<(), Box<ServoRun>> {
        if self.is_running {
            return Err(run);
        }
        let pushed = self.runs.push(run);
        pushed.map_err(|rtrb::PushError::Full(run)| run)?;
        self.is_running = true;
        self.wake();
        Ok(())
    }

    /// The run, if it has ended.
    ///
    /// # Errors
    /// When the loop panicked.
    pub fn poll_end(&mut self) -> Poll<Result<Box<ServoRun>, LoopPanicked>> {
        // In this order: a thread that has ended does not return a run any more.
        let has_ended = self.thread.as_ref().is_none_or(JoinHandle::is_finished);
        match self.ended.pop() {
            Ok(run) => {
                self.is_running = false;
                Poll::Ready(Ok(run))
            }
            Err(_) if has_ended => Poll::Ready(Err(LoopPanicked)),
            Err(_) => Poll::Pending,
        }
    }

    fn wake(&self) {
        if let Some(thread) = &self.thread {
            thread.thread().unpark();
        }
    }
}

impl Drop for LiveLoop {
    /// Waits until the rig is closed. A run that still goes on is not waited for: it ends by itself, at the latest when its arm
    /// lease expires.
    fn drop(&mut self) {
        // The thread ends when the other end of this ring is gone.
        self.runs = RingBuffer::new(1).0;
        self.wake();
        if let Some(thread) = self.thread.take().filter(|_| !self.is_running) {
            let _ = thread.join(); // a panic was reported by `poll_end`
        }
    }
}

/// Idle ticks before a run. Locking memory takes milliseconds; on a computer with one processor nothing is read meanwhile, and the
/// first reading of the run would be stale.
fn catch_up_ticks(period_s: f64) -> u64 {
    const CATCH_UP_S: f64 = 0.01;
    (CATCH_UP_S / period_s).ceil() as u64
}

/// The loop's ends of the rings.
struct LoopEnds {
    runs: Consumer<Box<ServoRun>>,
    ended: Producer<Box<ServoRun>>,
    scheduling: Scheduling,
}

impl LoopEnds {
    fn serve_virtual(mut self, mut servo: Servo, period_s: f64) {
        while !self.runs.is_abandoned() {
            match self.runs.pop() {
                Ok(run) => self.serve(&mut servo, run, Virtual { period_s }),
                Err(_) => std::thread::park(),
            }
        }
    }

    fn serve_realtime(mut self, mut servo: Servo, period_s: f64, awake_s: f64) {
        let (mut idle, mut number) = (Realtime::new(period_s), 0);
        while !self.runs.is_abandoned() {
            match self.runs.pop() {
                Ok(run) => {
                    let privileges = self.scheduling.hold();
                    for _ in 0..catch_up_ticks(period_s) {
                        number = tick(&mut servo, &mut idle, number);
                    }
                    let clock = Realtime::new(period_s).awake_before_ticks(awake_s);
                    self.serve(&mut servo, run, clock);
                    drop(privileges);
                    (idle, number) = (Realtime::new(period_s), 0);
                }
                Err(_) => number = tick(&mut servo, &mut idle, number),
            }
        }
    }

    /// One run.
    fn serve(&mut self, servo: &mut Servo, run: Box<ServoRun>, clock: impl Clock) {
        let mut idle = servo.exchange(run);
        run_to_end(servo, clock);
        idle.restart_clocks();
        let ended = servo.exchange(idle);
        // The ring holds one run, and the next one begins after this one was taken.
        let _ = self.ended.push(ended);
    }
}

/// Ticks until the loop has been off for the tail of its run.
pub fn run_to_end(servo: &mut Servo, mut clock: impl Clock) {
    let (mut number, mut off_ticks) = (0, 0);
    while off_ticks <= servo.run().tail_ticks() {
        number = tick(servo, &mut clock, number);
        off_ticks = if servo.is_off() { off_ticks + 1 } else { 0 };
    }
}

/// Serves the tick `number`, or a later one; returns the number of the next.
fn tick(servo: &mut Servo, clock: &mut impl Clock, number: u64) -> u64 {
    let timing = clock.wait(number, servo.run().publisher());
    servo.tick(&timing, clock);
    timing.tick.number + 1
}
