//! The scales in the driver of a serial probe, which are between the interlocks and the device.

use super::{CalibrationSettings, Config, MIN_PROBE_GAIN, SerialDevice, is_near_one};
use bench_base::finding::Finding;

const GAIN: &str = "probe.device.mounting.gain";
/// Rounding of the ends of a range, as a ratio of the travel limit.
const ROUNDING: f64 = 1e-9;

/// Errors in the mounting and the range of a serial probe.
pub(super) fn mounting(config: &Config) -> Vec<Finding> {
    let Some(serial) = config.probe.device.serial() else {
        return Vec::new();
    };
    let gain = serial.mounting.gain;
    let errors = [
        vanishing_gain(gain),
        unconfirmed_gain(gain, &config.calibration),
        unmeasured_travel(serial, config.interlock.soft_limit_m),
    ];
    errors.into_iter().flatten().collect()
}

fn vanishing_gain(gain: f64) -> Option<Finding> {
    let what = format!(
        "is {gain:e}, between -0.001 and 0.001, so all positions would be near 0; set 1, or -1 for a reversed probe"
    );
    (gain.abs() < MIN_PROBE_GAIN).then(|| Finding::new(GAIN, what))
}

/// The gain has the limits of that of a calibration.
fn unconfirmed_gain(gain: f64, calibration: &CalibrationSettings) -> Option<Finding> {
    let is_accepted = is_near_one(gain.abs()) || calibration.confirming_name().is_some();
    let what = format!(
        "is {gain}, outside 0.75 to 1.25, and outside -1.25 to -0.75 of a reversed probe; set 1 or -1 and the range of the probe as in its data sheet, or set calibration.accepted_by = \"NAME\" to confirm the value with your name"
    );
    (!is_accepted).then(|| Finding::new(GAIN, what))
}

/// The range of a probe is its scale: with one that is too small all positions are too small.
fn unmeasured_travel(serial: &SerialDevice, soft_m: f64) -> Option<Finding> {
    let [lowest_m, highest_m] = serial.stage_range_m()?;
    let needed_m = soft_m * (1.0 - ROUNDING);
    let is_measured = lowest_m <= -needed_m && needed_m <= highest_m;
    let (low_mm, high_mm, soft_mm) = (1e3 * lowest_m, 1e3 * highest_m, 1e3 * soft_m);
    let what = format!(
        "and the range of the probe let it measure {low_mm:.6} to {high_mm:.6} mm of the stage, which does not contain the permitted travel of +-{soft_mm} mm; set the range as in the data sheet of the probe and offset_m so that the middle of the range is position 0, or lower interlock.soft_limit_m"
    );
    (!is_measured).then(|| Finding::new("probe.device.mounting", what))
}
