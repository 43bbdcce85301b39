//! The CSV file of a frequency response.

use bench_base::atomic_file::write_atomic;
use bench_identify::frf_csv::{self, METRES_PER_AMPERE};
use bench_identify::{EstimatorSettings, Frf, FrfPoint, local};
use nalgebra::Complex;

use crate::identify::stage;

fn frf(responses: &[(f64, f64)]) -> Frf {
    let mut frf = Frf::default();
    for (k, (re, im)) in responses.iter().enumerate() {
        frf.push(FrfPoint {
            frequency_hz: (k + 1) as f64 / 3.0,
            response: Complex::new(*re, *im),
            coherence: 0.75,
            variance: 2e-14,
            resolution_hz: 0.1,
        });
    }
    frf
}

#[test]
fn file_has_the_documented_header_and_one_row_per_frequency() {
    let text = frf_csv::to_string(&frf(&[(0.0, -2e-4), (1e-4, 0.0)]), METRES_PER_AMPERE);
    let lines: Vec<&str> = text.lines().collect();
    assert_eq!(
        lines[0],
        "frequency_hz,magnitude_m_per_a,phase_deg,coherence,magnitude_sigma,phase_sigma_deg,resolution_hz"
    );
    // sigma(|H|) = sqrt(2e-14 / 2) = 1e-7, over |H| = 2e-4: 0.0005 rad.
    let row: Vec<f64> = lines[1]
        .split(',')
        .map(|field| field.parse().unwrap())
        .collect();
    assert_eq!(row[..4], [1.0 / 3.0, 2e-4, -90.0, 0.75]);
    assert!(
        (row[4] / 1e-7 - 1.0).abs() < 1e-12
            && (row[5] / 0.0005_f64.to_degrees() - 1.0).abs() < 1e-12
    );
    assert_eq!((row[6], lines.len()), (0.1, 3));
}

#[test]
fn phases_are_wrapped_to_above_minus_180_up_to_180_degrees() {
    let text = frf_csv::to_string(
        &frf(&[(-1e-4, -0.0), (-1e-4, 0.0), (-1e-4, -1e-9), (1e-4, 0.0)]),
        METRES_PER_AMPERE,
    );
    let phases: Vec<f64> = text
        .lines()
        .skip(1)
        .map(|line| line.split(',').nth(2).unwrap().parse().unwrap())
        .collect();
    assert_eq!((phases[0], phases[1], phases[3]), (180.0, 180.0, 0.0));
    assert!((-180.0..-179.9).contains(&phases[2]));
}

#[test]
fn measured_response_is_unchanged_after_writing_and_reading() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("frf.csv");
    let signals = stage::with_noise(&stage::clean_run(), 1);
    let frf = local::estimate(&signals, (0.5, 450.0), &EstimatorSettings::default()).unwrap();
    write_atomic(&path, &frf_csv::to_string(&frf, METRES_PER_AMPERE)).unwrap();
    let back = frf_csv::read(&path).unwrap();
    let exact = |frf: &Frf| {
        (
            frf.frequency_hz.clone(),
            frf.coherence.clone(),
            frf.magnitude_sigma.clone(),
            frf.resolution_hz.clone(),
        )
    };
    assert_eq!(exact(&back), exact(&frf));
    for k in 0..frf.len() {
        // The file has magnitude and degrees: a few roundings of 1.1e-16 at angles up to pi rad.
        assert!((back.response[k] / frf.response[k] - 1.0).norm() < 2e-15);
        assert!((back.phase_sigma_rad[k] / frf.phase_sigma_rad[k] - 1.0).abs() < 1e-15);
    }
}

#[test]
fn replaces_an_existing_file_as_a_whole() {
    let directory = tempfile::tempdir().unwrap();
    let path = directory.path().join("frf.csv");
    let (first, second) = (frf(&[(1e-4, 0.0), (2e-4, 0.1)]), frf(&[(2e-4, 0.0)]));
    for frf in [&first, &second] {
        write_atomic(&path, &frf_csv::to_string(frf, METRES_PER_AMPERE)).unwrap();
    }
    assert_eq!(frf_csv::read(&path).unwrap().len(), second.len());
    let files = std::fs::read_dir(directory.path()).unwrap().count();
    assert_eq!(files, 1, "no partial file is left");
}

#[test]
fn rejects_other_columns_and_invalid_rows_with_their_line() {
    let error = frf_csv::from_str("frequency_hz,magnitude\n1,2\n").unwrap_err();
    assert!(
        error.to_string().contains("frequency_hz,magnitude_m_per_a"),
        "{error}"
    );
    for row in [
        "1,2,3",
        "1,NaN,3,4,5,6,7",
        "0.1,2,3,4,5,6,7",
        "1,2,3,4,5,6,seven",
        "1,2,3,4,5,6,7,8",
    ] {
        let text = format!("{}\n0.5,1e-4,0,1,1e-7,0.1,0.1\n{row}\n", frf_csv::HEADER);
        let error = frf_csv::from_str(&text).unwrap_err().to_string();
        assert!(error.contains("line 3") && error.contains(row), "{error}");
    }
}

/// The delay is a quarter of the period of the first frequency.
#[test]
fn removing_a_delay_changes_phases_only() {
    let delayed = frf(&[(0.0, -2e-4), (1e-4, 0.0)]);
    let delay_s = 0.25 / delayed.frequency_hz[0];
    let undelayed = delayed.without_delay(delay_s);
    assert!((undelayed.response[0] - Complex::new(2e-4, 0.0)).norm() < 1e-18);
    let turns = delayed.frequency_hz[1] * delay_s;
    let expected = delayed.response[1] * Complex::from_polar(1.0, std::f64::consts::TAU * turns);
    assert!((undelayed.response[1] - expected).norm() < 1e-18);
    assert_eq!(
        (undelayed.magnitude_sigma, undelayed.coherence),
        (delayed.magnitude_sigma, delayed.coherence)
    );
}
