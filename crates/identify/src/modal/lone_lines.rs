//! Modes that one datum alone shows.
//!
//! A disturbance that repeats in every period, such as the mains with periods of whole seconds, shifts a single line. A mode of the
//! half-width b = zeta w on a line contributes r/(2 w b) there, and r/(2 w n D) to the n-th line beside it, with lines at the distance D.
//! With b far below D it describes any value of one line and leaves the others as they are. Of its power at the lines, the part
//!
//! ```text
//! 1 - (1/b^2) / sum over all n of 1/(b^2 + (n D)^2) = 1 - D/(pi b) tanh(pi b/D)
//! ```
//!
//! lies beside its own line: 42 % with 2 b = D, and (pi b/D)^2/3 if b is far below D. So only a mode whose half-power width 2 b is below D
//! can be that of one datum. Whether it is, the others decide, not its width: a light mode whose flanks exceed the noise is a mode. Without
//! the datum next to it, removing it must increase chi^2 by more than 3 ln 2N, what three parameters are worth (Bayesian information
//! criterion); its place is known, so that there is no choice of a place as in the search. If it does not,
//! while all data together need the mode, the datum alone shows it. (If they do not, other modes can take its place.) One datum determines
//! no mode: two numbers for w, zeta and r. It is left out, and the search is repeated.

use super::parameters::ModalParameters;
use super::prune::sigmas_of_residues;
use super::refine::refine_below;
use super::solution::{Problem, Solution};
use crate::FrfDatum;
use bench_plant::zeros::ModalTerm;

/// One of so many data may be left out, or [`MIN_LEFT_OUT`]: with more of them the data are no sum of modes.
const DATA_PER_LEFT_OUT: usize = 50;
/// As many may always be left out: the mains and harmonics.
const MIN_LEFT_OUT: usize = 4;
/// Data are left out at most this number of times, each before another search.
const MAX_ROUNDS: usize = 3;
/// Largest ratio of chi^2 to its expected value of modes that describe the data.
const DESCRIBED: f64 = 4.0;
/// Where chi^2 increases by this multiple of the limit without a mode, to first order, no other places of the other modes are tried: the mode
/// is there.
const CLEAR: f64 = 10.0;
/// See [`refine_below`]: the limit is some ten times larger than what is left of chi^2 with a thousand data.
const TOLERANCE: f64 = 1e-3;

/// The data of a fit, without those that were left out.
pub(super) struct UsedData {
    pub(super) data: Vec<FrfDatum>,
    /// The frequencies of the others.
    pub(super) left_out_hz: Vec<f64>,
    /// Largest number of data to leave out.
    most: usize,
    /// How often data were left out.
    rounds: usize,
}

impl UsedData {
    /// All data.
    pub(super) fn all(data: &[FrfDatum]) -> UsedData {
        UsedData {
            data: data.to_vec(),
            left_out_hz: Vec::new(),
            most: (data.len() / DATA_PER_LEFT_OUT).max(MIN_LEFT_OUT),
            rounds: 0,
        }
    }

    /// Whether some data, by their indices, are there and few enough to be left out.
    pub(super) fn can_leave_out(&self, lone: &[usize]) -> bool {
        let are_few = self.left_out_hz.len() + lone.len() <= self.most;
        !lone.is_empty() && are_few && self.rounds < MAX_ROUNDS
    }

    pub(super) fn leave_out(&mut self, lone: &[usize]) {
        let left_out = lone.iter().map(|k| self.data[*k].frequency_hz);
        self.left_out_hz.extend(left_out);
        self.left_out_hz.sort_by(f64::total_cmp);
        self.data = without(&self.data, lone);
        self.rounds += 1;
    }
}

/// The data that alone show a mode of a fit that describes them: their indices, rising.
pub(super) fn lone_data(problem: Problem<'_>, parameters: &ModalParameters) -> Vec<usize> {
    let chi2 = Solution::new(problem, parameters.clone()).chi2;
    if problem.misfit(chi2) > DESCRIBED {
        return Vec::new();
    }
    let modes = 0..parameters.modes.len();
    let lone = modes.filter_map(|mode| lone_datum(problem, parameters, mode));
    let mut lone: Vec<usize> = lone.collect();
    lone.sort_unstable();
    lone.dedup();
    lone
}

/// The datum that alone shows a mode.
fn lone_datum(problem: Problem<'_>, parameters: &ModalParameters, mode: usize) -> Option<usize> {
    let nearest = narrow_at(problem.data, &parameters.modes[mode])?;
    let fewer = parameters.without_mode(mode);
    let others = &without(problem.data, &[nearest]);
    let beside = Problem {
        chain: problem.chain,
        data: others,
        nodes: &problem.chain.nodes(others, parameters.delay_s),
    };
    let with_mode = Solution::new(beside, parameters.clone());
    let limit = presence(others.len()) * beside.misfit(with_mode.chi2);
    if increase_without(beside, &with_mode, mode) > CLEAR * limit {
        return None;
    }
    let enough = with_mode.chi2 + limit;
    let without_mode = refine_below(beside, fewer, TOLERANCE, enough);
    if without_mode.chi2 >= enough {
        return None;
    }
    is_needed(problem, parameters, without_mode.parameters).then_some(nearest)
}

