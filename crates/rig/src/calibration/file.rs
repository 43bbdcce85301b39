//! The file of a calibration, and the check whether it may be used.

use std::path::Path;
use std::time::{Duration, SystemTime};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use bench_config::{
    CalibrationSettings, Config, ConfigError, MIN_PROBE_GAIN, OnInvalidCalibration, is_near_one,
};

/// The result of `bench calibrate`, with the date and the devices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "bench calibration")]
pub struct Calibration {
    /// When it was made (RFC 3339).
    pub made: String,
    /// The recording of the staircase.
    pub recording: String,
    /// The amplifier.
    pub amplifier: AmplifierCalibration,
    /// The probe.
    pub probe: ProbeCalibration,
    /// The whole chain, with motor and springs.
    pub chain: ChainCalibration,
}

/// The amplifier: current = gain * command + offset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmplifierCalibration {
    /// Identity, as the device reports it.
    pub device: String,
    /// Measured current per commanded current; 1 if the amplifier does not measure its current.
    #[schemars(range(min = 0.01, max = 100.0))]
    pub current_gain: f64,
    /// Measured current in amperes at command zero; 0 if the amplifier does not measure its current.
    #[schemars(range(min = -100.0, max = 100.0))]
    pub current_offset_a: f64,
    /// Whether the amplifier measures its current.
    pub measures_current: bool,
}

/// The probe: position = gain * reading + offset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeCalibration {
    /// Identity, as far as it is known.
    pub device: String,
    /// Metres per metre of reading; its sign makes the displacement by a positive current positive.
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub gain: f64,
    /// Offset in metres, for zero displacement without current.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub offset_m: f64,
    /// RMS of the reading at rest in metres.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub noise_rms_m: f64,
}

/// Amplifier, motor, springs and probe, before the correction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChainCalibration {
    /// Metres of reading per ampere commanded.
    pub compliance_m_per_a: f64,
    /// Its standard deviation.
    pub compliance_sigma_m_per_a: f64,
    /// The compliance of the model.
    pub model_m_per_a: f64,
    /// Largest deviation from the straight line, as a ratio of the travel.
    pub nonlinearity_ratio: f64,
    /// Largest difference between the way up and the way down, as a ratio of the travel.
    pub hysteresis_ratio: f64,
    /// Delay from a command to its reading in seconds, from the phase of a chirp.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay_s: Option<f64>,
    /// Its standard deviation in seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay_sigma_s: Option<f64>,
}

/// A value of a calibration with which no run is made. Its text ends with the remedy.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrationDefect {
    /// A gain of the probe with which no position could be measured.
    #[error(
        "probe.gain = {gain:e} is between -0.001 and 0.001, so all positions would be near 0; check scale and wiring of the probe and repeat `bench calibrate`"
    )]
    NoProbeGain {
        /// Its value.
        gain: f64,
    },
    /// A gain of the amplifier so far from 1 that an error is more likely.
    #[error(
        "amplifier.current_gain = {gain:.4} is outside 0.75 to 1.25; check scale and wiring of the amplifier and repeat `bench calibrate`, or set calibration.accepted_by = \"NAME\" to confirm the value with your name"
    )]
    CurrentGain {
        /// Its value.
        gain: f64,
    },
    /// A gain of the probe so far from 1 or -1 that an error is more likely.
    #[error(
        "probe.gain = {gain:.4} is outside 0.75 to 1.25, and outside -1.25 to -0.75 of a reversed probe; check scale and range of the probe and repeat `bench calibrate`, or set calibration.accepted_by = \"NAME\" to confirm the value with your name"
    )]
    ProbeGain {
        /// Its value.
        gain: f64,
    },
    /// An offset of the current that the check of the measured current cannot distinguish from a drive that does not follow.
    #[error(
        "amplifier.current_offset_a = {offset_a:.4} A exceeds interlock.current_error_a = {limit_a} A; correct the offset of the drive and repeat `bench calibrate`"
    )]
    CurrentOffset {
        /// The offset.
        offset_a: f64,
        /// The limit.
        limit_a: f64,
    },
}

/// A calibration that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CalibrationError {
    /// The file is not a calibration.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// The date cannot be read.
    #[error(
        "calibration {file}: the key `made` = {made:?} is not a date (RFC 3339); repeat `bench calibrate`"
    )]
    Date {
        /// The file.
        file: String,
        /// The text in place of the date.
        made: String,
    },
    /// The calibration cannot be written.
    #[error("the calibration cannot be written as TOML: {0}; report this with the configuration")]
    Text(String),
    /// A value with which no run is made.
    #[error("calibration {file}: {defect}; nothing was moved")]
    Defect {
        /// The file.
        file: String,
        /// The value.
        defect: CalibrationDefect,
    },
    /// Too old, or of other devices.
    #[error(
        "calibration {file}: {why}; repeat `bench calibrate`, or set {setting} = \"warn\"; nothing was moved"
    )]
    Unfit {
        /// The file.
        file: String,
        /// The reason.
        why: String,
        /// The setting that decides.
        setting: &'static str,
    },
}

/// The identities of the devices, as far as they are known. An unknown one is not compared with a calibration.
#[derive(Clone, Copy, Debug)]
pub struct KnownDevices<'a> {
    /// The amplifier, as it reports itself.
    pub amplifier: Option<&'a str>,
    /// The probe.
    pub probe: Option<&'a str>,
}

/// A calibration from its file, checked.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedCalibration {
    /// Path of the file.
    pub file: String,
    /// The calibration.
    pub calibration: Calibration,
    /// Defects that the configuration accepts with a warning.
    pub warnings: Vec<String>,
}

