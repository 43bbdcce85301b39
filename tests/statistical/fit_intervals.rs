//! Coverage of the confidence intervals of the fit.
use bench_identify::modal::{Estimate, MeasurementChain, fit};
use bench_identify::verdict::zeros;

use bench_test_support::synthetic::{frf_data, stage};

const SEEDS: u64 = 200;

/// 95 % of 200 seeds: 190 +- 3.1, so that the limits are 3.9 and 2.9 standard deviations away.
const EXPECTED: std::ops::RangeInclusive<usize> = 178..=199;

#[test]
fn intervals_of_modes_contain_the_truth_in_95_percent_of_the_seeds() {
    for sigma_m_per_n in [1e-9, 3e-8] {
        let truth = stage();
        let mut covered = [[0; 3]; 3];
        for seed in 0..SEEDS {
            let modes = fit(
                &frf_data(&truth, 2e-4, sigma_m_per_n, seed),
                &MeasurementChain::Direct,
            )
            .unwrap()
            .modes();
            assert_eq!(modes.len(), 3, "{sigma_m_per_n} {seed}: {modes:?}");
            for ((mode, truth), covered) in modes.iter().zip(&truth).zip(&mut covered) {
                let within =
                    |e: Estimate, truth: f64| usize::from((e.value - truth).abs() < 1.96 * e.sigma);
                covered[0] += within(mode.omega_rad_s, truth.omega_rad_s);
                covered[1] += within(mode.damping_ratio, truth.damping_ratio);
                covered[2] += within(mode.residue_per_kg, truth.residue_per_kg);
            }
        }
        assert!(
            covered
                .iter()
                .flatten()
                .all(|covered| EXPECTED.contains(covered)),
            "{sigma_m_per_n}: {covered:?} of {SEEDS}"
        );
        let all: usize = covered.iter().flatten().sum();
        // Nine estimates: 9 x 190 +- 3 x 3.1 = 1710 +- 9.2; the bounds are 3.8 standard deviations away.
        assert!((1675..=1745).contains(&all), "{all}");
    }
}

#[test]
fn ellipses_of_complex_zeros_contain_the_truth_in_95_percent_of_the_seeds() {
    let truth = stage();
    let exact = bench_plant::zeros::ModalSum::new(truth.clone(), 0.0)
        .unwrap()
        .damped_zeros()
        .unwrap();
    let exact = exact
        .iter()
        .find(|zero| zero.s.re > 1.0 && zero.s.im > 0.0)
        .expect("CNMP")
        .s;
    let mut covered = 0;
    for seed in 0..SEEDS {
        let fit = fit(
            &frf_data(&truth, 2e-4, 1e-9, seed),
            &MeasurementChain::Direct,
        )
        .unwrap();
        let zeros = zeros(&fit).unwrap();
        let near = zeros
            .iter()
            .min_by(|a, b| (a.s - exact).norm().total_cmp(&(b.s - exact).norm()))
            .unwrap();
        let [[a, b], [_, d]] = near.covariance;
        let (x, y) = (near.s.re - exact.re, near.s.im - exact.im);
        // The 95 % ellipse: chi^2 of two degrees of freedom.
        covered += usize::from((d * x * x - 2.0 * b * x * y + a * y * y) / (a * d - b * b) < 5.991);
    }
    assert!(EXPECTED.contains(&covered), "{covered} of {SEEDS}");
}
