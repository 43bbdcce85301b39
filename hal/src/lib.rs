//! The hardware interface of `bench`: the traits of a current amplifier and of a displacement probe, and their drivers.
//!
//! A device implements [`CurrentAmplifier`], [`DisplacementProbe`], or both (a [`Rig`]). The loop calls the methods in its
//! real-time thread. No method is called from another thread while the loop owns the device.
//!
//! | method | when the loop calls it | may allocate | may block |
//! |---|---|---|---|
//! | [`latest`](DisplacementProbe::latest) | every tick, first | no | no |
//! | [`status`](CurrentAmplifier::status) | every tick | no | no |
//! | [`actual_current_a`](CurrentAmplifier::actual_current_a) | every tick, twice | no | no |
//! | [`explain`](CurrentAmplifier::explain) | every tick in which `status` is a fault | no | no |
//! | [`command`](CurrentAmplifier::command) | every tick while armed, after the interlocks and the control law | no | no |
//! | [`rounded_a`](CurrentAmplifier::rounded_a) | after a command, if the next one is sent a tick later | no | no |
//! | [`disable`](CurrentAmplifier::disable) | in the tick at a stop or a trip, and when the loop ends | no | no |
//! | [`begin_enable`](CurrentAmplifier::begin_enable) | once, after the request to arm | no | no |
//! | [`poll_enable`](CurrentAmplifier::poll_enable) | every tick from then on, until the result | no | no |
//! | [`begin_reset`](CurrentAmplifier::begin_reset) | once, after the request to clear a trip | no | no |
//! | [`poll_reset`](CurrentAmplifier::poll_reset) | every tick from then on, until the result | no | no |
//!
//! "May block: no" excludes locks, sleeping, printing, and waiting for a device. A system call that returns at once, such as a
//! write to a non-blocking socket, is permitted. A slow device is read by its own thread; `latest` returns the newest
//! value with its age.
//!
//! Nothing in the loop waits for a device: enabling and resetting begin in one tick and end in a later one, within the time
//! limit of the driver. The amplifier gives no current meanwhile. Callers outside the loop use [`blocking`].
//!
//! # Rules for a driver
//!
//! * A value that cannot be trusted is never returned as [`Validity::Valid`]. A value that is returned again keeps its sequence
//!   number.
//! * After [`CurrentAmplifier::disable`] the current is zero, whatever happened before.
//! * Each error states the remedy: the operator reads the [`DeviceError`] in front of the machine.
//!
//! `hal/README.md` describes step by step how to add a driver, with the VESC driver ([`can::vesc`]) as the example.
#![warn(missing_docs)]
#![deny(unsafe_code)]

mod atomics;
pub mod blocking;
pub mod can;
pub mod serial;

use std::fmt;
use std::task::Poll;

/// The scheduled time of a tick. The loop gets the time only in this form, so that simulation, hardware and replay run the
/// same code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tick {
    /// Number of the tick since the loop started. Missed ticks are counted, too.
    pub number: u64,
    /// Scheduled time since the loop started, in nanoseconds: `number` times the sampling period.
    pub scheduled_ns: u64,
}

/// Validity of a reading.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Validity {
    /// A measurement within the measuring range.
    Valid,
    /// The target is outside the measuring range; the position is the end of the range.
    OutOfRange,
    /// The probe reports that it cannot measure, or the connection to it is lost.
    Faulty,
    /// No reading has arrived yet.
    #[default]
    Missing,
}

/// The newest measurement of a displacement probe.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Reading {
    /// Displacement in metres, positive in the direction of positive force.
    pub position_m: f64,
    /// Number of the measurement; unchanged when the same measurement is returned again.
    pub sequence: u64,
    /// Age of the measurement in nanoseconds.
    pub age_ns: u64,
    /// Whether `position_m` may be used.
    pub validity: Validity,
}

/// State of an amplifier.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AmplifierStatus {
    /// No current flows.
    #[default]
    Disabled,
    /// The amplifier follows commands.
    Enabled,
    /// The amplifier has switched off because of a fault, with the code of the driver.
    Fault(u32),
}

/// Description of a fault for the operator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultText {
    /// What happened.
    pub what: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
}

/// Error of a device. It contains static text only, because it is created in the tick.
///
/// ```
/// let error = bench_hal::DeviceError { what: "the drive is not enabled", remedy: "arm first", code: 3 };
/// assert_eq!(error.to_string(), "the drive is not enabled (code 3); arm first");
/// ```
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceError {
    /// What went wrong, where.
    pub what: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
    /// Error number of the device or of the system; 0 if there is none.
    pub code: i64,
}

impl fmt::Display for DeviceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (code {}); {}", self.what, self.code, self.remedy)
    }
}

impl std::error::Error for DeviceError {}

/// A current amplifier.
pub trait CurrentAmplifier: Send {
    /// Begins to prepare the amplifier to follow commands; the current stays zero.
    ///
    /// Called in the tick. Must not allocate or block.
    ///
    /// # Errors
    ///
    /// The amplifier has a fault, or cannot be enabled now.
    fn begin_enable(&mut self) -> Result<(), DeviceError>;

