//! The frequencies up to which readings show the modes of a stage.
//!
//! Where the output moves by less than a step, readings may not change at all, and a mode there is not seen; nor is one that a sweep passes
//! while readings are lost. A trial mode of residue 1 at a frequency w gives the standard deviation with which the readings show its residue:
//!
//! ```text
//! sigma_r = (sum of I o^2/s^2)^-1/2       I: information of a reading, s: noise, o: output of the trial mode near its resonance
//! seen:     5 sigma_r/(2 zeta w^2) < |G(j w)|                      a mode as narrow as the narrowest one, with a peak as high as the response around w
//! ```
//!
//! A mode that is lower than the response around it has its zeros beside its pole, left of the imaginary axis. A higher one that is not seen
//! has no effect on the verdict if the number of CNMP pairs in the band is the same with it, of either sign, and with any residue up to
//! 5 sigma_r: a large hidden mode may have none where a smaller one has a pair. That is known of one hidden mode below all others. Above the
//! first one several may be hidden, which may have a pair where each of them alone has none.

use nalgebra::Complex;

use super::refine::{Likeliest, TimeRecord};
use bench_plant::zeros::{ModalSum, ModalTerm, cnmp_pairs};

/// Zeros may lie below a mode that is not seen, but not much below it: those beside it, as the response around it is that of other modes.
const BELOW_UNSEEN: f64 = 0.95;
/// Number of trial modes in the band.
const TRIALS: usize = 60;
/// The response is the largest one within this ratio of the frequency, because it vanishes near a zero.
const AROUND: f64 = 1.1;
/// Number of frequencies at which it is looked for.
const NODES: usize = 11;
/// Near its resonance the output of a mode is above this ratio of its largest value.
const NEAR_RESONANCE: f64 = 0.3;
/// A hidden mode with a peak below this ratio of the response around it has its zeros beside its pole.
const LEAST_HIDDEN: f64 = 0.1;
/// Below this ratio of the two, nothing is known of a hidden mode.
const MIN_HIDDEN_RATIO: f64 = 1e-6;
/// A residue of as many standard deviations is seen.
const SEEN_SIGMAS: f64 = 5.0;

impl TimeRecord<'_> {
    /// The frequency in rad/s up to which a mode from `from_rad_s` on is seen or has no effect on the verdict, at most `to_rad_s`.
    pub(super) fn seen_up_to_rad_s(
        &self,
        found: &Likeliest,
        (from_rad_s, to_rad_s): (f64, f64),
    ) -> Option<f64> {
        let sum = found.parameters.sum().ok()?;
        let zeta = least_damping(found);
        let ratio = (to_rad_s / from_rad_s).powf(1.0 / TRIALS as f64);
        let mut seen_rad_s = from_rad_s;
        for k in 1..=TRIALS {
            let trial_rad_s = from_rad_s * ratio.powi(k as i32);
            let delay_s = found.parameters.delay_s;
            let output = self.simulation.of_mode(trial_rad_s, zeta, delay_s);
            let sigma_per_kg = found.sigma / information(&output, &found.information).sqrt();
            let hidden = ModalTerm {
                omega_rad_s: trial_rad_s,
                damping_ratio: zeta,
                residue_per_kg: SEEN_SIGMAS * sigma_per_kg,
            };
            let peak = hidden.residue_per_kg / (2.0 * zeta * trial_rad_s * trial_rad_s);
            let around = largest_around(&sum, trial_rad_s);
            let is_seen = peak < around;
            let least = LEAST_HIDDEN * around / peak;
            if !is_seen && !has_no_effect(&sum, hidden, least, to_rad_s) {
                return Some(from_rad_s.max(BELOW_UNSEEN * seen_rad_s));
            }
            seen_rad_s = trial_rad_s;
        }
        Some(seen_rad_s)
    }
}

/// The sum of I o^2 over the readings in which the output of a mode is not small. Far from its resonance the residual of modes beyond the
/// band can take its place.
fn information(output: &[f64], of_readings: &[f64]) -> f64 {
    let largest = output.iter().fold(0.0_f64, |max, y| max.max(y.abs()));
    let pairs = output.iter().zip(of_readings);
    let near_resonance = pairs.filter(|(y, _)| y.abs() > NEAR_RESONANCE * largest);
    near_resonance
        .map(|(y, information)| y * y * information)
        .sum()
}

/// Whether a mode below all others, if it is hidden, leaves the number of CNMP pairs up to a frequency as it is.
fn has_no_effect(sum: &ModalSum, hidden: ModalTerm, least: f64, to_rad_s: f64) -> bool {
    let mut others = sum.terms().iter();
    let is_below = others.all(|mode| hidden.omega_rad_s < mode.omega_rad_s);
    is_below && keeps_pairs(sum, hidden, least, to_rad_s)
}

