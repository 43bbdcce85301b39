//! Signals and settings that cannot be used are rejected with value, limit and remedy.

use bench_identify::{Estimator, EstimatorSettings, Frf, IdentifyError, Signals, local, welch};
use proptest::prelude::*;

/// Signals that any estimator can process.
fn valid() -> Signals {
    let input_a: Vec<f64> = (0..200).map(|k| f64::from(k * k % 17) - 8.0).collect();
    let output_m = input_a.iter().map(|u| 1e-4 * u).collect();
    Signals {
        rate_hz: 1000.0,
        input: input_a,
        output: output_m,
    }
}

/// The error of both estimators.
fn rejection(signals: &Signals, band_hz: (f64, f64)) -> IdentifyError {
    let local = local::estimate(signals, band_hz, &EstimatorSettings::default()).unwrap_err();
    let welch = welch::estimate(signals, band_hz, 16, Estimator::H1).unwrap_err();
    // Both are the same error; only the spacing of the bins in the message differs.
    assert_eq!(
        std::mem::discriminant(&local),
        std::mem::discriminant(&welch),
        "{local} / {welch}"
    );
    local
}

fn assert_contains(error: &IdentifyError, parts: &[&str]) {
    let text = error.to_string();
    for part in parts {
        assert!(text.contains(part), "{part:?} is not in {text:?}");
    }
}

#[test]
fn accepts_valid_signals() {
    assert!(local::estimate(&valid(), (10.0, 400.0), &EstimatorSettings::default()).is_ok());
    assert!(welch::estimate(&valid(), (70.0, 400.0), 16, Estimator::H1).is_ok());
}

#[test]
fn rejects_constant_output() {
    let signals = Signals {
        output: vec![1.25e-3; 200],
        ..valid()
    };
    assert_contains(
        &rejection(&signals, (10.0, 400.0)),
        &[
            "output is 0.00125 at every",
            "200 samples",
            "check its range",
        ],
    );
}

#[test]
fn rejects_constant_input() {
    let signals = Signals {
        input: vec![0.0; 200],
        ..valid()
    };
    assert_contains(
        &rejection(&signals, (10.0, 400.0)),
        &[
            "input is 0 at every",
            "200 samples",
            "amplifier was enabled",
        ],
    );
}

#[test]
fn rejects_a_single_sample() {
    let signals = Signals {
        input: vec![1.0],
        output: vec![1e-4],
        ..valid()
    };
    assert_contains(
        &rejection(&signals, (10.0, 400.0)),
        &["1 samples", "at least 64", "longer"],
    );
}

#[test]
fn rejects_columns_of_different_lengths() {
    let signals = Signals {
        output: vec![0.0; 199],
        ..valid()
    };
    assert_contains(
        &rejection(&signals, (10.0, 400.0)),
        &["the input has 200 samples", "the output 199"],
    );
}

#[test]
fn rejects_samples_that_are_not_finite_with_column_and_index() {
    let mut signals = valid();
    signals.output[37] = f64::NAN;
    assert_contains(
        &rejection(&signals, (10.0, 400.0)),
        &["output is NaN at sample 37", "finite"],
    );
    signals.input[5] = f64::INFINITY;
    assert_contains(
        &rejection(&signals, (10.0, 400.0)),
        &["input is inf at sample 5", "finite"],
    );
}

#[test]
fn rejects_band_beyond_the_nyquist_frequency_with_the_limit() {
    assert_contains(
        &rejection(&valid(), (10.0, 501.0)),
        &[
            "501 Hz",
            "Nyquist frequency of 500 Hz",
            "lower its upper limit",
        ],
    );
}

#[test]
fn accepts_band_up_to_the_nyquist_frequency() {
    let frf = local::estimate(&valid(), (10.0, 500.0), &EstimatorSettings::default()).unwrap();
    assert_eq!(frf.frequency_hz.last(), Some(&495.0));
}

#[test]
fn rejects_inverted_and_non_finite_bands() {
    for band_hz in [
        (400.0, 10.0),
        (10.0, 10.0),
        (-1.0, 10.0),
        (f64::NAN, 10.0),
        (10.0, f64::NAN),
        (1.0, f64::INFINITY),
    ] {
        assert_contains(&rejection(&valid(), band_hz), &["0 <= lower < upper"]);
    }
}

#[test]
fn rejects_band_between_two_bins_with_their_distance() {
    let error = local::estimate(&valid(), (11.0, 14.0), &EstimatorSettings::default()).unwrap_err();
    assert_contains(
        &error,
        &["between 11 and 14 Hz", "spacing 5 Hz", "longer record"],
    );
    let error = welch::estimate(&valid(), (70.0, 100.0), 16, Estimator::H1).unwrap_err();
    assert_contains(&error, &["between 70 and 100 Hz", "spacing 62.5 Hz"]);
}

