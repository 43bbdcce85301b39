//! A rig whose amplifier and probe are corrected by a calibration.

use bench_hal::{
    AmplifierStatus, CurrentAmplifier, DeviceError, DisplacementProbe, FaultText, Reading, Rig,
    Tick,
};

use super::Calibration;

/// Corrects commands and readings: the loop commands true amperes, and reads metres from the rest position.
pub struct CalibratedRig {
    rig: Box<dyn Rig>,
    current_gain: f64,
    current_offset_a: f64,
    gain: f64,
    offset_m: f64,
}

impl CalibratedRig {
    /// `rig` with the corrections of `calibration`.
    pub fn new(rig: Box<dyn Rig>, calibration: &Calibration) -> Self {
        CalibratedRig {
            rig,
            current_gain: calibration.amplifier.current_gain,
            current_offset_a: calibration.amplifier.current_offset_a,
            gain: calibration.probe.gain,
            offset_m: calibration.probe.offset_m,
        }
    }
}

impl CurrentAmplifier for CalibratedRig {
    fn enable(&mut self) -> Result<(), DeviceError> {
        self.rig.enable()
    }

    /// Commands the set-point that gives `current_a`, and returns the resulting current.
    fn command(&mut self, current_a: f64) -> Result<f64, DeviceError> {
        let accepted_a = self
            .rig
            .command((current_a - self.current_offset_a) / self.current_gain)?;
        Ok(accepted_a * self.current_gain + self.current_offset_a)
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

    fn reset_fault(&mut self) -> Result<(), DeviceError> {
        self.rig.reset_fault()
    }

    fn explain(&self, code: u32) -> Option<FaultText> {
        self.rig.explain(code)
    }
}

impl DisplacementProbe for CalibratedRig {
    fn latest(&mut self, now: Tick) -> Reading {
        let reading = self.rig.latest(now);
        Reading {
            position_m: self.gain * reading.position_m + self.offset_m,
            ..reading
        }
    }
}
