//! One short chirp of a sequential experiment.

use serde::Serialize;

use crate::errors::ExperimentError;
use bench_base::units::hz;
use bench_config::Config;
use bench_excitation::{AmplitudePoint, ExcitationKind, Sweep};
use bench_plant::ModalModel;

/// Length of the first shot in periods of the lowest mode.
const FIRST_PERIODS: f64 = 90.0;
/// The first shot begins at this ratio of the lowest mode ...
const BELOW_FIRST_MODE: f64 = 0.4;
/// ... and ends at this ratio of the highest one.
const ABOVE_LAST_MODE: f64 = 1.4;
/// Length of each fade as a ratio of the sweep.
const FADE_RATIO: f64 = 0.05;
/// Zero current before a shot in seconds: the stage is at rest since the shot before.
const QUIET_BEFORE_S: f64 = 0.2;

/// Band and length of a logarithmic sweep.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct Shot {
    /// Lowest frequency in hertz.
    pub low_hz: f64,
    /// Highest frequency in hertz.
    pub high_hz: f64,
    /// Length of the sweep in seconds, without the zero current before and after.
    pub duration_s: f64,
}

impl Shot {
    /// The first shot: over all modes of the model, within the configured band.
    ///
    /// # Errors
    /// When the model of the plant cannot be built.
    pub(super) fn first(config: &Config) -> Result<Shot, ExperimentError> {
        let modal = ModalModel::of(&bench_plant::build(&config.plant)?)?;
        let modes_hz = modal.modes.iter().map(|mode| hz(mode.omega_rad_s));
        let modes_hz = modes_hz.filter(|hz| *hz > 0.0);
        let (first_hz, last_hz) = modes_hz.fold((f64::INFINITY, 0.0f64), |(low, high), hz| {
            (low.min(hz), high.max(hz))
        });
        let (low_hz, high_hz) = config.chirp.band_hz();
        let first_hz = if first_hz.is_finite() {
            first_hz
        } else {
            low_hz
        };
        let around = Shot {
            low_hz: low_hz.max(BELOW_FIRST_MODE * first_hz),
            high_hz: high_hz.min(ABOVE_LAST_MODE * last_hz),
            duration_s: FIRST_PERIODS / first_hz,
        };
        Ok(if around.low_hz < around.high_hz {
            around
        } else {
            Shot {
                low_hz,
                high_hz,
                ..around
            }
        })
    }

    /// ln(high/low).
    pub(super) fn log_width(&self) -> f64 {
        libm::log(self.high_hz / self.low_hz)
    }

    /// The configuration of the run of this shot.
    pub(super) fn config(&self, base: &Config, amplitude: Vec<AmplitudePoint>) -> Config {
        let mut config = base.clone();
        config.excitation.kind = ExcitationKind::Chirp;
        let chirp = &mut config.chirp;
        chirp.sweep = Sweep::Logarithmic;
        (chirp.start_hz, chirp.stop_hz) = (self.low_hz, self.high_hz);
        chirp.duration_s = self.duration_s;
        chirp.fade_in_s = FADE_RATIO * self.duration_s;
        chirp.fade_out_s = FADE_RATIO * self.duration_s;
        chirp.quiet_before_s = QUIET_BEFORE_S.min(base.chirp.quiet_before_s);
        chirp.repetitions = 1;
        chirp.amplitude = amplitude;
        config
    }
}
