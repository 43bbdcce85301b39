//! The configured calibration: whether the runs would use it on the devices.

use std::time::SystemTime;

use super::drive::DriveFigures;
use super::finding::{Finding, Subject};
use super::runs;
use bench_config::{AmplifierDevice, Config};
use bench_rig::calibration::{KnownDevices, LoadedCalibration, load_calibration};
use bench_rig::devices::canopen::identity_text;
use bench_rig::devices::{SIMULATED, probe, vesc};

/// Evaluates the calibration; `drive` is what a CANopen drive reported. No finding without a calibration.
pub fn findings(config: &Config, drive: Option<&DriveFigures>) -> Vec<Finding> {
    let amplifier = amplifier_identity(&config.amplifier.device, drive);
    let probe = probe::identity(&config.probe.device);
    let devices = KnownDevices {
        amplifier: amplifier.as_deref(),
        probe: Some(&probe),
    };
    match load_calibration(config, devices, SystemTime::now()) {
        Ok(None) => Vec::new(),
        Ok(Some(loaded)) => accepted(loaded, amplifier.is_some()),
        Err(error) => vec![runs::refused(
            Subject::Calibration,
            &error.to_string(),
            "correct calibration.file, or repeat `bench calibrate`",
        )],
    }
}

/// The identity of the amplifier, as a run compares it; `None` if the drive did not answer.
fn amplifier_identity(device: &AmplifierDevice, drive: Option<&DriveFigures>) -> Option<String> {
    match device {
        AmplifierDevice::Simulated(_) => Some(SIMULATED.into()),
        AmplifierDevice::Canopen(_) => drive.map(|drive| identity_text(drive.identity)),
        AmplifierDevice::Vesc(device) => Some(vesc::identity(device)),
    }
}

fn accepted(loaded: LoadedCalibration, is_amplifier_known: bool) -> Vec<Finding> {
    let warning = |what| Subject::Calibration.warning(what, "repeat `bench calibrate`");
    let mut findings: Vec<Finding> = loaded.warnings.into_iter().map(warning).collect();
    let (file, made) = (loaded.file, loaded.calibration.made);
    findings.push(if is_amplifier_known {
        Subject::Calibration.ok(format!("{file}, made {made}"))
    } else {
        Subject::Calibration.note(
            format!("{file}, made {made}: not checked whether it belongs to the amplifier"),
            "correct the failures of the amplifier, then repeat `bench doctor`",
        )
    });
    findings
}
