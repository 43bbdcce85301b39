//! The rest position of the stage, measured without current.

use serde::{Deserialize, Serialize};

use crate::campaign::error::CampaignError;
use bench_base::running_stats::RunningStats;
use bench_hal::Validity;
use bench_recording::{Recording, RecordingError};
use bench_rt::record::flag;

/// Number of segments whose means are compared.
const SEGMENTS: usize = 10;
/// Smallest number of readings in a segment.
const MIN_READINGS: usize = 2;

/// The mean of the probe over the active part of a run with zero current.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RestPosition {
    /// The mean in metres.
    pub mean_m: f64,
    /// Standard deviation of the mean, from the scatter of the means of ten segments; it includes drift and slow noise.
    pub sigma_m: f64,
    /// The recording.
    pub recording: String,
}

impl RestPosition {
    /// The rest position in a recording. Refuses a recording with fewer than twenty valid readings.
    pub fn of(recording: &Recording, name: &str) -> Result<RestPosition, CampaignError> {
        let readings = valid_readings(recording);
        let readings = readings.map_err(|error| refused(name, error.to_string()))?;
        let (found, needed) = (readings.len(), SEGMENTS * MIN_READINGS);
        if found < needed {
            let why = format!("{found} valid readings, {needed} are needed");
            return Err(refused(name, why));
        }
        let (mean_m, scatter_m) = scatter(&readings);
        Ok(RestPosition {
            mean_m,
            sigma_m: scatter_m / (SEGMENTS as f64).sqrt(),
            recording: name.to_string(),
        })
    }
}

fn refused(recording: &str, why: String) -> CampaignError {
    CampaignError::RestPosition {
        recording: recording.to_string(),
        why,
    }
}

fn valid_readings(recording: &Recording) -> Result<Vec<f64>, RecordingError> {
    let mut readings = Vec::new();
    for record in recording.ticks()? {
        let record = record?;
        if record.flags & flag::ACTIVE != 0 && record.validity == Validity::Valid {
            readings.push(record.position_m);
        }
    }
    Ok(readings)
}

/// Mean of all readings, and standard deviation of the means of the segments.
fn scatter(readings: &[f64]) -> (f64, f64) {
    let mut means = RunningStats::default();
    for segment in 0..SEGMENTS {
        let [begin, end] = [segment, segment + 1].map(|k| k * readings.len() / SEGMENTS);
        means.push(statistics(&readings[begin..end]).mean);
    }
    // Ten means always have a standard deviation.
    (statistics(readings).mean, means.sigma().unwrap_or(0.0))
}

fn statistics(readings: &[f64]) -> RunningStats {
    let mut statistics = RunningStats::default();
    readings.iter().for_each(|x| statistics.push(*x));
    statistics
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scatter_comes_from_ten_segments_of_any_number_of_readings() {
        for count in [20, 29, 1000, 1009] {
            // The segments alternate between 1 and -1.
            let segment = |k: usize| {
                (0..SEGMENTS)
                    .rfind(|i| i * count / SEGMENTS <= k)
                    .expect("the first segment begins at 0")
            };
            let sign = |k| if segment(k) % 2 == 0 { 1.0 } else { -1.0 };
            let readings: Vec<f64> = (0..count).map(sign).collect();
            let (mean, scatter) = scatter(&readings);
            // Ten means of +1 or -1 have the standard deviation sqrt(10/9). The numbers of readings
            // in the segments of either sign differ by at most five.
            assert!(
                (scatter - (10.0_f64 / 9.0).sqrt()).abs() < 1e-12,
                "{count}: {scatter}"
            );
            assert!(mean.abs() <= 5.0 / count as f64, "{count}: {mean}");
        }
    }
}
