//! Effects of the local model, the resolution and the frequency grid.

use bench_identify::{EstimatorSettings, Frf, LocalModel, ResolutionPoint, Signals, local};

use crate::identify::stage::{self, Dice, RATE_HZ, SampledPlant};

/// Modes R, u and v in hertz.
const PEAKS_HZ: [f64; 3] = [29.27, 82.23, 85.78];

fn settings(curve: LocalModel) -> EstimatorSettings {
    EstimatorSettings {
        curve,
        ..EstimatorSettings::default()
    }
}

/// A chirp of ten seconds on the stage. The bins are 1/20 Hz wide; the half-power width of mode R is ten bins.
fn ten_seconds() -> Signals {
    let input_a = stage::chirp_of(10.0, 1.0, 9.0);
    let output_m = SampledPlant::stage().simulate(&input_a);
    Signals {
        rate_hz: RATE_HZ,
        input: input_a,
        output: output_m,
    }
}

/// The largest relative error within a half-power width of the peaks.
fn largest_error_at_peaks(frf: &Frf) -> f64 {
    let plant = SampledPlant::stage();
    let near = |f: &f64| PEAKS_HZ.iter().any(|peak| (f / peak - 1.0).abs() < 0.008);
    let at_peaks = frf
        .frequency_hz
        .iter()
        .zip(&frf.response)
        .filter(|(f, _)| near(f));
    at_peaks
        .map(|(f, h)| (h / plant.response(*f) - 1.0).norm())
        .fold(0.0, f64::max)
}

/// The neighbourhood extends 0.8 Hz to either side, and zeta f0 is 0.26 Hz: a local constant averages over the whole peak.
#[test]
fn only_the_rational_model_resolves_the_peaks_of_a_ten_second_record() {
    let off = |curve| {
        largest_error_at_peaks(
            &local::estimate(&ten_seconds(), (10.0, 120.0), &settings(curve)).unwrap(),
        )
    };
    let [constant, polynomial, rational] = [
        LocalModel::Constant,
        LocalModel::Polynomial,
        LocalModel::Rational,
    ]
    .map(off);
    println!("constant {constant:.4}, polynomial {polynomial:.4}, rational {rational:.6}");
    assert!(rational < 0.005, "{rational}");
    assert!(
        polynomial > 0.1 && constant > polynomial,
        "{polynomial} {constant}"
    );
}

#[test]
fn peaks_of_a_noisy_ten_second_record_are_within_two_sigma() {
    let (clean, plant) = (ten_seconds(), SampledPlant::stage());
    let (mut covered, mut count, mut worst) = (0.0, 0.0, 0.0_f64);
    for seed in 1..=40 {
        let frf = local::estimate(
            &stage::with_noise(&clean, seed),
            (10.0, 120.0),
            &settings(LocalModel::Rational),
        )
        .unwrap();
        for (k, f) in frf.frequency_hz.iter().enumerate() {
            if PEAKS_HZ.iter().any(|peak| (f / peak - 1.0).abs() < 0.008) {
                let truth = plant.response(*f).norm();
                covered += f64::from(
                    (frf.response[k].norm() - truth).abs() <= 2.0 * frf.magnitude_sigma[k],
                );
                count += 1.0;
                worst = worst.max((frf.response[k].norm() / truth - 1.0).abs());
            }
        }
    }
    println!(
        "within two sigma {:.4} of {count}, off by up to {worst:.4}",
        covered / count
    );
    assert!(
        (0.90..0.995).contains(&(covered / count)),
        "{}",
        covered / count
    );
    assert!(worst < 0.02, "{worst}");
}

/// The pole of the rational model increases the variance, so that it must not be used where the response is smooth. Fisher's F-test
/// accepts it wrongly with a probability of 0.001.
#[test]
fn rational_model_equals_the_parabola_away_from_modes() {
    let mut dice = Dice::new(8);
    let input_a: Vec<f64> = (0..20_000).map(|_| dice.normal()).collect();
    let output_m = input_a
        .iter()
        .map(|u| 1e-4 * (u + 0.3 * dice.normal()))
        .collect();
    let signals = Signals {
        rate_hz: 1000.0,
        input: input_a,
        output: output_m,
    };
    let [parabola, rational] = [LocalModel::Polynomial, LocalModel::Rational]
        .map(|curve| local::estimate(&signals, (10.0, 490.0), &settings(curve)).unwrap());
    let same = parabola
        .response
        .iter()
        .zip(&rational.response)
        .filter(|(a, b)| a == b)
        .count() as f64;
    let share = same / parabola.len() as f64;
    assert!(share > 0.985 && share <= 1.0, "{share}");
}

