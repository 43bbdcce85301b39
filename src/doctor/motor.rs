//! The thermal state of the motor that earlier runs left, and whether `bench chirp` may start with it.

use super::finding::{Finding, Severity, Subject};
use super::report::Report;
use bench_config::Config;
use bench_experiment::{ExperimentError, MotorError, MotorForecast, Plan};
use bench_rig::devices;
use bench_rig::motor::{Moment, MotorMemory};

/// Examines the stored state. The simulated motor has none.
pub(super) fn examine(config: &Config, report: &mut Report) {
    if devices::is_simulated(config) {
        return;
    }
    match gather(config) {
        Err(error) => report.extend([Subject::Motor.refused(&error)]),
        Ok(forecast) => {
            report.extend([finding(&forecast)]);
            report.figures.motor = Some(forecast.summary());
        }
    }
}

fn gather(config: &Config) -> Result<MotorForecast, ExperimentError> {
    let memory = MotorMemory::of(config).map_err(MotorError::from)?;
    let plan = Plan::chirp(config.clone());
    MotorForecast::of(&plan, &memory, None, Moment::now())
}

/// A motor that is too warm is a warning: it cools within some thermal time constants.
fn finding(forecast: &MotorForecast) -> Finding {
    match forecast.require_cool() {
        Ok(()) => {
            let summary = forecast.summary();
            Subject::Motor.ok(format!(
                "{}; `bench chirp` would reach {:.3} A of {:.3} A thermal",
                summary.known_from, summary.thermal_peak_a, summary.thermal_limit_a
            ))
        }
        Err(error) => {
            let text = error.to_string();
            let text = text.trim_end_matches("; nothing was moved");
            let refused = Subject::Motor.refused(&format!("`bench chirp`: {text}"));
            refused.at_most(Severity::Warning)
        }
    }
}
