//! What a swept loop shows of itself: its responses as CSV, its margins beside those of the model.

use std::path::Path;

use serde::Serialize;

use super::analysis_output::free;
use super::error::CliError;
use crate::experiment::ClosedResponses;
use crate::identify::{Frf, frf_csv};

/// The part of the report that a closed loop makes.
#[derive(Clone, Debug, Serialize)]
pub(super) struct LoopMade {
    /// L = P C, from error to reading.
    loop_csv: String,
    /// S, from reference to error.
    sensitivity_csv: String,
    /// T, from reference to reading.
    complementary_csv: String,
    /// Lowest frequency at which the measured |L| falls through 1, and 180 degrees + arg L there.
    crossover_rad_s: Option<f64>,
    phase_margin_deg: Option<f64>,
    phase_margin_sigma_deg: Option<f64>,
    /// 1/max |S| in the band that was swept.
    modulus_margin: f64,
    modulus_margin_sigma: f64,
    predicted_modulus_margin: f64,
}

impl LoopMade {
    pub(super) fn of(closed: &ClosedResponses, recording: &Path) -> Result<LoopMade, CliError> {
        let write = |frf: &Frf, what| {
            let path = free(recording, what, "csv");
            frf_csv::write_new(&path, frf, frf_csv::RATIO)
                .map_err(|e| CliError::Failed(e.to_string()))?;
            Ok::<_, CliError>(path.display().to_string())
        };
        let margins = &closed.margins;
        Ok(LoopMade {
            loop_csv: write(&closed.loop_gain, "loop")?,
            sensitivity_csv: write(&closed.sensitivity, "sensitivity")?,
            complementary_csv: write(&closed.complementary, "complementary")?,
            crossover_rad_s: margins.crossover_rad_s,
            phase_margin_deg: margins.phase_margin_deg.map(|margin| margin.value),
            phase_margin_sigma_deg: margins.phase_margin_deg.map(|margin| margin.sigma),
            modulus_margin: margins.modulus_margin.value,
            modulus_margin_sigma: margins.modulus_margin.sigma,
            predicted_modulus_margin: closed.predicted.modulus_margin,
        })
    }

    pub(super) fn text(&self) -> String {
        let crossover = self
            .crossover_rad_s
            .map_or("none in the band".into(), |w| format!("{w:.2} rad/s"));
        let margin = match (self.phase_margin_deg, self.phase_margin_sigma_deg) {
            (Some(deg), Some(sigma_deg)) => format!("{deg:.2} +- {:.2} deg", 2.0 * sigma_deg),
            _ => "none".into(),
        };
        format!(
            "  loop       {}\n  S          {}\n  T          {}\n  measured   crossover {crossover}, phase margin {margin}, \
             modulus margin {:.4} +- {:.4} (by the model {:.4})\n",
            self.loop_csv,
            self.sensitivity_csv,
            self.complementary_csv,
            self.modulus_margin,
            2.0 * self.modulus_margin_sigma,
            self.predicted_modulus_margin
        )
    }
}
