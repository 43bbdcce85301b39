//! Averages over periods: exact without noise, and with correct standard deviations.
use bench_identify::IdentifyError;
use bench_identify::periodic::{Repetition, estimate};
use bench_identify::settling::settling_periods;

use crate::external::python;
use crate::external::signals::{PERIOD, multisine, response};

const BAND_HZ: (f64, f64) = (5.0, 200.0);

fn repetition(skip: usize) -> Repetition {
    Repetition {
        period: PERIOD,
        skip,
    }
}

fn lines(step: usize) -> Vec<usize> {
    (5..=200).step_by(step).collect()
}

#[test]
fn response_is_exact_despite_drift_and_a_settling_first_period() {
    let mut signals = multisine(&lines(1), 8, 3e-3, 0.0, 1);
    signals.output[..PERIOD]
        .iter_mut()
        .enumerate()
        .for_each(|(n, y)| *y += 1e-2 * (-(n as f64) / 30.0).exp());
    let periods = estimate(&signals, BAND_HZ, repetition(1)).unwrap();
    assert_eq!((periods.count, periods.frf.len()), (6, 196));
    for (f, h) in periods.frf.frequency_hz.iter().zip(&periods.frf.response) {
        let exact = response(*f);
        // 1000 samples of 0.02 with a rounding of 1e-15 each, relative to a line of 1e-6 x 500: 1e-15 x 0.02 x sqrt(1000)/5e-4.
        assert!(
            (h - exact).norm() < 1e-10 + 1e-9 * exact.norm(),
            "{f} Hz: {h} is not {exact}"
        );
    }
}

#[test]
fn reports_excited_lines_only() {
    let periods = estimate(
        &multisine(&lines(5), 6, 0.0, 1e-7, 2),
        BAND_HZ,
        repetition(0),
    )
    .unwrap();
    let hz: Vec<f64> = lines(5).iter().map(|f| *f as f64).collect();
    assert_eq!(periods.frf.frequency_hz, hz);
    assert!(periods.frf.resolution_hz.iter().all(|width| *width == 1.0));
}

#[test]
fn distortion_of_a_measured_input_is_no_excitation() {
    // Odd lines, and between them lines of the input of 2 %, to which the output does not respond.
    let odd: Vec<usize> = (5..=199).step_by(2).collect();
    let even: Vec<usize> = (6..=198).step_by(2).collect();
    let mut signals = multisine(&odd, 6, 0.0, 1e-7, 2);
    let distortion = multisine(&even, 6, 0.0, 0.0, 3).input;
    for (input, distortion) in signals.input.iter_mut().zip(distortion) {
        *input += 0.02 * distortion;
    }
    let periods = estimate(&signals, BAND_HZ, repetition(0)).unwrap();
    let hz: Vec<f64> = odd.iter().map(|f| *f as f64).collect();
    assert_eq!(periods.frf.frequency_hz, hz);
}

#[test]
fn distortion_beside_a_band_of_all_lines_is_no_excitation() {
    // Every line from 20 to 120 Hz, and 5 % of distortion with irregular amplitudes below and above.
    let band: Vec<usize> = (20..=120).collect();
    let beside: Vec<usize> = (5..20).chain(121..=200).collect();
    let mut signals = multisine(&band, 6, 0.0, 1e-7, 2);
    for (k, line) in beside.iter().enumerate() {
        let amplitude = 0.05 * (1.0 + 0.8 * (3.0 * k as f64).sin()) / 1.8;
        let distortion = multisine(&[*line], 6, 0.0, 0.0, 3).input;
        for (input, distortion) in signals.input.iter_mut().zip(distortion) {
            *input += amplitude * distortion;
        }
    }
    let periods = estimate(&signals, (0.0, 500.0), repetition(0)).unwrap();
    let hz: Vec<f64> = band.iter().map(|f| *f as f64).collect();
    assert_eq!(periods.frf.frequency_hz, hz);
}

