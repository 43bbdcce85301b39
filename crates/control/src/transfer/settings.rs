//! A transfer function as the tables `[tf]`, `[zpk]` or `[ss]` of a controller file.
//!
//! Sign: u = C (r - y); the input is the error r - y, the output the current in amperes.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Unit of the gain of a controller, output per input.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize, JsonSchema)]
pub enum GainUnit {
    /// Amperes per micrometre.
    #[serde(rename = "A/um")]
    AmperesPerMicrometre,
    /// Amperes per metre.
    #[serde(rename = "A/m")]
    AmperesPerMetre,
}

impl GainUnit {
    /// The unit as it is written.
    pub fn symbol(self) -> &'static str {
        match self {
            GainUnit::AmperesPerMicrometre => "A/um",
            GainUnit::AmperesPerMetre => "A/m",
        }
    }
}

/// A ratio of two polynomials, continuous or discrete.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TfSettings {
    /// Unit of output over input: `A/um` or `A/m`.
    pub gain_unit: GainUnit,
    /// Servo rate in hertz for which a discrete controller was designed (polynomials of z). Absent: continuous (polynomials of s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1.0, max = 100000.0))]
    pub rate_hz: Option<f64>,
    /// Coefficients of the numerator by falling powers of s (in rad/s) or z.
    #[schemars(length(min = 1, max = 33))]
    pub numerator: Vec<f64>,
    /// Coefficients of the denominator by falling powers of s (in rad/s) or z.
    #[schemars(length(min = 1, max = 33))]
    pub denominator: Vec<f64>,
}

/// Zeros, poles and gain, continuous or discrete: k prod(v - z)/prod(v - p), where v is s or z.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ZpkSettings {
    /// Unit of output over input: `A/um` or `A/m`.
    pub gain_unit: GainUnit,
    /// Servo rate in hertz for which a discrete controller was designed (z plane). Absent: continuous (s plane, rad/s).
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1.0, max = 100000.0))]
    pub rate_hz: Option<f64>,
    /// Zeros, each as `[re, im]`, with both of each conjugate pair.
    #[serde(default)]
    #[schemars(length(max = 32))]
    pub zeros: Vec<[f64; 2]>,
    /// Poles, each as `[re, im]`, with both of each conjugate pair.
    #[serde(default)]
    #[schemars(length(max = 32))]
    pub poles: Vec<[f64; 2]>,
    /// k: the ratio of the leading coefficients, not the static gain.
    pub gain: f64,
}

/// Matrices, continuous or discrete: x' = A x + B e or x+ = A x + B e, and u = C x + D e.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SsSettings {
    /// Unit of output over input: `A/um` or `A/m`.
    pub gain_unit: GainUnit,
    /// Servo rate in hertz for which a discrete controller was designed. Absent: continuous.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    #[schemars(range(min = 1.0, max = 100000.0))]
    pub rate_hz: Option<f64>,
    /// A, row by row; empty for a static gain.
    #[schemars(length(max = 32))]
    pub a: Vec<Vec<f64>>,
    /// B, one number per state.
    pub b: Vec<f64>,
    /// C, one number per state.
    pub c: Vec<f64>,
    /// D.
    #[serde(default)]
    pub d: f64,
}

/// A controller file with a ratio of polynomials.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "bench controller as a ratio of polynomials")]
pub struct TfFile {
    /// Title of the controller.
    pub title: String,
    /// The transfer function.
    pub tf: TfSettings,
}

/// A controller file with zeros, poles and gain.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "bench controller as zeros, poles and gain")]
pub struct ZpkFile {
    /// Title of the controller.
    pub title: String,
    /// The transfer function.
    pub zpk: ZpkSettings,
}

/// A controller file with matrices.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(title = "bench controller as matrices")]
pub struct SsFile {
    /// Title of the controller.
    pub title: String,
    /// The transfer function.
    pub ss: SsSettings,
}

/// The table of a transfer function in a controller file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum TransferTable {
    /// `[tf]`
    Tf,
    /// `[zpk]`
    Zpk,
    /// `[ss]`
    Ss,
}

impl TransferTable {
    /// All tables.
    pub const ALL: [TransferTable; 3] = [TransferTable::Tf, TransferTable::Zpk, TransferTable::Ss];

    /// The key of the table.
    pub fn key(self) -> &'static str {
        match self {
            TransferTable::Tf => "tf",
            TransferTable::Zpk => "zpk",
            TransferTable::Ss => "ss",
        }
    }
}

/// A transfer function of one of the three forms.
#[derive(Clone, Debug, PartialEq)]
pub enum TransferSettings {
    /// A ratio of polynomials.
    Tf(TfSettings),
    /// Zeros, poles and gain.
    Zpk(ZpkSettings),
    /// Matrices.
    Ss(SsSettings),
}

impl TransferSettings {
    /// The table in a controller file.
    pub fn table(&self) -> TransferTable {
        match self {
            TransferSettings::Tf(_) => TransferTable::Tf,
            TransferSettings::Zpk(_) => TransferTable::Zpk,
            TransferSettings::Ss(_) => TransferTable::Ss,
        }
    }

    /// Unit of the gain.
    pub fn gain_unit(&self) -> GainUnit {
        match self {
            TransferSettings::Tf(tf) => tf.gain_unit,
            TransferSettings::Zpk(zpk) => zpk.gain_unit,
            TransferSettings::Ss(ss) => ss.gain_unit,
        }
    }

    /// Servo rate of a discrete controller in hertz; `None` of a continuous one.
    pub fn rate_hz(&self) -> Option<f64> {
        match self {
            TransferSettings::Tf(tf) => tf.rate_hz,
            TransferSettings::Zpk(zpk) => zpk.rate_hz,
            TransferSettings::Ss(ss) => ss.rate_hz,
        }
    }

    /// A controller file with this table. Every number has all its digits.
    ///
    /// # Errors
    /// Those of the TOML writer.
    pub fn toml(&self, title: &str) -> Result<String, toml::ser::Error> {
        let title = title.to_string();
        match self.clone() {
            TransferSettings::Tf(tf) => toml::to_string(&TfFile { title, tf }),
            TransferSettings::Zpk(zpk) => toml::to_string(&ZpkFile { title, zpk }),
            TransferSettings::Ss(ss) => toml::to_string(&SsFile { title, ss }),
        }
    }
}
