//! The delay of a fit with complex residues.
//!
//! exp(-s d) (r + q s) = r + (q - r d) s + ...: complex residues represent a delay as well, and the data determine neither
//! their common part nor the delay. The search varies both. For the result the delay is fixed where the imaginary parts are smallest:
//!
//! ```text
//! sum of w^2 (q + r d)^2 = min!           d = -sum of w^2 q r/sum of w^2 r^2
//! ```
//!
//! which is the delay itself if the residues are real. Poles do not depend on d, nor do zeros as long as the model describes the data.
//!
//! Samples of a held input represent a delay of whole periods exactly, by rotated residues and a constant, but a part of a period only
//! approximately. Of data with little noise chi^2 then has a minimum at each whole period from the delay, and only there the zeros are those of
//! the stage where the imaginary parts are smallest. So the change is also tried in whole periods.

use super::parameters::ModalParameters;
use super::refine::refine;
use super::solution::{Problem, Solution};
use crate::FrfDatum;

/// Largest number of changes of the delay.
const MAX_DELAY_CHANGES: usize = 4;
/// A change that turns the response by less than this angle in radians at the end of the band is negligible.
const NEGLIGIBLE_ANGLE_RAD: f64 = 1e-3;

/// A delay of less than this part of a period before the input is none.
const NEGLIGIBLE_DELAY_RATIO: f64 = 0.1;

/// Parameters with complex residues, refined at a fixed delay for which their imaginary parts are smallest; those with real residues as
/// they are.
pub(super) fn with_determined_delay(
    problem: Problem<'_>,
    start: ModalParameters,
) -> ModalParameters {
    if start.has_real_residues() {
        return start;
    }
    let start = ModalParameters {
        has_fixed_delay: true,
        ..start
    };
    let mut best = refine(problem, start, 0.0);
    let last_rad_s = problem.data.last().map_or(0.0, FrfDatum::omega_rad_s);
    for _ in 0..MAX_DELAY_CHANGES {
        let change_s = smallest_imaginary_parts_s(&best.parameters);
        let Some((next, change_s)) = changed(problem, &best, change_s) else {
            break;
        };
        best = next;
        if (change_s * last_rad_s).abs() < NEGLIGIBLE_ANGLE_RAD {
            break;
        }
    }
    best.parameters
}

/// The solution with the delay changed by this time, or else by the nearest whole number of periods, if it describes the data as well.
fn changed(problem: Problem<'_>, best: &Solution, change_s: f64) -> Option<(Solution, f64)> {
    let period_s = problem.chain.period_s();
    let whole_s = period_s.map(|period_s| period_s * (change_s / period_s).round());
    // Large imaginary parts of a stage may ask for an output that precedes its input.
    let least_s = -best.parameters.delay_s - NEGLIGIBLE_DELAY_RATIO * period_s.unwrap_or(0.0);
    let whole_s = whole_s.filter(|whole_s| *whole_s != 0.0 && *whole_s >= least_s);
    let changes = [Some(change_s), whole_s];
    changes.into_iter().flatten().find_map(|change_s| {
        let moved = best.parameters.clone().with_longer_delay(change_s);
        let next = refine(problem, moved, 0.0);
        let increase = next.chi2 - best.chi2;
        // The delay is worth one parameter, chi^2 a half of one each.
        (increase <= problem.misfit(best.chi2)).then_some((next, change_s))
    })
}

/// d in seconds: the change of the delay with the smallest imaginary parts; 0 if all real parts are 0.
fn smallest_imaginary_parts_s(parameters: &ModalParameters) -> f64 {
    let (mut product, mut square) = (0.0, 0.0);
    for (k, mode) in parameters.modes.iter().enumerate() {
        let (w2, r) = (mode.omega_rad_s.powi(2), mode.residue_per_kg);
        product += w2 * parameters.rate_s_per_kg(k) * r;
        square += w2 * r * r;
    }
    if square > 0.0 { -product / square } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use std::f64::consts::TAU;

    use nalgebra::Complex;

    use super::*;
    use crate::modal::{InputPath, Residues};
    use bench_plant::zeros::ModalTerm;

    const RATE_HZ: f64 = 300.0;

    /// Poles above the axis in rad/s with their residues: a chain of three masses with one damper.
    fn partial_fractions() -> [(Complex<f64>, Complex<f64>); 3] {
        let pole = |hz: f64, zeta: f64| Complex::new(-zeta, (1.0 - zeta * zeta).sqrt()) * TAU * hz;
        [
            (pole(11.8, 0.060), Complex::new(-2e-4, -3.5e-3)),
            (pole(33.7, 0.042), Complex::new(1.5e-4, -1.9e-3)),
            (pole(41.1, 0.014), Complex::new(2e-5, -6e-5)),
        ]
    }

    /// Samples of a held input, with noise of 1e-6 of the static response:
    /// H = sum of rho (e - 1)/p/(z - e) + conj with e = exp(p T), z = exp(s T).
    fn data() -> Vec<FrfDatum> {
        let response = |hz: f64| -> Complex<f64> {
            let z = Complex::new(0.0, TAU * hz / RATE_HZ).exp();
            let all = partial_fractions()
                .into_iter()
                .flat_map(|(p, rho)| [(p, rho), (p.conj(), rho.conj())]);
            let terms = all.map(|(p, rho)| {
                let e = (p / RATE_HZ).exp();
                rho * (e - 1.0) / p / (z - e)
            });
            terms.sum()
        };
        let variance = 1e-12 * response(0.0).norm_sqr();
        let datum = |k: u32| {
            let frequency_hz = 1.0 + 0.1 * f64::from(k);
            FrfDatum {
                frequency_hz,
                spread_hz: 0.0,
                response: response(frequency_hz),
                variance,
            }
        };
        (0..570).map(datum).collect()
    }

    /// The modes with an advance of a period, which rotated residues make up for.
    fn advanced() -> ModalParameters {
        let period_s = 1.0 / RATE_HZ;
        let (mut modes, mut rates) = (Vec::new(), Vec::new());
        for (pole, rho) in partial_fractions() {
            let rotated = rho * (-pole * period_s).exp();
            modes.push(ModalTerm {
                omega_rad_s: pole.norm(),
                damping_ratio: -pole.re / pole.norm(),
                residue_per_kg: -2.0 * (rotated * pole.conj()).re,
            });
            rates.push(2.0 * rotated.re);
        }
        ModalParameters {
            modes,
            residues: Residues::Complex(rates),
            delay_s: -period_s,
            ..ModalParameters::default()
        }
    }

    #[test]
    fn delay_of_samples_is_found_in_whole_periods() {
        let held = InputPath {
            hold_s: 1.0 / RATE_HZ,
            lag_s: 0.0,
        };
        let (data, chain) = (&data(), &held.chain(RATE_HZ));
        let nodes = &chain.nodes(data, 0.0);
        let problem = Problem { chain, data, nodes };
        let found = with_determined_delay(problem, advanced());
        assert!((found.delay_s * RATE_HZ).abs() < 0.02, "{}", found.delay_s);
        for (k, (pole, rho)) in partial_fractions().into_iter().enumerate() {
            // Within 1 %, as the delay is known within 2 % of a period: 0.4 degrees at 41 Hz.
            let residue = -2.0 * (rho * pole.conj()).re;
            let ratio = found.modes[k].residue_per_kg / residue;
            assert!((ratio - 1.0).abs() < 0.01, "{k}: {ratio}");
        }
    }
}
