//! A rig with injected faults.
use std::ops::Range;
use std::task::Poll;

use bench_hal::{
    AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, Reading, Rig, Tick, Validity,
};

/// An injected fault.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The reading has this validity.
    Validity(Validity),
    /// The reading has this position, in metres.
    Position(f64),
    /// This offset is added to the position, in metres.
    Offset(f64),
    /// The reading has this age, in nanoseconds.
    Age(u64),
    /// The reading repeats the sequence number of the previous one.
    RepeatedSample,
    /// New sequence numbers with a constant position.
    Stuck,
    /// The amplifier reports a fault with this code.
    AmplifierFault(u32),
    /// The amplifier reports itself disabled.
    ReportsDisabled,
    /// The amplifier refuses a command with this code.
    RefusedCommand(i64),
    /// The amplifier refuses to be enabled, with this code.
    RefusedEnable(i64),
    /// The amplifier is still being enabled.
    PendingEnable,
    /// The amplifier fails while it is being enabled, with this code.
    FailedEnable(i64),
    /// The amplifier is still resetting its fault.
    PendingClear,
    /// The amplifier keeps its fault at the end of the reset.
    FailedClear,
    /// The amplifier refuses to clear its fault.
    RefusedClear,
    /// The amplifier returns this current from every command, in amperes.
    ReturnedCurrent(f64),
    /// The measured current is the last command plus this offset, in amperes.
    MeasuredOffset(f64),
}

/// A rig with its faults, each in a range of ticks.
pub struct FaultyRig<R> {
    /// The rig without faults.
    pub inner: R,
    /// Each fault with its ticks.
    pub faults: Vec<(Range<u64>, Fault)>,
    now: Option<u64>,
    last: Reading,
    commanded_a: f64,
}

impl<R: Rig> FaultyRig<R> {
    pub fn new(inner: R, faults: &[(Range<u64>, Fault)]) -> Self {
        FaultyRig {
            inner,
            faults: faults.to_vec(),
            now: None,
            last: Reading::default(),
            commanded_a: 0.0,
        }
    }

    /// The first fault of the tick that `wanted` selects.
    fn find<T>(&self, tick: u64, wanted: impl Fn(&Fault) -> Option<T>) -> Option<T> {
        self.faults
            .iter()
            .filter(|(when, _)| when.contains(&tick))
            .find_map(|(_, fault)| wanted(fault))
    }

    fn now(&self) -> u64 {
        self.now.unwrap_or_default()
    }
}

fn refusal(code: i64) -> DeviceError {
    DeviceError {
        what: "the amplifier refuses",
        remedy: "this fault is injected by a test",
        code,
    }
}

impl<R: Rig> CurrentAmplifier for FaultyRig<R> {
    /// The loop judges the reading of the tick before it enables the amplifier.
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        match self.find(self.now(), |fault| {
            if let Fault::RefusedEnable(code) = fault {
                Some(*code)
            } else {
                None
            }
        }) {
            Some(code) => Err(refusal(code)),
            None => self.inner.begin_enable(),
        }
    }

    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        let result = self.find(self.now(), |fault| match fault {
            Fault::PendingEnable => Some(Poll::Pending),
            Fault::FailedEnable(code) => Some(Poll::Ready(Err(refusal(*code)))),
            _ => None,
        });
        result.unwrap_or_else(|| self.inner.poll_enable())
    }

    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        self.commanded_a = current_a;
        if let Some(code) = self.find(self.now(), |fault| {
            if let Fault::RefusedCommand(code) = fault {
                Some(*code)
            } else {
                None
            }
        }) {
            return Err(refusal(code));
        }
        let inner_a = self.inner.command(current_a)?;
        let returned_a = self.find(self.now(), |fault| {
            if let Fault::ReturnedCurrent(a) = fault {
                Some(*a)
            } else {
                None
            }
        });
        Ok(returned_a.unwrap_or(inner_a))
    }

    fn disable(&mut self) {
        self.inner.disable();
    }

    fn actual_current_a(&self) -> Option<f64> {
        let offset_a = |fault: &Fault| {
            if let Fault::MeasuredOffset(a) = fault {
                Some(*a)
            } else {
                None
            }
        };
        self.find(self.now(), offset_a)
            .map(|offset_a| self.commanded_a + offset_a)
    }

    /// The loop processes requests before it reads the probe, so the tick is the one after the last reading.
    fn begin_reset(&mut self) -> Result<(), DeviceError> {
        let tick = self.now.map_or(0, |now| now + 1);
        let refused = self.find(tick, |fault| {
            (*fault == Fault::RefusedClear).then_some(refusal(5))
        });
        refused.map_or(Ok(()), Err)
    }

    fn poll_reset(&mut self) -> Poll<Result<(), DeviceError>> {
        let tick = self.now.map_or(0, |now| now + 1);
        let result = self.find(tick, |fault| match fault {
            Fault::PendingClear => Some(Poll::Pending),
            Fault::FailedClear => Some(Poll::Ready(Err(refusal(6)))),
            _ => None,
        });
        result.unwrap_or(Poll::Ready(Ok(())))
    }

    fn status(&self) -> AmplifierStatus {
        let status = self.find(self.now(), |fault| match fault {
            Fault::AmplifierFault(code) => Some(AmplifierStatus::Fault(*code)),
            Fault::ReportsDisabled => Some(AmplifierStatus::Disabled),
            _ => None,
        });
        status.unwrap_or(self.inner.status())
    }
}

impl<R: Rig> DisplacementProbe for FaultyRig<R> {
    fn latest(&mut self, now: Tick) -> Reading {
        let mut reading = self.inner.latest(now);
        for (_, fault) in self
            .faults
            .iter()
            .filter(|(when, _)| when.contains(&now.number))
        {
            match *fault {
                Fault::Validity(validity) => reading.validity = validity,
                Fault::Position(position_m) => reading.position_m = position_m,
                Fault::Offset(offset_m) => reading.position_m += offset_m,
                Fault::Age(age_ns) => reading.age_ns = age_ns,
                Fault::RepeatedSample => reading.sequence = self.last.sequence,
                Fault::Stuck => reading.position_m = self.last.position_m,
                Fault::AmplifierFault(_)
                | Fault::ReportsDisabled
                | Fault::RefusedCommand(_)
                | Fault::RefusedEnable(_)
                | Fault::ReturnedCurrent(_)
                | Fault::MeasuredOffset(_)
                | Fault::PendingEnable
                | Fault::FailedEnable(_)
                | Fault::PendingClear
                | Fault::FailedClear
                | Fault::RefusedClear => {}
            }
        }
        self.now = Some(now.number);
        self.last = reading;
        reading
    }
}
