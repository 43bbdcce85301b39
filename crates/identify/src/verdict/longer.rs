//! How much longer a record must be for a verdict.
//!
//! ```text
//! sigma ~ 1/sqrt(T)       d ~ T         T: duration of the same excitation        d: decrease of chi^2 by a mode
//! ```
//!
//! The amplitude has the same effect as the square root of the duration.

use core::fmt;

use super::Certainty;
use crate::Estimate;
use crate::modal::OneMoreMode;

/// A shorter excitation is a hit, which is repeated, and not made longer.
const LEAST_S: f64 = 1.0;

/// The duration over that of the record with which a quantity becomes certain, if it is what it seems to be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Longer {
    ratio: f64,
    /// Whether the quantity is so uncertain that only a lower limit of the ratio is known.
    is_least: bool,
    duration_s: Option<f64>,
}

impl Longer {
    /// For a quantity whose sign decides. One below its standard deviation may be of any smaller size.
    pub(super) fn for_sign(of: Estimate, certainty: Certainty, duration_s: Option<f64>) -> Longer {
        let size = of.value.abs();
        let is_known = size >= of.sigma;
        Longer {
            ratio: (certainty.quantile() * of.sigma / size.max(of.sigma)).powi(2),
            is_least: !is_known,
            duration_s,
        }
    }

    /// For one more mode, which belongs to the fit from the decrease D of chi^2 on: with p = 1/(1 + exp((D - d)/2)) the decrease that is
    /// seen is d = D - 2 ln(1/p - 1). If the mode is none, d does not grow, and p falls.
    pub(super) fn for_mode(more: &OneMoreMode, duration_s: Option<f64>) -> Longer {
        let significant = more.significant_decrease;
        let decrease = significant - 2.0 * (1.0 / more.probability - 1.0).ln();
        Longer {
            ratio: significant / decrease.max(1.0),
            is_least: decrease < 1.0,
            duration_s,
        }
    }
}

impl fmt::Display for Longer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if !self.ratio.is_finite() {
            return f.write_str("increase the amplitude there, or the duration");
        }
        let about = if self.is_least { "more than" } else { "about" };
        let ratio = self.ratio.max(1.1);
        let digits = usize::from(ratio < 10.0);
        write!(
            f,
            "increase the amplitude there, or the duration to {about} {ratio:.digits$} times"
        )?;
        match self.duration_s {
            Some(duration_s) if duration_s >= LEAST_S => write!(f, ", {:.0} s", ratio * duration_s),
            _ => Ok(()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modal::ModalParameters;

    fn estimate(value: f64, sigma: f64) -> Estimate {
        Estimate { value, sigma }
    }

    #[test]
    fn standard_deviation_falls_with_the_square_root_of_the_duration() {
        // 3.09 standard deviations are needed: 3.09^2 = 9.55, and for twice the value a quarter of it.
        let text = |value: f64, duration_s: Option<f64>| {
            Longer::for_sign(estimate(value, 1.0), Certainty::ONE_LOOK, duration_s).to_string()
        };
        let begin = "increase the amplitude there, or the duration to";
        assert_eq!(text(1.0, None), format!("{begin} about 9.5 times"));
        assert_eq!(
            text(-2.0, Some(20.0)),
            format!("{begin} about 2.4 times, 48 s")
        );
        assert_eq!(text(0.3, None), format!("{begin} more than 9.5 times"));
        assert_eq!(text(f64::NAN, None), format!("{begin} more than 9.5 times"));
        let unknown = estimate(1.0, f64::INFINITY);
        let text = Longer::for_sign(unknown, Certainty::ONE_LOOK, None).to_string();
        assert_eq!(text, "increase the amplitude there, or the duration");
    }

    #[test]
    fn evidence_of_a_mode_grows_with_the_duration() {
        let more = |probability: f64| OneMoreMode {
            parameters: ModalParameters::default(),
            near_rad_s: 100.0,
            probability,
            significant_decrease: 36.6,
        };
        let begin = "increase the amplitude there, or the duration to";
        // 2 ln 99 = 9.19 are lacking of 36.6, and of a probability of 1e-8 all of it, 36.84.
        let text = |probability: f64| Longer::for_mode(&more(probability), Some(20.0)).to_string();
        assert_eq!(text(0.01), format!("{begin} about 1.3 times, 27 s"));
        assert_eq!(text(1e-8), format!("{begin} more than 37 times, 732 s"));
        let hit = Longer::for_mode(&more(0.01), Some(0.01)).to_string();
        assert_eq!(hit, format!("{begin} about 1.3 times"));
    }
}
