//! The thread that owns the port: listens or asks, decodes, and publishes the newest measurement with its time.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::time::{Duration, Instant};

use super::cell::{Measurement, Writer};
use super::decoder::{Decoder, Event};
use super::error::Trouble;
use super::poller::{Exchange, Step};
use super::port::{Port, PortSettings};
use super::statistics::{Counters, Rate, add};
use crate::Validity;

/// Longest sleep in a read: how long a drop of the probe may wait for the thread.
const SLICE: Duration = Duration::from_millis(5);
/// A listening thread that has not looked for longer does not know when what it finds has arrived.
const AWAY_NS: u64 = 4 * SLICE.as_nanos() as u64;
/// A read that brings so much found a backlog (22 ms of line at 921600 baud): there is newer behind it.
const BACKLOG: usize = 2048;

/// How a probe is mounted: position = gain * (reading of the probe) + offset.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mounting {
    /// Metres of the stage per metre of the probe; negative if the probe faces against positive force.
    pub gain: f64,
    /// Position of the stage at the probe's zero, metres.
    pub offset_m: f64,
}

impl Default for Mounting {
    /// As the probe reads.
    fn default() -> Self {
        Self {
            gain: 1.0,
            offset_m: 0.0,
        }
    }
}

/// All that the thread owns.
pub(super) struct ReaderThread {
    pub port: Port,
    pub line: PortSettings,
    pub decoder: Box<dyn Decoder>,
    pub exchange: Option<Exchange>,
    pub mounting: Mounting,
    pub latency_ns: u64,
    pub clock: Clock,
    pub publisher: Publisher,
    /// When the thread last knew that nothing was left to read.
    pub looked_ns: u64,
    pub stop: Arc<AtomicBool>,
}

/// Nanoseconds of the monotonic clock.
#[derive(Clone, Copy, Debug)]
pub(super) struct Clock {
    opened: Instant,
}

impl Clock {
    /// What the clock shows when a probe is opened: as old as the longest latency, so that a time before exists.
    pub(super) const OPENED: Duration = Duration::from_secs(3600);

    pub(super) fn start() -> Self {
        Self {
            opened: Instant::now(),
        }
    }

    pub(super) fn now_ns(self) -> u64 {
        (Self::OPENED + self.opened.elapsed()).as_nanos() as u64 // 584 years
    }
}

/// Numbers measurements and hands the newest over.
pub(super) struct Publisher {
    cell: Writer,
    counters: Arc<Counters>,
    newest: Measurement,
    rate: Rate,
}

/// What one read brought.
#[derive(Default)]
struct Harvest {
    /// The newest measurement: its position as the probe reads it, and its validity.
    newest: Option<(f64, Validity)>,
    values: u64,
    /// Measurements made, those that never arrived included.
    made: u64,
    answers: u32,
}

impl Harvest {
    fn take(&mut self, event: Event) {
        let mut measured = |position_m, validity| {
            self.newest = Some((position_m, validity));
            self.values += 1;
            self.made += 1;
        };
        match event {
            Event::Value(sample) => measured(sample.position_m, Validity::Valid),
            Event::OutOfRange(sample) => measured(sample.position_m, Validity::OutOfRange),
            Event::Fault { .. } => measured(f64::NAN, Validity::Faulty),
            Event::Gap(missed) => self.made += u64::from(missed),
            Event::AnswerEnd => self.answers += 1,
            Event::Withheld(_) | Event::Restart | Event::Damaged(_) | Event::Echo => {}
        }
    }
}

impl Publisher {
    pub(super) fn new(cell: Writer, counters: Arc<Counters>) -> Self {
        Self {
            cell,
            counters,
            newest: Measurement::default(),
            rate: Rate::default(),
        }
    }

    /// Takes note of what a read brought; with the time it was made (and only then) the newest goes to the loop.
    fn publish(&mut self, harvest: &Harvest, made_ns: Option<u64>, mounting: Mounting) {
        self.newest.sequence += harvest.made;
        let Some((position_m, validity)) = harvest.newest else {
            return;
        };
        let Some(made_ns) = made_ns else {
            return add(&self.counters.unknown_age, harvest.values);
        };
        add(&self.counters.superseded, harvest.values - 1);
        add(&self.counters.published, 1);
        let position_m = mounting.gain * position_m + mounting.offset_m;
        self.newest = Measurement {
            position_m,
            validity,
            made_ns,
            ..self.newest
        };
        self.cell.publish(self.newest);
    }

