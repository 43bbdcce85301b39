//! A displacement probe on a serial port, behind the boundary.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::ascii::Ascii;
use super::capancdt::Capancdt;
use super::cell::{self, Reader};
use super::decoder::Decoder;
use super::error::SerialError;
use super::optoncdt::Optoncdt;
use super::poller::{Exchange, Times};
use super::port::{Note, Port, PortSettings};
use super::reader::{Clock, Mounting, Publisher, ReaderThread};
use super::statistics::{Counters, Statistics};
use super::{ascii, capancdt, optoncdt};
use crate::{DisplacementProbe, Reading, Tick};

/// What the probe speaks.
#[derive(Clone, Debug, PartialEq)]
pub enum Protocol {
    /// Micro-Epsilon capaNCDT 61xx over RS485, polled.
    Capancdt(capancdt::Settings),
    /// Micro-Epsilon RS422 stream.
    Optoncdt(optoncdt::Settings),
    /// Lines of text, polled or by itself.
    Ascii(ascii::Settings),
}

impl Protocol {
    /// The decoder of this protocol, or the setting that makes no sense.
    pub fn decoder(&self) -> Result<Box<dyn Decoder>, SerialError> {
        Ok(match self.clone() {
            Self::Capancdt(settings) => Box::new(Capancdt::new(settings)?),
            Self::Optoncdt(settings) => Box::new(Optoncdt::new(settings)?),
            Self::Ascii(settings) => Box::new(Ascii::new(settings)?),
        })
    }
}

/// Times of a probe that must be asked.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Polling {
    /// From one request to the next; 0 asks again as soon as the answer is there.
    pub interval: Duration,
    /// How long a probe may stay silent before it is asked again. At the start, and once more after the answer that ends a
    /// series of missing ones, nothing is believed until the line has been silent for twice as long at least.
    pub timeout: Duration,
    /// How long the line must be quiet before a damaged answer counts as over: longer than the probe thinks before it
    /// answers, and than the longest pause that the adapter makes in an answer (16 ms over USB without low latency).
    pub quiet: Duration,
}

impl Default for Polling {
    /// As fast as the probe answers; 100 ms for an answer, 20 ms of silence after a damaged one.
    fn default() -> Self {
        let ms = Duration::from_millis;
        Self {
            interval: ms(0),
            timeout: ms(100),
            quiet: ms(20),
        }
    }
}

/// A probe, its port and how it is mounted.
#[derive(Clone, Debug, PartialEq)]
pub struct ProbeSettings {
    /// Where it is connected.
    pub port: PortSettings,
    /// What it speaks.
    pub protocol: Protocol,
    /// When it is asked, if it must be.
    pub polling: Polling,
    /// How its readings become positions of the stage.
    pub mounting: Mounting,
    /// From a measurement to the moment the probe could tell it (filters, computing); known from its manual or a
    /// calibration, and added to the age of every reading. An hour at most.
    pub latency: Duration,
}

impl ProbeSettings {
    /// This probe on this port, as it reads.
    pub fn new(port: PortSettings, protocol: Protocol) -> Self {
        let (polling, mounting) = (Polling::default(), Mounting::default());
        Self {
            port,
            protocol,
            polling,
            mounting,
            latency: Duration::ZERO,
        }
    }

    fn check(&self) -> Result<(), SerialError> {
        let Mounting { gain, offset_m } = self.mounting;
        let refuse = |name, value: String, wants| Err(SerialError::Setting { name, value, wants });
        if !gain.is_normal() {
            return refuse("gain", gain.to_string(), "a finite number other than zero");
        }
        if !offset_m.is_finite() {
            return refuse(
                "offset_m",
                offset_m.to_string(),
                "a finite number of metres",
            );
        }
        let Polling { timeout, quiet, .. } = self.polling;
        if quiet.is_zero() || timeout < quiet {
            let value = format!("{quiet:?}, {timeout:?}");
            return refuse(
                "quiet, timeout",
                value,
                "above zero, and the timeout no shorter than the quiet",
            );
        }
        Ok(())
    }
}

