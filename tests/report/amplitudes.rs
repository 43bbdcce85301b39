//! The overview of runs at several amplitudes.

use std::f64::consts::TAU;

use bench_config::{Source, load};
use bench_experiment::linearity::{ModeOverAmplitude, compare_modes};
use bench_experiment::outputs::{AnalysisOutputs, ExistingFile, ResultFiles};
use bench_identify::modal::{Estimate, FittedMode};
use bench_report::run_pages::AmplitudeFiles;
use bench_report::{AmplitudeOverview, ReportError, amplitudes_svg};

use crate::report::svg;

const SCALES: [f64; 3] = [0.25, 0.5, 1.0];

fn estimate(value: f64) -> Estimate {
    Estimate {
        value,
        sigma: 1e-3 * value,
    }
}

/// Modes in an excited band of 5 to 200 Hz, whose frequencies rise by 1 % at the last amplitude.
fn modes(frequencies_hz: &[f64]) -> Vec<ModeOverAmplitude> {
    let fitted = |omega_rad_s: f64| FittedMode {
        omega_rad_s: estimate(omega_rad_s),
        damping_ratio: estimate(0.005),
        residue_per_kg: estimate(0.5),
        residue_imaginary_per_kg: None,
        turned_by_one_more: 0.0,
    };
    let run = |ratio: f64| {
        frequencies_hz
            .iter()
            .map(|hz| fitted(TAU * ratio * hz))
            .collect()
    };
    compare_modes(&[1.0, 1.0, 1.01].map(run), (5.0, 200.0), true).modes
}

fn drawn(scales: &[f64], modes: &[ModeOverAmplitude]) -> Result<String, ReportError> {
    let overview = AmplitudeOverview {
        scales,
        modes,
        linearity: &vec![None; scales.len()],
    };
    amplitudes_svg(&overview, "Stage", "")
}

#[test]
fn shows_the_modes_of_the_excited_band_only() {
    let svg = drawn(&SCALES, &modes(&[2.5, 29.27, 85.8, 281.0])).unwrap();
    let words: Vec<String> = svg::words(&svg).into_iter().map(|w| w.text).collect();
    let is_shown = |frequency: &str| {
        let name = format!("mode at {frequency} (band: 95 %)");
        words.contains(&name)
    };
    let shown = ["2.500 Hz", "29.27 Hz", "85.80 Hz", "281.0 Hz"].map(is_shown);
    assert_eq!(shown, [false, true, true, false], "{words:?}");
    assert!(!svg.contains("NaN") && !svg.contains("inf"));
}

/// A deviation of 1 % at the last amplitude needs an axis with this number.
#[test]
fn deviations_are_in_percent_of_the_value_at_the_smallest_amplitude() {
    let svg = drawn(&SCALES, &modes(&[29.27])).unwrap();
    let words = svg::words(&svg);
    let label = words.iter().find(|w| w.text == "Frequency: deviation (%)");
    assert!(label.is_some());
    // From 0 to 1 %: ticks at multiples of 0.2.
    for tick in ["0.2", "0.4", "0.6", "0.8"] {
        assert!(words.iter().any(|w| w.text == tick), "{tick}");
    }
}

#[test]
fn rejects_no_amplitudes() {
    assert_eq!(drawn(&[], &[]), Err(ReportError::NoTrace));
}

#[test]
fn overview_is_null_unless_two_runs_were_analysed() {
    let folder = tempfile::tempdir().unwrap();
    let results = ResultFiles {
        beside: &folder.path().join("run.mcap"),
        existing: ExistingFile::Replace,
    };
    let failed = AnalysisOutputs::run_incomplete();
    let config = load(&Source::default()).unwrap();
    for runs in [&[][..], &[(0.5, &failed), (1.0, &failed)]] {
        let files = AmplitudeFiles::write(runs, &modes(&[29.27]), &config, results).unwrap();
        assert!(files.is_none());
    }
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