#[test]
fn periods_in_which_the_plant_settles_are_skipped() {
    let settling = |decay: f64, sigma: f64| {
        let mut signals = multisine(&lines(1), 12, 1e-4, sigma, 1);
        let transient = |n: usize| 1e-3 * (-(n as f64) / (decay * PERIOD as f64)).exp();
        let samples = signals.output.iter_mut().enumerate();
        samples.for_each(|(n, y)| *y += transient(n));
        settling_periods(&signals, PERIOD).unwrap()
    };
    // The transient is below the noise of 1e-7 after ln(1e4) = 9.2 decays, as an RMS over a period a little earlier.
    let skipped = settling(0.3, 1e-7);
    assert!((2..=3).contains(&skipped), "{skipped}");
    assert_eq!(settling(0.01, 1e-3), 0);
    // At most half of the 11 periods are skipped.
    assert!((3..=5).contains(&settling(2.0, 1e-9)));
}

#[test]
fn weak_lines_of_the_same_pattern_are_excited() {
    let lines: Vec<usize> = (5..=199).step_by(2).collect();
    let (weak, strong) = lines.split_at(20);
    let mut signals = multisine(strong, 6, 0.0, 1e-7, 2);
    let more = multisine(weak, 6, 0.0, 0.0, 3);
    for (input, more) in signals.input.iter_mut().zip(&more.input) {
        *input += 0.1 * more;
    }
    for (output, more) in signals.output.iter_mut().zip(&more.output) {
        *output += 0.1 * more;
    }
    let periods = estimate(&signals, BAND_HZ, repetition(0)).unwrap();
    assert_eq!(periods.frf.len(), lines.len());
}

#[test]
fn errors_match_their_standard_deviations() {
    let (mut ratio, mut count) = (0.0, 0.0);
    for seed in 0..20 {
        let periods = estimate(
            &multisine(&lines(1), 12, 0.0, 1e-6, seed),
            BAND_HZ,
            repetition(1),
        )
        .unwrap();
        for datum in &periods.frf.data {
            ratio += (datum.response - response(datum.frequency_hz)).norm_sqr() / datum.variance;
            count += 1.0;
        }
    }
    // Expected with P = 10 periods: (P - 1)/(P - 2) = 1.125, with a standard error of 1.5/sqrt(3920) = 2.4 %. The correction of drift adds
    // an error that is correlated between neighbouring periods; it increases the variance estimate more than the error of the mean, so
    // that the lower limit is wider.
    let mean: f64 = ratio / count;
    assert!((0.95..1.22).contains(&mean), "{mean}");
}

#[test]
fn response_and_variance_equal_numpy() {
    let signals = multisine(&lines(3), 7, 1e-3, 1e-6, 3);
    let rows: String = signals
        .input
        .iter()
        .zip(&signals.output)
        .map(|(u, y)| format!("{u:e} {y:e}\n"))
        .collect();
    let arguments = [
        PERIOD.to_string(),
        "2".into(),
        "5".into(),
        "200".into(),
        "3".into(),
    ];
    let arguments: Vec<&str> = arguments.iter().map(String::as_str).collect();
    let Some(reference) = python::numbers("periodic.py", &arguments, &rows) else {
        return;
    };
    let ours = estimate(&signals, BAND_HZ, repetition(2)).unwrap().frf.data;
    assert_eq!(reference.len(), ours.len());
    for (row, datum) in reference.iter().zip(&ours) {
        let off =
            (datum.response.re - row[1]).hypot(datum.response.im - row[2]) / row[1].hypot(row[2]);
        // The FFT libraries differ by the rounding of the largest line, which is 1e3 times the smallest.
        assert!(
            datum.frequency_hz == row[0] && off < 1e-9,
            "{row:?}: {datum:?}"
        );
        assert!(
            (datum.variance / row[3] - 1.0).abs() < 1e-6,
            "{row:?}: {datum:?}"
        );
    }
}

#[test]
fn rejects_invalid_periods() {
    let signals = multisine(&lines(1), 8, 0.0, 1e-7, 4);
    let refused =
        |period, skip| estimate(&signals, BAND_HZ, Repetition { period, skip }).unwrap_err();
    for (period, skip) in [(0, 0), (1, 0), (7, 0), (8001, 0), (usize::MAX, 0)] {
        assert!(
            matches!(
                refused(period, skip),
                IdentifyError::Setting { name: "period", .. }
            ),
            "{period}"
        );
    }
    for (period, skip) in [(PERIOD, 4), (PERIOD, usize::MAX), (2000, 0), (8000, 0)] {
        assert!(
            matches!(refused(period, skip), IdentifyError::Periods { .. }),
            "{period} {skip}"
        );
    }
    // A band between two lines.
    assert!(estimate(&signals, (5.2, 5.8), repetition(0)).is_err());
}
