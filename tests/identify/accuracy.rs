//! Bias of the local estimator on the stage.

use bench_identify::{EstimatorSettings, Frf, LocalModel, Signals, local};

use crate::identify::stage::{self, SampledPlant};

const BAND_HZ: (f64, f64) = (0.5, 450.0);

/// Equivalent noise bandwidth of a local parabola with cos^2 weights, divided by the half-width. With the moments of the weights
/// m2 = 1/3 - 2/pi^2 and m4 = 1/5 - 4/pi^2 + 24/pi^4, the kernel is cos^2(pi x/2) (m4 - m2 x^2)/(m4 - m2^2). 1 over the integral
/// of its square is 0.6894 (4/3 for a local constant).
const PARABOLA: f64 = 0.6894;

fn estimate(signals: &Signals) -> Frf {
    local::estimate(signals, BAND_HZ, &EstimatorSettings::default()).unwrap()
}

/// The estimate is within 0.1 % and 0.06 degrees of the plant at all frequencies.
///
/// The local model describes a single mode exactly. Three modes lie within 2.2 Hz (281.4, 282.0, 283.6 Hz, zeta = 0.005): the
/// contribution of the other two, a third of the response each, deviates from a parabola by 0.027 x^4 = 0.17 % with
/// x = 0.7 Hz/1.4 Hz, or 0.03 degrees. The bounds are twice these errors.
fn assert_close(frf: &Frf, plant: &SampledPlant) {
    for (f, h) in frf.frequency_hz.iter().zip(&frf.response) {
        let ratio = h / plant.response(*f);
        let (magnitude, phase_deg) = ((ratio.norm() - 1.0).abs(), ratio.arg().to_degrees().abs());
        assert!(
            magnitude < 0.001,
            "magnitude off by {} % at {f} Hz",
            100.0 * magnitude
        );
        assert!(
            phase_deg < 0.06,
            "phase off by {phase_deg} degrees at {f} Hz"
        );
    }
}

#[test]
fn noiseless_estimate_equals_the_sampled_plant_including_resonances() {
    let signals = stage::clean_run();
    let start = std::time::Instant::now();
    let frf = estimate(&signals);
    println!(
        "{} frequencies from {} samples in {:?}",
        frf.len(),
        signals.len(),
        start.elapsed()
    );
    assert_close(&frf, &SampledPlant::stage());
}

#[test]
fn sigma_of_the_local_parabola_covers_its_bias_at_peaks() {
    let settings = EstimatorSettings {
        curve: LocalModel::Polynomial,
        ..EstimatorSettings::default()
    };
    let frf = local::estimate(&stage::clean_run(), BAND_HZ, &settings).unwrap();
    let plant = SampledPlant::stage();
    for peak_hz in [29.27, 82.23, 85.78] {
        let k = frf.frequency_hz.partition_point(|f| *f < peak_hz);
        let off = (frf.response[k].norm() - plant.response(frf.frequency_hz[k]).norm()).abs();
        let sigma = frf.magnitude_sigma[k];
        assert!(
            off <= 2.0 * sigma && sigma <= 2.0 * off,
            "{peak_hz} Hz: off by {off}, sigma {sigma}"
        );
    }
}

#[test]
fn frequencies_rise_in_steps_below_the_resolution() {
    let settings = EstimatorSettings {
        curve: LocalModel::Polynomial,
        ..EstimatorSettings::default()
    };
    let frf = local::estimate(&stage::clean_run(), BAND_HZ, &settings).unwrap();
    let last = frf.len() - 1;
    let bin_hz = 1.0 / 120.0;
    assert!((frf.frequency_hz[0] - 0.5).abs() < 1e-9);
    assert!((449.4..=450.0).contains(&frf.frequency_hz[last]));
    // The half-width is 16 bins at low frequencies and 0.0025 of the frequency at high ones. The ripple of the chirp's spectrum changes it
    // by up to 5 %.
    assert!((frf.resolution_hz[0] / (PARABOLA * 16.0 * bin_hz) - 1.0).abs() < 0.05);
    assert!((frf.resolution_hz[last] / (PARABOLA * 0.0025 * 450.0) - 1.0).abs() < 0.05);
    for (pair, width) in frf.frequency_hz.windows(2).zip(&frf.resolution_hz) {
        let step = pair[1] - pair[0];
        assert!(step > 0.0 && step < *width, "{step} Hz at {} Hz", pair[0]);
    }
}

