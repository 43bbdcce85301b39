//! The reader thread: owns the port, polls or listens, decodes, and publishes the newest measurement with its time.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::{Duration, Instant};

use super::cell::{Measurement, Writer};
use super::decoder::{Decoder, Event};
use super::error::Failure;
use super::mounting::Mounting;
use super::poller::{Action, Poller};
use super::port::{Port, PortSettings};
use super::statistics::{Counters, Rate, add};
use crate::Validity;

/// Longest wait in a read: how long dropping the probe may wait for the thread.
const READ_WAIT: Duration = Duration::from_millis(5);
/// If the thread has not read for longer than this, the arrival time of the bytes of a stream is unknown.
const MAX_PAUSE_NS: u64 = 4 * READ_WAIT.as_nanos() as u64;
/// A read of this many bytes (22 ms at 921600 baud) found a backlog: newer bytes follow.
const BACKLOG: usize = 2048;

/// The state of the thread.
pub(super) struct ReaderThread {
    pub port: Port,
    pub line: PortSettings,
    pub decoder: Box<dyn Decoder>,
    /// `None` for a stream.
    pub poller: Option<Poller>,
    pub latency_ns: u64,
    pub clock: Clock,
    pub publisher: Publisher,
    /// When the thread last read all available bytes.
    pub last_read_ns: u64,
    pub stop: Arc<AtomicBool>,
}

/// Nanoseconds of the monotonic clock.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    opened: Instant,
}

impl Clock {
    /// The reading of the clock when a probe is opened: the longest latency, so that times before the opening exist.
    const AT_OPENING: Duration = Duration::from_secs(3600);

    pub(super) fn start() -> Self {
        Self {
            opened: Instant::now(),
        }
    }

    pub(super) fn now_ns(self) -> u64 {
        (Self::AT_OPENING + self.opened.elapsed()).as_nanos() as u64 // sufficient for 584 years
    }
}

/// The result of one read.
#[derive(Default)]
struct Batch {
    /// Position as the probe sent it, and validity, of the newest measurement.
    newest: Option<(f64, Validity)>,
    /// Measurements in this batch.
    values: u64,
    /// Measurements that the probe made, including those that did not arrive.
    made: u64,
    /// Complete answers.
    answers: u32,
}

impl Batch {
    fn add(&mut self, event: Event) {
        match event {
            Event::Value(sample) => self.add_measurement(sample.position_m, Validity::Valid),
            Event::OutOfRange(sample) => {
                self.add_measurement(sample.position_m, Validity::OutOfRange);
            }
            Event::Fault { .. } => self.add_measurement(f64::NAN, Validity::Faulty),
            Event::Gap(missed) => self.made += u64::from(missed),
            Event::AnswerEnd => self.answers += 1,
            Event::Withheld(_) | Event::Restart | Event::Damaged(_) | Event::Echo => {}
        }
    }

    fn add_measurement(&mut self, position_m: f64, validity: Validity) {
        self.newest = Some((position_m, validity));
        self.values += 1;
        self.made += 1;
    }
}

/// Numbers the measurements and passes the newest to the loop.
pub(super) struct Publisher {
    cell: Writer,
    counters: Arc<Counters>,
    mounting: Mounting,
    newest: Measurement,
    rate: Rate,
}

impl Publisher {
    pub(super) fn new(cell: Writer, counters: Arc<Counters>, mounting: Mounting) -> Self {
        Self {
            cell,
            counters,
            mounting,
            newest: Measurement::default(),
            rate: Rate::default(),
        }
    }

    /// Counts a batch, and publishes its newest measurement if the time of the measurement is known.
    fn publish(&mut self, batch: &Batch, measured_ns: Option<u64>) {
        self.newest.sequence += batch.made;
        let Some((position_m, validity)) = batch.newest else {
            return;
        };
        let Some(measured_ns) = measured_ns else {
            return add(&self.counters.unknown_age, batch.values);
        };
        add(&self.counters.superseded, batch.values - 1);
        add(&self.counters.published, 1);
        self.newest = Measurement {
            position_m: self.mounting.gain * position_m + self.mounting.offset_m,
            validity,
            measured_ns,
            ..self.newest
        };
        self.cell.publish(self.newest);
    }

    /// Marks the last measurement as faulty, because the port is lost.
    fn fail(&mut self, failure: Failure, error: &io::Error) {
        let code = error.raw_os_error().unwrap_or(0);
        self.counters.set_failure(failure, code.into());
        if self.newest.validity != Validity::Missing {
            self.newest.validity = Validity::Faulty;
            self.cell.publish(self.newest);
        }
    }

