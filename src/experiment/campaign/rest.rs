//! Where the stage rests without current.

use serde::{Deserialize, Serialize};

use super::CampaignError;
use crate::recording::Recording;
use crate::rt::record::flag;
use crate::util::running_stats::RunningStats;
use bench_hal::Validity;

/// Stretches whose means are compared.
const STRETCHES: usize = 10;
/// Readings that a stretch has at least.
const LEAST: usize = 2;

/// The mean of the probe over the active part of a quiet run.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rest {
    /// The mean in metres.
    pub mean_m: f64,
    /// Standard deviation of the mean, from the scatter of the means of ten stretches: it has drift and slow noise in it.
    pub sigma_m: f64,
    /// The recording.
    pub recording: String,
}

impl Rest {
    /// Of a recording. Refuses one with fewer than twenty valid readings.
    pub fn of(recording: &Recording, name: &str) -> Result<Rest, CampaignError> {
        let failed = |why: String| CampaignError::Rest {
            recording: name.to_string(),
            why,
        };
        let mut readings = Vec::new();
        for record in recording.ticks().map_err(|e| failed(e.to_string()))? {
            let record = record.map_err(|e| failed(e.to_string()))?;
            if record.flags & flag::ACTIVE != 0 && record.validity == Validity::Valid {
                readings.push(record.position_m);
            }
        }
        if readings.len() < STRETCHES * LEAST {
            return Err(failed(format!(
                "{} valid readings, {} are needed",
                readings.len(),
                STRETCHES * LEAST
            )));
        }
        let (mean_m, scatter_m) = scatter(&readings);
        Ok(Rest {
            mean_m,
            sigma_m: scatter_m / (STRETCHES as f64).sqrt(),
            recording: name.to_string(),
        })
    }
}

/// Mean of all, and standard deviation of the means of the stretches.
fn scatter(readings: &[f64]) -> (f64, f64) {
    let (mut all, mut means) = (RunningStats::default(), RunningStats::default());
    let begin = |k: usize| k * readings.len() / STRETCHES;
    for k in 0..STRETCHES {
        let mut within = RunningStats::default();
        readings[begin(k)..begin(k + 1)]
            .iter()
            .for_each(|x| within.push(*x));
        means.push(within.mean);
    }
    readings.iter().for_each(|x| all.push(*x));
    // Ten means have one.
    (all.mean, means.sigma().unwrap_or(0.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ten_stretches_make_the_scatter_however_many_readings_there_are() {
        for count in [20, 29, 1000, 1009] {
            // Stretch by stretch 1 and -1, each with all of its readings.
            let stretch = |k: usize| {
                (0..STRETCHES)
                    .rfind(|i| i * count / STRETCHES <= k)
                    .expect("the first begins at 0")
            };
            let readings: Vec<f64> = (0..count)
                .map(|k| if stretch(k) % 2 == 0 { 1.0 } else { -1.0 })
                .collect();
            let (mean, scatter) = scatter(&readings);
            // Ten means of size 1 about 0: sqrt(10/9). Five stretches of either sign differ by five readings at most.
            assert!(
                (scatter - (10.0_f64 / 9.0).sqrt()).abs() < 1e-12,
                "{count}: {scatter}"
            );
            assert!(mean.abs() <= 5.0 / count as f64, "{count}: {mean}");
        }
    }
}
