use super::*;
use crate::Reference;
use bench_base::finding::Finding;

fn made(settings: &ReferenceSettings) -> Result<Box<dyn Reference>, ReferenceError> {
    let chirp = crate::test_profile::profile().chirp;
    let text = settings.design().text()?;
    settings.design().build(&ReferenceContext {
        chirp: &chirp,
        period_s: 1e-3,
        file: text.as_deref(),
    })
}

fn at(settings: ReferenceSettings, tick: u64) -> f64 {
    made(&settings).unwrap().at_m(tick)
}

#[test]
fn each_kind_has_its_analytic_values() {
    let step = ReferenceSettings::Step(StepReference {
        amplitude_m: -5e-5,
        at_s: 0.2,
    });
    assert_eq!((at(step.clone(), 199), at(step, 200)), (0.0, -5e-5));
    for amplitude_m in [4e-6, -4e-6] {
        let ramp = ReferenceSettings::Ramp(RampReference {
            amplitude_m,
            speed_m_per_s: 1e-4,
            at_s: 0.1,
        });
        let side = amplitude_m.signum();
        for (tick, expected) in [
            (0, 0.0),
            (100, 0.0),
            (120, 2e-6 * side),
            (140, 4e-6 * side),
            (1000, 4e-6 * side),
        ] {
            assert!((at(ramp.clone(), tick) - expected).abs() < 1e-18, "{tick}");
        }
    }
    let sine = ReferenceSettings::Sine(SineReference {
        amplitude_m: 1e-6,
        frequency_hz: 10.0,
    });
    assert!((at(sine, 25) - 1e-6).abs() < 1e-18);
    assert_eq!(at(ReferenceSettings::Hold(HoldReference {}), 7), 0.0);
}

#[test]
fn interpolates_linearly_between_the_points_of_a_file() {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(
        file.path(),
        "time_s,reference_m\n0,0\n0.01,1e-6\n0.02,1e-6\n",
    )
    .unwrap();
    let settings = ReferenceSettings::File(FileReference {
        path: file.path().display().to_string(),
    });
    for (tick, expected) in [(0, 0.0), (5, 5e-7), (10, 1e-6), (500, 1e-6)] {
        assert!(
            (at(settings.clone(), tick) - expected).abs() < 1e-18,
            "{tick}"
        );
    }
}

#[test]
fn rejects_an_unusable_file_with_its_line() {
    for (text, line) in [
        ("", 1),
        ("time_s,reference_m\n0,0\nx,1\n", 3),
        ("0,0\n0,1\n", 2),
        ("0,NaN\n", 1),
        ("0;1\n", 1),
    ] {
        let file = tempfile::NamedTempFile::new().unwrap();
        std::fs::write(file.path(), text).unwrap();
        let settings = ReferenceSettings::File(FileReference {
            path: file.path().display().to_string(),
        });
        let error = made(&settings).err().unwrap();
        assert!(
            matches!(error, ReferenceError::Line { line: l, .. } if l == line),
            "{text:?}: {error}"
        );
    }
    let missing = ReferenceSettings::File(FileReference {
        path: "/nonexistent".into(),
    });
    assert!(matches!(
        made(&missing),
        Err(ReferenceError::Unreadable { .. })
    ));
}

#[test]
fn square_changes_its_sign_every_half_period() {
    // Half a period of 2 Hz is 250 ticks of 1 ms.
    let settings = ReferenceSettings::Square(SquareReference {
        amplitude_m: 3e-6,
        frequency_hz: 2.0,
        at_s: 0.1,
    });
    let reference = made(&settings).unwrap();
    for (ticks, expected_m) in [
        (0..100, 0.0),
        (100..350, 3e-6),
        (350..600, -3e-6),
        (600..850, 3e-6),
    ] {
        assert!(
            ticks.clone().all(|tick| reference.at_m(tick) == expected_m),
            "{ticks:?}"
        );
    }
}

#[test]
fn square_of_a_half_period_between_ticks_keeps_its_frequency() {
    // 3 Hz: 6000 changes in 1000 s, the k-th at the first tick at or after k/6 s.
    let settings = ReferenceSettings::Square(SquareReference {
        amplitude_m: 1.0,
        frequency_hz: 3.0,
        at_s: 0.0,
    });
    let reference = made(&settings).unwrap();
    let changes: Vec<u64> = (1..=1_000_000)
        .filter(|tick| reference.at_m(*tick) != reference.at_m(tick - 1))
        .collect();
    let expected = (1..=6000u64).map(|k| (1000 * k).div_ceil(6));
    assert!(changes.iter().copied().eq(expected));
}

