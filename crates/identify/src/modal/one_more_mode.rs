//! One more mode than is significant: what else the data may show, with its probability.
//!
//! ```text
//! p = 1/(1 + exp((D - d)/2))        d: decrease of chi^2 by the mode        D: the smallest significant decrease
//! ```
//!
//! D has ln 2N for each parameter of the mode and 2 ln N for the choice of its place, so that exp((d - D)/2) approximates the probability of
//! the data with the mode over that without it (G. Schwarz, Estimating the dimension of a model, Annals of Statistics 6, 1978).

use super::parameters::ModalParameters;
use super::solution::{Problem, Solution};
use bench_plant::Sign;
use bench_plant::zeros::ModalTerm;

/// The best fit with one mode more than is significant.
#[derive(Clone, Debug, PartialEq)]
pub struct OneMoreMode {
    /// All modes, with this one.
    pub parameters: ModalParameters,
    /// Where the residual shows it, in rad/s; 0 for a free body.
    pub near_rad_s: f64,
    /// Probability that the stage has it.
    pub probability: f64,
    /// The smallest decrease of chi^2 that is significant.
    pub significant_decrease: f64,
}

impl OneMoreMode {
    /// `next` has a mode near a frequency that the solution does not have.
    pub(super) fn new(
        problem: Problem<'_>,
        solution: &Solution,
        next: Solution,
        near_rad_s: f64,
    ) -> OneMoreMode {
        let significant = problem.significant_decrease(&next.parameters.residues);
        let lacking = significant * (1.0 - problem.evidence(solution, &next));
        OneMoreMode {
            parameters: next.parameters,
            near_rad_s,
            probability: 1.0 / (1.0 + (0.5 * lacking).exp()),
            significant_decrease: significant,
        }
    }

    /// Whether a mode has a residue of the other sign with this one: that of the nearest mode.
    pub(super) fn turns(&self, mode: &ModalTerm) -> bool {
        let distance = |other: &ModalTerm| (other.omega_rad_s - mode.omega_rad_s).abs();
        let modes = self.parameters.modes.iter();
        let nearest = modes.min_by(|a, b| distance(a).total_cmp(&distance(b)));
        nearest.is_some_and(|near| Sign::of(near.residue_per_kg) != Sign::of(mode.residue_per_kg))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::FrfDatum;
    use crate::modal::{MeasurementChain, ModalFit, fit};
    use nalgebra::Complex;
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    /// E|error of G|^2 in (m/N)^2: 1e-3 of the response at rest.
    const VARIANCE: f64 = 2e-16;

    fn term(frequency_hz: f64, residue_per_kg: f64) -> ModalTerm {
        ModalTerm {
            omega_rad_s: std::f64::consts::TAU * frequency_hz,
            damping_ratio: 0.01,
            residue_per_kg,
        }
    }

    /// The fit of modes at 30 and 80 Hz, and of one at 55 Hz with this residue, from 5 to 105 Hz.
    fn fitted(residue_per_kg: f64, seed: u64) -> ModalFit {
        let modes = [term(30.0, 0.5), term(80.0, 0.5), term(55.0, residue_per_kg)];
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let mut normal = || {
            let mut uniform = || (random.next_u64() as f64 + 0.5) / u64::MAX as f64;
            (-2.0 * uniform().ln()).sqrt() * (std::f64::consts::TAU * uniform()).cos()
        };
        let datum = |k: u32| {
            let frequency_hz = 5.0 + 0.1 * f64::from(k);
            let s = Complex::new(0.0, std::f64::consts::TAU * frequency_hz);
            let error = Complex::new(normal(), normal()) * (0.5 * VARIANCE).sqrt();
            let of_mode = |mode: &ModalTerm| mode.resonance(s) * mode.residue_per_kg;
            let response: Complex<f64> = modes.iter().map(of_mode).sum();
            FrfDatum {
                frequency_hz,
                spread_hz: 0.0,
                response: response + error,
                variance: VARIANCE,
            }
        };
        let data: Vec<FrfDatum> = (0..1000).map(datum).collect();
        fit(&data, &MeasurementChain::Direct).expect("modes")
    }

    fn probability(fit: &ModalFit) -> f64 {
        let more = fit.one_more_mode.as_ref();
        more.expect("fewer modes than are allowed").probability
    }

    #[test]
    fn noise_alone_makes_one_more_mode_improbable() {
        // With a thousand data the smallest significant decrease is 3 ln 2000 + 2 ln 1000 = 36.6. Of three parameters noise decreases chi^2
        // by more than 22.8 (a probability of 1e-3) with 4e-5, and by more than 28.8 (0.02) with 2.5e-6. There are some thousand
        // places: the first is exceeded in 4 % of the records.
        let fits = (0..20).map(|seed| fitted(0.0, seed));
        let found: Vec<f64> = fits
            .inspect(|fit| assert_eq!(fit.parameters.modes.len(), 2))
            .map(|fit| probability(&fit))
            .collect();
        let negligible = found.iter().filter(|probability| **probability < 1e-3);
        assert!(negligible.count() >= 17, "{found:?}");
        assert!(
            found.iter().all(|probability| *probability < 0.02),
            "{found:?}"
        );
    }

    #[test]
    fn probability_is_a_half_where_the_mode_becomes_significant() {
        let seed = 0;
        let (mut hidden, mut found) = (0.0, 1e-3);
        for _ in 0..12 {
            let middle = 0.5 * (hidden + found);
            if fitted(middle, seed).parameters.modes.len() == 2 {
                hidden = middle;
            } else {
                found = middle;
            }
        }
        // The residue is known to 1e-3/2^12, a thousandth of itself, and d to 0.2 %.
        let fit = fitted(hidden, seed);
        let probability = probability(&fit);
        assert!((0.4..=0.5).contains(&probability), "{probability}");
        let near_hz = fit
            .one_more_mode
            .map(|more| more.near_rad_s / std::f64::consts::TAU);
        assert!(
            near_hz.is_some_and(|hz| (hz - 55.0).abs() < 2.0),
            "{near_hz:?}"
        );
    }

    #[test]
    fn sign_error_includes_one_more_mode_with_which_the_nearest_residue_has_the_other_sign() {
        let fit = fitted(0.0, 1);
        let with = |residue_per_kg: f64, probability: f64| {
            let mut parameters = fit.parameters.clone();
            parameters.modes[1].residue_per_kg = residue_per_kg;
            let fit = ModalFit {
                one_more_mode: Some(OneMoreMode {
                    parameters: parameters.with_mode(term(79.0, 0.9)),
                    near_rad_s: 0.0,
                    probability,
                    significant_decrease: 30.0,
                }),
                ..fit.clone()
            };
            let modes = fit.modes();
            let signs: String = modes.iter().map(|mode| mode.certain_sign()).collect();
            (
                modes[0].sign_error_probability(),
                modes[1].sign_error_probability(),
                signs,
            )
        };
        // Both residues are known to better than 1 %.
        let (first, second, signs) = with(-0.4, 0.2);
        assert!(
            first < 1e-12 && (second - 0.2).abs() < 1e-12,
            "{first} {second}"
        );
        assert_eq!(signs, "+?");
        assert_eq!(with(-0.4, 0.02).2, "++");
        let (_, second, signs) = with(0.4, 0.2);
        assert!(second < 1e-12, "{second}");
        assert_eq!(signs, "++");
    }
}