#[test]
fn offset_and_drift_leave_the_estimate_within_its_bounds() {
    assert_close(
        &estimate(&with_drift(stage::clean_run())),
        &SampledPlant::stage(),
    );
}

/// Without correction the spectrum of the drift, 5/(2 pi f) um s, is 0.8 um s at 1 Hz, against 0.006 um s of probe noise: sigma would
/// increase by a factor of 100.
#[test]
fn offset_and_drift_do_not_change_sigma() {
    let still = stage::with_noise(&stage::clean_run(), 2);
    let (still, drifting) = (estimate(&still), estimate(&with_drift(still.clone())));
    for (k, f) in still.frequency_hz.iter().enumerate() {
        let ratio = drifting.magnitude_sigma[k] / still.magnitude_sigma[k];
        assert!(
            (0.9..1.1).contains(&ratio),
            "{ratio} times as large at {f} Hz"
        );
    }
}

fn with_drift(mut signals: Signals) -> Signals {
    let samples = signals.len() as f64;
    for (k, y) in signals.output.iter_mut().enumerate() {
        *y += 1e-3 + 5e-6 * k as f64 / samples;
    }
    signals
}

/// A raised cosine of 0.5 A added to the chirp gives bin 0 of the input more energy than any other bin. The record has no quiet
/// interval from which the probe offset could be determined: bin 0 of the output contains only the subtracted mean.
#[test]
fn probe_offset_does_not_change_the_estimate_in_the_first_bin() {
    let chirp = stage::chirp_of(20.0, 0.0, 0.2);
    let turn = std::f64::consts::TAU / chirp.len() as f64;
    let raised_cosine = |k: usize| 0.25 - 0.25 * (turn * k as f64).cos();
    let input_a: Vec<f64> = chirp
        .iter()
        .enumerate()
        .map(|(k, u)| u + raised_cosine(k))
        .collect();
    let plant = SampledPlant::stage();
    let output_m = plant.simulate(&input_a).iter().map(|y| y + 1e-3).collect();
    let signals = Signals {
        rate_hz: stage::RATE_HZ,
        input: input_a,
        output: output_m,
    };
    let frf = local::estimate(&signals, (0.0, 10.0), &EstimatorSettings::default()).unwrap();
    assert!((frf.frequency_hz[0] - 1.0 / 20.2).abs() < 1e-12);
    for (f, h) in frf.frequency_hz.iter().zip(&frf.response) {
        // The response changes by (0.8/29)^2 over 16 bins of 0.05 Hz, which a parabola describes.
        assert!(
            (h / plant.response(*f) - 1.0).norm() < 0.01,
            "{h} at {f} Hz"
        );
    }
}

/// 599,999 is odd, 99,991 is a prime.
#[test]
fn accepts_records_of_any_length() {
    let signals = stage::clean_run();
    let cut = |from: usize, samples: usize| Signals {
        rate_hz: signals.rate_hz,
        input: signals.input[from..from + samples].to_vec(),
        output: signals.output[from..from + samples].to_vec(),
    };
    assert_close(&estimate(&cut(1, 599_999)), &SampledPlant::stage());
    let short = Signals {
        input: stage::chirp_of(15.0, 1.0, 4.0),
        ..signals.clone()
    };
    let mut short = Signals {
        output: SampledPlant::stage().simulate(&short.input),
        ..short
    };
    short.input.truncate(99_991);
    short.output.truncate(99_991);
    let frf = estimate(&short);
    let dc = SampledPlant::stage().response(0.5).norm();
    assert!((frf.response[0].norm() / dc - 1.0).abs() < 0.01);
}