/// The increase of chi^2 without a mode, if it were quadratic in the residue: (r/sigma)^2, with all parameters free. 0 if the data do not
/// determine them.
fn increase_without(problem: Problem<'_>, solution: &Solution, mode: usize) -> f64 {
    let Some(covariance) = solution.covariance(problem) else {
        return 0.0;
    };
    sigmas_of_residues(&solution.parameters, &covariance)[mode].powi(2)
}

/// Whether all data together need the mode that parameters, a start without it, lack.
fn is_needed(
    problem: Problem<'_>,
    parameters: &ModalParameters,
    without_mode: ModalParameters,
) -> bool {
    let with_mode = Solution::new(problem, parameters.clone());
    let significant = problem.significant_decrease(&parameters.residues);
    let enough = with_mode.chi2 + significant * problem.misfit(with_mode.chi2);
    refine_below(problem, without_mode, 0.0, enough).chi2 >= enough
}

/// By how much chi^2 must increase without a mode at a known place: 3 ln 2N.
fn presence(data: usize) -> f64 {
    3.0 * ((2 * data) as f64).ln()
}

/// The datum next to a mode within the data, if the half-power width of the mode is below the distance of the data there.
fn narrow_at(data: &[FrfDatum], mode: &ModalTerm) -> Option<usize> {
    let omega = mode.omega_rad_s;
    let above = data.partition_point(|datum| datum.omega_rad_s() < omega);
    let distance = |k: &usize| (data[*k].omega_rad_s() - omega).abs();
    let nearest = (above.saturating_sub(1)..(above + 1).min(data.len()))
        .min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
    let spacing = spacing_rad_s(data, nearest)?;
    let around = gap_rad_s(data, above).unwrap_or(spacing);
    let is_narrow = 2.0 * mode.damping_ratio * omega < spacing;
    let is_within = distance(&nearest) <= 0.5 * around;
    (is_narrow && is_within).then_some(nearest)
}

/// The distance of a datum from its nearest neighbour.
fn spacing_rad_s(data: &[FrfDatum], k: usize) -> Option<f64> {
    let gaps = [gap_rad_s(data, k), gap_rad_s(data, k + 1)];
    gaps.into_iter().flatten().min_by(f64::total_cmp)
}

/// The distance of a datum from the one below; `None` at the ends.
fn gap_rad_s(data: &[FrfDatum], k: usize) -> Option<f64> {
    let below = data.get(k.checked_sub(1)?)?;
    Some(data.get(k)?.omega_rad_s() - below.omega_rad_s())
}

fn without(data: &[FrfDatum], left_out: &[usize]) -> Vec<FrfDatum> {
    let kept = data.iter().enumerate();
    let kept = kept.filter(|(k, _)| !left_out.contains(k));
    kept.map(|(_, datum)| *datum).collect()
}

#[cfg(test)]
mod tests {
    use nalgebra::Complex;

    use super::*;
    use crate::modal::{MeasurementChain, ModalFit, fit};
    use rand_core::{Rng, SeedableRng};
    use rand_pcg::Pcg64;

    const SIGMA: f64 = 1e-8;

    fn term(hz: f64, damping_ratio: f64, residue_per_kg: f64) -> ModalTerm {
        ModalTerm {
            omega_rad_s: std::f64::consts::TAU * hz,
            damping_ratio,
            residue_per_kg,
        }
    }

    /// Of variance 1, half of it in each part.
    fn noise(random: &mut Pcg64) -> Complex<f64> {
        let unit = ((random.next_u64() >> 11) + 1) as f64 / (1u64 << 53) as f64;
        let turn = (random.next_u64() >> 11) as f64 / (1u64 << 53) as f64;
        Complex::from_polar((-unit.ln()).sqrt(), std::f64::consts::TAU * turn)
    }

    /// Lines of 1 Hz from 5 to 150 Hz, with the noise of [`SIGMA`].
    fn lines(modes: &[ModalTerm], seed: u64) -> Vec<FrfDatum> {
        let mut random = Pcg64::seed_from_u64(seed);
        let datum = |k: u32| {
            let s = Complex::new(0.0, std::f64::consts::TAU * f64::from(k));
            let parts = modes
                .iter()
                .map(|mode| mode.resonance(s) * mode.residue_per_kg);
            FrfDatum {
                frequency_hz: f64::from(k),
                spread_hz: 0.0,
                response: parts.sum::<Complex<f64>>() + noise(&mut random) * SIGMA,
                variance: SIGMA * SIGMA,
            }
        };
        (5..=150).map(datum).collect()
    }