    /// Whether the amplifier follows commands; the current stays zero until the first command.
    ///
    /// Called in every tick after [`begin_enable`](Self::begin_enable) until it is ready. Must not allocate or block. The driver
    /// limits the time: a CANopen drive to `state_timeout` (2 s by default), a VESC to `status_timeout`. After an error, and
    /// after a [`disable`](Self::disable), the amplifier is disabled and the result is an error.
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>>;

    /// Commands a current in amperes and returns the current that the amplifier will give after quantisation and limits.
    ///
    /// Called in every tick while armed. Must not allocate or block. `current_a` is finite, because the interlocks are checked
    /// first.
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError>;

    /// The current in amperes that the next [`command`](Self::command) returns for `current_a`, after rounding and limits. Without
    /// an implementation of its own, an amplifier gives every current unchanged.
    ///
    /// Called in the tick, if commands are sent one tick after they were computed. Must not allocate or block.
    fn rounded_a(&self, current_a: f64) -> f64 {
        current_a
    }

    /// Sets the current to zero immediately; further commands are refused.
    ///
    /// Called in the tick at a stop or a trip, and when the loop ends; in any state, and repeatedly. Must not allocate or
    /// block.
    fn disable(&mut self);

    /// The latest known state. Called in every tick; must not allocate or block.
    fn status(&self) -> AmplifierStatus;

    /// The current that the amplifier measures, in amperes; `None` if it does not report it. Called in every tick; must not
    /// allocate or block.
    fn actual_current_a(&self) -> Option<f64> {
        None
    }

    /// Begins to acknowledge a fault. The amplifier is disabled and stays so.
    ///
    /// Called in the tick, only on a command of the operator. Must not allocate or block.
    ///
    /// # Errors
    ///
    /// The driver cannot begin.
    fn begin_reset(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    /// Whether the fault is acknowledged.
    ///
    /// Called in every tick after [`begin_reset`](Self::begin_reset) until it is ready. Must not allocate or block. The driver
    /// limits the time: a CANopen drive that has restarted is configured again, which may take several times `state_timeout`.
    fn poll_reset(&mut self) -> Poll<Result<(), DeviceError>> {
        Poll::Ready(Ok(()))
    }

    /// Meaning and remedy of a code of [`AmplifierStatus::Fault`].
    ///
    /// Called in every tick in which the amplifier has a fault. Must not allocate or block: the text is static.
    fn explain(&self, code: u32) -> Option<FaultText> {
        let _ = code;
        None
    }
}

/// A displacement probe.
pub trait DisplacementProbe: Send {
    /// The newest measurement at the tick `now`. Called first in every tick; must not allocate or block.
    fn latest(&mut self, now: Tick) -> Reading;
}

impl<A: CurrentAmplifier + ?Sized> CurrentAmplifier for Box<A> {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        (**self).begin_enable()
    }
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        (**self).poll_enable()
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        (**self).command(current_a)
    }
    fn rounded_a(&self, current_a: f64) -> f64 {
        (**self).rounded_a(current_a)
    }
    fn disable(&mut self) {
        (**self).disable();
    }
    fn status(&self) -> AmplifierStatus {
        (**self).status()
    }
    fn actual_current_a(&self) -> Option<f64> {
        (**self).actual_current_a()
    }
    fn begin_reset(&mut self) -> Result<(), DeviceError> {
        (**self).begin_reset()
    }
    fn poll_reset(&mut self) -> Poll<Result<(), DeviceError>> {
        (**self).poll_reset()
    }
    fn explain(&self, code: u32) -> Option<FaultText> {
        (**self).explain(code)
    }
}

impl<P: DisplacementProbe + ?Sized> DisplacementProbe for Box<P> {
    fn latest(&mut self, now: Tick) -> Reading {
        (**self).latest(now)
    }
}

/// An amplifier and a probe.
pub trait Rig: CurrentAmplifier + DisplacementProbe {}
impl<T: CurrentAmplifier + DisplacementProbe> Rig for T {}

/// An amplifier and a probe as one [`Rig`].
#[derive(Debug)]
pub struct Devices<A, P> {
    /// The amplifier of the motor.
    pub amplifier: A,
    /// The probe at the stage.
    pub probe: P,
}

impl<A: CurrentAmplifier, P: Send> CurrentAmplifier for Devices<A, P> {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        self.amplifier.begin_enable()
    }
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        self.amplifier.poll_enable()
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        self.amplifier.command(current_a)
    }
    fn rounded_a(&self, current_a: f64) -> f64 {
        self.amplifier.rounded_a(current_a)
    }
    fn disable(&mut self) {
        self.amplifier.disable();
    }
    fn status(&self) -> AmplifierStatus {
        self.amplifier.status()
    }
    fn actual_current_a(&self) -> Option<f64> {
        self.amplifier.actual_current_a()
    }
    fn begin_reset(&mut self) -> Result<(), DeviceError> {
        self.amplifier.begin_reset()
    }
    fn poll_reset(&mut self) -> Poll<Result<(), DeviceError>> {
        self.amplifier.poll_reset()
    }
    fn explain(&self, code: u32) -> Option<FaultText> {
        self.amplifier.explain(code)
    }
}

impl<A: Send, P: DisplacementProbe> DisplacementProbe for Devices<A, P> {
    fn latest(&mut self, now: Tick) -> Reading {
        self.probe.latest(now)
    }
}
