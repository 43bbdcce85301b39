//! The file of a calibration, and whether it may be used.

use std::path::Path;
use std::time::{Duration, SystemTime};

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use crate::config::{self, CalibrationSettings, ConfigError, OnInvalidCalibration};

/// What `bench calibrate` found, with date and devices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "bench calibration")]
pub struct Calibration {
    /// When it was made (RFC 3339).
    pub made: String,
    /// The recording that it was made from.
    pub recording: String,
    /// The amplifier.
    pub amplifier: AmplifierCalibration,
    /// The probe.
    pub probe: ProbeCalibration,
    /// Both together, with motor and springs.
    pub chain: ChainCalibration,
}

/// The amplifier: it gives gain (command) + offset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AmplifierCalibration {
    /// Which device, as it says itself.
    pub device: String,
    /// Amperes that flow per ampere commanded, by the amplifier's own measurement; 1 where it makes none.
    #[schemars(range(min = 0.01, max = 100.0))]
    pub current_gain: f64,
    /// Amperes that flow at the command zero, by the amplifier's own measurement; 0 where it makes none.
    #[schemars(range(min = -100.0, max = 100.0))]
    pub current_offset_a: f64,
    /// Whether the amplifier measures its current.
    pub measures_current: bool,
}

/// The probe: position = gain (reading) + offset.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ProbeCalibration {
    /// Which device, as far as it can be told.
    pub device: String,
    /// Metres per metre of reading, with the sign that makes positive current move the stage positively.
    #[schemars(range(min = -1000.0, max = 1000.0))]
    pub gain: f64,
    /// Metres to add: the stage rests at zero where no current flows.
    #[schemars(range(min = -1.0, max = 1.0))]
    pub offset_m: f64,
    /// RMS of the reading at rest in metres.
    #[schemars(range(min = 0.0, max = 1.0))]
    pub noise_rms_m: f64,
}

/// Amplifier, motor, springs and probe together, before the correction.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ChainCalibration {
    /// Metres of reading per ampere commanded.
    pub compliance_m_per_a: f64,
    /// Its standard deviation.
    pub compliance_sigma_m_per_a: f64,
    /// The same by the model.
    pub model_m_per_a: f64,
    /// Largest distance of a level from the straight line, as a ratio of the whole travel.
    pub nonlinearity_ratio: f64,
    /// Largest distance between the way up and the way down, as a ratio of the whole travel.
    pub hysteresis_ratio: f64,
    /// From a command to the position that its reading shows, in seconds, by the phases of a chirp.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay_s: Option<f64>,
    /// Its standard deviation in seconds.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub delay_sigma_s: Option<f64>,
}

/// A calibration that may not be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// The file is not a calibration.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Its date is none.
    #[error(
        "calibration {file}: made = {made:?} is not a date; make it anew with `bench calibrate`"
    )]
    Date {
        /// The file.
        file: String,
        /// What stands there.
        made: String,
    },
    /// It cannot be written down.
    #[error("the calibration cannot be written as TOML: {0}")]
    Text(String),
    /// Too old, or of other devices.
    #[error(
        "calibration {file}: {why}; make it anew with `bench calibrate`, or {setting} = \"warn\"; nothing moved"
    )]
    Unfit {
        /// The file.
        file: String,
        /// What is wrong.
        why: String,
        /// The setting that decides.
        setting: &'static str,
    },
}

/// The calibration of a run, and warnings about it; nothing where none is configured.
pub fn load_calibration(
    settings: &CalibrationSettings,
    amplifier: &str,
    probe: &str,
    now: SystemTime,
) -> Result<Option<(Calibration, Vec<String>)>, CalibrationError> {
    let Some(file) = &settings.file else {
        return Ok(None);
    };
    let text = config::text_of_file(file, "calibration")?;
    let calibration: Calibration = config::typed(file, &text)?;
    let complaints = [
        (
            expired(file, &calibration, settings.valid_days, now)?,
            settings.when_expired,
            "calibration.when_expired",
        ),
        (
            foreign(&calibration, amplifier, probe),
            settings.when_foreign,
            "calibration.when_foreign",
        ),
    ];
    let mut warnings = Vec::new();
    for (complaint, then, setting) in complaints {
        match (complaint, then) {
            (None, _) => {}
            (Some(why), OnInvalidCalibration::Warn) => {
                warnings.push(format!("calibration {file}: {why}"))
            }
            (Some(why), OnInvalidCalibration::Refuse) => {
                return Err(CalibrationError::Unfit {
                    file: file.clone(),
                    why,
                    setting,
                });
            }
        }
    }
    Ok(Some((calibration, warnings)))
}

fn expired(
    file: &str,
    calibration: &Calibration,
    valid_days: f64,
    now: SystemTime,
) -> Result<Option<String>, CalibrationError> {
    let wrong = || CalibrationError::Date {
        file: file.to_string(),
        made: calibration.made.clone(),
    };
    let made = humantime::parse_rfc3339(&calibration.made).map_err(|_| wrong())?;
    let age = now.duration_since(made).unwrap_or(Duration::ZERO);
    let days = age.as_secs_f64() / 86_400.0;
    Ok((days > valid_days)
        .then(|| format!("it was made {days:.0} days ago, calibration.valid_days is {valid_days}")))
}

fn foreign(calibration: &Calibration, amplifier: &str, probe: &str) -> Option<String> {
    let pairs = [
        ("amplifier", &calibration.amplifier.device, amplifier),
        ("probe", &calibration.probe.device, probe),
    ];
    let other = pairs.into_iter().find(|(_, theirs, ours)| theirs != ours);
    other.map(|(what, theirs, ours)| {
        format!("it is of another {what}: {theirs:?}, this one is {ours:?}")
    })
}

impl Calibration {
    /// The text of the file.
    pub fn to_toml(&self) -> Result<String, CalibrationError> {
        toml::to_string(self).map_err(|e| CalibrationError::Text(e.to_string()))
    }

    /// Writes the file; one that exists is never overwritten.
    pub fn write_new(&self, path: &Path) -> std::io::Result<()> {
        use std::io::Write;
        let text = self.to_toml().map_err(std::io::Error::other)?;
        let head = "# Made by `bench calibrate`. Name it in a configuration: [calibration] file = \"this file\".\n";
        std::fs::File::create_new(path)?.write_all(format!("{head}{text}").as_bytes())
    }
}
