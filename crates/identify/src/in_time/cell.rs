//! How probable a rounded reading is: the true value plus normal noise of standard deviation s lies within its cell.
//!
//! ```text
//! P = Phi(b) - Phi(a)                      a, b: the ends of the cell less the true value m, over s
//! score = s d ln P/dm = (phi(a) - phi(b))/P
//! information = s^2 E(d ln P/dm)^2 = sum over the cells of (phi(a) - phi(b))^2/P
//! ```
//!
//! Without rounding the score is the error over s, and the information is 1. Source: Wang, Yin, Zhang and Zhao, "System identification
//! with quantized observations", Birkhaeuser 2010, chapter 3.

use core::f64::consts::{FRAC_1_SQRT_2, PI};

/// From here on, the tail of the normal distribution is computed by its asymptotic series: the next term is below 2e-12.
const FAR: f64 = 30.0;
/// Beyond this number of standard deviations, a normal number changes a sum of 1e5 probabilities by less than 1e-10.
const REACH: f64 = 8.0;
/// From this ratio of the step on, the standard deviation makes information the same at all places of a cell to 0.1 %.
const LARGE_SIGMA_STEPS: f64 = 0.6;

/// A rounded reading with its true value and its noise.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    /// The end nearer to 0 and the other one, less the true value, over the standard deviation; the cell above the true value or, if it
    /// contains that, with its farther end above.
    near: f64,
    far: f64,
    /// Whether the ends are mirrored for that.
    is_mirrored: bool,
}

impl Cell {
    /// The reading of a true value, if readings are multiples of `step`, apart from a constant.
    pub(super) fn new(reading: f64, true_value: f64, step: f64, sigma: f64) -> Cell {
        let centre = reading - true_value;
        Cell {
            near: (centre.abs() - 0.5 * step) / sigma,
            far: (centre.abs() + 0.5 * step) / sigma,
            is_mirrored: centre < 0.0,
        }
    }

    /// Whether the true value is that far within the cell that the reading is certain.
    fn is_certain(self) -> bool {
        self.near < -REACH
    }

    /// ln P.
    pub(super) fn log_probability(self) -> f64 {
        if self.is_certain() {
            0.0
        } else if self.near < FAR {
            libm::log(self.probability())
        } else {
            log_tail(self.near)
        }
    }

    /// s d ln P/dm.
    pub(super) fn score(self) -> f64 {
        if self.is_certain() {
            return 0.0;
        }
        let score = if self.near < FAR {
            (density(self.near) - density(self.far)) / self.probability()
        } else {
            over_tail(self.near)
        };
        if self.is_mirrored { -score } else { score }
    }

    /// P. The other end is at least a step, and a step at least a standard deviation away: no difference of numbers that are nearly equal.
    fn probability(self) -> f64 {
        tail(self.near) - tail(self.far)
    }
}

/// The information of a reading of a true value that is `offset`, at most half a step, above the middle of its cell.
pub(super) fn information(offset: f64, step: f64, sigma: f64) -> f64 {
    let steps = step / sigma;
    if steps * LARGE_SIGMA_STEPS < 1.0 {
        // The variance with that of the rounding errors, step^2/12.
        return 1.0 / (1.0 + steps * steps / 12.0);
    }
    let middle = Cell::new(0.0, offset, step, sigma);
    if middle.is_certain() {
        return 0.0;
    }
    let part = |near: f64, far: f64| {
        let change = density(near) - density(far);
        change * change / (tail(near) - tail(far)).max(f64::MIN_POSITIVE)
    };
    let beyond = |first: f64| {
        let ends = (0..).map(|k| first + f64::from(k) * steps);
        let cells = ends.take_while(|end| *end < REACH);
        cells.map(|end| part(end, end + steps)).sum::<f64>()
    };
    part(middle.near, middle.far) + beyond(-middle.near) + beyond(middle.far)
}

/// ln of the probability of a standard normal number above x.
pub(super) fn log_tail_of_normal(x: f64) -> f64 {
    if x < FAR {
        libm::log(tail(x))
    } else {
        log_tail(x)
    }
}

/// The density of a standard normal number at x over the probability of one above x.
pub(super) fn over_tail(x: f64) -> f64 {
    if x < FAR {
        density(x) / tail(x)
    } else {
        libm::exp(-0.5 * x * x - log_tail(x)) / (2.0 * PI).sqrt()
    }
}

/// The probability of a standard normal number above x.
fn tail(x: f64) -> f64 {
    0.5 * libm::erfc(x * FRAC_1_SQRT_2)
}

/// ln of the probability of a standard normal number above a large x.
fn log_tail(x: f64) -> f64 {
    let square = 1.0 / (x * x);
    let series =
        libm::log1p(-square * (1.0 - 3.0 * square * (1.0 - 5.0 * square * (1.0 - 7.0 * square))));
    -0.5 * x * x - libm::log(x * (2.0 * PI).sqrt()) + series
}

/// The density of a standard normal number at x.
fn density(x: f64) -> f64 {
    libm::exp(-0.5 * x * x) / (2.0 * PI).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use core::f64::consts::{FRAC_2_PI, LN_2};

    /// True value and standard deviation over the step, ln P and score of the reading 0, by mpmath with 60 digits. In the last two the
    /// true value is 50 and 65 standard deviations outside of the cell.
    const EXPECTED: [(f64, f64, f64, f64); 8] = [
        (0.0, 1.0, -0.959_916_333_695_622_3, 0.0),
        (0.0, 10.0, -3.221_940_223_426_453, 0.0),
        (0.0, 0.01, 0.0, 0.0),
        (0.3, 0.2, -0.172_791_423_328_125, -0.287_451_724_607_027),
        (0.5, 0.001, -LN_2, -0.797_884_560_802_865_4),
        (0.55, 0.02, -5.081_648_277_278_69, -2.822_744_797_663_907),
        (3.0, 0.05, -1_254.831_361_139_42, -50.019_984_031_905_64),
        (-7.0, 0.1, -2_117.593_562_349_603, 65.015_377_341_329_91),
    ];

    #[test]
    fn probability_and_score_are_those_of_mpmath() {
        for (true_value, sigma, log_probability, score) in EXPECTED {
            let step = 3e-6;
            let cell = Cell::new(0.0, true_value * step, step, sigma * step);
            let error = (cell.log_probability() - log_probability).abs();
            // The rounding of the ends, 1e-16 of 65, times the score of 65.
            assert!(error < 1e-12 * log_probability.abs().max(1.0), "{cell:?}");
            let error = (cell.score() - score).abs();
            assert!(error < 1e-11 * score.abs().max(1.0), "{cell:?}");
        }
    }

    #[test]
    fn information_is_that_of_mpmath() {
        // Offset and standard deviation over the step, and the accuracy: above 0.6 that of the mean over the places in a cell.
        for (offset, sigma, expected, accuracy) in [
            (0.0, 1.0, 0.923_084_815_470_59, 1e-5),
            (0.0, 0.6, 0.811_851_484_694_47, 2e-4),
            (0.2, 0.3, 0.495_135_764_776_88, 1e-12),
            (0.5, 0.01, FRAC_2_PI, 1e-12),
            (0.47, 0.02, 0.269_068_520_175_81, 1e-12),
            (0.0, 0.05, 0.0, 1e-20),
        ] {
            let found = information(offset, 1.0, sigma);
            assert!((found - expected).abs() < accuracy, "{offset}: {found}");
        }
    }
}
