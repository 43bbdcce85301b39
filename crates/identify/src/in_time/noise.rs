//! The noise of an output, and what a reading with it tells of the true value.
//!
//! ```text
//! value y without a step     ln P = -e^2/2 - ln s - ln(2 pi)/2      score = e            information = 1         e = (y - m)/s
//! value with a step          ln P, score and information of its cell
//! at least y                 ln P = ln Phi(z)                       score = h            information = h (h + z)  z = (m - y)/s, h = phi(z)/Phi(z)
//! lost                       ln P = 0                               score = 0            information = 0
//! ```
//!
//! m is the true value, s the standard deviation of the noise. Readings at a limit are those of a censored regression. Source: Tobin,
//! "Estimation of relationships for limited dependent variables", Econometrica 26 (1958), 24-36.

use core::f64::consts::TAU;

use super::cell::{Cell, information, log_tail_of_normal, over_tail};
use crate::record_check::Reading;

/// Noise before rounding, if the output is rounded.
#[derive(Clone, Copy, Debug)]
pub(super) struct Noise {
    /// The step of the output; `None` if its noise exceeds that.
    step: Option<f64>,
    /// The standard deviation.
    sigma: f64,
    /// ln(2 pi s^2)/2.
    log_scale: f64,
}

impl Noise {
    pub(super) fn new(step: Option<f64>, sigma: f64) -> Noise {
        Noise {
            step,
            sigma,
            log_scale: 0.5 * libm::log(TAU * sigma * sigma),
        }
    }

    /// ln P of a reading.
    pub(super) fn log_probability(self, reading: Reading, true_value: f64) -> f64 {
        match (reading, self.step) {
            (Reading::Value(y), Some(step)) => {
                Cell::new(y, true_value, step, self.sigma).log_probability()
            }
            (Reading::Value(y), None) => {
                let error = (y - true_value) / self.sigma;
                -0.5 * error * error - self.log_scale
            }
            (Reading::AtLeast(limit), _) => log_tail_of_normal(self.below(limit, true_value)),
            (Reading::AtMost(limit), _) => log_tail_of_normal(self.above(limit, true_value)),
            (Reading::Lost, _) => 0.0,
        }
    }

    /// s d ln P/dm.
    pub(super) fn score(self, reading: Reading, true_value: f64) -> f64 {
        match (reading, self.step) {
            (Reading::Value(y), Some(step)) => Cell::new(y, true_value, step, self.sigma).score(),
            (Reading::Value(y), None) => (y - true_value) / self.sigma,
            (Reading::AtLeast(limit), _) => over_tail(self.below(limit, true_value)),
            (Reading::AtMost(limit), _) => -over_tail(self.above(limit, true_value)),
            (Reading::Lost, _) => 0.0,
        }
    }

    /// The information on m, in s^2: of a cell the expected one, of a limit -s^2 d^2 ln P/dm^2.
    pub(super) fn information(self, reading: Reading, true_value: f64) -> f64 {
        let at_limit = |distance: f64| {
            let ratio = over_tail(distance);
            (ratio * (ratio - distance)).clamp(0.0, 1.0)
        };
        match (reading, self.step) {
            (Reading::Value(y), Some(step)) => {
                let steps = (true_value - y) / step;
                information((steps - steps.round()) * step, step, self.sigma)
            }
            (Reading::Value(_), None) => 1.0,
            (Reading::AtLeast(limit), _) => at_limit(self.below(limit, true_value)),
            (Reading::AtMost(limit), _) => at_limit(self.above(limit, true_value)),
            (Reading::Lost, _) => 0.0,
        }
    }

    /// By how many standard deviations the true value is below an upper limit.
    fn below(self, limit: f64, true_value: f64) -> f64 {
        (limit - true_value) / self.sigma
    }

    /// By how many standard deviations the true value is above a lower limit.
    fn above(self, limit: f64, true_value: f64) -> f64 {
        (true_value - limit) / self.sigma
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{FRAC_2_PI, LN_2};

    /// Limit less true value over the noise, ln P, score and information of a reading at an upper limit, by mpmath with 40 digits.
    const EXPECTED: [(f64, f64, f64, f64); 7] = [
        (
            -3.0,
            -0.001_350_809_964_748_193_8,
            0.004_437_839_042_125_664,
            0.013_333_211_541_740_806,
        ),
        (0.0, -LN_2, 0.797_884_560_802_865_4, FRAC_2_PI),
        (
            0.5,
            -1.175_911_761_593_618_6,
            1.141_077_770_368_064_5,
            0.731_519_592_844_121,
        ),
        (
            4.0,
            -10.360_101_486_527_29,
            4.225_607_144_489_471,
            0.953_327_161_602_577_4,
        ),
        (
            29.0,
            -424.787_419_909_730_16,
            29.034_401_237_736_326,
            0.998_819_339_511_232_5,
        ),
        (
            31.0,
            -484.853_963_627_179_3,
            31.032_191_276_777_725,
            0.998_965_858_410_046_6,
        ),
        (
            200.0,
            -20_006.217_280_898_19,
            200.004_999_750_031_24,
            0.999_975_003_749_218_9,
        ),
    ];

    #[test]
    fn readings_at_a_limit_are_those_of_mpmath() {
        for (distance, log_probability, score, information) in EXPECTED {
            let noise = Noise::new(None, 2e-6);
            let true_value = 5e-6 - distance * 2e-6;
            let mirrored = (Reading::AtMost(-5e-6), -true_value);
            for (reading, m, sign) in [
                (Reading::AtLeast(5e-6), true_value, 1.0),
                (mirrored.0, mirrored.1, -1.0),
            ] {
                // Rounding of the distance, 1e-16 of 5, times the score.
                let error = noise.log_probability(reading, m) - log_probability;
                assert!(
                    error.abs() < 1e-11 * log_probability.abs().max(1.0),
                    "{distance}"
                );
                let error = noise.score(reading, m) - sign * score;
                assert!(error.abs() < 1e-11 * score.abs().max(1.0), "{distance}");
                // The information is a difference of numbers of the size of the square of the distance.
                let error = noise.information(reading, m) - information;
                assert!(
                    error.abs() < 1e-11 * distance.powi(2).max(1.0),
                    "{distance}"
                );
            }
        }
    }
}
