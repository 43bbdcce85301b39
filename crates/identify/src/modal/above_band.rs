//! A mode above the band, of which the data show the flank only.

use super::parameters::ModalParameters;
use super::refine::refine;
use super::solution::{Problem, Solution, better};
use crate::FrfDatum;
use bench_plant::zeros::ModalTerm;

/// Lowest place of a mode above the band, as a multiple of its end.
const FIRST_PLACE: f64 = 1.1;
/// Ratio of one place to the one before. A step changes a frequency by up to 2 %, so that a mode between two places is reached in six.
const PLACE_RATIO: f64 = 1.25;
/// Number of places, up to 6.6 times the end of the band: the flank of a mode beyond is constant within 3 %.
const PLACES: i32 = 9;
/// Damping ratio at the start, of which the flank shows little.
const DAMPING_RATIO: f64 = 0.01;
/// A mode of a larger damping ratio is wide: no mechanical one.
const WIDE_DAMPING_RATIO: f64 = 0.2;
/// Number of places from which a mode is fitted, the best first.
const FITTED_PLACES: usize = 2;

/// The solution with a mode above the band in place of those that were added to `before`, if the last one reaches the end of the band and
/// the data do not tell that it is better.
///
/// The flank of a mode above the band has no peak. Steps from a start within the band end at a mode that is as wide as the band, of
/// the wrong sign, which describes the flank almost as well; further modes are then added to mend the rest. Where both describe the
/// data, the mode above the band is preferred: a mechanical mode has a damping ratio of some per cent. A light mode within the band and a
/// significant one are not replaced by one that describes the data less well.
pub(super) fn with_last_mode_above(
    problem: Problem<'_>,
    before: &Solution,
    next: Solution,
    tolerance: f64,
) -> Solution {
    let end_rad_s = end_of_band_rad_s(problem);
    let Some(last) = next.parameters.modes.last() else {
        return next;
    };
    if last.omega_rad_s * (1.0 + last.damping_ratio) < end_rad_s {
        return next;
    }
    let is_of_a_flank = last.omega_rad_s > end_rad_s || last.damping_ratio > WIDE_DAMPING_RATIO;
    let margin = if is_of_a_flank {
        problem.choice_decrease(next.chi2)
    } else {
        0.0
    };
    let is_significant = |solution: &Solution| problem.evidence(before, solution) > 1.0;
    match with_mode_above(problem, &before.parameters, tolerance) {
        Some(above)
            if above.chi2 < next.chi2 + margin
                && (is_significant(&above) || !is_significant(&next)) =>
        {
            above
        }
        _ => next,
    }
}

/// The frequency of the last mode of a solution, if it lies above the band.
pub(super) fn mode_above(problem: Problem<'_>, solution: &Solution) -> Option<f64> {
    let last = solution.parameters.modes.last()?;
    (last.omega_rad_s > end_of_band_rad_s(problem)).then_some(last.omega_rad_s)
}

/// The best solution with one more mode, above the band.
fn with_mode_above(
    problem: Problem<'_>,
    without: &ModalParameters,
    tolerance: f64,
) -> Option<Solution> {
    // A complex residue describes the flank of a filter or a lag as well, which has no frequency.
    if !without.has_real_residues() {
        return None;
    }
    let starts = best_places(problem, without).into_iter();
    let fitted = starts.map(|start| refine(problem, start.parameters, tolerance));
    fitted.reduce(better)
}

/// The places above the band where a mode describes the data best, with the best residues of all modes.
fn best_places(problem: Problem<'_>, without: &ModalParameters) -> Vec<Solution> {
    let end_rad_s = end_of_band_rad_s(problem);
    let places = (0..PLACES).map(|k| FIRST_PLACE * PLACE_RATIO.powi(k) * end_rad_s);
    let shown = places.filter(|omega_rad_s| problem.chain.is_below_nyquist(*omega_rad_s));
    let solutions = shown.map(|omega_rad_s| {
        let mode = ModalTerm {
            omega_rad_s,
            damping_ratio: DAMPING_RATIO,
            residue_per_kg: 0.0,
        };
        Solution::with_best_residues(problem, without.clone().with_mode(mode))
    });
    let mut solutions: Vec<Solution> = solutions.collect();
    solutions.sort_by(|a, b| a.chi2.total_cmp(&b.chi2));
    solutions.truncate(FITTED_PLACES);
    solutions
}

