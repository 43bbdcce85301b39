//! The files that a configuration names, as a run would use them, checked without opening a device.

use std::time::SystemTime;

use crate::errors::ExperimentError;
use crate::plan::{PlanError, Stage};
use bench_config::Config;
use bench_control::ControllerText;
use bench_excitation::ReferenceContext;
use bench_rig::calibration::{CalibrationError, KnownDevices, load_calibration};
use bench_rig::devices::{SIMULATED, probe};

/// Refuses a configuration whose controller, reference or calibration cannot be used. Returns what needs attention.
pub fn check_named_files(config: &Config) -> Result<Vec<String>, ExperimentError> {
    check_control_files(config)?;
    let mut attention = bench_config::warnings(config);
    attention.extend(check_calibration(config, Stage::of(config))?);
    Ok(attention)
}

fn check_control_files(config: &Config) -> Result<(), PlanError> {
    let (control, servo) = (&config.control, &config.servo);
    ControllerText::find(&control.controller)?.design(servo.rate_hz)?;
    let reference = control.reference.design();
    let Some(text) = reference.text()? else {
        return Ok(());
    };
    let context = ReferenceContext {
        chirp: &config.chirp,
        period_s: servo.period_s(),
        file: Some(&text),
    };
    reference.build(&context)?;
    Ok(())
}

/// Refuses a calibration that a run would refuse. Returns its warnings. The amplifier's identity is not known before it is
/// opened; then a warning states that it was not checked.
pub fn check_calibration(config: &Config, stage: Stage) -> Result<Vec<String>, CalibrationError> {
    let probe = probe::identity(&config.probe.device);
    let devices = match stage {
        Stage::Simulated => KnownDevices {
            amplifier: Some(SIMULATED),
            probe: Some(SIMULATED),
        },
        Stage::Devices => KnownDevices {
            amplifier: None,
            probe: Some(&probe),
        },
    };
    let Some(loaded) = load_calibration(config, devices, SystemTime::now())? else {
        return Ok(Vec::new());
    };
    let mut warnings = loaded.warnings;
    if devices.amplifier.is_none() {
        let file = loaded.file;
        warnings.push(format!(
            "calibration {file}: not checked whether it belongs to the connected amplifier; run `bench doctor` to check it"
        ));
    }
    Ok(warnings)
}