/// Whether a mode of either sign, with any residue from a ratio `least` of that of `hidden` up to it, leaves the number of CNMP pairs up to
/// a frequency as it is.
fn keeps_pairs(sum: &ModalSum, hidden: ModalTerm, least: f64, to_rad_s: f64) -> bool {
    let is_possible = hidden.residue_per_kg.is_finite() && least > MIN_HIDDEN_RATIO;
    let (true, Some(pairs)) = (is_possible, pairs_up_to(sum, to_rad_s)) else {
        return false;
    };
    let halved = std::iter::successors(Some(1.0), |ratio| Some(0.5 * ratio));
    let ratios = halved.take_while(|ratio| *ratio >= least);
    ratios.flat_map(|ratio| [ratio, -ratio]).all(|ratio| {
        let residue_per_kg = ratio * hidden.residue_per_kg;
        let mode = ModalTerm {
            residue_per_kg,
            ..hidden
        };
        pairs_with(sum, mode, to_rad_s) == Some(pairs)
    })
}

/// The number of CNMP pairs up to a frequency with one more mode, if it can be computed.
fn pairs_with(sum: &ModalSum, mode: ModalTerm, to_rad_s: f64) -> Option<usize> {
    let terms = sum.terms().iter().copied().chain([mode]).collect();
    let with_mode = ModalSum::new(terms, sum.constant_m_per_n()).ok()?;
    pairs_up_to(&with_mode, to_rad_s)
}

/// The number of CNMP pairs up to a frequency, if it can be computed.
fn pairs_up_to(sum: &ModalSum, to_rad_s: f64) -> Option<usize> {
    let mut zeros = sum.damped_zeros().ok()?;
    zeros.retain(|zero| zero.s.norm() <= to_rad_s);
    Some(cnmp_pairs(&zeros))
}

/// The largest magnitude of the response around a frequency.
fn largest_around(sum: &ModalSum, omega_rad_s: f64) -> f64 {
    let middle = (NODES / 2) as f64;
    let near = |k: usize| omega_rad_s * AROUND.powf((k as f64 - middle) / middle);
    let magnitudes = (0..NODES).map(|k| sum.response(Complex::new(0.0, near(k))).norm());
    magnitudes.fold(0.0, f64::max)
}

fn least_damping(found: &Likeliest) -> f64 {
    let modes = found.parameters.modes.iter();
    modes.map(|mode| mode.damping_ratio).fold(1.0, f64::min)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// With damping ratios of 0.01, modes at 100 and 300 rad/s of residue 1, and one at 250 rad/s: by the roots of its numerator
    /// (numpy.roots) the sum has a CNMP pair with residues of -1/16 to -1, and none with -2 to -64, or with a positive one.
    #[test]
    fn hidden_mode_may_change_the_number_of_pairs_by_a_smaller_residue_only() {
        let mode = |omega_rad_s, residue_per_kg| ModalTerm {
            omega_rad_s,
            damping_ratio: 0.01,
            residue_per_kg,
        };
        let sum = ModalSum::new(vec![mode(100.0, 1.0), mode(300.0, 1.0)], 0.0).expect("modes");
        let hidden = mode(250.0, 64.0);
        for (least, expected) in [(1.0 / 32.0, true), (1.0 / 64.0, false), (1e-3, false)] {
            assert_eq!(keeps_pairs(&sum, hidden, least, 1e3), expected, "{least}");
        }
        // The same mode may not be known at all.
        assert!(!keeps_pairs(&sum, hidden, 1e-7, 1e3));
    }

    /// With damping ratios of 0.01 and modes at 100 and 300 rad/s of residue 1: by numpy.roots, modes at 150 and 160 rad/s of residues -0.1 and
    /// 0.1 have a CNMP pair at 4.09 +- 154.4 j together, and each of them alone has none.
    #[test]
    fn several_hidden_modes_may_have_a_pair_where_one_has_none() {
        let mode = |omega_rad_s, residue_per_kg| ModalTerm {
            omega_rad_s,
            damping_ratio: 0.01,
            residue_per_kg,
        };
        let sum = ModalSum::new(vec![mode(100.0, 1.0), mode(300.0, 1.0)], 0.0).expect("modes");
        let hidden = [mode(150.0, -0.1), mode(160.0, 0.1)];
        for alone in hidden {
            assert!(keeps_pairs(&sum, alone, 0.5, 1e3));
            assert!(!has_no_effect(&sum, alone, 0.5, 1e3));
        }
        let [lower, upper] = hidden;
        let with_lower = [sum.terms(), &[lower]].concat();
        let with_lower = ModalSum::new(with_lower, 0.0).expect("modes");
        assert_eq!(pairs_with(&with_lower, upper, 1e3), Some(1));
        // Below all others.
        assert!(has_no_effect(&sum, mode(50.0, 1e-3), 0.5, 1e3));
    }
}
