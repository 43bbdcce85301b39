//! Identification in closed loop, on a loop simulated independently of the library.

use bench_identify::joint::estimate;
use bench_identify::{EstimatorSettings, Frf, SignalsError, local};
use bench_test_support::feedback_loop::{BAND_HZ, loop_gain, plant, run};
use nalgebra::Complex;

#[test]
fn noiseless_plant_loop_and_sensitivities_equal_the_model() {
    let joint = estimate(&run(0.0, 1), BAND_HZ, &EstimatorSettings::default()).unwrap();
    let one = Complex::new(1.0, 0.0);
    for (name, frf, truth) in [
        ("P", &joint.plant, &plant as &dyn Fn(f64) -> Complex<f64>),
        ("L", &joint.loop_gain, &loop_gain),
        ("S", &joint.sensitivity, &|f| one / (one + loop_gain(f))),
        ("T", &joint.complementary, &|f| {
            loop_gain(f) / (one + loop_gain(f))
        }),
    ] {
        assert!(frf.len() > 1000, "{name}");
        for (k, f) in frf.frequency_hz.iter().enumerate() {
            // An average over 16 bins of 0.05 Hz to either side would reduce a peak with a half-width of 0.4 Hz by two thirds. The
            // remaining error is the transient at the end of the record, exp(-0.02 * 2 pi 20 * 3.5) = 1.5e-4; the bound is twice that.
            let off = (frf.response[k] / truth(*f) - one).norm();
            assert!(off < 3e-4, "{name} at {f} Hz: off by {off}");
        }
    }
}

/// Just below the resonance |L| is near 1, and H1 is biased by the noise that the controller feeds back. Ten runs; the bound is
/// three standard errors of their mean. The statistical suite has sixty runs.
#[test]
fn noise_fed_back_by_the_controller_biases_h1_but_not_the_plant() {
    let (frequency_hz, settings) = (19.5, EstimatorSettings::default());
    let runs: Vec<_> = (0..10).map(|seed| run(0.6, seed)).collect();
    let relative = |frf: &Frf| {
        let at = frf.frequency_hz.partition_point(|f| *f < frequency_hz);
        frf.response[at] / plant(frf.frequency_hz[at]) - 1.0
    };
    let mean = |errors: &[Complex<f64>]| errors.iter().sum::<Complex<f64>>() / errors.len() as f64;
    let joint = runs
        .iter()
        .map(|run| relative(&estimate(run, BAND_HZ, &settings).unwrap().plant));
    let joint: Vec<Complex<f64>> = joint.collect();
    let direct = runs
        .iter()
        .map(|run| relative(&local::estimate(&run.signals, BAND_HZ, &settings).unwrap()));
    let direct: Vec<Complex<f64>> = direct.collect();
    let squares: f64 = joint.iter().map(Complex::norm_sqr).sum();
    let bound = 3.0 * squares.sqrt() / joint.len() as f64;
    let (joint, direct) = (mean(&joint).norm(), mean(&direct).norm());
    println!("joint {joint:.3}, H1 {direct:.3}, bound {bound:.3}");
    assert!(joint < bound && bound < 0.37, "{joint} within {bound}");
    assert!(direct > bound, "H1 is expected to be biased: {direct}");
}

#[test]
fn rejects_constant_reference_and_columns_of_different_lengths() {
    let mut signals = run(1e-3, 3);
    signals.reference_m.fill(0.0);
    let error = estimate(&signals, BAND_HZ, &EstimatorSettings::default()).unwrap_err();
    assert!(
        error.to_string().contains("no energy between 2 and 300 Hz"),
        "{error}"
    );
    signals.reference_m.pop();
    let reference = signals.reference_m.len();
    let error = SignalsError::ReferenceLength {
        reference,
        signals: reference + 1,
    };
    assert_eq!(
        estimate(&signals, BAND_HZ, &EstimatorSettings::default()).unwrap_err(),
        error.into()
    );
}
