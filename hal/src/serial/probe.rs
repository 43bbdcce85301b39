//! The driver of a displacement probe on a serial port.

use std::fmt;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering::Relaxed};
use std::thread::{self, JoinHandle};
use std::time::Duration;

use super::cell::{self, Reader};
use super::error::SerialError;
use super::mounting::Mounting;
use super::note::Note;
use super::poller::{Poller, nanoseconds};
use super::port::{Port, PortSettings};
use super::protocol::Protocol;
use super::reader::{Clock, Publisher, ReaderThread};
use super::statistics::{Counters, Statistics};
use crate::{DisplacementProbe, Reading, Tick};

/// Longest time for writing the start command.
const START_WAIT: Duration = Duration::from_secs(1);

/// Settings of a probe: port, protocol and mounting.
#[derive(Clone, Debug)]
pub struct ProbeSettings {
    /// The port and its line settings.
    pub port: PortSettings,
    /// The protocol with its settings.
    pub protocol: Arc<dyn Protocol>,
    /// How the position of the stage follows from the measurement.
    pub mounting: Mounting,
    /// Time from a measurement until its value is available in the probe (filters, computation), from the manual or a
    /// calibration. It is added to the age of every reading; at most one hour.
    pub latency: Duration,
}

impl ProbeSettings {
    /// A probe with this port and protocol, without mounting and latency.
    pub fn new(port: PortSettings, protocol: Arc<dyn Protocol>) -> Self {
        Self {
            port,
            protocol,
            mounting: Mounting::default(),
            latency: Duration::ZERO,
        }
    }
}

/// A displacement probe on a serial port, read by its own thread. Dropping it ends the thread and closes the port.
///
/// ```no_run
/// use std::sync::Arc;
///
/// use bench_hal::serial::{PortSettings, ProbeSettings, SerialProbe, optoncdt};
/// use bench_hal::{DisplacementProbe, Tick, Validity};
///
/// let port = PortSettings::new("/dev/ttyUSB0", 921_600);
/// let protocol = Arc::new(optoncdt::Settings::new(10e-3));
/// let mut probe = SerialProbe::open(ProbeSettings::new(port, protocol))?;
/// let reading = probe.latest(Tick::default());
/// if reading.validity == Validity::Valid {
///     println!("{} m, {} ns ago", reading.position_m, reading.age_ns);
/// }
/// # Ok::<(), bench_hal::serial::SerialError>(())
/// ```
pub struct SerialProbe {
    newest: Reader,
    clock: Clock,
    counters: Arc<Counters>,
    notes: Vec<Note>,
    stop: Arc<AtomicBool>,
    thread: Option<JoinHandle<()>>,
}

/// Gives access to the statistics of a probe while the loop owns the probe.
#[derive(Clone, Debug)]
pub struct StatisticsHandle {
    counters: Arc<Counters>,
}

impl StatisticsHandle {
    /// The present counts.
    pub fn statistics(&self) -> Statistics {
        self.counters.snapshot()
    }
}

impl SerialProbe {
    /// Opens and locks the port, and starts to read.
    pub fn open(settings: ProbeSettings) -> Result<Self, SerialError> {
        Self::open_with(settings, || {})
    }

    /// As [`open`](Self::open); `prepare` runs first in the reader thread, for example to set its priority. The thread should
    /// have a priority just below the loop: a delay of the thread makes readings of a stream appear younger than they are,
    /// by up to 20 ms; after a longer delay they are not published.
    pub fn open_with(
        settings: ProbeSettings,
        prepare: impl FnOnce() + Send + 'static,
    ) -> Result<Self, SerialError> {
        settings.mounting.check()?;
        settings.protocol.polling().check()?;
        let decoder = settings.protocol.decoder()?;
        let (mut port, notes) = Port::open(&settings.port)?;
        send_start_command(&mut port, &settings)?;
        let (writer, newest) = cell::cell();
        let counters = Arc::<Counters>::default();
        let stop = Arc::<AtomicBool>::default();
        let clock = Clock::start();
        let polling = settings.protocol.polling();
        let reader = ReaderThread {
            port,
            line: settings.port,
            poller: decoder
                .request()
                .map(|_| Poller::new(polling, clock.now_ns())),
            decoder,
            latency_ns: nanoseconds(settings.latency),
            clock,
            publisher: Publisher::new(writer, Arc::clone(&counters), settings.mounting),
            last_read_ns: clock.now_ns(),
            stop: Arc::clone(&stop),
        };
        counters.running.store(true, Relaxed);
        Ok(Self {
            thread: Some(spawn(reader, prepare)?),
            newest,
            clock,
            counters,
            notes,
            stop,
        })
    }

    /// Settings that the port did not accept.
    pub fn notes(&self) -> &[Note] {
        &self.notes
    }

    /// The present counts.
    pub fn statistics(&self) -> Statistics {
        self.counters.snapshot()
    }

    /// A handle to the statistics for another thread.
    pub fn statistics_handle(&self) -> StatisticsHandle {
        StatisticsHandle {
            counters: Arc::clone(&self.counters),
        }
    }
}

fn send_start_command(port: &mut Port, settings: &ProbeSettings) -> Result<(), SerialError> {
    let command = settings.protocol.start_command();
    if command.is_empty() {
        return Ok(());
    }
    port.write(command, START_WAIT)
        .map_err(|source| SerialError::Start {
            path: settings.port.path.clone(),
            source,
        })
}

fn spawn(
    reader: ReaderThread,
    prepare: impl FnOnce() + Send + 'static,
) -> Result<JoinHandle<()>, SerialError> {
    let run = move || {
        prepare();
        reader.run();
    };
    thread::Builder::new()
        .name("serial-probe".into())
        .spawn(run)
        .map_err(|source| SerialError::Thread { source })
}

impl DisplacementProbe for SerialProbe {
    /// The newest measurement with its present age by the monotonic clock. Wait-free; reads the clock once.
    fn latest(&mut self, _now: Tick) -> Reading {
        let now_ns = self.clock.now_ns();
        let newest = self.newest.newest();
        Reading {
            position_m: newest.position_m,
            sequence: newest.sequence,
            age_ns: now_ns.saturating_sub(newest.measured_ns),
            validity: newest.validity,
        }
    }
}

impl Drop for SerialProbe {
    fn drop(&mut self) {
        self.stop.store(true, Relaxed);
        if let Some(thread) = self.thread.take() {
            let _ = thread.join(); // a panic was reported by the thread itself
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
