//! A rig that fails when told to.
use std::ops::Range;

use bench_hal::{
    AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, Reading, Rig, Tick, Validity,
};

/// What goes wrong.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fault {
    /// The probe says this of its reading.
    Validity(Validity),
    /// The probe reads this position, in metres.
    Position(f64),
    /// The probe reads so much more than there is, in metres.
    Offset(f64),
    /// The reading has this age, in nanoseconds.
    Age(u64),
    /// The probe hands out an old measurement under its old number.
    RepeatedSample,
    /// New measurements, always of the same position.
    Stuck,
    /// The amplifier has switched itself off with this code.
    AmplifierFault(u32),
    /// The amplifier refuses commands with this code.
    RefusedCommand(i64),
    /// The amplifier cannot be enabled, with this code.
    RefusedEnable(i64),
    /// The amplifier keeps its fault, whoever clears it.
    RefusedClear,
    /// The amplifier says that it gives this current, whatever it was asked for.
    ReturnedCurrent(f64),
    /// The amplifier measures the current that it was asked for last, in amperes, and this much more.
    MeasuredOffset(f64),
}

/// A rig and what goes wrong with it, by tick.
pub struct FaultyRig<R> {
    /// What works.
    pub inner: R,
    /// What fails, when.
    pub faults: Vec<(Range<u64>, Fault)>,
    now: Option<u64>,
    last: Reading,
    asked_a: f64,
}

impl<R: Rig> FaultyRig<R> {
    pub fn new(inner: R, faults: &[(Range<u64>, Fault)]) -> Self {
        FaultyRig {
            inner,
            faults: faults.to_vec(),
            now: None,
            last: Reading::default(),
            asked_a: 0.0,
        }
    }

    /// The faults of the tick under way.
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
        remedy: "it was told to",
        code,
    }
}

impl<R: Rig> CurrentAmplifier for FaultyRig<R> {
    /// Orders are taken before the probe is read: the tick is the one after the last reading.
    fn enable(&mut self) -> Result<(), DeviceError> {
        let tick = self.now.map_or(0, |now| now + 1);
        match self.find(tick, |fault| {
            if let Fault::RefusedEnable(code) = fault {
                Some(*code)
            } else {
                None
            }
        }) {
            Some(code) => Err(refusal(code)),
            None => self.inner.enable(),
        }
    }

    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        self.asked_a = current_a;
        if let Some(code) = self.find(self.now(), |fault| {
            if let Fault::RefusedCommand(code) = fault {
                Some(*code)
            } else {
                None
            }
        }) {
            return Err(refusal(code));
        }
        let given_a = self.inner.command(current_a)?;
        let claimed = self.find(self.now(), |fault| {
            if let Fault::ReturnedCurrent(a) = fault {
                Some(*a)
            } else {
                None
            }
        });
        Ok(claimed.unwrap_or(given_a))
    }

    fn disable(&mut self) {
        self.inner.disable();
    }

    fn actual_current_a(&self) -> Option<f64> {
        let beyond_a = |fault: &Fault| {
            if let Fault::MeasuredOffset(a) = fault {
                Some(*a)
            } else {
                None
            }
        };
        self.find(self.now(), beyond_a)
            .map(|beyond_a| self.asked_a + beyond_a)
    }

    fn reset_fault(&mut self) -> Result<(), DeviceError> {
        let tick = self.now.map_or(0, |now| now + 1);
        let kept = self.find(tick, |fault| {
            (*fault == Fault::RefusedClear).then_some(refusal(5))
        });
        kept.map_or(Ok(()), Err)
    }

    fn status(&self) -> AmplifierStatus {
        let code = self.find(self.now(), |fault| {
            if let Fault::AmplifierFault(code) = fault {
                Some(*code)
            } else {
                None
            }
        });
        code.map_or(self.inner.status(), AmplifierStatus::Fault)
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
                | Fault::RefusedCommand(_)
                | Fault::RefusedEnable(_)
                | Fault::ReturnedCurrent(_)
                | Fault::MeasuredOffset(_)
                | Fault::RefusedClear => {}
            }
        }
        self.now = Some(now.number);
        self.last = reading;
        reading
    }
}