/// A displacement probe on a serial port. A thread of its own reads it; dropping it ends the thread and frees the port.
pub struct SerialProbe {
    newest: Reader,
    clock: Clock,
    watch: StatisticsHandle,
    notes: Vec<Note>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// Sees the statistics of a probe while the loop has the probe itself.
#[derive(Clone, Debug)]
pub struct StatisticsHandle {
    counters: Arc<Counters>,
}

impl StatisticsHandle {
    /// The counts up to now.
    pub fn statistics(&self) -> Statistics {
        self.counters.snapshot()
    }
}

impl SerialProbe {
    /// Opens the port, takes it for this process, and starts to read.
    pub fn open(settings: ProbeSettings) -> Result<Self, SerialError> {
        Self::open_with(settings, || {})
    }

    /// The same; `prepare` runs first in the reader's thread, to give it a name, a priority or a processor. The thread
    /// should run just below the loop: whatever delays it makes readings look younger than they are, up to 20 ms, by
    /// which time they are not handed out.
    pub fn open_with(
        settings: ProbeSettings,
        prepare: impl FnOnce() + Send + 'static,
    ) -> Result<Self, SerialError> {
        settings.check()?;
        let decoder = settings.protocol.decoder()?;
        let (port, notes) = Port::open(&settings.port)?;
        let (writer, newest) = cell::cell();
        let (counters, stop) = (
            Arc::new(Counters::default()),
            Arc::new(AtomicBool::new(false)),
        );
        let clock = Clock::start();
        let reader = ReaderThread {
            port,
            exchange: decoder
                .request()
                .map(|_| Exchange::new(times(settings.polling), clock.now_ns())),
            decoder,
            line: settings.port,
            mounting: settings.mounting,
            latency_ns: nanoseconds(settings.latency),
            clock,
            publisher: Publisher::new(writer, counters.clone()),
            looked_ns: clock.now_ns(),
            stop: stop.clone(),
        };
        counters.running.store(true, Relaxed);
        let thread = thread::Builder::new()
            .name("serial-probe".into())
            .spawn(move || {
                prepare();
                reader.run();
            });
        let thread = Some(thread.map_err(|source| SerialError::Thread { source })?);
        Ok(Self {
            newest,
            clock,
            watch: StatisticsHandle { counters },
            notes,
            stop,
            thread,
        })
    }

    /// What the port did not take, for a person.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// The counts up to now.
    pub fn statistics(&self) -> Statistics {
        self.watch.statistics()
    }

    /// A way to the statistics that another thread may keep.
    pub fn watch(&self) -> StatisticsHandle {
        self.watch.clone()
    }

    fn reading_at(&mut self, now_ns: u64) -> Reading {
        let newest = self.newest.newest();
        let age_ns = now_ns.saturating_sub(newest.made_ns);
        Reading {
            position_m: newest.position_m,
            sequence: newest.sequence,
            age_ns,
            validity: newest.validity,
        }
    }
}

impl DisplacementProbe for SerialProbe {
    /// The newest measurement and its age now, by the monotonic clock. Wait-free; one look at the clock.
    fn latest(&mut self, _now: Tick) -> Reading {
        let now_ns = self.clock.now_ns();
        self.reading_at(now_ns)
    }
}

impl Drop for SerialProbe {
    fn drop(&mut self) {
        self.stop.store(true, Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // a panic was reported by its own thread
        }
    }
}

impl fmt::Debug for SerialProbe {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("SerialProbe")
            .field("notes", &self.notes)
            .field("statistics", &self.statistics())
            .finish()
    }
}

/// An hour is for ever on this line, and far from overflowing a sum.
fn nanoseconds(duration: Duration) -> u64 {
    duration.min(Clock::OPENED).as_nanos() as u64
}

fn times(polling: Polling) -> Times {
    Times {
        interval_ns: nanoseconds(polling.interval),
        timeout_ns: nanoseconds(polling.timeout),
        quiet_ns: nanoseconds(polling.quiet),
    }
}
