//! The forecast of a calibration: the extremes of its runs and their limits.

use serde::Serialize;

use super::excitation_plan::PlanLimits;
use bench_config::Config;
use bench_excitation::Extremes;

/// The plan of a calibration, predicted by the model.
#[derive(Clone, Copy, Debug, Serialize)]
pub struct CalibrationForecast {
    /// Extremes of the static steps.
    pub steps: Extremes,
    /// Extremes of the chirp; `None` if the delay is not measured.
    pub chirp: Option<Extremes>,
    /// Extremes of both runs together.
    pub expected: ExpectedExtremes,
    /// The limits of these extremes.
    pub limits: PlanLimits,
}

/// The larger ones of both runs, and their length.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct ExpectedExtremes {
    /// Largest travel in metres.
    pub travel_m: f64,
    /// Largest current in amperes.
    pub current_a: f64,
    /// Largest thermal current in amperes.
    pub thermal_current_a: f64,
    /// Length of both runs in seconds.
    pub duration_s: f64,
}

impl CalibrationForecast {
    /// The forecast of static steps and, unless it is left out, of the chirp after them.
    pub fn new(config: &Config, steps: Extremes, chirp: Option<Extremes>) -> CalibrationForecast {
        CalibrationForecast {
            steps,
            chirp,
            expected: ExpectedExtremes::of(&steps, chirp.as_ref()),
            limits: PlanLimits::of(config),
        }
    }
}

impl ExpectedExtremes {
    fn of(steps: &Extremes, chirp: Option<&Extremes>) -> ExpectedExtremes {
        let largest = |value: fn(&Extremes) -> f64| value(steps).max(chirp.map_or(0.0, value));
        ExpectedExtremes {
            travel_m: largest(|extremes| extremes.travel_m),
            current_a: largest(|extremes| extremes.current_a),
            thermal_current_a: largest(|extremes| extremes.thermal_current_a),
            duration_s: steps.duration_s + chirp.map_or(0.0, |chirp| chirp.duration_s),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STEPS: Extremes = Extremes {
        travel_m: 200e-6,
        travel_tick: 0,
        current_a: 0.5,
        rms_current_a: 0.3,
        thermal_current_a: 0.4,
        slew_a_per_s: 10.0,
        duration_s: 12.0,
    };

    #[test]
    fn expects_the_larger_extremes_of_both_runs_and_their_whole_length() {
        let chirp = Extremes {
            travel_m: 300e-6,
            current_a: 0.2,
            thermal_current_a: 0.1,
            duration_s: 8.0,
            ..STEPS
        };
        let both = ExpectedExtremes {
            travel_m: 300e-6,
            current_a: 0.5,
            thermal_current_a: 0.4,
            duration_s: 20.0,
        };
        assert_eq!(ExpectedExtremes::of(&STEPS, Some(&chirp)), both);
        let steps_only = ExpectedExtremes {
            travel_m: 200e-6,
            duration_s: 12.0,
            ..both
        };
        assert_eq!(ExpectedExtremes::of(&STEPS, None), steps_only);
    }
}
