//! The simulated rig with the faults of the schedule.

use std::task::Poll;
use std::time::Duration;

use bench_hal::{
    AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, FaultText, Reading, Tick,
};
use bench_rig::simulated::SimulatedRig;
use bench_rt::thread::Pace;
use bench_test_support::faulty_rig::FaultyRig;

use super::faults::{Injection, Period, Schedule};

/// The first measurement of the probe: its count of 32 bits wraps in the first second.
const FIRST_SEQUENCE: u32 = u32::MAX - 1000;

/// The simulated rig. Its probe counts with 32 bits.
pub struct ScheduledRig {
    rig: FaultyRig<SimulatedRig>,
    schedule: Schedule,
    period: Period,
    pace: Pace,
}

impl ScheduledRig {
    /// The rig without faults in the past.
    pub fn new(rig: SimulatedRig, schedule: Schedule, pace: Pace) -> ScheduledRig {
        let mut scheduled = ScheduledRig {
            rig: FaultyRig::new(rig, &[]),
            schedule,
            period: schedule.period(0),
            pace,
        };
        // Later faults find room in the list, so that the tick does not allocate.
        scheduled.rig.faults.reserve(1);
        scheduled.prepare_faults();
        scheduled
    }

    fn prepare_faults(&mut self) {
        self.rig.faults.clear();
        match self.period.case.injection {
            Injection::Rig(fault) | Injection::Enabling(fault) | Injection::Both(fault, _) => {
                self.rig.faults.push((self.period.fault.clone(), fault));
            }
            Injection::Program(_) | Injection::MissedTicks(_) => {}
        }
    }

    /// In real time, ticks are missed because a device blocks the loop; in virtual pace the clock skips them.
    fn miss_ticks(&self, now: Tick) {
        if let (Injection::MissedTicks(ticks), Pace::Realtime) =
            (self.period.case.injection, self.pace)
            && now.number == self.period.fault.start
            && let Some(period_ns) = now.scheduled_ns.checked_div(now.number)
        {
            std::thread::sleep(Duration::from_nanos(u64::from(ticks) * period_ns));
        }
    }
}

impl DisplacementProbe for ScheduledRig {
    fn latest(&mut self, now: Tick) -> Reading {
        let number = self.schedule.number(now.number);
        if number != self.period.number {
            self.period = self.schedule.period(number);
            self.prepare_faults();
        }
        self.miss_ticks(now);
        let reading = self.rig.latest(now);
        Reading {
            sequence: u64::from(FIRST_SEQUENCE.wrapping_add(reading.sequence as u32)),
            ..reading
        }
    }
}

impl CurrentAmplifier for ScheduledRig {
    fn begin_enable(&mut self) -> Result<(), DeviceError> {
        self.rig.begin_enable()
    }
    fn poll_enable(&mut self) -> Poll<Result<(), DeviceError>> {
        self.rig.poll_enable()
    }
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        self.rig.command(current_a)
    }
    fn disable(&mut self) {
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