    fn update_rate(&mut self, now_ns: u64) {
        let values = self.counters.values.load(Relaxed);
        if let Some(rate_hz) = self.rate.update(now_ns, values) {
            self.counters.rate_bits.store(rate_hz.to_bits(), Relaxed);
        }
    }
}

impl ReaderThread {
    /// Runs until the probe is dropped or the port is lost.
    pub(super) fn run(mut self) {
        while !self.stop.load(Relaxed) {
            if let Err((failure, error)) = self.step() {
                self.publisher.fail(failure, &error);
                break;
            }
            self.publisher.update_rate(self.clock.now_ns());
        }
        self.publisher.counters.running.store(false, Relaxed);
    }

    /// Reads once; if nothing arrived, executes the next action of the poller.
    fn step(&mut self) -> Result<(), (Failure, io::Error)> {
        let mut buffer = [0; 4096];
        let wait = self.read_wait();
        let count = self
            .port
            .read(&mut buffer, wait)
            .map_err(|error| (read_failure(&error), error))?;
        let now_ns = self.clock.now_ns();
        let is_late = count >= BACKLOG || now_ns - self.last_read_ns > MAX_PAUSE_NS;
        self.last_read_ns = now_ns;
        if count > 0 {
            self.receive(&buffer[..count], now_ns, is_late);
            Ok(())
        } else {
            self.poll(now_ns).map_err(|error| (Failure::Write, error))
        }
    }

    /// How long to wait for bytes: until the next action of the poller is due.
    fn read_wait(&self) -> Duration {
        let Some(poller) = &self.poller else {
            return READ_WAIT;
        };
        let left_ns = poller.listen_until_ns().saturating_sub(self.clock.now_ns());
        READ_WAIT.min(Duration::from_nanos(left_ns))
    }

    fn poll(&mut self, now_ns: u64) -> io::Result<()> {
        let Some(poller) = &mut self.poller else {
            return Ok(());
        };
        match poller.next_action(now_ns) {
            Action::Listen { .. } => Ok(()),
            Action::TimedOut => {
                let counters = &self.publisher.counters;
                add(&counters.timeouts, 1);
                counters.set_failure(Failure::Timeout, 0);
                Ok(())
            }
            Action::Send => self.send_request(),
        }
    }

    fn send_request(&mut self) -> io::Result<()> {
        let counters = &self.publisher.counters;
        self.decoder.reset(&mut |event| counters.count(event));
        if let (Some(request), Some(poller)) = (self.decoder.request(), &mut self.poller) {
            poller.sent(self.clock.now_ns());
            self.port.write(request, READ_WAIT)?;
        }
        Ok(())
    }

    /// Decodes bytes and publishes the newest measurement. `is_late`: the arrival time of the bytes is unknown.
    fn receive(&mut self, bytes: &[u8], now_ns: u64, is_late: bool) {
        let counters = Arc::clone(&self.publisher.counters);
        add(&counters.bytes, bytes.len() as u64);
        let is_expected = self
            .poller
            .as_mut()
            .is_none_or(|poller| poller.received(now_ns));
        if !is_expected {
            return add(&counters.damaged_bytes, bytes.len() as u64);
        }
        let mut batch = Batch::default();
        self.decoder.feed(bytes, &mut |event| {
            counters.count(event);
            batch.add(event);
        });
        let measured_ns = self.measured_ns(&batch, now_ns, is_late);
        self.publisher.publish(&batch, measured_ns);
    }

    /// Time of the newest measurement of the batch: the request that it answers, or for a stream the time before its first
    /// byte. `None` if it is unknown.
    fn measured_ns(&mut self, batch: &Batch, now_ns: u64, is_late: bool) -> Option<u64> {
        let known_ns = match &mut self.poller {
            Some(_) if batch.answers == 0 => None,
            Some(poller) => poller.answered(batch.answers, now_ns),
            None if is_late => None,
            None => {
                let line_ns = self.line.line_time_ns(self.decoder.message_bytes());
                Some(now_ns.saturating_sub(line_ns))
            }
        };
        known_ns.map(|known_ns| known_ns.saturating_sub(self.latency_ns))
    }
}

fn read_failure(error: &io::Error) -> Failure {
    if error.kind() == io::ErrorKind::BrokenPipe {
        Failure::HangUp
    } else {
        Failure::Read
    }
}