fn end_of_band_rad_s(problem: Problem<'_>) -> f64 {
    problem.data.last().map_or(0.0, FrfDatum::omega_rad_s)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::modal::measurement_chain::MeasurementChain;
    use crate::modal::{Estimate, FittedMode, InputPath, fit};
    use core::f64::consts::TAU;
    use nalgebra::Complex;
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64Mcg;

    const IN_BAND_HZ: f64 = 44.0;
    const RATE_HZ: f64 = 1000.0;

    fn chain(hold_s: f64) -> MeasurementChain {
        let lag_s = 0.0;
        InputPath { hold_s, lag_s }.chain(RATE_HZ)
    }

    /// Data from 5 to 78 Hz of a mode at 44 Hz and one above the band, with errors of this ratio of the response.
    fn data(chain: &MeasurementChain, above: ModalTerm, error_ratio: f64) -> Vec<FrfDatum> {
        let frequency_hz: Vec<f64> = (0..1460).map(|k| 5.0 + 0.05 * f64::from(k)).collect();
        let nodes = chain.nodes_at(&frequency_hz, 0.0);
        let observed = |mode: &ModalTerm| {
            let response = nodes.mean(&nodes.mode(mode), &nodes.delays(0.0));
            let residue = Complex::from(mode.residue_per_kg);
            response.into_iter().map(move |h| h * residue)
        };
        let within = mode(IN_BAND_HZ, 0.01, 1.0);
        let response: Vec<Complex<f64>> = observed(&within)
            .zip(observed(&above))
            .map(|(within, above)| within + above)
            .collect();
        let power: f64 = response.iter().map(Complex::norm_sqr).sum();
        let sigma = error_ratio * (power / response.len() as f64).sqrt();
        let mut random = Pcg64Mcg::seed_from_u64(7);
        let datum = |(frequency_hz, response): (f64, Complex<f64>)| FrfDatum {
            frequency_hz,
            spread_hz: 0.0,
            response: response + normal(&mut random) * sigma,
            variance: sigma * sigma,
        };
        frequency_hz.into_iter().zip(response).map(datum).collect()
    }

    fn mode(hz: f64, damping_ratio: f64, residue_per_kg: f64) -> ModalTerm {
        ModalTerm {
            omega_rad_s: TAU * hz,
            damping_ratio,
            residue_per_kg,
        }
    }

    /// A complex Gaussian number with E|z|^2 = 1.
    fn normal(random: &mut Pcg64Mcg) -> Complex<f64> {
        let mut uniform = || (random.next_u64() as f64 + 0.5) / u64::MAX as f64;
        let (radius, angle) = ((-uniform().ln()).sqrt(), TAU * uniform());
        Complex::from_polar(radius, angle)
    }

    /// Frequency, damping ratio, residue and error ratio. The higher the mode, the less of it is in the data.
    const ABOVE: [(f64, f64, f64, f64); 8] = [
        (85.0, 0.002, 1.0, 1e-3),
        (85.0, 0.05, -1.0, 1e-4),
        (147.0, 0.01, 0.3, 1e-5),
        (147.0, 0.03, -1.0, 1e-4),
        (200.0, 0.05, 1.0, 1e-4),
        (200.0, 0.002, -2.0, 3e-6),
        (300.0, 0.01, 1.0, 3e-6),
        (300.0, 0.03, -0.3, 1e-6),
    ];

    /// Frequency and residue are within 4.5 standard deviations, and no other mode is found.
    #[test]
    fn mode_above_the_band_is_found() {
        for hold_s in [0.0, 1.0 / RATE_HZ] {
            let chain = &chain(hold_s);
            for (hz, damping_ratio, residue, error_ratio) in ABOVE {
                let case = format!("hold {hold_s} s, {hz} Hz, residue {residue}");
                let above = mode(hz, damping_ratio, residue);
                let modes = modes_of(&data(chain, above, error_ratio), chain, &case);
                assert_eq!(modes.len(), 2, "{case}");
                assert_near(modes[1].frequency_hz(), hz, &case);
                assert_near(modes[1].residue_per_kg, residue, &case);
            }
        }
    }

    fn modes_of(data: &[FrfDatum], chain: &MeasurementChain, case: &str) -> Vec<FittedMode> {
        let fit = fit(data, chain);
        fit.unwrap_or_else(|error| panic!("{case}: {error}"))
            .modes()
    }

    fn assert_near(found: Estimate, truth: f64, case: &str) {
        let error = (found.value - truth) / found.sigma;
        assert!(error.abs() < 4.5, "{case}: {found:?}");
        // An estimate that tells nothing is none.
        assert!(found.sigma < 0.3 * truth.abs(), "{case}: {found:?}");
    }

    /// No mode above the band where the response has none: in its place a filter of second order, whose poles are damped by 70 %.
    #[test]
    fn remainder_of_a_filter_is_no_mode_of_a_frequency() {
        let chain = &chain(0.0);
        for corner_hz in [300.0, 1000.0] {
            let corner_rad_s = TAU * corner_hz;
            let filter = |s: Complex<f64>| {
                let x = s / corner_rad_s;
                (x * x + x * core::f64::consts::SQRT_2 + 1.0).inv()
            };
            let mut data = data(chain, mode(85.0, 0.01, 0.0), 1e-4);
            for datum in &mut data {
                datum.response *= filter(Complex::new(0.0, datum.omega_rad_s()));
            }
            let modes = modes_of(&data, chain, "filter");
            let light = modes.iter().filter(|mode| mode.damping_ratio.value < 0.1);
            assert_eq!(light.count(), 1, "{corner_hz} Hz: {modes:?}");
        }
    }
}