#[test]
fn logarithmic_grid_covers_the_band_at_a_constant_ratio() {
    let settings = EstimatorSettings {
        frequencies: Some(2000),
        ..EstimatorSettings::default()
    };
    let frf = local::estimate(&stage::clean_run(), (0.5, 450.0), &settings).unwrap();
    assert_eq!(frf.len(), 2000);
    let ratio = 900_f64.powf(1.0 / 1999.0);
    for (k, f) in frf.frequency_hz.iter().enumerate() {
        assert!(
            (f / (0.5 * ratio.powi(k as i32)) - 1.0).abs() < 1e-9,
            "{f} Hz is number {k}"
        );
    }
    // The frequencies need not be those of bins.
    let plant = SampledPlant::stage();
    let off = frf
        .frequency_hz
        .iter()
        .zip(&frf.response)
        .map(|(f, h)| (h / plant.response(*f) - 1.0).norm());
    assert!(off.fold(0.0, f64::max) < 0.001);
}

/// The noise bandwidth of cos^2 weights is 4/3 of the half-width; the ripple of the chirp's spectrum changes it by up to 5 %.
#[test]
fn half_widths_are_interpolated_between_the_points_of_the_list() {
    let point = |frequency_hz, half_width_hz| ResolutionPoint {
        frequency_hz,
        half_width_hz,
    };
    let resolution = vec![point(2.0, 0.5), point(50.0, 0.5), point(200.0, 8.0)];
    let settings = EstimatorSettings {
        resolution,
        frequencies: Some(50),
        ..settings(LocalModel::Constant)
    };
    let frf = local::estimate(&stage::clean_run(), (1.5, 400.0), &settings).unwrap();
    for (f, width) in frf.frequency_hz.iter().zip(&frf.resolution_hz) {
        let half_width_hz = match f {
            f if *f < 50.0 => 0.5,
            // The half-width rises from 0.5 to 8 Hz while the frequency rises by 4: proportional to f^2.
            f if *f < 200.0 => 0.5 * (f / 50.0).powi(2),
            _ => 8.0,
        };
        assert!(
            (width / (4.0 / 3.0 * half_width_hz) - 1.0).abs() < 0.05,
            "{width} at {f} Hz"
        );
    }
}

#[test]
fn rejects_half_widths_whose_frequencies_do_not_rise() {
    let point = ResolutionPoint {
        frequency_hz: 10.0,
        half_width_hz: 0.5,
    };
    let settings = EstimatorSettings {
        resolution: vec![point, point],
        ..EstimatorSettings::default()
    };
    let error = local::estimate(&stage::clean_run(), (1.0, 400.0), &settings).unwrap_err();
    assert!(
        error.to_string().contains("resolution.frequency_hz is 10"),
        "{error}"
    );
}

/// Twenty seconds from the middle of sixty seconds of white noise. The transients at both ends leak into the whole band.
#[test]
fn transient_model_removes_leakage_of_a_record_cut_from_a_longer_one() {
    let mut dice = Dice::new(6);
    let input_a: Vec<f64> = (0..300_000).map(|_| 0.1 * dice.normal()).collect();
    let plant = SampledPlant::stage();
    let output_m = plant.simulate(&input_a);
    let middle = 100_000..200_000;
    let cut = Signals {
        rate_hz: RATE_HZ,
        input: input_a[middle.clone()].to_vec(),
        output: output_m[middle].to_vec(),
    };
    let off = |transient| {
        let settings = EstimatorSettings {
            transient,
            ..EstimatorSettings::default()
        };
        let frf = local::estimate(&cut, (10.0, 70.0), &settings).unwrap();
        let off = frf
            .frequency_hz
            .iter()
            .zip(&frf.response)
            .map(|(f, h)| (h / plant.response(*f) - 1.0).norm());
        let mut off: Vec<f64> = off.collect();
        off.sort_by(f64::total_cmp);
        off[off.len() / 2]
    };
    let (with, without) = (off(true), off(false));
    println!("with {with:.6}, without {without:.6}");
    assert!(with < 0.1 * without && with < 0.002, "{with} {without}");
}
