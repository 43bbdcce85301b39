//! The file of a certificate: what a chirp showed about a rig, and which rig it was.

use std::f64::consts::TAU;
use std::path::Path;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::error::CertificateError;
use super::signs::SignCheck;
use bench_base::input_file::{self, MAX_SETTINGS_BYTES, MAX_TABLE_BYTES};
use bench_identify::modal::FittedMode;
use bench_identify::{Estimate, Frf, frf_csv};

/// Version of the format.
pub(crate) const FORMAT: u32 = 1;

/// What a chirp showed about a rig. The names in JSON must not change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Certificate {
    /// Version of the format.
    pub format: u32,
    /// The program that made it.
    pub program: String,
    /// Wall time at the start of the chirp (RFC 3339, UTC).
    pub made: String,
    /// Days for which it is valid.
    pub valid_days: f64,
    /// File name of the recording.
    pub recording: String,
    /// Identities of the devices.
    pub devices: CertifiedDevices,
    /// Rate and delay of the loop.
    #[serde(rename = "loop")]
    pub servo: CertifiedLoop,
    /// The load of the stage, as configured.
    pub load: CertifiedLoad,
    /// Digests of the settings and of the calibration.
    pub digests: Digests,
    /// The frequency response.
    pub frf: CertifiedResponse,
    /// The fitted modes, lowest frequency first.
    pub modes: Vec<CertifiedMode>,
    /// The signs of the residues beside those of the model.
    pub signs: SignCheck,
    /// The verdict on CNMP zeros.
    pub verdict: CertifiedVerdict,
}

/// Identities of the devices, as in the metadata of the recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CertifiedDevices {
    /// The amplifier.
    pub amplifier: String,
    /// The probe.
    pub probe: String,
    /// Range and mounting of the probe, which are the scale of all positions; `None` for the simulated probe, and in certificates
    /// of older versions.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub probe_scale: Option<String>,
}

/// Rate and delay of a loop.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CertifiedLoop {
    /// Ticks per second.
    pub rate_hz: f64,
    /// Delay from a tick to the output of its command, in periods.
    pub computing_delay_periods: u32,
    /// Mean time from a command to the position in its reading by the configuration, in seconds.
    pub delay_s: f64,
    /// Measured delay beyond it in seconds.
    pub delay_beyond_model_s: Option<f64>,
    /// Its standard deviation.
    pub delay_beyond_model_sigma_s: Option<f64>,
}

/// The load of a stage; `None` for a model without such a setting.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CertifiedLoad {
    /// Static Y displacement in metres.
    pub operating_point_m: Option<f64>,
    /// m2/m3 - 1.
    pub mass_asymmetry: Option<f64>,
}

/// SHA-256 of tables of the settings as TOML, and of the calibration as TOML.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Digests {
    /// The table `[motor]`.
    pub motor: String,
    /// The table `[amplifier]`.
    pub amplifier: String,
    /// The table `[probe]`.
    pub probe: String,
    /// The table `[plant]`. It is a model and not a property of the rig, so that it may be corrected after the chirp.
    pub plant: String,
    /// The calibration in use; `None` if there was none.
    pub calibration: Option<String>,
    /// The configured controller when the certificate was written; `None` if there was none. Another one may close the loop: its
    /// margins are computed from the response.
    #[serde(default)]
    pub controller: Option<String>,
}

/// The file of a frequency response.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CertifiedResponse {
    /// File name, in the folder of the certificate.
    pub file: String,
    /// SHA-256 of the file.
    pub sha256: String,
    /// Number of frequencies.
    pub frequencies: usize,
    /// Lowest frequency in hertz.
    pub from_hz: f64,
    /// Highest frequency in hertz.
    pub to_hz: f64,
}

/// A fitted mode with standard deviations.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct CertifiedMode {
    /// Undamped natural frequency in hertz.
    pub frequency_hz: f64,
    /// Its standard deviation.
    pub frequency_hz_sigma: f64,
    /// Damping ratio.
    pub damping_ratio: f64,
    /// Its standard deviation.
    pub damping_ratio_sigma: f64,
    /// Residue in 1/kg.
    pub residue: f64,
    /// Its standard deviation.
    pub residue_sigma: f64,
    /// `+` or `-`.
    pub sign: char,
}

/// The verdict on CNMP zeros.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CertifiedVerdict {
    /// `detected`, `excluded` or `undecided`.
    pub cnmp: String,
    /// Its reasons.
    pub why: String,
}

/// A certificate and its frequency response as texts, so that they can be sent to another process and attached to a recording.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct CertificateText {
    /// Path of the certificate as the user named it.
    pub name: String,
    /// JSON.
    pub json: String,
    /// The frequency response as CSV.
    pub frf_csv: String,
}

/// A certificate with its frequency response, checked for integrity.
#[derive(Clone, Debug, PartialEq)]
pub struct LoadedCertificate {
    /// The certificate.
    pub certificate: Certificate,
    /// Its frequency response, from current (A) to position (m).
    pub frf: Frf,
}

