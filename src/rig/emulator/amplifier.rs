//! An amplifier that acts as the configured one, and moves the stage.

use std::sync::atomic::{AtomicU64, Ordering::Relaxed};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use std::time::Instant;

use bench_hal::can::bus::{Claim, Condition, Host, SocketPort, SystemHost, TaskHandle};
use bench_hal::can::emulator::{
    AmplifierTask, DeviceFault, EmulatedAmplifier, EmulatedDrive, EmulatedDriveSettings,
    EmulatedVesc, FrameCounts, Observer,
};

use super::EmulatorError;
use super::fault::AmplifierFault;
use super::journal::{CurrentWatch, EventLog, LogEntry, Turned};
use super::stage::{Stage, seconds};
use crate::config::{AmplifierDevice, CanopenSettings, Config};
use crate::rig::devices::amplifier::reference;
use crate::util::thread_priority::device_thread_setup;

/// An amplifier at work; dropping it takes it from the bus.
pub struct Amplifier {
    _running: TaskHandle,
    device: Arc<Mutex<dyn EmulatedAmplifier>>,
    host: Arc<dyn Host>,
    tally: Arc<Tally>,
    kind: &'static str,
    _claim: Claim,
}

/// What an amplifier has seen and given.
#[derive(Debug, Default)]
pub struct Tally {
    /// Frames heard.
    pub received: AtomicU64,
    /// Frames sent.
    pub sent: AtomicU64,
    /// Bits of the largest |current| in amperes: those of numbers that are not negative have the same order.
    largest_a: AtomicU64,
    /// When it was enabled first, in nanoseconds; 0: never.
    enabled_ns: AtomicU64,
}

impl Tally {
    /// The largest |current| given so far, in amperes.
    pub fn largest_a(&self) -> f64 {
        f64::from_bits(self.largest_a.load(Relaxed))
    }

    /// When the amplifier was enabled first, in seconds.
    pub fn enabled_s(&self) -> Option<f64> {
        Some(self.enabled_ns.load(Relaxed))
            .filter(|ns| *ns > 0)
            .map(seconds)
    }
}

impl Amplifier {
    /// On the CAN interface of the configuration, with a clock that began at `start`.
    pub fn open(
        config: &Config,
        stage: Stage,
        journal: EventLog,
        start: Instant,
    ) -> Result<Amplifier, EmulatorError> {
        let (interface, bit_rate, node) = match &config.amplifier.device {
            AmplifierDevice::Simulated(_) => {
                return Err(EmulatorError::Simulated {
                    device: "amplifier",
                });
            }
            AmplifierDevice::Canopen(device) => (&device.interface, device.bit_rate, device.node),
            AmplifierDevice::Vesc(device) => (&device.interface, device.bit_rate, device.node),
        };
        let port = SocketPort::open(interface, bit_rate)?;
        // Another claim than that of the driver, which may run on this computer too.
        let claim = Claim::new(&format!("{interface}/device"), node);
        let held = |held| EmulatorError::NodeInUse {
            interface: interface.clone(),
            held,
        };
        let host = Arc::new(
            SystemHost::since(port, start).prepared(device_thread_setup(config.servo.priority)),
        );
        Ok(Amplifier {
            _claim: claim.map_err(held)?,
            ..Amplifier::start(config, host, stage, journal)?
        })
    }

    /// On any bus.
    pub fn start(
        config: &Config,
        host: Arc<dyn Host>,
        stage: Stage,
        journal: EventLog,
    ) -> Result<Amplifier, EmulatorError> {
        let device = device(config)?;
        let tally = Arc::<Tally>::default();
        let follow = follow(stage, journal, Arc::clone(&tally));
        let running = AmplifierTask::start_observed(&*host, Arc::clone(&device), follow);
        let running = running.map_err(|source| EmulatorError::Thread {
            device: "amplifier",
            source,
        })?;
        let kind = config.amplifier.device.kind();
        Ok(Amplifier {
            _running: running,
            device,
            host,
            tally,
            kind,
            _claim: Claim::none(),
        })
    }

    /// Whether the device can have this fault.
    pub fn knows(&self, fault: AmplifierFault) -> bool {
        match fault {
            AmplifierFault::Device(fault) => self.device().supports(fault),
            AmplifierFault::BusOff => true,
        }
    }

