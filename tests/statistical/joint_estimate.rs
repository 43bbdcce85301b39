//! Bias and confidence intervals of identification in closed loop.

use bench_identify::joint::estimate;
use bench_identify::{EstimatorSettings, local};
use bench_test_support::feedback_loop::{BAND_HZ, POLE, plant, run};
use nalgebra::Complex;

/// Just below the resonance |L| is near 1, and noise and reference have the same magnitude in a bin. There H1 from command to position
/// is biased from P towards -1/C. The estimate with the reference as instrumental variable is not biased.
#[test]
fn noise_fed_back_by_the_controller_does_not_bias_the_plant() {
    let (frequency_hz, seeds) = (19.5, 60);
    let (mut joint_mean, mut direct_mean) = (Complex::new(0.0, 0.0), Complex::new(0.0, 0.0));
    let mut squares = 0.0;
    for seed in 0..seeds {
        let signals = run(0.6, seed);
        let joint = estimate(&signals, BAND_HZ, &EstimatorSettings::default()).unwrap();
        let direct =
            local::estimate(&signals.signals, BAND_HZ, &EstimatorSettings::default()).unwrap();
        let at = joint
            .plant
            .frequency_hz
            .partition_point(|f| *f < frequency_hz);
        let ratio = joint.plant.response[at] / plant(joint.plant.frequency_hz[at]);
        joint_mean += ratio / seeds as f64;
        squares += (ratio - 1.0).norm_sqr() / seeds as f64;
        direct_mean += direct.response[at] / plant(direct.frequency_hz[at]) / seeds as f64;
    }
    // Standard error of the mean of 60 values; the bound is three times that.
    let bound = 3.0 * (squares / seeds as f64).sqrt();
    assert!(
        (joint_mean - 1.0).norm() < bound && bound < 0.15,
        "{joint_mean} within {bound}"
    );
    assert!(
        (direct_mean - 1.0).norm() > 2.0 * bound,
        "H1 is expected to be biased: {direct_mean}"
    );
}

#[test]
fn confidence_intervals_contain_the_truth_in_93_to_97_percent() {
    let (mut inside, mut all) = (0, 0);
    for seed in 100..300 {
        let joint = estimate(&run(1e-3, seed), BAND_HZ, &EstimatorSettings::default()).unwrap();
        let frf = &joint.plant;
        for k in (0..frf.len())
            .step_by(7)
            .filter(|k| (frf.frequency_hz[*k] / POLE.0 - 1.0).abs() > 0.1)
        {
            let off = (frf.response[k].norm() - plant(frf.frequency_hz[k]).norm()).abs();
            inside += usize::from(off < 1.96 * frf.magnitude_sigma[k]);
            all += 1;
        }
    }
    let share = inside as f64 / all as f64;
    assert!((0.93..0.97).contains(&share), "{share} of {all}");
}
