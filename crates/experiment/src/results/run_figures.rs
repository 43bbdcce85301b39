//! Largest values and heat of a whole closed-loop run, also of one that tripped.

use serde::Serialize;

use bench_base::numeric::larger;
use bench_config::Config;
use bench_recording::{Recording, RecordingError};
use bench_rig::motor::ThermalModel;
use bench_rt::record::{TickRecord, flag};

/// Figures of a run from the tick on in which the loop closed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize)]
pub struct RunFigures {
    /// Largest |r - y| in metres.
    pub peak_error_m: f64,
    /// RMS of r - y in metres.
    pub rms_error_m: f64,
    /// Largest |u| in amperes.
    pub peak_current_a: f64,
    /// RMS of u in amperes.
    pub rms_current_a: f64,
    /// Largest thermal current of the motor in amperes, by the model of the interlocks.
    pub thermal_peak_a: f64,
    /// The thermal current at which the interlocks trip, in amperes.
    pub thermal_limit_a: f64,
}

/// The figures of a recorded run whose motor began in the thermal state `thermal_start_a2`. One pass with constant memory.
///
/// # Errors
/// When the recording cannot be read.
pub fn run_figures(
    recording: &Recording,
    config: &Config,
    thermal_start_a2: f64,
) -> Result<RunFigures, RecordingError> {
    let mut meter = FiguresMeter::new(config, thermal_start_a2);
    for record in recording.ticks()? {
        meter.push(&record?);
    }
    Ok(meter.figures())
}

struct FiguresMeter {
    figures: RunFigures,
    /// Change of the thermal state in a tick, as a part of its difference from i^2.
    heating: f64,
    thermal_a2: f64,
    ticks: f64,
    error_m2: f64,
    current_a2: f64,
}

impl FiguresMeter {
    fn new(config: &Config, thermal_start_a2: f64) -> FiguresMeter {
        let motor = ThermalModel::of(&config.motor);
        FiguresMeter {
            figures: RunFigures {
                thermal_peak_a: thermal_start_a2.sqrt(),
                thermal_limit_a: motor.limit_a2.sqrt(),
                ..RunFigures::default()
            },
            heating: (config.servo.period_s() / motor.time_constant_s).min(1.0),
            thermal_a2: thermal_start_a2,
            ticks: 0.0,
            error_m2: 0.0,
            current_a2: 0.0,
        }
    }

    fn push(&mut self, record: &TickRecord) {
        let current_a = record.command_a;
        self.thermal_a2 += self.heating * (current_a * current_a - self.thermal_a2);
        let figures = &mut self.figures;
        figures.thermal_peak_a = larger(figures.thermal_peak_a, self.thermal_a2.sqrt());
        let error_m = record.reference_m - record.position_m;
        if record.flags & flag::ACTIVE == 0 || !error_m.is_finite() {
            return;
        }
        figures.peak_error_m = larger(figures.peak_error_m, error_m.abs());
        figures.peak_current_a = larger(figures.peak_current_a, current_a.abs());
        self.ticks += 1.0;
        self.error_m2 += error_m * error_m;
        self.current_a2 += current_a * current_a;
    }

    fn figures(self) -> RunFigures {
        let ticks = self.ticks.max(1.0);
        RunFigures {
            rms_error_m: (self.error_m2 / ticks).sqrt(),
            rms_current_a: (self.current_a2 / ticks).sqrt(),
            ..self.figures
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use bench_config::{Source, load};

    #[test]
    fn figures_of_a_constant_current_and_error() {
        let config = load(&Source::default()).unwrap();
        let mut meter = FiguresMeter::new(&config, 1.0);
        let ticks = 5000;
        for tick in 0..ticks {
            meter.push(&TickRecord {
                tick,
                reference_m: 3e-5,
                position_m: 1e-5,
                command_a: if tick % 2 == 0 { 2.0 } else { -2.0 },
                flags: flag::ACTIVE,
                ..TickRecord::default()
            });
        }
        let found = meter.figures();
        assert!(
            (found.peak_error_m - 2e-5).abs() < 1e-18 && (found.rms_error_m - 2e-5).abs() < 1e-15
        );
        assert_eq!((found.peak_current_a, found.rms_current_a), (2.0, 2.0));
        // 1 s of 4 A^2 from 1 A^2: 4 - 3 (1 - T/tau)^n, which is 4 - 3 exp(-t/tau) within T/tau of its exponent.
        let heat_a2 = 4.0 - 3.0 * (-1.0 / config.motor.thermal_time_constant_s).exp();
        assert!(
            (found.thermal_peak_a / heat_a2.sqrt() - 1.0).abs() < 1e-3,
            "{found:?}"
        );
    }
}
