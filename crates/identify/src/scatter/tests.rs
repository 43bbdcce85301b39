//! The estimate against noise of known standard deviation on a stage of two modes.

use std::f64::consts::TAU;

use rand_core::{Rng, SeedableRng};
use rand_pcg::Pcg64Mcg;

use super::*;

const SEEDS: u64 = 6;
/// Frequencies and damping ratios of the modes of the stage.
const MODES: [(f64, f64, f64); 2] = [(29.3, 0.009, 0.47), (118.0, 0.004, -0.05)];
const DELAY_S: f64 = 6e-4;

/// A stage of two modes with residues of both signs, in m/N, with a delay.
fn stage(hz: f64) -> Complex<f64> {
    let s = Complex::new(0.0, TAU * hz);
    let mode = |(at_hz, zeta, residue): (f64, f64, f64)| {
        let w = TAU * at_hz;
        Complex::from(residue) / (s * s + s * (2.0 * zeta * w) + w * w)
    };
    MODES.into_iter().map(mode).sum::<Complex<f64>>()
        * Complex::from_polar(1.0, -TAU * hz * DELAY_S)
}

/// A complex Gaussian number with E|z|^2 = 1.
fn normal(random: &mut Pcg64Mcg) -> Complex<f64> {
    let mut uniform = || (random.next_u64() as f64 + 0.5) / u64::MAX as f64;
    let (radius, angle) = ((-uniform().ln()).sqrt(), TAU * uniform());
    Complex::from_polar(radius, angle)
}

/// Errors with E|e|^2 = 1, each a weighted sum of neighbouring independent ones.
fn coupled(random: &mut Pcg64Mcg, count: usize, taps: &[f64]) -> Vec<Complex<f64>> {
    let independent: Vec<_> = (0..count + taps.len()).map(|_| normal(random)).collect();
    let power = taps.iter().map(|tap| tap * tap).sum::<f64>().sqrt();
    let sum = |near: &[Complex<f64>]| {
        let products = near.iter().zip(taps).map(|(e, tap)| e * *tap);
        products.sum::<Complex<f64>>() / power
    };
    independent
        .windows(taps.len())
        .take(count)
        .map(sum)
        .collect()
}

/// Estimated over true standard deviations of independent errors, over all seeds, with the frequencies.
fn ratios(grid_hz: &[f64], sigma: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    coupled_ratios(grid_hz, &[1.0], sigma)
}

fn coupled_ratios(grid_hz: &[f64], taps: &[f64], sigma: impl Fn(f64) -> f64) -> Vec<(f64, f64)> {
    let mut ratios = Vec::new();
    for seed in 0..SEEDS {
        let mut random = Pcg64Mcg::seed_from_u64(seed);
        let noise = coupled(&mut random, grid_hz.len(), taps);
        let measured = |(hz, e): (&f64, &Complex<f64>)| stage(*hz) + e * sigma(*hz);
        let response: Vec<_> = grid_hz.iter().zip(&noise).map(measured).collect();
        let scatter = Scatter::of(grid_hz, &response).expect("enough points");
        let found = grid_hz.iter().zip(scatter.variance);
        ratios.extend(found.map(|(hz, variance)| (*hz, variance.sqrt() / sigma(*hz))));
    }
    ratios
}

/// 800 lines from 0.25 Hz to 200 Hz: mode 1 is two lines wide, mode 2 four.
fn analyser() -> Vec<f64> {
    (1..=800).map(|k| 0.25 * f64::from(k)).collect()
}

fn quantile(ratios: &[(f64, f64)], part: f64) -> f64 {
    let mut sorted: Vec<f64> = ratios.iter().map(|(_, ratio)| *ratio).collect();
    sorted.sort_by(f64::total_cmp);
    sorted[(part * sorted.len() as f64) as usize]
}

/// Within so many lines of a mode.
fn near(ratios: &[(f64, f64)], lines: f64) -> Vec<(f64, f64)> {
    let is_near = |hz: f64| MODES.iter().any(|mode| (hz - mode.0).abs() <= 0.25 * lines);
    ratios
        .iter()
        .copied()
        .filter(|(hz, _)| is_near(*hz))
        .collect()
}