    /// The port is lost: the last measurement stays what it was, but is no longer to be used.
    fn lose(&mut self, trouble: Trouble, error: &io::Error) {
        self.counters
            .trouble(trouble, error.raw_os_error().unwrap_or(0).into());
        if self.newest.validity != Validity::Missing {
            self.newest.validity = Validity::Faulty;
            self.cell.publish(self.newest);
        }
    }

    fn update_rate(&mut self, now_ns: u64) {
        if let Some(rate_hz) = self.rate.update(now_ns, self.counters.values.load(Relaxed)) {
            self.counters.rate_bits.store(rate_hz.to_bits(), Relaxed);
        }
    }
}

impl ReaderThread {
    /// Runs until the probe is dropped or the port is lost.
    pub(super) fn run(mut self) {
        while !self.stop.load(Relaxed) {
            if let Err((trouble, error)) = self.turn() {
                self.publisher.lose(trouble, &error);
                break;
            }
            self.publisher.update_rate(self.clock.now_ns());
        }
        self.publisher.counters.running.store(false, Relaxed);
    }

    /// One look at the line; if it brought nothing, what the exchange wants done.
    fn turn(&mut self) -> Result<(), (Trouble, io::Error)> {
        let mut bytes = [0; 4096];
        let wait = self.wait();
        let count = self
            .port
            .read(&mut bytes, wait)
            .map_err(|error| (trouble_of(&error), error))?;
        let now_ns = self.clock.now_ns();
        let late = count >= BACKLOG || now_ns - self.looked_ns > AWAY_NS;
        self.looked_ns = now_ns;
        if count > 0 {
            self.receive(&bytes[..count], now_ns, late); // read never says more than fits
            return Ok(());
        }
        match self.exchange.as_mut().map(|exchange| exchange.step(now_ns)) {
            None | Some(Step::Listen { .. }) => Ok(()),
            Some(Step::TimedOut) => {
                add(&self.publisher.counters.timeouts, 1);
                self.publisher.counters.trouble(Trouble::Timeout, 0);
                Ok(())
            }
            Some(Step::Send) => self.ask().map_err(|error| (Trouble::WriteFailed, error)),
        }
    }

    /// How long to listen; what is due must not wait, but what has arrived comes first.
    fn wait(&self) -> Duration {
        let until_ns = self.exchange.as_ref().map(Exchange::listen_until_ns);
        until_ns.map_or(SLICE, |until_ns| {
            SLICE.min(Duration::from_nanos(
                until_ns.saturating_sub(self.clock.now_ns()),
            ))
        })
    }

    fn ask(&mut self) -> io::Result<()> {
        let counters = &self.publisher.counters;
        self.decoder.reset(&mut |event| counters.count(event));
        let Some((request, exchange)) = self.decoder.request().zip(self.exchange.as_mut()) else {
            return Ok(());
        };
        exchange.sent(self.clock.now_ns());
        self.port.write(request, SLICE)
    }

    /// Takes what the line brought. `late`: nobody knows when it arrived.
    fn receive(&mut self, bytes: &[u8], now_ns: u64, late: bool) {
        let counters = self.publisher.counters.clone();
        add(&counters.bytes, bytes.len() as u64);
        if let Some(exchange) = &mut self.exchange
            && !exchange.heard(now_ns)
        {
            return add(&counters.damaged_bytes, bytes.len() as u64);
        }
        let mut harvest = Harvest::default();
        self.decoder.feed(bytes, &mut |event| {
            counters.count(event);
            harvest.take(event);
        });
        let made_ns = self.made_ns(&harvest, now_ns, late);
        self.publisher.publish(&harvest, made_ns, self.mounting);
    }

    /// When the newest measurement of the harvest was made: at the request that brought it, or, of a probe that speaks by
    /// itself, before its message began to arrive. `None` if that cannot be said.
    fn made_ns(&mut self, harvest: &Harvest, now_ns: u64, late: bool) -> Option<u64> {
        let known_ns = match &mut self.exchange {
            Some(_) if harvest.answers == 0 => None,
            Some(exchange) => exchange.answered(harvest.answers, now_ns),
            None if late => None,
            None => {
                Some(now_ns.saturating_sub(self.line.line_time_ns(self.decoder.message_bytes())))
            }
        };
        known_ns.map(|known_ns| known_ns.saturating_sub(self.latency_ns))
    }
}

fn trouble_of(error: &io::Error) -> Trouble {
    if error.kind() == io::ErrorKind::BrokenPipe {
        Trouble::HungUp
    } else {
        Trouble::ReadFailed
    }
}