    fn fitted(data: &[FrfDatum]) -> ModalFit {
        fit(data, &MeasurementChain::Direct).expect("modes")
    }

    fn stage() -> [ModalTerm; 2] {
        [term(30.2, 0.02, 1.0), term(82.4, 0.015, 0.6)]
    }

    /// Disturbances of 100 standard deviations at one line, and at four.
    #[test]
    fn a_disturbed_line_gives_no_mode_and_is_left_out() {
        for seed in 0..3 {
            for disturbed in [vec![50], vec![50, 100], vec![25, 50, 75, 125]] {
                let mut data = lines(&stage(), seed);
                for hz in &disturbed {
                    let line = &mut data[hz - 5];
                    line.response += Complex::from_polar(100.0 * SIGMA, *hz as f64);
                }
                let fit = fitted(&data);
                assert_eq!(fit.parameters.modes.len(), 2, "{seed} {disturbed:?}");
                let expected: Vec<f64> = disturbed.iter().map(|hz| *hz as f64).collect();
                assert_eq!(fit.left_out_hz, expected, "{seed}");
                // 2 x 146 - 8 degrees of freedom: a standard deviation of 8 %.
                let chi2 = fit.chi2_per_freedom;
                assert!((0.7..1.35).contains(&chi2), "{seed}: {chi2}");
            }
        }
    }

    /// A mode of half-width 0.12 Hz on a line, beside one, and between two of 1 Hz. At 1.5 Hz from it, its residue gives
    /// 0.01/(2 x 2 pi 120 x 2 pi 1.5) = 7e-7, 70 standard deviations. With the residue -0.01 just between two lines the search, which
    /// starts at lines, does not always find it: chi^2 then shows that a mode is missing.
    #[test]
    fn light_mode_that_shows_in_its_flanks_is_a_mode() {
        let [first, second] = stage();
        for (hz, residue) in [
            (120.0, 0.01),
            (120.0, -0.01),
            (120.1, 0.01),
            (120.1, -0.01),
            (120.25, 0.01),
            (120.25, -0.01),
            (120.5, 0.01),
        ] {
            let light = term(hz, 1e-3, residue);
            for seed in 0..2 {
                let fit = fitted(&lines(&[first, second, light], seed));
                let modes = fit.modes();
                assert_eq!(modes.len(), 3, "{hz}: {modes:?}");
                assert!(fit.left_out_hz.is_empty(), "{hz}: {:?}", fit.left_out_hz);
                let frequency_hz = modes[2].frequency_hz();
                let (found, sigma) = (frequency_hz.value, frequency_hz.sigma);
                // Five standard deviations.
                assert!((found - hz).abs() < 5.0 * sigma, "{hz}: {found} +- {sigma}");
                assert!(modes[2].residue_per_kg.value * residue > 0.0, "{modes:?}");
            }
        }
    }

    #[test]
    fn without_disturbances_no_line_is_left_out() {
        for seed in 0..12 {
            let fit = fitted(&lines(&stage(), 100 + seed));
            assert_eq!(fit.parameters.modes.len(), 2, "{seed}");
            assert!(fit.left_out_hz.is_empty(), "{seed}: {:?}", fit.left_out_hz);
        }
    }

    /// Seven disturbed lines of 146 are more than four.
    #[test]
    fn many_disturbed_lines_are_no_disturbance() {
        let mut data = lines(&stage(), 1);
        for hz in [15, 45, 60, 70, 100, 115, 140] {
            data[hz - 5].response += Complex::from_polar(300.0 * SIGMA, hz as f64);
        }
        let fit = fitted(&data);
        assert!(fit.left_out_hz.len() <= 4, "{:?}", fit.left_out_hz);
        assert!(fit.parameters.modes.len() > 2, "{:?}", fit.parameters);
    }

    #[test]
    fn mode_is_narrow_if_its_half_power_width_is_below_the_distance_of_the_lines() {
        let data = lines(&stage(), 1);
        // Widths of 0.98 and 1.02 Hz at 50 Hz; the line at 50 Hz has the index 45.
        assert_eq!(narrow_at(&data, &term(50.2, 0.0098, 1.0)), Some(45));
        assert_eq!(narrow_at(&data, &term(50.0, 0.0102, 1.0)), None);
        // Beyond the ends by more than half of the distance of the lines.
        assert_eq!(narrow_at(&data, &term(4.4, 1e-4, 1.0)), None);
        assert_eq!(narrow_at(&data, &term(150.4, 1e-4, 1.0)), Some(145));
        // A free body.
        assert_eq!(narrow_at(&data, &term(0.0, 0.0, 1.0)), None);
        assert_eq!(narrow_at(&data[..1], &term(5.0, 1e-4, 1.0)), None);
    }
}