    /// Misbehaves from now on. In bus-off nothing passes: the other end is told, and the device hears and says nothing.
    pub fn ask(&self, fault: AmplifierFault) -> Result<(), EmulatorError> {
        match fault {
            AmplifierFault::Device(fault) => self.device().inject(fault),
            AmplifierFault::BusOff => {
                self.device().inject(DeviceFault::Unplugged);
                self.host.tell(Condition::BusOff)?;
            }
        }
        Ok(())
    }

    /// The current that it gives, in amperes.
    pub fn current_a(&self) -> f64 {
        self.device().current_a()
    }

    /// Whether current may flow.
    pub fn is_enabled(&self) -> bool {
        self.device().is_enabled()
    }

    /// State of its power stage, in words.
    pub fn state(&self) -> &'static str {
        self.device().state()
    }

    /// Kind of the device, as in a configuration.
    pub fn kind(&self) -> &'static str {
        self.kind
    }

    /// What it has seen and given.
    pub fn tally(&self) -> &Tally {
        &self.tally
    }

    fn device(&self) -> MutexGuard<'_, dyn EmulatedAmplifier + 'static> {
        self.device.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn device(config: &Config) -> Result<Arc<Mutex<dyn EmulatedAmplifier>>, EmulatorError> {
    match &config.amplifier.device {
        AmplifierDevice::Simulated(_) => Err(EmulatorError::Simulated {
            device: "amplifier",
        }),
        AmplifierDevice::Canopen(device) => {
            Ok(Arc::new(Mutex::new(EmulatedDrive::new(drive(device)))))
        }
        AmplifierDevice::Vesc(device) => Ok(Arc::new(Mutex::new(EmulatedVesc::new(device.node)))),
    }
}

/// A drive that is what the configuration expects.
fn drive(device: &CanopenSettings) -> EmulatedDriveSettings {
    let usual = EmulatedDriveSettings::default();
    let [vendor, product, revision, serial] = usual.identity;
    let identity = &device.identity;
    EmulatedDriveSettings {
        node: device.node,
        identity: [
            identity.vendor.unwrap_or(vendor),
            identity.product.unwrap_or(product),
            identity.revision.unwrap_or(revision),
            identity.serial.unwrap_or(serial),
        ],
        rated_current_ma: (device.rated_current_a * 1e3).round() as u32,
        maximum_per_mille: (device.maximum_current_ratio * 1e3).round() as u16,
        reference: reference(device.target_reference),
        ..usual
    }
}

/// Moves the stage by what the device gives, lets it measure what flows, and writes down its changes.
fn follow(stage: Stage, journal: EventLog, tally: Arc<Tally>) -> Observer {
    let (mut given_a, mut state, mut watch) = (0.0, "", CurrentWatch::default());
    Box::new(move |passed, device| {
        let (now_ns, current_a) = (passed.now_ns, device.current_a());
        if current_a != given_a {
            given_a = current_a;
            stage.command(now_ns, current_a);
        }
        device.set_measured_current_a(Some(stage.current_a(now_ns)));
        count(&tally, passed, device);
        let write = |what, text: &str, since_s| {
            let entry = LogEntry {
                time_s: seconds(now_ns),
                device: "amplifier",
                what,
                text: text.into(),
                enabled: device.is_enabled(),
                current_a,
                position_m: stage.position_m(now_ns),
                since_s,
            };
            journal.write(entry);
        };
        if device.state() != state {
            state = device.state();
            write("state", state, None);
        }
        match watch.see(now_ns, current_a, device.is_enabled()) {
            Some(Turned::On) => write("current on", state, None),
            Some(Turned::Off { since_s }) => write("current off", state, Some(since_s)),
            None => {}
        }
    })
}

fn count(tally: &Tally, passed: FrameCounts, device: &mut dyn EmulatedAmplifier) {
    tally.received.store(passed.received, Relaxed);
    tally.sent.store(passed.sent, Relaxed);
    tally
        .largest_a
        .fetch_max(device.current_a().abs().to_bits(), Relaxed);
    if device.is_enabled() {
        let _ = tally
            .enabled_ns
            .compare_exchange(0, passed.now_ns.max(1), Relaxed, Relaxed); // the first time counts
    }
}