/// 400 points from 1 Hz to 200 Hz at a constant ratio of 1.3 %.
fn stepped() -> Vec<f64> {
    (0..400)
        .map(|k| 200_f64.powf(f64::from(k) / 400.0))
        .collect()
}

#[test]
fn estimate_is_the_standard_deviation_of_the_noise() {
    let at_rest = stage(0.0).norm();
    // From poor to good: one part in 100 to one in 10 000 of the static response.
    for part in [1e-2, 1e-3, 1e-4] {
        for (name, found) in [
            ("equal", ratios(&analyser(), |_| part * at_rest)),
            (
                "relative",
                ratios(&analyser(), |hz| part * stage(hz).norm()),
            ),
            ("stepped", ratios(&stepped(), |_| part * at_rest)),
        ] {
            // The median of (chi-square/28)^(1/2) of 28 degrees of freedom is 0.988; where a further model is used it has 26.
            let median = quantile(&found, 0.5);
            assert!((0.95..1.05).contains(&median), "{part} {name}: {median}");
            // Its first percentile is 0.70, that of 10 degrees of freedom 0.51; a tenth is for the choice of the models.
            let small = quantile(&found, 0.01);
            assert!((0.40..0.75).contains(&small), "{part} {name}: {small}");
        }
    }
}

#[test]
fn coupled_lines_and_smoothed_responses_have_their_standard_deviation() {
    let at_rest = stage(0.0).norm();
    let fine: Vec<f64> = (1..=2000).map(|k| 0.1 * f64::from(k)).collect();
    // Hann: weights of 1/4 of both neighbours give the correlation 0.44. The other is a mean of eleven points.
    for taps in [vec![0.25, 1.0, 0.25], vec![1.0; 11]] {
        let found = coupled_ratios(&fine, &taps, |_| 1e-3 * at_rest);
        let [small, median] = [0.1, 0.5].map(|part| quantile(&found, part));
        // Without regard of the correlation the first median would be 0.89.
        assert!((0.9..1.1).contains(&median), "{}: {median}", taps.len());
        assert!((0.7..0.9).contains(&small), "{}: {small}", taps.len());
    }
}

#[test]
fn estimate_near_lightly_damped_modes_may_be_larger_and_is_never_much_smaller() {
    let at_rest = stage(0.0).norm();
    for part in [1e-2, 1e-3, 1e-4] {
        for (name, found) in [
            ("equal", ratios(&analyser(), |_| part * at_rest)),
            (
                "relative",
                ratios(&analyser(), |hz| part * stage(hz).norm()),
            ),
        ] {
            let near = near(&found, 3.0);
            let median = quantile(&near, 0.5);
            assert!((0.8..2.0).contains(&median), "{part} {name}: {median}");
            let small = quantile(&near, 0.1);
            assert!((0.45..1.0).contains(&small), "{part} {name}: {small}");
        }
    }
}

#[test]
fn too_few_points_and_zeros_have_no_estimate() {
    let grid = &analyser()[..MIN_POINTS];
    let response: Vec<_> = grid.iter().map(|hz| stage(*hz)).collect();
    assert!(Scatter::of(grid, &response).is_some());
    assert!(Scatter::of(&grid[1..], &response[1..]).is_none());
    assert!(Scatter::of(grid, &[Complex::default(); MIN_POINTS]).is_none());
}

#[test]
fn points_made_equal_by_rounding_are_not_exact() {
    let grid = analyser();
    let mut random = Pcg64Mcg::seed_from_u64(1);
    let noisy = |(k, _): (usize, &f64)| match k {
        ..100 => Complex::from(1.0),
        _ => Complex::from(1.0) + normal(&mut random) * 0.01,
    };
    let response: Vec<_> = grid.iter().enumerate().map(noisy).collect();
    let found = Scatter::of(&grid, &response).expect("noise").variance;
    // Single precision: 6e-8.
    assert!(found.iter().all(|variance| *variance > 3e-15), "{found:?}");
}
