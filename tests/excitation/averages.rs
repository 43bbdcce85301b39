//! N repetitions of a chirp, or N times the periods of a multisine, reduce the error by sqrt(N).
use bench_experiment::Analysis;

use crate::excitation::rig::{SILENT, analysed, config, of_kind};

const SEEDS: u64 = 12;

/// RMS over frequencies and seeds of the relative error of |H|, and of its relative sigma. The reference is a run without noise.
fn errors(sets: &[&str], kind: (&str, &[&str])) -> (f64, f64) {
    let exact: Analysis = analysed(&of_kind(kind, &[sets, SILENT.as_slice()].concat()));
    let (mut error, mut sigma, mut count) = (0.0, 0.0, 0.0);
    for seed in 1..=SEEDS {
        let seed = format!("sim.seed={seed}");
        // Only white noise of the probe, large enough to dominate all other errors. Floor vibration consists of sinusoids that last
        // longer than the chirp takes to pass a frequency, and where the response is steep the estimator attributes a part of the
        // slope to noise.
        let analysis = analysed(&of_kind(
            kind,
            &[
                sets,
                &[seed.as_str(), "sim.floor=[]", "sim.probe_noise_rms_m=1e-6"],
            ]
            .concat(),
        ));
        assert_eq!(analysis.frf.frequency_hz, exact.frf.frequency_hz);
        for k in 0..exact.frf.len() {
            let size = exact.frf.response[k].norm();
            error += ((analysis.frf.response[k].norm() - size) / size).powi(2);
            sigma += (analysis.frf.magnitude_sigma[k] / size).powi(2);
            count += 1.0;
        }
    }
    ((error / count).sqrt(), (sigma / count).sqrt())
}

#[test]
fn four_repetitions_of_a_chirp_halve_error_and_sigma() {
    let sets = [
        "chirp.start_hz=40.0",
        "chirp.stop_hz=75.0",
        "chirp.duration_s=10.0",
        "chirp.fade_in_s=0.5",
    ];
    let errors_with = |n: &str| errors(&[&sets, [n].as_slice()].concat(), ("chirp", &[]));
    let (once, four) = (
        errors_with("chirp.repetitions=1"),
        errors_with("chirp.repetitions=4"),
    );
    // About 700 frequencies with 8 to 9 bins each are 80 independent ones. With 12 seeds the standard error of an RMS is
    // 1/sqrt(2 x 80 x 12) = 2.3 %, that of the ratio of two 3.2 %; the bounds are three times that.
    let (error, sigma) = (once.0 / four.0, once.1 / four.1);
    assert!(
        (1.8..2.2).contains(&error),
        "the error decreases by {error}: {once:?} {four:?}"
    );
    assert!(
        (1.8..2.2).contains(&sigma),
        "sigma decreases by {sigma}: {once:?} {four:?}"
    );
}

#[test]
fn four_times_the_periods_of_a_multisine_halve_error_and_sigma() {
    let sets = [
        "chirp.start_hz=40.0",
        "chirp.stop_hz=75.0",
        "multisine.period_s=4.0",
        "multisine.settle_periods=2",
    ];
    let errors_with = |n: &str| errors(&[&sets, [n].as_slice()].concat(), ("multisine", &[]));
    // One period is used for the drift: 8 and 32 periods are averaged.
    let (few, many) = (
        errors_with("multisine.periods=9"),
        errors_with("multisine.periods=33"),
    );
    // 141 lines and 12 seeds: the standard error of an RMS is 1.7 %, that of the ratio 2.4 %. A sigma from 8 periods gives the same.
    let (error, sigma) = (few.0 / many.0, few.1 / many.1);
    assert!(
        (1.85..2.15).contains(&error),
        "the error decreases by {error}: {few:?} {many:?}"
    );
    assert!(
        (1.85..2.15).contains(&sigma),
        "sigma decreases by {sigma}: {few:?} {many:?}"
    );
}

#[test]
fn one_repetition_equals_the_default_chirp() {
    let sets = ["chirp.duration_s=20.0", "chirp.start_hz=2.0"];
    let (plain, once) = (
        config(&sets),
        config(&[&sets, ["chirp.repetitions=1"].as_slice()].concat()),
    );
    assert_eq!(plain, once);
    assert_eq!(analysed(&plain).frf, analysed(&once).frf);
}