/// SHA-256 of a text, as 64 hexadecimal digits.
///
/// ```
/// // FIPS 180-2, appendix B.1: the message "abc".
/// let digest = bench_experiment::certificate::sha256("abc");
/// assert_eq!(digest, "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
/// ```
pub fn sha256(text: &str) -> String {
    let digest = Sha256::digest(text.as_bytes());
    digest.iter().map(|byte| format!("{byte:02x}")).collect()
}

impl CertificateText {
    /// Reads a certificate, and its frequency response beside it.
    ///
    /// # Errors
    /// When one of them cannot be read, or the certificate is damaged.
    pub fn read(name: &str) -> Result<CertificateText, CertificateError> {
        let path = Path::new(name);
        let json = input_file::read_text(path, MAX_SETTINGS_BYTES);
        let json = json.map_err(|error| unreadable(name, "the file", &error))?;
        let frf_file = parsed(name, &json)?.frf.file;
        let plain = Path::new(&frf_file).file_name() == Some(frf_file.as_ref());
        if !plain {
            let why = format!(
                "the name {frf_file:?} of its frequency response is not that of a file beside it"
            );
            return Err(damaged(name, why));
        }
        let frf_csv = input_file::read_text(&path.with_file_name(&frf_file), MAX_TABLE_BYTES);
        let frf_csv = frf_csv.map_err(|error| unreadable(name, &frf_file, &error))?;
        Ok(CertificateText {
            name: name.into(),
            json,
            frf_csv,
        })
    }

    /// The certificate with its frequency response.
    ///
    /// # Errors
    /// When one of them is damaged, or the response was changed after the chirp.
    pub fn load(&self) -> Result<LoadedCertificate, CertificateError> {
        let certificate = parsed(&self.name, &self.json)?;
        if sha256(&self.frf_csv) != certificate.frf.sha256 {
            return Err(CertificateError::ChangedResponse {
                file: self.name.clone(),
                frf: certificate.frf.file,
            });
        }
        let frf = frf_csv::from_str(&self.frf_csv);
        let frf = frf.map_err(|error| damaged(&self.name, error.to_string().replace(';', ",")))?;
        if frf.is_empty() {
            Err(damaged(
                &self.name,
                "its response has no frequencies".into(),
            ))
        } else {
            Ok(LoadedCertificate { certificate, frf })
        }
    }
}

impl From<&FittedMode> for CertifiedMode {
    fn from(mode: &FittedMode) -> CertifiedMode {
        let frequency_hz = mode.frequency_hz();
        CertifiedMode {
            frequency_hz: frequency_hz.value,
            frequency_hz_sigma: frequency_hz.sigma,
            damping_ratio: mode.damping_ratio.value,
            damping_ratio_sigma: mode.damping_ratio.sigma,
            residue: mode.residue_per_kg.value,
            residue_sigma: mode.residue_per_kg.sigma,
            sign: mode.sign(),
        }
    }
}

impl From<&CertifiedMode> for FittedMode {
    fn from(mode: &CertifiedMode) -> FittedMode {
        let estimate = |value, sigma| Estimate { value, sigma };
        FittedMode {
            omega_rad_s: estimate(mode.frequency_hz, mode.frequency_hz_sigma).scaled(TAU),
            damping_ratio: estimate(mode.damping_ratio, mode.damping_ratio_sigma),
            residue_per_kg: estimate(mode.residue, mode.residue_sigma),
            residue_imaginary_per_kg: None,
            turned_by_one_more: 0.0,
        }
    }
}

impl CertifiedMode {
    /// Whether JSON can hold all numbers.
    pub(crate) fn is_finite(&self) -> bool {
        let values = [self.frequency_hz, self.damping_ratio, self.residue];
        let sigmas = [
            self.frequency_hz_sigma,
            self.damping_ratio_sigma,
            self.residue_sigma,
        ];
        values
            .iter()
            .chain(&sigmas)
            .all(|number| number.is_finite())
    }
}

impl Certificate {
    /// The text of the file.
    pub fn to_json(&self) -> String {
        // Strings and numbers only, which JSON can hold.
        let json = serde_json::to_string_pretty(self).unwrap_or_default();
        json + "\n"
    }
}

fn parsed(name: &str, json: &str) -> Result<Certificate, CertificateError> {
    let certificate: Certificate = serde_json::from_str(json).map_err(|error| {
        damaged(
            name,
            format!("it is not a certificate of `bench chirp`: {error}"),
        )
    })?;
    if certificate.format == FORMAT {
        Ok(certificate)
    } else {
        let format = certificate.format;
        let why = format!("its format {format} is not {FORMAT}, that of this version of bench");
        Err(damaged(name, why))
    }
}

fn damaged(name: &str, why: String) -> CertificateError {
    CertificateError::Damaged {
        file: name.into(),
        why,
    }
}

fn unreadable(name: &str, what: &str, error: &std::io::Error) -> CertificateError {
    CertificateError::Unreadable {
        file: name.into(),
        what: what.into(),
        why: error.to_string(),
    }
}
