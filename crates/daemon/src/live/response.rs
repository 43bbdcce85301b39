//! The response of the stage during a chirp, for clients.

use schemars::JsonSchema;
use serde::Serialize;

use bench_identify::GrowingPoint;

/// The response so far: an estimate for watching. The result is that of the analysis after the run.
#[derive(Clone, Debug, Serialize, JsonSchema)]
pub struct ResponseView {
    /// Number of the run.
    pub run: u32,
    /// Frequencies in hertz.
    pub frequency_hz: Vec<f64>,
    /// Magnitude of position over current set-point in metres per ampere.
    pub magnitude_m_per_a: Vec<f64>,
    /// Phase in degrees from -180 to 180; a lag is negative. It contains the delay of the loop.
    pub phase_deg: Vec<f64>,
    /// Coherence; `null` where a single average gives none.
    pub coherence: Vec<Option<f64>>,
}

impl ResponseView {
    /// The view of an estimate.
    pub fn of(points: &[GrowingPoint], run: u32) -> ResponseView {
        let each = |value: fn(&GrowingPoint) -> f64| points.iter().map(value).collect();
        ResponseView {
            run,
            frequency_hz: each(|point| point.frequency_hz),
            magnitude_m_per_a: each(|point| point.response.norm()),
            phase_deg: each(|point| point.response.arg().to_degrees()),
            coherence: points.iter().map(|point| point.coherence).collect(),
        }
    }
}
