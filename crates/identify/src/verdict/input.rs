//! Input of a verdict, and the certainty that it requires.

use crate::modal::{FittedMode, MeasurementChain, ModalFit};
use crate::{Estimate, FrfDatum};

/// Largest number of looks of an experiment at its data.
pub const MAX_LOOKS: usize = 8;

/// How small the probability must be that a sign, or the side of a zero, is the opposite one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Certainty {
    error_probability: f64,
    quantile: f64,
}

impl Certainty {
    /// For one look at the data: 1e-3.
    pub const ONE_LOOK: Certainty = Certainty {
        error_probability: 1e-3,
        quantile: 3.090,
    };

    /// For each of up to [`MAX_LOOKS`] looks at data that grow until the verdict is certain: 1e-3/8. The probability that any of
    /// the looks gives a wrong side is then at most 1e-3 (Bonferroni's inequality), whatever the stopping rule.
    pub const REPEATED_LOOKS: Certainty = Certainty {
        error_probability: 1e-3 / MAX_LOOKS as f64,
        quantile: 3.662,
    };

    /// Whether an error of this probability is small enough.
    pub(super) fn allows(self, error_probability: f64) -> bool {
        error_probability <= self.error_probability
    }

    /// A normally distributed estimate is certain from this multiple of its standard deviation.
    pub(super) fn quantile(self) -> f64 {
        self.quantile
    }
}

/// What a verdict covers, and what it requires.
#[derive(Clone, Copy, Debug)]
pub struct VerdictScope {
    /// It covers modes and zeros up to here, in rad/s.
    pub up_to_rad_s: f64,
    /// The number of modes that must be found there, if it is known.
    pub expected_modes: Option<usize>,
    /// How certain signs and sides must be.
    pub certainty: Certainty,
    /// Duration of the excitation in seconds, if it is known, for what is to be changed.
    pub duration_s: Option<f64>,
}

impl VerdictScope {
    /// Up to a frequency, without a model, for one look at the data.
    pub fn up_to(up_to_rad_s: f64) -> VerdictScope {
        VerdictScope {
            up_to_rad_s,
            expected_modes: None,
            certainty: Certainty::ONE_LOOK,
            duration_s: None,
        }
    }

    /// The input of a verdict.
    pub fn input<'a>(
        self,
        fit: &'a ModalFit,
        frf_data: &'a [FrfDatum],
        chain: &'a MeasurementChain,
    ) -> VerdictInput<'a> {
        VerdictInput {
            fit,
            chain,
            frf_data,
            up_to_rad_s: self.up_to_rad_s,
            expected_modes: self.expected_modes,
            certainty: self.certainty,
            duration_s: self.duration_s,
        }
    }
}

/// Input of a verdict.
#[derive(Clone, Copy, Debug)]
pub struct VerdictInput<'a> {
    /// The fitted modes.
    pub fit: &'a ModalFit,
    /// The chain through which the mechanics were observed.
    pub chain: &'a MeasurementChain,
    /// The fitted data, frequencies rising.
    pub frf_data: &'a [FrfDatum],
    /// The verdict covers zeros and modes up to here, in rad/s.
    pub up_to_rad_s: f64,
    /// Number of modes of the model in that band with a residue between its actuator and its probe.
    pub expected_modes: Option<usize>,
    /// How certain signs and sides must be.
    pub certainty: Certainty,
    /// Duration of the excitation in seconds, if it is known.
    pub duration_s: Option<f64>,
}

impl VerdictInput<'_> {
    /// Whether the verdict covers an angular frequency: from the first datum to the upper limit.
    pub(super) fn covers(&self, omega_rad_s: f64) -> bool {
        let low_rad_s = self.frf_data.first().map_or(0.0, FrfDatum::omega_rad_s);
        omega_rad_s <= self.up_to_rad_s && omega_rad_s >= low_rad_s
    }

    /// Whether the sign of a residue is certain.
    pub(super) fn has_certain_sign(&self, mode: &FittedMode) -> bool {
        self.certainty.allows(mode.sign_error_probability())
    }

    /// Whether a residue is certainly not 0: the sign of a real one, or of a part of a complex one, is certain.
    pub(super) fn has_certain_residue(&self, mode: &FittedMode) -> bool {
        let is_certain = |part: Estimate| {
            let magnitude = Estimate {
                value: part.value.abs(),
                ..part
            };
            self.certainty.allows(magnitude.below_zero_probability())
        };
        self.has_certain_sign(mode) || mode.residue_imaginary_per_kg.is_some_and(is_certain)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantile_belongs_to_the_error_probability() {
        for certainty in [Certainty::ONE_LOOK, Certainty::REPEATED_LOOKS] {
            let at = |value| Estimate { value, sigma: 1.0 }.below_zero_probability();
            // The quantiles are rounded to 1e-3, and d ln p/dq is about -q - 1/q: 0.4 %.
            let ratio = at(certainty.quantile) / certainty.error_probability;
            assert!((0.995..1.005).contains(&ratio), "{certainty:?}: {ratio}");
        }
    }
}
