//! The response to a stage check beside the certificate.
//!
//! Each of the three comparisons allows [`SIGMAS`] standard deviations, in which the noise of the shot, the noise of the certificate
//! and the repeatability of a stage are added as squares:
//!
//! ```text
//! compliance: sigma^2 = (noise of shot)^2 + (noise of certificate)^2 + 0.01^2                     relative
//! phase:      sigma^2 = (noise of shot)^2 + (noise of certificate)^2 + 0.01^2 + (1e-3 d arg/d ln f)^2 + (w T/sqrt(12))^2    in rad
//! ```
//!
//! with the period T of a probe that has its own clock.
//!
//! False refusals: three normal comparisons at three sigma exceed their limits with a probability of 3 x 0.27 % = 0.8 % if noise is
//! all of sigma. The amplitudes make the noise at most as large as the repeatability, so that the limits are at least
//! 3 sqrt(2) = 4.2 standard deviations of the noise: 3 x 2.7e-5, far below 1 of 200. A shot with so much noise that it could not tell
//! another stage is refused as inconclusive.

use nalgebra::Complex;
use serde::{Deserialize, Serialize};

use super::error::StageCheckError;
use super::estimate::{Measured, ShotResponse, estimate};
use super::figures::{PhaseComparison, StaticComparison};
use super::shot::{Expected, Shot};
use bench_identify::Signals;
use bench_recording::Recording;

/// Allowed difference in standard deviations.
const SIGMAS: f64 = 3.0;
/// Repeatability of the compliance, relative: temperature of motor and springs, and the load put on again.
const COMPLIANCE_REPEATABILITY: f64 = 0.01;
/// Largest limit of a conclusive comparison of the compliance, relative.
const MAX_LIMIT_RATIO: f64 = 0.5;
/// Largest limit of a conclusive comparison of a phase in degrees. Other signs of the residues change it by up to 180 degrees.
const MAX_LIMIT_DEG: f64 = 75.0;

/// The result of a stage check. The names in JSON must not change.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct StageCheck {
    /// Static compliance.
    pub compliance: StaticComparison,
    /// Phase at each tone.
    pub phases: Vec<PhaseComparison>,
    /// Whether all of them agree with the certificate.
    pub agrees: bool,
}

impl StageCheck {
    /// Compares the signals of a shot with the certificate; `None` if they allow no estimate.
    pub(crate) fn of(shot: &Shot, signals: &Signals) -> Option<StageCheck> {
        Some(StageCheck::compare(shot, &estimate(shot, signals)?))
    }

    /// The result that the run of a check has added to its recording; `None` if there is none.
    pub fn recorded(recording: &Recording) -> Option<StageCheck> {
        let results = recording.attachment("results.json")?;
        serde_json::from_slice(&results.data).ok()
    }

    fn compare(shot: &Shot, response: &ShotResponse) -> StageCheck {
        let compliance = static_comparison(&response.compliance, &shot.compliance);
        let tones = shot.settings.tones.iter();
        let pairs = response.responses.iter().zip(&shot.responses);
        let phases: Vec<PhaseComparison> = tones
            .zip(pairs)
            .map(|(tone, (measured, certified))| {
                phase_comparison(tone.frequency_hz, measured, certified)
            })
            .collect();
        let mut check = StageCheck {
            compliance,
            phases,
            agrees: false,
        };
        check.agrees = check.refusal().is_none();
        check
    }

    /// Why the loop must not close; `None` if the stage agrees with the certificate.
    pub fn refusal(&self) -> Option<StageCheckError> {
        let compliance = self.compliance.refusal();
        let mut phases = self.phases.iter();
        compliance.or_else(|| phases.find_map(PhaseComparison::refusal))
    }
}

fn static_comparison(measured: &Measured<f64>, certified: &Expected<f64>) -> StaticComparison {
    let size = certified.value.abs();
    let sigma = root_of_squares(&[
        measured.sigma / size,
        certified.sigma / size,
        COMPLIANCE_REPEATABILITY,
    ]);
    StaticComparison {
        measured_m_per_a: measured.value,
        certified_m_per_a: certified.value,
        limit_ratio: SIGMAS * sigma,
    }
}

fn phase_comparison(
    frequency_hz: f64,
    measured: &Measured<Complex<f64>>,
    certified: &Expected<Complex<f64>>,
) -> PhaseComparison {
    let sigma_rad = root_of_squares(&[
        measured.sigma / measured.value.norm(),
        certified.sigma / certified.value.norm(),
        certified.repeatability_rad,
    ]);
    PhaseComparison {
        frequency_hz,
        measured_deg: measured.value.arg().to_degrees(),
        certified_deg: certified.value.arg().to_degrees(),
        difference_deg: (measured.value / certified.value).arg().to_degrees(),
        limit_deg: (SIGMAS * sigma_rad).to_degrees(),
    }
}

fn root_of_squares(values: &[f64]) -> f64 {
    values.iter().map(|value| value * value).sum::<f64>().sqrt()
}

impl StaticComparison {
    fn refusal(&self) -> Option<StageCheckError> {
        let ratio = self.measured_m_per_a / self.certified_m_per_a;
        // Written this way, a number that is not finite is refused.
        let is_conclusive = self.limit_ratio <= MAX_LIMIT_RATIO;
        if !is_conclusive {
            return Some(StageCheckError::Inconclusive {
                what: "the static compliance".into(),
            });
        }
        if ratio < 0.0 {
            return Some(StageCheckError::Reversed(*self));
        }
        let agrees = (ratio - 1.0).abs() <= self.limit_ratio;
        (!agrees).then_some(StageCheckError::Compliance(*self))
    }
}

impl PhaseComparison {
    fn refusal(&self) -> Option<StageCheckError> {
        let is_conclusive = self.limit_deg <= MAX_LIMIT_DEG;
        if !is_conclusive {
            let hz = self.frequency_hz;
            return Some(StageCheckError::Inconclusive {
                what: format!("the phase at {hz:.2} Hz"),
            });
        }
        let agrees = self.difference_deg.abs() <= self.limit_deg;
        (!agrees).then_some(StageCheckError::Phase(*self))
    }
}
