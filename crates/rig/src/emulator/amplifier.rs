//! An emulated amplifier on a CAN bus, whose current moves the stage.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use bench_hal::can::bus::{Claim, Condition, Host, SocketPort, SystemHost, TaskHandle};
use bench_hal::can::emulator::{
    AmplifierTask, DeviceFault, EmulatedAmplifier, FrameCounts, Observer,
};

use super::event_log::{CurrentChange, CurrentMonitor, EventLog, LogEntry, LogEvent};
use super::fault::AmplifierFault;
use super::stage::{Stage, seconds};
use super::{EmulatedDevice, EmulatorError};
use crate::devices::amplifier::{CanAddress, can_amplifier};
use bench_base::thread_priority::device_thread_setup;
use bench_config::AmplifierDevice;

/// Serves an emulated amplifier; dropping it takes the amplifier from the bus.
pub struct AmplifierServer {
    _task: TaskHandle,
    device: Arc<Mutex<dyn EmulatedAmplifier>>,
    host: Arc<dyn Host>,
    counters: Arc<AmplifierCounters>,
    kind: &'static str,
    _claim: Claim,
}

/// Counts of an amplifier since its start.
#[derive(Debug, Default)]
pub struct AmplifierCounters {
    /// Frames received.
    pub received: AtomicU64,
    /// Frames sent.
    pub sent: AtomicU64,
    /// The bits of the largest |current| in amperes. Non-negative numbers and their bits have the same order.
    largest_a_bits: AtomicU64,
    /// When it was first enabled, in nanoseconds; 0 for never.
    enabled_ns: AtomicU64,
}

impl AmplifierCounters {
    /// The largest |current| so far, in amperes.
    pub fn largest_a(&self) -> f64 {
        f64::from_bits(self.largest_a_bits.load(Relaxed))
    }

    /// When the amplifier was first enabled, in seconds.
    pub fn enabled_s(&self) -> Option<f64> {
        match self.enabled_ns.load(Relaxed) {
            0 => None,
            enabled_ns => Some(seconds(enabled_ns)),
        }
    }

    fn update(&self, frames: FrameCounts, device: &dyn EmulatedAmplifier) {
        self.received.store(frames.received, Relaxed);
        self.sent.store(frames.sent, Relaxed);
        let magnitude_bits = device.current_a().abs().to_bits();
        self.largest_a_bits.fetch_max(magnitude_bits, Relaxed);
        if device.is_enabled() {
            // Fails after the first time, which remains stored.
            let now_ns = frames.now_ns.max(1);
            let _ = (self.enabled_ns).compare_exchange(0, now_ns, Relaxed, Relaxed);
        }
    }
}

impl AmplifierServer {
    /// Serves `device` on its CAN interface, with a clock that began at `start`.
    pub fn open(
        device: &AmplifierDevice,
        loop_priority: i32,
        stage: Stage,
        log: EventLog,
        start: Instant,
    ) -> Result<AmplifierServer, EmulatorError> {
        let can = can_amplifier(device).ok_or_else(simulated)?.address();
        let port = SocketPort::open(can.interface, can.bit_rate)?;
        let claim = claim(can)?;
        let host = SystemHost::since(port, start).prepared(device_thread_setup(loop_priority));
        let server = AmplifierServer::start(device, Arc::new(host), stage, log)?;
        Ok(AmplifierServer {
            _claim: claim,
            ..server
        })
    }

    /// Serves `device` on any bus.
    pub fn start(
        device: &AmplifierDevice,
        host: Arc<dyn Host>,
        stage: Stage,
        log: EventLog,
    ) -> Result<AmplifierServer, EmulatorError> {
        let emulated = can_amplifier(device).ok_or_else(simulated)?.emulate();
        let counters = Arc::<AmplifierCounters>::default();
        let observer = observer(stage, log, Arc::clone(&counters));
        let task = AmplifierTask::start_observed(&*host, Arc::clone(&emulated), observer);
        Ok(AmplifierServer {
            _task: task.map_err(no_thread)?,
            device: emulated,
            host,
            counters,
            kind: device.kind(),
            _claim: Claim::none(),
        })
    }