#[test]
fn triangle_has_a_slope_of_four_times_amplitude_times_frequency() {
    for amplitude_m in [5e-6, -5e-6] {
        let settings = ReferenceSettings::Triangle(TriangleReference {
            amplitude_m,
            frequency_hz: 2.0,
        });
        let reference = made(&settings).unwrap();
        // A quarter of a period is 125 ticks.
        for (tick, turns) in [(0, 0.0), (125, 1.0), (250, 0.0), (375, -1.0), (500, 0.0)] {
            assert!(
                (reference.at_m(tick) - turns * amplitude_m).abs() < 1e-18,
                "{tick}"
            );
        }
        let step_m = 4.0 * amplitude_m * 2.0 * 1e-3;
        for (tick, sign) in [(60, 1.0), (130, -1.0), (300, -1.0), (400, 1.0)] {
            let change_m = reference.at_m(tick + 1) - reference.at_m(tick);
            assert!(
                (change_m - sign * step_m).abs() < 1e-18,
                "{tick}: {change_m}"
            );
        }
    }
}

/// Largest magnitudes of speed, acceleration and jerk, as differences over a tick.
fn largest_differences(positions_m: &[f64], period_s: f64) -> [f64; 3] {
    let difference = |values: &[f64]| -> Vec<f64> {
        values
            .windows(2)
            .map(|pair| (pair[1] - pair[0]) / period_s)
            .collect()
    };
    let largest = |values: &[f64]| values.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
    let speed = difference(positions_m);
    let acceleration = difference(&speed);
    let jerk = difference(&acceleration);
    [largest(&speed), largest(&acceleration), largest(&jerk)]
}

#[test]
fn s_curve_reaches_its_limits_and_ends_at_its_height() {
    // Distance, limits of speed, acceleration and jerk; duration and the largest speed and acceleration by the closed forms.
    let cases = [
        // All limits: tj = 0.2, ta = 0.7, tv = 0.3.
        ([1.0, 1.0, 2.0, 10.0], 1.7, 1.0, 2.0),
        // Without the limit of the acceleration: tj = sqrt(0.01) = 0.1, ta = 0.2, tv = 9.8.
        ([1.0, 0.1, 2.0, 10.0], 10.2, 0.1, 1.0),
        // Without that of the speed: tj = 0.2, ta = 0.1 + sqrt(0.01 + 0.5).
        (
            [1.0, 10.0, 2.0, 10.0],
            0.2 + 2.0 * 0.51f64.sqrt(),
            2.0 * (0.51f64.sqrt() - 0.1),
            2.0,
        ),
        // With that of the jerk only: tj = cbrt(0.1/20), T = 4 tj.
        (
            [0.1, 10.0, 2.0, 10.0],
            4.0 * 0.005f64.cbrt(),
            10.0 * 0.005f64.cbrt().powi(2),
            10.0 * 0.005f64.cbrt(),
        ),
    ];
    for ([distance_m, speed, acceleration, jerk], duration_s, top_speed, top_acceleration) in cases
    {
        for sign in [1.0, -1.0] {
            let settings = SCurveReference {
                amplitude_m: sign * distance_m,
                speed_m_per_s: speed,
                acceleration_m_per_s2: acceleration,
                jerk_m_per_s3: jerk,
                at_s: 0.05,
            };
            assert!((settings.last_change_s() - 0.05 - duration_s).abs() < 1e-12);
            let reference = made(&ReferenceSettings::SCurve(settings)).unwrap();
            let positions_m: Vec<f64> = (0..11_000).map(|tick| reference.at_m(tick)).collect();
            let end = (1e3 * (0.05 + duration_s)).ceil() as usize;
            assert!(positions_m[..=50].iter().all(|x| *x == 0.0));
            assert!(
                positions_m[end..].iter().all(|x| *x == sign * distance_m),
                "exact end"
            );
            let [found_speed, found_acceleration, found_jerk] =
                largest_differences(&positions_m, 1e-3);
            // A difference is a mean over ticks: it is at most the largest value, and below it by at most a change over two
            // ticks. Positions up to 1 m rounded at 1e-16 give 8e-16/T^3 = 1e-6 in the jerk.
            assert!(
                found_speed <= top_speed * (1.0 + 1e-9)
                    && found_speed > top_speed - 2e-3 * top_acceleration
            );
            assert!(found_acceleration <= top_acceleration + 1e-8);
            assert!(
                found_acceleration > top_acceleration - 2e-3 * jerk,
                "{found_acceleration}"
            );
            assert!((found_jerk - jerk).abs() < 1e-5, "{found_jerk}");
        }
    }
}

