//! A measured frequency response with its file.

use std::path::Path;

use sha2::{Digest, Sha256};

use super::error::TuneSourceError;
use crate::analysis::{MeasuredFrf, variance};
use bench_base::numeric::to_four_decimals;
use bench_config::{Config, PlantSettings};
use bench_external::frf::PhaseUnit;
use bench_identify::{Frf, FrfDatum};

/// A measured frequency response, from command (A) to reading (m).
#[derive(Clone, Debug)]
pub struct FrfSource {
    /// The file as the user named it.
    pub file: String,
    /// SHA-256 of the file, as hexadecimal digits.
    pub sha256: String,
    /// The response, with its data for a fit.
    pub measured: MeasuredFrf,
}

impl FrfSource {
    /// The response of a table, or of a recording, which ends in `.mcap`; `phase` as in [`MeasuredFrf::read`].
    ///
    /// # Errors
    /// When the file cannot be read, or has no response from current to displacement.
    pub fn read(path: &Path, phase: Option<PhaseUnit>) -> Result<FrfSource, TuneSourceError> {
        let file = path.display().to_string();
        let read = MeasuredFrf::read(path, phase);
        let mut measured = read.map_err(|why| TuneSourceError::File {
            file: file.clone(),
            why: Box::new(why),
        })?;
        let bytes = std::fs::read(path).map_err(|why| TuneSourceError::Read {
            file: file.clone(),
            why,
        })?;
        let digest = Sha256::digest(&bytes);
        // A CSV file contains the points only.
        if measured.frf.data.is_empty() {
            measured.frf.data = independent(&measured.frf);
        }
        Ok(FrfSource {
            file,
            sha256: digest.iter().map(|byte| format!("{byte:02x}")).collect(),
            measured,
        })
    }

    /// The loop rate of a recording in hertz.
    pub fn recorded_rate_hz(&self) -> Option<f64> {
        let recorded = self.measured.recorded.as_ref()?;
        Some(recorded.servo.rate_hz)
    }

    /// The settings of the stage of a recording with operating points.
    pub fn recorded_point(&self) -> Option<&PlantSettings> {
        let recorded: &Config = self.measured.recorded.as_ref()?;
        recorded.plant.operating_point_m().map(|_| &recorded.plant)
    }

    /// Operating point and mass asymmetry of a recording, as text.
    pub fn point_name(&self) -> Option<String> {
        let plant = self.recorded_point()?;
        let point = plant.operating_point_name()?;
        Some(match plant.mass_asymmetry() {
            Some(asymmetry) => format!("{point}, D {:+} %", to_four_decimals(100.0 * asymmetry)),
            None => point,
        })
    }
}

/// The points of a response as data of independent errors: where neighbours are closer than the noise bandwidth B of the estimator, at
/// a spacing d, the variance of a mean is larger by B/d than that of independent points.
pub(super) fn independent(frf: &Frf) -> Vec<FrfDatum> {
    let datum = |k: usize| {
        let spacing_hz = spacing_hz(&frf.frequency_hz, k);
        FrfDatum {
            frequency_hz: frf.frequency_hz[k],
            spread_hz: 0.0,
            response: frf.response[k],
            variance: variance(frf, k) * (frf.resolution_hz[k] / spacing_hz).max(1.0),
        }
    };
    let data = (0..frf.len()).map(datum);
    // A fit cannot weight a point without noise.
    data.filter(|datum| datum.variance > 0.0 && datum.variance.is_finite())
        .collect()
}

/// The mean distance from the neighbours.
fn spacing_hz(frequency_hz: &[f64], k: usize) -> f64 {
    let last = frequency_hz.len() - 1;
    let (from, to) = (k.saturating_sub(1), (k + 1).min(last));
    (frequency_hz[to] - frequency_hz[from]) / (to - from).max(1) as f64
}
