//! The rest between the check of a stage and the closing of its loop: the vibration of the shot must have decayed.
//!
//! ```text
//!  A0 = |step| + sum over the tones |motion| max(1, f tone/f1)      bound of the free vibration when the current has ended
//!  A(t) = A0 exp(-d t)                                              d: the slowest decay zeta w of the certified modes
//!  A(t) <= a/10:   t = ln(10 A0/a)/d                                a: absolute bound of the residual monitor
//! ```
//!
//! A tone above the first mode leaves it with the speed of the tone, hence f tone/f1. The ramp at the end of every run reduces the
//! vibration further, which is not used. The residual monitor starts with models at rest: a tenth of its bound is left to the
//! vibration. Without the monitor the bound is that of the default settings.

use serde::Serialize;

use super::shot::Shot;
use crate::certificate::LoadedCertificate;
use bench_config::Config;
use bench_control::ClosedLoop;

/// Part of the absolute bound of the residual monitor that is left to the vibration.
const BOUND_PART: f64 = 0.1;
/// `interlock.model_error_ratio` if the monitor is off.
const DEFAULT_RATIO: f64 = 0.02;
/// Longest rest in seconds.
const LONGEST_S: f64 = 60.0;

/// The rest after a check of a stage. The names in JSON must not change.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct RestAfterCheck {
    /// Time with zero current before the loop closes, in seconds: at least `control.settle_s`.
    pub rest_s: f64,
    /// Bound of the vibration at the end of the check in metres.
    pub vibration_m: f64,
    /// Bound of the vibration when the loop closes.
    pub left_m: f64,
    /// The vibration that is permitted when the loop closes.
    pub permitted_m: f64,
    /// Whether the rest was limited to 60 s, so that more than the permitted vibration may be left.
    pub is_limited: bool,
}

impl RestAfterCheck {
    /// The rest before a loop with this certificate; `None` if its stage cannot be checked.
    pub fn of(
        loaded: &LoadedCertificate,
        model: &ClosedLoop,
        config: &Config,
    ) -> Option<RestAfterCheck> {
        let shot = Shot::of(loaded, model, config)?;
        let interlock = &config.interlock;
        let ratio = interlock.model_error_ratio.unwrap_or(DEFAULT_RATIO);
        let permitted_m = BOUND_PART * ratio * interlock.soft_limit_m;
        let vibration = Vibration {
            amplitude_m: shot.vibration_m(),
            decay_per_s: slowest_decay_per_s(loaded),
        };
        Some(vibration.rest(permitted_m, config.control.settle_s))
    }
}

/// The slowest decay zeta w of the certified modes in 1/s; 0 for a mode that does not decay.
fn slowest_decay_per_s(loaded: &LoadedCertificate) -> f64 {
    let modes = loaded.certificate.modes.iter();
    let decays = modes.map(|mode| mode.damping_ratio * mode.frequency_hz * std::f64::consts::TAU);
    decays.reduce(f64::min).unwrap_or(0.0).max(0.0)
}

/// A decaying vibration.
#[derive(Clone, Copy, Debug)]
struct Vibration {
    amplitude_m: f64,
    decay_per_s: f64,
}

impl Vibration {
    /// The rest until a permitted amplitude, at least `least_s`.
    fn rest(&self, permitted_m: f64, least_s: f64) -> RestAfterCheck {
        let excess = (self.amplitude_m / permitted_m).max(1.0);
        let needed_s = if excess > 1.0 {
            libm::log(excess) / self.decay_per_s
        } else {
            0.0
        };
        // A mode that does not decay needs an infinite time.
        let rest_s = needed_s.min(LONGEST_S).max(least_s);
        RestAfterCheck {
            rest_s,
            vibration_m: self.amplitude_m,
            left_m: self.amplitude_m * libm::exp(-self.decay_per_s * rest_s),
            permitted_m,
            is_limited: needed_s > rest_s,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn rest(decay_per_s: f64, least_s: f64) -> RestAfterCheck {
        let vibration = Vibration {
            amplitude_m: 10e-6,
            decay_per_s,
        };
        vibration.rest(1e-6, least_s)
    }

    #[test]
    fn rest_lasts_until_the_slowest_mode_has_decayed_to_the_permitted_vibration() {
        // 0.009 x 183.9 rad/s: ln(10)/1.6551 = 1.3912 s.
        let found = rest(0.009 * 183.9, 0.5);
        assert!((found.rest_s - 1.3912).abs() < 1e-4, "{found:?}");
        assert!((found.left_m - 1e-6).abs() < 1e-12, "{found:?}");
        assert!(!found.is_limited);
    }

    #[test]
    fn rest_is_never_shorter_than_the_setting_and_limited_to_60_s() {
        assert_eq!(rest(100.0, 0.5).rest_s, 0.5);
        for decay_per_s in [0.0, 1e-3] {
            let limited = rest(decay_per_s, 0.5);
            assert_eq!((limited.rest_s, limited.is_limited), (60.0, true));
        }
        // A longer setting is not shortened.
        assert_eq!(rest(1e-3, 100.0).rest_s, 100.0);
    }

    #[test]
    fn small_vibration_needs_no_longer_rest() {
        let small = Vibration {
            amplitude_m: 0.5e-6,
            decay_per_s: 0.0,
        };
        let found = small.rest(1e-6, 0.5);
        assert_eq!((found.rest_s, found.is_limited), (0.5, false));
    }
}