fn random(frequency_hz: f64, seed: u64) -> RandomReference {
    RandomReference {
        amplitude_m: 4e-6,
        frequency_hz,
        period_s: 1.0,
        seed,
    }
}

fn random_period(settings: RandomReference) -> Vec<f64> {
    let reference = made(&ReferenceSettings::Random(settings)).unwrap();
    (0..1000).map(|tick| reference.at_m(tick)).collect()
}

#[test]
fn random_reference_keeps_its_peak_and_starts_at_zero() {
    for seed in 1..=20 {
        let values = random_period(random(40.0, seed));
        let peak_m = values.iter().fold(0.0, |a: f64, b| a.max(b.abs()));
        assert_eq!(values[0], 0.0);
        assert!((peak_m / 4e-6 - 1.0).abs() < 1e-12, "seed {seed}: {peak_m}");
    }
}

#[test]
fn random_reference_has_a_flat_spectrum_within_its_band_and_nothing_beyond() {
    let values = random_period(random(40.0, 3));
    let fft = realfft::RealFftPlanner::<f64>::new().plan_fft_forward(values.len());
    let (mut input, mut output) = (values, fft.make_output_vec());
    fft.process(&mut input, &mut output).unwrap();
    let sizes: Vec<f64> = output.iter().map(|line| line.norm()).collect();
    // Lines of 1 Hz. The first value is set from rounding, some 1e-15 of the peak, to zero.
    for (k, size) in sizes.iter().enumerate() {
        let expected = if (1..=40).contains(&k) { sizes[1] } else { 0.0 };
        assert!(
            (size - expected).abs() < 1e-11 * sizes[1],
            "line {k}: {size}"
        );
    }
}

#[test]
fn random_reference_repeats_and_depends_on_its_seed() {
    let reference = made(&ReferenceSettings::Random(random(40.0, 5))).unwrap();
    assert!((0..3000).all(|tick| reference.at_m(tick) == reference.at_m(tick + 1000)));
    assert_eq!(
        random_period(random(40.0, 5)),
        random_period(random(40.0, 5))
    );
    assert_ne!(
        random_period(random(40.0, 5)),
        random_period(random(40.0, 6))
    );
}

#[test]
fn rejects_references_beyond_their_limits() {
    let square = SquareReference {
        amplitude_m: 2e-3,
        frequency_hz: 500.0,
        at_s: 0.0,
    };
    let keys = |findings: Vec<Finding>| -> Vec<String> {
        findings.into_iter().map(|finding| finding.path).collect()
    };
    let (amplitude, frequency) = (
        "control.reference.amplitude_m",
        "control.reference.frequency_hz",
    );
    assert_eq!(keys(square.check(1e-3, 1000.0)), [amplitude, frequency]);
    assert!(square.check(3e-3, 1001.0).is_empty());
    let period = "control.reference.period_s";
    assert_eq!(
        keys(random(0.9, 1).check(1e-3, 1000.0)),
        [frequency],
        "no line"
    );
    assert!(random(1.0, 1).check(1e-3, 1000.0).is_empty());
    let long = RandomReference {
        period_s: 1001.0,
        ..random(1.0, 1)
    };
    assert_eq!(keys(long.check(1e-3, 1000.0)), [period], "too many ticks");
}

#[test]
fn each_kind_is_read_under_the_name_that_it_gives() {
    let hold = ReferenceSettings::Hold(HoldReference {});
    let sine = ReferenceSettings::Sine(SineReference {
        amplitude_m: 1e-6,
        frequency_hz: 10.0,
    });
    let s_curve = ReferenceSettings::SCurve(SCurveReference {
        amplitude_m: 1e-6,
        speed_m_per_s: 1e-4,
        acceleration_m_per_s2: 1e-2,
        jerk_m_per_s3: 1.0,
        at_s: 0.0,
    });
    let swept = ReferenceSettings::Chirp(SweptReference {
        amplitude: Vec::new(),
        travel_m: 1e-6,
    });
    for (settings, name) in [
        (hold, "hold"),
        (sine, "sine"),
        (s_curve, "s_curve"),
        (swept, "chirp"),
    ] {
        let table = serde_json::to_value(&settings).unwrap();
        assert_eq!((settings.kind(), &table["kind"]), (name, &name.into()));
        assert_eq!(
            serde_json::from_value::<ReferenceSettings>(table).unwrap(),
            settings
        );
    }
}