/// The configured calibration; `None` if none is configured.
///
/// # Errors
/// If the file cannot be used, contains a value with which no run is made, or belongs to other devices.
pub fn load_calibration(
    config: &Config,
    devices: KnownDevices,
    now: SystemTime,
) -> Result<Option<LoadedCalibration>, CalibrationError> {
    let settings = &config.calibration;
    let Some(file) = &settings.file else {
        return Ok(None);
    };
    let calibration = read(file, config)?;
    let expired = expired(file, &calibration, settings.valid_days, now)?;
    let other_device = other_device(&calibration, devices);
    Ok(Some(LoadedCalibration {
        warnings: warnings(file, settings, expired, other_device)?,
        file: file.clone(),
        calibration,
    }))
}

/// The warnings for the defects of a calibration that the configuration accepts.
fn warnings(
    file: &str,
    settings: &CalibrationSettings,
    expired: Option<String>,
    other_device: Option<String>,
) -> Result<Vec<String>, CalibrationError> {
    let expired = Check {
        file,
        setting: "calibration.when_expired",
        reaction: settings.when_expired,
        defect: expired,
    };
    let other_device = Check {
        file,
        setting: "calibration.when_other_devices",
        reaction: settings.when_other_devices,
        defect: other_device,
    };
    let warnings = [expired.warning()?, other_device.warning()?];
    Ok(warnings.into_iter().flatten().collect())
}

/// The calibration in a file, if its values allow a run.
fn read(file: &str, config: &Config) -> Result<Calibration, CalibrationError> {
    let text = bench_settings::text_of_file(file, "calibration")?;
    let calibration: Calibration = bench_settings::typed(file, &text)?;
    match calibration.check(&config.calibration, config.interlock.current_error_a) {
        Ok(()) => Ok(calibration),
        Err(defect) => Err(CalibrationError::Defect {
            file: file.into(),
            defect,
        }),
    }
}

/// A check of a calibration, and the configured reaction to a defect.
struct Check<'a> {
    file: &'a str,
    setting: &'static str,
    reaction: OnInvalidCalibration,
    defect: Option<String>,
}

impl Check<'_> {
    /// The warning for a defect, if there is one; the error if the calibration is refused.
    fn warning(self) -> Result<Option<String>, CalibrationError> {
        let (file, setting) = (self.file, self.setting);
        match (self.defect, self.reaction) {
            (None, _) => Ok(None),
            (Some(why), OnInvalidCalibration::Warn) => {
                Ok(Some(format!("calibration {file}: {why}")))
            }
            (Some(why), OnInvalidCalibration::Refuse) => Err(CalibrationError::Unfit {
                file: file.into(),
                why,
                setting,
            }),
        }
    }
}

fn expired(
    file: &str,
    calibration: &Calibration,
    valid_days: f64,
    now: SystemTime,
) -> Result<Option<String>, CalibrationError> {
    let made = &calibration.made;
    let made = humantime::parse_rfc3339(made).map_err(|_| CalibrationError::Date {
        file: file.into(),
        made: made.clone(),
    })?;
    let age = now.duration_since(made).unwrap_or(Duration::ZERO);
    let days = age.as_secs_f64() / 86_400.0;
    if days <= valid_days {
        return Ok(None);
    }
    Ok(Some(format!(
        "it was made {days:.0} days ago, and calibration.valid_days is {valid_days}"
    )))
}

fn other_device(calibration: &Calibration, devices: KnownDevices) -> Option<String> {
    let (amplifier, probe) = (&calibration.amplifier.device, &calibration.probe.device);
    let mut pairs = [
        ("amplifier", amplifier, devices.amplifier),
        ("probe", probe, devices.probe),
    ]
    .into_iter();
    pairs.find_map(|(kind, calibrated, connected)| {
        let connected = connected.filter(|connected| connected != calibrated)?;
        Some(format!(
            "it was made for the {kind} {calibrated:?}, but {connected:?} is connected"
        ))
    })
}

impl Calibration {
    /// Refuses gains outside 1 +- 0.25 that nobody confirmed with a name, and an offset of the current beyond `current_error_a`,
    /// the limit within which the measured current must follow the commands. The gain of a reversed probe is near -1.
    pub fn check(
        &self,
        settings: &CalibrationSettings,
        current_error_a: f64,
    ) -> Result<(), CalibrationDefect> {
        let gain = self.probe.gain;
        if gain.abs() < MIN_PROBE_GAIN {
            return Err(CalibrationDefect::NoProbeGain { gain });
        }
        if settings.confirming_name().is_none() {
            self.check_gains()?;
        }
        let (offset_a, limit_a) = (self.amplifier.current_offset_a, current_error_a);
        if offset_a.abs() <= limit_a {
            Ok(())
        } else {
            Err(CalibrationDefect::CurrentOffset { offset_a, limit_a })
        }
    }

    fn check_gains(&self) -> Result<(), CalibrationDefect> {
        let (current, probe) = (self.amplifier.current_gain, self.probe.gain);
        if !is_near_one(current) {
            return Err(CalibrationDefect::CurrentGain { gain: current });
        }
        if is_near_one(probe.abs()) {
            Ok(())
        } else {
            Err(CalibrationDefect::ProbeGain { gain: probe })
        }
    }

    /// The text of the file.
    pub fn to_toml(&self) -> Result<String, CalibrationError> {
        toml::to_string(self).map_err(|e| CalibrationError::Text(e.to_string()))
    }

    /// Writes a new file; an existing file is not overwritten.
    pub fn write_new(&self, path: &Path) -> std::io::Result<()> {
        use std::io::Write;
        let text = self.to_toml().map_err(std::io::Error::other)?;
        let head = "# Written by `bench calibrate`. To use it, name it in a configuration: [calibration] file = \"this file\".\n";
        std::fs::File::create_new(path)?.write_all(format!("{head}{text}").as_bytes())
    }
}
