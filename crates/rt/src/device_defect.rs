//! Whether the devices can be used, for other threads, also between two runs.

use std::fmt;
use std::sync::atomic::{AtomicU8, Ordering};

use bench_hal::AmplifierStatus;

use super::trip::Trip;

/// A device that cannot be used.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[non_exhaustive]
pub enum DeviceDefect {
    /// The amplifier reports a fault, or does not answer.
    Amplifier,
    /// The probe sends no valid reading.
    Probe,
}

impl DeviceDefect {
    /// What status of the amplifier and check of the reading say about the devices. A position beyond a limit is not a defect.
    pub fn of(status: AmplifierStatus, reading: Result<(), Trip>) -> Option<DeviceDefect> {
        match (status, reading) {
            (AmplifierStatus::Fault(_), _) => Some(DeviceDefect::Amplifier),
            (_, Err(Trip::ProbeInvalid | Trip::ProbeStale { .. })) => Some(DeviceDefect::Probe),
            (_, Ok(()) | Err(_)) => None,
        }
    }
}

impl fmt::Display for DeviceDefect {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            DeviceDefect::Amplifier => {
                "the amplifier reports a fault or does not answer; check its cable and its supply, and examine it with `bench doctor`; --clear-fault clears a stored fault"
            }
            DeviceDefect::Probe => {
                "the probe sends no valid reading; check its cable, target and range"
            }
        })
    }
}

/// The defect in the last tick. Written by the loop without waiting.
#[derive(Debug, Default)]
pub struct DefectCell(AtomicU8);

const AMPLIFIER: u8 = 1;
const PROBE: u8 = 2;

impl DefectCell {
    /// The defect in the last tick.
    pub fn get(&self) -> Option<DeviceDefect> {
        match self.0.load(Ordering::Relaxed) {
            AMPLIFIER => Some(DeviceDefect::Amplifier),
            PROBE => Some(DeviceDefect::Probe),
            _ => None,
        }
    }

    /// Runs in the tick: does not allocate or block.
    pub(super) fn set(&self, defect: Option<DeviceDefect>) {
        let code = match defect {
            None => 0,
            Some(DeviceDefect::Amplifier) => AMPLIFIER,
            Some(DeviceDefect::Probe) => PROBE,
        };
        self.0.store(code, Ordering::Relaxed);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn position_beyond_its_limit_is_no_defect_of_the_probe() {
        let travel = Trip::Travel {
            position_m: 2e-3,
            limit_m: 1e-3,
        };
        let healthy = AmplifierStatus::Disabled;
        assert_eq!(DeviceDefect::of(healthy, Err(travel)), None);
        assert_eq!(DeviceDefect::of(healthy, Ok(())), None);
        let invalid = Err(Trip::ProbeInvalid);
        assert_eq!(
            DeviceDefect::of(healthy, invalid),
            Some(DeviceDefect::Probe)
        );
    }

    #[test]
    fn cell_returns_the_last_defect() {
        let cell = DefectCell::default();
        for defect in [
            Some(DeviceDefect::Amplifier),
            Some(DeviceDefect::Probe),
            None,
        ] {
            cell.set(defect);
            assert_eq!(cell.get(), defect);
        }
    }
}
