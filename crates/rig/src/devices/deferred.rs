//! A configured computing delay of one period, enforced on real devices.
//!
//! ```text
//!  tick k      read, check, decide: x(k)     sends x(k-1)
//!  tick k+1    read, check, decide: x(k+1)   sends x(k)      a trip or a stop sends zero at once instead
//! ```
//!
//! The loop sees the same amplifier as without the delay: the result of a command is the current that the amplifier will give for
//! it, one period later. This is also the meaning of a command on the simulated stage, so that a law, the interlocks, a recording
//! and the analysis use the configured delay for both.

use std::task::Poll;

use bench_hal::{
    AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, FaultText, Reading, Rig,
    Tick,
};

use bench_config::LoopSettings;

/// The delay between computation and output cannot be enforced.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error(
    "loop.computing_delay_periods is {periods}, but with real devices a command is sent in its tick (0) or in the next one (1); set it to 0 or 1"
)]
pub struct ComputingDelayError {
    /// As configured.
    pub periods: u32,
}

/// When a set-point is sent.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum OutputTiming {
    /// In the tick in which it is computed.
    SameTick,
    /// In the tick after.
    NextTick,
}

impl OutputTiming {
    /// The timing of the configured computing delay. A delay of two or more periods is refused.
    pub fn of(servo: &LoopSettings) -> Result<OutputTiming, ComputingDelayError> {
        match servo.computing_delay_periods {
            0 => Ok(OutputTiming::SameTick),
            1 => Ok(OutputTiming::NextTick),
            periods => Err(ComputingDelayError { periods }),
        }
    }

    /// The rig with this timing.
    pub fn apply(self, rig: impl Rig + 'static) -> Box<dyn Rig> {
        match self {
            OutputTiming::SameTick => Box::new(rig),
            OutputTiming::NextTick => Box::new(Deferred::new(rig)),
        }
    }
}

const OTHER_CURRENT: DeviceError = DeviceError {
    what: "the amplifier gives another current than its driver announced one period before",
    remedy: "this is a fault of the driver; set loop.computing_delay_periods = 0 and report it",
    code: 0,
};

/// A set-point of the loop, and the current that the amplifier will give for it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
struct SetPoint {
    requested_a: f64,
    accepted_a: f64,
}

/// A rig whose set-points are sent one tick after they were computed.
#[derive(Debug)]
pub struct Deferred<R> {
    rig: R,
    /// The set-point of the last tick. Zero current after a disable.
    next: SetPoint,
}

impl<R> Deferred<R> {
    /// The rig, with no set-point to send.
    pub fn new(rig: R) -> Self {
        Deferred {
            rig,
            next: SetPoint::default(),
        }
    }
}

impl<R: Rig> CurrentAmplifier for Deferred<R> {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        self.next = SetPoint::default();
        self.rig.begin_enable()
    }

    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        self.rig.poll_enable()
    }

    /// Sends the set-point of the last tick, and stores this one.
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        let given_a = self.rig.command(self.next.requested_a)?;
        if given_a != self.next.accepted_a {
            return Err(OTHER_CURRENT);
        }
        self.next = SetPoint {
            requested_a: current_a,
            accepted_a: self.rig.rounded_a(current_a),
        };
        Ok(self.next.accepted_a)
    }

    fn rounded_a(&self, current_a: f64) -> f64 {
        self.rig.rounded_a(current_a)
    }

    /// Zero current at once: the stored set-point is discarded.
    fn disable(&mut self) {
        self.next = SetPoint::default();
        self.rig.disable();
    }

    fn status(&self) -> AmplifierStatus {
        self.rig.status()
    }

    fn actual_current_a(&self) -> Option<f64> {
        self.rig.actual_current_a()
    }

    fn begin_reset(&mut self) -> Result<(), DeviceError> {
        self.rig.begin_reset()
    }

    fn poll_reset(&mut self) -> Poll<Result<(), DeviceError>> {
        self.rig.poll_reset()
    }

    fn explain(&self, code: u32) -> Option<FaultText> {
        self.rig.explain(code)
    }
}

impl<R: Rig> DisplacementProbe for Deferred<R> {
    fn latest(&mut self, now: Tick) -> Reading {
        self.rig.latest(now)
    }
}