    /// Whether the device can have this fault.
    pub fn supports(&self, fault: AmplifierFault) -> bool {
        match fault {
            AmplifierFault::Device(fault) => self.device().supports(fault),
            AmplifierFault::BusOff => true,
        }
    }

    /// Begins a fault, or ends one. In bus-off no frame passes, and the host reports the condition.
    pub fn inject(&self, fault: AmplifierFault) -> Result<(), EmulatorError> {
        match fault {
            AmplifierFault::Device(fault) => self.device().inject(fault),
            AmplifierFault::BusOff => {
                self.device().inject(DeviceFault::Unplugged);
                self.host.inject_condition(Condition::BusOff)?;
            }
        }
        Ok(())
    }

    /// The current that it gives, in amperes.
    pub fn current_a(&self) -> f64 {
        self.device().current_a()
    }

    /// Whether the power stage is enabled.
    pub fn is_enabled(&self) -> bool {
        self.device().is_enabled()
    }

    /// Name of the state of the power stage.
    pub fn state(&self) -> &'static str {
        self.device().state()
    }

    /// Kind of the device, as in a configuration.
    pub fn kind(&self) -> &'static str {
        self.kind
    }

    /// Its counts so far.
    pub fn counters(&self) -> &AmplifierCounters {
        &self.counters
    }

    fn device(&self) -> MutexGuard<'_, dyn EmulatedAmplifier + 'static> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn simulated() -> EmulatorError {
    let device = EmulatedDevice::Amplifier;
    EmulatorError::Simulated { device }
}

fn no_thread(source: std::io::Error) -> EmulatorError {
    let device = EmulatedDevice::Amplifier;
    EmulatorError::Thread { device, source }
}

/// Claims the device. The driver, which may run on the same computer, claims the node under another name.
fn claim(can: CanAddress<'_>) -> Result<Claim, EmulatorError> {
    let interface = can.interface;
    let claim = Claim::new(&format!("{interface}/device"), can.node);
    claim.map_err(|holder| EmulatorError::NodeInUse {
        interface: interface.into(),
        holder,
    })
}

/// Connects the device to the stage: its current moves the stage, the current that flows is what it measures, and its changes
/// go to the log.
fn observer(stage: Stage, log: EventLog, counters: Arc<AmplifierCounters>) -> Observer {
    let mut given_a = 0.0;
    let mut reporter = ChangeReporter {
        stage: stage.clone(),
        log,
        state: "",
        monitor: CurrentMonitor::default(),
    };
    Box::new(move |frames, device| {
        let now_ns = frames.now_ns;
        if device.current_a() != given_a {
            given_a = device.current_a();
            stage.command(now_ns, given_a);
        }
        device.set_measured_current_a(Some(stage.current_a(now_ns)));
        counters.update(frames, device);
        reporter.report(now_ns, device);
    })
}

/// Writes changes of state and of current to the log.
struct ChangeReporter {
    stage: Stage,
    log: EventLog,
    state: &'static str,
    monitor: CurrentMonitor,
}

impl ChangeReporter {
    fn report(&mut self, now_ns: u64, device: &dyn EmulatedAmplifier) {
        if device.state() != self.state {
            self.state = device.state();
            self.write(now_ns, device, LogEvent::State, None);
        }
        let change = self
            .monitor
            .update(now_ns, device.current_a(), device.is_enabled());
        match change {
            Some(CurrentChange::On) => self.write(now_ns, device, LogEvent::CurrentOn, None),
            Some(CurrentChange::Off { since_s }) => {
                self.write(now_ns, device, LogEvent::CurrentOff, Some(since_s));
            }
            None => {}
        }
    }

    fn write(
        &self,
        now_ns: u64,
        device: &dyn EmulatedAmplifier,
        what: LogEvent,
        since_s: Option<f64>,
    ) {
        self.log.write(LogEntry {
            time_s: seconds(now_ns),
            device: EmulatedDevice::Amplifier,
            what,
            text: self.state.into(),
            enabled: device.is_enabled(),
            current_a: device.current_a(),
            position_m: self.stage.position_m(now_ns),
            since_s,
        });
    }
}
