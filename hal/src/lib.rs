//! The hardware boundary of `bench`: one page for the author of a driver.
//!
//! A device is a [`CurrentAmplifier`], a [`DisplacementProbe`], or both (a [`Rig`]). The loop calls them from its
//! real-time thread, once a tick, in this order:
//!
//! ```text
//! probe.latest(now)   ->  ...interlocks, controller...  ->  amplifier.command(current_a)
//! ```
//!
//! # Rules for a driver
//!
//! * None of the calls marked *in the tick* may allocate, lock, print, sleep or wait for a device. A slow device is read
//!   by a thread of its own, and [`DisplacementProbe::latest`] hands out the newest value with its age.
//! * A value that cannot be trusted is never handed out as [`Validity::Valid`]; an old value never gets a new sequence
//!   number.
//! * After [`CurrentAmplifier::disable`] the current is zero, whatever came before.
//! * Errors say what to do about them: a person reads [`DeviceError`] with the motor in front of him.
//!
//! `hal/README.md` shows step by step how a driver is added, with the VESC driver ([`can::vesc`]) as the worked example.
#![warn(missing_docs)]

pub mod can;
pub mod serial;

use std::fmt;

/// The moment a tick was scheduled for. Time enters the bench only like this, so simulation, hardware and replay run
/// the same code.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Tick {
    /// Number of the tick since the loop started; counts scheduled ticks, so a missed tick leaves a gap.
    pub number: u64,
    /// Scheduled time since the loop started, in nanoseconds: `number` times the period.
    pub scheduled_ns: u64,
}

/// Whether a reading may be used.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Validity {
    /// A measurement within the range of the probe.
    Valid,
    /// The target is outside the probe's range; the position is the range's end.
    OutOfRange,
    /// The probe answers, but says that it cannot measure, or the answer was damaged.
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
    /// Counts measurements: unchanged when `latest` returns the same measurement again.
    pub sequence: u64,
    /// Age of the measurement at the tick, in nanoseconds.
    pub age_ns: u64,
    /// Whether `position_m` may be used.
    pub validity: Validity,
}

/// What an amplifier says of itself.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum AmplifierStatus {
    /// No current flows.
    #[default]
    Disabled,
    /// The amplifier follows commands.
    Enabled,
    /// The amplifier has switched itself off; the code is the device's own.
    Fault(u32),
}

/// A fault in words, for a person.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FaultText {
    /// What happened.
    pub what: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
}

/// A device did not do as told. Static text only: it is made inside the tick.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DeviceError {
    /// What went wrong, where.
    pub what: &'static str,
    /// What to do about it.
    pub remedy: &'static str,
    /// The device's or the system's own number, 0 if there is none.
    pub code: i64,
}

impl fmt::Display for DeviceError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} (code {}); {}", self.what, self.code, self.remedy)
    }
}

impl std::error::Error for DeviceError {}

/// A current amplifier: amperes in, force out.
pub trait CurrentAmplifier: Send {
    /// Prepares the amplifier to follow commands; the current stays zero. Not in the tick: may take its time.
    fn enable(&mut self) -> Result<(), DeviceError>;

    /// Commands `current_a` amperes and returns what the amplifier will really give (quantised, limited). *In the tick.*
    /// `current_a` is finite: the loop's interlocks stand above this call.
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError>;

    /// Zero current, at once, and no more commands followed. *In the tick*, may be called at any time, repeatedly.
    fn disable(&mut self);

    /// The latest known state. *In the tick.*
    fn status(&self) -> AmplifierStatus;

    /// The current that the amplifier says it gives, in amperes, if it says so. *In the tick.*
    fn actual_current_a(&self) -> Option<f64> {
        None
    }

    /// Acknowledges a fault, on a person's command only. Nothing is enabled by it. Not in the tick: may take its time.
    fn reset_fault(&mut self) -> Result<(), DeviceError> {
        Ok(())
    }

    /// What a code of [`AmplifierStatus::Fault`] means and what to do about it, in words.
    fn explain(&self, code: u32) -> Option<FaultText> {
        let _ = code;
        None
    }
}

/// A displacement probe.
pub trait DisplacementProbe: Send {
    /// The newest measurement as of the tick `now`. *In the tick.*
    fn latest(&mut self, now: Tick) -> Reading;
}

impl<A: CurrentAmplifier + ?Sized> CurrentAmplifier for Box<A> {
    fn enable(&mut self) -> Result<(), DeviceError> {
        (**self).enable()
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        (**self).command(current_a)
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
    fn reset_fault(&mut self) -> Result<(), DeviceError> {
        (**self).reset_fault()
    }
    fn explain(&self, code: u32) -> Option<FaultText> {
        (**self).explain(code)
    }
}

/// What the loop drives: an amplifier and a probe.
pub trait Rig: CurrentAmplifier + DisplacementProbe {}
impl<T: CurrentAmplifier + DisplacementProbe> Rig for T {}

/// Joins two devices into a [`Rig`].
#[derive(Debug)]
pub struct Devices<A, P> {
    /// Drives the motor.
    pub amplifier: A,
    /// Reads the stage.
    pub probe: P,
}

impl<A: CurrentAmplifier, P: Send> CurrentAmplifier for Devices<A, P> {
    fn enable(&mut self) -> Result<(), DeviceError> {
        self.amplifier.enable()
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        self.amplifier.command(current_a)
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
    fn reset_fault(&mut self) -> Result<(), DeviceError> {
        self.amplifier.reset_fault()
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