#[test]
fn rejects_invalid_sampling_rate() {
    for rate_hz in [0.0, -5000.0, f64::NAN, f64::INFINITY] {
        assert_contains(
            &rejection(&Signals { rate_hz, ..valid() }, (10.0, 400.0)),
            &["sampling rate", "above 0 Hz"],
        );
    }
}

#[test]
fn rejects_settings_out_of_bounds_with_name_value_and_bounds() {
    let wide = EstimatorSettings {
        resolution_ratio: 0.2,
        ..EstimatorSettings::default()
    };
    assert_contains(
        &local::estimate(&valid(), (10.0, 400.0), &wide).unwrap_err(),
        &["resolution_ratio is 0.2", "0 to 0.1"],
    );
    let one = EstimatorSettings {
        min_half_width_bins: 1,
        ..EstimatorSettings::default()
    };
    assert_contains(
        &local::estimate(&valid(), (10.0, 400.0), &one).unwrap_err(),
        &["min_half_width_bins is 1", "2 to 10000"],
    );
    assert_contains(
        &welch::estimate(&valid(), (10.0, 400.0), 7, Estimator::H1).unwrap_err(),
        &["segment is 7", "8 to 200"],
    );
    assert_contains(
        &welch::estimate(&valid(), (10.0, 400.0), 201, Estimator::H1).unwrap_err(),
        &["segment is 201", "8 to 200"],
    );
}

#[test]
fn rejects_a_single_segment_with_the_required_length() {
    assert_contains(
        &welch::estimate(&valid(), (10.0, 400.0), 150, Estimator::H1).unwrap_err(),
        &["200 samples", "at least 225"],
    );
}

/// Values of all kinds, most of them valid.
fn sample() -> impl Strategy<Value = f64> {
    prop_oneof![
        20 => -1.0..1.0,
        4 => Just(0.0),
        1 => Just(1e99),
        1 => Just(-1e99),
        1 => Just(1e-300),
        1 => prop::num::f64::NORMAL | prop::num::f64::SUBNORMAL | prop::num::f64::INFINITE,
    ]
}

fn limit() -> impl Strategy<Value = f64> {
    prop_oneof![10 => 0.0..60.0, 1 => any::<f64>()]
}

fn assert_valid(frf: &Frf, band_hz: (f64, f64)) {
    assert!(!frf.is_empty());
    let columns = [
        &frf.frequency_hz,
        &frf.coherence,
        &frf.magnitude_sigma,
        &frf.phase_sigma_rad,
        &frf.resolution_hz,
    ];
    assert!(
        columns
            .iter()
            .all(|column| column.len() == frf.response.len())
    );
    assert!(columns.iter().all(|column| {
        column
            .iter()
            .all(|number| number.is_finite() && *number >= 0.0)
    }));
    assert!(
        frf.response
            .iter()
            .all(|h| h.re.is_finite() && h.im.is_finite())
    );
    assert!(frf.coherence.iter().all(|coherence| *coherence <= 1.0));
    assert!(frf.frequency_hz.windows(2).all(|pair| pair[0] < pair[1]));
    let (low, high) = (frf.frequency_hz[0], frf.frequency_hz[frf.len() - 1]);
    assert!(low > 0.0 && low >= band_hz.0 * (1.0 - 1e-4) && high <= band_hz.1 * (1.0 + 1e-4));
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 2000, ..ProptestConfig::default() })]

    #[test]
    fn any_data_give_a_valid_response_or_an_error(
        input_a in prop::collection::vec(sample(), 0..300),
        outputs in prop::collection::vec(sample(), 300),
        lengths_agree in prop::bool::weighted(0.95),
        rate_hz in prop_oneof![10 => Just(100.0), 1 => any::<f64>()],
        band_hz in (limit(), limit()),
        half_width in 1_usize..40,
        ratio in 0.0..0.11,
        segment in 0_usize..310,
    ) {
        let samples = if lengths_agree { input_a.len() } else { outputs.len() };
        let signals = Signals { rate_hz, input: input_a, output: outputs[..samples].to_vec() };
        let settings = EstimatorSettings { min_half_width_bins: half_width, resolution_ratio: ratio, ..EstimatorSettings::default() };
        if let Ok(frf) = local::estimate(&signals, band_hz, &settings) {
            assert_valid(&frf, band_hz);
        }
        if let Ok(frf) = welch::estimate(&signals, band_hz, segment, Estimator::H1) {
            assert_valid(&frf, band_hz);
        }
    }
}
