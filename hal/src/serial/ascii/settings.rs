//! Settings of a text protocol.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::super::protocol::Polling;

/// Settings of the protocol. Texts may contain the escapes `\r`, `\n`, `\t`, `\xNN`, `\\`, `\{`.
///
/// ```
/// use bench_hal::serial::ascii::{LineFormat, Output, Settings};
///
/// let format = LineFormat::new(Settings::keyence_lk_g(3e-3)).unwrap();
/// assert_eq!(format.write(Output::Position(1.2345e-3)), b"+01.2345\r");
/// ```
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct Settings {
    /// Pattern of a line with a measurement: plain text and the fields `{value}`, `{value:WIDTH.DECIMALS}`, `{skip}`, with
    /// `{value}` exactly once.
    #[serde(rename = "pattern")]
    pub line: String,
    /// End of a line.
    #[serde(default = "line_end")]
    pub terminator: String,
    /// Texts in place of the value that mean: not measured.
    #[serde(default)]
    pub invalid: Vec<String>,
    /// Texts in place of the value that mean: above the range.
    #[serde(default)]
    pub over: Vec<String>,
    /// Texts in place of the value that mean: below the range.
    #[serde(default)]
    pub under: Vec<String>,
    /// Pattern of a line with an error: plain text, `{skip}`, and `{code}` exactly once.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub error: Option<String>,
    /// Meaning of the error numbers.
    #[serde(skip)]
    pub error_texts: &'static [(i64, &'static str)],
    /// Request for a line; `None` if the probe sends without requests.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub request: Option<String>,
    /// Metres per unit of the number, from the data sheet: 1e-3 for millimetres. A correction belongs into a calibration, a reversed
    /// direction into `mounting.gain`.
    #[schemars(range(min = 1e-12, max = 1.0))]
    pub unit_m: f64,
    /// Position at the number 0, in metres.
    #[serde(rename = "zero_m", default)]
    #[schemars(range(min = -10.0, max = 10.0))]
    pub offset_m: f64,
    /// Start of the measuring range in metres.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub lower_m: f64,
    /// End of the measuring range in metres.
    #[schemars(range(min = -10.0, max = 10.0))]
    pub upper_m: f64,
    /// Timing of the requests.
    #[serde(default)]
    pub polling: Polling,
}

fn line_end() -> String {
    "\\r\\n".into()
}

impl Settings {
    /// Keyence LK-G with a display in millimetres with four decimals, sending without requests, with a measuring range of
    /// +-`half_range_m`.
    pub fn keyence_lk_g(half_range_m: f64) -> Self {
        Self {
            line: "{value:8.4}".into(),
            terminator: "\\r".into(),
            invalid: vec!["XXXXXXXX".into()],
            over: vec!["+FFFFFFF".into()],
            under: vec!["-FFFFFFF".into()],
            error: Some("ER,{skip},{code}".into()),
            error_texts: KEYENCE_ERRORS,
            request: None,
            unit_m: 1e-3,
            offset_m: 0.0,
            lower_m: -half_range_m,
            upper_m: half_range_m,
            polling: Polling::default(),
        }
    }
}

/// Error numbers of the Keyence LK-G [manual, page 5-5].
pub const KEYENCE_ERRORS: &[(i64, &str)] = &[
    (0, "the probe does not know the command"),
    (
        1,
        "the probe cannot execute the command in its present state",
    ),
    (20, "the command has the wrong length"),
    (21, "the command has the wrong number of parameters"),
    (22, "a parameter of the command is invalid"),
    (88, "the controller of the probe timed out"),
];
