//! The correction of commands and readings by a calibration.

use super::Calibration;

/// Linear corrections of amplifier and probe. The loop computes with true amperes, and with metres from the rest position:
///
/// current = `current_gain` * set-point + `current_offset_a`,
/// position = `probe_gain` * reading + `probe_offset_m`.
///
/// The loop applies them itself, above the interlocks: these judge the reading and the set-point of the devices as well.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Correction {
    /// Amperes per ampere of set-point; not zero.
    pub current_gain: f64,
    /// Current in amperes at the set-point zero.
    pub current_offset_a: f64,
    /// Metres per metre of reading.
    pub probe_gain: f64,
    /// Position in metres at the reading zero.
    pub probe_offset_m: f64,
}

impl Correction {
    /// The set-point of the amplifier that gives a current, both in amperes.
    pub fn set_point_a(&self, current_a: f64) -> f64 {
        (current_a - self.current_offset_a) / self.current_gain
    }

    /// The current that a set-point of the amplifier gives, both in amperes.
    pub fn current_a(&self, set_point_a: f64) -> f64 {
        self.current_gain * set_point_a + self.current_offset_a
    }

    /// The position for a reading of the probe, both in metres.
    pub fn position_m(&self, reading_m: f64) -> f64 {
        self.probe_gain * reading_m + self.probe_offset_m
    }
}

impl From<&Calibration> for Correction {
    fn from(calibration: &Calibration) -> Correction {
        Correction {
            current_gain: calibration.amplifier.current_gain,
            current_offset_a: calibration.amplifier.current_offset_a,
            probe_gain: calibration.probe.gain,
            probe_offset_m: calibration.probe.offset_m,
        }
    }
}
